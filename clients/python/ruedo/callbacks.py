"""Callbacks that can be taken back while other threads call them."""

from __future__ import annotations

import inspect
import logging
import threading
from collections.abc import Callable
from typing import Any

from .arguments import check_callback

log = logging.getLogger("ruedo")

Keep = Callable[[BaseException, str], bool]


def _keep_none(error: BaseException, what: str) -> bool:
    return False


class Subscription:
    """A callback that is called until close(), or the end of a with block. What it raises is
    raised by the next call of its simulation, and does not affect other callbacks."""

    def __init__(
        self,
        callback: Callable[..., Any],
        what: str,
        leave: Callable[[Subscription], None],
        keep: Keep,
    ):
        self._callback, self._what, self._leave = callback, what, leave
        self._keep = keep
        self._failed = False
        self.closed = False

    def close(self) -> None:
        """No call begins after this returns; one in another thread may still be running."""
        if not self.closed:
            self.closed = True
            self._leave(self)

    def __enter__(self) -> Subscription:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Subscription to {self._what}{', closed' if self.closed else ''}>"

    def _call(self, *arguments: Any) -> None:
        if self.closed:
            return
        try:
            made = self._callback(*arguments)
            if inspect.iscoroutine(made) or inspect.isgenerator(made):
                made.close()
                raise TypeError(f"a callback returned {made!r}, which nothing runs")
        except BaseException as error:
            if (
                isinstance(error, KeyboardInterrupt)
                and threading.current_thread() is threading.main_thread()
            ):
                raise  # Ctrl-C, while step() receives for itself
            if not self._keep(error, self._what) and not self._failed:
                self._failed = True
                log.exception(
                    "a callback on %s failed; it stays subscribed (shown once)", self._what
                )


class Callbacks:
    """All callbacks on one thing. Safe to use from any thread.

    what: they are called on, for the log. left: called after one was taken back. keep: takes what
    one raised, with `what`; where it returns False, that is logged, once of each.
    """

    def __init__(self, what: str, left: Callable[[], None] = lambda: None, keep: Keep = _keep_none):
        self._what, self._left, self._keep = what, left, keep
        self._lock = threading.Lock()
        self._all: tuple[Subscription, ...] = ()  # replaced, never changed: call() takes no lock

    def __bool__(self) -> bool:
        return bool(self._all)

    def add(self, callback: Callable[..., Any]) -> Subscription:
        check_callback(callback)
        subscription = Subscription(callback, self._what, self._remove, self._keep)
        with self._lock:
            self._all += (subscription,)
        return subscription

    def call(self, *arguments: Any) -> None:
        for subscription in self._all:
            subscription._call(*arguments)

    def _remove(self, subscription: Subscription) -> None:
        with self._lock:
            self._all = tuple(one for one in self._all if one is not subscription)
        self._left()
