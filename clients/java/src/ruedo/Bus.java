package ruedo;

import static java.util.concurrent.TimeUnit.SECONDS;

import ruedo.lcmtypes.Message;

import java.io.ByteArrayOutputStream;
import java.io.DataOutputStream;
import java.io.IOException;
import java.util.ArrayList;
import java.util.List;
import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;
import java.util.concurrent.locks.ReentrantLock;
import java.util.function.Consumer;

/**
 * The messages of a client: raw bytes to handlers. Thread safe; the transport's thread calls the
 * handlers.
 */
final class Bus implements Transport.Receiver {
    private final Transport transport;
    private final Map<String, List<Subscription>> handlers =
            new ConcurrentHashMap<>(); // lists are never changed
    private static final int LARGEST = 4 << 20; // bytes: what a server takes from a client
    private static final long LONG_SECONDS = 5; // for a callback
    private final ReentrantLock delivering = new ReentrantLock(); // while handlers are called
    private volatile Thread receiving; // the one that calls them; null: nothing came yet
    private boolean told; // of a handler that is waited for; under this object's monitor
    private volatile boolean closed;

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
        Subscription subscription = Subscription.of(channel, handler, one -> leave(channel, one));
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
    public void receive(String channel, byte[] message) {
        receiving = Thread.currentThread();
        HANDLING.set(this);
        delivering.lock();
        try {
            for (Subscription subscription : handlers.getOrDefault(channel, List.of())) {
                if (!closed) subscription.call(message);
            }
        } finally {
            delivering.unlock();
            HANDLING.remove();
        }
    }

    /** False: what is published now reaches nobody. */
    boolean isConnected() {
        return transport.isConnected();
    }

    /** Whether this thread is in a handler: while that lasts, nothing is received. */
    boolean handling() {
        return HANDLING.get() == this;
    }

    static boolean inAnyHandler() {
        return HANDLING.get() != null;
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

    /** From now on no handler is called; one that is running goes on. */
    void close() {
        closed = true;
        transport.close();
    }

    /**
     * Waits for a handler that is running, which is named when it takes long. At the program's end
     * it is not waited for any longer: it may be what ended the program.
     */
    void awaitHandler() {
        if (returned()) return;
        tellOfHandler();
        while (!ProgramEnd.hasBegun() && !returned()) {} // which waits
    }

    /** Once; who waits with others goes on after it was said. */
    private synchronized void tellOfHandler() {
        if (told) return;
        told = true;
        System.err.println(
                "ruedo: a callback has not returned for "
                        + LONG_SECONDS
                        + " s, at "
                        + placeInCallback()
                        + (ProgramEnd.hasBegun()
                                ? ": the program ends without it"
                                : ": close() waits for it"));
    }

    /** Whether no handler runs; waits for that. */
    private boolean returned() {
        if (!Uninterrupted.get(() -> delivering.tryLock(LONG_SECONDS, SECONDS))) return false;
        delivering.unlock();
        return true;
    }

    /** The innermost line of the user's, in the thread that calls the handlers. */
    private String placeInCallback() {
        for (StackTraceElement frame : receiving.getStackTrace()) {
            String module = frame.getModuleName();
            boolean ofJava =
                    module != null && (module.startsWith("java.") || module.startsWith("jdk."));
            if (!ofJava && !frame.getClassName().startsWith("ruedo."))
                return frame.getFileName() + ":" + frame.getLineNumber();
        }
        return "a place that is not known";
    }
}
