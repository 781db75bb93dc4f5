"""The labs of clients/python/examples/labs: the results that each should show, from a formula or
from planted values.
"""

import math
import sys
from itertools import pairwise

import numpy as np
import pytest
from conftest import SOURCE

sys.path[:0] = [str(SOURCE / "clients/python/examples/labs" / one) for one in (".", "marking")]

import labs
import mapping
import particle_filter
import sonar_avoidance
import square
import umbmark
import wall_following


# The kinematic drive follows its plan exactly. With a track that it believes to be 2 % wider it
# turns 360 / 1.02 degrees.
def test_a_square_ends_where_it_began_and_its_odometry_elsewhere():
    odometry, pose = square.square(track_error=0.02)
    assert math.hypot(pose.x, pose.y) < 1e-6 and abs(pose.heading) < 1e-6
    assert odometry.theta == pytest.approx(2 * math.pi / 1.02, abs=1e-6)
    assert odometry.heading == pytest.approx(2 * math.pi / 1.02 - 2 * math.pi, abs=1e-6)


def test_a_wall_is_followed_at_its_distance():
    kept = np.array(wall_following.follow(distance=0.8, seconds=40))
    assert len(kept) > 200  # most of the time there is a wall to follow
    assert abs(np.median(kept) - 0.8) < 0.2 and np.percentile(kept, 5) > 0.5


def test_sonars_keep_it_from_what_is_near():
    way, clearance = sonar_avoidance.avoid(seconds=60)
    assert way > 8.0 and clearance > 0.3


# UMBmark finds the planted errors.
@pytest.mark.parametrize("track_error, radius_error", [(0.02, 0.0), (0.0, 0.002)])
def test_umbmark_finds_the_planted_errors(track_error, radius_error):
    track, radius, worst = umbmark.umbmark(track_error, radius_error, runs=1)
    assert track == pytest.approx(track_error, abs=0.003)
    assert radius == pytest.approx(radius_error, abs=0.0003)
    assert worst > 0.1


# The arena's outer walls are 10 m apart: along the axes through its middle the map's outermost
# taken cells are them.
def test_a_map_has_the_walls_where_they_are():
    grid = mapping.explore(seconds=60)
    taken = np.argwhere(grid.log_odds > 1.0) * mapping.CELL - mapping.HALF + mapping.CELL / 2
    assert abs(taken).max() < 5.3
    for axis in (0, 1):
        for sign in (-1, 1):
            assert (abs(sign * taken[:, axis] - 5.0) < 0.2).sum() > 20
    assert (grid.log_odds < -1.0).sum() * mapping.CELL**2 > 40  # m^2 that are free


def test_a_particle_filter_finds_the_robot():
    errors = particle_filter.localise(seconds=20)
    assert errors[0] > 1.0 and max(errors[100:]) < 0.3


# The referee of a class, by ways that are given, ten places a second.
def along(*corners):
    """Straight from one to the next at 0.4 m/s."""
    return np.concatenate(
        [
            np.linspace(a, b, max(2, round(math.dist(a, b) / 0.04)), endpoint=False)
            for a, b in pairwise(corners)
        ]
        + [corners[-1:]]
    )


def around(x, y, radius, turns=1.0, begin=0.0):
    angles = begin + np.linspace(
        0.0, 2 * math.pi * turns, round(2 * math.pi * radius * turns / 0.04)
    )
    return np.stack([x + radius * np.cos(angles), y + radius * np.sin(angles)], axis=1)


def why_not(lab, way):
    run = labs.Run(lab, 1, 0.0, np.asarray(way, dtype=float), np.zeros((0, 3)), "")
    try:
        labs.LABS[lab].judge(run)
    except labs.Failed as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    "way, text",
    [
        (along((0, 0), (2, 0), (2, 2), (0, 2), (0, 0)), ""),
        (along((0, 0), (2.15, 0), (2.15, 2.15), (0, 2.15), (0, 0)), ""),  # too far
        (along((0, 0), (1.9, 0.1), (1.8, 2.0), (-0.1, 1.9), (0.1, 0.1)), ""),  # at wrong angles
        (along((0, 0), (1.7, 0), (2, 0.3), (2, 1.7), (1.7, 2), (0.3, 2), (0, 1.7), (0, 0)), ""),
        (around(1, 1, math.sqrt(2), begin=-0.75 * math.pi), "0.41 m off the straight edge to the "),
        (
            around(1, 1, 1.2, 1.1, begin=-0.8 * math.pi),
            "m off the straight edge to the corner 2, 0",
        ),
        (along((0, 0), (1, -0.3), (2, 0), (2, 2), (0, 2), (0, 0)), "0.30 m off the straight edge"),
        (
            along((0, 0), (0, 2), (2, 2), (2, 0), (0, 0)),
            "m off the straight edge to the corner 2, 0",
        ),
        (along((0, 0), (2, 0), (2, 2), (0, 2)), "was not at the corner 0, 0 in its turn"),
    ],
)
def test_a_square_has_four_straight_edges(way, text):
    said = why_not("square", way)
    assert text in said and bool(text) == bool(said)


