"""How far a program has come in a run that it launched: the server waits for it there.

A run at the highest rate takes a second of sim time in less than a millisecond. A program that
looks at a sensor and then commands would act on a world that has gone on without it. So it tells
its server what it has received, and from which moment on it works with what it knew then.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import stat
import threading
import time
from collections.abc import Callable

_NEVER = 2**63 - 1
# A program that was given a sample and then does something else for so long is not waited for.
_PATIENCE_SECONDS = 0.5
# Stands for the thread that will first ask for something, which may take as long as it likes.
_NOT_YET_KNOWN = 0

Tell = Callable[[str], object]

_FIRST = f"0 0 {_NEVER}\n"  # nothing was received yet
_LEFT = "-1 0 0\n"
_connections = itertools.count()  # of this process, to regressions


class ToRegression:
    """The pipe that reports a launched client's progress to `ruedo regress` (docs/protocol.md)."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._sender = f"{os.getpid()} {next(_connections)}"
        self.tell(_FIRST)

    def tell(self, line: str) -> None:
        """Writes a line; when the pipe is full, a later line replaces it."""
        with contextlib.suppress(OSError):
            os.write(self._descriptor, f"{line[:-1]} {self._sender}\n".encode())

    def close(self) -> None:
        self.tell(_LEFT)


def regression_at(url: str) -> ToRegression | None:
    """The regression that launched this program, if that is its address."""
    try:
        descriptor = int(os.environ["RUEDO_PROGRESS"])
        is_pipe = stat.S_ISFIFO(os.fstat(descriptor).st_mode)
    except (KeyError, ValueError, OSError):
        return None
    return (
        ToRegression(descriptor) if is_pipe and url == os.environ.get("LCM_DEFAULT_URL") else None
    )


class Progress:
    """Safe to use from any thread. Until begin() no server waits for this program."""

    def __init__(self) -> None:
        self._tell: Tell | None = None
        self._lock = threading.Lock()
        self._epoch = 0
        self._received = 0  # us of sim time
        self._uses: dict[
            int, tuple[int, float]
        ] = {}  # by thread: since when, us and s of time.monotonic()
        self._told = ""

    def begin(self, tell: Tell, epoch: int, utime: int) -> None:
        """The program works with what is known at that sim time until its first use(), wait() or
        listen(), however long that takes.

        tell: writes a line to the server, which may be lost; the next one says all that it did.
        """
        self._tell = tell
        with self._lock:
            self._epoch = epoch
            self._uses[_NOT_YET_KNOWN] = utime, time.monotonic()
            self._say()

    @property
    def is_told(self) -> bool:
        return self._tell is not None

    @property
    def in_use(self) -> bool:
        """Whether progress must be reported again soon, since a thread is using a sample."""
        return bool(self._uses)

    def received(self, epoch: int, utime: int) -> None:
        """All that the server sent up to that sim time has come, and callbacks have seen it."""
        if self._tell is None:
            return
        with self._lock:
            if epoch != self._epoch:
                self._epoch = epoch
                self._uses.clear()
            self._received = utime
            self._say()

    def use(self, utime: int, threads: tuple[int, ...] = ()) -> None:
        """The threads, by default the caller's, work with what is known at that sim time."""
        if self._tell is None:
            return
        since = utime, time.monotonic()
        with self._lock:
            self._uses.pop(_NOT_YET_KNOWN, None)
            for thread in threads or (threading.get_ident(),):
                self._uses[thread] = since
            self._say()

    def wait(self) -> None:
        """The caller's thread waits for what the server sends."""
        self._end_uses(_NOT_YET_KNOWN, threading.get_ident())

    def listen(self) -> None:
        """Callbacks get what the server sends."""
        self._end_uses(_NOT_YET_KNOWN)

    def _end_uses(self, *threads: int) -> None:
        if self._tell is None:
            return
        with self._lock:
            ended = [self._uses.pop(thread, None) for thread in threads]
            if any(ended):
                self._say()

    def say(self) -> None:
        """Reports the progress. While a thread computes, the run continues as in real time."""
        with self._lock:
            self._say()

    def _say(self) -> None:
        used = _NEVER
        if self._uses:
            now = time.monotonic()
            for thread, (utime, since) in list(self._uses.items()):
                if thread != _NOT_YET_KNOWN and now - since > _PATIENCE_SECONDS:
                    del self._uses[thread]
                else:
                    used = min(used, utime + int((now - since) * 1e6))
        line = f"{self._epoch} {self._received} {used}\n"
        if line != self._told and self._tell:
            self._told = line
            self._tell(line)
