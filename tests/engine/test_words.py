"""An Engine and a Simulation share words: a program that uses these runs with either."""

import numpy as np
import pytest
import ruedo

TEXT = (
    "<sdf version='1.9'><world name='w'><include><uri>model://ground_plane</uri></include>"
    "<include><uri>model://p3at</uri></include></world></sdf>"
)


def program(sim, step):
    """step: s of sim time."""
    assert sim.step_size == 0.005
    step(1.0)
    begin = sim.time
    saved = sim.save()
    step(0.5)
    later = sim.time
    sim.restore(saved)
    back = sim.time
    sim.reset(seed=3)
    return begin, later, back, sim.time


def test_a_program_moves_from_one_to_the_other(tmp_path):
    expected = pytest.approx((1.0, 1.5, 1.0, 0.0), abs=1e-9)
    with ruedo.Engine(text=TEXT, disable=["p3at/camera"]) as sim:
        assert program(sim, lambda s: sim.step(n=round(s / sim.step_size))) == expected
    with ruedo.launch(text=TEXT, paused=True, snapshots=tmp_path, disable=["p3at/camera"]) as sim:

        def step(seconds):
            sim.step(n=round(seconds / sim.step_size))
            assert sim.state().step >= 0

        assert program(sim, step) == expected


def test_time_is_a_number_and_that_of_each_copy():
    with ruedo.Engine(text=TEXT, worlds=2, disable=["p3at/camera"]) as engine:
        engine.step(n=20, worlds=np.array([True, False]))
        assert engine.time == pytest.approx(0.1) and engine.time(1) == 0.0
        assert engine.dt == engine.step_size


def test_errors_are_the_same_kinds():
    for make in (ruedo.Engine, ruedo.launch):
        with pytest.raises(ruedo.LaunchError):
            make(text="<sdf version='1.9'><world name='w'><model name='")
    with (
        ruedo.Engine(text=TEXT, disable=["p3at/camera"]) as engine,
        pytest.raises(ruedo.UnknownName, match="lrf"),
    ):
        engine.observe("lfr.ranges")
