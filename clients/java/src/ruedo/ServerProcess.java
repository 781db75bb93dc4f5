package ruedo;

import java.io.File;
import java.io.FileOutputStream;
import java.io.IOException;
import java.io.OutputStream;
import java.io.RandomAccessFile;
import java.lang.ProcessBuilder.Redirect;
import java.net.InetAddress;
import java.net.InetSocketAddress;
import java.net.ServerSocket;
import java.net.StandardProtocolFamily;
import java.net.URISyntaxException;
import java.nio.channels.DatagramChannel;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.HashSet;
import java.util.List;
import java.util.Set;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.atomic.AtomicBoolean;

/**
 * A private server: on a free port, and ended when this process is, however that ends. The server
 * watches its standard input (--follow-stdin) and ends when the pipe closes: the kernel closes it
 * for a process that was killed, too.
 */
final class ServerProcess {
    /** Starts a program in a session of its own: a terminal's Ctrl-C is for this process alone. */
    private static final File SETSID = new File("/usr/bin/setsid");

    private static final int MOST_SAID = 1 << 16; // bytes of its last lines
    private static final int MOST_HEARD = 1 << 16; // bytes of warnings that are read at once
    private static final int MOST_WARNED = 1000; // warnings, each of which is printed once

    final String url;
    private final List<String> command;
    private final Process process;
    private RandomAccessFile output; // its warnings and errors; null when verbose
    private long heard; // bytes of it that warnings() has read
    private final Set<String> warned = new HashSet<>();
    private ServerSocket token; // see freeUrl()
    private Path folder; // of the socket; null: not made
    private Path file; // of a world's text; null: the world is somebody's own

    ServerProcess(String world, LaunchOptions options) {
        if (world.isEmpty() == options.text.isEmpty())
            throw new RuedoException.LaunchError("launch() needs either a world or its text");
        String program = findRuedo();
        boolean started = false;
        try {
            if (options.url.isEmpty()) url = privateUrl();
            else url = options.url.equals("auto") ? freeUrl() : options.url;
            String shown = options.text.isEmpty() ? world : written(options.text);
            command =
                    new ArrayList<>(List.of(program, "run", shown, "--lcm", url, "--follow-stdin"));
            command.addAll(optionsOf(options));
            addTemporary(folder);
            addTemporary(file);
            process = started(options.verbose);
            started = true;
        } finally {
            if (!started) cleanUp();
        }
    }

    /** It goes with the server, even where this process is killed. */
    private void addTemporary(Path path) {
        if (path != null) command.addAll(List.of("--temporary", path.toString()));
    }

    private Process started(boolean verbose) {
        List<String> words = new ArrayList<>();
        if (isProgram(SETSID)) words.add(SETSID.getPath());
        words.addAll(command);
        ProcessBuilder builder = new ProcessBuilder(words);
        try {
            if (verbose) return builder.inheritIO().redirectInput(Redirect.PIPE).start();
            Path log = Files.createTempFile("ruedo-", ".log");
            try {
                output = new RandomAccessFile(log.toFile(), "r");
                return builder.redirectOutput(Redirect.DISCARD).redirectError(log.toFile()).start();
            } finally { // it lives on without a name, for as long as it is open
                Files.delete(log);
            }
        } catch (IOException error) {
            throw new RuedoException.LaunchError(
                    command.get(0) + " cannot be started: " + error.getMessage());
        }
    }

    /** Python's launch() takes the same options. */
    private static List<String> optionsOf(LaunchOptions options) {
        List<String> words = new ArrayList<>();
        if (options.seed != null) words.addAll(List.of("--seed", Long.toString(options.seed)));
        String rate = Double.isInfinite(options.rate) ? "max" : Double.toString(options.rate);
        words.addAll(List.of("--rate", rate));
        if (options.lockstep != 0)
            words.addAll(List.of("--lockstep", Integer.toString(options.lockstep)));
        for (String model : options.spawn) words.addAll(List.of("--spawn", model));
        for (String device : options.disable) words.addAll(List.of("--disable", device));
        for (String setting : options.settings) words.addAll(List.of("--set", setting));
        if (!options.noise) words.add("--no-noise");
        words.addAll(options.more);
        words.addAll(options.args);
        return words;
    }

