"""LCM's multicast as a transport, without LCM: its receiver reads outside of a datagram that is
shorter than its head says and ends the program, and it keeps every channel's name that ever came.

    short:    "LC02", sequence, channel and a 0, data
    fragment: "LC03", sequence, size of the message, offset, number, of how many; number 0 has the
              channel and a 0 before its data
"""

from __future__ import annotations

import contextlib
import math
import select
import socket
import struct
import threading
import time
from dataclasses import dataclass, field

from ..errors import NoServer
from . import arrivals
from .address import Address
from .stream import Receiver, is_readable

_SHORT, _FRAGMENT = b"LC02", b"LC03"
_SHORT_HEAD = 8
_HEAD = struct.Struct(">4sIIIHH")
_LONGEST_CHANNEL, _LONGEST_DATAGRAM = 63, 65536
_MOST_IN_DATAGRAM = 64000  # bytes of channel and data that are sent in one
_LONGEST_MESSAGE = 64 << 20  # bytes
_MOST_PARTIAL = 80 << 20  # bytes: memory of messages that are not whole yet
_FRAGMENT_MEMORY = 256  # bytes, beside its data
_MOST_MESSAGES, _MOST_OF_SENDER = 64, 4  # of these
_RECEIVE_BUFFER = 2 << 20  # bytes; the system gives at most its own limit
_MOST_AT_ONCE = 100  # datagrams

_Address = tuple[str, int]


@dataclass
class _Partial:
    """A message that is not whole yet: several threads of a sender's may send at once. It takes the
    memory of what has come, not of what its sender says is to come."""

    size: int
    count: int
    fragments: dict[int, tuple[int, bytes]] = field(default_factory=dict)  # offset and data
    channel: str | None = None  # None: without a subscription, or its fragment has not come
    memory: int = 0

    def joined(self) -> bytes | None:
        """The whole message; None unless the fragments follow each other without a gap."""
        at, pieces = 0, []
        for number in range(self.count):
            offset, data = self.fragments[number]
            if offset != at:
                return None
            at += len(data)
            pieces.append(data)
        return b"".join(pieces) if at == self.size else None


