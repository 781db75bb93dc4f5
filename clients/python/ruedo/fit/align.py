"""A path for logs that have none but dead reckoning: each scan is aligned to the map of those
before it, by generalised ICP (Segal et al., RSS 2009; small_gicp). Loops are not closed: what is
left of the drift stays.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .mapping import NO_PATH, key_scans, scan_poses
from .progress import track
from .rangefinder import valid
from .recording import Array, Path, Recording, composed, inverse, wrapped

_LAYERS_M = (0.05, 0.11, 0.17)  # heights of a scan's points: its surfaces stand upright
_NEIGHBOURS = 15  # of a point, that show the direction of its surface
_CELL_M = 0.25  # of the map
_FARTHEST_M = 0.5  # between a point and its surface
_CLOSE = 1e-4  # m and rad, of the last step of an alignment
_LEAST_ALIKE = 0.5  # of the points of a scan
_ALIGNED = (
    "the log has no corrected path: its scans were aligned to one another; loops are not closed"
)


def find_path(recording: Recording, mount: Array) -> None:
    """Gives the recording a path by its scans and odometry, where it lacks one. Without small_gicp
    it stays without.
    """
    scans, odometry = recording.scans, recording.odometry
    if recording.truth is not None or scans is None or scans.pose is not None or odometry is None:
        return
    try:
        import small_gicp
    except ImportError:
        recording.findings.append("scans are not aligned: pip install 'ruedo[fit]'")
        return
    believed = scan_poses(recording, mount)
    keys = key_scans(believed)
    if len(keys) < 2:
        return
    recording.findings.remove(NO_PATH)
    found, lost = _aligned(small_gicp, recording, believed, keys)
    recording.findings.append(_ALIGNED)
    if lost:
        recording.findings.append(
            f"{lost} of {len(keys)} scans do not fit to those before; odometry holds there"
        )
    own = composed(found, np.broadcast_to(inverse(mount[None]), found.shape))
    step = composed(own, inverse(odometry.at(scans.time[keys])))
    correction = Path(scans.time[keys], step, "scans").at(odometry.time)
    recording.truth = Path(odometry.time, composed(correction, odometry.pose), "scans")


def _aligned(
    small_gicp: Any, recording: Recording, believed: Array, keys: NDArray[np.int64]
) -> tuple[Array, int]:
    """Poses (N, 3) of the range finder at the key scans, and how many scans did not fit."""
    chart = small_gicp.GaussianVoxelMap(_CELL_M)
    good = valid(recording)
    poses: list[Array] = []
    lost = 0
    for k, i in enumerate(track(keys.tolist(), "aligning")):
        cloud = small_gicp.PointCloud(_upright(recording, i, good[i]))
        small_gicp.estimate_covariances(cloud, num_neighbors=_NEIGHBOURS)
        pose = believed[i]
        if poses:
            moved = composed(inverse(believed[None, keys[k - 1]]), believed[None, i])
            pose = composed(poses[-1][None], moved)[0]
            done = small_gicp.align(
                chart, cloud, _matrix(pose), _FARTHEST_M,
                rotation_epsilon=_CLOSE, translation_epsilon=_CLOSE,
            )  # fmt: skip
            if done.num_inliers > _LEAST_ALIKE * cloud.size():
                place = done.T_target_source
                turn = wrapped(np.arctan2(place[1, 0], place[0, 0]) - pose[2])
                pose = np.array([place[0, 3], place[1, 3], pose[2] + turn])
            else:
                lost += 1
        chart.insert(cloud, _matrix(pose))
        poses.append(pose)
    return np.array(poses), lost


def _upright(recording: Recording, scan: int, good: NDArray[np.bool_]) -> Array:
    """(N, 3) m: the scan's points in its own frame, in layers."""
    scans = recording.scans
    assert scans is not None
    angles, reach = scans.angles[good], scans.ranges[scan, good]
    x, y = reach * np.cos(angles), reach * np.sin(angles)
    return np.concatenate([np.stack([x, y, np.full(len(x), z)], axis=1) for z in _LAYERS_M])


def _matrix(pose: Array) -> Array:
    """(4, 4) of x, y, heading."""
    answer = np.eye(4)
    sine, cosine = np.sin(pose[2]), np.cos(pose[2])
    answer[:2, :2] = [[cosine, -sine], [sine, cosine]]
    answer[:2, 3] = pose[:2]
    return answer
