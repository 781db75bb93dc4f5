package ruedo;

import java.io.ByteArrayOutputStream;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.ArrayList;
import java.util.HashMap;
import java.util.List;
import java.util.Map;

/**
 * Occupancy maps in files, as map_server of ROS has them: a YAML file, and a picture that it names.
 */
final class MapFile {
    private static final byte FREE = 0;
    private static final byte OCCUPIED = 100;
    private static final byte UNKNOWN = -1;
    private static final double FARTHEST = 1e6; // m, rad
    private static final long MOST_YAML = 1 << 20; // bytes
    private static final long MOST_PICTURE = 256 << 20;

    private final Path path;
    private final Map<String, String> values;

    private MapFile(Path path) {
        this.path = path;
        values = values(new String(content(path, MOST_YAML), StandardCharsets.UTF_8));
        List<String> missing = new ArrayList<>(List.of("image", "resolution", "origin"));
        missing.removeAll(values.keySet());
        if (!missing.isEmpty()) throw wrong(path, String.join(", ", missing) + " is missing");
    }

    static OccupancyMap load(Path path) {
        MapFile head = new MapFile(path);
        double occupied = head.positive("occupied_thresh", 0.65);
        double free = head.positive("free_thresh", 0.196);
        double resolution = head.positive("resolution", 0.0);
        double[] origin = head.origin();
        String negate = head.values.getOrDefault("negate", "0");
        boolean negated = !negate.equals("0") && !negate.equals("false");
        byte[][] pixels = pixels(path.resolveSibling(head.values.get("image")));
        byte[][] cells = new byte[pixels.length][pixels[0].length];
        for (int row = 0; row < cells.length; ++row) {
            for (int i = 0; i < cells[row].length; ++i) {
                double grey = (pixels[cells.length - 1 - row][i] & 0xFF) / 255.0;
                double dark = negated ? grey : 1.0 - grey;
                cells[row][i] = dark > occupied ? OCCUPIED : dark < free ? FREE : UNKNOWN;
            }
        }
        return new OccupancyMap(cells, resolution, origin[0], origin[1], origin[2]);
    }

    static void save(OccupancyMap map, Path path) {
        String name = path.getFileName().toString();
        if (!name.endsWith(".yaml"))
            throw new IllegalArgumentException(path + ": the name of a map ends in .yaml");
        String picture = name.substring(0, name.length() - ".yaml".length()) + ".pgm";
        byte[][] cells = map.cells();
        byte[] head =
                ("P5\n" + cells[0].length + " " + cells.length + "\n255\n")
                        .getBytes(StandardCharsets.US_ASCII);
        ByteArrayOutputStream pgm = new ByteArrayOutputStream();
        pgm.writeBytes(head);
        for (int row = cells.length; row-- > 0; ) {
            for (byte cell : cells[row]) pgm.write(cell == OCCUPIED ? 0 : cell == FREE ? 254 : 205);
        }
        double[] origin = map.origin();
        String yaml =
                String.join(
                        "\n",
                        "image: " + picture,
                        "resolution: " + map.resolution(),
                        "origin: [" + origin[0] + ", " + origin[1] + ", " + origin[2] + "]",
                        "negate: 0",
                        "occupied_thresh: 0.65",
                        "free_thresh: 0.196",
                        "");
        try {
            Files.write(path.resolveSibling(picture), pgm.toByteArray());
            Files.write(path, yaml.getBytes(StandardCharsets.UTF_8));
        } catch (IOException error) {
            throw new RuedoException(path + ": it cannot be written: " + error.getMessage());
        }
    }

    private static RuedoException wrong(Path path, String what) {
        return new RuedoException(path + ": " + what);
    }

    private static byte[] content(Path path, long most) {
        try {
            if (!Files.isRegularFile(path)) {
                boolean there = Files.exists(path);
                throw wrong(path, there ? "it is not a file that can be read" : "no such file");
            }
            if (Files.size(path) > most) throw wrong(path, "it has more than " + most + " bytes");
            return Files.readAllBytes(path);
        } catch (IOException error) {
            throw wrong(path, "it cannot be read: " + error.getMessage());
        }
    }

    /** The keys of a YAML file without nesting, which map files are; a list is "a, b, c". */
    private static Map<String, String> values(String yaml) {
        Map<String, String> values = new HashMap<>();
        String last = ""; // key
        for (String whole : yaml.split("\n")) {
            String line = whole.replaceFirst("(^#| #).*", "").trim();
            int colon = line.indexOf(':');
            if (line.startsWith("- ") && !last.isEmpty()) {
                values.merge(
                        last,
                        line.substring(2).trim(),
                        (list, one) -> list.isEmpty() ? one : list + ", " + one);
            } else if (colon >= 0) {
                last = line.substring(0, colon).trim();
                String value = line.substring(colon + 1).trim();
                values.put(last, value.replaceAll("^[\\[\"']|[\\]\"']$", ""));
            }
        }
        return values;
    }

    /** NaN if the text is not a number, or too large. */
    private static double number(String text) {
        try {
            double value = Double.parseDouble(text.trim());
            return Math.abs(value) <= FARTHEST ? value : Double.NaN;
        } catch (NumberFormatException error) {
            return Double.NaN;
        }
    }

    private double positive(String key, double fallback) {
        if (!values.containsKey(key)) return fallback;
        double value = number(values.get(key));
        if (value > 0.0) return value;
        throw wrong(
                path,
                key + " is '" + values.get(key) + "': expected a number above 0, at most 1e6");
    }

    private double[] origin() {
        String[] parts = values.get("origin").split(",");
        double[] origin = new double[3];
        for (int i = 0; i < 3; ++i) origin[i] = parts.length == 3 ? number(parts[i]) : Double.NaN;
        if (!Double.isNaN(origin[0] + origin[1] + origin[2])) return origin;
        throw wrong(
                path,
                "origin is '"
                        + values.get("origin")
                        + "': expected three numbers: x, y and heading");
    }

    /** The pixels of a PGM of 8 bits, by rows from the top. */
    private static byte[][] pixels(Path path) {
        byte[] content = content(path, MOST_PICTURE);
        if (content.length < 2 || content[0] != 'P' || content[1] != '5')
            throw wrong(path, "it is not a PGM, the kind of picture that is read here");
        long[] head = new long[3]; // width, height, largest value
        int at = 2;
        for (int i = 0; i < 3; ++i) {
            while (at < content.length && (content[at] <= ' ' || content[at] == '#')) {
                boolean comment = content[at] == '#';
                while (comment && at < content.length && content[at] != '\n') at++;
                if (!comment) at++;
            }
            for (; at < content.length && Character.isDigit(content[at]); at++)
                head[i] = Math.min(head[i] * 10 + content[at] - '0', Integer.MAX_VALUE);
        }
        int begin = Math.min(at + 1, content.length);
        long width = head[0], height = head[1];
        if (head[2] != 255 || width < 1 || height < 1 || width * height > content.length - begin)
            throw wrong(
                    path,
                    String.format(
                            "expected an 8-bit PGM of %d x %d pixels, found %d bytes",
                            width, height, content.length - begin));
        byte[][] rows = new byte[(int) height][(int) width];
        for (byte[] row : rows) {
            System.arraycopy(content, begin, row, 0, row.length);
            begin += row.length;
        }
        return rows;
    }
}
