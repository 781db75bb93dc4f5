package ruedo;

/**
 * The pose of a frame B in a frame A: transforms points of B to A. Immutable. If a is B in A and b
 * is C in B, a.compose(b) is C in A, and a.inverse() is A in B.
 */
public final class Transform {
    private final double[] position;
    private final double[] orientation;

    /** position: x, y, z (m); orientation: a unit quaternion w, x, y, z. */
    public Transform(double[] position, double[] orientation) {
        if (position.length != 3 || orientation.length != 4)
            throw new IllegalArgumentException(
                    "a Transform has a position of 3 numbers and an orientation of 4");
        this.position = position.clone();
        this.orientation = orientation.clone();
    }

    /** A transform on the ground from m, m and rad, counter-clockwise from the x axis. */
    public static Transform of(double x, double y, double heading) {
        return new Transform(
                new double[] {x, y, 0.0},
                new double[] {Math.cos(heading / 2.0), 0.0, 0.0, Math.sin(heading / 2.0)});
    }

    /** The equal angle in [-pi, pi), rad. */
    public static double normalizeAngle(double angle) {
        double turned = (angle + Math.PI) % (2.0 * Math.PI);
        return (turned < 0.0 ? turned + 2.0 * Math.PI : turned) - Math.PI;
    }

    /** m. */
    public double x() {
        return position[0];
    }

    /** m. */
    public double y() {
        return position[1];
    }

    /** m. */
    public double z() {
        return position[2];
    }

    /** x, y, z (m). */
    public double[] position() {
        return position.clone();
    }

    /** w, x, y, z. */
    public double[] orientation() {
        return orientation.clone();
    }

    /** rad, counter-clockwise from A's x axis, in (-pi, pi]. */
    public double heading() {
        double w = orientation[0], x = orientation[1], y = orientation[2], z = orientation[3];
        return Math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
    }

    /** A in B. */
    public Transform inverse() {
        double[] back = {orientation[0], -orientation[1], -orientation[2], -orientation[3]};
        double[] there = rotated(back, position);
        return new Transform(new double[] {-there[0], -there[1], -there[2]}, back);
    }

    /** other: C in B. Returns C in A. */
    public Transform compose(Transform other) {
        double w = orientation[0], x = orientation[1], y = orientation[2], z = orientation[3];
        double[] o = other.orientation;
        return new Transform(
                apply(other.position),
                new double[] {
                    w * o[0] - x * o[1] - y * o[2] - z * o[3],
                    w * o[1] + x * o[0] + y * o[3] - z * o[2],
                    w * o[2] - x * o[3] + y * o[0] + z * o[1],
                    w * o[3] + x * o[2] - y * o[1] + z * o[0]
                });
    }

    /** Transforms a point of B (m) to A. */
    public double[] apply(double... point) {
        double[] turned =
                rotated(
                        orientation,
                        new double[] {point[0], point[1], point.length > 2 ? point[2] : 0.0});
        for (int i = 0; i < 3; ++i) turned[i] += position[i];
        return turned;
    }

    /** v + 2 w (u x v) + 2 u x (u x v), of the unit quaternion w, u. */
    private static double[] rotated(double[] q, double[] v) {
        double[] once = cross(q, v);
        double[] twice = cross(q, once);
        double[] turned = new double[3];
        for (int i = 0; i < 3; ++i) turned[i] = v[i] + 2.0 * (q[0] * once[i] + twice[i]);
        return turned;
    }

    private static double[] cross(double[] q, double[] v) {
        return new double[] {
            q[2] * v[2] - q[3] * v[1], q[3] * v[0] - q[1] * v[2], q[1] * v[1] - q[2] * v[0]
        };
    }

    @Override
    public String toString() {
        return String.format(
                java.util.Locale.ROOT,
                "Transform(x, y, z, heading: %.6g, %.6g, %.6g, %.6g)",
                x(),
                y(),
                z(),
                heading());
    }
}
