package ruedo;

/** The last reading of each of an array's transducers; their poses are the device's elements. */
public final class SonarReading extends Sample {
    /** m from the transducer's face; without an echo: the maximum range. */
    public final float[] ranges;

    /** us of sim time at which each fired last; -1: not yet. */
    public final long[] firedUtime;

    /** True where the reading is of this very message. */
    public final boolean[] fresh;

    SonarReading(long utime, float[] ranges, long[] firedUtime, boolean[] fresh) {
        super(utime);
        this.ranges = ranges;
        this.firedUtime = firedUtime;
        this.fresh = fresh;
    }
}
