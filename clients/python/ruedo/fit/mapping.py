"""Occupancy from a recorded drive, and what the scans saw moving.

Each cell counts the scans that end in it and those that pass through it (occupancy by counting:
Haehnel et al., "Map building with mobile robots in dynamic environments", ICRA 2003).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from .errors import FitError
from .recording import Array, Recording, composed

_KEY_M, _KEY_RAD = 0.1, np.radians(5)  # between scans that count
_FARTHEST_M = 25.0  # of what a ray shows to be free
_WALL = 0.25  # least share of the scans at a cell that end there
_LEAST_HITS = 2
_MOVED_HITS, _MOVED_CELLS = 3, 4
_MOST_CELLS = 100_000_000
NO_PATH = "the log has no corrected path: walls follow the robot's own odometry, which drifts"
FREE, OCCUPIED, UNKNOWN = 254, 0, 205  # grey, as map_server has it


@dataclass(eq=False)
class Moving:
    """A place that scans saw occupied and at other times empty."""

    x: float  # m
    y: float
    size: float  # m, the longer side
    first: float  # s, when it was seen
    last: float
    scans: int

    def text(self) -> str:
        return (
            f"something moved at ({self.x:.2f}, {self.y:.2f}) m, {self.size:.2f} m wide, seen from "
            f"{self.first:.1f} to {self.last:.1f} s in {self.scans} scans; it is not in the world"
        )


@dataclass(eq=False)
class Occupancy:
    """grey (rows, columns), row 0 is the northernmost; origin: x, y (m) of the south-western
    corner.
    """

    grey: NDArray[np.uint8]
    resolution: float  # m
    origin: tuple[float, float]
    moving: list[Moving]


def own_mount(recording: Recording) -> Array:
    """(3,) x, y (m), heading (rad) of the range finder on the robot, as far as the log says it."""
    scans = recording.scans
    known = scans is not None and scans.pose is None and scans.mount is not None
    return scans.mount if known else np.zeros(3)  # type: ignore[union-attr, return-value]


def scan_poses(recording: Recording, mount: Array, later: float = 0.0) -> Array:
    """(N, 3) poses of the range finder in the world. mount: x, y, heading on the robot. later: s
    between the time of a scan and that of its pose on the path. Raises FitError.
    """
    recording.need("scans", "scans are needed")
    scans = recording.scans
    assert scans is not None
    if scans.pose is not None:
        robot = scans.pose
    else:
        path = recording.truth
        if path is None:
            recording.need("odometry", "a path is needed (SLAM, /tf map->odom, ROBOT/pose)")
            path = recording.odometry
            if NO_PATH not in recording.findings:
                recording.findings.append(NO_PATH)
        assert path is not None
        robot = path.at(scans.time + later)
        outside = (scans.time < path.time[0]) | (scans.time > path.time[-1])
        robot[outside] = np.nan
        if outside.all():
            raise FitError(
                f"{recording.file}: no scan lies within the path's times ({path.time[0]:g} to "
                f"{path.time[-1]:g} s): the clocks or the units may differ"
            )
    return composed(robot, np.broadcast_to(mount, robot.shape))


def key_scans(poses: Array) -> NDArray[np.int64]:
    """Scans far enough from the one before: a standing robot would count the same thing often."""
    kept: list[int] = []
    for i, pose in enumerate(poses):
        if not np.isfinite(pose).all():
            continue
        if kept:
            step = pose - poses[kept[-1]]
            if np.hypot(step[0], step[1]) < _KEY_M and abs(step[2]) < _KEY_RAD:
                continue
        kept.append(i)
    return np.array(kept, np.int64)


def occupancy(recording: Recording, mount: Array, resolution: float = 0.05) -> Occupancy:
    """Raises FitError for a log whose scans show nothing, or a map of too many cells."""
    poses = scan_poses(recording, mount)
    scans = recording.scans
    assert scans is not None
    keys = key_scans(poses)
    good = np.isfinite(scans.ranges) & (scans.ranges > 0) & (scans.ranges < scans.max_range)
    if len(keys) < 2 or not good[keys].any():
        raise FitError(
            f"{recording.file}: {len(keys)} scans at different places, {good[keys].sum()} ranges; "
            "a drive with returns is needed"
        )
    reach = np.where(good, scans.ranges, 0)[keys].max(axis=1)
    low = (poses[keys, :2] - reach[:, None]).min(axis=0) - 1
    high = (poses[keys, :2] + reach[:, None]).max(axis=0) + 1
    columns, rows = np.ceil((high - low) / resolution).astype(int)
    if columns * rows > _MOST_CELLS:
        raise FitError(
            f"{recording.file}: {columns} x {rows} cells of {resolution:g} m; allowed are "
            f"{_MOST_CELLS}: ranges and poses may be in other units than m"
        )
    counts = _Counts(int(rows * columns))
    for i in keys:
        angles = poses[i, 2] + scans.angles[good[i]]
        rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        ends, free = _cells(poses[i, :2] - low, rays, scans.ranges[i, good[i]], resolution, columns)
        counts.add(ends, np.setdiff1d(free, ends, assume_unique=True), scans.time[i])
    return _judged(counts, (int(rows), int(columns)), resolution, low)


def _cells(
    place: Array, rays: Array, ranges: Array, resolution: float, columns: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cells in which rays end, and cells that they cross, each once."""
    end = ((place + rays * ranges[:, None]) / resolution).astype(np.int64)
    steps = np.arange(0.0, min(float(ranges.max()), _FARTHEST_M), 0.7 * resolution)
    inside = steps[None, :] < ranges[:, None] - 1.5 * resolution
    ray, at = np.nonzero(inside)
    way = ((place + rays[ray] * steps[at, None]) / resolution).astype(np.int64)
    return (
        np.unique(end[:, 1] * columns + end[:, 0]),
        np.unique(way[:, 1] * columns + way[:, 0]),
    )


