package ruedo;

import ruedo.lcmtypes.channel_info_t;
import ruedo.lcmtypes.request_t;
import ruedo.lcmtypes.reset_request_t;
import ruedo.lcmtypes.robot_info_t;
import ruedo.lcmtypes.set_pose_request_t;
import ruedo.lcmtypes.spawn_request_t;
import ruedo.lcmtypes.step_request_t;
import ruedo.lcmtypes.tick_t;

import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.util.ArrayList;
import java.util.HashMap;
import java.util.LinkedHashSet;
import java.util.List;
import java.util.Map;
import java.util.Set;
import java.util.concurrent.ConcurrentHashMap;
import java.util.concurrent.CountDownLatch;
import java.util.concurrent.atomic.AtomicBoolean;
import java.util.concurrent.atomic.AtomicLong;
import java.util.function.Supplier;

/**
 * A running simulation. Made by {@link Ruedo#connect} or {@link Ruedo#launch}; thread safe. close()
 * ends a server that launch() started. Requests throw NotSupported where the server does not have
 * them, RequestError when it refuses.
 */
public final class Simulation extends Requests implements AutoCloseable {
    private static final double SILENCE_SECONDS =
            5.0; // without any message: a server gives a sign of life each second
    private static final long SEEK_NANOS = 1_000_000_000;
    private static final double REPLY_SECONDS = 5.0;
    private static final long ASK_AGAIN_NANOS = 500_000_000;
    private static final long FAULT_NANOS = 1_000_000_000;
    private static final long LISTEN_NANOS = 200_000_000; // to the server's warnings
    private static final long TURN_MILLIS = 100; // of the receiving thread
    private static final long TURN_IN_USE_MILLIS = 10;
    private static final double SLOW_REPLY_SECONDS = 60.0;

    static {
        if ("1".equals(System.getenv("RUEDO_REGRESS"))) ProgramEnd.comesWithTheRun();
    }

    /** Its address. */
    public final String url;

    final Bus bus;
    private final ToRegression regression; // null: none launched this program
    final Progress progress = new Progress();
    final Clock clock = new Clock(progress);
    final CallbackQueue callbacks = new CallbackQueue();
    final CallbackFaults faults = new CallbackFaults();
    private final Address address;
    private final ServerProcess server; // null: not ours
    private final Session session;
    private final Stepper stepper;
    private final WorldInfo.Assembler assembler = new WorldInfo.Assembler();
    private final Map<String, Robot> robots = new HashMap<>(); // these three under its monitor
    private final Map<String, StreamCore<?>> streams = new HashMap<>(); // by channel, type, form
    private final Map<String, Driver> drivers = new HashMap<>(); // by robot
    private final Set<Driver> repeating = ConcurrentHashMap.newKeySet();
    private final Set<Subscription> newRun = ConcurrentHashMap.newKeySet();
    private static final Map<Long, Integer> joined =
            new ConcurrentHashMap<>(); // by run: how many clients of this process have joined it
    private final AtomicLong ids; // the newest primitive's
    private final ThreadLocal<Long> ends = new ThreadLocal<>(); // us, of the last motion awaited
    private final Object news = new Object(); // a user may hold the monitor of this object itself
    private WorldInfo known; // these under news
    private RuedoException fault; // of an info that cannot be read
    private long faultAt; // the first
    private Thread repeater;
    private long listenedAt = System.nanoTime(); // the receiving thread's
    private volatile long asked = System.nanoTime(); // for info
    private volatile long soughtAt = System.nanoTime() - SEEK_NANOS; // the server, in its silence
    private volatile boolean there;
    private final RunWatch watch = new RunWatch(this::tellAnotherServer);
    private final AtomicBoolean closing = new AtomicBoolean();
    private volatile boolean closed;
    private volatile String over; // the server's last word on the run; null: it has not said it
    private final CountDownLatch ended = new CountDownLatch(1); // all that close() ends

    Simulation(String url, String name, double timeout, ServerProcess server) {
        this(new Address(url), name, timeout, server, null);
    }

