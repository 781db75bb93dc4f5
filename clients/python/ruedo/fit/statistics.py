"""Two drives, real or simulated, by their distributions: ranges, drift of odometry, spectra.

Messages of two drives do not match one by one; their distributions should. Range residuals are
those of ruedo.fit.rangefinder, each against the surfaces of its own log. Drift is the relative pose
error of Sturm et al. (A benchmark for the evaluation of RGB-D SLAM systems, IROS 2012) over each
stretch of a distance or a time. Spectra are Welch's.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.signal import welch
from scipy.stats import energy_distance, ks_2samp

from .align import find_path
from .drives import Drive, integrate
from .errors import FitError
from .fitting import Robot, mount_on
from .mapping import key_scans, scan_poses
from .rangefinder import OUTLIER_M, Residuals, residuals_of, surfaces_of, valid
from .recording import Array, Path, Recording, body_steps, wrapped

RANGES = ((0, 2), (2, 4), (4, 8), (8, 82))  # m
INCIDENCES = ((0, 20), (20, 45), (45, 75))  # degrees
DISTANCES_M = (1, 10, 100)
TIMES_S = (60, 600)
BANDS_HZ = ((0.02, 0.1), (0.1, 0.5), (0.5, 2), (2, 10), (10, 50), (50, 250))
_LEAST = 20  # values in each log, of which a distribution is shown
_LEAST_STRETCHES = 3
_STRETCHES_PER_LENGTH = 4  # starts of stretches, which overlap
_SEGMENT_S = 50.0  # of a spectrum
_QUANTILES = (0.05, 0.5, 0.95)


@dataclass(eq=False)
class Row:
    """One quantity of both drives. values: (N,) and (M,), in units of `unit`. group: of rows of one
    part that belong into one plot.
    """

    part: str
    group: str
    name: str
    unit: str
    values: tuple[Array, Array]

    def as_dict(self) -> dict[str, Any]:
        a, b = self.values
        return {
            "name": self.name,
            "unit": self.unit,
            "count": [len(a), len(b)],
            "quantiles": [[float(q) for q in np.quantile(one, _QUANTILES)] for one in (a, b)],
            "kolmogorov_smirnov": float(ks_2samp(a, b).statistic),
            "energy_distance": float(energy_distance(a, b)),
        }


@dataclass(eq=False)
class Spectrum:
    """power: per Hz, of both drives, at `hertz` of each."""

    name: str
    unit: str
    hertz: tuple[Array, Array]
    power: tuple[Array, Array]

    def bands(self) -> list[tuple[float, float, float, float]]:
        """Low and high (Hz), rms of each drive within."""
        answer = []
        for low, high in BANDS_HZ:
            both: list[float] = []
            for hertz, power in zip(self.hertz, self.power):
                inside = (hertz >= low) & (hertz < high)
                if hertz[-1] >= high * 0.99 and inside.any():
                    both.append(float(np.sqrt(power[inside].sum() * (hertz[1] - hertz[0]))))
            if len(both) == 2:
                answer.append((float(low), float(high), both[0], both[1]))
        return answer


@dataclass(eq=False)
class Statistics:
    """quantiles are those of 5, 50 and 95 %. remarks: what could not be compared, and why."""

    files: tuple[str, str]
    rows: list[Row] = field(default_factory=list)
    spectra: list[Spectrum] = field(default_factory=list)
    shares: dict[str, tuple[float, float]] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        parts: dict[str, list[Any]] = {}
        for row in self.rows:
            parts.setdefault(row.part, []).append(row.as_dict())
        spectra = [
            {
                "name": one.name,
                "unit": one.unit,
                "bands": [{"hertz": [a, b], "rms": [x, y]} for a, b, x, y in one.bands()],
            }
            for one in self.spectra
        ]
        shares = {name: list(both) for name, both in self.shares.items()}
        return {
            "logs": list(self.files),
            "remarks": self.remarks,
            "distributions": parts,
            "shares": shares,
            "spectra": spectra,
        }

    def text(self) -> str:
        lines = [f"A: {self.files[0]}", f"B: {self.files[1]}"]
        part = ""
        for row in self.rows:
            if row.part != part:
                part = row.part
                lines += [
                    part,
                    f"  {'':26}{'A: 5 %':>10}{'50 %':>10}{'95 %':>10}{'B: 5 %':>10}{'50 %':>10}"
                    f"{'95 %':>10}{'KS':>8}{'energy':>9}{'count':>16}",
                ]
            one = row.as_dict()
            numbers = "".join(f"{q:10.3g}" for both in one["quantiles"] for q in both)
            label = f"{row.name}, {row.unit}"
            lines.append(
                f"  {label:26}{numbers}{one['kolmogorov_smirnov']:8.3f}"
                f"{one['energy_distance']:9.3g}{one['count'][0]:>8}{one['count'][1]:>8}"
            )
        for name, both in self.shares.items():
            lines.append(f"{name}: A {both[0]:.2%}, B {both[1]:.2%}")
        if self.spectra:
            lines.append("Spectra, rms within each band")
        for spectrum in self.spectra:
            for low, high, a, b in spectrum.bands():
                label = f"{spectrum.name}, {low:g} to {high:g} Hz"
                lines.append(f"  {label:44}A {a:9.3g}  B {b:9.3g} {spectrum.unit}")
        return "\n".join(lines)


def compare(first: Recording, second: Recording, robot: Robot | None = None) -> Statistics:
    """robot: says where the range finder is, of logs that do not. Raises FitError where the logs
    have nothing in common.
    """
    both = (first, second)
    answer = Statistics((str(first.file), str(second.file)))
    for one in both:
        find_path(one, mount_on(one, robot))
        answer.remarks += [f"{one.file}: {finding}" for finding in one.findings]
    for part in (_compare_ranges, _compare_drift, _compare_spectra):
        try:
            part(answer, both, robot)
        except FitError as error:
            answer.remarks.append(str(error))
    if not answer.rows and not answer.spectra:
        raise FitError("; ".join(answer.remarks) or "the logs have nothing in common to compare")
    return answer


# ---- Range finders.


def own_residuals(recording: Recording, robot: Robot | None = None) -> Residuals:
    """Of the readings of a log, against the surfaces that its other scans show."""
    recording.need("scans", "scans are needed to compare ranges")
    place = mount_on(recording, robot)
    keys = key_scans(scan_poses(recording, place))
    return residuals_of(recording, place, keys, surfaces_of(recording, place, keys))


def _compare_ranges(
    answer: Statistics, both: tuple[Recording, Recording], robot: Robot | None
) -> None:
    found = [own_residuals(one, robot) for one in both]
    values = []
    for one in found:
        kept = np.abs(one.residual) < OUTLIER_M
        values.append((one.residual[kept] * 1000, one.reach[kept], np.degrees(one.incidence[kept])))
    part = "Range residuals"
    _add(answer, part, "all", "all", "mm", values[0][0], values[1][0])
    for column, classes, unit in ((1, RANGES, "m"), (2, INCIDENCES, "deg")):
        group = "by range" if unit == "m" else "by incidence"
        for low, high in classes:
            chosen = [one[0][(one[column] >= low) & (one[column] < high)] for one in values]
            _add(answer, part, group, f"{low} to {high} {unit}", "mm", *chosen)
    returns = [1 - float(valid(one).mean()) for one in both]
    answer.shares["beams without return"] = (returns[0], returns[1])
    others = [float(np.mean(np.abs(one.residual) >= OUTLIER_M)) for one in found]
    answer.shares[f"readings more than {OUTLIER_M:g} m off"] = (others[0], others[1])


def _add(
    answer: Statistics, part: str, group: str, name: str, unit: str, a: Array, b: Array
) -> None:
    least = _LEAST_STRETCHES if part == "Drift" else _LEAST
    if min(len(a), len(b)) >= least:
        answer.rows.append(Row(part, group, name, unit, (a, b)))


# ---- Drift.


def reckoned(recording: Recording) -> Path | None:
    """The robot's own odometry, or that of its encoders and nominal measures."""
    if recording.odometry is not None:
        return recording.odometry
    wheels, geometry = recording.wheels, recording.geometry
    if wheels is None or geometry is None:
        return None
    middle = None if wheels.steering is None else (wheels.steering[1:] + wheels.steering[:-1]) / 2
    drive = Drive(geometry)
    moved = drive.moved(drive.nominal(), np.diff(wheels.turned, axis=0), middle)
    return Path(wheels.time, integrate(moved), "encoders")


