"""What was found becomes as small as it goes and still fails the same way: fewest obstacles, no
fault that is not needed, simple numbers, the shortest time.

What is left must be a case that a mended controller passes. So nothing that such a one needs to
reach what is expected is taken from it on the way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from .space import Choices, Dimension, Space, is_idle

Evaluate = Callable[[list[Choices]], list[tuple[dict[str, Any], float]]]


@dataclass(frozen=True)
class Way:
    """How a case may shrink. content: of the hunt's file."""

    content: dict[str, Any]

    def may_move(self, one: Dimension) -> bool:
        """An obstacle that is moved, and a fault that lasts longer, may leave nobody a way to a
        goal; without them there is one all the more.
        """
        return not one.owner or not self.content.get("expect", {}).get("goal")

    @property
    def may_be_shorter(self) -> bool:
        """A goal needs its time, and so do a golden log and metrics; a signal may end a program."""
        expect = self.content.get("expect", {})
        python = all("python" in one for one in self.content["controllers"])
        return python and not ({"goal", "golden"} & set(expect) or self.content.get("metrics"))


def shrink(
    space: Space,
    choices: Choices,
    outcome: dict[str, Any],
    evaluate: Evaluate,
    most: int,
    way: Way,
) -> tuple[Choices, dict[str, Any]]:
    """At most so many cases more. Failing the same way: the same status, and the same
    expectation.
    """
    same = outcome["status"], outcome["what"]
    left = most

    def try_one(smaller: Choices) -> bool:
        nonlocal choices, outcome, left
        if left <= 0 or smaller == choices:
            return False
        left -= 1
        ((tried, _),) = evaluate([smaller])
        if (tried["status"], tried["what"]) != same:
            return False
        choices, outcome = smaller, tried
        return True

    changed = True
    while changed and left > 0:
        changed = False
        for one in filter(way.may_move, space.dimensions):
            for value in _simpler(one, choices):
                if try_one({**choices, one.name: value}):
                    changed = True
                    break
    ended = _failed_at(outcome)
    if ended is not None and way.may_be_shorter:
        try_one({**choices, "duration": math.ceil(ended * 10 + 1) / 10})
    return choices, outcome


def _simpler(one: Dimension, choices: Choices) -> Iterator[Any]:
    """Values simpler than the present one, the simplest first."""
    value = choices[one.name]
    if value == one.simple or is_idle(one, choices):
        return
    yield one.simple
    if one.options or one.whole:
        return
    for digits in range(3):
        rounded = round(value, digits)
        if one.low <= rounded <= one.high and rounded != value:
            yield rounded
        elif rounded == value:
            return


def _failed_at(outcome: dict[str, Any]) -> float | None:
    """A contact ends the story."""
    at = outcome["metrics"].get("contact_time_s")
    return float(at) if outcome["what"] == "contact" and at is not None else None
