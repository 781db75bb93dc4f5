"""A server of tcpq frames that lies, over TCP or a Unix-domain socket, in a thread of a test."""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
from collections.abc import Callable, Iterable

from ruedo import lcmtypes

HELLO = struct.pack(">II", 0x287617FA, 0x0100)
_MOST_STEPS = 1024


def frame(channel: str, data: bytes, size: int | None = None) -> bytes:
    """size: what the frame says of its length."""
    name = channel.encode()
    return (
        struct.pack(">II", 1, len(name))
        + name
        + struct.pack(">I", len(data) if size is None else size)
        + data
    )


def _tick(step: int, nparts: int) -> bytes:
    tick = lcmtypes.tick_t()
    tick.utime, tick.run_id, tick.step, tick.nparts = 50000 + step, 7, step, nparts
    return tick.encode()


def _answer(request) -> bytes:
    """To JOIN, GRANT and GET_STATE."""
    reply = lcmtypes.reply_t()
    reply.run_id, reply.session, reply.sequence = 7, 5, request.sequence
    reply.epoch, reply.kind, reply.code = 0, request.kind, reply.OK
    bodies = {request.GRANT: lcmtypes.grant_reply_t, request.GET_STATE: lcmtypes.state_reply_t}
    if request.kind in bodies:
        reply.body = bodies[request.kind]().encode()
        reply.size = len(reply.body)
    return frame("ruedo/reply", reply.encode())


def grants_and_huge_ticks(request) -> Iterable[bytes]:
    """Answers JOIN and GRANT, then sends a part of each of a thousand ticks of 32767 parts."""
    yield _answer(request)
    if request.kind == request.GRANT:
        for step in range(1, _MOST_STEPS):
            yield frame("ruedo/tick", _tick(step, 32767))


def grants_and_ever_new_infos(info: lcmtypes.world_info_t) -> Callable[..., Iterable[bytes]]:
    """Answers JOIN and GRANT, then sends 200 MB of infos whose channels have other names each."""
    changing = [lcmtypes.channel_info_t() for _ in range(100)]
    known = list(info.channels)

    def of(utime: int) -> bytes:
        info.utime = utime
        for number, channel in enumerate(changing):
            channel.name = f"{utime}/{number}/" + "x" * 1000
        info.channels = known + changing
        info.nchannels = len(info.channels)
        return frame("ruedo/info", info.encode())

    def answer(request) -> Iterable[bytes]:
        yield _answer(request)
        if request.kind == request.GRANT:
            for number in range(1700):
                yield of(100_000 + number)

    return answer


class LyingStream:
    """Sends `sent` to everybody who connects, and what `answer` makes of each request, `moved` of
    each primitive; reads nothing where `answer` is None, and never closes.
    """

    def __init__(
        self,
        url: str,
        sent: bytes,
        answer: Callable[[lcmtypes.request_t], Iterable[bytes]] | None = None,
        moved: Callable[[lcmtypes.move_command_t], Iterable[bytes]] = lambda move: [],
    ):
        self.url, self._sent, self._answer, self._moved = url, sent, answer, moved
        scheme, _, where = url.partition("://")
        if scheme == "unix":
            self._listening = socket.socket(socket.AF_UNIX)
            self._listening.bind(where)
        else:
            host, port = where.split(":")
            self._listening = socket.create_server((host, int(port)))
        self._listening.listen(100)
        self.granted = threading.Event()  # and all of the answer was taken
        self._open: list[socket.socket] = []
        self._greeted: list[socket.socket] = []  # of these: `sent` has been sent
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self) -> LyingStream:
        return self

    def __exit__(self, *_: object) -> None:
        for one in [self._listening, *self._open]:
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()

    def send(self, data: bytes) -> None:
        """To everybody who is connected, behind `sent`."""
        for one in self._greeted:
            with contextlib.suppress(OSError):
                one.sendall(data)

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client = self._listening.accept()[0]
                self._open.append(client)
                threading.Thread(target=self._serve, args=(client,), daemon=True).start()

    def _serve(self, client: socket.socket) -> None:
        with contextlib.suppress(OSError):
            client.sendall(self._sent)
            self._greeted.append(client)
            if self._answer is None:
                return
            data = b""
            while came := client.recv(1 << 16):
                data = self._taken(client, data + came)

    def _taken(self, client: socket.socket, data: bytes) -> bytes:
        """Answers the requests; returns what is not whole yet."""
        if data[:4] == struct.pack(">I", 0x287617FB):
            data = data[8:]
        while len(data) >= 12:
            kind, length = struct.unpack_from(">II", data)
            end = 8 + length
            if kind == 1:
                if len(data) < end + 4:
                    break
                end += 4 + struct.unpack_from(">I", data, end)[0]
            if len(data) < end:
                break
            if kind == 1 and data[8 : 8 + length] == b"ruedo/request":
                request = lcmtypes.request_t.decode(data[12 + length : end])
                for part in self._answer(request):
                    client.sendall(part)
                if request.kind == request.GRANT:
                    self.granted.set()
            elif kind == 1 and data[8 : 8 + length].endswith(b"/move"):
                for part in self._moved(lcmtypes.move_command_t.decode(data[12 + length : end])):
                    client.sendall(part)
            data = data[end:]
        return data
