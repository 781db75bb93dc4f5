"""Whether a thread is in a call of this package, or in a callback of its user's."""

from __future__ import annotations

import inspect
import sys
import threading
from types import FrameType

_PACKAGE = __name__.partition(".")[0]


def _is_ours(frame: FrameType) -> bool:
    return bool(frame.f_globals.get("__name__", "").partition(".")[0] == _PACKAGE)


def is_in_another_call() -> bool:
    """Whether another call of this package is under way in this thread: it was
    interrupted, or it calls back."""
    outside, frame = False, inspect.currentframe()
    while frame is not None:
        if not _is_ours(frame):
            outside = True
        elif outside:
            return True
        frame = frame.f_back
    return False


def place_in_callback(thread: threading.Thread) -> str:
    """FILE:LINE of what this package calls back there; "" where it is in none."""
    place, inner, frame = "", None, sys._current_frames().get(thread.ident or 0)
    while frame is not None:
        if inner and _is_ours(frame) and not _is_ours(inner):
            place = f"{inner.f_code.co_filename}:{inner.f_lineno}"
        inner, frame = frame, frame.f_back
    return place
