"""Domain randomisation: what is drawn, that it has an effect, and that a reset equals a fresh
engine.
"""

import math

import numpy as np
import pytest
import ruedo

ARENA = {"world": "arena", "disable": ["p3at/camera", "p3at/sonar_front", "p3at/sonar_rear"]}
ALL = {
    "p3at.x": "uniform(-3, 3)",
    "p3at.y": "uniform(-3, 3)",
    "p3at.yaw": "uniform(-3.1, 3.1)",
    "p3at.mass": "uniform(0.8, 1.3)",
    "p3at/lrf.lidar.noise.stddev": "log_uniform(0.003, 0.03)",
    "p3at/odometry.track_error": "normal(0, 0.02)",
    "ground_plane.friction": "choice(0.4, 0.7, 1.0)",
    "sun.brightness": "uniform(0.5, 1.5)",
}


def observed(engine):
    return {
        name: engine.observe(name)
        for name in ("lrf.ranges", "pose.pos", "pose.orientation", "odometry.x", "odometry.theta")
    }


# Copies that are drawn, driven and reset, in any order, against those of fresh engines, whose
# copies have never run: 20 engines of 50 copies are 1 000 episodes. 3 s are long enough for many to
# run into walls and boxes.
def test_a_reset_equals_a_fresh_start_over_1000_episodes():
    worlds, rounds, touched = 50, 20, 0
    settings = {"p3at/lrf.lidar.scan.horizontal.samples": 5}
    generator = np.random.default_rng(1)
    options = {**ARENA, "worlds": worlds, "set": settings, "randomize": ALL}
    with ruedo.Engine(**options) as used:
        seen = observed(used)
        for _ in range(rounds):
            first = int(generator.integers(2**31))
            used.step(generator.uniform(-0.8, 0.8, (worlds, 1, 2)), int(generator.integers(1, 400)))
            order = generator.permutation(worlds)  # copy order[i] is as copy i of a fresh engine
            used.reset(order, seed=first)
            with ruedo.Engine(**options, seed=first) as fresh:
                again = observed(fresh)
                commands = generator.uniform(-0.8, 0.8, (worlds, 1, 2))
                mixed = np.empty_like(commands)
                mixed[order] = commands
                for steps in (0, 5, 119, 119, 119, 119, 119):  # a command holds for 120
                    if steps:
                        fresh.step(commands, steps), used.step(mixed, steps)
                    for i, copy in enumerate(order):
                        assert used.drawn(copy) == fresh.drawn(i)
                        assert used.state_hash(copy) == fresh.state_hash(i)
                    for name, array in seen.items():
                        assert np.array_equal(array[order], again[name]), name
                touched += int((fresh.touching() > 0).sum())
    assert touched > 100


def test_drawn_values_follow_their_distribution():
    worlds = 400
    draws = {
        "p3at.yaw": "uniform(-1, 1)",
        "p3at.mass": "log_uniform(0.5, 2)",
        "p3at.friction": "normal(1, 0.1)",
        "ground_plane.friction": "choice(0.25, 0.5)",
    }
    with ruedo.Engine(**ARENA, worlds=worlds, noise=False, randomize=draws) as engine:
        drawn = [engine.drawn(i) for i in range(worlds)]
        orientation = engine.observe("pose.orientation")[:, 0]
    yaw = np.array([one["p3at.yaw"] for one in drawn])
    assert yaw.min() >= -1 and yaw.max() <= 1
    assert yaw.mean() == pytest.approx(0, abs=4 / math.sqrt(3 * worlds))
    assert yaw.var() == pytest.approx(1 / 3, rel=0.2)
    np.testing.assert_allclose(2 * np.arctan2(orientation[:, 3], orientation[:, 0]), yaw, atol=1e-9)
    mass = np.log2([one["p3at.mass"] for one in drawn])
    assert abs(mass).max() <= 1 and mass.mean() == pytest.approx(0, abs=4 / math.sqrt(3 * worlds))
    friction = np.array([one["p3at.friction"] for one in drawn])
    assert friction.mean() == pytest.approx(1, abs=0.02)
    assert friction.std() == pytest.approx(0.1, rel=0.2)
    ground = [one["ground_plane.friction"] for one in drawn]
    assert set(ground) == {0.25, 0.5} and 140 < ground.count(0.25) < 260


# A value depends on its target and its seed alone, not on other draws or their order.
def test_a_draw_depends_on_seed_and_target_alone():
    with (
        ruedo.Engine(**ARENA, seed=9, randomize={"p3at.mass": "uniform(1, 2)"}) as alone,
        ruedo.Engine(
            **ARENA, seed=9, randomize=dict(reversed(ALL.items())) | {"p3at.mass": "uniform(1, 2)"}
        ) as among,
    ):
        assert alone.drawn()["p3at.mass"] == among.drawn()["p3at.mass"]
        assert list(among.drawn()) != []


