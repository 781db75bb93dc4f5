"""Public robots that nobody here wrote drive a square in a room, and their laser range finders see
its walls where they are.
"""

import math
import os
from pathlib import Path

import numpy as np
import pytest
import ruedo

CORPUS = Path(os.environ["RUEDO_SOURCE_DIR"]).parent / "shared" / "corpus"
pytestmark = pytest.mark.skipif(
    not CORPUS.is_dir(),
    reason=f"the public files are not here ({CORPUS}); they are not part of Ruedo",
)

HALF = 2.0  # m, from the middle of the room to its walls
# Added to a robot without a range finder in its <include>: its own file stays unchanged.
LIDAR = """<sensor name="lidar" type="lidar"><pose>0 0 0.6 0 0 0</pose><update_rate>10</update_rate><lidar><scan><horizontal><samples>360</samples>
<min_angle>-3.13</min_angle><max_angle>3.13</max_angle></horizontal></scan><range><min>0.1</min><max>10</max></range></lidar></sensor>"""
ROBOTS = {
    "turtlebot3_burger": "",
    "turtlebot3_waffle": "",
    "pioneer2dx": LIDAR,
    "pioneer3at": LIDAR,
}


def wall(name, x, y, dx, dy):
    return (
        f"<model name='{name}'><static>true</static><pose>{x} {y} 1 0 0 0</pose><link name='l'><collision name='c'><geometry><box><size>{dx} {dy} 2</size>"
        "</box></geometry></collision></link></model>"
    )


def room(model, inside):
    walls = [
        wall("east", HALF + 0.1, 0, 0.2, 4.4),
        wall("west", -HALF - 0.1, 0, 0.2, 4.4),
        wall("north", 0, HALF + 0.1, 4.4, 0.2),
        wall("south", 0, -HALF - 0.1, 4.4, 0.2),
    ]
    return (
        f"<sdf version='1.9'><world name='room'><include><uri>model://ground_plane</uri></include>{''.join(walls)}"
        f"<include><uri>model://{model}</uri><name>robot</name><pose>-0.5 -0.5 0 0 0 0</pose>{inside}</include></world></sdf>"
    )


def to_the_walls(x, y, angles):
    """The way from (x, y) to the walls of the room along each angle, m."""
    cosine, sine = np.cos(angles), np.sin(angles)
    with np.errstate(divide="ignore"):
        return np.minimum((np.sign(cosine) * HALF - x) / cosine, (np.sign(sine) * HALF - y) / sine)


@pytest.mark.parametrize("model", ROBOTS)
def test_drives_a_square_and_sees_the_walls(model, tmp_path, monkeypatch):
    monkeypatch.setenv("GAZEBO_MODEL_PATH", f"{CORPUS}/gazebo_models:{CORPUS}/turtlebot3/models")
    world = tmp_path / "room.sdf"
    world.write_text(room(model, ROBOTS[model]))
    disabled = ["--disable", "robot/camera"] if model == "turtlebot3_waffle" else []
    # Not as fast as it goes: a client that the server leaves behind sends its commands again.
    with ruedo.launch(world, rate=20, args=["--no-noise", *disabled], timeout=60) as sim:
        robot = sim.robot("robot")
        start = robot.pose.next()  # base_link is not the model's origin for all of them
        for x, y in [(1, 0), (1, 1), (0, 1), (0, 0)]:
            robot.advance(1.0, speed=0.2).wait(60)
            pose = robot.pose.next()
            while pose.velocity.any():  # the client may be behind the server
                pose = robot.pose.next()
            scan = robot.lrf.next()
            while scan.utime < pose.utime:
                scan = robot.lrf.next()
            assert math.hypot(pose.x - start.x - x, pose.y - start.y - y) < 0.005, (model, pose)
            mount = robot.lrf.position  # in base_link
            heading = pose.heading
            at_x = pose.x + math.cos(heading) * mount[0] - math.sin(heading) * mount[1]
            at_y = pose.y + math.sin(heading) * mount[0] + math.cos(heading) * mount[1]
            wanted = to_the_walls(at_x, at_y, scan.angles + heading)
            in_range = wanted < robot.lrf.range_max
            right = np.abs(scan.ranges[in_range] - wanted[in_range]) < 0.01
            assert right.mean() > 0.97, (model, pose, np.nonzero(~right)[0])
            robot.rotate(math.pi / 2, speed=0.5).wait(60)
        pose = robot.pose.next()
        while pose.rotation_rate.any():
            pose = robot.pose.next()
        assert abs(math.remainder(pose.heading, 2 * math.pi)) < 0.01