    /** transport: null opens the address's. */
    Simulation(
            Address address,
            String name,
            double timeout,
            ServerProcess server,
            Transport transport) {
        this.address = address;
        url = address.url;
        this.server = server;
        session = new Session(this, name);
        stepper = new Stepper(this, session);
        bus = new Bus(transport == null ? Transport.open(address) : transport);
        regression = server == null ? ToRegression.at(url) : null;
        boolean isWaitedFor = server != null || regression != null;
        if (isWaitedFor) bus.beforeTurn = this::beforeTurn;
        bus.subscribe("ruedo/info", this::onInfo);
        bus.subscribe("ruedo/tick", this::onTick);
        bus.subscribe("ruedo/reply", session::receive);
        bus.start();
        try {
            awaitInfo(timeout);
        } catch (RuntimeException error) {
            bus.close();
            throw error;
        }
        if (isWaitedFor || lockstep()) callbacks.keepAll();
        if (isWaitedFor && !lockstep())
            progress.begin(
                    server != null ? server::tell : regression::tell,
                    info().head.epoch,
                    clock.utime());
        ids = new AtomicLong(idsFrom(name, info()));
    }

    /**
     * Where a client that joins at that time begins to number its primitives: apart from others',
     * and from those of its own that an earlier start of the program has left under way. Equal runs
     * in lockstep have equal numbers, since their logs are compared.
     */
    private static long idsFrom(String name, WorldInfo info) {
        int hash = 0x811c9dc5; // FNV-1a
        for (byte b : name.getBytes(StandardCharsets.UTF_8)) hash = (hash ^ (b & 255)) * 16777619;
        long before = joined.merge(info.head.run_id, 1, Integer::sum) - 1;
        return (hash + info.head.utime + before * 0x9e3779b1L & 0x7fffffff) << 20; // far apart
    }

    // Description.

    /** The server's version. */
    public String version() {
        return info().head.version;
    }

    /** Name of the world. */
    public String world() {
        return info().head.world;
    }

    /** The seed of the random numbers. */
    public long seed() {
        return info().head.seed;
    }

    /** Length of a step, s. */
    public double stepSize() {
        return info().head.step_us * 1e-6;
    }

    /** Sim time of the newest message that came, s. */
    public double time() {
        return clock.utime() * 1e-6;
    }

    /** Whether the run is paused, by the latest ruedo/info. */
    public boolean paused() {
        return info().head.paused;
    }

    /** All robots, in the order of the world file. */
    public List<Robot> robots() {
        List<Robot> all = new ArrayList<>();
        for (String name : info().robots.keySet()) all.add(robot(name));
        return all;
    }

    /** All bodies. */
    public List<Body> bodies() {
        List<Body> all = new ArrayList<>();
        for (Body one : info().bodies) all.add(new Body(this, one.name, one.isStatic, one.mass));
        return all;
    }

    /**
     * A model ("crate"), or a part of it ("crate/lid"): reads and sets its pose and twist. Throws
     * UnknownName, which lists the models.
     */
    public Body body(String name) {
        boolean found = false, isStatic = true;
        double mass = 0.0;
        Set<String> models = new LinkedHashSet<>();
        for (Body one : info().bodies) {
            models.add(one.name.split("/")[0]);
            if (!one.name.equals(name) && !one.name.startsWith(name + "/")) continue;
            found = true;
            isStatic &= one.isStatic;
            mass += one.mass;
        }
        if (found) return new Body(this, name, isStatic, mass);
        throw new RuedoException.UnknownName(
                "there is no model or MODEL/LINK '"
                        + name
                        + "'; there is "
                        + (models.isEmpty() ? "none" : String.join(", ", models)));
    }

    /** The robot of that name. Throws UnknownName, which lists those that exist. */
    public Robot robot(String name) {
        robotInfo(name);
        synchronized (robots) {
            return robots.computeIfAbsent(name, key -> new Robot(this, key));
        }
    }

