"""Reader of CARMEN's text logs: FLASER, ROBOTLASER1 and ODOM lines.

The formats are those that the head of such a log defines. FLASER: n, ranges (m), pose of the laser,
pose of the robot, time of the sender, host, time of the logger.
"""

from __future__ import annotations

import gzip
import math
from collections.abc import Iterator
from pathlib import Path as File
from typing import IO, cast

import numpy as np

from ..files import open_regular
from .errors import FitError
from .recording import Path, Recording, Scans, sorted_rows

LINES = ("FLASER", "ROBOTLASER1", "ODOM", "PARAM", "RLASER", "TRUEPOS", "SYNC", "NEFF", "#")
_MOST_RAYS = 10_000
_MADE = (
    "the log's times do not increase: they were made from the path, at 0.5 m/s; nothing that "
    "depends on time is fitted or compared"
)


def read_carmen(file: File) -> Recording:
    """Raises FitError with the line that is wrong."""
    scans: list[tuple[float, list[float], list[float]]] = []
    odometry: list[list[float]] = []
    fields = {"robot_front_laser_max": math.nan}
    for number, words in _lines(file):
        kind = words[0]
        if kind in ("FLASER", "ROBOTLASER1"):
            scans.append(_scan(file, number, words))
        elif kind == "ODOM" and len(words) >= 9:
            odometry.append([*_numbers(file, number, words[1:4]), _stamp(file, number, words)])
        elif kind == "PARAM" and len(words) > 2 and words[1] in fields:
            fields[words[1]] = _numbers(file, number, words[2:3])[0]
    if not scans:
        raise FitError(f"{file}: no FLASER or ROBOTLASER1 line; a CARMEN log with scans is needed")
    recording = Recording(file, "CARMEN log")
    time, finding = _times([one[0] for one in scans], np.array([one[2] for one in scans]))
    recording.findings += finding
    rays = _most_common([len(one[1]) for one in scans])
    kept = [i for i, one in enumerate(scans) if len(one[1]) == rays]
    if len(kept) < len(scans):
        recording.findings.append(
            f"{len(scans) - len(kept)} scans have another number of rays than {rays}; they are ignored"
        )
    ranges = np.array([scans[i][1] for i in kept])
    when, ranges, poses = sorted_rows(time[kept], ranges, np.array([scans[i][2] for i in kept]))
    limit = _no_return(ranges, fields["robot_front_laser_max"])
    step = math.pi / (rays - 1) if rays % 2 else math.pi / rays
    recording.scans = Scans(when, ranges, -math.pi / 2, step, limit, poses, "log")
    recording.truth = Path(when, poses.copy(), "the log's poses")
    recording.timed = _MADE not in recording.findings
    if recording.timed:
        recording.streams["scans"] = when
    return recording


def _lines(file: File) -> Iterator[tuple[int, list[str]]]:
    with open_regular(file) as raw:
        opened: IO[bytes] = raw
        if raw.read(2) == b"\x1f\x8b":
            raw.seek(0)
            opened = cast(IO[bytes], gzip.GzipFile(fileobj=raw))
        else:
            raw.seek(0)
        try:
            for number, line in enumerate(opened, 1):
                words = line.decode("ascii", "replace").split()
                if words:
                    yield number, words
        except (EOFError, OSError) as error:
            raise FitError(f"{file}: the compressed file is damaged: {error}") from None


def _numbers(file: File, line: int, words: list[str]) -> list[float]:
    try:
        values = [float(word) for word in words]
    except ValueError as error:
        raise FitError(f"{file}:{line}: {error}; a number is allowed") from None
    if not all(map(math.isfinite, values)):
        raise FitError(f"{file}:{line}: {' '.join(words[:5])} ...: finite numbers are allowed")
    return values


def _scan(file: File, line: int, words: list[str]) -> tuple[float, list[float], list[float]]:
    """Time (s), ranges (m), pose of the laser."""
    if words[0] == "FLASER":
        count, first = words[1:2], 2
    else:  # type, start, field of view, resolution, maximum, accuracy, remission mode
        count, first = words[8:9], 9
    rays = int(count[0]) if count and count[0].isdigit() else -1
    if not 2 <= rays <= _MOST_RAYS or len(words) < first + rays + 9:
        raise FitError(
            f"{file}:{line}: {words[0]} with {len(words)} words and '{' '.join(count)}' rays; "
            f"allowed are 2 to {_MOST_RAYS} rays, all their ranges, two poses and the times"
        )
    ranges = _numbers(file, line, words[first : first + rays])
    if words[0] == "FLASER":
        pose = _numbers(file, line, words[first + rays : first + rays + 3])
    else:
        remissions = int(words[first + rays])
        at = first + rays + 1 + remissions
        pose = _numbers(file, line, words[at : at + 3])
    return _stamp(file, line, words), ranges, pose


def _stamp(file: File, line: int, words: list[str]) -> float:
    """Some logs have 0 for the time of the sender or of the logger: the other one then holds."""
    sender, logger = (_numbers(file, line, [words[k]])[0] for k in (-3, -1))
    return sender if sender > 0 else logger


def _most_common(counts: list[int]) -> int:
    values, how_many = np.unique(counts, return_counts=True)
    return int(values[np.argmax(how_many)])


def _no_return(ranges: np.ndarray, declared: float) -> float:
    """The range from which on a reading means "no return": the largest value, if many share it."""
    largest = float(ranges.max())
    if np.mean(ranges > largest - 0.1) > 1e-4:
        return largest - 0.1
    return declared if declared > 0 else largest + 1e-3


def _times(stamps: list[float], poses: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Times that increase. Where the stamps do not (0 everywhere, or a jump back), the scans keep
    their order, at the usual interval.
    """
    time = np.array(stamps)
    gaps = np.diff(time)
    if len(time) > 1 and np.mean(gaps > 0) < 0.5:
        way = np.hypot(*np.diff(poses[:, :2], axis=0).T)
        return np.concatenate([[0.0], np.cumsum(np.maximum(0.1, way / 0.5))]), [_MADE]
    if np.any(gaps < 0):
        usual = float(np.median(gaps[gaps > 0]))
        bad = int(np.sum(gaps < 0))
        time = np.concatenate([[time[0]], time[0] + np.cumsum(np.where(gaps < 0, usual, gaps))])
        return time, [
            f"time goes back in {bad} places: the usual interval of {usual:.3g} s was put there"
        ]
    return time, []
