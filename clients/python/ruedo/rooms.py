"""Scenes for learning, as SDF, from a number: rooms and corridors. The same number gives the same
scene everywhere.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

__all__ = [
    "ArmPlace",
    "Corridor",
    "CrowdHall",
    "PushRoom",
    "Room",
    "Scene",
    "make_arm_place",
    "make_corridor",
    "make_crowd_hall",
    "make_fleet_room",
    "make_hills",
    "make_landmark_room",
    "make_push_room",
    "make_room",
]

TEST_ROOMS = 1_000_000  # scenes from this number on are never used for training


@dataclass(frozen=True)
class Scene:
    """A world with a robot, which is called "robot" where it is alone."""

    number: int
    sdf: str
    extent: tuple[float, float, float] = field(default=(0.0, 0.0, 8.6), kw_only=True)
    """x and y of the middle, and the width of what is to be seen, m"""

    def seen_from_above(self) -> str:
        """The same with a camera of 256 x 256 pixels above it, ten times a second: the device
        "overview".
        """
        x, y, width = self.extent
        camera = (
            f"<model name='overview'><static>true</static><pose>{x:.3f} {y:.3f} {width:.3f} 0 1.5707963 0</pose><link name='link'>"
            "<sensor name='overview' type='camera'><update_rate>10</update_rate><ruedo:encoding>rgb</ruedo:encoding><camera>"
            "<horizontal_fov>0.95</horizontal_fov><image><width>256</width><height>256</height></image>"
            "<clip><near>0.1</near><far>100</far></clip></camera></sensor></link></model>"
        )
        return self.sdf.replace("</world>", camera + "</world>")


@dataclass(frozen=True)
class Room(Scene):
    """A room with a start that is free around it, and a goal."""

    start: tuple[float, float, float]  # m, m, rad
    goal: tuple[float, float]  # m


@dataclass(frozen=True)
class PushRoom(Room):
    """A room whose goal is one for a box."""

    box: tuple[float, float, float]  # m, m, rad


@dataclass(frozen=True)
class ArmPlace(Scene):
    """An arm, which is called "arm", and a target for its tip."""

    target: tuple[float, float]  # m, from the arm's first axis


@dataclass(frozen=True)
class CrowdHall(Room):
    """A hall with people."""


@dataclass(frozen=True)
class Corridor(Scene):
    """A corridor that winds, and its middle from the start to the end."""

    middle: tuple[tuple[float, float], ...]  # m
    width: float  # m


def _wall(name: str, x: float, y: float, heading: float, size: tuple[float, float, float]) -> str:
    return (
        f"<model name='{name}'><static>true</static><pose>{x:.4f} {y:.4f} {size[2] / 2:.4f} 0 0 {heading:.4f}</pose><link name='link'>"
        f"<collision name='c'><geometry><box><size>{size[0]:.4f} {size[1]:.4f} {size[2]:.4f}</size></box></geometry></collision>"
        f"<visual name='v'><geometry><box><size>{size[0]:.4f} {size[1]:.4f} {size[2]:.4f}</size></box></geometry></visual></link></model>"
    )


def _pillar(name: str, x: float, y: float, radius: float, colour: str = "") -> str:
    shape = (
        f"<geometry><cylinder><radius>{radius:.4f}</radius><length>1</length></cylinder></geometry>"
    )
    return (
        f"<model name='{name}'><static>true</static><pose>{x:.4f} {y:.4f} 0.5 0 0 0</pose><link name='link'>"
        f"<collision name='c'>{shape}</collision><visual name='v'>{shape}{colour}</visual></link></model>"
    )


def make_room(
    number: int, robot: str = "p3at", size: float = 8.0, obstacles: int = 8, start_free: float = 1.0
) -> Room:
    """The room of that number: a square of ``size`` m with obstacles, a start, and a goal at least
    half of the square away.

    No obstacle is nearer than ``start_free`` m to the start's or the goal's centre. A way from the
    start to the goal is likely, not certain: obstacles are drawn without looking at each other, at
    most 0.8 m wide.
    """
    draw = random.Random(number)
    between = _between(draw)
    reach = size / 2 - 0.7
    start = (between(-reach, reach), between(-reach, reach), between(-3.1, 3.1))
    goal = start[:2]
    while (goal[0] - start[0]) ** 2 + (goal[1] - start[1]) ** 2 < (size / 2) ** 2:
        goal = (between(-reach, reach), between(-reach, reach))
    models = _square(size)
    while len(models) < 4 + obstacles:
        x, y = between(-size / 2, size / 2), between(-size / 2, size / 2)
        radius = between(0.1, 0.4)
        free = start_free + radius
        if (
            min((x - start[0]) ** 2 + (y - start[1]) ** 2, (x - goal[0]) ** 2 + (y - goal[1]) ** 2)
            < free * free
        ):
            continue
        name = f"obstacle{len(models)}"
        models.append(
            _pillar(name, x, y, radius)
            if draw.random() < 0.5
            else _wall(name, x, y, between(-3.1, 3.1), (1.4 * radius, 1.4 * radius, 1.0))
        )
    return Room(
        number, _world(f"room-{number}", [_robot("robot", robot, start), *models]), start, goal
    )


def _square(size: float) -> list[str]:
    walls = [
        (0, size / 2, 0),
        (0, -size / 2, 0),
        (size / 2, 0, 1.5707963),
        (-size / 2, 0, 1.5707963),
    ]
    return [_wall(f"wall{i}", *place, (size + 0.2, 0.1, 1.0)) for i, place in enumerate(walls)]


def _robot(name: str, model: str, start: tuple[float, float, float]) -> str:
    place = f"{start[0]:.4f} {start[1]:.4f} 0 0 0 {start[2]:.4f}"
    uri = model if "/" in model else f"model://{model}"
    return f"<include><uri>{uri}</uri><name>{name}</name><pose>{place}</pose></include>"


def _world(name: str, models: list[str]) -> str:
    return (
        "<sdf version='1.9' xmlns:ruedo='urn:ruedo'>"
        f"<world name='{name}'>"
        "<physics type='bullet'><max_step_size>0.005</max_step_size></physics>"
        "<include><uri>model://sun</uri></include><include><uri>model://ground_plane</uri></include>"
        f"{''.join(models)}</world></sdf>"
    )


def _between(draw: random.Random) -> Callable[[float, float], float]:
    # random.Random's own numbers for one seed are promised to stay; shuffle() and the like are not,
    # so only random() is used.
    return lambda low, high: low + (high - low) * draw.random()


def make_corridor(number: int, robot: str = "p3at", pieces: int = 6) -> Corridor:
    """The corridor of that number: straight pieces of 2 to 3 m, each turned by up to 50 degrees
    against the x axis, 1.6 to 2.4 m wide.
    """
    between = _between(random.Random(number))
    width = between(1.6, 2.4)
    middle, headings = [(0.0, 0.0)], []
    for _ in range(pieces):
        headings.append(between(-0.87, 0.87))
        length, (x, y) = between(2.0, 3.0), middle[-1]
        middle.append((x + length * math.cos(headings[-1]), y + length * math.sin(headings[-1])))
    # The walls' corners lie on the lines that halve the angles of the middle's.
    at_corners = [headings[0], *((a + b) / 2 for a, b in pairwise(headings)), headings[-1]]
    opened = [
        0.0,
        *((b - a) / 2 for a, b in pairwise(headings)),
        0.0,
    ]
    models = []
    for side in (1, -1):
        corners = [
            (
                x - side * width / 2 / math.cos(half) * math.sin(heading),
                y + side * width / 2 / math.cos(half) * math.cos(heading),
            )
            for (x, y), heading, half in zip(middle, at_corners, opened)
        ]
        back = (corners[0][0] - math.cos(headings[0]), corners[0][1] - math.sin(headings[0]))
        for i, (a, b) in enumerate(zip([back, *corners], corners)):
            models.append(_wall_between(f"wall{side}_{i}", a, b))
    end = (-math.cos(headings[0]), -math.sin(headings[0]))
    across = (-math.sin(headings[0]) * width / 2, math.cos(headings[0]) * width / 2)
    models.append(
        _wall_between(
            "wall_back",
            (end[0] - across[0], end[1] - across[1]),
            (end[0] + across[0], end[1] + across[1]),
        )
    )
    start = (0.0, between(-0.1, 0.1), headings[0] + between(-0.3, 0.3))
    sdf = _world(f"corridor-{number}", [_robot("robot", robot, start), *models])
    ys = [y for _, y in middle]
    length, low, high = middle[-1][0], min(ys), max(ys)
    extent = (length / 2, (low + high) / 2, max(length, high - low) + 3.0)
    return Corridor(number, sdf, tuple(middle), width, extent=extent)


def _wall_between(name: str, a: tuple[float, float], b: tuple[float, float]) -> str:
    x, y = (a[0] + b[0]) / 2, (a[1] + b[1]) / 2
    heading = math.atan2(b[1] - a[1], b[0] - a[0])
    return _wall(name, x, y, heading, (math.dist(a, b) + 0.1, 0.1, 1.0))


BOX_M = 0.4


def make_push_room(number: int, robot: str = "p3at", size: float = 6.0) -> PushRoom:
    """The room of that number: a square with a box of 0.4 m and 3 kg near its middle, a place for
    it, and a robot.
    """
    between = _between(random.Random(number))
    box = (between(-1.2, 1.2), between(-1.2, 1.2), between(-3.1, 3.1))
    goal, start = box[:2], box
    while math.dist(goal, box[:2]) < 0.8 or math.dist(goal, box[:2]) > 1.6:
        goal = (between(-2.0, 2.0), between(-2.0, 2.0))
    while math.dist(start[:2], box[:2]) < 1.0:
        start = (between(-2.2, 2.2), between(-2.2, 2.2), between(-3.1, 3.1))
    inertia = 3.0 * BOX_M * BOX_M / 6.0
    # With a sensor it is a robot that only senses, and so has a pose that can be observed.
    model = (
        f"<model name='box'><pose>{box[0]:.4f} {box[1]:.4f} {BOX_M / 2} 0 0 {box[2]:.4f}</pose><link name='link'>"
        f"<inertial><mass>3</mass><inertia><ixx>{inertia:.5f}</ixx><iyy>{inertia:.5f}</iyy><izz>{inertia:.5f}</izz></inertia></inertial>"
        f"<collision name='c'><geometry><box><size>{BOX_M} {BOX_M} {BOX_M}</size></box></geometry>"
        "<surface><friction><ode><mu>0.4</mu><mu2>0.4</mu2></ode></friction></surface></collision>"
        f"<visual name='v'><geometry><box><size>{BOX_M} {BOX_M} {BOX_M}</size></box></geometry>{_colour(0.9, 0.6, 0.1)}</visual>"
        "<sensor name='imu' type='imu'><update_rate>10</update_rate></sensor></link></model>"
    )
    place = (
        f"<model name='place'><static>true</static><pose>{goal[0]:.4f} {goal[1]:.4f} 0.003 0 0 0</pose><link name='link'>"
        f"<visual name='v'><geometry><cylinder><radius>0.3</radius><length>0.004</length></cylinder></geometry>{_colour(0.1, 0.7, 0.2)}"
        "</visual></link></model>"
    )
    models = [_robot("robot", robot, start), model, place, *_square(size)]
    return PushRoom(number, _world(f"push-{number}", models), start, goal, box)


def _colour(red: float, green: float, blue: float) -> str:
    rgb = f"{red:.3f} {green:.3f} {blue:.3f} 1"
    return f"<material><ambient>{rgb}</ambient><diffuse>{rgb}</diffuse></material>"


def make_landmark_room(number: int, robot: str = "p3at", size: float = 6.0) -> Room:
    """The room of that number: a square with a red pillar, the goal, and four others of other
    colours.
    """
    draw = random.Random(number)
    between = _between(draw)
    reach = size / 2 - 0.8
    start = (between(-reach, reach), between(-reach, reach), between(-3.1, 3.1))
    places: list[tuple[float, float]] = []
    while len(places) < 5:
        place = (between(-reach, reach), between(-reach, reach))
        others = [start[:2], *places]
        if math.dist(place, start[:2]) > 1.5 and all(math.dist(place, o) > 1.2 for o in others):
            places.append(place)
    models = [_robot("robot", robot, start), *_square(size)]
    for i, (x, y) in enumerate(places):
        hue = (0.85, 0.05, 0.05) if i == 0 else (0.1, between(0.2, 0.9), between(0.2, 0.9))
        models.append(_pillar(f"pillar{i}", x, y, 0.2, _colour(*hue)))
    return Room(number, _world(f"landmark-{number}", models), start, places[0])


def make_crowd_hall(number: int, robot: str = "p3at", people: int = 8) -> CrowdHall:
    """The hall of that number: 10 m long and 8 m wide, a start at one end and a goal at the other,
    and people between, some of whom walk across and some along it.

    Where they begin and how they walk comes from the run's seed.
    """
    between = _between(random.Random(number))
    turned = 1.0 if between(0.0, 1.0) < 0.5 else -1.0  # which end is the start
    ahead = 0.0 if turned > 0.0 else math.pi
    start = (-4.0 * turned, between(-2.5, 2.5), ahead + between(-0.5, 0.5))
    goal = (4.0 * turned, between(-2.5, 2.5))
    across = round(people * between(0.3, 0.7))
    speed = between(0.6, 1.2)
    sides = ("-3 2.4 3 3.2", "-3 -3.2 3 -2.4")
    ends = ("-3.6 -3 -2.8 3", "2.8 -3 3.6 3")
    crowds = [
        f"<ruedo:crowd name='{name}'><ruedo:count>{count}</ruedo:count>"
        f"<ruedo:area>-2.5 -3 2.5 3</ruedo:area><ruedo:goal>{goals[0]}</ruedo:goal>"
        f"<ruedo:goal>{goals[1]}</ruedo:goal><ruedo:speed>{speed:.3f} 0.2</ruedo:speed>"
        "</ruedo:crowd>"
        for name, count, goals in (("across", across, sides), ("along", people - across, ends))
        if count > 0
    ]
    walls = [
        _wall(f"wall{i}", *place)
        for i, place in enumerate(
            [
                (0, 4.0, 0, (10.2, 0.1, 1.0)),
                (0, -4.0, 0, (10.2, 0.1, 1.0)),
                (5.0, 0, 1.5707963, (8.2, 0.1, 1.0)),
                (-5.0, 0, 1.5707963, (8.2, 0.1, 1.0)),
            ]
        )
    ]
    sdf = _world(f"crowd-{number}", [_robot("robot", robot, start), *walls, *crowds])
    return CrowdHall(number, sdf, start, goal, extent=(0.0, 0.0, 10.6))


ARM_M = (0.5, 0.4)  # lengths of its links


def make_arm_place(number: int) -> ArmPlace:
    """The place of that number: an arm of two links, 0.5 m above the floor, stretched out along the
    x axis, and a target at 0.25 to 0.85 m from its first axis.
    """
    between = _between(random.Random(number))
    distance, bearing = between(0.25, 0.85), between(-2.3, 2.3)
    target = (distance * math.cos(bearing), distance * math.sin(bearing))
    links = [_arm_link("upper", 0.0, ARM_M[0], 1.0), _arm_link("fore", ARM_M[0], ARM_M[1], 0.6)]
    joints = [
        _arm_joint("shoulder", "base", "upper", -ARM_M[0] / 2),
        _arm_joint("elbow", "upper", "fore", -ARM_M[1] / 2),
    ]
    arm = (
        "<model name='arm'><link name='base'><pose>0 0 0.22 0 0 0</pose><collision name='c'><geometry><cylinder>"
        "<radius>0.08</radius><length>0.4</length></cylinder></geometry></collision><visual name='v'><geometry><cylinder>"
        "<radius>0.08</radius><length>0.4</length></cylinder></geometry></visual></link>"
        "<joint name='foot' type='fixed'><parent>world</parent><child>base</child></joint>"
        f"{''.join(links + joints)}<ruedo:joints/></model>"
    )
    mark = (
        f"<model name='target'><static>true</static><pose>{target[0]:.4f} {target[1]:.4f} 0.5 0 0 0</pose><link name='link'>"
        f"<visual name='v'><geometry><sphere><radius>0.03</radius></sphere></geometry>{_colour(0.1, 0.7, 0.2)}</visual></link></model>"
    )
    return ArmPlace(number, _world(f"arm-{number}", [arm, mark]), target, extent=(0.0, 0.0, 2.4))


def _arm_link(name: str, x: float, length: float, mass: float) -> str:
    bar = f"<geometry><box><size>{length} 0.06 0.06</size></box></geometry>"
    inertia = mass * length * length / 12.0
    return (
        f"<link name='{name}'><pose>{x + length / 2} 0 0.5 0 0 0</pose><inertial><mass>{mass}</mass>"
        f"<inertia><ixx>0.001</ixx><iyy>{inertia:.5f}</iyy><izz>{inertia:.5f}</izz></inertia></inertial>"
        f"<collision name='c'>{bar}</collision><visual name='v'>{bar}{_colour(0.9, 0.6, 0.1)}</visual></link>"
    )


def _arm_joint(name: str, parent: str, child: str, x: float) -> str:
    return (
        f"<joint name='{name}' type='revolute'><parent>{parent}</parent><child>{child}</child><pose>{x} 0 0 0 0 0</pose><axis>"
        "<xyz>0 0 1</xyz><limit><lower>-2.8</lower><upper>2.8</upper><effort>50</effort><velocity>2</velocity></limit></axis></joint>"
    )


def make_hills(number: int, robot: str = "p3at", size: float = 10.0, hills: int = 6) -> Room:
    """The place of that number: a square with hills, a start on its floor, and a goal at least half
    of the square away.

    A hill is the top of a buried ball of 4 to 8 m radius, 0.2 to 0.5 m high: slopes up to 0.5 rad.
    """
    draw = random.Random(number)
    between = _between(draw)
    reach = size / 2 - 0.8
    start = (between(-reach, reach), between(-reach, reach), between(-3.1, 3.1))
    goal = start[:2]
    while math.dist(goal, start[:2]) < size / 2:
        goal = (between(-reach, reach), between(-reach, reach))
    models = [_robot("robot", robot, start), *_square(size)]
    while len(models) < 5 + hills:
        x, y = between(-size / 2, size / 2), between(-size / 2, size / 2)
        radius, height = between(4.0, 8.0), between(0.2, 0.5)
        foot = math.sqrt(height * (2.0 * radius - height))  # radius of the circle on the floor
        if math.dist((x, y), start[:2]) > foot + 0.5:
            models.append(_hill(f"hill{len(models)}", x, y, radius, height))
    sdf = _world(f"hills-{number}", models)
    return Room(number, sdf, start, goal, extent=(0.0, 0.0, size + 0.6))


def _hill(name: str, x: float, y: float, radius: float, height: float) -> str:
    ball = f"<geometry><sphere><radius>{radius:.4f}</radius></sphere></geometry>"
    return (
        f"<model name='{name}'><static>true</static><pose>{x:.4f} {y:.4f} {height - radius:.4f} 0 0 0</pose><link name='link'>"
        f"<collision name='c'>{ball}</collision><visual name='v'>{ball}{_colour(0.35, 0.45, 0.24)}</visual></link></model>"
    )


def make_fleet_room(
    number: int, robots: int, robot: str = "p3at", size: float = 10.0
) -> tuple[Scene, list[tuple[float, float]]]:
    """An empty square with robots on places of a grid, and goals on others: of each robot."""
    draw = random.Random(number)
    between = _between(draw)
    aside = math.ceil(math.sqrt(2 * robots))
    cell = (size - 1.0) / aside
    free = [
        ((i % aside + 0.5) * cell - (size - 1.0) / 2, (i // aside + 0.5) * cell - (size - 1.0) / 2)
        for i in range(aside * aside)
    ]
    taken = [free.pop(int(draw.random() * len(free))) for _ in range(2 * robots)]
    models = [
        _robot(f"robot{i}", robot, (*place, between(-3.1, 3.1)))
        for i, place in enumerate(taken[:robots])
    ]
    scene = Scene(number, _world(f"fleet-{number}", [*models, *_square(size)]))
    return scene, taken[robots:]
