"""ruedo nav2-params, against the robots' files and against geometry by hand."""

import math
import os
import re
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml

RUEDO = os.environ["RUEDO"]
WORLDS = Path(os.environ["RUEDO_SOURCE_DIR"]) / "worlds"
NS = "{urn:ruedo}"

# A box of 0.4 m x 0.3 m between wheels of 0.2 m x 0.04 m; the axle is in its middle.
CART = """<robot name="cart"><link name="base"><collision><origin xyz="0 0 0.2"/><geometry><box size="0.4 0.3 0.2"/></geometry></collision></link>
<link name="wl"><collision><origin rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
<link name="wr"><collision><origin rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
<joint name="jl" type="continuous"><parent link="base"/><child link="wl"/><origin xyz="0 0.2 0.1"/><axis xyz="0 1 0"/></joint>
<joint name="jr" type="continuous"><parent link="base"/><child link="wr"/><origin xyz="0 -0.2 0.1"/><axis xyz="0 1 0"/></joint></robot>"""

TWO_LASERS = """<sdf version="1.9" xmlns:ruedo="urn:ruedo"><world name="w"><model name="bot"><link name="base">
<collision name="c"><pose>0 0 0.2 0 0 0</pose><geometry><cylinder><radius>0.25</radius><length>0.2</length></cylinder></geometry></collision>
<sensor name="ahead" type="lidar"><pose>0.2 0 0.2 0 0 0</pose><lidar><scan><horizontal><samples>10</samples><min_angle>-1</min_angle><max_angle>1</max_angle></horizontal></scan><range><min>0.1</min><max>2</max></range></lidar></sensor>
<sensor name="behind" type="lidar"><pose>-0.2 0 0.2 0 0 3.1</pose><lidar><scan><horizontal><samples>10</samples><min_angle>-1</min_angle><max_angle>1</max_angle></horizontal></scan><range><min>0.05</min><max>30</max></range></lidar></sensor>
</link><ruedo:drive steering="holonomic"><ruedo:max_speed>0.7</ruedo:max_speed><ruedo:max_side_speed>0.3</ruedo:max_side_speed><ruedo:acceleration>0.2</ruedo:acceleration></ruedo:drive></model></world></sdf>"""


def ruedo(*words):
    return subprocess.run(
        [RUEDO, "nav2-params", *map(str, words)], capture_output=True, text=True, timeout=60
    )


def parameters(*words):
    """{node: its parameters}; each number that Nav2 declares as one is one."""
    done = ruedo(*words)
    assert done.returncode == 0, done.stderr
    return {
        name: node.get(name, node)["ros__parameters"]
        for name, node in yaml.safe_load(done.stdout).items()
    }


def corners(costmap):
    return sorted(map(tuple, yaml.safe_load(costmap["footprint"])))


@pytest.mark.parametrize("robot", ["p3at", "turtle", "mecanum", "car"])
def test_limits_are_those_of_the_robots_file(robot):
    told = parameters(robot)
    drive = ET.parse(WORLDS / f"robots/{robot}/model.sdf").find(f"model/{NS}drive")

    def limit(name, default=None):
        return float(drive.findtext(NS + name, default))

    speed, acceleration = limit("max_speed"), limit("acceleration")
    deceleration = limit("deceleration", acceleration)
    follow, smoother = told["controller_server"]["FollowPath"], told["velocity_smoother"]
    assert follow["vx_max"] == follow["desired_linear_vel"] == follow["max_vel_x"] == speed
    assert (follow["ax_max"], follow["ax_min"]) == (acceleration, -deceleration)
    assert smoother["max_velocity"][0] == speed
    assert smoother["max_accel"][0] == acceleration
    assert smoother["max_decel"][0] == -deceleration
    assert all(isinstance(value, float) for value in smoother["max_velocity"])
    turn = limit("turn_acceleration")
    assert follow["az_max"] == smoother["max_accel"][2] == turn
    assert told["behavior_server"]["rotational_acc_lim"] == turn
    rate = follow["wz_max"]
    assert rate == told["behavior_server"]["max_rotational_vel"] == smoother["max_velocity"][2]
    assert 0 < told["behavior_server"]["min_rotational_vel"] < rate <= limit("max_turn_rate")


