"""ruedo.Map against SciPy's distances and the geometry of a room."""

import math

import numpy as np
import pytest
import ruedo

CELL = 0.1  # m


@pytest.fixture
def room():
    """8 x 6 m with walls of a cell, about the origin, and a pillar of a cell at 1 m, 1 m."""
    cells = np.zeros((60, 80), np.int8)
    cells[[0, -1], :] = 100
    cells[:, [0, -1]] = 100
    cells[40, 50] = 100
    cells[20:25, 10:15] = -1
    return ruedo.Map(cells, CELL, (-4.0, -3.0, 0.0))


def test_look_up_of_places_one_and_many(room):
    assert room.at(0.0, 0.0) == 0 and room.at(1.05, 1.05) == 100 and room.at(9.0, 0.0) == -1
    assert room.occupied(1.05, 1.05) and not room.occupied(0.0, 0.0) and room.free(0.0, 0.0)
    assert not room.free(-2.9, -0.9) and not room.occupied(-2.9, -0.9)  # unknown
    assert room.at([0.0, 1.05, 9.0], 1.05).tolist() == [0, 100, -1]
    assert room.cell(1.05, 1.05) == (40, 50)
    assert room.place(40, 50) == pytest.approx([1.05, 1.05])


def test_distances_are_those_of_scipy(room):
    from scipy.ndimage import distance_transform_edt

    expected = distance_transform_edt(room.cells != 100) * CELL
    assert room.distance_field() == pytest.approx(expected, abs=1e-9)
    few = ruedo.Map(np.zeros((7, 31), np.int8), CELL, (0.0, 0.0, 0.0))
    assert np.isinf(few.distance_field()).all()


def test_a_map_is_inflated_by_a_robots_radius(room):
    grown = room.inflated(0.25)
    assert grown.at(1.05, 1.25) == 100 and grown.at(1.05, 1.35) == 0
    assert grown.at(-3.75, 0.05) == 100 and grown.at(-3.65, 0.05) == 0
    assert room.at(1.05, 1.25) == 0  # the map itself stays as it was


def test_rays_end_at_the_walls(room):
    angles = np.linspace(-math.pi, math.pi, 721)
    got = room.ray(-0.5, -0.75, angles)
    with np.errstate(divide="ignore"):
        across = np.where(np.cos(angles) > 0, 3.9 + 0.5, 3.9 - 0.5) / np.abs(np.cos(angles))
        along = np.where(np.sin(angles) > 0, 2.9 + 0.75, 2.9 - 0.75) / np.abs(np.sin(angles))
    walls = np.minimum(across, along)
    to_pillar = np.arctan2(1.05 + 0.75, 1.05 + 0.5)
    clear = np.abs(angles - to_pillar) > 0.05
    assert got[clear] == pytest.approx(walls[clear], abs=1e-9)
    ahead = room.ray(-0.5, -0.75, to_pillar)
    assert math.hypot(1.5, 1.75) <= ahead < math.hypot(1.55, 1.8)
    assert room.ray(0.0, 0.0, 0.0, max_range=1.0) == math.inf
    assert room.ray(1.05, 1.05, 0.3) == 0.0
    assert room.ray(-6.0, 0.0, 0.0) == pytest.approx(2.0)  # from outside to the western wall
    assert room.ray(-6.0, 0.0, math.pi) == math.inf


def test_a_turned_map(room):
    turned = ruedo.Map(room.cells, CELL, (1.0, 2.0, math.pi / 2))
    x, y = turned.place(40, 50)
    assert (x, y) == pytest.approx((1.0 - 4.05, 2.0 + 5.05)) and turned.occupied(x, y)
    assert turned.ray(x, y - 1.0, math.pi / 2) == pytest.approx(0.95)


def test_a_map_is_written_and_read_again(room, tmp_path):
    room.save(tmp_path / "room.yaml")
    again = ruedo.load_map(tmp_path / "room.yaml")
    assert (again.cells == room.cells).all() and again.origin == room.origin
    with pytest.raises(ValueError, match=r"ends in \.yaml"):
        room.save(tmp_path / "room.png")


def test_a_plot_of_map_path_and_scan(room):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = room.plot(
        path=[(0, 0), (1, 1)], points=np.zeros((5, 3)), pose=ruedo.Transform.of(0.5, 0.5, 0.1)
    )
    assert len(axes.lines) == 2 and len(axes.collections) == 1


def test_the_name_before_1_0_is_still_there():
    from ruedo.maps import OccupancyMap

    assert OccupancyMap is ruedo.Map is ruedo.load_map.__globals__["Map"]
