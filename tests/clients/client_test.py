"""Each method of the clients, in each language, against the real server: the probes print what they
saw, and the expected numbers are known.
"""

import math
import re

import lcm
import pytest
import ruedo
from conftest import HERE, PATIENCE, probe, ruedo_run
from ruedo import lcmtypes

HALL = str(HERE / "hall.sdf")
WALL = 6.0  # m, the wall's face
LRF_AHEAD = 0.16  # m, where the P3-AT carries its LRF
WHEEL_RADIUS = 0.111  # m


@pytest.fixture(scope="module")
def server():
    """A quiet hall without noise, in real time; tests leave the robot at rest."""
    with ruedo_run("--no-noise", "--disable", "p3at/camera", world=HALL) as server:
        yield server


def test_list(language, server):
    said = probe(language, server.url, "list")
    assert said.words("world") == ["hall", "1", "0.005000"]
    name, drive, watchdog, track = said.words("robot")
    assert (name, drive) == ("p3at", "kinematic") and (float(watchdog), float(track)) == (
        0.6,
        0.394,
    )
    devices = {words[1]: words[2:] for words in (line.split() for line in said.all("device"))}
    assert devices["lrf"][:3] == ["lrf", "planar_lidar_t", "10.000000"]
    assert devices["sonar_front"][:2] == ["sonar", "sonar_t"] and devices["sonar_front"][3:] == [
        "5.000000",
        "8",
    ]
    assert devices["odometry"][:3] == ["odometry", "odometry_t", "50.000000"]
    assert devices["pose"][1] == "pose_t" and devices["motion"][1] == "motion_status_t"
    assert "camera" not in devices
    bodies = {
        name: (static, float(mass))
        for name, static, mass in (line.split() for line in said.all("body"))
    }
    assert bodies["wall/link"] == ("True", 0.0) and bodies["ground_plane/link"] == ("True", 0.0)
    assert bodies["p3at/base_link"][0] == "False"
    assert sum(
        mass for name, (_, mass) in bodies.items() if name.startswith("p3at/")
    ) == pytest.approx(14 + 4 * 1.5)


def test_read(language):
    with ruedo_run("--no-noise", world=HALL) as server:
        said = probe(language, server.url, "read", "p3at")
    rays, first, last, nearest, intensities = said.numbers("scan")
    assert (rays, intensities) == (181, 181)
    assert (first, last) == pytest.approx((-math.pi / 2, math.pi / 2), abs=1e-5)
    assert nearest == pytest.approx(WALL - LRF_AHEAD, abs=1e-4)
    assert said.numbers("sonar") == [8, 5.0, 8, 8]  # the wall is beyond the sonar's 5 m
    assert said.numbers("odometry") == [0.0, 0.0, 0.0, 4]
    assert said.numbers("pose") == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    gap = int(said.one("next"))
    assert gap > 0 and gap % 100000 == 0  # us: a multiple of the LRF's period
    width, height, format, data = said.words("image")
    assert int(width) > 0 and int(height) > 0 and (format, data) == ("jpeg", "True")


def test_velocity_holds_until_stopped(language, server):
    """3 s: five times the watchdog's time. The probe says once it was at its speed for so long."""
    said = probe(language, server.url, "velocity", "p3at", "0.3", "0.5", "3")
    kind, state, v, omega = said.words("status")
    assert (kind, state) == ("velocity", "running") and (float(v), float(omega)) == pytest.approx(
        (0.3, 0.5), abs=1e-6
    )
    moved, turned, time = said.numbers("moved")
    assert time > 2.5  # poses come at 50 Hz
    assert moved == pytest.approx(
        abs(2 * 0.3 / 0.5 * math.sin(0.5 * time / 2)), abs=1e-3
    )  # a chord of a circle of v / omega
    assert math.remainder(turned - 0.5 * time, 2 * math.pi) == pytest.approx(0.0, abs=1e-3)
    assert said.numbers("stopped") == pytest.approx([0.0], abs=1e-9)


def test_wheels(language, server):
    said = probe(language, server.url, "wheels", "p3at", "2", "2", "2")
    kind, state, v, omega = said.words("status")
    assert (kind, state) == ("wheels", "running") and (float(v), float(omega)) == pytest.approx(
        (2 * WHEEL_RADIUS, 0.0), abs=1e-6
    )
    assert said.numbers("stopped") == pytest.approx([0.0], abs=1e-9)


def test_velocity_holds_faster_than_real_time(language):
    """At eight times real time a repetition every 100 ms would come 800 ms of sim time apart, and
    the watchdog stops the robot after 600: the ticks of the server set the pace."""
    with ruedo_run("--rate", "8", "--disable", "p3at/camera", world=HALL) as server:
        said = probe(language, server.url, "velocity", "p3at", "0.0", "0.4", "2")
        assert said.words("status")[:2] == ["velocity", "running"], said.text


