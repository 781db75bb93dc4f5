"""What the benchmarks of environments share: options, timing, the row that is printed."""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import resource
import time
from collections.abc import Callable

import rooms as bench

DECISION_S = 0.1
CORES = multiprocessing.cpu_count()


def options(simulator: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=f"{simulator}: environment steps a second")
    parser.add_argument("world", help="file written by ruedo bench --write-world")
    parser.add_argument("--envs", type=int, default=256)
    parser.add_argument("--beams", type=int, default=181)
    parser.add_argument("--seconds", type=float, default=5.0)
    return parser.parse_args()


def angles(beams: int) -> list[float]:
    """From the robot's x axis, over 180 degrees, rad."""
    return [math.radians(-90 + 180 * i / (beams - 1)) for i in range(beams)]


def rate(step: Callable[[], int], seconds: float) -> float:
    """Environment steps a second; step() advances each environment by one and returns how many
    there are."""
    step()
    done, begin = 0, time.perf_counter()
    while time.perf_counter() - begin < seconds:
        done += step()
    return done / (time.perf_counter() - begin)


def memory_mb() -> float:
    kinds = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    return sum(resource.getrusage(kind).ru_maxrss for kind in kinds) / 1024


def show(simulator: str, envs: int, beams: int, steps_per_s: float) -> None:
    row = {"simulator": simulator, "envs": envs, "beams": beams}
    print(json.dumps({**row, "steps_per_s": steps_per_s, "memory_mb": memory_mb()}))


def in_processes(
    make: Callable[[bench.Rooms, int, int], Callable[[], int]], given: argparse.Namespace
) -> float:
    """The sum over one process per core, each with its share of the environments."""
    parts = [given.envs // CORES + (i < given.envs % CORES) for i in range(CORES)]
    parts = [part for part in parts if part]
    with multiprocessing.Pool(len(parts)) as pool:
        rates = pool.starmap(
            _rate_of, [(make, given.world, part, given.beams, given.seconds) for part in parts]
        )
    return sum(rates)


def _rate_of(make, world: str, envs: int, beams: int, seconds: float) -> float:
    return rate(make(bench.load(world), envs, beams), seconds)
