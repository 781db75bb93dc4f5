"""PyBullet's environments: a box whose velocity is imposed, 24 steps of 1/240 s, rayTestBatch; one
process per core.
"""

import math

import environments as common
import numpy as np
import pybullet
import rooms as bench
from pybullet_utils.bullet_client import BulletClient

STEPS = 24


def make(rooms: bench.Rooms, envs: int, beams: int):
    start = rooms.starts[0]
    clients, robots = [], []
    for _ in range(envs):
        client = BulletClient(pybullet.DIRECT)
        for wall in rooms.walls:
            shape = client.createCollisionShape(
                pybullet.GEOM_BOX, halfExtents=[size / 2 for size in wall.size]
            )
            client.createMultiBody(0, shape, basePosition=wall.center)
        shape = client.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.25, 0.25, 0.14])
        turn = pybullet.getQuaternionFromEuler([0, 0, start.yaw])
        robots.append(client.createMultiBody(20, shape, -1, [start.x, start.y, 0.14], turn))
        client.changeDynamics(robots[-1], -1, lateralFriction=0)
        clients.append(client)
    angles = np.array(common.angles(beams))

    def step() -> int:
        for client, robot in zip(clients, robots):
            position, turn = client.getBasePositionAndOrientation(robot)
            yaw = 2.0 * math.atan2(turn[2], turn[3])
            client.resetBaseVelocity(
                robot,
                [bench.SPEED_M_S * math.cos(yaw), bench.SPEED_M_S * math.sin(yaw), 0],
                [0, 0, bench.TURN_RATE_RAD_S],
            )
            for _ in range(STEPS):
                client.stepSimulation()
            origin = np.array([position[0], position[1], bench.LRF_HEIGHT_M])
            rays = np.stack([np.cos(yaw + angles), np.sin(yaw + angles), np.zeros(beams)], axis=1)
            client.rayTestBatch(np.tile(origin, (beams, 1)), origin + bench.LRF_RANGE_M * rays)
        return envs

    return step


if __name__ == "__main__":
    given = common.options("PyBullet")
    rate = common.in_processes(make, given)
    common.show("PyBullet", given.envs, given.beams, rate)
