package ruedo;

/**
 * A set of links that do not move against each other, from {@link Simulation#bodies}; or a model,
 * from {@link Simulation#body}. pose() and its like ask the server, and throw what a request does.
 */
public final class Body {
    /** MODEL/LINK, or MODEL. */
    public final String name;

    /** True when it never moves. */
    public final boolean isStatic;

    /** kg; 0 of what never moves. */
    public final double mass;

    private final Simulation sim; // null: in ruedo/info

    Body(String name, boolean isStatic, double mass) {
        this(null, name, isStatic, mass);
    }

    Body(Simulation sim, String name, boolean isStatic, double mass) {
        this.sim = sim;
        this.name = name;
        this.isStatic = isStatic;
        this.mass = mass;
    }

    /** In the world, as it is now. */
    public Transform pose() {
        State state = sim.state(name);
        return new Transform(state.position, state.orientation);
    }

    /** In the world, as it moves now. */
    public Twist twist() {
        State state = sim.state(name);
        return new Twist(state.linear, state.angular);
    }

    /** Puts the model somewhere in the world, at rest. */
    public void setPose(Transform pose) {
        sim.setPose(name, pose.position(), pose.orientation());
    }

    /** The same on the ground: m, m, rad. */
    public void setPose(double x, double y, double heading) {
        setPose(Transform.of(x, y, heading));
    }

    /** Gives the model a twist in the world. */
    public void setTwist(Twist twist) {
        sim.setTwist(name, twist.linear, twist.angular);
    }
}
