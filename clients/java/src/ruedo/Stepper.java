package ruedo;

import ruedo.lcmtypes.channel_info_t;
import ruedo.lcmtypes.grant_command_t;
import ruedo.lcmtypes.grant_reply_t;
import ruedo.lcmtypes.grant_request_t;
import ruedo.lcmtypes.name_request_t;
import ruedo.lcmtypes.reply_t;
import ruedo.lcmtypes.request_t;
import ruedo.lcmtypes.resend_reply_t;
import ruedo.lcmtypes.resend_request_t;
import ruedo.lcmtypes.resend_wanted_t;
import ruedo.lcmtypes.tick_t;

import java.io.IOException;
import java.util.ArrayDeque;
import java.util.ArrayList;
import java.util.Iterator;
import java.util.List;
import java.util.TreeMap;
import java.util.zip.CRC32;

/**
 * The client's side of lockstep: grants, and the messages of every step, whatever is lost on the
 * way. The receiving thread puts ticks and messages together; the caller of step() grants, waits,
 * and asks again.
 */
final class Stepper {
    private static final long FIRST_REPEAT_MILLIS = 5;
    private static final long LAST_REPEAT_MILLIS = 100;
    private static final long ACKNOWLEDGED_TOGETHER = 32; // steps
    private static final int MOST_WANTED = 256; // messages requested at once
    private static final int MOST_EARLY = 512; // messages of one channel that wait for their ticks
    private static final long MOST_EARLY_BYTES = // no server continues with so much unheard
            Math.min(256 << 20, Runtime.getRuntime().maxMemory() / 4);
    private static final int MOST_CHANNELS = 1 << 16; // more cannot be subscribed
    private static final int MOST_PARTS = 1024; // of a tick
    private static final long MOST_LISTED = 1 << 20; // messages: 160 steps of a fleet
    private static final long MOST_AHEAD = 1024; // steps beyond what is here: no server is that far
    private static final long FURTHEST = Long.MAX_VALUE / 2; // steps
    private static final int DOUBTED_AFTER = 20; // silences in a row: 1.7 s and more

    /** Of a manifest. */
    private static final class Entry {
        int channel;
        long sequence;
        int size;
        int crc;
        byte[] data = {}; // as much as is here
        boolean here;
    }

    private static final class Step {
        long utime;
        long stateHash;
        int missing;
        int partsHere;
        List<List<Entry>> parts = new ArrayList<>(); // null where one is missing

        boolean complete() {
            return missing == 0 && partsHere == parts.size();
        }
    }

    /** A message whose tick has not come yet. */
    private static final class Early {
        final long utime;
        final int crc;
        final byte[] data;

        Early(long utime, int crc, byte[] data) {
            this.utime = utime;
            this.crc = crc;
            this.data = data;
        }
    }

    private final Simulation sim;
    private final Session session;
    // All under this object's monitor.
    private boolean part; // takes part
    private WorldInfo info; // whose channels are subscribed
    private final List<String> names =
            new ArrayList<>(); // of what is subscribed, by the channel's index; "": not
    private final ChannelNames channelNames = new ChannelNames(); // of the state being collected
    private final List<Subscription> sources = new ArrayList<>();
    private long runId;
    private int epoch;
    private long granted;
    private long have = -1; // all of the states up to that one are here
    private long acknowledged = -1;
    private long newest = -1;
    private long wantedUntil = -1;
    private long[] last = {0, -1, 0}; // utime, step and hash of what was collected
    private long grantSequence; // the grant under way
    private long grantFrom = -1;
    private byte[] grantBody = {};
    private boolean taken = true;
    private long resends;
    private final TreeMap<Long, Step> steps = new TreeMap<>(); // those not collected yet
    private long listed; // messages in the manifests of those not here
    private final List<ArrayDeque<Early>> early = new ArrayList<>(); // of each channel
    private long earlyBytes; // of all
    private String waitsFor = "";
    private RuedoException fault;
    private boolean askNow; // without waiting for a silence

    Stepper(Simulation sim, Session session) {
        this.sim = sim;
        this.session = session;
    }

    /** Its caller runs the callbacks of arrived messages, before it returns. */
    Observations step(long n, List<Command> commands, double timeout) {
        if (n < 0) throw new IllegalArgumentException("n is " + n + ": it must be at least 0");
        for (Command command : commands) {
            if (command.after >= 0 && command.after < n) continue;
            throw new IllegalArgumentException(
                    "a command is for "
                            + command.after
                            + " steps on; of "
                            + n
                            + " steps 0 to "
                            + (n - 1)
                            + " is allowed");
        }
        sim.checkMayWait();
        sim.callbacks.borrow();
        try {
            return stepInTurn(n, commands, timeout);
        } finally {
            sim.bus.awaitHandlers(); // which put them into the queue
            sim.callbacks.drain();
        }
    }

