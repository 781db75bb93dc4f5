"""How long a log takes to open: RUEDO_BINARY_DIR=build/release .venv/bin/python
tests/console/measure_log.py [LOG [TIMES]]; without LOG an hour of the arena without pictures is
recorded first. Prints a line of JSON each time: seconds until the page is served, and from there
until it is drawn and until another moment is, and the processor time of the server (until served;
until the page has been measured). What it says is in docs/console.md.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from harness import ARENA, RUEDO, browser, playing


def processor_s(process):
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


with tempfile.TemporaryDirectory() as folder:
    log = sys.argv[1] if len(sys.argv) > 1 else f"{folder}/hour.lcm"
    if len(sys.argv) == 1:
        run = [RUEDO, "run", ARENA, "--quiet", "--lcm", "memq://", "--disable", "p3at/camera"]
        subprocess.run([*run, "--rate", "max", "--duration", "3600", "--record", log], check=True)
    for _ in range(int(sys.argv[2]) if len(sys.argv) > 2 else 3):
        begin = time.monotonic()
        with playing(log) as process:
            figures = {
                "served": round(time.monotonic() - begin, 3),
                "server_until_served": processor_s(process),
            }
            with browser(process.url, folder, "opening", {"time": 1800}) as page:
                for line in page.stdout:
                    if line.startswith("measured: "):
                        figures |= json.loads(line.removeprefix("measured: "))
                        figures["server"] = processor_s(process)
                    elif line.startswith("error"):
                        print(line, end="")
        print(f"measured: {json.dumps(figures)}", flush=True)
