"""A worker's process: python -m ruedo.campaign.worker FD FOLDER. Cases come in by the pipe,
outcomes go out.
"""

from __future__ import annotations

import signal
import sys
import time
from contextlib import suppress
from multiprocessing.connection import Connection

from .case import Runner
from .processes import adopt_orphans, die_with_parent


def work(pipe: Connection, folder: str) -> None:
    die_with_parent()
    for to_driver in (signal.SIGINT, signal.SIGHUP):  # of the terminal
        signal.signal(to_driver, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _end)
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


def _end(*_: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # nothing interrupts what is cleaned up then
    raise KeyboardInterrupt


if __name__ == "__main__":
    with suppress(KeyboardInterrupt):  # told to end
        work(Connection(int(sys.argv[1])), sys.argv[2])