INNER = [(-3.15, -2.15), (3.15, -2.15), (3.15, 2.15), (-3.15, 2.15)]


@pytest.mark.parametrize(
    "way, text",
    [
        (along((-2, -1.4), *INNER[:3]), ""),
        (along((2, -1.4), *INNER[1::-1], INNER[3]), ""),  # the other way around
        (along(*INNER, *INNER), ""),
        (along(*((-3 + 0.5 * i, -2.15 + 0.25 * (-1) ** i) for i in range(13)), *INNER[1:3]), ""),
        (around(0, -2.15, 0.2, 12), "went on 0.0 m along the walls"),
        (around(3.0, -2.0, 0.2, 12), "m along the walls"),  # in a corner
        (along(*[(-2, -2.15), (1, -2.15)] * 4), "went on 3.0 m along the walls"),
        (along((-3, -1), (3, -1), (3, 1), (-3, 1)), "m from the wall, not 0.8"),
    ],
)
def test_the_wall_following_lab_judges_programs(way, text):
    said = why_not("wall_following", way)
    assert text in said and bool(text) == bool(said)


@pytest.mark.parametrize(
    "way, text",
    [
        (along((-3, -2), (2, -1), (2.5, 1)), ""),
        (around(0, 0, 0.6, 5), "its farthest places are 1.2 m from each other"),
        (around(0, 0, 1.5, 2), "its farthest places are 3.0 m from each other"),
        (along(*[(0, 0), (1, 0)] * 8), "its farthest places are 1.0 m from each other"),
    ],
)
def test_the_avoidance_lab_judges_programs(way, text):
    said = why_not("sonar_avoidance", way)
    assert text in said and bool(text) == bool(said)


def ending(lab, seed, places):
    """Why robots that end at these places have not passed."""
    ways = dict(zip(labs.LABS[lab].robots, (np.array([place]) for place in places)))
    run = labs.Run(lab, seed, 0.0, ways["p3at"], np.zeros((0, 3)), "", ways)
    try:
        labs.LABS[lab].judge(run)
    except labs.Failed as error:
        return str(error)
    return ""


@pytest.mark.parametrize("lab", ["planning", "many_robots"])
def test_labs_with_goals_judge_where_each_robot_ends(lab):
    goals = np.array(labs.goals(lab, 3))
    assert ending(lab, 3, goals) == ""
    assert ending(lab, 3, goals + (0.2, 0.2)) == ""  # 0.28 m
    away = goals.copy()
    away[-1] += (0.0, 0.5)
    assert ending(lab, 3, away) == f"{labs.LABS[lab].robots[-1]} ends 0.50 m from its goal"
    if len(goals) > 1:
        assert "from its goal" in ending(lab, 3, np.roll(goals, 1, axis=0))


def test_the_vision_lab_judges_the_distance_from_the_red_beacon():
    beacons = {name: np.array(place) for name, place in labs.beacons("vision", 3).items()}
    assert ending("vision", 3, [beacons["red"] + (1.2, 0.0)]) == ""
    assert ending("vision", 3, [beacons["red"] + (1.4, 0.0)]).startswith("ends 1.40 m from")
    assert "from the red beacon" in ending("vision", 3, [beacons["green"] + (0.0, 1.0)])


def test_drawn_worlds_leave_room_for_a_robot():
    """0.36 m is half the diagonal of the P3-AT with its wheels."""
    for seed in range(200):
        x, y, _ = labs.start("planning", seed)
        goal = labs.goals("planning", seed)[0]
        for post in labs.posts("planning", seed):
            assert min(math.dist(post, (x, y)), math.dist(post, goal)) > labs.POST + 0.4
        for a, b in pairwise([(x, y), goal]):
            assert np.linalg.norm(labs.points(labs.walls("planning", seed)) - a, axis=1).min() > 0.5
            assert np.linalg.norm(labs.points(labs.walls("planning", seed)) - b, axis=1).min() > 0.5
        team = np.array(labs.starts_of_team(seed))[:, :2]
        apart = np.linalg.norm(team[:, None] - team, axis=2)[np.triu_indices(4, 1)]
        assert apart.min() > 2.0 and len(set(labs.goals("many_robots", seed))) == 4
        beacons = labs.beacons("vision", seed).values()
        assert all(abs(x) < 3 and abs(y) < 2 for x, y in beacons)
