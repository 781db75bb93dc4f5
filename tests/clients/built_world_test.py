"""What ruedo.World() builds beside boxes and walls: it moves as it was said to."""

import math

import pytest
import ruedo


def test_paths_people_doors_and_sensors(tmp_path):
    world = (
        ruedo.World()
        .robot("p3at", -2.0, 0.0, sensors={"gps": "navsat", "second": "imu"})
        .box(0, 3, size=(0.5, 0.5, 0.5), path=[(0, 0, 3), (2, 1, 3), (4, 0, 3)], name="shuttle")
        .door(1, -0.5, 1, 0.5, distance=1.0)
        .person([(0, 5, 5), (10, 5, -5)])
        .people(3, (6, -2, 8, 2), goals=[(7, 0)])
    )
    with ruedo.launch(world, lockstep=1, noise=False, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        names = {device.name for device in robot.devices}
        assert {"gps", "second"} <= names and robot.gps.name == "gps"
        sim.step(200)  # 1 s
        shuttle, door = sim.body("shuttle"), sim.body("door")
        assert shuttle.pose.x == pytest.approx(0.5, abs=1e-6)  # halfway to 1 m
        closed = door.pose
        assert {"people_1", "people_2", "people_3", "person"} <= {
            body.name.partition("/")[0] for body in sim.bodies
        }
        assert sim.body("person").pose.y == pytest.approx(4.0, abs=0.02)  # at 1 m/s
        for _ in range(30):  # 1 m before the door at 2 m of way
            sim.step(40, [robot.velocity_command(0.4, 0.0)])
        sim.step(600)  # the watchdog stops it; the door takes 2 s
        opened = door.pose
        assert math.dist(closed.position, opened.position) > 0.9


def test_errors_are_reported():
    with pytest.raises(ValueError, match="at least two points"):
        ruedo.World().box(0, 0, path=[(0, 0, 0)])
    with pytest.raises(ValueError, match=r"needs \(s, x, y\)"):
        ruedo.World().person([(0, 0), (1, 1)])
    with pytest.raises(ValueError, match="no mass"):
        ruedo.World().box(0, 0, mass=1.0, path=[(0, 0, 0), (1, 1, 1)])
