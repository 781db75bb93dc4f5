"""What an open page and its server hold, minute by minute: RUEDO_BINARY_DIR=build/release
.venv/bin/python tests/console/measure_memory.py [MINUTES [WORLD [OPTION...]]] (10, the arena);
WORLD may be a number of robots, options are `ruedo run`'s. Prints a line of JSON a minute. What it
says is in docs/console.md.

Beside what the page's engine tells (memory.mjs) these are the kernel's figures: pss_mb of all the
browser's processes, in which memory that several of them share counts once, and rss_mb of the
server.
"""

import json
import re
import sys
import tempfile
from pathlib import Path

from harness import ARENA, browser, running, world_of_robots


def family(root):
    """The processes that have come from that one, itself among them."""
    children = {}
    for status in Path("/proc").glob("[0-9]*/status"):
        try:
            parent = re.search(r"^PPid:\t(\d+)", status.read_text(), re.MULTILINE)
        except OSError:  # it has ended meanwhile
            continue
        children.setdefault(int(parent[1]), []).append(int(status.parent.name))
    found = [root]
    for process in found:
        found += children.get(process, [])
    return found


def held_mb(process, what):
    """Pss or Rss; 0 of a process that has ended."""
    try:
        text = Path(f"/proc/{process}/smaps_rollup").read_text()
    except OSError:
        return 0
    return int(re.search(rf"^{what}: *(\d+) kB", text, re.MULTILINE)[1]) / 1000


def by_kind(processes):
    """{kind: megabytes} of the browser's processes: renderer, gpu-process, utility, browser."""
    held = {}
    for process in processes:
        try:
            command = Path(f"/proc/{process}/cmdline").read_text().replace("\0", " ")
        except OSError:
            continue
        if "chrom" not in command:
            continue
        kind = re.search(r"--type=([\w-]+)", command)
        name = kind[1] if kind else "browser"
        held[name] = round(held.get(name, 0) + held_mb(process, "Pss"), 1)
    return held


minutes = int(sys.argv[1]) if len(sys.argv) > 1 else 10
wanted = sys.argv[2] if len(sys.argv) > 2 else str(ARENA)
with tempfile.TemporaryDirectory() as folder:
    world = world_of_robots(Path(folder), int(wanted)) if wanted.isdigit() else wanted
    with (
        running("--lcm", "memq://", *sys.argv[3:], world=world) as process,
        browser(process.url, folder, "memory", {"minutes": minutes}) as page,
    ):
        for line in page.stdout:
            if not line.startswith("measured: "):
                print(line, end="", flush=True)
                continue
            kinds = by_kind(family(page.pid))
            figures = json.loads(line.removeprefix("measured: ")) | {
                "pss_mb": round(sum(kinds.values()), 1),
                "pss_by_kind_mb": kinds,
                "server_rss_mb": round(held_mb(process.pid, "Rss"), 1),
            }
            print(f"measured: {json.dumps(figures)}", flush=True)
