"""PyBullet on the benchmark's map: boxes on a plane whose velocity is imposed, LRFs by
rayTestBatch.
"""

import math

import pybullet as p
import rooms as bench

STEP_S = 1.0 / 240.0


def run(rooms: bench.Rooms):
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.8)
    p.setTimeStep(STEP_S)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    for wall in rooms.walls:
        shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[length / 2 for length in wall.size])
        p.createMultiBody(0, shape, basePosition=wall.center)
    chassis = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.25, 0.25, 0.14])
    robots = []
    for start in rooms.starts:
        robot = p.createMultiBody(
            20,
            chassis,
            basePosition=[start.x, start.y, 0.141],
            baseOrientation=p.getQuaternionFromEuler([0, 0, start.yaw]),
        )
        p.changeDynamics(robot, -1, lateralFriction=0, spinningFriction=0)
        robots.append(robot)
    angles = bench.ray_angles()
    scan_every = round(1.0 / bench.LRF_RATE_HZ / STEP_S)
    step = 0

    def advance(seconds: float) -> None:
        nonlocal step
        for _ in range(round(seconds / STEP_S)):
            poses = []
            for robot in robots:
                position, orientation = p.getBasePositionAndOrientation(robot)
                yaw = p.getEulerFromQuaternion(orientation)[2]
                fall = p.getBaseVelocity(robot)[0][2]
                p.resetBaseVelocity(
                    robot,
                    [bench.SPEED_M_S * math.cos(yaw), bench.SPEED_M_S * math.sin(yaw), fall],
                    [0, 0, bench.TURN_RATE_RAD_S],
                )
                poses.append((position, yaw))
            p.stepSimulation()
            if step % scan_every == 0:
                for position, yaw in poses:
                    origin = [position[0], position[1], bench.LRF_HEIGHT_M]
                    ends = [
                        [
                            origin[0] + bench.LRF_RANGE_M * math.cos(yaw + a),
                            origin[1] + bench.LRF_RANGE_M * math.sin(yaw + a),
                            origin[2],
                        ]
                        for a in angles
                    ]
                    p.rayTestBatch([origin] * len(ends), ends, numThreads=0)
            step += 1

    return advance


if __name__ == "__main__":
    bench.main("PyBullet", STEP_S, run)
