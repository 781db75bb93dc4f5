package ruedo;

import ruedo.lcmtypes.channel_info_t;
import ruedo.lcmtypes.device_info_t;

/**
 * A sensor of a robot: latest(), next() and onSample() deliver its samples.
 *
 * @param <T> kind of sample
 */
public class Device<T extends Sample> extends Stream<T> {
    /** Name of the robot. */
    public final String robot;

    /** Its name in the world file. */
    public final String name;

    /** "lrf", "sonar", "odometry", "camera", "pose", "motion", "imu", "contact", ... */
    public final String kind;

    /** m, the device's frame in base_link at the start. */
    public final double[] position;

    /** w, x, y, z: device to base_link. */
    public final double[] orientation;

    /** m. */
    public final double rangeMin;

    /** m. */
    public final double rangeMax;

    /** rad: LRF from first to last ray, camera's width, sonar's cone. */
    public final double fovHorizontal;

    /** rad. */
    public final double fovVertical;

    /** Rays in a layer, transducers, pixels. */
    public final int width;

    /** Layers, pixels; 1 otherwise. */
    public final int height;

    /** A sonar's transducers: x, y, z (m), roll, pitch, yaw (rad) in the device's frame. */
    public final double[][] elements;

    /** The device's frame in base_link at the start. */
    public Transform transform() {
        return new Transform(position, orientation);
    }

    Device(StreamCore<T> core, device_info_t info, channel_info_t channel) {
        super(core, channel);
        robot = info.robot;
        name = info.name;
        kind = info.kind;
        position = info.position;
        orientation = info.orientation;
        rangeMin = info.range_min;
        rangeMax = info.range_max;
        fovHorizontal = info.fov_horizontal;
        fovVertical = info.fov_vertical;
        width = info.width;
        height = info.height;
        elements = info.element_pose;
    }
}
