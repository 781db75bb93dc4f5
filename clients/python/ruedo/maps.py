"""Occupancy maps, as ROS's map_server keeps them: look-up, distances, rays and pictures."""

from __future__ import annotations

import io
import math
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import finite
from .errors import NotSupported
from .files import MOST_YAML_BYTES, parse_yaml, read_bytes
from .geometry import Floats, Transform
from .notebook import axes_of

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
FARTHEST = 1e6  # m, rad
MOST_BYTES, MOST_PIXELS, LONGEST_SIDE = 256 << 20, 100_000_000, 20_000  # of a picture
_PGM = re.compile(rb"P5" + 3 * rb"(?:\s|#[^\n]*\n)+(\d{1,9})" + rb"\s")


@dataclass(frozen=True, eq=False)
class Map:
    """An occupancy map. cells (rows, columns): 0 free, 100 occupied, -1 unknown; row 0 is the
    southernmost, so that cells[row, column] is about origin + resolution * (column + 0.5, row +
    0.5), in m, turned by the origin's heading."""

    cells: NDArray[np.int8]
    resolution: float  # m, of a cell
    origin: tuple[float, float, float]  # x, y (m) of the south-western corner, and heading (rad)

    def __repr__(self) -> str:
        rows, columns = self.cells.shape
        return f"<Map of {columns} x {rows} cells of {self.resolution:g} m>"

    def at(self, x: ArrayLike, y: ArrayLike) -> Any:
        """The cell at a place of the world (m), or those at arrays of places; unknown outside of
        the map.
        """
        column, row = (np.floor(one).astype(int) for one in self._in_cells(x, y))
        inside = (row >= 0) & (row < self.cells.shape[0])
        inside &= (column >= 0) & (column < self.cells.shape[1])
        found = np.where(
            inside, self.cells[np.where(inside, row, 0), np.where(inside, column, 0)], UNKNOWN
        )
        return found if found.ndim else int(found)

    def occupied(self, x: ArrayLike, y: ArrayLike) -> Any:
        """Whether the place is occupied (m), or an array of that."""
        found = np.asarray(self.at(x, y)) == OCCUPIED
        return found if found.ndim else bool(found)

    def free(self, x: ArrayLike, y: ArrayLike) -> Any:
        """Whether the place is known to be free (m), or an array of that."""
        found = np.asarray(self.at(x, y)) == FREE
        return found if found.ndim else bool(found)

    def place(self, row: ArrayLike, column: ArrayLike) -> Floats:
        """(..., 2) m: the middle of a cell, or of each of arrays of cells."""
        across = (np.asarray(column, np.float64) + 0.5) * self.resolution
        up = (np.asarray(row, np.float64) + 0.5) * self.resolution
        x, y, turn = self.origin
        made: Floats = np.stack(
            [
                x + np.cos(turn) * across - np.sin(turn) * up,
                y + np.sin(turn) * across + np.cos(turn) * up,
            ],
            axis=-1,
        )
        return made

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of a place (m), which may lie outside."""
        column, row = self._in_cells(x, y)
        return math.floor(row), math.floor(column)

    def distance_field(self) -> Floats:
        """(rows, columns) m from the middle of each cell to that of the nearest occupied one: 0 in
        an occupied cell, +inf on a map without one. Exact (Felzenszwalb and Huttenlocher 2012, by
        rows and then columns).
        """
        taken = self.cells == OCCUPIED
        rows, columns = taken.shape
        along = np.where(taken, 0.0, np.inf)
        for column in range(1, columns):
            along[:, column] = np.minimum(along[:, column], along[:, column - 1] + 1.0)
        for column in range(columns - 2, -1, -1):
            along[:, column] = np.minimum(along[:, column], along[:, column + 1] + 1.0)
        squared = along * along
        nearest = squared.copy()
        for step in range(1, rows):
            if step * step >= nearest.max():
                break
            shifted = squared[:-step] + step * step
            nearest[step:] = np.minimum(nearest[step:], shifted)
            shifted = squared[step:] + step * step
            nearest[:-step] = np.minimum(nearest[:-step], shifted)
        made: Floats = np.sqrt(nearest) * self.resolution
        return made

    def inflated(self, radius: float) -> Map:
        """The map in which every cell is occupied that is at most so far (m) from an occupied one:
        where the middle of a robot of that radius cannot be.
        """
        near = self.distance_field() <= finite("radius", radius, 0.0) + 1e-9
        cells = np.where(near, np.int8(OCCUPIED), self.cells)
        cells.setflags(write=False)
        return Map(cells, self.resolution, self.origin)

    def ray(self, x: ArrayLike, y: ArrayLike, angle: ArrayLike, max_range: float = 30.0) -> Any:
        """How far a ray goes (m) from a place (m) in a direction (rad, of the world) until it
        enters an occupied cell: +inf where it meets none within max_range, 0 from within one. For
        arrays, which broadcast, an array. Goes from cell to cell (Amanatides and Woo 1987)."""
        given = np.broadcast_arrays(*(np.asarray(one, np.float64) for one in (x, y, angle)))
        shape = given[0].shape
        start = np.stack(self._in_cells(given[0].ravel(), given[1].ravel()), axis=1)
        turned = given[2].ravel() - self.origin[2]
        way = np.stack([np.cos(turned), np.sin(turned)], axis=1)
        ranges = self._cast(start, way, max_range / self.resolution) * self.resolution
        made = ranges.reshape(shape)
        return made if made.ndim else float(made)

    def _cast(self, start: Floats, way: Floats, most: float) -> Floats:
        """start, way: (n, 2) columns and rows. Returns (n,) cells."""
        taken = self.cells == OCCUPIED
        sizes = np.array([self.cells.shape[1], self.cells.shape[0]])
        cell, step = np.floor(start).astype(int), np.sign(way).astype(int)
        with np.errstate(divide="ignore", invalid="ignore"):
            per_cell = np.abs(1.0 / way)
            to_border = np.where(step > 0, cell + 1 - start, start - cell) * per_cell
        to_border[step == 0] = np.inf
        ranges, gone = np.full(len(start), np.inf), np.zeros(len(start))
        active = np.arange(len(start))
        while active.size:
            inside = np.all((cell[active] >= 0) & (cell[active] < sizes), axis=1)
            within = cell[active[inside]]
            hit = np.zeros(len(active), bool)
            hit[inside] = taken[within[:, 1], within[:, 0]]
            ranges[active[hit]] = gone[active[hit]]
            active = active[~hit]
            axis = np.argmin(to_border[active], axis=1)
            gone[active] = to_border[active, axis]
            cell[active, axis] += step[active, axis]
            to_border[active, axis] += per_cell[active, axis]
            away = ((cell[active] < 0) & (step[active] <= 0)) | (
                (cell[active] >= sizes) & (step[active] >= 0)
            )
            active = active[(gone[active] <= most) & ~away.any(axis=1)]
        return ranges

    def plot(
        self,
        axes: Any = None,
        *,
        path: ArrayLike | None = None,
        points: ArrayLike | None = None,
        pose: Transform | None = None,
    ) -> Any:
        """Draws the map with matplotlib: occupied black, free white, unknown grey. path: (n, 2) m,
        a line. points: (n, 2) or (n, 3) m, such as ``scan.points(robot.lrf, pose)``. pose: of the
        robot. axes: None makes new ones. Returns them.
        """
        axes = axes_of(axes)
        shade = np.where(self.cells == OCCUPIED, 0.0, np.where(self.cells == FREE, 1.0, 0.7))
        rows, columns = (np.arange(size + 1) for size in self.cells.shape)
        corners = self.place(rows[:, None] - 0.5, columns[None, :] - 0.5)
        axes.pcolormesh(corners[..., 0], corners[..., 1], shade, cmap="gray", vmin=0.0, vmax=1.0)
        if path is not None:
            line = np.asarray(path, np.float64)
            axes.plot(line[:, 0], line[:, 1], "-", color="tab:blue")
        if points is not None:
            ends = np.asarray(points, np.float64)
            axes.plot(ends[:, 0], ends[:, 1], ".", color="tab:red", markersize=3)
        if pose is not None:
            tip = pose.apply((0.4, 0.0))
            axes.annotate("", tip[:2], (pose.x, pose.y), arrowprops={"arrowstyle": "->"})
        axes.set(aspect="equal", xlabel="x, m", ylabel="y, m")
        return axes

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes NAME.yaml and NAME.pgm, as map_server reads them."""
        file = Path(path)
        if file.suffix != ".yaml":
            raise ValueError(f"{file}: the name of a map ends in .yaml")
        grey = np.select([self.cells == OCCUPIED, self.cells == FREE], [0, 254], 205)
        rows, columns = grey.shape
        picture = file.with_suffix(".pgm")
        head = f"P5\n{columns} {rows}\n255\n".encode()
        picture.write_bytes(head + grey[::-1].astype(np.uint8).tobytes())
        x, y, turn = self.origin
        file.write_text(
            f"image: {picture.name}\nresolution: {self.resolution!r}\n"
            f"origin: [{float(x)!r}, {float(y)!r}, {float(turn)!r}]\n"
            "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
        )

    def _in_cells(self, x: ArrayLike, y: ArrayLike) -> tuple[Floats, Floats]:
        """Columns and rows, from the corner of the first cell."""
        across = np.asarray(x, np.float64) - self.origin[0]
        up = np.asarray(y, np.float64) - self.origin[1]
        cosine, sine = math.cos(self.origin[2]), math.sin(self.origin[2])
        return (
            (cosine * across + sine * up) / self.resolution,
            (cosine * up - sine * across) / self.resolution,
        )


