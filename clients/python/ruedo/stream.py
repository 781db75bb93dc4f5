"""A stream of samples from one channel: the latest, the next, or each as it comes."""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING, Any, Callable, Generic, TypeVar

from . import samples
from .errors import RuedoError, Timeout, TypeMismatch

if TYPE_CHECKING:
    from .simulation import Simulation

T = TypeVar("T")
log = logging.getLogger("ruedo")


class Stream(Generic[T]):
    """Safe to use from any thread; the first use subscribes.

    channel: its name on the bus. type: its message type. rate: Hz of sim time, 0: every step or when
    something happens.
    """

    def __init__(self, sim: Simulation, channel: str, type: str, fingerprint: int, rate: float):
        self.channel, self.type, self.rate = channel, type, rate
        self._sim = sim
        self._fingerprint = fingerprint & 0xFFFFFFFFFFFFFFFF
        self._news = threading.Condition()
        self._open = False
        self._sample: T | None = None
        self._count = 0    # samples received
        self._seen = 0     # of those, the newest that a call has returned
        self._fault: RuedoError | None = None
        self._callbacks: list[Callable[[T], None]] = []

    def latest(self, timeout: float = 5.0) -> T:
        """The newest sample. Before the first one it waits, at most timeout seconds of real time."""
        return self._wait(lambda: self._count > 0, timeout)

    def next(self, timeout: float = 5.0) -> T:
        """The newest sample that neither latest() nor next() of this stream has returned yet; waits for one, at
        most timeout seconds of real time. A reader slower than the rate skips samples; on_sample() skips none."""
        return self._wait(lambda: self._count > self._seen, timeout)

    def on_sample(self, callback: Callable[[T], None]) -> None:
        """Calls callback(sample) in the receiving thread for every sample from now on. It must be quick, and must
        not wait for other samples or replies."""
        self._subscribe()
        with self._news:
            self._callbacks.append(callback)

    def _subscribe(self) -> None:
        with self._news:
            if self._open:
                return
            if self.type not in samples.CONVERSIONS:
                raise TypeMismatch(f"{self.channel}: this client does not know the type {self.type} of the server's "
                                   f"Ruedo {self._sim.version}")
            message, self._convert = samples.CONVERSIONS[self.type]
            self._decode = message.decode
            self._expected: bytes = message._get_packed_fingerprint()
            if self._fingerprint != int.from_bytes(self._expected, "big"):
                raise self._mismatch(self._fingerprint)
            self._open = True
        self._sim._bus.subscribe(self.channel, self._receive)

    def _mismatch(self, fingerprint: int) -> TypeMismatch:
        return TypeMismatch(f"{self.channel} carries another version of {self.type} (fingerprint {fingerprint:016x}) than "
                            f"this client reads ({int.from_bytes(self._expected, 'big'):016x}): the server is Ruedo "
                            f"{self._sim.version}; install the client of the same version")

    def _receive(self, data: bytes) -> None:
        try:
            if data[:8] != self._expected:
                raise self._mismatch(int.from_bytes(data[:8], "big"))
            sample = self._convert(self._decode(data))
        except Exception as error:    # whatever came, the receiving thread lives
            with self._news:
                self._fault = error if isinstance(error, RuedoError) else TypeMismatch(
                    f"{self.channel}: a message of {len(data)} bytes is no valid {self.type} ({error})")
                self._news.notify_all()
            return
        with self._news:
            self._sample, self._fault = sample, None
            self._count += 1
            self._news.notify_all()
            callbacks = list(self._callbacks)
        self._sim._note_time(sample.utime)
        for callback in callbacks:
            try:
                callback(sample)
            except Exception:
                log.exception("a callback on %s failed", self.channel)

    def _wait(self, ready: Callable[[], bool], timeout: float) -> T:
        self._subscribe()
        deadline = time.monotonic() + timeout
        with self._news:
            while not ready():
                if self._fault:
                    fault, self._fault = self._fault, None
                    raise fault
                left = deadline - time.monotonic()
                if left <= 0.0:
                    raise Timeout(f"no sample on {self.channel} within {timeout:g} s ({self._sim._what_is_known(self.rate)})")
                self._news.wait(min(left, 0.5))
                self._sim._check_server()
            self._seen = self._count
            assert self._sample is not None
            return self._sample

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.channel} ({self.type})>"


AnyStream = Stream[Any]
