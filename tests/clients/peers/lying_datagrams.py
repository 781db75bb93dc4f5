"""A server of LCM's multicast that lies: beside good messages it sends datagrams of every kind."""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator

from fake_server import info, scan


def short(channel: str, data: bytes) -> bytes:
    return b"LC02" + bytes(4) + channel.encode() + b"\0" + data


def fragment(
    sequence: int, size: int, offset: int, number: int, count: int, payload: bytes
) -> bytes:
    return struct.pack(">4sIIIHH", b"LC03", sequence, size, offset, number, count) + payload


def cut() -> list[bytes]:
    """Datagrams that end in their head or in the name of their channel."""
    heads = [short("p3at/LRF", b""), fragment(1, 100, 0, 0, 3, b"p3at/LRF\0")]
    pieces = [head[:size] for head in heads for size in range(len(head))]
    return [*pieces, b"LC02" + bytes(4) + b"A" * 60000, fragment(2, 1000, 0, 0, 3, b"A" * 60000)]


def _address(url: str) -> tuple[str, int]:
    group, port = url.removeprefix("udpm://").split("?")[0].split(":")
    return group, int(port)


class Datagrams:
    """Sends messages as any program on the bus may."""

    def __init__(self, url: str):
        self._to = _address(url)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def __enter__(self) -> Datagrams:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def send(self, channel: str, data: bytes) -> None:
        self._socket.sendto(short(channel, data), self._to)


class LyingDatagrams:
    """Sends good messages 20 times a second, and `lies` again and again from as many senders."""

    def __init__(self, url: str, lies: Callable[[int], list[bytes]], senders: int = 1):
        self._to = _address(url)
        self._lies = lies
        self._sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(senders)]
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._send, daemon=True)

    def __enter__(self) -> LyingDatagrams:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join()
        for one in self._sockets:
            one.close()

    def _send(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as honest:
            for turn, utime in enumerate(_times(self._stopping)):
                if turn % 5 == 0:
                    honest.sendto(short("ruedo/info", info([]).encode()), self._to)
                    honest.sendto(short("p3at/LRF", scan(utime)), self._to)
                for sender in self._sockets:
                    for lie in self._lies(turn):
                        sender.sendto(lie, self._to)


def _times(stopping: threading.Event) -> Iterator[int]:
    start = time.monotonic()
    while not stopping.wait(0.01):
        yield int((time.monotonic() - start) * 1e6)
