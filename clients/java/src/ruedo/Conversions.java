package ruedo;

import java.io.IOException;
import java.util.ArrayList;
import java.util.List;
import java.util.Map;
import lcm.lcm.LCMDataInputStream;
import ruedo.lcmtypes.camera_info_t;
import ruedo.lcmtypes.contact_point_t;
import ruedo.lcmtypes.contact_t;
import ruedo.lcmtypes.image_t;
import ruedo.lcmtypes.imu_t;
import ruedo.lcmtypes.joint_state_t;
import ruedo.lcmtypes.lidar_t;
import ruedo.lcmtypes.motion_status_t;
import ruedo.lcmtypes.odometry_t;
import ruedo.lcmtypes.planar_lidar_t;
import ruedo.lcmtypes.pose_t;
import ruedo.lcmtypes.sonar_t;

/** How each message type becomes a sample. */
final class Conversions {
    /** A message type: its fingerprint, and how its bytes become a sample. */
    static final class Conversion {
        final long fingerprint;
        final Decoder decoder;

        Conversion(long fingerprint, Decoder decoder) {
            this.fingerprint = fingerprint;
            this.decoder = decoder;
        }
    }

    interface Decoder {
        Sample decode(LCMDataInputStream in) throws IOException;
    }

    private static final Map<String, Conversion> ALL = Map.ofEntries(
            Map.entry("planar_lidar_t", new Conversion(planar_lidar_t.LCM_FINGERPRINT, Conversions::scan)),
            Map.entry("lidar_t", new Conversion(lidar_t.LCM_FINGERPRINT, Conversions::lidar)),
            Map.entry("sonar_t", new Conversion(sonar_t.LCM_FINGERPRINT, Conversions::sonar)),
            Map.entry("odometry_t", new Conversion(odometry_t.LCM_FINGERPRINT, Conversions::odometry)),
            Map.entry("pose_t", new Conversion(pose_t.LCM_FINGERPRINT, Conversions::pose)),
            Map.entry("image_t", new Conversion(image_t.LCM_FINGERPRINT, Conversions::image)),
            Map.entry("camera_info_t", new Conversion(camera_info_t.LCM_FINGERPRINT, Conversions::cameraInfo)),
            Map.entry("imu_t", new Conversion(imu_t.LCM_FINGERPRINT, Conversions::imu)),
            Map.entry("contact_t", new Conversion(contact_t.LCM_FINGERPRINT, Conversions::contact)),
            Map.entry("joint_state_t", new Conversion(joint_state_t.LCM_FINGERPRINT, Conversions::joints)),
            Map.entry("motion_status_t", new Conversion(motion_status_t.LCM_FINGERPRINT, Conversions::motion)));

    private static final String[] KINDS = {"none", "advance", "rotate", "heading", "arc", "stop"};
    private static final String[] STATES = {"idle", "running", "done", "ended", "refused"};
    private static final String[] REASONS =
            {"", "replaced", "blocked", "watchdog", "not finite", "bad kind", "bad value", "no drive"};

    private Conversions() {}

    /** Null for a type that this library does not know. */
    static Conversion of(String type) {
        return ALL.get(type);
    }

    private static Sample scan(LCMDataInputStream in) throws IOException {
        planar_lidar_t m = new planar_lidar_t(in);
        return new Scan(m.utime, m.ranges, m.intensities, m.rad0, m.radstep);
    }

    private static Sample lidar(LCMDataInputStream in) throws IOException {
        lidar_t m = new lidar_t(in);
        if ((long) m.nlayers * m.ncolumns != m.nranges || (m.nintensities != 0 && m.nintensities != m.nranges)) {
            throw new IOException("sizes that do not fit each other");
        }
        return new LidarScan(m.utime, m.nlayers, m.ncolumns, m.ranges, m.intensities, m.azimuth0, m.azimuth_step,
                m.elevation0, m.elevation_step);
    }

    private static Sample sonar(LCMDataInputStream in) throws IOException {
        sonar_t m = new sonar_t(in);
        return new SonarReading(m.utime, m.range, m.fired_utime, m.fresh);
    }

    private static Sample odometry(LCMDataInputStream in) throws IOException {
        odometry_t m = new odometry_t(in);
        return new Odometry(m.utime, m.x, m.y, m.theta, m.v, m.omega, m.angle, m.rate, m.ticks, m.resets);
    }

    private static Sample pose(LCMDataInputStream in) throws IOException {
        pose_t m = new pose_t(in);
        return new Pose(m.utime, m.pos, m.orientation, m.vel, m.rotation_rate, m.accel);
    }

    private static Sample image(LCMDataInputStream in) throws IOException {
        image_t m = new image_t(in);
        return new Image(m.utime, m.width, m.height, pixelFormat(m.pixelformat), m.row_stride, m.data);
    }

    private static String pixelFormat(int format) {
        switch (format) {
            case image_t.PIXEL_FORMAT_GRAY: return "gray";
            case image_t.PIXEL_FORMAT_RGB: return "rgb";
            case image_t.PIXEL_FORMAT_BGR: return "bgr";
            case image_t.PIXEL_FORMAT_MJPEG: return "jpeg";
            case image_t.PIXEL_FORMAT_LE_GRAY16: return "gray16";
            case image_t.PIXEL_FORMAT_FLOAT_GRAY32: return "float32";
            default: return String.format("0x%08x", format);
        }
    }

    private static Sample cameraInfo(LCMDataInputStream in) throws IOException {
        camera_info_t m = new camera_info_t(in);
        return new CameraInfo(m.utime, m.width, m.height, m.fx, m.fy, m.cx, m.cy, m.distortion);
    }

    private static Sample imu(LCMDataInputStream in) throws IOException {
        imu_t m = new imu_t(in);
        return new Imu(m.utime, m.orientation, m.angular_velocity, m.linear_acceleration);
    }

    private static Sample contact(LCMDataInputStream in) throws IOException {
        contact_t m = new contact_t(in);
        List<Contact.Point> points = new ArrayList<>();
        for (contact_point_t p : m.points) points.add(new Contact.Point(p.body, p.position, p.normal, p.force, p.depth));
        return new Contact(m.utime, m.pressed, List.copyOf(points));
    }

    private static Sample joints(LCMDataInputStream in) throws IOException {
        joint_state_t m = new joint_state_t(in);
        return new Joints(m.utime, List.of(m.joint_name), m.joint_position, m.joint_velocity, m.joint_effort);
    }

    private static Sample motion(LCMDataInputStream in) throws IOException {
        motion_status_t m = new motion_status_t(in);
        String kind = m.kind == motion_status_t.KIND_VELOCITY ? "velocity"
                : m.kind == motion_status_t.KIND_WHEELS ? "wheels" : word(KINDS, m.kind);
        return new MotionStatus(m.utime, m.id, kind, word(STATES, m.state), word(REASONS, m.reason), m.done, m.remaining,
                m.v, m.omega);
    }

    private static String word(String[] words, int index) {
        return index >= 0 && index < words.length ? words[index] : Integer.toString(index);
    }
}
