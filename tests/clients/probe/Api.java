import ruedo.Body;
import ruedo.Boxes2D;
import ruedo.Boxes3D;
import ruedo.Device;
import ruedo.Joint;
import ruedo.JointMode;
import ruedo.Joints;
import ruedo.NavSat;
import ruedo.Observations;
import ruedo.OccupancyMap;
import ruedo.Odometry;
import ruedo.Pose;
import ruedo.Robot;
import ruedo.Ruedo;
import ruedo.RuedoException;
import ruedo.Scan;
import ruedo.Simulation;
import ruedo.State;
import ruedo.Synchronised;
import ruedo.Transform;
import ruedo.Twist;
import ruedo.lcmtypes.velocity_command_t;

import java.util.ArrayList;
import java.util.List;
import java.util.Locale;
import java.util.Map;
import java.util.concurrent.atomic.AtomicInteger;

/**
 * What textbook programs use of the client, in Java; api.py and api.cpp are its twins, with the
 * same commands and output.
 */
public final class Api {
    private static final double PATIENCE = 300.0; // s, for what comes sooner or later

    private Api() {}

    private static void say(Object... words) {
        StringBuilder line = new StringBuilder();
        for (Object word : words) {
            String text = String.valueOf(word);
            if (word instanceof Double)
                text = String.format(Locale.ROOT, "%.6f", word).replace("Infinity", "inf");
            if (word instanceof Boolean) text = (Boolean) word ? "True" : "False";
            line.append(line.length() == 0 ? "" : " ").append(text.replace("\n", " "));
        }
        System.out.println(line);
    }

    private static void attempt(String what, Runnable call) {
        try {
            call.run();
            say(what, "none");
        } catch (RuedoException error) {
            say(what, error.getClass().getSimpleName() + ":", error.getMessage());
        } catch (IllegalArgumentException error) {
            say(what, "ValueError:", error.getMessage());
        }
    }

    private static void joints(Simulation sim) {
        Robot robot = sim.robot("arm");
        for (String name : sim.jointLimits("arm").names) {
            Joint joint = robot.joint(name);
            say(name, joint.kind, joint.takesCommands, joint.holds, joint.lower, joint.upper);
            say(name + "_most", joint.maxVelocity, joint.maxEffort);
        }
        attempt("unknown", () -> robot.joint("elbo"));
        attempt("unknown_command", () -> robot.commandJoints(Map.of("elbo", 1.0)));
        attempt("nan", () -> robot.commandJoints(Map.of("elbow", Double.NaN)));
        attempt("mimic", () -> robot.commandJoints(Map.of("finger", 0.1)));
        attempt("unknown_state", () -> robot.joints().latest(PATIENCE).position("elbo"));
        robot.commandJoints(Map.of("shoulder", 0.5, "wrist", -0.25));
        while (Math.abs(robot.joint("shoulder").position() - 0.5) > 1e-3) sim.sleep(0.05);
        sim.sleep(1.0);
        Joints state = robot.joints().next(PATIENCE);
        say(
                "reached",
                state.position("shoulder"),
                state.position("wrist"),
                state.position("elbow"));
        Joint joint = robot.joint("elbow");
        joint.setVelocity(0.2);
        sim.sleep(1.0);
        say("velocity", joint.velocity());
        robot.commandJoints(Map.of("elbow", 0.0), JointMode.VELOCITY);
        robot.joint("wrist").setPosition(9.0); // beyond its limit
        sim.sleep(2.0);
        say("limited", robot.joint("wrist").position());
    }

    private static void jointsInLockstep(Simulation sim) {
        Robot robot = sim.robot("arm");
        sim.step(0);
        attempt("at_once", () -> robot.commandJoints(Map.of("elbow", 0.1)));
        Observations seen =
                sim.step(
                        400, List.of(robot.jointCommand(Map.of("elbow", 0.1), JointMode.POSITION)));
        say("reached", seen.latest(robot.joints()).position("elbow"));
    }

