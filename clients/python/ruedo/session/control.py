"""Requests to the simulation: each is repeated until it is answered, and executed once."""

from __future__ import annotations

import random
import struct
import threading
import time
from typing import Any, Protocol

from .. import lcmtypes
from ..decoding import decode
from ..errors import NotSupported, RequestError, RunEnded, Timeout, TypeMismatch, for_terminal
from ..samples import REPLIES, State
from .link import Link

REQUEST_CHANNEL = "ruedo/request"
_REPEAT_SECONDS = 0.1
_MOST_LEAVES = 5  # that are sent: for half a second in all


def _names(of: Any) -> dict[int, str]:
    return {
        value: name for name, value in vars(of).items() if name.isupper() and isinstance(value, int)
    }


_REQUEST = struct.Struct(
    ">8sqqiqqii"
)  # request_t but for the body; encode() takes as long as a step
_REQUEST_FINGERPRINT = lcmtypes.request_t._get_packed_fingerprint()
_KINDS = _names(lcmtypes.request_t)
_CODES = _names(lcmtypes.reply_t)


class _TakesReplies(Protocol):
    def on_reply(self, reply: Any) -> None: ...


class _Link(Link, Protocol):
    @property
    def stepper(self) -> _TakesReplies: ...


class Session:
    """A client's session with the server: joins on the first request."""

    def __init__(self, connection: _Link, name: str):
        self._connection = connection
        self._name = name
        self.name = name.encode()
        self._one_at_a_time = threading.Lock()
        self._news = threading.Condition()
        self._session = 0
        self._run_id = 0
        self._sequence = 0
        self._awaited: tuple[int, int] | None = None  # kind, sequence
        self._reply: Any = None

    def request(self, kind: int, body: Any = None, timeout: float = 5.0) -> Any:
        """The reply. Raises NotSupported, RequestError, Timeout (after timeout seconds of real
        time).
        """
        self._connection.check_may_wait()
        with self._one_at_a_time:
            return self.request_in_turn(kind, body, timeout)

    def request_in_turn(self, kind: int, body: Any = None, timeout: float = 5.0) -> Any:
        self._connection.check_open()
        info = self._connection.info
        if not info.features >> kind & 1:
            raise NotSupported(f"this server (Ruedo {info.version}) has no {_KINDS[kind]} request")
        for attempt in (1, 2):
            if not self._session or self._run_id != info.run_id:
                self._run_id = info.run_id
                self._join(timeout)
            reply = self._exchange(kind, self._session, self.next_sequence(), body, timeout)
            if reply.code != lcmtypes.reply_t.UNKNOWN_SESSION or attempt == 2:
                break
            self._session = 0  # its place went to another: join again
        return self._checked(reply)

    def turn(self) -> threading.Lock:
        """The lock that makes other requests wait while a grant, which has no reply, is sent."""
        return self._one_at_a_time

    def next_sequence(self) -> int:
        self._sequence += 1
        return self._sequence

    @property
    def id(self) -> int:
        return self._session

    def check_size(self, body: bytes) -> None:
        """Raises RuedoError for a request that no server would take."""
        self._connection.bus.check_size(REQUEST_CHANNEL, _REQUEST.size + len(body))

    def leave(self) -> None:
        """Gives the session back. Others would wait for a client in lockstep whose LEAVE was lost:
        it is repeated until it is answered, but a few times only, since the server may be gone.
        Times are counted, not seconds: in a second without a processor one alone would go out.
        """
        if not self._session:
            return
        # Whoever has the turn notices soon that this client is closed, unless it is a daemon thread
        # and the program has ended.
        its_turn = self._one_at_a_time.acquire(timeout=_REPEAT_SECONDS * _MOST_LEAVES)
        try:
            sequence = self.next_sequence()
            with self._news:
                self._awaited, self._reply = (lcmtypes.request_t.LEAVE, sequence), None
            for _ in range(_MOST_LEAVES):
                self.publish(lcmtypes.request_t.LEAVE, self._session, sequence, b"")
                with self._news:
                    self._news.wait_for(lambda: self._reply is not None, _REPEAT_SECONDS)
                    answered = self._reply is not None
                if answered or self._connection.server_has_ended():
                    break
            with self._news:
                self._awaited, self._session = None, 0
        finally:
            if its_turn:
                self._one_at_a_time.release()

    def receive(self, data: bytes) -> None:
        """A message of ruedo/reply."""
        if data[:8] != lcmtypes.reply_t._get_packed_fingerprint():
            return
        try:
            reply = decode(lcmtypes.reply_t, data)
        except Exception:
            return
        if not self._connection.is_of_our_run(reply.run_id):
            return  # another server's, which was not asked
        reply.text = for_terminal(reply.text)
        if reply.code == lcmtypes.reply_t.ENDED and not reply.session:  # without a request
            self._connection.note_end(reply.text)
            return
        with self._news:
            ours = reply.session == self._session or reply.kind == lcmtypes.request_t.JOIN
            if self._awaited == (reply.kind, reply.sequence) and ours:
                self._reply = reply
                self._news.notify_all()
                return
        if ours and reply.kind in (lcmtypes.request_t.GRANT, lcmtypes.request_t.RESEND):
            self._connection.stepper.on_reply(reply)

    def _join(self, timeout: float) -> None:
        join = lcmtypes.join_t()
        join.client = self._name
        reply = self._checked(
            self._exchange(lcmtypes.request_t.JOIN, 0, random.getrandbits(62) + 1, join, timeout)
        )
        self._session, self._sequence = reply.session, 0

    def _exchange(self, kind: int, session: int, sequence: int, body: Any, timeout: float) -> Any:
        deadline = time.monotonic() + timeout
        encoded = body.encode() if body is not None else b""
        with self._news:
            self._awaited, self._reply = (kind, sequence), None
        try:
            while True:
                if self._connection.info.run_id != self._run_id:
                    raise RequestError(
                        f"{_KINDS[kind]}: another run has begun meanwhile", "WRONG_RUN"
                    )
                if time.monotonic() >= deadline:
                    raise Timeout(f"no reply to {_KINDS[kind]} on ruedo/reply within {timeout:g} s")
                # Not under the lock: it may take long, and the receiving thread continues.
                self.publish(kind, session, sequence, encoded)
                with self._news:
                    self._news.wait_for(lambda: self._reply is not None, _REPEAT_SECONDS)
                    reply = self._reply
                self._connection.check_open()
                if reply is not None:  # else the run may have ended since
                    return reply
                self._connection.check_server()
        finally:
            with self._news:
                if self._awaited == (kind, sequence):
                    self._awaited = None

    def publish(self, kind: int, session: int, sequence: int, body: bytes, epoch: int = -1) -> None:
        head = _REQUEST.pack(
            _REQUEST_FINGERPRINT,
            self._connection.clock.utime,
            self._run_id,
            epoch,
            session,
            sequence,
            kind,
            len(body),
        )
        self._connection.bus.publish(REQUEST_CHANNEL, head + body)

    @staticmethod
    def _checked(reply: Any) -> Any:
        if reply.code == lcmtypes.reply_t.OK:
            return reply
        code, kind = (
            _CODES.get(reply.code, str(reply.code)),
            _KINDS.get(reply.kind, str(reply.kind)),
        )
        if reply.code == lcmtypes.reply_t.ENDED:
            raise RunEnded(f"{kind}: {reply.text}")
        if reply.code == lcmtypes.reply_t.NOT_SUPPORTED:
            raise NotSupported(f"{kind}: {reply.text or 'this server does not have it'}")
        raise RequestError(f"{kind}: {reply.text or code}", code)


def reply_of(reply: Any, type: str) -> Any:
    """The body of a reply. Raises TypeMismatch."""
    message_type, convert = REPLIES[type]
    try:
        return convert(decode(message_type, reply.body))
    except Exception:
        raise TypeMismatch(f"the reply's body is not a {type} of this client's version") from None


def state_of(reply: Any) -> State:
    state: State = reply_of(reply, "state_reply_t")
    return state
