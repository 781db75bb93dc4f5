"""Sim time, as the messages of the server tell it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

_MOST_AHEAD = 1_000_000  # us: ticks come ten times a second


class Clock:
    """Sim time, and how long the server has been silent. Safe to use from any thread."""

    def __init__(self) -> None:
        self.utime = 0  # us, of the newest message
        self._last_sign = time.monotonic()
        self._news = threading.Condition()
        self._sleepers = 0

    def note(self, utime: int) -> None:
        """A message of that time came."""
        if utime > self.utime:
            self.utime = utime
        self._last_sign = time.monotonic()
        if self._sleepers:  # else a lock for each tick, of which a step() may bring hundreds
            with self._news:
                self._news.notify_all()

    def is_far_ahead(self, utime: int) -> bool:
        """Of a time that no message of this run has yet: it was false."""
        return utime > self.utime + _MOST_AHEAD

    def note_tick(self, utime: int) -> None:
        """A tick of that time came: what another message said of a time long after it was false."""
        if utime < self.utime - _MOST_AHEAD:
            self.utime = max(utime, 0)
        self.note(utime)

    def note_sign(self) -> None:
        """Something came that has no time."""
        self._last_sign = time.monotonic()

    def reset(self, utime: int = 0) -> None:
        self.utime = utime

    def silence(self) -> float:
        """s of real time since the last sign of life."""
        return time.monotonic() - self._last_sign

    def sleep(self, duration: int, check: Callable[[], None]) -> None:
        """duration: us. check: called meanwhile, every 0.5 s at least; what it raises ends the
        waiting."""
        with self._news:
            self._sleepers += 1
            before = self.utime
            try:
                while duration > 0:
                    self._news.wait(0.5)
                    check()
                    now = self.utime
                    duration -= max(0, now - before)  # time may be set back
                    before = now
            finally:
                self._sleepers -= 1
