"""Drawings of a program in the world, which the web console and logs show: the markers
that Simulation.markers() takes.

Points are rows of x, y, z in m, or of x, y on the floor; a color is red, green, blue and maybe
alpha, from 0 to 1; place is where the marker is in its frame (m), and heading its turn there (rad).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from . import arguments, lcmtypes

_MOST_BYTES = 65536
Color = Sequence[float]
_BLUE = (0.25, 0.7, 1.0)


def lines(points: ArrayLike, color: Color = _BLUE, width: float = 0.03) -> lcmtypes.marker_t:
    """Lines, each from one point to the next but one: points 0 and 1, points 2 and 3, ..."""
    marker = _made(lcmtypes.marker_t.LINES, color, width)
    _set_points(marker, points)
    if marker.n % 2:
        raise ValueError(f"lines have two ends each; {marker.n} points do not make pairs")
    return marker


def path(points: ArrayLike, color: Color = _BLUE, width: float = 0.03) -> lcmtypes.marker_t:
    """A line from point to point."""
    marker = _made(lcmtypes.marker_t.PATH, color, width)
    _set_points(marker, points)
    return marker


def points(points: ArrayLike, color: Color = _BLUE, size: float = 0.05) -> lcmtypes.marker_t:
    """Points of a size (m)."""
    marker = _made(lcmtypes.marker_t.POINTS, color, size)
    _set_points(marker, points)
    return marker


def text(
    text: str, place: Sequence[float], color: Color = _BLUE, height: float = 0.2
) -> lcmtypes.marker_t:
    """A text that faces who looks, its lines so high (m)."""
    if len(text.encode()) > 1000:
        raise ValueError(f"a text has at most 1000 bytes, not {len(text.encode())}")
    marker = _made(lcmtypes.marker_t.TEXT, color, height)
    _set_place(marker, place, 0.0)
    marker.text = text
    return marker


def map(
    cells: ArrayLike,
    resolution: float,
    place: Sequence[float] = (0.0, 0.0),
    heading: float = 0.0,
    color: Color = _BLUE,
) -> lcmtypes.marker_t:
    """An occupancy grid on the floor: rows of cells from 0 (free) to 100 (occupied), -1 or 255
    unknown. The first cell of the first row is at `place`; columns go along x, rows along y.
    resolution: m, a cell's side.
    """
    grid = np.asarray(cells)
    if grid.ndim != 2 or grid.size == 0:
        raise ValueError(f"a map is rows of cells, not of shape {grid.shape}")
    whole = grid.astype(np.int64)
    if not (((whole >= 0) & (whole <= 100)) | (whole == -1) | (whole == 255)).all():
        raise ValueError("a cell is 0 to 100, or -1 or 255 where it is unknown")
    marker = _made(lcmtypes.marker_t.MAP, color, resolution)
    _set_place(marker, place, heading)
    marker.columns, marker.ncells = grid.shape[1], grid.size
    marker.cells = (whole & 255).astype(np.uint8).tobytes()
    return marker


def message(
    layer: str, markers: Iterable[lcmtypes.marker_t], frame: str, utime: int
) -> lcmtypes.markers_t:
    """The message that Simulation.markers() sends."""
    if not 1 <= len(arguments.text("layer", layer).encode()) <= 63:
        raise ValueError(f"layer {arguments.shown(layer)}: it must be a name of 1 to 63 bytes")
    result = lcmtypes.markers_t()
    result.utime, result.layer, result.frame = utime, layer, arguments.text("frame", frame)
    if not isinstance(markers, Iterable):
        raise TypeError(f"markers are a list, not {arguments.shown(markers)}")
    result.markers = list(markers)
    for one in result.markers:
        if not isinstance(one, lcmtypes.marker_t):
            raise TypeError(
                f"expected a marker, as ruedo.markers makes it, not {arguments.shown(one)}"
            )
    result.n = len(result.markers)
    if result.n > 1000:
        raise ValueError(f"a layer has at most 1000 markers, not {result.n}")
    if (size := len(result.encode())) > _MOST_BYTES:
        raise ValueError(f"a layer has at most {_MOST_BYTES} bytes, not {size}: use several")
    return result


def _made(kind: int, color: Color, size: float) -> lcmtypes.marker_t:
    if len(color) not in (3, 4) or not all(0.0 <= part <= 1.0 for part in color):
        raise ValueError(f"color {tuple(color)}: it must be 3 or 4 numbers from 0 to 1")
    if not 0.0 < size <= 1000.0:
        raise ValueError(f"size {size}: it must be above 0 m, and 1000 m at most")
    marker = lcmtypes.marker_t()
    marker.kind, marker.size = kind, float(size)
    marker.color = [*(float(part) for part in color), 1.0][:4]
    marker.orientation = [1.0, 0.0, 0.0, 0.0]
    return marker


def _set_points(marker: lcmtypes.marker_t, points: ArrayLike) -> None:
    rows = np.asarray(points, dtype=np.float64)
    if rows.size == 0:
        rows = rows.reshape(0, 3)
    if rows.ndim != 2 or rows.shape[1] not in (2, 3) or not np.isfinite(rows).all():
        raise ValueError("points are rows of 2 or 3 finite numbers")
    if rows.shape[1] == 2:
        rows = np.column_stack([rows, np.zeros(len(rows))])
    marker.n, marker.points = len(rows), rows.tolist()


def _set_place(marker: lcmtypes.marker_t, place: Sequence[float], heading: float) -> None:
    numbers = [float(part) for part in place] + [0.0] * (3 - len(place))
    if len(numbers) != 3 or not all(math.isfinite(part) for part in (*numbers, heading)):
        raise ValueError(f"place {tuple(place)}: it must be 2 or 3 finite numbers")
    marker.position = numbers
    marker.orientation = [math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)]
