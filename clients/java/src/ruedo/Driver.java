package ruedo;

import java.util.ArrayList;
import java.util.List;
import ruedo.lcmtypes.move_command_t;

/** The commands of one robot: what is repeated until changed, and the primitives under way. */
final class Driver {
    private final Robot robot;
    private String heldChannel;
    private byte[] held;
    private List<Motion> motions = new ArrayList<>();
    private boolean listening;
    private boolean running;          // a status has shown the held command
    private boolean watchdogTold;

    Driver(Robot robot) {
        this.robot = robot;
    }

    /** Publishes the command now, and again until the next one. */
    void hold(String channel, byte[] bytes) {
        listen();
        synchronized (this) {
            heldChannel = channel;
            held = bytes;
            running = false;
            robot.sim.bus.publish(channel, bytes);
        }
        robot.sim.keepRepeating(this);
    }

    synchronized void repeat() {
        if (held != null) robot.sim.bus.publish(heldChannel, held);
    }

    /** ms of real time between repetitions: a quarter of the watchdog's time, at most 100. */
    long periodMillis() {
        double watchdog = robot.watchdog();
        return watchdog > 0.0 ? Math.round(Math.min(100.0, Math.max(10.0, watchdog * 250.0))) : 100L;
    }

    Motion move(String channel, move_command_t command, String kind) {
        listen();
        Motion motion = new Motion(robot.sim, robot.name, command.id, kind, Math.abs(command.value));
        synchronized (this) {
            held = null;    // a repetition after this would replace the primitive
            List<Motion> underWay = new ArrayList<>();
            for (Motion other : motions) {
                if (!other.done()) underWay.add(other);
            }
            underWay.add(motion);
            motions = underWay;
            robot.sim.bus.publish(channel, command);
        }
        return motion;
    }

    private void listen() {
        synchronized (this) {
            if (listening) return;
            listening = true;
        }
        robot.motion().onSample(this::onStatus);
    }

    private void onStatus(MotionStatus status) {
        List<Motion> underWay;
        boolean stopped;
        synchronized (this) {
            underWay = motions;
            running = running || (held != null && status.id == 0 && status.state.equals("running"));
            stopped = running && held != null && status.reason.equals("watchdog") && !watchdogTold;
            watchdogTold = watchdogTold || stopped;
        }
        if (stopped) {
            System.err.println("ruedo: " + robot.name + ": stopped by its watchdog: no command came for " + robot.watchdog()
                    + " s of sim time");
        }
        for (Motion motion : underWay) motion.update(status);
    }
}
