"""The tests: each sets up a scene, measures one number in any simulator, and knows its expected
value.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import piles
from scenes import (
    BOUNCING_PLANE,
    GRAVITY,
    PLANE,
    Body,
    Chain,
    Scene,
    Shape,
    flat_mesh,
    gripper,
    skid_steered,
    turned_mesh,
)
from simulators import Simulator

Make = Callable[[Scene, float], Simulator]  # a simulator's class
Series = list[tuple[float, float]]  # s, value


@dataclass(frozen=True)
class Row:
    key: str
    group: str
    title: str
    unit: str
    reference: float
    source: str  # of the reference
    measure: Callable[[Make, float, Series], float]  # the series may be filled with values to plot
    digits: int = 4
    long: bool = False  # takes more than a few seconds


def steps(seconds: float, step_s: float) -> int:
    return round(seconds / step_s)


# Flight and rotation


def flight(make: Make, step_s: float, series: Series) -> float:
    with make(Scene((Body("ball", (Shape("sphere", (0.1,)),), at=(0, 0, 5)),)), step_s) as sim:
        sim.set_velocity("ball", (2, 0, 3))
        sim.step(steps(1.0, step_s))
        return sim.position("ball")[2]


def tumbling(make: Make, step_s: float, series: Series) -> float:
    moments = (0.01, 0.02, 0.025)
    with make(
        Scene((Body("brick", (Shape("box", (0.1, 0.1, 0.1)),), inertia=moments),), gravity=0.0),
        step_s,
    ) as sim:

        def energy() -> float:
            own = sim.rotation("brick").T @ sim.velocity("brick")[1]
            return 0.5 * float(np.dot(moments, own * own))

        sim.set_velocity("brick", (0, 0, 0), (0.1, 5.0, 0.1))
        before = 0.5 * (0.01 * 0.01 + 0.02 * 25 + 0.025 * 0.01)
        for i in range(60):
            sim.step(steps(0.1, step_s))
            series.append((0.1 * (i + 1), energy() / before))
        return energy() / before


# Mechanisms

LINK = (0.001, 0.02, 0.02)


def pendulum_period(amplitude: float) -> float:
    """4 sqrt(J / m g r) K(sin(a / 2)), by the arithmetic-geometric mean."""
    a, b = 1.0, math.cos(amplitude / 2)
    for _ in range(30):
        a, b = (a + b) / 2, math.sqrt(a * b)
    return 2 * math.pi * math.sqrt((0.1 + 2 * 0.25) / (2 * GRAVITY * 0.5)) / a


def angle_about_y(rotation: np.ndarray) -> float:
    return math.atan2(rotation[0, 2], rotation[2, 2])


def pendulum(amplitude: float) -> Callable[[Make, float, Series], float]:
    def measure(make: Make, step_s: float, series: Series) -> float:
        # At rest along x; hanging is pi / 2 about y.
        urdf = (
            Chain()
            .add(
                "arm",
                (0, 0, 1),
                2.0,
                (0.5, 0, 0),
                (0.01, 0.1, 0.1),
                rpy=(0, math.pi / 2 - amplitude, 0),
            )
            .urdf()
        )
        with make(Scene(urdf=urdf), step_s) as sim:
            crossings, last, i = [], -amplitude, 0
            while len(crossings) < 3 and i * step_s < 12.0:
                sim.step(1)
                i += 1
                angle = math.remainder(
                    angle_about_y(sim.rotation("arm")) - math.pi / 2, 2 * math.pi
                )
                if abs(angle) < 1.0 and last * angle < 0.0 and abs(last) < 1.0:
                    crossings.append((i - angle / (angle - last)) * step_s)
                last = angle
            return crossings[2] - crossings[0] if len(crossings) == 3 else math.nan

    return measure


def double_pendulum(make: Make, step_s: float, series: Series) -> float:
    chain = (
        Chain()
        .add("a", (0, 0, 2), 1.0, (0.25, 0, 0), LINK, rpy=(0, -1, 0))
        .add("b", (0.5, 0, 0), 1.0, (0.25, 0, 0), LINK, rpy=(0, 0.5, 0))
    )
    with make(Scene(urdf=chain.urdf()), step_s) as sim:

        def energy() -> float:
            total = 0.0
            for link in ("a", "b"):
                rotation, (linear, angular) = sim.rotation(link), sim.velocity(link)
                center = rotation @ np.array([0.25, 0, 0])
                v, own = linear + np.cross(angular, center), rotation.T @ angular
                total += (
                    0.5 * float(v @ v)
                    + 0.5 * float(np.dot(LINK, own * own))
                    + GRAVITY * (sim.position(link)[2] + center[2] - 2.0)
                )
            return total

        before, scale = energy(), GRAVITY * (0.25 + 0.75)
        for i in range(40):
            sim.step(steps(0.5, step_s))
            series.append((0.5 * (i + 1), 100 * (energy() - before) / (before + scale)))
        return series[-1][1]


def arm() -> str:
    """Six links of 0.2 m and 1 kg, stretched out, 5 kg at the tip; every second joint turns about
    z.
    """
    chain = Chain()
    for i in range(6):
        chain.add(
            f"l{i}",
            (0, 0, 1) if i == 0 else (0.2, 0, 0),
            6.0 if i == 5 else 1.0,
            (0.1, 0, 0),
            (0.001, 0.004, 0.004),
            "0 1 0" if i % 2 == 0 else "0 0 1",
        )
    return chain.urdf()


JOINTS = [f"to_l{i}" for i in range(6)]


def arm_creep(make: Make, step_s: float, series: Series) -> float:
    with make(Scene(urdf=arm(), commands=True), step_s) as sim:
        sim.hold(JOINTS, "velocity", 0.0)
        sim.step(steps(1.0, step_s))
        start = sim.position("l5")
        sim.step(steps(9.0, step_s))
        return float(np.linalg.norm(sim.position("l5") - start)) / 9.0  # over 1 m: rad/s


def arm_error(make: Make, step_s: float, series: Series) -> float:
    """With all joints commanded to 0.2 rad from the stretched pose: the position of its last joint
    4 s later, against the product of the rotations.
    """
    at, turned = np.array([0.0, 0.0, 1.0]), np.eye(3)
    c, s = math.cos(0.2), math.sin(0.2)
    about_y, about_z = (
        np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    )
    for i in range(5):
        turned = turned @ (about_y if i % 2 == 0 else about_z)
        at = at + turned @ np.array([0.2, 0, 0])
    with make(Scene(urdf=arm(), commands=True), step_s) as sim:
        sim.hold(JOINTS, "position", 0.2)
        sim.step(steps(4.0, step_s))
        return 1e3 * float(np.linalg.norm(sim.position("l5") - at))


def slow_joint(make: Make, step_s: float, series: Series) -> float:
    urdf = Chain().add("arm", (0, 0, 1), 1.0, (0.2, 0, 0), LINK, "0 0 1").urdf()
    with make(Scene(urdf=urdf, commands=True), step_s) as sim:
        sim.hold(["to_arm"], "velocity", 0.005)
        sim.step(steps(60.0, step_s))
        rotation = sim.rotation("arm")
        return math.atan2(rotation[1, 0], rotation[0, 0])


def damper(damping: float) -> Callable[[Make, float, Series], float]:
    def measure(make: Make, step_s: float, series: Series) -> float:
        chain = Chain().add(
            "load", (0, 0, 1), 5.0, (0, 0, 0), LINK, "0 0 1", kind="prismatic", damping=damping
        )
        with make(Scene(urdf=chain.urdf()), step_s) as sim:
            sim.step(steps(1.0, step_s))
            start = sim.position("load")[2]
            sim.step(steps(4.0, step_s))
            return 1e3 * float(start - sim.position("load")[2]) / 4.0

    return measure


def gripping(what: str) -> Callable[[Make, float, Series], float]:
    """A box of 0.5 kg between fingers that press it by 20 N, mu 0.6."""

    def measure(make: Make, step_s: float, series: Series) -> float:
        held = Body("box", (Shape("box", (0.04,) * 3, friction=0.6),), mass=0.5, at=(0, 0.003, 1))
        with make(Scene((held,), urdf=gripper(), commands=True), step_s) as sim:
            sim.push("to_left", 20.0)
            sim.step(steps(1.0, step_s))
            start, fastest = sim.position("box"), 0.0
            for i in range(50):
                sim.step(steps(0.1, step_s))
                fastest = max(fastest, float(np.linalg.norm(sim.velocity("left")[0])))
                slip = float(np.linalg.norm(sim.position("box") - start))
                series.append((0.1 * (i + 1), 1e3 * slip))
            return 1e3 * fastest if what == "speed" else series[-1][1]

    return measure


# Contacts


def box(name: str = "box", **more) -> Body:
    friction = more.pop("friction", 0.8)
    return Body(name, (Shape("box", (0.2, 0.2, 0.2), friction=friction),), **more)


def sliding(angle: float) -> Callable[[Make, float, Series], float]:
    def measure(make: Make, step_s: float, series: Series) -> float:
        with make(Scene((PLANE, box(friction=0.4, at=(0, 0, 0.1)))), step_s) as sim:
            sim.step(steps(0.2, step_s))
            start = sim.position("box")
            sim.set_velocity("box", (math.cos(angle), math.sin(angle), 0))
            sim.step(steps(1.0, step_s))
            return float(np.linalg.norm((sim.position("box") - start)[:2]))

    return measure


def slope(angle: float, body: Body) -> Scene:
    """A body that touches a slope descending along x."""
    height = body.shapes[0].size[0] / (2 if body.shapes[0].kind == "box" else 1)
    at = (height * math.sin(angle), 0.0, height * math.cos(angle))
    hill = Body(
        "hill",
        (Shape("box", (40.0, 4.0, 1.0)),),
        mass=0.0,
        at=(-0.5 * math.sin(angle), 0, -0.5 * math.cos(angle)),
        rpy=(0, angle, 0),
    )
    return Scene((hill, Body(body.name, body.shapes, at=at, rpy=(0, angle, 0))))


def creep(make: Make, step_s: float, series: Series) -> float:
    with make(slope(math.atan(0.8) - 0.01, box()), step_s) as sim:
        sim.step(steps(1.0, step_s))
        start = sim.position("box")
        sim.step(steps(10.0, step_s))
        return 1e3 * float(np.linalg.norm(sim.position("box") - start))


def slide_down(make: Make, step_s: float, series: Series) -> float:
    with make(slope(0.8, box()), step_s) as sim:
        sim.step(steps(0.5, step_s))
        before = np.linalg.norm(sim.velocity("box")[0])
        sim.step(steps(0.5, step_s))
        return float(np.linalg.norm(sim.velocity("box")[0]) - before) / 0.5


def roll_down(make: Make, step_s: float, series: Series) -> float:
    with make(slope(0.3, Body("ball", (Shape("sphere", (0.1,)),))), step_s) as sim:
        sim.step(steps(0.5, step_s))
        before = np.linalg.norm(sim.velocity("ball")[0])
        sim.step(steps(0.5, step_s))
        return float(np.linalg.norm(sim.velocity("ball")[0]) - before) / 0.5


def bounce(restitution: float) -> Callable[[Make, float, Series], float]:
    def measure(make: Make, step_s: float, series: Series) -> float:
        if make.__name__ == "MuJoCo":
            return math.nan
        ball = Body("ball", (Shape("sphere", (0.1,), restitution=restitution),), at=(0, 0, 1.1))
        with make(Scene((BOUNCING_PLANE, ball)), step_s) as sim:
            highest, up = 0.0, False
            for i in range(steps(1.3, step_s)):
                sim.step(1)
                z = sim.position("ball")[2] - 0.1
                series.append((step_s * (i + 1), z))
                up = up or sim.velocity("ball")[0][2] > 0.05
                highest = max(highest, z) if up else 0.0
            return highest

    return measure


def spinning(make: Make, step_s: float, series: Series) -> float:
    ball = Body("ball", (Shape("sphere", (0.1,), torsion_m=0.005),), at=(0, 0, 0.1))
    with make(Scene((PLANE, ball)), step_s) as sim:
        sim.step(steps(0.2, step_s))
        sim.set_velocity("ball", (0, 0, 0), (0, 0, 10))
        sim.step(steps(0.4, step_s))
        return float(sim.velocity("ball")[1][2])


DISK, SPIN = 0.1, 20.0  # m, rad/s


@cache
def way_of_disk(speed: float, mu: float) -> float:
    """How far a disk slides whose load is spread evenly, and which spins: the integral of Coulomb
    friction over its face, by quadrature, and Heun's method.
    """
    r, a = np.meshgrid((np.arange(40) + 0.5) / 40 * DISK, (np.arange(80) + 0.5) / 80 * 2 * math.pi)
    x, y, area = r * np.cos(a), r * np.sin(a), r / r.sum()

    def slowing(v: float, w: float) -> tuple[float, float]:
        u, side = v - w * y, w * x
        size = np.hypot(u, side) + 1e-12
        force = float((area * u / size).sum())
        moment = float((area * (x * side - y * u) / size).sum())
        return -mu * GRAVITY * force, -mu * GRAVITY * moment / (DISK**2 / 2)

    v, w, way, dt = speed, SPIN, 0.0, 2e-4
    while v > 1e-3:
        a1, b1 = slowing(v, w)
        a2, b2 = slowing(v + a1 * dt, w + b1 * dt)
        way += dt * (v + a1 * dt / 2)
        v, w = v + (a1 + a2) / 2 * dt, w + (b1 + b2) / 2 * dt
    return way


def turning_disk(make: Make, step_s: float, series: Series) -> float:
    disk = Body("disk", (Shape("cylinder", (DISK, 0.02), friction=0.4),), at=(0, 0, 0.01))
    with make(Scene((PLANE, disk)), step_s) as sim:
        sim.step(steps(0.2, step_s))
        start = sim.position("disk")
        sim.set_velocity("disk", (1, 0, 0), (0, 0, SPIN))
        sim.step(steps(2.0, step_s))
        return float(np.linalg.norm((sim.position("disk") - start)[:2]))


# Small, thin, round and fast


def resting(
    shape: Shape, height: float, seconds: float, rpy: tuple[float, float, float] = (0, 0, 0)
) -> Callable[[Make, float, Series], float]:
    """How far it moves, of water's density, put down on a plane."""

    def measure(make: Make, step_s: float, series: Series) -> float:
        size = shape.size
        volume = math.prod(size) if shape.kind == "box" else math.pi * size[0] ** 2 * size[1]
        body = Body("thing", (shape,), mass=1e3 * volume, at=(0, 0, height), rpy=rpy)
        with make(Scene((PLANE, body)), step_s) as sim:
            sim.step(steps(seconds, step_s))
            return 1e3 * float(np.linalg.norm(sim.position("thing") - np.array(body.at)))

    return measure


