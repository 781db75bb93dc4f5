"""How the labs are marked: the world of each, what a program is given in it, and when it passes.

The referee alone holds the run. It starts a student's program in a sandbox (lab.py), gives it the
readings, takes its commands, and draws what it hands in into the run's log. The campaign marks the
log: true poses, and what was handed in. Rooms, starts and errors are drawn by the run's seed.
"""

from __future__ import annotations

import json
import math
import os
import random
import select
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import ruedo
from ruedo import lcmtypes, markers
from ruedo.decoding import decode
from ruedo.logs import APPLIED_CHANNEL, HEADER_CHANNEL, events

HERE = Path(__file__).resolve().parent
SIDE, APART = 2.0, 0.8  # m, as in lab.py
THICKNESS = 0.1  # m, of walls
Point = tuple[float, float]
Wall = tuple[Point, Point]
ROOM: list[Wall] = [
    ((-4.0, -3.0), (4.0, -3.0)),
    ((4.0, -3.0), (4.0, 3.0)),
    ((4.0, 3.0), (-4.0, 3.0)),
    ((-4.0, 3.0), (-4.0, -3.0)),
]
PATIENCE = 20.0  # s of real time from readings to the command; less than the lease of lockstep
LONGEST, MOST_POINTS = 1 << 20, 4000  # bytes of a line, points of a map
LAYER = "handed in"
STRAIGHT = 0.2  # m, that an edge may deviate


class Failed(AssertionError):
    """Why a lab has not passed."""


# ---- The worlds.


def walls(lab: str, seed: int) -> list[Wall]:
    if lab in ("square", "umbmark"):
        return []
    if lab in ("wall_following", "sonar_avoidance"):
        return ROOM
    draw = random.Random(seed)
    a, b, c = (draw.uniform(-0.4, 0.4) for _ in range(3))
    made = [
        *ROOM,
        ((-1.0 + a, -3.0), (-1.0 + a, -0.5)),
        ((1.5 + b, 3.0), (1.5 + b, 1.0)),
        ((2.0, -1.5 + c), (4.0, -1.5 + c)),
    ]
    turn = draw.uniform(0.3, 1.2) if lab == "mapping" else 0.0  # no map known before fits
    return [(turned(begin, turn), turned(end, turn)) for begin, end in made]


def turned(point: Point, angle: float) -> Point:
    c, s = math.cos(angle), math.sin(angle)
    return c * point[0] - s * point[1], s * point[0] + c * point[1]


def world(lab: str, seed: int) -> ruedo.World:
    made = ruedo.World(lab)
    for begin, end in walls(lab, seed):
        made.wall(*begin, *end, thickness=THICKNESS)
    return made.robot("p3at", *start(lab, seed))


def start(lab: str, seed: int) -> tuple[float, float, float]:
    draw = random.Random(f"start {seed}")
    if lab in ("square", "umbmark"):
        return 0.0, 0.0, 0.0
    if lab == "wall_following":
        return draw.uniform(-3.0, 2.0), draw.uniform(-1.7, -1.3), draw.uniform(-0.3, 0.3)
    while True:
        place = draw.uniform(-3.0, 3.0), draw.uniform(-3.0, 3.0)
        apart = np.linalg.norm(points(walls(lab, seed)) - place, axis=1)
        if 0.8 < apart.min() < 2.5:
            return *place, draw.uniform(-math.pi, math.pi)


def points(of: list[Wall]) -> np.ndarray:
    """(n, 2) m, every 0.1 m along the walls."""
    return np.concatenate([np.linspace(a, b, 1 + round(10 * math.dist(a, b))) for a, b in of])


# ---- The run.


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

    def next(self) -> tuple[str, Any]:
        """What it said: ("drive", m/s and rad/s), ("result", (n, 3)), or ("end", why)."""
        while b"\n" not in self._said:
            left = max(0.0, self._until - time.monotonic())
            if not select.select([self._out], [], [], left)[0]:
                raise Fault(f"did not drive for {PATIENCE:g} s of real time")
            came = os.read(self._out, 1 << 16)
            if not came:
                code = self._process.wait()
                return "end", "" if code == 0 else f"ended with exit code {code}"
            self._said += came
            if len(self._said) > LONGEST:
                raise Fault("said more than 1 MB at once")
        if time.monotonic() > self._until:
            raise Fault(f"did not drive for {PATIENCE:g} s of real time")
        line, _, self._said = self._said.partition(b"\n")
        return understood(line)


