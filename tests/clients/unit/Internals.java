package ruedo;

import ruedo.lcmtypes.body_info_t;
import ruedo.lcmtypes.channel_info_t;
import ruedo.lcmtypes.device_info_t;
import ruedo.lcmtypes.motion_status_t;
import ruedo.lcmtypes.odometry_t;
import ruedo.lcmtypes.pose_t;
import ruedo.lcmtypes.reply_t;
import ruedo.lcmtypes.request_t;
import ruedo.lcmtypes.robot_info_t;
import ruedo.lcmtypes.tick_t;
import ruedo.lcmtypes.world_info_t;

import java.io.IOException;
import java.nio.ByteBuffer;
import java.util.ArrayDeque;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;
import java.util.Queue;
import java.util.concurrent.BlockingQueue;
import java.util.concurrent.CountDownLatch;
import java.util.concurrent.LinkedBlockingQueue;
import java.util.concurrent.Semaphore;
import java.util.concurrent.TimeUnit;
import java.util.function.Supplier;

/**
 * What no real server shows at will, by a server in memory or by the transport alone;
 * lifetimes_test.py defines the expected results.
 */
public final class Internals {
    private static final double PATIENCE = 300.0; // s

    private Internals() {}

    /** Calls the client in the thread that calls it, and answers requests for ruedo/info. */
    private static class Server implements Transport {
        final world_info_t info = new world_info_t();
        Simulation sim;
        private Receiver client;

        Server() {
            info.run_id = 7;
            info.nparts = 1;
            info.version = "1";
            info.world = "memory";
            info.step_us = 5000;
            info.bodies = new body_info_t[0];
            robot_info_t robot = new robot_info_t();
            robot.name = "p3at";
            robot.model = "p3at";
            robot.drive = "kinematic";
            robot.wheels = new String[0];
            robot.left = new boolean[0];
            info.robots = new robot_info_t[] {robot};
            info.devices =
                    new device_info_t[] {
                        device("lrf"), device("odometry"), device("pose"), device("motion")
                    };
            info.channels =
                    new channel_info_t[] {
                        channel("lrf", "planar_lidar_t", false),
                        channel("odometry", "odometry_t", false),
                        channel("pose", "pose_t", false),
                        channel("motion", "motion_status_t", false),
                        channel("move", "move_command_t", true)
                    };
        }

        private static device_info_t device(String name) {
            device_info_t device = new device_info_t();
            device.robot = "p3at";
            device.name = device.kind = name;
            device.rate = 10.0;
            device.position = new double[3];
            device.orientation = new double[] {1.0, 0.0, 0.0, 0.0};
            device.element_pose = new double[0][];
            return device;
        }

        private static channel_info_t channel(String device, String type, boolean input) {
            channel_info_t channel = new channel_info_t();
            channel.name = "p3at/" + device;
            channel.robot = "p3at";
            channel.device = device;
            channel.type = type;
            channel.rate = 10.0;
            channel.input = input;
            if (!input) channel.fingerprint = Conversions.of(type).fingerprint;
            return channel;
        }

        Simulation connect() {
            return connect("udpm://239.255.76.67:7667");
        }

        Simulation connect(String url) {
            sim = new Simulation(new Address(url), "client", PATIENCE, null, this);
            return sim;
        }

        void send(String channel, ruedo.lcmtypes.Message message) {
            client.receive(channel, Bus.encode(message));
        }

        void sendInfo(device_info_t[] devices, channel_info_t... channels) {
            info.utime++;
            info.devices = devices;
            info.ndevices = devices.length;
            info.channels = channels;
            info.nchannels = channels.length;
            info.nrobots = info.robots.length;
            send("ruedo/info", info);
        }

        @Override
        public void start(Receiver receiver) {
            client = receiver;
        }

        @Override
        public void subscribe(String channel) {}

        @Override
        public void unsubscribe(String channel) {}

        @Override
        public void publish(String channel, byte[] message) {
            if (channel.equals("ruedo/request")) sendInfo(info.devices, info.channels);
        }

        @Override
        public void close() {}
    }

    private static String said(Supplier<Object> call) {
        try {
            return String.valueOf(call.get());
        } catch (RuntimeException error) {
            return error.getClass().getSimpleName();
        }
    }

