"""Controllers that run in the engine, in the process: what they see, and what they answer."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import finite, shown
from ..engine import Engine

DONE = "done"
"""A controller returns this to end its run."""


class NothingYet(LookupError):
    """A controller read a device that has published nothing so far. The robot stands meanwhile, as
    one does whose program waits for its first message.
    """


class View:
    """The robot as its controller in the engine sees it at a decision.

    view["lrf.ranges"]: the newest message's field, DEVICE.FIELD as in Engine.observe(). Raises
    NothingYet before the first message; a controller need not catch it, and the robot waits.
    "lrf.ranges" in view says whether there is a message. view.time: s of sim time.
    view.parameters and view.seed: of the case. view.send(channel, message): a command other
    than a velocity.
    """

    def __init__(self, engine: Engine, robot: str, parameters: dict[str, Any], seed: int) -> None:
        self._engine = engine
        self._row = dict(_rows(engine, robot).items())
        self.robot = robot
        self.parameters = parameters
        self.seed = seed
        self.has_sent = False

    @property
    def time(self) -> float:
        """s of sim time."""
        return self._engine.time()

    def __getitem__(self, name: str) -> NDArray[Any]:
        device = name.rpartition(".")[0].lower()
        try:
            return np.asarray(self._engine.observe(name)[0, self._row.get(device, 0)])
        except ValueError as error:
            if "has no sample yet" in str(error):
                raise NothingYet(f"{name}: nothing has come yet") from None
            raise

    def __contains__(self, name: str) -> bool:
        try:
            self[name]
        except NothingYet:
            return False
        return True

    def send(self, channel: str, message: Any) -> None:
        """A message on one of the robot's channels: "move" or "p3at/move"."""
        full = channel if "/" in channel else f"{self.robot}/{channel}"
        self._engine.command(0, full, message)
        self.has_sent = True


def _rows(engine: Engine, robot: str) -> dict[str, int]:
    """The robot's row in the arrays of each device or kind."""
    seen: dict[str, int] = {}
    rows: dict[str, int] = {}
    for owner, device, kind in engine.devices:
        for name in {device.lower(), kind.lower()}:
            if owner == robot:
                rows.setdefault(name, seen.get(name, 0))
            seen[name] = seen.get(name, 0) + 1
    return rows


def velocity_of(answer: Any) -> tuple[float, float, float]:
    """m/s ahead and to the left, rad/s. Raises what a wrong answer leads to."""
    allowed = f"a controller answers (m/s, rad/s), (m/s, m/s to the left, rad/s), None or {DONE!r}"
    if isinstance(answer, (str, bytes)) or not isinstance(answer, Iterable):
        raise TypeError(f"{shown(answer)}: {allowed}")
    given = [finite("a controller's velocity", one) for one in answer]
    if not 2 <= len(given) <= 3:
        raise ValueError(f"{shown(answer)}: {allowed}")
    return given[0], given[1] if len(given) == 3 else 0.0, given[-1]


def make_controller(thing: Any, parameters: dict[str, Any]) -> Callable[[View], Any]:
    """A class is made anew for each run, with the parameters that it takes; a function is as it
    is.
    """
    if not inspect.isclass(thing):
        if not callable(thing):
            raise TypeError(
                f"{thing!r} is not a controller: a function of a View, or a class of such objects"
            )
        return thing
    make: Any = thing
    accepted = inspect.signature(make).parameters.values()
    if any(one.kind is one.VAR_KEYWORD for one in accepted):
        return make(**parameters)
    names = {one.name for one in accepted}
    return make(**{name: value for name, value in parameters.items() if name in names})
