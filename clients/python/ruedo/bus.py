"""The messages of a client: one thread that receives, raw bytes to handlers."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from . import arrivals
from .callbacks import Callbacks, Subscription
from .errors import RuedoError
from .stack import place_in_callback
from .transport import Transport

Handler = Callable[[bytes], None]
_LEND_SECONDS = 0.02
_LONG_SECONDS = 5.0  # for a handler that is waited for
_LARGEST = 4 << 20  # bytes of a message: what a server takes from a client
_receives_for = threading.local()  # .bus: the one that this thread receives for, or None
log = logging.getLogger("ruedo")


def _nothing(arrived: arrivals.Arrived) -> None:
    pass


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
        """Whether this thread is in a handler of it: while that lasts, nothing is received."""
        return getattr(_receives_for, "bus", None) is self

    @property
    def is_connected(self) -> bool:
        """False: what is published now reaches nobody."""
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

    def close(self, patience: float | None = None) -> None:
        """patience: s of real time for the handler that runs to return; None for ever. One that
        takes long is named."""
        self._closed.set()
        self._transport.close()
        if patience == 0.0 or not self._thread.is_alive():
            return
        self._thread.join(_LONG_SECONDS if patience is None else patience)
        place = place_in_callback(self._thread) if self._thread.is_alive() else ""
        if place:
            log.warning(
                "a callback has not returned for %g s, at %s: %s",
                _LONG_SECONDS if patience is None else patience,
                place,
                "close() waits for it" if patience is None else "the program ends without it",
            )
        if patience is None:
            self._thread.join()

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
                    self._handle(0.1)
            lent = self._lent_until - time.monotonic()
            if lent > 0.0:
                self._closed.wait(min(lent, _LEND_SECONDS))
