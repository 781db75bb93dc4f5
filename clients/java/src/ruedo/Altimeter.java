package ruedo;

/** Height above where the device was at the start. */
public final class Altimeter extends Sample {
    /** m. */
    public final double altitude;

    /** m/s, upwards. */
    public final double velocity;

    Altimeter(long utime, double altitude, double velocity) {
        super(utime);
        this.altitude = altitude;
        this.velocity = velocity;
    }
}
