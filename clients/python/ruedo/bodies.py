"""Bodies by their names: where they are, how they move, and putting them elsewhere."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple, Protocol

from .arguments import shown
from .errors import UnknownName
from .geometry import Floats, Transform

if TYPE_CHECKING:
    from .samples import State


class _Simulation(Protocol):
    def state(self, name: str) -> State: ...
    def set_pose(
        self,
        name: str,
        x: float,
        y: float,
        heading: float = ...,
        z: float = ...,
        orientation: Sequence[float] | None = ...,
    ) -> None: ...
    def set_twist(
        self, name: str, linear: Sequence[float], angular: Sequence[float] = ...
    ) -> None: ...
    def remove(self, name: str) -> None: ...


class Twist(NamedTuple):
    """How something moves, in the world."""

    linear: Floats  # (3,) m/s
    angular: Floats  # (3,) rad/s


@dataclass(frozen=True)
class Body:
    """A set of links that do not move against each other, from ``sim.bodies``; or a model, from
    ``sim.body("crate")``. Each property requests the current state from the server, and raises the
    errors of a request.
    """

    name: str  # MODEL/LINK, or MODEL
    is_static: bool  # it never moves
    mass: float  # kg; 0 of what never moves
    _simulation: _Simulation | None = field(default=None, repr=False, compare=False)

    @property
    def pose(self) -> Transform:
        """The pose in the world."""
        state = self._there.state(self.name)
        return Transform(state.position, state.orientation)

    @property
    def twist(self) -> Twist:
        """The twist in the world."""
        state = self._there.state(self.name)
        return Twist(state.linear, state.angular)

    def set_pose(
        self, x: float | Transform, y: float = 0.0, heading: float = 0.0, z: float = 0.0
    ) -> None:
        """Puts the model at x, y, z (m) with a heading (rad), or at a Transform, at rest. Raises
        RequestError for a part of a model.
        """
        if isinstance(x, Transform):
            at = x.position
            self._there.set_pose(
                self.name, at[0], at[1], z=at[2], orientation=x.orientation.tolist()
            )
        else:
            self._there.set_pose(self.name, x, y, heading, z)

    def set_twist(
        self, linear: Sequence[float], angular: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> None:
        """Gives the model a velocity (m/s) and a turn rate (rad/s), in the world."""
        self._there.set_twist(self.name, linear, angular)

    def remove(self) -> None:
        """Takes the model away."""
        self._there.remove(self.name)

    @property
    def _there(self) -> _Simulation:
        assert self._simulation is not None
        return self._simulation


def found(bodies: Iterable[Body], name: str, simulation: _Simulation) -> Body:
    """A body, or a model's bodies as one. Raises UnknownName, which lists the models."""
    there = list(bodies)
    parts = [one for one in there if one.name == name or one.name.startswith(f"{name}/")]
    if not parts:
        models = dict.fromkeys(one.name.partition("/")[0] for one in there)
        raise UnknownName(
            f"there is no model or MODEL/LINK {shown(name)}; there is {', '.join(models) or 'none'}"
        )
    static = all(one.is_static for one in parts)
    return replace(
        parts[0],
        name=name,
        is_static=static,
        mass=sum(one.mass for one in parts),
        _simulation=simulation,
    )