    /** The robot turns about a circle: at each moment its place follows from its heading. */
    private static void inStep(Simulation sim) {
        Robot robot = sim.robot("p3at");
        robot.setVelocity(0.5, 0.5);
        robot.lrf().latest(PATIENCE);
        List<Long> stamps = new ArrayList<>();
        boolean rising = true;
        double worst = 0.0;
        for (Synchronised<Scan, Pose> both : sim.synchronised(robot.lrf(), robot.pose())) {
            long stamp = both.first.utime;
            rising &= stamps.isEmpty() || stamps.get(stamps.size() - 1) < stamp;
            stamps.add(stamp);
            worst = Math.max(worst, Math.abs(stamp - both.second.utime));
            if (stamps.size() == 10) break;
        }
        say("joined", stamps.size(), worst, rising);
        for (Synchronised<Scan, Pose> all :
                sim.synchronised(robot.lrf(), robot.pose(), robot.odometry())) {
            long stamp = all.get(robot.lrf()).utime;
            Odometry odometry = all.get(robot.odometry());
            say("three", all.first.utime - stamp, all.second.utime - stamp, odometry.utime - stamp);
            break;
        }
        long last = stamps.get(stamps.size() - 1);
        Pose between = robot.pose().at(last - 7000); // poses come each 20 ms
        Pose before = robot.pose().at(last - 20000);
        Pose after = robot.pose().at(last);
        double share = 13.0 / 20.0;
        double expected = (1 - share) * before.x() + share * after.x();
        say("between", between.utime - last, between.x() - expected, before.x() != after.x());
        say("nearest", robot.lrf().at(last + 130000, PATIENCE).utime - last); // each 100 ms
        attempt("early", () -> robot.odometry().at(0));
        int count = 0;
        for (Scan scan : robot.lrf()) {
            if (scan.ranges.length > 0 && ++count == 3) break;
        }
        if (robot.lrf().samples().limit(2).mapToLong(scan -> scan.utime).distinct().count() != 2)
            throw new IllegalStateException("samples() gave one twice");
        List<Double> times = new ArrayList<>();
        for (double t : sim.every(0.25)) {
            times.add(t);
            if (times.size() == 4) break;
        }
        say(
                "every",
                times.get(1) - times.get(0),
                times.get(2) - times.get(1),
                times.get(3) - times.get(2),
                times.get(0) / 0.25 % 1.0);
        attempt("period", () -> sim.every(0.0));
        sim.quit();
        int rest = 0, ticks = 0;
        for (Scan scan : robot.lrf()) rest += scan.ranges.length > 0 ? 1 : 0;
        for (double t : sim.every(0.1)) ticks += t > 0.0 ? 1 : 0;
        say("ended", rest < 1000, ticks < 1000);
    }

    /** Paused; a scan each 20 steps. */
    private static void queue(Simulation sim) {
        Device<Scan> lrf = sim.robot("p3at").lrf();
        AtomicInteger came = new AtomicInteger();
        lrf.onSample(scan -> came.incrementAndGet());
        lrf.setQueueDepth(4);
        sim.step(20);
        waitFor(came, 1);
        long first = lrf.next(PATIENCE).utime, begin = lrf.dropped();
        sim.step(120);
        waitFor(came, 7);
        List<Object> line = new ArrayList<>(List.of("queue"));
        for (int i = 0; i < 4; ++i) line.add(lrf.next(PATIENCE).utime - first);
        line.add(lrf.dropped() - begin);
        line.add(lrf.queueDepth());
        line.add(sim.robot("p3at").lrf().queueDepth());
        say(line.toArray());
        lrf.setQueueDepth(1);
        sim.step(60);
        waitFor(came, 10);
        say("newest", lrf.next(PATIENCE).utime - first, lrf.dropped() - begin);
        for (int depth : new int[] {0, 1001})
            attempt("depth" + depth, () -> lrf.setQueueDepth(depth));
    }

    private static void waitFor(AtomicInteger came, int count) {
        while (came.get() < count) Thread.yield();
    }