class _Counts:
    """For each cell: the scans that end in it and that pass it, and when the first and last
    ended.
    """

    def __init__(self, size: int):
        self.hits = np.zeros(size, np.uint16)
        self.passes = np.zeros(size, np.uint16)
        self.first = np.full(size, np.inf, np.float32)
        self.last = np.full(size, -np.inf, np.float32)
        self.start: float | None = None

    def add(self, ends: NDArray[np.int64], free: NDArray[np.int64], time: float) -> None:
        self.start = time if self.start is None else self.start
        self.hits[ends] += 1
        self.passes[free] += 1
        since = np.float32(time - self.start)
        self.first[ends] = np.minimum(self.first[ends], since)
        self.last[ends] = np.maximum(self.last[ends], since)


def _judged(counts: _Counts, shape: tuple[int, int], resolution: float, low: Array) -> Occupancy:
    hits, passes = counts.hits.astype(np.int64), counts.passes.astype(np.int64)
    seen = hits + passes
    wall = (hits >= _LEAST_HITS) & (hits >= _WALL * np.maximum(seen, 1))
    wall |= (hits == 1) & (passes == 0)
    near = ndimage.binary_dilation(wall.reshape(shape), iterations=2).ravel()
    moved = (hits >= _MOVED_HITS) & (passes >= _MOVED_HITS) & ~wall & ~near
    grey = np.full(len(hits), UNKNOWN, np.uint8)
    grey[seen > 0] = FREE
    grey[wall] = OCCUPIED
    labels, _ = ndimage.label(moved.reshape(shape), np.ones((3, 3)))
    moving = []
    for label, (rows, columns) in enumerate(ndimage.find_objects(labels), 1):
        inside = labels[rows, columns] == label
        if inside.sum() < _MOVED_CELLS:
            continue
        row, column = np.nonzero(inside)
        cells = (row + rows.start) * shape[1] + column + columns.start
        start = counts.start or 0.0
        moving.append(
            Moving(
                float(low[0] + resolution * (columns.start + columns.stop) / 2),
                float(low[1] + resolution * (rows.start + rows.stop) / 2),
                resolution * max(rows.stop - rows.start, columns.stop - columns.start),
                start + float(counts.first[cells].min()),
                start + float(counts.last[cells].max()),
                int(counts.hits[cells].max()),
            )
        )
    used = np.argwhere((grey != UNKNOWN).reshape(shape))
    (top, left), (bottom, right) = used.min(axis=0), used.max(axis=0) + 1
    cut = grey.reshape(shape)[top:bottom, left:right]
    origin = (float(low[0] + left * resolution), float(low[1] + top * resolution))
    return Occupancy(np.ascontiguousarray(cut[::-1]), resolution, origin, moving)
