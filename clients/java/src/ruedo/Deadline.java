package ruedo;

import java.io.IOException;
import java.io.InterruptedIOException;
import java.nio.channels.ClosedSelectorException;
import java.nio.channels.Selector;

/** A point in real time until which something is waited for. */
final class Deadline {
    private final long start = System.nanoTime();
    private final double seconds;

    /** seconds: may be infinite. */
    Deadline(double seconds) {
        this.seconds = seconds;
    }

    boolean passed() {
        return left() <= 0.0;
    }

    private double left() {
        return seconds - (System.nanoTime() - start) * 1e-9;
    }

    /**
     * Waits for a notification, at most until here, at most so many milliseconds. The monitor must
     * be held.
     */
    void waitOn(Object monitor, long atMostMillis) {
        long millis = Math.max(1L, Math.min(atMostMillis, (long) Math.ceil(left() * 1e3)));
        try {
            monitor.wait(millis);
        } catch (InterruptedException error) {
            Thread.currentThread().interrupt();
            throw new RuedoException.Interrupted();
        }
    }

    /** Until something may be done with a channel, at most until here; an interrupt is put off. */
    void select(Selector selector) throws IOException {
        while (!selects(selector, 1000)) {
            if (passed()) throw new InterruptedIOException("it takes too long");
        }
    }

    /** Whether something may be done with a channel, now or within so many milliseconds. */
    static boolean selects(Selector selector, long millis) throws IOException {
        boolean interrupted = Thread.interrupted();
        try {
            if (millis > 0) selector.select(millis);
            else selector.selectNow();
            interrupted |= Thread.interrupted();
            boolean found = !selector.selectedKeys().isEmpty();
            selector.selectedKeys().clear();
            return found;
        } catch (ClosedSelectorException error) {
            throw new IOException("it was closed", error);
        } finally {
            if (interrupted) Thread.currentThread().interrupt();
        }
    }

    /** Seconds as a user wrote them: 5, not 5.0. */
    static String text(double seconds) {
        return seconds == Math.rint(seconds) && Math.abs(seconds) < 1e9
                ? Long.toString((long) seconds)
                : Double.toString(seconds);
    }
}