def test_primitives(language, server):
    said = probe(language, server.url, "primitives", "p3at")
    for name, moved, turned in (
        ("advance", 0.4, 0.0),
        ("rotate", 0.0, 1.2),
        ("arc", 2 * 0.5 * math.sin(0.8 / 2), 0.8),
    ):
        early, done, state, reason, distance, angle = said.words(name)
        assert (early, done, state, reason) == ("False", "True", "done", "-"), name
        assert (float(distance), float(angle)) == pytest.approx((moved, turned), abs=2e-6), name
    assert said.words("turn_to")[1:4] == ["True", "done", "-"]
    assert said.one("replaced").startswith("MotionError: p3at: advance ended: replaced, ")
    assert said.one("refused").startswith("MotionError: p3at: advance was refused: bad value, ")
    assert said.one("too_long").startswith("Timeout: p3at: advance was not done within 0.3 s (")


def test_primitives_of_two_clients_are_reported_apart(language, server):
    """Of two in a process, and of a program that is started again under its name; four times, for
    numbers that clash in half of all starts.
    """
    said = probe(language, server.url, "apart", "p3at")
    for who in "unnamed", "driver":
        assert said.all(who) == 4 * ["none"]
        first = said.all(f"first_{who}")
        assert len(first) == 4
        assert all(one.startswith("MotionError: p3at: advance ended: replaced, ") for one in first)


def test_collisions_need_no_bumper(language):
    """20 m ahead the wall stands in the way, at 6 m: its name is in what is raised."""
    with ruedo_run("--rate", "8", "--disable", "p3at/camera", world=HALL) as server:
        said = probe(language, server.url, "collisions", "p3at")
    assert said.words("free") == ["0", "-"]
    for what in ("once", "twice"):
        assert said.one(what).startswith(
            "MotionError: p3at: advance ended: blocked by wall/link, "
        ), said.text
        assert said.words(f"{what}_by") == ["wall/link"]
        assert said.words(f"{what}_seen") == ["wall/link", "wall/link"]
    assert said.words("met") == ["wall/link", "wall/link"]
    assert said.words("off") == ["-"]


def test_errors_name_what_exists(language, server):
    said = probe(language, server.url, "errors", "p3at")
    assert said.one("robot") == "UnknownName: there is no robot 'nobody'; there is p3at"
    device = said.one("device")
    assert (
        device.startswith("UnknownName: p3at has no device 'nothing'; it has ")
        and "lrf" in device
        and "sonar_rear" in device
    )
    assert said.one("nan").startswith("ValueError: v is ")
    assert said.one("radius").startswith("ValueError: radius is 0")
    assert said.one("limit").startswith("ValueError: speed is -1")
    assert said.one("spawn").split(":")[0] in ("NotSupported", "RequestError")


def test_a_robot_that_cannot_move_sideways_refuses_the_command(language, server):
    """The part ahead would be lost with it."""
    said = probe(language, server.url, "sideways", "p3at")
    for what in ("command", "velocity"):
        assert re.fullmatch(
            r"NotSupported: vy is 0\.30* m/s, but p3at cannot move sideways: its drive is 'kinematic'",
            said.one(what),
        )
    assert said.one("none") == "none"


def test_a_robot_that_moves_sideways_accepts_the_command(language):
    with ruedo_run("--spawn", "mecanum:m@0,0", world="empty") as server:
        said = probe(language, server.url, "sideways", "m")
    assert [said.one(what) for what in ("command", "velocity", "none")] == 3 * ["none"]


def test_an_impossible_command_is_refused_whole_and_reported_once():
    """The server's part, for any LCM program: a misspelt joint beside a good one, and a speed to
    the side beside one ahead.
    """
    joints, velocity = lcmtypes.joint_command_t(), lcmtypes.velocity_command_t()
    joints.n, joints.name = 2, ["turret_joint", "hand_jiont"]
    joints.mode, joints.value = bytes(2), [0.5, 0.5]
    velocity.vx, velocity.vy = 0.2, 0.1
    with ruedo_run("--spawn", "carrier:c@0,0", world="empty") as server:
        with ruedo.connect(server.url, timeout=PATIENCE) as sim:
            robot, refused = sim.robot("c"), []
            robot.motion.on_sample(
                lambda status: status.state == "refused" and refused.append(status.kind)
            )
            bus = lcm.LCM(server.url)
            while not (refused.count("none") >= 2 and refused.count("velocity") >= 2):
                bus.publish("c/joint_command", joints.encode())
                bus.publish("c/velocity", velocity.encode())
                sim.sleep(0.1)
            seen = robot.joints.latest(PATIENCE)
            turret = seen.positions[list(seen.names).index("turret_joint")]
            assert abs(turret) < 1e-3 and abs(robot.pose.latest(PATIENCE).x) < 1e-3
        said = [line for line in server.end().splitlines() if "a command was refused" in line]
    assert len(said) == 2 and all(line.endswith("(shown once)") for line in said), said
    assert any("c has no joint 'hand_jiont' that takes commands; it has turr" in s for s in said)
    assert any("vy is 0.1 m/s, but c cannot move sideways" in line for line in said)