    /** A robot's joint limits: requested once, and again when the world has changed. */
    JointLimits limitsOf(String robot) {
        robotInfo(robot);
        return info().jointLimits.computeIfAbsent(robot, this::jointLimits);
    }

    /**
     * Calls back, in the thread of the callbacks, when another server, or the same one restarted,
     * answers at this address. Commands are not repeated into the new run, and primitives under way
     * have ended.
     */
    public Subscription onNewRun(Runnable callback) {
        checkOpen();
        Subscription subscription = Subscription.of("a new run", callback, faults, newRun::remove);
        newRun.add(subscription);
        return subscription;
    }

    /**
     * Waits until so many seconds of sim time have passed. Prints a warning if sim time stands
     * still for 5 s of real time, with the reason.
     *
     * @throws RuedoException.RunEnded when the run has
     */
    public void sleep(double seconds) {
        checkMayWait();
        Standstill standstill = standstill("sleep()");
        clock.sleep(
                Math.round(seconds * 1e6),
                () -> {
                    checkServer();
                    standstill.look();
                });
    }

    /**
     * A loop at a period of sim time (s): for (double t : sim.every(0.1)) iterates at each multiple
     * of it, with its time (s), and skips those that have passed while the loop's body ran. Ends
     * with the run.
     */
    public Iterable<Double> every(double period) {
        long micros = Double.isFinite(period) ? Math.round(period * 1e6) : 0;
        if (micros < 1)
            throw new IllegalArgumentException(
                    "period is " + period + ": it must be a number of seconds above 0");
        return () -> {
            long[] next = {0};
            return new UntilRunEnds<>(() -> awaitMultiple(micros, next) * 1e-6);
        };
    }

    private long awaitMultiple(long period, long[] next) {
        checkOpen();
        if (lockstep())
            throw new RuedoException.NotSupported("in lockstep, only sim.step(n) advances time");
        long begin = clock.utime();
        long following = (begin / period + 1) * period;
        boolean inTime = begin < next[0] + period && next[0] + period <= following;
        next[0] = inTime ? next[0] + period : following; // the first, late, or a reset
        sleep((next[0] - begin) * 1e-6);
        return next[0];
    }

    /**
     * Streams joined by stamp: for (var both : sim.synchronised(robot.lrf(), robot.pose())) has in
     * both.first each sample of the first stream, and in both.second the result of {@link
     * Stream#at} of the second for its time; both.get(stream) has that of any of them. A loop
     * slower than the first stream gets its newest sample each time, or the oldest of its {@link
     * Stream#queueDepth()}. Ends with the run.
     */
    public <A extends Sample, B extends Sample> Iterable<Synchronised<A, B>> synchronised(
            Stream<A> first, Stream<B> second, Stream<?>... others) {
        return () -> {
            List<StreamCore<?>> joined = new ArrayList<>(List.of(second.core));
            for (Stream<?> other : others) joined.add(other.core);
            for (StreamCore<?> one : joined) one.subscribe();
            Reader<A> reader = first.reader(first.queueDepth());
            return new UntilRunEnds<>(
                    () -> {
                        while (true) { // until the first one that came after the others' first
                            A sample = reader.next(Double.POSITIVE_INFINITY);
                            Map<StreamCore<?>, Sample> all = at(sample.utime, joined);
                            all.put(first.core, sample);
                            @SuppressWarnings("unchecked")
                            B at = (B) all.get(second.core);
                            if (all.size() > joined.size())
                                return new Synchronised<>(sample, at, all);
                        }
                    });
        };
    }

    /** Their samples of that moment (us), of those that have kept one. */
    private static Map<StreamCore<?>, Sample> at(long utime, List<StreamCore<?>> streams) {
        Map<StreamCore<?>, Sample> found = new HashMap<>();
        for (StreamCore<?> stream : streams) {
            Sample sample = stream.at(utime, Reader.DEFAULT_TIMEOUT);
            if (sample != null) found.put(stream, sample);
        }
        return found;
    }

    // Control.

