package ruedo;

import java.util.Map;

/** A joint of a robot, from {@link Robot#joint}. Thread safe. */
public final class Joint {
    /** Its name in the file. */
    public final String name;

    /** "revolute", "continuous", "prismatic", ... */
    public final String kind;

    /** rad or m; -inf: no limit. */
    public final double lower;

    /** rad or m; +inf: no limit. */
    public final double upper;

    /** rad/s or m/s; +inf: no limit. */
    public final double maxVelocity;

    /** N m or N; +inf: no limit. */
    public final double maxEffort;

    /** Whether it takes commands: not a joint that mimics another, a gearbox or a ball joint. */
    public final boolean takesCommands;

    /**
     * Whether the file has a controller, a transmission or a servo for it: then it holds its
     * position until its first command. Other joints are free until then.
     */
    public final boolean holds;

    private final Robot robot;

    Joint(Robot robot, JointLimits limits, int index) {
        this.robot = robot;
        name = limits.names.get(index);
        kind = limits.kinds.get(index);
        lower = limits.lower[index];
        upper = limits.upper[index];
        maxVelocity = limits.maxVelocities[index];
        maxEffort = limits.maxEfforts[index];
        takesCommands = limits.takesCommands[index];
        holds = limits.holds[index];
    }

    /** rad or m, of the newest sample. */
    public double position() {
        return robot.joints().latest().position(name);
    }

    /** rad/s or m/s, of the newest sample. */
    public double velocity() {
        return robot.joints().latest().velocity(name);
    }

    /** N m or N, of its motor, of the newest sample. */
    public double effort() {
        return robot.joints().latest().effort(name);
    }

    /**
     * Commands a position (rad or m) within its limits, which it holds until its next command.
     * Throws NotSupported in lockstep.
     */
    public void setPosition(double value) {
        robot.commandJoints(Map.of(name, value), JointMode.POSITION);
    }

    /** The same with a velocity, rad/s or m/s. */
    public void setVelocity(double value) {
        robot.commandJoints(Map.of(name, value), JointMode.VELOCITY);
    }

    /** The same with an effort, N m or N. */
    public void setEffort(double value) {
        robot.commandJoints(Map.of(name, value), JointMode.EFFORT);
    }

    @Override
    public String toString() {
        return robot.name + "/" + name + ": " + kind;
    }
}
