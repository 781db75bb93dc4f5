package trial;

import ruedo.Robot;
import ruedo.Ruedo;
import ruedo.Simulation;

/** Starts a server of its own, as a user's program does, and drives one metre. */
public final class Drive {
    private Drive() {}

    public static void main(String[] arguments) {
        try (Simulation simulation = Ruedo.launch("arena")) {
            Robot robot = simulation.robot("p3at");
            robot.advance(0.5).await(30);
            System.out.printf(
                    "%s %.3f %s%n",
                    System.getProperty("java.specification.version"),
                    robot.pose().latest().x(),
                    Ruedo.class.getModule().isNamed()
                            ? Ruedo.class.getModule().getName()
                            : "class path");
        }
    }
}
