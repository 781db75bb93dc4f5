"""The textbook programs of clients/python/examples/textbook, and those of the labs that are such:
what each should show, from the world that it builds, and that none is longer than 80 lines.
"""

import math
import sys

import numpy as np
import pytest
from conftest import SOURCE

EXAMPLES = SOURCE / "clients/python/examples"
sys.path.insert(0, str(EXAMPLES / "textbook"))
PROGRAMS = [*sorted((EXAMPLES / "textbook").glob("*.py"))]
PROGRAMS += [EXAMPLES / "labs" / name for name in ("mapping.py", "wall_following.py")]


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_a_textbook_program_has_at_most_80_lines(program):
    assert len(program.read_text().splitlines()) <= 80


def test_an_arm_picks_up_a_box():
    import arm

    height, off = arm.pick()
    assert height == pytest.approx(0.3, abs=0.02) and off < 0.01  # the fingertips' goal
    with pytest.raises(ValueError, match="out of reach"):
        arm.joints_at(0.9, 0.0, 0.1)


def test_pure_pursuit_follows_a_path():
    import pure_pursuit

    errors = pure_pursuit.follow()
    assert len(errors) > 100 and max(errors) < 0.15 and np.mean(errors) < 0.05


def test_a_dynamic_window_gets_between_pillars():
    import dynamic_window

    away, touched = dynamic_window.drive()
    assert away < 0.3 and touched == set()


def test_an_ekf_bounds_the_error_that_odometry_accumulates():
    import ekf

    errors = ekf.localise()
    assert errors[-100:, 0].max() < 0.15
    assert errors[-1, 1] > 2.0 * errors[-100:, 0].max()


def test_a_follower_keeps_its_gap():
    import leader_follower

    gaps = leader_follower.follow()
    assert gaps[0] > 2.0 and max(abs(gap - leader_follower.GAP) for gap in gaps[-100:]) < 0.1


def test_visual_servoing_brings_the_camera_before_the_beacon():
    import visual_servoing

    away, bearing = visual_servoing.servo()
    assert away == pytest.approx(visual_servoing.DISTANCE, abs=0.1) and abs(bearing) < 0.05


def test_frontiers_explore_a_room_to_its_end():
    import frontiers

    chart, complete = frontiers.explore()
    assert complete
    area = (chart.cells == 0).sum() * frontiers.CELL**2
    assert area == pytest.approx(36.0 - 0.1 * 3.5, rel=0.1)  # m^2: the room without its wall
    assert chart.occupied(2.98, np.linspace(-2.5, 2.5, 40)).mean() > 0.8
    assert math.isinf(chart.ray(-4.5, 0.0, math.pi))


def test_monte_carlo_localisation_finds_the_robot():
    import localisation

    errors = localisation.localise()
    assert errors[0] > 0.3 and max(errors[-10:]) < 0.1


def test_a_patrol_drives_home_before_its_battery_is_empty():
    """Of 20 kJ at 1 kJ/m: at the third post 8 are left, and to the first and home are 9.66 m."""
    import patrol

    visits, least = patrol.patrol()
    posts = patrol.POSTS
    assert [place for place, _ in visits] == [*posts, patrol.HOME, *posts]
    expected = [16.0, 12.0, 8.0, 4.0, 16.0, 12.0, 8.0]
    assert [charge for _, charge in visits] == pytest.approx(expected, abs=0.05)
    assert least == pytest.approx(4.0, abs=0.05)


def test_a_potential_field_leads_between_pillars():
    """The straight way touches the first of them: its edge is 0.15 m off, the robot 0.25."""
    import potential_field

    way, touched = potential_field.drive()
    assert touched == set() and math.dist(way[-1], potential_field.GOAL) < 0.2
    assert max(abs(way[:, 1])) > 0.1
    away = [np.hypot(*(way - place).T).min() for place in potential_field.PILLARS]
    assert min(away) > 0.25 + 0.1
