package ruedo;

import java.io.Closeable;
import java.io.IOException;
import java.io.InputStream;
import java.lang.reflect.Method;
import java.net.InetAddress;
import java.net.InetSocketAddress;
import java.net.ProtocolFamily;
import java.net.SocketAddress;
import java.net.SocketException;
import java.net.SocketOption;
import java.net.StandardProtocolFamily;
import java.net.StandardSocketOptions;
import java.nio.ByteBuffer;
import java.nio.channels.SelectionKey;
import java.nio.channels.Selector;
import java.nio.channels.SocketChannel;
import java.nio.file.Files;
import java.nio.file.LinkOption;
import java.nio.file.Paths;
import java.security.Principal;

/**
 * A connection to a server: over TCP, or a Unix-domain socket. One thread reads while another
 * writes. What the server does not take within seconds is an IOException.
 */
final class StreamSocket implements Closeable {
    private static final long SENDING_MILLIS = 5000;
    private static final long AGAIN_MILLIS = 10;

    private final SocketChannel channel;
    private final Selector reads = Selector.open();
    private final Selector writes = Selector.open();
    private final Selector looks = Selector.open(); // of hasInput(), for any thread
    private volatile long readMillis; // 0: without end

    /** Throws IOException if no server is there. */
    StreamSocket(Address address) throws IOException {
        channel = address.path != null ? local(address) : SocketChannel.open();
        try {
            channel.configureBlocking(false);
            channel.register(reads, SelectionKey.OP_READ);
            channel.register(looks, SelectionKey.OP_READ);
            if (address.path == null) channel.setOption(StandardSocketOptions.TCP_NODELAY, true);
            if (address.path != null) {
                checkPeer(channel, address.path);
                channel.register(writes, SelectionKey.OP_WRITE);
            } else {
                connect(address);
            }
        } catch (IOException error) {
            close();
            throw error;
        }
    }

    private void connect(Address address) throws IOException {
        if (!channel.connect(addressOf(address))) {
            SelectionKey key = channel.register(writes, SelectionKey.OP_CONNECT);
            new Deadline(SENDING_MILLIS * 1e-3).select(writes);
            if (!channel.finishConnect()) throw new IOException("nobody answers");
            key.interestOps(SelectionKey.OP_WRITE);
        } else {
            channel.register(writes, SelectionKey.OP_WRITE);
        }
    }

    /** Waits for input, at most so long; the thread that reads. */
    boolean awaitInput(long millis) throws IOException {
        return Deadline.selects(reads, millis);
    }

    /** Whether there is something to read; any thread. */
    boolean hasInput() {
        synchronized (looks) {
            try {
                return Deadline.selects(looks, 0);
            } catch (IOException error) { // it was closed
                return false;
            }
        }
    }

    InputStream input() {
        return new InputStream() {
            @Override
            public int read() throws IOException {
                byte[] one = new byte[1];
                return read(one, 0, 1) < 0 ? -1 : one[0] & 0xff;
            }

            @Override
            public int read(byte[] into, int at, int most) throws IOException {
                if (most == 0) return 0;
                ByteBuffer room = ByteBuffer.wrap(into, at, most);
                Deadline deadline =
                        new Deadline(
                                readMillis == 0 ? Double.POSITIVE_INFINITY : readMillis * 1e-3);
                for (; ; ) {
                    int got = channel.read(room);
                    if (got != 0) return got;
                    deadline.select(reads);
                }
            }
        };
    }

    void write(byte[] bytes, int size) throws IOException {
        ByteBuffer left = ByteBuffer.wrap(bytes, 0, size);
        Deadline deadline = new Deadline(SENDING_MILLIS * 1e-3);
        while (left.hasRemaining()) {
            if (channel.write(left) == 0) deadline.select(writes);
        }
    }

    /** Until input() gives up, milliseconds; 0: never. */
    void setTimeout(int millis) {
        readMillis = millis;
    }

    /** A reader or writer in another thread ends with an IOException. */
    @Override
    public void close() throws IOException {
        channel.close();
        reads.close();
        writes.close();
        looks.close();
    }

    /** A connection; waits for a server whose queue is full, as that of a stopped one. */
    private static SocketChannel local(Address address) throws IOException {
        Deadline deadline = new Deadline(SENDING_MILLIS * 1e-3);
        for (; ; ) {
            SocketChannel made = unconnected();
            try {
                made.configureBlocking(false);
                if (made.connect(addressOf(address))) return made;
                throw new SocketException("its queue of connections is full");
            } catch (IOException error) {
                made.close();
                boolean full = // there is no class of its own for it
                        error.getClass() == SocketException.class
                                && Files.exists(Paths.get(address.path));
                if (!full || deadline.passed()) throw error;
            }
            Uninterrupted.sleep(AGAIN_MILLIS);
        }
    }

    /** Java 16 has these sockets; this library is for 11. */
    private static SocketChannel unconnected() throws IOException {
        try {
            Method open = SocketChannel.class.getMethod("open", ProtocolFamily.class);
            return (SocketChannel) open.invoke(null, StandardProtocolFamily.valueOf("UNIX"));
        } catch (ReflectiveOperationException | IllegalArgumentException error) {
            throw new IOException("unix:// addresses need Java 16 or later", error);
        }
    }

    /** The server is this user's or root's: whoever may write in a folder may serve there. */
    private static void checkPeer(SocketChannel channel, String path) throws IOException {
        String user = peerOf(channel, path);
        if (!user.equals("root") && !user.equals(Files.getOwner(Paths.get("/proc/self")).getName()))
            throw new IOException("it is served by another user");
    }

    /** The user that the kernel names; in a runtime without the module jdk.net the file's owner. */
    private static String peerOf(SocketChannel channel, String path) throws IOException {
        try {
            Object option =
                    Class.forName("jdk.net.ExtendedSocketOptions")
                            .getField("SO_PEERCRED")
                            .get(null);
            Object peer = channel.getOption((SocketOption<?>) option);
            return ((Principal) peer.getClass().getMethod("user").invoke(peer)).getName();
        } catch (ReflectiveOperationException error) {
            return Files.getOwner(Paths.get(path), LinkOption.NOFOLLOW_LINKS).getName();
        }
    }

    private static SocketAddress addressOf(Address address) throws IOException {
        String path = address.path;
        if (path == null)
            return new InetSocketAddress(InetAddress.getByName(address.host), address.port);
        try {
            return (SocketAddress)
                    Class.forName("java.net.UnixDomainSocketAddress")
                            .getMethod("of", String.class)
                            .invoke(null, path);
        } catch (ReflectiveOperationException error) {
            throw new IOException(path + " is not a path of a socket", error);
        }
    }
}
