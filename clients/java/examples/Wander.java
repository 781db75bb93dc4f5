import ruedo.Device;
import ruedo.Odometry;
import ruedo.Pose;
import ruedo.Robot;
import ruedo.Ruedo;
import ruedo.RuedoException;
import ruedo.Scan;
import ruedo.Simulation;
import ruedo.SonarReading;

import java.nio.file.Path;
import java.util.HashMap;
import java.util.List;
import java.util.Map;
import java.util.Set;

/**
 * Wanders without bumping into things, by laser range finder and sonar; saves a camera picture and
 * compares odometry with the true pose at the end.
 */
public final class Wander {
    private static final double CLEARANCE = 0.7; // m, from here on it turns away
    private static final double SPEED = 0.35; // m/s
    private static final double TURN_RATE = 0.6; // rad/s
    private static final String USAGE =
            String.join(
                    System.lineSeparator(),
                    "java -cp ruedo.jar:ruedo-examples.jar Wander [OPTION VALUE]...",
                    "  --robot NAME        default: the first",
                    "  --duration SECONDS  of sim time; default: until Ctrl-C",
                    "  --url URL           of the server; default: LCM_DEFAULT_URL",
                    "  --launch WORLD      start a private server with this world",
                    "  --picture FILE      default: wander.jpg");
    private static final Set<String> OPTIONS =
            Set.of("--robot", "--duration", "--url", "--launch", "--picture");
    private static volatile boolean interrupted;

    private Wander() {}

    /** The nearest echo (m) of the transducers that look ahead, on the left or the right. */
    private static double nearestEcho(SonarReading reading, double[][] elements, boolean left) {
        double nearest = Double.POSITIVE_INFINITY;
        for (int i = 0; i < Math.min(reading.ranges.length, elements.length); i++) {
            double heading = elements[i][5];
            boolean ahead = Math.abs(heading) < 1.0 && (heading >= 0.0) == left;
            if (ahead && reading.firedUtime[i] >= 0) nearest = Math.min(nearest, reading.ranges[i]);
        }
        return nearest;
    }

    private static boolean has(Robot robot, String type) {
        for (Device<?> device : robot.devices()) {
            if (device.type.equals(type)) return true;
        }
        return false;
    }

    private static void wander(Robot robot, double duration) {
        boolean hasSonar = has(robot, "sonar_t");
        double start = robot.lrf().latest().time();
        double now = start;
        // rad/s while it turns away; it keeps to one side, or it would get stuck in corners
        double turning = 0.0;
        while (!interrupted && now - start < duration) {
            Scan scan = robot.lrf().next();
            now = scan.time();
            double left = scan.nearest(0.0, 1.2);
            double right = scan.nearest(-1.2, 0.0);
            if (hasSonar) {
                SonarReading reading = robot.sonar().latest();
                left = Math.min(left, nearestEcho(reading, robot.sonar().elements, true));
                right = Math.min(right, nearestEcho(reading, robot.sonar().elements, false));
            }
            if (Math.min(left, right) > CLEARANCE) {
                turning = 0.0;
                robot.setVelocity(SPEED, 0.0);
            } else {
                if (turning == 0.0) turning = left > right ? TURN_RATE : -TURN_RATE;
                robot.setVelocity(0.0, turning);
            }
        }
    }

    private static double[] place(Pose pose) {
        return new double[] {pose.x(), pose.y(), pose.heading()};
    }

    private static double[] place(Odometry odometry) {
        return new double[] {odometry.x, odometry.y, odometry.theta};
    }

    /** From one x, y, heading (m, rad) to another, seen from the first. */
    private static double[] moved(double[] start, double[] end) {
        double x = end[0] - start[0];
        double y = end[1] - start[1];
        double cos = Math.cos(start[2]);
        double sin = Math.sin(start[2]);
        return new double[] {
            cos * x + sin * y,
            cos * y - sin * x,
            Math.IEEEremainder(end[2] - start[2], 2.0 * Math.PI)
        };
    }

    private static void run(Map<String, String> options) throws java.io.IOException {
        String world = options.get("--launch");
        try (Simulation sim =
                world != null ? Ruedo.launch(world) : Ruedo.connect(options.get("--url"))) {
            Robot robot =
                    options.containsKey("--robot")
                            ? sim.robot(options.get("--robot"))
                            : sim.robots().get(0);
            double duration = Double.parseDouble(options.getOrDefault("--duration", "Infinity"));
            double[] poseStart = place(robot.pose().latest());
            double[] odometryStart = place(robot.odometry().latest());
            System.out.println(
                    robot.name
                            + " wanders in "
                            + sim.world()
                            + (Double.isInfinite(duration) ? "; Ctrl-C ends it" : ""));

            wander(robot, duration);
            robot.stop().await(10.0);

            if (has(robot, "image_t")) {
                String file = options.getOrDefault("--picture", "wander.jpg");
                robot.camera().latest().save(Path.of(file));
                System.out.println("camera    " + file);
            }
            double[] truth = moved(poseStart, place(robot.pose().next()));
            double[] belief = moved(odometryStart, place(robot.odometry().next()));
            System.out.printf(
                    "true pose x %.3f m, y %.3f m, heading %.3f rad from where it began%n",
                    truth[0], truth[1], truth[2]);
            System.out.printf(
                    "odometry  x %.3f m, y %.3f m, heading %.3f rad, which is %.3f m off%n",
                    belief[0],
                    belief[1],
                    belief[2],
                    Math.hypot(truth[0] - belief[0], truth[1] - belief[1]));
        }
    }

    /** The options by their names; null when they are not those of USAGE. */
    private static Map<String, String> read(String[] args) {
        Map<String, String> options = new HashMap<>();
        for (int i = 0; i < args.length; i += 2) {
            if (!OPTIONS.contains(args[i]) || i + 1 == args.length) return null;
            options.put(args[i], args[i + 1]);
        }
        return options;
    }

    /** See the class. */
    public static void main(String[] args) throws Exception {
        Map<String, String> options = read(args);
        if (options == null) {
            System.err.println(USAGE);
            System.exit(List.of(args).contains("--help") ? 0 : 2);
        }
        Thread main = Thread.currentThread();
        Runtime.getRuntime()
                .addShutdownHook(
                        new Thread(
                                () -> { // Ctrl-C: wait until the robot stands
                                    interrupted = true;
                                    try {
                                        main.join(15000);
                                    } catch (InterruptedException error) {
                                        Thread.currentThread().interrupt();
                                    }
                                }));
        try {
            run(options);
        } catch (RuedoException error) {
            System.err.println("wander: " + error.getMessage());
            Runtime.getRuntime()
                    .halt(1); // exit() would wait for the hook, which waits for this thread
        }
    }
}
