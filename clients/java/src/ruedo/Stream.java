package ruedo;

import ruedo.lcmtypes.channel_info_t;

import java.util.function.Consumer;

/**
 * A stream of samples from one channel. Thread safe; the first use subscribes. It is a reader of
 * itself, the same one as every stream of the channel that the robot returns; who reads beside it
 * takes a {@link #reader()} of its own.
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

    /** A reader that has seen nothing yet. */
    public Reader<T> reader() {
        return new Reader<>(core, new StreamCore.Place());
    }

    /**
     * Calls back in the receiving thread for every sample from now on, until what it returns is
     * closed (or the simulation). The callback must be quick, and cannot wait for other samples or
     * replies: such a call throws RuedoException.
     */
    public Subscription onSample(Consumer<? super T> callback) {
        return core.onSample(callback);
    }

    @Override
    public String toString() {
        return channel + " (" + type + ")";
    }
}
