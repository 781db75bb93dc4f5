package ruedo;

import java.io.BufferedInputStream;
import java.io.DataInputStream;
import java.io.IOException;
import java.nio.ByteBuffer;
import java.nio.charset.StandardCharsets;
import java.util.LinkedHashSet;
import java.util.Set;

/**
 * LCM over TCP, or a Unix-domain socket with the same frames, connected again when the server comes
 * back. LCM's own class for it is not used: it walks through its subscriptions while others add to
 * them, and its thread ends by that, or by an Error in a callback.
 */
final class StreamTransport implements Transport {
    private static final int CLIENT = 0x287617fb;
    private static final int SERVER = 0x287617fa;
    private static final int VERSION = 0x0100;
    private static final int PUBLISH = 1;
    private static final int SUBSCRIBE = 2;
    private static final int UNSUBSCRIBE = 3;
    private static final int LONGEST_CHANNEL = 1 << 10; // bytes
    private static final int LONGEST = 64 << 20;
    private static final long AGAIN_MILLIS = 500;

    private final Address address;
    private final Set<String> subscriptions =
            new LinkedHashSet<>(); // these under this object's monitor
    private volatile StreamSocket socket; // null: not connected
    private volatile boolean busy; // something was read that the receiver has not seen
    private volatile boolean closed;

    StreamTransport(Address address) {
        this.address = address;
        try {
            connect();
        } catch (IOException error) {
            throw new RuedoException.NoServer(
                    address.url
                            + ": it cannot be used ("
                            + error.getMessage()
                            + "); `ruedo doctor` looks for what is wrong");
        }
    }

    @Override
    public void start(Receiver receiver) {
        new LastingThread("ruedo-receive", () -> closed, () -> receive(receiver)).start();
    }

    @Override
    public synchronized void subscribe(String channel) {
        if (subscriptions.add(channel)) send(named(SUBSCRIBE, pattern(channel), 0));
    }

    @Override
    public synchronized void unsubscribe(String channel) {
        if (subscriptions.remove(channel)) send(named(UNSUBSCRIBE, pattern(channel), 0));
    }

    @Override
    public synchronized void publish(String channel, byte[] message) {
        send(named(PUBLISH, channel, 4 + message.length).putInt(message.length).put(message));
    }

    @Override
    public boolean hasNews() { // in this order: it is busy before it reads
        StreamSocket open = socket;
        return (open != null && open.hasInput()) || busy;
    }

    @Override
    public boolean isConnected() {
        return socket != null;
    }

    @Override
    public synchronized void close() {
        closed = true;
        drop();
        notifyAll();
    }

    /** Subscriptions are regular expressions. */
    private static String pattern(String channel) {
        return channel.replaceAll("([\\\\.^$*+?{}\\[\\]|()])", "\\\\$1");
    }

    private static ByteBuffer named(int kind, String channel, int more) {
        byte[] name = channel.getBytes(StandardCharsets.US_ASCII);
        return ByteBuffer.allocate(8 + name.length + more)
                .putInt(kind)
                .putInt(name.length)
                .put(name);
    }

    private synchronized void send(ByteBuffer bytes) {
        if (socket == null) return;
        try {
            socket.write(bytes.array(), bytes.position());
        } catch (IOException error) {
            drop();
        }
    }

    private synchronized void drop() {
        try {
            if (socket != null) socket.close(); // a read under way ends
        } catch (IOException error) {
            // it is gone
        }
        socket = null;
    }

    private synchronized void connect() throws IOException {
        StreamSocket made = new StreamSocket(address);
        try {
            made.setTimeout(2000);
            made.write(ByteBuffer.allocate(8).putInt(CLIENT).putInt(VERSION).array(), 8);
            ByteBuffer hello = ByteBuffer.wrap(made.input().readNBytes(8));
            if (hello.remaining() < 8 || hello.getInt() != SERVER)
                throw new IOException("no LCM server answers there");
            made.setTimeout(0);
        } catch (IOException error) {
            made.close();
            throw error;
        }
        socket = made;
        for (String channel : subscriptions) send(named(SUBSCRIBE, pattern(channel), 0));
    }

    /** The connection, reopened if necessary; null if none is possible now, or after close(). */
    private synchronized StreamSocket connected() throws InterruptedException {
        if (socket == null && !closed) {
            try {
                connect();
            } catch (IOException error) {
                wait(AGAIN_MILLIS);
            }
        }
        return socket;
    }

    private void receive(Receiver receiver) throws InterruptedException {
        StreamSocket open = connected();
        if (open == null) return;
        DataInputStream in = new DataInputStream(new BufferedInputStream(open.input(), 1 << 16));
        try {
            while (!closed) {
                long millis = receiver.beforeTurn();
                if (in.available() == 0 && !open.awaitInput(millis)) continue;
                busy = true;
                takeOne(in, receiver);
                busy = in.available() > 0;
            }
        } catch (IOException | RuntimeException | Error error) { // maybe within a message
            drop();
        } finally {
            busy = false;
        }
    }

    private static void takeOne(DataInputStream in, Receiver receiver) throws IOException {
        in.readInt(); // kind
        String channel =
                new String(in.readNBytes(length(in, LONGEST_CHANNEL)), StandardCharsets.US_ASCII);
        byte[] message = new byte[length(in, LONGEST)];
        in.readFully(message);
        try {
            if (receiver.wants(channel)) receiver.receive(channel, message);
        } catch (Throwable error) { // whatever came, the receiving thread lives
            Faults.tell("a message was passed over: ", error, "");
        }
    }

    private static int length(DataInputStream in, int most) throws IOException {
        int length = in.readInt();
        if (length < 0 || length > most) throw new IOException("a length of " + length);
        return length;
    }
}
