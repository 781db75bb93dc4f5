package ruedo;

import ruedo.lcmtypes.body_info_t;
import ruedo.lcmtypes.channel_info_t;
import ruedo.lcmtypes.device_info_t;
import ruedo.lcmtypes.robot_info_t;
import ruedo.lcmtypes.world_info_t;

import java.io.IOException;
import java.nio.ByteBuffer;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.HashMap;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;

/** One complete ruedo/info; immutable. */
final class WorldInfo {
    final world_info_t head;
    final Map<String, robot_info_t> robots = new LinkedHashMap<>();
    final List<channel_info_t> channelList = new ArrayList<>(); // as ruedo/tick counts them
    final List<Body> bodies; // that are there now
    final int tickChannel; // in that list; -1 if there is none
    private final Map<String, List<device_info_t>> devices = new HashMap<>();
    private final Map<String, List<channel_info_t>> channels = new HashMap<>();
    private final Map<String, Map<String, channel_info_t>> deviceChannels = new HashMap<>();
    private final Map<String, channel_info_t> outputs = new HashMap<>(); // by name

    /** Of the requested robots. */
    final Map<String, JointLimits> jointLimits = new ConcurrentHashMap<>();

    private WorldInfo(List<world_info_t> parts) {
        head = parts.get(0);
        int tick = -1;
        List<Body> there = new ArrayList<>();
        for (world_info_t part : parts) {
            for (robot_info_t robot : part.robots) robots.put(robot.name, robot);
            for (device_info_t device : part.devices) {
                devices.computeIfAbsent(device.robot, key -> new ArrayList<>()).add(device);
            }
            for (body_info_t body : part.bodies) { // one that was removed has no name
                if (!body.name.isEmpty()) there.add(new Body(body.name, body.is_static, body.mass));
            }
            for (channel_info_t channel : part.channels) {
                channels.computeIfAbsent(channel.robot, key -> new ArrayList<>()).add(channel);
                if (!channel.input) {
                    outputs.put(channel.name, channel);
                    deviceChannels
                            .computeIfAbsent(channel.robot, key -> new HashMap<>())
                            .putIfAbsent(channel.device, channel);
                }
                if (channel.type.equals("tick_t")) tick = channelList.size();
                channelList.add(channel);
            }
        }
        tickChannel = tick;
        bodies = List.copyOf(there);
    }

    List<device_info_t> devices(String robot) {
        return devices.getOrDefault(robot, List.of());
    }

    List<channel_info_t> channels(String robot) {
        return channels.getOrDefault(robot, List.of());
    }

    /** The channel of that name from the server, or null. */
    channel_info_t output(String name) {
        return outputs.get(name);
    }

    /** The first channel of a device's samples, or null. */
    channel_info_t channelOf(String robot, String device) {
        return deviceChannels.getOrDefault(robot, Map.of()).get(device);
    }

    /** Decodes a world_info_t; null if this client cannot read it. */
    static Long runIdOf(byte[] message) {
        if (message.length < Assembler.HEAD) return null;
        ByteBuffer head = ByteBuffer.wrap(message);
        return head.getLong(0) == world_info_t.LCM_FINGERPRINT ? head.getLong(16) : null;
    }

    boolean supports(int kind) {
        return (head.features >> kind & 1) != 0;
    }

    private static world_info_t readPart(WireReader in) throws IOException {
        world_info_t part = new world_info_t();
        in.int64(); // fingerprint
        part.utime = in.int64();
        part.run_id = in.int64();
        part.epoch = in.int32();
        part.part = in.int16();
        part.nparts = in.int16();
        part.version = in.name();
        part.world = in.name();
        part.seed = in.int64();
        part.step_us = in.int64();
        part.features = in.int64();
        part.paused = in.bool();
        part.robots = new robot_info_t[in.count(80)];
        for (int i = 0; i < part.robots.length; i++) part.robots[i] = readRobot(in);
        part.devices = new device_info_t[in.count(100)];
        for (int i = 0; i < part.devices.length; i++) part.devices[i] = readDevice(in);
        part.channels = new channel_info_t[in.count(30)];
        for (int i = 0; i < part.channels.length; i++) part.channels[i] = readChannel(in);
        part.bodies = new body_info_t[in.count(4 + 4 + 1 + 1 + 8)];
        for (int i = 0; i < part.bodies.length; i++) part.bodies[i] = readBody(in);
        return part;
    }

    private static robot_info_t readRobot(WireReader in) throws IOException {
        robot_info_t robot = new robot_info_t();
        robot.name = in.name();
        robot.model = in.name();
        robot.drive = in.name();
        robot.body = in.int32();
        robot.wheel_radius = in.float64();
        robot.track = in.float64();
        robot.max_speed = in.float64();
        robot.max_turn_rate = in.float64();
        robot.acceleration = in.float64();
        robot.deceleration = in.float64();
        robot.turn_acceleration = in.float64();
        robot.watchdog_us = in.int64();
        int n = in.count(5 + 1);
        robot.wheels = in.names(n).toArray(new String[0]);
        robot.left = in.bools(n);
        return robot;
    }

