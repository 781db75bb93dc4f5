import ruedo.Command;
import ruedo.Device;
import ruedo.LaunchOptions;
import ruedo.Observations;
import ruedo.Robot;
import ruedo.Ruedo;
import ruedo.Scan;
import ruedo.Simulation;

import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;

/**
 * Lockstep from Java with the robots of a world: robot-decisions a second at 10 Hz over the local
 * socket, as bench_lockstep_fleet.py measures them from Python, which writes the world, too.
 *
 * <pre>
 * bench_lockstep_fleet.py --world 64 > fleet.sdf
 * java -cp BUILD/java/ruedo.jar BenchLockstepFleet.java WORLD [DECISIONS] [ROUNDS]
 * </pre>
 */
public final class BenchLockstepFleet {
    private BenchLockstepFleet() {}

    private static double rate(String world, int decisions) {
        LaunchOptions options = new LaunchOptions().lockstep(1).args("--quiet");
        try (Simulation sim = Ruedo.launch(world, options)) {
            List<Robot> robots = sim.robots();
            List<Device<Scan>> scanners = new ArrayList<>();
            for (Robot robot : robots) scanners.add(robot.lrf());
            Observations seen = sim.step(20);
            long begin = System.nanoTime();
            for (int i = 0; i < decisions; i++) {
                List<Command> commands = new ArrayList<>();
                for (int k = 0; k < robots.size(); k++) {
                    boolean near = seen.latest(scanners.get(k)).ranges[12] < 0.5;
                    commands.add(robots.get(k).velocityCommand(near ? 0.0 : 0.2, 0.5));
                }
                seen = sim.step(20, commands);
            }
            return robots.size() * decisions * 1e9 / (System.nanoTime() - begin);
        }
    }

    public static void main(String[] args) {
        int decisions = args.length > 1 ? Integer.parseInt(args[1]) : 100;
        double[] rates = new double[args.length > 2 ? Integer.parseInt(args[2]) : 5];
        for (int i = 0; i < rates.length; i++) {
            rates[i] = rate(args[0], decisions);
            System.out.printf("%.0f robot-decisions/s%n", rates[i]);
        }
        Arrays.sort(rates);
        System.out.printf("median %.0f robot-decisions/s%n", rates[rates.length / 2]);
    }
}
