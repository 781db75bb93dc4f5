package ruedo;

import java.util.Iterator;
import java.util.stream.StreamSupport;

/**
 * Reads a stream at a pace of its own, which other readers of the stream do not change. Thread
 * safe.
 *
 * @param <T> kind of sample
 */
public class Reader<T extends Sample> implements Iterable<T> {
    static final double DEFAULT_TIMEOUT = 5.0; // s

    private final StreamCore<T> samples;
    private final StreamCore.Place place;

    Reader(StreamCore<T> samples, StreamCore.Place place) {
        this.samples = samples;
        this.place = place;
    }

    /** {@link #latest(double)}, at most 5 s. */
    public T latest() {
        return latest(DEFAULT_TIMEOUT);
    }

    /** The newest sample. Before the first one it waits, at most timeout seconds of real time. */
    public T latest(double timeout) {
        return samples.read(place, false, timeout);
    }

    /** {@link #next(double)}, at most 5 s. */
    public T next() {
        return next(DEFAULT_TIMEOUT);
    }

    /**
     * The newest sample that neither latest() nor next() has returned yet, or of the newest
     * queueDepth() the oldest; waits for one, at most timeout seconds of real time. After await()
     * of a motion it is one from its end or later. A reader slower than the rate skips samples,
     * which dropped() counts; onSample() skips none.
     */
    public T next(double timeout) {
        return samples.read(place, true, timeout);
    }

    /**
     * Iterates over the results of next(), until the run ends: for (Scan scan : robot.lrf()). A
     * loop slower than the stream gets the newest sample each time, or the oldest of queueDepth().
     */
    @Override
    public Iterator<T> iterator() {
        return new UntilRunEnds<>(() -> next(Double.POSITIVE_INFINITY));
    }

    /** The same as a stream of Java's: robot.lrf().samples().limit(10).forEach(...). */
    public java.util.stream.Stream<T> samples() {
        return StreamSupport.stream(spliterator(), false);
    }

    /**
     * The number of samples that are kept for next() and loops, from 1 (only the newest; the
     * default) to 1000. With more, next() returns the oldest kept sample; if more arrive, the
     * oldest are dropped, and dropped() counts them.
     */
    public int queueDepth() {
        return samples.queueDepth(place);
    }

    /** Sets {@link #queueDepth()}. */
    public void setQueueDepth(int depth) {
        samples.setQueueDepth(place, depth);
    }

    /**
     * The number of samples between those that this reader got: newer ones had arrived, or they
     * were lost on the way.
     */
    public long dropped() {
        return samples.skipped(place);
    }
}
