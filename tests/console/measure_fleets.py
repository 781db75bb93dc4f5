"""How fast the page draws many robots: RUEDO_BINARY_DIR=build/release .venv/bin/python
tests/console/measure_fleets.py [ROBOTS ...] (100 and 1 000). Prints a line of JSON for each view,
and one with the frames a second as a share of those of an empty scene.
What it says is in docs/console.md; RUEDO_PAGE=sources takes the page as its sources are now.
"""

import sys
import tempfile
from pathlib import Path

from harness import browse, log_of_robots, playing

for count in [int(each) for each in sys.argv[1:]] or [100, 1000]:
    with tempfile.TemporaryDirectory() as folder:
        with playing(log_of_robots(Path(folder), count)) as process:
            print(f"{count} robots", flush=True)
            browse(process.url, folder, "fleet", {"robots": count, "seconds": 5})
            browse(process.url, folder, "share", {"robots": count, "seconds": 3, "turns": 5})