    private static device_info_t readDevice(WireReader in) throws IOException {
        device_info_t device = new device_info_t();
        device.robot = in.name();
        device.name = in.name();
        device.kind = in.name();
        device.rate = in.float64();
        device.position = in.doubles(3);
        device.orientation = in.doubles(4);
        device.range_min = in.float64();
        device.range_max = in.float64();
        device.fov_horizontal = in.float64();
        device.fov_vertical = in.float64();
        device.width = in.int32();
        device.height = in.int32();
        device.element_pose = new double[in.count(6 * 8)][];
        for (int i = 0; i < device.element_pose.length; i++) device.element_pose[i] = in.doubles(6);
        return device;
    }

    private static body_info_t readBody(WireReader in) throws IOException {
        body_info_t body = new body_info_t();
        body.index = in.int32();
        body.name = in.name();
        body.is_static = in.bool();
        body.mass = in.float64();
        return body;
    }

    private static channel_info_t readChannel(WireReader in) throws IOException {
        channel_info_t channel = new channel_info_t();
        channel.name = in.name();
        channel.robot = in.name();
        channel.device = in.name();
        channel.type = in.name();
        channel.fingerprint = in.int64();
        channel.rate = in.float64();
        channel.input = in.bool();
        return channel;
    }

    /**
     * Takes messages of ruedo/info as they come. The parts of one info share run, epoch and utime.
     * An info with the content of the last one, which is the usual case, is recognised by its bytes
     * and not decoded.
     */
    static final class Assembler {
        private static final int HEAD =
                8 + 8 + 8 + 4 + 2 + 2; // bytes: fingerprint, utime, run, epoch, part, nparts
        private static final int MOST_PARTS = 1024; // of an info
        private static final int MOST_BYTES = 64 << 20; // of all of them
        private byte[] key = {};
        private Map<Integer, byte[]> parts = new HashMap<>();
        private List<byte[]> last = List.of();

        /**
         * The info, when this message completed a new one, else null. Throws TypeMismatch for
         * another version.
         */
        WorldInfo add(byte[] bytes) {
            if (bytes.length < HEAD) return null;
            ByteBuffer head = ByteBuffer.wrap(bytes);
            long fingerprint = head.getLong();
            if (fingerprint != world_info_t.LCM_FINGERPRINT) {
                throw new RuedoException.TypeMismatch(
                        String.format(
                                "ruedo/info carries another version of world_info_t (fingerprint"
                                    + " %016x) than this client reads (%016x): use the client of"
                                    + " the server's version",
                                fingerprint, world_info_t.LCM_FINGERPRINT));
            }
            int part = head.getShort(28);
            int nparts = head.getShort(30);
            if (part < 0 || part >= nparts) return null;
            byte[] found = Arrays.copyOfRange(bytes, 8, 28); // utime, run, epoch
            if (!Arrays.equals(found, key)) parts = new HashMap<>();
            key = found;
            parts.put(part, bytes);
            checkSize(nparts);
            if (parts.size() < nparts) return null;
            List<byte[]> whole = new ArrayList<>();
            List<byte[]> content = new ArrayList<>();
            for (int i = 0; i < nparts; i++) {
                if (!parts.containsKey(i)) return null;
                whole.add(parts.get(i));
                content.add(
                        Arrays.copyOfRange(
                                parts.get(i),
                                16,
                                parts.get(i).length)); // all but fingerprint and utime
            }
            parts = new HashMap<>();
            if (same(content, last)) return null;
            List<world_info_t> decoded = new ArrayList<>();
            try {
                for (byte[] message : whole) decoded.add(readPart(new WireReader(message)));
            } catch (IOException error) {
                throw new RuedoException.TypeMismatch(
                        "a message on ruedo/info is not a valid world_info_t: "
                                + error.getMessage());
            }
            last = content;
            return new WorldInfo(decoded);
        }

        /** Incomplete parts wait in memory. */
        private void checkSize(int nparts) {
            long size = 0;
            for (byte[] part : parts.values()) size += part.length;
            if (nparts <= MOST_PARTS && size <= MOST_BYTES) return;
            parts = new HashMap<>();
            throw new RuedoException.TypeMismatch(
                    "ruedo/info has "
                            + nparts
                            + " parts of "
                            + size
                            + " bytes so far: a client takes "
                            + MOST_PARTS
                            + " parts of "
                            + MOST_BYTES
                            + " bytes together at most");
        }

        private static boolean same(List<byte[]> a, List<byte[]> b) {
            if (a.size() != b.size()) return false;
            for (int i = 0; i < a.size(); i++) {
                if (!Arrays.equals(a.get(i), b.get(i))) return false;
            }
            return true;
        }
    }
}
