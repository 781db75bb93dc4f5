package ruedo;

import java.util.List;

/** How a private server is started. Every setter returns this. */
public final class LaunchOptions {
    Long seed;
    double rate = 1.0;
    List<String> args = List.of();
    String url = "";
    String name = "client";
    double timeout = 30.0;
    boolean verbose;

    /** Of the random numbers; default: the server's. */
    public LaunchOptions seed(long seed) {
        this.seed = seed;
        return this;
    }

    /** Sim time per real time, default 1; {@link Double#POSITIVE_INFINITY}: as fast as it goes. */
    public LaunchOptions rate(double rate) {
        this.rate = rate;
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

    /** Of this client; default "client". */
    public LaunchOptions name(String name) {
        this.name = name;
        return this;
    }

    /** s of real time until the world is loaded; default 30. */
    public LaunchOptions timeout(double timeout) {
        this.timeout = timeout;
        return this;
    }

    /** True: show what the server prints; else it is shown in errors alone. */
    public LaunchOptions verbose(boolean verbose) {
        this.verbose = verbose;
        return this;
    }
}
