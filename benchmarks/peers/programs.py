"""What the peers that are programs share: whether a path is the right program, and a row from two
of its runs, whose difference is free of start-up and loading.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass

import rooms as bench

ANSWERS_WITHIN_S = 60.0


@dataclass(frozen=True)
class Run:
    sim_s: float  # simulated
    wall_s: float
    cpu_s: float


def version_of(program: str, arguments: list[str], pattern: str) -> str:
    """The group of the pattern in what the program prints. Raises ValueError where it has none."""
    command = [program, *arguments]
    asked = f"`{' '.join(command)}`"
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=ANSWERS_WITHIN_S)
    except subprocess.TimeoutExpired:
        raise ValueError(f"{asked} did not end within {ANSWERS_WITHIN_S:g} s") from None
    except OSError as error:
        raise ValueError(f"{asked} cannot be started: {error.strerror}") from None
    said = re.search(pattern, done.stdout + done.stderr)
    if not said:
        first = next(iter((done.stdout or done.stderr).strip().splitlines()), "nothing")
        raise ValueError(f"{asked} said {first[:100]!r}, not its version")
    return said.group(1)


def cpu_s() -> float:
    """Of the children that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main(
    simulator: str,
    step_s: float,
    run: Callable[[str, bench.Rooms, str, float], Run],
    version: Callable[[str], str],
) -> None:
    """Prints a JSON row. `run(program, rooms, folder, seconds)` runs the program, which ends after
    so many seconds: of sim time, or of wall time where it cannot be given a sim time.
    """
    parser = argparse.ArgumentParser(description=f"{simulator} on Ruedo's benchmark map")
    parser.add_argument("world", help="file written by ruedo bench --write-world")
    parser.add_argument("--program", required=True, help=f"{simulator}'s program")
    parser.add_argument("--duration", type=float, default=5.0, help="seconds (default 5)")
    given = parser.parse_args()
    rooms = bench.load(given.world)
    try:
        name = f"{simulator} {version(given.program)}"
        with tempfile.TemporaryDirectory() as folder:
            short = run(given.program, rooms, folder, 0.2 * given.duration)
            long = run(given.program, rooms, folder, 1.2 * given.duration)
    except ValueError as error:
        raise SystemExit(f"{simulator}: {error}") from None
    sim_s, wall_s = long.sim_s - short.sim_s, long.wall_s - short.wall_s
    if sim_s <= 0.0 or wall_s <= 0.0:
        raise SystemExit(f"{simulator}: a longer run did not simulate more: {short}, {long}")
    row = {
        "simulator": name,
        "robots": len(rooms.starts),
        "step_ms": step_s * 1e3,
        "real_time_factor": sim_s / wall_s,
        "cpu_s_per_sim_s": (long.cpu_s - short.cpu_s) / sim_s,
        "memory_mb": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024,
    }
    print(json.dumps(row))


def timed(command: list[str], folder: str) -> tuple[float, float]:
    """Wall and CPU seconds of a command that ends by itself. Raises ValueError if it fails."""
    began, cpu_began = time.perf_counter(), cpu_s()
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        said = (done.stderr or done.stdout).strip()[-300:]
        raise ValueError(f"`{' '.join(command[:3])}` ended with {done.returncode}: {said}")
    return time.perf_counter() - began, cpu_s() - cpu_began
