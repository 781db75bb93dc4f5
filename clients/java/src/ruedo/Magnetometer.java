package ruedo;

/** The magnetic field. */
public final class Magnetometer extends Sample {
    /** T, in the device's frame. */
    public final double[] field;

    Magnetometer(long utime, double[] field) {
        super(utime);
        this.field = field;
    }
}
