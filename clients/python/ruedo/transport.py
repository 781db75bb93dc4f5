"""What carries messages: the interface, and LCM behind it."""

from __future__ import annotations

import math
import select
import threading
import time
from typing import Any, Protocol
from urllib.parse import urlsplit

import lcm

from .address import check_reachable
from .multicast_transport import MulticastTransport
from .stream_transport import Receiver, StreamTransport


class Transport(Protocol):
    """receive() is called by one thread at a time, the rest by any, also while receive() waits or
    its receiver runs.
    """

    loses_nothing: bool

    @property
    def is_connected(self) -> bool:
        """False: nothing can be sent, since there is no server."""

    def subscribe(self, channel: str) -> None:
        """From the return on, every message of that channel is received."""

    def unsubscribe(self, channel: str) -> None: ...

    def publish(self, channel: str, data: bytes) -> None: ...

    def receive(self, seconds: float, receiver: Receiver) -> bool:
        """Hands over what has come, or waits for it at most so long and returns False."""

    def close(self) -> None:
        """receive() returns soon, and nothing is sent any more."""


def open_transport(url: str) -> Transport:
    """Raises NoServer, with the cure, when nothing can come from that URL."""
    check_reachable(url)
    parts = urlsplit(url)
    if parts.scheme in ("tcpq", "unix"):
        return StreamTransport(parts)
    return MulticastTransport(url) if parts.scheme == "udpm" else LcmTransport(url)


class LcmTransport:
    """What only LCM itself can carry, memq and logs. It forbids most of what Transport promises:

    - Its module runs callbacks from handle() without the interpreter's lock until it has read its
      subscription. Beside that, subscribe() has a subscription called before its fields are set,
      and unsubscribe() frees it: both crash.
    - lcm_unsubscribe() changes the list that a dispatch in another thread walks through.
    - A subscription and its LCM hold each other, out of sight of the garbage collector: an LCM with
      a subscription is never freed, nor is its thread, which goes on receiving.

    So one lock is around every call; what comes is handed over after it was released, waiting is
    done outside, and close() takes every subscription back.
    """

    loses_nothing = False
    is_connected = True

    def __init__(self, url: str):
        self._lcm: lcm.LCM | None = lcm.LCM(url)  # None: closed
        self._lock = threading.Lock()
        self._subscriptions: dict[str, Any] = {}
        self._arrived: list[tuple[str, bytes]] = []
        self._poll: select.poll | None = None

    def subscribe(self, channel: str) -> None:
        escaped = "".join(
            "\\" + c if c in ".^$*+?{}[]\\|()" else c for c in channel
        )  # LCM takes a regex
        with self._lock:
            if self._lcm:
                self._subscriptions[channel] = self._lcm.subscribe(escaped, self._arrive)

    def unsubscribe(self, channel: str) -> None:
        with self._lock:
            if self._lcm:
                self._lcm.unsubscribe(self._subscriptions.pop(channel))

    def publish(self, channel: str, data: bytes) -> None:
        with self._lock:
            if self._lcm:
                self._lcm.publish(channel, data)

    def receive(self, seconds: float, receiver: Receiver) -> bool:
        open_lcm = self._lcm
        if open_lcm is None:
            return False
        try:
            if self._wait(open_lcm, seconds):
                with self._lock:
                    open_lcm.handle_timeout(0)
        except OSError:  # those who wait find out by their timeouts
            time.sleep(min(seconds, 0.1))
        arrived, self._arrived = self._arrived, []
        if arrived:
            receiver(arrived)
        return bool(arrived)

    def close(self) -> None:
        with self._lock:
            if self._lcm:
                for subscription in self._subscriptions.values():
                    self._lcm.unsubscribe(subscription)
            self._subscriptions.clear()
            self._lcm = None  # freed here, or by a receive() that is under way

    def _arrive(self, channel: str, data: bytes) -> None:
        self._arrived.append((channel, data))

    def _wait(self, open_lcm: lcm.LCM, seconds: float) -> bool:
        if self._poll is None:  # not before the first subscription, which makes the socket
            self._poll = select.poll()
            self._poll.register(open_lcm.fileno(), select.POLLIN)
        return bool(self._poll.poll(math.ceil(seconds * 1e3)))
