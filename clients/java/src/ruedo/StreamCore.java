package ruedo;

import ruedo.lcmtypes.channel_info_t;

import java.io.IOException;
import java.nio.ByteBuffer;
import java.util.ArrayDeque;
import java.util.ArrayList;
import java.util.Iterator;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.concurrent.atomic.AtomicLong;
import java.util.function.BooleanSupplier;
import java.util.function.Consumer;

/**
 * The samples of a channel, decoded in one way: all streams of it share them, also those from an
 * earlier ruedo/info. The receiving thread keeps the newest message undecoded; readers decode it,
 * and so does the thread of the callbacks. Thread safe.
 *
 * @param <T> kind of sample
 */
final class StreamCore<T extends Sample> {
    private static final long NO_TIME = Long.MAX_VALUE; // its type does not say
    private static final int UTIME_AT = 8; // in all of the server's own types

    /** Periods: gaps of samples that are taken at whole steps tell no more than that. */
    private static final double MOST_UNEVEN = 0.25;

    private static final int MOST_KEPT = 256; // of what came before, where no depth is larger
    private static final long MOST_KEPT_BYTES = 4 << 20;
    private static final int MOST_DEPTH = 1000;

    /** The progress of a reader. */
    static final class Place {
        private long seen; // of the samples of the stream, the last that a call has returned
        private long skipped;
        private int depth = 1;
    }

    /** A message as it came. */
    private final class Arrival {
        final byte[] message;
        final long utime; // us
        long number; // of the samples of the stream, with those that were lost
        private volatile T sample;

        Arrival(byte[] message) {
            this.message = message;
            boolean timed = hasTime && message.length >= UTIME_AT + 8;
            utime = timed ? ByteBuffer.wrap(message).getLong(UTIME_AT) : NO_TIME;
        }

        /** Decoded once; by two threads at most twice. */
        T sample() {
            if (sample == null) sample = decoded(message);
            return sample;
        }

        void callBack() {
            T decoded;
            try {
                decoded = sample();
            } catch (RuedoException error) {
                fail(error);
                return;
            }
            for (Subscription callback : callbacks) callback.call(decoded);
        }
    }

    final Simulation sim;
    final String channel;
    final String type;
    final Conversions.Conversion conversion; // null if the type has none
    final Place place = new Place(); // of the streams, where they are readers themselves
    private final boolean hasTime;
    private final double period; // us; 0: lost samples cannot be counted
    private final List<Subscription> arrivals = new CopyOnWriteArrayList<>(); // the package's own
    private final List<Subscription> callbacks = new CopyOnWriteArrayList<>();
    private final AtomicLong missed = new AtomicLong(); // by the callbacks
    private final List<Thread> waiting = new ArrayList<>(); // these under this object's monitor
    private Subscription source;
    private Arrival newest;
    private final ArrayDeque<Arrival> kept = new ArrayDeque<>(); // the newest last
    private long keptBytes;
    private int leastKept = 1; // the largest depth of a reader
    private long count; // samples that came or were lost
    private long lastUtime = NO_TIME;
    private RuedoException fault;

    StreamCore(Simulation sim, channel_info_t info, Conversions.Conversion conversion) {
        this.sim = sim;
        channel = info.name;
        type = info.type;
        this.conversion = conversion;
        hasTime = Conversions.of(type) != null;
        double steps = sim.info().head.step_us * 1e-6 * info.rate; // in a period
        period = info.rate > 0.0 && steps <= MOST_UNEVEN ? 1e6 / info.rate : 0.0;
    }

    Subscription onSample(Consumer<? super T> callback) {
        Subscription subscription = add(callbacks, callback, sim.faults);
        sim.progress.listens();
        return subscription;
    }

    /** In the receiving thread, for this package's own use. */
    Subscription onArrival(Consumer<? super T> callback) {
        return add(arrivals, callback, null);
    }

    private Subscription add(
            List<Subscription> all, Consumer<? super T> callback, CallbackFaults faults) {
        Subscription subscription = Subscription.of(channel, callback, faults, all::remove);
        subscribe();
        all.add(subscription);
        return subscription;
    }

