"""A world from a recorded drive: its occupancy map, and walls as boxes by `ruedo import`."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path as File

import numpy as np

from ..launching import find_ruedo
from .align import find_path
from .errors import FitError, UsageError
from .mapping import Moving, Occupancy, occupancy
from .recording import Recording


@dataclass(frozen=True)
class MadeWorld:
    """The files that make_world() wrote."""

    summary: str
    moving: list[Moving]


def make_world(
    recording: Recording, out: File, mount: Sequence[float], resolution: float, height: float
) -> MadeWorld:
    """Writes `out` and, beside it, the map as map_server has it (.yaml, .pgm). Raises FitError."""
    if out.suffix != ".sdf":
        raise UsageError(f"{out}: -o takes a name that ends with .sdf; the map gets the same name")
    if not out.absolute().parent.is_dir():
        raise UsageError(f"{out}: its folder does not exist")
    find_path(recording, np.asarray(mount, float))
    found = occupancy(recording, np.asarray(mount, float), resolution)
    file = out.with_suffix(".yaml")
    write_map(found, file)
    words = [find_ruedo(), "import", str(file), "-o", str(out), "--height", str(height)]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode:
        raise FitError(done.stderr.strip().removeprefix("ruedo: "))
    rows, columns = found.grey.shape
    size = f"{columns * resolution:.1f} x {rows * resolution:.1f} m"
    moving = f"; {len(found.moving)} places where something moved" if found.moving else ""
    return MadeWorld(f"{done.stdout.strip()}, {size}; map in {file}{moving}", found.moving)


def write_map(found: Occupancy, file: File) -> None:
    picture = file.with_suffix(".pgm")
    rows, columns = found.grey.shape
    picture.write_bytes(b"P5\n%d %d\n255\n" % (columns, rows) + found.grey.tobytes())
    x, y = found.origin
    file.write_text(
        f"image: {picture.name}\nresolution: {found.resolution:g}\norigin: [{x:.6g}, {y:.6g}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
