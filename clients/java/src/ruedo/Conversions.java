package ruedo;

import ruedo.lcmtypes.air_pressure_t;
import ruedo.lcmtypes.air_speed_t;
import ruedo.lcmtypes.altimeter_t;
import ruedo.lcmtypes.boxes_2d_t;
import ruedo.lcmtypes.boxes_3d_t;
import ruedo.lcmtypes.camera_info_t;
import ruedo.lcmtypes.collisions_t;
import ruedo.lcmtypes.contact_t;
import ruedo.lcmtypes.force_torque_t;
import ruedo.lcmtypes.image_t;
import ruedo.lcmtypes.imu_t;
import ruedo.lcmtypes.joint_state_t;
import ruedo.lcmtypes.lidar_t;
import ruedo.lcmtypes.logical_camera_t;
import ruedo.lcmtypes.magnetometer_t;
import ruedo.lcmtypes.motion_status_t;
import ruedo.lcmtypes.navsat_t;
import ruedo.lcmtypes.odometry_t;
import ruedo.lcmtypes.odometry_twist_t;
import ruedo.lcmtypes.planar_lidar_t;
import ruedo.lcmtypes.pose_t;
import ruedo.lcmtypes.sonar_t;

import java.io.IOException;
import java.util.ArrayList;
import java.util.List;
import java.util.Map;

/**
 * How each message type becomes a sample. Arguments are evaluated from left to right, which is the
 * order on the wire.
 */
final class Conversions {
    /** A message type: its fingerprint, and how its bytes become a sample. */
    static final class Conversion {
        final long fingerprint;
        final Decoder decoder;
        final boolean any; // of messages of any type
        final String key; // what tells it from others of a channel; "": Ruedo's own samples

        Conversion(long fingerprint, Decoder decoder) {
            this(fingerprint, decoder, false, "");
        }

        Conversion(long fingerprint, Decoder decoder, boolean any, String key) {
            this.fingerprint = fingerprint;
            this.decoder = decoder;
            this.any = any;
            this.key = key;
        }

        boolean reads(long found) {
            return any || found == fingerprint;
        }
    }

    interface Decoder {
        Sample decode(WireReader in) throws IOException;
    }

    private static final Map<String, Conversion> ALL =
            Map.ofEntries(
                    Map.entry(
                            "planar_lidar_t",
                            new Conversion(planar_lidar_t.LCM_FINGERPRINT, Conversions::scan)),
                    Map.entry(
                            "lidar_t", new Conversion(lidar_t.LCM_FINGERPRINT, Conversions::lidar)),
                    Map.entry(
                            "sonar_t", new Conversion(sonar_t.LCM_FINGERPRINT, Conversions::sonar)),
                    Map.entry(
                            "odometry_t",
                            new Conversion(odometry_t.LCM_FINGERPRINT, Conversions::odometry)),
                    Map.entry(
                            "odometry_twist_t",
                            new Conversion(
                                    odometry_twist_t.LCM_FINGERPRINT, Conversions::odometryTwist)),
                    Map.entry("pose_t", new Conversion(pose_t.LCM_FINGERPRINT, Conversions::pose)),
                    Map.entry(
                            "image_t", new Conversion(image_t.LCM_FINGERPRINT, Conversions::image)),
                    Map.entry(
                            "camera_info_t",
                            new Conversion(camera_info_t.LCM_FINGERPRINT, Conversions::cameraInfo)),
                    Map.entry("imu_t", new Conversion(imu_t.LCM_FINGERPRINT, Conversions::imu)),
                    Map.entry(
                            "contact_t",
                            new Conversion(contact_t.LCM_FINGERPRINT, Conversions::contact)),
                    Map.entry(
                            "collisions_t",
                            new Conversion(collisions_t.LCM_FINGERPRINT, Conversions::collisions)),
                    Map.entry(
                            "joint_state_t",
                            new Conversion(joint_state_t.LCM_FINGERPRINT, Conversions::joints)),
                    Map.entry(
                            "motion_status_t",
                            new Conversion(motion_status_t.LCM_FINGERPRINT, Conversions::motion)),
                    Map.entry(
                            "navsat_t",
                            new Conversion(navsat_t.LCM_FINGERPRINT, Conversions::navSat)),
                    Map.entry(
                            "magnetometer_t",
                            new Conversion(
                                    magnetometer_t.LCM_FINGERPRINT, Conversions::magnetometer)),
                    Map.entry(
                            "altimeter_t",
                            new Conversion(altimeter_t.LCM_FINGERPRINT, Conversions::altimeter)),
                    Map.entry(
                            "air_pressure_t",
                            new Conversion(
                                    air_pressure_t.LCM_FINGERPRINT, Conversions::airPressure)),
                    Map.entry(
                            "air_speed_t",
                            new Conversion(air_speed_t.LCM_FINGERPRINT, Conversions::airSpeed)),
                    Map.entry(
                            "force_torque_t",
                            new Conversion(
                                    force_torque_t.LCM_FINGERPRINT, Conversions::forceTorque)),
                    Map.entry(
                            "logical_camera_t",
                            new Conversion(
                                    logical_camera_t.LCM_FINGERPRINT, Conversions::logicalCamera)),
                    Map.entry(
                            "boxes_2d_t",
                            new Conversion(boxes_2d_t.LCM_FINGERPRINT, Conversions::boxes2D)),
                    Map.entry(
                            "boxes_3d_t",
                            new Conversion(boxes_3d_t.LCM_FINGERPRINT, Conversions::boxes3D)));

