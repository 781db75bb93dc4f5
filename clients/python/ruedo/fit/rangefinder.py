"""Fit of a planar range finder to the surfaces that its own drive shows.

A surface at a reading is the line through the readings of other scans around it. The residual is
the reading less the range to that line. Its spread has two causes that the range and the incidence
tell apart, as Ruedo's sensor has them: noise of the range, and noise of the bearing, which makes
range errors of r tan(incidence). Beside these "hits" of Thrun's beam model (Probabilistic Robotics,
6.3) stands a uniform share of others: mixed readings at edges, glass, what moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import cKDTree
from scipy.special import erf

from .errors import FitError
from .estimate import Estimate, log_normal, normal
from .lines import Against, Points, against_lines
from .mapping import key_scans, scan_poses
from .noise import stds_of
from .recording import Array, Recording

WINDOW_M = 0.15  # half length of the line around a reading
LEAST_POINTS = 8
FLAT_M = 0.03  # points that spread more across make no surface
STEEPEST = np.radians(75)  # of incidence; readings beyond it are too uncertain
OUTLIER_M = 0.3  # half width of what residuals are modelled in
_MOST_POINTS = 300_000
_MOST_READINGS = 40_000
_AT_ONCE = 500  # readings, each with hundreds of points around it
_RANGE_EDGES = (0.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
_LEAST_READINGS = 500
# Of the fit against weighted lines.
_MOST_LINE_POINTS = 60_000
_MOST_LINE_READINGS = 12_000
_LEAST_ROUNDS, _MOST_ROUNDS = 2, 10
_NOTHING = 1e-9  # of information, by the limits of _PLACE
_STILL = 0.3  # std of a place that moves no more
_GATE = 4.0  # sigma
_RATE_S = 0.05  # half of the time over which the speed of a path is taken
# Where a range finder is: name, unit, std from which on it is not determined, and why that may be.
_PLACE = (
    ("mounting ahead", "m", 0.02, "the drive has too few turns"),
    ("mounting left", "m", 0.02, "the drive has too few turns"),
    ("mounting angle", "rad", 0.01, "surfaces are seen in too few directions"),
    ("time offset", "s", 0.02, "the robot moves too little"),
)


@dataclass(eq=False)
class Surfaces:
    """Readings of one or more scans as points (N, 2) m, of scan (N,)."""

    points: Array
    scan: NDArray[np.int64]
    tree: cKDTree


@dataclass(eq=False)
class Residuals:
    """Of readings with a surface: residual (N,) m, range (N,) m, incidence (N,) rad, and of all
    readings that were looked at the share that has one.
    """

    residual: Array
    reach: Array
    incidence: Array
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
    residual, incidence = np.concatenate(parts, axis=1)
    known = np.isfinite(residual)
    if not known.any():
        raise FitError(f"{recording.file}: no reading lies on a surface that other scans saw")
    return Residuals(residual[known], reach[known], incidence[known], float(known.mean()))


def _against_lines(
    surfaces: Surfaces, ends: Array, way: Array, scan: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(2, N): residual (m, scaled to the variance of a reading) and incidence (rad) of readings
    against the lines through the points of other scans around them; NaN without a line.
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
        good = (count >= LEAST_POINTS) & (small / count <= FLAT_M**2) & (large >= 9 * small)
        good &= (large / count >= (WINDOW_M / 4) ** 2) & (incidence <= STEEPEST)
    return np.where(good, [residual, incidence], np.nan)


def fit_beams(found: Residuals, line: Array | None = None) -> tuple[BeamModel, Array]:
    """Maximum likelihood; and the relative standard deviations of both sigmas. line: sigma (N,) m
    of other errors of each residual.
    """
    slope = found.reach * np.tan(found.incidence)
    usual = 1.4826 * float(np.median(np.abs(found.residual - np.median(found.residual))))
    inside = np.abs(found.residual) < OUTLIER_M
    x, slope = found.residual[inside], slope[inside]
    others = np.zeros(len(x)) if line is None else line[inside] ** 2

    def cost(values: Array) -> float:
        bias, log_range, log_bearing, logit = values
        variance = np.exp(2 * log_range) + np.exp(2 * log_bearing) * slope**2 + others
        share = 1 / (1 + np.exp(-logit))
        hit = np.exp(-0.5 * (x - bias) ** 2 / variance) / np.sqrt(2 * np.pi * variance)
        hit *= (1 - share) / erf(OUTLIER_M / np.sqrt(2 * variance))
        return -float(np.log(hit + share / (2 * OUTLIER_M)).sum())

    start = np.array([0.0, np.log(max(usual, 1e-4)), np.log(1e-3), -3.0])
    best = minimize(cost, start, method="Nelder-Mead", options={"maxiter": 2000, "fatol": 1e-3})
    values = best.x
    model = BeamModel(
        float(values[0]), float(np.exp(values[1])), float(np.exp(values[2])),
        float(1 / (1 + np.exp(-values[3]))),
    )  # fmt: skip
    return model, stds_of(cost, values, np.array([1e-4, 0.02, 0.02, 0.05]))[1:3]


_ANY_NOISE = BeamModel(0.0, 0.05, 0.01, 0.0)  # to begin with


@dataclass(eq=False)
class Place:
    """Values and standard deviations of _PLACE; empty where the log has the scans' own poses."""

    value: Array
    std: Array

    def points(
        self, recording: Recording, scan: NDArray[np.int64], ray: NDArray[np.int64]
    ) -> Points:
        """Of these readings, with the derivatives by the values."""
        data = recording.scans
        assert data is not None
        x, y, turn, late = self.value if len(self.value) else np.zeros(4)
        poses = scan_poses(recording, np.array([x, y, turn]), -late)[scan]
        heading = poses[:, 2] + data.angles[ray]
        beam = np.stack([np.cos(heading), np.sin(heading)], axis=1)
        reach = data.ranges[scan, ray]
        place = poses[:, :2] + reach[:, None] * beam
        if not len(self.value):
            return Points(place, beam, reach, scan, np.zeros((len(scan), 0, 2)))
        path = recording.truth or recording.odometry
        assert path is not None
        when = data.time[scan] - late
        robot = path.at(when)
        rate = (path.at(when + _RATE_S) - path.at(when - _RATE_S)) / (2 * _RATE_S)
        ahead = np.stack([np.cos(robot[:, 2]), np.sin(robot[:, 2])], axis=1)
        swing = rate[:, 2:] * _left_of(place - robot[:, :2])
        by = [ahead, _left_of(ahead), reach[:, None] * _left_of(beam), -rate[:, :2] - swing]
        return Points(place, beam, reach, scan, np.stack(by, axis=1))