SPEEDS = (2, 4, 7, 10, 15, 18, 22, 28, 35, 45, 60, 80)  # m/s


def tunnelling(make: Make, step_s: float, series: Series) -> float:
    """How many of 72 balls of 5 cm pass walls of 2, 10 and 100 mm, from two distances."""
    walls, balls = [], {}
    for i, thickness in enumerate((0.002, 0.01, 0.1)):
        at = (thickness / 2, 30.0 * i, 0)
        walls.append(Body(f"w{i}", (Shape("box", (thickness, 28, 2)),), mass=0.0, at=at))
        for k, speed in enumerate((*SPEEDS, *SPEEDS)):
            start = (-0.31 if k < len(SPEEDS) else -0.503, 30.0 * i + k - 11.5, 0)
            balls[f"b{i}_{k}"] = (
                speed,
                Body(f"b{i}_{k}", (Shape("sphere", (0.05,)),), mass=0.5, at=start),
            )
    bodies = (*walls, *(body for _, body in balls.values()))
    with make(Scene(bodies, gravity=0.0), step_s) as sim:
        for name, (speed, _) in balls.items():
            sim.set_velocity(name, (speed, 0, 0))
        sim.step(steps(0.3, step_s))
        return float(sum(sim.position(name)[0] > 0.0 for name in balls))


