"""Arguments of the wrong kind: one line that says which, and what is allowed."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Mapping
from typing import Any

MOST_WHOLE = 2**63 - 1
MOST_SEED = 2**64 - 1


def whole(what: str, value: Any, low: int = 0, high: int = MOST_WHOLE) -> int:
    """A whole number from low to high. Raises TypeError and ValueError."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{what} is a whole number, not {value!r}") from None
    if not low <= number <= high:
        raise ValueError(f"{what} is {number}; allowed are {low} to {high}")
    return number


def texts(what: str, value: Any) -> list[str]:
    """A list of texts. Raises TypeError."""
    if isinstance(value, str):
        raise TypeError(f"{what} is a list of texts, not one: {what}=[{value!r}]")
    if not isinstance(value, Iterable) or isinstance(value, Mapping):
        raise TypeError(f"{what} is a list of texts, not {value!r}")
    given = list(value)
    for one in given:
        if not isinstance(one, str):
            raise TypeError(f"{what} is a list of texts; {one!r} is none")
    return given


def named(what: str, value: Any, example: str) -> dict[str, Any]:
    """What belongs to each name; None: nothing. Raises TypeError."""
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise TypeError(f"{what} is a dict, {example}, not {value!r}")
    return dict(value)


def switch(what: str, value: Any) -> bool:
    """True or False. Raises TypeError."""
    if isinstance(value, (str, bytes)) or value is None:
        raise TypeError(f"{what} is True or False, not {value!r}")
    return bool(value)


def text(what: str, value: Any) -> str:
    """A text. Raises TypeError."""
    if not isinstance(value, str):
        raise TypeError(f"{what} is a text, not {value!r}")
    return value


def number(what: str, value: Any) -> float:
    """A number. Raises TypeError."""
    if isinstance(value, (str, bytes)) or not hasattr(value, "__float__"):
        raise TypeError(f"{what} is a number, not {value!r}")
    return float(value)


def numbers(what: str, values: Any, count: int) -> list[float]:
    """So many of them. Raises TypeError and ValueError."""
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise TypeError(f"{what} is {count} numbers, not {values!r}")
    given = [number(what, one) for one in values]
    if len(given) != count:
        raise ValueError(f"{what} is {count} numbers, not {len(given)}")
    return given
