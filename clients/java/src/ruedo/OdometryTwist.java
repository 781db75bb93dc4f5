package ruedo;

/**
 * What the robot believes of its velocity from its wheels, in base_link; comes with each {@link
 * Odometry}.
 */
public final class OdometryTwist extends Sample {
    /** m/s, ahead. */
    public final double vx;

    /** m/s, to the left. */
    public final double vy;

    /** rad/s. */
    public final double omega;

    /** Of (vx, vy, omega), 3 x 3 by rows; 0: ideal encoders. */
    public final double[] covariance;

    OdometryTwist(long utime, double vx, double vy, double omega, double[] covariance) {
        super(utime);
        this.vx = vx;
        this.vy = vy;
        this.omega = omega;
        this.covariance = covariance;
    }
}
