package ruedo;

import java.util.ArrayList;
import java.util.List;

/** A motion primitive under way. Thread safe. */
public final class Motion {
    // A primitive is sent again until a status shows it: messages may be lost, and the server
    // executes each once. One that no status has shown after so many statuses and seconds is
    // lost, or was replaced at once.
    private static final double FIRST_AGAIN = 0.1; // s of real time
    private static final double LAST_AGAIN = 1.0;
    private static final int UNSEEN_STATUSES = 20;
    private static final double UNSEEN_SECONDS = 5.0;

    /** Its number, as in {@link MotionStatus#id}. */
    public final long id;

    private final Simulation sim;
    private final String robot;
    private final String kind;
    final byte[] message; // the command
    private final Deadline unseenUntil = new Deadline(UNSEEN_SECONDS);
    private final Object lock = new Object(); // a user may hold the monitor of this object itself
    private String state = "sent"; // these under lock
    private String reason = "";
    private String blockedBy = "";
    private double progress;
    private double remaining;
    private int unseen;
    private double again = FIRST_AGAIN;
    private Deadline untilAgain = new Deadline(0.0);
    private final List<Thread> waiting = new ArrayList<>();
    // Of the newest status; an earlier one is another run's, or of a reset that info will report.
    private long utime = -1;
    private long shown = -1; // of the newest status that shows it

    Motion(Simulation sim, String robot, long id, String kind, double amount, byte[] message) {
        this.sim = sim;
        this.robot = robot;
        this.id = id;
        this.kind = kind;
        this.message = message;
        remaining = amount;
    }

    /** Whether it has ended, for whatever reason. */
    public boolean done() {
        synchronized (lock) {
            return state.equals("done") || state.equals("ended") || state.equals("refused");
        }
    }

    /** "sent", then as in {@link MotionStatus#state}. */
    public String state() {
        synchronized (lock) {
            return state;
        }
    }

    /**
     * The reason why it ended early or was refused, as in {@link MotionStatus#reason}; "removed":
     * its robot is gone; "new run": its run is gone; "lost": no status has shown it, though others
     * came.
     */
    public String reason() {
        synchronized (lock) {
            return reason;
        }
    }

    /** The body that blocked it; "" if none did. */
    public String blockedBy() {
        synchronized (lock) {
            return blockedBy;
        }
    }

    /** m or rad done. */
    public double progress() {
        synchronized (lock) {
            return progress;
        }
    }

    /** m or rad. */
    public double remaining() {
        synchronized (lock) {
            return remaining;
        }
    }

    /** {@link #await(double)}, however long it takes. Java's Object has the name wait. */
    public Motion await() {
        return await(Double.POSITIVE_INFINITY);
    }

    /**
     * Waits until it is done, at most timeout seconds of real time.
     *
     * @throws RuedoException.MotionError if it ended early or was refused
     * @throws RuedoException.Timeout if it still runs; the robot continues then
     * @throws RuedoException.RunEnded when the run has
     */
    public Motion await(double timeout) {
        synchronized (lock) {
            waiting.add(Thread.currentThread());
            try {
                awaitEnd(timeout);
            } finally {
                waiting.remove(Thread.currentThread());
            }
            sim.beginAfter(utime);
            if (!state.equals("done")) {
                throw new RuedoException.MotionError(
                        String.format(
                                "%s: %s %s: %s, %.3f remain",
                                robot,
                                kind,
                                state.equals("refused") ? "was refused" : "ended",
                                blockedBy.isEmpty() ? reason : reason + " by " + blockedBy,
                                remaining),
                        reason);
            }
            return this;
        }
    }

    private void awaitEnd(double timeout) {
        Deadline deadline = new Deadline(timeout);
        sim.checkCallbacks();
        if (!done()) sim.progress.waits();
        Standstill standstill = sim.standstill(robot + ": await() for " + kind);
        while (!done()) {
            sim.checkMayWait();
            if (deadline.passed()) {
                String why = standstill.reason();
                throw new RuedoException.Timeout(
                        String.format(
                                "%s: %s was not done within %s s (%.3f remain%s)",
                                robot,
                                kind,
                                Deadline.text(timeout),
                                remaining,
                                why.isEmpty() ? "" : "; " + why));
            }
            deadline.waitOn(lock, 500);
            if (done()) return;
            sim.checkServer();
            if (timeout == Double.POSITIVE_INFINITY) standstill.look();
        }
    }

    /** Whether it is to be sent now: at first, and again until a status shows it. */
    boolean isDue() {
        synchronized (lock) {
            if (!state.equals("sent") || !untilAgain.passed()) return false;
            untilAgain = new Deadline(again);
            again = Math.min(2.0 * again, LAST_AGAIN);
            return true;
        }
    }

    /** Sim time was reset. */
    void beginEpoch() {
        synchronized (lock) {
            utime = shown = -1;
        }
    }

    void end(String why) {
        synchronized (lock) {
            if (done()) return;
            state = "ended";
            reason = why;
            lock.notifyAll();
        }
    }

    void update(MotionStatus status, String blocker) {
        synchronized (lock) {
            if (done() || status.utime < utime && !sim.clock.isFarAhead(utime)) return;
            utime = status.utime;
            if (status.id == id) {
                progress = status.progress;
                remaining = status.remaining;
                state = status.state;
                reason = status.reason;
                shown = status.utime;
                blockedBy = reason.equals("blocked") ? blocker : "";
            } else if (status.state.equals("refused")) {
                return; // another command, which changed nothing
            } else if (status.state.equals("ended") && status.utime == shown) {
                return; // what it ended itself: the network may exchange the two
            } else if (!state.equals("sent")) {
                state = "ended"; // its own end fell between two statuses
                reason = "replaced";
            } else if (++unseen >= UNSEEN_STATUSES && unseenUntil.passed()) {
                state = "ended";
                reason = "lost";
            }
            if (done()) sim.progress.use(status.utime, waiting);
            lock.notifyAll();
        }
    }
}
