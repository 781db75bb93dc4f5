package ruedo;

import java.nio.file.Path;

/**
 * Ruedo's client for Java: connect to a robot simulation, read its sensors, drive its robots.
 *
 * <pre>{@code
 * try (Simulation sim = Ruedo.connect()) {
 *     Robot robot = sim.robot("p3at");
 *     robot.setVelocity(0.3, 0.0);               // m/s, rad/s; holds until changed
 *     while (robot.lrf().next().nearest(-0.5, 0.5) > 0.8) {}
 *     robot.stop().await();
 * }
 * }</pre>
 *
 * Units are SI, angles radians; x ahead, y left, z up.
 */
public final class Ruedo {
    private Ruedo() {}

    /**
     * Joins the simulation at LCM_DEFAULT_URL, else LCM's default group and port with ttl 0. Throws
     * NoServer.
     */
    public static Simulation connect() {
        return connect("");
    }

    /**
     * Joins the simulation at an LCM URL; a server that does not answer within 2 s is a NoServer.
     * Its name is "client-PID".
     */
    public static Simulation connect(String url) {
        return connect(url, "client-" + ProcessHandle.current().pid(), 2.0);
    }

    /** The same with a name of this client, and a timeout to wait for a server, s of real time. */
    public static Simulation connect(String url, String name, double timeout) {
        return new Simulation(Address.resolve(url), name, timeout, null);
    }

    /**
     * Opens the log of a run (`ruedo run --record`), or any other log of LCM. Throws RuedoException
     * if the file cannot be read, or is not a log.
     */
    public static Log readLog(String path) {
        return new Log(path);
    }

    /**
     * Reads a map of `ruedo map`, {@link OccupancyMap#save} or map_server of ROS: NAME.yaml, and
     * its PGM. Throws RuedoException, which names the file and its fault.
     */
    public static OccupancyMap loadMap(String path) {
        return MapFile.load(Path.of(path));
    }

    /** {@link #launch(String, LaunchOptions)} in real time. */
    public static Simulation launch(String world) {
        return launch(world, new LaunchOptions());
    }

    /**
     * Starts `ruedo run WORLD` (found by RUEDO, the PATH, or above this jar) and joins it. The
     * server ends with the Simulation, and with this process however that ends. Throws LaunchError
     * with the server's message.
     */
    public static Simulation launch(String world, LaunchOptions options) {
        ServerProcess server = new ServerProcess(world, options);
        try {
            server.awaitPort(options.timeout);
            return new Simulation(server.url, options.name, options.timeout, server);
        } catch (RuedoException.NoServer error) {
            server.end();
            throw new RuedoException.LaunchError(
                    error.getMessage()); // with what the server said, when it ended
        } catch (RuntimeException error) {
            server.end();
            throw error;
        }
    }
}
