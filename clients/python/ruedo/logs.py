"""read_log(): a recorded run as pandas has it."""

from __future__ import annotations

import logging
import os
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

from . import lcmtypes
from .decoding import decode
from .errors import NotSupported
from .files import open_regular
from .samples import CONVERSIONS

EVENT = b"\xed\xa1\xda\x01"  # that LCM's logs begin each message with
_HEAD = struct.Struct(
    ">4sqqii"
)  # EVENT, number, timestamp, sizes of the channel's name and the data
# of the records, by which a run can be repeated
HEADER_CHANNEL, APPLIED_CHANNEL, STATE_HASH_CHANNEL = (
    "ruedo/header",
    "ruedo/applied",
    "ruedo/state_hash",
)
# Bytes, as `ruedo` itself reads them: the largest message is a picture of 8192 x 8192 pixels.
LONGEST_CHANNEL, LARGEST = 1000, 8192 * 8192 * 4 + 65536
log = logging.getLogger("ruedo")


class Event(NamedTuple):
    """A message of a log."""

    timestamp: int  # us, sim time
    channel: str
    data: bytes


def events(path: str | os.PathLike[str]) -> Iterator[Event]:
    """The messages of a log, up to where it is damaged or cut off, which is logged as a warning.
    LCM's own reader ends there without a word, or looks for the next message.
    """
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        at = 0
        while at < size:
            head = file.read(_HEAD.size)
            if len(head) == _HEAD.size:
                event, _, timestamp, name_size, data_size = _HEAD.unpack(head)
                if event != EVENT or not (
                    0 <= name_size <= LONGEST_CHANNEL and 0 <= data_size <= LARGEST
                ):
                    log.warning("%s: it is damaged at byte %d", os.fspath(path), at)
                    return
            if len(head) < _HEAD.size or at + _HEAD.size + name_size + data_size > size:
                log.warning(
                    "%s: it was cut off in the event that begins at byte %d", os.fspath(path), at
                )
                return
            name = file.read(name_size).decode("utf-8", "replace")
            yield Event(timestamp, name, file.read(data_size))
            at += _HEAD.size + name_size + data_size


def read_log(
    path: str | os.PathLike[str], channels: list[str] | None = None, raw: bool = False
) -> dict[str, Any]:
    """The messages of a log, a DataFrame for each channel: the index is `time` (s of sim time), the
    columns are the fields of the samples that a stream of that channel delivers, with their units
    and values (`log["p3at/pose"]["position"]` has arrays (3,)); of what no stream delivers, such as
    ruedo/header, the members of the message, with lists for arrays.

    channels: those that are wanted, None: all whose type is one of Ruedo's. raw: the members of the
    message for all of them. A log that is damaged or was cut off is read up to there and no
    further, which is logged as a warning.

    Needs pandas (pip install 'ruedo[logs]'). Raises ValueError for a file that is no log. A message
    that is no valid one of its type is left out.
    """
    try:
        import pandas
    except ImportError:
        raise NotSupported("read_log() needs pandas: pip install 'ruedo[logs]'") from None
    every: dict[str, Any] = vars(lcmtypes)
    types: dict[bytes, Any] = {
        one._get_packed_fingerprint(): one
        for one in every.values()
        if hasattr(one, "_get_packed_fingerprint")
    }
    rows: dict[str, list[dict[str, Any]]] = {}
    if os.path.isdir(path):
        raise IsADirectoryError(f"{os.fspath(path)}: a folder, and no log")
    if not os.path.exists(path):
        raise FileNotFoundError(f"{os.fspath(path)}: no such file")
    with open_regular(path) as file:
        begin = file.read(len(EVENT))
    if begin not in (EVENT, b""):
        raise ValueError(
            f"{os.fspath(path)}: no LCM log: it begins with {begin.hex(' ')}, an event with {EVENT.hex(' ')}"
        )
    for event in events(path):
        message_type = types.get(event.data[:8])
        if message_type is None or (channels is not None and event.channel not in channels):
            continue
        try:
            row = _row(message_type, event.data, raw)
        except Exception:
            continue
        rows.setdefault(event.channel, []).append(row)
    frames = {}
    for channel, all_of_it in rows.items():
        frame = pandas.DataFrame(all_of_it)
        if "utime" in frame:
            frame.index = pandas.Index(frame["utime"] * 1e-6, name="time")
        frames[channel] = frame
    return frames


def _row(message_type: Any, data: bytes, raw: bool) -> dict[str, Any]:
    """By columns. Raises when the bytes are not a message of the type."""
    message = decode(message_type, data)
    own, convert = CONVERSIONS.get(message_type.__name__, (None, None))
    if own is message_type and convert and not raw:
        return vars(convert(message))
    return {name: _plain(getattr(message, name)) for name in message.__slots__}


def _plain(value: Any) -> Any:
    """A cell: messages within messages as dicts."""
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    if hasattr(value, "__slots__") and hasattr(value, "_get_packed_fingerprint"):
        return {name: _plain(getattr(value, name)) for name in value.__slots__}
    return value
