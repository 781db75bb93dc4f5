"""Sim time, as the messages of the server tell it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

_MOST_AHEAD = 1_000_000  # us: ticks come ten times a second


class Clock:
    """Sim time, and how long the server has been silent. Safe to use from any thread."""

    def __init__(self, woken: Callable[[int, tuple[int, ...]], object]):
        """woken: called with the sim time at which threads are woken, and with those."""
        self._woken = woken
        self.utime = 0  # us, of the newest message
        self._last_sign = time.monotonic()
        self._news = threading.Condition()
        self._sleepers: list[_Sleeper] = []

    def note(self, utime: int) -> None:
        """A message of that time came."""
        before = self.utime
        if utime > before:
            self.utime = utime
        self._last_sign = time.monotonic()
        if self._sleepers:  # else a lock for each tick, of which a step() may bring hundreds
            with self._news:
                for sleeper in self._sleepers:
                    sleeper.left -= max(0, utime - before)
                woken = [one for one in self._sleepers if one.left <= 0]
                if woken:
                    self._sleepers = [one for one in self._sleepers if one.left > 0]
                    self._woken(utime, tuple(one.thread for one in woken))
                    self._news.notify_all()

    def is_far_ahead(self, utime: int) -> bool:
        """Whether a time is too far beyond every message of this run to be right."""
        return utime > self.utime + _MOST_AHEAD

    def note_tick(self, utime: int) -> None:
        """A tick of that time came: a message with a time long after it was wrong."""
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
        """duration: us. check: called at least every 0.5 s; an exception of it ends the wait."""
        sleeper = _Sleeper(threading.get_ident(), duration)
        with self._news:
            self._sleepers.append(sleeper)
            try:
                while sleeper.left > 0:
                    self._news.wait(0.5)
                    if sleeper.left > 0:
                        check()
            finally:
                self._sleepers = [one for one in self._sleepers if one is not sleeper]


class _Sleeper:
    def __init__(self, thread: int, left: int):
        self.thread, self.left = thread, left  # us of sim time, which may be set back
