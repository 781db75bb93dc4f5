"""Arguments of the wrong kind: one line that says which, and what is allowed."""

from __future__ import annotations

import difflib
import functools
import inspect
import math
import operator
import os
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from .errors import CONTROL

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

P = ParamSpec("P")
R = TypeVar("R")

MOST_WHOLE = 2**63 - 1
MOST_SEED = 2**64 - 1
MOST_NAME = 63  # bytes of UTF-8: of a client
_MOST_SHOWN = 100  # characters


def shown(value: Any) -> str:
    """The beginning of a value's repr, for error messages."""
    written = repr(value)
    return written if len(written) <= _MOST_SHOWN else f"{written[:_MOST_SHOWN]}..."


def whole(what: str, value: Any, low: int = 0, high: int = MOST_WHOLE) -> int:
    """A whole number from low to high. Raises TypeError and ValueError."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{what} is a whole number, not {shown(value)}") from None
    if not low <= number <= high:
        raise ValueError(f"{what} is {number}; allowed are {low} to {high}")
    return number


def texts(what: str, value: Any) -> list[str]:
    """A list of texts. Raises TypeError and ValueError."""
    if isinstance(value, str):
        raise TypeError(f"{what} is a list of texts, not one: {what}=[{shown(value)}]")
    if not isinstance(value, Iterable) or isinstance(value, Mapping):
        raise TypeError(f"{what} is a list of texts, not {shown(value)}")
    given = list(value)
    for one in given:
        if not isinstance(one, str):
            raise TypeError(f"{what} is a list of texts; {shown(one)} is not a text")
        text(what, one)
    return given


def named(what: str, value: Any, example: str) -> dict[str, Any]:
    """A mapping as {name: value}; None: empty. Raises TypeError."""
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise TypeError(f"{what} is a dict, {example}, not {shown(value)}")
    return dict(value)


def switch(what: str, value: Any) -> bool:
    """True or False. Raises TypeError."""
    if isinstance(value, (str, bytes)) or value is None:
        raise TypeError(f"{what} is True or False, not {shown(value)}")
    try:
        return bool(value)
    except ValueError:  # an array of several
        raise TypeError(f"{what} is True or False, not {shown(value)}") from None


def text(what: str, value: Any) -> str:
    """A text that UTF-8 can hold, without a 0 character, at which C ends it. Raises TypeError and
    ValueError.
    """
    if not isinstance(value, str):
        raise TypeError(f"{what} is a text, not {shown(value)}")
    return _held(what, value, str.encode)


def word(what: str, value: Any) -> str:
    """A text or a path, as a program can be passed it. Raises TypeError and ValueError."""
    given = os.fspath(value) if isinstance(value, (str, os.PathLike)) else None
    if not isinstance(given, str):
        raise TypeError(f"{what} is a text or a path, not {shown(value)}")
    return _held(what, given, os.fsencode)  # file names that are no UTF-8 pass


def _held(what: str, value: str, encode: Callable[[str], bytes]) -> str:
    """A text without NUL bytes, as C can hold it. Raises ValueError."""
    try:
        encode(value)
    except UnicodeEncodeError:
        raise ValueError(f"{what} is {shown(value)}, with half a character in it") from None
    if "\0" in value:
        raise ValueError(f"{what} is {shown(value)}, which holds the character 0")
    return value


def path(what: str, value: Any) -> str:
    """The path of a file or folder. Raises TypeError and ValueError."""
    given = word(what, value)
    if not given:
        raise ValueError(f"{what} is an empty text: it must be a path")
    return given


def client_name(value: Any) -> str:
    """A client's name that a server accepts. Raises TypeError and ValueError."""
    name = text("name", value)
    if len(name) > MOST_NAME or not 1 <= len(name.encode()) <= MOST_NAME or CONTROL.search(name):
        raise ValueError(
            f"name is {shown(name[: MOST_NAME + 1])}: a client's name has 1 to {MOST_NAME} bytes of "
            "UTF-8, without control characters"
        )
    return name


