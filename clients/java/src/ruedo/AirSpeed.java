package ruedo;

/** A Pitot tube along the device's x axis. */
public final class AirSpeed extends Sample {
    /** Pa, total less static; negative: from behind. */
    public final double differentialPressure;

    /** K, of the air. */
    public final double temperature;

    AirSpeed(long utime, double differentialPressure, double temperature) {
        super(utime);
        this.differentialPressure = differentialPressure;
        this.temperature = temperature;
    }
}
