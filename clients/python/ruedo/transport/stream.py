"""tcpq's frames, over TCP or over a Unix-domain socket to a server on this machine: no other user
reads that, nothing is lost, and it is faster.

All that a server publishes at once comes in one piece, and is taken apart here. LCM's own TCP is
not used: it waits for the rest of a message without end, and takes memory for whatever length a
server names.
"""

from __future__ import annotations

import contextlib
import errno
import math
import os
import select
import socket
import struct
import threading
import time
from collections.abc import Callable

from . import arrivals
from .address import Address

Receiver = Callable[[arrivals.Arrived], None]

_HELLO = struct.pack(">II", 0x287617FB, 0x0100)
_SERVER = struct.pack(">I", 0x287617FA)  # its hello begins with that
_PATIENCE = struct.pack("ll", 5, 0)  # s, us: of connecting and sending, as a timeval
_HEAD = struct.Struct(">II")  # kind, length of the channel's name
_SIZE = struct.Struct(">I")
_CREDENTIALS = struct.Struct("3i")  # process, user, group
_PUBLISH, _SUBSCRIBE, _UNSUBSCRIBE = 1, 2, 3
_CHUNK = 1 << 18  # bytes received at a time


def connect(address: Address) -> socket.socket:
    """Connects to a tcpq or unix address. Raises OSError when no server listens there."""
    local = address.scheme == "unix"
    end = socket.socket(socket.AF_UNIX if local else socket.AF_INET, socket.SOCK_STREAM)
    try:
        # A server that reads nothing blocks no caller for longer.
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, _PATIENCE)
        if local:
            end.connect(address.path)
            _check_peer(end)
        else:
            end.connect((address.host, address.port))
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except BlockingIOError as error:
        end.close()
        raise TimeoutError(errno.ETIMEDOUT, os.strerror(errno.ETIMEDOUT)) from error
    except OSError:
        end.close()
        raise
    return end


def _check_peer(end: socket.socket) -> None:
    """The server is this user's or root's: whoever may write in a folder may serve there."""
    _, user, _ = _CREDENTIALS.unpack(
        end.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    )
    if user not in (os.geteuid(), 0):
        raise PermissionError(errno.EPERM, "it is served by another user")


def is_served(address: Address) -> bool:
    """Also by a server that is stopped."""
    try:
        if address.scheme != "unix":
            connect(address).close()
            return True
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as end:
            end.setblocking(False)
            end.connect(address.path)
            _check_peer(end)
    except BlockingIOError:  # its queue is full
        return True
    except OSError:
        return False
    return True


def is_readable(end: socket.socket) -> bool:
    """Whether data can be read. For any thread: a poll object belongs to one."""
    poll = select.poll()
    try:
        poll.register(end, select.POLLIN)
        return bool(poll.poll(0))
    except (OSError, ValueError):  # it was closed
        return False


class StreamTransport:
    """Connects again when the server comes back."""

    def __init__(self, address: Address):
        """Raises OSError when no server listens there."""
        self.loses_nothing = address.scheme == "unix"
        self.busy = False
        self._address = address
        self._lock = threading.Lock()  # of what is sent, and of the connection
        self._channels: set[str] = set()
        self._names: dict[bytes, str] = {}  # of channels that came
        self._socket: socket.socket | None = None
        self._rest = b""
        self._closed = False
        self._connect()

    @property
    def is_connected(self) -> bool:
        return self._socket is not None

    def subscribe(self, channel: str) -> None:
        with self._lock:
            self._channels.add(channel)
            self._send(_named(_SUBSCRIBE, _pattern(channel)))

    def unsubscribe(self, channel: str) -> None:
        with self._lock:
            self._channels.discard(channel)
            self._send(_named(_UNSUBSCRIBE, _pattern(channel)))

    def publish(self, channel: str, data: bytes) -> None:
        with self._lock:
            if not self._closed:
                self._send(_named(_PUBLISH, channel) + _SIZE.pack(len(data)) + data)

    def has_news(self) -> bool:
        connection = self._socket
        return connection is not None and is_readable(connection)

    def receive(self, seconds: float, receiver: Receiver) -> bool:
        connection = self._socket
        if connection is None:  # waiting threads notice by their timeouts
            time.sleep(min(seconds, 0.1))
            if not self._closed:
                with contextlib.suppress(OSError):
                    self._connect()
            return False
        try:
            if not self._poll.poll(math.ceil(seconds * 1e3)):
                return False
            self.busy = True
            came = connection.recv(_CHUNK)
            arrived = self._taken_apart(came) if came else None
        except OSError:
            arrived = None
        try:
            if arrived:
                receiver(arrived)
        finally:
            self.busy = False
        if arrived is None:
            with self._lock:
                connection.close()
                self._socket = None
        return bool(arrived)

    def close(self) -> None:
        self._closed = True
        connection, self._socket = self._socket, None
        if connection:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)  # the server keeps nothing for it any more
            connection.close()

    def _connect(self) -> None:
        made = connect(self._address)
        with self._lock:
            if self._closed:
                made.close()
                return
            self._socket = made
            self._poll = select.poll()
            self._poll.register(made, select.POLLIN)
            self._rest, self._greeted = b"", False
            self._send(
                _HELLO
                + b"".join(_named(_SUBSCRIBE, _pattern(channel)) for channel in self._channels)
            )

    def _send(self, frames: bytes) -> None:
        connection = self._socket  # close() in another thread takes it away
        if connection is None:
            return
        try:
            connection.sendall(frames)
        except OSError:  # part of a frame may be there: nothing sensible can follow
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)  # receive() notices

    def _taken_apart(self, came: bytes) -> arrivals.Arrived | None:
        """The whole messages; None for what no server of Ruedo's sends."""
        data = self._rest + came if self._rest else came
        at = 0
        if not self._greeted:
            if len(data) < 8:
                self._rest = data
                return []
            if not data.startswith(_SERVER):
                return None
            self._greeted, at = True, 8
        taken = arrivals.take_apart(data, at, self._names)
        if taken is None:
            return None
        arrived, at = taken
        self._rest = data[at:]
        return arrived


def _named(kind: int, name: str) -> bytes:
    encoded = name.encode()
    return _HEAD.pack(kind, len(encoded)) + encoded


def _pattern(channel: str) -> str:
    """Subscriptions are regular expressions."""
    return "".join("\\" + c if c in ".^$*+?{}[]\\|()" else c for c in channel)
