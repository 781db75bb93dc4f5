package ruedo;

import ruedo.lcmtypes.channel_info_t;

import java.util.ArrayDeque;
import java.util.ArrayList;
import java.util.List;

/**
 * The names of the channels while robots come and go, and others take their places: as they are in
 * each of the states that a client in lockstep collects, one after the other. Of more than 16 MB of
 * changes since the last one, the oldest count as made: a server may send ever new ones.
 */
final class ChannelNames {
    private static final long MOST_BYTES = 16 << 20; // of the changes
    private static final int CHANGE_BYTES = 100; // of one without its name

    private static final class Change {
        final long utime; // us, holds after it
        final int channel;
        final String name;

        Change(long utime, int channel, String name) {
            this.utime = utime;
            this.channel = channel;
            this.name = name;
        }

        int bytes() {
            return CHANGE_BYTES + name.length();
        }
    }

    private List<String> names = new ArrayList<>(); // by the channel's index
    private List<String> newest = new ArrayList<>(); // likewise, when all changes are made
    private long newestUtime;
    private final ArrayDeque<Change> changes = new ArrayDeque<>();
    private long bytes; // that they take

    /** Forgets everything. */
    void begin(WorldInfo info) {
        names = namesOf(info);
        newest = namesOf(info);
        newestUtime = info.head.utime;
        changes.clear();
        bytes = 0;
    }

    /** From the states after its utime on. */
    void change(WorldInfo info) {
        if (info.head.utime < newestUtime) return; // on its way for longer than the next one
        newestUtime = info.head.utime;
        List<String> before = newest;
        newest = namesOf(info);
        for (int i = 0; i < newest.size(); i++) {
            if (newest.get(i).equals(i < before.size() ? before.get(i) : "")) continue;
            Change change = new Change(newestUtime, i, newest.get(i));
            bytes += change.bytes();
            changes.addLast(change);
        }
        while (bytes > MOST_BYTES) makeFirst();
    }

    /** The state of that time, us; never backwards. */
    void goTo(long utime) {
        while (!changes.isEmpty() && changes.getFirst().utime < utime) makeFirst();
    }

    /**
     * The channel's name in that state. If the info from before it was lost, its next name; ""
     * without one.
     */
    String of(int channel) {
        if (channel < names.size() && !names.get(channel).isEmpty()) return names.get(channel);
        for (Change change : changes)
            if (change.channel == channel && !change.name.isEmpty()) return change.name;
        return "";
    }

    private void makeFirst() {
        Change first = changes.removeFirst();
        bytes -= first.bytes();
        while (names.size() <= first.channel) names.add("");
        names.set(first.channel, first.name);
    }

    private static List<String> namesOf(WorldInfo info) {
        List<String> names = new ArrayList<>();
        for (channel_info_t channel : info.channelList) names.add(channel.name);
        return names;
    }
}
