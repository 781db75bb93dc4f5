package ruedo;

import ruedo.lcmtypes.move_command_t;
import ruedo.lcmtypes.robot_info_t;

import java.util.ArrayList;
import java.util.List;

/**
 * The commands to one robot: what is repeated, and the primitives under way. The simulation has one
 * for each name.
 */
final class Driver {
    private final Simulation sim;
    private final String robot;
    private String heldChannel;
    private byte[] held;
    private long heldAt; // us, when it last went out by sim time
    private List<Motion> motions = new ArrayList<>(); // the newest last
    private String moveChannel;
    private Subscription statuses;
    private Subscription collisions;
    private String blockedBy = "";
    private boolean running; // a status has shown the held command
    private boolean watchdogTold;
    private String ended = "";

    Driver(Simulation sim, String robot) {
        this.sim = sim;
        this.robot = robot;
    }

    /** Publishes the command now, and again until the next one. */
    void keepSending(String channel, byte[] bytes) {
        listen();
        synchronized (this) {
            if (!ended.isEmpty()) return;
            heldChannel = channel;
            held = bytes;
            running = false;
            sim.bus.publish(channel, bytes);
        }
        sim.keepRepeating(this);
    }

    /** Repeats the held command, and the newest primitive until a status shows it, by real time. */
    synchronized void repeat() {
        if (held != null) sim.bus.publish(heldChannel, held);
        else if (!motions.isEmpty()) sendIfDue(motions.get(motions.size() - 1));
    }

    /** Repeats the held command, by sim time. */
    synchronized void repeatAt(long utime) {
        if (held == null || (utime >= heldAt && utime - heldAt < 1000 * periodMillis())) return;
        heldAt = utime;
        sim.bus.publish(heldChannel, held);
    }

    private void sendIfDue(Motion motion) {
        if (motion.isDue()) sim.bus.publish(moveChannel, motion.message);
    }

    /** ms of real time between repetitions: a quarter of the watchdog's time, at most 100. */
    long periodMillis() {
        double watchdog = watchdog();
        return watchdog > 0.0
                ? Math.round(Math.min(100.0, Math.max(10.0, watchdog * 250.0)))
                : 100L;
    }

    /** s; 0: none, or the robot was removed meanwhile. */
    private double watchdog() {
        robot_info_t info = sim.info().robots.get(robot);
        return info == null ? 0.0 : info.watchdog_us * 1e-6;
    }

    Motion move(String channel, move_command_t command, String kind) {
        listen();
        double amount = Math.abs(command.value);
        Motion motion = new Motion(sim, robot, command.id, kind, amount, Bus.encode(command));
        synchronized (this) {
            held = null; // a repetition after this would replace the primitive
            List<Motion> underWay = new ArrayList<>();
            for (Motion other : motions) {
                if (!other.done()) underWay.add(other);
            }
            underWay.add(motion);
            motions = underWay;
            moveChannel = channel;
            if (!ended.isEmpty()) motion.end(ended);
            sendIfDue(motion);
        }
        sim.keepRepeating(this);
        return motion;
    }

    /** Sim time was reset. */
    synchronized void beginEpoch() {
        for (Motion motion : motions) motion.beginEpoch();
    }

    /** Stops when the robot or the run is gone: the next robot of that name gets no commands. */
    void end(String reason) {
        List<Motion> underWay;
        List<Subscription> listening = new ArrayList<>();
        synchronized (this) {
            ended = reason;
            held = null;
            underWay = motions;
            motions = new ArrayList<>();
            if (statuses != null) listening.add(statuses);
            if (collisions != null) listening.add(collisions);
            statuses = null;
            collisions = null;
        }
        for (Subscription subscription : listening) subscription.close();
        for (Motion motion : underWay) motion.end(reason);
    }

    private synchronized void listen() {
        if (!ended.isEmpty())
            throw new RuedoException.UnknownName(
                    robot + " is gone: " + ended); // while the command was made
        if (statuses != null) return;
        try { // of a step they come before the status
            collisions = sim.robot(robot).collisions().onArrival(this::onCollisions);
        } catch (RuedoException.UnknownName switchedOff) {
            blockedBy = ""; // a motion that is blocked does not know by what
        }
        statuses = sim.robot(robot).motion().onArrival(this::onStatus);
    }

    private synchronized void onCollisions(Collisions sample) {
        blockedBy = sample.blockedBy;
    }

    private void onStatus(MotionStatus status) {
        List<Motion> underWay;
        boolean stopped;
        String blocker;
        synchronized (this) {
            underWay = motions;
            blocker = blockedBy;
            running = running || (held != null && status.id == 0 && status.state.equals("running"));
            stopped = running && held != null && status.reason.equals("watchdog") && !watchdogTold;
            watchdogTold = watchdogTold || stopped;
        }
        if (stopped) {
            System.err.println(
                    "ruedo: "
                            + robot
                            + ": stopped by its watchdog: no command came for "
                            + watchdog()
                            + " s of sim time");
        }
        for (Motion motion : underWay) motion.update(status, blocker);
    }
}
