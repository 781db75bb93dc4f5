import ruedo.Body;
import ruedo.Collisions;
import ruedo.Command;
import ruedo.Contact;
import ruedo.Device;
import ruedo.Image;
import ruedo.LaunchOptions;
import ruedo.Limits;
import ruedo.Log;
import ruedo.Marker;
import ruedo.Motion;
import ruedo.MotionStatus;
import ruedo.Observations;
import ruedo.Odometry;
import ruedo.Pose;
import ruedo.Robot;
import ruedo.Ruedo;
import ruedo.RuedoException;
import ruedo.Scan;
import ruedo.Simulation;
import ruedo.SonarReading;
import ruedo.State;
import ruedo.Stream;
import ruedo.Subscription;
import ruedo.lcmtypes.joint_command_t;

import java.io.ByteArrayOutputStream;
import java.io.DataOutputStream;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import java.util.Locale;
import java.util.Set;
import java.util.TreeSet;
import java.util.concurrent.CountDownLatch;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.atomic.AtomicBoolean;
import java.util.concurrent.atomic.AtomicInteger;
import java.util.function.Supplier;
import java.util.zip.CRC32;

/**
 * The Java probe: does what a test asks of a client and prints the results. probe.py and probe.cpp
 * are its twins, with the same commands and output.
 */
public final class Probe {
    private static final double PATIENCE = 300.0; // s, for what comes sooner or later
    private static final int AGAIN = 60; // s, for what follows soon, or never

    private Probe() {}

