"""Rooms for learning: a walled square with boxes and pillars, as SDF, from a number. The same
number gives the same room everywhere.
"""

from __future__ import annotations

import random
from dataclasses import dataclass

__all__ = ["Room", "make_room"]

TEST_ROOMS = 1_000_000  # rooms from this number on are never used for training


@dataclass(frozen=True)
class Room:
    """A room with a start that is free around it, and a goal."""

    number: int
    sdf: str
    start: tuple[float, float, float]  # m, m, rad
    goal: tuple[float, float]  # m


def _wall(name: str, x: float, y: float, heading: float, size: tuple[float, float, float]) -> str:
    return (
        f"<model name='{name}'><static>true</static><pose>{x:.4f} {y:.4f} {size[2] / 2:.4f} 0 0 {heading:.4f}</pose><link name='link'>"
        f"<collision name='c'><geometry><box><size>{size[0]:.4f} {size[1]:.4f} {size[2]:.4f}</size></box></geometry></collision>"
        f"<visual name='v'><geometry><box><size>{size[0]:.4f} {size[1]:.4f} {size[2]:.4f}</size></box></geometry></visual></link></model>"
    )


def _pillar(name: str, x: float, y: float, radius: float) -> str:
    shape = (
        f"<geometry><cylinder><radius>{radius:.4f}</radius><length>1</length></cylinder></geometry>"
    )
    return (
        f"<model name='{name}'><static>true</static><pose>{x:.4f} {y:.4f} 0.5 0 0 0</pose><link name='link'>"
        f"<collision name='c'>{shape}</collision><visual name='v'>{shape}</visual></link></model>"
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
    # random.Random's own numbers for one seed are promised to stay; shuffle() and the like are not,
    # so only random() is used.
    draw = random.Random(number)

    def between(low: float, high: float) -> float:
        return low + (high - low) * draw.random()

    reach = size / 2 - 0.7
    start = (between(-reach, reach), between(-reach, reach), between(-3.1, 3.1))
    goal = start[:2]
    while (goal[0] - start[0]) ** 2 + (goal[1] - start[1]) ** 2 < (size / 2) ** 2:
        goal = (between(-reach, reach), between(-reach, reach))
    models = [
        _wall(f"wall{i}", *place, (size + 0.2, 0.1, 1.0))
        for i, place in enumerate(
            [
                (0, size / 2, 0),
                (0, -size / 2, 0),
                (size / 2, 0, 1.5707963),
                (-size / 2, 0, 1.5707963),
            ]
        )
    ]
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
    place = f"{start[0]:.4f} {start[1]:.4f} 0 0 0 {start[2]:.4f}"
    sdf = (
        "<sdf version='1.9' xmlns:ruedo='urn:ruedo'>"
        f"<world name='room-{number}'>"
        "<physics type='bullet'><max_step_size>0.005</max_step_size></physics>"
        "<include><uri>model://ground_plane</uri></include>"
        f"<include><uri>model://{robot}</uri><name>robot</name><pose>{place}</pose></include>{''.join(models)}</world></sdf>"
    )
    return Room(number, sdf, start, goal)
