"""The runs of golden_runs.cpp in a Python process: wheel_runs.py [NAME...] prints for each its name
and the SHA-256 of all messages, by the module of whatever Ruedo this Python imports. They are the
hashes of hashes.txt, whichever Python and system that is.
"""

import hashlib
import struct
import sys
from pathlib import Path

import ruedo
from ruedo._engine import cos, sin
from ruedo.lcmtypes import joint_command_t

HERE = Path(__file__).resolve().parent
TURN_US = 100_000
BASES = ["car@-3,0", "mecanum@-4,3", "omni@0,-3", "tricycle@3.8,-3.8,2", "crawler@-4,-4,1"]
RUNS = {  # name: world, seconds, and options of ruedo.Engine
    "arena": ("arena", 2.0, {"spawn": ["p3dx:guest@3.8,3.8,-2.4"], "disable": ["p3at/camera"]}),
    "fleet": ("fleet", 2.0, {"disable": ["alice/camera", "bob/camera"]}),
    "bases": ("arena", 2.0, {"spawn": [*BASES, "puck@0,4"], "disable": ["p3at/camera"]}),
    "wheels": (HERE / "wheels.sdf", 2.0, {}),
    "arms": (HERE / "arms.sdf", 2.0, {}),
    "meshes": ("office", 0.4, {}),
    "camera": (HERE / "camera.sdf", 0.2, {}),
}


def velocities(turn: int, robots: int) -> list[list[float]]:
    rows = []
    for robot in range(robots):
        phase = 0.7 * turn + 1.3 * robot
        ahead = -0.2 if turn % 7 == 6 else 0.4 + 0.3 * sin(phase)
        rows.append([ahead, 0.1 * cos(phase), 0.9 * sin(2.0 * phase)])
    return rows


def joints(turn: int) -> joint_command_t:
    command = joint_command_t()
    command.n = 3
    command.name = ["pan", "tilt", "fork"]
    position, velocity = joint_command_t.POSITION, joint_command_t.VELOCITY
    command.mode = [position, velocity, position]
    command.value = [
        sin(0.5 * turn),
        0.4 if turn % 4 < 2 else -0.4,
        0.2 + 0.2 * cos(0.3 * turn),
    ]
    return command


def run(name: str) -> str:
    world, seconds, options = RUNS[name]
    digest = hashlib.sha256()

    def take() -> None:
        for _, step, channel, data in engine.messages():
            digest.update(f"{step} {channel} {len(data)}\n".encode() + data)

    with ruedo.Engine(str(world), seed=7, record=True, **options) as engine:
        take()
        for turn in range(max(1, int(seconds * 1e6 / TURN_US))):
            if name == "arms":
                engine.command(0, "lift/joint_command", joints(turn))
            commands = velocities(turn, len(engine.robots)) if engine.robots else None
            engine.step(commands, round(TURN_US * 1e-6 / engine.dt))
            take()
        digest.update(struct.pack("<Q", engine.state_hash()))
    return digest.hexdigest()


if __name__ == "__main__":
    for name in sys.argv[1:] or RUNS:
        print(name, run(name), flush=True)
