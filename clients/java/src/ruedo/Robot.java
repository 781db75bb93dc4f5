package ruedo;

import ruedo.lcmtypes.channel_info_t;
import ruedo.lcmtypes.device_info_t;
import ruedo.lcmtypes.joint_command_t;
import ruedo.lcmtypes.move_command_t;
import ruedo.lcmtypes.robot_info_t;
import ruedo.lcmtypes.velocity_command_t;
import ruedo.lcmtypes.wheel_command_t;

import java.util.ArrayList;
import java.util.HashSet;
import java.util.List;
import java.util.Map;
import java.util.Set;
import java.util.TreeMap;
import java.util.function.Consumer;

/**
 * A robot of the simulation. Lengths in m, angles in rad, counter-clockwise is positive. Thread
 * safe.
 */
public final class Robot {
    /** Its name in the world file. */
    public final String name;

    final Simulation sim;

    Robot(Simulation sim, String name) {
        this.sim = sim;
        this.name = name;
    }

    // Description.

    private robot_info_t info() {
        return sim.robotInfo(name);
    }

    /** Name of the model that it was made from. */
    public String model() {
        return info().model;
    }

    /** "kinematic", "wheels", or "" for a robot that only senses. */
    public String drive() {
        return info().drive;
    }

    /** m. */
    public double wheelRadius() {
        return info().wheel_radius;
    }

    /** m, between the left and the right wheels. */
    public double track() {
        return info().track;
    }

    /** m/s. */
    public double maxSpeed() {
        return info().max_speed;
    }

    /** rad/s. */
    public double maxTurnRate() {
        return info().max_turn_rate;
    }

    /** s of sim time without a command after which it stops; 0: never. */
    public double watchdog() {
        return info().watchdog_us * 1e-6;
    }

    /** Names of the wheel joints. */
    public List<String> wheels() {
        return List.of(info().wheels);
    }

    // Its devices.

    /** All devices, in the order of the world file. */
    public List<Device<?>> devices() {
        info();
        WorldInfo known = sim.info();
        List<Device<?>> found = new ArrayList<>();
        for (device_info_t device : known.devices(name)) {
            channel_info_t channel = known.channelOf(name, device.name);
            if (channel != null) found.add(device(device, channel));
        }
        return found;
    }

    /** The device of that name. Throws UnknownName, which lists those that exist. */
    public Device<?> device(String name) {
        List<Device<?>> all = devices();
        for (Device<?> device : all) {
            if (device.name.equals(name)) return device;
        }
        throw new RuedoException.UnknownName(
                this.name + " has no device '" + name + "'; it has " + names(all));
    }

    /** The first laser range finder with one layer. */
    @SuppressWarnings("unchecked")
    public Device<Scan> lrf() {
        return (Device<Scan>) first("planar_lidar_t", "laser range finder");
    }

    /** The first laser scanner with several layers. */
    @SuppressWarnings("unchecked")
    public Device<LidarScan> lidar() {
        return (Device<LidarScan>) first("lidar_t", "laser scanner with several layers");
    }

    /** The first sonar array. */
    @SuppressWarnings("unchecked")
    public Device<SonarReading> sonar() {
        return (Device<SonarReading>) first("sonar_t", "sonar");
    }

    /** Wheel odometry. */
    @SuppressWarnings("unchecked")
    public Device<Odometry> odometry() {
        return (Device<Odometry>) first("odometry_t", "odometry");
    }

    /** The velocity that the odometry computes from the wheels, also sideways. */
    @SuppressWarnings("unchecked")
    public Stream<OdometryTwist> odometryTwist() {
        return (Stream<OdometryTwist>) firstStream("odometry_twist_t", "velocity of odometry");
    }

    /** The first camera. */
    public Camera camera() {
        return (Camera) first("image_t", "camera");
    }

    /** The camera of that name. Throws UnknownName, which lists the devices; TypeMismatch. */
    public Camera camera(String name) {
        Device<?> device = device(name);
        if (device instanceof Camera) return (Camera) device;
        throw new RuedoException.TypeMismatch(
                this.name + "/" + name + " sends " + device.type + ", not image_t");
    }

    /** The first camera that boxes what it sees in its picture. */
    @SuppressWarnings("unchecked")
    public Device<Boxes2D> boxes2d() {
        return (Device<Boxes2D>) first("boxes_2d_t", "bounding box camera");
    }

