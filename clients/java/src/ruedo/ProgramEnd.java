package ruedo;

import java.util.Set;
import java.util.concurrent.ConcurrentHashMap;

/** The end of the program: the work that it waits for, and whether it has begun. */
final class ProgramEnd {
    private static final Set<Thread> HOOKS = ConcurrentHashMap.newKeySet();

    private ProgramEnd() {}

    /** From now on it runs the thread, and waits for it. False: it has begun. */
    static boolean waitsFor(Thread thread) {
        try {
            Runtime.getRuntime().addShutdownHook(thread);
            HOOKS.add(thread);
            return true;
        } catch (IllegalStateException error) {
            return false;
        }
    }

    static void waitsNoMoreFor(Thread thread) {
        try {
            if (Runtime.getRuntime().removeShutdownHook(thread)) HOOKS.remove(thread);
        } catch (IllegalStateException error) {
            // it has begun
        }
    }

    static boolean hasBegun() {
        Thread thread = new Thread(() -> {});
        if (!waitsFor(thread)) return true;
        waitsNoMoreFor(thread);
        return false;
    }

    /** Called in one of the end's threads: waits until the others have ended. */
    static void awaitOthers(long mostMillis) {
        Deadline deadline = new Deadline(mostMillis * 1e-3);
        for (Thread hook : HOOKS) {
            if (hook != Thread.currentThread())
                Uninterrupted.get(
                        () -> {
                            while (hook.getState() != Thread.State.TERMINATED && !deadline.passed())
                                hook.join(10); // at once for one that has not begun
                            return true;
                        });
        }
    }

    /**
     * From now on an uncaught RunEnded ends the program, or its thread, as if it were done. What a
     * callback threw, which close() has added to it, counts.
     */
    static void comesWithTheRun() {
        Thread.UncaughtExceptionHandler otherwise = Thread.getDefaultUncaughtExceptionHandler();
        Thread.setDefaultUncaughtExceptionHandler(
                (thread, error) -> {
                    boolean isDone =
                            error instanceof RuedoException.RunEnded
                                    && error.getSuppressed().length == 0;
                    if (isDone && thread.getName().equals("main")) System.exit(0);
                    if (isDone) return;
                    if (otherwise != null) {
                        otherwise.uncaughtException(thread, error);
                    } else {
                        System.err.print("Exception in thread \"" + thread.getName() + "\" ");
                        error.printStackTrace();
                    }
                });
    }
}
