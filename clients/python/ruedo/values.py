"""The base of samples: values that compare by content, and the arrays and texts in
them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .geometry import Floats


class Value:
    """Equal when all is equal, NaN to NaN too; hashed alike; and shown in a line."""

    def _key(self) -> tuple[Any, ...]:
        values: Any = self  # every subclass is a dataclass
        return tuple(_comparable(getattr(self, field.name)) for field in fields(values))

    def __eq__(self, other: object) -> bool:
        return self is other or (type(self) is type(other) and self._key() == other._key())

    def __hash__(self) -> int:
        return hash((type(self), self._key()))

    def __repr__(self) -> str:
        values: Any = self
        shown = ", ".join(
            f"{field.name}={_short(getattr(self, field.name))}" for field in fields(values)
        )
        heading = getattr(self, "heading", None)  # of poses, beside the quaternion
        more = "" if heading is None else f", heading={heading:g}"
        return f"{type(self).__name__}({shown}{more})"


def _comparable(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, (value + 0).tobytes()  # -0 as 0
    if isinstance(value, list):
        return tuple(_comparable(one) for one in value)
    return "nan" if isinstance(value, float) and math.isnan(value) else value


def _short(value: Any) -> str:
    if isinstance(value, np.ndarray):
        if value.size <= 4:
            return "[" + ", ".join(f"{one:g}" for one in value.ravel()) + "]"
        finite = value[np.isfinite(value)] if value.dtype.kind == "f" else value
        return f"<{' x '.join(map(str, value.shape))}{f', {finite.min():g} to {finite.max():g}' if finite.size and value.dtype.kind != 'b' else ''}>"
    if isinstance(value, bytes):
        return f"<{len(value)} bytes>"
    if isinstance(value, list) and len(value) > 4:
        return f"<{len(value)}>"
    return f"{value:g}" if isinstance(value, float) else repr(value)


@dataclass(frozen=True, eq=False, repr=False)
class Sample(Value):
    """utime: us of sim time. Nothing in a sample can be written into: others may have the same
    one.
    """

    utime: int

    @property
    def time(self) -> float:
        """Sim time, s."""
        return self.utime * 1e-6


class Word(str, Enum):
    """A text of an enumeration: equal to the plain one, and shown as that."""

    __str__ = str.__str__

    def __repr__(self) -> str:
        return repr(self.value)

    def __format__(self, spec: str) -> str:
        return format(str(self), spec)


def word(words: Mapping[int, str], value: int) -> str:
    """The name of a number in a message; an unknown number, of a later server, as digits."""
    if value in words:
        return words[value]
    return f"0x{value:08x}" if value > 127 else str(value)


def fixed(values: NDArray[Any]) -> NDArray[Any]:
    """A read-only array."""
    values.setflags(write=False)
    return values


def floats(values: Any) -> Floats:
    return fixed(np.array(values, np.float64))


def shaped(values: Any, rows: int, columns: int, optional: bool = False) -> Floats:
    """(rows, columns); optional: (0, 0) where there are none."""
    if optional and not len(values):
        rows = columns = 0
    if rows < 0 or columns < 0 or rows * columns != len(values):
        raise ValueError("sizes that do not fit each other")
    return floats(values).reshape(rows, columns)


def steps(first: float, step: float, count: int) -> Floats:
    """(count,) values, equally far apart."""
    return fixed(first + step * np.arange(count))


def counted(length: int) -> None:
    """Raises ValueError for a length below 0: lcm-gen's Python reads none then."""
    if length < 0:
        raise ValueError(f"a length of {length}")


# Columns: the same of many messages at once, one array for each member of the message.


def words_of(words: Mapping[int, str], numbers: NDArray[Any]) -> NDArray[Any]:
    """(n,) texts of an enumeration."""
    known = {number: word(words, number) for number in set(numbers.tolist())}
    return np.fromiter((known[number] for number in numbers.tolist()), object, len(numbers))


def shaped_column(values: Any, rows: Any, columns: Any, optional: bool = False) -> NDArray[Any]:
    """(n, rows, columns) where all have the same; else n arrays. Raises ValueError as shaped()."""
    sizes = {*zip(rows.tolist(), columns.tolist())}
    if len(sizes) == 1 and values.dtype != object:
        height, width = sizes.pop()
        if optional and values.shape[1] == 0:
            height = width = 0
        if min(height, width) < 0 or height * width != values.shape[1]:
            raise ValueError("sizes that do not fit each other")
        return values.reshape(len(values), height, width)
    each = (shaped(*one, optional) for one in zip(values, rows.tolist(), columns.tolist()))
    return np.fromiter(each, object, len(values))


def steps_column(first: Any, step: Any, count: Any) -> NDArray[Any]:
    """(n, count) where all have as many; else n arrays. Of a scanner, which has the same angles in
    each message, they take the memory of one.
    """
    if len({*zip(first.tolist(), step.tolist(), count.tolist())}) == 1:
        values = steps(float(first[0]), float(step[0]), int(count[0]))
        return np.broadcast_to(values, (len(first), len(values)))
    counts = set(count.tolist())
    if len(counts) == 1:
        columns = np.multiply.outer(step.astype(np.float64), np.arange(counts.pop()))
        columns += first.astype(np.float64)[:, None]
        return columns
    each = (steps(*one) for one in zip(first.tolist(), step.tolist(), count.tolist()))
    return np.fromiter(each, object, len(first))
