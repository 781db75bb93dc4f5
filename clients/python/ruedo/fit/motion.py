"""Fit of how a drive follows velocity commands: delay, limits of acceleration, first-order lag.

The model: a command takes effect after the delay and holds until the next one; the speed follows it
with at most the acceleration (the deceleration, where it slows down), and approaches it with the
time constant of the lag. Compared are the means of the speed between two readings of the path.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import differential_evolution, minimize

from .estimate import Estimate, normal
from .recording import Array, Path, Recording, body_steps

_FINE_S = 0.005  # step of the model
_MOST_S = 60.0  # of the log, where commands change most
_LEAST_CHANGES = 10
_LEAST_STD = 1e-3  # of limits, relative: ramps are rounded to steps
_AXES = (("speed", 0, "m/s"), ("turn rate", 2, "rad/s"))
# Delay (s), logarithms of acceleration, deceleration (per s) and lag (s).
_LOW, _HIGH = np.array([0.0, -4.6, -4.6, -6.0]), np.array([0.6, 3.0, 3.0, 0.7])
_STEPS = np.diag(
    [2e-3, 0.02, 0.02, 0.03]
)  # of delay and logarithms, between which derivatives are taken


def fit_motion(recording: Recording) -> list[Estimate]:
    """Of speed and turn rate; nothing of a log without commands."""
    path = recording.truth or recording.odometry
    commands = recording.commands
    if commands is None or path is None:
        return []
    begin = max(path.time[0], commands.time[0])
    end = min(path.time[-1], commands.time[-1])
    if end - begin > _MOST_S:
        changes = commands.time[1:][np.any(np.diff(commands.value, axis=0) != 0, axis=1)]
        starts = np.arange(begin, end - _MOST_S, 10.0)
        many = [np.sum((changes >= s) & (changes < s + _MOST_S)) for s in starts]
        begin = float(starts[int(np.argmax(many))])
        end = begin + _MOST_S
    answer = []
    for name, column, unit in _AXES:
        kept = (commands.time >= begin - 2) & (commands.time <= end)
        answer += _fit_axis(
            name,
            unit,
            commands.time[kept],
            commands.value[kept, column],
            path,
            (begin, end),
            column,
        )
    return answer


def _fit_axis(
    name: str,
    unit: str,
    when: Array,
    value: Array,
    path: Path,
    span: tuple[float, float],
    column: int,
) -> list[Estimate]:
    changes = int(np.sum(np.abs(np.diff(value)) > 1e-9))
    if changes < _LEAST_CHANGES:
        why = f"{changes} changes of its commands; at least {_LEAST_CHANGES} are needed"
        return [Estimate(f"{name}: delay, acceleration and lag", None, why=why)]
    inside = (path.time >= span[0]) & (path.time <= span[1])
    time = path.time[inside]
    speed = body_steps(path.pose[inside])[:, column] / np.diff(time)
    fine = np.arange(time[0], time[-1], _FINE_S)
    target = _Held(when, value)

    def residuals(logs: Array) -> Array:
        delay, rise, fall, lag = logs[0], *np.exp(logs[1:])
        modelled = follow(target.means(fine - delay), float(speed[0]), rise, fall, lag)
        way = np.concatenate([[0.0], np.cumsum(modelled) * _FINE_S])
        edges = np.append(fine, fine[-1] + _FINE_S)
        return np.diff(np.interp(time, edges, way)) / np.diff(time) - speed

    best = _least(residuals)
    jacobian = np.stack(
        [(residuals(best + step) - residuals(best - step)) / (2 * step.sum()) for step in _STEPS],
        axis=1,
    )
    return _estimates(name, unit, best, jacobian, residuals(best))


def _least(residuals: Callable[[Array], Array]) -> Array:
    """Where the sum of squares is least. A long lag and a low limit look alike, and limits give it
    kinks: hence a search everywhere, and without derivatives.
    """

    def cost(x: Array) -> float:
        left = residuals(np.clip(x, _LOW, _HIGH))
        return float(left @ left)

    begin = differential_evolution(
        cost, list(zip(_LOW, _HIGH)), seed=1, popsize=8, maxiter=25, tol=1e-4, polish=False
    ).x
    found = minimize(
        cost,
        begin,
        method="Nelder-Mead",
        options={
            "initial_simplex": np.vstack([begin, begin + 3 * _STEPS]),
            "xatol": 2e-4,
            "fatol": 1e-9,
            "maxfev": 400,
        },
    )
    return np.asarray(np.clip(found.x, _LOW, _HIGH), float)


class _Held:
    """Commands that each hold until the next, and their means over steps of _FINE_S."""

    def __init__(self, when: Array, value: Array):
        self.edges = np.append(when, when[-1] + 1e6)
        self.sums = np.concatenate([[0.0], np.cumsum(value * np.diff(self.edges))])

    def means(self, begin: Array) -> Array:
        ends = np.interp(np.append(begin, begin[-1] + _FINE_S), self.edges, self.sums)
        return np.diff(ends) / _FINE_S


def follow(target: Array, speed: float, rise: float, fall: float, lag: float) -> Array:
    """Mean speed in each step of _FINE_S (s), within rise and fall (per s), lag (s)."""
    answer = np.empty(len(target))
    share = 1 - float(np.exp(-_FINE_S / lag))
    up, down = rise * _FINE_S, fall * _FINE_S
    for i, wanted in enumerate(target.tolist()):
        change = (wanted - speed) * share
        faster = change * speed >= 0 and (speed != 0 or wanted != 0)
        most = up if faster else down
        change = min(max(change, -most), most)
        answer[i] = speed + change / 2
        speed += change
    return answer


def _estimates(name: str, unit: str, x: Array, jacobian: Array, left: Array) -> list[Estimate]:
    freedom = max(len(left) - len(x), 1)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * float(left @ left) / freedom
    # Residuals of neighbouring readings are alike: fewer of them are independent.
    alike = float(left[1:] @ left[:-1] / max(float(left @ left), 1e-30))
    inflation = (1 + max(alike, 0)) / max(1 - max(alike, 0), 0.05)
    stds = np.sqrt(np.maximum(np.diag(covariance), 0.0) * inflation)
    stds[np.sum(jacobian**2, axis=0) < 1e-9] = np.inf  # nothing follows from these readings
    # The model knows times to a step; a robot's commands act, and its speeds hold, for steps, too.
    within = _FINE_S / np.sqrt(12)
    stds[0], stds[3] = np.hypot(stds[0], 2 * within), np.hypot(stds[3], within / np.exp(x[3]))
    stds[1:3] = np.hypot(stds[1:3], _LEAST_STD)
    answer = [
        normal(f"{name}: delay", float(x[0]), float(stds[0]), "s", "with the step of the readings")
    ]
    for k, what in ((1, "acceleration"), (2, "deceleration")):
        value = float(np.exp(x[k]))
        if stds[k] < 0.25:
            answer.append(normal(f"{name}: {what}", value, value * float(stds[k]), f"{unit}^2"))
        else:
            answer.append(Estimate(f"{name}: {what}", None, why="commands do not reach the limit"))
    lag = float(np.exp(x[3]))
    if lag > 2 * _FINE_S and stds[3] < 0.5:
        answer.append(normal(f"{name}: lag", lag, lag * float(stds[3]), "s", "time constant"))
    else:
        answer.append(
            Estimate(f"{name}: lag", None, why="it is shorter than the readings can show")
        )
    return answer
