import ruedo.LaunchOptions;
import ruedo.Observations;
import ruedo.Odometry;
import ruedo.Pose;
import ruedo.Robot;
import ruedo.Ruedo;
import ruedo.Simulation;

import java.util.List;
import java.util.Locale;

/** Evening 1 in Java: a square by odometry. It drives the first side; turn, and repeat that. */
public final class SquareStart {
    private static final double SIDE = 2.0; // m

    private SquareStart() {}

    public static void main(String[] arguments) {
        LaunchOptions options =
                new LaunchOptions()
                        .lockstep(1)
                        .spawn("p3at@0,0")
                        .disable("p3at/camera")
                        .setting("p3at/odometry.track_error", 0.02);
        try (Simulation sim = Ruedo.launch("empty", options)) {
            Robot robot = sim.robot("p3at");
            Observations seen = sim.step(20); // of 5 ms
            Odometry begin = seen.latest(robot.odometry());
            Odometry now = begin;
            while (Math.hypot(now.x - begin.x, now.y - begin.y) < SIDE) {
                // m/s, rad/s, for 0.1 s
                seen = sim.step(20, List.of(robot.velocityCommand(0.3, 0.0)));
                now = seen.latest(robot.odometry());
            }
            // Yours: turn left until now.theta has grown by pi / 2, slower towards the end; four
            // times.
            seen = sim.step(20, List.of(robot.velocityCommand(0.0, 0.0)));
            now = seen.latest(robot.odometry());
            Pose truth = seen.latest(robot.pose());
            System.out.printf(
                    Locale.ROOT,
                    "odometry %.3f %.3f, truly at %.3f %.3f%n",
                    now.x,
                    now.y,
                    truth.x(),
                    truth.y());
        }
    }
}
