package ruedo;

import java.io.IOException;
import java.util.function.BooleanSupplier;

/** Repeats its work until that is over, whatever it throws: memory that ran out is there again. */
final class LastingThread extends Thread {
    private static final long PAUSE_MILLIS = 10; // after a fault, which may last

    interface Work {
        /** What is lost by an IOException is not worth telling. */
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
                work.run();
            } catch (IOException | InterruptedException error) {
                pause();
            } catch (Throwable error) {
                Faults.tell("a message was passed over: ", error, "");
                pause();
            }
        }
    }

    private static void pause() {
        try {
            Thread.sleep(PAUSE_MILLIS);
        } catch (InterruptedException error) {
            // nobody ends this thread that way
        }
    }
}
