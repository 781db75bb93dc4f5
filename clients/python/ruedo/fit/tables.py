"""Readers of tables: encoder ticks beside poses without a header (as OptiOdom's), and CSV with one.

A table without a header has time (s), x, y (m), theta (rad) and a column of ticks per wheel since
the row before; a tricycle's has the ticks and the steering angle (rad). The file
NAME_metadata.csv beside NAME_run-NN.csv says the drive, its encoders and measures.
"""

from __future__ import annotations

import csv
import gzip
import math
import re
from pathlib import Path as File

import numpy as np

from ..files import open_regular
from .errors import FitError
from .recording import Array, Commands, Geometry, Imu, Path, Recording, Wheels, sorted_rows

MOST_BYTES = 1 << 30
_KINDS = {"diff": "differential", "tricyc": "tricycle", "omni3": "omni3", "omni4": "omni4"}
_UNITS = "units are s, m, rad"
# Of a CSV with a header, in the order of this page.
COLUMNS = {
    "time": "s",
    "x": "m, pose of the robot",
    "y": "m",
    "theta": "rad",
    "odom_x": "m, the robot's own dead reckoning",
    "odom_y": "m",
    "odom_theta": "rad",
    "left": "rad, angle of the left wheel since the start",
    "right": "rad",
    "cmd_v": "m/s, commanded",
    "cmd_omega": "rad/s, commanded",
    "gyro_x": "rad/s",
    "gyro_y": "rad/s",
    "gyro_z": "rad/s",
    "acc_x": "m/s^2",
    "acc_y": "m/s^2",
    "acc_z": "m/s^2",
}


def text_of(file: File) -> str:
    """The text of a file, which gzip may have compressed. Raises FitError."""
    with open_regular(file) as raw:
        packed = raw.read(2) == b"\x1f\x8b"
        raw.seek(0)
        try:
            opened = gzip.GzipFile(fileobj=raw) if packed else raw
            content = opened.read(MOST_BYTES + 1)
        except (EOFError, OSError) as error:
            raise FitError(f"{file}: the compressed file is damaged: {error}") from None
    if len(content) > MOST_BYTES:
        raise FitError(f"{file}: more than {MOST_BYTES} bytes of text; split the log")
    return content.decode("utf-8-sig", "replace")


def cells_of(line: str) -> list[str]:
    """The cells of a row, between semicolons, tabs or commas; but for the last, a comma in a number
    is a decimal one.
    """
    for separator in (";", "\t"):
        if separator in line:
            return [cell.strip().replace(",", ".") for cell in line.split(separator)]
    return [cell.strip() for cell in line.split(",")]


def _rows(file: File, lines: list[str], first: int, width: int) -> Array:
    """An empty cell is NaN."""
    rows = []
    for number, line in enumerate(lines, first):
        if not line.strip():
            continue
        try:
            row = [float(cell or "nan") for cell in cells_of(line)]
        except ValueError as error:
            raise FitError(f"{file}:{number}: {error}; a number is allowed ({_UNITS})") from None
        if len(row) != width:
            raise FitError(f"{file}:{number}: {len(row)} columns, the first row has {width}")
        rows.append(row)
    if len(rows) < 2:
        raise FitError(f"{file}: {len(rows)} rows; at least two are needed")
    return np.array(rows)


def read_encoder_table(file: File) -> Recording:
    """Raises FitError, also where the metadata is missing: ticks alone have no unit."""
    lines = text_of(file).splitlines()
    rows = _rows(file, lines, 1, len(cells_of(lines[0])))
    if not np.isfinite(rows).all():
        bad = 1 + int(np.argmin(np.isfinite(rows).all(axis=1)))
        raise FitError(f"{file}:{bad}: finite numbers are allowed ({_UNITS})")
    metadata = _metadata(file)
    kind = _KINDS.get(metadata["type"][0])
    if kind is None:
        raise FitError(
            f"{metadata['file'][0]}: type '{metadata['type'][0]}'; allowed are {', '.join(_KINDS)}"
        )
    tick = 2 * math.pi / (_of(metadata, "encRes") * _of(metadata, "ngear"))
    lever = sum(float(one) for one in metadata["Li"]) / (2 if kind == "omni4" else 1)
    geometry = Geometry(kind, _of(metadata, "Di") / 2, lever)
    if np.any(np.diff(rows[:, 0]) <= 0):
        bad = 2 + int(np.argmax(np.diff(rows[:, 0]) <= 0))
        raise FitError(f"{file}:{bad}: time {rows[bad - 1, 0]:g} s does not increase")
    ticks, steering = rows[:, 4:], None
    if kind == "tricycle":
        ticks, steering = rows[:, 4:5], rows[:, 5]
    turned = np.cumsum(ticks, axis=0) * tick
    turned -= turned[0]
    if kind == "differential":  # the table has the right wheel first
        turned = turned[:, ::-1]
    recording = Recording(file, "encoder table", geometry=geometry)
    recording.truth = Path(rows[:, 0], rows[:, 1:4], "motion capture")
    recording.wheels = Wheels(rows[:, 0], turned, steering, tick)
    recording.streams = {"encoders": rows[:, 0]}
    return recording


