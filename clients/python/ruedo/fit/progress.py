"""A bar on standard error for what takes more than seconds."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from typing import TypeVar

T = TypeVar("T")


def track(steps: Sequence[T], what: str) -> Iterable[T]:
    """The steps, with a bar on a terminal; without a bar where rich is not installed."""
    if not sys.stderr.isatty():
        return steps
    try:
        from rich.console import Console
        from rich.progress import track as shown
    except ImportError:
        return steps
    return shown(steps, what, console=Console(stderr=True), transient=True)
