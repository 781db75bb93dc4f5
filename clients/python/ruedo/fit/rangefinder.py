"""Fit of a planar range finder to the surfaces that its own drive shows.

A surface at a reading is the line through the readings of other scans around it. The residual is
the reading less the range to that line. Its spread has two causes that the range and the incidence
tell apart, as Ruedo's sensor has them: noise of the range, and noise of the bearing, which makes
range errors of r tan(incidence). Beside these "hits" of Thrun's beam model (Probabilistic Robotics,
6.3) stands a uniform share of others: mixed readings at edges, glass, what moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from .errors import FitError
from .estimate import Estimate, log_normal, normal
from .mapping import key_scans, scan_poses
from .recording import Array, Recording

WINDOW_M = 0.15  # half length of the line around a reading
LEAST_POINTS = 8
FLAT_M = 0.03  # points that spread more across make no surface
STEEPEST = np.radians(75)  # of incidence; readings beyond it are too uncertain
OUTLIER_M = 0.3  # half width of what residuals are modelled in
_MOST_POINTS = 300_000
_MOST_READINGS = 40_000
_AT_ONCE = 100  # readings, each with up to thousands of points around it
_RANGE_EDGES = (0.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
_LEAST_READINGS = 500
_WIDEST = 1.5  # scatter of a flat surface's points over the noise: 8 points exceed it in 1 of 100
_MOST_ROUNDS = 20


@dataclass(eq=False)
class Surfaces:
    """Readings of one or more scans as points (N, 2) m, of scan (N,)."""

    points: Array
    scan: NDArray[np.int64]
    tree: cKDTree


@dataclass(eq=False)
class Residuals:
    """Of readings with a surface: residual (N,) m, range (N,) m, incidence (N,) rad, standard
    deviation of the surface's own readings about their line (N,) m; and of all readings that were
    looked at the share that has one.
    """

    residual: Array
    reach: Array
    incidence: Array
    scatter: Array
    share: float


@dataclass(frozen=True)
class BeamModel:
    """Ruedo's range finder: sigma of the range (m) and of the bearing (rad); outliers: share."""

    bias: float
    range_sigma: float
    bearing_sigma: float
    outliers: float

    def sigma(self, reach: Array, incidence: Array) -> Array:
        return np.asarray(
            np.hypot(self.range_sigma, self.bearing_sigma * reach * np.tan(incidence)), float
        )