OccupancyMap = Map  # deprecated: its name before 1.0


def load_map(path: str | os.PathLike[str]) -> Map:
    """Reads NAME.yaml and the picture that it names: what ``ruedo map`` writes and map_server
    reads. Pictures other than PGM need Pillow.

    Raises ValueError, which names the file and what is wrong with it.
    """
    try:
        import yaml
    except ImportError:
        raise NotSupported("load_map() needs PyYAML: pip install pyyaml") from None
    file = Path(path)
    try:
        _, head = parse_yaml(read_bytes(file, MOST_YAML_BYTES).decode())
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f"{file}: {error}") from None
    if not isinstance(head, dict):
        raise ValueError(f"{file}: expected a map with image, resolution and origin")
    missing = [key for key in ("image", "resolution", "origin") if key not in head]
    if missing:
        raise ValueError(f"{file}: {', '.join(missing)} is missing")
    resolution, origin = _number(file, head, "resolution"), head["origin"]
    if not (
        isinstance(origin, list)
        and len(origin) == 3
        and all(isinstance(one, (int, float)) and abs(one) <= FARTHEST for one in origin)
    ):
        raise ValueError(
            f"{file}: origin is {origin!r:.100}: expected three numbers: x, y and heading"
        )
    grey = _grey(file.parent / str(head["image"])).astype(np.float64) / 255.0
    dark = grey if head.get("negate") else 1.0 - grey
    cells = np.full(grey.shape, UNKNOWN, np.int8)
    cells[dark > _number(file, head, "occupied_thresh", 0.65)] = OCCUPIED
    cells[dark < _number(file, head, "free_thresh", 0.196)] = FREE
    cells = np.ascontiguousarray(cells[::-1])
    cells.setflags(write=False)
    return Map(cells, resolution, (float(origin[0]), float(origin[1]), float(origin[2])))