def number(what: str, value: Any) -> float:
    """A number. Raises TypeError and ValueError."""
    if isinstance(value, (str, bytes)) or not hasattr(value, "__float__"):
        raise TypeError(f"{what} is a number, not {shown(value)}")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{what} is {shown(value)}: it must be a finite number") from None
    except (TypeError, ValueError):  # an array of several
        raise TypeError(f"{what} is a number, not {shown(value)}") from None


def finite(what: str, value: Any, low: float = -math.inf) -> float:
    """A finite number, low or more. Raises TypeError and ValueError."""
    given = number(what, value)
    if not math.isfinite(given) or given < low:
        allowed = "" if low == -math.inf else f", {low:g} or more"
        raise ValueError(f"{what} is {value}: it must be a finite number{allowed}")
    return given


def check_known(
    what: str, given: Iterable[str], calls: Sequence[Callable[..., Any]], also: Iterable[str]
) -> None:
    """Raises TypeError, with a suggestion, for an option that is neither one of these calls', which
    pass on to the next what they do not know, nor among the others. The last call may take any.
    """
    listed = [list(inspect.signature(call).parameters.values()) for call in calls]
    if listed and any(one.kind == one.VAR_KEYWORD for one in listed[-1]):
        return
    named = [one for parameters in listed for one in parameters if one.kind != one.VAR_KEYWORD]
    allowed = list(dict.fromkeys([*(one.name for one in named if one.name != "self"), *also]))
    for name in given:
        if name not in allowed:
            raise unknown_option(what, name, allowed)


def unknown_option(what: str, name: str, allowed: list[str]) -> TypeError:
    near = difflib.get_close_matches(name, allowed, 1)
    hint = f": did you mean {near[0]}?" if near else f"; it has {', '.join(allowed)}"
    return TypeError(f"{what}() has no option {name}{hint}")


def options(**renamed: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A call that raises a TypeError with a suggestion for an option that it does not have.

    renamed: deprecated names of options, with those that they have now.
    """

    def made(call: Callable[P, R]) -> Callable[P, R]:
        allowed = [name for name in inspect.signature(call).parameters if name != "self"]
        what = call.__qualname__.removesuffix(".__init__")

        @functools.wraps(call)
        def checked(*given: P.args, **named: P.kwargs) -> R:
            for old in [name for name in named if name not in allowed]:
                now = renamed.get(old)
                if now is None or now in named:
                    raise unknown_option(what, old, allowed)
                warnings.warn(
                    f"{what}({old}=...) is deprecated: it is {now}",
                    DeprecationWarning,
                    stacklevel=2,
                )
                named[now] = named.pop(old)
            return call(*given, **named)

        checked.deprecated_options = tuple(renamed)  # type: ignore[attr-defined]
        return checked

    return made


def check_callback(value: Any) -> None:
    """Raises TypeError for what is not called, and for what only makes something that would have to
    be run then.
    """
    if not callable(value):
        raise TypeError(f"a callback is a function of one sample, not {shown(value)}")
    for one in (value, type(value).__call__):  # of a function, of an object
        if (
            inspect.iscoroutinefunction(one)
            or inspect.isgeneratorfunction(one)
            or inspect.isasyncgenfunction(one)
        ):
            raise TypeError(
                "a callback is a plain function of one sample; an `async def` or a generator as "
                f"{shown(value)} would never run"
            )


def array(what: str, value: Any) -> NDArray[np.float64]:
    """Real numbers of any shape. Raises TypeError for other values, and for arrays with imaginary
    parts, masks or units of time, which a float64 would lose.
    """
    import numpy as np  # here, so that launch() starts the server before NumPy is loaded

    try:
        given = np.asarray(value)
        if given.dtype.kind in "biufO" and not isinstance(value, np.ma.MaskedArray):
            return given.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError):
        pass
    raise TypeError(f"{what}, not {shown(value)}") from None


def numbers(what: str, values: Any, count: int) -> list[float]:
    """A list of `count` numbers. Raises TypeError and ValueError."""
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise TypeError(f"{what} is {count} numbers, not {shown(values)}")
    given = [number(what, one) for one in values]
    if len(given) != count:
        raise ValueError(f"{what} is {count} numbers, not {len(given)}")
    return given
