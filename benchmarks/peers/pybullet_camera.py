"""PyBullet's pictures of the benchmark's walls, 640 x 480, by its TinyRenderer: frames per
second.
"""

import math

import pybullet as p
import rooms as bench


def prepare(walls: list[bench.Box], eye: tuple[float, float, float]):
    p.connect(p.DIRECT)
    ground = p.createVisualShape(p.GEOM_BOX, halfExtents=[50, 50, 0.05])
    p.createMultiBody(0, baseVisualShapeIndex=ground, basePosition=[0, 0, -0.05])
    for wall in walls:
        shape = p.createVisualShape(p.GEOM_BOX, halfExtents=[length / 2 for length in wall.size])
        p.createMultiBody(0, baseVisualShapeIndex=shape, basePosition=wall.center)
    width, height = bench.PICTURE
    projection = p.computeProjectionMatrixFOV(
        math.degrees(bench.vertical_view_rad()), width / height, 0.05, 50
    )

    def draw(yaw: float):
        target = [eye[0] + math.cos(yaw), eye[1] + math.sin(yaw), eye[2]]
        view = p.computeViewMatrix(eye, target, [0, 0, 1])
        return p.getCameraImage(
            width, height, view, projection, shadow=0, renderer=p.ER_TINY_RENDERER
        )[2]

    return draw


if __name__ == "__main__":
    bench.camera_main("PyBullet", prepare)
