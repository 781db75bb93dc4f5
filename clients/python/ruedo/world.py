"""A world that a program builds."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape  # xml.sax brings in urllib and ssl, 20 ms at each start of a program
from pathlib import Path

from . import arguments

Colour = tuple[float, float, float]
Way = Sequence[tuple[float, ...]]


class World:
    """Builds a world: a plane, and what is put on it. Lengths in m, angles in rad, positions of
    centres.

        world = World().wall(0, 3, 6, 3).box(2, 1, colour=(0.9, 0.1, 0.1)).robot("p3at", 0, 0)
        with ruedo.launch(world) as sim: ...
        engine = ruedo.Engine(world, worlds=64)

    colour: red, green and blue, each from 0 to 1; None: grey. texture: a picture (PNG, JPEG), which
    covers each side of a box and goes once around a cylinder; a colour tints it. str(world) is the
    world's SDF.
    """

    def __init__(self, name: str = "built", *, step: float = 0.005):
        """step: s, of the simulation."""
        self._name, self._step = name, _positive("step", step)
        self._models: list[str] = []
        self._names: set[str] = set()

    def box(
        self,
        x: float,
        y: float,
        *,
        size: tuple[float, float, float] = (0.5, 0.5, 0.5),
        heading: float = 0.0,
        mass: float | None = None,
        colour: Colour | None = None,
        texture: str | os.PathLike[str] | None = None,
        path: Way | None = None,
        name: str = "box",
    ) -> World:
        """size: along x, y, z. mass: kg, of one that can be pushed; None: it never moves. path: of
        one that moves by itself, again and again: (s, x, y) or (s, x, y, heading) each.
        """
        a, b, c = (_positive("size", s) for s in size)
        inertia = None if mass is None else (b * b + c * c, a * a + c * c, a * a + b * b)
        shape = f"<box><size>{a!r} {b!r} {c!r}</size></box>"
        return self._add(
            name,
            shape,
            (x, y, c / 2.0),
            heading,
            mass,
            inertia and [i / 12.0 for i in inertia],
            _material(colour, texture),
            "" if path is None else _path(path, c / 2.0),
        )

    def cylinder(
        self,
        x: float,
        y: float,
        *,
        radius: float = 0.25,
        height: float = 0.5,
        mass: float | None = None,
        colour: Colour | None = None,
        texture: str | os.PathLike[str] | None = None,
        name: str = "cylinder",
    ) -> World:
        """Upright. mass: kg, of one that can be pushed; None: it never moves."""
        r, h = _positive("radius", radius), _positive("height", height)
        side = (3.0 * r * r + h * h) / 12.0
        return self._add(
            name,
            f"<cylinder><radius>{r!r}</radius><length>{h!r}</length></cylinder>",
            (x, y, h / 2.0),
            0.0,
            mass,
            None if mass is None else [side, side, r * r / 2.0],
            _material(colour, texture),
        )

    def wall(
        self,
        x1: float,
        y1: float,
        x2: float,
        y2: float,
        *,
        height: float = 1.0,
        thickness: float = 0.1,
        colour: Colour | None = None,
        texture: str | os.PathLike[str] | None = None,
        name: str = "wall",
    ) -> World:
        """From one point to another, which are the middle of its ends."""
        for what, end in (("x1", x1), ("y1", y1), ("x2", x2), ("y2", y2)):
            _finite(what, end)
        length = _positive("the length of a wall", math.hypot(x2 - x1, y2 - y1))
        return self.box(
            (x1 + x2) / 2.0,
            (y1 + y2) / 2.0,
            size=(length, thickness, height),
            heading=math.atan2(y2 - y1, x2 - x1),
            colour=colour,
            texture=texture,
            name=name,
        )

    def robot(
        self,
        model: str,
        x: float = 0.0,
        y: float = 0.0,
        heading: float = 0.0,
        *,
        name: str | None = None,
        sensors: Mapping[str, str] | None = None,
        link: str = "base_link",
    ) -> World:
        """model: one of Ruedo's ("p3at"), or a file or model:// that the server finds. name: by
        default the model's, with a number if that is taken. sensors: further ones of a link, by
        name, each an SDF type ("navsat", "imu") or its whole content ("<sensor type='camera'>...").
        """
        arguments.text("model", model)
        uri = model if "://" in model or os.sep in model else f"model://{model}"
        if name in self._names:
            raise ValueError(f"name is {arguments.shown(name)}, which another model has")
        own = self._unused(name or Path(model).stem)
        self._models.append(
            f"<include><uri>{escape(uri)}</uri><name>{escape(own)}</name>"
            f"<pose>{_finite('x', x)!r} {_finite('y', y)!r} 0 0 0 {_finite('heading', heading)!r}</pose>{_added(sensors or {}, link)}</include>"
        )
        return self

    def door(
        self,
        x1: float,
        y1: float,
        x2: float,
        y2: float,
        *,
        height: float = 2.0,
        thickness: float = 0.06,
        distance: float = 1.5,
        colour: Colour | None = None,
        name: str = "door",
    ) -> World:
        """A sliding door from one point to another: it opens along itself while a robot or a person
        is within the distance (m) of its middle.
        """
        length = _positive("the length of a door", math.hypot(x2 - x1, y2 - y1))
        box = f"<box><size>{length!r} {thickness!r} {_positive('height', height)!r}</size></box>"
        return self._add(
            name,
            box,
            ((x1 + x2) / 2.0, (y1 + y2) / 2.0, height / 2.0),
            math.atan2(y2 - y1, x2 - x1),
            None,
            None,
            _material(colour, None),
            f"<ruedo:door><ruedo:open>{length!r} 0 0 0 0 0</ruedo:open>"
            f"<ruedo:distance>{_positive('distance', distance)!r}</ruedo:distance></ruedo:door>",
        )

    def people(
        self,
        count: int,
        area: tuple[float, float, float, float],
        *,
        goals: Iterable[tuple[float, ...]] = (),
        speed: float = 1.34,
        name: str = "people",
    ) -> World:
        """People who walk to their goals and avoid what is in their way: `name`_1 to `name`_COUNT.
        area: x, y, x, y of two corners (m), where they start. goals: x, y each, or corners as of
        the area; none: places in the area. speed: m/s, on average.
        """
        places = "".join(
            f"<ruedo:goal>{' '.join(repr(_finite('goals', one)) for one in goal)}</ruedo:goal>"
            for goal in goals
        )
        corners = " ".join(repr(_finite("area", one)) for one in area)
        return self.sdf(
            f'<ruedo:crowd name="{escape(self._unused(name))}"><ruedo:count>{arguments.whole("count", count, 1)}</ruedo:count>'
            f"<ruedo:area>{corners}</ruedo:area>{places}<ruedo:speed>{_positive('speed', speed)!r} 0.26</ruedo:speed></ruedo:crowd>"
        )

    def person(self, path: Way, *, name: str = "person") -> World:
        """A person who walks along a path, again and again.

        path: (s, x, y) or (s, x, y, heading).
        """
        points = "".join(
            f"<waypoint><time>{point[0]!r}</time><pose>{point[1]!r} {point[2]!r} 0 0 0 {point[3]!r}</pose></waypoint>"
            for point in _points(path)
        )
        return self.sdf(
            f'<actor name="{escape(self._unused(name))}"><script><loop>true</loop><auto_start>true</auto_start>'
            f'<trajectory id="0" type="walk">{points}</trajectory></script></actor>'
        )

    def sdf(self, element: str) -> World:
        """Adds an element of SDF to the ``<world>`` as it is: whatever this class has no method
        for, such as ``<ruedo:crowd>``, a heightmap or a model of your own.
        """
        self._models.append(arguments.text("element", element))
        return self

    def __str__(self) -> str:
        lines = "\n    ".join(
            [
                "<include><uri>model://sun</uri></include>",
                "<include><uri>model://ground_plane</uri></include>",
                *self._models,
            ]
        )
        return (
            f'<sdf version="1.9" xmlns:ruedo="urn:ruedo" xmlns:experimental="http://sdformat.org/schemas/experimental">\n  <world name="{escape(self._name)}">\n'
            f'    <physics name="step" type="bullet"><max_step_size>{self._step!r}</max_step_size></physics>\n    {lines}\n  </world>\n</sdf>\n'
        )

    def __repr__(self) -> str:
        return f"<World {self._name}: {', '.join(sorted(self._names)) or 'empty'}>"

    def _add(
        self,
        name: str,
        shape: str,
        position: tuple[float, float, float],
        heading: float,
        mass: float | None,
        inertia_of_1_kg: list[float] | None,
        material: str,
        moves: str = "",
    ) -> World:
        """moves: what moves one without a mass."""
        pose = (
            " ".join(repr(_finite("position", p)) for p in position)
            + f" 0 0 {_finite('heading', heading)!r}"
        )
        geometry = f"<geometry>{shape}</geometry>"
        if moves and mass is not None:
            raise ValueError("path: what moves by itself has no mass that can be pushed")
        if moves:
            body = f"{moves}<link name='link'>"
        elif mass is None or inertia_of_1_kg is None:
            body = "<static>true</static><link name='link'>"
        else:
            kg = _positive("mass", mass)
            moments = "".join(
                f"<i{axis}{axis}>{kg * i!r}</i{axis}{axis}>"
                for axis, i in zip("xyz", inertia_of_1_kg)
            )
            body = f"<link name='link'><inertial><mass>{kg!r}</mass><inertia>{moments}</inertia></inertial>"
        self._models.append(
            f'<model name="{escape(self._unused(name))}"><pose>{pose}</pose>{body}'
            f"<collision name='collision'>{geometry}</collision><visual name='visual'>{geometry}{material}</visual></link></model>"
        )
        return self

    def _unused(self, name: str) -> str:
        number, own = 1, name
        while own in self._names:
            number += 1
            own = f"{name}_{number}"
        self._names.add(own)
        return own


def _points(path: Way) -> list[tuple[float, float, float, float]]:
    """Each with its heading. Raises ValueError."""
    made: list[tuple[float, float, float, float]] = []
    for point in path:
        if not isinstance(point, (tuple, list)) or len(point) not in (3, 4):
            raise ValueError(
                f"path: {arguments.shown(point)} needs (s, x, y) or (s, x, y, heading)"
            )
        numbers = [_finite("path", one) for one in point]
        made.append((numbers[0], numbers[1], numbers[2], numbers[3] if len(numbers) > 3 else 0.0))
    if len(made) < 2:
        raise ValueError("path: it has at least two points")
    return made


def _path(path: Way, z: float) -> str:
    points = "".join(
        f"<ruedo:waypoint>{t!r} {x!r} {y!r} {z!r} 0 0 {heading!r}</ruedo:waypoint>"
        for t, x, y, heading in _points(path)
    )
    return f"<ruedo:path>{points}</ruedo:path>"


def _added(sensors: Mapping[str, str], link: str) -> str:
    """The SDF that adds sensors to a robot's link, by parameter passing."""
    if not sensors:
        return ""
    made = ""
    for name, kind in sensors.items():
        inner = kind.partition(">")[2].rpartition("</sensor>")[0] if kind.startswith("<") else ""
        found = re.search(r"type=['\"](\w+)['\"]", kind) if kind.startswith("<") else None
        plain = found[1] if found else kind
        made += (
            f'<sensor element_id="{escape(link)}" action="add" name="{escape(name)}" '
            f'type="{escape(plain)}">{inner}</sensor>'
        )
    return f"<experimental:params>{made}</experimental:params>"


