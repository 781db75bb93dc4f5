"""A worker's process: python -m ruedo.campaign.worker FD FOLDER. Cases come in by the pipe; that
one has begun goes out, and then its outcome, or what is wrong with the machine.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from .case import Runner
from .errors import CampaignError
from .processes import adopt_orphans, die_with_parent


def work(pipe: Connection, folder: str) -> None:
    die_with_parent()
    for to_driver in (signal.SIGINT, signal.SIGHUP):  # of the terminal
        signal.signal(to_driver, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _end)
    adopt_orphans()
    runner = Runner(folder)
    own = set(threading.enumerate())
    while True:
        try:
            case, what, full_log = pipe.recv()
        except (EOFError, OSError):
            return
        pipe.send(case)  # it has begun
        begin = time.monotonic()
        try:
            outcome: dict[str, Any] | CampaignError = runner.run(what, full_log).as_dict()
        except CampaignError as error:
            outcome = error
        pipe.send((case, outcome, time.monotonic() - begin))
        if set(threading.enumerate()) - own:
            _begin_anew()


def _begin_anew() -> None:
    """What a case leaves running in threads, which nothing else can end, ends here: the process
    stays, and so does its pipe.
    """
    os.execv(sys.executable, [sys.executable, "-m", "ruedo.campaign.worker", *sys.argv[1:]])


def _end(*_: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # nothing interrupts what is cleaned up then
    raise KeyboardInterrupt


if __name__ == "__main__":
    with suppress(KeyboardInterrupt):  # told to end
        work(Connection(int(sys.argv[1])), sys.argv[2])
