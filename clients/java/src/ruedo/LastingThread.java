package ruedo;

import java.io.IOException;
import java.util.function.BooleanSupplier;

/** Repeats its work until that is over, whatever it throws: exhausted memory may be free again. */
final class LastingThread extends Thread {
    private static final long PAUSE_MILLIS = 10; // after a fault, which may last

    interface Work {
        /** A loss by an IOException needs no report. */
        void run() throws IOException, InterruptedException;
    }

    private final Work work;
    private final BooleanSupplier over;

    LastingThread(String name, BooleanSupplier over, Work work) {
        super(name);
        this.work = work;
        this.over = over;
        setDaemon(true);
    }

    @Override
    public void run() {
        while (!over.getAsBoolean()) {
            try {
                runOnce();
            } catch (Throwable error) {
                // an interrupt, which ends nothing here; or there is no memory even for what
                // follows
            }
        }
    }

    private void runOnce() throws InterruptedException {
        try {
            work.run();
            return;
        } catch (IOException error) {
            // lost
        } catch (RuntimeException | Error error) {
            Faults.tell("a message was passed over: ", error, "");
        }
        Thread.sleep(PAUSE_MILLIS);
    }
}
