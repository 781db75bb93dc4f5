"""What can go wrong, in words that say what to do next.

Every error of this package is a RuedoError. Bad arguments (NaN, a radius of 0) are plain
ValueErrors.
"""

from __future__ import annotations

import re

CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")
_CONTROL_IN_TEXT = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def for_terminal(text: str) -> str:
    """A server's text as it may be printed: a terminal obeys control characters, so '?' stands for
    each but line ends and tabs.
    """
    return _CONTROL_IN_TEXT.sub("?", text)


class RuedoError(Exception):
    """Base of all errors of this package."""


class NoServer(RuedoError, ConnectionError):
    """No server answered, or it fell silent or ended."""


class LaunchError(RuedoError):
    """A private server could not be started."""


class UnknownName(RuedoError, LookupError):
    """There is no robot, device or channel of that name; the text lists those that exist."""


class Timeout(RuedoError, TimeoutError):
    """Nothing came within the time given."""


class TypeMismatch(RuedoError):
    """A channel carries another version of a message type than this package reads."""


class NotSupported(RuedoError):
    """The server does not have that request."""


class MotionError(RuedoError):
    """A motion primitive ended before it was done, or was refused; `reason` says why."""

    def __init__(self, text: str, reason: str):
        super().__init__(text)
        self.reason = reason


class RequestError(RuedoError):
    """The server refused a request; `code` is one of reply_t's names, such as "UNKNOWN_NAME"."""

    def __init__(self, text: str, code: str):
        super().__init__(text)
        self.code = code


class LeaseLost(RequestError):
    """Lockstep goes on without this client, which was silent for too long; the next step() takes
    part again.
    """
