package ruedo;

import java.util.ArrayList;
import java.util.List;

/**
 * Sim time, as the messages of the server tell it, and how long the server has been silent. Thread
 * safe.
 */
final class Clock {
    private static final long MOST_AHEAD_MICROS = 1_000_000; // ticks come ten times a second

    private static final class Sleeper {
        final Thread thread = Thread.currentThread();
        long left; // us of sim time, which may be set back

        Sleeper(long left) {
            this.left = left;
        }
    }

    private final Progress progress;
    private final List<Sleeper> sleepers = new ArrayList<>(); // under this object's monitor
    private volatile long utime; // us, of the newest message; changed under it
    private volatile long lastSign = System.nanoTime();

    Clock(Progress progress) {
        this.progress = progress;
    }

    /** us. */
    long utime() {
        return utime;
    }

    /** A message of that time came. */
    void note(long now) {
        noteSign();
        synchronized (this) {
            long passed = now - utime;
            if (passed <= 0) return;
            utime = now;
            List<Thread> woken = new ArrayList<>();
            for (Sleeper sleeper : sleepers) {
                if (sleeper.left <= 0) continue; // it was woken before
                sleeper.left -= passed;
                if (sleeper.left <= 0) woken.add(sleeper.thread);
            }
            if (woken.isEmpty()) return;
            progress.use(now, woken);
            notifyAll();
        }
    }

    /** Whether the time is too far ahead of this run's messages to be right. */
    boolean isFarAhead(long time) {
        return time - MOST_AHEAD_MICROS > utime;
    }

    /** A tick came: a time of another message long after it was wrong. */
    void noteTick(long now) {
        if (now < utime - MOST_AHEAD_MICROS) reset(Math.max(now, 0));
        note(now);
    }

    /** Something came that has no time. */
    void noteSign() {
        lastSign = System.nanoTime();
        progress.heard();
    }

    synchronized void reset(long now) {
        utime = now;
    }

    /** s of real time since the last sign of life. */
    double silence() {
        return (System.nanoTime() - lastSign) * 1e-9;
    }

    /** check: called meanwhile, at least twice a second; what it throws ends the waiting. */
    void sleep(long micros, Runnable check) {
        Deadline never = new Deadline(Double.POSITIVE_INFINITY);
        Sleeper sleeper = new Sleeper(micros);
        synchronized (this) {
            progress.waits();
            sleepers.add(sleeper);
            try {
                while (sleeper.left > 0) {
                    never.waitOn(this, 500);
                    if (sleeper.left > 0) check.run();
                }
            } finally {
                sleepers.remove(sleeper);
            }
        }
    }

    /** Sleeping threads check at once. */
    synchronized void wake() {
        notifyAll();
    }
}
