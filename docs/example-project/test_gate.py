"""Regressions by pytest: the fixture ruedo_regression comes with the package ruedo."""

import shlex
import sys

CLIENT = [sys.executable, "through_the_gate.py"]


def test_through_the_gate(ruedo_regression):
    run = ruedo_regression(
        "gate.sdf",
        client=CLIENT,
        lockstep=1,
        seed=7,
        duration=60,
        goal=(4.0, 0.0),
        radius=0.3,
        by=30.0,
        no_contact=True,
        clearance=0.2,
        odometry_error=0.3,
    )
    assert "through" in run.output and run.log.exists()


def test_too_slow_is_too_late(ruedo_regression):
    run = ruedo_regression(
        "gate.sdf",
        client="SPEED=0.1 " + shlex.join(CLIENT),
        lockstep=1,
        seed=7,
        duration=12,
        goal=(4.0, 0.0),
        radius=0.3,
        by=12.0,
        check=False,
    )
    assert not run.passed and "was not within 0.3 m" in run.output
