"""Recorded runs by channel and time: as NumPy arrays, as data frames of pandas, as Arrow tables."""

from __future__ import annotations

import functools
import logging
import os
import struct
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from . import lcmtypes
from .decoding import decode
from .errors import NotSupported, UnknownName
from .files import open_regular
from .samples import COLUMNS, CONVERSIONS

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
                    _warn(path, f"damaged at byte {at}")
                    return
            if len(head) < _HEAD.size or at + _HEAD.size + name_size + data_size > size:
                _warn(path, f"cut off in the event that begins at byte {at}")
                return
            name = file.read(name_size).decode("utf-8", "replace")
            yield Event(timestamp, name, file.read(data_size))
            at += _HEAD.size + name_size + data_size


class LogChannel(NamedTuple):
    """A channel of a log."""

    type: str  # "pose_t"; "" if it is not one of Ruedo's
    messages: int
    begin: float  # s of sim time: the first message
    end: float  # s: the last


class Log:
    """A recorded run. Reads on demand: a log of any size is opened at once,
    and its channels are read one by one, in memory for what is returned. In a log that is damaged
    or was cut off, what is there before is read, which is logged as a warning.

    begin, end: only the messages of these times (s of sim time, both included). The times of a run
    never go back, so that what comes before is passed over without being read.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Raises ValueError for a file that is not a log."""
        self.path = os.fspath(path)
        if os.path.isdir(path):
            raise IsADirectoryError(f"{self.path}: a folder, and no log")
        if not os.path.exists(path):
            raise FileNotFoundError(f"{self.path}: no such file")
        with open_regular(path) as file:
            begin = file.read(len(EVENT))
        if begin not in (EVENT, b""):
            raise ValueError(
                f"{self.path}: no LCM log: it begins with {begin.hex(' ')}, an event with {EVENT.hex(' ')}"
            )

    def __repr__(self) -> str:
        return f"ruedo.open_log({self.path!r})"

    @functools.cached_property
    def channels(self) -> dict[str, LogChannel]:
        """The channels of the log, from the headers of all messages, read once."""
        return _summary(self.path)

    def columns(
        self,
        channel: str,
        begin: float | None = None,
        end: float | None = None,
        raw: bool = False,
    ) -> dict[str, Any]:
        """The messages of a channel, a NumPy array for each field of the samples that a stream of
        that channel delivers: n numbers; n x m numbers for an array of m elements; n objects for
        texts, for parts such as contact points, and for arrays that are not equally long (arrays).
        raw: for each member of the message instead, as for types without samples; a message within
        it is a dict. Raises UnknownName.
        """
        columns = read_columns(self.path, {channel}, begin, end, raw).get(channel)
        if columns is not None:
            return columns
        if channel not in self.channels:
            known = ", ".join(sorted(self.channels))
            raise UnknownName(f"{self.path} has no channel {channel!r}; it has {known}")
        return {}

    def frame(
        self,
        channel: str,
        begin: float | None = None,
        end: float | None = None,
        raw: bool = False,
    ) -> Any:
        """The same as a DataFrame: the index is `time` (s of sim time); an array's cells are
        arrays. Needs pandas (pip install 'ruedo[logs]').
        """
        return _frame(_pandas(), self.columns(channel, begin, end, raw))

    def arrow(
        self,
        channel: str,
        begin: float | None = None,
        end: float | None = None,
        raw: bool = False,
    ) -> Any:
        """The same as a pyarrow.Table, which polars and Parquet take. Needs pyarrow."""
        try:
            import pyarrow
        except ImportError:
            raise NotSupported("arrow() needs pyarrow: pip install pyarrow") from None
        columns = self.columns(channel, begin, end, raw)
        return pyarrow.table({name: _arrow(pyarrow, one) for name, one in columns.items()})


def open_log(path: str | os.PathLike[str]) -> Log:
    """A recorded run, to be read by channel and time. Raises ValueError for any other file."""
    return Log(path)


def read_log(
    path: str | os.PathLike[str],
    channels: list[str] | None = None,
    begin: float | None = None,
    end: float | None = None,
    raw: bool = False,
) -> dict[str, Any]:
    """The messages of a log, a DataFrame for each channel: the index is `time` (s of sim time), the
    columns are the fields of the samples that a stream of that channel delivers, with their units
    and values (`log["p3at/pose"]["position"]` has arrays (3,)); of what no stream delivers, such as
    ruedo/header, the members of the message.

    channels: the channels to read; None: all whose type is one of Ruedo's. begin, end: only the
    messages of these times (s). raw: the members of the message for all of them. A log that is
    damaged or was cut off is read up to there and no further, which is logged as a warning.

    Needs pandas (pip install 'ruedo[logs]'). Raises ValueError for a file that is not a log.
    A message that does not decode as its channel's type is left out.
    """
    pandas = _pandas()
    wanted = None if channels is None else set(channels)
    every = read_columns(Log(path).path, wanted, begin, end, raw)
    return {channel: _frame(pandas, every.pop(channel)) for channel in list(every)}