def through_mesh(make: Make, step_s: float, series: Series) -> float:
    """How many of 24 balls of 2 to 10 mm pass a floor of triangles."""
    balls = [
        Body(f"b{i}", (Shape("sphere", (r,)),), mass=1e3 * 4.19 * r**3, at=(x, 0.013 * i, 0.1 + r))
        for i, (r, x) in enumerate((1e-3 * r, 0.1 * k) for r in (1, 2, 3, 5) for k in range(6))
    ]
    with make(Scene((floor(), *balls)), step_s) as sim:
        sim.step(steps(1.0, step_s))
        return float(sum(sim.position(ball.name)[2] < -0.001 for ball in balls))


CUP = ((0, 0), (0.04, 0), (0.04, 0.1), (0.037, 0.1), (0.037, 0.003), (0, 0.003))
PRISM = ((0, -0.15), (0.1, -0.15), (0.1, 0.15), (0, 0.15))


@cache
def solid(name: str, outline: tuple[tuple[float, float], ...], sides: int) -> Shape:
    folder = Path(tempfile.mkdtemp(prefix="ruedo-solid-"))
    return Shape("solid", file=turned_mesh(folder / f"{name}.obj", outline, sides), friction=0.5)


def in_cup(make: Make, step_s: float, series: Series) -> float:
    """The height of a ball that fell into a loose cup, over the cup's origin."""
    cup = Body("cup", (solid("cup", CUP, 32),), mass=0.2, inertia=(5e-4,) * 3)
    ball = Body("ball", (Shape("sphere", (0.025,)),), mass=0.05, at=(0.003, 0.002, 0.13))
    with make(Scene((PLANE, cup, ball)), step_s) as sim:
        sim.step(steps(2.0, step_s))
        return float(sim.position("ball")[2] - sim.position("cup")[2])


