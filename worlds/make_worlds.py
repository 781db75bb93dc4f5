#!/usr/bin/env python3
"""Makes example worlds: a corridor with rooms, a maze, a warehouse, a hill, a
football field, a crossing.

    worlds/make_worlds.py [FOLDER]

Writes NAME.sdf (and terrain/hill.png) into FOLDER, this one where none is given. All is made of
boxes, cylinders, spheres and one height map; random places come from a generator
with a fixed seed. Dimensions are our own.
"""

import math
import random
import struct
import sys
import zlib
from pathlib import Path

WALL, WOOD, STEEL, ORANGE, BLUE = (
    (0.82, 0.80, 0.75),
    (0.60, 0.44, 0.28),
    (0.55, 0.57, 0.60),
    (0.85, 0.45, 0.12),
    (0.16, 0.33, 0.60),
)
GREEN, WHITE, RED, DARK, YELLOW = (
    (0.16, 0.42, 0.20),
    (0.92, 0.92, 0.92),
    (0.65, 0.14, 0.12),
    (0.16, 0.16, 0.18),
    (0.90, 0.75, 0.15),
)


def numbers(values):
    return " ".join(f"{0.0 if abs(value) < 1e-12 else value:.6g}" for value in values)


def paint(rgb):
    return f"<material><ambient>{numbers(rgb)} 1</ambient><diffuse>{numbers(rgb)} 1</diffuse><specular>0.05 0.05 0.05 1</specular></material>"


def box(x, y, z):
    return f"<box><size>{numbers((x, y, z))}</size></box>"


def cylinder(radius, length):
    return f"<cylinder><radius>{numbers([radius])}</radius><length>{numbers([length])}</length></cylinder>"


def sphere(radius):
    return f"<sphere><radius>{numbers([radius])}</radius></sphere>"


def seen(name, pose, geometry, rgb):
    return f'        <visual name="{name}"><pose>{numbers(pose)}</pose><geometry>{geometry}</geometry>{paint(rgb)}</visual>\n'


def solid(name, pose, geometry, rgb):
    return (
        f'        <collision name="{name}"><pose>{numbers(pose)}</pose><geometry>{geometry}</geometry></collision>\n'
        + seen(name, pose, geometry, rgb)
    )


def model(name, parts, pose=None, static=True, extra="", mass=None):
    text = f'    <model name="{name}">\n'
    if static:
        text += "      <static>true</static>\n"
    if pose:
        text += f"      <pose>{numbers(pose)}</pose>\n"
    text += '      <link name="link">\n'
    if mass:
        kilograms, moments = mass
        inertia = "".join(
            f"<i{axis}{axis}>{numbers([moment])}</i{axis}{axis}>"
            for axis, moment in zip("xyz", moments)
        )
        text += f"        <inertial><mass>{numbers([kilograms])}</mass><inertia>{inertia}</inertia></inertial>\n"
    return text + parts + "      </link>\n" + extra + "    </model>\n\n"


def include(uri, pose, name=""):
    named = f"<name>{name}</name>" if name else ""
    return f"    <include><uri>model://{uri}</uri>{named}<pose>{numbers(pose)}</pose></include>\n"


def world(name, about, content, ground=True):
    about = " ".join(about.split())
    floor = '    <include><uri>model://ground_plane</uri></include>\n' if ground else ""
    return (
        f'<?xml version="1.0"?>\n<!-- Made by worlds/make_worlds.py. {about} -->\n<sdf version="1.9" xmlns:ruedo="urn:ruedo">\n  <world name="{name}">\n'
        '    <physics name="5ms" type="bullet"><max_step_size>0.005</max_step_size><real_time_factor>1</real_time_factor></physics>\n'
        "    <scene><ambient>0.45 0.45 0.48 1</ambient><background>0.62 0.74 0.88 1</background><shadows>true</shadows></scene>\n"
        f"    <gravity>0 0 -9.81</gravity>\n    <include><uri>model://sun</uri></include>\n{floor}\n{content}  </world>\n</sdf>\n"
    )


def wall(name, x0, y0, x1, y1, gaps=(), height=1.2, thickness=0.12, rgb=WALL):
    """Along x or y; gaps are (distance of the centre from the start, width)."""
    length = math.hypot(x1 - x0, y1 - y0)
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    text, begin = "", 0.0
    for number, (end, width) in enumerate([*sorted(gaps), (length, 0.0)]):
        piece = end - width / 2 - begin
        if piece > 0:
            middle = begin + piece / 2
            size = (piece if ux else thickness, piece if uy else thickness, height)
            text += solid(
                f"{name}_{number}",
                (x0 + ux * middle, y0 + uy * middle, height / 2, 0, 0, 0),
                box(*size),
                rgb,
            )
        begin = end + width / 2
    return text


