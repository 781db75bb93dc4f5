"""A stream of samples from one channel: the latest, the next, or each as it comes.

The receiving thread keeps the newest message undecoded. Readers decode it, and so does the thread
of the callbacks.
"""

from __future__ import annotations

import bisect
import contextlib
import itertools
import math
import struct
import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from . import samples
from .arguments import shown, whole
from .callbacks import Callbacks, Subscription
from .decoding import decode
from .errors import RuedoError, RunEnded, Timeout, TypeMismatch
from .fast_decoding import DECODERS

if TYPE_CHECKING:
    from .session.link import Link
    from .world_info import WorldInfo

T = TypeVar("T")

_UTIME = struct.Struct(">q")
_UTIME_AT = 8  # behind the fingerprint, in all of the server's own types
_MOST_LOST = 1_000_000_000  # in one gap: a false time may make it any
_LOOK_SECONDS = 0.5  # for the server, while nothing comes
_MOST_KEPT, _MOST_KEPT_BYTES = 256, 4 << 20  # of what came before, where no depth is larger
MOST_DEPTH = 1000
_MOST_UNEVEN = 0.25  # periods: with longer steps, gaps of samples show no losses


class Form(NamedTuple):
    """How a stream decodes its messages."""

    fingerprint: bytes | None  # of the messages that it can be made of; None: of any
    make: Callable[[bytes], Any]
    key: Any  # distinguishes it: the class that lcm-gen made, or "raw"; None: the channel's own samples


RAW = Form(None, bytes, "raw")


def form_of(message: Any) -> Form:
    """The form of an lcm-gen class: its objects, as they are."""
    try:
        fingerprint = message._get_packed_fingerprint()
    except AttributeError:
        raise TypeError(
            f"type is {shown(message)}: it must be a class that lcm-gen made of an .lcm file"
        ) from None
    return Form(fingerprint, lambda data: decode(message, data), message)


class Reader(Generic[T]):
    """Reads a stream at a pace of its own, which other readers of the stream do not change."""

    def __init__(self, stream: Stream[T], queue_depth: int = 1):
        self._stream = stream
        self._seen = 0  # of the samples of the stream, the last that a call has returned
        self._skipped = 0
        self._depth = whole("queue_depth", queue_depth, 1, MOST_DEPTH)

    @property
    def queue_depth(self) -> int:
        """How many samples wait for next() and loops, from 1 (the newest alone, from which a stream
        starts) to 1000. With more, next() returns the oldest that waits; where more than that
        came meanwhile, the oldest go, and `dropped` counts them."""
        return self._depth

    @queue_depth.setter
    def queue_depth(self, queue_depth: int) -> None:
        self._depth = whole("queue_depth", queue_depth, 1, MOST_DEPTH)
        self._stream._keep_at_least(self._depth)

    @property
    def dropped(self) -> int:
        """How many samples there were between those that this reader got: newer ones had come, or
        they were lost on the way."""
        return self._skipped

    def latest(self, timeout: float = 5.0) -> T:
        """The newest sample. Before the first one it waits, at most timeout seconds of real
        time.
        """
        return self._stream._sample_for(self, False, timeout)

    def next(self, timeout: float = 5.0) -> T:
        """The newest sample that neither latest() nor next() has returned yet, or of the newest
        `queue_depth` the oldest; waits for one, at most timeout seconds of real time. After wait()
        of a motion it is one from its end or later. A reader slower than the rate skips samples,
        which `dropped` counts; on_sample() skips none."""
        return self._stream._sample_for(self, True, timeout)

    def __iter__(self) -> Iterator[T]:
        """Yields next() repeatedly: ``for scan in robot.lrf``. Ends with the run."""
        while True:
            try:
                sample = self.next(math.inf)
            except RunEnded:
                return
            yield sample

    async def __aiter__(self) -> AsyncIterator[T]:
        """The same for asyncio: ``async for scan in robot.lrf``, beside the loop's other tasks."""
        import asyncio

        loop, woken = asyncio.get_running_loop(), asyncio.Event()

        def wake(_: T) -> None:
            with contextlib.suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(woken.set)

        with self._stream.on_arrival(wake):
            while True:
                woken.clear()
                try:
                    arrival = self._stream._poll_for(self)
                except RunEnded:
                    return
                if arrival:
                    yield arrival.sample()
                else:
                    with contextlib.suppress(asyncio.TimeoutError):
                        await asyncio.wait_for(woken.wait(), _LOOK_SECONDS)


