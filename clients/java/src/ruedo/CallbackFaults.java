package ruedo;

import java.util.ArrayList;
import java.util.List;
import java.util.Set;
import java.util.concurrent.ConcurrentHashMap;

/**
 * What the callbacks of a simulation threw, until one of its calls throws it. A program that makes
 * no such call prints it at its end, and has an exit code that is not 0. Thread safe.
 */
final class CallbackFaults {
    private static final long PATIENCE_MILLIS = 10_000; // for what else the program's end does
    private static final Set<CallbackFaults> UNTHROWN = ConcurrentHashMap.newKeySet();
    private static boolean hooked; // under the class's monitor

    private Throwable kept; // these under this object's monitor
    private String keptOn; // what the callback was on

    /** Whether it is kept: false if another one is, or without memory. */
    boolean keep(Throwable fault, String what) {
        try {
            hook();
            synchronized (this) {
                if (kept != null) return false;
                UNTHROWN.add(this);
                kept = fault;
                keptOn = what;
            }
            return true;
        } catch (OutOfMemoryError error) {
            return false;
        }
    }

    /** Once. */
    synchronized void rethrow() {
        if (kept == null) return;
        Throwable fault = kept;
        kept = null;
        UNTHROWN.remove(this);
        throw new RuedoException.CallbackException(
                "a callback on " + keptOn + " failed: " + Faults.described(fault), fault);
    }

    private synchronized void print() {
        if (kept == null) return;
        Faults.tell("a callback on " + keptOn + " failed: ", kept, "");
        Faults.trace(kept);
    }

    private static synchronized void hook() {
        if (hooked) return;
        hooked = true;
        ProgramEnd.waitsFor(new Thread(CallbackFaults::failAtEnd, "ruedo-faults"));
    }

    /** After whatever else the package does at the program's end. */
    private static void failAtEnd() {
        ProgramEnd.awaitOthers(PATIENCE_MILLIS);
        List<CallbackFaults> unthrown = new ArrayList<>(UNTHROWN);
        if (unthrown.isEmpty()) return;
        for (CallbackFaults faults : unthrown) faults.print();
        System.out.flush();
        Runtime.getRuntime().halt(1); // no other way gives an exit code here
    }
}
