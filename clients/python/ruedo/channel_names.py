"""The names of the channels while robots come and go, and others take their places."""

from __future__ import annotations

import itertools
from collections import deque

from .world_info import WorldInfo

_MOST_BYTES = 16 << 20  # of the changes
_CHANGE_BYTES = 200  # of one without its name


class ChannelNames:
    """The channels' names in each state that a client in lockstep collects, in order. Of more than
    16 MB of changes since the last one, the oldest count as made: a server may send ever new ones.
    """

    def __init__(self) -> None:
        self._names: list[str] = []  # by the channel's index
        self._newest: list[str] = []  # likewise, when all changes are made
        self._newest_utime = 0
        self._changes: deque[tuple[int, int, str]] = deque()  # utime (us), channel, name after it
        self._bytes = 0  # that they take

    def begin(self, info: WorldInfo) -> None:
        """Forgets everything."""
        self._newest, self._newest_utime = _names_of(info), info.utime
        self._names = list(self._newest)
        self._changes.clear()
        self._bytes = 0

    def change(self, info: WorldInfo) -> None:
        """From the states after its utime on."""
        if info.utime < self._newest_utime:
            return  # it was on its way for longer than the next one
        before = itertools.chain(self._newest, itertools.repeat(""))
        self._newest, self._newest_utime = _names_of(info), info.utime
        for channel, (old, name) in enumerate(zip(before, self._newest, strict=False)):
            if name != old:
                self._bytes += _CHANGE_BYTES + len(name)
                self._changes.append((info.utime, channel, name))
        while self._bytes > _MOST_BYTES:
            self._make_first()

    def go_to(self, utime: int) -> None:
        """The state of that time, us; never backwards."""
        while self._changes and self._changes[0][0] < utime:
            self._make_first()

    def of(self, channel: int) -> str:
        """The channel's name in that state. If the info from before it was lost, the channel's next
        name; "" without one.
        """
        if channel < len(self._names) and self._names[channel]:
            return self._names[channel]
        return next((name for _, c, name in self._changes if c == channel and name), "")

    def _make_first(self) -> None:
        _, channel, name = self._changes.popleft()
        self._bytes -= _CHANGE_BYTES + len(name)
        self._names.extend([""] * (channel + 1 - len(self._names)))
        self._names[channel] = name


def _names_of(info: WorldInfo) -> list[str]:
    return [channel.name for channel in info.channel_list]
