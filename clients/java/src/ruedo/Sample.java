package ruedo;

/** A measurement of a device. SI units, radians; x ahead, y left, z up; quaternions w, x, y, z. */
public abstract class Sample {
    /** us, sim time of the state shown. */
    public final long utime;

    Sample(long utime) {
        this.utime = utime;
    }

    /** Sim time, s. */
    public double time() {
        return utime * 1e-6;
    }
}
