"""How a program ends whose callbacks raised what nobody has seen, or whose regression run is over.

What a callback raises is kept until a call of its connection raises it. A program that makes no
such call prints it at its end, and has an exit code that is not 0.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import sys
import threading
import traceback
from types import TracebackType
from typing import Any

from ..errors import RuedoError, RunEnded


class CallbackFaults:
    """The exceptions of a connection's callbacks. Safe to use from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._kept: tuple[BaseException, str] | None = None  # with what the callback was on
        self._has_raised = False

    def note(self, error: BaseException, what: str) -> bool:
        """Whether it is kept: False while another one is."""
        if isinstance(error, SystemExit):  # which would end the program as if all were well
            fault = RuedoError(
                f"a callback on {what} raised {error!r}, which ends a program in its main thread alone"
            )
            fault.__cause__, error = error, fault
        with self._lock:
            if self._kept is not None:
                return False
            self._kept = error, what
        _unraised.add(self)
        return True

    def raise_kept(self) -> None:
        """Once."""
        if self._kept is None:  # without the lock: each call of the package comes here
            return
        error, _ = self._take()
        if error is not None:
            self._has_raised = True
            raise error

    def print_kept(self) -> None:
        """Prints the kept error when another exception is on its way. The program still ends with
        an exit code that is not 0, unless a call has raised one of these before."""
        error, what = self._take()
        if error is None:
            return
        print(f"ruedo: a callback on {what} failed:", file=sys.stderr)
        traceback.print_exception(type(error), error, error.__traceback__)
        if not self._has_raised:
            _unraised.add(self)

    def _take(self) -> tuple[BaseException | None, str]:
        with self._lock:
            kept, self._kept = self._kept, None
        _unraised.discard(self)
        return kept or (None, "")


_unraised: set[CallbackFaults] = set()  # changed in one call of the interpreter each


def _is_interactive() -> bool:
    shell = sys.modules.get("IPython")
    return (
        hasattr(sys, "ps1")
        or bool(sys.flags.interactive)
        or (shell is not None and shell.get_ipython() is not None)
    )


def _fail_at_end() -> None:
    """After the connections were closed: atexit calls what was registered last first."""
    unraised = list(_unraised)
    if not unraised:
        return
    for faults in unraised:
        faults.print_kept()
    if _is_interactive():
        return
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):
            stream.flush()
    os._exit(1)  # no other way gives an exit code here


def _end_with_the_run() -> None:
    """From now on an uncaught RunEnded ends the program, or its thread, as if it were done."""
    of_program, of_threads = sys.excepthook, threading.excepthook

    def end_program(
        kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        if issubclass(kind, RunEnded):
            raise SystemExit(0)
        of_program(kind, error, trace)

    def end_thread(arguments: Any) -> None:
        if not issubclass(arguments.exc_type, RunEnded):
            of_threads(arguments)

    sys.excepthook, threading.excepthook = end_program, end_thread


atexit.register(_fail_at_end)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_unraised.clear)  # they are the parent's
if os.environ.get("RUEDO_REGRESS") == "1":
    _end_with_the_run()
