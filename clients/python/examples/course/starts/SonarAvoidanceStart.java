import ruedo.LaunchOptions;
import ruedo.Observations;
import ruedo.Pose;
import ruedo.Robot;
import ruedo.Ruedo;
import ruedo.Simulation;
import ruedo.SonarReading;

import java.util.List;
import java.util.Locale;

/** Evening 2 in Java: around the arena by sonars. It stops before what is ahead; turn away. */
public final class SonarAvoidanceStart {
    private SonarAvoidanceStart() {}

    public static void main(String[] arguments) {
        LaunchOptions options = new LaunchOptions().lockstep(1).disable("p3at/camera");
        try (Simulation sim = Ruedo.launch("arena", options)) {
            Robot robot = sim.robot("p3at");
            Observations seen = sim.step(80);
            double ahead = 5.0; // m
            while (seen.time() < 40.0) {
                // In front: to 90, 50, 30, 10, -10, -30, -50, -90 degrees.
                SonarReading reading = seen.latest(robot.sonar());
                if (reading != null) {
                    ahead = Double.POSITIVE_INFINITY;
                    for (int i = 2; i < 6; i++) ahead = Math.min(ahead, reading.ranges[i]);
                }
                double speed = ahead > 0.9 ? 0.25 : 0.0;
                double turn = 0.0; // Yours
                seen = sim.step(20, List.of(robot.velocityCommand(speed, turn)));
            }
            Pose truth = seen.latest(robot.pose());
            System.out.printf(
                    Locale.ROOT,
                    "ends at %.2f %.2f, %.2f m before something%n",
                    truth.x(),
                    truth.y(),
                    ahead);
        }
    }
}