    /** The first camera that boxes what it sees in space. */
    @SuppressWarnings("unchecked")
    public Device<Boxes3D> boxes3d() {
        return (Device<Boxes3D>) first("boxes_3d_t", "bounding box camera in space");
    }

    /** The first inertial measurement unit. */
    @SuppressWarnings("unchecked")
    public Device<Imu> imu() {
        return (Device<Imu>) first("imu_t", "IMU");
    }

    /** The first satellite receiver; {@link NavSat#enu} is its place in metres. */
    @SuppressWarnings("unchecked")
    public Device<NavSat> gps() {
        return (Device<NavSat>) first("navsat_t", "satellite receiver");
    }

    /** The first magnetometer. */
    @SuppressWarnings("unchecked")
    public Device<Magnetometer> magnetometer() {
        return (Device<Magnetometer>) first("magnetometer_t", "magnetometer");
    }

    /** The first altimeter. */
    @SuppressWarnings("unchecked")
    public Device<Altimeter> altimeter() {
        return (Device<Altimeter>) first("altimeter_t", "altimeter");
    }

    /** The first barometer. */
    @SuppressWarnings("unchecked")
    public Device<AirPressure> airPressure() {
        return (Device<AirPressure>) first("air_pressure_t", "barometer");
    }

    /** The first Pitot tube. */
    @SuppressWarnings("unchecked")
    public Device<AirSpeed> airSpeed() {
        return (Device<AirSpeed>) first("air_speed_t", "air speed sensor");
    }

    /** The first force-torque sensor. */
    @SuppressWarnings("unchecked")
    public Device<ForceTorque> forceTorque() {
        return (Device<ForceTorque>) first("force_torque_t", "force-torque sensor");
    }

    /** The first logical camera. */
    @SuppressWarnings("unchecked")
    public Device<LogicalCamera> logicalCamera() {
        return (Device<LogicalCamera>) first("logical_camera_t", "logical camera");
    }

    /** The first bumper. */
    @SuppressWarnings("unchecked")
    public Device<Contact> contact() {
        return (Device<Contact>) first("contact_t", "contact sensor");
    }

    /** The bodies that it runs into, and the one that blocks it; it needs no bumper. */
    @SuppressWarnings("unchecked")
    public Stream<Collisions> collisions() {
        return (Stream<Collisions>) firstStream("collisions_t", "collisions");
    }

    /**
     * Calls back as {@link Stream#onSample} does, but only when the robot runs into a body that it
     * did not touch a moment before.
     */
    public Subscription onCollision(Consumer<? super Collisions> callback) {
        if (callback == null) throw new IllegalArgumentException("the callback is null");
        Set<String> touched = new HashSet<>();
        return collisions()
                .onSample(
                        sample -> {
                            Set<String> now = new HashSet<>();
                            for (Contact.Point point : sample.points) now.add(point.body);
                            boolean news = !touched.containsAll(now);
                            touched.clear();
                            touched.addAll(now);
                            if (news) callback.accept(sample);
                        });
    }

    /** The true pose. */
    @SuppressWarnings("unchecked")
    public Stream<Pose> pose() {
        return (Stream<Pose>) firstStream("pose_t", "true pose");
    }

    /** The status of its motion. */
    @SuppressWarnings("unchecked")
    public Stream<MotionStatus> motion() {
        return (Stream<MotionStatus>) firstStream("motion_status_t", "motion status");
    }

    /** Its joints. */
    @SuppressWarnings("unchecked")
    public Stream<Joints> joints() {
        return (Stream<Joints>) firstStream("joint_state_t", "joints");
    }

    /**
     * A joint by its name: its limits, its state and its commands. Throws UnknownName, which lists
     * the joints.
     */
    public Joint joint(String name) {
        JointLimits limits = sim.limitsOf(this.name);
        return new Joint(this, limits, indexOf(limits, name));
    }

    private int indexOf(JointLimits limits, String joint) {
        int index = limits.names.indexOf(joint);
        if (index >= 0) return index;
        throw new RuedoException.UnknownName(
                name
                        + " has no joint '"
                        + joint
                        + "'; it has "
                        + (limits.names.isEmpty() ? "none" : String.join(", ", limits.names)));
    }

    /** {@link #commandJoints(Map, JointMode)} to positions, rad or m. */
    public void commandJoints(Map<String, Double> positions) {
        commandJoints(positions, JointMode.POSITION);
    }

