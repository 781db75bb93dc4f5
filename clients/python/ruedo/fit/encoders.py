"""The resolution of encoders: the step of which all changes of their angles are multiples."""

from __future__ import annotations

import numpy as np

from .estimate import Estimate
from .recording import Array, Recording

NAME = "encoder ticks per turn"
_NOISE = 1e-6  # rad, of an angle in a file: a wheel stands at smaller changes
_LEAST = 50 * _NOISE  # of a tick, to be told from that
_LEAST_CHANGES = 100
_FIRST = 50  # of the smallest changes: they give a first idea of the step


def fit_ticks(recording: Recording) -> Estimate:
    """Ticks of a wheel's turn."""
    wheels = recording.wheels
    if wheels is None:
        return Estimate(NAME, None, why="the log has no encoders")
    if wheels.tick_rad:
        return Estimate(NAME, 2 * np.pi / wheels.tick_rad, why="by the file that is beside the log")
    changes = np.abs(np.diff(wheels.turned, axis=0)).ravel()
    changes = changes[changes > _NOISE]
    if len(changes) < _LEAST_CHANGES:
        return Estimate(NAME, None, why="the wheels hardly turn")
    tick = _step_of(np.sort(changes))
    if not tick or np.abs(changes - np.round(changes / tick) * tick).max() > 10 * _NOISE:
        return Estimate(NAME, None, why="angles are multiples of no step: finer than the log shows")
    return Estimate(NAME, 2 * np.pi / tick, why="all angles are multiples")


def _step_of(changes: Array) -> float:
    """The step (rad), or 0. From the smallest changes on, since errors of the step multiply."""
    step = _common_divisor(changes[:_FIRST])
    for count in np.geomspace(_FIRST, len(changes), 10).astype(int) if step else []:
        counts = np.round(changes[:count] / step)
        step = float((changes[:count] * counts).sum() / (counts**2).sum())
    return step


def _common_divisor(changes: Array) -> float:
    """Of all changes, by Euclid's algorithm (rad), or 0."""
    step = 0.0
    for change in changes.tolist():
        while change > _LEAST / 2:
            step, change = change, step % change if step else 0.0
            if change > step - _LEAST / 2:  # a whole number of them, less the noise
                change = 0.0
    return step if step > _LEAST else 0.0
