import ruedo.JointMode;
import ruedo.LaunchOptions;
import ruedo.OccupancyMap;
import ruedo.Odometry;
import ruedo.Pose;
import ruedo.Robot;
import ruedo.Ruedo;
import ruedo.Scan;
import ruedo.Simulation;
import ruedo.Synchronised;

import java.util.Locale;
import java.util.Map;

/** What a program of a textbook uses, in Java; api.py and api.cpp are its twins. */
public final class Api {
    public static void main(String[] args) {
        LaunchOptions options =
                new LaunchOptions()
                        .rate(Double.POSITIVE_INFINITY)
                        .noise(false)
                        .spawn("p3at@0,0", "carrier:arm@0,3")
                        .disable("p3at/camera")
                        .settings(Map.of("p3at/lrf.update_rate", 20));
        try (Simulation sim = Ruedo.launch("empty", options)) {
            Robot robot = sim.robot("p3at");
            Robot arm = sim.robot("arm");
            System.out.println("rate " + Math.round(robot.lrf().rate));
            try (Robot.Driving driving = robot.driving(0.3, 0.0)) {
                for (Synchronised<Scan, Pose> at :
                        sim.synchronised(robot.lrf(), robot.pose(), robot.odometry())) {
                    Odometry odometry = at.get(robot.odometry());
                    if (at.first.utime != at.second.utime || at.first.utime != odometry.utime)
                        throw new IllegalStateException(driving + " is not in step");
                    if (at.second.x() > 0.5) break;
                }
            }
            System.out.println("drove " + (sim.body("p3at").pose().x() > 0.5 ? "True" : "False"));
            arm.commandJoints(Map.of("forearm_joint", 0.4));
            while (Math.abs(arm.joint("forearm_joint").position() - 0.4) > 0.01) sim.sleep(0.1);
            System.out.println("joint " + JointMode.POSITION);
            byte[][] cells = new byte[10][20];
            for (byte[] row : cells) row[15] = 100;
            String file = args[0] + "/map.yaml";
            new OccupancyMap(cells, 0.1, 0.0, 0.0, 0.0).save(file);
            double ray = Ruedo.loadMap(file).ray(0.55, 0.5, 0.0, 30.0);
            System.out.println(String.format(Locale.ROOT, "ray %.2f", ray));
        }
        System.exit(0);
    }
}
