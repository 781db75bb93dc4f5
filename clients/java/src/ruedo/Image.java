package ruedo;

import java.awt.image.BufferedImage;
import java.io.ByteArrayInputStream;
import java.io.IOException;
import java.nio.file.Files;
import java.nio.file.Path;

import javax.imageio.ImageIO;

/** A picture. */
public final class Image extends Sample {
    /** Pixels. */
    public final int width;

    /** Pixels. */
    public final int height;

    /**
     * "jpeg", "rgb", "bgr", "gray", "gray16" (labels: body index + 1), "float32" (depth, m; +inf:
     * nothing, -inf: nearer than the camera sees).
     */
    public final String format;

    /** Bytes in a row, 0 for jpeg. */
    public final int rowStride;

    /** As they came: rows from the top, or a JPEG file. */
    public final byte[] data;

    Image(long utime, int width, int height, String format, int rowStride, byte[] data) {
        super(utime);
        this.width = width;
        this.height = height;
        this.format = format;
        this.rowStride = rowStride;
        this.data = data;
    }

    /**
     * The picture, decoded; formats "jpeg", "rgb", "bgr" and "gray".
     *
     * @throws IOException for other formats, and for data that is not what it says
     */
    public BufferedImage image() throws IOException {
        if (format.equals("jpeg")) {
            BufferedImage decoded = ImageIO.read(new ByteArrayInputStream(data));
            if (decoded == null) throw new IOException("the picture is no valid JPEG");
            return decoded;
        }
        int channels =
                format.equals("gray") ? 1 : format.equals("rgb") || format.equals("bgr") ? 3 : 0;
        int stride = rowStride > 0 ? rowStride : width * channels;
        if (channels == 0)
            throw new IOException("a picture of the format " + format + " has no colours");
        if (width <= 0
                || height <= 0
                || stride < width * channels
                || (long) stride * height > data.length) {
            throw new IOException("the picture's size does not fit its " + data.length + " bytes");
        }
        BufferedImage result = new BufferedImage(width, height, BufferedImage.TYPE_INT_RGB);
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                int at = y * stride + x * channels;
                int first = data[at] & 255,
                        second = data[at + channels / 2] & 255,
                        third = data[at + channels - 1] & 255;
                boolean bgr = format.equals("bgr");
                result.setRGB(
                        x, y, (bgr ? third : first) << 16 | second << 8 | (bgr ? first : third));
            }
        }
        return result;
    }

    /** Writes a JPEG's bytes as they are; "rgb", "bgr" and "gray" as PNG. */
    public void save(Path file) throws IOException {
        if (format.equals("jpeg")) {
            Files.write(file, data);
        } else {
            ImageIO.write(image(), "png", file.toFile());
        }
    }
}
