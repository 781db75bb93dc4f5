package ruedo;

import java.io.IOException;
import java.util.ArrayList;
import java.util.HashMap;
import java.util.List;
import java.util.Map;

/**
 * The observations of a step: the state after its last step, and the sensor messages of all its
 * steps.
 */
public final class Observations extends State {
    /** A sensor message, undecoded. */
    public static final class Message {
        /** Number of the state. */
        public final long step;

        /** Its channel. */
        public final String channel;

        /** All of its bytes. */
        public final byte[] data;

        Message(long step, String channel, byte[] data) {
            this.step = step;
            this.channel = channel;
            this.data = data;
        }
    }

    /**
     * In the order in which the simulation made them; empty when a paused simulation is stepped.
     */
    public final List<Message> messages;

    private final Object lock = new Object();
    private Map<String, List<Message>> byChannel; // under lock; null: not requested yet

    Observations(State state, List<Message> messages) {
        super(
                state.utime,
                state.step,
                state.stateHash,
                state.paused,
                state.rate,
                state.name,
                state.position,
                state.orientation,
                state.linear,
                state.angular);
        this.messages = messages;
    }

    Observations(long utime, long step, long stateHash, List<Message> messages) {
        super(
                utime,
                step,
                stateHash,
                false,
                Double.POSITIVE_INFINITY,
                "",
                new double[3],
                new double[] {1.0, 0.0, 0.0, 0.0},
                new double[3],
                new double[3]);
        this.messages = messages;
    }

    /**
     * The samples of a device or stream, decoded, in order; none when none was due. Throws
     * TypeMismatch.
     */
    public <T extends Sample> List<T> all(Stream<T> stream) {
        List<T> samples = new ArrayList<>();
        for (Message message : on(stream.channel)) samples.add(sample(message, stream));
        return samples;
    }

    /** The last of them, or null. */
    public <T extends Sample> T latest(Stream<T> stream) {
        List<Message> found = on(stream.channel);
        return found.isEmpty() ? null : sample(found.get(found.size() - 1), stream);
    }

    /** Sorted once: a fleet asks for each of its robots. */
    private List<Message> on(String channel) {
        synchronized (lock) {
            if (byChannel == null) {
                byChannel = new HashMap<>();
                for (Message message : messages)
                    byChannel
                            .computeIfAbsent(message.channel, key -> new ArrayList<>())
                            .add(message);
            }
            return byChannel.getOrDefault(channel, List.of());
        }
    }

    @SuppressWarnings("unchecked")
    private static <T extends Sample> T sample(Message message, Stream<T> stream) {
        Conversions.Conversion conversion = stream.core.conversion;
        try {
            WireReader in = new WireReader(message.data);
            if (conversion != null && conversion.reads(in.int64()))
                return (T) conversion.decoder.decode(in);
        } catch (IOException error) {
            throw new RuedoException.TypeMismatch(
                    stream.channel
                            + ": a message is not a valid "
                            + stream.type
                            + ": "
                            + error.getMessage());
        }
        throw new RuedoException.TypeMismatch(
                stream.channel
                        + " carries another type than "
                        + stream.type
                        + ", or another version of it");
    }
}
