package ruedo;

import java.util.ArrayList;
import java.util.List;
import java.util.Map;
import java.util.TreeMap;

/** Options of a private server. Every setter returns this. */
public final class LaunchOptions {
    Long seed;
    double rate = 1.0;
    int lockstep;
    List<String> spawn = List.of();
    List<String> disable = List.of();
    final List<String> settings = new ArrayList<>(); // KEY=VALUE
    final List<String> more = new ArrayList<>(); // as the command line has them
    boolean noise = true;
    String text = "";
    List<String> args = List.of();
    String url = "";
    String name = "client";
    double timeout = 30.0;
    boolean verbose;

    /** Seed of the random numbers; default: the server's. */
    public LaunchOptions seed(long seed) {
        this.seed = seed;
        return this;
    }

    /** Sim time per real time, default 1; {@link Double#POSITIVE_INFINITY}: as fast as it goes. */
    public LaunchOptions rate(double rate) {
        this.rate = rate;
        return this;
    }

    /** Number of clients that the run waits for; default 0: not in lockstep. */
    public LaunchOptions lockstep(int clients) {
        lockstep = clients;
        return this;
    }

    /** Further models: "p3at@0,0", "p3at:NAME@X,Y,YAW". */
    public LaunchOptions spawn(String... models) {
        spawn = List.of(models);
        return this;
    }

    /** Devices that are left out: "p3at/camera". */
    public LaunchOptions disable(String... devices) {
        disable = List.of(devices);
        return this;
    }

    /** Adds a setting: setting("p3at/lrf.update_rate", 20). */
    public LaunchOptions setting(String key, Object value) {
        settings.add(key + "=" + value);
        return this;
    }

    /** Adds several settings: settings(Map.of("p3at/lrf.update_rate", 20)). */
    public LaunchOptions settings(Map<String, ?> values) {
        new TreeMap<>(values).forEach(this::setting);
        return this;
    }

    /**
     * {@link #setting}.
     *
     * @deprecated its name before 1.0
     */
    @Deprecated
    public LaunchOptions set(String key, Object value) {
        return setting(key, value);
    }

    /** Whether sensors have noise; false: ideal values. */
    public LaunchOptions noise(boolean noise) {
        this.noise = noise;
        return this;
    }

    /** s of sim time after which the run ends. */
    public LaunchOptions duration(double seconds) {
        return more("--duration", Double.toString(seconds));
    }

    /** Starts the run paused, at step 0. */
    public LaunchOptions paused() {
        more.add("--paused");
        return this;
    }

    /** Records the run into this file. */
    public LaunchOptions record(String file) {
        return more("--record", file);
    }

    /** The folder for snapshot() and restore(). */
    public LaunchOptions snapshots(String folder) {
        return more("--snapshots", folder);
    }

    /** Drives by wheel joints: "rover=left_joint,right_joint". */
    public LaunchOptions drive(String... drives) {
        return more("--drive", drives);
    }

    /** Faults to inject: "p3at/lrf:freeze@3". */
    public LaunchOptions fault(String... faults) {
        return more("--fault", faults);
    }

    /** Shared libraries with sensors or drives. */
    public LaunchOptions plugin(String... files) {
        return more("--plugin", files);
    }

    /** Inputs that the run waits for where a command is due: "p3at/velocity@10". */
    public LaunchOptions waitFor(String... inputs) {
        return more("--wait-for", inputs);
    }

    private LaunchOptions more(String option, String... values) {
        for (String value : values) more.addAll(List.of(option, value));
        return this;
    }

    /** The SDF or URDF text of the world, if the world's name is "". */
    public LaunchOptions text(String text) {
        this.text = text;
        return this;
    }

    /** Further options of `ruedo run`. */
    public LaunchOptions args(String... args) {
        this.args = List.of(args);
        return this;
    }

    /**
     * Default: a local socket, which no other user of the machine reads, and plain LCM programs do
     * not know (before Java 16, as "auto"); "auto": a free port for LCM.
     */
    public LaunchOptions url(String url) {
        this.url = url;
        return this;
    }

    /** Name of this client; default "client". */
    public LaunchOptions name(String name) {
        this.name = name;
        return this;
    }

    /** s of real time until the world is loaded; default 30. */
    public LaunchOptions timeout(double timeout) {
        this.timeout = timeout;
        return this;
    }

    /** Whether to show all output of the server; else only its warnings. */
    public LaunchOptions verbose(boolean verbose) {
        this.verbose = verbose;
        return this;
    }
}