def _left_of(vectors: Array) -> Array:
    return np.stack([-vectors[:, 1], vectors[:, 0]], axis=1)


def _refined(
    recording: Recording, mount: Array, keys: NDArray[np.int64]
) -> tuple[BeamModel, Array, Place, Array]:
    """Against lines whose points are weighted by the noise of their beams, which the round before
    found; also, where the range finder is and how late its clock. With the ranges of the readings.
    """
    data = recording.scans
    assert data is not None
    row, ray = np.nonzero(valid(recording)[keys])
    if len(row) < _LEAST_READINGS:
        raise FitError(
            f"{recording.file}: {len(row)} ranges; at least {_LEAST_READINGS} are needed"
        )
    model = _ANY_NOISE
    rng = np.random.default_rng(1)
    points, readings = (
        np.sort(rng.choice(len(row), min(len(row), most), replace=False))
        for most in (_MOST_LINE_POINTS, _MOST_LINE_READINGS)
    )
    place = Place(np.zeros(0) if data.pose is not None else np.append(mount, 0.0), np.zeros(0))
    step = _step_of(recording) or 0.0
    farthest = data.ranges[keys[row], ray].max()
    for turn in range(_MOST_ROUNDS):
        at = place.points(recording, keys[row[points]], ray[points])
        seen = place.points(recording, keys[row[readings]], ray[readings])
        found = against_lines(seen, at, (model.range_sigma, model.bearing_sigma))
        if len(found.residual) < _LEAST_READINGS:
            raise FitError(
                f"{recording.file}: {len(found.residual)} readings lie on flat surfaces that other "
                f"scans saw; at least {_LEAST_READINGS} are needed"
            )
        # Beyond the farthest range only those that are too short come back.
        sigma = model.sigma(seen.reach[found.reading], found.incidence)
        found = found.part(seen.reach[found.reading] - found.residual < farthest - _GATE * sigma)
        reach = seen.reach[found.reading]
        residuals = Residuals(found.residual, reach, found.incidence, 1.0)
        if turn == 0:  # of _ANY_NOISE, which may be more than all there is
            found.line[:] = 0.0
        model, relative = fit_beams(residuals, np.hypot(found.line, step / np.sqrt(12)))
        variance = model.sigma(reach, found.incidence) ** 2 + found.line**2
        before, place = place, _moved(place, found, variance, seen.scan[found.reading])
        moved = np.abs(place.value - before.value) > _STILL * place.std
        if turn >= _LEAST_ROUNDS and not moved.any():
            break
    return model, relative, place, reach


