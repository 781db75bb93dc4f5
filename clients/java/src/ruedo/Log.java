package ruedo;

import java.io.File;
import java.io.IOException;
import java.io.RandomAccessFile;
import java.nio.ByteBuffer;
import java.nio.charset.StandardCharsets;
import java.util.ArrayList;
import java.util.List;
import java.util.Map;
import java.util.TreeMap;

/**
 * What a run recorded: its messages by channel. They are read from the file when they are asked
 * for. {@link Ruedo#readLog} makes it. Thread safe.
 *
 * <p>An event of LCM's log is, big endian: sync word, number, time, lengths of channel and data,
 * channel, data.
 */
public final class Log {
    private static final int SYNC = 0xEDA1DA01;
    private static final int HEAD = 28;
    private static final int LONGEST_CHANNEL = 1000;

    /** Of a message, in bytes: a picture of 8192 x 8192 pixels. */
    private static final int LARGEST = 8192 * 8192 * 4 + 65536;

    private static final class Place {
        final long offset; // of the data
        final int size;

        Place(long offset, int size) {
            this.offset = offset;
            this.size = size;
        }
    }

    private final String path;
    private final Map<String, List<Place>> places = new TreeMap<>();
    private String fault = "";

    Log(String path) {
        this.path = path;
        if (!new File(path).isFile()) {
            boolean there = new File(path).exists();
            throw new RuedoException(
                    path + (there ? ": it is not a file that can be read" : ": no such file"));
        }
        try (RandomAccessFile file = new RandomAccessFile(path, "r")) {
            long begin = 0;
            while (begin >= 0 && begin < file.length()) begin = addEvent(file, begin);
        } catch (IOException error) {
            throw new RuedoException(path + ": " + error.getMessage());
        }
        if (!fault.isEmpty() && places.isEmpty())
            throw new RuedoException(path + ": it is not an LCM log: " + fault);
    }

    /** Where the next one begins; -1 where the log was cut off, or is damaged. */
    private long addEvent(RandomAccessFile file, long begin) throws IOException {
        byte[] head = new byte[(int) Math.min(HEAD, file.length() - begin)];
        file.seek(begin);
        file.readFully(head);
        ByteBuffer numbers = ByteBuffer.wrap(head);
        String cutOff = "it was cut off in the event that begins at byte " + begin;
        String damaged = "it is damaged at byte " + begin;
        if (head.length < 4) return wrong(cutOff);
        if (numbers.getInt(0) != SYNC) return wrong(damaged);
        if (head.length < HEAD) return wrong(cutOff);
        int nameSize = numbers.getInt(20);
        int size = numbers.getInt(24);
        if (nameSize < 0 || nameSize > LONGEST_CHANNEL || size < 0 || size > LARGEST)
            return wrong(damaged);
        long data = begin + HEAD + nameSize;
        if (data + size > file.length()) return wrong(cutOff); // before memory is taken for it
        byte[] name = new byte[nameSize];
        file.readFully(name);
        places.computeIfAbsent(new String(name, StandardCharsets.UTF_8), key -> new ArrayList<>())
                .add(new Place(data, size));
        return data + size;
    }

    private long wrong(String what) {
        fault = what;
        return -1;
    }

    /** The channels of the log, sorted. */
    public List<String> channels() {
        return List.copyOf(places.keySet());
    }

    /** The number of messages on a channel; 0 for one that is not in the log. */
    public int count(String channel) {
        return places.getOrDefault(channel, List.of()).size();
    }

    /**
     * "" where the file ends properly; else how it was cut off or is damaged, and at which byte.
     * What came before that is here.
     */
    public String fault() {
        return fault;
    }

    /**
     * The samples on a channel, in order: {@code log.samples("p3at/lrf", Scan.class)}. Throws
     * UnknownName, with the channels that there are; TypeMismatch.
     */
    public <T extends Sample> List<T> samples(String channel, Class<T> kind) {
        List<T> samples = new ArrayList<>();
        for (byte[] message : bytes(channel)) {
            Sample sample = decoded(channel, message, null);
            if (!kind.isInstance(sample)) {
                throw new RuedoException.TypeMismatch(
                        channel
                                + " carries samples of "
                                + sample.getClass().getSimpleName()
                                + ", not of "
                                + kind.getSimpleName());
            }
            samples.add(kind.cast(sample));
        }
        return samples;
    }

    /** The messages on a channel as objects of a class that lcm-gen made. */
    @SuppressWarnings("unchecked")
    public <M> List<M> messages(String channel, Class<M> type) {
        Conversions.Conversion conversion = MessageSample.of(type);
        List<M> messages = new ArrayList<>();
        for (byte[] message : bytes(channel))
            messages.add(((MessageSample<M>) decoded(channel, message, conversion)).message);
        return messages;
    }

    /** The messages on a channel as they are, each type's fingerprint first. */
    public List<byte[]> bytes(String channel) {
        List<Place> found = places.get(channel);
        if (found == null) {
            throw new RuedoException.UnknownName(
                    path
                            + " has no channel '"
                            + channel
                            + "'; it has "
                            + (places.isEmpty() ? "none" : String.join(", ", places.keySet())));
        }
        List<byte[]> messages = new ArrayList<>();
        try (RandomAccessFile file = new RandomAccessFile(path, "r")) {
            for (Place place : found) {
                byte[] message = new byte[place.size];
                file.seek(place.offset);
                file.readFully(message);
                messages.add(message);
            }
        } catch (IOException error) {
            throw new RuedoException(path + ": it cannot be read any more: " + error.getMessage());
        }
        return messages;
    }

    /** given: null takes the one that the message's fingerprint says. */
    private static Sample decoded(String channel, byte[] message, Conversions.Conversion given) {
        try {
            WireReader in = new WireReader(message);
            long fingerprint = in.int64();
            Conversions.Conversion conversion = given == null ? Conversions.of(fingerprint) : given;
            if (conversion != null && conversion.reads(fingerprint))
                return conversion.decoder.decode(in);
            throw new RuedoException.TypeMismatch(
                    String.format(
                            "%s carries another type than %s, or another version of it"
                                    + " (fingerprint %016x)",
                            channel, given == null ? "a sample's" : given.key, fingerprint));
        } catch (IOException error) {
            throw new RuedoException.TypeMismatch(
                    channel + ": a message is not valid: " + error.getMessage());
        }
    }
}
