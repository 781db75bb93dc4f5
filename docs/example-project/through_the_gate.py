"""The twin of through_the_gate.cpp. SPEED in the environment changes its speed, m/s."""

import os

import ruedo

with ruedo.connect(name="gate", timeout=30.0) as sim:
    robot = sim.robot("p3at")
    v = omega = 0.0
    while True:
        seen = sim.step(20, [robot.velocity_command(v, omega)])
        scan, odometry = seen.latest(robot.lrf), seen.latest(robot.odometry)
        if scan is None or odometry is None:
            continue
        if odometry.x > 4.0:
            break
        left, right = min(scan.nearest(0.2, 1.5), 3.0), min(scan.nearest(-1.5, -0.2), 3.0)
        v = float(os.environ.get("SPEED", "0.4"))
        omega = max(-0.5, min(0.5, 0.5 * (left - right) - 0.8 * odometry.theta))
    sim.step(100, [robot.velocity_command(0.0, 0.0)])
    print("through")
