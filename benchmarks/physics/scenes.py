"""The scenes of the tests, described once for all simulators: free bodies, things that never move,
and mechanisms as URDF.

Lengths in m, angles in rad, kg, s. Every mechanism is one URDF text, which all three simulators
read themselves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

GRAVITY = 9.81


@dataclass(frozen=True)
class Shape:
    """kind and size: box (x, y, z), sphere (radius), cylinder (radius, length along z),
    capsule (the same, length without its ends), plane (), mesh (), solid (closed,
    it may move).
    """

    kind: str
    size: tuple[float, ...] = ()
    file: Path | None = None  # of a mesh or a solid
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    friction: float = 1.0
    restitution: float = 0.0
    torsion_m: float = 0.0  # torsional friction: moment about the normal per newton of load


@dataclass(frozen=True)
class Body:
    """mass 0: it never moves. inertia: of the axes; by default that of its first shape, solid."""

    name: str
    shapes: tuple[Shape, ...]
    mass: float = 1.0
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: tuple[float, float, float] | None = None

    def moments(self) -> tuple[float, float, float]:
        if self.inertia:
            return self.inertia
        m, shape = self.mass, self.shapes[0]
        if shape.kind == "box":
            a, b, c = (s * s for s in shape.size)
            return m * (b + c) / 12, m * (a + c) / 12, m * (a + b) / 12
        if shape.kind == "sphere":
            return (0.4 * m * shape.size[0] ** 2,) * 3
        r, h = shape.size
        side = m * (3 * r * r + h * h) / 12
        return side, side, m * r * r / 2


@dataclass(frozen=True)
class Scene:
    bodies: tuple[Body, ...] = ()
    urdf: str = ""  # a mechanism "robot" whose first link is called "world" and never moves
    gravity: float = GRAVITY
    slope: float = 0.0  # the plane descends along x by that angle: gravity is turned
    commands: bool = False  # joints are commanded
    wheels: tuple[tuple[str, ...], tuple[str, ...]] = (
        (),
        (),
    )  # joints of a robot "robot" that moves: left and right, in `urdf`
    friction: float = 1.0  # of its wheels

    def down(self) -> tuple[float, float, float]:
        """The acceleration of gravity."""
        return self.gravity * math.sin(self.slope), 0.0, -self.gravity * math.cos(self.slope)

    @property
    def free(self) -> list[Body]:
        return [body for body in self.bodies if body.mass > 0.0]


PLANE = Body("ground", (Shape("plane"),), mass=0.0)
BOUNCING_PLANE = Body("ground", (Shape("plane", restitution=1.0),), mass=0.0)


@dataclass
class Chain:
    """Links one after another, each turning about an axis of its own at its origin, as URDF."""

    links: list[str] = field(default_factory=list)
    last: str = "world"

    def add(
        self,
        name: str,
        at: tuple[float, float, float],
        mass: float,
        center: tuple[float, float, float],
        inertia: tuple[float, float, float],
        axis: str = "0 1 0",
        rpy: tuple[float, float, float] = (0, 0, 0),
        kind: str = "continuous",
        damping: float = 0.0,
    ) -> Chain:
        i = inertia
        range_m = 'lower="-10" upper="10" ' if kind == "prismatic" else ""
        self.links.append(
            f'<link name="{name}"><inertial><origin xyz="{_list(center)}"/><mass value="{mass!r}"/>'
            f'<inertia ixx="{i[0]!r}" iyy="{i[1]!r}" izz="{i[2]!r}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="to_{name}" type="{kind}"><parent link="{self.last}"/><child link="{name}"/>'
            f'<origin xyz="{_list(at)}" rpy="{_list(rpy)}"/><axis xyz="{axis}"/><dynamics damping="{damping!r}"/>'
            f'<limit {range_m}effort="1000" velocity="1000"/></joint>'
        )
        self.last = name
        return self

    def urdf(self) -> str:
        return f'<robot name="robot"><link name="world"/>{"".join(self.links)}</robot>'


def skid_steered(
    half_base: float,
    half_track: float,
    radius: float,
    width: float,
    body_kg: float,
    wheel_kg: float,
    ahead: float = 0.0,
) -> str:
    """A robot of four wheels as URDF; its first link, "base", has its origin on the ground, in the
    middle, and its centre of mass `ahead` of it.
    """
    side, axle = wheel_kg * (3 * radius**2 + width**2) / 12, wheel_kg * radius**2 / 2
    wheels = ""
    for name, x, y in (("fl", 1, 1), ("rl", -1, 1), ("fr", 1, -1), ("rr", -1, -1)):
        wheels += (
            f'<link name="{name}"><inertial><mass value="{wheel_kg}"/><inertia ixx="{side!r}" iyy="{axle!r}" izz="{side!r}" ixy="0" ixz="0" iyz="0"/></inertial>'
            f'<collision><origin rpy="{math.pi / 2!r} 0 0"/><geometry><cylinder radius="{radius}" length="{width}"/></geometry></collision></link>'
            f'<joint name="to_{name}" type="continuous"><parent link="base"/><child link="{name}"/>'
            f'<origin xyz="{x * half_base} {y * half_track} {radius}"/><axis xyz="0 1 0"/><limit effort="100" velocity="100"/></joint>'
        )
    return (
        f'<robot name="robot"><link name="base"><inertial><origin xyz="{ahead!r} 0 0.18"/><mass value="{body_kg}"/>'
        f'<inertia ixx="0.1381" iyy="0.2829" izz="0.3277" ixy="0" ixz="0" iyz="0"/></inertial></link>{wheels}</robot>'
    )


def flat_mesh(
    folder: Path, half: float = 8.0, triangle: float = 0.08, along: float | None = None
) -> Path:
    """A flat floor of right triangles with legs of that length, z = 0."""
    along = half if along is None else along
    path = folder / f"flat_{half:g}_{triangle:g}.obj"
    nx, ny = round(2 * along / triangle), round(2 * half / triangle)
    lines = [
        f"v {-1.0 + i * triangle:.4f} {-half + j * triangle:.4f} 0"
        for j in range(ny + 1)
        for i in range(nx + 1)
    ]
    for j in range(ny):
        for i in range(nx):
            a = j * (nx + 1) + i + 1
            lines += [f"f {a} {a + 1} {a + nx + 2}", f"f {a} {a + nx + 2} {a + nx + 1}"]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def gripper() -> str:
    """Two fingers that slide along y, 50 mm apart, the second one by the mimic of the first one."""
    fingers = ""
    for name, y, mimic in (
        ("left", -0.03, ""),
        ("right", 0.03, '<mimic joint="to_left" multiplier="-1" offset="0"/>'),
    ):
        fingers += (
            f'<link name="{name}"><inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>'
            f'<collision><geometry><box size="0.03 0.01 0.06"/></geometry></collision></link>'
            f'<joint name="to_{name}" type="prismatic"><parent link="world"/><child link="{name}"/>'
            f'<origin xyz="0 {y} 1"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1000" velocity="1000"/>{mimic}</joint>'
        )
    return f'<robot name="robot"><link name="world"/>{fingers}</robot>'


def turned_mesh(path: Path, outline: tuple[tuple[float, float], ...], sides: int) -> Path:
    """A body of revolution about z with that many sides, from the points (r, z) of its outline,
    counter-clockwise with z up and r to the right.
    """
    lines = [
        f"v {r * math.cos(2 * math.pi * k / sides)!r} {r * math.sin(2 * math.pi * k / sides)!r} {z!r}"
        for r, z in outline
        for k in range(sides)
    ]
    for i in range(len(outline)):
        j = (i + 1) % len(outline)
        for k in range(sides):
            a, b = (i * sides + m % sides + 1 for m in (k, k + 1))
            d, c = (j * sides + m % sides + 1 for m in (k, k + 1))
            lines += [f"f {a} {b} {d}"] if outline[i][0] else []
            lines += [f"f {b} {c} {d}"] if outline[j][0] else []
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def quaternion(rpy: tuple[float, float, float]) -> tuple[float, float, float, float]:
    """w, x, y, z."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in rpy)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def _list(values: tuple[float, ...]) -> str:
    return " ".join(repr(float(v)) for v in values)