    /** A log as a run: what would change it is refused, and it ends. */
    private static void played(Simulation sim) {
        Robot robot = sim.robot("p3at");
        say("world", sim.world(), robot.lrf().rangeMax > 1.0);
        attempt("drive", () -> robot.setVelocity(0.1, 0.0));
        attempt("pause", sim::pause);
        List<Double> xs = new ArrayList<>();
        for (Synchronised<Scan, Pose> both : sim.synchronised(robot.lrf(), robot.pose()))
            xs.add(both.second.x());
        say("went", xs.size(), xs.get(xs.size() - 1), sim.time());
    }

    private static void mapFiles(String folder) {
        OccupancyMap map = Ruedo.loadMap(folder + "/given.yaml");
        byte[][] cells = map.cells();
        double[] origin = map.origin();
        say(
                "map",
                cells.length,
                cells[0].length,
                map.resolution(),
                origin[0],
                origin[1],
                origin[2]);
        List<Object> line = new ArrayList<>(List.of("cells"));
        for (byte[] row : cells) for (byte cell : row) line.add((int) cell);
        say(line.toArray());
        map.save(folder + "/saved.yaml");
        attempt("name", () -> map.save(folder + "/saved.png"));
        for (String wrong : List.of("none", "missing", "resolution", "origin", "short", "picture"))
            attempt(wrong, () -> Ruedo.loadMap(folder + "/" + wrong + ".yaml"));
    }

    /** The depth of one camera among several, and the boxes of two. */
    private static void devicesByName(Simulation sim) {
        Robot robot = sim.robot("rig");
        say("width", robot.camera("right").latest(PATIENCE).width);
        say("depth", robot.camera("right").depth().latest(PATIENCE).width);
        List<Object> line = new ArrayList<>(List.of("boxes"));
        for (Boxes2D.Box2D box : robot.boxes2d().latest(PATIENCE).boxes)
            line.add(box.name + " " + box.label);
        say(line.toArray());
        Boxes3D.Box3D box = robot.boxes3d().latest(PATIENCE).boxes.get(0);
        say("solid", box.name, box.center[0], box.center[1], box.center[2]);
    }

    private static void bodies(Simulation sim) {
        Body crate = sim.body("crate");
        Transform pose = crate.pose();
        say("crate", crate.isStatic, crate.mass, pose.x(), pose.y(), pose.heading());
        crate.setPose(1.0, 2.0, 0.5);
        say("put", crate.pose().x(), crate.pose().y(), crate.pose().heading());
        crate.setTwist(new Twist(new double[] {0.0, 0.0, 3.0}, new double[3]));
        sim.step(10);
        double up = crate.twist().linear[2];
        say("rises", up < 3.0, up > 1.0, crate.pose().z() > 0.1);
        attempt("unknown", () -> sim.body("crat"));
        say("all", sim.bodies().size() > 1, sim.bodies().get(0).name);
    }

    private static void geometry(Simulation sim) {
        Transform a = Transform.of(1.0, 2.0, 0.3);
        Transform b =
                new Transform(new double[] {0.5, -1.0, 0.25}, new double[] {0.5, 0.5, 0.5, 0.5});
        Transform product = a.compose(b), identity = product.compose(product.inverse());
        double[] q = product.orientation(), i = identity.orientation();
        say("product", product.x(), product.y(), product.z(), q[0], q[1], q[2], q[3]);
        say(
                "identity",
                identity.x(),
                identity.y(),
                identity.z(),
                Math.abs(i[0]),
                Math.abs(i[1]),
                Math.abs(i[2]),
                Math.abs(i[3]));
        double[] applied = a.apply(1.0, 0.0, 0.0);
        say("apply", applied[0], applied[1], applied[2]);
        say(
                "angles",
                Transform.normalizeAngle(3.5),
                Transform.normalizeAngle(-3.5),
                Transform.normalizeAngle(7.0),
                Transform.normalizeAngle(0.25),
                Transform.normalizeAngle(-100.0));
        Robot robot = sim.robot("p3at");
        Scan scan = robot.lrf().latest(PATIENCE);
        Pose pose = robot.pose().latest(PATIENCE);
        double wall = 0.0;
        for (double[] point : scan.points(pose.transform().compose(robot.lrf().transform()))) {
            if (Math.abs(point[1]) < 1.0) wall = Math.max(wall, point[0]);
        }
        say("wall", wall);
    }

