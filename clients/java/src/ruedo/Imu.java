package ruedo;

/** An inertial measurement unit, in the device's frame. */
public final class Imu extends Sample {
    /** w, x, y, z: device to world. */
    public final double[] orientation;

    /** rad/s. */
    public final double[] angularVelocity;

    /** m/s^2, specific force: at rest gravity upwards. */
    public final double[] linearAcceleration;

    Imu(long utime, double[] orientation, double[] angularVelocity, double[] linearAcceleration) {
        super(utime);
        this.orientation = orientation;
        this.angularVelocity = angularVelocity;
        this.linearAcceleration = linearAcceleration;
    }
}
