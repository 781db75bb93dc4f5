"""MuJoCo on the benchmark's map: free bodies on a plane whose velocity is imposed, LRFs by
mj_multiRay.
"""

import mujoco
import numpy as np
import rooms as bench

STEP_S = 0.005


def make_xml(rooms: bench.Rooms) -> str:
    walls = "".join(
        f'<geom type="box" pos="{b.center[0]} {b.center[1]} {b.center[2]}" '
        f'size="{b.size[0] / 2} {b.size[1] / 2} {b.size[2] / 2}" contype="1" conaffinity="2"/>'
        for b in rooms.walls
    )
    robots = "".join(
        f'<body name="r{i}" pos="{s.x} {s.y} 0.14" euler="0 0 {s.yaw}"><freejoint/>'
        '<geom type="box" size="0.25 0.25 0.14" mass="20" friction="0 0 0" contype="2" conaffinity="3"/></body>'
        for i, s in enumerate(rooms.starts)
    )
    return (
        f'<mujoco><compiler angle="radian"/><option timestep="{STEP_S}"/><size memory="2G"/><worldbody>'
        f'<geom type="plane" size="0 0 1" friction="0 0 0" contype="1" conaffinity="2"/>{walls}{robots}'
        '</worldbody></mujoco>'
    )


def run(rooms: bench.Rooms):
    model = mujoco.MjModel.from_xml_string(make_xml(rooms))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    count = len(rooms.starts)
    body_ids = [model.body(f"r{i}").id for i in range(count)]
    angles = np.array(bench.ray_angles())
    distances = np.zeros(bench.LRF_RAYS)
    geom_ids = np.zeros(bench.LRF_RAYS, dtype=np.int32)
    scan_every = round(1.0 / bench.LRF_RATE_HZ / STEP_S)
    step = 0

    def advance(seconds: float) -> None:
        nonlocal step
        qvel = data.qvel.reshape(count, 6)
        for _ in range(round(seconds / STEP_S)):
            quaternions = data.qpos.reshape(count, 7)[:, 3:7]
            yaw = 2.0 * np.arctan2(quaternions[:, 3], quaternions[:, 0])
            qvel[:, 0] = bench.SPEED_M_S * np.cos(yaw)
            qvel[:, 1] = bench.SPEED_M_S * np.sin(yaw)
            qvel[:, 5] = bench.TURN_RATE_RAD_S
            mujoco.mj_step(model, data)
            if step % scan_every == 0:
                for i in range(count):
                    heading = yaw[i] + angles
                    rays = np.stack(
                        [np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=1
                    )
                    origin = np.array([data.qpos[7 * i], data.qpos[7 * i + 1], bench.LRF_HEIGHT_M])
                    mujoco.mj_multiRay(
                        model,
                        data,
                        origin,
                        rays.ravel(),
                        None,
                        1,
                        body_ids[i],
                        geom_ids,
                        distances,
                        None,
                        bench.LRF_RAYS,
                        bench.LRF_RANGE_M,
                    )
            step += 1

    return advance


if __name__ == "__main__":
    bench.main("MuJoCo " + mujoco.__version__, STEP_S, run)
