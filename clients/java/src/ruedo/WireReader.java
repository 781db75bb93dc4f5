package ruedo;

import java.io.IOException;
import java.nio.BufferUnderflowException;
import java.nio.ByteBuffer;
import java.nio.charset.StandardCharsets;
import java.util.ArrayList;
import java.util.List;
import java.util.regex.Pattern;

/**
 * Reads an LCM message field by field: what a length promises must be there before memory is taken
 * for it. (lcm-gen's own decoders allocate first, 8 GB for a length that lies.) Every method throws
 * IOException for bytes that are too few.
 */
final class WireReader {
    /** Control characters, Unicode's line ends, and the marks that change the order of text. */
    private static final String OBEYED =
            "\\p{Cc}\\u061c\\u200e\\u200f\\u2028-\\u202e\\u2066-\\u2069";

    private static final Pattern IN_NAMES = Pattern.compile("[" + OBEYED + "]");
    private static final Pattern IN_TEXTS = Pattern.compile("[" + OBEYED + "&&[^\n\t]]");

    private final ByteBuffer bytes; // big endian, as LCM writes

    WireReader(byte[] message) {
        bytes = ByteBuffer.wrap(message);
    }

    /** The whole message, whichever part was read. */
    byte[] whole() {
        return bytes.array();
    }

    private interface Read<T> {
        T read();
    }

    private <T> T get(Read<T> read) throws IOException {
        try {
            return read.read();
        } catch (BufferUnderflowException error) {
            throw new IOException("it is too short");
        }
    }

    byte int8() throws IOException {
        return get(bytes::get);
    }

    boolean bool() throws IOException {
        return int8() != 0;
    }

    short int16() throws IOException {
        return get(bytes::getShort);
    }

    int int32() throws IOException {
        return get(bytes::getInt);
    }

    long int64() throws IOException {
        return get(bytes::getLong);
    }

    float float32() throws IOException {
        return get(bytes::getFloat);
    }

    double float64() throws IOException {
        return get(bytes::getDouble);
    }

    /**
     * An int32_t that counts elements of at least so many bytes each, which must still be there.
     */
    int count(int elementSize) throws IOException {
        return fits(int32(), elementSize);
    }

    int fits(int n, int elementSize) throws IOException {
        if (n < 0 || n > bytes.remaining() / elementSize) {
            throw new IOException(
                    "a length of " + n + " with " + bytes.remaining() + " bytes left");
        }
        return n;
    }

    /** For an array with another number of elements. */
    static void checkProduct(int size, int rows, int columns) throws IOException {
        if (rows < 0 || columns < 0 || (long) rows * columns != size)
            throw new IOException("sizes that do not fit each other");
    }

    String string() throws IOException {
        int length = count(1); // with its closing zero
        if (length == 0) throw new IOException("a string without an end");
        byte[] text = bytes(length);
        return new String(text, 0, length - 1, StandardCharsets.UTF_8);
    }

    /** A string that is printed: a terminal obeys control characters, so a name has none. */
    String name() throws IOException {
        String text = string();
        if (hasControl(text)) throw new IOException("a name with control characters");
        return text;
    }

    /** A string that is printed; '?' replaces each control character but line ends and tabs. */
    String text() throws IOException {
        return printed(string());
    }

    static boolean hasControl(String name) {
        return IN_NAMES.matcher(name).find();
    }

    static String printed(String text) {
        return IN_TEXTS.matcher(text).replaceAll("?");
    }

    byte[] bytes(int n) throws IOException {
        byte[] values = new byte[fits(n, 1)];
        bytes.get(values);
        return values;
    }

    short[] int16s(int n) throws IOException {
        short[] values = new short[fits(n, 2)];
        for (int i = 0; i < n; i++) values[i] = int16();
        return values;
    }

    int[] int32s(int n) throws IOException {
        int[] values = new int[fits(n, 4)];
        for (int i = 0; i < n; i++) values[i] = int32();
        return values;
    }

    float[] floats(int n) throws IOException {
        float[] values = new float[fits(n, 4)];
        for (int i = 0; i < n; i++) values[i] = bytes.getFloat();
        return values;
    }

    double[] doubles(int n) throws IOException {
        double[] values = new double[fits(n, 8)];
        for (int i = 0; i < n; i++) values[i] = bytes.getDouble();
        return values;
    }

    long[] int64s(int n) throws IOException {
        long[] values = new long[fits(n, 8)];
        for (int i = 0; i < n; i++) values[i] = bytes.getLong();
        return values;
    }

    boolean[] bools(int n) throws IOException {
        boolean[] values = new boolean[fits(n, 1)];
        for (int i = 0; i < n; i++) values[i] = bytes.get() != 0;
        return values;
    }

    List<String> strings(int n) throws IOException {
        fits(n, 5);
        List<String> values = new ArrayList<>();
        for (int i = 0; i < n; i++) values.add(string());
        return values;
    }

    List<String> names(int n) throws IOException {
        fits(n, 5);
        List<String> values = new ArrayList<>();
        for (int i = 0; i < n; i++) values.add(name());
        return values;
    }
}
