"""Noise of sums: errors that grow with the way (a random walk) under errors of each reading.

The increments y_i of a sum have the variance q a_i + 2 r and the covariance -r with their
neighbours, where a_i is the clock of the random walk (m or rad driven) and r the variance of a
reading. Maximum likelihood; the likelihood by a banded Cholesky factor, in O(N).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky_banded, solve_banded
from scipy.optimize import minimize

from .recording import Array

_LEAST = 1e-7  # of a variance, relative to the largest one that would explain the residuals


@dataclass(frozen=True)
class Walk:
    """Variances: q per unit of each clock (C,), r of a reading; relative_std of q (C,)."""

    q: Array
    r: float
    relative_std: Array


def _factor(q: Array, r: float, clocks: Array, least: float) -> Array:
    """Lower banded Cholesky factor of the covariance. clocks (C, N)."""
    banded = np.zeros((2, clocks.shape[1]))
    banded[0] = q @ clocks + 2 * r + least
    banded[1, :-1] = -r
    return cholesky_banded(banded, lower=True)


def whiten(values: Array, walk: Walk, clocks: Array) -> Array:
    """Values (N,) as independent ones of variance 1."""
    least = _least(values)
    return solve_banded((1, 0), _factor(walk.q, walk.r, clocks, least), values)


def _least(values: Array) -> float:
    """Keeps the covariance regular where nothing moves: the size of rounding."""
    return max(_LEAST * float(np.mean(values**2)), 1e-20)


def fit_walk(groups: list[tuple[Array, Array]]) -> Walk:
    """Fits residuals (N,) with clocks (C, N): several independent series with the same
    variances.
    """
    size = groups[0][1].shape[0]
    total = sum(float(np.sum(values**2)) for values, _ in groups)
    driven = sum(clocks.sum(axis=1) for _, clocks in groups)
    start = np.log(
        np.append(
            total / size / np.maximum(driven, 1e-9), total * 1e-2 / sum(len(v) for v, _ in groups)
        )
        + 1e-20
    )

    def cost(logs: Array) -> float:
        variances = np.exp(np.clip(logs, -60, 20))
        answer = 0.0
        for values, clocks in groups:
            factor = _factor(variances[:-1], variances[-1], clocks, _least(values))
            white = solve_banded((1, 0), factor, values)
            answer += float(np.log(factor[0]).sum() + 0.5 * white @ white)
        return answer

    best = minimize(
        cost,
        start,
        method="Nelder-Mead",
        options={"xatol": 1e-3, "fatol": 1e-4, "maxiter": 600, "adaptive": True},
    )
    stds = stds_of(cost, best.x, np.full(size + 1, 0.05))
    return Walk(np.exp(best.x[:-1]), float(np.exp(best.x[-1])), stds[:-1])


def stds_of(cost: Callable[[Array], float], x: Array, steps: Array) -> Array:
    """Standard deviations of the most likely values, logarithms for the most part, by the curvature
    of cost(), a negative log-likelihood, over these steps; inf without one.
    """
    size = len(x)
    hessian = np.zeros((size, size))
    unit = np.diag(steps)
    for i in range(size):
        for j in range(i + 1):
            corners = [
                a * b * cost(x + a * unit[i] + b * unit[j]) for a in (1, -1) for b in (1, -1)
            ]
            hessian[i, j] = hessian[j, i] = sum(corners) / (4 * steps[i] * steps[j])
    free = np.diag(hessian) > 0.05  # others do not matter to the likelihood, such as r = 0
    answer = np.full(size, np.inf)
    if free.any():
        inverse = np.linalg.pinv(hessian[np.ix_(free, free)])
        answer[free] = np.sqrt(np.maximum(np.diag(inverse), 0))
    return answer
