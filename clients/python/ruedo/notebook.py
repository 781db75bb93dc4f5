"""How samples show in a notebook: pictures as pictures, scans as small plots. No package but numpy
is needed.
"""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import NotSupported


def png(pixels: NDArray[Any]) -> bytes:
    """(height, width) or (height, width, 3) uint8 as a PNG."""
    height, width = pixels.shape[:2]
    colour = 2 if pixels.ndim == 3 else 0
    rows = np.ascontiguousarray(pixels, np.uint8).reshape(height, -1)
    raw = np.hstack([np.zeros((height, 1), np.uint8), rows]).tobytes()  # filter 0 before each row
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0)),
        (b"IDAT", zlib.compress(raw, 6)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in chunks
    )


def visible(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    """Depth and labels as grey: near is bright, nothing is black."""
    if pixels.dtype == np.uint8:
        return pixels
    values = pixels.astype(np.float64)
    there = np.isfinite(values) & (values > 0)
    low, high = (values[there].min(), values[there].max()) if there.any() else (0.0, 1.0)
    grey = np.zeros(values.shape, np.uint8)
    grey[there] = (255.0 - 215.0 * (values[there] - low) / ((high - low) or 1.0)).astype(np.uint8)
    return grey


def scan_svg(points: NDArray[np.float64], size: int = 240) -> str:
    """(n, 2) points about the device, x upwards as the robot looks, y to the left."""
    reach = float(np.abs(points).max()) if points.size else 1.0
    scale, middle = 0.46 * size / (reach or 1.0), size / 2
    dots = "".join(
        f'<circle cx="{middle - scale * y:.1f}" cy="{middle - scale * x:.1f}" r="1.4"/>'
        for x, y in points
    )
    robot = f'<path d="M {middle} {middle - 7} l 5 12 l -10 0 z" fill="#c33"/>'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{size}" height="{size}"><rect width="{size}" height="{size}" fill="#fff" stroke="#999"/>'
        f'<g fill="#246">{dots}</g>{robot}<text x="6" y="{size - 6}" font-family="sans-serif" font-size="11">{2 * reach / 0.92:.3g} m wide</text></svg>'
    )


def axes_of(axes: Any) -> Any:
    """matplotlib's; None: new ones. Raises NotSupported where it is not installed."""
    if axes is not None:
        return axes
    try:
        from matplotlib import pyplot
    except ImportError:
        raise NotSupported("plot() needs matplotlib: pip install matplotlib") from None
    return pyplot.subplots()[1]