def read_columns(
    path: str,
    channels: set[str] | None,
    begin: float | None,
    end: float | None,
    raw: bool = False,
) -> dict[str, dict[str, Any]]:
    """Channels with their fields, as Log.columns() has them."""
    begin_us, end_us = (None if time is None else round(time * 1e6) for time in (begin, end))
    try:
        from . import _engine
    except ImportError:  # an installation without the engine: slower, and with more memory
        return _read_in_python(path, channels, begin_us, end_us, raw)
    nested: dict[str, _Rows] = {}

    def add(channel: bytes, data: bytes) -> None:
        nested.setdefault(channel.decode("utf-8", "replace"), _Rows(raw)).add(data)

    found, fault = _engine.read_columns(os.fsencode(path), channels, begin_us, end_us, add)
    if fault:
        _warn(path, fault)
    columns = {
        channel.decode("utf-8", "replace"): _of_samples(
            its, {name: _column(*parts) for name, *parts in fields}, raw
        )
        for channel, (its, messages, fields) in found.items()
        if messages
    }
    columns |= {channel: rows.columns() for channel, rows in nested.items() if rows.fields}
    return columns


def _of_samples(type_name: str, columns: dict[str, Any], raw: bool) -> dict[str, Any]:
    """The columns of a type's samples, from those of its members."""
    convert = None if raw else COLUMNS.get(type_name)
    return convert(columns) if convert else columns


def _warn(path: str | os.PathLike[str], fault: str) -> None:
    log.warning("%s: it %s%s", os.fspath(path), "was " if fault.startswith("cut") else "is ", fault)


def _summary(path: str) -> dict[str, LogChannel]:
    try:
        from . import _engine
    except ImportError:
        every: dict[str, LogChannel] = {}
        for event in events(path):
            time = event.timestamp * 1e-6
            its = _types().get(event.data[:8])
            name = its.__name__ if its else ""
            type_name, messages, begin, _ = every.get(event.channel) or (name, 0, time, 0)
            every[event.channel] = LogChannel(type_name, messages + 1, begin, time)
        return every
    found, fault = _engine.summarize_log(os.fsencode(path))
    if fault:
        _warn(path, fault)
    return {
        channel.decode("utf-8", "replace"): LogChannel(its, n, first * 1e-6, last * 1e-6)
        for channel, (its, n, first, last) in found.items()
    }


@functools.cache
def _types() -> dict[bytes, Any]:
    """Ruedo's message types, by fingerprint."""
    return {
        one._get_packed_fingerprint(): one
        for one in vars(lcmtypes).values()
        if hasattr(one, "_get_packed_fingerprint")
    }


class _Rows:
    """Messages of a type that are decoded by its class: those with messages in them, whose samples
    have parts, and all where there is no engine.
    """

    def __init__(self, raw: bool) -> None:
        self.raw = raw
        self.type: Any = None
        self.convert: Any = None
        self.fields: dict[str, list[Any]] = {}

    def add(self, data: bytes) -> None:
        its = _types().get(data[:8])
        if its is None or self.type not in (None, its):
            return
        convert = None
        if not self.raw and its.__name__ not in COLUMNS:
            _, convert = CONVERSIONS.get(its.__name__, (None, None))
        try:
            message = decode(its, data)
            values = vars(convert(message)) if convert else None
        except Exception:
            return  # no valid one
        self.type, self.convert = its, convert
        if values is None:
            values = {name: _plain(getattr(message, name)) for name in message.__slots__}
        for name, value in values.items():
            self.fields.setdefault(name, []).append(value)

    def columns(self) -> dict[str, Any]:
        """The columns as read_columns() returns them."""
        if self.convert:
            return {name: _stacked(cells) for name, cells in self.fields.items()}
        kinds = zip(self.type.__typenames__, self.type.__dimensions__)
        of = dict(zip(self.type.__slots__, kinds))
        columns = {name: _joined(cells, *of[name]) for name, cells in self.fields.items()}
        return _of_samples(self.type.__name__, columns, self.raw)


def _stacked(cells: list[Any]) -> Any:
    """The values of samples as one array: of numbers where they are, and are equally long."""
    if all(isinstance(cell, (bool, int, float)) for cell in cells):
        return np.array(cells)
    if all(isinstance(cell, np.ndarray) for cell in cells) and len({c.shape for c in cells}) == 1:
        return np.stack(cells)
    return _objects(cells, len(cells))