    void subscribe() {
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

    /** Stops when the robot is gone. */
    void end() {
        Subscription ended;
        synchronized (this) {
            ended = source;
            source = null;
        }
        if (ended != null) ended.close();
    }

    /** Forgets the samples of a run that has ended. */
    synchronized void forget() {
        newest = null;
        fault = null;
        lastUtime = NO_TIME;
        kept.clear();
        keptBytes = 0;
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

    private RuedoException.TypeMismatch invalid(byte[] message, IOException error) {
        return new RuedoException.TypeMismatch(
                channel
                        + ": a message of "
                        + message.length
                        + " bytes is not a valid "
                        + type
                        + ": "
                        + error.getMessage());
    }

    @SuppressWarnings("unchecked")
    private T decoded(byte[] message) {
        try {
            WireReader in = new WireReader(message);
            in.int64(); // fingerprint
            return (T) conversion.decoder.decode(in);
        } catch (IOException error) {
            throw invalid(message, error);
        }
    }

    private void receive(byte[] message) {
        if (sim.isClosed() || sim.inDoubt()) return;
        Arrival arrival = new Arrival(message);
        T sample = null;
        try {
            long found = new WireReader(message).int64();
            if (!conversion.reads(found)) throw mismatch(found);
            if (!arrivals.isEmpty()) sample = arrival.sample();
        } catch (RuedoException error) {
            fail(error);
            return;
        } catch (IOException error) {
            fail(invalid(message, error));
            return;
        }
        if (arrival.utime != NO_TIME) sim.clock.note(arrival.utime);
        take(arrival);
        if (sample != null) for (Subscription own : arrivals) own.call(sample);
        if (!callbacks.isEmpty()) sim.callbacks.put(arrival::callBack, this, message.length);
    }

    private synchronized void take(Arrival arrival) {
        newest = arrival;
        fault = null;
        count += 1 + lostBefore(arrival.utime);
        arrival.number = count;
        keep(arrival);
        if (!waiting.isEmpty()) sim.progress.use(sim.clock.utime(), waiting);
        waiting.clear(); // a thread that waits on registers again
        notifyAll();
    }

    private void keep(Arrival arrival) {
        if (!kept.isEmpty() && arrival.utime < kept.getLast().utime) { // sim time was reset
            kept.clear();
            keptBytes = 0;
        }
        kept.addLast(arrival);
        keptBytes += arrival.message.length;
        while (kept.size() > leastKept && (kept.size() > MOST_KEPT || keptBytes > MOST_KEPT_BYTES))
            keptBytes -= kept.removeFirst().message.length;
    }

    synchronized long keptFrom() {
        return kept.isEmpty() ? 0 : kept.getFirst().utime;
    }

    /** The sample of that time; null if it is older than the kept ones. */
    T at(long utime, double timeout) {
        if (!hasTime)
            throw new RuedoException.NotSupported(
                    channel + " carries " + type + ", whose messages have no time");
        subscribe();
        sim.noteUse();
        sim.bus.catchUp();
        Arrival before = null, after = null;
        synchronized (this) {
            await(() -> !kept.isEmpty() && kept.getLast().utime >= utime, timeout);
            for (Arrival arrival : kept) {
                after = arrival;
                if (arrival.utime >= utime) break;
                before = arrival;
            }
        }
        sim.noteUse();
        if (after.utime == utime) return after.sample();
        return before == null ? null : between(before.sample(), after.sample(), utime);
    }

    @SuppressWarnings("unchecked")
    private T between(T before, T after, long utime) {
        if (before instanceof Pose) return (T) ((Pose) before).interpolated((Pose) after, utime);
        if (before instanceof Odometry)
            return (T) ((Odometry) before).interpolated((Odometry) after, utime);
        return utime - before.utime < after.utime - utime ? before : after;
    }

    /** Keeps the error for the readers: the receiving thread continues. */
    private synchronized void fail(RuedoException error) {
        fault = error;
        notifyAll();
    }

    /** The number of samples lost since the last one. */
    private long lostBefore(long utime) {
        long last = lastUtime;
        lastUtime = utime;
        if (period == 0.0 || last == NO_TIME || utime == NO_TIME || utime <= last) return 0;
        return Math.max(0, Math.round((utime - last) / period) - 1);
    }

    /** A callback does not get a sample. */
    void miss() {
        missed.incrementAndGet();
    }

    long missed() {
        return missed.get();
    }

    synchronized long skipped(Place reader) {
        return reader.skipped;
    }

    synchronized int queueDepth(Place reader) {
        return reader.depth;
    }

    synchronized void setQueueDepth(Place reader, int depth) {
        if (depth < 1 || depth > MOST_DEPTH)
            throw new IllegalArgumentException(
                    "queueDepth is " + depth + "; allowed are 1 to " + MOST_DEPTH);
        reader.depth = depth;
        leastKept = Math.max(leastKept, depth);
    }

    T read(Place reader, boolean newOne, double timeout) {
        subscribe();
        sim.noteUse();
        sim.bus.catchUp();
        long notBefore = newOne ? sim.notBefore() : Long.MIN_VALUE;
        Arrival arrival;
        synchronized (this) {
            await(() -> found(reader, newOne, notBefore) != null, timeout);
            arrival = found(reader, newOne, notBefore);
            if (reader.seen > 0) reader.skipped += Math.max(0, arrival.number - reader.seen - 1);
            reader.seen = arrival.number;
        }
        sim.noteUse();
        try {
            return arrival.sample();
        } catch (RuedoException error) {
            synchronized (this) {
                if (newest == arrival) newest = null;
            }
            throw error;
        }
    }

    /** The reader's sample; null if it has not arrived yet. */
    private Arrival found(Place reader, boolean newOne, long notBefore) {
        if (!newOne) return newest;
        Arrival oldest = null;
        int left = reader.depth;
        for (Iterator<Arrival> all = kept.descendingIterator(); all.hasNext() && left > 0; left--) {
            Arrival arrival = all.next();
            if (arrival.number <= reader.seen || arrival.utime < notBefore) break;
            oldest = arrival;
        }
        return oldest;
    }

    private void await(BooleanSupplier ready, double timeout) {
        if (ready.getAsBoolean()) return;
        Deadline deadline = new Deadline(timeout);
        Thread me = Thread.currentThread();
        try {
            while (!ready.getAsBoolean()) {
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
                if (!waiting.contains(me)) {
                    sim.progress.waits();
                    waiting.add(me);
                }
                deadline.waitOn(this, 500);
                sim.checkOpen();
                if (!ready.getAsBoolean()) sim.checkServer(); // or the run has ended
            }
        } finally {
            waiting.remove(me);
        }
    }

    private String whatIsKnown() {
        channel_info_t now = sim.info().output(channel);
        return sim.whatIsKnown(now == null ? 0.0 : now.rate);
    }
}