    /** {@link #step(long, List)} without commands. */
    public Observations step(long n) {
        return step(n, List.of());
    }

    /** {@link #step(long, List, double)}, at most 60 s. */
    public Observations step(long n, List<Command> commands) {
        return step(n, commands, SLOW_REPLY_SECONDS);
    }

    /**
     * Takes n steps and returns the observations; timeout: the longest pause without progress, s of
     * real time. In lockstep (`ruedo run --lockstep N`): takes part from the first call on, grants
     * n steps with their commands, and has every message of every step; the first call's
     * observations begin with those of the state it found. n = 0 takes no step. Throws LeaseLost.
     * Else: steps a paused simulation; there are no commands, and the messages are in the streams.
     */
    public Observations step(long n, List<Command> commands, double timeout) {
        if (lockstep()) {
            Observations observations = stepper.step(n, commands, timeout);
            clock.note(observations.utime);
            return observations;
        }
        if (!commands.isEmpty()) {
            throw new RuedoException.NotSupported(
                    "commands go with steps where the server runs in lockstep: start it with "
                            + "`ruedo run --lockstep N`");
        }
        progress.waits();
        step_request_t body = new step_request_t();
        body.steps = n;
        return new Observations(
                Decoders.stateOf(session.request(request_t.STEP, body, timeout)), List.of());
    }

    /** Whether the server runs in lockstep. */
    public boolean lockstep() {
        return info().supports(request_t.GRANT);
    }

    /** The parts that a reset resets. */
    public enum Reset {
        /** The run continues as a fresh one. */
        ALL,
        /** Sim time alone. */
        TIME,
        /** Every model back to where it started, at rest. */
        POSES
    }

    /** Resets everything, with the same seed. */
    public void reset() {
        reset(Reset.ALL, -1);
    }

    /** Resets everything. seed: of the new run; -1: the same as before. */
    public void reset(Reset what, long seed) {
        reset_request_t body = new reset_request_t();
        body.what =
                what == Reset.ALL
                        ? reset_request_t.ALL
                        : what == Reset.TIME ? reset_request_t.TIME : reset_request_t.POSES;
        body.seed = seed;
        session.request(request_t.RESET, body, SLOW_REPLY_SECONDS);
        if (what == Reset.POSES) return;
        clock.reset(0);
        stepper.forget();
    }

    /**
     * Adds one of Ruedo's models ("p3at"), or a file in the server's search folders, on the ground
     * below x, y (m).
     */
    public String spawn(String model, double x, double y, double heading, String name) {
        return spawn(model, "", name, new double[] {x, y, 0.0}, aboutZ(heading), true);
    }

    /**
     * Adds a model. model: a name, or "" for SDF or URDF in text. name: "" is the model's own.
     * position: m; orientation: w, x, y, z. onGround: places it on the ground below. The server
     * refuses a place inside of another model. Returns the model's name: the server numbers a name
     * that exists, unless it was given.
     */
    public String spawn(
            String model,
            String text,
            String name,
            double[] position,
            double[] orientation,
            boolean onGround) {
        spawn_request_t body = new spawn_request_t();
        body.model = model;
        body.text = text;
        body.name = name;
        body.position = position;
        body.orientation = orientation;
        body.on_ground = onGround;
        WorldInfo before = known;
        String given =
                Decoders.stateOf(session.request(request_t.SPAWN, body, SLOW_REPLY_SECONDS)).name;
        refreshInfo(before);
        return given;
    }

    @Override
    public void remove(String name) {
        WorldInfo before = known;
        super.remove(name);
        refreshInfo(before);
    }

    /** Sets a model's place x, y, z (m) and heading (rad), at rest. */
    public void setPose(String name, double x, double y, double heading, double z) {
        setPose(name, new double[] {x, y, z}, aboutZ(heading));
    }

    /** Sets a model's pose, at rest. position: m; orientation: w, x, y, z. */
    public void setPose(String name, double[] position, double[] orientation) {
        set_pose_request_t body = new set_pose_request_t();
        body.name = name;
        body.position = position;
        body.orientation = orientation;
        session.request(request_t.SET_POSE, body, REPLY_SECONDS);
    }