    private static final String[] KINDS = {"none", "advance", "rotate", "heading", "arc", "stop"};
    private static final String[] STATES = {"idle", "running", "done", "ended", "refused"};
    private static final String[] REASONS = {
        "",
        "replaced",
        "blocked",
        "watchdog",
        "not finite",
        "bad kind",
        "bad value",
        "no drive",
        "not possible"
    };

    private Conversions() {}

    /** Null for a type that this library does not know. */
    static Conversion of(String type) {
        return ALL.get(type);
    }

    /** Of the messages with that fingerprint; null for a type that this library does not know. */
    static Conversion of(long fingerprint) {
        for (Conversion conversion : ALL.values()) {
            if (conversion.fingerprint == fingerprint) return conversion;
        }
        return null;
    }

    private static Sample scan(WireReader in) throws IOException {
        return new Scan(
                in.int64(),
                in.floats(in.count(4)),
                in.floats(in.count(4)),
                in.float32(),
                in.float32());
    }

    private static Sample lidar(WireReader in) throws IOException {
        LidarScan scan =
                new LidarScan(
                        in.int64(),
                        in.int32(),
                        in.int32(),
                        in.floats(in.count(4)),
                        in.floats(in.count(4)),
                        in.float32(),
                        in.float32(),
                        in.float32(),
                        in.float32());
        boolean fits =
                (long) scan.layers * scan.columns == scan.ranges.length
                        && (scan.intensities.length == 0
                                || scan.intensities.length == scan.ranges.length);
        if (!fits) throw new IOException("sizes that do not fit each other");
        return scan;
    }

    private static Sample sonar(WireReader in) throws IOException {
        long utime = in.int64();
        int n = in.count(4 + 8 + 1);
        return new SonarReading(utime, in.floats(n), in.int64s(n), in.bools(n));
    }

    private static Sample odometry(WireReader in) throws IOException {
        long utime = in.int64();
        double[] pose = in.doubles(5);
        int n = in.count(8 + 8 + 8);
        return new Odometry(
                utime,
                pose[0],
                pose[1],
                pose[2],
                pose[3],
                pose[4],
                in.doubles(n),
                in.doubles(n),
                in.int64s(n),
                in.int32());
    }

    private static Sample odometryTwist(WireReader in) throws IOException {
        long utime = in.int64();
        double[] twist = in.doubles(3);
        return new OdometryTwist(utime, twist[0], twist[1], twist[2], in.doubles(9));
    }

    private static Sample pose(WireReader in) throws IOException {
        long utime = in.int64();
        double[] position = in.doubles(3);
        double[] velocity = in.doubles(3);
        return new Pose(utime, position, in.doubles(4), velocity, in.doubles(3), in.doubles(3));
    }

    private static Sample image(WireReader in) throws IOException {
        long utime = in.int64();
        int width = in.int32();
        int height = in.int32();
        int stride = in.int32();
        String format = pixelFormat(in.int32());
        return new Image(
                utime,
                width,
                height,
                format,
                stride,
                in.bytes(in.count(1))); // the metadata behind is not used
    }

    private static String pixelFormat(int format) {
        switch (format) {
            case image_t.PIXEL_FORMAT_GRAY:
                return "gray";
            case image_t.PIXEL_FORMAT_RGB:
                return "rgb";
            case image_t.PIXEL_FORMAT_BGR:
                return "bgr";
            case image_t.PIXEL_FORMAT_MJPEG:
                return "jpeg";
            case image_t.PIXEL_FORMAT_LE_GRAY16:
                return "gray16";
            case image_t.PIXEL_FORMAT_FLOAT_GRAY32:
                return "float32";
            default:
                return String.format("0x%08x", format);
        }
    }

