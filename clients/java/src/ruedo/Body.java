package ruedo;

/** A set of links that do not move against each other, as ruedo/info lists it. */
public final class Body {
    /** MODEL/LINK: what {@link Simulation#state(String)} takes. */
    public final String name;

    /** True when it never moves. */
    public final boolean isStatic;

    /** kg; 0 of what never moves. */
    public final double mass;

    Body(String name, boolean isStatic, double mass) {
        this.name = name;
        this.isStatic = isStatic;
        this.mass = mass;
    }
}