    /**
     * Commands joints by their names. Each holds its command until the next one; no watchdog ends
     * it. values: rad or m, rad/s or m/s, N m or N; positions are kept within the joint's limits.
     * Throws UnknownName, which lists the joints, NotSupported for a joint that takes no commands,
     * and in lockstep.
     */
    public void commandJoints(Map<String, Double> values, JointMode mode) {
        sim.checkOpen();
        checkActsAtOnce("jointCommand(Map.of(...), mode)");
        Command command = jointCommand(values, mode);
        sim.bus.publish(command.channel, command.data);
    }

    /**
     * A joint command for {@link Simulation#step(long, List)}, as {@link #commandJoints} sends it.
     */
    public Command jointCommand(Map<String, Double> values, JointMode mode) {
        String channel = input("joint_command_t", "it has no joints");
        JointLimits limits = sim.limitsOf(name);
        boolean ofOthers = // the name of a detachable joint, a lift or a door: the server knows
                mode == JointMode.ATTACHED || mode == JointMode.FLOOR || mode == JointMode.OPEN;
        joint_command_t command = new joint_command_t();
        command.utime = sim.clock.utime();
        command.n = values.size();
        command.name = new String[command.n];
        command.mode = new byte[command.n];
        command.value = new double[command.n];
        int i = 0;
        for (Map.Entry<String, Double> entry : new TreeMap<>(values).entrySet()) {
            String joint = entry.getKey();
            if (!ofOthers && !limits.takesCommands[indexOf(limits, joint)]) {
                throw new RuedoException.NotSupported(
                        "the joint " + joint + " of " + name + " takes no commands");
            }
            command.name[i] = joint;
            command.mode[i] = (byte) mode.value;
            command.value[i++] = finite(joint, entry.getValue());
        }
        return new Command(channel, Bus.encode(command));
    }

    // Driving.

    /**
     * Drives with v (m/s ahead) and omega (rad/s), within the robot's limits, until the next
     * command of any kind: this program repeats it in the background, so that the watchdog does not
     * stop the robot. It lapses watchdog() s of sim time after the program has ended or was
     * stopped; {@link #driving} limits it to a block of the program. Throws NotSupported for a
     * robot without a drive, and in lockstep, as all that drives at once.
     */
    public void setVelocity(double v, double omega) {
        setVelocity(v, omega, 0.0);
    }

    /**
     * The same with vy, m/s to the left, of a robot that moves sideways. Throws NotSupported for
     * other robots.
     */
    public void setVelocity(double v, double omega, double vy) {
        Command command = velocityCommand(v, omega, vy);
        driver("velocityCommand(v, omega)").keepSending(command.channel, command.data);
    }

    /** The robot drives until close(), from {@link Robot#driving}. */
    public interface Driving extends AutoCloseable {
        /** The robot stops. */
        @Override
        void close();
    }

    /**
     * As {@link #setVelocity}, for as long as a block lasts; then the robot stops: try (var driving
     * = robot.driving(0.3, 0.0)) { ... }.
     */
    public Driving driving(double v, double omega) {
        return driving(v, omega, 0.0);
    }

    /** The same with vy, m/s to the left, of a robot that moves sideways. */
    public Driving driving(double v, double omega, double vy) {
        setVelocity(v, omega, vy);
        return () -> {
            try {
                stop();
            } catch (RuedoException.NoServer error) {
                // the simulation was closed
            }
        };
    }

    /** The same with the rates of the left and the right wheels, rad/s, positive ahead. */
    public void setWheels(double left, double right) {
        Command command = wheelCommand(left, right);
        driver("wheelCommand(left, right)").keepSending(command.channel, command.data);
    }

    /**
     * A velocity command for {@link Simulation#step(long, List)}, as {@link #setVelocity} sends it,
     * once.
     */
    public Command velocityCommand(double v, double omega) {
        return velocityCommand(v, omega, 0.0);
    }

    /** The same with vy, m/s to the left. */
    public Command velocityCommand(double v, double omega, double vy) {
        velocity_command_t command = new velocity_command_t();
        command.utime = sim.clock.utime();
        command.vx = finite("v", v);
        command.vy = finite("vy", vy);
        command.omega = finite("omega", omega);
        String channel = input("velocity_command_t");
        if (vy != 0.0 && !drive().matches(".* (mecanum|omni|holonomic)")) {
            throw new RuedoException.NotSupported(
                    "vy is "
                            + vy
                            + " m/s, but "
                            + name
                            + " cannot move sideways: its drive is '"
                            + drive()
                            + "'");
        }
        return new Command(channel, Bus.encode(command));
    }