    private static Sample cameraInfo(WireReader in) throws IOException {
        return new CameraInfo(
                in.int64(),
                in.int32(),
                in.int32(),
                in.float64(),
                in.float64(),
                in.float64(),
                in.float64(),
                in.doubles(5));
    }

    private static Sample imu(WireReader in) throws IOException {
        return new Imu(in.int64(), in.doubles(4), in.doubles(3), in.doubles(3));
    }

    private static Sample navSat(WireReader in) throws IOException {
        return new NavSat(in.int64(), in.float64(), in.float64(), in.float64(), in.doubles(3));
    }

    private static Sample magnetometer(WireReader in) throws IOException {
        return new Magnetometer(in.int64(), in.doubles(3));
    }

    private static Sample altimeter(WireReader in) throws IOException {
        return new Altimeter(in.int64(), in.float64(), in.float64());
    }

    private static Sample airPressure(WireReader in) throws IOException {
        return new AirPressure(in.int64(), in.float64());
    }

    private static Sample airSpeed(WireReader in) throws IOException {
        return new AirSpeed(in.int64(), in.float64(), in.float64());
    }

    private static Sample forceTorque(WireReader in) throws IOException {
        return new ForceTorque(in.int64(), in.doubles(3), in.doubles(3));
    }

    private static Sample logicalCamera(WireReader in) throws IOException {
        long utime = in.int64();
        List<LogicalCamera.LogicalObject> objects = new ArrayList<>();
        for (int n = in.count(5 + 7 * 8); n > 0; n--) {
            objects.add(new LogicalCamera.LogicalObject(in.string(), in.doubles(3), in.doubles(4)));
        }
        return new LogicalCamera(utime, List.copyOf(objects));
    }

    private static Sample boxes2D(WireReader in) throws IOException {
        long utime = in.int64();
        int width = in.int32();
        int height = in.int32();
        List<Boxes2D.Box2D> boxes = new ArrayList<>();
        for (int n = in.count(4 + 5 + 4 * 8); n > 0; n--) {
            boxes.add(
                    new Boxes2D.Box2D(
                            in.int32(),
                            in.string(),
                            in.float64(),
                            in.float64(),
                            in.float64(),
                            in.float64()));
        }
        return new Boxes2D(utime, width, height, List.copyOf(boxes));
    }

    private static Sample boxes3D(WireReader in) throws IOException {
        long utime = in.int64();
        List<Boxes3D.Box3D> boxes = new ArrayList<>();
        for (int n = in.count(4 + 5 + 10 * 8); n > 0; n--) {
            boxes.add(
                    new Boxes3D.Box3D(
                            in.int32(), in.string(), in.doubles(3), in.doubles(4), in.doubles(3)));
        }
        return new Boxes3D(utime, List.copyOf(boxes));
    }

    private static List<Contact.Point> contactPoints(WireReader in) throws IOException {
        List<Contact.Point> points = new ArrayList<>();
        for (int n = in.count(5 + 8 * 8); n > 0; n--) {
            points.add(
                    new Contact.Point(
                            in.string(), in.doubles(3), in.doubles(3), in.float64(), in.float64()));
        }
        return List.copyOf(points);
    }

    private static Sample contact(WireReader in) throws IOException {
        return new Contact(in.int64(), in.bool(), contactPoints(in));
    }

    private static Sample collisions(WireReader in) throws IOException {
        return new Collisions(in.int64(), in.text(), contactPoints(in));
    }

    private static Sample joints(WireReader in) throws IOException {
        long utime = in.int64();
        int n = in.fits(in.int16(), 5 + 3 * 4);
        return new Joints(
                utime, List.copyOf(in.strings(n)), in.floats(n), in.floats(n), in.floats(n));
    }

    private static Sample motion(WireReader in) throws IOException {
        long utime = in.int64();
        long id = in.int64();
        byte kind = in.int8();
        String kindName =
                kind == motion_status_t.KIND_VELOCITY
                        ? "velocity"
                        : kind == motion_status_t.KIND_WHEELS ? "wheels" : word(KINDS, kind);
        return new MotionStatus(
                utime,
                id,
                kindName,
                word(STATES, in.int8()),
                word(REASONS, in.int8()),
                in.float64(),
                in.float64(),
                in.float64(),
                in.float64());
    }

    private static String word(String[] words, int index) {
        return index >= 0 && index < words.length ? words[index] : Integer.toString(index);
    }
}
