package ruedo;

import java.util.Iterator;
import java.util.NoSuchElementException;
import java.util.function.Supplier;

/** Iterates over a call's results; ends when the call throws RunEnded. */
final class UntilRunEnds<T> implements Iterator<T> {
    private final Supplier<T> call;
    private T next; // null: it is not there yet
    private boolean ended;

    UntilRunEnds(Supplier<T> call) {
        this.call = call;
    }

    @Override
    public boolean hasNext() {
        if (next != null || ended) return !ended;
        try {
            next = call.get();
        } catch (RuedoException.RunEnded error) {
            ended = true;
        }
        return !ended;
    }

    @Override
    public T next() {
        if (!hasNext()) throw new NoSuchElementException("the run has ended");
        T given = next;
        next = null;
        return given;
    }
}
