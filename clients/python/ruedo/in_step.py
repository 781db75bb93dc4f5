"""Loops at a fixed period of sim time."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from typing import TYPE_CHECKING

from .errors import NotSupported, RunEnded

if TYPE_CHECKING:
    from .session.connection import Connection


class Every:
    """A loop at a fixed period of sim time, from Simulation.every()."""

    def __init__(self, connection: Connection, period_us: int):
        self._connection, self._period = connection, period_us
        self._next = 0  # us

    def __iter__(self) -> Iterator[float]:
        while True:
            try:
                now = self._wait()
            except RunEnded:
                return
            yield now * 1e-6

    async def __aiter__(self) -> AsyncIterator[float]:
        import asyncio

        while True:
            try:
                now = await asyncio.to_thread(self._wait)
            except RunEnded:
                return
            yield now * 1e-6

    def _wait(self) -> int:
        """Until the next multiple of the period; those that have passed meanwhile are left out."""
        connection = self._connection
        connection.check_open()
        if connection.in_lockstep:
            raise NotSupported("in lockstep, only sim.step(n) advances time")
        begin = connection.clock.utime
        following = (begin // self._period + 1) * self._period
        if not begin < self._next + self._period <= following:  # the first, late, or a reset
            self._next = following
        else:
            self._next += self._period
        connection.sleep(self._next - begin)
        return self._next