def lying_prism(make: Make, step_s: float, series: Series) -> float:
    """How far a meshed cylinder of 64 sides moves that lies on one of them."""
    flat = 0.1 * math.cos(math.pi / 64)
    turn = math.pi / 64  # a side points down
    body = Body(
        "prism",
        (solid("prism", PRISM, 64),),
        at=(0, 0, flat),
        rpy=(math.pi / 2, turn, 0),
        inertia=(0.01, 0.01, 0.005),
    )
    with make(Scene((PLANE, body)), step_s) as sim:
        sim.step(steps(0.5, step_s))
        start = sim.position("prism")
        sim.step(steps(20.0, step_s))
        return 1e3 * float(np.linalg.norm(sim.position("prism") - start))


def dominoes(make: Make, step_s: float, series: Series) -> float:
    """How many of 20 dominoes of 48 x 24 x 7.6 mm fall after the first one."""
    shape = Shape("box", (0.0076, 0.024, 0.048), friction=0.4)
    row = [Body("d0", (shape,), mass=0.01, at=(0, 0, 0.0241), rpy=(0, 0.3, 0))]
    row += [Body(f"d{i}", (shape,), mass=0.01, at=(0.02 * i, 0, 0.024)) for i in range(1, 20)]
    with make(Scene((PLANE, *row)), step_s) as sim:
        sim.step(steps(2.0, step_s))
        return float(sum(sim.position(body.name)[2] < 0.02 for body in row))


