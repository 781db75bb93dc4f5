"""The LCM side of a client: one LCM instance, one thread that receives, raw bytes to handlers.

The route is checked before the first subscription, because LCM's own self-test blocks for ten seconds
where multicast has no route.
"""

from __future__ import annotations

import math
import os
import socket
import threading
import time
from contextlib import contextmanager
from typing import Callable, Iterator
from urllib.parse import urlsplit

import lcm

from .errors import NoServer

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"
FALLBACK_URL = "tcpq://127.0.0.1:7700"    # what `ruedo run` serves where there is no multicast route

Handler = Callable[[bytes], None]
_LEND_SECONDS = 0.02


def resolve_url(url: str | None) -> str:
    """url, or LCM_DEFAULT_URL, or LCM's default group and port with ttl 0, or TCP where multicast has no route."""
    return url or os.environ.get("LCM_DEFAULT_URL") or (DEFAULT_URL if has_multicast_route() else FALLBACK_URL)


def has_multicast_route(group: str = "239.255.76.67") -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((group, 7667))
        except OSError:
            return False
    return True


def check_reachable(url: str) -> None:
    """Raises NoServer, with the cure, when nothing can come from that URL."""
    parts = urlsplit(url)
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        raise NoServer(f"{url}: the port is not a number from 0 to 65535") from None
    if parts.scheme == "udpm":
        if not has_multicast_route(host or "239.255.76.67"):
            raise NoServer(f"{url}: this machine has no route for multicast. On Linux: "
                           "sudo ip route add 224.0.0.0/4 dev lo; `ruedo doctor` tells more")
    elif parts.scheme == "tcpq":
        try:
            socket.create_connection((host or "127.0.0.1", port or 7700), 2.0).close()
        except OSError as error:
            raise NoServer(f"no Ruedo server at {url} ({error.strerror or error}). Is `ruedo run` started with this "
                           "--lcm? `ruedo doctor` looks for what is wrong") from None
    elif parts.scheme not in ("memq", "file"):
        raise NoServer(f"{url}: not an LCM URL; udpm://GROUP:PORT?ttl=0 or tcpq://HOST:PORT is")


def is_claimed(url: str) -> bool:
    """Whether a server on this machine has the address: its claim goes with its process."""
    parts = urlsplit(url)
    host, port = (parts.hostname, parts.port) if parts.hostname else ("239.255.76.67", 7667) if parts.scheme == "udpm" else ("127.0.0.1", 7700)
    try:
        with open("/proc/net/unix", encoding="ascii", errors="replace") as sockets:
            return any(line.rstrip("\n").endswith(f" @ruedo/{parts.scheme}/{host}:{port}") for line in sockets)
    except OSError:
        return False


class Bus:
    """Safe to use from any thread. Handlers run in the receiving thread, one at a time."""

    def __init__(self, url: str):
        check_reachable(url)
        self.url = url
        self._lcm = lcm.LCM(url)
        self._closed = threading.Event()
        self._handlers: dict[str, list[Handler]] = {}
        self._lock = threading.Lock()
        self._turn = threading.Lock()    # to receive
        self._lent_until = 0.0           # until then the thread leaves it to who has received last
        self._thread = threading.Thread(target=self._receive, name="ruedo-receive", daemon=True)

    def start(self) -> None:
        """Begins to receive. At least one subscription comes first (see the head of this file)."""
        self._thread.start()

    def subscribe(self, channel: str, handler: Handler) -> None:
        with self._lock:
            if channel in self._handlers:
                self._handlers[channel] = self._handlers[channel] + [handler]
                return
            self._handlers[channel] = [handler]
        escaped = "".join("\\" + c if c in ".^$*+?{}[]\\|()" else c for c in channel)    # LCM takes a regex
        self._lcm.subscribe(escaped, self._dispatch)

    def publish(self, channel: str, data: bytes) -> None:
        if not self._closed.is_set():
            self._lcm.publish(channel, data)

    def close(self) -> None:
        self._closed.set()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join()

    def _dispatch(self, channel: str, data: bytes) -> None:
        for handler in self._handlers.get(channel, ()):
            handler(data)

    @contextmanager
    def receiving(self) -> Iterator[Callable[[float], bool]]:
        """The caller receives instead of the thread: calls what it is given, which handles one message, or waits for it
        at most so many seconds and returns False."""
        self._lent_until = math.inf
        with self._turn:
            try:
                yield self._handle
            finally:
                self._lent_until = time.monotonic() + _LEND_SECONDS

    def _handle(self, seconds: float) -> bool:
        try:
            return bool(self._lcm.handle_timeout(math.ceil(seconds * 1e3)))
        except OSError:    # tcpq: the server is gone; those who wait find out by their timeouts
            time.sleep(min(seconds, 0.1))
            return False

    def _receive(self) -> None:
        while not self._closed.is_set():
            with self._turn:
                if time.monotonic() >= self._lent_until:
                    self._handle(0.1)
            lent = self._lent_until - time.monotonic()
            if lent > 0.0:
                self._closed.wait(min(lent, _LEND_SECONDS))
