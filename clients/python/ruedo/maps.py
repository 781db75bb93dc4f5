"""load_map(): an occupancy map as ROS's map_server keeps it."""

from __future__ import annotations

import io
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import NotSupported
from .files import MOST_YAML_BYTES, parse_yaml, read_bytes

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
FARTHEST = 1e6  # m, rad
MOST_BYTES, MOST_PIXELS, LONGEST_SIDE = 256 << 20, 100_000_000, 20_000  # of a picture
_PGM = re.compile(rb"P5" + 3 * rb"(?:\s|#[^\n]*\n)+(\d{1,9})" + rb"\s")


@dataclass(frozen=True, eq=False)
class OccupancyMap:
    """cells (rows, columns): 0 free, 100 occupied, -1 unknown; row 0 is the southernmost, so that
    cells[row, column] is about origin + resolution * (column + 0.5, row + 0.5), in m."""

    cells: NDArray[np.int8]
    resolution: float  # m, of a cell
    origin: tuple[float, float, float]  # x, y (m) of the south-western corner, and heading (rad)

    def __repr__(self) -> str:
        rows, columns = self.cells.shape
        return f"<OccupancyMap of {columns} x {rows} cells of {self.resolution:g} m>"

    def at(self, x: float, y: float) -> int:
        """The cell at a place of the world (m); unknown outside of the map."""
        turn = np.array(
            [
                [np.cos(self.origin[2]), np.sin(self.origin[2])],
                [-np.sin(self.origin[2]), np.cos(self.origin[2])],
            ]
        )
        column, row = np.floor(
            turn @ (np.array([x, y]) - self.origin[:2]) / self.resolution
        ).astype(int)
        inside = 0 <= row < self.cells.shape[0] and 0 <= column < self.cells.shape[1]
        return int(self.cells[row, column]) if inside else UNKNOWN


def load_map(path: str | os.PathLike[str]) -> OccupancyMap:
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
        raise ValueError(f"{file}: a map of image, resolution and origin is wanted")
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
            f"{file}: origin is {origin!r:.100}: three numbers are wanted, x, y and heading"
        )
    grey = _grey(file.parent / str(head["image"])).astype(np.float64) / 255.0
    dark = grey if head.get("negate") else 1.0 - grey
    cells = np.full(grey.shape, UNKNOWN, np.int8)
    cells[dark > _number(file, head, "occupied_thresh", 0.65)] = OCCUPIED
    cells[dark < _number(file, head, "free_thresh", 0.196)] = FREE
    cells = np.ascontiguousarray(cells[::-1])
    cells.setflags(write=False)
    return OccupancyMap(cells, resolution, (float(origin[0]), float(origin[1]), float(origin[2])))


def _number(file: Path, head: dict[str, Any], key: str, fallback: float | None = None) -> float:
    value = head.get(key, fallback)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value <= FARTHEST:
        raise ValueError(
            f"{file}: {key} is {value!r:.100}: a number above 0, {FARTHEST:g} at most, is wanted"
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
            f"{picture}: a PGM of 8 bits with {width} x {height} pixels is wanted, and {pixels} bytes are there"
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
