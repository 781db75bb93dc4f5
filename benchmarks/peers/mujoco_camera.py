"""MuJoCo's pictures of the benchmark's walls, 640 x 480, drawn by OSMesa: frames per second.

MUJOCO_GL=osmesa python mujoco_camera.py WORLD
"""

import math
import os

os.environ.setdefault("MUJOCO_GL", "osmesa")

import mujoco
import rooms as bench


def prepare(walls: list[bench.Box], eye: tuple[float, float, float]):
    boxes = "".join(
        f'<geom type="box" pos="{b.center[0]} {b.center[1]} {b.center[2]}" '
        f'size="{b.size[0] / 2} {b.size[1] / 2} {b.size[2] / 2}"/>'
        for b in walls
    )
    # A camera looks along its -z with y up.
    xml = (
        f'<mujoco><compiler angle="radian"/><visual><global offwidth="{bench.PICTURE[0]}" offheight="{bench.PICTURE[1]}"/></visual>'
        f'<worldbody><light directional="true" pos="0 0 10" dir="0.3 0.2 -0.9" castshadow="false"/><geom type="plane" size="0 0 1"/>{boxes}'
        f'<body name="head" mocap="true" pos="{eye[0]} {eye[1]} {eye[2]}">'
        f'<camera name="eye" fovy="{bench.vertical_view_rad()}" xyaxes="0 -1 0 0 0 1"/></body></worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    renderer = mujoco.Renderer(model, height=bench.PICTURE[1], width=bench.PICTURE[0])

    def draw(yaw: float):
        data.mocap_quat[0] = [math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)]
        mujoco.mj_forward(model, data)
        renderer.update_scene(data, camera="eye")
        return renderer.render()

    return draw


if __name__ == "__main__":
    bench.camera_main("MuJoCo " + mujoco.__version__, prepare)
