"""A run whose log becomes a rosbag2 bag at its end.

python3 -m ruedo_ros.recorded BAG RUEDO run WORLD ...
"""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
from pathlib import Path


def main() -> int:
    bag, ruedo, *words = sys.argv[1:]
    if Path(bag).exists():
        print(f"the bag {bag} is there already", file=sys.stderr)
        return 2
    asked: list[
        int
    ] = []  # signals, of which the run gets those, too, that came before it was there
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, lambda number, _: asked.append(number))
    with tempfile.TemporaryDirectory(prefix="ruedo-", dir=Path(bag).absolute().parent) as folder:
        log = str(Path(folder, "run.lcm"))
        run = subprocess.Popen([ruedo, *words, "--record", log])
        while (code := ended(run)) is None:
            while asked:
                run.send_signal(asked.pop(0))
        return code or subprocess.run([ruedo, "export", log, "--ros2", bag], check=False).returncode


def ended(run: subprocess.Popen[bytes]) -> int | None:
    """Its exit code, if it ends within a moment."""
    try:
        return run.wait(0.1)
    except subprocess.TimeoutExpired:
        return None


if __name__ == "__main__":
    sys.exit(main())