    /**
     * Draws in the world; the web console and the log show it.
     *
     * @param layer a name of your own; the markers replace all earlier ones of the layer, and an
     *     empty list clears it
     * @param frame a robot, with whose base_link it moves; "": the world
     * @throws IllegalArgumentException for more than a message holds
     */
    public void markers(String layer, List<Marker> markers, String frame) {
        checkOpen();
        for (channel_info_t channel : info().channels("")) {
            if (!channel.input || !channel.type.equals("markers_t")) continue;
            bus.publish(channel.name, Marker.message(layer, markers, frame));
            return;
        }
        throw new RuedoException.NotSupported("this server does not accept markers");
    }

    /** The same, in the world. */
    public void markers(String layer, List<Marker> markers) {
        markers(layer, markers, "");
    }

    /**
     * Sends a message to the server and to all listeners at {@link #url}: its bytes as LCM encodes
     * it, on a channel such as "p3at/velocity". In lockstep commands belong to step().
     */
    public void publish(String channel, byte[] message) {
        checkOpen();
        bus.publish(channel, message);
    }

    /** The same with an object of one of ruedo.lcmtypes, or of lcm-gen's. */
    public void publish(String channel, ruedo.lcmtypes.Message message) {
        publish(channel, Bus.encode(message));
    }

    /**
     * Saves the state under a name, in the folder of {@link LaunchOptions#snapshots}; restore()
     * takes the result.
     */
    public State save(String name) {
        State now = snapshot(name);
        return new State(
                now.utime,
                now.step,
                now.stateHash,
                now.paused,
                now.rate,
                name,
                now.position,
                now.orientation,
                now.linear,
                now.angular);
    }

    /** Restores a state that save() returned. */
    public State restore(State saved) {
        return restore(saved.name);
    }

    @Override
    public State restore(String name) {
        State state = super.restore(name);
        clock.reset(state.utime);
        stepper.forget();
        return state;
    }

    @Override
    public void quit() {
        try {
            super.quit();
        } catch (RuedoException.RunEnded ended) {
            // its last word may come before the reply, or without
        }
    }

    /**
     * Ends repeated commands, and a server that launch() started. A program that ends without it
     * leaves nothing behind either: the watchdog stops its robots, and its server ends with the
     * pipe to it. Waits for a callback that is running. In a callback it returns at once, and the
     * end follows by itself; a second call waits for it.
     *
     * @throws RuedoException.CallbackException for what a callback threw, and no call has thrown
     *     since
     */
    @Override
    public void close() {
        if (closing.compareAndSet(false, true)) {
            // A callback is not to wait for the answer to a LEAVE, and any other thread may be
            // interrupted: one of its own waits, and the program's end for that. It starts before
            // anyone sees that this is closed.
            Thread ending = new Thread(this::end, "ruedo-close");
            ending.setDaemon(false);
            ending.start();
            sayClosed();
        }
        if (CallbackQueue.inAnyCallback()) return;
        Uninterrupted.get(this::awaitEnd);
        callbacks.awaitCallback();
        checkCallbacks();
    }

    private void sayClosed() {
        synchronized (news) {
            closed = true;
            news.notifyAll();
        }
        clock.wake();
        callbacks.close();
    }

    private void end() {
        sayClosed();
        try {
            session.leave();
            bus.close();
        } finally {
            if (regression != null) regression.close();
            if (server != null) server.end();
            ended.countDown();
        }
    }

    private boolean awaitEnd() throws InterruptedException {
        ended.await();
        return true;
    }

    /** For certain; one that cannot be found now has, too. */
    boolean serverHasEnded() {
        return (server != null && server.ended() != null) || !bus.isConnected();
    }

    @Override
    public String toString() {
        return world() + " at " + url + ": " + String.join(", ", info().robots.keySet());
    }

    // For the package's other classes.

    @Override
    Session session() {
        return session;
    }

