package ruedo;

/** Waiting that an interrupt does not end: the thread is found interrupted afterwards. */
final class Uninterrupted {
    private Uninterrupted() {}

    interface Wait<T> {
        T get() throws InterruptedException;
    }

    /** At least so long. */
    static void sleep(long millis) {
        Deadline deadline = new Deadline(millis * 1e-3);
        get(
                () -> {
                    while (!deadline.passed()) Thread.sleep(millis);
                    return null;
                });
    }

    static <T> T get(Wait<T> wait) {
        boolean interrupted = false;
        try {
            while (true) {
                try {
                    return wait.get();
                } catch (InterruptedException error) {
                    interrupted = true;
                }
            }
        } finally {
            if (interrupted) Thread.currentThread().interrupt();
        }
    }
}
