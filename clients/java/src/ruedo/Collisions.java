package ruedo;

import java.util.List;

/** What a robot runs into: with what neither carries it nor lies on it. */
public final class Collisions extends Sample {
    /** The body that blocks what it was told to do; "": nothing does. */
    public final String blockedBy;

    /** Where; empty: nothing is touched. */
    public final List<Contact.Point> points;

    Collisions(long utime, String blockedBy, List<Contact.Point> points) {
        super(utime);
        this.blockedBy = blockedBy;
        this.points = points;
    }
}