def drift(recording: Recording) -> dict[str, tuple[Array, Array]]:
    """By "1 m", "10 min" and so on: distance (N,) m and absolute heading error (N,) degrees between
    odometry and path after each stretch of that way or time. Raises FitError.
    """
    odometry, truth = reckoned(recording), recording.truth
    if odometry is None or truth is None:
        recording.need("odometry", "odometry and a path are needed to compare drift")
        recording.need("truth", "odometry and a path are needed to compare drift")
    assert odometry is not None and truth is not None
    inside = (odometry.time >= truth.time[0]) & (odometry.time <= truth.time[-1])
    time, believed = odometry.time[inside], odometry.pose[inside]
    if len(time) < 2:
        raise FitError(f"{recording.file}: no odometry within the path's times")
    true = truth.at(time)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(believed[:, :2], axis=0).T))])
    answer = {}
    for clock, length, name in (
        *((way, float(d), f"{d} m") for d in DISTANCES_M),
        *((time - time[0], float(t), f"{t // 60} min") for t in TIMES_S),
    ):
        starts = np.arange(0.0, clock[-1] - length + 1e-9, length / _STRETCHES_PER_LENGTH)
        moved = [_moved(clock, pose, starts, starts + length) for pose in (believed, true)]
        wrong = moved[0] - moved[1]
        heading = np.abs(np.degrees(wrapped(wrong[:, 2])))
        answer[name] = (np.hypot(wrong[:, 0], wrong[:, 1]), heading)
    return answer


