package ruedo;

import java.util.function.LongConsumer;

/**
 * Which run a client belongs to, where those of several servers are heard. A client stays with its
 * run for as long as that is heard: what else is heard meanwhile is another server, at the same
 * address. Only when nothing more comes of its own run has the other one taken its place. Until it
 * shows which, samples may be of either run. For the receiving thread alone, but for another().
 */
final class RunWatch {
    private static final long GONE_NANOS = 1_500_000_000; // a server gives a sign each second
    private static final int RETURNS = 3; // one may be a datagram that was late

    private final LongConsumer say;
    private volatile boolean another;
    private long since; // when the first of them was heard
    private long otherId;
    private int returns;

    /** say: called once for each run of the client, with the id of a run beside it. */
    RunWatch(LongConsumer say) {
        this.say = say;
    }

    /** The client has a new run. */
    void begin() {
        another = false;
        returns = 0;
    }

    void hearOwn() {
        if (!another) return;
        another = false;
        if (++returns == RETURNS) say.accept(otherId);
    }

    /** Whether the client's own run is over. */
    boolean hearAnother(long runId) {
        long now = System.nanoTime();
        if (!another) {
            since = now;
            otherId = runId;
            another = true;
        }
        return now - since >= GONE_NANOS;
    }

    /** The other run may be the next one of this client's. */
    boolean inDoubt() {
        return another && returns < RETURNS;
    }

    /** The last message was of another run. From any thread. */
    boolean another() {
        return another;
    }
}
