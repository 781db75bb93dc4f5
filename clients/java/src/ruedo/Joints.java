package ruedo;

import java.util.List;

/** The joints of a robot. */
public final class Joints extends Sample {
    /** As in the model. */
    public final List<String> names;

    /** rad or m. */
    public final float[] positions;

    /** rad/s or m/s. */
    public final float[] velocities;

    /** N m or N. */
    public final float[] efforts;

    Joints(long utime, List<String> names, float[] positions, float[] velocities, float[] efforts) {
        super(utime);
        this.names = names;
        this.positions = positions;
        this.velocities = velocities;
        this.efforts = efforts;
    }
}
