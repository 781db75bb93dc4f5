"""What a program of a textbook uses, in Python; api.cpp and Api.java are its twins."""

import sys

import numpy as np
import ruedo

with ruedo.launch(
    "empty",
    rate="max",
    noise=False,
    spawn=["p3at@0,0", "carrier:arm@0,3"],
    disable=["p3at/camera"],
    settings={"p3at/lrf.update_rate": 20},
) as sim:
    robot, arm, body = sim.robot("p3at"), sim.robot("arm"), sim.body("p3at")
    print("rate", round(robot.lrf.rate))
    with robot.driving(0.3, 0.0):
        for scan, pose, odometry in sim.synchronised(robot.lrf, robot.pose, robot.odometry):
            assert scan.utime == pose.utime == odometry.utime
            if pose.x > 0.5:
                break
    print("drove", body.pose.x > 0.5)
    arm.command_joints({"forearm_joint": 0.4})
    while abs(arm.joints["forearm_joint"].position - 0.4) > 0.01:
        sim.sleep(0.1)
    print("joint", ruedo.JointMode("position"))
    cells = np.zeros((10, 20), np.int8)
    cells[:, 15] = 100
    ruedo.Map(cells, 0.1, (0.0, 0.0, 0.0)).save(f"{sys.argv[1]}/map.yaml")
    chart = ruedo.load_map(f"{sys.argv[1]}/map.yaml")
    print(f"ray {chart.ray(0.55, 0.5, 0.0):.2f}")
