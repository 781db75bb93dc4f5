package ruedo;

import java.util.ArrayDeque;
import java.util.HashMap;
import java.util.Map;

/**
 * Memory for fragments, which is used again: where each datagram left garbage, the heap would grow
 * to whatever the JVM may take before it collects.
 */
final class FragmentPool {
    private static final int LEAST = 512; // bytes of an array
    private static final int BESIDE = 128; // bytes of memory beside the data of each

    private final Map<Integer, ArrayDeque<byte[]>> spare = new HashMap<>(); // by length
    private long held; // bytes, of what is in use and spare

    /** At least so many bytes. */
    byte[] take(int size) {
        int length = rounded(size);
        ArrayDeque<byte[]> found = spare.get(length);
        if (found != null && !found.isEmpty()) return found.removeLast();
        held += length + BESIDE;
        return new byte[length];
    }

    void giveBack(byte[] data) {
        spare.computeIfAbsent(data.length, key -> new ArrayDeque<>()).addLast(data);
    }

    long held() {
        return held;
    }

    /** Leaves unused memory to the garbage collector; false if there is nothing to free. */
    boolean shrink() {
        long before = held;
        spare.forEach((length, arrays) -> held -= (long) arrays.size() * (length + BESIDE));
        spare.clear();
        return held < before;
    }

    /** Four lengths for each doubling: what was of use for one fragment is for others, too. */
    private static int rounded(int size) {
        if (size <= LEAST) return LEAST;
        int step = Integer.highestOneBit(size - 1) / 4;
        return (size + step - 1) / step * step;
    }
}
