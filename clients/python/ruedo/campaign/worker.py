"""A worker's process: python -m ruedo.campaign.worker FD FOLDER. Cases come in by the pipe,
outcomes go out.
"""

from __future__ import annotations

import signal
import sys
import time
from multiprocessing.connection import Connection

from .case import Runner
from .processes import adopt_orphans, die_with_parent


def work(pipe: Connection, folder: str) -> None:
    die_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the driver's
    adopt_orphans()
    runner = Runner(folder)
    while True:
        try:
            what = pipe.recv()
        except (EOFError, OSError):
            return
        begin = time.monotonic()
        outcome = runner.run(what)
        pipe.send((outcome.as_dict(), time.monotonic() - begin))


if __name__ == "__main__":
    work(Connection(int(sys.argv[1])), sys.argv[2])