def _material(colour: Colour | None, texture: str | os.PathLike[str] | None) -> str:
    if colour is None and texture is None:
        return ""
    rgb = (1.0, 1.0, 1.0) if colour is None else colour
    if not isinstance(rgb, (tuple, list)) or len(rgb) != 3:
        raise ValueError(
            f"colour is {arguments.shown(colour)}: it must be red, green and blue, from 0 to 1"
        )
    if not all(0.0 <= _finite("colour", part) <= 1.0 for part in rgb):
        raise ValueError(f"colour is {arguments.shown(colour)}: its parts must be from 0 to 1")
    values = " ".join(repr(float(part)) for part in rgb) + " 1"
    paint = f"<ambient>{values}</ambient><diffuse>{values}</diffuse>"
    if texture is not None:
        file = Path(arguments.path("texture", texture)).absolute()
        if not file.is_file():
            raise ValueError(f"texture {arguments.shown(str(texture))}: there is no such file")
        picture = f"<albedo_map>{escape(str(file))}</albedo_map>"
        paint += f"<pbr><metal>{picture}</metal></pbr>"
    return f"<material>{paint}</material>"


def _finite(what: str, value: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{what} is {arguments.shown(value)}: it must be a finite number")
    return arguments.finite(what, value)


def _positive(what: str, value: float) -> float:
    if not _finite(what, value) > 0.0:
        raise ValueError(f"{what} is {arguments.shown(value)}: it must be > 0")
    return float(value)
