import example.thermometer_t;

import ruedo.MessageSample;
import ruedo.Ruedo;
import ruedo.Simulation;
import ruedo.Stream;

/** Prints what the thermometer says. The type is made by `lcm-gen -j thermometer_t.lcm`. */
public class ReadTemperature {
    public static void main(String[] args) {
        try (Simulation sim = Ruedo.connect()) {
            Stream<MessageSample<thermometer_t>> temp =
                    sim.robot("rover").stream("temp", thermometer_t.class);
            if (sim.lockstep()) {
                for (MessageSample<thermometer_t> sample : sim.step(40).all(temp))
                    System.out.printf("%s s: %.6f%n", sample.time(), sample.message.temperature);
            } else {
                int size = sim.robot("rover").rawStream("temp").latest().bytes.length;
                System.out.printf("%.6f, %d bytes%n", temp.latest().message.temperature, size);
            }
        }
    }
}