    WorldInfo info() {
        synchronized (news) {
            return known;
        }
    }

    robot_info_t robotInfo(String name) {
        Map<String, robot_info_t> all = info().robots;
        robot_info_t robot = all.get(name);
        if (robot != null) return robot;
        throw new RuedoException.UnknownName(
                "there is no robot '"
                        + name
                        + "'; there is "
                        + (all.isEmpty() ? "none" : String.join(", ", all.keySet())));
    }

    Stepper stepper() {
        return stepper;
    }

    long nextId() {
        return ids.incrementAndGet();
    }

    /** This thread uses the current samples. The run waits for callbacks anyway. */
    void noteUse() {
        if (!isCalledBack()) progress.use(clock.utime());
    }

    /** A motion ended then, and this thread knows: next() of any stream returns nothing older. */
    void beginAfter(long utime) {
        ends.set(utime);
    }

    /** us of sim time, which may have been reset since. */
    long notBefore() {
        Long utime = ends.get();
        return utime == null ? Long.MIN_VALUE : Math.min(utime, clock.utime());
    }

    private boolean isCalledBack() {
        return callbacks.runsHere() || bus.handling();
    }

    boolean isClosed() {
        return closed;
    }

    /**
     * At the beginning of a call, and while it waits. Throws NoServer, and what a callback threw.
     */
    void checkOpen() {
        checkCallbacks();
        if (closed) throw new RuedoException.NoServer("this simulation was closed");
    }

    /** Rethrows an exception of one of them. */
    void checkCallbacks() {
        if (!isCalledBack()) faults.rethrow();
    }

    /**
     * Before waiting for what the server sends. Throws NoServer; RuedoException in a callback: the
     * server may wait for that.
     */
    void checkMayWait() {
        checkOpen();
        if (isCalledBack()) {
            throw new RuedoException(
                    "a callback cannot wait for the server, which may wait for it to return: make"
                            + " this call in another thread");
        }
    }

    void checkServer() {
        checkOpen();
        if (over != null) throw new RuedoException.RunEnded(over);
        String ended = server == null ? null : server.ended();
        if (ended != null && server.isDone()) throw new RuedoException.RunEnded(ended);
        if (ended != null) throw new RuedoException.NoServer(ended);
        if (clock.silence() > SILENCE_SECONDS && !isThere()) {
            throw new RuedoException.NoServer(
                    "nothing was heard from the server at " + url + " for 5 s");
        }
    }

    /**
     * One that is stopped, or in a debugger, is waited for. It is looked for seldom: a local socket
     * is connected to for it, and one that is stopped keeps all those connections.
     */
    private boolean isThere() {
        long now = System.nanoTime();
        if (now - soughtAt >= SEEK_NANOS) {
            there = address.isClaimed();
            soughtAt = now;
        }
        return there;
    }

    /** The server's last message. */
    void noteEnd(String text) {
        over = text + ", at " + url;
    }

    /** For a call that waits for sim time. */
    Standstill standstill(String call) {
        return new Standstill(clock, call, () -> whyItStands(stepper::whoseTurn));
    }

    private String whyItStands(Supplier<String> inLockstep) {
        double silence = clock.silence();
        if (silence > 3.0)
            return String.format("nothing at all was heard from the server for %.1f s", silence);
        if (paused()) return "the simulation is paused";
        return lockstep() ? inLockstep.get() : "";
    }

    String whatIsKnown(double rate) {
        String why =
                whyItStands(
                        () ->
                                String.format(
                                        "in lockstep, sim time advances only in step(), whose"
                                            + " observations have the samples, as in"
                                            + " sim.step(20).latest(robot.lrf()); it is at %.2f s",
                                        time()));
        if (!why.isEmpty()) return why;
        return rate > 0.0
                ? String.format(
                        "its rate is %s Hz of sim time, which is now %.2f s",
                        Deadline.text(rate), time())
                : "it sends when something happens";
    }