    /** What ruedo/info says of a device holds from then on, whatever it said before. */
    private static void infos() {
        Server server = new Server();
        Simulation sim = server.connect();
        Robot robot = sim.robot("p3at");
        device_info_t[] devices = server.info.devices;
        channel_info_t[] channels = server.info.channels;
        Device<Scan> before = robot.lrf();
        devices[0].range_max = 3.0;
        channels[0].rate = 20.0;
        server.sendInfo(devices, channels);
        System.out.println(
                "lrf " + before.rate + " " + robot.lrf().rate + " " + robot.lrf().rangeMax);

        server.sendInfo(new device_info_t[0]);
        server.sendInfo(new device_info_t[0], channels);
        robot.pose();
        server.sendInfo(devices, channels);
        System.out.println("device " + said(() -> robot.pose() instanceof Device));

        long right = channels[2].fingerprint;
        server.sendInfo(new device_info_t[0]);
        channels[2].fingerprint = right + 1;
        server.sendInfo(devices, channels);
        System.out.println("other " + said(() -> robot.pose().latest(0.001)));
        channels[2].fingerprint = right;
        server.sendInfo(devices, channels);
        System.out.println("none yet " + said(() -> robot.pose().latest(0.001)));
        pose_t pose = new pose_t();
        pose.pos[0] = 4.0;
        server.send("p3at/pose", pose);
        System.out.println("pose " + said(() -> robot.pose().latest(0.001).position[0]));
        System.out.println("once " + said(() -> robot.pose().next(0.001).position[0]));
    }

    /** All is received while somebody else holds the monitors of what a user sees. */
    private static void monitors() throws InterruptedException {
        Server server = new Server();
        Simulation sim = server.connect();
        Robot robot = sim.robot("p3at");
        Stream<Odometry> odometry = robot.odometry();
        Motion motion = robot.advance(1.0);
        Semaphore heard = new Semaphore(0);
        Subscription subscription = odometry.onSample(sample -> heard.release());
        motion_status_t status = new motion_status_t();
        status.id = motion.id;
        status.state = motion_status_t.STATE_DONE;
        odometry_t sample = new odometry_t();
        tick_t tick = new tick_t();
        tick.run_id = server.info.run_id;
        tick.nparts = 1;
        Thread receiving =
                new Thread(
                        () -> {
                            server.send("ruedo/tick", tick);
                            server.send("p3at/odometry", sample);
                            server.send("p3at/motion", status);
                        });
        receiving.setDaemon(true);
        boolean called;
        synchronized (sim) {
            synchronized (robot) {
                synchronized (odometry) {
                    synchronized (motion) {
                        synchronized (subscription) {
                            receiving.start();
                            receiving.join((long) (PATIENCE * 1e3));
                            called = heard.tryAcquire((long) PATIENCE, TimeUnit.SECONDS);
                        }
                    }
                }
            }
        }
        System.out.println("received " + !receiving.isAlive() + " " + called + " " + motion.done());
    }

    private static odometry_t odometryAt(long utime) {
        odometry_t sample = new odometry_t();
        sample.utime = utime;
        return sample;
    }

    /**
     * Receiving goes on beside a callback that does not return; what waits for it is dropped from a
     * megabyte on, and counted, as is what was lost on the way.
     */
    private static void callbacks() throws InterruptedException {
        Server server = new Server();
        Stream<Odometry> odometry = server.connect().robot("p3at").odometry();
        Semaphore begun = new Semaphore(0);
        Semaphore goOn = new Semaphore(0);
        List<Long> heard = new ArrayList<>();
        odometry.onSample(
                sample -> {
                    begun.release();
                    goOn.acquireUninterruptibly();
                    heard.add(sample.utime / 100_000);
                });
        server.send("p3at/odometry", odometryAt(100_000));
        System.out.println("newest " + odometry.next().utime);
        begun.acquire();
        for (int i = 2; i < 5; i++) server.send("p3at/odometry", odometryAt(i * 100_000));
        System.out.println("newest " + odometry.next().utime + ", skipped " + odometry.dropped());
        server.send("p3at/odometry", odometryAt(800_000));
        System.out.println("newest " + odometry.next().utime + ", lost " + odometry.dropped());
        goOn.release(5);
        begun.acquire(4);
        int many = 20_000;
        for (int i = 0; i < many; i++) server.send("p3at/odometry", odometryAt(900_000 + i));
        begun.acquire();
        goOn.release(many);
        while (!server.sim.callbacks.isIdle()) Thread.sleep(10);
        System.out.println("heard " + heard.subList(0, 5));
        System.out.println("all " + (heard.size() - 5 + odometry.core.missed() == many));
    }