# Stacks


def pyramid(make: Make, step_s: float, series: Series) -> float:
    scene = piles.cylinders()
    with make(scene, step_s) as sim:
        sim.step(steps(10.0, step_s))
        return 1e3 * max(
            float(np.linalg.norm(sim.position(b.name) - np.array(b.at))) for b in scene.free
        )


def stack(boxes: int, top: float = 1.0) -> Callable[[Make, float, Series], float]:
    def measure(make: Make, step_s: float, series: Series) -> float:
        bodies = tuple(
            box(f"b{i}", mass=top if i + 1 == boxes else 1.0, at=(0, 0, 0.1 + 0.2 * i))
            for i in range(boxes)
        )
        with make(Scene((PLANE, *bodies)), step_s) as sim:
            for i in range(60):
                sim.step(steps(1.0, step_s))
                series.append(
                    (
                        i + 1.0,
                        1e3
                        * max(
                            float(np.linalg.norm(sim.position(b.name) - np.array(b.at)))
                            for b in bodies
                        ),
                    )
                )
            return max(value for _, value in series)

    return measure


# A floor of triangles


@cache
def floor() -> Body:
    folder = Path(tempfile.mkdtemp(prefix="ruedo-floor-"))
    return Body("floor", (Shape("mesh", file=flat_mesh(folder, half=2.0, along=5.0)),), mass=0.0)


def rolling(
    body: Body, ground: Callable[[], Body], what: str, heading: float = 0.3
) -> Callable[[Make, float, Series], float]:
    def measure(make: Make, step_s: float, series: Series) -> float:
        radius = body.shapes[0].size[0]
        with make(Scene((ground(), body)), step_s) as sim:
            sim.step(steps(0.2, step_s))
            start = sim.position(body.name)
            ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
            sim.set_velocity(body.name, ahead, (-ahead[1] / radius, ahead[0] / radius, 0))
            worst = 0.0
            for i in range(50):
                sim.step(steps(0.1, step_s))
                aside = float(np.cross(ahead, sim.position(body.name) - start)[2])
                series.append((0.1 * (i + 1), 1e3 * aside))
                worst = max(worst, abs(aside))
            return 1e3 * worst if what == "aside" else float(sim.velocity(body.name)[0] @ ahead)

    return measure