    /** The text in a file that ends with the server; its name. */
    private String written(String text) {
        boolean urdf = text.contains("<robot") && !text.contains("<sdf");
        try {
            file = Files.createTempFile("ruedo-", urdf ? ".urdf" : ".sdf");
            file.toFile().deleteOnExit();
            // A channel of Files' would be closed by an interrupt.
            try (OutputStream out = new FileOutputStream(file.toFile())) {
                out.write(text.getBytes(StandardCharsets.UTF_8));
            }
            return file.toString();
        } catch (IOException error) {
            throw new RuedoException.LaunchError(
                    "the world's text cannot be written: " + error.getMessage());
        }
    }

    /** Waits for a tcpq server to listen, which it does once its world is loaded; timeout: s. */
    void awaitPort(double timeout) {
        Deadline deadline = new Deadline(timeout);
        Address address = new Address(url);
        while (!address.isServed() && !deadline.passed()) {
            String how = ended();
            if (how != null) throw new RuedoException.LaunchError(how);
            try {
                Thread.sleep(20);
            } catch (InterruptedException error) {
                Thread.currentThread().interrupt();
                throw new RuedoException.Interrupted();
            }
        }
    }

    private static final AtomicBoolean said = new AtomicBoolean();

    private static void sayOnce(String line) {
        if (said.compareAndSet(false, true)) System.err.println(line);
    }

    /** Reports this client's progress. Not from two threads at once. */
    void tell(String line) {
        try {
            process.getOutputStream().write(line.getBytes(StandardCharsets.US_ASCII));
            process.getOutputStream().flush();
        } catch (IOException error) {
            // it has ended
        }
    }

    /** The server's warnings since the last call, each once. */
    synchronized List<String> warnings() {
        List<String> news = new ArrayList<>();
        if (output == null) return news;
        try {
            byte[] said = new byte[(int) Math.min(output.length() - heard, MOST_HEARD)];
            output.seek(heard);
            output.readFully(said);
            int end = said.length; // of its last whole line
            while (end > 0 && said[end - 1] != '\n') end--;
            heard += end;
            for (String line : new String(said, 0, end, StandardCharsets.UTF_8).split("\n")) {
                String warning = WireReader.printed(line);
                if (line.isEmpty() || line.startsWith("ruedo: info:") || warned.contains(warning))
                    continue;
                if (warned.size() < MOST_WARNED) warned.add(warning);
                news.add(warning);
            }
        } catch (IOException error) {
            // end() has closed it
        }
        return news;
    }

    /** How the server ended, with the last lines it printed; null while it runs. */
    synchronized String ended() {
        if (process.isAlive()) return null;
        String said = lastLines();
        return "the server ended (exit code "
                + process.exitValue()
                + "): "
                + (said.isEmpty() ? "it said nothing" : said)
                + "\n(`"
                + String.join(" ", command)
                + "`)";
    }

    /** Whether it has ended with exit code 0. */
    synchronized boolean isDone() {
        return !process.isAlive() && process.exitValue() == 0;
    }

    /** Closes the pipe, which ends the server; kills it when it has not ended after 5 s. */
    synchronized void end() {
        try {
            process.getOutputStream().close();
        } catch (IOException error) {
            // it is closed, then
        }
        try {
            if (!Uninterrupted.get(() -> process.waitFor(5, TimeUnit.SECONDS)))
                Uninterrupted.get(() -> process.destroyForcibly().waitFor());
        } finally {
            cleanUp();
        }
    }

    private void cleanUp() {
        try {
            if (token != null) token.close();
            if (output != null) output.close();
            if (file != null) Files.deleteIfExists(file);
            if (folder != null) {
                Files.deleteIfExists(folder.resolve("bus"));
                Files.deleteIfExists(folder);
            }
        } catch (IOException error) {
            // it is gone already
        }
    }

    private String lastLines() {
        try {
            if (output == null) return "";
            byte[] said = new byte[(int) Math.min(output.length(), MOST_SAID)];
            output.seek(output.length() - said.length);
            output.readFully(said);
            String[] lines = new String(said, StandardCharsets.UTF_8).trim().split("\n");
            return String.join(
                    "\n", Arrays.copyOfRange(lines, Math.max(0, lines.length - 12), lines.length));
        } catch (IOException error) {
            return "";
        }
    }

