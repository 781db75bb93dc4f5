package ruedo;

import java.io.BufferedReader;
import java.io.DataInputStream;
import java.io.DataOutputStream;
import java.io.IOException;
import java.io.InputStreamReader;
import java.nio.charset.StandardCharsets;
import java.util.List;
import java.util.Locale;
import java.util.zip.CRC32;

/** Runs the test vectors against the Java client; runner.py describes the output. */
public final class VectorsRunner {
    private VectorsRunner() {}

    private static String number(Object value) {
        if (value instanceof Float) return number((double) (Float) value);
        if (value instanceof Boolean) return (Boolean) value ? "1" : "0";
        if (!(value instanceof Double)) return value.toString();
        double one = (Double) value;
        return Double.isInfinite(one)
                ? one > 0 ? "inf" : "-inf"
                : String.format(Locale.ROOT, "%.6f", one);
    }

    /** values: numbers, or arrays of them. */
    private static void row(String name, Object... values) {
        StringBuilder line = new StringBuilder(name);
        for (Object value : values) {
            if (!value.getClass().isArray()) {
                line.append(' ').append(number(value));
                continue;
            }
            for (int i = 0; i < java.lang.reflect.Array.getLength(value); i++) {
                line.append(' ').append(number(java.lang.reflect.Array.get(value, i)));
            }
        }
        System.out.println(line);
    }

    private static void mean(Sample sample) {
        row("utime", sample.utime);
        if (sample instanceof Scan) {
            Scan s = (Scan) sample;
            row("ranges", (Object) s.ranges);
            row("intensities", (Object) s.intensities);
            row(
                    "angles",
                    (Object)
                            (s.ranges.length == 0
                                    ? new double[0]
                                    : new double[] {s.angle(0), s.angle(s.ranges.length - 1)}));
        } else if (sample instanceof LidarScan) {
            LidarScan s = (LidarScan) sample;
            row("shape", s.layers, s.columns);
            row("ranges", (Object) s.ranges);
            row("intensities", (Object) s.intensities);
            row("azimuths", s.azimuthMin, s.azimuthMin + s.azimuthStep * (s.columns - 1));
            row("elevations", s.elevationMin, s.elevationMin + s.elevationStep * (s.layers - 1));
        } else if (sample instanceof Image) {
            Image s = (Image) sample;
            row("picture", s.width, s.height, s.rowStride);
            System.out.println("format " + s.format);
            int[] data = new int[s.data.length];
            for (int i = 0; i < data.length; i++) data[i] = s.data[i] & 255;
            row("data", (Object) data);
        } else if (sample instanceof CameraInfo) {
            CameraInfo s = (CameraInfo) sample;
            row("picture", s.width, s.height);
            row("focus", s.fx, s.fy, s.cx, s.cy);
            row("distortion", (Object) s.distortion);
        } else if (sample instanceof SonarReading) {
            SonarReading s = (SonarReading) sample;
            row("ranges", (Object) s.ranges);
            row("fired_utime", (Object) s.firedUtime);
            row("fresh", (Object) s.fresh);
        } else if (sample instanceof Odometry) {
            Odometry s = (Odometry) sample;
            row("pose", s.x, s.y, s.theta);
            row("twist", s.v, s.omega);
            row("angles", (Object) s.wheelAngles);
            row("rates", (Object) s.wheelRates);
            row("ticks", (Object) s.ticks);
            row("resets", s.resets);
        } else if (sample instanceof OdometryTwist) {
            OdometryTwist s = (OdometryTwist) sample;
            row("twist", s.vx, s.vy, s.omega);
            row("covariance", (Object) s.covariance);
        } else if (sample instanceof Pose) {
            Pose s = (Pose) sample;
            row("position", (Object) s.position);
            row("orientation", (Object) s.orientation);
            row("velocity", (Object) s.velocity);
            row("rotation_rate", (Object) s.rotationRate);
            row("acceleration", (Object) s.acceleration);
            row("heading", s.heading());
        } else if (sample instanceof Imu) {
            Imu s = (Imu) sample;
            row("orientation", (Object) s.orientation);
            row("angular_velocity", (Object) s.angularVelocity);
            row("linear_acceleration", (Object) s.linearAcceleration);
        } else if (sample instanceof NavSat) {
            NavSat s = (NavSat) sample;
            row("place", s.latitudeDeg, s.longitudeDeg, s.altitude);
            row("velocity", (Object) s.velocity);
        } else if (sample instanceof Magnetometer) {
            row("field", (Object) ((Magnetometer) sample).field);
        } else if (sample instanceof Altimeter) {
            row("altitude", ((Altimeter) sample).altitude, ((Altimeter) sample).velocity);
        } else if (sample instanceof AirPressure) {
            row("pressure", ((AirPressure) sample).pressure);
        } else if (sample instanceof AirSpeed) {
            AirSpeed s = (AirSpeed) sample;
            row("air", s.differentialPressure, s.temperature);
        } else if (sample instanceof ForceTorque) {
            row("force", (Object) ((ForceTorque) sample).force);
            row("torque", (Object) ((ForceTorque) sample).torque);
        } else if (sample instanceof LogicalCamera) {
            for (LogicalCamera.LogicalObject o : ((LogicalCamera) sample).objects)
                row("object " + o.model, o.position, o.orientation);
        } else if (sample instanceof Boxes2D) {
            Boxes2D s = (Boxes2D) sample;
            row("picture", s.width, s.height);
            for (Boxes2D.Box2D b : s.boxes)
                row("box " + b.name, b.label, b.x, b.y, b.width, b.height);
        } else if (sample instanceof Boxes3D) {
            for (Boxes3D.Box3D b : ((Boxes3D) sample).boxes)
                row("box " + b.name, b.label, b.center, b.orientation, b.size);
        } else if (sample instanceof Contact) {
            Contact s = (Contact) sample;
            row("pressed", s.pressed);
            for (Contact.Point p : s.points)
                row("point " + p.body, p.position, p.normal, p.force, p.depth);
        } else if (sample instanceof Collisions) {
            Collisions s = (Collisions) sample;
            System.out.println("blocked by " + s.blockedBy);
            for (Contact.Point p : s.points)
                row("point " + p.body, p.position, p.normal, p.force, p.depth);
        } else if (sample instanceof Joints) {
            Joints s = (Joints) sample;
            for (int i = 0; i < s.names.size(); i++)
                row("joint " + s.names.get(i), s.positions[i], s.velocities[i], s.efforts[i]);
        } else if (sample instanceof MotionStatus) {
            MotionStatus s = (MotionStatus) sample;
            row("id", s.id);
            System.out.println(s.kind + " " + s.state + " " + s.reason);
            row("amounts", s.progress, s.remaining);
            row("twist", s.v, s.omega);
        }
    }