def moving(waypoints):
    return (
        "      <ruedo:path>\n"
        + "".join(
            f"        <ruedo:waypoint>{numbers(waypoint)}</ruedo:waypoint>\n"
            for waypoint in waypoints
        )
        + "      </ruedo:path>\n"
    )


def rooms():
    """A corridor of 16 m with four rooms on each side, their doors 1 m wide, and a door at the end
    that opens and closes.
    """
    parts = (
        wall("south", 0, -5, 16, -5)
        + wall("north", 0, 5, 16, 5)
        + wall("west", 0, -5, 0, 5)
        + wall("east", 16, -5, 16, 5)
    )
    doors = [(2 + 4 * room, 1.0) for room in range(4)]
    parts += wall("corridor_south", 0, -1, 16, -1, doors) + wall(
        "corridor_north", 0, 1, 16, 1, doors
    )
    for room in range(1, 4):
        parts += wall(f"south_{room}", 4 * room, -5, 4 * room, -1) + wall(
            f"north_{room}", 4 * room, 1, 4 * room, 5
        )
    content = include("p3at", (1, 0, 0, 0, 0, 0)) + model("walls", parts)
    for number, (x, y, turn) in enumerate(
        [(3.2, -4.2, 0), (7.3, 4.3, 1.57), (11.4, -4.1, 0.3), (14.6, 4.2, -0.4)]
    ):
        content += model(
            f"crate_{number}",
            solid("body", (0, 0, 0.3, 0, 0, 0), box(0.6, 0.6, 0.6), WOOD),
            (x, y, 0, 0, 0, turn),
        )
    for number, (x, y) in enumerate([(1.2, 3.8), (6.8, -3.4), (10.2, 3.6), (13.2, -3.8)]):
        content += model(
            f"column_{number}",
            solid("body", (0, 0, 0.6, 0, 0, 0), cylinder(0.2, 1.2), BLUE),
            (x, y, 0, 0, 0, 0),
        )
    leaf = solid("leaf", (0, 0, 0.6, 0, 0, 0), box(0.06, 1.84, 1.2), ORANGE)
    shut, open_ = (12, 0, 0, 0, 0, 0), (12, -1.9, 0, 0, 0, 0)
    times = [(0, shut), (4, shut), (6, open_), (12, open_), (14, shut), (16, shut)]
    content += model(
        "sliding_door",
        leaf,
        shut,
        static=False,
        extra=moving([(time, *pose) for time, pose in times]),
    )
    return world("rooms", rooms.__doc__, content)


def maze():
    """A maze of 8 x 8 cells of 1.5 m with one way between any two of them: the P3-AT starts in a
    corner, the goal is the red disc.
    """
    cells, pitch = 8, 1.5
    draw = random.Random(3)
    open_walls, known, stack = set(), {(0, 0)}, [(0, 0)]
    while stack:  # depth first
        x, y = stack[-1]
        ways = [
            (x + dx, y + dy)
            for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1))
            if 0 <= x + dx < cells and 0 <= y + dy < cells and (x + dx, y + dy) not in known
        ]
        if not ways:
            stack.pop()
            continue
        there = ways[int(draw.random() * len(ways))]
        open_walls.add(frozenset(((x, y), there)))
        known.add(there)
        stack.append(there)
    side = cells * pitch
    parts = (
        wall("south", 0, 0, side, 0)
        + wall("north", 0, side, side, side)
        + wall("west", 0, 0, 0, side)
        + wall("east", side, 0, side, side)
    )
    for x in range(cells):
        for y in range(cells):
            if x + 1 < cells and frozenset(((x, y), (x + 1, y))) not in open_walls:
                parts += wall(
                    f"x_{x}_{y}", (x + 1) * pitch, y * pitch, (x + 1) * pitch, (y + 1) * pitch
                )
            if y + 1 < cells and frozenset(((x, y), (x, y + 1))) not in open_walls:
                parts += wall(
                    f"y_{x}_{y}", x * pitch, (y + 1) * pitch, (x + 1) * pitch, (y + 1) * pitch
                )
    goal = seen("disc", (0, 0, 0.002, 0, 0, 0), cylinder(0.3, 0.004), RED)
    content = include("p3at", (pitch / 2, pitch / 2, 0, 0, 0, 0)) + model("walls", parts)
    return world(
        "maze",
        maze.__doc__,
        content + model("goal", goal, (side - pitch / 2, side - pitch / 2, 0, 0, 0, 0)),
    )