    private Observations stepInTurn(long n, List<Command> commands, double timeout) {
        synchronized (session) { // its turn: other requests wait
            sim.checkOpen();
            if (!takesPart()) {
                takePart(timeout);
                if (n == 0 && have >= 0) look(timeout);
            }
            synchronized (this) {
                await(have, timeout); // for nothing, unless the call before gave up
                long until = n > Long.MAX_VALUE - granted ? Long.MAX_VALUE : granted + n;
                if (n > 0) {
                    byte[] body = body(until, commands);
                    Session.checkSize(body); // before anything is granted
                    grantBody = body;
                    grantSequence = session.nextSequence();
                    grantFrom = granted;
                    granted = until;
                    acknowledged = have; // the grant says it
                    taken = false;
                    grantAgain();
                }
                await(until, timeout);
            }
            if (early.size() > info.channelList.size()
                    || info != sim.info()) { // a model came on the way
                if (early.size() > sim.info().channelList.size()) sim.refreshInfo();
                subscribe();
            }
            return collect();
        }
    }

    /** The clients whose grants the run waits for, as far as this client knows. */
    synchronized String whoseTurn() {
        String name = session.name();
        if (!part) {
            return "in lockstep the clients that take part grant each step, and this one, '"
                    + name
                    + "', does not: step() takes part";
        }
        return have < wantedUntil && !waitsFor.isEmpty()
                ? "in lockstep it waits for " + waitsFor
                : "in lockstep it waits for the next step() of this client, '" + name + "'";
    }

    /** The client has reset the world: the next step joins again. */
    synchronized void forget() {
        part = false;
    }

    private synchronized boolean takesPart() {
        if (part) checkRun();
        return part;
    }

    private void checkRun() {
        if (sim.info().head.run_id == runId) return;
        part = false;
        throw new RuedoException.NoServer(
                "the run that this client took part in has ended; another is at "
                        + sim.url
                        + " now");
    }

    private void takePart(double timeout) {
        subscribe();
        grant_request_t body = new grant_request_t();
        body.granted = -1;
        body.received = -1;
        body.commands = new grant_command_t[0];
        reply_t reply = session.request(request_t.GRANT, body, timeout);
        synchronized (this) {
            try {
                WireReader in = new WireReader(reply.body);
                if (in.int64() != grant_reply_t.LCM_FINGERPRINT)
                    throw new IOException("another version of the type");
                granted = in.int64();
                have = in.int64();
                newest = in.int64();
                if (granted < 0 || granted > FURTHEST || have < -1 || have > granted)
                    throw new IOException("impossible steps");
            } catch (IOException error) {
                throw new RuedoException.TypeMismatch(
                        "the reply to GRANT is not a grant_reply_t of this client's version");
            }
            runId = sim.info().head.run_id;
            epoch = reply.epoch;
            acknowledged = have;
            steps.clear();
            listed = 0;
            grantBody = new byte[0];
            grantFrom = -1;
            taken = true;
            fault = null;
            channelNames.begin(sim.info());
            waitsFor = "";
            part = true;
        }
    }

    /** Reads the current state, for a client that joins later and grants nothing. */
    private void look(double timeout) {
        name_request_t body = new name_request_t();
        body.name = "";
        State state = Decoders.stateOf(session.request(request_t.GET_STATE, body, timeout));
        synchronized (this) {
            last = new long[] {state.utime, state.step, state.stateHash};
        }
    }

    /** Subscribes to all that the simulation publishes: a manifest may name any of it. */
    private void subscribe() {
        WorldInfo found = sim.info();
        if (info == found) return;
        for (int i = 0; i < found.channelList.size(); i++) {
            channel_info_t channel = found.channelList.get(i);
            synchronized (this) {
                if (early.size() == i) early.add(new ArrayDeque<>());
            }
            String wanted =
                    channel.input
                                    || (channel.robot.isEmpty()
                                            && !channel.type.equals("world_state_t"))
                            ? ""
                            : channel.name;
            if (names.size() == i) {
                names.add("");
                sources.add(null);
            }
            if (names.get(i).equals(wanted)) continue;
            if (sources.get(i) != null) sources.get(i).close();
            int index = i;
            names.set(i, wanted);
            sources.set(
                    i,
                    wanted.isEmpty()
                            ? null
                            : sim.bus.subscribe(
                                    wanted, (byte[] message) -> onMessage(index, message)));
        }
        for (int i = names.size() - 1; i >= found.channelList.size(); i--) {
            if (sources.get(i) != null) sources.get(i).close();
            names.remove(i);
            sources.remove(i);
        }
        info = found;
    }

