package ruedo;

import static java.nio.charset.StandardCharsets.UTF_8;

import ruedo.lcmtypes.Message;
import ruedo.lcmtypes.join_t;
import ruedo.lcmtypes.reply_t;
import ruedo.lcmtypes.request_t;

import java.io.IOException;
import java.lang.reflect.Field;
import java.lang.reflect.Modifier;
import java.security.SecureRandom;
import java.util.HashMap;
import java.util.Map;
import java.util.concurrent.CountDownLatch;
import java.util.concurrent.atomic.AtomicBoolean;
import java.util.concurrent.atomic.AtomicLong;

/**
 * A client's session with the server: requests are repeated until they are answered, and executed
 * once.
 */
final class Session {
    static final String REQUEST_CHANNEL = "ruedo/request";
    private static final long REPEAT_MILLIS = 100;
    private static final int MOST_LEAVES = 5; // that are sent: for half a second in all
    private static final long AT_EXIT_MILLIS = 3000; // that the program's end waits for LEAVE
    private static final int MOST_NAME = 63; // bytes of UTF-8
    private static final int HEAD = 52; // bytes of a request_t without a body
    private static final Map<Integer, String> KINDS = kinds();

    private final Simulation sim;
    private final String name;
    private final Object news = new Object();
    private volatile long runId; // changed under this object's monitor
    private final AtomicLong sequence = new AtomicLong(); // likewise, or by leave()
    private volatile long session;
    private int awaitedKind; // these under news; 0: none
    private long awaitedSequence;
    private reply_t reply;
    private boolean left; // a LEAVE was answered
    private Thread atExit; // since the first JOIN
    private final AtomicBoolean leaving = new AtomicBoolean();
    private final CountDownLatch gone = new CountDownLatch(1);

    Session(Simulation sim, String name) {
        int size = name.length() > MOST_NAME ? MOST_NAME + 1 : name.getBytes(UTF_8).length;
        if (size == 0 || size > MOST_NAME || WireReader.hasControl(name))
            throw new IllegalArgumentException(
                    "the name '"
                            + WireReader.printed(name.substring(0, Math.min(size, MOST_NAME)))
                            + "': a client's has 1 to 63 bytes of UTF-8, without control"
                            + " characters");
        this.sim = sim;
        this.name = name;
    }

    /** Joins on the first request. body: null for none. timeout: s of real time. */
    reply_t request(int kind, Message body, double timeout) {
        sim.checkMayWait();
        return requestInTurn(kind, body, timeout);
    }

    private synchronized reply_t requestInTurn(int kind, Message body, double timeout) {
        sim.checkOpen();
        WorldInfo info = sim.info();
        if (!info.supports(kind)) {
            throw new RuedoException.NotSupported(
                    "this server (Ruedo "
                            + info.head.version
                            + ") has no "
                            + name(kind)
                            + " request");
        }
        byte[] encoded = encoded(kind, body);
        for (int attempt = 1; ; attempt++) {
            if (session == 0 || runId != info.head.run_id) {
                runId = info.head.run_id;
                join(timeout);
            }
            reply_t answer = exchange(kind, session, sequence.incrementAndGet(), encoded, timeout);
            if (answer.code != reply_t.UNKNOWN_SESSION || attempt == 2) return checked(answer);
            session = 0; // its place went to another: join again
        }
    }

    private static byte[] encoded(int kind, Message body) {
        try {
            return body == null ? new byte[0] : Bus.encode(body);
        } catch (NullPointerException | ArrayIndexOutOfBoundsException error) {
            throw new IllegalArgumentException(
                    name(kind) + ": an argument is null, or an array has too few numbers", error);
        }
    }

    /** Throws RuedoException for a request that no server would take. */
    static void checkSize(byte[] body) {
        Bus.checkSize(REQUEST_CHANNEL, HEAD + body.length);
    }

    /**
     * Gives the session back; at the program's end, too. Others would wait for a client in lockstep
     * whose LEAVE was lost: it is repeated until it is answered, but a few times only, since the
     * server may be gone. Times are counted, not seconds: in a second without a processor one alone
     * would go out. This object's monitor is not waited for: who has it may be what ends the
     * program, or wait for a server for ever.
     */
    void leave() {
        if (session == 0) return;
        if (leaving.getAndSet(true)) {
            Uninterrupted.get(this::awaitGone);
            return;
        }
        try {
            repeatLeave();
        } finally {
            session = 0;
            gone.countDown();
            ProgramEnd.waitsNoMoreFor(atExit);
        }
    }

    /** For a moment: to a server that is stopped, a send may take for ever. */
    private void leaveAtExit() {
        Thread thread = new Thread(this::leave, "ruedo-leave");
        thread.setDaemon(true);
        thread.start();
        Uninterrupted.get(
                () -> {
                    thread.join(AT_EXIT_MILLIS);
                    return true;
                });
    }

    private void repeatLeave() {
        long number = sequence.incrementAndGet();
        synchronized (news) {
            for (int sent = 0; sent < MOST_LEAVES; ++sent) {
                send(request_t.LEAVE, session, number, new byte[0], -1);
                new Deadline(Double.POSITIVE_INFINITY).waitOn(news, REPEAT_MILLIS);
                if (left || sim.serverHasEnded()) return;
            }
        }
    }

    private boolean awaitGone() throws InterruptedException {
        gone.await();
        return true;
    }