def _read_in_python(
    path: str,
    channels: set[str] | None,
    begin_us: int | None,
    end_us: int | None,
    raw: bool = False,
) -> dict[str, dict[str, Any]]:
    rows: dict[str, _Rows] = {}
    for timestamp, channel, data in events(path):
        if end_us is not None and timestamp > end_us:
            break
        if channels is not None and channel not in channels:
            continue
        if begin_us is None or timestamp >= begin_us:
            rows.setdefault(channel, _Rows(raw)).add(data)
    return {channel: its.columns() for channel, its in rows.items() if its.fields}


_NUMBERS = {
    "boolean": np.bool_,
    "byte": np.uint8,
    "int8_t": np.int8,
    "int16_t": np.int16,
    "int32_t": np.int32,
    "int64_t": np.int64,
    "float": np.float32,
    "double": np.float64,
}


def _joined(cells: list[Any], kind: str, dimensions: list[Any] | None) -> Any:
    """The cells of a field as one array: of numbers where they are equally long. dimensions: sizes,
    and names of the fields that have them."""
    number = _NUMBERS.get(kind)
    if number is None:
        return _objects(cells, len(cells))

    if dimensions is None:
        return np.array(cells, number)
    inner = [size for size in dimensions[1:] if isinstance(size, int)]

    def array(cell: Any) -> Any:
        flat: Any
        flat = np.frombuffer(cell, number) if isinstance(cell, bytes) else np.array(cell, number)
        return flat.reshape(-1, *inner) if len(inner) == len(dimensions) - 1 else flat

    arrays = [array(cell) for cell in cells]
    if len({one.shape for one in arrays}) == 1:
        return np.stack(arrays)
    return _objects(arrays, len(arrays))


def _objects(cells: Iterable[Any], count: int) -> Any:
    """A column of these, whatever they are."""
    return np.fromiter(cells, object, count)


def _column(shape: tuple[int, ...], values: Any, text_ends: Any, ends: Any) -> Any:
    """A field's array, from the parts that the module gives."""
    if text_ends is not None:
        known: dict[bytes, str] = {}  # names come again and again
        flat, begin = values.tobytes(), 0
        texts: list[str] = []
        for end in text_ends.tolist():
            text = flat[begin:end]
            texts.append(known.setdefault(text, text.decode("utf-8", "replace")))
            begin = end
        if not shape:
            return _objects(texts, len(texts))
        each = shape[0]
        if ends is None:
            ends = np.arange(1, len(texts) // each + 1) * each if each else np.zeros(0, int)
        begins = [0, *ends.tolist()[:-1]]
        cells = (texts[i:j] for i, j in zip(begins, ends.tolist()))
        return _objects(cells, len(ends))
    if ends is None:
        return values
    begins = [0, *ends.tolist()[:-1]]
    arrays = (values[i:j].reshape(-1, *shape[1:]) for i, j in zip(begins, ends.tolist()))
    return _objects(arrays, len(ends))


def _pandas() -> Any:
    try:
        import pandas
    except ImportError:
        raise NotSupported("read_log() needs pandas: pip install 'ruedo[logs]'") from None
    return pandas


def _frame(pandas: Any, columns: dict[str, Any]) -> Any:
    frame = pandas.DataFrame({name: _cells(one) for name, one in columns.items()}, copy=False)
    if "utime" in frame:
        frame.index = pandas.Index(columns["utime"] * 1e-6, name="time")
    return frame


def _cells(column: Any) -> Any:
    """The column's cells for a DataFrame: the bytes of pictures and maps as bytes."""
    if column.ndim == 1 and column.dtype != object:
        return column
    first = column[0] if len(column) else None
    if isinstance(first, np.ndarray) and first.dtype == np.uint8:
        return _objects((one.tobytes() for one in column), len(column))
    return _objects(column, len(column)) if column.ndim > 1 else column


def _arrow(pyarrow: Any, column: Any) -> Any:
    if column.dtype == object:
        cells = (one.tolist() if isinstance(one, np.ndarray) else one for one in column)
        return pyarrow.array(list(cells))
    if 0 in column.shape:
        lists = pyarrow.list_(pyarrow.from_numpy_dtype(column.dtype))
        return pyarrow.array([[]] * len(column), lists)
    array = pyarrow.array(column.reshape(-1))
    for size in reversed(column.shape[1:]):
        array = pyarrow.FixedSizeListArray.from_arrays(array, size)
    return array


def _plain(value: Any) -> Any:
    """A cell: messages within messages as dicts."""
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    if hasattr(value, "__slots__") and hasattr(value, "_get_packed_fingerprint"):
        return {name: _plain(getattr(value, name)) for name in value.__slots__}
    return value