def understood(line: bytes) -> tuple[str, Any]:
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
    if kind == "drive" and numbers.shape == (2,):
        return kind, numbers
    if kind == "result" and numbers.shape == (len(numbers), 3) and len(numbers) <= MOST_POINTS:
        return kind, numbers
    raise Fault(wrong)


def main(file: str, name: str) -> None:
    handed, fault = np.zeros((0, 3)), ""
    with ruedo.connect() as sim, Program(file, name) as program:
        robot, steps = sim.robot("p3at"), round(0.1 / sim.step_size)
        seen = sim.step(steps)
        try:
            program.tell({**readings(name, robot, seen), **given(name)})
            while seen.time < LABS[name].seconds:
                kind, what = program.next()
                if kind == "end":
                    fault = what
                    break
                if kind == "result":
                    handed = what
                    continue
                seen = sim.step(steps, [robot.velocity_command(*what)])
                program.tell(readings(name, robot, seen))
        except Fault as error:
            fault = str(error)
        sim.step(steps, [drawn(handed, fault)])


def readings(lab: str, robot: Any, seen: Any) -> dict[str, Any]:
    odometry = seen.latest(robot.odometry)
    told = {
        "time": seen.time,
        "odometry": [odometry.x, odometry.y, odometry.theta],
        "ranges": seen.latest(robot.lrf).ranges.tolist(),
        "sonar": seen.latest(robot.device("sonar_front")).ranges.tolist(),
    }
    if lab in ("umbmark", "mapping"):
        pose = seen.latest(robot.pose)
        told["pose"] = [pose.x, pose.y, pose.heading]
    return told


def given(lab: str) -> dict[str, Any]:
    """Once, with the first readings."""
    seed = int(os.environ["RUEDO_SEED"])
    return {"walls": walls(lab, seed)} if lab == "particle_filter" else {}


def drawn(handed: np.ndarray, fault: str) -> ruedo.Command:
    text = "".join(one if " " <= one <= "~" else "?" for one in fault[:300])
    made = markers.message(LAYER, [markers.points(handed), markers.text(text, (0, 0))], "", 0)
    return ruedo.Command("ruedo/markers", made.encode())


# ---- The marks.


class Run(NamedTuple):
    """way: true places (m), ten a second. handed: what was handed in, (n, 3)."""

    lab: str
    seed: int
    track_error: float
    way: np.ndarray
    handed: np.ndarray
    fault: str


def judge(log: str) -> float:
    """The metric of labs.yaml. Raises Failed."""
    run = read(log)
    if run.fault:
        raise Failed(run.fault)
    LABS[run.lab].judge(run)
    return 1.0


def read(log: str) -> Run:
    header, way, seen, handed = None, [], -math.inf, None
    for event in events(log):
        if event.channel == HEADER_CHANNEL:
            header = decode(lcmtypes.log_header_t, event.data)
        elif event.channel == "p3at/pose" and event.timestamp >= seen + 100_000:
            way.append(decode(lcmtypes.pose_t, event.data).pos[:2])
            seen = event.timestamp
        elif event.channel == APPLIED_CHANNEL:
            applied = decode(lcmtypes.applied_t, event.data)
            if applied.channel == "ruedo/markers":
                handed = decode(lcmtypes.markers_t, applied.data).markers
    if header is None or handed is None or not way:
        raise Failed("the run did not come to its end")
    error = next(one for one in header.options if "odometry.track_error=" in one)
    return Run(
        header.world,
        header.seed,
        float(error.rpartition("=")[2]),
        np.array(way),
        np.reshape(handed[0].points, (-1, 3)),
        handed[1].text,
    )


def square(run: Run) -> None:
    before = 0
    for x, y in ((SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE), (0.0, 0.0)):
        apart = np.hypot(*(run.way[before:] - (x, y)).T)
        near = np.flatnonzero(apart < 0.3)
        if not len(near):
            raise Failed(f"was not at the corner {x:g}, {y:g} in its turn")
        gone = near[0] + np.argmax(np.append(apart[near[0] :], math.inf) >= 0.3)
        corner = before + near[0] + int(np.argmin(apart[near[0] : gone]))
        off = deviation(run.way[before : corner + 1])
        if off > STRAIGHT:
            raise Failed(f"was {off:.2f} m off the straight edge to the corner {x:g}, {y:g}")
        before = corner
    if np.hypot(*run.way[-1]) > 0.3:
        raise Failed(f"ends {np.hypot(*run.way[-1]):.2f} m from where it began")


