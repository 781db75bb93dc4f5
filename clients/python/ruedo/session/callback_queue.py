"""The thread that runs the user's callbacks, so that receiving never waits for them."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from .stack import place_in_callback

_LONG_SECONDS = 5.0  # for a callback that is waited for
_MOST_WAITING = 1 << 20  # bytes of samples, where the server does not wait for the callbacks
_OVERHEAD = 100  # bytes, of a sample
_runs_for = threading.local()  # .queue: the one whose callback this thread runs, or None
log = logging.getLogger("ruedo")

Call = Callable[[], object]


class CallbackQueue:
    """Runs calls one at a time, in the order in which they came. Safe to use from any thread.

    may_drop: where more than a megabyte of samples waits, the newest of each channel stays; else
    whoever sends waits for the callbacks.
    """

    def __init__(self) -> None:
        self.may_drop = True
        self._waiting: deque[tuple[Any, int, Call]] = deque()  # of what, bytes, call
        self._bytes = 0
        self._news = threading.Condition()
        self._turn = threading.RLock()  # to run them
        self._running = False  # one runs, or is about to
        self._borrowed = 0  # other threads that run them
        self._closed = False
        self._told = False
        self._thread: threading.Thread | None = None

    @property
    def runs_here(self) -> bool:
        """Whether this thread is in one of its calls."""
        return getattr(_runs_for, "queue", None) is self

    @property
    def is_idle(self) -> bool:
        return not self._waiting and not self._running

    def put(self, call: Call, of: Any = None, size: int = 0) -> list[Any]:
        """of: the stream whose sample the call gets; None: it gets no sample, and is never dropped.
        Returns the streams that lost a sample, each as often as it lost one."""
        with self._news:
            if self._closed:
                return []
            cost = size + _OVERHEAD if of is not None else 0
            self._waiting.append((of, cost, call))
            self._bytes += cost
            dropped = self._drop() if self._bytes > _MOST_WAITING and self.may_drop else []
            if self._thread is None:
                self._thread = threading.Thread(
                    target=self._run, name="ruedo-callbacks", daemon=True
                )
                self._thread.start()
            elif not self._borrowed:
                self._news.notify()
            return dropped

    @contextmanager
    def in_this_thread(self) -> Iterator[None]:
        """The caller's thread runs what comes meanwhile, at the end."""
        with self._news:
            self._borrowed += 1
        try:
            yield
        finally:
            try:
                while self._run_one():
                    pass
            finally:
                with self._news:
                    self._borrowed -= 1
                    self._news.notify()

    def stop(self) -> None:
        """Lets no further callback begin."""
        self._closed = True
        with self._news:
            self._news.notify_all()

    def close(self, patience: float | None) -> None:
        """After stop(): returns when what has begun has returned. patience: s of real time for
        that; None for ever. One that takes long is named."""
        thread = self._thread
        if thread is None or patience == 0.0 or self.runs_here:
            return
        thread.join(_LONG_SECONDS if patience is None else patience)
        place = place_in_callback(thread) if thread.is_alive() else ""
        if place:
            log.warning(
                "a callback has not returned for %g s, at %s: %s",
                _LONG_SECONDS if patience is None else patience,
                place,
                "close() waits for it" if patience is None else "the program ends without it",
            )
        if patience is None:
            thread.join()

    def _drop(self) -> list[Any]:
        """Drops superseded calls, with the lock held."""
        seen: set[Any] = set()
        kept: deque[tuple[Any, int, Call]] = deque()
        dropped: list[Any] = []
        for one in reversed(self._waiting):
            of, cost, _ = one
            if of is not None and of in seen:
                self._bytes -= cost
                dropped.append(of)
                continue
            seen.add(of)
            kept.appendleft(one)
        self._waiting = kept
        if dropped and not self._told:
            self._told = True
            log.warning(
                "callbacks are slower than their samples: they get only the newest sample of each channel, and `dropped` of each stream counts the others (shown once)"
            )
        return dropped

    def _run_one(self) -> bool:
        """False: nothing waits."""
        with self._turn:
            with self._news:
                if self._closed or not self._waiting:
                    return False
                _, cost, call = self._waiting.popleft()
                self._bytes -= cost
                self._running = True
            before, _runs_for.queue = getattr(_runs_for, "queue", None), self
            try:
                call()
            finally:
                _runs_for.queue = before
                self._running = False
        return True

    def _run(self) -> None:
        while True:
            with self._news:
                while not self._closed and (not self._waiting or self._borrowed):
                    self._news.wait()
                if self._closed:
                    return
            self._run_one()
