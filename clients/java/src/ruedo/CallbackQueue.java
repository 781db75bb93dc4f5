package ruedo;

import static java.util.concurrent.TimeUnit.SECONDS;

import java.util.ArrayDeque;
import java.util.HashSet;
import java.util.Iterator;
import java.util.Set;
import java.util.concurrent.locks.ReentrantLock;

/**
 * Runs the user's callbacks, one at a time, in the order in which they came: in a thread of its
 * own, so that receiving never waits for them, or for a while in that of a caller. Thread safe.
 */
final class CallbackQueue {
    private static final long LONG_SECONDS = 5; // for a callback that is waited for
    private static final long MOST_WAITING = 1 << 20; // bytes of samples, where they may be dropped
    private static final int OVERHEAD = 100; // bytes, of a sample

    /** The one that this thread is in a callback of. */
    private static final ThreadLocal<CallbackQueue> RUNS = new ThreadLocal<>();

    private static final class Call {
        final Runnable run;
        final StreamCore<?> of; // null: the call gets no sample, and is never dropped
        final int cost; // bytes

        Call(Runnable run, StreamCore<?> of, int cost) {
            this.run = run;
            this.of = of;
            this.cost = cost;
        }
    }

    private final ReentrantLock turn = new ReentrantLock(); // to run one
    private volatile Thread runner; // the one that runs a call, or is about to; null: none
    private ArrayDeque<Call> waiting = new ArrayDeque<>(); // these under this object's monitor
    private long bytes; // of what waits
    private boolean mayDrop = true;
    private int borrowed; // by threads that run what comes meanwhile
    private Thread thread; // null: nothing came yet
    private boolean droppingTold;
    private boolean longTold;
    private volatile boolean closed;

    /** Whether this thread is in one of its callbacks. */
    boolean runsHere() {
        return RUNS.get() == this;
    }

    static boolean inAnyCallback() {
        return RUNS.get() != null;
    }

    /** From now on senders wait for the callbacks. */
    synchronized void keepAll() {
        mayDrop = false;
    }

    synchronized boolean isIdle() {
        return waiting.isEmpty() && runner == null;
    }

    void put(Runnable call) {
        put(new Call(call, null, 0));
    }

    /** A callback that gets a sample of so many bytes, unless newer ones of its stream wait. */
    void put(Runnable call, StreamCore<?> of, int size) {
        put(new Call(call, of, size + OVERHEAD));
    }

    private synchronized void put(Call call) {
        if (closed) return;
        waiting.add(call);
        bytes += call.cost;
        if (bytes > MOST_WAITING && mayDrop) drop();
        if (thread == null) {
            Thread made = new LastingThread("ruedo-callbacks", () -> closed, this::runNext);
            made.start();
            thread = made;
        } else if (borrowed == 0) {
            notifyAll();
        }
    }

    /** Of each stream the newest stays. */
    private void drop() {
        Set<StreamCore<?>> seen = new HashSet<>();
        ArrayDeque<Call> kept = new ArrayDeque<>();
        boolean all = true;
        for (Iterator<Call> calls = waiting.descendingIterator(); calls.hasNext(); ) {
            Call call = calls.next();
            if (call.of == null || seen.add(call.of)) {
                kept.addFirst(call);
                continue;
            }
            bytes -= call.cost;
            call.of.miss();
            all = false;
        }
        waiting = kept;
        if (all || droppingTold) return;
        droppingTold = true;
        System.err.println(
                "ruedo: callbacks are slower than their samples: they get only the newest sample"
                        + " of each channel, and dropped() of each stream counts the others"
                        + " (shown once)");
    }

    /** Until drain() the caller's thread runs arriving calls. */
    synchronized void borrow() {
        borrowed++;
    }

    /** When it returns, all callbacks of what came before have. */
    void drain() {
        try {
            while (runOne()) {}
        } finally {
            synchronized (this) {
                borrowed--;
                notifyAll();
            }
        }
    }

    private void runNext() throws InterruptedException {
        synchronized (this) {
            while (!closed && (waiting.isEmpty() || borrowed > 0)) wait();
        }
        try {
            runOne();
        } finally {
            Thread.interrupted(); // it was for the callback
        }
    }

    /** False: nothing waits. */
    private boolean runOne() {
        turn.lock();
        CallbackQueue before = RUNS.get();
        try {
            Call call;
            synchronized (this) {
                call = waiting.poll();
                if (call == null) return false;
                bytes -= call.cost;
                runner = Thread.currentThread();
            }
            RUNS.set(this);
            call.run.run();
            return true;
        } finally {
            runner = null;
            if (before == null) RUNS.remove();
            else RUNS.set(before);
            turn.unlock();
        }
    }

    /** Lets no further callback begin. */
    synchronized void close() {
        closed = true;
        waiting.clear();
        notifyAll();
    }

    /**
     * Waits for a running callback, and reports one that takes long. At the program's end it waits
     * no longer: the callback may have ended the program.
     */
    void awaitCallback() {
        if (returned()) return;
        tellOfCallback();
        while (!ProgramEnd.hasBegun() && !returned()) {} // which waits
    }

    /** Once; a thread that waits with others continues after the report. */
    private synchronized void tellOfCallback() {
        if (longTold) return;
        longTold = true;
        System.err.println(
                "ruedo: a callback has not returned for "
                        + LONG_SECONDS
                        + " s, at "
                        + placeInCallback()
                        + (ProgramEnd.hasBegun()
                                ? ": the program ends without it"
                                : ": close() waits for it"));
    }

    /** Whether no callback runs; waits for that. */
    private boolean returned() {
        if (!Uninterrupted.get(() -> turn.tryLock(LONG_SECONDS, SECONDS))) return false;
        turn.unlock();
        return true;
    }

    /** The innermost line of the user's, in the thread that runs the callback. */
    private String placeInCallback() {
        Thread running = runner;
        StackTraceElement[] frames =
                running == null ? new StackTraceElement[0] : running.getStackTrace();
        for (StackTraceElement frame : frames) {
            String module = frame.getModuleName();
            boolean ofJava =
                    module != null && (module.startsWith("java.") || module.startsWith("jdk."));
            if (!ofJava && !frame.getClassName().startsWith("ruedo."))
                return frame.getFileName() + ":" + frame.getLineNumber();
        }
        return "a place that is not known";
    }
}
