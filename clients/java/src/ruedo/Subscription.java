package ruedo;

import java.util.concurrent.atomic.AtomicBoolean;
import java.util.function.Consumer;

/**
 * A callback that is called until close(), which try-with-resources does at its end. The next call
 * of its simulation throws an exception of the callback, even an Error, as the cause of a {@link
 * RuedoException.CallbackException}; it affects no other callback.
 */
public final class Subscription implements AutoCloseable {
    private final Runnable callback;
    private final Consumer<Object> taker;
    private final String what;
    private final CallbackFaults faults;
    private final Consumer<Subscription> leave;
    private final AtomicBoolean closed = new AtomicBoolean();
    private boolean failed;

    private Subscription(
            String what,
            Runnable callback,
            Consumer<Object> taker,
            CallbackFaults faults,
            Consumer<Subscription> leave) {
        if (callback == null && taker == null)
            throw new IllegalArgumentException(what + ": the callback is null");
        this.what = what;
        this.callback = callback;
        this.taker = taker;
        this.faults = faults;
        this.leave = leave;
    }

    /**
     * faults: keeps what it throws; null: that is printed once. leave: what takes it from those
     * that are called.
     */
    @SuppressWarnings("unchecked")
    static <T> Subscription of(
            String what,
            Consumer<? super T> callback,
            CallbackFaults faults,
            Consumer<Subscription> leave) {
        return new Subscription(what, null, (Consumer<Object>) callback, faults, leave);
    }

    static Subscription of(
            String what, Runnable callback, CallbackFaults faults, Consumer<Subscription> leave) {
        return new Subscription(what, callback, null, faults, leave);
    }

    /** After it returns no new call begins; a call in another thread may still be running. */
    @Override
    public void close() {
        if (closed.compareAndSet(false, true)) leave.accept(this);
    }

    /** Whether it was closed. */
    public boolean closed() {
        return closed.get();
    }

    void call(Object argument) {
        if (closed.get()) return;
        try {
            if (taker != null) taker.accept(argument);
            else callback.run();
        } catch (Throwable error) { // an Error, too, leaves the thread alive that calls
            if (faults != null && faults.keep(error, what) || failed) return;
            failed = true;
            Faults.tell(
                    "a callback on " + what + " failed: ",
                    error,
                    "; it stays subscribed (shown once)");
        }
    }

    @Override
    public String toString() {
        return "subscription to " + what + (closed() ? ", closed" : "");
    }
}
