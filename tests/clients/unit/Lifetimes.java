import ruedo.LaunchOptions;
import ruedo.Motion;
import ruedo.Odometry;
import ruedo.Reader;
import ruedo.Robot;
import ruedo.Ruedo;
import ruedo.RuedoException;
import ruedo.Simulation;
import ruedo.Stream;
import ruedo.Subscription;

import java.io.PrintStream;
import java.util.ArrayList;
import java.util.List;
import java.util.concurrent.CountDownLatch;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.atomic.AtomicBoolean;
import java.util.concurrent.atomic.AtomicInteger;
import java.util.concurrent.locks.LockSupport;

/**
 * Callbacks that are cancelled or throw, readers, close(), two simulations in one process, and a
 * restarted server; lifetimes_test.py defines the expected results.
 */
public final class Lifetimes {
    private static final double PATIENCE = 300.0; // s

    private Lifetimes() {}

    private static void readUntilThrown(Stream<Odometry> odometry) {
        try {
            while (true) odometry.next(PATIENCE);
        } catch (RuedoException.CallbackException error) {
            System.out.println("thrown " + error.getMessage());
        }
    }

    private static void callbacks(Simulation sim) {
        Stream<Odometry> odometry = sim.robot("p3at").odometry();
        AtomicInteger heard = new AtomicInteger();
        AtomicInteger failed = new AtomicInteger();
        try (Subscription first =
                        odometry.onSample(
                                sample -> {
                                    // Only once there are both: onSample() would throw it.
                                    if (heard.get() > 0 && failed.incrementAndGet() == 1)
                                        throw new AssertionError("a fault of the user's");
                                });
                Subscription second = odometry.onSample(sample -> heard.incrementAndGet())) {
            readUntilThrown(odometry);
            while (failed.get() < 3) odometry.next(PATIENCE);
            System.out.println("open " + !first.closed() + " " + !second.closed());
        }
        int count = heard.get();
        Reader<Odometry> one = odometry.reader();
        Reader<Odometry> other = odometry.reader();
        long before = one.next(PATIENCE).utime;
        System.out.println("newer " + (one.next(PATIENCE).utime > before));
        System.out.println("stolen " + (other.next(0.001).utime == 0));
        System.out.println("heard " + (heard.get() == count) + " " + (count >= 3));
    }

    private static void closed(Simulation sim) {
        Robot robot = sim.robot("p3at");
        Stream<Odometry> odometry = robot.odometry();
        odometry.latest(PATIENCE);
        sim.close();
        sim.close();
        List<Runnable> calls =
                new ArrayList<>(
                        List.of(
                                sim::pause,
                                sim::resume,
                                () -> sim.step(1),
                                () -> sim.setRate(1.0),
                                sim::reset,
                                sim::state,
                                () -> sim.remove("p3at"),
                                sim::quit,
                                () -> sim.sleep(1.0),
                                () -> sim.onNewRun(() -> {}),
                                odometry::latest,
                                odometry::next,
                                () -> odometry.onSample(sample -> {}),
                                () -> robot.setVelocity(0.1, 0.0),
                                () -> robot.advance(1.0),
                                () -> robot.stop()));
        int right = 0;
        for (Runnable call : calls) {
            try {
                call.run();
            } catch (RuedoException.NoServer error) {
                if (error.getMessage().equals("this simulation was closed")) right++;
            }
        }
        System.out.println("closed " + right + " of " + calls.size() + " " + sim.world());
    }

    private static String refusal(Runnable call) {
        try {
            call.run();
            return "none";
        } catch (RuedoException | IllegalArgumentException error) {
            return error.getMessage();
        }
    }

