"""CPU time of piles, an arm and a floor of triangles, in the process, at a step of 5 ms.

As a program: of piles drawn from seeds, beside MuJoCo and PyBullet, and their distribution
(in build/physics-venv, with PYTHONPATH=build/release/python).
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path

import piles
import rows
import ruedo
from scenes import PLANE, Body, Scene, Shape
from simulators import Simulator, available, sdf, with_friction

STEP_S, SECONDS, REPEATS = (
    0.005,
    1.5,
    9,
)  # shorter than the 2 s after which Ruedo puts resting bodies to sleep


class InProcess(Simulator):
    """Ruedo as ruedo.Engine, on one core."""

    name = "Ruedo"

    def __init__(self, scene: Scene, step_s: float) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="ruedo-physics-")
        world = Path(self._folder.name) / "world.sdf"
        if scene.urdf:
            (Path(self._folder.name) / "robot.urdf").write_text(
                with_friction(scene), encoding="utf-8"
            )
        world.write_text(sdf(scene, step_s), encoding="utf-8")
        self._engine = ruedo.Engine(str(world), threads=1)

    def step(self, n: int = 1) -> None:
        if n:
            self._engine.step(None, n)

    def hold(self, joints, mode, value) -> None:
        command = ruedo.lcmtypes.joint_command_t()
        command.n, command.name = len(joints), list(joints)
        command.mode, command.value = bytes([command.VELOCITY] * command.n), [value] * command.n
        self._engine.command(0, "robot/joint_command", command)

    def close(self) -> None:
        self._engine.close()
        self._folder.cleanup()


def falling() -> Scene:
    """20 boxes, balls and cylinders onto triangles of 8 cm."""
    shapes = (
        Shape("box", (0.2, 0.2, 0.2), friction=0.8),
        Shape("sphere", (0.1,), friction=0.8),
        Shape("cylinder", (0.1, 0.2), friction=0.8),
    )
    return Scene(
        (
            rows.floor(),
            *(
                Body(
                    f"b{i}",
                    (shapes[i % 3],),
                    at=(0.03 + 0.4 * (i % 5), -0.61 + 0.4 * (i // 5), 0.15),
                )
                for i in range(20)
            ),
        )
    )


def cost(make, scene: Scene, rate: float | None = None, step_s: float = STEP_S) -> float:
    """ms of CPU time for a second of sim time: the least of several runs from the same
    start. rate: of all joints, rad/s.
    """
    best = float("inf")
    for _ in range(REPEATS):
        with make(scene, step_s) as sim:
            if rate is not None:
                sim.hold(rows.JOINTS, "velocity", rate)
            began = time.process_time()
            sim.step(round(SECONDS / step_s))
            best = min(best, time.process_time() - began)
    return 1e3 * best / SECONDS


def table(peers: list[type[Simulator]]) -> str:
    scenes = (
        (
            "stack of 15 boxes, 1.5 s",
            Scene(
                (PLANE, *(rows.box(f"b{i}", mass=1.0, at=(0, 0, 0.1 + 0.2 * i)) for i in range(15)))
            ),
            None,
        ),
        ("arm of six joints that holds 5 kg", Scene(urdf=rows.arm(), commands=True), 0.0),
        ("the same arm, each joint at 0.1 rad/s", Scene(urdf=rows.arm(), commands=True), 0.1),
        ("20 things that fall on triangles of 8 cm", falling(), None),
        *((title, make(), None) for title, make in piles.SCENES.items()),
    )
    makers = [InProcess, *peers]
    lines = [
        "| ms of one core for a simulated second | "
        + " | ".join(m.name for m in makers)
        + (" | Ruedo, of the faster one |" if peers else " |"),
        "|---|" + "---|" * (len(makers) + bool(peers)),
    ]
    for title, scene, rate in scenes:
        costs = [cost(make, scene, rate) for make in makers]
        ratio = f" {costs[0] / min(costs[1:]):.2f} |" if peers else ""
        lines.append(f"| {title} | " + " | ".join(f"{c:.1f}" for c in costs) + " |" + ratio)
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", nargs=2, type=int, default=(0, 100), metavar=("FIRST", "END"))
    peers = available(True)[1:]
    ratios = []
    for seed in range(*parser.parse_args().seeds):
        scene, step_s = piles.drawn(seed)
        costs = [cost(make, scene, None, step_s) for make in (InProcess, *peers)]
        ratios.append(costs[0] / min(costs[1:], default=costs[0]))
        print(seed, len(scene.free), f"{1e3 * step_s:g} ms", *(f"{c:.1f}" for c in costs))
    print(f"of the faster peer: median {statistics.median(ratios):.2f}, most {max(ratios):.2f}")


if __name__ == "__main__":
    main()
