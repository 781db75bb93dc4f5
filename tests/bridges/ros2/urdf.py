"""Where URDF's links are for positions of its joints: by its specification, and from nothing of
Ruedo's.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np


def numbers(text: str) -> np.ndarray:
    return np.array([float(x) for x in text.split()])


def about(axis, angle: float) -> np.ndarray:
    """Rodrigues' formula."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def pose(rotation: np.ndarray, position) -> np.ndarray:
    return np.block([[rotation, np.reshape(position, (3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]])


def origin(element: ET.Element) -> np.ndarray:
    told = element.find("origin")
    roll, pitch, yaw = numbers(told.get("rpy"))
    turned = about([0, 0, 1], yaw) @ about([0, 1, 0], pitch) @ about([1, 0, 0], roll)
    return pose(turned, numbers(told.get("xyz")))


def child_frames(text: str, positions: dict[str, float]) -> dict[tuple[str, str], np.ndarray]:
    """{(parent, child): the child's frame in its parent's}"""
    frames = {}
    for joint in ET.fromstring(text).iter("joint"):
        at, kind = origin(joint), joint.get("type")
        if kind != "fixed":
            axis, q = numbers(joint.find("axis").get("xyz")), positions[joint.get("name")]
            slides = kind == "prismatic"
            at = at @ (pose(np.eye(3), axis * q) if slides else pose(about(axis, q), [0, 0, 0]))
        frames[joint.find("parent").get("link"), joint.find("child").get("link")] = at
    return frames


def of_transform(transform) -> np.ndarray:
    t, q = transform.translation, transform.rotation
    w, v = q.w, np.array([q.x, q.y, q.z])
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    rotation = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    return pose(rotation, [t.x, t.y, t.z])