    private byte[] body(long until, List<Command> commands) {
        grant_request_t body = new grant_request_t();
        body.granted = granted;
        body.step_until = until;
        body.received = have;
        body.ncommands = commands.size();
        body.commands = new grant_command_t[commands.size()];
        for (int i = 0; i < body.ncommands; i++) {
            Command command = commands.get(i);
            grant_command_t sent = new grant_command_t();
            sent.step = granted + command.after;
            sent.channel = command.channel;
            sent.size = command.data.length;
            sent.data = command.data;
            body.commands[i] = sent;
        }
        return Bus.encode(body);
    }

    /**
     * Until the states up to `until` are here with all their messages. After a silence the grant,
     * or the request for what is missing, goes out again, sooner at first.
     */
    private void await(long until, double timeout) {
        long repeat = FIRST_REPEAT_MILLIS;
        int silences = 0;
        Deadline deadline = new Deadline(timeout);
        wantedUntil = until;
        while (have < until || !taken) {
            sim.checkOpen();
            long had = have;
            long quietAt = System.nanoTime() + repeat * 1_000_000;
            Deadline never = new Deadline(Double.POSITIVE_INFINITY);
            long left = repeat;
            while (left > 0
                    && !(have >= until && taken)
                    && fault == null
                    && !askNow
                    && have - acknowledged < ACKNOWLEDGED_TOGETHER) {
                never.waitOn(this, left);
                left = (quietAt - System.nanoTime() + 999_999) / 1_000_000;
            }
            if (fault != null) {
                RuedoException thrown = fault;
                fault = null;
                part = false;
                throw thrown;
            }
            if (have >= until && taken) return;
            boolean silence = left <= 0 && have == had;
            silences = silence ? silences + 1 : 0;
            if (silences == DOUBTED_AFTER) {
                silences = 0;
                doubt();
            }
            if (!taken && silence) {
                grantAgain();
            } else if (taken && (silence || askNow)) {
                askForLost(until);
            } else if (have - acknowledged >= ACKNOWLEDGED_TOGETHER) {
                askForLost(have); // for nothing: it says what is here
            }
            askNow = false;
            repeat = silence ? Math.min(2 * repeat, LAST_REPEAT_MILLIS) : FIRST_REPEAT_MILLIS;
            if (have > had) {
                deadline = new Deadline(timeout);
            } else if (silence) {
                sim.checkServer();
                checkRun();
                if (!deadline.passed()) continue;
                throw new RuedoException.Timeout(
                        "step "
                                + (have + 1)
                                + " did not come within "
                                + Deadline.text(timeout)
                                + " s"
                                + (waitsFor.isEmpty() ? "" : ": the run waits for " + waitsFor));
            }
        }
    }

    /**
     * Some of the messages since the last complete step may not be the server's: all are requested
     * again.
     */
    private void doubt() {
        forgetSteps();
        newest = have;
        taken = grantBody.length == 0;
    }

    /** Forgets incomplete steps, which are requested again. */
    private void forgetSteps() {
        steps.tailMap(have, false).clear();
        listed = 0;
    }

    private void grantAgain() {
        session.publish(request_t.GRANT, session.id(), grantSequence, grantBody, epoch);
    }

    private void askForLost(long until) {
        acknowledged = have;
        List<resend_wanted_t> wanted = new ArrayList<>();
        long to = Math.min(until, Math.max(newest, have + 1));
        for (long number = have + 1; number <= to && wanted.size() < MOST_WANTED; number++) {
            Step step = steps.get(number);
            if (step == null) {
                wanted.add(wanted(number, info.tickChannel, 0, 0));
                continue;
            }
            for (int i = 0; i < step.parts.size(); i++) {
                if (step.parts.get(i) == null) {
                    wanted.add(wanted(number, info.tickChannel, i, 0));
                    continue;
                }
                for (Entry entry : step.parts.get(i)) {
                    if (!entry.here)
                        wanted.add(
                                wanted(number, entry.channel, entry.sequence, entry.data.length));
                }
            }
        }
        if (wanted.size() > MOST_WANTED)
            wanted = wanted.subList(0, MOST_WANTED); // the rest when these have come
        resend_request_t body = new resend_request_t();
        body.received = have;
        body.nwanted = wanted.size();
        body.wanted = wanted.toArray(new resend_wanted_t[0]);
        session.publish(request_t.RESEND, session.id(), ++resends, Bus.encode(body), epoch);
    }

