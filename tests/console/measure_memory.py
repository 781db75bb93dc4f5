"""What an open page holds, minute by minute: RUEDO_BINARY_DIR=build/release .venv/bin/python
tests/console/measure_memory.py [MINUTES [WORLD]] (10, the arena); WORLD may be a number of robots.
Prints a line of JSON a minute. What it says is in docs/console.md.
"""

import sys
import tempfile
from pathlib import Path

from harness import ARENA, browser, running, world_of_robots

minutes = int(sys.argv[1]) if len(sys.argv) > 1 else 10
wanted = sys.argv[2] if len(sys.argv) > 2 else str(ARENA)
with tempfile.TemporaryDirectory() as folder:
    world = world_of_robots(Path(folder), int(wanted)) if wanted.isdigit() else wanted
    with (
        running("--lcm", "memq://", world=world) as process,
        browser(process.url, folder, "memory", {"minutes": minutes}) as page,
    ):
        for line in page.stdout:
            print(line, end="", flush=True)
