package ruedo;

import java.io.IOException;
import java.net.InetAddress;
import java.net.InetSocketAddress;
import java.net.StandardProtocolFamily;
import java.net.URI;
import java.net.URISyntaxException;
import java.nio.channels.DatagramChannel;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.nio.file.Path;

/**
 * An LCM URL: udpm://GROUP:PORT?ttl=0 or tcpq://HOST:PORT; or unix:///PATH, a local socket, which
 * is none of LCM's.
 */
final class Address {
    private static final String GROUP = "239.255.76.67"; // LCM's own
    static final String DEFAULT_URL = "udpm://" + GROUP + ":7667?ttl=0";

    /** What `ruedo run` serves where there is no multicast route. */
    static final String FALLBACK_URL = "tcpq://127.0.0.1:7700";

    final String url;
    final boolean multicast;
    final String host;
    final int port;
    final String path; // of a local socket; else null
    private final String options;

    /** Throws NoServer for a text that is no such URL. */
    Address(String url) {
        this.url = url;
        URI uri;
        try {
            // URI wants a host.
            uri =
                    new URI(
                            url.replaceFirst("^udpm://(?=$|[:?])", "udpm://" + GROUP)
                                    .replaceFirst("^tcpq://(?=$|[:?])", "tcpq://127.0.0.1"));
        } catch (URISyntaxException error) {
            throw notOne();
        }
        multicast = "udpm".equals(uri.getScheme());
        if ("unix".equals(uri.getScheme())) {
            path = url.substring("unix://".length());
            if (!path.startsWith("/")) throw notOne();
            host = options = "";
            port = 0;
            return;
        }
        path = null;
        if ((!multicast && !"tcpq".equals(uri.getScheme())) || uri.getHost() == null)
            throw notOne();
        host = uri.getHost();
        port = uri.getPort() < 0 ? multicast ? 7667 : 7700 : uri.getPort();
        if (port > 65535) throw notOne();
        options = uri.getQuery() == null ? "" : uri.getQuery();
    }

    private RuedoException.NoServer notOne() {
        return new RuedoException.NoServer(
                url
                        + ": not an LCM URL; udpm://GROUP:PORT?ttl=0, tcpq://HOST:PORT or"
                        + " unix:///PATH is");
    }

    /** The number that the URL gives as an option. */
    int option(String name, int otherwise) {
        for (String option : options.split("&")) {
            if (!option.startsWith(name + "=")) continue;
            try {
                return Integer.parseInt(option.substring(name.length() + 1));
            } catch (NumberFormatException error) {
                throw new RuedoException.NoServer(url + ": " + option + " is no number");
            }
        }
        return otherwise;
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
        try (java.util.stream.Stream<String> sockets =
                Files.lines(Path.of("/proc/net/unix"), StandardCharsets.ISO_8859_1)) {
            return sockets.anyMatch(line -> line.endsWith(claim));
        } catch (IOException | java.io.UncheckedIOException error) {
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
                            + "sudo ip route add 224.0.0.0/4 dev lo; `ruedo doctor` tells more");
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

    /** False for a tcpq or unix address where nobody listens. */
    boolean isServed() {
        if (multicast) return true;
        try {
            probe();
            return true;
        } catch (IOException error) {
            return false;
        }
    }
}