    private static resend_wanted_t wanted(long step, int channel, long sequence, int offset) {
        resend_wanted_t wanted = new resend_wanted_t();
        wanted.step = step;
        wanted.channel_index = channel;
        wanted.sequence = sequence;
        wanted.offset = offset;
        return wanted;
    }

    private synchronized Observations collect() {
        List<Observations.Message> messages = new ArrayList<>();
        for (Iterator<java.util.Map.Entry<Long, Step>> all =
                        steps.headMap(have, true).entrySet().iterator();
                all.hasNext();
                all.remove()) {
            java.util.Map.Entry<Long, Step> next = all.next();
            Step step = next.getValue();
            last = new long[] {step.utime, next.getKey(), step.stateHash};
            channelNames.goTo(step.utime);
            for (List<Entry> entries : step.parts) {
                for (Entry entry : entries) {
                    String name = channelNames.of(entry.channel);
                    messages.add(new Observations.Message(next.getKey(), name, entry.data));
                }
            }
        }
        return new Observations(last[0], last[1], last[2], messages);
    }

    // Putting ticks and messages together, as they come: in any order, twice, or not at all.

    private static int crc(byte[] data) {
        CRC32 crc = new CRC32();
        crc.update(data);
        return (int) crc.getValue();
    }

    private synchronized void onMessage(int channel, byte[] data) {
        if (!part || data.length < 16) return;
        int crc = crc(data);
        for (Step step : steps.values()) { // a tick may come before its messages
            if (step.missing == 0) continue;
            for (List<Entry> entries : step.parts) {
                if (entries == null) continue;
                for (Entry entry : entries) {
                    if (entry.here
                            || entry.channel != channel
                            || entry.crc != crc
                            || entry.size != data.length) continue;
                    entry.data = data;
                    entry.here = true;
                    step.missing--;
                    progress();
                    return;
                }
            }
        }
        ArrayDeque<Early> queue = early.get(channel);
        if (queue.size() == MOST_EARLY) forgetFirst(queue);
        queue.addLast(new Early(java.nio.ByteBuffer.wrap(data).getLong(8), crc, data));
        earlyBytes += data.length;
        if (earlyBytes <= MOST_EARLY_BYTES) return;
        for (ArrayDeque<Early> all : early) all.clear(); // missing messages are requested
        earlyBytes = 0;
    }

    private void forgetFirst(ArrayDeque<Early> queue) {
        earlyBytes -= queue.removeFirst().data.length;
    }

    synchronized void onInfo(WorldInfo info) {
        if (part) channelNames.change(info);
    }

    synchronized void onTick(byte[] message) {
        try {
            if (part) takeTick(message);
        } catch (IOException error) {
            // broken: it is requested again
        }
    }

    private void takeTick(byte[] message) throws IOException {
        WireReader in = new WireReader(message);
        if (in.int64() != tick_t.LCM_FINGERPRINT) return;
        long utime = in.int64();
        long run = in.int64();
        int tickEpoch = in.int32();
        long number = in.int64();
        long hash = in.int64();
        int index = in.int16();
        int nparts = in.int16();
        if (run != runId || index < 0 || index >= nparts || nparts > MOST_PARTS) return;
        if (tickEpoch != epoch) {
            onOtherEpoch(tickEpoch);
            return;
        }
        newest = Math.max(newest, number);
        for (int n = in.count(13);
                n > 0;
                n--) { // applied: only this says that the grant was executed
            boolean mine = in.string().equals(session.name());
            if (in.int64() >= grantSequence && mine && number > grantFrom) taken = true;
        }
        if (number <= have || number > have + MOST_AHEAD) return;
        Step step = steps.computeIfAbsent(number, key -> new Step());
        if (step.parts.isEmpty()) {
            step.parts.addAll(java.util.Collections.nCopies(nparts, null));
            step.utime = utime;
            step.stateHash = hash;
        }
        if (step.parts.size() != nparts || step.parts.get(index) != null) return;
        List<Entry> entries = new ArrayList<>();
        int missing = 0;
        for (int n = in.count(20); n > 0; n--) {
            Entry entry = readEntry(in);
            if (!entry.here) missing++;
            entries.add(entry);
        }
        step.parts.set(index, entries);
        step.missing += missing;
        step.partsHere++;
        listed += entries.size();
        if (listed > MOST_LISTED) forgetSteps();
        progress();
    }