def _moved(clock: Array, pose: Array, begins: Array, ends: Array) -> Array:
    """(N, 3): poses at the ends as seen from those at the begins, by a clock (N,) in m or s."""
    begin, end = (
        np.stack([np.interp(at, clock, column) for column in pose.T], axis=1)
        for at in (begins, ends)
    )
    step = end - begin
    sine, cosine = np.sin(begin[:, 2]), np.cos(begin[:, 2])
    ahead = cosine * step[:, 0] + sine * step[:, 1]
    left = -sine * step[:, 0] + cosine * step[:, 1]
    return np.stack([ahead, left, step[:, 2]], axis=1)


def _compare_drift(
    answer: Statistics, both: tuple[Recording, Recording], robot: Robot | None
) -> None:
    first, second = (drift(one) for one in both)
    for name in first:
        for k, (what, unit) in enumerate((("place", "m"), ("heading", "deg"))):
            values = first[name][k], second[name][k]
            _add(answer, "Drift", what, f"{what} after {name}", unit, *values)


# ---- Spectra.


def _signals(recording: Recording, source: str) -> dict[str, tuple[Array, Array, str]]:
    """Times (s), values and unit. source: "odometry" or "path", of the speeds."""
    answer: dict[str, tuple[Array, Array, str]] = {}
    if not recording.timed:
        return answer
    path = reckoned(recording) if source == "odometry" else recording.truth
    if path is not None and len(path.time) > 2:
        middle = (path.time[1:] + path.time[:-1]) / 2
        speed = body_steps(path.pose) / np.diff(path.time)[:, None]
        answer[f"speed ({source})"] = (middle, speed[:, 0], "m/s")
        answer[f"turn rate ({source})"] = (middle, speed[:, 2], "rad/s")
    if recording.imu is not None:
        imu = recording.imu
        answer["turn rate z (IMU)"] = (imu.time, imu.rate[:, 2], "rad/s")
        answer["acceleration x (IMU)"] = (imu.time, imu.acceleration[:, 0], "m/s^2")
        answer["acceleration z (IMU)"] = (imu.time, imu.acceleration[:, 2], "m/s^2")
    return answer


def spectrum(time: Array, values: Array) -> tuple[Array, Array]:
    """Frequencies (Hz) and power per Hz, of values put onto their median interval."""
    interval = float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1], interval)
    segment = min(len(even), max(8, round(_SEGMENT_S / interval)))
    hertz, power = welch(np.interp(even, time, values), 1 / interval, nperseg=segment)
    return hertz, power


def _compare_spectra(
    answer: Statistics, both: tuple[Recording, Recording], robot: Robot | None
) -> None:
    source = "path" if any(reckoned(one) is None for one in both) else "odometry"
    first, second = (_signals(one, source) for one in both)
    for name in first.keys() & second.keys():
        pair = [spectrum(*one[name][:2]) for one in (first, second) if len(one[name][0]) >= 64]
        if len(pair) == 2:
            (f, p), (g, q) = pair
            answer.spectra.append(Spectrum(name, first[name][2], (f, g), (p, q)))
    answer.spectra.sort(key=lambda one: one.name)
    if not answer.spectra:
        raise FitError("no spectra: no odometry, path or IMU of 64 readings is in both logs")