    private static void decode() throws IOException {
        BufferedReader lines =
                new BufferedReader(new InputStreamReader(System.in, StandardCharsets.US_ASCII));
        for (String line = lines.readLine(); line != null; line = lines.readLine()) {
            String[] words = line.split(" ");
            byte[] bytes = new byte[words.length > 1 ? words[1].length() / 2 : 0];
            for (int i = 0; i < bytes.length; i++)
                bytes[i] = (byte) Integer.parseInt(words[1].substring(2 * i, 2 * i + 2), 16);
            Conversions.Conversion conversion = Conversions.of(words[0]);
            try {
                WireReader in = new WireReader(bytes);
                if (in.int64() != conversion.fingerprint) throw new IOException("another type");
                mean(conversion.decoder.decode(in));
            } catch (IOException error) {
                System.out.println("broken");
            }
            System.out.println(".");
        }
    }

    /** Frames on standard input and output: the lengths of channel and message, and both. */
    private static final class PipeTransport implements Transport {
        private final DataInputStream in = new DataInputStream(System.in);
        private final DataOutputStream out = new DataOutputStream(System.out);

        @Override
        public void start(Receiver receiver) {
            Thread thread =
                    new Thread(
                            () -> {
                                try {
                                    while (true) {
                                        byte[] channel = new byte[in.readInt()];
                                        byte[] message = new byte[in.readInt()];
                                        in.readFully(channel);
                                        in.readFully(message);
                                        receiver.receive(
                                                new String(channel, StandardCharsets.US_ASCII),
                                                message);
                                    }
                                } catch (IOException error) {
                                    Runtime.getRuntime().halt(3);
                                }
                            });
            thread.setDaemon(true);
            thread.start();
        }

        @Override
        public void subscribe(String channel) {}

        @Override
        public void unsubscribe(String channel) {}

        @Override
        public synchronized void publish(String channel, byte[] message) {
            try {
                out.writeInt(channel.length());
                out.writeInt(message.length);
                out.write(channel.getBytes(StandardCharsets.US_ASCII));
                out.write(message);
                out.flush();
            } catch (IOException error) {
                Runtime.getRuntime().halt(3);
            }
        }

        @Override
        public void close() {}
    }

    private static void converse(String[] args) {
        Simulation sim =
                new Simulation(
                        new Address(Address.DEFAULT_URL), "test", 300.0, null, new PipeTransport());
        try {
            Robot robot = sim.robot("p3at");
            for (int i = 1; i < args.length; i++) {
                if (args[i].equals("pause")) {
                    sim.pause();
                    continue;
                }
                long n = Long.parseLong(args[i]);
                Observations seen =
                        sim.step(
                                n,
                                n > 0 ? List.of(robot.velocityCommand(0.5, 0.0)) : List.of(),
                                300.0);
                StringBuilder line =
                        new StringBuilder(
                                "step " + seen.step + " " + seen.utime + " " + seen.stateHash);
                for (Observations.Message m : seen.messages) {
                    CRC32 crc = new CRC32();
                    crc.update(m.data);
                    line.append(' ')
                            .append(m.step)
                            .append(':')
                            .append(m.channel)
                            .append(':')
                            .append(crc.getValue());
                }
                System.err.println(line);
            }
        } catch (RuedoException error) {
            String kind =
                    error.getClass() == RuedoException.class
                            ? "RuedoError"
                            : error.getClass().getSimpleName();
            if (error.getClass() == RuedoException.RequestError.class)
                kind += " " + ReplyCode.text(((RuedoException.RequestError) error).code);
            System.err.println(kind + ": " + error.getMessage());
        }
        Runtime.getRuntime().halt(0);
    }

    public static void main(String[] args) throws IOException {
        if (args[0].equals("decode")) {
            decode();
        } else {
            converse(args);
        }
    }
}
