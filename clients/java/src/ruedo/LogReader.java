package ruedo;

import java.io.File;
import java.io.IOException;
import java.io.RandomAccessFile;
import java.nio.ByteBuffer;
import java.nio.charset.StandardCharsets;

/**
 * The events of a log, one after another: whatever its size, one of them is in memory. Of LCM's log
 * each is, big endian: sync word, number, time, lengths of channel and data, channel, data.
 */
final class LogReader implements AutoCloseable {
    private static final int SYNC = 0xEDA1DA01;
    private static final int HEAD = 28;
    private static final int LONGEST_CHANNEL = 1000;

    /** us, on either side of 0. */
    static final long LATEST = 9_000_000_000_000_000L;

    /** Of a message, in bytes: a picture of 8192 x 8192 pixels. */
    private static final int LARGEST = 8192 * 8192 * 4 + 65536;

    /** Bytes that are read faster than halved. */
    private static final int NEAR = 1 << 20;

    private final RandomAccessFile file;
    private final byte[] buffer = new byte[1 << 16];
    private long bufferAt; // of the file
    private int buffered; // bytes
    private long next; // where the next event begins
    private long dataAt;
    private int dataSize;

    final long size;
    String channel = "";
    long time; // us
    String fault = "";

    LogReader(String path) throws IOException {
        if (!new File(path).isFile()) {
            boolean there = new File(path).exists();
            throw new RuedoException(
                    path + (there ? ": it is not a file that can be read" : ": no such file"));
        }
        file = new RandomAccessFile(path, "r");
        size = file.length();
    }

    @Override
    public void close() throws IOException {
        file.close();
    }

    /** Copies up to that many bytes; returns how many there are. */
    private int read(long at, byte[] into, int count) throws IOException {
        int done = 0;
        while (done < count) {
            long from = at + done - bufferAt;
            if (from < 0 || from >= buffered) {
                bufferAt = at + done;
                file.seek(bufferAt);
                buffered = Math.max(file.read(buffer), 0);
                from = 0;
                if (buffered == 0) break;
            }
            int part = (int) Math.min(count - done, buffered - from);
            System.arraycopy(buffer, (int) from, into, done, part);
            done += part;
        }
        return done;
    }

    /** False at the end, and where the log was cut off, or is damaged. */
    boolean next() throws IOException {
        if (next >= size) return false;
        byte[] head = new byte[HEAD];
        int got = read(next, head, HEAD);
        ByteBuffer numbers = ByteBuffer.wrap(head);
        String cutOff = "it was cut off in the event that begins at byte " + next;
        String damaged = "it is damaged at byte " + next;
        if (got < 4) return wrong(cutOff);
        if (numbers.getInt(0) != SYNC) return wrong(damaged);
        if (got < HEAD) return wrong(cutOff);
        int nameSize = numbers.getInt(20);
        dataSize = numbers.getInt(24);
        if (nameSize < 0 || nameSize > LONGEST_CHANNEL || dataSize < 0 || dataSize > LARGEST)
            return wrong(damaged);
        dataAt = next + HEAD + nameSize;
        if (dataAt + dataSize > size) return wrong(cutOff); // before memory is taken for it
        byte[] name = new byte[nameSize];
        if (read(next + HEAD, name, nameSize) < nameSize) return wrong(cutOff);
        channel = new String(name, StandardCharsets.UTF_8);
        time = numbers.getLong(12);
        next = dataAt + dataSize;
        return true;
    }

    private boolean wrong(String what) {
        fault = what;
        return false;
    }

    /** Of the event. */
    byte[] data() throws IOException {
        byte[] bytes = new byte[dataSize];
        if (read(dataAt, bytes, dataSize) < dataSize)
            throw new IOException("it became shorter since it was opened");
        return bytes;
    }

    /** Skips events that are all earlier than that time; maybe not all of them. */
    void seekTime(long wanted) throws IOException {
        long low = 0; // an event begins here, and is before the time, or the first
        long high = size;
        byte[] head = new byte[HEAD];
        while (high - low > NEAR) {
            long middle = low + (high - low) / 2;
            long found = eventAfter(middle, high);
            if (found >= 0
                    && read(found, head, HEAD) == HEAD
                    && ByteBuffer.wrap(head).getLong(12) < wanted) low = found;
            else high = middle;
        }
        next = low;
    }

    /**
     * The first event that begins between the two; -1: none. What only looks like one in a message
     * has no other behind it.
     */
    private long eventAfter(long begin, long end) throws IOException {
        byte[] head = new byte[HEAD];
        byte[] part = new byte[buffer.length];
        for (long at = begin; at < end; at += part.length - HEAD) {
            int got = read(at, part, part.length);
            for (int i = 0; i + HEAD <= got && i < part.length - HEAD; ++i) {
                if (at + i >= end) return -1;
                if (part[i] != (byte) 0xED || !isHead(part, i)) continue;
                ByteBuffer numbers = ByteBuffer.wrap(part, i, HEAD);
                long behind =
                        at + i + HEAD + numbers.getInt(i + 20) + (long) numbers.getInt(i + 24);
                if (behind == size || (read(behind, head, HEAD) == HEAD && isHead(head, 0)))
                    return at + i;
            }
        }
        return -1;
    }

    private static boolean isHead(byte[] bytes, int at) {
        ByteBuffer numbers = ByteBuffer.wrap(bytes);
        int nameSize = numbers.getInt(at + 20);
        int dataSize = numbers.getInt(at + 24);
        return numbers.getInt(at) == SYNC
                && nameSize >= 0
                && nameSize <= LONGEST_CHANNEL
                && dataSize >= 0
                && dataSize <= LARGEST
                && Math.abs(numbers.getLong(at + 12)) <= LATEST;
    }
}
