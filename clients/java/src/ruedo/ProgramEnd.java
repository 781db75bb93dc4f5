package ruedo;

/** The end of the program: what it waits for, and whether it has begun. */
final class ProgramEnd {
    private ProgramEnd() {}

    /** From now on it runs the thread, and waits for it. False: it has begun. */
    static boolean waitsFor(Thread thread) {
        try {
            Runtime.getRuntime().addShutdownHook(thread);
            return true;
        } catch (IllegalStateException error) {
            return false;
        }
    }

    static void waitsNoMoreFor(Thread thread) {
        try {
            Runtime.getRuntime().removeShutdownHook(thread);
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
}