def skidding(left: float, right: float) -> Callable[[Make, float, Series], float]:
    """By what factor the track that follows from its wheels' rates and its turn exceeds the true
    one.
    """

    def measure(make: Make, step_s: float, series: Series) -> float:
        half_base, half_track, radius = 0.1345, 0.197, 0.111
        urdf = skid_steered(half_base, half_track, radius, 0.075, 14.0, 1.5)
        scene = Scene(
            (PLANE,), urdf=urdf, wheels=(("to_fl", "to_rl"), ("to_fr", "to_rr")), friction=0.8
        )
        with make(scene, step_s) as sim:
            sim.drive(left, right)
            sim.step(steps(2.0, step_s))

            def heading() -> float:
                rotation = sim.rotation("base")
                return math.atan2(rotation[1, 0], rotation[0, 0])

            turned, last = 0.0, heading()
            for i in range(16):
                sim.step(steps(0.5, step_s))
                turned += math.remainder(heading() - last, 2 * math.pi)
                last = heading()
                series.append((0.5 * (i + 1), turned))
            return radius * (right - left) * 8.0 / (2 * half_track * turned)

    return measure


def on_wheels(slope: float) -> Scene:
    urdf = skid_steered(0.1345, 0.197, 0.111, 0.075, 14.0, 1.5, ahead=-0.05)
    wheels = (("to_fl", "to_rl"), ("to_fr", "to_rr"))
    return Scene((PLANE,), urdf=urdf, wheels=wheels, friction=0.8, slope=slope)


def parked(make: Make, step_s: float, series: Series) -> float:
    with make(on_wheels(math.radians(35)), step_s) as sim:
        sim.drive(0, 0)
        sim.step(steps(1.0, step_s))
        start = sim.position("base")
        sim.step(steps(5.0, step_s))
        return 1e3 * float(np.linalg.norm(sim.position("base") - start))


def braking(make: Make, step_s: float, series: Series) -> float:
    """How far it slides on locked wheels, of what mu allows."""
    with make(on_wheels(0.0), step_s) as sim:
        sim.drive(10.0, 10.0)
        sim.step(steps(2.0, step_s))
        start, speed = sim.position("base"), float(np.linalg.norm(sim.velocity("base")[0]))
        sim.drive(0, 0)
        sim.step(steps(1.0, step_s))
        way = float(np.linalg.norm(sim.position("base") - start))
        return way / (speed**2 / (2 * 0.8 * GRAVITY))


BALL = Body("ball", (Shape("sphere", (0.1,)),), at=(0, 0, 0.1))
ROLLER = Body("roller", (Shape("cylinder", (0.1, 0.3)),), at=(0, 0, 0.1), rpy=(math.pi / 2, 0, 0))

WHEEL = Body("wheel", (Shape("cylinder", (0.1, 0.01)),), at=(0, 0, 0.1), rpy=(math.pi / 2, 0, 0))

FREE, JOINTED, CONTACT, SIZES, STACKS, MESHES = (
    "Flight and rotation",
    "Mechanisms",
    "Contacts",
    "Small, thin, round and fast",
    "Stacks",
    "Floors of triangles",
)
SKIDDING, WHEELED = "Skid steering", "Standing and braking on wheels"
CLOSED = "closed form"