def warehouse():
    """A hall of 24 x 16 m with four rows of racks, pallets that can be pushed, and two carts that
    go round.
    """
    parts = wall("south", -12, -8, 12, -8, height=2.5) + wall("north", -12, 8, 12, 8, height=2.5)
    parts += wall("west", -12, -8, -12, 8, height=2.5) + wall("east", 12, -8, 12, 8, height=2.5)
    content = include("p3dx", (-10.5, 0, 0, 0, 0, 0)) + model("walls", parts)
    draw = random.Random(5)
    for row, y in enumerate((-5.4, -1.8, 1.8, 5.4)):
        for bay in range(5):
            x = -6.6 + 3.0 * bay
            rack = "".join(
                solid(f"post_{number}", (dx, dy, 1.1, 0, 0, 0), box(0.08, 0.08, 2.2), STEEL)
                for number, (dx, dy) in enumerate(
                    ((-1.35, -0.45), (1.35, -0.45), (-1.35, 0.45), (1.35, 0.45))
                )
            )
            for level, z in enumerate((0.15, 1.05, 1.95)):
                rack += solid(f"shelf_{level}", (0, 0, z, 0, 0, 0), box(2.78, 0.98, 0.06), ORANGE)
                for place, dx in enumerate((-0.85, 0.0, 0.85)):
                    if draw.random() < 0.7:
                        high = 0.35 + 0.3 * draw.random()
                        rack += solid(
                            f"goods_{level}_{place}",
                            (dx, 0, z + 0.03 + high / 2, 0, 0, 0),
                            box(0.7, 0.8, high),
                            WOOD,
                        )
            content += model(f"rack_{row}_{bay}", rack, (x, y, 0, 0, 0, 0))
    for number, (x, y, turn) in enumerate([(9.4, -5.5, 0.1), (9.6, -3.9, -0.2), (9.2, 5.2, 0.4)]):
        mass = (
            12.0,
            [12.0 / 12 * (a * a + b * b) for a, b in ((0.8, 0.3), (1.2, 0.3), (1.2, 0.8))],
        )
        content += model(
            f"pallet_{number}",
            solid("body", (0, 0, 0, 0, 0, 0), box(1.2, 0.8, 0.3), WOOD),
            (x, y, 0.15, 0, 0, turn),
            static=False,
            mass=mass,
        )
    cart = solid("body", (0, 0, 0.25, 0, 0, 0), box(1.4, 0.8, 0.3), YELLOW) + solid(
        "load", (0, 0, 0.65, 0, 0, 0), box(1.0, 0.7, 0.5), DARK
    )
    loop = [
        (0, -8.6, -3.6, 0),
        (17, 8.4, -3.6, 0),
        (19, 8.4, -3.6, 1.5707963),
        (26, 8.4, 3.6, 1.5707963),
        (28, 8.4, 3.6, 3.1415927),
        (45, -8.6, 3.6, 3.1415927),
        (47, -8.6, 3.6, 4.712389),
        (54, -8.6, -3.6, 4.712389),
        (56, -8.6, -3.6, 6.2831853),
    ]
    for number, late in enumerate((0, 28)):
        turned = [((time - late) % 56, x, y, yaw) for time, x, y, yaw in loop[:-1]]
        turned = sorted(turned)
        turned = turned + [(56, *turned[0][1:])] if turned[0][0] == 0 else turned
        before, way = None, []
        for time, x, y, yaw in turned:  # the heading is continuous, and does not jump by a turn
            while before is not None and yaw < before - 1e-9:
                yaw += 2 * 3.14159265
            before = yaw
            way.append((time, x, y, 0, 0, 0, yaw))
        content += model(f"cart_{number}", cart, way[0][1:], static=False, extra=moving(way))
    return world("warehouse", warehouse.__doc__, content)


def png(path, rows):
    """A 16-bit greyscale PNG."""
    height, width = len(rows), len(rows[0])
    raw = b"".join(b"\0" + b"".join(struct.pack(">H", value) for value in row) for row in rows)
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)),
        (b"IDAT", zlib.compress(raw, 9)),
        (b"IEND", b""),
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + b"".join(
            struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
            for kind, body in chunks
        )
    )


HILLS = (
    (9, 6, 5.0, 1.8),
    (-8, 9, 7.0, 2.8),
    (-11, -7, 5.5, 2.0),
    (8, -10, 8.0, 2.9),
    (0, 14, 5.0, 1.6),
    (15, -2, 5.0, 1.4),
)  # x, y, width, height: m
TERRAIN_SIZE, TERRAIN_HEIGHT, TERRAIN_PIXELS = 40.0, 3.0, 129


