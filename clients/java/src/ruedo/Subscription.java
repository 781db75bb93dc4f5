package ruedo;

import java.util.function.Consumer;

/**
 * A callback that is called until close(), which try-with-resources does at its end. What it
 * throws, an Error too, is said on the terminal once, and hurts nobody else.
 */
public final class Subscription implements AutoCloseable {
    private final Runnable callback;
    private final Consumer<Object> taker;
    private final String what;
    private final Consumer<Subscription> leave;
    private volatile boolean closed;
    private boolean failed;

    private Subscription(
            String what, Runnable callback, Consumer<Object> taker, Consumer<Subscription> leave) {
        this.what = what;
        this.callback = callback;
        this.taker = taker;
        this.leave = leave;
    }

    /** leave: what takes it from those that are called. */
    @SuppressWarnings("unchecked")
    static <T> Subscription of(
            String what, Consumer<? super T> callback, Consumer<Subscription> leave) {
        return new Subscription(what, null, (Consumer<Object>) callback, leave);
    }

    static Subscription of(String what, Runnable callback, Consumer<Subscription> leave) {
        return new Subscription(what, callback, null, leave);
    }

    /** From the return on it is not called any more; another thread may just be in it. */
    @Override
    public void close() {
        synchronized (this) {
            if (closed) return;
            closed = true;
        }
        leave.accept(this);
    }

    /** Whether it was closed. */
    public boolean closed() {
        return closed;
    }

    void call(Object argument) {
        if (closed) return;
        try {
            if (taker != null) taker.accept(argument);
            else callback.run();
        } catch (Throwable error) { // an Error, too, leaves the receiving thread alive
            if (failed) return;
            failed = true;
            System.err.println(
                    "ruedo: a callback on "
                            + what
                            + " failed: "
                            + error
                            + "; it is called on, and this is said once");
        }
    }

    @Override
    public String toString() {
        return "subscription to " + what + (closed ? ", closed" : "");
    }
}
