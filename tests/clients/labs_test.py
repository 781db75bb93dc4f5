"""The labs of clients/python/examples/labs: the results that each should show, from a formula or
from planted values.
"""

import math
import sys

import numpy as np
import pytest
from conftest import SOURCE

sys.path.insert(0, str(SOURCE / "clients/python/examples/labs"))

import mapping
import particle_filter
import sonar_avoidance
import square
import umbmark
import wall_following


# The kinematic drive does what it plans. What believes in a track that is 2 % wider turns 360 /
# 1.02 degrees by its own reckoning.
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
