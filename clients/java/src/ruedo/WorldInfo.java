package ruedo;

import java.io.IOException;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.HashMap;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;
import lcm.lcm.LCMDataInputStream;
import ruedo.lcmtypes.channel_info_t;
import ruedo.lcmtypes.device_info_t;
import ruedo.lcmtypes.robot_info_t;
import ruedo.lcmtypes.world_info_t;

/** One complete ruedo/info; immutable. */
final class WorldInfo {
    final world_info_t head;
    final Map<String, robot_info_t> robots = new LinkedHashMap<>();
    private final Map<String, List<device_info_t>> devices = new HashMap<>();
    private final Map<String, List<channel_info_t>> channels = new HashMap<>();

    private WorldInfo(List<world_info_t> parts) {
        head = parts.get(0);
        for (world_info_t part : parts) {
            for (robot_info_t robot : part.robots) robots.put(robot.name, robot);
            for (device_info_t device : part.devices) {
                devices.computeIfAbsent(device.robot, key -> new ArrayList<>()).add(device);
            }
            for (channel_info_t channel : part.channels) {
                channels.computeIfAbsent(channel.robot, key -> new ArrayList<>()).add(channel);
            }
        }
    }

    List<device_info_t> devices(String robot) {
        return devices.getOrDefault(robot, List.of());
    }

    List<channel_info_t> channels(String robot) {
        return channels.getOrDefault(robot, List.of());
    }

    boolean supports(int kind) {
        return (head.features >> kind & 1) != 0;
    }

    /**
     * Takes messages of ruedo/info as they come. The parts of one info share run, epoch and utime. An info that says again
     * what the last one said, which is the rule, is known by its bytes and not decoded.
     */
    static final class Assembler {
        private byte[] key = {};
        private Map<Integer, byte[]> parts = new HashMap<>();
        private List<byte[]> last = List.of();

        /** The info, when this message completed a new one, else null. Throws TypeMismatch for another version. */
        WorldInfo add(LCMDataInputStream in) throws IOException {
            byte[] bytes = new byte[in.available()];
            in.readFully(bytes);
            if (bytes.length < 32) return null;
            LCMDataInputStream head = new LCMDataInputStream(bytes);
            long fingerprint = head.readLong();
            if (fingerprint != world_info_t.LCM_FINGERPRINT) {
                throw new RuedoException.TypeMismatch(String.format("ruedo/info carries another version of world_info_t "
                        + "(fingerprint %016x) than this client reads (%016x): use the client of the server's version",
                        fingerprint, world_info_t.LCM_FINGERPRINT));
            }
            head.readLong();    // utime
            head.readLong();    // run
            head.readInt();     // epoch
            int part = head.readShort();
            int nparts = head.readShort();
            if (part < 0 || part >= nparts) return null;
            byte[] found = Arrays.copyOfRange(bytes, 8, 28);    // utime, run, epoch
            if (!Arrays.equals(found, key)) parts = new HashMap<>();
            key = found;
            parts.put(part, bytes);
            if (parts.size() < nparts) return null;
            List<byte[]> whole = new ArrayList<>();
            List<byte[]> content = new ArrayList<>();
            for (int i = 0; i < nparts; i++) {
                if (!parts.containsKey(i)) return null;
                whole.add(parts.get(i));
                content.add(Arrays.copyOfRange(parts.get(i), 16, parts.get(i).length));    // all but fingerprint and utime
            }
            parts = new HashMap<>();
            if (same(content, last)) return null;
            List<world_info_t> decoded = new ArrayList<>();
            try {
                for (byte[] message : whole) decoded.add(new world_info_t(message));
            } catch (IOException | RuntimeException | OutOfMemoryError error) {
                throw new RuedoException.TypeMismatch("a message on ruedo/info is no valid world_info_t (" + error + ")");
            }
            last = content;
            return new WorldInfo(decoded);
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
