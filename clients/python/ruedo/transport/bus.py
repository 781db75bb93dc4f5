"""The messages of a client: one thread that receives, raw bytes to handlers."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from ..callbacks import Callbacks, Subscription
from ..errors import RuedoError
from . import arrivals
from .transport import Transport

Handler = Callable[[bytes], None]
_LEND_SECONDS = 0.02
_CATCH_UP_SECONDS, _LOOK_SECONDS = 0.05, 0.0002
_TURN_SECONDS = 0.1
_LARGEST = 4 << 20  # bytes of a message: what a server takes from a client
_receives_for = threading.local()  # .bus: the one that this thread receives for, or None


def _nothing(arrived: arrivals.Arrived) -> None:
    pass


def _as_usual() -> float:
    return _TURN_SECONDS


class Bus:
    """Safe to use from any thread. Handlers run in the receiving thread, one at a time."""

    def __init__(self, transport: Transport):
        self._transport = transport
        self.loses_nothing = transport.loses_nothing
        self._closed = threading.Event()
        self._handlers: dict[str, Callbacks] = {}
        self._collectors: dict[str, Callable[[tuple[str, bytes]], object]] = {}
        # Told first of what came at once; for a client that collects.
        self.on_arrived: Callable[[arrivals.Arrived], object] = _nothing
        # The receiving thread calls this before it waits; returns the longest time to wait, s.
        self.before_turn: Callable[[], float] = _as_usual
        self._lock = threading.Lock()
        self._turn = threading.Lock()  # to receive
        self._lent_until = (
            0.0  # until then the thread leaves receiving to the last caller of receiving()
        )
        self._thread = threading.Thread(target=self._receive, name="ruedo-receive", daemon=True)

    def start(self) -> None:
        """Begins to receive."""
        self._thread.start()

    def subscribe(self, channel: str, handler: Handler) -> Subscription:
        with self._lock:
            handlers = self._handlers.get(channel)
            if handlers is not None:
                return handlers.add(handler)
            handlers = self._handlers[channel] = Callbacks(channel, partial(self._left, channel))
            subscription = handlers.add(handler)
            if channel not in self._collectors:
                self._transport.subscribe(channel)
            return subscription

    def collect(self, channel: str, collector: Callable[[tuple[str, bytes]], object]) -> None:
        """Every message of the channel also goes to a collector, with its channel. There is at most
        one, and it must not raise. For a client that takes every message."""
        with self._lock:
            others = channel in self._handlers or channel in self._collectors
            self._collectors[channel] = collector
            if not others:
                self._transport.subscribe(channel)

    def collect_no_more(self, channel: str) -> None:
        with self._lock:
            if self._collectors.pop(channel, None) and channel not in self._handlers:
                self._transport.unsubscribe(channel)

    @property
    def handling(self) -> bool:
        """Whether this thread is in a handler of it."""
        return getattr(_receives_for, "bus", None) is self

    @property
    def is_connected(self) -> bool:
        """False while published messages have no receiver."""
        return self._transport.is_connected

    @staticmethod
    def check_size(channel: str, size: int) -> None:
        """Raises RuedoError for a message that no server would take."""
        if size > _LARGEST:
            raise RuedoError(
                f"a message of {size} bytes on {channel}: a server takes {_LARGEST} bytes at most"
            )

    def publish(self, channel: str, data: bytes) -> None:
        self.check_size(channel, len(data))
        if not self._closed.is_set():
            self._transport.publish(channel, data)

    def close(self, patient: bool = True) -> None:
        """patient: it returns when nothing is received any more."""
        self._closed.set()
        self._transport.close()
        if patient and not self.handling and self._thread.is_alive():
            self._thread.join()

    def catch_up(self) -> None:
        """Returns when what waits now was handled, or after a moment: more may come all the
        time."""
        if self.handling:
            return
        deadline = time.monotonic() + _CATCH_UP_SECONDS
        # News first: once the receiving thread has taken it, that thread is busy.
        while (self._transport.has_news() or self._transport.busy) and not self._closed.is_set():
            if time.monotonic() >= deadline:
                break
            time.sleep(_LOOK_SECONDS)

    def _left(self, channel: str) -> None:
        """A handler of the channel was taken back."""
        with self._lock:
            handlers = self._handlers.get(channel)
            if handlers is None or handlers:
                return
            del self._handlers[channel]
            if channel not in self._collectors:
                self._transport.unsubscribe(channel)

    def _dispatch(self, arrived: arrivals.Arrived) -> None:
        self.on_arrived(arrived)
        arrivals.dispatch(arrived, self._collectors, self._handlers, Callbacks.call)

    @contextmanager
    def receiving(self) -> Iterator[Callable[[float], bool]]:
        """Lets the caller receive instead of the thread: what is given to it handles the messages
        that came, or waits at most that many seconds for one and returns False."""
        self._lent_until = math.inf
        with self._turn:
            try:
                yield self._handle
            finally:
                self._lent_until = time.monotonic() + _LEND_SECONDS

    def _handle(self, seconds: float) -> bool:
        before = getattr(_receives_for, "bus", None)
        _receives_for.bus = self
        try:
            return self._transport.receive(seconds, self._dispatch)
        finally:
            _receives_for.bus = before

    def _receive(self) -> None:
        while not self._closed.is_set():
            with self._turn:
                if time.monotonic() >= self._lent_until:
                    self._handle(self.before_turn())
            lent = self._lent_until - time.monotonic()
            if lent > 0.0:
                self._closed.wait(min(lent, _LEND_SECONDS))
