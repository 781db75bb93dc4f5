"""What a student's program is given: a robot that it reads and drives.

A program is a file with a function for each lab, as students/solution.py. It runs in a process of
its own, which reaches nothing but this.
"""

from __future__ import annotations

import base64
import json
import os
import runpy
import sys
import traceback
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

SIDE = 2.0  # m, of squares
APART = 0.8  # m, from the wall
BEFORE = 1.0  # m, from the red beacon's middle to the robot's


class Robot:
    """time: s. odometry: x, y, angle turned (m, m, rad), by the wheels. ranges: of the range finder
    (m), a degree apart from -90 to 90. sonar: of the eight in front (m), from left to right.

    pose: x, y, heading (m, m, rad), as a camera on the ceiling sees it; in umbmark, mapping and
    planning. walls: the map, a list of both ends (m) of each; in particle_filter and planning.
    goal: x, y (m); in planning. image: (60, 80, 3) red, green, blue, 0 to 255, of a camera that
    sees 60 degrees from left to right, 0.19 m before the robot's middle; in vision. poses: (4, 3),
    goals: (4, 2), of all robots; in many_robots.
    """

    time: float
    odometry: np.ndarray
    ranges: np.ndarray
    sonar: np.ndarray
    pose: np.ndarray
    walls: np.ndarray
    goal: np.ndarray
    image: np.ndarray
    poses: np.ndarray
    goals: np.ndarray

    def __init__(self, hears: IO[str], says: IO[str]) -> None:
        self._hears, self._says = hears, says
        self._hear()

    def drive(self, speed: ArrayLike, turn: ArrayLike) -> None:
        """Goes on so (m/s, rad/s) for a tenth of a second; the readings are those of its end. In
        many_robots a number for each robot. Ends the program when the lab's time is over.
        """
        told = np.array(np.broadcast_arrays(speed, turn), dtype=float)
        self._say("drive", told.reshape(2, -1).tolist())
        self._hear()

    def hand_in(self, result: Any) -> None:
        """What the lab asks for: a number; x, y and maybe a heading; or points, (n, 2) m. The last
        counts.
        """
        given = np.atleast_2d(np.asarray(result, dtype=float))
        rows = np.zeros((len(given), 3))
        rows[:, : given.shape[1]] = given
        self._say("result", rows.tolist())

    def _say(self, kind: str, what: Any) -> None:
        self._says.write(json.dumps([kind, what]) + "\n")
        self._says.flush()

    def _hear(self) -> None:
        line = self._hears.readline()
        if not line:
            raise SystemExit  # the time is over
        self._take(json.loads(line))

    def _take(self, readings: dict[str, Any]) -> None:
        for name, value in readings.items():
            if name == "image":
                pixels = np.frombuffer(base64.b64decode(value), np.uint8)
                self.image = pixels.reshape(60, 80, 3)
            else:
                setattr(self, name, value if name == "time" else np.array(value))


def run(file: str, lab: str) -> NoReturn:
    """In the sandbox; what it prints goes to standard error."""
    says = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    sys.path.insert(1, str(Path(__file__).resolve().parents[1]))
    sys.modules["lab"] = sys.modules["__main__"]
    import mapping  # noqa: F401  for programs, which cannot read the folder
    import particle_filter  # noqa: F401
    import sandbox

    del sys.path[:2]
    sandbox.enter([file])
    os.write(says.fileno(), b"!")
    robot = Robot(sys.stdin, says)
    end = ""
    try:
        program = runpy.run_path(file).get(lab)
        if program is None:
            end = "nothing was handed in"
        else:
            program(robot)
    except SystemExit as error:
        end = f"SystemExit: {error}" if error.code else ""
    except BaseException as error:
        with suppress(Exception):  # it may have printed too much
            traceback.print_exc()
        end = f"{type(error).__name__}: {error}"
    robot._say("end", end)
    raise SystemExit


if __name__ == "__main__":
    run(*sys.argv[1:])