    void keepRepeating(Driver driver) {
        repeating.add(driver);
        synchronized (news) {
            if (repeater != null) return;
            repeater = new LastingThread("ruedo-repeat", () -> closed, this::repeat);
            repeater.start();
        }
    }

    /** Feeds the watchdogs in real time. */
    private void repeat() throws InterruptedException {
        long period = 100;
        for (Driver driver : repeating) {
            if (!watch.another()) driver.repeat();
            period = Math.min(period, driver.periodMillis());
        }
        Thread.sleep(period);
    }

    /** The samples of a channel; made on first use. conversion: null if the type has none. */
    @SuppressWarnings("unchecked")
    <T extends Sample> StreamCore<T> core(
            channel_info_t channel, Conversions.Conversion conversion) {
        String form = conversion == null ? "" : conversion.key;
        String key = String.join("\0", channel.name, channel.type, form);
        synchronized (robots) {
            return (StreamCore<T>)
                    streams.computeIfAbsent(
                            key, made -> new StreamCore<T>(this, channel, conversion));
        }
    }

    Driver driver(String robot) {
        checkOpen();
        synchronized (robots) {
            return drivers.computeIfAbsent(robot, key -> new Driver(this, key));
        }
    }

    /** No command is repeated to a robot that is gone, nor to the next one of its name. */
    private void forgetRemoved(WorldInfo info) {
        List<Driver> gone = new ArrayList<>();
        List<StreamCore<?>> ended = new ArrayList<>();
        synchronized (robots) {
            robots.keySet().retainAll(info.robots.keySet());
            drivers.forEach(
                    (name, driver) -> {
                        if (!info.robots.containsKey(name)) gone.add(driver);
                    });
            drivers.keySet().retainAll(info.robots.keySet());
            streams.values()
                    .removeIf(stream -> info.output(stream.channel) == null && ended.add(stream));
        }
        endDrivers(gone, "removed");
        for (StreamCore<?> stream : ended) stream.end();
    }

    private void endDrivers(List<Driver> gone, String reason) {
        repeating.removeAll(gone);
        for (Driver driver : gone) driver.end(reason);
    }

    /** The server was restarted, or another has taken its place. */
    private void beginRun() {
        List<Driver> all;
        List<StreamCore<?>> known;
        watch.begin();
        over = null;
        clock.reset(info().head.utime);
        synchronized (robots) {
            all = new ArrayList<>(drivers.values());
            known = new ArrayList<>(streams.values());
            drivers.clear();
        }
        endDrivers(all, "new run");
        for (StreamCore<?> stream : known) stream.forget();
        System.err.println(
                "ruedo: another run has begun at " + url + ": commands are not repeated into it");
        callbacks.put(
                () -> {
                    for (Subscription callback : newRun) callback.call(null);
                });
    }

    private void onInfo(byte[] message) {
        Long runId = WorldInfo.runIdOf(message);
        if (runId != null && info() != null && !isOfOurRun(runId, true)) return;
        WorldInfo info = null;
        RuedoException wrong = null;
        try {
            info = assembler.add(message);
        } catch (RuedoException error) {
            wrong = error;
        }
        WorldInfo before;
        synchronized (news) {
            before = known;
            if (wrong != null && fault == null) faultAt = System.nanoTime();
            if (wrong != null) fault = wrong;
            if (info != null) {
                if (before == null || before.head.epoch != info.head.epoch)
                    clock.reset(info.head.utime);
                known = info;
            }
            news.notifyAll();
        }
        if (wrong == null) clock.noteSign();
        if (info == null) return;
        stepper.onInfo(info);
        if (before != null && before.head.epoch != info.head.epoch) {
            List<Driver> all;
            synchronized (robots) {
                all = new ArrayList<>(drivers.values());
            }
            for (Driver driver : all) driver.beginEpoch();
        }
        forgetRemoved(info);
        if (before != null && before.head.run_id != info.head.run_id) beginRun();
    }