def height_at(x, y):
    """m. Gaussian hills, and flat around the origin, where the robot starts."""
    hills = sum(
        top * math.exp(-((x - hx) ** 2 + (y - hy) ** 2) / (2 * (width / 2) ** 2))
        for hx, hy, width, top in HILLS
    )
    return hills * (1 - math.exp(-(x * x + y * y) / 8.0))


def terrain_rows():
    step = TERRAIN_SIZE / (TERRAIN_PIXELS - 1)
    ways = [-TERRAIN_SIZE / 2 + step * i for i in range(TERRAIN_PIXELS)]
    return [
        [round(65535 * min(1.0, height_at(x, y) / TERRAIN_HEIGHT)) for x in ways]
        for y in reversed(ways)
    ]


def terrain():
    """An outdoor terrain of 40 x 40 m with six hills of up to 2.9 m, trees and rocks."""
    size = numbers((TERRAIN_SIZE, TERRAIN_SIZE, TERRAIN_HEIGHT))
    field = f"<heightmap><uri>terrain/hill.png</uri><size>{size}</size><pos>0 0 0</pos></heightmap>"
    content = include("crawler", (0, 0, 0.02, 0, 0, 0)) + model(
        "hills", solid("ground", (0, 0, 0, 0, 0, 0), field, (0.35, 0.45, 0.24))
    )
    draw = random.Random(11)
    for number in range(24):
        x, y = 36 * draw.random() - 18, 36 * draw.random() - 18
        turn, big = 6.2 * draw.random(), draw.random()
        if math.hypot(x, y) < 3:
            continue
        z = height_at(x, y)
        if number % 2:
            stone = 0.25 + 0.3 * big
            content += model(
                f"rock_{number}",
                solid(
                    "body",
                    (0, 0, 0.4 * stone, 0.2, 0.1, 0),
                    box(2 * stone, 1.5 * stone, stone),
                    STEEL,
                ),
                (x, y, z, 0, 0, turn),
            )
        else:
            tree = solid("trunk", (0, 0, 0.7, 0, 0, 0), cylinder(0.14, 1.8), WOOD) + solid(
                "crown", (0, 0, 2.3, 0, 0, 0), sphere(0.7 + 0.4 * big), GREEN
            )
            content += model(f"tree_{number}", tree, (x, y, z, 0, 0, turn))
    return world("terrain", terrain.__doc__, content, ground=False)


def field():
    """A football field of 9 x 6 m for small robots: lines, two goals, a ball, two robots a side."""
    lines = seen("grass", (0, 0, 0.001, 0, 0, 0), box(10.4, 7.4, 0.002), GREEN)
    marks = [
        ("left", (-4.5, 0), (0.05, 6)),
        ("right", (4.5, 0), (0.05, 6)),
        ("top", (0, 3), (9.05, 0.05)),
        ("bottom", (0, -3), (9.05, 0.05)),
        ("half", (0, 0), (0.05, 6)),
    ]
    for name, (x, y), (long, wide) in marks:
        lines += seen(f"line_{name}", (x, y, 0.003, 0, 0, 0), box(long, wide, 0.002), WHITE)
    for part in range(36):
        angle = 2 * math.pi * (part + 0.5) / 36
        lines += seen(
            f"circle_{part}",
            (0.75 * math.cos(angle), 0.75 * math.sin(angle), 0.003, 0, 0, angle + math.pi / 2),
            box(0.132, 0.05, 0.002),
            WHITE,
        )
    content = model("lines", lines)
    border = wall("south", -5.2, -3.7, 5.2, -3.7, height=0.2) + wall(
        "north", -5.2, 3.7, 5.2, 3.7, height=0.2
    )
    content += model(
        "border",
        border
        + wall("west", -5.2, -3.7, -5.2, 3.7, height=0.2)
        + wall("east", 5.2, -3.7, 5.2, 3.7, height=0.2),
    )
    for name, side, rgb in (("goal_blue", -1, BLUE), ("goal_yellow", 1, YELLOW)):
        goal = "".join(
            solid(f"post_{number}", (0, y, 0.25, 0, 0, 0), cylinder(0.05, 0.5), rgb)
            for number, y in enumerate((-0.7, 0.7))
        )
        goal += solid("bar", (0, 0, 0.5, math.pi / 2, 0, 0), cylinder(0.05, 1.5), rgb)
        goal += solid("net", (side * 0.5, 0, 0.25, 0, 0, 0), box(0.04, 1.4, 0.5), WHITE)
        content += model(name, goal, (side * 4.5, 0, 0, 0, 0, 0))
    mass, radius = 0.2, 0.08
    ball = f"<sphere><radius>{radius}</radius></sphere>"
    moments = [2 / 3 * mass * radius * radius] * 3  # a hollow ball
    content += model(
        "ball",
        solid("body", (0, 0, 0, 0, 0, 0), ball, ORANGE),
        (0, 0, radius, 0, 0, 0),
        static=False,
        mass=(mass, moments),
    )
    for name, x, y, turn in (
        ("blue_1", -1.5, 0.8, 0),
        ("blue_2", -3.2, -0.6, 0),
        ("yellow_1", 1.5, -0.8, math.pi),
        ("yellow_2", 3.2, 0.6, math.pi),
    ):
        content += include("puck", (x, y, 0, 0, 0, turn), name)
    return world("field", field.__doc__, content)


