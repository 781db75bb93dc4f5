"""Timing of streams, and IMUs at rest: what a log shows without any model of the robot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .estimate import Z95, Estimate, normal
from .recording import Array, Recording

_LEAST_MESSAGES = 20
_LONG_GAP = 1.5  # periods, from which on messages are missing
_LEAST_REST_S = 10.0
_AXES = "xyz"


def fit_timing(recordings: Sequence[Recording]) -> list[Estimate]:
    """Rate (Hz), jitter (s, standard deviation of the intervals without gaps) and the share of
    messages that are missing, of each stream of the first recording.
    """
    answer = []
    for name, time in sorted(recordings[0].streams.items()):
        if len(time) < _LEAST_MESSAGES:
            continue
        gaps = np.diff(np.sort(time))
        period = float(np.median(gaps))
        if period <= 0:
            continue
        missing = float(
            np.sum(np.maximum(np.round(gaps[gaps > _LONG_GAP * period] / period) - 1, 0))
        )
        steady = gaps[gaps <= _LONG_GAP * period]
        std = float(steady.std())
        mean = float(steady.mean())
        share = missing / (missing + len(time))
        wide = np.sqrt(share * (1 - share) / (missing + len(time)))
        error = std / np.sqrt(len(steady))
        answer += [
            Estimate(
                f"{name}: rate", 1 / mean, 1 / (mean + Z95 * error), 1 / (mean - Z95 * error), "Hz"
            ),
            Estimate(f"{name}: jitter", std, unit="s", why="standard deviation of the intervals"),
            normal(f"{name}: missing messages", share, float(wide), "", "gaps of whole intervals"),
        ]
    return answer


def allan_variance(values: Array, sizes: Array) -> Array:
    """The Allan variance of averages over so many samples (M,), overlapping (IEEE Std 952, annex
    C).
    """
    total = np.concatenate([[0.0], np.cumsum(values)])
    answer = np.empty(len(sizes))
    for k, n in enumerate(sizes):
        means = (total[n:] - total[:-n]) / n
        answer[k] = 0.5 * np.mean((means[n:] - means[:-n]) ** 2)
    return answer


def fit_imu(recording: Recording) -> list[Estimate]:
    """Bias and noise of each axis while the robot stands, and the random walk of the bias."""
    imu = recording.imu
    assert imu is not None
    rest = _longest_rest(recording)
    if rest is None:
        why = f"the robot does not stand still for {_LEAST_REST_S:g} s"
        return [Estimate("bias and noise of the IMU", None, why=why)]
    kept = (imu.time >= rest[0]) & (imu.time <= rest[1])
    answer = []
    for what, unit, rows in (
        ("turn rate", "rad/s", imu.rate[kept]),
        ("acceleration", "m/s^2", imu.acceleration[kept]),
    ):
        for axis, values in zip(_AXES, rows.T):
            answer += _axis(f"{what} {axis}", unit, values, float(np.ptp(imu.time[kept])))
    return answer


def _longest_rest(recording: Recording) -> tuple[float, float] | None:
    """s; by the path or the odometry. Without both the whole log is taken as rest."""
    imu = recording.imu
    assert imu is not None
    path = recording.odometry or recording.truth
    if path is None:
        span = float(imu.time[0]), float(imu.time[-1])
        return span if span[1] - span[0] >= _LEAST_REST_S else None
    moving = np.hypot(*np.diff(path.pose[:, :2], axis=0).T) > 1e-4
    moving |= np.abs(np.diff(path.pose[:, 2])) > 1e-4
    edges = np.concatenate([[path.time[0]], path.time[1:][moving], [path.time[-1]]])
    longest = int(np.argmax(np.diff(edges)))
    begin, end = float(edges[longest]), float(edges[longest + 1])
    return (begin, end) if end - begin >= _LEAST_REST_S else None


def _axis(name: str, unit: str, values: Array, span: float) -> list[Estimate]:
    count = len(values)
    if count < 100:
        return [Estimate(name, None, why=f"{count} samples at rest; at least 100 are needed")]
    sizes = np.unique(np.geomspace(1, count // 9, 20).astype(int))
    variances = allan_variance(values, sizes)
    # Of white noise and a random walk of the bias: sigma^2 / n + walk^2 n / 3, weighted by how many
    # independent averages there are.
    parts = np.stack([1 / sizes, sizes / 3.0], axis=1)
    weights = np.sqrt(count / sizes)[:, None] / variances[:, None].clip(1e-30)
    white, walk = np.linalg.lstsq(parts * weights, variances * weights[:, 0], rcond=None)[0]
    sigma = float(np.sqrt(max(white, 0.0)))
    relative = 1 / np.sqrt(2 * count)
    mean_std = float(np.sqrt(max(white, 0) / count + max(walk, 0) * count / 3))
    answer = [
        normal(f"{name}: mean at rest", float(values.mean()), mean_std, unit, "gravity is in it"),
        normal(f"{name}: noise", sigma, sigma * relative * 1.5, unit, "of a sample"),
    ]
    # Less than the scatter of the longest averages would show by chance.
    if walk * sizes[-1] / 3 < 3 * white / sizes[-1]:
        why = f"{span:.0f} s at rest are too short beside the noise"
        return [*answer, Estimate(f"{name}: random walk of the bias", None, why=why)]
    rate = float(np.sqrt(walk * count / span))
    return [*answer, Estimate(f"{name}: random walk of the bias", rate, unit=f"{unit}/sqrt(s)")]
