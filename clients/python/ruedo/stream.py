"""A stream of samples from one channel: the latest, the next, or each as it comes."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from . import samples
from .arguments import shown
from .callbacks import Callbacks, Subscription
from .decoding import decode
from .errors import RuedoError, Timeout, TypeMismatch

if TYPE_CHECKING:
    from .connection import Connection
    from .world_info import WorldInfo

T = TypeVar("T")


class Form(NamedTuple):
    """What a stream makes of its messages."""

    fingerprint: bytes | None  # of the messages that it can be made of; None: of any
    make: Callable[[bytes], Any]
    key: Any  # what tells it from others: the class that lcm-gen made, or "raw"; None: the channel's own samples


RAW = Form(None, bytes, "raw")


def form_of(message: Any) -> Form:
    """Of a class that lcm-gen made: its objects, as they are."""
    try:
        fingerprint = message._get_packed_fingerprint()
    except AttributeError:
        raise TypeError(
            f"type is {shown(message)}: it must be a class that lcm-gen made of an .lcm file"
        ) from None
    return Form(fingerprint, lambda data: decode(message, data), message)


class Reader(Generic[T]):
    """Reads a stream at a pace of its own, which other readers of the stream do not change."""

    def __init__(self, stream: Stream[T]):
        self._stream = stream
        self._seen = 0  # of the samples received, the newest that a call has returned

    def latest(self, timeout: float = 5.0) -> T:
        """The newest sample. Before the first one it waits, at most timeout seconds of real
        time.
        """
        return self._stream._sample_for(self, False, timeout)

    def next(self, timeout: float = 5.0) -> T:
        """The newest sample that neither latest() nor next() has returned yet; waits for one, at
        most timeout seconds of real time. A reader slower than the rate skips samples; on_sample()
        skips none."""
        return self._stream._sample_for(self, True, timeout)


class Stream(Reader[T]):
    """Safe to use from any thread; the first use subscribes.

    channel: its name on the bus. type: its message type. rate: Hz of sim time, 0: every step or
    when something happens. It is a reader of itself; who reads beside it takes a reader() of its
    own.
    """

    def __init__(
        self,
        connection: Connection,
        channel: str,
        type: str,
        fingerprint: int,
        rate: float,
        form: Form | None = None,
    ):
        super().__init__(self)
        self._given = form
        self.channel, self.type, self.rate = channel, type, rate
        self._connection = connection
        self._fingerprint = fingerprint  # as ruedo/info said first
        self._news = threading.Condition()
        self._source: Subscription | None = None
        self._sample: T | None = None
        self._count = 0  # samples received
        self._fault: RuedoError | None = None
        self._callbacks = Callbacks(channel)

    def reader(self) -> Reader[T]:
        """A reader that has seen nothing yet."""
        return Reader(self)

    def on_sample(self, callback: Callable[[T], None]) -> Subscription:
        """Calls callback(sample) in the receiving thread for every sample from now on, until
        close() of what it returns (or of the simulation). It must be quick, and cannot wait for
        other samples or replies: such a call raises RuedoError."""
        self._subscribe()
        return self._callbacks.add(callback)

    def _subscribe(self) -> None:
        self._connection.check_open()
        with self._news:
            if self._source:
                return
            form = self._form()
            if form.fingerprint and self._announced() != int.from_bytes(form.fingerprint, "big"):
                raise self._mismatch(self._announced(), form.fingerprint)
            self._source = self._connection.bus.subscribe(self.channel, self._receive)

    def _announced(self) -> int:
        """The fingerprint by the newest info: one before may have been false, or of another
        server."""
        fingerprints = self._connection.info.fingerprints
        return fingerprints.get(self.channel, self._fingerprint) & 0xFFFFFFFFFFFFFFFF

    def _form(self) -> Form:
        if self._given is None:
            if self.type not in samples.CONVERSIONS:
                name = self.channel.rpartition("/")[2]
                raise TypeMismatch(
                    f"{self.channel} carries {self.type}, of which this client has no samples: "
                    f'robot.stream("{name}", {self.type}) takes the class that lcm-gen made of its .lcm file, '
                    f'robot.stream("{name}", raw=True) gives the bytes'
                )
            message, convert = samples.CONVERSIONS[self.type]
            make = samples.DECODERS.get(self.type, lambda data: convert(decode(message, data)))
            self._given = Form(message._get_packed_fingerprint(), make, None)
        return self._given

    def _sample_of(self, data: bytes) -> T:
        """Raises TypeMismatch."""
        form = self._form()
        if form.fingerprint and data[:8] != form.fingerprint:
            raise self._mismatch(int.from_bytes(data[:8], "big"), form.fingerprint)
        try:
            sample: T = form.make(data)
        except Exception as error:
            raise TypeMismatch(
                f"{self.channel}: a message of {len(data)} bytes is no valid {self.type} ({error})"
            ) from None
        return sample

    def _unsubscribe(self) -> None:
        """Its robot is gone."""
        with self._news:
            source, self._source = self._source, None
        if source:
            source.close()

    def _forget(self) -> None:
        """What came is of a run that has ended."""
        with self._news:
            self._sample = self._fault = None

    def _mismatch(self, fingerprint: int, expected: bytes) -> TypeMismatch:
        ours = int.from_bytes(expected, "big")
        form = self._form()
        if form.key is not None:
            return TypeMismatch(
                f"{self.channel} carries {self.type} (fingerprint {fingerprint:016x}), which {form.key.__name__} "
                f"({ours:016x}) does not read: it is another type, or made of another version of its .lcm file"
            )
        return TypeMismatch(
            f"{self.channel} carries another version of {self.type} (fingerprint {fingerprint:016x}) than "
            f"this client reads ({ours:016x}): the server is Ruedo "
            f"{self._connection.version}; install the client of the same version"
        )

    def _receive(self, data: bytes) -> None:
        if self._connection.closed or self._connection.in_doubt:
            return
        try:
            sample = self._sample_of(data)
        except RuedoError as error:  # whatever came, the receiving thread lives
            with self._news:
                self._fault = error
                self._news.notify_all()
            return
        with self._news:
            self._sample, self._fault = sample, None
            self._count += 1
            self._news.notify_all()
        utime = getattr(sample, "utime", None)  # a type of a user's own may have none
        if isinstance(utime, int):
            self._connection.clock.note(utime)
        self._callbacks.call(sample)

    def _sample_for(self, reader: Reader[T], a_new_one: bool, timeout: float) -> T:
        if isinstance(timeout, bool) or not isinstance(timeout, (int, float)):
            raise TypeError(
                f"timeout is {shown(timeout)}: it must be a number of seconds of real time; of lockstep's observations "
                "latest(device) and all(device) are the samples"
            )
        self._subscribe()
        deadline = time.monotonic() + timeout
        with self._news:
            while self._sample is None or (a_new_one and reader._seen == self._count):
                if self._fault:
                    fault, self._fault = self._fault, None
                    raise fault
                self._connection.check_may_wait()
                left = deadline - time.monotonic()
                if left <= 0.0:
                    raise Timeout(
                        f"no sample on {self.channel} within {timeout:g} s ({self._connection.what_is_known(self.rate)})"
                    )
                self._news.wait(min(left, 0.5))
                self._connection.check_server()
            reader._seen = self._count
            return self._sample

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.channel} ({self.type})>"


sample_of = Stream._sample_of  # what a stream makes of a message, for observations


class Streams:
    """The streams of a connection, by channel and form. Safe to use from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._all: dict[tuple[str, Any], Stream[Any]] = {}

    def get(
        self, channel: Any, make: Callable[[], Stream[Any]], form: Form | None = None
    ) -> Stream[Any]:
        """The stream of a channel, made on first use."""
        key = channel.name, form.key if form else None
        with self._lock:
            known = self._all.get(key)
            if known is None or known.type != channel.type:  # the next run's may be another
                known = self._all[key] = make()
            return known

    def end_removed(self, info: WorldInfo) -> None:
        """Ends those of channels that are gone."""
        channels = {channel.name for channel in info.channel_list}
        with self._lock:
            gone = [self._all.pop(key) for key in list(self._all) if key[0] not in channels]
        for stream in gone:
            stream._unsubscribe()

    def forget(self) -> None:
        """What came is of a run that has ended."""
        with self._lock:
            streams = list(self._all.values())
        for stream in streams:
            stream._forget()
