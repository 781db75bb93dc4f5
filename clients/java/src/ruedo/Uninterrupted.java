package ruedo;

/** Waiting that an interrupt does not end: the thread is found interrupted afterwards. */
final class Uninterrupted {
    private Uninterrupted() {}

    interface Wait<T> {
        T get() throws InterruptedException;
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
