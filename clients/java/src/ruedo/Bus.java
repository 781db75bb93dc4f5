package ruedo;

import ruedo.lcmtypes.Message;

import java.io.ByteArrayOutputStream;
import java.io.DataOutputStream;
import java.io.IOException;
import java.util.ArrayList;
import java.util.List;
import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;
import java.util.concurrent.locks.LockSupport;
import java.util.concurrent.locks.ReentrantLock;
import java.util.function.Consumer;
import java.util.function.LongSupplier;

/**
 * The messages of a client: raw bytes to handlers. Thread safe; the transport's thread calls the
 * handlers.
 */
final class Bus implements Transport.Receiver {
    private final Transport transport;
    private final Map<String, List<Subscription>> handlers =
            new ConcurrentHashMap<>(); // lists are never changed
    private static final int LARGEST = 4 << 20; // bytes: what a server takes from a client
    private static final double CATCH_UP_SECONDS = 0.05;
    private static final long LOOK_NANOS = 50_000;
    private final ReentrantLock delivering = new ReentrantLock(true); // while handlers are called
    private volatile boolean closed;

    /** The receiving thread calls this before it waits; returns the longest time, ms. */
    volatile LongSupplier beforeTurn = () -> 1000;

    /** The one that this thread is in a handler of. */
    private static final ThreadLocal<Bus> HANDLING = new ThreadLocal<>();

    Bus(Transport transport) {
        this.transport = transport;
    }

    void start() {
        transport.start(this);
    }

    /** Calls handler with all bytes of every message from now on. */
    synchronized Subscription subscribe(String channel, Consumer<byte[]> handler) {
        Subscription subscription =
                Subscription.of(channel, handler, null, one -> leave(channel, one));
        List<Subscription> all = new ArrayList<>(handlers.getOrDefault(channel, List.of()));
        all.add(subscription);
        if (handlers.put(channel, all) == null) transport.subscribe(channel);
        return subscription;
    }

    private synchronized void leave(String channel, Subscription subscription) {
        List<Subscription> all = new ArrayList<>(handlers.getOrDefault(channel, List.of()));
        if (!all.remove(subscription)) return;
        if (!all.isEmpty()) {
            handlers.put(channel, all);
            return;
        }
        handlers.remove(channel);
        transport.unsubscribe(channel);
    }

    @Override
    public boolean wants(String channel) {
        return !closed && handlers.containsKey(channel);
    }

    @Override
    public long beforeTurn() {
        return beforeTurn.getAsLong();
    }

    @Override
    public void receive(String channel, byte[] message) {
        HANDLING.set(this);
        delivering.lock();
        try {
            for (Subscription subscription : handlers.getOrDefault(channel, List.of())) {
                if (!closed) subscription.call(message);
            }
        } finally {
            delivering.unlock();
            HANDLING.remove();
            Thread.interrupted(); // it was for a handler, not for the thread that receives
        }
    }

    /** Returns when all handlers of arrived messages have been called. */
    void awaitHandlers() {
        delivering.lock();
        delivering.unlock();
    }

    /**
     * Returns when the waiting messages were handled, or after a moment: more may come all the
     * time.
     */
    void catchUp() {
        if (handling()) return;
        Deadline deadline = new Deadline(CATCH_UP_SECONDS);
        while (!closed && transport.hasNews() && !deadline.passed())
            LockSupport.parkNanos(LOOK_NANOS);
    }

    /** False: messages published now are lost. */
    boolean isConnected() {
        return transport.isConnected();
    }

    /** Whether this thread is in a handler. */
    boolean handling() {
        return HANDLING.get() == this;
    }

    /** Throws RuedoException for a message that no server would take. */
    static void checkSize(String channel, int size) {
        if (size <= LARGEST) return;
        throw new RuedoException(
                "a message of "
                        + size
                        + " bytes on "
                        + channel
                        + ": a server takes "
                        + LARGEST
                        + " bytes at most");
    }

    void publish(String channel, Message message) {
        publish(channel, encode(message));
    }

    void publish(String channel, byte[] bytes) {
        checkSize(channel, bytes.length);
        if (!closed) transport.publish(channel, bytes);
    }

    static byte[] encode(Message message) {
        try {
            ByteArrayOutputStream bytes = new ByteArrayOutputStream();
            message.encode(new DataOutputStream(bytes));
            return bytes.toByteArray();
        } catch (IOException error) {
            throw new IllegalStateException(error);
        }
    }

    /** From now on no handler is called; a running one continues. */
    void close() {
        closed = true;
        transport.close();
    }
}
