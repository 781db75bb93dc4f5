"""Fit of a drive: radii, track or lever, and the random errors of the wheels.

Systematic errors as Borenstein and Feng define them (IEEE Trans. Robotics and Automation 12, 1996),
by maximum likelihood over the whole drive in place of UMBmark's squares. Random errors: slip grows
with the square root of the way of each wheel, as in <ruedo:slip_noise>; the spread of distance and
heading per metre and per radian is that of Thrun et al. (Probabilistic Robotics, 5.4; alpha
1 to 4).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from .drives import Drive, integrate
from .errors import FitError
from .estimate import Estimate, log_normal, normal
from .noise import Walk, fit_walk, whiten
from .recording import Array, Geometry, Recording, body_steps

STEP_M = 0.1  # of the wheels, between two readings that are compared
_LEAST_STEPS = 20
_ODD = 3.0  # times; between nominal measures and the path's
_ROUNDS = 3  # of parameters and variances in turn; they change by far less than their errors then
_UNSURE = 0.05  # relative std from which on a measure is not determined
_PLACE = ["tracked point ahead", "tracked point left", "tracked heading"]  # in base_link
_LACKS = {
    "track": "the drive has too few turns",
    "lever arm": "the drive has too few turns",
    "wheelbase": "the drive has too few turns",
}


@dataclass
class Run:
    """One drive at the encoders' rate; cuts are the rows at which steps of STEP_M begin."""

    moved: Array  # (N, 3) of the tracked point: arc ahead, arc left, turn
    turned: Array  # (N, W) rad
    steering: Array | None
    cuts: NDArray[np.int64]
    clock: Array  # (M,) m, mean way of a wheel in each step
    time: Array  # (N + 1,)
    pose: Array  # (N + 1, 3)

    def summed(self, fine: Array) -> Array:
        return np.add.reduceat(fine, self.cuts, axis=0)


@dataclass
class OdometryFit:
    """parameters: as of Drive.names. place: x, y (m), heading (rad) of the tracked point on the
    robot. covariance: of both. slip: sigma per square root of a metre, of each wheel.
    """

    drive: Drive
    parameters: Array
    place: Array
    covariance: Array
    determined: Array  # (P,) bool
    slip: float
    walks: list[Walk]
    estimates: list[Estimate] = field(default_factory=list)
    end_errors: list[tuple[float, float]] = field(default_factory=list)  # m, nominal and fitted
    runs: list[Run] = field(default_factory=list)


def wheels_of(recording: Recording, geometry: Geometry) -> tuple[Array, Array, Array | None]:
    """Times (N,), wheel angles (N, W) and steering; from the odometry where no encoder is there."""
    wheels = recording.wheels
    if wheels is not None:
        return wheels.time, wheels.turned, wheels.steering
    recording.need("odometry", "encoders or odometry are needed")
    odometry = recording.odometry
    assert odometry is not None
    if geometry.kind != "differential":
        raise FitError(f"{recording.file}: a drive of the kind {geometry.kind} needs encoders")
    ahead, _, turn = body_steps(odometry.pose).T
    ways = np.stack(
        [ahead - turn * geometry.track_m / 2, ahead + turn * geometry.track_m / 2], axis=1
    )
    turned = np.concatenate([np.zeros((1, 2)), np.cumsum(ways, axis=0)]) / geometry.radius_m
    return odometry.time, turned, None


def run_of(recording: Recording, drive: Drive) -> Run:
    recording.need("truth", "the robot's path is needed (motion capture, SLAM, simulation)")
    truth = recording.truth
    assert truth is not None
    time, turned, steering = wheels_of(recording, drive.geometry)
    inside = (time >= truth.time[0]) & (time <= truth.time[-1])
    if inside.sum() < _LEAST_STEPS:
        raise FitError(
            f"{recording.file}: {inside.sum()} readings of the wheels lie within the path's times "
            f"({truth.time[0]:g} to {truth.time[-1]:g} s): the clocks or the units may differ"
        )
    time, turned = time[inside], turned[inside]
    pose, steps = truth.at(time), np.diff(turned, axis=0)
    ways = np.abs(steps).mean(axis=1) * drive.geometry.radius_m
    driven = np.concatenate([[0.0], np.cumsum(ways)])
    count = int(driven[-1] / STEP_M)
    if count < _LEAST_STEPS:
        raise FitError(
            f"{recording.file}: the wheels went {driven[-1]:.3g} m; at least "
            f"{_LEAST_STEPS * STEP_M:g} m are needed"
        )
    cuts = np.unique(np.searchsorted(driven, STEP_M * np.arange(count + 1) - 1e-12)).astype(
        np.int64
    )
    middle = None
    if steering is not None:
        angles = steering[inside]
        middle = (angles[1:] + angles[:-1]) / 2
        middle = middle[: cuts[-1]]
    clock = np.diff(driven[cuts])
    last = cuts[-1]
    run = Run(
        body_steps(pose)[:last], steps[:last], middle, cuts[:-1], clock,
        time[: last + 1], pose[: last + 1],
    )  # fmt: skip
    _check_units(recording, drive, run)
    return run


