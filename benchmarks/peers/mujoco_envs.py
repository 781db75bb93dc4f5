"""MuJoCo's environments: a planar body whose velocity is imposed, in threads: mj_step and
mj_multiRay release the GIL.
"""

from concurrent.futures import ThreadPoolExecutor

import environments as common
import mujoco
import numpy as np
import rooms as bench

STEPS = 20
STEP_S = common.DECISION_S / STEPS


def make_xml(rooms: bench.Rooms) -> str:
    walls = "".join(
        f'<geom type="box" pos="{b.center[0]} {b.center[1]} {b.center[2]}" '
        f'size="{b.size[0] / 2} {b.size[1] / 2} {b.size[2] / 2}" contype="1" conaffinity="2"/>'
        for b in rooms.walls
    )
    start = rooms.starts[0]
    return (
        f'<mujoco><compiler angle="radian"/><option timestep="{STEP_S}"/><worldbody>{walls}'
        f'<body name="robot" pos="{start.x} {start.y} 0.14" euler="0 0 {start.yaw}"><joint type="slide" axis="1 0 0"/>'
        '<joint type="slide" axis="0 1 0"/><joint type="hinge" axis="0 0 1"/>'
        '<geom type="box" size="0.25 0.25 0.14" mass="20" friction="0 0 0" contype="2" conaffinity="3"/></body>'
        "</worldbody></mujoco>"
    )


def main() -> None:
    given = common.options("MuJoCo")
    rooms = bench.load(given.world)
    model = mujoco.MjModel.from_xml_string(make_xml(rooms))
    start, body = rooms.starts[0], model.body("robot").id
    angles = np.array(common.angles(given.beams))
    datas = [mujoco.MjData(model) for _ in range(given.envs)]
    scans = np.zeros((given.envs, given.beams))

    def advance(first: int) -> None:
        rays, ids = np.zeros((given.beams, 3)), np.zeros(given.beams, np.int32)
        origin = np.zeros(3)
        for i in range(first, given.envs, common.CORES):
            data = datas[i]
            turned = data.qpos[2]  # in the body's own frame, which has the start's yaw
            data.qvel[:] = (
                bench.SPEED_M_S * np.cos(turned),
                bench.SPEED_M_S * np.sin(turned),
                bench.TURN_RATE_RAD_S,
            )
            mujoco.mj_step(model, data, STEPS)
            heading = start.yaw + data.qpos[2] + angles
            rays[:, 0], rays[:, 1] = np.cos(heading), np.sin(heading)
            origin[:2], origin[2] = data.xpos[body, :2], bench.LRF_HEIGHT_M
            mujoco.mj_multiRay(
                model,
                data,
                origin,
                rays.ravel(),
                None,
                1,
                body,
                ids,
                scans[i],
                None,
                given.beams,
                bench.LRF_RANGE_M,
            )

    with ThreadPoolExecutor(common.CORES) as pool:

        def step() -> int:
            list(pool.map(advance, range(min(common.CORES, given.envs))))
            return given.envs

        rate = common.rate(step, given.seconds)
    common.show("MuJoCo " + mujoco.__version__, given.envs, given.beams, rate)


if __name__ == "__main__":
    main()