    private static void misused(Simulation sim) throws InterruptedException {
        Robot robot = sim.robot("p3at");
        Stream<Odometry> odometry = robot.odometry();
        Motion motion = robot.advance(0.1, new ruedo.Limits(0.001, 0.0, 0.0));
        List<Runnable> waits =
                List.of(
                        () -> {
                            while (true) odometry.next(PATIENCE); // those that are there
                        },
                        () -> sim.sleep(1.0),
                        sim::pause,
                        sim::state,
                        () -> sim.step(1),
                        () -> sim.restore("s"),
                        motion::await);
        List<String> said = new ArrayList<>();
        CountDownLatch done = new CountDownLatch(1);
        Subscription waiting =
                odometry.onSample(
                        sample -> {
                            if (done.getCount() == 0) return;
                            for (Runnable wait : waits) said.add(refusal(wait));
                            done.countDown();
                        });
        done.await();
        waiting.close();
        System.out.println(
                "waits "
                        + said.stream().filter(s -> s.startsWith("a callback cannot wait")).count()
                        + " of "
                        + waits.size());
        String text = "<sdf>" + "x".repeat(5 << 20);
        double[] origin = new double[3];
        double[] upright = {1.0, 0.0, 0.0, 0.0};
        System.out.println(refusal(() -> sim.spawn("", text, "", origin, upright, true)));
        System.out.println(refusal(() -> sim.setPose("p3at", origin, new double[3])));
        System.out.println(refusal(() -> sim.remove(null)));
        System.out.println(refusal(() -> odometry.onSample(null)));
        System.out.println(refusal(() -> sim.onNewRun(null)));
        System.out.println(refusal(() -> Ruedo.readLog("a\0b")));
    }

    private static void newRun(Simulation sim) throws InterruptedException {
        CountDownLatch event = new CountDownLatch(1);
        sim.onNewRun(event::countDown);
        Motion motion = sim.robot("p3at").advance(0.1, new ruedo.Limits(0.001, 0.0, 0.0));
        System.out.println("ready");
        event.await();
        System.out.println("ended " + motion.state() + " " + motion.reason());
        System.out.println("turned " + sim.robot("p3at").rotate(0.1).await(PATIENCE).done());
    }

    private static String errorOf(Runnable call) {
        try {
            call.run();
            return "none";
        } catch (RuedoException.NoServer error) {
            return error.getMessage();
        }
    }

    private static void two(String firstUrl, String secondUrl) throws InterruptedException {
        for (boolean firstEndsFirst : new boolean[] {true, false}) {
            Simulation first = Ruedo.connect(firstUrl, "first", PATIENCE);
            Simulation second = Ruedo.connect(secondUrl, "second", PATIENCE);
            Stream<Odometry> odometry = first.robot("p3at").odometry();
            Stream<Odometry> other = second.robot("p3at").odometry();
            other.latest(PATIENCE);
            CountDownLatch done = new CountDownLatch(1);
            try (Subscription closing =
                    odometry.onSample(
                            sample -> {
                                second.close();
                                done.countDown();
                            })) {
                done.await();
                System.out.println("other " + errorOf(other::next) + ", " + !closing.closed());
            }
            long before = odometry.latest(PATIENCE).utime;
            System.out.println("goes on " + (odometry.next(PATIENCE).utime > before));
            (firstEndsFirst ? first : second).close();
            (firstEndsFirst ? second : first).close();
            System.out.println("ended " + errorOf(odometry::next) + ", " + errorOf(other::next));
        }
    }

    private static void closedByNewRun(Simulation sim) throws InterruptedException {
        Stream<Odometry> odometry = sim.robot("p3at").odometry();
        CountDownLatch done = new CountDownLatch(1);
        sim.onNewRun(
                () -> {
                    sim.close();
                    done.countDown();
                });
        System.out.println("ready");
        done.await();
        System.out.println(errorOf(odometry::next) + ", " + errorOf(sim::pause));
    }

    private static final class Unspeakable extends RuntimeException {
        private static final long serialVersionUID = 1L;

        @Override
        public String getMessage() {
            throw this;
        }
    }

    /** What cannot be described ends nothing either. */
    private static void unspeakable(Simulation sim) {
        Stream<Odometry> odometry = sim.robot("p3at").odometry();
        AtomicInteger failed = new AtomicInteger();
        odometry.onSample(
                sample -> {
                    if (failed.incrementAndGet() == 1) throw new Unspeakable();
                });
        readUntilThrown(odometry);
        while (failed.get() < 3) odometry.next(PATIENCE);
        System.out.println("goes on");
    }

