package ruedo;

import java.util.Locale;
import java.util.function.Supplier;

/** Whether sim time advances while a call waits for it, and if not, why; in its thread. */
final class Standstill {
    private static final double LONG_SECONDS = 5.0; // of real time
    private static final double STANDS_SECONDS = 1.0;

    private final Clock clock;
    private final String call;
    private final Supplier<String> why;
    private final long began = System.nanoTime();
    private long since = began;
    private long utime;
    private boolean told;

    /** call: for the terminal. why: why sim time may stand still; "": it is not known to. */
    Standstill(Clock clock, String call, Supplier<String> why) {
        this.clock = clock;
        this.call = call;
        this.why = why;
        utime = clock.utime();
    }

    /** Warns once when it has stood still for 5 s. */
    void look() {
        double seconds = standsFor();
        if (told || seconds < LONG_SECONDS) return;
        String reason = why.get();
        if (reason.isEmpty()) return;
        told = true;
        System.err.println(
                String.format(
                        Locale.ROOT,
                        "ruedo: %s waits, and sim time has stood still for %d s at %.2f s: %s",
                        call,
                        (long) seconds,
                        utime * 1e-6,
                        reason));
    }

    /** The reason why the call has waited in vain; "": sim time advances. */
    String reason() {
        return standsFor() >= STANDS_SECONDS || since == began ? why.get() : "";
    }

    /** s of real time. */
    private double standsFor() {
        long now = System.nanoTime();
        if (clock.utime() != utime) {
            utime = clock.utime();
            since = now;
        }
        return (now - since) * 1e-9;
    }
}
