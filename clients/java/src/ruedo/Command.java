package ruedo;

/**
 * A command for {@link Simulation#step(long, java.util.List)}, from {@link Robot#velocityCommand}
 * and its like.
 */
public final class Command {
    /** One of the command channels of ruedo/info. */
    public final String channel;

    /** Number of steps from the call's first state to the one that it acts on. */
    public final long after;

    final byte[] data;

    /** data: the encoded message. */
    public Command(String channel, byte[] data) {
        this(channel, data, 0);
    }

    private Command(String channel, byte[] data, long after) {
        this.channel = channel;
        this.data = data;
        this.after = after;
    }

    /** The same, for the state so many steps on. */
    public Command at(long steps) {
        return new Command(channel, data, steps);
    }
}
