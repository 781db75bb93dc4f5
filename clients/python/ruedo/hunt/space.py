"""The dimensions that a hunt chooses in, each with a neutral value: parameters, obstacles, faults,
the seed.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

from ..campaign.schema import Source

Choices = dict[str, Any]  # a value for each dimension


@dataclass(frozen=True)
class Dimension:
    """A number from low to high (whole: of whole ones), or one of `options`. simple: where
    shrinking goes.
    """

    name: str
    simple: Any
    low: float = 0.0
    high: float = 0.0
    whole: bool = False
    log: bool = False
    options: tuple[Any, ...] = ()
    owner: str = ""  # the obstacle or fault that it belongs to
    alone: bool = True  # whether a case at its corner alone says anything

    def corners(self) -> list[Any]:
        """Values at which programs break: the ends, the simple value, zero."""
        if self.options:
            return list(self.options)
        zero = [0.0] if self.low < 0.0 < self.high else []
        return [int(one) if self.whole else one for one in (self.low, self.high, *zero)]

    def at(self, p: float) -> Any:
        """The value at a part p of the way, 0 to 1."""
        if self.options:
            return self.options[min(int(p * len(self.options)), len(self.options) - 1)]
        if self.whole:
            return min(int(self.low + p * (self.high - self.low + 1)), int(self.high))
        if self.log:
            return self.low * (self.high / self.low) ** p
        return self.low + p * (self.high - self.low)


# Names of a hunt's own choices, which no parameter may have.
_TAKEN = re.compile(r"duration|fault(_at|_for|_value)?|obstacle\d+(_x|_y|_size)?")

# Of the faults whose value a hunt chooses: from, to.
_VALUES = {
    "lag": (0.1, 3.0),
    "bias": (-1.0, 1.0),
    "scale": (0.2, 2.0),
    "blocked": (0.05, 0.5),
    "clock_drift": (-0.1, 0.1),
    "wheel_slip": (0.05, 0.8),
    "weak_motor": (0.1, 0.9),
    "commands_lost": (0.1, 1.0),
    "commands_late": (0.05, 2.0),
    "commands_doubled": (0.05, 2.0),
}


# Without what never comes at all no program does anything, and a hunt would find nothing else.
_FIRST_MESSAGES_S = 1.0


class Space:
    """content: of a checked campaign's file with its `hunt`."""

    def __init__(self, content: dict[str, Any], source: Source) -> None:
        asked = content.get("hunt", {})
        self.dimensions: list[Dimension] = []
        self.parameters = list(content.get("parameters", {}))
        for name, given in content.get("parameters", {}).items():
            if _TAKEN.fullmatch(name):
                raise source.error(
                    ("parameters", name), "is what a hunt itself chooses; give it another name"
                )
            try:
                self.dimensions.append(_of_parameter(name, given))
            except ValueError as error:
                raise source.error(("parameters", name), str(error)) from None
        obstacles = asked.get("obstacles", {})
        self.obstacles: int = obstacles.get("most", 0)
        self.faults: list[dict[str, Any]] = asked.get("faults", [])
        self._duration: float = content["limits"]["duration"]
        if self.obstacles:
            self._add_obstacles(obstacles)
        if self.faults:
            self._add_fault()
        seeds = asked.get("seeds", 1000)
        self.dimensions.append(Dimension("seed", 1, 1, seeds, whole=True, alone=False))

    def neutral(self) -> Choices:
        """The simplest case: no obstacle, no fault."""
        return {one.name: one.simple for one in self.dimensions}

    def _add_obstacles(self, obstacles: dict[str, Any]) -> None:
        x1, y1, x2, y2 = obstacles["area"]
        small, large = obstacles.get("size", [0.2, 0.6])
        for i in range(self.obstacles):
            name = f"obstacle{i}"
            part: dict[str, Any] = {"owner": name, "alone": False}
            self.dimensions += [
                Dimension(name, False, options=(False, True), alone=False),
                Dimension(f"{name}_x", (x1 + x2) / 2, x1, x2, **part),
                Dimension(f"{name}_y", (y1 + y2) / 2, y1, y2, **part),
                Dimension(f"{name}_size", small, small, large, **part),
            ]

    def _add_fault(self) -> None:
        part: dict[str, Any] = {"owner": "fault", "alone": False}
        self.dimensions += [
            Dimension("fault", "", options=("", *map(str, range(len(self.faults))))),
            Dimension("fault_at", 0.0, 0.0, self._duration, **part),
            Dimension("fault_for", self._duration, 0.1, self._duration, **part),
            Dimension("fault_value", 0.5, 0.0, 1.0, **part),
        ]

    def fault(self, choices: Choices) -> list[dict[str, Any]]:
        """The case's faults: one, or none."""
        which = choices.get("fault", "")
        if not which:
            return []
        made = dict(self.faults[int(which)])
        earliest = _FIRST_MESSAGES_S if made["kind"] == "dropout" else 0.0
        made.setdefault("at", _rounded(max(choices["fault_at"], earliest)))
        if choices["fault_for"] < self._duration and made["kind"] not in (
            "kidnapped",
            "reseeded",
        ):
            made.setdefault("duration", _rounded(choices["fault_for"]))
        if made["kind"] in _VALUES and "value" not in made:
            low, high = _VALUES[made["kind"]]
            made["value"] = _rounded(low + (high - low) * choices["fault_value"])
        return [made]

    def boxes(self, choices: Choices) -> list[tuple[float, float, float]]:
        """The case's obstacles: x, y, side (m)."""
        return [
            (choices[f"obstacle{i}_x"], choices[f"obstacle{i}_y"], choices[f"obstacle{i}_size"])
            for i in range(self.obstacles)
            if choices[f"obstacle{i}"]
        ]

    def used(self, choices: Choices) -> Choices:
        """Without what belongs to an obstacle or fault that is not there."""
        absent = {one.name for one in self.dimensions if is_idle(one, choices)}
        return {name: value for name, value in choices.items() if name not in absent}


def is_idle(one: Dimension, choices: Choices) -> bool:
    """Whether an obstacle or fault is absent."""
    return bool(one.owner) and not choices[one.owner]


def _of_parameter(name: str, given: Any) -> Dimension:
    values: Any
    kind, values = ("list", given) if isinstance(given, list) else next(iter(given.items()))
    if kind == "list":
        return Dimension(name, values[0], options=tuple(values))
    if kind == "grid":
        low, high, steps = values["from"], values["to"], values["steps"]
        return Dimension(
            name,
            low,
            options=tuple(low + (high - low) * i / max(steps - 1, 1) for i in range(steps)),
        )
    low, high = (
        values if kind != "normal" else (values[0] - 3 * values[1], values[0] + 3 * values[1])
    )
    if not (math.isfinite(low) and math.isfinite(high)):
        raise ValueError("has no ends, which a hunt needs")
    middle = math.sqrt(low * high) if kind == "log_uniform" else (low + high) / 2
    simple = 0.0 if low <= 0.0 <= high else min(max(_rounded(middle), low), high)
    if kind == "integers":
        return Dimension(name, int(simple), low, high, whole=True)
    return Dimension(name, simple, low, high, log=kind == "log_uniform")


def _rounded(value: float) -> float:
    return float(f"{value:.9g}")
