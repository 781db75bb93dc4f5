"""Kinematics of drives as a fit sees them: from the motion of the base to the ways of the wheels.

The wheels' ways are compared, and not the motion, since slip and ticks are errors of the wheels'
readings: a regression on noisy readings would estimate radii that are too large.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .recording import Array, Geometry

_ROOT3 = np.sqrt(3.0)
# fwd, lat and turn times the lever, of each wheel's way (inverse kinematics).
_OMNI = {
    "omni3": np.array([[-_ROOT3 / 2, -0.5, -1], [_ROOT3 / 2, -0.5, -1], [0, 1, -1]]),
    "omni4": np.array([[1, -1, -1], [-1, -1, -1], [1, 1, -1], [-1, 1, -1]]),
}


@dataclass(frozen=True)
class Drive:
    """The parameters of a kind of drive, and what they make of a motion."""

    geometry: Geometry

    @property
    def names(self) -> list[str]:
        return {
            "differential": ["left radius", "right radius", "track"],
            "tricycle": ["wheel radius", "wheelbase", "steering offset"],
            "omni3": ["radius 1", "radius 2", "radius 3", "lever arm"],
            "omni4": ["radius 1", "radius 2", "radius 3", "radius 4", "lever arm"],
        }[self.geometry.kind]

    @property
    def units(self) -> list[str]:
        return ["rad" if name.endswith("offset") else "m" for name in self.names]

    @property
    def wheels(self) -> int:
        """How many wheels are driven, or read."""
        return {"differential": 2, "tricycle": 1, "omni3": 3, "omni4": 4}[self.geometry.kind]

    def nominal(self) -> Array:
        radius, lever = self.geometry.radius_m, self.geometry.track_m
        if self.geometry.kind == "tricycle":
            return np.array([radius, lever, 0.0])
        return np.append(np.full(len(self.names) - 1, radius), lever)

    def scale(self) -> Array:
        """Sizes of the parameters, by which errors are judged."""
        return np.where(self.nominal() == 0, 1.0, self.nominal())

    def residuals(
        self, parameters: Array, moved: Array, turned: Array, steering: Array | None
    ) -> Array:
        """(N, C) m, per step: readings of the wheels less what the motion should have made, and
        the motion that the drive cannot make. moved (N, 3): m ahead, m left, rad of the base;
        turned (N, W) rad; steering (N,): mean of the step.
        """
        forward, left, turn = moved.T
        radius = self.geometry.radius_m
        ways = turned * radius
        if self.geometry.kind == "differential":
            r_left, r_right, track = parameters
            return np.stack(
                [
                    ways[:, 0] - (forward - turn * track / 2) * (radius / r_left),
                    ways[:, 1] - (forward + turn * track / 2) * (radius / r_right),
                    left,
                ],
                axis=1,
            )
        if self.geometry.kind == "tricycle":
            r, wheelbase, offset = parameters
            assert steering is not None
            sine, cosine = np.sin(steering + offset), np.cos(steering + offset)
            along = forward * cosine + (left + wheelbase * turn) * sine
            across = -forward * sine + (left + wheelbase * turn) * cosine
            return np.stack([ways[:, 0] - along * (radius / r), across, left], axis=1)
        matrix = _OMNI[self.geometry.kind]
        should = (moved * [1, 1, parameters[-1]]) @ matrix.T
        return ways - should * (radius / parameters[:-1])

    def moved(self, parameters: Array, turned: Array, steering: Array | None) -> Array:
        """(N, 3): m ahead, m left, rad that the wheels' steps say (forward kinematics)."""
        if self.geometry.kind == "differential":
            ways = turned * parameters[:2]
            forward, turn = ways.mean(axis=1), (ways[:, 1] - ways[:, 0]) / parameters[2]
            return np.stack([forward, np.zeros_like(forward), turn], axis=1)
        if self.geometry.kind == "tricycle":
            assert steering is not None
            way, angle = turned[:, 0] * parameters[0], steering + parameters[2]
            return np.stack(
                [way * np.cos(angle), np.zeros_like(way), way * np.sin(angle) / parameters[1]],
                axis=1,
            )
        inverse = np.linalg.pinv(_OMNI[self.geometry.kind])
        return (turned * parameters[:-1]) @ inverse.T / [1, 1, parameters[-1]]


def integrate(moved: Array, start: Array | None = None) -> Array:
    """(N + 1, 3) poses from (N, 3) steps, each an arc (exact for a constant twist)."""
    start = np.zeros(3) if start is None else start
    heading = start[2] + np.concatenate([[0.0], np.cumsum(moved[:, 2])])
    along = heading[:-1] + moved[:, 2] / 2
    chord = np.sinc(moved[:, 2] / (2 * np.pi))[:, None] * moved[:, :2]
    x = np.cos(along) * chord[:, 0] - np.sin(along) * chord[:, 1]
    y = np.sin(along) * chord[:, 0] + np.cos(along) * chord[:, 1]
    place = [start[0] + np.append(0.0, np.cumsum(x)), start[1] + np.append(0.0, np.cumsum(y))]
    return np.stack([*place, heading], axis=1)
