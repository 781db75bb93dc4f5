"""ruedo.Engine on the benchmark's map, and Ruedo's environments."""

import argparse

import numpy as np
import ruedo
from environments import rate, show

DEVICES = ("camera", "sonar_front", "sonar_rear")


def engine_steps(given: argparse.Namespace):
    with open(given.world) as file:
        text = file.read()
    first = ruedo.Engine(given.world)
    name = first.robots[0]
    first.close()
    # Each in one of the 16 rooms, placed as the first one is in its room.
    spawn = [
        f"p3at:more{i - 1}@{4 + 6 * (i % 4)},{3 + 6 * (i // 4)},1.5708"
        for i in range(1, given.robots)
    ]
    names = [name, *(f"more{i}" for i in range(given.robots - 1))]
    left_out = [device for device in DEVICES if not (given.camera and device == "camera")]
    settings: dict[str, object] = {
        f"{one}/lrf.lidar.scan.horizontal.samples": given.beams for one in names
    }
    if given.camera:
        for one in names:
            settings |= {
                f"{one}/camera.camera.image.width": 64,
                f"{one}/camera.camera.image.height": 64,
                f"{one}/camera.encoding": "rgb",
                f"{one}/camera.update_rate": 10,
            }
    engine = ruedo.Engine(
        given.world,
        text=text,
        worlds=given.envs,
        spawn=spawn,
        set=settings,
        disable=[f"{one}/{device}" for one in names for device in left_out],
    )
    engine.observe("lrf.ranges"), engine.observe("pose.pos")
    if given.camera:
        engine.observe("camera.data")
    commands = np.broadcast_to([0.4, 0.4], (given.envs, len(names), 2))

    def step() -> int:
        engine.step(commands, 20)
        return given.envs

    return step


def gym_steps(given: argparse.Namespace):
    import gymnasium
    import ruedo.gym  # noqa: F401

    generator = np.random.default_rng(1)
    if given.envs == 1:
        env = gymnasium.make("ruedo/Navigate-v0", beams=given.beams, disable_env_checker=True)
        env.reset(seed=1)

        def step() -> int:
            *_, terminated, truncated, _ = env.step(generator.uniform(-1, 1, 2))
            if terminated or truncated:
                env.reset()
            return 1

        return step
    envs = gymnasium.make_vec("ruedo/Navigate-v0", num_envs=given.envs, beams=given.beams)
    envs.reset(seed=1)

    def step() -> int:
        envs.step(generator.uniform(-1, 1, (given.envs, 2)))
        return given.envs

    return step


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("world")
    parser.add_argument("--envs", type=int, default=256)
    parser.add_argument("--beams", type=int, default=181)
    parser.add_argument("--robots", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--camera", action="store_true")
    parser.add_argument("--gym", action="store_true")
    given = parser.parse_args()
    step = gym_steps(given) if given.gym else engine_steps(given)
    show(f"Ruedo {ruedo.__version__}", given.envs, given.beams, rate(step, given.seconds))


if __name__ == "__main__":
    main()