def _moved(place: Place, found: Against, variance: Array, scan: NDArray[np.int64]) -> Place:
    """By weighted least squares; errors of one scan go together, as those of its pose do."""
    good = found.residual**2 < _GATE**2 * variance
    by, left, weight = found.by[good], found.residual[good], 1 / variance[good]
    limits = np.array([one[2] for one in _PLACE[: by.shape[1]]])
    free = np.ones(len(limits), bool)
    value, std = place.value.copy(), np.full(len(limits), np.inf)
    while free.any():
        some = by[:, free] * limits[free]
        inverse = np.linalg.inv((some * weight[:, None]).T @ some + _NOTHING * np.eye(free.sum()))
        change = -inverse @ (some.T @ (weight * left))
        scores = np.zeros((int(scan.max()) + 1, some.shape[1]))
        np.add.at(scores, scan[good], some * (weight * (left + some @ change))[:, None])
        together = inverse @ (scores.T @ scores) @ inverse
        stds = np.sqrt(np.maximum(np.diag(inverse), np.diag(together)))  # of their limits
        if stds.max() < 1:
            value[free] += change * limits[free]
            std[free] = stds * limits[free]
            break
        free[np.flatnonzero(free)[int(np.argmax(stds))]] = False
    return Place(value, std)


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
    model, relative, place, reach = _refined(recording, mount, keys)
    estimates = []
    for name, value, std, unit in (
        ("range noise", model.range_sigma, relative[0], "m"),
        ("bearing noise", model.bearing_sigma, relative[1], "rad"),
    ):
        if np.isfinite(std) and std < 0.5:
            why = f"on {len(reach)} readings; the path's own errors are in it"
            estimates.append(log_normal(name, value, float(std), unit, why))
        else:
            why = "it is too small beside the others, or all surfaces are met head-on"
            estimates.append(Estimate(name, None, why=why))
    farthest = float(np.quantile(reach, 0.99))
    why = "surfaces farther away are needed"
    estimates.append(Estimate(f"noise beyond {farthest:.2g} m", None, why=why))
    estimates.append(Estimate("bias of the range", None, why="surfaces are the range finder's own"))
    name = "share of short and mixed returns"
    estimates.append(_share(name, model.outliers, len(reach), "near flat surfaces"))
    estimates += _place_estimates(place)
    return model, estimates + _no_returns(recording, keys) + _resolution(recording)


def _place_estimates(place: Place) -> list[Estimate]:
    answer = []
    for k, (name, unit, _, why) in enumerate(_PLACE):
        if k >= len(place.value):
            answer.append(Estimate(name, None, why="the log has the range finder's own poses"))
        elif np.isfinite(place.std[k]):
            answer.append(normal(name, float(place.value[k]), float(place.std[k]), unit))
        else:
            answer.append(Estimate(name, None, why=why))
    return answer


def _no_returns(recording: Recording, keys: NDArray[np.int64]) -> list[Estimate]:
    data = recording.scans
    assert data is not None
    seen = data.ranges[keys]
    lost = ~np.isfinite(seen) | (seen >= data.max_range)
    count, missing = seen.size, int(lost.sum())
    why = "of all beams, and open space; with --world: by range, incidence, reflectance"
    return [_share("share of beams without return", missing / count, count, why)]


def _share(name: str, share: float, count: int, why: str) -> Estimate:
    std = np.sqrt(max(share * (1 - share), 1 / count) / count)
    return Estimate(name, share, max(0.0, share - 2 * std), share + 2 * std, "", why)


def _step_of(recording: Recording) -> float | None:
    """The step (m) of the readings, if they have one."""
    data = recording.scans
    assert data is not None
    values = np.round(data.ranges[valid(recording)][:20_000], 6)
    for step in (0.05, 0.01, 0.005, 0.001):
        if np.mean(np.abs(values / step - np.round(values / step)) < 1e-3) > 0.999:
            return step
    return None


def _resolution(recording: Recording) -> list[Estimate]:
    if step := _step_of(recording):
        return [Estimate("resolution", step, unit="m", why="all readings are multiples")]
    return [Estimate("resolution", None, why="readings are not multiples of 1 mm or more")]