def _check_units(recording: Recording, drive: Drive, run: Run) -> None:
    """Raises FitError where the path moves in no way that the nominal wheels could."""
    left = run.summed(drive.residuals(drive.nominal(), run.moved, run.turned, run.steering))
    ways = run.summed(run.turned) * drive.geometry.radius_m
    ratio = float(np.abs(ways - left[:, : drive.wheels]).sum() / np.abs(ways).sum())
    if not 1 / _ODD < ratio < _ODD:
        raise FitError(
            f"{recording.file}: the path moves {ratio:.3g} times as far as wheels of "
            f"{drive.geometry.radius_m:g} m at {drive.geometry.track_m:g} m turn: allowed are m and "
            "rad in the log, and nominal measures within a third and three times the true ones"
        )


def base_motion(moved: Array, place: Array) -> Array:
    """Motion of base_link from that of the tracked point at `place` (x, y, heading) on it."""
    x, y, heading = place
    sine, cosine = np.sin(heading), np.cos(heading)
    ahead = cosine * moved[:, 0] - sine * moved[:, 1] + y * moved[:, 2]
    left = sine * moved[:, 0] + cosine * moved[:, 1] - x * moved[:, 2]
    return np.stack([ahead, left, moved[:, 2]], axis=1)


def fit_odometry(
    recordings: Sequence[Recording], geometry: Geometry, plain: bool = False
) -> OdometryFit:
    """Fits the drives of one robot. plain: least squares, all errors alike, as a baseline.

    Raises FitError for a log without a path, without wheels, or in which little is driven.
    """
    drive = Drive(geometry)
    runs = [run_of(one, drive) for one in recordings]
    values = np.append(drive.nominal(), np.zeros(3))
    scale = np.append(drive.scale(), np.ones(3))
    size = len(drive.names)

    def residuals(scaled: Array) -> list[Array]:
        x = scaled * scale
        return [
            one.summed(
                drive.residuals(
                    x[:size], base_motion(one.moved, x[size:]), one.turned, one.steering
                )
            )
            for one in runs
        ]

    walks: list[Walk] = []
    for _ in range(1 if plain else _ROUNDS):
        current = walks

        def white(scaled: Array, current: list[Walk] = current) -> Array:
            parts = []
            for one, run in zip(residuals(scaled), runs):
                for k in range(one.shape[1]):
                    clock = run.clock[None]
                    parts.append(whiten(one[:, k], current[k], clock) if current else one[:, k])
            return np.concatenate(parts)

        solved = least_squares(
            white, values / scale, method="lm" if plain else "trf", x_scale="jac"
        )
        values = solved.x * scale
        walks = _walks(drive, residuals(solved.x), runs)
    covariance, determined = _covariance(solved.jac, scale)
    fit = OdometryFit(
        drive, values[:size], values[size:], covariance, determined, _slip(drive, walks), walks
    )
    fit.estimates = _estimates(fit) + _spreads(fit, residuals(solved.x), runs)
    fit.runs = runs
    fit.end_errors = [_end_errors(fit, one) for one in runs]
    return fit


def _walks(drive: Drive, residuals: list[Array], runs: list[Run]) -> list[Walk]:
    """One for each channel; the wheels of a drive share theirs."""
    wheels = drive.wheels
    pooled = fit_walk(
        [(one[:, k], run.clock[None]) for one, run in zip(residuals, runs) for k in range(wheels)]
    )
    others = range(wheels, residuals[0].shape[1])
    return [pooled] * wheels + [
        fit_walk([(one[:, k], run.clock[None]) for one, run in zip(residuals, runs)])
        for k in others
    ]


def _slip(drive: Drive, walks: list[Walk]) -> float:
    return float(np.sqrt(walks[0].q[0]))


