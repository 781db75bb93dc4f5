"""Piles, which cost a simulator the most: five scenes, and a generator of others from a seed."""

from __future__ import annotations

import math
import random

from scenes import PLANE, Body, Scene, Shape

QUARTER = math.pi / 2
STEPS_S = (0.001, 0.005, 0.01)  # of generated scenes


def bricks() -> Scene:
    """A ball of 20 kg falls on a wall of 10 x 6 bricks."""
    brick = Shape("box", (0.2, 0.1, 0.1), friction=0.6)
    wall = tuple(
        Body(f"b{row}_{i}", (brick,), mass=2.0, at=(0.2 * i + 0.1 * (row % 2), 0, 0.05 + 0.1 * row))
        for row in range(6)
        for i in range(10)
    )
    ball = Body("ball", (Shape("sphere", (0.15,), friction=0.6),), mass=20.0, at=(0.95, 0.01, 1.15))
    return Scene((PLANE, *wall, ball))


def cylinders() -> Scene:
    """A pyramid of 15 lying cylinders."""
    shape = Shape("cylinder", (0.1, 0.5), friction=0.6)
    return Scene(
        (
            PLANE,
            *(
                Body(
                    f"c{row}_{i}",
                    (shape,),
                    at=(0.2 * i + 0.1 * row, 0, 0.1 + math.sqrt(0.03) * row),
                    rpy=(QUARTER, 0, 0),
                )
                for row in range(5)
                for i in range(5 - row)
            ),
        )
    )


def dominoes() -> Scene:
    """30 dominoes, the first of which leans on the second."""
    shape = Shape("box", (0.02, 0.1, 0.2), friction=0.4)
    return Scene(
        (
            PLANE,
            *(
                Body(
                    f"d{i}",
                    (shape,),
                    mass=0.3,
                    at=(0.06 * i + 0.03 * (i == 0), 0, 0.1),
                    rpy=(0, 0.3 * (i == 0), 0),
                )
                for i in range(30)
            ),
        )
    )


def heap() -> Scene:
    """60 boxes, spheres and cylinders fall in a heap."""
    shapes = (
        Shape("box", (0.2, 0.2, 0.2), friction=0.8),
        Shape("sphere", (0.1,), friction=0.8),
        Shape("cylinder", (0.1, 0.2), friction=0.8),
    )
    return Scene(
        (
            PLANE,
            *(
                Body(
                    f"h{i}",
                    (shapes[i % 3],),
                    at=(
                        0.22 * (i % 4) + 0.03 * (i // 16 % 2),
                        0.22 * (i // 4 % 4) + 0.02 * (i % 3),
                        0.15 + 0.25 * (i // 16),
                    ),
                    rpy=(0.2 * (i % 5), 0.3 * (i % 2), 0),
                )
                for i in range(60)
            ),
        )
    )


def loaded() -> Scene:
    """1000 kg on four boxes of 1 kg."""
    shape = Shape("box", (0.2, 0.2, 0.2), friction=0.8)
    return Scene(
        (
            PLANE,
            *(
                Body(f"s{i}", (shape,), mass=1000.0 if i == 4 else 1.0, at=(0, 0, 0.1 + 0.2 * i))
                for i in range(5)
            ),
        )
    )


SCENES = {
    "20 kg ball falls on a wall of 10 x 6 bricks": bricks,
    "pyramid of 15 cylinders": cylinders,
    "30 dominoes fall": dominoes,
    "60 boxes, spheres, cylinders fall in a heap": heap,
    "1 000 kg on 4 boxes of 1 kg": loaded,
}


def _shape(rng: random.Random, size: float, friction: float) -> Shape:
    kind = rng.choice(("box", "sphere", "cylinder"))
    if kind == "sphere":
        return Shape(kind, (size / 2,), friction=friction)
    if kind == "cylinder":
        return Shape(kind, (size / 2, size * rng.uniform(0.5, 2.0)), friction=friction)
    return Shape(kind, tuple(size * rng.uniform(0.5, 1.5) for _ in range(3)), friction=friction)


def drawn(seed: int) -> tuple[Scene, float]:
    """A scene and its step in seconds: 5 to 200 bodies of 5 mm to 1 m fall in layers."""
    rng = random.Random(seed)
    size = 10 ** rng.uniform(math.log10(0.005), 0.0)
    bodies, friction = round(10 ** rng.uniform(math.log10(5), math.log10(200))), rng.uniform(0.1, 1)
    density, side = 10 ** rng.uniform(2, 3.9), max(2, round(bodies ** (1 / 3)))
    mixed = rng.random() < 0.7
    same = _shape(rng, size, friction)
    made = []
    for i in range(bodies):
        shape = _shape(rng, size * rng.uniform(0.6, 1.2), friction) if mixed else same
        x, y, z = i % side, i // side % side, i // side**2
        pitch = 2.6 * size
        at = tuple(
            pitch * (k + rng.uniform(-0.05, 0.05) + off)
            for k, off in ((x, 0.0), (y, 0.0), (z, 0.6))
        )
        rpy = tuple(rng.uniform(-0.5, 0.5) for _ in range(3))
        made.append(Body(f"p{i}", (shape,), density * size**3, at, rpy))
    return Scene((PLANE, *made)), rng.choice(STEPS_S)
