"""The errors of this package; their texts say what to do next.

Every error of this package is a RuedoError, and can be pickled: a pool of processes hands it on.
Bad arguments (NaN, a radius of 0) are plain ValueErrors.
"""

from __future__ import annotations

import re
from typing import Any

# Control characters, Unicode's line ends, and the marks that change the order of what is beside
# them.
_OBEYED = r"\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
CONTROL = re.compile(rf"[\x00-\x1f{_OBEYED}]")
_CONTROL_IN_TEXT = re.compile(rf"[\x00-\x08\x0b-\x1f{_OBEYED}]")


def for_terminal(text: str) -> str:
    """A server's text as it may be printed: a terminal obeys control characters, so '?' stands for
    each but line ends and tabs.
    """
    return _CONTROL_IN_TEXT.sub("?", text)


class RuedoError(Exception):
    """Base of all errors of this package."""


class NoServer(RuedoError, ConnectionError):
    """No server answered, or it fell silent or ended."""


class RunEnded(NoServer):
    """The run is over: its server has said so, or ended with exit code 0."""


class LaunchError(RuedoError):
    """A private server could not be started."""


class BadWorld(LaunchError, ValueError):
    """The world of an Engine cannot be loaded: what is wrong, with file and line."""


class UnknownName(RuedoError, LookupError):
    """There is no robot, device or channel of that name; the text lists those that exist."""


class UnknownField(UnknownName, ValueError):
    """An Engine has no such field; the text lists those that exist."""


class Timeout(RuedoError, TimeoutError):
    """No message or reply came within the timeout."""


class TypeMismatch(RuedoError):
    """A channel carries another version of a message type than this package reads."""


class NotSupported(RuedoError):
    """The server does not have that request."""


class MotionError(RuedoError):
    """A motion primitive ended before it was done, or was refused; `reason` says why."""

    def __init__(self, text: str, reason: str):
        super().__init__(text)
        self.reason = reason

    def __reduce__(self) -> Any:
        return type(self), (str(self), self.reason), vars(self)


class RequestError(RuedoError):
    """The server refused a request; `code` is one of reply_t's names, such as "UNKNOWN_NAME"."""

    def __init__(self, text: str, code: str):
        super().__init__(text)
        self.code = code

    def __reduce__(self) -> Any:
        return type(self), (str(self), self.code), vars(self)


class LeaseLost(RequestError):
    """Lockstep continues without this client, which was silent for too long; the next step() takes
    part again.
    """
