package ruedo;

import java.io.IOException;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.function.Consumer;
import ruedo.lcmtypes.channel_info_t;

/**
 * A stream of samples from one channel. Thread safe; the first use subscribes.
 *
 * @param <T> kind of sample
 */
public class Stream<T extends Sample> {
    static final double DEFAULT_TIMEOUT = 5.0;    // s

    /** Its name on the bus. */
    public final String channel;
    /** Its message type. */
    public final String type;
    /** Hz of sim time; 0: every step, or when something happens. */
    public final double rate;

    final Simulation sim;
    private final long fingerprint;
    private final Conversions.Conversion conversion;
    private final List<Consumer<? super T>> callbacks = new CopyOnWriteArrayList<>();
    private boolean open;
    private T sample;
    private long count;    // samples received
    private long seen;     // of those, the newest that a call has returned
    private RuedoException fault;

    Stream(Simulation sim, channel_info_t info) {
        this.sim = sim;
        channel = info.name;
        type = info.type;
        rate = info.rate;
        fingerprint = info.fingerprint;
        conversion = Conversions.of(type);
    }

    /** {@link #latest(double)}, at most 5 s. */
    public T latest() {
        return latest(DEFAULT_TIMEOUT);
    }

    /** The newest sample. Before the first one it waits, at most timeout seconds of real time. */
    public T latest(double timeout) {
        return await(false, timeout);
    }

    /** {@link #next(double)}, at most 5 s. */
    public T next() {
        return next(DEFAULT_TIMEOUT);
    }

    /**
     * The newest sample that neither latest() nor next() of this channel has returned yet; waits for one, at most timeout
     * seconds of real time. A reader slower than the rate skips samples; onSample() skips none.
     */
    public T next(double timeout) {
        return await(true, timeout);
    }

    /**
     * Calls back in the receiving thread for every sample from now on. The callback must be quick, and must not wait for
     * other samples or replies.
     */
    public void onSample(Consumer<? super T> callback) {
        callbacks.add(callback);
        subscribe();
    }

    private void subscribe() {
        synchronized (this) {
            if (open) return;
            if (conversion == null) {
                throw new RuedoException.TypeMismatch(channel + ": this client does not know the type " + type
                        + " of the server's Ruedo " + sim.version());
            }
            if (fingerprint != conversion.fingerprint) throw mismatch(fingerprint);
            open = true;
        }
        sim.bus.subscribe(channel, this::receive);
    }

    private RuedoException.TypeMismatch mismatch(long found) {
        return new RuedoException.TypeMismatch(String.format(
                "%s carries another version of %s (fingerprint %016x) than this client reads (%016x): the server is Ruedo %s; "
                + "use the client of the same version", channel, type, found, conversion.fingerprint, sim.version()));
    }

    @SuppressWarnings("unchecked")
    private void receive(byte[] message) {
        T received = null;
        RuedoException wrong = null;
        try {
            WireReader in = new WireReader(message);
            long found = in.int64();
            if (found != conversion.fingerprint) throw mismatch(found);
            received = (T) conversion.decoder.decode(in);
        } catch (RuedoException error) {
            wrong = error;
        } catch (IOException error) {
            wrong = new RuedoException.TypeMismatch(channel + ": a message of " + message.length + " bytes is no valid " + type
                    + ": " + error.getMessage());
        }
        synchronized (this) {
            fault = wrong;
            if (received != null) {
                sample = received;
                count++;
            }
            notifyAll();
        }
        if (received == null) return;
        sim.noteTime(received.utime);
        for (Consumer<? super T> callback : callbacks) {
            try {
                callback.accept(received);
            } catch (RuntimeException error) {    // the receiving thread lives on
                System.err.println("ruedo: a callback on " + channel + " failed: " + error);
            }
        }
    }

    private T await(boolean newOne, double timeout) {
        subscribe();
        Deadline deadline = new Deadline(timeout);
        synchronized (this) {
            while (newOne ? count == seen : count == 0) {
                if (fault != null) {
                    RuedoException thrown = fault;
                    fault = null;
                    throw thrown;
                }
                if (deadline.passed()) {
                    throw new RuedoException.Timeout(String.format("no sample on %s within %s s (%s)", channel,
                            Deadline.text(timeout), sim.whatIsKnown(rate)));
                }
                deadline.waitOn(this, 500);
                sim.checkServer();
            }
            seen = count;
            return sample;
        }
    }

    @Override
    public String toString() {
        return channel + " (" + type + ")";
    }
}