def test_a_footprint_is_that_of_the_collisions(tmp_path):
    (tmp_path / "cart.urdf").write_text(CART)
    told = parameters(tmp_path / "cart.urdf")
    # The box reaches 0.35 / sqrt(2) m at 45 degrees, which cuts what the wheels add at the corners.
    quarter = [(0.2, 0.15), (0.13, 0.22)]
    expected = sorted((x * sx, y * sy) for x, y in quarter for sx in (1, -1) for sy in (1, -1))
    for costmap in ("local_costmap", "global_costmap"):
        found = corners(told[costmap])
        assert len(found) == 8
        for one, other in zip(found, expected, strict=True):
            assert one == pytest.approx(other, abs=1e-4)
    # Nothing limits it, and it has no laser: Nav2's own values.
    assert told["velocity_smoother"]["max_velocity"][0] == 0.5
    assert "observation_sources" not in told["collision_monitor"]
    assert "scan_topic" not in told["amcl"]


def test_a_round_robot_has_a_radius(tmp_path):
    (tmp_path / "world.sdf").write_text(TWO_LASERS)
    told = parameters(tmp_path / "world.sdf")
    assert told["local_costmap"]["robot_radius"] == pytest.approx(0.25)
    assert "footprint" not in told["local_costmap"]
    # It moves sideways, too, and has two lasers, which have topics of their own.
    assert told["amcl"]["robot_model_type"] == "nav2_amcl::OmniMotionModel"
    assert told["controller_server"]["FollowPath"]["motion_model"] == "Omni"
    assert told["velocity_smoother"]["max_velocity"][:2] == [0.7, 0.3]
    layer = told["local_costmap"]["voxel_layer"]
    assert layer["observation_sources"] == "ahead behind"
    assert layer["ahead"]["topic"] == "/ahead/scan"
    assert layer["ahead"]["obstacle_max_range"] == layer["ahead"]["raytrace_max_range"] == 2.0
    assert (layer["behind"]["raytrace_min_range"], layer["behind"]["raytrace_max_range"]) == (
        0.05,
        3,
    )
    assert told["collision_monitor"]["behind"] == {"topic": "/behind/scan", "type": "scan"}
    assert told["slam_toolbox"]["max_laser_range"] == 2.0


def test_a_car_keeps_its_turning_circle():
    drive = ET.parse(WORLDS / "robots/car/model.sdf").find(f"model/{NS}drive")
    told = parameters("car")
    follow = told["controller_server"]["FollowPath"]
    radius = follow["AckermannConstraints"]["min_turning_r"]
    angle = float(drive.findtext(NS + "max_steering_angle", "nan"))
    wheelbase = float(drive.findtext(NS + "wheelbase", "nan"))
    if not math.isnan(angle + wheelbase):
        assert radius == pytest.approx(wheelbase / math.tan(angle), rel=1e-5)
    assert told["planner_server"]["GridBased"]["minimum_turning_radius"] == radius > 0.1
    assert follow["wz_max"] <= follow["vx_max"] / radius * 1.00001


def test_robots_of_a_fleet_have_topics_of_their_own():
    told = parameters(WORLDS / "fleet.sdf", "--robot", "bob")
    topics = re.findall(r"topic: (/\S+)", ruedo(WORLDS / "fleet.sdf", "--robot", "bob").stdout)
    assert topics and all(topic.startswith("/bob/") for topic in topics)
    assert told["slam_toolbox"]["odom_frame"] == "odom"  # those of /bob/tf have no prefix


@pytest.mark.parametrize(
    "words, text",
    [
        (["nothing"], "no model of that name"),
        ([WORLDS / "empty.sdf"], "has no robot with a drive"),
        ([WORLDS / "fleet.sdf"], "choose one by --robot: alice, bob"),
        ([WORLDS / "fleet.sdf", "--robot", "eve"], "there is no 'eve'"),
        ([], "ROBOT"),
    ],
)
def test_missing_parameters_are_an_error(words, text):
    done = ruedo(*words)
    assert text in done.stderr and done.stdout == ""
    assert done.returncode == 2