class _Arrival:
    """A message of a stream."""

    __slots__ = ("_sample", "_stream", "data", "number", "utime")

    def __init__(self, stream: Stream[Any], data: bytes, utime: int | None):
        self._stream, self.data = stream, data
        self.utime = utime  # us; None: its type does not say
        self.number = 0  # of the samples of the stream, with those that were lost
        self._sample: Any = None

    def sample(self) -> Any:
        """The decoded sample, cached (two threads may decode it twice). Raises TypeMismatch."""
        if self._sample is None:
            self._sample = self._stream._sample_of(self.data)
        return self._sample

    def call_back(self) -> None:
        try:
            sample = self.sample()
        except RuedoError as error:
            self._stream._fail(error)
        else:
            self._stream._callbacks.call(sample)


class Stream(Reader[T]):
    """Safe to use from any thread; the first use subscribes.

    channel: its name on the bus. type: its message type. rate: Hz of sim time, 0: every step or
    when something happens. It is a reader of itself; who reads beside it takes a reader() of its
    own.
    """

    def __init__(
        self,
        connection: Link,
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
        self._newest: _Arrival | None = None
        self._kept: deque[_Arrival] = deque()  # the newest last
        self._least_kept = 1  # the largest depth of a reader
        self._kept_bytes = 0
        self._count = 0  # samples that came or were lost
        self._last_utime: int | None = None  # us
        self._waiting: list[int] = []  # threads that wait for a sample
        self._fault: RuedoError | None = None
        self._arrivals = Callbacks(channel)  # this package's own
        self._callbacks = Callbacks(channel, keep=connection.faults.note)
        self._missed = 0  # by the callbacks
        self._has_utime = type in samples.CONVERSIONS
        # s; 0: lost samples cannot be counted.
        even = rate > 0.0 and connection.info.step_us * 1e-6 * rate <= _MOST_UNEVEN
        self._period = 1.0 / rate if even else 0.0

    @property
    def dropped(self) -> int:
        """How many samples latest() and next() have skipped, since newer ones had come, or were
        lost on the way; and how many a callback did not get, which was slower than they came."""
        return self._skipped + self._missed

    def reader(self, queue_depth: int = 1) -> Reader[T]:
        """A reader that has seen nothing yet, with a `queue_depth` of its own."""
        made = Reader(self, queue_depth)
        self._keep_at_least(made.queue_depth)
        return made

    def _keep_at_least(self, count: int) -> None:
        with self._news:
            self._least_kept = max(self._least_kept, count)

    def on_sample(self, callback: Callable[[T], None]) -> Subscription:
        """Calls callback(sample) for every sample from now on, until close() of what it returns (or
        of the simulation). All callbacks run in one thread of their own, one at a time, in the
        order in which the samples came. A server that launch() started waits for them; with
        another one, and more than a megabyte of samples behind, they get the newest of each channel
        (`dropped`). A callback cannot wait for other samples or replies: such a call raises
        RuedoError. What a callback raises is raised by the simulation's next call, at the latest by
        close()."""
        self._subscribe()
        subscription = self._callbacks.add(callback)
        self._connection.progress.listen()
        return subscription

    def on_arrival(self, callback: Callable[[T], None]) -> Subscription:
        """The same in the receiving thread, for what is this package's own."""
        self._subscribe()
        return self._arrivals.add(callback)

    def at(self, utime: int, timeout: float = 5.0) -> T:
        """The sample of a moment, utime (us of sim time, such as ``scan.utime``): waits until the
        stream has come so far. Where no sample is of that moment, a pose or odometry is
        interpolated between its neighbours, and of other streams it is the nearest.

        A stream keeps its last 256 samples, of 4 MB at most, from its first use on: for an earlier
        moment Timeout is raised. `Simulation.synchronised()` joins streams from the beginning.
        """
        sample = self._at(whole("utime", utime), timeout)
        if sample is None:
            first = self._kept[0].utime or 0 if self._kept else 0
            raise Timeout(
                f"{self.channel} has no sample of {utime * 1e-6:g} s: those that it has kept, from "
                f"its first use on, begin at {first * 1e-6:g} s. Use it before, or sim.synchronised()"
            )
        return sample

    def _at(self, utime: int, timeout: float) -> T | None:
        """The sample at that time; None if it is older than the kept ones."""
        if not self._has_utime:
            raise TypeError(f"{self.channel} carries {self.type}, whose messages have no time")
        self._subscribe()
        self._connection.note_use()
        self._connection.bus.catch_up()
        with self._news:
            self._await(lambda: bool(self._kept) and (self._kept[-1].utime or 0) >= utime, timeout)
            times = [arrival.utime or 0 for arrival in self._kept]
            after = bisect.bisect_left(times, utime)
            if times[after] != utime and after == 0:
                return None
            pair = [self._kept[max(after - 1, 0)], self._kept[after]]
        self._connection.note_use()
        before, behind = (arrival.sample() for arrival in pair)
        if times[after] == utime:
            return behind
        if hasattr(before, "interpolated"):
            between: T = before.interpolated(behind, utime)
            return between
        return before if utime - times[after - 1] < times[after] - utime else behind

    def _poll_for(self, reader: Reader[T]) -> _Arrival | None:
        """The sample of next(), or None: then the caller's thread waits for it. Raises what
        next() does."""
        connection = self._connection
        connection.check_open()
        connection.bus.catch_up()
        not_before, me = connection.not_before(), threading.get_ident()
        with self._news:
            self._raise_fault()
            arrival = self._for(reader, True, not_before)
            if arrival:
                return self._taken(reader, arrival)
            connection.progress.wait()
            if me not in self._waiting:
                self._waiting.append(me)
        connection.check_server()
        return None

    def _raise_fault(self) -> None:
        if self._fault:
            fault, self._fault = self._fault, None
            raise fault

    def _taken(self, reader: Reader[T], arrival: _Arrival) -> _Arrival:
        """Advances the reader to the sample, with the lock held."""
        if reader._seen:
            reader._skipped += max(0, arrival.number - reader._seen - 1)
        reader._seen = arrival.number
        return arrival

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
            make = DECODERS.get(self.type, lambda data: convert(decode(message, data)))
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
                f"{self.channel}: a message of {len(data)} bytes is not a valid {self.type} ({error})"
            ) from None
        return sample

    def _unsubscribe(self) -> None:
        """Stops when the robot is gone."""
        with self._news:
            source, self._source = self._source, None
        if source:
            source.close()

    def _forget(self) -> None:
        """Forgets the samples of a run that has ended."""
        with self._news:
            self._newest = self._fault = self._last_utime = None
            self._kept.clear()
            self._kept_bytes = 0

    def _fail(self, error: RuedoError) -> None:
        """Keeps the error for the readers: the receiving thread continues."""
        with self._news:
            self._fault = error
            self._news.notify_all()

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
        connection = self._connection
        if connection.closed or connection.in_doubt:
            return
        form = self._form()
        if form.fingerprint and data[:8] != form.fingerprint:
            self._fail(self._mismatch(int.from_bytes(data[:8], "big"), form.fingerprint))
            return
        timed = self._has_utime and len(data) >= _UTIME_AT + 8
        utime = _UTIME.unpack_from(data, _UTIME_AT)[0] if timed else None
        arrival = _Arrival(self, data, utime)
        try:
            sample = arrival.sample() if self._arrivals else None
        except RuedoError as error:
            self._fail(error)
            return
        if utime is not None:
            connection.clock.note(utime)
        with self._news:
            self._newest, self._fault = arrival, None
            self._count += 1 + self._lost_before(utime)
            arrival.number = self._count
            self._keep(arrival)
            if self._waiting:
                connection.progress.use(connection.clock.utime, tuple(self._waiting))
                self._waiting.clear()
            self._news.notify_all()
        if sample is not None:  # else somebody has begun to listen just now
            self._arrivals.call(sample)
        if self._callbacks:
            for stream in connection.callbacks.put(arrival.call_back, self, len(data)):
                stream._missed += 1

    def _keep(self, arrival: _Arrival) -> None:
        """Keeps a sample for at(), and for readers with a depth. With the lock held."""
        before = self._kept[-1].utime if self._kept else None
        if before is not None and (arrival.utime or 0) < before:  # sim time was reset
            self._kept.clear()
            self._kept_bytes = 0
        self._kept.append(arrival)
        self._kept_bytes += len(arrival.data)
        while len(self._kept) > self._least_kept and (
            len(self._kept) > _MOST_KEPT or self._kept_bytes > _MOST_KEPT_BYTES
        ):
            self._kept_bytes -= len(self._kept.popleft().data)

    def _lost_before(self, utime: int | None) -> int:
        """How many samples are missing since the last one."""
        last, self._last_utime = self._last_utime, utime
        if last is None or utime is None or not self._period or utime <= last:
            return 0
        return min(max(0, round((utime - last) * 1e-6 / self._period) - 1), _MOST_LOST)

    def _sample_for(self, reader: Reader[T], a_new_one: bool, timeout: float) -> T:
        if isinstance(timeout, bool) or not isinstance(timeout, (int, float)):
            raise TypeError(
                f"timeout is {shown(timeout)}: it must be a number of seconds of real time; of lockstep's observations "
                "latest(device) and all(device) are the samples"
            )
        self._subscribe()
        connection = self._connection
        connection.note_use()
        connection.bus.catch_up()
        not_before = connection.not_before() if a_new_one else None
        with self._news:
            self._await(lambda: self._for(reader, a_new_one, not_before) is not None, timeout)
            found = self._for(reader, a_new_one, not_before)
            assert found is not None
            arrival = self._taken(reader, found)
        connection.note_use()
        try:
            sample: T = arrival.sample()
            return sample
        except RuedoError:
            with self._news:
                if self._newest is arrival:
                    self._newest = None
            raise

    def _for(self, reader: Reader[T], a_new_one: bool, not_before: int | None) -> _Arrival | None:
        """The reader's sample, if it has arrived. With the lock held."""
        if not a_new_one:
            return self._newest
        found = None
        for arrival in itertools.islice(reversed(self._kept), reader._depth):
            if arrival.number <= reader._seen:
                break
            if not_before is not None and arrival.utime is not None and arrival.utime < not_before:
                break
            found = arrival
        return found

    def _await(self, ready: Callable[[], bool], timeout: float) -> None:
        """Waits until ready() or the timeout, with the lock held."""
        if ready():
            return
        deadline, me = time.monotonic() + timeout, threading.get_ident()
        try:
            while not ready():
                if me not in self._waiting:  # what came meanwhile was not what is wanted
                    self._connection.progress.wait()
                    self._waiting.append(me)
                self._raise_fault()
                self._connection.check_may_wait()
                left = deadline - time.monotonic()
                if left <= 0.0:
                    raise Timeout(
                        f"no sample on {self.channel} within {timeout:g} s ({self._connection.what_is_known(self.rate)})"
                    )
                self._news.wait(min(left, 0.5))
                self._connection.check_open()
                if not ready():  # else the run may have ended
                    self._connection.check_server()
        finally:
            if me in self._waiting:
                self._waiting.remove(me)

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
        """Forgets the samples of a run that has ended."""
        with self._lock:
            streams = list(self._all.values())
        for stream in streams:
            stream._forget()


def synchronised(first: Stream[Any], others: tuple[Stream[Any], ...]) -> Iterator[tuple[Any, ...]]:
    """Samples of the first stream, each with those of the others at its stamp."""
    for other in others:
        other._subscribe()
    for sample in first.reader(first.queue_depth):
        try:
            joined = [other._at(sample.utime, 5.0) for other in others]
        except RunEnded:
            return
        if all(one is not None for one in joined):  # else it came before the others' first
            yield (sample, *joined)
