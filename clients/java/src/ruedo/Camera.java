package ruedo;

import ruedo.lcmtypes.channel_info_t;
import ruedo.lcmtypes.device_info_t;

/** A camera, with its further channels if the world file has them; else they throw UnknownName. */
public final class Camera extends Device<Image> {
    Camera(StreamCore<Image> core, device_info_t info, channel_info_t channel) {
        super(core, info, channel);
    }

    /** Depth pictures: "float32", m along the optical axis. */
    public Stream<Image> depth() {
        return core.sim.robot(robot).cameraPart(name, "depth", "image_t");
    }

    /** Label pictures: "gray16", body index + 1. */
    public Stream<Image> labels() {
        return core.sim.robot(robot).cameraPart(name, "labels", "image_t");
    }

    /** The intrinsics. */
    public Stream<CameraInfo> intrinsics() {
        return core.sim.robot(robot).cameraPart(name, "info", "camera_info_t");
    }
}
