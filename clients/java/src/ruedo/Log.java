package ruedo;

import java.io.IOException;
import java.util.ArrayList;
import java.util.List;
import java.util.Map;
import java.util.TreeMap;
import java.util.function.Consumer;

/**
 * The log of a run: its messages by channel. They are read from the file on demand, so that a log
 * of any size is opened at once. {@link Ruedo#readLog} makes it. Thread safe.
 */
public final class Log {
    private static final double ALWAYS = Double.POSITIVE_INFINITY;

    private final String path;
    private Map<String, Integer> counts; // messages by channel; null: not read yet
    private String fault = "";

    Log(String path) {
        this.path = path;
        try (LogReader first = new LogReader(path)) {
            if (!first.next() && !first.fault.isEmpty())
                throw new RuedoException(path + ": it is not an LCM log: " + first.fault);
        } catch (IOException error) {
            throw new RuedoException(path + ": " + error.getMessage());
        }
    }

    /** Reads the log through, once. */
    private synchronized Map<String, Integer> counts() {
        if (counts != null) return counts;
        Map<String, Integer> found = new TreeMap<>();
        try (LogReader reader = new LogReader(path)) {
            while (reader.next()) found.merge(reader.channel, 1, Integer::sum);
            fault = reader.fault;
        } catch (IOException error) {
            throw new RuedoException(path + ": " + error.getMessage());
        }
        counts = found;
        return found;
    }

    /**
     * The channels of the log, sorted. The first call of this, {@link #count} or {@link #fault}
     * reads the log through.
     */
    public List<String> channels() {
        return List.copyOf(counts().keySet());
    }

    /** The number of messages on a channel; 0 for one that is not in the log. */
    public int count(String channel) {
        return counts().getOrDefault(channel, 0);
    }

    /**
     * "" if the file ends properly; else its truncation or damage, and at which byte. The messages
     * before that are readable.
     */
    public String fault() {
        counts();
        return fault;
    }

    /**
     * The samples on a channel, in order: {@code log.samples("p3at/lrf", Scan.class)}. Throws
     * UnknownName, with the log's channels; TypeMismatch.
     */
    public <T extends Sample> List<T> samples(String channel, Class<T> kind) {
        List<T> samples = new ArrayList<>();
        each(channel, kind, -ALWAYS, ALWAYS, samples::add);
        return samples;
    }

    /**
     * Calls {@code use} with each sample on a channel from {@code begin} to {@code end}, s of the
     * log's time, both included, in order: of a log of any size one is in memory. Earlier messages
     * are not read; infinities mean the log's beginning and end. Throws as {@link #samples}.
     */
    public <T extends Sample> void each(
            String channel, Class<T> kind, double begin, double end, Consumer<? super T> use) {
        eachBytes(
                channel,
                begin,
                end,
                message -> {
                    Sample sample = decoded(channel, message, null);
                    if (!kind.isInstance(sample)) {
                        throw new RuedoException.TypeMismatch(
                                channel
                                        + " carries samples of "
                                        + sample.getClass().getSimpleName()
                                        + ", not of "
                                        + kind.getSimpleName());
                    }
                    use.accept(kind.cast(sample));
                });
    }

    /** The messages on a channel as objects of a class that lcm-gen made. */
    public <M> List<M> messages(String channel, Class<M> type) {
        List<M> messages = new ArrayList<>();
        eachMessage(channel, type, -ALWAYS, ALWAYS, messages::add);
        return messages;
    }

    /** As {@link #each}, with objects of a class that lcm-gen made. */
    @SuppressWarnings("unchecked")
    public <M> void eachMessage(
            String channel, Class<M> type, double begin, double end, Consumer<? super M> use) {
        Conversions.Conversion conversion = MessageSample.of(type);
        eachBytes(
                channel,
                begin,
                end,
                message ->
                        use.accept(
                                ((MessageSample<M>) decoded(channel, message, conversion))
                                        .message));
    }

    /** The messages on a channel as they are, each type's fingerprint first. */
    public List<byte[]> bytes(String channel) {
        List<byte[]> messages = new ArrayList<>();
        eachBytes(channel, -ALWAYS, ALWAYS, messages::add);
        return messages;
    }

    /** As {@link #each}, with the messages as they are, each type's fingerprint first. */
    public void eachBytes(String channel, double begin, double end, Consumer<byte[]> use) {
        long beginUs = microseconds(begin);
        long endUs = microseconds(end);
        boolean found = false;
        try (LogReader reader = new LogReader(path)) {
            if (beginUs > -LogReader.LATEST) reader.seekTime(beginUs);
            while (reader.next() && reader.time <= endUs) {
                if (reader.time < beginUs || !reader.channel.equals(channel)) continue;
                found = true;
                use.accept(reader.data());
            }
        } catch (IOException error) {
            throw new RuedoException(path + ": it cannot be read any more: " + error.getMessage());
        }
        if (found || counts().containsKey(channel)) return;
        throw new RuedoException.UnknownName(
                path
                        + " has no channel '"
                        + channel
                        + "'; it has "
                        + (counts().isEmpty() ? "none" : String.join(", ", counts().keySet())));
    }

    private static long microseconds(double time) {
        double latest = LogReader.LATEST * 1e-6;
        return Math.round(Math.min(Math.max(time, -latest), latest) * 1e6);
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
