package ruedo;

/** What a robot is executing. */
public final class MotionStatus extends Sample {
    /** Of the primitive; 0 for velocity and wheel commands. */
    public final long id;

    /** "none", "advance", "rotate", "heading", "arc", "stop", "velocity", "wheels". */
    public final String kind;

    /** "idle", "running", "done", "ended", "refused". */
    public final String state;

    /**
     * "", "replaced", "blocked", "watchdog", "not finite", "bad kind", "bad value", "no drive",
     * "not possible".
     */
    public final String reason;

    /** m or rad done. */
    public final double progress;

    /** m or rad. */
    public final double remaining;

    /** m/s. */
    public final double v;

    /** rad/s. */
    public final double omega;

    MotionStatus(
            long utime,
            long id,
            String kind,
            String state,
            String reason,
            double progress,
            double remaining,
            double v,
            double omega) {
        super(utime);
        this.id = id;
        this.kind = kind;
        this.state = state;
        this.reason = reason;
        this.progress = progress;
        this.remaining = remaining;
        this.v = v;
        this.omega = omega;
    }
}
