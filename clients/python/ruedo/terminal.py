"""Output of this package's commands; names and reasons may come from elsewhere."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from .errors import for_terminal


def say(text: str) -> None:
    """A line on standard output. Raises OSError, which names that, where it cannot be written."""
    with _named():
        print(for_terminal(text))


def flush() -> None:
    """Flushes the output at the end. Raises OSError likewise."""
    with _named():
        sys.stdout.flush()


@contextmanager
def _named() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        drop(1)
        raise OSError(error.errno, error.strerror, "standard output") from None


def tell(text: str) -> None:
    """A line on standard error. Where that cannot be written, as on a full disk, it is lost, and no
    exit code changes.
    """
    try:
        print(for_terminal(text), file=sys.stderr, flush=True)
    except OSError:
        drop(2)


def drop(descriptor: int) -> None:
    """Discards later output, and the buffered, which is written at the program's end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)
