"""Silhouettes of triangle soups along an axis, and how far apart two of them are; for robots'
models and meshes.

A silhouette is drawn on a grid of RESOLUTION_M; outlines are compared by their Hausdorff distance,
so a result is right to about one cell.
"""

import struct
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

RESOLUTION_M = 0.002
MARGIN_M = 0.05


def read_stl(path):
    """Triangles (n, 3, 3) of a binary STL, in the file's unit."""
    data = Path(path).read_bytes()
    (count,) = struct.unpack("<I", data[80:84])
    records = np.frombuffer(data, np.uint8, 50 * count, 84).reshape(count, 50)
    return records[:, 12:48].copy().view("<f4").reshape(count, 3, 3).astype(float)


def read_obj(path):
    """Triangles (n, 3, 3) of a Wavefront OBJ with polygons that a fan from their first corner
    covers.
    """
    vertices, triangles = [], []
    for line in Path(path).read_text(encoding="ascii").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(w) for w in words[1:4]])
        elif words[:1] == ["f"]:
            corners = [int(w.split("/")[0]) - 1 for w in words[1:]]
            triangles += [
                (corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)
            ]
    return np.array(vertices)[np.array(triangles)]


def moved(triangles, xyz, rpy=(0, 0, 0)):
    """The triangles in the frame in which theirs has this pose (SDF's convention: Rz(yaw) Ry(pitch)
    Rx(roll)).
    """
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    rotation = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    return triangles @ rotation.T + np.asarray(xyz, float)


def model_triangles(sdf_path, skip=()):
    """Triangles of the mesh visuals of a model.sdf in the model's frame; visuals named in `skip`
    are left out.
    """
    folder = Path(sdf_path).parent
    parts = []
    for link in ElementTree.parse(sdf_path).getroot().find("model").findall("link"):
        for visual in link.findall("visual"):
            if visual.get("name") in skip:
                continue
            triangles = read_obj(folder / visual.find("geometry/mesh/uri").text)
            for pose in (visual.find("pose"), link.find("pose")):
                if pose is not None:
                    numbers = [float(w) for w in pose.text.split()]
                    triangles = moved(triangles, numbers[:3], numbers[3:])
            parts.append(triangles)
    return np.concatenate(parts)


def outline_distance_m(first, second, axes):
    """Hausdorff distance between the outlines of two triangle soups projected onto two axes (0 x, 1
    y, 2 z), in metres.

    An outline is the border towards the open: holes inside a silhouette do not count.
    """
    points = np.concatenate([first, second]).reshape(-1, 3)[:, axes]
    low = points.min(axis=0) - MARGIN_M
    shape = np.ceil((points.max(axis=0) + MARGIN_M - low) / RESOLUTION_M).astype(int)
    borders = [_border(_raster(soup[:, :, axes], low, shape)) for soup in (first, second)]
    gaps = np.linalg.norm(borders[0][:, None, :] - borders[1][None, :, :], axis=2)
    return max(gaps.min(axis=0).max(), gaps.min(axis=1).max()) * RESOLUTION_M


def _raster(triangles, low, shape):
    """The cells whose centre some triangle covers."""
    covered = np.zeros(shape, bool)
    for corners in (triangles - low) / RESOLUTION_M:
        first = np.floor(corners.min(axis=0)).astype(int)
        last = np.ceil(corners.max(axis=0)).astype(int) + 1
        x, y = np.meshgrid(
            np.arange(first[0], last[0]) + 0.5, np.arange(first[1], last[1]) + 0.5, indexing="ij"
        )
        sides = [
            (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
            for p, q in zip(corners, np.roll(corners, -1, axis=0))
        ]
        inside = np.all([s >= 0 for s in sides], axis=0) | np.all([s <= 0 for s in sides], axis=0)
        covered[first[0] : last[0], first[1] : last[1]] |= inside
    return covered


def _border(covered):
    """Cells of the open outside (reached from the corner) that touch the silhouette."""
    outside = np.zeros_like(covered)
    outside[0, 0] = True
    count = 0
    while count != outside.sum():
        count = outside.sum()
        for axis in (
            0,
            1,
        ):  # sweeps that run on along rows and columns until something covered stops them
            for order in (slice(None), slice(None, None, -1)):
                open_, free = (np.moveaxis(a, axis, 0)[order] for a in (outside, ~covered))
                for i in range(1, len(open_)):
                    open_[i] |= open_[i - 1] & free[i]
    near = np.zeros_like(covered)
    near[1:] |= covered[:-1]
    near[:-1] |= covered[1:]
    near[:, 1:] |= covered[:, :-1]
    near[:, :-1] |= covered[:, 1:]
    return np.argwhere(outside & near).astype(float)
