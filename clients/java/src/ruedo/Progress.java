package ruedo;

import java.util.Arrays;
import java.util.Collections;
import java.util.HashMap;
import java.util.List;
import java.util.Map;
import java.util.function.Consumer;

/**
 * How far a program has come in a run that it launched: the server waits for it there. A run at the
 * highest rate takes a second of sim time in less than a millisecond; a program that looks at a
 * sensor and then commands would act on a world that has gone on without it. So it tells its server
 * what it has received, and from which moment on it works with what it knew then. Thread safe;
 * until begin() no server waits.
 */
final class Progress {
    private static final long NEVER = Long.MAX_VALUE;

    /** The run does not wait for a thread that got a sample so long ago: it does something else. */
    private static final long PATIENCE_NANOS = 500_000_000;

    /** Stands for the thread that will first ask for something, however long that takes. */
    private static final Thread NOT_YET_KNOWN = null;

    private static final long AGAIN_NANOS = 10_000_000;

    /** Characters since the server was heard: a pipe holds a page of those that it has not read. */
    private static final int MOST_UNHEARD = 4000;

    private static final class Use {
        final long utime;
        final long since = System.nanoTime();

        Use(long utime) {
            this.utime = utime;
        }

        /** Meanwhile the run advances as in real time; in whole ms, or each call had a line. */
        long now(long nanoTime) {
            return utime + (nanoTime - since) / 1_000_000 * 1000;
        }
    }

    private volatile Consumer<String> tell; // null: not begun
    private volatile int unheard;
    private final Map<Thread, Use> uses = new HashMap<>(); // these under this object's monitor
    private int epoch;
    private long received; // us of sim time
    private String told = "";
    private long toldAt;

    /** The progress line of a program that has received nothing yet. */
    static String first() {
        return line(0, 0, NEVER);
    }

    private static String line(int epoch, long received, long used) {
        return epoch + " " + received + " " + used + "\n";
    }

    /**
     * The program works with what is known at that sim time until its first use(), waits() or
     * listens(), however long that takes. teller: writes a line to the server.
     */
    synchronized void begin(Consumer<String> teller, int firstEpoch, long utime) {
        tell = teller;
        epoch = firstEpoch;
        uses.put(NOT_YET_KNOWN, new Use(utime));
        say();
    }

    boolean isTold() {
        return tell != null;
    }

    /** All that the server sent up to that sim time has come, and callbacks have seen it. */
    void received(int newEpoch, long utime) {
        if (tell == null) return;
        synchronized (this) {
            if (newEpoch != epoch) uses.clear();
            epoch = newEpoch;
            received = utime;
            say();
        }
    }

    /** The caller's thread uses samples of that sim time. */
    void use(long utime) {
        if (tell != null) use(utime, List.of(Thread.currentThread()));
    }

    /** The same of other threads. */
    void use(long utime, List<Thread> threads) {
        if (tell == null) return;
        Use use = new Use(utime);
        synchronized (this) {
            uses.remove(NOT_YET_KNOWN);
            for (Thread thread : threads) uses.put(thread, use);
            say();
        }
    }

    /** The caller's thread waits for messages of the server. */
    void waits() {
        endUses(Arrays.asList(NOT_YET_KNOWN, Thread.currentThread()));
    }

    /** Callbacks get what the server sends. */
    void listens() {
        endUses(Collections.singletonList(NOT_YET_KNOWN));
    }

    private void endUses(List<Thread> threads) {
        if (tell == null) return;
        synchronized (this) {
            if (uses.keySet().removeAll(threads)) say();
        }
    }

    /** Reports it again, if a thread works. False if none does. */
    boolean goOn() {
        if (tell == null) return false;
        synchronized (this) {
            if (uses.isEmpty()) return false;
            if (System.nanoTime() - toldAt >= AGAIN_NANOS) say();
            return true;
        }
    }

    /** A message came: the server runs, and reads this program's reports. */
    void heard() {
        boolean wasFull = unheard > MOST_UNHEARD;
        unheard = 0;
        if (!wasFull) return;
        synchronized (this) {
            say();
        }
    }

    private void say() {
        long now = System.nanoTime();
        long used = NEVER;
        uses.entrySet()
                .removeIf(
                        use ->
                                use.getKey() != NOT_YET_KNOWN
                                        && now - use.getValue().since > PATIENCE_NANOS);
        for (Use use : uses.values()) used = Math.min(used, use.now(now));
        String line = line(epoch, received, used);
        // Of a server that is stopped the pipe would be full, and hold this thread up. A later line
        // says all that this one does.
        if (line.equals(told) || unheard > MOST_UNHEARD) return;
        unheard += line.length();
        told = line;
        toldAt = now;
        tell.accept(line);
    }
}
