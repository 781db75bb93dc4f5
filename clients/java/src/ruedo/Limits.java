package ruedo;

/**
 * Limits of a primitive: m/s and m/s^2, for turns on the spot rad/s and rad/s^2. 0: the robot's
 * own.
 */
public final class Limits {
    /** The robot's own. */
    public static final Limits NONE = new Limits(0.0, 0.0, 0.0);

    final double speed;
    final double acceleration;
    final double deceleration;

    /** Finite numbers >= 0, else IllegalArgumentException. */
    public Limits(double speed, double acceleration, double deceleration) {
        this.speed = check("speed", speed);
        this.acceleration = check("acceleration", acceleration);
        this.deceleration = check("deceleration", deceleration);
    }

    private static double check(String name, double value) {
        if (Double.isFinite(value) && value >= 0.0) return value;
        throw new IllegalArgumentException(
                name
                        + " is "
                        + value
                        + ": it must be a finite number >= 0; 0 is the robot's own limit");
    }
}
