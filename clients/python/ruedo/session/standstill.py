"""Whether sim time advances while a call waits for it, and if not, why."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

from .clock import Clock

_LONG_SECONDS = 5.0  # of real time
log = logging.getLogger("ruedo")


class Standstill:
    """The watch of one call, in its thread.

    what: the call, for the log. why: why sim time may stand still; "": it is not known to.
    """

    def __init__(self, clock: Clock, what: str, why: Callable[[], str]):
        self._clock, self._what, self._why = clock, what, why
        self._utime = clock.utime
        self._began = self._since = time.monotonic()
        self._told = False

    def look(self) -> None:
        """Warns, once, when it has stood still for 5 s."""
        stands_for = self._stands_for()
        if self._told or stands_for < _LONG_SECONDS or not (why := self._why()):
            return
        self._told = True
        log.warning(
            "%s waits, and sim time has stood still for %.0f s at %.2f s: %s",
            self._what,
            stands_for,
            self._utime * 1e-6,
            why,
        )

    def reason(self) -> str:
        """The reason why the call waits in vain; "": sim time advances, or it is unknown."""
        stands_for = self._stands_for()
        return self._why() if stands_for >= 1.0 or self._since == self._began else ""

    def _stands_for(self) -> float:
        """s of real time."""
        if self._clock.utime != self._utime:
            self._utime, self._since = self._clock.utime, time.monotonic()
        return time.monotonic() - self._since
