"""How often beams come back short, far off, or not at all, by what they met, where the world of a
drive is known: the parts of Thrun's beam model beside its hits (Probabilistic Robotics, 6.3).

The engine casts the beams: a range finder without errors goes from scan to scan through the world.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path as File

import numpy as np
from numpy.typing import NDArray

from ..engine import Engine
from .errors import FitError
from .estimate import Estimate, normal
from .mapping import key_scans, scan_poses
from .progress import track
from .recording import Array, Recording

APART_M = 0.3  # from its surface, from which on a reading is of something else
HEIGHT_M = 0.2  # of a range finder whose robot is unknown
_MOST_SCANS = 1000
_LEAST_BEAMS = 100  # of a class
_BENT = 0.3  # rad between two beams' ends, from which on they lie on two surfaces
_FARTHEST_M = 1000.0
_RANGES_M = (0.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, np.inf)  # edges of classes, as the next
_INCIDENCES_DEG = (0.0, 30.0, 60.0, 75.0, 90.0)
_REFLECTANCES = (0.0, 0.05, 0.2, 0.5, 1.0)
_LEAST_SHARE = 0.02  # of a reflectance: beams at the steps of an imported wall seem to have others
_FINDER = """<sdf version="1.9" xmlns:ruedo="urn:ruedo"><model name="{name}">
<ruedo:path>{path}<ruedo:loop>false</ruedo:loop></ruedo:path>
<link name="link"><sensor name="beams" type="lidar"><update_rate>0</update_rate><lidar><scan>
<horizontal><samples>{rays}</samples><min_angle>{low:.9g}</min_angle><max_angle>{high:.9g}</max_angle>
</horizontal></scan><range><min>0.001</min><max>{farthest:g}</max></range></lidar></sensor></link>
</model></sdf>"""
_NAME = "range_finder_of_a_fit"


@dataclass(eq=False)
class Met:
    """What beams meet (N, K): range (m; inf: nothing), incidence (rad) and reflectance; NaN at
    edges and corners, and in the first and the last beam.
    """

    reach: Array
    incidence: Array
    reflectance: Array


def fit_beams_in(
    world: str | File, recording: Recording, mount: Array, height: float = HEIGHT_M
) -> list[Estimate]:
    """Shares of beams by range, incidence and reflectance. mount: x, y (m) and heading (rad) of the
    range finder on the robot; height (m) above the world's z = 0. Raises FitError, RuedoError.
    """
    poses = scan_poses(recording, mount)
    data = recording.scans
    assert data is not None
    keys = key_scans(poses)
    if len(keys) > _MOST_SCANS:
        keys = keys[np.linspace(0, len(keys) - 1, _MOST_SCANS).astype(np.int64)]
    met = cast(world, poses[keys], data.angles, height)
    seen = data.ranges[keys]
    none = (np.isnan(seen) | (seen >= data.max_range)) & ~np.isneginf(seen)
    judged = np.isfinite(met.incidence) & (met.reach < data.max_range) & ~np.isneginf(seen)
    judged &= seen != 0  # a device's word for an error
    if not judged.any():
        raise FitError(f"{recording.file}: no beam of the drive meets a surface of {world}")
    kinds = {
        "without return": none,
        "short": ~none & (seen < met.reach - APART_M),
        "far off": ~none & (seen > met.reach + APART_M),
    }
    classes = _classes(met, judged)
    return [
        _share(f"{kind}, {of}", hits, some) for kind, hits in kinds.items() for of, some in classes
    ]


def _classes(met: Met, judged: NDArray[np.bool_]) -> list[tuple[str, NDArray[np.bool_]]]:
    """Names, and which beams each has: of range, of incidence and, where it varies, of
    reflectance.
    """
    reflectances = _of("reflectance ", met.reflectance, _REFLECTANCES, "", judged)
    least = _LEAST_SHARE * judged.sum()
    reflectances = [one for one in reflectances if one[1].sum() >= least]
    return [
        *_of("", met.reach, _RANGES_M, " m", judged),
        *_of("incidence ", np.degrees(met.incidence), _INCIDENCES_DEG, " deg", judged),
        *(reflectances if len(reflectances) > 1 else []),
    ]


def _of(
    what: str, value: Array, edges: tuple[float, ...], unit: str, judged: NDArray[np.bool_]
) -> list[tuple[str, NDArray[np.bool_]]]:
    """The classes between these edges that have enough beams."""
    number = np.digitize(
        np.minimum(value, np.nextafter(edges[-1], 0)), edges
    )  # the last edge is in
    found = []
    for k, (low, high) in enumerate(pairwise(edges), 1):
        some = judged & (number == k)
        if some.sum() >= _LEAST_BEAMS:
            found.append((f"{what}{low:g} to {high:g}{unit}", some))
    return found


def check_world(world: str | File) -> None:
    """Raises RuedoError where it cannot be used."""
    Engine(str(world), allow_errors=True).close()


def cast(world: str | File, poses: Array, angles: Array, height: float) -> Met:
    """poses (N, 3): x, y (m), heading (rad). Raises RuedoError for a world that cannot be used."""
    with Engine(str(world), allow_errors=True) as engine:
        step = engine.step_size
    ways = "".join(
        f"<ruedo:waypoint>{i * step:.9g} {x:.9g} {y:.9g} {height:.9g} 0 0 {heading:.9g}</ruedo:waypoint>"
        for i, (x, y, heading) in enumerate(poses.tolist())
    )
    low, high = min(angles[0], angles[-1]), max(angles[0], angles[-1])
    text = _FINDER.format(
        name=_NAME, path=ways, rays=len(angles), low=low, high=high, farthest=_FARTHEST_M
    )
    with tempfile.TemporaryDirectory() as folder:
        model = File(folder, f"{_NAME}.sdf")
        model.write_text(text)
        with Engine(str(world), spawn=[f"{model}:{_NAME}@0,0"], allow_errors=True) as engine:
            ranges, light = (
                _observed(engine, f"beams.{field}") for field in ("ranges", "intensities")
            )
            both = []
            for _ in track(list(range(len(poses))), "casting"):
                both.append((ranges.copy(), light.copy()))
                engine.step()
    reach, intensity = np.array(both, float).transpose(1, 0, 2)
    if angles[0] > angles[-1]:
        reach, intensity = reach[:, ::-1], intensity[:, ::-1]
    incidence = _incidence(reach, angles)
    with np.errstate(invalid="ignore"):
        reflectance = np.minimum(intensity / np.cos(incidence), 1.0)
    return Met(reach, incidence, reflectance)


def _observed(engine: Engine, name: str) -> NDArray[np.float32]:
    """Of our range finder, which comes last of those with this name."""
    values: NDArray[np.float32] = engine.observe(name)[0, -1]
    return values


def _incidence(reach: Array, angles: Array) -> Array:
    """By the ends of the beams beside each, where the three lie on one surface."""
    beam = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    ends = np.where(np.isfinite(reach), reach, np.nan)[..., None] * beam
    step = np.diff(ends, axis=1)
    before, after = step[:, :-1], step[:, 1:]
    with np.errstate(invalid="ignore", divide="ignore"):
        bend = before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0]
        bend = np.abs(np.arctan2(bend, (before * after).sum(axis=-1)))
        along = before + after
        along /= np.linalg.norm(along, axis=-1, keepdims=True)
        facing = np.abs(along[..., 0] * beam[1:-1, 1] - along[..., 1] * beam[1:-1, 0])
        inner = np.where(bend < _BENT, np.arccos(np.minimum(facing, 1.0)), np.nan)
    return np.pad(inner, ((0, 0), (1, 1)), constant_values=np.nan)


def _share(name: str, hits: NDArray[np.bool_], among: NDArray[np.bool_]) -> Estimate:
    """With an interval in which the beams of a scan go together."""
    count = among.sum()
    share = float((hits & among).sum() / count)
    by_scan = (hits & among).sum(axis=1) - share * among.sum(axis=1)
    least = np.sqrt(max(share * (1 - share), 1 / count) / count)
    std = max(float(np.sqrt((by_scan**2).sum()) / count), float(least))
    found = normal(f"share {name}", share, std, "", f"of {count} beams")
    return Estimate(found.name, share, max(0.0, found.low), min(1.0, found.high), "", found.why)
