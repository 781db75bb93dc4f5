"""The labs: the world of each, what a program is given in it, and when it passes.

Rooms, starts, goals and errors are drawn by the run's seed. The campaign marks the log that
referee.py leaves: true poses, and what was handed in.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import ruedo
from ruedo import lcmtypes
from ruedo.decoding import decode
from ruedo.logs import APPLIED_CHANNEL, HEADER_CHANNEL, events

SIDE, APART = 2.0, 0.8  # m, as in lab.py
BEFORE = 1.0  # m, from the red beacon, as in lab.py
THICKNESS = 0.1  # m, of walls
POST, BEACON = 0.2, 0.15  # m, radii
Point = tuple[float, float]
Wall = tuple[Point, Point]
ROOM: list[Wall] = [
    ((-4.0, -3.0), (4.0, -3.0)),
    ((4.0, -3.0), (4.0, 3.0)),
    ((4.0, 3.0), (-4.0, 3.0)),
    ((-4.0, 3.0), (-4.0, -3.0)),
]
COLOURS = {"red": (0.9, 0.05, 0.05), "green": (0.05, 0.7, 0.05), "blue": (0.05, 0.1, 0.9)}
TEAM = ("p3at", "second", "third", "fourth")
EYE = "eye"  # a camera of 80 x 60 pixels and 60 degrees
CAMERA = """<sensor type='camera'><pose>0.19 0 0.52 0 0 0</pose><update_rate>10</update_rate>
<camera><horizontal_fov>1.0472</horizontal_fov><image><width>80</width><height>60</height></image>
<clip><near>0.05</near><far>20</far></clip></camera></sensor>"""
LAYER = "handed in"
STRAIGHT = 0.2  # m, that an edge may deviate
NEAR = 0.3  # m, from a goal


class Failed(AssertionError):
    """Why a lab has not passed."""


# ---- The worlds.


def walls(lab: str, seed: int) -> list[Wall]:
    if lab in ("square", "umbmark", "many_robots"):
        return []
    if lab in ("wall_following", "sonar_avoidance", "vision"):
        return ROOM
    draw = random.Random(seed)
    a, b, c = (draw.uniform(-0.4, 0.4) for _ in range(3))
    if lab == "planning":
        return [*ROOM, ((-1.3, -3.0), (-1.3, 1.0 + a)), ((1.3, 3.0), (1.3, -1.0 + b))]
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


def posts(lab: str, seed: int) -> list[Point]:
    """What no map has, one in each part of the room of `planning`."""
    if lab != "planning":
        return []
    draw = random.Random(f"posts {seed}")
    return [
        (middle + draw.uniform(-0.3, 0.3), draw.uniform(-0.5, 0.5)) for middle in (-2.6, 0.0, 2.6)
    ]


def beacons(lab: str, seed: int) -> dict[str, Point]:
    """By colour, 2 m from each other and from the robot."""
    if lab != "vision":
        return {}
    draw = random.Random(f"beacons {seed}")
    while True:
        places = [(draw.uniform(-2.8, 2.8), draw.uniform(-1.8, 1.8)) for _ in COLOURS]
        all_places = [*places, start(lab, seed)[:2]]
        if min(math.dist(a, b) for a in all_places for b in all_places if a is not b) > 2.0:
            return dict(zip(COLOURS, places))


def goals(lab: str, seed: int) -> list[Point]:
    """One for each robot."""
    draw = random.Random(f"goals {seed}")
    if lab == "planning":
        return [(draw.uniform(2.4, 3.0), draw.uniform(1.4, 2.2))]
    if lab != "many_robots":
        return []
    starts = [one[:2] for one in starts_of_team(seed)]
    while True:
        order = draw.sample(range(len(starts)), len(starts))
        if all(k != other for k, other in enumerate(order)):
            return [starts[k] for k in order]


def world(lab: str, seed: int) -> ruedo.World:
    made = ruedo.World(lab)
    for begin, end in walls(lab, seed):
        made.wall(*begin, *end, thickness=THICKNESS)
    for x, y in posts(lab, seed):
        made.cylinder(x, y, radius=POST, name="post")
    for name, (x, y) in beacons(lab, seed).items():
        made.cylinder(x, y, radius=BEACON, height=1.2, colour=COLOURS[name], name=name)
    for name, place in zip(LABS[lab].robots[1:], starts_of_team(seed)[1:]):
        made.robot("p3dx", *place, name=name)
    sensors = {EYE: CAMERA} if "image" in LABS[lab].sees else None
    return made.robot("p3at", *start(lab, seed), sensors=sensors)


def start(lab: str, seed: int) -> tuple[float, float, float]:
    draw = random.Random(f"start {seed}")
    if lab in ("square", "umbmark"):
        return 0.0, 0.0, 0.0
    if lab == "wall_following":
        return draw.uniform(-3.0, 2.0), draw.uniform(-1.7, -1.3), draw.uniform(-0.3, 0.3)
    if lab == "planning":
        return draw.uniform(-3.0, -2.4), draw.uniform(-2.2, -1.6), draw.uniform(-3.0, 3.0)
    if lab == "many_robots":
        return starts_of_team(seed)[0]
    while True:
        place = draw.uniform(-3.0, 3.0), draw.uniform(-3.0, 3.0)
        apart = np.linalg.norm(points(walls(lab, seed)) - place, axis=1)
        if 0.8 < apart.min() < 2.5:
            return *place, draw.uniform(-math.pi, math.pi)


def starts_of_team(seed: int) -> list[tuple[float, float, float]]:
    """About the corners of a square."""
    draw = random.Random(f"team {seed}")
    made = []
    for k in range(len(TEAM)):
        angle = (k + 0.5) * math.pi / 2 + draw.uniform(-0.15, 0.15)
        x, y = turned((draw.uniform(2.2, 2.6), 0.0), angle)
        made.append((x, y, draw.uniform(-math.pi, math.pi)))
    return made


def given(lab: str, seed: int) -> dict[str, Any]:
    """Once, with the first readings."""
    told: dict[str, Any] = {}
    if lab in ("particle_filter", "planning"):
        told["walls"] = walls(lab, seed)
    if lab == "planning":
        told["goal"] = goals(lab, seed)[0]
    if lab == "many_robots":
        told["goals"] = goals(lab, seed)
    return told


def points(of: list[Wall]) -> np.ndarray:
    """(n, 2) m, every 0.1 m along the walls."""
    return np.concatenate([np.linspace(a, b, 1 + round(10 * math.dist(a, b))) for a, b in of])


# ---- The marks.


class Run(NamedTuple):
    """way: true places (m), ten a second. handed: what was handed in, (n, 3). ways: those of all
    robots, by name.
    """

    lab: str
    seed: int
    track_error: float
    way: np.ndarray
    handed: np.ndarray
    fault: str
    ways: Mapping[str, np.ndarray] = MappingProxyType({})


def judge(log: str) -> float:
    """The metric of labs.yaml. Raises Failed."""
    run = read(log)
    if run.fault:
        raise Failed(run.fault)
    LABS[run.lab].judge(run)
    return 1.0


def read(log: str) -> Run:
    header, handed = None, None
    ways: dict[str, list[Point]] = {}
    seen: dict[str, float] = {}
    for event in events(log):
        if event.channel == HEADER_CHANNEL:
            header = decode(lcmtypes.log_header_t, event.data)
        elif event.channel.endswith("/pose"):
            name = event.channel.removesuffix("/pose")
            if event.timestamp >= seen.get(name, -math.inf) + 100_000:
                ways.setdefault(name, []).append(decode(lcmtypes.pose_t, event.data).pos[:2])
                seen[name] = event.timestamp
        elif event.channel == APPLIED_CHANNEL:
            applied = decode(lcmtypes.applied_t, event.data)
            if applied.channel == "ruedo/markers":
                handed = decode(lcmtypes.markers_t, applied.data).markers
    if header is None or handed is None or "p3at" not in ways:
        raise Failed("the run did not come to its end")
    error = next(one for one in header.options if "odometry.track_error=" in one)
    return Run(
        header.world,
        header.seed,
        float(error.rpartition("=")[2]),
        np.array(ways["p3at"]),
        np.reshape(handed[0].points, (-1, 3)),
        handed[1].text,
        {name: np.array(way) for name, way in ways.items()},
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


def at_goals(run: Run) -> None:
    for name, goal in zip(LABS[run.lab].robots, goals(run.lab, run.seed)):
        off = math.dist(run.ways[name][-1], goal)
        if off > NEAR:
            raise Failed(f"{name} ends {off:.2f} m from its goal")


def vision(run: Run) -> None:
    off = math.dist(run.way[-1], beacons(run.lab, run.seed)["red"])
    if not abs(off - BEFORE) < NEAR:
        raise Failed(f"ends {off:.2f} m from the red beacon, not {BEFORE:g}")


def needs_way(run: Run, least: float) -> None:
    way = float(np.hypot(*np.diff(run.way, axis=0).T).sum())
    if way < least:
        raise Failed(f"went {way:.1f} m, and {least:g} are asked for")


class Lab(NamedTuple):
    """seconds: that the program has. sees: readings beside those that all labs have."""

    seconds: float
    judge: Callable[[Run], None]
    sees: tuple[str, ...] = ()
    robots: tuple[str, ...] = ("p3at",)


LABS = {
    "square": Lab(70.0, square),  # of 2 m, turning left, back to its start
    "wall_following": Lab(40.0, wall_following),  # along the walls of a room, 0.8 m away
    "sonar_avoidance": Lab(40.0, sonar_avoidance),  # around a room, by sonars alone
    # hands in by how much odometry overestimates the track
    "umbmark": Lab(120.0, umbmark, ("pose",)),
    "mapping": Lab(40.0, mapping, ("pose",)),  # hands in the occupied places of the world
    "particle_filter": Lab(40.0, particle_filter),  # hands in where the robot is
    "planning": Lab(90.0, at_goals, ("pose",)),  # to a goal, by a map that lacks three posts
    "vision": Lab(60.0, vision, ("image",)),  # before the red of three beacons, by a camera
    "many_robots": Lab(60.0, at_goals, ("poses",), TEAM),  # four robots exchange their places
}
