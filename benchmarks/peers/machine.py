"""Runs of other programs: the row that each prints, the threads it used, and whether the machine is
free for them. Reads Linux's /proc.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

ALLOWED_BUSY = 0.1  # of the cores' time; more disturbs the rows


def cpu_times(text: str) -> tuple[int, int]:
    """Of /proc/stat: all ticks of all cores since the start of the machine, and the idle ones."""
    user, nice, system, idle, wait, *rest = (int(word) for word in text.split("\n")[0].split()[1:9])
    return user + nice + system + idle + wait + sum(rest), idle + wait


def busy_part(before: str, after: str) -> float:
    """The part of the cores' time that programs took between two texts of /proc/stat."""
    (all_before, idle_before), (all_after, idle_after) = cpu_times(before), cpu_times(after)
    return 1.0 - (idle_after - idle_before) / max(1, all_after - all_before)


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--busy", action="store_true", help="measure although other programs use the cores"
    )


def check_free(allow_busy: bool, stat: Path = Path("/proc/stat"), seconds: float = 2.0) -> None:
    """Prints the load before the run; ends the program if others use the cores."""
    before = stat.read_text()
    time.sleep(seconds)
    busy = busy_part(before, stat.read_text())
    print(
        f"{os.cpu_count()} cores, {100 * busy:.0f} % busy before the run, load average "
        f"{os.getloadavg()[0]:.1f}\n",
        flush=True,
    )
    if busy > ALLOWED_BUSY and not allow_busy:
        raise SystemExit(
            f"other programs use {100 * busy:.0f} % of the cores; allowed: {100 * ALLOWED_BUSY:.0f} %. "
            "Wait, or measure with --busy"
        )


def threads_of(pid: int) -> int:
    """The threads of a process and its descendants; 0 once it has ended."""
    count = 0
    try:
        for task in Path(f"/proc/{pid}/task").iterdir():
            count += 1
            for child in (task / "children").read_text().split():
                count += threads_of(int(child))
    except OSError:
        pass
    return count


def row_of(
    command: list[str], limit_s: float, environment: dict[str, str] | None = None
) -> dict | None:
    """The JSON row that a command prints last, with the most `threads` it had at once; None when it
    fails or takes longer than limit_s.
    """
    title = " ".join(command[:3])
    end = time.monotonic() + limit_s
    threads = 0
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **(environment or {})},
    ) as process:
        while True:
            try:
                output, errors = process.communicate(timeout=0.1)
                break
            except subprocess.TimeoutExpired:
                threads = max(threads, threads_of(process.pid))
                if time.monotonic() > end:
                    process.kill()
                    print(f"  {title}: longer than {limit_s:g} s", file=sys.stderr)
                    return None
    lines = [line for line in output.splitlines() if line.startswith("{")]
    if process.returncode != 0 or not lines:
        print(f"  {title}: {errors.strip()[-400:]}", file=sys.stderr)
        return None
    row: dict = json.loads(lines[-1])
    row["threads"] = threads
    if "cpu_s" in row and "sim_s" in row:
        row["cpu_s_per_sim_s"] = row["cpu_s"] / row["sim_s"]
    return row
