package ruedo;

import ruedo.lcmtypes.channel_info_t;

import java.io.IOException;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.function.Consumer;

/**
 * The samples of a channel, decoded in one way: all streams of it share them, whatever ruedo/info
 * said of the channel when each was made. Thread safe.
 *
 * @param <T> kind of sample
 */
final class StreamCore<T extends Sample> {
    /** How far a reader has come. */
    static final class Place {
        private long seen; // of the samples received, the newest that a call has returned
    }

    final Simulation sim;
    final String channel;
    final String type;
    final Conversions.Conversion conversion; // null: there is none for the type
    final Place place = new Place(); // of the streams, where they are readers themselves
    private final List<Subscription> callbacks = new CopyOnWriteArrayList<>();
    private Subscription source; // these under this object's monitor
    private T sample;
    private long count; // samples received
    private RuedoException fault;

    StreamCore(Simulation sim, channel_info_t info, Conversions.Conversion conversion) {
        this.sim = sim;
        channel = info.name;
        type = info.type;
        this.conversion = conversion;
    }

    Subscription onSample(Consumer<? super T> callback) {
        Subscription subscription = Subscription.of(channel, callback, callbacks::remove);
        subscribe();
        callbacks.add(subscription);
        return subscription;
    }

    private void subscribe() {
        sim.checkOpen();
        synchronized (this) {
            if (source != null) return;
            if (conversion == null) {
                throw new RuedoException.TypeMismatch(
                        channel
                                + " carries "
                                + type
                                + ", of which this client has no samples: robot.stream(\""
                                + channel.substring(channel.lastIndexOf('/') + 1)
                                + "\", "
                                + type
                                + ".class) takes the class that lcm-gen made of its .lcm file");
            }
            channel_info_t now = sim.info().output(channel);
            if (now != null && !conversion.reads(now.fingerprint)) throw mismatch(now.fingerprint);
            source = sim.bus.subscribe(channel, this::receive);
        }
    }

    /** Its robot is gone. */
    void end() {
        Subscription ended;
        synchronized (this) {
            ended = source;
            source = null;
        }
        if (ended != null) ended.close();
    }

    /** What came is of a run that has ended. */
    synchronized void forget() {
        sample = null;
        fault = null;
    }

    private RuedoException.TypeMismatch mismatch(long found) {
        if (!conversion.key.isEmpty()) {
            return new RuedoException.TypeMismatch(
                    String.format(
                            "%s carries %s (fingerprint %016x), which %s (%016x) does not read: it"
                                + " is another type, or made of another version of its .lcm file",
                            channel, type, found, conversion.key, conversion.fingerprint));
        }
        return new RuedoException.TypeMismatch(
                String.format(
                        "%s carries another version of %s (fingerprint %016x) than this client"
                            + " reads (%016x): the server is Ruedo %s; use the client of the same"
                            + " version",
                        channel, type, found, conversion.fingerprint, sim.version()));
    }

    @SuppressWarnings("unchecked")
    private void receive(byte[] message) {
        if (sim.isClosed() || sim.inDoubt()) return;
        T received = null;
        RuedoException wrong = null;
        try {
            WireReader in = new WireReader(message);
            long found = in.int64();
            if (!conversion.reads(found)) throw mismatch(found);
            received = (T) conversion.decoder.decode(in);
        } catch (RuedoException error) {
            wrong = error;
        } catch (IOException error) {
            wrong =
                    new RuedoException.TypeMismatch(
                            channel
                                    + ": a message of "
                                    + message.length
                                    + " bytes is no valid "
                                    + type
                                    + ": "
                                    + error.getMessage());
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
        if (received.utime != 0) sim.noteTime(received.utime);
        for (Subscription callback : callbacks) callback.call(received);
    }

    T read(Place reader, boolean newOne, double timeout) {
        subscribe();
        Deadline deadline = new Deadline(timeout);
        synchronized (this) {
            while (sample == null || (newOne && count == reader.seen)) {
                if (fault != null) {
                    RuedoException thrown = fault;
                    fault = null;
                    throw thrown;
                }
                sim.checkMayWait();
                if (deadline.passed()) {
                    throw new RuedoException.Timeout(
                            String.format(
                                    "no sample on %s within %s s (%s)",
                                    channel, Deadline.text(timeout), whatIsKnown()));
                }
                deadline.waitOn(this, 500);
                sim.checkServer();
            }
            reader.seen = count;
            return sample;
        }
    }

    private String whatIsKnown() {
        channel_info_t now = sim.info().output(channel);
        return sim.whatIsKnown(now == null ? 0.0 : now.rate);
    }
}
