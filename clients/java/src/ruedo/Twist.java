package ruedo;

/** A velocity, linear and angular, in the world. */
public final class Twist {
    /** x, y, z, m/s. */
    public final double[] linear;

    /** About x, y, z, rad/s. */
    public final double[] angular;

    /** Both of three numbers, m/s and rad/s. */
    public Twist(double[] linear, double[] angular) {
        this.linear = linear.clone();
        this.angular = angular.clone();
    }
}