    private static void driving(Simulation sim) {
        Robot robot = sim.robot("p3at");
        double begin = robot.pose().latest(PATIENCE).x();
        try (Robot.Driving driving = robot.driving(0.3, 0.0)) {
            sim.sleep(driving == null ? 0.0 : 2.0);
        }
        double speed = 1.0;
        while (speed > 0.0) speed = robot.motion().next(PATIENCE).v;
        say("went", robot.pose().next(PATIENCE).x() - begin > 0.3);
        velocity_command_t command = new velocity_command_t();
        command.vx = 0.1;
        sim.publish("p3at/velocity", command);
        double fastest = 0.0;
        while (fastest == 0.0 || robot.motion().latest(PATIENCE).v > 0.0)
            fastest = Math.max(fastest, robot.motion().next(PATIENCE).v);
        say("published", fastest); // it lapsed: nobody repeats it
    }

    private static void saves(Simulation sim) {
        long begin = sim.state().step;
        State saved = sim.save("here");
        sim.step(40);
        say("back", sim.restore(saved).step - begin, sim.state().step - begin);
    }

    /** 8 x 6 m with walls of a cell, about the origin, and a pillar of a cell. */
    private static void chart() {
        byte[][] cells = new byte[60][80];
        for (int row = 0; row < 60; ++row) {
            for (int column = 0; column < 80; ++column) {
                boolean wall = row == 0 || row == 59 || column == 0 || column == 79;
                if (wall || row == 40 && column == 50) cells[row][column] = 100;
            }
        }
        OccupancyMap map = new OccupancyMap(cells, 0.1, -4.0, -3.0, 0.0);
        say("at", map.at(0.0, 0.0), map.at(1.05, 1.05), map.at(9.0, 0.0));
        List<Object> line = new ArrayList<>(List.of("rays"));
        for (int i = 0; i < 63; ++i) line.add(map.ray(-0.5, -0.75, 0.1 * i, 30.0));
        line.add(map.ray(0.0, 0.0, 0.0, 1.0));
        say(line.toArray());
        double[][] field = map.distanceField();
        line = new ArrayList<>(List.of("field"));
        for (int row = 0; row < 60; row += 7)
            for (int column = 0; column < 80; column += 9) line.add(field[row][column]);
        say(line.toArray());
        OccupancyMap grown = map.inflated(0.25);
        say("grown", grown.occupied(1.05, 1.25), grown.occupied(1.05, 1.35));
    }

    private static void fixes(Simulation sim) {
        NavSat first = sim.robot("here").gps().latest(PATIENCE);
        double[] enu = sim.robot("there").gps().latest(PATIENCE).enu(first);
        say("enu", enu[0], enu[1], enu[2]);
        say("heading", sim.robot("there").imu().latest(PATIENCE).heading());
        attempt("none", () -> sim.robot("here").magnetometer());
    }

    public static void main(String[] args) {
        try (Simulation sim = Ruedo.connect(args[0], "api", 60.0)) {
            switch (args[1]) {
                case "joints":
                    joints(sim);
                    break;
                case "in_step":
                    inStep(sim);
                    break;
                case "bodies":
                    bodies(sim);
                    break;
                case "geometry":
                    geometry(sim);
                    break;
                case "driving":
                    driving(sim);
                    break;
                case "chart":
                    chart();
                    break;
                case "saves":
                    saves(sim);
                    break;
                case "queue":
                    queue(sim);
                    break;
                case "played":
                    played(sim);
                    break;
                case "map_files":
                    mapFiles(args[2]);
                    break;
                case "devices_by_name":
                    devicesByName(sim);
                    break;
                case "fixes":
                    fixes(sim);
                    break;
                case "joints_in_lockstep":
                    jointsInLockstep(sim);
                    break;
                default:
                    throw new IllegalArgumentException(args[1]);
            }
        }
        System.exit(0);
    }
}
