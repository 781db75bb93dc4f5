import ruedo.LaunchOptions;
import ruedo.Observations;
import ruedo.Robot;
import ruedo.Ruedo;
import ruedo.Scan;
import ruedo.Simulation;

import java.util.List;
import java.util.Locale;

/** Evening 3 in Java: along the walls of room.sdf, on the right. Complete the controller. */
public final class WallFollowingStart {
    private static final double APART = 0.8; // m

    private WallFollowingStart() {}

    public static void main(String[] arguments) {
        String world = arguments.length > 0 ? arguments[0] : "room.sdf";
        LaunchOptions options = new LaunchOptions().lockstep(1).disable("p3at/camera");
        try (Simulation sim = Ruedo.launch(world, options)) {
            Robot robot = sim.robot("p3at");
            Observations seen = sim.step(20);
            double apart = 0.0; // m
            while (seen.time() < 40.0) {
                Scan scan = seen.latest(robot.lrf());
                // Yours: a line through these hits has an angle, too.
                apart = scan.nearest(-1.6, -0.8);
                double speed = 0.3;
                double turn = 0.0; // Yours: of APART, apart and the angle
                if (scan.nearest(-0.4, 0.4) < APART + 0.6) { // a corner
                    speed = 0.1;
                    turn = 0.8;
                }
                seen = sim.step(20, List.of(robot.velocityCommand(speed, turn)));
            }
            System.out.printf(
                    Locale.ROOT, "%.2f m from the wall, and %.1f are asked for%n", apart, APART);
        }
    }
}