    /**
     * RUEDO, else that of the installation which this jar belongs to, else the PATH, else one built
     * in a folder above this jar.
     */
    private static String findRuedo() {
        String named = System.getenv("RUEDO");
        if (named != null && !named.isEmpty()) {
            if (isProgram(new File(named))) return named;
            throw new RuedoException.LaunchError(
                    "the environment's RUEDO is '" + named + "', which is not a program");
        }
        List<File> above = foldersAbove();
        List<File> candidates = new ArrayList<>();
        for (File folder : above) candidates.add(new File(folder, "bin/ruedo"));
        String path = System.getenv("PATH");
        for (String folder : (path == null ? "" : path).split(File.pathSeparator))
            candidates.add(new File(folder, "ruedo"));
        for (File folder : above) {
            candidates.add(new File(folder, "build/bin/ruedo"));
            File[] builds = new File(folder, "build").listFiles(File::isDirectory);
            if (builds == null) continue;
            Arrays.sort(builds);
            for (File build : builds) candidates.add(new File(build, "bin/ruedo"));
        }
        for (File candidate : candidates) {
            if (isProgram(candidate)) return candidate.getPath();
        }
        throw new RuedoException.LaunchError(
                "the program `ruedo` was not found: not in RUEDO, not beside this jar, not on the"
                        + " PATH (a Maven project names it by RUEDO; `scripts/run` builds it)");
    }

    /** The folders that contain this jar, the nearest first; none if they are unknown. */
    private static List<File> foldersAbove() {
        List<File> folders = new ArrayList<>();
        try {
            File here =
                    new File(
                            Ruedo.class
                                    .getProtectionDomain()
                                    .getCodeSource()
                                    .getLocation()
                                    .toURI());
            for (File folder = here.getParentFile();
                    folder != null;
                    folder = folder.getParentFile()) folders.add(folder);
        } catch (URISyntaxException error) {
            // not a file
        }
        return folders;
    }

    private static boolean isProgram(File file) {
        return file.isFile() && file.canExecute();
    }

    /** A local socket in a folder that only this user can enter; a port before Java 16. */
    private String privateUrl() {
        if (Runtime.version().feature() < 16) return freeUrl();
        String runtime = System.getenv("XDG_RUNTIME_DIR");
        boolean usable = // a socket's path has 99 bytes at most
                runtime != null
                        && !runtime.isEmpty()
                        && runtime.length() < 60
                        && Files.isWritable(Path.of(runtime));
        try {
            folder = Files.createTempDirectory(Path.of(usable ? runtime : "/tmp"), "ruedo-");
        } catch (IOException error) {
            throw new RuedoException.LaunchError(
                    "no folder for the server's socket: " + error.getMessage());
        }
        return "unix://" + folder.resolve("bus");
    }

    /**
     * A URL that nothing else uses. The TCP socket on the same port, kept open, is the token by
     * which launches of any process, in any language, stay apart from each other.
     */
    private String freeUrl() {
        for (int i = 0; i < 100; i++) {
            try {
                token = new ServerSocket(0, 1, InetAddress.getByName("127.0.0.1"));
                int port = token.getLocalPort();
                if (!Address.hasMulticastRoute("239.255.76.67")) {
                    token.close(); // the server itself will listen on it
                    sayOnce(
                            "ruedo: no multicast route here: launch() speaks LCM over TCP,"
                                    + " LCM_DEFAULT_URL=tcpq://127.0.0.1:"
                                    + port);
                    return "tcpq://127.0.0.1:" + port;
                }
                try (DatagramChannel probe = DatagramChannel.open(StandardProtocolFamily.INET)) {
                    probe.bind(
                            new InetSocketAddress(
                                    "0.0.0.0", port)); // fails when any LCM program uses the port
                    return "udpm://239.255.76.67:" + port + "?ttl=0";
                } catch (IOException error) {
                    token.close();
                }
            } catch (IOException error) {
                throw new RuedoException.LaunchError(
                        "no port for the server: " + error.getMessage());
            }
        }
        throw new RuedoException.LaunchError("no free UDP port was found in 100 tries");
    }
}
