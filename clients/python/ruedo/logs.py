"""read_log(): a recorded run as pandas has it."""

from __future__ import annotations

import os
from typing import Any

import lcm

from . import lcmtypes
from .errors import NotSupported

EVENT = b"\xed\xa1\xda\x01"  # that LCM's logs begin each message with


def read_log(path: str | os.PathLike[str], channels: list[str] | None = None) -> dict[str, Any]:
    """The messages of a log, a DataFrame for each channel: the index is `time` (s of sim time), the
    columns are the type's fields; an array's cells are lists. channels: those that are wanted,
    None: all whose type is one of Ruedo's.

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
    if not os.path.isfile(path):
        raise FileNotFoundError(f"{os.fspath(path)}: no such file")
    with open(path, "rb") as file:
        begin = file.read(len(EVENT))
    if begin not in (EVENT, b""):
        raise ValueError(
            f"{os.fspath(path)}: no LCM log: it begins with {begin.hex(' ')}, an event with {EVENT.hex(' ')}"
        )
    for event in lcm.EventLog(os.fspath(path), "r"):
        message_type = types.get(event.data[:8])
        if message_type is None or (channels is not None and event.channel not in channels):
            continue
        try:
            message = message_type.decode(event.data)
        except Exception:
            continue
        rows.setdefault(event.channel, []).append(
            {name: _plain(getattr(message, name)) for name in message.__slots__}
        )
    frames = {}
    for channel, all_of_it in rows.items():
        frame = pandas.DataFrame(all_of_it)
        if "utime" in frame:
            frame.index = pandas.Index(frame["utime"] * 1e-6, name="time")
        frames[channel] = frame
    return frames


def _plain(value: Any) -> Any:
    """A cell: messages within messages as dicts."""
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    if hasattr(value, "__slots__") and hasattr(value, "_get_packed_fingerprint"):
        return {name: _plain(getattr(value, name)) for name in value.__slots__}
    return value
