"""How fast the page draws many robots: RUEDO_BINARY_DIR=build/release .venv/bin/python
tests/console/measure_fleets.py [ROBOTS ...] (100 and 1 000). Prints a line of JSON for each view,
and at the end the frames a second as a share of those of an empty scene, beside the share aimed at.
What it says is in docs/console.md; RUEDO_PAGE=sources takes the page as its sources are now. The
machine should do nothing else.
"""

import json
import sys
import tempfile
from pathlib import Path

from harness import browse, log_of_robots, playing

AIMED_AT = {100: 0.9, 1000: 0.5}  # shares, by the count of robots

shares = {}
for count in [int(each) for each in sys.argv[1:]] or list(AIMED_AT):
    with tempfile.TemporaryDirectory() as folder:
        with playing(log_of_robots(Path(folder), count)) as process:
            print(f"{count} robots", flush=True)
            browse(process.url, folder, "fleet", {"robots": count, "seconds": 5})
            given = {"robots": count, "seconds": 3, "turns": 5}
            said = browse(process.url, folder, "share", given)
            (line,) = [each for each in said if each.startswith("measured: ")]
            shares[count] = json.loads(line.removeprefix("measured: "))
for count, found in shares.items():
    aim = f", aimed at {AIMED_AT[count]}" if count in AIMED_AT else ""
    print(
        f"{count} robots: {found['share']} of an empty scene's frames a second{aim} "
        f"({found['frames_per_s']} and {found['empty_per_s']})"
    )