def deviation(way: np.ndarray) -> float:
    """How far it goes from the line between its ends (m)."""
    (x, y), from_begin = way[-1] - way[0], way - way[0]
    across = x * from_begin[:, 1] - y * from_begin[:, 0]
    return float(abs(across).max() / max(math.hypot(x, y), 1e-9))


def wall_following(run: Run) -> None:
    needs_way(run, 6.0)
    apart = np.minimum(4.0 - abs(run.way[:, 0]), 3.0 - abs(run.way[:, 1])) - THICKNESS / 2
    if not abs(np.median(apart[50:]) - APART) < 0.2:
        raise Failed(f"was {np.median(apart[50:]):.2f} m from the wall, not {APART}")
    along = progress(run.way, abs(apart - APART) < 0.5)
    if along < 6.0:
        raise Failed(f"went on {along:.1f} m along the walls, and 6 are asked for")


def progress(way: np.ndarray, counts: np.ndarray) -> float:
    """Along the walls of the room, there and back counting as nothing (m). counts: which places are
    near enough to a wall.
    """
    a, b = (
        4.0 - THICKNESS / 2 - APART,
        3.0 - THICKNESS / 2 - APART,
    )  # half of the way that is asked for
    x, y = np.clip(way, (-a, -b), (a, b)).T
    nearest = np.argmin([y + b, a - x, b - y, x + a], axis=0)  # the lower side, and on to the left
    at = np.choose(nearest, [x + a, 2 * a + b + y, 3 * a + 2 * b - x, 4 * a + 3 * b - y])
    steps = (np.diff(at) + 2 * (a + b)) % (4 * (a + b)) - 2 * (a + b)
    return float(abs(steps[counts[1:] & counts[:-1]].sum()))


def sonar_avoidance(run: Run) -> None:
    needs_way(run, 5.0)
    apart = np.linalg.norm(run.way[:, None] - run.way, axis=2).max()
    if apart < 4.0:
        raise Failed(f"its farthest places are {apart:.1f} m from each other, and 4 are asked for")


def umbmark(run: Run) -> None:
    needs_way(run, 14.0)
    measured = run.handed[0, 0] if len(run.handed) else math.nan
    if not abs(measured - run.track_error) < 0.003:
        raise Failed(f"measured {measured:+.3f} for the track's error, not {run.track_error:+.3f}")


def mapping(run: Run) -> None:
    needs_way(run, 5.0)
    taken = points(walls("mapping", run.seed))
    apart = np.linalg.norm(run.handed[:, None, :2] - taken, axis=2)
    if apart.size == 0 or np.mean(apart.min(axis=1) < 0.2) < 0.9:
        raise Failed("more than a tenth of what it has for taken is free")
    if np.mean(apart.min(axis=0) < 0.2) < 0.6:
        raise Failed(f"knows {np.mean(apart.min(axis=0) < 0.2):.0%} of the walls, not 60 %")


def particle_filter(run: Run) -> None:
    needs_way(run, 5.0)
    believed = run.handed[0, :2] if len(run.handed) else math.nan
    off = float(np.hypot(*(believed - run.way[-1])))
    if not off < 0.4:
        raise Failed(f"believes to be {off:.2f} m from where it is")


def needs_way(run: Run, least: float) -> None:
    way = float(np.hypot(*np.diff(run.way, axis=0).T).sum())
    if way < least:
        raise Failed(f"went {way:.1f} m, and {least:g} are asked for")


class Lab(NamedTuple):
    seconds: float  # that the program has
    judge: Callable[[Run], None]


LABS = {
    "square": Lab(70.0, square),  # of 2 m, turning left, back to its start
    "wall_following": Lab(40.0, wall_following),  # along the walls of a room, 0.8 m away
    "sonar_avoidance": Lab(40.0, sonar_avoidance),  # around a room, by sonars alone
    "umbmark": Lab(120.0, umbmark),  # hands in by how much odometry overestimates the track
    "mapping": Lab(40.0, mapping),  # hands in the occupied places of the world
    "particle_filter": Lab(40.0, particle_filter),  # hands in where the robot is
}

if __name__ == "__main__":
    main(*sys.argv[1:])
