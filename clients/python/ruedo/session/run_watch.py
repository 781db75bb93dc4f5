"""Which run a client belongs to, where those of several servers are heard."""

from __future__ import annotations

import time
from collections.abc import Callable

_GONE_SECONDS = 1.5  # a server gives a sign of life each second
_RETURNS = 3  # one may be a datagram that was late


class RunWatch:
    """Decides which run a client belongs to, for the receiving thread alone, but for `another`.

    A client stays with its run while it receives messages of it; other runs are then those of
    another server at the same address. When its run falls silent, the other run is its successor.
    Until that is decided, samples may be of either run.

    say: called once for each run of the client's, with the id of a run beside it.
    """

    def __init__(self, say: Callable[[int], None]):
        self._say = say
        self.begin()

    def begin(self) -> None:
        """The client has a new run."""
        self.another = False  # the last message was of another run
        self._since = 0.0  # when the first of those was heard
        self._other_id = 0
        self._returns = 0

    @property
    def in_doubt(self) -> bool:
        """Whether the other run may be the next one of this client's."""
        return self.another and self._returns < _RETURNS

    def hear_own(self) -> None:
        if not self.another:
            return
        self.another = False
        self._returns += 1
        if self._returns == _RETURNS:
            self._say(self._other_id)

    def hear_another(self, run_id: int) -> bool:
        """Whether the client's own run is over."""
        now = time.monotonic()
        if not self.another:
            self._since, self._other_id = now, run_id
            self.another = True
        return now - self._since >= _GONE_SECONDS
