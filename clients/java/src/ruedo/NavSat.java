package ruedo;

/** Satellite navigation (GPS). */
public final class NavSat extends Sample {
    /** Degrees, north is positive. */
    public final double latitudeDeg;

    /** Degrees, east is positive. */
    public final double longitudeDeg;

    /** m above the ellipsoid. */
    public final double altitude;

    /** m/s, to the east, to the north, upwards. */
    public final double[] velocity;

    NavSat(
            long utime,
            double latitudeDeg,
            double longitudeDeg,
            double altitude,
            double[] velocity) {
        super(utime);
        this.latitudeDeg = latitudeDeg;
        this.longitudeDeg = longitudeDeg;
        this.altitude = altitude;
        this.velocity = velocity;
    }
}
