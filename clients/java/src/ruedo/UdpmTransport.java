package ruedo;

import java.io.IOException;
import java.net.InetAddress;
import java.net.InetSocketAddress;
import java.net.NetworkInterface;
import java.net.SocketAddress;
import java.net.StandardProtocolFamily;
import java.net.StandardSocketOptions;
import java.nio.ByteBuffer;
import java.nio.channels.DatagramChannel;
import java.nio.channels.SelectionKey;
import java.nio.channels.Selector;
import java.nio.charset.StandardCharsets;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;
import java.util.Map;
import java.util.TreeMap;

/**
 * LCM over multicast: short messages in one datagram, long ones in fragments. LCM's own class for
 * it is not used: its reader thread ends at the first broken datagram, and at an Error in a
 * callback; it holds a lock while callbacks run; it cannot be closed in silence. The channel does
 * not block: an interrupt of a thread that sends would close one that does.
 */
final class UdpmTransport implements Transport {
    private static final int SHORT = 0x4c433032; // "LC02"
    private static final int LONG = 0x4c433033; // "LC03"
    private static final int MOST_IN_A_DATAGRAM = 64000; // bytes of channel and message
    private static final int LONGEST = 64 << 20; // bytes of a message that is put together
    private static final long MOST_PARTIAL = // bytes: memory of those not whole yet
            Math.min(80 << 20, Runtime.getRuntime().maxMemory() / 4);
    private static final double SENDING_SECONDS = 5.0; // what is not taken until then is lost
    private static final int MOST_MESSAGES = 64; // that are not whole yet, and of each sender
    private static final int MOST_OF_SENDER = 4;

    /**
     * A message that is not whole yet: several threads of a sender's may send at once. It takes the
     * memory of what has come, not of what its sender says is to come.
     */
    private static final class Partial {
        final SocketAddress sender;
        final int sequence;
        final int size;
        final int count;
        final Map<Integer, Fragment> fragments = new TreeMap<>(); // by number
        String channel;

        Partial(SocketAddress sender, int sequence, int size, int count) {
            this.sender = sender;
            this.sequence = sequence;
            this.size = size;
            this.count = count;
        }

        /** Null unless the fragments follow each other without a gap. */
        byte[] joined() {
            int at = 0;
            for (Fragment fragment : fragments.values()) {
                if (fragment.offset != at) return null;
                at += fragment.size;
            }
            if (at != size) return null;
            byte[] message = new byte[size];
            for (Fragment fragment : fragments.values())
                System.arraycopy(fragment.data, 0, message, fragment.offset, fragment.size);
            return message;
        }
    }

    private static final class Fragment {
        final int offset;
        final int size;
        final byte[] data; // as many bytes, or some more

        Fragment(int offset, int size, byte[] data) {
            this.offset = offset;
            this.size = size;
            this.data = data;
        }
    }

    private final InetSocketAddress group;
    private final DatagramChannel socket;
    private final Selector reads;
    private final Selector writes;
    private final Selector looks; // of hasNews(), for any thread
    private int sequence; // under this object's monitor
    private volatile boolean busy; // something was read that the receiver has not seen
    private volatile boolean closed;
    // The newest last; the receiving thread's.
    private final List<Partial> partials = new ArrayList<>();
    private final FragmentPool pool = new FragmentPool();

    UdpmTransport(Address address) {
        try {
            group = new InetSocketAddress(InetAddress.getByName(address.host), address.port);
            // Of IPv4: multicast over IPv6 sockets does not reach IPv4 groups everywhere, and
            // java.net.preferIPv4Stack is read
            // before this could set it when Java starts from a module path.
            socket = DatagramChannel.open(StandardProtocolFamily.INET);
            socket.setOption(StandardSocketOptions.SO_REUSEADDR, true);
            socket.bind(new InetSocketAddress(address.port));
            if (address.receiveBuffer > 0)
                socket.setOption(StandardSocketOptions.SO_RCVBUF, address.receiveBuffer);
            socket.setOption(StandardSocketOptions.IP_MULTICAST_LOOP, true);
            socket.setOption(StandardSocketOptions.IP_MULTICAST_TTL, address.ttl);
            socket.join(group.getAddress(), routeTo(group));
            socket.configureBlocking(false);
            reads = Selector.open();
            writes = Selector.open();
            looks = Selector.open();
            socket.register(reads, SelectionKey.OP_READ);
            socket.register(looks, SelectionKey.OP_READ);
            socket.register(writes, SelectionKey.OP_WRITE);
        } catch (IOException | RuntimeException error) {
            throw new RuedoException.NoServer(
                    address.url
                            + ": it cannot be used ("
                            + error.getMessage()
                            + "); `ruedo doctor` looks for what is wrong");
        }
    }

    /** The interface that the kernel sends by. */
    private static NetworkInterface routeTo(InetSocketAddress group) throws IOException {
        try (DatagramChannel probe = DatagramChannel.open(StandardProtocolFamily.INET)) {
            probe.connect(group);
            InetAddress own = ((InetSocketAddress) probe.getLocalAddress()).getAddress();
            if (own.isAnyLocalAddress())
                own = InetAddress.getByName("127.0.0.1"); // loopback's own is given to no way out
            NetworkInterface found = NetworkInterface.getByInetAddress(own);
            if (found == null)
                throw new IOException("no interface has the address " + own.getHostAddress());
            return found;
        }
    }

    @Override
    public void start(Receiver receiver) {
        ByteBuffer packet = ByteBuffer.allocate(65536);
        new LastingThread("ruedo-receive", () -> closed, () -> receive(packet, receiver)).start();
    }