def _number(file: Path, head: dict[str, Any], key: str, fallback: float | None = None) -> float:
    value = head.get(key, fallback)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value <= FARTHEST:
        raise ValueError(
            f"{file}: {key} is {value!r:.100}: expected a number above 0, at most {FARTHEST:g}"
        )
    return float(value)


def _grey(picture: Path) -> NDArray[np.uint8]:
    content = read_bytes(picture, MOST_BYTES)
    if not content.startswith(b"P5"):
        return _by_pillow(picture, content)
    head = _PGM.match(content)
    if not head:
        raise ValueError(f"{picture}: is not a PGM")
    width, height, largest = map(int, head.groups())
    pixels = len(content) - head.end()
    if largest != 255 or not 0 < width * height <= pixels:
        raise ValueError(
            f"{picture}: expected an 8-bit PGM of {width} x {height} pixels, found {pixels} bytes"
        )
    return np.frombuffer(content, np.uint8, width * height, head.end()).reshape(height, width)


def _by_pillow(picture: Path, content: bytes) -> NDArray[np.uint8]:
    try:
        from PIL import Image  # type: ignore[import-not-found, unused-ignore]
    except ImportError:
        raise NotSupported(
            f"{picture}: pictures other than PGM need Pillow: pip install pillow"
        ) from None
    try:
        image = Image.open(io.BytesIO(content), formats=("PNG", "JPEG", "BMP", "TIFF", "PPM"))
        width, height = image.size
        if max(width, height) > LONGEST_SIDE or width * height > MOST_PIXELS:
            raise ValueError(f"{width} x {height} pixels are too many")
        return np.asarray(image.convert("L"))
    except Exception as error:  # Pillow has many, of its own and of Python's
        raise ValueError(f"{picture}: is not a picture that can be read: {error}") from None
