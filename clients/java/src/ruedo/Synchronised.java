package ruedo;

/**
 * Samples of two streams, joined by stamp, from {@link Simulation#synchronised}.
 *
 * @param <A> kind of the first stream's samples
 * @param <B> kind of the second's
 */
public final class Synchronised<A, B> {
    /** Of the stream that paces the loop. */
    public final A first;

    /** Of the other stream, at the first one's time. */
    public final B second;

    Synchronised(A first, B second) {
        this.first = first;
        this.second = second;
    }
}