    private void onTick(byte[] message) {
        try {
            WireReader in = new WireReader(message);
            if (in.int64() != tick_t.LCM_FINGERPRINT) return;
            long now = in.int64();
            if (!isOfOurRun(in.int64(), false)) return;
            int epoch = in.int32();
            clock.noteTick(now);
            stepper.onTick(message);
            // Sim time may run a hundred times faster than real time: the watchdog is fed by its
            // beat, too.
            for (Driver driver : repeating) driver.repeatAt(now);
            if (progress.isTold()) noteProgress(epoch, now);
        } catch (IOException error) {
            // broken
        }
    }

    /** All messages up to that time have arrived. */
    private void noteProgress(int epoch, long utime) {
        if (callbacks.isIdle()) progress.received(epoch, utime);
        else callbacks.put(() -> progress.received(epoch, utime));
    }

    /** Prints the launched server's warnings, and reports this program's progress again. */
    private long beforeTurn() {
        if (server != null && System.nanoTime() - listenedAt >= LISTEN_NANOS) {
            listenedAt = System.nanoTime();
            for (String warning : server.warnings())
                System.err.println("ruedo: the server: " + warning);
        }
        return progress.goOn() ? TURN_IN_USE_MILLIS : TURN_MILLIS;
    }

    /**
     * Whether a message is of this client's run, or, where it may take over, of the one that has
     * taken its place. The receiving thread's.
     */
    boolean isOfOurRun(long runId, boolean mayTakeOver) {
        WorldInfo now = info();
        if (now == null) return false;
        if (runId == now.head.run_id) {
            watch.hearOwn();
            return true;
        }
        boolean isOver = watch.hearAnother(runId) || over != null;
        if (System.nanoTime() - asked > ASK_AGAIN_NANOS) askInfo(); // which of the two is there
        return isOver && mayTakeOver;
    }

    /** Messages may be of the next run, whose info is still missing. For the receiving thread. */
    boolean inDoubt() {
        return watch.inDoubt();
    }

    private void tellAnotherServer(long runId) {
        System.err.println(
                "ruedo: another server is at "
                        + url
                        + ", too, with run "
                        + runId
                        + "; this client is in run "
                        + info().head.run_id
                        + ", world "
                        + info().head.world
                        + ". Their samples mix, and commands reach both: start one of them with"
                        + " another --lcm port (shown once)");
    }

    private void awaitInfo(double timeout) {
        Deadline deadline = new Deadline(timeout);
        synchronized (news) {
            while (known == null) awaitSign(deadline, timeout);
        }
    }

    private void awaitSign(Deadline deadline, double timeout) {
        // Beside what cannot be read there may be what can.
        if (fault != null && (deadline.passed() || System.nanoTime() - faultAt >= FAULT_NANOS))
            throw fault;
        String ended = server == null ? null : server.ended();
        if (ended != null) throw new RuedoException.NoServer(ended);
        if (deadline.passed()) {
            throw new RuedoException.NoServer(
                    "no Ruedo server answered at "
                            + url
                            + " within "
                            + Deadline.text(timeout)
                            + " s. Is `ruedo run` started, with the same --lcm or"
                            + " LCM_DEFAULT_URL? `ruedo doctor` looks for what is wrong");
        }
        askInfo();
        deadline.waitOn(news, 100);
    }

    private void askInfo() {
        asked = System.nanoTime();
        request_t request = new request_t();
        request.epoch = -1;
        request.kind = request_t.INFO;
        request.body = new byte[0];
        bus.publish(Session.REQUEST_CHANNEL, request);
    }

    void refreshInfo() {
        refreshInfo(known);
    }

    /** Waits for an info other than that one, which may have arrived already. */
    void refreshInfo(WorldInfo before) {
        Deadline deadline = new Deadline(10.0);
        synchronized (news) {
            while (known == before && !deadline.passed()) {
                askInfo();
                deadline.waitOn(news, 100);
            }
        }
    }

    private static double[] aboutZ(double heading) {
        return new double[] {Math.cos(heading / 2.0), 0.0, 0.0, Math.sin(heading / 2.0)};
    }
}
