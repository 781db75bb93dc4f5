package ruedo;

import ruedo.lcmtypes.marker_t;
import ruedo.lcmtypes.markers_t;

import java.nio.charset.StandardCharsets;
import java.util.List;

/**
 * A drawing of a program in the world, for {@link Simulation#markers}; the web console and logs
 * show it. Points are x, y, z in m; a color is red, green, blue, alpha, each from 0 to 1. Values
 * that the server would refuse throw IllegalArgumentException.
 */
public final class Marker {
    private static final int MOST_BYTES = 65536;
    private static final int MOST_NAME = 63;
    private static final int MOST_TEXT = 1000;
    private static final int MOST_MARKERS = 1000;
    private static final double MOST_SIZE = 1000.0;
    private static final int UNKNOWN = 255;
    private static final int OCCUPIED = 100;

    private final marker_t message = new marker_t();

    private Marker(byte kind, float[] color, double size) {
        require(color.length == 4, "a color has four numbers from 0 to 1");
        for (float part : color) {
            require(part >= 0f && part <= 1f, "a color has four numbers from 0 to 1");
        }
        require(
                size > 0.0 && size <= MOST_SIZE,
                "size is " + size + ": it must be above 0 m, and 1000 m at most");
        message.kind = kind;
        message.color = color.clone();
        message.size = (float) size;
        message.orientation = new double[] {1.0, 0.0, 0.0, 0.0};
        message.text = "";
        message.points = new float[0][3];
        message.cells = new byte[0];
    }

    /** Points 0 and 1, points 2 and 3, ... are the ends of a line each. width: m. */
    public static Marker lines(double[][] points, float[] color, double width) {
        require(
                points.length % 2 == 0,
                "lines have two ends each; " + points.length + " points do not make pairs");
        return new Marker(marker_t.LINES, color, width).withPoints(points);
    }

    /** One line from point to point. width: m. */
    public static Marker path(double[][] points, float[] color, double width) {
        return new Marker(marker_t.PATH, color, width).withPoints(points);
    }

    /** Points. size: m. */
    public static Marker points(double[][] points, float[] color, double size) {
        return new Marker(marker_t.POINTS, color, size).withPoints(points);
    }

    /** A text that faces the viewer; height: of a line, m. */
    public static Marker text(String text, double[] place, float[] color, double height) {
        require(
                text.getBytes(StandardCharsets.UTF_8).length <= MOST_TEXT,
                "a text has at most 1000 bytes");
        Marker marker = new Marker(marker_t.TEXT, color, height).at(place, 0.0);
        marker.message.text = text;
        return marker;
    }

    /**
     * An occupancy grid: rows of cells along x from 0 (free) to 100 (occupied), 255 unknown; the
     * first is at the place, turned by the heading (rad). resolution: m, a cell's side.
     */
    public static Marker map(
            int[] cells,
            int columns,
            double resolution,
            double[] place,
            double heading,
            float[] color) {
        require(
                columns >= 1 && cells.length > 0 && cells.length % columns == 0,
                cells.length + " cells do not fill rows of " + columns);
        Marker marker = new Marker(marker_t.MAP, color, resolution).at(place, heading);
        marker.message.columns = columns;
        marker.message.ncells = cells.length;
        marker.message.cells = new byte[cells.length];
        for (int i = 0; i < cells.length; i++) {
            require(
                    cells[i] >= 0 && (cells[i] <= OCCUPIED || cells[i] == UNKNOWN),
                    "a cell is 0 to 100, or 255 where it is unknown");
            marker.message.cells[i] = (byte) cells[i];
        }
        return marker;
    }

    static markers_t message(String layer, List<Marker> markers, String frame) {
        int name = layer.getBytes(StandardCharsets.UTF_8).length;
        require(name >= 1 && name <= MOST_NAME, "a layer is a name of 1 to 63 bytes");
        require(markers.size() <= MOST_MARKERS, "a layer has at most 1000 markers");
        markers_t result = new markers_t();
        result.layer = layer;
        result.frame = frame;
        result.n = markers.size();
        result.markers = new marker_t[result.n];
        for (int i = 0; i < result.n; i++) result.markers[i] = markers.get(i).message;
        require(
                Bus.encode(result).length <= MOST_BYTES,
                "a layer has at most 65536 bytes: use several");
        return result;
    }

    private Marker withPoints(double[][] points) {
        message.n = points.length;
        message.points = new float[points.length][3];
        for (int i = 0; i < points.length; i++) {
            require(points[i].length == 3, "a point has three finite numbers");
            for (int k = 0; k < 3; k++) {
                require(Double.isFinite(points[i][k]), "a point has three finite numbers");
                message.points[i][k] = (float) points[i][k];
            }
        }
        return this;
    }

    private Marker at(double[] place, double heading) {
        require(place.length == 3 && Double.isFinite(heading), "a place has three finite numbers");
        for (double part : place) {
            require(Double.isFinite(part), "a place has three finite numbers");
        }
        message.position = place.clone();
        message.orientation =
                new double[] {Math.cos(heading / 2.0), 0.0, 0.0, Math.sin(heading / 2.0)};
        return this;
    }

    private static void require(boolean good, String otherwise) {
        if (!good) throw new IllegalArgumentException(otherwise);
    }
}
