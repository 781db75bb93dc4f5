"""Limits on what runs beside a campaign, and the ends of what it leaves behind. Linux."""

from __future__ import annotations

import ctypes
import os
import resource
import select
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress

_libc = ctypes.CDLL(None, use_errno=True)
_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36


def die_with_parent() -> None:
    """This process is killed when the thread that started it ends, however that ends."""
    _libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


def adopt_orphans() -> None:
    """Makes this process the parent of orphaned grandchildren, so that it can end them."""
    _libc.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def end_descendants() -> None:
    """Kills all children of this process that are left, and theirs."""
    while True:
        children = _children()
        if not children:
            return
        for child in children:
            with suppress(ProcessLookupError):
                os.kill(child, signal.SIGKILL)
        for child in children:
            with suppress(ChildProcessError):
                os.waitpid(child, 0)


@contextmanager
def forks_end() -> Iterator[None]:
    """A child that is forked within ends with what is called there, not with what follows."""
    process = os.getpid()
    try:
        yield
    finally:
        if os.getpid() != process:
            os._exit(0)


def ends_within(pid: int, seconds: float) -> bool:
    """Waits for a child. Popen.wait() with a timeout looks in intervals of up to 50 ms."""
    descriptor = os.pidfd_open(pid)
    try:
        return bool(select.select([descriptor], [], [], seconds)[0])
    finally:
        os.close(descriptor)


def kill_with_descendants(pid: int) -> None:
    """Kills a process and all that it has started, itself first."""
    family = [pid]
    for one in family:
        family += _children(one)
    for one in family:
        with suppress(ProcessLookupError):
            os.kill(one, signal.SIGKILL)


def _children(pid: int | str = "self") -> list[int]:
    found: list[int] = []
    with suppress(OSError):  # it has ended
        for task in os.listdir(f"/proc/{pid}/task"):
            with suppress(OSError), open(f"/proc/{pid}/task/{task}/children") as stream:
                found += [int(one) for one in stream.read().split()]
    return found


def private_mb() -> int:
    """The private data of this process, MB, as RLIMIT_DATA counts it."""
    with open("/proc/self/status") as stream:
        for line in stream:
            if line.startswith("VmData:"):
                return int(line.split()[1]) // 1024
    return 0


@contextmanager
def limit_memory(more_mb: int) -> Iterator[None]:
    """Limits this process to so many MB more than it has; beyond, MemoryError is raised."""
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = (private_mb() + more_mb) << 20
    if hard != resource.RLIM_INFINITY:
        wanted = min(wanted, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (wanted, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))
