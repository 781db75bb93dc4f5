package ruedo;

import java.util.List;

/** Labelled objects in a picture. */
public final class Boxes2D extends Sample {
    /** Pixels, of the picture. */
    public final int width;

    /** Pixels, of the picture. */
    public final int height;

    /** The objects. */
    public final List<Box2D> boxes;

    Boxes2D(long utime, int width, int height, List<Box2D> boxes) {
        super(utime);
        this.width = width;
        this.height = height;
        this.boxes = boxes;
    }

    /** Where an object is; whole numbers are the middles of pixels. */
    public static final class Box2D {
        /** Its class. */
        public final int label;

        /** Of the model. */
        public final String name;

        /** Pixels, the middle. */
        public final double x;

        /** Pixels, the middle. */
        public final double y;

        /** Pixels. */
        public final double width;

        /** Pixels. */
        public final double height;

        Box2D(int label, String name, double x, double y, double width, double height) {
            this.label = label;
            this.name = name;
            this.x = x;
            this.y = y;
            this.width = width;
            this.height = height;
        }
    }
}