    /**
     * A wheel command for {@link Simulation#step(long, List)}, as {@link #setWheels} sends it,
     * once.
     */
    public Command wheelCommand(double left, double right) {
        wheel_command_t command = new wheel_command_t();
        command.utime = sim.clock.utime();
        command.n = 2;
        command.rate = new double[] {finite("left", left), finite("right", right)};
        return new Command(input("wheel_command_t"), Bus.encode(command));
    }

    /**
     * A motion primitive for {@link Simulation#step(long, List)}. kind: "advance", "rotate",
     * "heading", "arc" or "stop"; value in m or rad, of a stop 0; radius, of an arc, in m.
     */
    public Command moveCommand(String kind, double value, Limits limits, double radius) {
        int index = List.of("advance", "rotate", "heading", "arc", "stop").indexOf(kind);
        if (index < 0)
            throw new IllegalArgumentException(
                    "kind is '" + kind + "': it must be advance, rotate, heading, arc or stop");
        byte[] kinds = {
            move_command_t.ADVANCE,
            move_command_t.ROTATE,
            move_command_t.HEADING,
            move_command_t.ARC,
            move_command_t.STOP
        };
        return new Command(
                input("move_command_t"),
                Bus.encode(moveMessage(kinds[index], value, radius, limits)));
    }

    /**
     * Comes to rest. Like all primitives it returns at once; await() of the result waits for the
     * end.
     */
    public Motion stop() {
        return move("stop", move_command_t.STOP, 0.0, 0.0, Limits.NONE);
    }

    /** {@link #advance(double, Limits)} with the robot's own limits. */
    public Motion advance(double distance) {
        return advance(distance, Limits.NONE);
    }

    /** Drives straight on by a distance (m, negative: back), and comes to rest. */
    public Motion advance(double distance, Limits limits) {
        return move("advance", move_command_t.ADVANCE, distance, 0.0, limits);
    }

    /** {@link #rotate(double, Limits)} with the robot's own limits. */
    public Motion rotate(double angle) {
        return rotate(angle, Limits.NONE);
    }

    /** Turns on the spot by an angle (rad, more than a turn is allowed). */
    public Motion rotate(double angle, Limits limits) {
        return move("rotate", move_command_t.ROTATE, angle, 0.0, limits);
    }

    /** {@link #turnTo(double, Limits)} with the robot's own limits. */
    public Motion turnTo(double heading) {
        return turnTo(heading, Limits.NONE);
    }

    /** Turns on the spot, the shorter way, to a heading (rad, in the frame odom). */
    public Motion turnTo(double heading, Limits limits) {
        return move("turn_to", move_command_t.HEADING, heading, 0.0, limits);
    }

    /** {@link #arc(double, double, Limits)} with the robot's own limits. */
    public Motion arc(double angle, double radius) {
        return arc(angle, radius, Limits.NONE);
    }

    /**
     * Drives ahead along a circle of a radius (m, > 0) until it has turned by an angle (rad;
     * positive: to the left).
     */
    public Motion arc(double angle, double radius, Limits limits) {
        if (!(radius > 0.0)) {
            throw new IllegalArgumentException(
                    "radius is "
                            + radius
                            + ": it must be > 0 m; the sign of the angle says left or right");
        }
        return move("arc", move_command_t.ARC, angle, radius, limits);
    }

    private Motion move(String kindName, byte kind, double value, double radius, Limits limits) {
        move_command_t command = moveMessage(kind, value, radius, limits);
        String kindOfCommand = kindName.equals("turn_to") ? "heading" : kindName;
        return driver("moveCommand(\"" + kindOfCommand + "\", ...)")
                .move(input("move_command_t"), command, kindName);
    }

    private move_command_t moveMessage(byte kind, double value, double radius, Limits limits) {
        move_command_t command = new move_command_t();
        command.utime = sim.clock.utime();
        command.kind = kind;
        command.value = finite("value", value);
        command.radius = finite("radius", radius);
        command.speed = limits.speed;
        command.acceleration = limits.acceleration;
        command.deceleration = limits.deceleration;
        command.id = sim.nextId();
        return command;
    }

    /**
     * inSteps: the call to make in lockstep, where what is sent beside the steps would act at
     * whatever step the run has reached.
     */
    private Driver driver(String inSteps) {
        Driver driver = sim.driver(name);
        checkActsAtOnce(inSteps);
        return driver;
    }

    private void checkActsAtOnce(String inSteps) {
        if (sim.lockstep()) {
            throw new RuedoException.NotSupported(
                    "in lockstep a command acts at a step that its client chooses:"
                            + " sim.step(n, List.of(robot."
                            + inSteps
                            + "))");
        }
    }