ROWS = [
    Row(
        "flight",
        FREE,
        "thrown with 2, 3 m/s: height after 1 s",
        "m",
        5 + 3 - GRAVITY / 2,
        CLOSED,
        flight,
        6,
    ),
    Row(
        "tumbling",
        FREE,
        "spun at 5 rad/s about its middle axis: energy after 6 s, of 1",
        "",
        1.0,
        CLOSED,
        tumbling,
        5,
    ),
    Row(
        "pendulum_small",
        JOINTED,
        "pendulum, 0.1 rad: period",
        "s",
        pendulum_period(0.1),
        CLOSED,
        pendulum(0.1),
        5,
    ),
    Row(
        "pendulum_large",
        JOINTED,
        "pendulum, 3.0 rad: period",
        "s",
        pendulum_period(3.0),
        CLOSED,
        pendulum(3.0),
        4,
    ),
    Row(
        "double_pendulum",
        JOINTED,
        "double pendulum: change of its energy in 20 s, of what it has above the lowest",
        "%",
        0.0,
        CLOSED,
        double_pendulum,
        3,
    ),
    Row(
        "arm_velocity",
        JOINTED,
        "arm of six joints, 5 kg at its tip, told to hold still: creep",
        "rad/s",
        0.0,
        CLOSED,
        arm_creep,
        2,
    ),
    Row(
        "arm_position",
        JOINTED,
        "the same arm told 0.2 rad in each joint: error of the last one's place after 4 s",
        "mm",
        0.0,
        CLOSED,
        arm_error,
        3,
    ),
    Row(
        "slow_joint",
        JOINTED,
        "joint told 0.005 rad/s: turned in 60 s",
        "rad",
        0.3,
        CLOSED,
        slow_joint,
        4,
    ),
    *(
        Row(
            f"damper_{c:g}",
            JOINTED,
            f"5 kg on a slider with a damping of {c:g} N s/m: speed of its fall",
            "mm/s",
            1e3 * 5 * GRAVITY / c,
            CLOSED,
            damper(c),
            4,
        )
        for c in (2e4, 1e5)
    ),
    Row(
        "grip_slip",
        JOINTED,
        "0.5 kg between mimic fingers that press by 20 N, mu 0.6: slip in 5 s",
        "mm",
        0.0,
        CLOSED,
        gripping("slip"),
        3,
    ),
    Row(
        "grip_speed",
        JOINTED,
        "the same: speed of a finger, at most",
        "mm/s",
        0.0,
        CLOSED,
        gripping("speed"),
        3,
    ),
    Row(
        "sliding",
        CONTACT,
        "box pushed to 1 m/s, mu 0.4: way",
        "m",
        1 / (2 * 0.4 * GRAVITY),
        CLOSED,
        sliding(0.0),
        5,
    ),
    Row(
        "sliding_45",
        CONTACT,
        "the same, at 45 degrees to its sides",
        "m",
        1 / (2 * 0.4 * GRAVITY),
        CLOSED,
        sliding(math.pi / 4),
        5,
    ),
    Row(
        "creep",
        CONTACT,
        "box on a slope, 0.01 rad less than mu 0.8 holds: way in 10 s",
        "mm",
        0.0,
        CLOSED,
        creep,
        3,
    ),
    Row(
        "slide_down",
        CONTACT,
        "box on a slope of 0.8 rad, mu 0.8: acceleration",
        "m/s^2",
        GRAVITY * (math.sin(0.8) - 0.8 * math.cos(0.8)),
        CLOSED,
        slide_down,
    ),
    Row(
        "roll_down",
        CONTACT,
        "ball on a slope of 0.3 rad: acceleration",
        "m/s^2",
        5 / 7 * GRAVITY * math.sin(0.3),
        CLOSED,
        roll_down,
    ),
    *(
        Row(
            f"bounce_{e:g}",
            CONTACT,
            f"ball from 1 m, restitution {e:g}: height",
            "m",
            e * e,
            CLOSED,
            bounce(e),
        )
        for e in (0.2, 0.5, 1.0)
    ),
    Row(
        "spinning",
        CONTACT,
        "ball that spins at 10 rad/s, moment 5 mm of its load: rate after 0.4 s",
        "rad/s",
        10 - 0.4 * 0.005 * GRAVITY / 0.004,
        CLOSED,
        spinning,
    ),
    Row(
        "turning_disk",
        CONTACT,
        "disk of 10 cm, load spread evenly, at 1 m/s and 20 rad/s, mu 0.4: way",
        "m",
        way_of_disk(1.0, 0.4),
        CLOSED,
        turning_disk,
    ),
    Row(
        "cube_5mm",
        SIZES,
        "cube of 5 mm at rest: moved in 5 s",
        "mm",
        0.0,
        CLOSED,
        resting(Shape("box", (0.005, 0.005, 0.005)), 0.0025, 5.0),
        3,
    ),
    Row(
        "cube_10mm",
        SIZES,
        "cube of 10 mm at rest: moved in 5 s",
        "mm",
        0.0,
        CLOSED,
        resting(Shape("box", (0.01, 0.01, 0.01)), 0.005, 5.0),
        3,
    ),
    Row(
        "slab",
        SIZES,
        "slab of 100 x 100 x 5 mm at rest: moved in 5 s",
        "mm",
        0.0,
        CLOSED,
        resting(Shape("box", (0.1, 0.1, 0.005)), 0.0025, 5.0),
        3,
    ),
    Row(
        "pen",
        SIZES,
        "upright cylinder of 8 mm, 140 mm high: moved in 5 s",
        "mm",
        0.0,
        CLOSED,
        resting(Shape("cylinder", (0.004, 0.14)), 0.07, 5.0),
        3,
    ),
    Row(
        "capsule",
        SIZES,
        "lying capsule, radius 50 mm, length 200 mm: moved in 20 s",
        "mm",
        0.0,
        CLOSED,
        resting(Shape("capsule", (0.05, 0.2)), 0.05, 20.0, (math.pi / 2, 0, 0)),
        3,
    ),
    Row(
        "thin_wheel",
        SIZES,
        "free wheel of 10 cm radius, 10 mm wide, at 1 m/s: aside in 5 s",
        "mm",
        0.0,
        CLOSED,
        rolling(WHEEL, lambda: PLANE, "aside", 0.0),
        3,
    ),
    Row(
        "tunnelling",
        SIZES,
        "balls of 5 cm, 2 to 80 m/s, against walls of 2 to 100 mm: passed, of 72",
        "",
        0.0,
        CLOSED,
        tunnelling,
        3,
    ),
    Row(
        "through_mesh",
        SIZES,
        "balls of 2 to 10 mm from 10 cm onto triangles of 8 cm: passed, of 24",
        "",
        0.0,
        CLOSED,
        through_mesh,
        3,
    ),
    Row(
        "prism",
        SIZES,
        "meshed cylinder of 64 sides, lying: moved in 20 s",
        "mm",
        0.0,
        CLOSED,
        lying_prism,
        3,
    ),
    Row(
        "in_cup",
        SIZES,
        "ball of 50 mm in a cup of triangles: height",
        "m",
        0.028,
        CLOSED,
        in_cup,
    ),
    Row(
        "dominoes",
        SIZES,
        "dominoes of 48 x 24 x 7.6 mm, 20 mm apart: fallen, of 20",
        "",
        20.0,
        CLOSED,
        dominoes,
        3,
    ),
    Row(
        "pyramid",
        STACKS,
        "pyramid of 15 lying cylinders, mu 0.6: furthest from its place in 10 s",
        "mm",
        0.0,
        CLOSED,
        pyramid,
        3,
        long=True,
    ),
    *(
        Row(
            f"stack_{n}",
            STACKS,
            f"{n} boxes: furthest from its place in 60 s",
            "mm",
            0.0,
            CLOSED,
            stack(n),
            3,
            long=True,
        )
        for n in (8, 10, 15)
    ),
    *(
        Row(
            f"heavy_{n}",
            STACKS,
            f"100 kg on {n} of 1 kg: furthest in 60 s",
            "mm",
            0.0,
            CLOSED,
            stack(n + 1, 100.0),
            3,
            long=True,
        )
        for n in (1, 2)
    ),
    Row(
        "ball_aside",
        MESHES,
        "ball rolling at 1 m/s over triangles of 8 cm, 5 s: aside",
        "mm",
        0.0,
        CLOSED,
        rolling(BALL, floor, "aside"),
        3,
    ),
    Row(
        "ball_speed",
        MESHES,
        "the same: speed after 5 s",
        "m/s",
        1.0,
        CLOSED,
        rolling(BALL, floor, "speed"),
    ),
    Row(
        "roller_plane",
        MESHES,
        "lying cylinder rolling on a plane: speed after 5 s",
        "m/s",
        1.0,
        CLOSED,
        rolling(ROLLER, lambda: PLANE, "speed", 0.0),
    ),
    Row(
        "skid_spot",
        SKIDDING,
        "P3-AT, wheels at -1 and 1 rad/s, mu 0.8: track that its wheels would say, of the real one",
        "",
        1 + (0.1345 / 0.197) ** 2,
        CLOSED,
        skidding(-1.0, 1.0),
        3,
    ),
    Row(
        "skid_curve",
        SKIDDING,
        "the same on a curve, wheels at 1 and 3 rad/s",
        "",
        1 + (0.1345 / 0.197) ** 2,
        CLOSED,
        skidding(1.0, 3.0),
        3,
    ),
    Row(
        "parked",
        WHEELED,
        "robot told to stand on a slope of 35 degrees, mu 0.8: moved in 5 s",
        "mm",
        0.0,
        CLOSED,
        parked,
        3,
    ),
    Row(
        "braking",
        WHEELED,
        "the same robot brakes from 1.1 m/s on a plane: way, of v^2 / (2 mu g)",
        "",
        1.0,
        CLOSED,
        braking,
        3,
    ),
    Row(
        "roller_mesh",
        MESHES,
        "lying cylinder rolling over triangles of 8 cm: speed after 5 s",
        "m/s",
        1.0,
        CLOSED,
        rolling(ROLLER, floor, "speed", 0.0),
    ),
]
