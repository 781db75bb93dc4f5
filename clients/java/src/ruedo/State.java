package ruedo;

import ruedo.lcmtypes.reply_t;
import ruedo.lcmtypes.state_reply_t;

import java.io.IOException;

/**
 * The state of the simulation, and of the model or MODEL/LINK that was asked for (else name is "").
 */
public class State extends Sample {
    /** Number of the state. */
    public final long step;

    /** Of all bodies' and robots' state. */
    public final long stateHash;

    /** True when paused. */
    public final boolean paused;

    /** Sim time per real time that is asked for; +inf: as fast as it goes. */
    public final double rate;

    /** As asked for. */
    public final String name;

    /** m, world. */
    public final double[] position;

    /** w, x, y, z: to world. */
    public final double[] orientation;

    /** m/s, world. */
    public final double[] linear;

    /** rad/s, world. */
    public final double[] angular;

    State(
            long utime,
            long step,
            long stateHash,
            boolean paused,
            double rate,
            String name,
            double[] position,
            double[] orientation,
            double[] linear,
            double[] angular) {
        super(utime);
        this.step = step;
        this.stateHash = stateHash;
        this.paused = paused;
        this.rate = rate;
        this.name = name;
        this.position = position;
        this.orientation = orientation;
        this.linear = linear;
        this.angular = angular;
    }

    static State of(reply_t reply) {
        try {
            WireReader in = new WireReader(reply.body);
            if (in.int64() != state_reply_t.LCM_FINGERPRINT)
                throw new IOException("another version of the type");
            return new State(
                    in.int64(),
                    in.int64(),
                    in.int64(),
                    in.bool(),
                    in.float64(),
                    in.string(),
                    in.doubles(3),
                    in.doubles(4),
                    in.doubles(3),
                    in.doubles(3));
        } catch (IOException error) {
            throw new RuedoException.TypeMismatch(
                    "the reply's body is no state_reply_t of this client's version: "
                            + error.getMessage());
        }
    }
}