    private void onOtherEpoch(int other) {
        if (other > epoch && fault == null) {
            fault =
                    new RuedoException(
                            "the world was reset by another client: the next step begins anew");
        }
        notifyAll();
    }

    /** A message of a step; it may have come before the tick that lists it. */
    private Entry readEntry(WireReader in) throws IOException {
        Entry entry = new Entry();
        entry.channel = in.int32();
        entry.sequence = in.int64();
        entry.size = in.int32();
        entry.crc = in.int32();
        if (entry.channel < 0 || entry.channel >= MOST_CHANNELS || entry.size < 0)
            throw new IOException("no message");
        while (entry.channel >= early.size())
            early.add(new ArrayDeque<>()); // of a model that came since
        Iterator<Early> all = early.get(entry.channel).iterator();
        while (all.hasNext() && !entry.here) {
            Early one = all.next();
            if (one.crc != entry.crc || one.data.length != entry.size) continue;
            entry.data = one.data;
            entry.here = true;
            earlyBytes -= one.data.length;
            all.remove();
        }
        return entry;
    }

    private void progress() {
        for (Step step = steps.get(have + 1);
                step != null && step.complete();
                step = steps.get(have + 1)) {
            have++;
            for (List<Entry> entries : step.parts) {
                listed -= entries.size();
                for (Entry entry : entries) { // what is left of the time before came twice
                    ArrayDeque<Early> queue = early.get(entry.channel);
                    while (!queue.isEmpty() && queue.peekFirst().utime <= step.utime)
                        forgetFirst(queue);
                }
            }
        }
        if (have >= wantedUntil || have - acknowledged >= ACKNOWLEDGED_TOGETHER) notifyAll();
    }

    /** Handles a reply to GRANT or RESEND. */
    synchronized void onReply(reply_t reply) {
        if (!part) return;
        boolean granting = reply.kind == request_t.GRANT;
        if (reply.code != reply_t.OK) {
            if (reply.sequence != (granting ? grantSequence : resends) || (granting && taken))
                return;
            if (fault == null) fault = faultOf(reply);
        } else if (!granting) {
            try {
                takePieces(new WireReader(reply.body));
            } catch (IOException error) {
                return; // broken: it is requested again
            }
        } else if (reply.sequence == grantSequence && !taken) {
            taken = true; // it was repeated: its ticks may be lost
            askNow = true;
        }
        notifyAll();
    }

    private void takePieces(WireReader in) throws IOException {
        if (in.int64() != resend_reply_t.LCM_FINGERPRINT)
            throw new IOException("another version of the type");
        newest = Math.max(newest, in.int64());
        waitsFor = in.text();
        int count = in.count(32);
        List<byte[]> ticks = new ArrayList<>();
        for (int n = count; n > 0; n--) {
            Step step = steps.get(in.int64());
            int channel = in.int32();
            long sequence = in.int64();
            in.int32(); // total
            int offset = in.int32();
            byte[] piece = in.bytes(in.count(1));
            if (channel == info.tickChannel) {
                ticks.add(piece);
            } else if (step != null) {
                addPiece(step, channel, sequence, offset, piece);
            }
        }
        for (byte[] tick : ticks) takeTick(tick);
        progress();
        askNow = count > 0; // more may be missing than goes into one reply
    }

    private static void addPiece(Step step, int channel, long sequence, int offset, byte[] piece) {
        for (List<Entry> entries : step.parts) {
            if (entries == null) continue;
            for (Entry entry : entries) {
                if (entry.here
                        || entry.channel != channel
                        || entry.sequence != sequence
                        || entry.data.length != offset) continue;
                if (piece.length > entry.size - offset) continue;
                byte[] longer = java.util.Arrays.copyOf(entry.data, offset + piece.length);
                System.arraycopy(piece, 0, longer, offset, piece.length);
                entry.data = longer;
                if (longer.length < entry.size) continue;
                if (crc(longer) == entry.crc) {
                    entry.here = true;
                    step.missing--;
                } else {
                    entry.data = new byte[0]; // from the start again
                }
            }
        }
    }

    private static RuedoException faultOf(reply_t reply) {
        String text = (reply.kind == request_t.GRANT ? "GRANT: " : "RESEND: ") + reply.text;
        if (reply.code == reply_t.UNKNOWN_SESSION)
            return new RuedoException.LeaseLost(text, reply.code);
        if (reply.code == reply_t.ENDED) return new RuedoException.RunEnded(text);
        if (reply.code == reply_t.WRONG_RUN || reply.code == reply_t.REFUSED)
            return new RuedoException.NoServer(text);
        return new RuedoException.RequestError(text, reply.code);
    }
}