    /** A callback that returns once it was said on stderr that it does not. */
    private static CountDownLatch stuck(Simulation sim, AtomicBoolean returned) {
        CountDownLatch begun = new CountDownLatch(1);
        CountDownLatch said = new CountDownLatch(1);
        System.setErr(
                new PrintStream(System.err, true) {
                    @Override
                    public void println(String line) {
                        super.println(line);
                        said.countDown();
                    }
                });
        sim.robot("p3at")
                .odometry()
                .onSample(
                        sample -> {
                            begun.countDown();
                            try {
                                said.await((long) PATIENCE, TimeUnit.SECONDS);
                            } catch (InterruptedException error) {
                                throw new AssertionError(error);
                            }
                            returned.set(true);
                        });
        return begun;
    }

    private static void closedBesideACallback(Simulation sim) throws InterruptedException {
        AtomicBoolean returned = new AtomicBoolean();
        stuck(sim, returned).await();
        sim.close();
        System.out.println("returned " + returned);
    }

    /** The program's end waits for its hook, and the callback for the program's end. */
    private static void endedInACallback(Simulation sim) {
        Runtime.getRuntime().addShutdownHook(new Thread(sim::close));
        sim.robot("p3at").odometry().onSample(sample -> System.exit(5));
        errorOf(() -> sim.sleep(PATIENCE));
    }

    /** The program ends all the same. */
    private static void closedByACallbackThatStays(Simulation sim) throws InterruptedException {
        CountDownLatch closed = new CountDownLatch(1);
        sim.robot("p3at")
                .odometry()
                .onSample(
                        sample -> {
                            sim.close();
                            closed.countDown();
                            while (true) LockSupport.park();
                        });
        closed.await();
        System.out.println("ends");
    }

    private static String launched(LaunchOptions options, String world) {
        try (Simulation sim = Ruedo.launch(world, options)) {
            return "launched " + sim.world();
        } catch (RuedoException error) {
            return error.getClass().getSimpleName();
        }
    }

    private static void interruptedLaunch(String world, String text) {
        Thread.currentThread().interrupt();
        System.out.println(launched(new LaunchOptions(), world) + " " + Thread.interrupted());
        Thread.currentThread().interrupt();
        System.out.println(
                launched(new LaunchOptions().text(text), "") + " " + Thread.interrupted());
    }

    private static void interruptedClose(String world) {
        Simulation sim = Ruedo.launch(world, new LaunchOptions().timeout(PATIENCE));
        Thread.currentThread().interrupt();
        sim.close();
        System.out.println("closed " + Thread.interrupted());
    }

    private static void launchedAndKilled(String world) {
        try (Simulation sim = Ruedo.launch(world, new LaunchOptions().timeout(PATIENCE))) {
            System.out.println("ready");
            sim.sleep(PATIENCE);
        }
    }

    public static void main(String[] args) throws InterruptedException {
        switch (args[1]) {
            case "two":
                two(args[0], args[2]);
                return;
            case "interrupted_launch":
                interruptedLaunch(args[0], args[2]);
                return;
            case "interrupted_close":
                interruptedClose(args[0]);
                return;
            case "stays":
                closedByACallbackThatStays(Ruedo.connect(args[0], "lifetimes", PATIENCE));
                return;
            case "killed":
                launchedAndKilled(args[0]);
                return;
            default:
                connected(args);
        }
    }

    private static void connected(String[] args) throws InterruptedException {
        try (Simulation sim = Ruedo.connect(args[0], "lifetimes", PATIENCE)) {
            switch (args[1]) {
                case "new_run":
                    newRun(sim);
                    break;
                case "misused":
                    misused(sim);
                    break;
                case "unspeakable":
                    unspeakable(sim);
                    break;
                case "closed_beside_a_callback":
                    closedBesideACallback(sim);
                    break;
                case "ended_in_a_callback":
                    endedInACallback(sim);
                    break;
                case "closed_by_new_run":
                    closedByNewRun(sim);
                    break;
                default:
                    callbacks(sim);
                    closed(sim);
            }
        }
    }
}
