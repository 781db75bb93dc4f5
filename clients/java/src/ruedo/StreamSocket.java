package ruedo;

import java.io.Closeable;
import java.io.IOException;
import java.io.InputStream;
import java.net.InetSocketAddress;
import java.net.Socket;
import java.net.SocketAddress;
import java.nio.ByteBuffer;
import java.nio.channels.SocketChannel;

/** A stream socket to a server: TCP or Unix-domain. One thread may read while another writes. */
abstract class StreamSocket implements Closeable {
    abstract InputStream input() throws IOException;

    abstract void write(byte[] bytes, int size) throws IOException;

    /** Milliseconds until a read gives up; 0: never. */
    abstract void setTimeout(int millis) throws IOException;

    /** Throws IOException when nobody serves there. */
    static StreamSocket connect(Address address) throws IOException {
        return address.path != null ? new Local(address.path) : new Tcp(address);
    }

    private static final class Tcp extends StreamSocket {
        private final Socket socket = new Socket();

        Tcp(Address address) throws IOException {
            try {
                socket.connect(new InetSocketAddress(address.host, address.port), 2000);
                socket.setTcpNoDelay(true);
            } catch (IOException error) {
                socket.close();
                throw error;
            }
        }

        @Override
        InputStream input() throws IOException {
            return socket.getInputStream();
        }

        @Override
        void write(byte[] bytes, int size) throws IOException {
            socket.getOutputStream().write(bytes, 0, size);
        }

        @Override
        void setTimeout(int millis) throws IOException {
            socket.setSoTimeout(millis);
        }

        @Override
        public void close() throws IOException {
            socket.close();
        }
    }

    /** Java 16 has these sockets; this library is for 11. */
    private static final class Local extends StreamSocket {
        private final SocketChannel channel;

        Local(String path) throws IOException {
            Object address;
            try {
                address =
                        Class.forName("java.net.UnixDomainSocketAddress")
                                .getMethod("of", String.class)
                                .invoke(null, path);
            } catch (ReflectiveOperationException error) {
                throw new IOException("unix:// addresses need Java 16 or later", error);
            }
            channel = SocketChannel.open((SocketAddress) address);
        }

        // The streams of java.nio.channels.Channels would make a writer wait for the reader.
        @Override
        InputStream input() {
            return new InputStream() {
                @Override
                public int read() throws IOException {
                    byte[] one = new byte[1];
                    return read(one, 0, 1) < 0 ? -1 : one[0] & 0xff;
                }

                @Override
                public int read(byte[] into, int at, int most) throws IOException {
                    return most == 0 ? 0 : channel.read(ByteBuffer.wrap(into, at, most));
                }
            };
        }

        @Override
        void write(byte[] bytes, int size) throws IOException {
            ByteBuffer left = ByteBuffer.wrap(bytes, 0, size);
            while (left.hasRemaining()) channel.write(left);
        }

        @Override
        void setTimeout(int millis) {} // a server on this machine answers

        @Override
        public void close() throws IOException {
            channel.close();
        }
    }
}