    /** A message of ruedo/reply. */
    void receive(byte[] message) {
        reply_t received = new reply_t();
        try {
            WireReader in = new WireReader(message);
            if (in.int64() != reply_t.LCM_FINGERPRINT) return;
            in.int64(); // utime
            if (!sim.isOfOurRun(in.int64(), false)) return; // another server's, which was not asked
            received.epoch = in.int32();
            received.session = in.int64();
            received.sequence = in.int64();
            received.kind = in.int32();
            received.code = in.int32();
            received.text = in.text();
            received.body = in.bytes(in.count(1));
        } catch (IOException error) {
            return;
        }
        if (received.code == reply_t.ENDED && received.session == 0) { // without a request
            sim.noteEnd(received.text);
            return;
        }
        synchronized (news) {
            boolean ours = received.kind == request_t.JOIN || received.session == session;
            if (!ours) return;
            if (received.kind == request_t.LEAVE) {
                left = true;
                news.notifyAll();
                return;
            }
            if (received.kind == awaitedKind && received.sequence == awaitedSequence) {
                reply = received;
                news.notifyAll();
                return;
            }
        }
        if (received.kind == request_t.GRANT || received.kind == request_t.RESEND)
            sim.stepper().onReply(received);
    }

    private void join(double timeout) {
        join_t body = new join_t();
        body.client = name;
        long number = (new SecureRandom().nextLong() >>> 2) + 1;
        reply_t answer = checked(exchange(request_t.JOIN, 0, number, Bus.encode(body), timeout));
        if (atExit == null) {
            atExit = new Thread(this::leaveAtExit);
            ProgramEnd.waitsFor(atExit);
        }
        sequence.set(0);
        session = answer.session;
    }

    private reply_t exchange(int kind, long toSession, long number, byte[] body, double timeout) {
        Deadline deadline = new Deadline(timeout);
        synchronized (news) {
            awaitedKind = kind;
            awaitedSequence = number;
            reply = null;
        }
        try {
            while (true) {
                if (sim.info().head.run_id != runId) {
                    throw new RuedoException.RequestError(
                            name(kind) + ": another run has begun meanwhile", reply_t.WRONG_RUN);
                }
                if (deadline.passed()) {
                    throw new RuedoException.Timeout(
                            "no reply to "
                                    + name(kind)
                                    + " on ruedo/reply within "
                                    + Deadline.text(timeout)
                                    + " s");
                }
                // Not under the lock: it may take long, and the receiving thread continues.
                publish(kind, toSession, number, body);
                reply_t answer;
                synchronized (news) {
                    if (reply == null) deadline.waitOn(news, REPEAT_MILLIS);
                    answer = reply;
                }
                sim.checkOpen();
                if (answer != null) return answer;
                sim.checkServer(); // the run may have ended since
            }
        } finally {
            synchronized (news) {
                awaitedKind = 0;
            }
        }
    }

    /** For grants, which have no replies. Under this object's monitor. */
    long nextSequence() {
        return sequence.incrementAndGet();
    }

    String name() {
        return name;
    }

    long id() {
        return session;
    }

    private void publish(int kind, long toSession, long number, byte[] body) {
        publish(kind, toSession, number, body, -1);
    }

    /** Sends nothing once this leaves: the reply would be an error. */
    void publish(int kind, long toSession, long number, byte[] body, int epoch) {
        if (!leaving.get()) send(kind, toSession, number, body, epoch);
    }

    private void send(int kind, long toSession, long number, byte[] body, int epoch) {
        request_t request = new request_t();
        request.utime = sim.clock.utime();
        request.run_id = runId;
        request.epoch = epoch;
        request.session = toSession;
        request.sequence = number;
        request.kind = kind;
        request.size = body.length;
        request.body = body;
        sim.bus.publish(REQUEST_CHANNEL, request);
    }

    private static String name(int kind) {
        return KINDS.getOrDefault(kind, Integer.toString(kind));
    }

    private static Map<Integer, String> kinds() {
        Map<Integer, String> names = new HashMap<>();
        try {
            for (Field field : request_t.class.getFields()) {
                if (field.getType() == int.class && Modifier.isFinal(field.getModifiers()))
                    names.put(field.getInt(null), field.getName());
            }
        } catch (IllegalAccessException error) {
            throw new AssertionError(error); // they are public
        }
        return names;
    }

    private static reply_t checked(reply_t reply) {
        if (reply.code == reply_t.OK) return reply;
        String kind = name(reply.kind);
        String text =
                kind
                        + ": "
                        + (reply.text.isEmpty() ? "refused with code " + reply.code : reply.text);
        if (reply.code == reply_t.ENDED) throw new RuedoException.RunEnded(text);
        if (reply.code == reply_t.NOT_SUPPORTED) throw new RuedoException.NotSupported(text);
        throw new RuedoException.RequestError(text, reply.code);
    }

    /** The content of a reply; type is the name of the body's. Throws TypeMismatch. */
    static <T> T body(reply_t reply, String type, long fingerprint, Conversions.Reader<T> reader) {
        try {
            WireReader in = new WireReader(reply.body);
            if (in.int64() != fingerprint) throw new IOException("another version of the type");
            return reader.read(in);
        } catch (IOException error) {
            throw new RuedoException.TypeMismatch(
                    "the reply's body is not a "
                            + type
                            + " of this client's version: "
                            + error.getMessage());
        }
    }
}