def surfaces_of(recording: Recording, mount: Array, scans: NDArray[np.int64]) -> Surfaces:
    """Of these scans' readings, at most _MOST_POINTS of them."""
    poses = scan_poses(recording, mount)
    data = recording.scans
    assert data is not None
    good = valid(recording)[scans]
    row, ray = np.nonzero(good)
    every = max(1, len(row) // _MOST_POINTS)
    row, ray = row[::every], ray[::every]
    scan = scans[row]
    angles = poses[scan, 2] + data.angles[ray]
    reach = data.ranges[scan, ray][:, None]
    points = poses[scan, :2] + reach * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return Surfaces(points, scan, cKDTree(points))


def valid(recording: Recording) -> NDArray[np.bool_]:
    """(N, K): the readings that are a range."""
    data = recording.scans
    assert data is not None
    return np.isfinite(data.ranges) & (data.ranges > 0) & (data.ranges < data.max_range)


def residuals_of(
    recording: Recording, mount: Array, scans: NDArray[np.int64], surfaces: Surfaces, seed: int = 0
) -> Residuals:
    """Of these scans' readings; those of the same scan are not part of the surface."""
    poses = scan_poses(recording, mount)
    data = recording.scans
    assert data is not None
    row, ray = np.nonzero(valid(recording)[scans])
    if len(row) > _MOST_READINGS:
        chosen = np.sort(
            np.random.default_rng(seed).choice(len(row), _MOST_READINGS, replace=False)
        )
        row, ray = row[chosen], ray[chosen]
    scan = scans[row]
    angles = poses[scan, 2] + data.angles[ray]
    way = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    reach = data.ranges[scan, ray]
    ends = poses[scan, :2] + reach[:, None] * way
    parts = [
        _against_lines(surfaces, ends[part], way[part], scan[part])
        for part in np.array_split(np.arange(len(ends)), max(1, len(ends) // _AT_ONCE))
    ]
    residual, incidence, scatter = np.concatenate(parts, axis=1)
    known = np.isfinite(residual)
    if not known.any():
        raise FitError(f"{recording.file}: no reading lies on a surface that other scans saw")
    share = float(known.mean())
    return Residuals(residual[known], reach[known], incidence[known], scatter[known], share)


def _against_lines(
    surfaces: Surfaces, ends: Array, way: Array, scan: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(3, N): residual (m, scaled to the variance of a reading) and incidence (rad) of readings
    against the lines through the points of other scans around them, and the standard deviation of
    those points about the line (m); NaN without a line.
    """
    near = surfaces.tree.query_ball_point(ends, WINDOW_M)
    row = np.repeat(np.arange(len(ends)), np.array([len(one) for one in near], np.int64))
    point = np.concatenate([np.zeros(0, np.int64), *(np.asarray(one, np.int64) for one in near)])
    others = surfaces.scan[point] != scan[row]
    row, point = row[others], point[others]
    x, y = (surfaces.points[point] - ends[row]).T

    def total(values: Array) -> Array:
        return np.asarray(np.bincount(row, values, len(ends)), float)

    with np.errstate(divide="ignore", invalid="ignore"):
        count = np.bincount(row, minlength=len(ends))
        middle_x, middle_y = total(x) / count, total(y) / count
        xx = total(x * x) - count * middle_x**2
        yy = total(y * y) - count * middle_y**2
        xy = total(x * y) - count * middle_x * middle_y
        apart = np.hypot((xx - yy) / 2, xy)
        small, large = np.maximum((xx + yy) / 2 - apart, 0), (xx + yy) / 2 + apart
        angle = np.arctan2(2 * xy, xx - yy) / 2  # of the line
        sine, cosine = np.sin(angle), np.cos(angle)
        facing = cosine * way[:, 1] - sine * way[:, 0]
        incidence = np.arccos(np.minimum(1.0, np.abs(facing)))
        leverage = 1 / count + (middle_x * cosine + middle_y * sine) ** 2 / large
        residual = (middle_x * sine - middle_y * cosine) / facing / np.sqrt(1 + leverage)
        scatter = np.sqrt(small / (count - 2))
        good = (count >= LEAST_POINTS) & (small / count <= FLAT_M**2) & (large >= 9 * small)
        good &= (large / count >= (WINDOW_M / 4) ** 2) & (incidence <= STEEPEST)
    return np.where(good, [residual, incidence, scatter], np.nan)


def fit_beams(found: Residuals) -> tuple[BeamModel, Array]:
    """Maximum likelihood; and the relative standard deviations of both sigmas."""
    slope = found.reach * np.tan(found.incidence)
    usual = 1.4826 * float(np.median(np.abs(found.residual - np.median(found.residual))))
    inside = np.abs(found.residual) < OUTLIER_M
    x, slope = found.residual[inside], slope[inside]

    def cost(values: Array) -> float:
        bias, log_range, log_bearing, logit = values
        variance = np.exp(2 * log_range) + np.exp(2 * log_bearing) * slope**2
        share = 1 / (1 + np.exp(-logit))
        hit = (
            (1 - share) * np.exp(-0.5 * (x - bias) ** 2 / variance) / np.sqrt(2 * np.pi * variance)
        )
        return -float(np.log(hit + share / (2 * OUTLIER_M)).sum())

    start = np.array([0.0, np.log(max(usual, 1e-4)), np.log(1e-3), -3.0])
    best = minimize(cost, start, method="Nelder-Mead", options={"maxiter": 2000, "fatol": 1e-3})
    values = best.x
    model = BeamModel(
        float(values[0]), float(np.exp(values[1])), float(np.exp(values[2])),
        float(1 / (1 + np.exp(-values[3]))),
    )  # fmt: skip
    return model, _curvature(cost, values)[1:3]


def fit_flat(found: Residuals) -> tuple[BeamModel, Array, int]:
    """The same by readings on flat surfaces, and how many these are. At corners and on round things
    the line is wrong by more than the noise of a good range finder: its points scatter about it by
    more than the model says. The share of outliers is that of all readings.
    """
    model, relative = fit_beams(found)
    outliers, kept = model.outliers, len(found.residual)
    for _ in range(_MOST_ROUNDS):
        noise = model.sigma(found.reach, found.incidence) * np.cos(found.incidence)
        flat = found.scatter <= _WIDEST * noise
        if flat.sum() < _LEAST_READINGS or flat.sum() == kept:
            break
        kept = int(flat.sum())
        model, relative = fit_beams(
            Residuals(
                found.residual[flat], found.reach[flat], found.incidence[flat],
                found.scatter[flat], found.share,
            )
        )  # fmt: skip
    return replace(model, outliers=outliers), relative, kept


def _curvature(cost: object, values: Array) -> Array:
    """Standard deviations by the curvature of the likelihood; infinite without curvature."""
    assert callable(cost)
    step = np.array([1e-4, 0.02, 0.02, 0.05])
    answer = np.full(len(values), np.inf)
    middle = cost(values)
    for i in range(len(values)):
        shift = np.zeros(len(values))
        shift[i] = step[i]
        second = (cost(values + shift) + cost(values - shift) - 2 * middle) / step[i] ** 2
        if second > 1e-9:
            answer[i] = 1 / np.sqrt(second)
    return answer


def fit_rangefinder(
    recordings: Sequence[Recording], mount: Array
) -> tuple[BeamModel, list[Estimate]]:
    """Of the first recording with scans. Raises FitError, also for too little that is seen
    again.
    """
    recording = next(one for one in recordings if one.scans is not None)
    keys = key_scans(scan_poses(recording, mount))
    if len(keys) < 3:
        raise FitError(f"{recording.file}: scans from {len(keys)} places; a drive is needed")
    found = residuals_of(recording, mount, keys, surfaces_of(recording, mount, keys))
    if len(found.residual) < _LEAST_READINGS:
        raise FitError(
            f"{recording.file}: {len(found.residual)} readings lie on surfaces that other scans saw; "
            f"at least {_LEAST_READINGS} are needed"
        )
    model, relative, used = fit_flat(found)
    estimates = []
    for name, value, std, unit in (
        ("range noise", model.range_sigma, relative[0], "m"),
        ("bearing noise", model.bearing_sigma, relative[1], "rad"),
    ):
        if np.isfinite(std) and std < 0.5:
            why = f"on {used} readings; the path's own errors are in it"
            estimates.append(log_normal(name, value, float(std), unit, why))
        else:
            why = "it is too small beside the others, or all surfaces are met head-on"
            estimates.append(Estimate(name, None, why=why))
    farthest = float(np.quantile(found.reach, 0.99))
    why = "surfaces farther away are needed"
    estimates.append(Estimate(f"noise beyond {farthest:.2g} m", None, why=why))
    estimates.append(Estimate("bias of the range", None, why="surfaces are the range finder's own"))
    share = max(model.outliers, 0.0)
    std = np.sqrt(share * (1 - share) / len(found.residual))
    estimates.append(normal("share of short and mixed returns", share, float(std)))
    return model, estimates + _no_returns(recording, keys) + _resolution(recording)


def _no_returns(recording: Recording, keys: NDArray[np.int64]) -> list[Estimate]:
    data = recording.scans
    assert data is not None
    seen = data.ranges[keys]
    lost = ~np.isfinite(seen) | (seen >= data.max_range)
    count, missing = seen.size, int(lost.sum())
    share = missing / count
    std = np.sqrt(max(share * (1 - share), 1 / count) / count)
    why = (
        "of all beams: open space is in it; by range, incidence and reflectance it needs the world"
    )
    return [
        Estimate(
            "share of beams without return",
            share,
            max(0.0, share - 2 * std),
            share + 2 * std,
            "",
            why,
        )
    ]


def _resolution(recording: Recording) -> list[Estimate]:
    """The step of the readings, if they have one."""
    data = recording.scans
    assert data is not None
    values = np.round(data.ranges[valid(recording)][:20_000], 6)
    for step in (0.05, 0.01, 0.005, 0.001):
        if np.mean(np.abs(values / step - np.round(values / step)) < 1e-3) > 0.999:
            return [Estimate("resolution", step, unit="m", why="all readings are multiples")]
    return [Estimate("resolution", None, why="readings are not multiples of 1 mm or more")]
