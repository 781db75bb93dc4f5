package ruedo;

/** A camera's intrinsics: a pinhole with OpenCV's distortion. */
public final class CameraInfo extends Sample {
    /** Pixels. */
    public final int width;

    /** Pixels. */
    public final int height;

    /** Pixels. */
    public final double fx;

    /** Pixels. */
    public final double fy;

    /** Pixels. */
    public final double cx;

    /** Pixels. */
    public final double cy;

    /** k1, k2, p1, p2, k3. */
    public final double[] distortion;

    CameraInfo(
            long utime,
            int width,
            int height,
            double fx,
            double fy,
            double cx,
            double cy,
            double[] distortion) {
        super(utime);
        this.width = width;
        this.height = height;
        this.fx = fx;
        this.fy = fy;
        this.cx = cx;
        this.cy = cy;
        this.distortion = distortion;
    }
}
