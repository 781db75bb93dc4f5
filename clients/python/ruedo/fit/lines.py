"""Readings against the lines that the readings of other scans show.

Each point of a line counts by the noise of its own beam, and how uncertain the line is, is known:
both need a first idea of the noise, which rangefinder.py improves. Derivatives by the place of the
range finder and by its clock come with the residuals.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .recording import Array

HALF_M = 0.15  # of a line around a reading
LEAST_POINTS = 8
STEEPEST = np.radians(75)  # of incidence; readings beyond it are too uncertain
_AROUND_M = 0.3  # of points that are looked at
_MANY = 150.0  # such points; more make a fit slow and hardly better
_BESIDE_M = 0.1  # of a line, where a flat surface has nothing else
_MOST_OTHERS = 0.02  # of the points there
_ROUGH, _FINE = 6.0, 4.0  # sigma, from a line to its points
_CHANCE = 4.0  # sigma that the points of a flat surface may scatter more than their noise says
_BENT = 2.0  # sigma of a quadratic term of the line, from which on the surface is round
_AT_ONCE = 500  # readings, each with hundreds of points around it


@dataclass(eq=False)
class Points:
    """Ends of beams. place (N, 2) m, beam (N, 2) unit vectors, reach (N,) m, scan (N,), and the
    derivatives (N, P, 2) of the place by what is not known.
    """

    place: Array
    beam: Array
    reach: Array
    scan: NDArray[np.int64]
    by: Array

    def part(self, chosen: NDArray[np.int64]) -> Points:
        return Points(*(one[chosen] for one in vars(self).values()))


@dataclass(eq=False)
class Against:
    """Of readings with a line: residual (N,) m along the beam, its incidence (N,) rad, sigma of the
    line there (N,) m, derivatives (N, P), and which readings these are (N,).
    """

    residual: Array
    incidence: Array
    line: Array
    by: Array
    reading: NDArray[np.int64]

    def part(self, chosen: NDArray[np.bool_]) -> Against:
        return Against(*(one[chosen] for one in vars(self).values()))


def against_lines(readings: Points, points: Points, sigma: tuple[float, float]) -> Against:
    """sigma: of the range (m) and of the bearing (rad)."""
    tree = cKDTree(points.place)
    some = readings.place[:: max(1, len(readings.reach) // 500)]
    usual = float(np.median(tree.query_ball_point(some, _AROUND_M, return_length=True)))
    if usual > _MANY:
        points = points.part(np.arange(0, len(points.reach), int(np.ceil(usual / _MANY))))
        tree = cKDTree(points.place)
    parts = np.array_split(np.arange(len(readings.reach)), max(1, len(readings.reach) // _AT_ONCE))
    found = []
    for part in parts:
        pairs = _Pairs(readings.part(part), points, tree)
        rough = pairs.weighted(pairs.first_lines(), _ROUGH, sigma)
        found.append(pairs.judged(pairs.weighted(rough, _FINE, sigma), part))
    return Against(
        *(np.concatenate([getattr(one, name) for one in found]) for name in vars(found[0]))
    )


@dataclass(eq=False)
class _Lines:
    """Of readings: the way to the line along the beam (m), and the angle of the line (rad)."""

    ahead: Array
    angle: Array


@dataclass(eq=False)
class _Weighted(_Lines):
    """Of pairs: weight (1/m^2) and place along the line (m). Of readings: sum of the weights, mean
    place and second moment, where the beam meets the line (m from the mean), how many points, their
    chi^2 by degrees of freedom, a quadratic term by its sigma, and how many are near or beside it.
    """

    weight: Array
    along: Array
    total: Array
    middle: Array
    second: Array
    meets: Array
    count: Array
    chi2: Array
    bend: Array
    beside: Array


class _Pairs:
    """Readings and the points of other scans around them."""

    def __init__(self, readings: Points, points: Points, tree: cKDTree):
        near = tree.query_ball_point(readings.place, _AROUND_M)
        row = np.repeat(np.arange(len(near)), np.array([len(one) for one in near], np.int64))
        point = np.concatenate(
            [np.zeros(0, np.int64), *(np.asarray(one, np.int64) for one in near)]
        )
        others = points.scan[point] != readings.scan[row]
        self.readings, self.row = readings, row[others]
        self.points = points.part(point[others])
        self.x, self.y = (self.points.place - readings.place[self.row]).T

    def sums(self, values: Array) -> Array:
        return np.asarray(np.bincount(self.row, values, len(self.readings.reach)), float)

    def first_lines(self) -> _Lines:
        """Through the points within HALF_M, all alike."""
        way = self.readings.beam
        near = (self.x**2 + self.y**2 <= HALF_M**2).astype(float)
        with np.errstate(divide="ignore", invalid="ignore"):
            count = self.sums(near)
            x, y = self.sums(near * self.x) / count, self.sums(near * self.y) / count
            xx = self.sums(near * self.x**2) / count - x * x
            yy = self.sums(near * self.y**2) / count - y * y
            xy = self.sums(near * self.x * self.y) / count - x * y
            angle = np.arctan2(2 * xy, xx - yy) / 2
            sine, cosine = np.sin(angle), np.cos(angle)
            ahead = (cosine * y - sine * x) / (cosine * way[:, 1] - sine * way[:, 0])
        return _Lines(ahead, angle)

    def weighted(self, lines: _Lines, gate: float, sigma: tuple[float, float]) -> _Weighted:
        """By the points within `gate` sigma of the line, of which each beam has its own."""
        row, points = self.row, self.points
        cosine, sine = np.cos(lines.angle), np.sin(lines.angle)
        ahead_x, ahead_y = (lines.ahead[:, None] * self.readings.beam).T
        x, y = self.x - ahead_x[row], self.y - ahead_y[row]
        t, d = cosine[row] * x + sine[row] * y, cosine[row] * y - sine[row] * x
        facing = cosine[row] * points.beam[:, 1] - sine[row] * points.beam[:, 0]
        spread = np.hypot(sigma[0] * facing, sigma[1] * points.reach * np.sqrt(1 - facing**2))
        inside, apart = np.abs(t) <= HALF_M, np.abs(d)
        near = inside & (apart <= gate * spread)
        with np.errstate(divide="ignore", invalid="ignore"):
            weight = near / spread**2
            total = self.sums(weight)
            middle, off = self.sums(weight * t) / total, self.sums(weight * d) / total
            second = self.sums(weight * t * t) - total * middle**2
            mixed = self.sums(weight * t * d) - total * middle * off
            left = self.sums(weight * d * d) - total * off**2
            slope = mixed / second
            beam_x, beam_y = self.readings.beam.T
            along, across = cosine * beam_x + sine * beam_y, cosine * beam_y - sine * beam_x
            more = (off - slope * middle) / (across - slope * along)
            count = self.sums(near.astype(float))
            chi2 = (left - slope * mixed) / (count - 2)
            u = t - middle[row]
            third, fourth = self.sums(weight * u**3), self.sums(weight * u**4)
            bent = self.sums(weight * d * u * u) - second * off - third * mixed / second
            bend = bent / np.sqrt(fourth - second**2 / total - third**2 / second)
        beside = self.sums((inside & (apart <= _BESIDE_M + gate * spread)).astype(float))
        return _Weighted(
            lines.ahead + more, lines.angle + np.arctan(slope), weight, t, total, middle, second,
            more * along - middle, count, chi2, bend, beside,
        )  # fmt: skip

    def judged(self, lines: _Weighted, reading: NDArray[np.int64]) -> Against:
        """Those that lie on a flat surface."""
        row = self.row
        normal = np.stack([-np.sin(lines.angle), np.cos(lines.angle)], axis=1)
        facing = np.sum(normal * self.readings.beam, axis=1)
        incidence = np.arccos(np.minimum(1.0, np.abs(facing)))
        with np.errstate(divide="ignore", invalid="ignore"):
            good = (lines.count >= LEAST_POINTS) & (incidence <= STEEPEST)
            good &= lines.chi2 <= 1 + _CHANCE * np.sqrt(2 / (lines.count - 2))
            good &= np.abs(lines.bend) <= _BENT
            good &= lines.second / lines.total >= (HALF_M / 4) ** 2
            good &= lines.beside <= lines.count * (1 + _MOST_OTHERS)
            line = np.sqrt(1 / lines.total + lines.meets**2 / lines.second) / np.abs(facing)
            arm = (lines.meets / lines.second)[row] * (lines.along - lines.middle[row])
            share = lines.weight * (1 / lines.total[row] + arm)  # of each point in the line there
        own = np.sum(self.readings.by * normal[:, None], axis=2)
        moved = np.sum(self.points.by * normal[row][:, None], axis=2) * share[:, None]
        by = own.copy()
        for k, one in enumerate(moved.T):
            by[:, k] -= self.sums(one)
        return Against(
            -lines.ahead[good], incidence[good], line[good], (by / facing[:, None])[good],
            reading[good],
        )  # fmt: skip
