"""ruedo::engine, the engine as a C++ library, makes the Python module's messages; that these are
the server's is tests/run/engine_test.cpp's.
"""

import os
import subprocess
from pathlib import Path

import numpy as np
import ruedo

ARENA = str(Path(os.environ["RUEDO_SOURCE_DIR"]) / "worlds/arena.sdf")


def test_it_makes_the_same_messages():
    done = subprocess.run(
        [os.environ["RUEDO_LIBRARY_PROGRAM"], ARENA], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    expected = []

    def keep(engine):
        expected.extend(
            f"{world} {step} {channel} {data.hex()}"
            for world, step, channel, data in engine.messages()
        )

    with ruedo.Engine(ARENA, worlds=2, seed=7, disable=["p3at/camera"], record=True) as engine:
        engine.step(np.array([[[0.3, 0.0, 0.5]], [[0.1, 0.0, -0.2]]]), 60)
        keep(engine)
        engine.reset([1], seed=99)
        keep(engine)
        engine.step(None, 40)
        keep(engine)
    told = done.stdout.splitlines()
    assert len(told) > 200 and told == expected