class _Sender:
    """From any thread. What the system does not take is lost, as LCM's own messages are."""

    def __init__(self, address: Address):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        # LCM's own receiver puts together one message of a sender at a time.
        self._lock = threading.Lock()
        self._sequence = 0
        try:
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, address.ttl)
            self._socket.connect((address.host, address.port))
        except OSError:
            self._socket.close()
            raise

    def send(self, channel: str, data: bytes) -> None:
        name = channel.encode() + b"\0"
        with self._lock, contextlib.suppress(OSError):  # of a network that is down, or closed
            sequence = self._sequence & 0xFFFFFFFF
            self._sequence += 1
            if len(name) + len(data) <= _MOST_IN_DATAGRAM:
                self._socket.send(_SHORT + sequence.to_bytes(4, "big") + name + data)
                return
            whole = name + data
            count = -(-len(whole) // _MOST_IN_DATAGRAM)
            for number in range(count):
                piece = whole[number * _MOST_IN_DATAGRAM : (number + 1) * _MOST_IN_DATAGRAM]
                offset = max(0, number * _MOST_IN_DATAGRAM - len(name))
                head = _HEAD.pack(_FRAGMENT, sequence, len(data), offset, number, count)
                self._socket.send(head + piece)

    def close(self) -> None:
        self._socket.close()


class MulticastTransport:
    """LCM's multicast. Waiting messages are in the socket's buffer alone, of all channels
    together.
    """

    loses_nothing = False
    is_connected = True
    busy = False

    def __init__(self, address: Address):
        try:
            self._sender = _Sender(address)
            self._socket = _joined_socket(address)
        except OSError as error:
            raise NoServer(
                f"{address}: it cannot be used ({error}); `ruedo doctor` looks for what is wrong"
            ) from None
        self._closed = False
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)
        self._buffer = bytearray(_LONGEST_DATAGRAM)
        self._view = memoryview(self._buffer)
        self._channels: dict[bytes, str] = {}  # that are listened to
        # Of a sender, and with its number; the newest last.
        self._partials: dict[tuple[_Address, int], _Partial] = {}
        self._partial_memory = 0

    def subscribe(self, channel: str) -> None:
        self._channels[channel.encode()] = channel

    def unsubscribe(self, channel: str) -> None:
        self._channels.pop(channel.encode(), None)

    def publish(self, channel: str, data: bytes) -> None:
        self._sender.send(channel, data)

    def receive(self, seconds: float, receiver: Receiver) -> bool:
        arrived: arrivals.Arrived = []
        deadline = time.monotonic() + seconds
        # A message without a subscription, such as one sent here, does not end the waiting.
        while not arrived and not self._closed:
            left = max(0.0, deadline - time.monotonic())
            if not self._poll.poll(math.ceil(left * 1e3)):
                break
            with contextlib.suppress(OSError):  # there is no more, or it was closed
                self.busy = True
                for _ in range(_MOST_AT_ONCE):
                    self._take(*self._socket.recvfrom_into(self._buffer), arrived)
            if left == 0.0:
                break
        try:
            if arrived:
                receiver(arrived)
        finally:
            self.busy = False
        return bool(arrived)

    def has_news(self) -> bool:
        return is_readable(self._socket)

    def close(self) -> None:
        self._closed = True
        self._sender.close()
        self._socket.close()

    def _take(self, size: int, sender: _Address, arrived: arrivals.Arrived) -> None:
        """A datagram, which is at the beginning of the buffer."""
        if size >= _HEAD.size and self._buffer.startswith(_FRAGMENT):
            self._take_fragment(size, sender, arrived)
        elif size > _SHORT_HEAD and self._buffer.startswith(_SHORT):
            end = self._buffer.find(0, _SHORT_HEAD, size)
            channel = self._channels.get(bytes(self._view[_SHORT_HEAD:end])) if end >= 0 else None
            if channel is not None:
                arrived.append((channel, bytes(self._view[end + 1 : size])))

    def _take_fragment(
        self, datagram_size: int, sender: _Address, arrived: arrivals.Arrived
    ) -> None:
        _, sequence, size, offset, number, count = _HEAD.unpack_from(self._buffer)
        name, data = b"", bytes(self._view[_HEAD.size : datagram_size])
        if number == 0:
            name, end, data = data.partition(b"\0")
            if not end or len(name) > _LONGEST_CHANNEL:
                return
        if number >= count or size > _LONGEST_MESSAGE or offset + len(data) > size:
            return
        key = sender, sequence
        partial = self._partials.get(key)
        if partial is None:
            of_sender = [other for other in self._partials if other[0] == sender]
            if len(of_sender) >= _MOST_OF_SENDER:
                self._drop_partial(of_sender[0])
            if len(self._partials) >= _MOST_MESSAGES:
                self._drop_partial(next(iter(self._partials)))
            partial = self._partials[key] = _Partial(size, count)
        if (size, count) != (partial.size, partial.count) or number in partial.fragments:
            return
        partial.fragments[number] = (offset, data)
        partial.memory += len(data) + _FRAGMENT_MEMORY
        self._partial_memory += len(data) + _FRAGMENT_MEMORY
        if number == 0:
            partial.channel = self._channels.get(name)
        if len(partial.fragments) == count:
            self._drop_partial(key)
            message = partial.joined() if partial.channel is not None else None
            if partial.channel is not None and message is not None:
                arrived.append((partial.channel, message))
        while self._partial_memory > _MOST_PARTIAL:
            self._drop_partial(next(iter(self._partials)))

    def _drop_partial(self, key: tuple[_Address, int]) -> None:
        partial = self._partials.pop(key, None)
        if partial is not None:
            self._partial_memory -= partial.memory


def _joined_socket(address: Address) -> socket.socket:
    """Raises OSError."""
    end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        end.setblocking(False)
        for option in (socket.SO_REUSEADDR, socket.SO_REUSEPORT):
            end.setsockopt(socket.SOL_SOCKET, option, 1)
        buffer = min(max(address.receive_buffer, _RECEIVE_BUFFER), 1 << 30)
        end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
        end.bind((address.host, address.port))
        membership = socket.inet_aton(address.host) + socket.inet_aton("0.0.0.0")
        end.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
    except OSError:
        end.close()
        raise
    return end
