package ruedo;

import java.util.List;

/** A bumper. */
public final class Contact extends Sample {
    /** True when anything is touched. */
    public final boolean pressed;

    /** Where. */
    public final List<Point> points;

    Contact(long utime, boolean pressed, List<Point> points) {
        super(utime);
        this.pressed = pressed;
        this.points = points;
    }

    /** One point at which something is touched. */
    public static final class Point {
        /** The other body. */
        public final String body;

        /** m, world. */
        public final double[] position;

        /** Unit vector, world, towards the sensor's body. */
        public final double[] normal;

        /** N. */
        public final double force;

        /** m. */
        public final double depth;

        Point(String body, double[] position, double[] normal, double force, double depth) {
            this.body = body;
            this.position = position;
            this.normal = normal;
            this.force = force;
            this.depth = depth;
        }
    }
}