    /** What waits at the transport is received before latest(), next() and at() give a sample. */
    private static void latest() {
        Queue<odometry_t> waiting = new ArrayDeque<>();
        Server server =
                new Server() {
                    @Override
                    public boolean hasNews() {
                        Runnable receive =
                                () -> {
                                    while (!waiting.isEmpty())
                                        send("p3at/odometry", waiting.remove());
                                };
                        Thread receiving = new Thread(receive);
                        receiving.start();
                        Uninterrupted.get(
                                () -> {
                                    receiving.join();
                                    return null;
                                });
                        return false;
                    }
                };
        Stream<Odometry> odometry = server.connect().robot("p3at").odometry();
        odometry.onSample(sample -> {});
        server.send("p3at/odometry", odometryAt(100_000));
        System.out.println("newest " + odometry.latest().utime);
        waiting.add(odometryAt(200_000));
        waiting.add(odometryAt(300_000));
        System.out.println("newest " + odometry.latest().utime);
        waiting.add(odometryAt(400_000));
        waiting.add(odometryAt(500_000));
        System.out.println("next " + odometry.next().utime);
        waiting.add(odometryAt(600_000));
        System.out.println("at " + odometry.at(600_000, 0.0).utime);
        System.out.println("newest " + odometry.latest().utime);
    }

    /** A primitive is sent again until a status shows it, or another command has replaced it. */
    private static void resends() throws InterruptedException {
        BlockingQueue<byte[]> sent = new LinkedBlockingQueue<>();
        Server server =
                new Server() {
                    @Override
                    public void publish(String channel, byte[] message) {
                        if (channel.equals("p3at/move")) sent.add(message);
                        super.publish(channel, message);
                    }
                };
        Robot robot = server.connect().robot("p3at");
        robot.advance(1.0);
        byte[] first = sent.take();
        System.out.println("again " + Arrays.equals(first, sent.take()));
        Motion motion = robot.advance(2.0);
        byte[] second = sent.take();
        while (Arrays.equals(first, second)) second = sent.take(); // it was on its way
        for (int i = 0; i < 3; i++)
            System.out.println("again " + Arrays.equals(second, sent.take()));
        motion_status_t status = new motion_status_t();
        status.id = motion.id;
        status.state = motion_status_t.STATE_RUNNING;
        server.send("p3at/motion", status);
        Thread.sleep(100); // for one on its way
        sent.clear();
        System.out.println("shown " + (sent.poll(1200, TimeUnit.MILLISECONDS) == null));
    }

    /** What a server that the client launched is told of it. */
    private static void progress() throws InterruptedException {
        BlockingQueue<String> lines = new LinkedBlockingQueue<>();
        Progress progress = new Progress();
        progress.use(1); // nobody is told yet
        long joined = System.nanoTime();
        progress.begin(lines::add, 0, 25_000);
        System.out.println("began " + usedAfter(lines.take(), 25_000, joined));
        Thread.sleep(700); // longer than one that has been given something
        System.out.println(
                "waited for " + progress.goOn() + " " + usedAfter(lines.take(), 725_000, joined));
        progress.listens();
        System.out.print("listens " + lines.take());
        System.out.print("first " + Progress.first());
        progress.received(0, 25_000);
        System.out.print("received " + lines.take());
        progress.use(25_000);
        long begun = System.nanoTime();
        System.out.println("used " + usedAfter(lines.take(), 25_000, begun));
        Thread.sleep(50);
        System.out.println(
                "goes on " + progress.goOn() + " " + usedAfter(lines.take(), 75_000, begun));
        progress.waits();
        System.out.print("waits " + lines.take());
        System.out.println("said again " + progress.goOn());
        progress.use(30_000);
        lines.take();
        Thread.sleep(600); // it does something else
        progress.goOn();
        System.out.print("forgotten " + lines.take());
        progress.use(30_000);
        lines.take();
        progress.received(1, 0);
        System.out.print("reset " + lines.take());
        for (int i = 0; i < 1000; i++) progress.received(1, i); // nothing is heard of the server
        System.out.println("stopped " + (lines.size() < 300));
        lines.clear();
        progress.heard();
        System.out.print("heard " + lines.take());
    }

    /** Whether it is at least that, and at most as much as real time has gone on. */
    private static boolean usedAfter(String line, long least, long since) {
        long used = Long.parseLong(line.trim().split(" ")[2]);
        return used >= least && used <= 25_000 + (System.nanoTime() - since) / 1000 + 1000;
    }

    private static byte[] part(int number, int count, int size) {
        return ByteBuffer.allocate(size)
                .putLong(0, world_info_t.LCM_FINGERPRINT)
                .putShort(28, (short) number)
                .putShort(30, (short) count)
                .array();
    }

    /** Parts of ruedo/info wait for the others, but not without end. */
    private static void parts() {
        WorldInfo.Assembler many = new WorldInfo.Assembler();
        System.out.println(said(() -> many.add(part(0, 1024, 100))));
        System.out.println(said(() -> many.add(part(0, 1025, 100))));
        WorldInfo.Assembler large = new WorldInfo.Assembler();
        int taken = 0;
        try {
            for (; taken < 100; taken++) large.add(part(taken, 1024, 1 << 20));
        } catch (RuedoException error) {
            System.out.println(taken + ": " + error.getMessage());
        }
        System.out.println(said(() -> large.add(part(0, 1024, 1 << 20))));
    }

