"""The referee: it alone holds the run. It starts a student's program in a sandbox (lab.py), gives
it the readings, takes its commands, and draws what it hands in into the run's log, which labs.py
judges.
"""

from __future__ import annotations

import base64
import json
import os
import select
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import ruedo
from labs import EYE, LABS, LAYER, given
from ruedo import markers

HERE = Path(__file__).resolve().parent
PATIENCE = 20.0  # s of real time from readings to the command; less than the lease of lockstep
LONGEST, MOST_POINTS = 1 << 20, 4000  # bytes of a line, points of a map


class Fault(Exception):
    """What a program did instead of driving."""


class Program:
    """A student's, in a process of its own."""

    def __init__(self, file: str, lab: str) -> None:
        kept = {key: os.environ[key] for key in ("PATH", "PYTHONPATH") if key in os.environ}
        self._process = subprocess.Popen(
            [sys.executable, "-B", HERE / "lab.py", os.path.realpath(file), lab],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**kept, "OPENBLAS_NUM_THREADS": "1"},
        )
        assert self._process.stdin and self._process.stdout
        self._in, self._out = self._process.stdin.fileno(), self._process.stdout.fileno()
        os.set_blocking(self._in, False)
        os.read(self._out, 1)  # it is in its sandbox, or has ended
        self._said, self._until = b"", 0.0

    def __enter__(self) -> Program:
        return self

    def __exit__(self, *exception: object) -> None:
        self._process.kill()
        self._process.wait()

    def tell(self, readings: dict[str, Any]) -> None:
        try:
            line = json.dumps(readings).encode() + b"\n"
            if os.write(self._in, line) < len(line):
                raise BlockingIOError
        except BlockingIOError:
            raise Fault("drove without a look at the readings") from None
        except BrokenPipeError:
            pass  # it has ended: next() says how
        self._until = time.monotonic() + PATIENCE

    def next(self) -> bytes:
        """A line of its own, or b"" with its end."""
        while b"\n" not in self._said:
            left = max(0.0, self._until - time.monotonic())
            if not select.select([self._out], [], [], left)[0]:
                raise Fault(f"did not drive for {PATIENCE:g} s of real time")
            came = os.read(self._out, 1 << 16)
            if not came:
                code = self._process.wait()
                if code:
                    raise Fault(f"ended with exit code {code}")
                return b'["end", ""]'
            self._said += came
            if len(self._said) > LONGEST:
                raise Fault("said more than 1 MB at once")
        if time.monotonic() > self._until:
            raise Fault(f"did not drive for {PATIENCE:g} s of real time")
        line, _, self._said = self._said.partition(b"\n")
        return line


def understood(line: bytes, robots: int) -> tuple[str, Any]:
    """("drive", speeds and turns, (2, robots) m/s and rad/s), ("result", (n, 3)), or ("end", why).
    Raises Fault.
    """
    wrong = f"said {line[:40]!r}, which is neither a command nor a result"
    try:
        kind, what = json.loads(line)
        if kind == "end" and isinstance(what, str):
            return kind, what
        numbers = np.array(what, dtype=float)
    except (ValueError, TypeError, OverflowError, RecursionError):
        raise Fault(wrong) from None
    if kind == "result" and numbers.size == 0:
        numbers = numbers.reshape(0, 3)
    if not np.isfinite(numbers).all():
        raise Fault(f"{kind!r:.20} holds what is not a finite number")
    if kind == "drive" and numbers.shape[:1] == (2,) and numbers.size == 2 * robots:
        return kind, numbers.reshape(2, robots)
    if kind == "result" and numbers.shape == (len(numbers), 3) and len(numbers) <= MOST_POINTS:
        return kind, numbers
    raise Fault(wrong)


class Ride:
    """A lab's robots in lockstep, a tenth of a second at a time."""

    def __init__(self, sim: ruedo.Simulation, lab: str) -> None:
        self._sim, self._lab, self._steps = sim, LABS[lab], round(0.1 / sim.step_size)
        self.robots = [sim.robot(name) for name in self._lab.robots]
        self.seen = sim.step(self._steps)

    @property
    def over(self) -> bool:
        return bool(self.seen.time >= self._lab.seconds)

    def drive(self, commands: np.ndarray) -> None:
        """(2, robots): m/s, rad/s."""
        told = [one.velocity_command(*what) for one, what in zip(self.robots, commands.T)]
        self.seen = self._sim.step(self._steps, told)

    def readings(self) -> dict[str, Any]:
        robot, sees = self.robots[0], self._lab.sees
        odometry = self.seen.latest(robot.odometry)
        told = {
            "time": self.seen.time,
            "odometry": [odometry.x, odometry.y, odometry.theta],
            "ranges": self.seen.latest(robot.lrf).ranges.tolist(),
            "sonar": self.seen.latest(robot.device("sonar_front")).ranges.tolist(),
        }
        poses = [self.seen.latest(one.pose) for one in self.robots]
        rows = [[pose.x, pose.y, pose.heading] for pose in poses]
        if "pose" in sees:
            told["pose"] = rows[0]
        if "poses" in sees:
            told["poses"] = rows
        if "image" in sees:
            pixels = self.seen.latest(robot.cameras[EYE]).array()
            told["image"] = base64.b64encode(np.ascontiguousarray(pixels)).decode()
        return told

    def end(self, handed: np.ndarray, fault: str) -> None:
        """Draws what was handed in into the log."""
        text = "".join(one if " " <= one <= "~" else "?" for one in fault[:300])
        marks = [markers.points(handed), markers.text(text, (0, 0))]
        drawn = markers.message(LAYER, marks, "", 0)
        self._sim.step(self._steps, [ruedo.Command("ruedo/markers", drawn.encode())])


def main(file: str, name: str) -> None:
    handed, fault = np.zeros((0, 3)), ""
    with ruedo.connect() as sim, Program(file, name) as program:
        ride = Ride(sim, name)
        try:
            program.tell({**ride.readings(), **given(name, int(os.environ["RUEDO_SEED"]))})
            while not ride.over:
                kind, what = understood(program.next(), len(ride.robots))
                if kind == "end":
                    fault = what
                    break
                if kind == "result":
                    handed = what
                    continue
                ride.drive(what)
                program.tell(ride.readings())
        except Fault as error:
            fault = str(error)
        ride.end(handed, fault)


if __name__ == "__main__":
    main(*sys.argv[1:])
