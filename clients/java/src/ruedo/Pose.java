package ruedo;

/** The true pose of base_link in the world; velocities are expressed in base_link. */
public final class Pose extends Sample {
    /** x, y, z, m. */
    public final double[] position;

    /** w, x, y, z. */
    public final double[] orientation;

    /** m/s. */
    public final double[] velocity;

    /** rad/s. */
    public final double[] rotationRate;

    /** m/s^2, without gravity. */
    public final double[] acceleration;

    Pose(
            long utime,
            double[] position,
            double[] orientation,
            double[] velocity,
            double[] rotationRate,
            double[] acceleration) {
        super(utime);
        this.position = position;
        this.orientation = orientation;
        this.velocity = velocity;
        this.rotationRate = rotationRate;
        this.acceleration = acceleration;
    }

    /** m. */
    public double x() {
        return position[0];
    }

    /** m. */
    public double y() {
        return position[1];
    }

    /** rad, counter-clockwise from the world's x axis, in (-pi, pi]. */
    public double heading() {
        double w = orientation[0], x = orientation[1], y = orientation[2], z = orientation[3];
        return Math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
    }
}
