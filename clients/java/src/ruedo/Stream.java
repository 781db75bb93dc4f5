package ruedo;

import ruedo.lcmtypes.channel_info_t;

import java.util.Locale;
import java.util.function.Consumer;

/**
 * A stream of samples from one channel. Thread safe; the first use subscribes. It is a reader of
 * itself, the same one as every stream of the channel that the robot returns; for an independent
 * one take a {@link #reader()}.
 *
 * @param <T> kind of sample
 */
public class Stream<T extends Sample> extends Reader<T> {
    /** Its name on the bus. */
    public final String channel;

    /** Its message type. */
    public final String type;

    /** Hz of sim time; 0: every step, or when something happens. */
    public final double rate;

    final StreamCore<T> core;

    Stream(StreamCore<T> core, channel_info_t info) {
        super(core, core.place);
        this.core = core;
        channel = info.name;
        type = info.type;
        rate = info.rate;
    }

    /** A new reader, which has read no sample yet. */
    public Reader<T> reader() {
        return reader(1);
    }

    /** The same with a {@link #queueDepth()} of its own. */
    public Reader<T> reader(int depth) {
        Reader<T> made = new Reader<>(core, new StreamCore.Place());
        made.setQueueDepth(depth);
        return made;
    }

    /** {@link #at(long, double)}, at most 5 s. */
    public T at(long utime) {
        return at(utime, DEFAULT_TIMEOUT);
    }

    /**
     * The sample of a time (us of sim time, such as scan.utime): waits until the stream has reached
     * it, at most timeout seconds of real time. If no sample is of that time, a pose or odometry is
     * interpolated between its neighbours, and other streams return the nearest sample. A stream
     * keeps its last 256 samples, of 4 MB at most, from its first use on: for an earlier time it
     * throws Timeout; {@link Simulation#synchronised} joins streams from the beginning.
     */
    public T at(long utime, double timeout) {
        T found = core.at(utime, timeout);
        if (found != null) return found;
        throw new RuedoException.Timeout(
                String.format(
                        Locale.ROOT,
                        "%s has no sample of %s s: those that it has kept, from its first use on,"
                                + " begin at %s s. Use it before, or sim.synchronised()",
                        channel,
                        Deadline.text(utime * 1e-6),
                        Deadline.text(core.keptFrom() * 1e-6)));
    }

    /**
     * The number of samples that latest() and next() have skipped, since newer ones had arrived or
     * they were lost on the way; and of those that a callback was too slow for.
     */
    @Override
    public long dropped() {
        return super.dropped() + core.missed();
    }

    /**
     * Calls back for every sample from now on, until what it returns is closed (or the simulation).
     * All callbacks run in one thread of their own, one at a time, in the order in which the
     * samples came. A server that launch() started waits for them; with another one, and more than
     * a megabyte of samples behind, they get the newest of each channel ({@link #dropped()}). In
     * lockstep they run in the thread that calls step(), before it returns. A callback cannot wait
     * for other samples or replies: such a call throws RuedoException.
     */
    public Subscription onSample(Consumer<? super T> callback) {
        return core.onSample(callback);
    }

    /** The same in the receiving thread, for what is this package's own. */
    Subscription onArrival(Consumer<? super T> callback) {
        return core.onArrival(callback);
    }

    @Override
    public String toString() {
        return channel + " (" + type + ")";
    }
}
