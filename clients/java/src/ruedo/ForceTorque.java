package ruedo;

/** In a joint: what the child puts on the parent, unless the world file says otherwise. */
public final class ForceTorque extends Sample {
    /** N. */
    public final double[] force;

    /** N m, about the joint's origin. */
    public final double[] torque;

    ForceTorque(long utime, double[] force, double[] torque) {
        super(utime);
        this.force = force;
        this.torque = torque;
    }
}
