package ruedo;

import java.nio.file.Path;

/**
 * An occupancy map: cells by rows, the southernmost first; 0 free, 100 occupied, -1 unknown.
 * Immutable.
 */
public final class OccupancyMap {
    private static final int OCCUPIED = 100;

    private final byte[][] cells;
    private final double resolution;
    private final double x;
    private final double y;
    private final double heading;

    /**
     * cells: rows of equal length; resolution: m, of a cell; x, y (m), heading (rad): of the first
     * cell's corner, in the world.
     */
    public OccupancyMap(byte[][] cells, double resolution, double x, double y, double heading) {
        if (cells.length == 0 || cells[0].length == 0 || !(resolution > 0.0))
            throw new IllegalArgumentException("a map has cells, and a resolution above 0 m");
        this.cells = new byte[cells.length][];
        for (int row = 0; row < cells.length; ++row) {
            if (cells[row].length != cells[0].length)
                throw new IllegalArgumentException("cells: the rows must be of equal length");
            this.cells[row] = cells[row].clone();
        }
        this.resolution = resolution;
        this.x = x;
        this.y = y;
        this.heading = heading;
    }

    /** By rows, the southernmost first; a copy. */
    public byte[][] cells() {
        byte[][] copy = new byte[cells.length][];
        for (int row = 0; row < cells.length; ++row) copy[row] = cells[row].clone();
        return copy;
    }

    /** m, of a cell. */
    public double resolution() {
        return resolution;
    }

    /** x, y (m) of the first cell's corner in the world, and heading (rad). */
    public double[] origin() {
        return new double[] {x, y, heading};
    }

    /**
     * Writes NAME.yaml and NAME.pgm, as map_server of ROS reads them. Throws RuedoException for
     * what cannot be written.
     */
    public void save(String path) {
        MapFile.save(this, Path.of(path));
    }

    /** The cell at a place of the world (m); -1 outside of the map. */
    public int at(double atX, double atY) {
        double[] place = toCells(atX, atY);
        int column = (int) Math.floor(place[0]), row = (int) Math.floor(place[1]);
        return inside(column, row) ? cells[row][column] : -1;
    }

    /** Whether a place of the world (m) is occupied. */
    public boolean occupied(double atX, double atY) {
        return at(atX, atY) == OCCUPIED;
    }

    /**
     * By rows: m from the middle of each cell to that of the nearest occupied one; +inf without
     * one. Exact (Felzenszwalb and Huttenlocher 2012, by rows and then columns).
     */
    public double[][] distanceField() {
        int rows = cells.length, columns = cells[0].length;
        double[][] along = new double[rows][columns], nearest = new double[rows][columns];
        for (int row = 0; row < rows; ++row) {
            for (int i = 0; i < columns; ++i) {
                double before = i > 0 ? along[row][i - 1] + 1.0 : Double.POSITIVE_INFINITY;
                along[row][i] = cells[row][i] == OCCUPIED ? 0.0 : before;
            }
            for (int i = columns - 2; i >= 0; --i)
                along[row][i] = Math.min(along[row][i], along[row][i + 1] + 1.0);
        }
        for (int i = 0; i < columns; ++i) {
            for (int row = 0; row < rows; ++row) {
                double best = Double.POSITIVE_INFINITY;
                for (int other = 0; other < rows; ++other) {
                    double up = row - other, beside = along[other][i];
                    best = Math.min(best, up * up + beside * beside);
                }
                nearest[row][i] = Math.sqrt(best) * resolution;
            }
        }
        return nearest;
    }

    /** The map in which every cell within a radius (m) of an occupied one is occupied. */
    public OccupancyMap inflated(double radius) {
        double[][] away = distanceField();
        byte[][] grown = new byte[cells.length][];
        for (int row = 0; row < cells.length; ++row) {
            grown[row] = cells[row].clone();
            for (int i = 0; i < grown[row].length; ++i)
                if (away[row][i] <= radius + 1e-9) grown[row][i] = OCCUPIED;
        }
        return new OccupancyMap(grown, resolution, x, y, heading);
    }

    /**
     * The distance (m) that a ray travels from a place (m) in a direction (rad, of the world) until
     * it enters an occupied cell: +inf if it meets none within maxRange, 0 from within one. Goes
     * from cell to cell (Amanatides and Woo 1987).
     */
    public double ray(double fromX, double fromY, double angle, double maxRange) {
        double[] start = toCells(fromX, fromY);
        double[] way = {Math.cos(angle - heading), Math.sin(angle - heading)};
        int[] cell = new int[2], step = new int[2], sizes = {cells[0].length, cells.length};
        double[] perCell = new double[2], toBorder = new double[2];
        for (int i = 0; i < 2; ++i) {
            cell[i] = (int) Math.floor(start[i]);
            step[i] = (int) Math.signum(way[i]);
            perCell[i] = Math.abs(1.0 / way[i]);
            double left = Math.abs(cell[i] + (step[i] > 0 ? 1.0 : 0.0) - start[i]);
            toBorder[i] = step[i] == 0 ? Double.POSITIVE_INFINITY : left * perCell[i];
        }
        for (double gone = 0.0; gone <= maxRange / resolution; ) {
            if (inside(cell[0], cell[1]) && cells[cell[1]][cell[0]] == OCCUPIED)
                return gone * resolution;
            for (int i = 0; i < 2; ++i) {
                boolean leaves = cell[i] < 0 ? step[i] <= 0 : cell[i] >= sizes[i] && step[i] >= 0;
                if (leaves) return Double.POSITIVE_INFINITY;
            }
            int axis = toBorder[0] <= toBorder[1] ? 0 : 1;
            gone = toBorder[axis];
            cell[axis] += step[axis];
            toBorder[axis] += perCell[axis];
        }
        return Double.POSITIVE_INFINITY;
    }

    /** Column and row, from the corner of the first cell. */
    private double[] toCells(double atX, double atY) {
        double across = atX - x, up = atY - y;
        double cosine = Math.cos(heading), sine = Math.sin(heading);
        return new double[] {
            (cosine * across + sine * up) / resolution, (cosine * up - sine * across) / resolution
        };
    }

    private boolean inside(int column, int row) {
        return column >= 0 && row >= 0 && row < cells.length && column < cells[0].length;
    }
}