def _metadata(file: File) -> dict[str, list[str]]:
    stem = re.sub(r"_run-\d+\.csv(\.gz)?$", "", file.name)
    for ending in ("_metadata.csv", "_metadata.csv.gz"):
        beside = file.with_name(stem + ending)
        if stem != file.name and beside.exists():
            break
    else:
        raise FitError(
            f"{file}: no {stem}_metadata.csv beside it, which says the drive, its encoders and measures; "
            f"or give the columns a header: {', '.join(COLUMNS)}"
        )
    found = {"file": [str(beside)]}
    for row in csv.reader(text_of(beside).splitlines()):
        if row:
            found[row[0].strip()] = [cell for cell in row[1:] if cell.strip()]
    missing = [key for key in ("type", "ngear", "encRes", "Li", "Di") if not found.get(key)]
    if missing:
        raise FitError(f"{beside}: {', '.join(missing)} is missing")
    return found


def _of(metadata: dict[str, list[str]], key: str) -> float:
    text = metadata[key][0]
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not value > 0:
        raise FitError(f"{metadata['file'][0]}: {key} is '{text}'; a number above 0 is allowed")
    return value


def _column(file: File, cell: str) -> str:
    """The name of a column. Raises FitError where the header has another unit for it: "x [mm]"."""
    match = re.fullmatch(r"(.*?)\s*[\[(](.*)[\])]", cell.strip("\"' ").lower())
    name, unit = match.groups() if match else (cell.strip("\"' ").lower(), "")
    allowed = COLUMNS.get(name, "").split(",")[0]
    if allowed and unit and unit.replace("^", "").replace("²", "2") != allowed.replace("^", ""):
        raise FitError(f"{file}:1: column '{cell}'; the unit of '{name}' is {allowed}")
    return name


def read_csv(file: File) -> Recording:
    """A CSV whose header names COLUMNS, in any order, with units or without; others are ignored,
    which is reported. An empty cell or "nan" is a row without that stream.
    """
    lines = text_of(file).splitlines()
    header = [_column(file, name) for name in cells_of(lines[0])]
    if "time" not in header:
        raise FitError(f"{file}:1: no column 'time'; allowed are {', '.join(COLUMNS)}")
    double = sorted({name for name in header if name and header.count(name) > 1})
    if double:
        raise FitError(f"{file}:1: column '{double[0]}' is there twice")
    rows = _rows(file, lines[1:], 2, len(header))
    recording = Recording(file, "CSV file")
    unknown = [name for name in header if name not in COLUMNS]
    if unknown:
        recording.findings.append(f"columns that are not read: {', '.join(unknown)}")
    table = {name: rows[:, header.index(name)] for name in header}

    def stream(name: str, *columns: str) -> tuple[Array, Array] | None:
        there = [one for one in columns if one in table]
        if not there:
            return None
        if len(there) < len(columns):
            raise FitError(
                f"{file}:1: '{there[0]}' without '{next(c for c in columns if c not in table)}'"
            )
        values = np.stack([table[one] for one in columns], axis=1)
        kept = np.isfinite(values).all(axis=1) & np.isfinite(table["time"])
        time, values = sorted_rows(table["time"][kept], values[kept])
        if len(time) == 1 and kept.sum() > 1:
            raise FitError(f"{file}: time is {time[0]:g} s in all rows; it must increase")
        recording.streams[name] = time
        return time, values

    if found := stream("path", "x", "y", "theta"):
        recording.truth = Path(*found, "the log's poses")
    if found := stream("odometry", "odom_x", "odom_y", "odom_theta"):
        recording.odometry = Path(*found, "odometry")
    if found := stream("encoders", "left", "right"):
        recording.wheels = Wheels(found[0], found[1])
    if found := stream("commands", "cmd_v", "cmd_omega"):
        time, value = found
        recording.commands = Commands(time, np.insert(value, 1, 0.0, axis=1))
    if found := stream("imu", "gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z"):
        recording.imu = Imu(found[0], found[1][:, :3], found[1][:, 3:])
    return recording
