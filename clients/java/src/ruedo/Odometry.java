package ruedo;

/** What the robot believes of its motion from its wheels; pose of base_link in the frame odom. */
public final class Odometry extends Sample {
    /** m. */
    public final double x;

    /** m. */
    public final double y;

    /** rad, not wrapped. */
    public final double theta;

    /** m/s. */
    public final double v;

    /** rad/s. */
    public final double omega;

    /** rad since the start, positive ahead; order of {@link Robot#wheels}. */
    public final double[] wheelAngles;

    /** rad/s. */
    public final double[] wheelRates;

    /** Encoder counts. */
    public final long[] ticks;

    /** How often the pose was reset. */
    public final int resets;

    Odometry(
            long utime,
            double x,
            double y,
            double theta,
            double v,
            double omega,
            double[] wheelAngles,
            double[] wheelRates,
            long[] ticks,
            int resets) {
        super(utime);
        this.x = x;
        this.y = y;
        this.theta = theta;
        this.v = v;
        this.omega = omega;
        this.wheelAngles = wheelAngles;
        this.wheelRates = wheelRates;
        this.ticks = ticks;
        this.resets = resets;
    }
}