def crossing():
    """A crossing of two roads with pavements, eight people who walk to and fro over it, and a car
    to drive through.
    """
    ground = seen("asphalt_x", (0, 0, 0.001, 0, 0, 0), box(40, 7, 0.002), DARK) + seen(
        "asphalt_y", (0, 0, 0.001, 0, 0, 0), box(7, 40, 0.002), DARK
    )
    for along in range(-9, 10):
        if abs(2 * along) > 5:
            ground += seen(
                f"middle_x_{along}", (2 * along, 0, 0.003, 0, 0, 0), box(1, 0.12, 0.002), WHITE
            )
            ground += seen(
                f"middle_y_{along}", (0, 2 * along, 0.003, 0, 0, 0), box(0.12, 1, 0.002), WHITE
            )
    for stripe in range(7):
        for side in (-1, 1):
            ground += seen(
                f"zebra_x_{stripe}_{side}",
                (side * 5, -3 + stripe, 0.003, 0, 0, 0),
                box(2.4, 0.5, 0.002),
                WHITE,
            )
            ground += seen(
                f"zebra_y_{stripe}_{side}",
                (-3 + stripe, side * 5, 0.003, 0, 0, 0),
                box(0.5, 2.4, 0.002),
                WHITE,
            )
    kerbs = ""
    for number, (x, y) in enumerate(((-1, -1), (1, -1), (-1, 1), (1, 1))):
        kerbs += solid(
            f"pavement_{number}", (x * 10.5, y * 10.5, 0.05, 0, 0, 0), box(14, 14, 0.1), STEEL
        )
        kerbs += solid(
            f"house_{number}",
            (x * 12.5, y * 12.5, 2.1, 0, 0, 0),
            box(9, 9, 4),
            WALL if number % 2 else RED,
        )
    content = (
        include("car", (-12, -1.75, 0, 0, 0, 0))
        + model("roads", ground)
        + model("pavements", kerbs)
    )
    draw = random.Random(7)
    for number in range(8):
        shirt = (0.2 + 0.7 * draw.random(), 0.2 + 0.6 * draw.random(), 0.2 + 0.6 * draw.random())
        person = solid("legs", (0, 0, 0.42, 0, 0, 0), cylinder(0.14, 0.84), DARK) + solid(
            "body", (0, 0, 1.12, 0, 0, 0), cylinder(0.2, 0.56), shirt
        )
        person += solid("head", (0, 0, 1.54, 0, 0, 0), sphere(0.13), (0.85, 0.66, 0.54))
        side, across, late = (-1 if number % 2 else 1), number % 4 < 2, 3.0 * draw.random()
        lane = side * (5 + 0.9 * (draw.random() - 0.5))
        speed = 1.0 + 0.5 * draw.random()
        walk = 7.6 / speed
        ends = [(lane, -3.8), (lane, 3.8)] if across else [(-3.8, lane), (3.8, lane)]
        yaw = math.pi / 2 if across else 0.0
        (x0, y0), (x1, y1) = ends
        way = [
            (0, x0, y0, 0, 0, 0, yaw),
            (late + 0.01, x0, y0, 0, 0, 0, yaw),
            (late + walk, x1, y1, 0, 0, 0, yaw),
            (late + walk + 1, x1, y1, 0, 0, 0, yaw + math.pi),
            (late + 2 * walk + 1, x0, y0, 0, 0, 0, yaw + math.pi),
            (late + 2 * walk + 2, x0, y0, 0, 0, 0, yaw + 2 * math.pi),
        ]
        content += model(f"person_{number}", person, way[0][1:], static=False, extra=moving(way))
    return world("crossing", crossing.__doc__, content)


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    png(folder / "terrain/hill.png", terrain_rows())
    for make in (rooms, maze, warehouse, terrain, field, crossing):
        (folder / f"{make.__name__}.sdf").write_text(make(), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent)
