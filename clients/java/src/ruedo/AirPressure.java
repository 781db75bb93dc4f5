package ruedo;

/** A barometer. */
public final class AirPressure extends Sample {
    /** Pa. */
    public final double pressure;

    AirPressure(long utime, double pressure) {
        super(utime);
        this.pressure = pressure;
    }
}
