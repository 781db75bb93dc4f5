"""Fit of how a drive follows velocity commands: delay, dead zone, limits, first-order lag.

The model: a command takes effect after the delay and holds until the next one. One within the dead
zone counts as 0; a steady speed is the command times the gain, at most the speed limit. The speed
follows it with at most the acceleration (the deceleration, where it slows down), and approaches it
with the time constant of the lag. Compared are the ways between readings of the path, whose errors
are those of each reading and a random walk (noise.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import differential_evolution, least_squares

from .estimate import Estimate, normal
from .noise import Walk, fit_walk, whiten
from .recording import Array, Path, Recording, body_steps

_MOST_S = 60.0  # of the log, where commands change most
_BEFORE_S = 10.0  # of commands before that, which still act
_START_S = 0.5  # before the first of these, which shows the speed then
_LEAST_CHANGES = 10
_LEAST_S = 2e-4  # std of times: a simulated robot's speeds hold for steps
_LEAST_STD = 5e-4  # of the others, relative
_ODD = 3.0  # times; between commanded and driven ways
_ROUNDS = 2  # of values and variances in turn
_AXES = (("speed", 0, "m/s"), ("turn rate", 2, "rad/s"))
# Delay (s; below 0 where clocks differ), logarithms of acceleration, deceleration (per s), lag (s),
# gain and speed limit.
_LOW = np.array([-0.05, -4.6, -4.6, -6.0, -0.4, -4.6])
_HIGH = np.array([0.6, 3.0, 3.0, 0.7, 0.4, 3.0])
_STEPS = np.array([1e-3, 0.01, 0.01, 0.02, 1e-3, 2e-3])  # between which derivatives are taken
_SURE = 0.25  # std of a logarithm from which on a value is not determined
_MORE_LIKELY = 25.0  # of sums of squares of white residuals
_MOST_ZONES = 40  # commands that may lie in the dead zone, smallest first


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
    first = max(int(np.searchsorted(commands.time, begin - _BEFORE_S, side="right")) - 1, 0)
    kept = slice(first, int(np.searchsorted(commands.time, end)))
    answer = []
    for name, column, unit in _AXES:
        when, value = commands.time[kept], commands.value[kept, column]
        new = np.append(True, np.abs(np.diff(value)) > 1e-9)[: len(value)]
        count = max(int(new.sum()) - 1, 0)
        why = f"{count} changes of its commands; at least {_LEAST_CHANGES} are needed"
        if count >= _LEAST_CHANGES:
            axis = _Axis(when[new], value[new], path, (begin, end), column)
            why = axis.lacks()
            if not why:
                answer += axis.estimates(name, unit)
                continue
        answer.append(Estimate(f"{name}: delay, acceleration and lag", None, why=why))
    return answer


@dataclass(frozen=True)
class Follower:
    """A motion in phases, each a ramp or an exponential approach: from its begin (s) on the way is
    way + base t + rate t^2 / 2 + excess lag (1 - exp(-t / lag)).
    """

    begin: Array
    way: Array
    base: Array
    rate: Array
    excess: Array
    lag: float

    def at(self, time: Array) -> Array:
        """Ways (N,) since the first command, of times that do not decrease."""
        k = np.maximum(np.searchsorted(self.begin, time, side="right") - 1, 0)
        t = np.maximum(time - self.begin[k], 0.0)
        ramp = self.way[k] + (self.base[k] + self.rate[k] / 2 * t) * t
        return np.asarray(ramp - self.excess[k] * self.lag * np.expm1(-t / self.lag), float)


def follow(
    when: Array, value: Array, speed: float, rise: float, fall: float, lag: float
) -> Follower:
    """The motion by commands (N,) that each act from `when` (s) on, from this speed."""
    phases: list[tuple[float, float, float, float, float]] = []
    ends = [*when[1:].tolist(), math.inf]
    way = 0.0
    for now, end, target in zip(when.tolist(), ends, value.tolist()):
        while now < end:
            gap = target - speed
            slowing = gap * speed < 0
            turning = target * speed < 0  # through 0, from where on it is faster again
            most = fall if slowing else rise
            if abs(gap) > most * lag * (1 + 1e-9):
                rate = math.copysign(most, gap)
                stop = target - rate * lag
                if turning and stop * speed <= 0:
                    stop = 0.0
                t = (stop - speed) / rate
                phases.append((now, way, speed, rate, 0.0))
                if now + t > end:
                    t = end - now
                    stop = speed + rate * t
                way += (speed + stop) / 2 * t
            else:
                t = end - now
                phases.append((now, way, target, 0.0, -gap))
                if turning:
                    t = min(t, lag * math.log(gap / target))
                if t == math.inf:
                    break
                stop = 0.0 if turning and t < end - now else target - gap * math.exp(-t / lag)
                way += target * t + (speed - stop) * lag
            now, speed = now + t, stop
    begin, ways, base, rates, excess = np.array(phases).T
    return Follower(begin, ways, base, rates, excess, lag)


class _Axis:
    """The fit of one axis. when (N,) s, value (N,): commands that differ from those before."""

    def __init__(
        self, when: Array, value: Array, path: Path, span: tuple[float, float], column: int
    ):
        inside = (path.time >= span[0]) & (path.time <= span[1])
        self.time = path.time[inside] - when[0]
        self.when, self.value = when - when[0], value
        self.ways = body_steps(path.pose[inside])[:, column]
        self.clock = np.diff(self.time)[None]
        before = (path.time > when[0] - _START_S) & (path.time <= when[0])
        ways = body_steps(path.pose[before])[:, column]
        self.speed = float(ways.sum() / np.ptp(path.time[before])) if len(ways) else 0.0
        self.high = _HIGH.copy()
        self.high[5] = math.log(max(float(np.abs(value).max()) * 1.01, 0.011))
        self.dead_zone = 0.0
        self.walk: Walk | None = None

    def lacks(self) -> str:
        """What is wrong with a path that moves in no way as the commands say; or ""."""
        seconds = np.diff(np.append(self.when, max(self.time[-1], self.when[-1])))
        told = float(np.abs(self.value * seconds).sum() * np.ptp(self.time) / seconds.sum())
        # Ways of a second, in which the noise of readings cancels.
        every = max(1, round(1 / float(np.median(self.clock))))
        moved = float(np.abs(np.add.reduceat(self.ways, np.arange(0, len(self.ways), every))).sum())
        if moved == 0:
            return "the robot does not move"
        if told / _ODD < moved < told * _ODD:
            return ""
        return (
            f"the path moves {moved / told:.3g} times as far as the commands say; allowed are m, "
            "rad and s"
        )

    def residuals(self, x: Array) -> Array:
        """Modelled less measured ways, white where their noise is known."""
        delay, gain, limit = x[0], math.exp(x[4]), math.exp(x[5])
        target = np.where(np.abs(self.value) > self.dead_zone, self.value * gain, 0.0)
        moved = follow(self.when, target.clip(-limit, limit), self.speed, *np.exp(x[1:4]).tolist())
        left = np.diff(moved.at(self.time - delay)) - self.ways
        return left if self.walk is None else whiten(left, self.walk, self.clock)

    def cost(self, x: Array) -> float:
        left = self.residuals(np.clip(x, _LOW, self.high))
        return float(left @ left)

    def jacobian(self, x: Array) -> Array:
        """(N, 6), by central differences over _STEPS, which pass over the kinks of limits."""
        low, high = (
            np.maximum(x - np.diag(_STEPS), _LOW),
            np.minimum(x + np.diag(_STEPS), self.high),
        )
        return np.stack(
            [
                (self.residuals(b) - self.residuals(a)) / (b[k] - a[k])
                for k, (a, b) in enumerate(zip(low, high))
            ],
            axis=1,
        )

    def fit(self) -> Array:
        """A long lag and a low limit look alike: hence a search everywhere first."""
        x = differential_evolution(
            self.cost, list(zip(_LOW, self.high)), seed=1, popsize=8, maxiter=40, tol=1e-3,
            polish=False,
        ).x  # fmt: skip
        for turn in range(_ROUNDS + 1):
            starts = _starts(x) if turn < 2 else [x]
            x = min((self._descend(one) for one in starts), key=self.cost)
            self.walk = None
            self.walk = fit_walk([(self.residuals(x), self.clock)])
            self._find_dead_zone(x)
        return self._without_limit(self._descend(x))

    def _without_limit(self, x: Array) -> Array:
        """Where no limit is nearly as likely: of a robot that gets one speed only, gain and limit
        look alike.
        """
        most = float(np.abs(self.value).max())
        gain = min(x[4], x[5] - math.log(most))
        free = self._descend(np.array([*x[:4], gain, self.high[5]]))
        return free if self.cost(free) - self.cost(x) < _MORE_LIKELY else x

    def _descend(self, x: Array) -> Array:
        x = np.clip(x, _LOW + 1e-9, self.high - 1e-9)
        found = least_squares(
            self.residuals,
            x,
            self.jacobian,
            (_LOW, self.high),
            x_scale=_STEPS,
            max_nfev=40,
            tr_solver="lsmr",
        )
        return np.asarray(found.x, float)

    def _find_dead_zone(self, x: Array) -> None:
        """The largest command that moves nothing, where that is far more likely than none."""
        small = np.unique(np.abs(self.value[self.value != 0]))[:_MOST_ZONES]
        zones, costs = [0.0, *small.tolist()], []
        for self.dead_zone in zones:
            costs.append(self.cost(x))
        best = int(np.argmin(costs))
        self.dead_zone = zones[best] if costs[0] - costs[best] > _MORE_LIKELY else 0.0

    def estimates(self, name: str, unit: str) -> list[Estimate]:
        x = self.fit()
        jacobian, left = self.jacobian(x), self.residuals(x)
        stds = _stds(jacobian, left)
        value = np.append(x[0], np.exp(x[1:]))
        answer = [normal(f"{name}: delay", float(x[0]), float(np.hypot(stds[0], _LEAST_S)), "s")]
        most = float(np.abs(self.value).max())
        if x[3] < _LOW[3] + 0.7:
            stds[3] = np.inf
        if x[5] > self.high[5] - 1e-3:
            stds[5] = np.inf  # beyond the largest command
        for k, what, per, why in (
            (1, "acceleration", f"{unit}^2", "commands do not reach the limit"),
            (2, "deceleration", f"{unit}^2", "commands do not reach the limit"),
            (3, "lag", "s", "it is shorter than the readings can show"),
            (4, "gain", "", "the robot reaches no command"),
            (5, "limit", unit, f"no command of up to {most:.3g} is above it"),
        ):
            if stds[k] < _SURE:
                std = float(value[k] * np.hypot(stds[k], _LEAST_STD))
                answer.append(normal(f"{name}: {what}", float(value[k]), std, per))
            else:
                answer.append(Estimate(f"{name}: {what}", None, why=why))
        return [*answer, self._dead_zone_estimate(f"{name}: dead zone", unit)]

    def _dead_zone_estimate(self, name: str, unit: str) -> Estimate:
        """Between the largest command that moves nothing and the smallest that moves the robot."""
        low = self.dead_zone
        above = np.abs(self.value)[np.abs(self.value) > low]
        if low == 0 or not len(above):
            least = float(above.min()) if len(above) else 0.0
            return Estimate(name, None, why=f"the smallest command, {least:.3g} {unit}, moves it")
        high = float(above.min())
        return Estimate(name, (low + high) / 2, low, high, unit, "between two commands of the log")


def _starts(x: Array) -> list[Array]:
    """x, and others of the same sum of delay and lag: the two hide one another."""
    answer = [x]
    for factor in (0.3, 2.0):
        lag = math.exp(x[3])
        other = x.copy()
        other[0], other[3] = x[0] + lag * (1 - factor), x[3] + math.log(factor)
        answer.append(other)
    return answer


def _stds(jacobian: Array, left: Array) -> Array:
    """Standard deviations of the values; infinite for those that the readings do not determine,
    which are left out where the others' are computed.
    """
    freedom = max(len(left) - jacobian.shape[1], 1)
    # Where a real drive is not as the model, neighbouring residuals are alike: fewer count.
    alike = min(max(float(left[1:] @ left[:-1] / max(float(left @ left), 1e-30)), 0.0), 0.9)
    variance = float(left @ left) / freedom * (1 + alike) / (1 - alike)
    answer = np.full(jacobian.shape[1], np.inf)
    free = np.sum(jacobian**2, axis=0) > 1e-9 * variance
    while free.any():
        inverse = np.linalg.pinv(jacobian[:, free].T @ jacobian[:, free]) * variance
        found = np.sqrt(np.maximum(np.diag(inverse), 0.0))
        unsure = found > _SURE
        if not unsure.any():
            answer[free] = found
            break
        free[np.flatnonzero(free)[int(np.argmax(found))]] = False
    return answer
