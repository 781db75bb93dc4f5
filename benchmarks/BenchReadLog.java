import ruedo.Pose;
import ruedo.Ruedo;

import java.util.concurrent.atomic.AtomicLong;

/** Reads each pose of a log's channel by the Java client, in constant memory: LOG CHANNEL. */
public final class BenchReadLog {
    public static void main(String[] a) {
        AtomicLong count = new AtomicLong();
        double always = Double.POSITIVE_INFINITY;
        Ruedo.readLog(a[0])
                .each(a[1], Pose.class, -always, always, pose -> count.incrementAndGet());
        System.out.println(count + " poses");
    }
}
