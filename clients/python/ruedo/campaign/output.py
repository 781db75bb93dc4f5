"""A case's output: a file of bounded size, which keeps the end."""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

_TAIL = 4000  # bytes that are kept
_MOST_BYTES = 1 << 20  # that the file takes of the disk, about
_LOOK_S = 0.02  # between looks at its size
_KEEP_SIZE, _PUNCH_HOLE = 1, 2
_LEFT_OUT = f"(it printed more than {_MOST_BYTES >> 20} MB; this is the end)\n"

_fallocate = ctypes.CDLL(None, use_errno=True).fallocate
_fallocate.argtypes = [ctypes.c_int, ctypes.c_int, ctypes.c_longlong, ctypes.c_longlong]


class Output:
    """The output of a case. What lies before the end of a large file is freed where it stands, so
    that nothing is lost of what is printed meanwhile. A file system that cannot do that, as FAT,
    lets the file begin anew.
    """

    def __init__(self, path: str) -> None:
        flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC
        self.descriptor = os.open(path, flags, 0o600)
        self._before = b""  # the end of what was dropped
        self._is_long = False
        self._over = threading.Event()
        self._watch = threading.Thread(target=self._bound, daemon=True)
        self._watch.start()

    def text(self) -> str:
        """The end of what was printed so far."""
        end = (self._before + self._last())[-_TAIL:].decode(errors="replace")
        # A short output is complete before the next look at the file.
        return (_LEFT_OUT if self._is_long or self._size() > _MOST_BYTES else "") + end

    def close(self) -> None:
        self._over.set()
        self._watch.join()
        os.close(self.descriptor)

    def _bound(self) -> None:
        while not self._over.wait(_LOOK_S):
            with suppress(MemoryError):  # of the controller's limit
                file = os.fstat(self.descriptor)
                if min(file.st_size, file.st_blocks * 512) > _MOST_BYTES:
                    self._is_long = True
                    self._free()

    def _free(self) -> None:
        how = _KEEP_SIZE | _PUNCH_HOLE
        if _fallocate(self.descriptor, how, 0, self._size() - _TAIL) != 0:
            self._before = self._last()
            os.ftruncate(self.descriptor, 0)

    def _size(self) -> int:
        return os.fstat(self.descriptor).st_size

    def _last(self) -> bytes:
        return os.pread(self.descriptor, _TAIL, max(0, self._size() - _TAIL))


@contextmanager
def captured(output: Output) -> Iterator[None]:
    """Redirects all output there, of Python and of libraries."""
    streams = sys.stdout, sys.stderr
    _flush(*streams)
    kept = os.dup(1), os.dup(2)
    for number in (1, 2):
        os.dup2(output.descriptor, number)
    ours = tuple(open(n, "w", errors="backslashreplace", closefd=False) for n in (1, 2))
    sys.stdout, sys.stderr = ours
    try:
        yield
    finally:
        _flush(sys.stdout, sys.stderr, *ours)
        sys.stdout, sys.stderr = streams
        for number, copy in enumerate(kept, 1):
            os.dup2(copy, number)
            os.close(copy)


def _flush(*streams: object) -> None:
    for stream in streams:
        with suppress(AttributeError, OSError, ValueError):  # None, full, closed
            stream.flush()  # type: ignore[attr-defined]
