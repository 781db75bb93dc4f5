"""What clients draw in a run, as rviz gets it on /markers: kinds and numbers by
visualization_msgs/Marker, read by an independent peer.
"""

from __future__ import annotations

import pytest
import ruedo
from conftest import Peer
from ros_types import MarkerArray
from ruedo import markers
from server import Run, wait_for

LINE_STRIP, CUBE_LIST, SPHERE_LIST, TEXT = 4, 6, 7, 9  # Marker.msg
ADD, DELETE = 0, 2
LCM = "udpm://239.255.76.67:7667?ttl=0"  # of a namespace of its own


@pytest.fixture
def run():
    with Run("--no-noise", "--disable", "p3at/camera", lcm=LCM) as run:
        yield run


class Viewer:
    """What a viewer shows, by namespace and number, as Marker.msg has it."""

    def __init__(self, run: Run, **qos: bool):
        self.reader = Peer(run.domain).reader("/markers", MarkerArray, **qos)
        self.shown: dict = {}
        self.came = 0

    def look(self) -> dict:
        for array in self.reader.take(N=1000):
            if not hasattr(array, "__idl__"):
                continue
            self.came += 1
            for marker in array.markers:
                if marker.action == DELETE:
                    self.shown.pop((marker.ns, marker.id), None)
                else:
                    assert marker.action == ADD
                    self.shown[marker.ns, marker.id] = marker
        return self.shown

    def sees(self, *names: tuple[str, int]) -> dict:
        wait_for(lambda: set(self.look()) == set(names), f"{names}, alone")
        return self.shown


def test_markers_appear_and_are_removed(run):
    viewer = Viewer(run)
    with ruedo.connect(LCM, timeout=60) as sim:
        sim.sleep(0.1)  # markers have the time of the state on which they are drawn

        def draw():
            sim.markers(
                "plan",
                [
                    markers.path([[0, 0], [1, 0], [1, 2]], color=(1, 0.5, 0), width=0.25),
                    markers.text("goal", (1, 2, 0.5), height=0.5),
                    markers.map([[100, 0], [0, 100]], resolution=0.5, place=(-2, -3)),
                ],
            )
            sim.sleep(0.1)
            return viewer.look()

        wait_for(draw, "the first markers")
        sim.markers("me", [markers.points([[1, 0, 0]], size=0.125)], frame="p3at")
        shown = viewer.sees(("plan", 0), ("plan", 1), ("plan", 2), ("me", 0))
        path, text, cells, point = (
            shown[name] for name in (("plan", 0), ("plan", 1), ("plan", 2), ("me", 0))
        )
        assert [m.type for m in (path, text, cells, point)] == [
            LINE_STRIP,
            TEXT,
            CUBE_LIST,
            SPHERE_LIST,
        ]
        assert [m.header.frame_id for m in (path, text, cells, point)] == [
            "world",
            "world",
            "world",
            "base_link",
        ]
        assert [(p.x, p.y, p.z) for p in path.points] == [(0, 0, 0), (1, 0, 0), (1, 2, 0)]
        assert (path.scale.x, path.color.g, path.color.a) == (0.25, 0.5, 1)
        assert (text.text, text.pose.position.y, text.scale.z) == ("goal", 2, 0.5)
        assert (cells.pose.position.x, cells.pose.position.y) == (-2, -3)
        assert [(p.x, p.y) for p in cells.points] == [(0.25, 0.25), (0.75, 0.75)]
        assert [(p.x, p.y, p.z) for p in point.points] == [(1, 0, 0)]
        assert (point.scale.x, point.frame_locked, point.lifetime.sec) == (0.125, True, 0)
        assert path.header.stamp.us > 0
        sim.markers("plan", [markers.points([[5, 5, 0]])])  # in place of all that was there
        shown = viewer.sees(("plan", 0), ("me", 0))
        assert shown["plan", 0].type == SPHERE_LIST
        sim.markers("me")
        viewer.sees(("plan", 0))


@pytest.mark.parametrize("latched", [False, True])
def test_a_later_viewer_gets_the_newest_message_of_each_layer(run, latched):
    first = Viewer(run)
    with ruedo.connect(LCM, timeout=60) as sim:

        def draw():
            for layer, x in (("a", 1), ("b", 2), ("b", 3), ("c", 4)):
                sim.markers(layer, [markers.points([[x, 0, 0]])])
            sim.sleep(0.1)
            return len(first.look()) == 3

        wait_for(draw, "the first viewer's markers")
        sim.markers("c")
        later = Viewer(run, latched=latched)
        shown = later.sees(("a", 0), ("b", 0))
        assert shown["b", 0].points[0].x == 3


def test_of_many_layers_the_newest_are_shown(run):
    """As in the console: 64."""
    viewer = Viewer(run)
    with ruedo.connect(LCM, timeout=60) as sim:

        def draw():
            sim.markers("0", [markers.points([[0, 0, 0]])])
            sim.sleep(0.1)
            return viewer.look()

        wait_for(draw, "the first markers")
        for layer in range(1, 70):
            sim.markers(str(layer), [markers.points([[layer, 0, 0]])])
            sim.sleep(0.02)
        viewer.sees(*((str(layer), 0) for layer in range(6, 70)))


def test_nothing_is_sent_before_somebody_draws(run):
    viewer = Viewer(run)
    with ruedo.connect(LCM, timeout=60) as sim:
        sim.sleep(1)
        assert not viewer.look()
        assert viewer.came == 0
