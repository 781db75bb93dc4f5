"""The handling of each arriving message: of a fleet in lockstep hundreds with each step.

compiled() puts the engine module's functions into the place of those here, where it is installed.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

Arrived = list[tuple[str, bytes]]  # channels and messages, as they came

_HEAD = struct.Struct(">II")  # kind, length of the channel's name
_SIZE = struct.Struct(">I")
_ENTRY = struct.Struct(">iqiI")  # of a manifest: channel_index, sequence, size, crc
_LONGEST_CHANNEL, _LARGEST = 63, 1 << 26
_MOST_NAMES = 65536


def take_apart(data: bytes, at: int, names: dict[bytes, str]) -> tuple[Arrived, int] | None:
    """The whole messages of a stream of frames from a place on, and where the rest begins; None for
    what no server of Ruedo's sends. names: of the channels that came."""
    end = len(data)
    arrived = []
    while end - at >= 12:
        _, length = _HEAD.unpack_from(data, at)
        if length > _LONGEST_CHANNEL:
            return None
        name_end = at + 8 + length
        if name_end + 4 > end:
            break
        (size,) = _SIZE.unpack_from(data, name_end)
        if size > _LARGEST:
            return None
        message_end = name_end + 4 + size
        if message_end > end:
            break
        name = data[at + 8 : name_end]
        channel = names.get(name)
        if channel is None:
            channel = name.decode(errors="replace")
            if len(names) < _MOST_NAMES:
                names[name] = channel
        arrived.append((channel, data[name_end + 4 : message_end]))
        at = message_end
    return arrived, at


def dispatch(
    arrived: Arrived,
    collectors: Mapping[str, Callable[[tuple[str, bytes]], object]],
    handlers: Mapping[str, Any],
    hand_over: Callable[[Any, bytes], object],
) -> None:
    """Each to its channel's collector; and the message of a channel that has handlers to
    hand_over(handlers, message)."""
    for one in arrived:
        channel, data = one
        collector = collectors.get(channel)
        if collector is not None:
            collector(one)
        listening = handlers.get(channel)
        if listening is not None:
            hand_over(listening, data)


def are_listed(
    came: Iterable[tuple[str, bytes]], tick: bytes, at: int, indices: Mapping[str, int]
) -> bool:
    """Whether the messages that came are those that a tick's manifest lists, in its order.

    at: where its entries begin, which are as many as came. indices: of the channels.
    """
    crc32 = zlib.crc32
    for (name, message), (channel, _, size, crc) in zip(came, _ENTRY.iter_unpack(tick[at:])):
        if indices.get(name) != channel or len(message) != size or crc32(message) != crc:
            return False
    return True


def by_channel(steps: list[tuple[int, Arrived]]) -> dict[str, list[bytes]]:
    """The messages of each channel, in order."""
    sorted_: dict[str, list[bytes]] = {}
    for _, messages in steps:
        for name, data in messages:
            sorted_.setdefault(name, []).append(data)
    return sorted_


_COMPILED = ("take_apart", "dispatch", "are_listed", "by_channel")


def compiled() -> bool:
    """Uses the functions of the engine module; False without it. Importing it takes some ms, which
    are for who steps alone.
    """
    try:
        from .. import _engine
    except ImportError:
        return False
    globals().update({name: getattr(_engine, name) for name in _COMPILED})
    return True