    /** Interrupts, of threads that send and in callbacks, leave the socket open. */
    private static void interrupts(String url) throws InterruptedException {
        Bus bus = new Bus(Transport.open(new Address(url)));
        bus.start();
        Semaphore heard = new Semaphore(0);
        bus.subscribe(
                "heard",
                (byte[] message) -> {
                    heard.release();
                    Thread.currentThread().interrupt();
                });
        for (int i = 0; i < 2; i++) {
            bus.publish("heard", new byte[8]);
            System.out.println("heard " + heard.tryAcquire((long) PATIENCE, TimeUnit.SECONDS));
        }
        for (int i = 0; i < 100; i++) {
            CountDownLatch sending = new CountDownLatch(3);
            Thread sender =
                    new Thread(
                            () -> {
                                while (!Thread.currentThread().isInterrupted()) {
                                    bus.publish("large", new byte[1 << 20]);
                                    sending.countDown();
                                }
                            });
            sender.start();
            sending.await();
            sender.interrupt();
            sender.join();
        }
        bus.publish("heard", new byte[8]);
        System.out.println("heard " + heard.tryAcquire((long) PATIENCE, TimeUnit.SECONDS));
        bus.close();
    }

    /** A server that is stopped is looked for again and again, by all that waits for it. */
    private static void silence(String url) throws InterruptedException {
        Simulation sim = new Server().connect(url);
        Thread.sleep(5100); // so long it may be silent
        long before = System.nanoTime();
        for (int i = 0; i < 1000; i++) sim.checkServer();
        System.out.println((System.nanoTime() - before) / 1_000_000_000);
    }

    private static volatile Object[] memory;

    /** As much as there is, in a chain; what goes on now finds none. */
    private static void takeMemory() {
        for (int size = 1 << 20; size > 0; ) {
            try {
                Object[] more = new Object[size];
                more[0] = memory;
                memory = more;
            } catch (OutOfMemoryError error) {
                size /= 2;
            }
        }
    }

    /** A thread lives on when memory runs out, although nothing can be said of it then. */
    private static void memory() throws InterruptedException {
        Error error = new OutOfMemoryError();
        Semaphore runs = new Semaphore(0);
        LastingThread thread =
                new LastingThread(
                        "receives",
                        () -> false,
                        () -> {
                            if (runs.availablePermits() == 0) takeMemory(); // once
                            runs.release();
                            throw error;
                        });
        thread.start();
        while (thread.isAlive() && runs.availablePermits() < 3) Thread.sleep(10);
        memory = null;
        System.out.println("lives " + thread.isAlive());
    }

    /**
     * Grants all requests but those of LEAVE, of which two are lost; who sends them waits for no
     * answer, which would be received in this thread.
     */
    private static final class LosingServer extends Server {
        private int leaves;

        LosingServer() {
            info.features = -1;
        }

        @Override
        public void publish(String channel, byte[] message) {
            reply_t reply = new reply_t();
            try {
                WireReader in = new WireReader(message);
                in.int64(); // hash
                in.int64(); // utime
                reply.run_id = in.int64();
                reply.epoch = in.int32();
                reply.session = in.int64();
                reply.sequence = in.int64();
                reply.kind = in.int32();
            } catch (IOException error) {
                throw new AssertionError(error);
            }
            if (reply.kind == request_t.LEAVE) {
                if (++leaves == 3) System.out.println("left");
                return;
            }
            super.publish(channel, message);
            if (reply.kind == request_t.JOIN) reply.session = 5;
            reply.text = "";
            reply.body = new byte[0];
            send("ruedo/reply", reply);
        }
    }

    /** The program's end waits for that of the simulation, which its callback has begun. */
    private static void exits() throws InterruptedException {
        LosingServer server = new LosingServer();
        Simulation sim = server.connect();
        sim.pause();
        sim.robot("p3at")
                .odometry()
                .onSample(
                        sample -> {
                            sim.close();
                            System.exit(5);
                        });
        odometry_t odometry = new odometry_t();
        odometry.utime = 1000;
        server.send("p3at/odometry", odometry);
        new CountDownLatch(1).await();
    }

    public static void main(String[] args) throws InterruptedException {
        switch (args[0]) {
            case "infos":
                infos();
                break;
            case "monitors":
                monitors();
                break;
            case "callbacks":
                callbacks();
                break;
            case "latest":
                latest();
                break;
            case "resends":
                resends();
                break;
            case "progress":
                progress();
                break;
            case "parts":
                parts();
                break;
            case "silence":
                silence(args[1]);
                break;
            case "memory":
                memory();
                break;
            case "interrupts":
                interrupts(args[1]);
                break;
            case "exits":
                exits();
                break;
            default:
                System.out.println("served " + new Address(args[1]).isServed());
        }
    }
}
