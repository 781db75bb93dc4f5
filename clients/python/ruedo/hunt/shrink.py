"""What was found becomes as small as it goes and still fails the same way: fewest obstacles, no
fault that is not needed, simple numbers, the shortest time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from .space import Choices, Dimension, Space, is_idle

Evaluate = Callable[[list[Choices]], list[tuple[dict[str, Any], float]]]


def shrink(
    space: Space, choices: Choices, outcome: dict[str, Any], evaluate: Evaluate, most: int
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
        for one in space.dimensions:
            for value in _simpler(one, choices):
                if try_one({**choices, one.name: value}):
                    changed = True
                    break
    ended = _failed_at(outcome)
    if ended is not None:
        try_one({**choices, "duration": math.ceil(ended * 10 + 1) / 10})
    return choices, outcome


def _simpler(one: Dimension, choices: Choices) -> Iterator[Any]:
    """Values that are simpler than what there is, the simplest first."""
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
    """A contact ends the story; a goal that is missed needs its time."""
    at = outcome["metrics"].get("contact_time_s")
    return float(at) if outcome["what"] == "contact" and at is not None else None
