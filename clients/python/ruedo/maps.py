"""load_map(): an occupancy map as ROS's map_server keeps it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import NotSupported

FREE, OCCUPIED, UNKNOWN = 0, 100, -1


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
        head = yaml.safe_load(file.read_text(encoding="utf-8"))
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
        and all(isinstance(one, (int, float)) for one in origin)
    ):
        raise ValueError(
            f"{file}: origin is {origin!r}: three numbers are wanted, x, y and heading"
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
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0:
        raise ValueError(f"{file}: {key} is {value!r}: a number above 0 is wanted")
    return float(value)


def _grey(picture: Path) -> NDArray[np.uint8]:
    content = picture.read_bytes()
    if not content.startswith(b"P5"):
        try:
            from PIL import Image  # type: ignore[import-not-found, unused-ignore]
        except ImportError:
            raise NotSupported(
                f"{picture}: pictures other than PGM need Pillow: pip install pillow"
            ) from None
        return np.asarray(Image.open(picture).convert("L"))
    words: list[bytes] = []
    rest = content[2:]
    while len(words) < 3:  # width, height and largest value; comments between them
        rest = rest.lstrip()
        if rest.startswith(b"#"):
            rest = rest.partition(b"\n")[2]
            continue
        word = rest.split(None, 1)[0] if rest.split(None, 1) else b""
        if not word.isdigit():
            raise ValueError(f"{picture}: is no PGM")
        words.append(word)
        rest = rest[len(word) :]
    width, height, largest = map(int, words)
    if largest != 255 or len(rest) - 1 < width * height:
        raise ValueError(
            f"{picture}: a PGM of 8 bits with {width} x {height} pixels is wanted, and {len(rest) - 1} bytes are there"
        )
    return np.frombuffer(rest, np.uint8, width * height, 1).reshape(height, width)
