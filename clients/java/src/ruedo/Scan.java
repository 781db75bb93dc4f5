package ruedo;

/** A scan of a planar laser range finder, in the device's frame. */
public final class Scan extends Sample {
    /** m; +inf: no return, -inf: nearer than the minimum range. */
    public final float[] ranges;

    /** 0 to 1; empty when the device has none. */
    public final float[] intensities;

    /** rad, of ray 0, from the device's x axis towards y (left). */
    public final double angleMin;

    /** rad, between neighbouring rays. */
    public final double angleStep;

    Scan(long utime, float[] ranges, float[] intensities, double angleMin, double angleStep) {
        super(utime);
        this.ranges = ranges;
        this.intensities = intensities;
        this.angleMin = angleMin;
        this.angleStep = angleStep;
    }

    /** The angle of a ray, rad. */
    public double angle(int ray) {
        return angleMin + angleStep * ray;
    }

    /** The smallest range (m) between two angles (rad); +inf when nothing is there. */
    public double nearest(double fromAngle, double toAngle) {
        double nearest = Double.POSITIVE_INFINITY;
        for (int i = 0; i < ranges.length; i++) {
            if (angle(i) >= fromAngle && angle(i) <= toAngle)
                nearest = Math.min(nearest, ranges[i]);
        }
        return nearest;
    }
}