def test_markers_are_drawn_and_logged(language, tmp_path):
    """Each library sends the same; what the server would refuse is said at once."""
    log = tmp_path / "run.lcm"
    with ruedo_run("--disable", "p3at/camera", "--record", log, world=HALL) as server:
        said = probe(language, server.url, "markers", "p3at")
    for what in ("lines", "size", "color", "cells", "layer", "large"):
        assert said.one(what).startswith("ValueError: "), what
    drawn = []
    for event in lcm.EventLog(str(log)):
        if event.channel == "ruedo/applied":
            applied = lcmtypes.applied_t.decode(event.data)
            if applied.channel == "ruedo/markers":
                drawn.append(lcmtypes.markers_t.decode(applied.data))
    assert [(each.layer, each.frame, each.n) for each in drawn] == [
        ("plan", "p3at", 5),
        ("gone", "", 0),
    ]
    lines, path, points, text, grid = drawn[0].markers
    kinds = lcmtypes.marker_t
    assert (lines.kind, lines.points) == (kinds.LINES, [(0, 0, 0), (1, 0, 0)])
    assert (path.kind, path.points) == (kinds.PATH, [(0, 0, 0), (1, 0, 0), (1, 2, 0)])
    assert (points.kind, points.points) == (kinds.POINTS, [(0, 0, 1)])
    assert (text.kind, text.text, text.position) == (kinds.TEXT, "goal", (1, 2, 0.5))
    assert (grid.kind, grid.columns, bytes(grid.cells)) == (kinds.MAP, 2, bytes([0, 100, 255, 50]))
    assert grid.position == (1, 1, 0) and grid.size == pytest.approx(0.5)
    half = math.sqrt(0.5)  # of a quarter turn about z
    assert grid.orientation == pytest.approx((half, 0, 0, half))
    for marker in drawn[0].markers:
        assert marker.color == pytest.approx((1, 0, 0, 0.5))
    assert [m.size for m in drawn[0].markers] == pytest.approx([0.02, 0.02, 0.1, 0.3, 0.5])


def test_control(language):
    with ruedo_run("--disable", "p3at/camera", world=HALL) as server:
        said = probe(language, server.url, "control", "p3at")
        assert said.words("paused") == ["True", "True"]
        assert said.words("step") == ["7"]
        assert said.words("name")[0] == "p3at" and abs(float(said.words("name")[1])) < 1e-3
        assert said.numbers("rate") == [2.0]
        assert said.words("reset") == ["0"]
        assert said.one("unknown").startswith("RequestError: GET_STATE: ")
        assert said.one("steps").startswith("RequestError: STEP: ")
        assert probe(language, server.url, "quit").words("quit") == ["True"]
        assert server.process.wait(PATIENCE) == 0


def test_paused_simulation_is_joined(language):
    with ruedo_run("--paused", "--disable", "p3at/camera", world=HALL) as server:
        assert probe(language, server.url, "list").words("world")[0] == "hall"


def test_sleep_lasts_its_time_after_a_join_or_a_restore(language, tmp_path):
    """The client's clock stood at 0 until the first tick, which then counted as slept."""
    options = ("--disable", "p3at/camera", "--snapshots", str(tmp_path))
    with ruedo_run(*options, world=HALL) as server:
        with ruedo.connect(server.url, timeout=PATIENCE) as sim:
            sim.sleep(2.0)
        said = probe(language, server.url, "sleeps", "0.3")
    for what in "slept", "slept_again":
        begin, slept = map(float, said.words(what))
        assert begin > 1.9 and slept >= 0.3, (what, begin, slept)


def test_a_slow_simulation_is_joined_as_fast(language):
    """ruedo/info comes once a second of sim time, which is 100 s here, longer than the probe waits:
    a client asks for it.
    """
    with ruedo_run("--rate", "0.01", "--disable", "p3at/camera", world=HALL) as server:
        assert probe(language, server.url, "list").words("world")[0] == "hall"