def test_settings_are_as_with_set():
    with ruedo.Engine(
        **ARENA, seed=3, randomize={"p3at/lrf.lidar.range.max": "uniform(2, 3)"}
    ) as drawn:
        limit = drawn.drawn()["p3at/lrf.lidar.range.max"]
        with ruedo.Engine(
            **ARENA, seed=3, settings={"p3at/lrf.lidar.range.max": repr(limit)}
        ) as told:
            assert np.array_equal(drawn.observe("lrf.ranges"), told.observe("lrf.ranges"))


@pytest.mark.parametrize(
    "draws, text",
    [
        ({"p3at.x": "uniform(1)"}, "it looks like TARGET=uniform(LOW,HIGH)"),
        ({"p3at.x": "uniform(2, 1)"}, "HIGH must not be below LOW"),
        ({"p3at.mass": "log_uniform(0, 1)"}, "LOW must be above 0"),
        ({"p3at.mass": "normal(1, -1)"}, "STDDEV must not be negative"),
        ({"p3at.mass": "normal(-1, 0)"}, "must not be negative"),
        ({"p3at.colour": "uniform(0, 1)"}, "TARGET is MODEL.x"),
        ({"p3at.x": "triangle(0, 1)"}, "it looks like"),
        ({"p3at.x": "uniform(0, nan)"}, "it looks like"),
        ({"p3dx.x": "uniform(0, 1)"}, "there is no model 'p3dx'"),
        ({"moon.brightness": "uniform(0, 1)"}, "there is no light 'moon'"),
        ({"p3at/lrf.no_such": "uniform(0, 1)"}, "there is no 'no_such'"),
        ({"ground_plane.mass": "uniform(1, 2)"}, "no force moves 'ground_plane'"),
        ({"*.mass": "uniform(1, 2)"}, None),
        ({"p3at.x": "choice(500)"}, None),
        (
            {"p3at.x": "choice(0)", "p3at.y": "choice(0)", "p3at.z": "choice(-0.3)"},
            "no place that is free",
        ),
    ],
)
def test_wrong_descriptions_are_refused(draws, text):
    if text is None:
        ruedo.Engine(**ARENA, randomize=draws).close()
        return
    with pytest.raises(ValueError) as caught:
        ruedo.Engine(**ARENA, randomize=draws)
    assert text in str(caught.value)


def test_draws_for_a_person_on_a_path_are_refused():
    world = ruedo.World().person([(0, 1, 1), (5, 2, 1)], name="leader").robot("p3at")
    ways = {
        "leader.x": "the place of 'leader' follows from its path",
        "leader.mass": "no force moves 'leader'",
    }
    for target, text in ways.items():
        with pytest.raises(ruedo.BadWorld, match=text):
            ruedo.Engine(world, randomize={target: "uniform(1, 2)"})


def test_a_pattern_passes_over_what_it_cannot_change():
    world = ruedo.World().box(2, 0, mass=1, name="thing_1").robot("p3at")
    world.person([(0, 1, 1), (5, 2, 1)], name="thing_2")
    for key in ("x", "yaw", "mass"):
        with ruedo.Engine(world, randomize={f"thing*.{key}": "uniform(2, 3)"}) as engine:
            assert list(engine.drawn()) == [f"thing_1.{key}"]


def test_repeated_texts_are_read_once_and_differ():
    from ruedo.rooms import make_room

    rooms = [make_room(i) for i in range(3)]
    with ruedo.Engine("room", text=rooms[0].sdf, worlds=3, noise=False) as engine:
        place = engine.observe("pose.pos")[:, 0, :2]
        for _ in range(2):
            engine.reset(text=[room.sdf for room in rooms])
            np.testing.assert_allclose(place, [room.start[:2] for room in rooms], atol=1e-4)
        before = engine.state_hash(0)
        engine.step([0.2, 0.0], 10, worlds=np.array([False, True, True]))
        assert engine.state_hash(0) == before and [engine.steps(i) for i in range(3)] == [0, 10, 10]
        with pytest.raises(ValueError, match="2 texts for 3 worlds"):
            engine.reset(text=["", ""])
        with pytest.raises(ValueError, match="reset twice"):
            engine.reset([1, 1])
        with pytest.raises(ValueError):
            engine.reset(0, text="<sdf version='1.9'><world/>")
        engine.reset(0, text=rooms[1].sdf)  # a text that was refused leaves nothing behind
        np.testing.assert_allclose(place[0], rooms[1].start[:2], atol=1e-4)
