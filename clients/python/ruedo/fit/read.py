"""Opens a log of any kind that a fit reads; its content says which kind it is."""

from __future__ import annotations

import gzip
from pathlib import Path as File

import numpy as np

from ..files import open_regular
from ..logs import EVENT
from .bags import read_bag
from .carmen import LINES, read_carmen
from .errors import FitError
from .lcm_log import read_lcm
from .recording import Array, Path, Recording
from .tables import cells_of, read_csv, read_encoder_table

KINDS = (
    "CARMEN log, LCM log, ROS 1 or 2 bag (.bag, sqlite3, MCAP), encoder table with its metadata, "
    "CSV with a header"
)
_MOST_GAP_S = 5.0  # between readings of wheels
_FASTEST_M_S = 100.0  # of a drive


def read(path: str | File, robot: str = "") -> Recording:
    """A recording from a file, or from the folder of a ROS 2 bag. robot: of an LCM log with
    several.

    Raises FitError for a file that is not a log or is damaged, OSError for what cannot be opened.
    """
    recording = _read(File(path), robot)
    for name in ("truth", "odometry"):
        if (stream := getattr(recording, name)) is not None:
            _check_speed(recording.file, "path" if name == "truth" else name, stream)
    for name in ("odometry", "wheels", "imu"):
        if (stream := getattr(recording, name)) is not None:
            _check_times(recording.file, name, stream.time)
    return recording


def _check_speed(file: File, name: str, path: Path) -> None:
    """Raises FitError where a path is faster than anything that drives."""
    speed = np.hypot(*np.diff(path.pose[:, :2], axis=0).T) / np.diff(path.time)
    usual = float(np.median(speed[speed > 0])) if np.sum(speed > 0) > 2 else 0.0
    if usual > _FASTEST_M_S:
        raise FitError(
            f"{file}: its {name} moves at {usual:.3g} m/s; allowed are m and s: these may be in "
            "another unit"
        )


def _check_times(file: File, name: str, time: Array) -> None:
    """Raises FitError where a stream that follows a drive is too slow for one."""
    gap = float(np.median(np.diff(time))) if len(time) > 2 else 0.0
    if gap > _MOST_GAP_S:
        raise FitError(
            f"{file}: a reading of its {name} every {gap:.3g} s; allowed are times in s: "
            "these may be in another unit (ms, us, ns)"
        )


def _read(file: File, robot: str) -> Recording:
    if file.is_dir():
        if not (file / "metadata.yaml").exists():
            raise FitError(f"{file}: a folder without metadata.yaml; that of a ROS 2 bag has one")
        return read_bag(file)
    head = _head(file)
    if not head:
        raise FitError(f"{file}: it is empty; allowed are {KINDS}")
    if head.startswith(EVENT):
        return read_lcm(file, robot)
    if head.startswith((b"#ROSBAG", b"\x89MCAP", b"SQLite format 3")):
        return read_bag(file)
    first = head.decode("utf-8-sig", "replace").split("\n")[0].strip()
    if first.split(" ")[0] in LINES or first.startswith("#"):
        return read_carmen(file)
    cells = cells_of(first)
    if len(cells) > 1:
        return read_encoder_table(file) if _is_number(cells[0]) else read_csv(file)
    raise FitError(f"{file}: it begins with '{first[:40]}'; allowed are {KINDS}")


def _head(file: File) -> bytes:
    with open_regular(file) as raw:
        head = raw.read(512)
        if head[:2] != b"\x1f\x8b":
            return head
        raw.seek(0)
        try:
            return gzip.GzipFile(fileobj=raw).read(512)
        except (EOFError, OSError) as error:
            raise FitError(f"{file}: the compressed file is damaged: {error}") from None


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
