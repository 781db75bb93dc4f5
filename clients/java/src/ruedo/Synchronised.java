package ruedo;

import java.util.Map;

/**
 * Samples of streams, joined by stamp, from {@link Simulation#synchronised}.
 *
 * @param <A> kind of the first stream's samples
 * @param <B> kind of the second's
 */
public final class Synchronised<A extends Sample, B extends Sample> {
    /** The sample of the stream that paces the loop. */
    public final A first;

    /** The sample of the second stream, at the first one's time. */
    public final B second;

    private final Map<StreamCore<?>, Sample> all;

    Synchronised(A first, B second, Map<StreamCore<?>, Sample> all) {
        this.first = first;
        this.second = second;
        this.all = all;
    }

    /** The sample of any of the streams, at the first one's time: both.get(robot.imu()). */
    @SuppressWarnings("unchecked")
    public <T extends Sample> T get(Stream<T> stream) {
        Sample sample = all.get(stream.core);
        if (sample != null) return (T) sample;
        throw new RuedoException.UnknownName(
                stream.channel + " is not among the streams that synchronised() joins");
    }
}