    // Channels, by what info says of them: names on the bus may be remapped.

    private String input(String type) {
        return input(type, "");
    }

    private String input(String type, String lack) {
        String drive = drive();
        for (channel_info_t channel : sim.info().channels(name)) {
            if (channel.input && channel.type.equals(type)) return channel.name;
        }
        if (!lack.isEmpty()) {
            throw new RuedoException.NotSupported(name + " takes no " + type + ": " + lack);
        }
        if (drive.isEmpty()) {
            throw new RuedoException.NotSupported(
                    name
                            + " cannot be driven: its model has no drive; --drive "
                            + name
                            + "=LEFT+...,RIGHT+... gives it one, by its wheel joints");
        }
        throw new RuedoException.NotSupported(name + " takes no " + type);
    }

    private Device<?> first(String type, String what) {
        List<Device<?>> all = devices();
        for (Device<?> device : all) {
            if (device.type.equals(type)) return device;
        }
        throw new RuedoException.UnknownName(name + " has no " + what + "; it has " + names(all));
    }

    /**
     * The messages of a device or channel, by its name ("temp"), of a plugin's, too. The
     * observations of step() accept the stream, too. Throws UnknownName.
     *
     * @param type the class that lcm-gen made of its .lcm file
     * @param <M> that class
     */
    @SuppressWarnings("unchecked")
    public <M> Stream<MessageSample<M>> stream(String device, Class<M> type) {
        return (Stream<MessageSample<M>>) messages(device, MessageSample.of(type));
    }

    /** The same as bytes, whatever their type is. */
    @SuppressWarnings("unchecked")
    public Stream<MessageSample<byte[]>> rawStream(String device) {
        return (Stream<MessageSample<byte[]>>) messages(device, MessageSample.raw());
    }

    private Stream<?> messages(String device, Conversions.Conversion conversion) {
        List<String> there = new ArrayList<>();
        for (channel_info_t channel : sim.info().channels(name)) {
            if (channel.input) continue;
            if (device.equals(channel.device)
                    || device.equals(channel.name)
                    || channel.name.equals(name + "/" + device)) {
                return new Stream<>(sim.core(channel, conversion), channel);
            }
            there.add(channel.device.isEmpty() ? channel.name : channel.device);
        }
        throw new RuedoException.UnknownName(
                name
                        + " publishes no '"
                        + device
                        + "'; it publishes "
                        + (there.isEmpty() ? "nothing" : String.join(", ", there)));
    }

    private Stream<?> firstStream(String type, String what) {
        for (Device<?> device : devices()) {
            if (device.type.equals(type)) return device;
        }
        for (channel_info_t channel : sim.info().channels(name)) {
            if (!channel.input && channel.type.equals(type)) return stream(channel);
        }
        throw new RuedoException.UnknownName(name + " publishes no " + what);
    }

    @SuppressWarnings("unchecked")
    <T extends Sample> Stream<T> cameraPart(String camera, String part, String type) {
        for (channel_info_t channel : sim.info().channels(name)) {
            boolean named =
                    channel.device.equals(camera + "/" + part)
                            || (channel.device.equals(camera) && channel.name.endsWith("/" + part));
            if (named && channel.type.equals(type)) return (Stream<T>) stream(channel);
        }
        throw new RuedoException.UnknownName(
                name
                        + "/"
                        + camera
                        + " publishes no "
                        + part
                        + "; <ruedo:"
                        + part
                        + "> in the world file switches it on");
    }

    private Stream<?> stream(channel_info_t channel) {
        return new Stream<>(sim.core(channel, Conversions.of(channel.type)), channel);
    }

    private Device<?> device(device_info_t info, channel_info_t channel) {
        Conversions.Conversion conversion = Conversions.of(channel.type);
        return channel.type.equals("image_t")
                ? new Camera(sim.core(channel, conversion), info, channel)
                : new Device<>(sim.core(channel, conversion), info, channel);
    }

    private static String names(List<Device<?>> devices) {
        List<String> names = new ArrayList<>();
        for (Device<?> device : devices) names.add(device.name);
        return names.isEmpty() ? "none" : String.join(", ", names);
    }

    private static double finite(String name, double value) {
        if (Double.isFinite(value)) return value;
        throw new IllegalArgumentException(name + " is " + value + ": it must be a finite number");
    }

    @Override
    public String toString() {
        return name + ": " + names(devices());
    }
}
