package ruedo;

import java.io.IOException;
import java.net.InetAddress;
import java.net.InetSocketAddress;
import java.net.Socket;
import java.net.URI;
import java.nio.channels.DatagramChannel;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.regex.Pattern;
import java.util.stream.Stream;
import lcm.lcm.LCM;
import lcm.lcm.LCMDataOutputStream;
import lcm.lcm.LCMEncodable;

/** The LCM side of a client: one LCM instance, raw bytes to handlers. Thread safe; LCM's thread calls the handlers. */
final class Bus {
    static final String DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0";

    /** What `ruedo run` serves where there is no multicast route. */
    static final String FALLBACK_URL = "tcpq://127.0.0.1:7700";

    interface Handler {
        /** message: all of its bytes. */
        void receive(byte[] message);
    }

    private final LCM lcm;
    private volatile boolean closed;

    /** Throws NoServer, with the cure, when nothing can come from that URL. */
    Bus(String url) {
        // As LCM's own provider says, IPv6 sockets do not do here; it says so too late for sockets made before it.
        System.setProperty("java.net.preferIPv4Stack", "true");
        checkReachable(url);
        try {
            lcm = new LCM(url);
        } catch (IOException | RuntimeException error) {
            throw new RuedoException.NoServer(url + ": LCM cannot use it (" + error.getMessage()
                    + "); `ruedo doctor` looks for what is wrong");
        }
    }

    static String resolveUrl(String url) {
        String named = System.getenv("LCM_DEFAULT_URL");
        if (url != null && !url.isEmpty()) return url;
        if (named != null && !named.isEmpty()) return named;
        System.setProperty("java.net.preferIPv4Stack", "true");    // before the first socket; see the constructor
        return hasMulticastRoute("239.255.76.67") ? DEFAULT_URL : FALLBACK_URL;
    }

    static boolean hasMulticastRoute(String group) {
        try (DatagramChannel probe = DatagramChannel.open(java.net.StandardProtocolFamily.INET)) {
            probe.connect(new InetSocketAddress(InetAddress.getByName(group), 7667));
            return true;
        } catch (IOException error) {
            return false;
        }
    }

    /** Whether a server on this machine has the address: its claim goes with its process. */
    static boolean isClaimed(String url) {
        URI address = URI.create(url);
        boolean udpm = "udpm".equals(address.getScheme());
        String host = address.getHost() == null ? udpm ? "239.255.76.67" : "127.0.0.1" : address.getHost();
        int port = address.getPort() < 0 ? udpm ? 7667 : 7700 : address.getPort();
        String claim = " @ruedo/" + address.getScheme() + "/" + host + ":" + port;
        try (Stream<String> sockets = Files.lines(Path.of("/proc/net/unix"), StandardCharsets.ISO_8859_1)) {
            return sockets.anyMatch(line -> line.endsWith(claim));
        } catch (IOException | java.io.UncheckedIOException error) {
            return false;
        }
    }

    private static void checkReachable(String url) {
        URI address;
        try {
            address = new URI(url);
        } catch (java.net.URISyntaxException error) {
            throw new RuedoException.NoServer(url + ": not an LCM URL; udpm://GROUP:PORT?ttl=0 or tcpq://HOST:PORT is");
        }
        String scheme = address.getScheme() == null ? "" : address.getScheme();
        if (scheme.equals("udpm")) {
            if (!hasMulticastRoute(address.getHost() == null ? "239.255.76.67" : address.getHost())) {
                throw new RuedoException.NoServer(url + ": this machine has no route for multicast. On Linux: "
                        + "sudo ip route add 224.0.0.0/4 dev lo; `ruedo doctor` tells more");
            }
        } else if (scheme.equals("tcpq")) {
            try {
                probe(address);
            } catch (IOException error) {
                throw new RuedoException.NoServer("no Ruedo server at " + url + " (" + error.getMessage() + "). Is `ruedo run` "
                        + "started with this --lcm? `ruedo doctor` looks for what is wrong");
            }
        } else if (!scheme.equals("memq") && !scheme.equals("file")) {
            throw new RuedoException.NoServer(url + ": not an LCM URL; udpm://GROUP:PORT?ttl=0 or tcpq://HOST:PORT is");
        }
    }

    private static void probe(URI address) throws IOException {
        String host = address.getHost() == null ? "127.0.0.1" : address.getHost();
        try (Socket probe = new Socket()) {
            probe.connect(new InetSocketAddress(host, address.getPort() < 0 ? 7700 : address.getPort()), 2000);
        }
    }

    /** False for a tcpq address where nobody listens. */
    static boolean isServed(String url) {
        if (!url.startsWith("tcpq:")) return true;
        try {
            probe(URI.create(url));
            return true;
        } catch (IOException | IllegalArgumentException error) {
            return false;
        }
    }

    void subscribe(String channel, Handler handler) {
        lcm.subscribe(Pattern.quote(channel), (from, name, in) -> {
            if (closed) return;
            try {
                byte[] message = new byte[in.available()];
                in.readFully(message);
                handler.receive(message);
            } catch (IOException | RuntimeException error) {    // whatever came, the receiving thread lives
                System.err.println("ruedo: a handler of " + name + " failed: " + error);
            }
        });
    }

    void publish(String channel, LCMEncodable message) {
        publish(channel, encode(message));
    }

    void publish(String channel, byte[] bytes) {
        if (closed) return;
        try {
            lcm.publish(channel, bytes, 0, bytes.length);
        } catch (IOException | IllegalStateException error) {
            // lost, as any datagram may be; who waits for an answer repeats
        }
    }

    static byte[] encode(LCMEncodable message) {
        try {
            LCMDataOutputStream out = new LCMDataOutputStream();
            message.encode(out);
            return out.toByteArray();
        } catch (IOException error) {
            throw new IllegalStateException(error);
        }
    }

    /**
     * Handlers hear nothing any more. LCM for Java cannot be closed while its thread receives without exceptions on
     * the terminal; the thread is a daemon, and ends with the process.
     */
    void close() {
        closed = true;
    }
}
