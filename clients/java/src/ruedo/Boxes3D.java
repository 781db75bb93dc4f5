package ruedo;

import java.util.List;

/** Labelled objects before a camera. */
public final class Boxes3D extends Sample {
    /** The objects. */
    public final List<Box3D> boxes;

    Boxes3D(long utime, List<Box3D> boxes) {
        super(utime);
        this.boxes = boxes;
    }

    /** An object, in the device's frame. */
    public static final class Box3D {
        /** Its class. */
        public final int label;

        /** Of the model. */
        public final String name;

        /** m. */
        public final double[] center;

        /** w, x, y, z: box to device. */
        public final double[] orientation;

        /** m, full lengths. */
        public final double[] size;

        Box3D(int label, String name, double[] center, double[] orientation, double[] size) {
            this.label = label;
            this.name = name;
            this.center = center;
            this.orientation = orientation;
            this.size = size;
        }
    }
}
