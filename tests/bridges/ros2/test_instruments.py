"""Instruments and the cameras that show what things are, in a bag, against values by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from conftest import bag_of

WORLD = str(Path(__file__).resolve().parent / "instruments.sdf")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """{topic: messages}"""
    return bag_of(WORLD, tmp_path_factory.mktemp("instruments"))


def xyz(v) -> tuple[float, float, float]:
    return v.x, v.y, v.z


def test_satellite_navigation(bag):
    fix = bag["/fix"][-1]
    assert fix.header.frame_id == "gps"
    assert (fix.status.status, fix.status.service) == (0, 1)
    assert fix.latitude == pytest.approx(45, abs=1e-12)
    assert fix.longitude == pytest.approx(8, abs=1e-12)
    assert fix.altitude == pytest.approx(110, abs=1e-8)
    assert fix.position_covariance_type == 0
    assert xyz(bag["/fix_velocity"][-1].twist.linear) == (0, 0, 0)


def test_field_height_and_air(bag):
    assert xyz(bag["/magnetic_field"][-1].magnetic_field) == (1e-5, 2e-5, -3e-5)
    assert (
        bag["/altimeter"][-1].vertical_position,
        bag["/altimeter"][-1].vertical_velocity,
    ) == (0, 0)
    height = 6356766 * 110 / (6356766 + 110)
    kelvin = 288.15 - 0.0065 * height
    expected = 101325 * (kelvin / 288.15) ** (9.80665 / (287.05287 * 0.0065))
    assert bag["/pressure"][-1].fluid_pressure == pytest.approx(expected, rel=1e-12)
    assert bag["/differential_pressure"][-1].fluid_pressure == 0
    assert bag["/air_temperature"][-1].temperature == pytest.approx(kelvin - 273.15, abs=1e-9)


def test_the_load_hangs_on_the_mast(bag):
    wrench = bag["/wrench"][-1]
    assert wrench.header.frame_id == "scale"
    assert xyz(wrench.wrench.force) == pytest.approx((0, 0, -2 * 9.8), abs=1e-12)
    assert xyz(wrench.wrench.torque) == pytest.approx((0, 0, 0), abs=1e-12)


def test_a_plugins_pose(bag):
    pose = bag["/pose"][-1]
    assert (pose.header.frame_id, pose.child_frame_id) == ("world", "p3d")
    assert xyz(pose.pose.pose.position) == pytest.approx((0, 0, 9), abs=1e-12)
    assert "/ground_truth" in bag


def test_detections(bag):
    (seen,) = bag["/logical/detections"][-1].detections
    assert (seen.id, seen.results[0].hypothesis.class_id) == ("crate", "crate")
    assert xyz(seen.bbox.center.position) == pytest.approx((5, 0, 0), abs=1e-12)
    flat = bag["/flat/detections"][-1]
    assert flat.header.frame_id == "flat_optical"
    (box,) = flat.detections
    assert (box.id, box.results[0].hypothesis.class_id) == ("crate", "7")
    assert (box.bbox.center.position.x, box.bbox.center.position.y) == pytest.approx((100, 50))
    assert (box.bbox.size_x, box.bbox.size_y) == pytest.approx((100 / 4.5, 100 / 4.5))
    (solid,) = bag["/solid/detections"][-1].detections
    assert xyz(solid.bbox.size) == pytest.approx((1, 1, 1))
    assert solid.bbox.center.orientation.w == 1


def test_pictures_of_classes_and_temperatures(bag):
    classes, heat = bag["/segmentation"][-1], bag["/thermal"][-1]
    assert (classes.encoding, classes.width, classes.height) == ("mono8", 64, 48)
    assert classes.data.reshape(48, 64)[24, 32] == 7 and classes.data[0] == 0
    assert heat.encoding == "16UC1"
    kelvin = np.frombuffer(heat.data.tobytes(), "<u2").reshape(48, 64) * 0.01
    assert kelvin[24, 32] == pytest.approx(310) and kelvin[0, 0] == pytest.approx(288.15)
    half = math.tan(1.047 / 2) * 4.5  # m, of the view at the crate
    assert np.count_nonzero(classes.data) == pytest.approx((64 * 0.5 / half) ** 2, rel=0.15)
