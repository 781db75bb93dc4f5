package ruedo;

/**
 * A set of links that do not move against each other, from {@link Simulation#bodies}; or a model,
 * from {@link Simulation#body}. pose() and its like send a request, and throw its exceptions.
 */
public final class Body {
    /** MODEL/LINK, or MODEL. */
    public final String name;

    /** Whether it never moves. */
    public final boolean isStatic;

    /** kg; 0 of a body that never moves. */
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

    /** The current pose in the world. */
    public Transform pose() {
        State state = sim.state(name);
        return new Transform(state.position, state.orientation);
    }

    /** The current twist in the world. */
    public Twist twist() {
        State state = sim.state(name);
        return new Twist(state.linear, state.angular);
    }

    /** Sets the model's pose in the world, at rest. */
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
