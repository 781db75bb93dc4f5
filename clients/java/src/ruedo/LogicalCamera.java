package ruedo;

import java.util.List;

/** A logical camera. */
public final class LogicalCamera extends Sample {
    /** What is seen. */
    public final List<LogicalObject> objects;

    LogicalCamera(long utime, List<LogicalObject> objects) {
        super(utime);
        this.objects = objects;
    }

    /** A model that is seen, in the device's frame. */
    public static final class LogicalObject {
        /** Its name. */
        public final String model;

        /** m. */
        public final double[] position;

        /** w, x, y, z: model to device. */
        public final double[] orientation;

        LogicalObject(String model, double[] position, double[] orientation) {
            this.model = model;
            this.position = position;
            this.orientation = orientation;
        }
    }
}
