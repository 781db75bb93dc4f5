"""The P3-AT's silhouettes against those of MobileRobots' own mesh, and the measure itself against
known outlines.
"""

from pathlib import Path

import numpy as np
import pytest
import silhouette

ROOT = Path(__file__).resolve().parents[2]
MESHES = ROOT.parent / "shared/corpus/amr_robots/meshes/p3at_meshes"
DEVICES = ("devices",)  # the LRF and the camera are not part of the corpus's mesh
ALLOWED_M = 0.03
TOP, SIDE, FRONT = (0, 1), (0, 2), (1, 2)

# AMR's URDF: mesh, position.
PLACED = [
    ("chassis", (0, 0, 0.177)),
    ("top", (0.003, 0, 0.274)),
    ("front_sonar", (0.193, 0, 0.25)),
    ("back_sonar", (-0.187, 0, 0.247)),
]
for x in (0.135, -0.134):
    for side, name in ((1, "left"), (-1, "right")):
        PLACED += [
            ("axle", (x, side * 0.156, 0.111)),
            (f"{name}_hubcap", (x, side * 0.197, 0.111)),
            ("wheel", (x, side * 0.197, 0.111)),
        ]


@pytest.fixture(scope="module")
def ours():
    return silhouette.model_triangles(ROOT / "worlds/robots/p3at/model.sdf", skip=DEVICES)


@pytest.fixture(scope="module")
def theirs():
    if not MESHES.is_dir():
        pytest.skip(f"the corpus is not there: {MESHES}")
    return np.concatenate(
        [silhouette.read_stl(MESHES / f"{name}.stl") + np.array(at) for name, at in PLACED]
    )


@pytest.mark.parametrize("axes", [TOP, SIDE, FRONT], ids=["above", "side", "front"])
def test_p3at_outline_is_that_of_the_corpus(ours, theirs, axes):
    assert silhouette.outline_distance_m(ours, theirs, axes) < ALLOWED_M


def test_p3at_has_the_datasheets_size(ours):
    size = ours.reshape(-1, 3).max(axis=0) - ours.reshape(-1, 3).min(axis=0)
    assert size == pytest.approx([0.508, 0.497, 0.277], abs=0.01)


def square(width, height, at=(0, 0, 0)):
    a, b, c, d = (0, 0, 0), (width, 0, 0), (width, height, 0), (0, height, 0)
    return np.array([(a, b, c), (a, c, d)], float) + np.array(at, float)


def test_distance_of_equal_outlines_is_zero():
    assert silhouette.outline_distance_m(square(0.4, 0.2), square(0.4, 0.2), TOP) == 0


def test_distance_sees_a_wider_side():
    assert silhouette.outline_distance_m(square(0.4, 0.2), square(0.45, 0.2), TOP) == pytest.approx(
        0.05, abs=0.003
    )


def test_distance_sees_a_small_thing_that_sticks_out():
    antenna = np.concatenate([square(0.4, 0.2), square(0.01, 0.1, at=(0.2, 0.2, 0))])
    assert silhouette.outline_distance_m(square(0.4, 0.2), antenna, TOP) == pytest.approx(
        0.1, abs=0.003
    )


def test_distance_sees_a_notch():
    notched = np.concatenate(
        [square(0.15, 0.2), square(0.15, 0.2, at=(0.25, 0, 0)), square(0.4, 0.1)]
    )
    assert silhouette.outline_distance_m(square(0.4, 0.2), notched, TOP) == pytest.approx(
        0.1, abs=0.003
    )


def test_distance_ignores_holes():
    frame = np.concatenate(
        [
            square(0.4, 0.05),
            square(0.4, 0.05, at=(0, 0.15, 0)),
            square(0.05, 0.2),
            square(0.05, 0.2, at=(0.35, 0, 0)),
        ]
    )
    assert silhouette.outline_distance_m(square(0.4, 0.2), frame, TOP) == 0
