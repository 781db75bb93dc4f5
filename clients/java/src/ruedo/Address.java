package ruedo;

import java.io.BufferedReader;
import java.io.File;
import java.io.FileReader;
import java.io.IOException;
import java.io.UncheckedIOException;
import java.net.ConnectException;
import java.net.Inet4Address;
import java.net.InetAddress;
import java.net.InetSocketAddress;
import java.net.SocketException;
import java.net.StandardProtocolFamily;
import java.net.UnknownHostException;
import java.nio.channels.DatagramChannel;
import java.nio.charset.StandardCharsets;
import java.util.HashMap;
import java.util.Map;

/**
 * An LCM URL: udpm://GROUP:PORT?ttl=0 or tcpq://HOST:PORT; or unix:///PATH, a local socket, which
 * LCM does not have.
 */
final class Address {
    private static final String GROUP = "239.255.76.67"; // LCM's own
    static final String DEFAULT_URL = "udpm://" + GROUP + ":7667?ttl=0";

    /** The address of `ruedo run` without a multicast route. */
    static final String FALLBACK_URL = "tcpq://127.0.0.1:7700";

    final String url;
    final boolean multicast;
    final String host;
    final int port;
    final String path; // of a local socket; else null
    final int ttl; // of multicast: networks that datagrams cross
    final int receiveBuffer; // of multicast, in bytes; 0: not named

    /** Reads it as the server does. Throws NoServer if the text is not a client's address. */
    Address(String url) {
        this.url = url;
        int at = url.indexOf("://");
        if (at < 0) throw refused("it has no scheme");
        String scheme = url.substring(0, at);
        String rest = url.substring(at + 3);
        if (scheme.equals("unix")) {
            if (!rest.startsWith("/")) throw refused("'" + rest + "' is not an absolute path");
            path = rest;
            multicast = false;
            host = "";
            port = ttl = receiveBuffer = 0;
            return;
        }
        path = null;
        multicast = scheme.equals("udpm");
        if (!multicast && !scheme.equals("tcpq"))
            throw refused("the schemes udpm, tcpq and unix are supported");
        String[] parts = rest.split("\\?", 2);
        Map<String, Integer> options = options(parts.length > 1 ? parts[1] : "");
        if (!multicast && !options.isEmpty()) throw refused("tcpq has no options");
        if (parts[0].startsWith("["))
            throw refused(
                    "LCM has no IPv6: '"
                            + parts[0]
                            + "' is not allowed; give a name or an IPv4 address");
        String[] place = parts[0].split(":", 2);
        port = place.length > 1 ? port(place[1]) : multicast ? 7667 : 7700;
        host =
                place[0].isEmpty()
                        ? multicast ? GROUP : "127.0.0.1"
                        : multicast ? group(place[0]) : resolved(place[0]);
        ttl = options.getOrDefault("ttl", 0);
        receiveBuffer = options.getOrDefault("recv_buf_size", 0);
    }

    private RuedoException.NoServer refused(String why) {
        return new RuedoException.NoServer(
                "url '"
                        + url
                        + "': "
                        + why
                        + "; an address looks like "
                        + DEFAULT_URL
                        + ", "
                        + FALLBACK_URL
                        + " or unix:///tmp/ruedo.sock");
    }

    private int port(String digits) {
        int port = number(digits, 1, 65535);
        if (port < 0) throw refused("'" + digits + "' is not a port");
        return port;
    }

    private String group(String text) {
        String[] bytes = text.split("\\.", -1);
        boolean good = bytes.length == 4 && number(bytes[0], 224, 239) >= 0;
        for (String value : bytes) good = good && number(value, 0, 255) >= 0;
        if (good) return text;
        throw refused("'" + text + "' is not a multicast group (224.0.0.0 to 239.255.255.255)");
    }

    private String resolved(String name) {
        try {
            for (InetAddress address : InetAddress.getAllByName(name))
                if (address instanceof Inet4Address) return address.getHostAddress();
        } catch (UnknownHostException error) {
            // said below
        }
        throw refused("'" + name + "' is not a host that this machine knows");
    }

    private Map<String, Integer> options(String text) {
        Map<String, Integer> found = new HashMap<>();
        for (String pair : text.isEmpty() ? new String[0] : text.split("&")) {
            String key = pair.replaceFirst("=.*", "");
            String digits = pair.substring(Math.min(key.length() + 1, pair.length()));
            int value =
                    key.equals("ttl")
                            ? number(digits, 0, 255)
                            : key.equals("recv_buf_size")
                                    ? number(digits, 1, Integer.MAX_VALUE)
                                    : -1;
            if (value < 0 || found.put(key, value) != null)
                throw refused(
                        "the option '"
                                + pair
                                + "' is not allowed: ttl, 0 to 255, and recv_buf_size, 1 to"
                                + " 2147483647 bytes, are, each once");
        }
        return found;
    }

    /** A number from least to most; -1 for any other text. */
    private static int number(String digits, int least, int most) {
        if (!digits.matches("[0-9]{1,10}")) return -1;
        long value = Long.parseLong(digits);
        return value >= least && value <= most ? (int) value : -1;
    }

    static String resolve(String url) {
        String named = System.getenv("LCM_DEFAULT_URL");
        if (url != null && !url.isEmpty()) return url;
        if (named != null && !named.isEmpty()) return named;
        return hasMulticastRoute("239.255.76.67") ? DEFAULT_URL : FALLBACK_URL;
    }

    static boolean hasMulticastRoute(String group) {
        try (DatagramChannel probe = DatagramChannel.open(StandardProtocolFamily.INET)) {
            probe.connect(new InetSocketAddress(InetAddress.getByName(group), 7667));
            return true;
        } catch (IOException | RuntimeException error) {
            return false;
        }
    }

    /** Whether a server on this machine has the address; its claim ends with its process. */
    boolean isClaimed() {
        if (path != null) return isServed();
        String claim = " @ruedo/" + (multicast ? "udpm" : "tcpq") + "/" + host + ":" + port;
        // A channel of Files' would be closed by an interrupt.
        try (BufferedReader sockets =
                new BufferedReader(new FileReader("/proc/net/unix", StandardCharsets.ISO_8859_1))) {
            return sockets.lines().anyMatch(line -> line.endsWith(claim));
        } catch (IOException | UncheckedIOException error) {
            return false;
        }
    }

    /** Throws NoServer, with the cure, when nothing can come from there. */
    void checkReachable() {
        if (multicast) {
            if (hasMulticastRoute(host)) return;
            throw new RuedoException.NoServer(
                    url
                            + ": this machine has no route for multicast. On Linux: "
                            + "sudo ip route add 224.0.0.0/4 dev lo; `ruedo doctor` explains");
        }
        try {
            probe();
        } catch (IOException error) {
            throw new RuedoException.NoServer(
                    "no Ruedo server at "
                            + url
                            + " ("
                            + error.getMessage()
                            + "). Is `ruedo run` "
                            + "started with this --lcm? `ruedo doctor` looks for what is wrong");
        }
    }

    private void probe() throws IOException {
        new StreamSocket(this).close();
    }

    /** False for a tcpq or unix address without a server. */
    boolean isServed() {
        if (multicast) return true;
        try {
            probe();
            return true;
        } catch (IOException error) {
            // The queue of a stopped server is full, for which Java has no exception of its own.
            return path != null
                    && error instanceof SocketException
                    && !(error instanceof ConnectException)
                    && new File(path).exists();
        }
    }
}