def _covariance(jacobian: Array, scale: Array) -> tuple[Array, Array]:
    """And which parameters the drive determines: those outside of the directions that change
    nothing, with a standard deviation below _UNSURE of their size.
    """
    _, singular, rows = np.linalg.svd(jacobian, full_matrices=False)
    kept = singular > singular[0] * 1e-9
    inverse = (rows[kept].T / singular[kept] ** 2) @ rows[kept]
    seen = np.sum(rows[kept] ** 2, axis=0) > 1 - 1e-6
    return inverse * np.outer(scale, scale), seen & (np.sqrt(np.diag(inverse)) < _UNSURE)


def _estimates(fit: OdometryFit) -> list[Estimate]:
    names = fit.drive.names + _PLACE
    units = fit.drive.units + ["m", "m", "rad"]
    stds = np.sqrt(np.diag(fit.covariance))
    answer = []
    for name, unit, value, std, known in zip(
        names, units, np.append(fit.parameters, fit.place), stds, fit.determined
    ):
        if known:
            answer.append(normal(name, float(value), float(std), unit))
        else:
            why = _LACKS.get(name, "the drive has too little of the motion that shows it")
            answer.append(Estimate(name, None, why=why))
    walk = fit.walks[0]
    relative = float(walk.relative_std[0])
    if np.isfinite(relative) and relative < 1:
        answer.append(log_normal("slip noise", fit.slip, relative / 2, "sqrt(m)"))
    else:
        why = "it is smaller than the errors of the path"
        answer.append(Estimate("slip noise", None, why=why))
    return answer


def _spreads(fit: OdometryFit, residuals: list[Array], runs: list[Run]) -> list[Estimate]:
    """Thrun's alphas: sigma of heading and distance per root of a metre and of a radian."""
    if fit.drive.geometry.kind != "differential" or not fit.determined[: len(fit.parameters)].all():
        return []
    track = fit.parameters[2]
    series = []
    for one, run in zip(residuals, runs):
        moved = np.abs(run.summed(base_motion(run.moved, fit.place)))
        series.append((one[:, 0], one[:, 1], moved[:, [0, 2]].T))
    kinds: list[tuple[str, str, str, Callable[[Array, Array], Array], str]] = [
        ("heading", "alpha 2", "alpha 1", lambda left, right: (right - left) / track, "rad"),
        ("distance", "alpha 3", "alpha 4", lambda left, right: (right + left) / 2, "m"),
    ]
    answer = []
    for what, per_m, per_rad, error, unit in kinds:
        walk = fit_walk([(error(left, right), clocks) for left, right, clocks in series])
        for k, (alpha, driven) in enumerate(((per_m, "m"), (per_rad, "rad"))):
            name = f"{alpha}: {what} per root {driven}"
            relative = float(walk.relative_std[k])
            if np.isfinite(relative) and relative < 1:
                root = float(np.sqrt(walk.q[k]))
                answer.append(log_normal(name, root, relative / 2, f"{unit}/sqrt({driven})"))
            else:
                why = "too little of that motion, or less than the errors of the path"
                answer.append(Estimate(name, None, why=why))
    return answer


def _end_errors(fit: OdometryFit, run: Run) -> tuple[float, float]:
    """m at the end of the drive, with the nominal and with the fitted values."""
    nominal = end_error(fit.drive, fit.drive.nominal(), fit.place, run)
    return nominal, end_error(fit.drive, fit.parameters, fit.place, run)


def end_error(drive: Drive, parameters: Array, place: Array, run: Run) -> float:
    """Distance (m) between the tracked point and where dead reckoning has it, at the end."""
    x, y, _ = place
    moved = drive.moved(parameters, run.turned, run.steering)
    end = integrate(moved, reckoned_from(run, place))[-1]
    return float(np.hypot(*(end[:2] + _rotated(end[2], x, y) - run.pose[-1, :2])))


def reckoned_from(run: Run, place: Array) -> Array:
    """Pose of base_link at the first reading, where the tracked point is at `place` on it."""
    start = run.pose[0] - [0, 0, place[2]]
    start[:2] -= _rotated(start[2], place[0], place[1])
    return start


def _rotated(heading: float, x: float, y: float) -> Array:
    return np.array(
        [np.cos(heading) * x - np.sin(heading) * y, np.sin(heading) * x + np.cos(heading) * y]
    )
