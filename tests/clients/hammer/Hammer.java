package ruedo;

import java.nio.charset.StandardCharsets;
import java.util.ArrayList;
import java.util.List;
import java.util.concurrent.CountDownLatch;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.atomic.AtomicLong;
import java.util.function.Consumer;

/**
 * Eight threads that subscribe, publish and leave while a ninth receives; hammer.py explains the
 * test.
 */
public final class Hammer {
    private static final int THREADS = 8;
    private static final int CHANNELS = 4;

    private Hammer() {}

    private static void hammer(Bus bus, int number, int count, long end, AtomicLong heard) {
        Consumer<byte[]> hear =
                message -> {
                    long now = heard.incrementAndGet();
                    if (now % 7 == 0)
                        bus.subscribe("hammer/within" + number, (byte[] other) -> {}).close();
                    if (now % 50 == 1)
                        throw new AssertionError("what a callback throws hurts nobody");
                };
        for (int done = 0; done < count || System.nanoTime() - end < 0; done++) {
            try (Subscription own =
                            bus.subscribe("hammer/" + number + "/" + done % CHANNELS, hear);
                    Subscription shared = bus.subscribe("hammer/shared" + done % CHANNELS, hear)) {
                for (int k = 0; k < CHANNELS; k++) {
                    bus.publish("hammer/shared" + k, "shared".getBytes(StandardCharsets.US_ASCII));
                    bus.publish("hammer/" + number + "/" + k, new byte[300]);
                }
                if (own.closed() || shared.closed())
                    throw new IllegalStateException("closed by nobody");
            }
        }
    }

    public static void main(String[] args) throws InterruptedException {
        Bus bus = new Bus(Transport.open(new Address(args[0])));
        AtomicLong heard = new AtomicLong();
        // The threads' subscriptions may all be closed before an echo comes; this one stays open.
        bus.subscribe(
                "hammer/shared0",
                (byte[] message) -> {
                    if (heard.incrementAndGet() % 50 == 1)
                        throw new AssertionError("what a callback throws hurts nobody");
                });
        bus.start();
        long end = System.nanoTime() + (long) (Double.parseDouble(args[2]) * 1e9);
        List<Thread> threads = new ArrayList<>();
        for (int i = 0; i < THREADS; i++) {
            int number = i;
            threads.add(
                    new Thread(() -> hammer(bus, number, Integer.parseInt(args[1]), end, heard)));
        }
        for (Thread thread : threads) thread.start();
        for (Thread thread : threads) thread.join();
        CountDownLatch through = new CountDownLatch(1);
        bus.subscribe("hammer/last", (byte[] message) -> through.countDown());
        while (!through.await(5, TimeUnit.MILLISECONDS)) bus.publish("hammer/last", new byte[4]);
        bus.close();
        System.out.println("heard " + (heard.get() > 0 ? "True" : "False"));
    }
}