    @Override
    public void subscribe(String channel) {} // all come

    @Override
    public void unsubscribe(String channel) {}

    @Override
    public boolean hasNews() { // in this order: it is busy before it reads
        synchronized (looks) {
            try {
                if (Deadline.selects(looks, 0)) return true;
            } catch (IOException error) {
                return false; // it was closed
            }
        }
        return busy;
    }

    @Override
    public void close() {
        closed = true;
        try {
            socket.close();
            reads.close();
            writes.close();
            looks.close();
        } catch (IOException error) {
            // it is of no use any more
        }
    }

    @Override
    public void publish(String channel, byte[] message) {
        byte[] name = (channel + "\0").getBytes(StandardCharsets.US_ASCII);
        try {
            synchronized (this) {
                sequence++;
                if (name.length + message.length <= MOST_IN_A_DATAGRAM) {
                    send(
                            ByteBuffer.allocate(8 + name.length + message.length)
                                    .putInt(SHORT)
                                    .putInt(sequence)
                                    .put(name)
                                    .put(message));
                } else {
                    sendFragments(name, message);
                }
            }
        } catch (IOException error) {
            // lost
        }
    }

    private void sendFragments(byte[] name, byte[] message) throws IOException {
        int first = MOST_IN_A_DATAGRAM - name.length;
        int fragments = 1 + (message.length - first + MOST_IN_A_DATAGRAM - 1) / MOST_IN_A_DATAGRAM;
        for (int i = 0, at = 0; i < fragments; i++) {
            int size = Math.min(i == 0 ? first : MOST_IN_A_DATAGRAM, message.length - at);
            ByteBuffer out =
                    ByteBuffer.allocate(20 + name.length + size)
                            .putInt(LONG)
                            .putInt(sequence)
                            .putInt(message.length)
                            .putInt(at)
                            .putShort((short) i)
                            .putShort((short) fragments);
            if (i == 0) out.put(name);
            send(out.put(message, at, size));
            at += size;
        }
    }

    private void send(ByteBuffer bytes) throws IOException {
        bytes.flip();
        Deadline deadline = new Deadline(SENDING_SECONDS);
        while (socket.send(bytes, group) == 0) deadline.select(writes);
    }

    private void receive(ByteBuffer packet, Receiver receiver) throws IOException {
        packet.clear();
        long millis = receiver.beforeTurn();
        busy = true;
        try {
            SocketAddress sender = socket.receive(packet);
            if (sender != null) {
                packet.flip();
                take(packet, sender, receiver);
                return;
            }
        } finally {
            busy = false;
        }
        Deadline.selects(reads, millis);
    }

    private void take(ByteBuffer in, SocketAddress sender, Receiver receiver) {
        if (in.remaining() < 8) return;
        int magic = in.getInt();
        int number = in.getInt();
        if (magic == LONG) {
            takeFragment(sender, number, in, receiver);
        } else if (magic == SHORT) {
            String channel = channel(in);
            if (channel == null || !receiver.wants(channel)) return;
            byte[] message = new byte[in.remaining()];
            in.get(message);
            receiver.receive(channel, message);
        }
    }

    private void takeFragment(SocketAddress sender, int number, ByteBuffer in, Receiver receiver) {
        if (in.remaining() < 12) return;
        int size = in.getInt();
        int offset = in.getInt();
        int fragment = in.getShort() & 0xffff;
        int fragments = in.getShort() & 0xffff;
        if (size < 0 || size > LONGEST || fragment >= fragments) return;
        String channel = fragment == 0 ? channel(in) : null;
        if (fragment == 0 && (channel == null || !receiver.wants(channel))) return;
        if (offset < 0 || offset > size - in.remaining()) return;
        Partial partial = partialOf(sender, number, size, fragments);
        if (partial == null || partial.fragments.containsKey(fragment)) return;
        int length = in.remaining();
        byte[] data = pool.take(length);
        in.get(data, 0, length);
        partial.fragments.put(fragment, new Fragment(offset, length, data));
        if (channel != null) partial.channel = channel;
        byte[] message = null;
        if (partial.fragments.size() == fragments) {
            if (partial.channel != null) message = partial.joined();
            forget(partial);
        }
        while (pool.held() > MOST_PARTIAL) {
            if (!pool.shrink()) forget(partials.get(0));
        }
        if (message != null) receiver.receive(partial.channel, message);
    }

    /** Null when a fragment contradicts those before it. */
    private Partial partialOf(SocketAddress sender, int sequence, int size, int count) {
        List<Partial> ofSender = new ArrayList<>();
        for (Partial known : partials) {
            if (!known.sender.equals(sender)) continue;
            if (known.sequence == sequence)
                return known.size == size && known.count == count ? known : null;
            ofSender.add(known);
        }
        if (ofSender.size() >= MOST_OF_SENDER) forget(ofSender.get(0));
        if (partials.size() >= MOST_MESSAGES) forget(partials.get(0));
        Partial made = new Partial(sender, sequence, size, count);
        partials.add(made);
        return made;
    }

    private void forget(Partial partial) {
        if (!partials.remove(partial)) return;
        for (Fragment fragment : partial.fragments.values()) pool.giveBack(fragment.data);
    }

    /** The name in front of a message; null where it has no end. */
    private static String channel(ByteBuffer in) {
        int from = in.position();
        int end = from;
        while (end < in.limit() && in.get(end) != 0) end++;
        if (end == in.limit()) return null;
        in.position(end + 1);
        return new String(Arrays.copyOfRange(in.array(), from, end), StandardCharsets.US_ASCII);
    }
}
