package ruedo;

/** A scan of a laser scanner with several layers: element layer * columns + column. */
public final class LidarScan extends Sample {
    /** Layers, lowest first. */
    public final int layers;

    /** Rays in a layer. */
    public final int columns;

    /** m; +inf: no return, -inf: nearer than the minimum range. */
    public final float[] ranges;

    /** 0 to 1; empty when the device has none. */
    public final float[] intensities;

    /** rad, left is positive. */
    public final double azimuthMin;

    /** rad. */
    public final double azimuthStep;

    /** rad, up is positive. */
    public final double elevationMin;

    /** rad. */
    public final double elevationStep;

    LidarScan(
            long utime,
            int layers,
            int columns,
            float[] ranges,
            float[] intensities,
            double azimuthMin,
            double azimuthStep,
            double elevationMin,
            double elevationStep) {
        super(utime);
        this.layers = layers;
        this.columns = columns;
        this.ranges = ranges;
        this.intensities = intensities;
        this.azimuthMin = azimuthMin;
        this.azimuthStep = azimuthStep;
        this.elevationMin = elevationMin;
        this.elevationStep = elevationStep;
    }
}