    private static void say(Object... words) {
        StringBuilder line = new StringBuilder();
        for (Object word : words) {
            String text = String.valueOf(word);
            if (word instanceof Double) text = String.format(Locale.ROOT, "%.6f", word);
            if (word instanceof Boolean) text = (Boolean) word ? "True" : "False";
            line.append(line.length() == 0 ? "" : " ").append(text.replace('\n', ' '));
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

    private static long bodiesOfGuest(Simulation sim) {
        return sim.bodies().stream().filter(body -> body.name.startsWith("guest/")).count();
    }

    private static void listAll(Simulation sim) {
        say("world", sim.world(), sim.seed(), sim.stepSize());
        for (Robot robot : sim.robots()) {
            say(
                    "robot",
                    robot.name,
                    robot.drive().isEmpty() ? "-" : robot.drive(),
                    robot.watchdog(),
                    robot.track());
            for (Device<?> d : robot.devices()) {
                say(
                        "device",
                        robot.name,
                        d.name,
                        d.kind,
                        d.type,
                        d.rate,
                        d.rangeMax,
                        d.elements.length);
            }
        }
        for (Body body : sim.bodies()) say("body", body.name, body.isStatic, body.mass);
    }

    private static void read(Simulation sim, String name) {
        Robot robot = sim.robot(name);
        Scan scan = robot.lrf().latest(PATIENCE);
        say(
                "scan",
                scan.ranges.length,
                scan.angle(0),
                scan.angle(scan.ranges.length - 1),
                scan.nearest(-Math.PI, Math.PI),
                scan.intensities.length);
        SonarReading reading = robot.sonar().latest(PATIENCE);
        double largest = 0.0;
        for (float range : reading.ranges) largest = Math.max(largest, range);
        say(
                "sonar",
                reading.ranges.length,
                largest,
                reading.firedUtime.length,
                reading.fresh.length);
        Odometry odometry = robot.odometry().latest(PATIENCE);
        say("odometry", odometry.x, odometry.y, odometry.theta, odometry.wheelAngles.length);
        Pose pose = robot.pose().latest(PATIENCE);
        say("pose", pose.x(), pose.y(), pose.heading());
        long first = robot.lrf().next(PATIENCE).utime;
        long second = robot.lrf().next(PATIENCE).utime;
        say("next", second - first);
        for (Device<?> device : robot.devices()) {
            if (!device.type.equals("image_t")) continue;
            Image image = robot.camera().latest(PATIENCE);
            say("image", image.width, image.height, image.format, image.data.length > 0);
            break;
        }
    }

    private static double chord(double v, double omega, double time) {
        return Math.abs(omega == 0.0 ? v * time : 2.0 * v / omega * Math.sin(omega * time / 2.0));
    }

    /**
     * At the commanded speed, and for that long without a gap: a client that was not scheduled for
     * a long time has to start over.
     */
    private static void drive(Simulation sim, String[] a, boolean wheels) {
        Robot robot = sim.robot(a[0]);
        double first = Double.parseDouble(a[1]);
        double second = Double.parseDouble(a[2]);
        if (wheels) {
            robot.setWheels(first, second);
        } else {
            robot.setVelocity(first, second);
        }
        double v = wheels ? robot.wheelRadius() * first : first; // both sides alike
        double omega = wheels ? 0.0 : second;
        robot.pose().latest(PATIENCE);
        while (true) {
            MotionStatus status = robot.motion().next(PATIENCE);
            if (Math.abs(status.v - v) > 1e-6 || Math.abs(status.omega - omega) > 1e-6) continue;
            Pose begin = robot.pose().next(PATIENCE);
            sim.sleep(Double.parseDouble(a[3]));
            Pose end = robot.pose().next(PATIENCE);
            double time = end.time() - begin.time();
            double moved = Math.hypot(end.x() - begin.x(), end.y() - begin.y());
            double turned = Math.IEEEremainder(end.heading() - begin.heading(), 2 * Math.PI);
            if (Math.abs(moved - chord(v, omega, time)) > 1e-3) continue;
            if (Math.abs(Math.IEEEremainder(turned - omega * time, 2 * Math.PI)) > 1e-3) continue;
            say("status", status.kind, status.state, status.v, status.omega);
            say("moved", moved, turned, time);
            break;
        }
        robot.stop().await(PATIENCE);
        say("stopped", robot.motion().next(PATIENCE).v);
    }

    private static void run(Simulation sim, Robot robot, String what, Supplier<Motion> start) {
        Pose begin = robot.pose().next(PATIENCE);
        sim.pause(); // else it may be over, for who looks late
        Motion motion = start.get();
        boolean early = motion.done();
        sim.resume();
        motion.await(PATIENCE);
        Pose end = robot.pose().next(PATIENCE);
        say(
                what,
                early,
                motion.done(),
                motion.state(),
                motion.reason().isEmpty() ? "-" : motion.reason(),
                Math.hypot(end.x() - begin.x(), end.y() - begin.y()),
                Math.IEEEremainder(end.heading() - begin.heading(), 2 * Math.PI));
    }

    private static void primitives(Simulation sim, String name) {
        Robot robot = sim.robot(name);
        robot.stop().await(PATIENCE);
        run(sim, robot, "advance", () -> robot.advance(0.4, new Limits(0.5, 0.0, 0.0)));
        run(sim, robot, "rotate", () -> robot.rotate(1.2));
        run(sim, robot, "turn_to", () -> robot.turnTo(0.0));
        run(sim, robot, "arc", () -> robot.arc(0.8, 0.5));
        Motion replaced =
                robot.advance(
                        5.0,
                        new Limits(0.05, 0.0, 0.0)); // slowly: whoever is late finds it under way
        sim.sleep(0.5);
        robot.stop().await(PATIENCE);
        attempt("replaced", () -> replaced.await());
        Motion running = robot.advance(5.0, new Limits(0.05, 0.0, 0.0));
        attempt(
                "refused",
                () ->
                        robot.advance(2e6)
                                .await()); // further than the server allows: what runs goes on
        attempt("too_long", () -> running.await(0.3));
        robot.stop().await(PATIENCE);
    }

    /** Into the wall, off it, and into it again. */
    private static void collisions(Simulation sim, String name) {
        Robot robot = sim.robot(name);
        Collisions first = robot.collisions().latest(PATIENCE);
        say("free", first.points.size(), first.blockedBy.isEmpty() ? "-" : first.blockedBy);
        List<Object> met = Collections.synchronizedList(new ArrayList<>(List.of("met")));
        Subscription open = robot.onCollision(sample -> met.add(sample.points.get(0).body));
        try (open) {
            for (String what : List.of("once", "twice")) {
                Motion motion = robot.advance(20.0);
                attempt(what, () -> motion.await());
                say(what + "_by", motion.blockedBy());
                Collisions seen = robot.collisions().latest(PATIENCE);
                Set<String> bodies = new TreeSet<>();
                for (Contact.Point point : seen.points) bodies.add(point.body);
                say(what + "_seen", seen.blockedBy, String.join(" ", bodies));
                robot.advance(-0.5).await(PATIENCE);
                while (!robot.collisions().next(PATIENCE).points.isEmpty()) continue;
            }
        }
        say(met.toArray());
        String off = robot.collisions().latest(PATIENCE).blockedBy;
        say("off", off.isEmpty() ? "-" : off);
    }

    private static void errors(Simulation sim, String name) {
        attempt("robot", () -> sim.robot("nobody"));
        Robot robot = sim.robot(name);
        attempt("device", () -> robot.device("nothing"));
        attempt("nan", () -> robot.setVelocity(Double.NaN, 0.0));
        attempt("radius", () -> robot.arc(1.0, 0.0));
        attempt("limit", () -> robot.advance(1.0, new Limits(-1.0, 0.0, 0.0)));
        attempt("spawn", () -> sim.spawn("no such model", 0.0, 0.0, 0.0, ""));
    }

    private static void markers(Simulation sim, String name) {
        float[] red = {1f, 0f, 0f, 0.5f};
        List<Marker> all =
                List.of(
                        Marker.lines(new double[][] {{0, 0, 0}, {1, 0, 0}}, red, 0.02),
                        Marker.path(new double[][] {{0, 0, 0}, {1, 0, 0}, {1, 2, 0}}, red, 0.02),
                        Marker.points(new double[][] {{0, 0, 1}}, red, 0.1),
                        Marker.text("goal", new double[] {1, 2, 0.5}, red, 0.3),
                        Marker.map(
                                new int[] {0, 100, 255, 50},
                                2,
                                0.5,
                                new double[] {1, 1, 0},
                                Math.PI / 2,
                                red));
        sim.markers("plan", all, name);
        sim.markers("gone", List.of());
        attempt("lines", () -> Marker.lines(new double[][] {{0, 0, 0}}, red, 0.02));
        attempt("size", () -> Marker.points(new double[0][], red, 0.0));
        attempt("color", () -> Marker.points(new double[0][], new float[] {2f, 0f, 0f, 1f}, 0.1));
        attempt(
                "cells",
                () -> Marker.map(new int[] {101}, 1, 0.5, new double[] {0, 0, 0}, 0.0, red));
        attempt("layer", () -> sim.markers("", List.of()));
        attempt(
                "large",
                () -> sim.markers("large", List.of(Marker.points(new double[6000][3], red, 0.1))));
        sim.state();
        sim.sleep(0.2);
    }

    private static void streams(Simulation sim, String name, double lrf, double odometry) {
        Robot robot = sim.robot(name);
        attempt("lrf", () -> robot.lrf().latest(lrf));
        attempt("odometry", () -> robot.odometry().latest(odometry));
    }

    private static void control(Simulation sim, String name) throws InterruptedException {
        sim.pause();
        State before = sim.state();
        Thread.sleep(200);
        say("paused", before.paused, sim.state().step == before.step);
        say("step", sim.step(7).step - before.step);
        say("name", sim.state(name).name, sim.state(name).position[0]);
        sim.setRate(2.0);
        sim.resume();
        sim.sleep(0.2);
        say("rate", sim.state().rate);
        sim.pause();
        sim.reset();
        say("reset", sim.state().step);
        attempt("unknown", () -> sim.state("nobody"));
        attempt("steps", () -> sim.step(0));
    }

    private static void sleeps(Simulation sim, double seconds) {
        double begin = sim.time();
        sim.sleep(seconds);
        say("slept", begin, sim.time() - begin);
        sim.snapshot("here");
        begin = sim.restore("here").time();
        sim.sleep(seconds);
        say("slept_again", begin, sim.time() - begin);
    }

    private static void snapshots(Simulation sim) {
        String first = sim.spawn("p3at", 3.0, 1.0, 0.0, ""),
                second = sim.spawn("p3at", 3.0, -1.0, 0.0, "");
        say("names", first, second, sim.spawn("p3at", -3.0, 1.0, 0.0, "guest"));
        sim.step(40);
        State saved = sim.snapshot("here");
        State later = sim.step(60);
        State back = sim.restore("here");
        say(
                "same",
                back.step == saved.step,
                back.stateHash == saved.stateHash,
                sim.step(60).stateHash == later.stateHash);
        say("steps", saved.step, later.step);
    }

    private static void world(Simulation sim, String text) {
        double[] ahead = {1.0, 0.0, 0.0, 0.0};
        sim.spawn("p3at", 3.0, 1.0, 0.0, "guest");
        Robot guest = sim.robot("guest");
        say("there", sim.state("guest").position[0], sim.robots().size(), bodiesOfGuest(sim));
        guest.setVelocity(0.3, 0.0);
        while (sim.state("guest").position[0] <= 3.05) sim.sleep(0.1);
        say("drives", true, guest.lrf().latest(PATIENCE).ranges.length);
        guest.stop().await(PATIENCE);
        sim.setPose("guest", 3.0, 2.0, 1.0, 0.0);
        say("put", sim.state("guest").position[1]);
        sim.spawn("", text, "ball", new double[] {-3.0, 2.0, 0.0}, ahead, true);
        sim.setTwist("ball", new double[] {0.0, 1.0, 0.0}, new double[3]);
        sim.sleep(0.3);
        say("rolls", sim.state("ball").position[1] > 2.05);
        attempt("taken", () -> sim.spawn("p3at", -3.0, -2.0, 0.0, "guest"));
        attempt("room", () -> sim.spawn("p3at", 3.0, 2.0, 0.0, ""));
        attempt(
                "text",
                () -> sim.spawn("", "<sdf", "", new double[] {0.0, -3.0, 0.0}, ahead, true));
        attempt("driven", () -> sim.setTwist("guest", new double[] {1.0, 0.0, 0.0}, new double[3]));
        sim.reset(Simulation.Reset.POSES, -1);
        say("poses", sim.state("guest").position[1], sim.state().time() > 1.0);
        sim.pause();
        sim.reset(Simulation.Reset.TIME, -1);
        say("time", sim.state().time() < 1.0, sim.robots().size());
        sim.resume();
        sim.remove("guest");
        say("gone", sim.robots().size(), bodiesOfGuest(sim));
        attempt("unknown", () -> sim.remove("guest"));
    }

    private static void lockstep(Simulation sim, String[] a) {
        Robot robot = sim.robot(a[1]);
        int steps = Integer.parseInt(a[2]);
        int chunk = Integer.parseInt(a[3]);
        CRC32 digest = new CRC32();
        int messages = 0;
        int poses = 0;
        Odometry odometry = null;
        Observations last = sim.step(0);
        say("begin", last.step, last.time());
        for (int step = -1; step < steps; step = step < 0 ? 0 : step + chunk) {
            if (step >= 0) {
                List<Command> commands = new ArrayList<>();
                for (int k = 0; k < chunk; k++)
                    commands.add(robot.velocityCommand(Double.parseDouble(a[4]), 0.1 * k).at(k));
                last = sim.step(chunk, commands);
            }
            for (Observations.Message message : last.messages) {
                digest.update(message.channel.getBytes(StandardCharsets.UTF_8));
                digest.update(message.data);
                messages++;
            }
            poses += last.all(robot.pose()).size();
            if (last.latest(robot.odometry()) != null) odometry = last.latest(robot.odometry());
        }
        say("end", last.step, last.stateHash, messages, poses, digest.getValue());
        say("odometry", odometry.utime, odometry.x);
        attempt("past", () -> sim.step(1, List.of(robot.velocityCommand(0.1, 0.0).at(1))));
    }

    private static void givenUp(Simulation sim) {
        sim.step(0);
        try {
            sim.step(2000, List.of(), 0.0);
            say("given_up", "no");
        } catch (RuedoException.Timeout error) {
            say("given_up", "Timeout");
        }
        long first = sim.step(1).step;
        say("then", first, sim.step(1).step);
    }

    private static void visited(Simulation sim, String[] a) {
        Robot robot = sim.robot(a[1]);
        CRC32 digest = new CRC32();
        int messages = 0;
        int ofGuest = 0;
        String guest = "";
        Observations last = null;
        for (int turn = 0; turn < 9; turn++) {
            if (turn == 3) {
                guest = sim.spawn("p3at", 3.0, 1.0, 0.0, "");
                say("guest", guest);
            }
            if (turn == 6) sim.remove(guest);
            List<Command> commands = new ArrayList<>(List.of(robot.velocityCommand(0.3, 0.2)));
            if (turn >= 3 && turn < 6)
                commands.add(sim.robot(guest).velocityCommand(0.2, -0.3).at(5));
            last = sim.step(10, commands);
            for (Observations.Message message : last.messages) {
                digest.update(message.channel.getBytes(StandardCharsets.UTF_8));
                digest.update(message.data);
                messages++;
                if (message.channel.startsWith("p3at_2/")) ofGuest++;
            }
        }
        say("end", last.step, last.stateHash, messages, ofGuest, digest.getValue());
    }

    /** Commands that go with no step. */
    private static void beside(Simulation sim, String[] a) {
        Robot robot = sim.robot(a[1]);
        attempt("before", () -> robot.setVelocity(0.3, 0.0));
        sim.step(0);
        attempt("velocity", () -> robot.setVelocity(0.3, 0.0));
        attempt("wheels", () -> robot.setWheels(1.0, 1.0));
        attempt("advance", () -> robot.advance(1.0));
        attempt("rotate", () -> robot.rotate(1.0));
        attempt("turn_to", () -> robot.turnTo(1.0));
        attempt("arc", () -> robot.arc(1.0, 0.5));
        attempt("stop", () -> robot.stop());
        Observations last = sim.step(200);
        say("end", last.step, last.stateHash, last.messages.size());
    }

    /** Sends them all to 0.2, in lockstep. */
    private static void joints(Simulation sim, String[] a) {
        joint_command_t order = new joint_command_t();
        order.name = Arrays.copyOfRange(a, 2, a.length);
        order.n = order.name.length;
        order.mode = new byte[order.n];
        order.value = new double[order.n];
        Arrays.fill(order.value, 0.2);
        ByteArrayOutputStream bytes = new ByteArrayOutputStream();
        try {
            order.encode(new DataOutputStream(bytes));
        } catch (IOException error) {
            throw new IllegalStateException(error);
        }
        sim.step(0);
        Command command = new Command(a[1] + "/joint_command", bytes.toByteArray());
        attempt("joints", () -> sim.step(1, List.of(command)));
        say("then", sim.step(1).step);
    }

    private static void sideways(Simulation sim, String name) {
        Robot robot = sim.robot(name);
        attempt("command", () -> robot.velocityCommand(0.2, 0.1, 0.3));
        attempt("velocity", () -> robot.setVelocity(0.2, 0.1, 0.3));
        attempt("none", () -> robot.setVelocity(0.0, 0.0, 0.0));
    }

    /** Lockstep in which others act. */
    private static void watches(Simulation sim, String[] a) {
        Observations seen = sim.step(0);
        say("begin", seen.step, seen.time(), seen.stateHash);
        Observations last = sim.step(Integer.parseInt(a[1]));
        CRC32 digest = new CRC32();
        for (Observations.Message message : last.messages) {
            digest.update(message.channel.getBytes(StandardCharsets.UTF_8));
            digest.update(message.data);
        }
        say("end", last.step, last.stateHash, last.messages.size(), digest.getValue());
    }

    /** In a callback, while the step that calls it goes on. */
    private static void leaves(Simulation sim, String[] a) {
        sim.robot(a[1]).odometry().onSample(sample -> sim.close());
        try {
            sim.step(1000);
        } catch (RuedoException.NoServer error) {
            say("left");
        }
    }

    private static void launched(String[] a) throws InterruptedException {
        LaunchOptions options =
                new LaunchOptions().seed(3).args(Arrays.copyOfRange(a, 1, a.length));
        Simulation sim = Ruedo.launch(a[0], options);
        say("url", sim.url);
        say("ready", sim.robots().get(0).odometry().latest(PATIENCE).time() >= 0.0);
        while (true) Thread.sleep(1000);
    }

    /** The second: the text of a world, instead of the world. */
    private static double ahead(Scan scan) {
        double least = Double.POSITIVE_INFINITY;
        for (int i = 60; i < 120; i++) least = Math.min(least, scan.ranges[i]);
        return least;
    }

    /**
     * Of the newest sample, s of sim time; without the real time that the question takes, in which
     * sim time goes on.
     */
    private static void sayAge(Simulation sim, double newest, long begin) {
        double now = sim.state().time();
        say("age", now - newest - (System.nanoTime() - begin) * 1e-9);
    }

    /** A program that does something else after it has launched a run at the highest rate. */
    private static void beginsLate(String firstCall) throws InterruptedException {
        LaunchOptions options =
                new LaunchOptions()
                        .rate(Double.POSITIVE_INFINITY)
                        .noise(false)
                        .disable("p3at/camera");
        long begun = System.nanoTime();
        try (Simulation sim = Ruedo.launch("arena", options)) {
            Stream<Pose> poses = sim.robot("p3at").pose();
            double stands;
            while ((stands = sim.state().time()) < 2.0) Thread.sleep(20);
            say("before", stands, (System.nanoTime() - begun) * 1e-9);
            if (firstCall.equals("latest"))
                say("latest", poses.latest(PATIENCE).time(), (System.nanoTime() - begun) * 1e-9);
            long called = System.nanoTime();
            if (firstCall.equals("on_sample")) {
                CountDownLatch done = new CountDownLatch(1);
                poses.onSample(
                        pose -> {
                            if (pose.time() >= 100.0) done.countDown();
                        });
                done.await((long) PATIENCE, TimeUnit.SECONDS);
            } else {
                sim.sleep(100.0 - sim.time());
            }
            say("after", (System.nanoTime() - called) * 1e-9);
        }
    }

    /**
     * What a program does in a run that it launched: looks now and then, works in a callback, and
     * acts on what it sees.
     */
    private static void keepsUp(String rate) throws InterruptedException {
        LaunchOptions options =
                new LaunchOptions()
                        .rate(
                                rate.equals("max")
                                        ? Double.POSITIVE_INFINITY
                                        : Double.parseDouble(rate))
                        .noise(false)
                        .disable("p3at/camera");
        try (Simulation sim = Ruedo.launch("arena", options)) {
            Robot robot = sim.robot("p3at");
            for (int i = 0; i < 5; i++) {
                Thread.sleep(200);
                long begin = System.nanoTime();
                double newest = robot.pose().latest(PATIENCE).time();
                sayAge(sim, newest, begin);
            }
            List<Double> seen = Collections.synchronizedList(new ArrayList<>());
            Subscription open =
                    robot.lrf()
                            .onSample(
                                    scan -> {
                                        seen.add(scan.time());
                                        pause(150);
                                    });
            try (open) {
                sim.sleep(2.0);
                long begin = System.nanoTime();
                double newest = robot.odometry().latest(PATIENCE).time();
                sayAge(sim, newest, begin);
            }
            double gap = 0.0;
            for (int i = 1; i < seen.size(); i++)
                gap = Math.max(gap, seen.get(i) - seen.get(i - 1));
            say("seen", seen.size(), gap, robot.lrf().dropped());
            for (int i = 0; i < 10; i++) {
                robot.rotate(0.1).await(PATIENCE);
                double heading = robot.pose().next(PATIENCE).heading();
                sim.sleep(0.2);
                say("after", Math.abs(robot.pose().latest(PATIENCE).heading() - heading));
            }
            robot.turnTo(0.0).await(PATIENCE);
            while (ahead(robot.lrf().next(PATIENCE)) > 0.8) robot.setVelocity(0.4, 0.0);
            robot.setVelocity(0.0, 0.0);
            sim.sleep(2.0);
            say("stands", ahead(robot.lrf().next(PATIENCE)));
        }
    }

    private static void pause(long ms) {
        try {
            Thread.sleep(ms);
        } catch (InterruptedException end) {
            Thread.currentThread().interrupt();
        }
    }

    private static void manyPrimitives(Simulation sim, String name, int count) {
        Robot robot = sim.robot(name);
        int done = 0;
        for (int i = 0; i < count; i++)
            if (robot.rotate(i % 2 == 1 ? 0.02 : -0.02).await(PATIENCE).done()) done++;
        say("done", done);
    }

    /** Of the server that takes the place of this one. */
    private static void heardAgain(Simulation sim, String name) throws InterruptedException {
        CountDownLatch begun = new CountDownLatch(1);
        sim.onNewRun(begun::countDown);
        sim.robot(name).pose().next(PATIENCE);
        say("heard", "first");
        if (!begun.await(AGAIN, TimeUnit.SECONDS)) return;
        sim.robot(name).pose().next(PATIENCE);
        say("heard", "again");
    }

    private static void launchedWith(String[] a) {
        LaunchOptions options =
                new LaunchOptions()
                        .seed(5)
                        .lockstep(1)
                        .spawn("p3at:guest@2,0")
                        .disable("p3at/camera", "guest/camera")
                        .setting("p3at/lrf.update_rate", 20)
                        .noise(false)
                        .text(a.length > 1 ? a[1] : "")
                        .timeout(400.0);
        try (Simulation sim = Ruedo.launch(a[0], options)) {
            List<String> names = new ArrayList<>();
            for (Robot robot : sim.robots()) names.add(robot.name);
            say("robots", String.join(" ", names));
            say("seed", sim.seed());
            Robot robot = sim.robot("p3at");
            List<String> devices = new ArrayList<>();
            for (Device<?> device : robot.devices()) devices.add(device.name);
            say("devices", String.join(" ", devices));
            say("rate", robot.lrf().rate);
            Observations seen = sim.step(20, List.of(robot.velocityCommand(0.3, 0.0)));
            say("scans", seen.all(robot.lrf()).size(), seen.latest(robot.lrf()).ranges[90]);
        }
    }

    private static void readLog(String[] a) {
        Log log = Ruedo.readLog(a[0]);
        say("channels", String.join(" ", log.channels()));
        List<Scan> scans = log.samples("p3at/lrf", Scan.class);
        Scan scan = scans.get(scans.size() - 1);
        say("scans", scans.size(), log.count("p3at/lrf"), scan.utime, scan.ranges[90]);
        List<Pose> poses = log.samples("p3at/pose", Pose.class);
        Pose pose = poses.get(poses.size() - 1);
        say("poses", poses.size(), pose.utime, pose.position[0]);
        List<byte[]> raw = log.bytes("p3at/pose");
        say("raw", raw.get(raw.size() - 1).length);
        say("fault", log.fault());
        List<Long> times = new ArrayList<>();
        double begin = a.length > 1 ? Double.parseDouble(a[1]) : 0.3;
        log.each("p3at/pose", Pose.class, begin, begin + 0.2, each -> times.add(each.utime));
        say("range", times.size(), times.get(0), times.get(times.size() - 1));
        log.each("p3at/pose", Pose.class, 1e6, Double.POSITIVE_INFINITY, each -> times.add(0L));
        say("beyond", times.size());
        attempt("unknown", () -> log.samples("nobody", Scan.class));
        attempt("mismatch", () -> log.samples("p3at/pose", Scan.class));
    }

    /** What another client of this process, or of the same name, has under way is not its own. */
    private static void apart(String url, String name) throws InterruptedException {
        for (int i = 0; i < 8; i++) {
            String what = i % 2 == 0 ? "unnamed" : "driver";
            try (Simulation first = joined(url, what)) {
                Motion running = first.robot(name).advance(5.0, new Limits(0.05, 0.0, 0.0));
                // Done: lost on the way.
                while (running.progress() == 0.0 && !running.done()) Thread.sleep(10);
                try (Simulation second = joined(url, what)) {
                    attempt(what, () -> second.robot(name).advance(0.02).await(PATIENCE));
                    attempt("first_" + what, () -> running.await(PATIENCE));
                }
            }
        }
    }

    private static Simulation joined(String url, String what) {
        return what.equals("unnamed")
                ? Ruedo.connect(url, "client-" + ProcessHandle.current().pid(), 60.0)
                : Ruedo.connect(url, what, 60.0);
    }

    /** A callback does. how: what the program does then. */
    private static void fails(String url, String how) throws InterruptedException {
        AtomicBoolean failed = new AtomicBoolean();
        AtomicInteger others = new AtomicInteger();
        Simulation sim = Ruedo.connect(url, "probe", 60.0);
        Stream<Odometry> odometry = sim.robot("p3at").odometry();
        odometry.onSample(sample -> others.incrementAndGet());
        odometry.onSample( // the last call before the one that throws
                sample -> {
                    if (!failed.getAndSet(true)) throw new AssertionError("a fault of the user's");
                });
        while (!failed.get() && !how.equals("sleep")) Thread.sleep(10);
        if (!how.equals("sleep")) Thread.sleep(300); // that it is kept
        if (how.equals("forget")) return;
        if (how.equals("close")) {
            attempt("raised", sim::close);
            attempt("once", sim::close);
            return;
        }
        try (Simulation there = sim) {
            if (how.equals("leave")) return;
            if (how.equals("other")) throw new IllegalStateException("another fault");
            attempt("raised", () -> call(there, how));
            attempt("once", odometry::latest);
            long deadline = System.nanoTime() + (long) (1e9 * PATIENCE); // the next sample comes
            while (others.get() < 2 && System.nanoTime() < deadline) Thread.sleep(10);
            say("others", others.get() > 1);
        } catch (IllegalStateException error) {
            say("won", error.getMessage());
            Throwable suppressed = error.getSuppressed()[0];
            say("suppressed", suppressed.getClass().getSimpleName() + ":", suppressed.getMessage());
        }
    }

    private static void call(Simulation sim, String how) {
        if (how.equals("latest")) sim.robot("p3at").odometry().latest();
        if (how.equals("sleep")) sim.sleep(PATIENCE);
        if (how.equals("command")) sim.robot("p3at").setVelocity(0.0, 0.0);
        if (how.equals("request")) sim.state();
    }

    /** The run does, while a call waits for it. */
    private static void ends(String url, String call) throws InterruptedException {
        CountDownLatch ended = new CountDownLatch(1);
        try (Simulation sim = Ruedo.connect(url, "probe", 60.0)) {
            Robot robot = sim.robot("p3at");
            if (call.equals("uncaught_failed"))
                robot.odometry()
                        .onSample(
                                sample -> {
                                    while (ended.getCount() > 0) Thread.onSpinWait();
                                    throw new AssertionError("a fault of the user's");
                                });
            if (!sim.lockstep()) sim.resume();
            say("joined");
            if (call.startsWith("uncaught")) {
                try {
                    sim.sleep(PATIENCE);
                } finally {
                    ended.countDown();
                    Thread.sleep(300);
                }
            }
            attempt("ended", () -> awaitEnd(sim, robot, call));
            attempt("request", sim::state);
        }
    }

    private static void awaitEnd(Simulation sim, Robot robot, String call) {
        while (call.equals("next")) robot.odometry().next(PATIENCE);
        if (call.equals("sleep")) sim.sleep(PATIENCE);
        if (call.equals("wait")) robot.advance(5.0, new Limits(0.01, 0.0, 0.0)).await();
        while (call.equals("step")) sim.step(20);
    }

    /** Sim time does. */
    private static void stands(String url, String call) throws InterruptedException {
        Simulation sim = Ruedo.connect(url, "waits", 60.0);
        if (call.equals("stepped")) sim.step(1);
        boolean drives = call.equals("wait") || call.equals("sleep");
        Motion motion = drives ? sim.robot("p3at").advance(1.0) : null;
        if (drives) attempt("timeout", () -> motion.await(1.2));
        Thread closing =
                new Thread(
                        () -> {
                            try {
                                Thread.sleep(8000);
                            } catch (InterruptedException error) {
                                return;
                            }
                            sim.close();
                        });
        closing.start();
        attempt(
                "ended",
                () -> {
                    if (call.equals("wait")) motion.await();
                    else sim.sleep(1.0);
                });
        closing.join();
    }

    private static void act(String url, String command, String[] a) throws InterruptedException {
        if (command.equals("launch")) launched(a);
        if (command.equals("launch_with")) {
            launchedWith(a);
            return;
        }
        if (command.equals("keeps_up")) {
            keepsUp(a[0]);
            return;
        }
        if (command.equals("begins_late")) {
            beginsLate(a[0]);
            return;
        }
        if (command.equals("log")) {
            readLog(a);
            return;
        }
        if (command.equals("apart")) {
            apart(url, a[0]);
            return;
        }
        boolean named =
                List.of("lockstep", "visited", "watches", "leaves", "beside", "joints")
                        .contains(command);
        try (Simulation sim =
                command.equals("connect")
                        ? Ruedo.connect(url)
                        : Ruedo.connect(url, named ? a[0] : "probe", 60.0)) {
            switch (command) {
                case "lockstep":
                    lockstep(sim, a);
                    break;
                case "given_up":
                    givenUp(sim);
                    break;
                case "visited":
                    visited(sim, a);
                    break;
                case "watches":
                    watches(sim, a);
                    break;
                case "leaves":
                    leaves(sim, a);
                    break;
                case "beside":
                    beside(sim, a);
                    break;
                case "joints":
                    joints(sim, a);
                    break;
                case "sideways":
                    sideways(sim, a[0]);
                    break;
                case "connect":
                    say("connected", sim.world());
                    break;
                case "list":
                    listAll(sim);
                    break;
                case "read":
                    read(sim, a[0]);
                    break;
                case "velocity":
                    drive(sim, a, false);
                    break;
                case "wheels":
                    drive(sim, a, true);
                    break;
                case "primitives":
                    primitives(sim, a[0]);
                    break;
                case "many_primitives":
                    manyPrimitives(sim, a[0], Integer.parseInt(a[1]));
                    break;
                case "heard_again":
                    heardAgain(sim, a[0]);
                    break;
                case "collisions":
                    collisions(sim, a[0]);
                    break;
                case "errors":
                    errors(sim, a[0]);
                    break;
                case "markers":
                    markers(sim, a[0]);
                    break;
                case "streams":
                    streams(sim, a[0], Double.parseDouble(a[1]), Double.parseDouble(a[2]));
                    break;
                case "control":
                    control(sim, a[0]);
                    break;
                case "world":
                    world(sim, a[0]);
                    break;
                case "snapshots":
                    snapshots(sim);
                    break;
                case "sleeps":
                    sleeps(sim, Double.parseDouble(a[0]));
                    break;
                case "quit":
                    sim.quit();
                    say("quit", true);
                    break;
                default:
                    throw new IllegalArgumentException(command);
            }
        }
    }

    public static void main(String[] args) throws InterruptedException {
        switch (args[1]) {
            case "fails":
                fails(args[0], args[2]);
                return;
            case "ends":
                ends(args[0], args[2]);
                return;
            case "stands":
                stands(args[0], args[2]);
                return;
            default:
        }
        try {
            act(args[0], args[1], Arrays.copyOfRange(args, 2, args.length));
            System.exit(0);
        } catch (RuedoException error) {
            say("failed", error.getClass().getSimpleName() + ":", error.getMessage());
            System.exit(1);
        }
    }
}
