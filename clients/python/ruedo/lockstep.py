"""The client's side of lockstep: grants steps, and collects every message of every step, whatever
is lost on the way.

The caller of step() receives in its own thread meanwhile: handing each message from thread to
thread would take longer than the step.
"""

from __future__ import annotations

import math
import struct
import time
import zlib
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

import numpy as np

from . import lcmtypes
from .arguments import shown
from .channel_names import ChannelNames
from .decoding import decode
from .errors import (
    LeaseLost,
    NoServer,
    RequestError,
    RuedoError,
    RunEnded,
    Timeout,
    TypeMismatch,
    for_terminal,
)
from .samples import State
from .session.control import state_of
from .session.link import Link
from .stream import Stream, sample_of
from .transport import arrivals

if TYPE_CHECKING:
    from .session.control import Session
    from .world_info import WorldInfo

T = TypeVar("T")

_FIRST_REPEAT, _LAST_REPEAT = 0.005, 0.1  # s; where nothing is lost, the last from the beginning
_ACKNOWLEDGED_TOGETHER = 32  # steps
_MOST_WANTED = 256  # messages requested at once
_MOST_EARLY = 512  # messages of one channel that wait for their ticks
_MOST_FRESH = 16384  # messages of all channels since the last tick
_MOST_BYTES = 256 << 20  # of either: no server continues with so much unheard
_MOST_CHANNELS = 1 << 16  # more cannot be subscribed
_MOST_PARTS = 1024  # of a tick
_MOST_LISTED = 1 << 20  # messages in the manifests of steps that are not here: 160 steps of a fleet
_MOST_AHEAD = 1024  # steps beyond what is here: no server is that far
_DOUBTED_AFTER = 20  # silences in a row: 1.7 s and more
_LONGEST = 2**63 - 1
_FURTHEST = _LONGEST // 2  # steps

_TICK = struct.Struct(
    ">8sqqiqqhh"
)  # fingerprint, utime, run_id, epoch, step, state_hash, part, nparts
_ENTRY = struct.Struct(">iqiI")  # channel_index, sequence, size, crc
_INT = struct.Struct(">i")
_GRANT = struct.Struct(">8sqqqi")  # fingerprint, granted, step_until, received, ncommands
_STEP_OF_COMMAND = struct.Struct(">q")
_GRANT_FINGERPRINT = lcmtypes.grant_request_t._get_packed_fingerprint()
_TICK_FINGERPRINT = lcmtypes.tick_t._get_packed_fingerprint()


@dataclass(frozen=True)
class Command:
    """A command for Simulation.step(), as Robot.velocity_command() and its like make it."""

    channel: str  # one of the command channels of ruedo/info
    data: bytes  # the encoded message
    after: int = 0  # steps from where the call begins to the state that it acts on

    def at(self, steps: int) -> Command:
        """The same, for the state so many steps on."""
        return Command(self.channel, self.data, steps)


class Message(NamedTuple):
    """A sensor message as it came."""

    step: int
    channel: str
    data: bytes


class Observations(State):
    """The result of step(): the state after its last step, and the sensor messages of all its
    steps.

    messages: in the order in which the simulation made them; empty when a paused simulation is
    stepped.
    """

    _steps: list[tuple[int, arrivals.Arrived]]  # number and messages

    @property
    def messages(self) -> list[Message]:
        """The messages of these steps, in the order in which the simulation made them."""
        made: list[Message] | None = self.__dict__.get("_messages")
        if made is None:
            made = [Message(step, *one) for step, came in self._steps for one in came]
            self.__dict__["_messages"] = made
        return made

    def _key(self) -> tuple[Any, ...]:
        return (*super()._key(), tuple(self.messages))

    def __repr__(self) -> str:
        count = sum(len(came) for _, came in self._steps)
        return f"Observations(step={self.step}, time={self.time:g}, {count} messages)"

    def all(self, stream: Stream[T]) -> list[T]:
        """The samples of a device or stream, decoded, in order; none when none was due. Raises
        TypeMismatch.
        """
        return [sample_of(stream, data) for data in self._of(stream)]

    def latest(self, stream: Stream[T]) -> T | None:
        """The last of them."""
        on_channel = self._of(stream)
        return sample_of(stream, on_channel[-1]) if on_channel else None

    def _of(self, stream: Stream[T]) -> list[bytes]:
        """Sorted once: a fleet asks for each of its robots."""
        if not hasattr(stream, "channel"):
            raise TypeError(
                f"expected a device or stream, such as sim.robot('p3at').lrf, not {shown(stream)}"
            )
        by_channel: dict[str, list[bytes]] | None = self.__dict__.get("_by_channel")
        if by_channel is None:
            by_channel = self.__dict__["_by_channel"] = arrivals.by_channel(self._steps)
        return by_channel.get(stream.channel, [])


_NOTHING = np.zeros(3)
_NOTHING.setflags(write=False)
_LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
_LEVEL.setflags(write=False)


def observed(
    state: State | tuple[int, int, int], steps: list[tuple[int, arrivals.Arrived]]
) -> Observations:
    """state: of a STEP's reply, or utime, step and state hash."""
    made = Observations.__new__(Observations)
    values = made.__dict__
    if isinstance(state, State):
        values.update(state.__dict__)
    else:
        values["utime"], values["step"], values["state_hash"] = state
        values.update(
            paused=False,
            rate=math.inf,
            name="",
            position=_NOTHING,
            orientation=_LEVEL,
            linear=_NOTHING,
            angular=_NOTHING,
        )
    values["_steps"] = steps
    return made


class _Entry:
    """An entry of a manifest. data: the bytes received so far; None: nothing."""

    __slots__ = ("channel", "crc", "data", "here", "sequence", "size")

    def __init__(self, channel: int, sequence: int, size: int, crc: int, data: bytes | None):
        self.channel, self.sequence, self.size, self.crc = channel, sequence, size, crc
        self.data, self.here = data or b"", data is not None


class _Step:
    __slots__ = ("missing", "nparts", "parts", "state_hash", "utime")

    def __init__(self, utime: int, state_hash: int, nparts: int):
        self.utime, self.state_hash, self.nparts = utime, state_hash, nparts
        self.parts: dict[int, list[_Entry]] = {}
        self.missing = 0

    def complete(self) -> bool:
        return not self.missing and len(self.parts) == self.nparts

    def messages(self, names: ChannelNames) -> arrivals.Arrived:
        entries = (entry for part in range(self.nparts) for entry in self.parts[part])
        names.go_to(self.utime)
        return [(names.of(entry.channel), entry.data) for entry in entries]


class _Link(Link, Protocol):
    @property
    def session(self) -> Session: ...


class Stepper:
    """Called with the simulation's turn: one step() at a time."""

    def __init__(self, connection: _Link):
        self._connection = connection
        self._part = False  # takes part
        self._info: Any = None  # whose channels are subscribed
        self._indices: dict[str, int] = {}  # of the channels that are subscribed
        self._run_id = self._epoch = 0
        self._granted, self._have = 0, -1  # all of the states up to _have are here
        self._acknowledged = self._newest = -1
        self._last = (0, -1, 0)  # utime, step and hash of what was collected
        self._grant: tuple[int, int, bytes] = (
            0,
            -1,
            b"",
        )  # the one under way: sequence, from, body
        self._taken = True
        self._resends = 0
        # Usually everything comes once and in order, a step's messages and then its tick, and is
        # used as it came. Only if something is lost, late or comes twice each message is put
        # into its place.
        self._fresh: deque[tuple[str, bytes]] = deque(maxlen=_MOST_FRESH)  # since the last tick
        self._steps: dict[int, _Step] = {}  # those of which something is missing, and later ones
        self._listed = 0  # messages in their manifests
        self._names = ChannelNames()  # in the step that is being collected
        # Utime, number, hash and messages of the steps up to _have that were not collected yet.
        self._whole: list[tuple[int, int, int, arrivals.Arrived | _Step]] = []
        self._early: dict[
            int, deque[tuple[int, int, int, bytes]]
        ] = {}  # of each channel: crc, size, utime, message
        self._fresh_bytes = self._early_bytes = 0  # at most
        self._waits_for = ""
        self._fault: RuedoError | None = None
        self._ask_now = False  # without waiting for a silence

    def step(self, n: int, commands: Sequence[Command], timeout: float) -> Observations:
        if isinstance(n, bool) or not isinstance(n, (int, np.integer)):
            raise TypeError(
                f"n is {shown(n)}: it must be a whole number of steps; {self._connection.info.step_us * 1e-6:g} s is one"
            )
        if isinstance(commands, Command):
            raise TypeError("commands is one Command: put it into a list, [command]")
        if not isinstance(commands, Iterable):
            raise TypeError(
                "commands is a list of what robot.velocity_command() and the like make, "
                f"not {shown(commands)}"
            )
        if n < 0:
            raise ValueError(f"n is {n}: it must be at least 0")
        for command in commands:
            if not isinstance(command, Command):
                raise TypeError(
                    f"expected a command, as robot.velocity_command() makes it, not {shown(command)}"
                )
            if not 0 <= command.after < n:
                raise ValueError(
                    f"a command is for {command.after} steps on; of {n} steps 0 to {n - 1} is allowed"
                )
        self._connection.check_may_wait()
        session = self._connection.session
        with session.turn():
            self._connection.check_open()
            if self._part:
                self._check_run()
            else:
                self._take_part(timeout)
                if n == 0 and self._have >= 0:
                    self._look(timeout)
            until = min(self._granted + n, _LONGEST)
            self._wait(self._have, timeout)  # returns at once, unless the previous call gave up
            if n > 0:
                body = self._grant_body(until, commands)
                session.check_size(body)  # before anything is granted
                self._grant = (session.next_sequence(), self._granted, body)
                self._granted, self._taken, self._acknowledged = (
                    until,
                    False,
                    self._have,
                )  # the grant says so
                self._grant_again()
            self._wait(until, timeout)
            if (
                max(self._early, default=0) >= len(self._info.channel_list)
                or self._info is not self._connection.info
            ):  # a model came
                if max(self._early, default=0) >= len(self._connection.info.channel_list):
                    self._connection.refresh_info()
                self._subscribe_all()
            return self._collect()

    def whose_turn(self) -> str:
        """The clients whose grants the run waits for, as far as this client knows."""
        session = self._connection.session
        name = session.name.decode()
        if not self._part:
            return (
                "in lockstep the clients that take part grant each step, and this one, "
                f"'{name}', does not: step() takes part"
            )
        if session.turn().locked() and self._waits_for:
            return f"in lockstep it waits for {self._waits_for}"
        return f"in lockstep it waits for the next step() of this client, '{name}'"

    def forget(self) -> None:
        """The client has reset the world: the next step takes part anew."""
        self._part = False

    def _check_run(self) -> None:
        if self._connection.info.run_id == self._run_id:
            return
        self._part = False
        raise NoServer(
            f"the run that this client took part in has ended; another is at {self._connection.url} now"
        )

    def _take_part(self, timeout: float) -> None:
        arrivals.compiled()
        self._connection.bus.on_arrived = self.note_arrived
        self._subscribe_all()
        body = lcmtypes.grant_request_t()
        body.granted = body.received = -1
        reply = self._connection.session.request_in_turn(lcmtypes.request_t.GRANT, body, timeout)
        try:
            stands = decode(lcmtypes.grant_reply_t, reply.body)
            if not -1 <= stands.received <= stands.granted or not 0 <= stands.granted <= _FURTHEST:
                raise ValueError("impossible steps")
        except Exception:
            raise TypeMismatch(
                "the reply to GRANT is not a grant_reply_t of this client's version"
            ) from None
        self._run_id, self._epoch = self._connection.info.run_id, reply.epoch
        self._granted, self._have, self._newest = stands.granted, stands.received, stands.step
        self._acknowledged = self._have
        self._grant = (0, -1, b"")
        self._forget_steps()
        self._fresh.clear()
        self._whole.clear()
        self._names.begin(self._connection.info)
        self._taken, self._fault, self._waits_for = True, None, ""
        self._part = True

    def _look(self, timeout: float) -> None:
        """At the state that stands, for who joins later and grants nothing."""
        state = state_of(
            self._connection.session.request_in_turn(
                lcmtypes.request_t.GET_STATE, lcmtypes.name_request_t(), timeout
            )
        )
        self._last = (state.utime, state.step, state.state_hash)

    def _subscribe_all(self) -> None:
        """Subscribes to everything that the simulation publishes: a manifest may list any of it."""
        info = self._connection.info
        if self._info is info:
            return
        wanted = {
            index: channel.name
            for index, channel in enumerate(info.channel_list)
            if not channel.input and (channel.robot or channel.type == "world_state_t")
        }
        for name, index in list(self._indices.items()):
            if wanted.get(index) != name:
                self._connection.bus.collect_no_more(name)
                del self._indices[name]
        for index, name in wanted.items():
            self._early.setdefault(index, deque(maxlen=_MOST_EARLY))
            if name not in self._indices:
                self._connection.bus.collect(name, self._fresh.append)
            self._indices[name] = index
        self._info = info

    def _grant_body(self, until: int, commands: Sequence[Command]) -> bytes:
        """A grant_request_t; its own encode() takes longer than a robot's step."""
        granted = self._granted
        parts = [_GRANT.pack(_GRANT_FINGERPRINT, granted, until, self._have, len(commands))]
        for command in commands:
            data = command.data
            parts += (
                _STEP_OF_COMMAND.pack(granted + command.after),
                _encoded_name(command.channel),
                _INT.pack(len(data)),
                data,
            )
        return b"".join(parts)

    def _wait(self, until: int, timeout: float) -> None:
        """Waits for the states up to `until` with all their messages. After a silence it repeats
        the grant, or the request for missing messages, sooner at first.
        """
        if self._taken and self._have >= until:
            return
        first = _LAST_REPEAT if self._connection.bus.loses_nothing else _FIRST_REPEAT
        repeat, deadline, silences = first, time.monotonic() + timeout, 0
        with (
            self._connection.callbacks.in_this_thread(),
            self._connection.bus.receiving() as receive,
        ):
            while True:
                had, quiet_at = self._have, time.monotonic() + repeat
                heard = True
                while (
                    heard
                    and not self._fault
                    and not self._ask_now
                    and not self._connection.closed
                    and self._have - self._acknowledged < _ACKNOWLEDGED_TOGETHER
                ):
                    if self._taken and self._have >= until:
                        return
                    heard = receive(max(0.0, quiet_at - time.monotonic()))
                    if self._steps:
                        self._sort()
                    if time.monotonic() >= quiet_at + _LAST_REPEAT:  # others may never be quiet
                        heard = False
                self._connection.check_open()  # a callback may have closed it
                if self._fault:
                    fault, self._fault, self._part = self._fault, None, False
                    raise fault
                silence = not heard and self._have == had
                silences = silences + 1 if silence else 0
                if silences == _DOUBTED_AFTER:
                    silences = 0
                    self._doubt()
                if not self._taken and silence:
                    self._grant_again()
                elif self._taken and (silence or self._ask_now):
                    self._ask_for_lost(until)
                elif self._have - self._acknowledged >= _ACKNOWLEDGED_TOGETHER:
                    self._ask_for_lost(self._have)  # asks for nothing, but says what is here
                self._ask_now = False
                repeat = min(2.0 * repeat, _LAST_REPEAT) if silence else first
                if self._have > had:
                    deadline = time.monotonic() + timeout
                elif silence:
                    self._connection.check_server()
                    self._check_run()
                    if time.monotonic() >= deadline:
                        waits = f": the run waits for {self._waits_for}" if self._waits_for else ""
                        raise Timeout(
                            f"step {self._have + 1} did not come within {timeout:g} s{waits}"
                        )

    def _forget_steps(self) -> None:
        """Forgets all steps that this client does not have yet; RESEND requests them."""
        self._steps.clear()
        self._listed = 0

    def _doubt(self) -> None:
        """Some data of the next steps may not be the server's: requests all of it anew."""
        self._forget_steps()
        self._newest = self._have
        self._taken = not self._grant[2]

    def _grant_again(self) -> None:
        session = self._connection.session
        session.publish(
            lcmtypes.request_t.GRANT, session.id, self._grant[0], self._grant[2], self._epoch
        )

    def _ask_for_lost(self, until: int) -> None:
        body = lcmtypes.resend_request_t()
        body.received = self._acknowledged = self._have
        last = min(until, max(self._newest, self._have + 1))
        tick = self._info.tick_channel
        for number in range(self._have + 1, last + 1):
            step = self._steps.get(number)
            if step is None:
                body.wanted.append(_wanted(number, tick, 0, 0))
            else:
                body.wanted += [
                    _wanted(number, tick, part, 0)
                    for part in range(step.nparts)
                    if part not in step.parts
                ]
                body.wanted += [
                    _wanted(number, entry.channel, entry.sequence, len(entry.data))
                    for part in step.parts.values()
                    for entry in part
                    if not entry.here
                ]
            if len(body.wanted) >= _MOST_WANTED:
                break
        del body.wanted[_MOST_WANTED:]  # the rest when these have come
        body.nwanted = len(body.wanted)
        self._resends += 1
        session = self._connection.session
        session.publish(
            lcmtypes.request_t.RESEND, session.id, self._resends, body.encode(), self._epoch
        )

    def _collect(self) -> Observations:
        steps = []
        for utime, number, state_hash, came in self._whole:
            self._last = (utime, number, state_hash)
            steps.append((number, came.messages(self._names) if isinstance(came, _Step) else came))
        self._whole = []
        self._names.go_to(self._last[0])
        return observed(self._last, steps)

    # Putting ticks and messages together, as they come: in any order, twice, or not at all.

    def _sort(self) -> None:
        """Sorts the messages since the last tick into their steps."""
        while self._fresh:
            name, data = self._fresh.popleft()
            if (channel := self._indices.get(name)) is not None:
                self._place(channel, data)
        self._fresh_bytes = 0

    def _place(self, channel: int, data: bytes) -> None:
        if len(data) < 16:
            return
        crc, size = zlib.crc32(data), len(data)
        for step in self._steps.values():  # a tick may come before its messages
            if step.missing and self._fill(step, channel, crc, data):
                self._progress()
                return
        self._early[channel].append(
            (crc, size, int.from_bytes(data[8:16], "big", signed=True), data)
        )
        self._early_bytes += size
        if self._early_bytes > _MOST_BYTES:
            self._early_bytes = sum(one[1] for early in self._early.values() for one in early)
        if self._early_bytes > _MOST_BYTES:
            for early in self._early.values():  # missing messages are requested
                early.clear()
            self._early_bytes = 0

    def note_arrived(self, arrived: arrivals.Arrived) -> None:
        """Counts messages that arrived together, of all channels; too many are dropped."""
        self._fresh_bytes += sum([len(data) for _, data in arrived])
        if self._fresh_bytes > _MOST_BYTES:
            self._fresh.clear()
            self._fresh_bytes = 0

    @staticmethod
    def _fill(step: _Step, channel: int, crc: int, data: bytes) -> bool:
        for part in step.parts.values():
            for entry in part:
                if (
                    not entry.here
                    and entry.channel == channel
                    and entry.crc == crc
                    and entry.size == len(data)
                ):
                    entry.data, entry.here = data, True
                    step.missing -= 1
                    return True
        return False

    def on_info(self, info: WorldInfo) -> None:
        if self._part:
            self._names.change(info)

    def on_tick(self, data: bytes) -> None:
        if not self._part:
            self._fresh.clear()
            self._fresh_bytes = 0
        if not self._part or len(data) < _TICK.size:
            return
        fingerprint, utime, run_id, epoch, number, state_hash, part, nparts = _TICK.unpack_from(
            data
        )
        if fingerprint != _TICK_FINGERPRINT or run_id != self._run_id:
            return
        if not 0 <= part < nparts <= _MOST_PARTS:
            return
        if epoch != self._epoch:
            if epoch > self._epoch and not self._fault:
                self._fault = RuedoError(
                    "the world was reset by another client: the next step begins anew"
                )
            return
        self._newest = max(self._newest, number)
        try:
            at = self._applied(data, number)
            if not 0 < number - self._have <= _MOST_AHEAD:
                return
            if nparts == 1 and number == self._have + 1 and not self._steps:
                came = self._as_they_came(data, at)
                if came is not None:
                    self._have = number
                    self._whole.append((utime, number, state_hash, came))
                    return
            self._sort()
            step = self._steps.get(number)
            if step is None:
                step = self._steps[number] = _Step(utime, state_hash, nparts)
            if part in step.parts:
                return
            entries, missing = self._manifest(data, at)
        except (struct.error, ValueError):
            return
        step.parts[part] = entries
        step.missing += missing
        self._listed += len(entries)
        if self._listed > _MOST_LISTED:
            self._forget_steps()
        self._progress()

    def _applied(self, data: bytes, number: int) -> int:
        """Only this says that the grant was executed. Returns where the manifest begins."""
        at = _TICK.size + 4
        for _ in range(_INT.unpack_from(data, at - 4)[0]):
            (size,) = _INT.unpack_from(data, at)
            if size < 1:
                raise ValueError("a string without an end")
            at += 4 + size
            if (
                not self._taken
                and number > self._grant[1]
                and data[at - size : at - 1] == self._connection.session.name
            ):
                self._taken = (
                    int.from_bytes(data[at : at + 8], "big", signed=True) >= self._grant[0]
                )
            at += 8
        return at

    def _as_they_came(self, data: bytes, at: int) -> arrivals.Arrived | None:
        """The messages since the last tick, when they are what this one lists."""
        fresh = self._fresh
        (count,) = _INT.unpack_from(data, at)
        at += 4
        if count != len(fresh) or at + count * _ENTRY.size != len(data):
            return None
        if not arrivals.are_listed(fresh, data, at, self._indices):
            return None
        came = list(fresh)
        fresh.clear()
        self._fresh_bytes = 0
        return came

    def _manifest(self, data: bytes, at: int) -> tuple[list[_Entry], int]:
        (count,) = _INT.unpack_from(data, at)
        at += 4
        if count < 0 or at + count * _ENTRY.size != len(data):
            raise ValueError("the manifest's length")
        entries, missing = [], 0
        for channel, sequence, size, crc in _ENTRY.iter_unpack(data[at:]):
            early = self._early.get(channel)
            if not 0 <= channel < _MOST_CHANNELS or size < 0:
                raise ValueError("no message")
            if early is None:  # of a model that came since
                early = self._early[channel] = deque(maxlen=_MOST_EARLY)
            found = None
            for i, one in enumerate(early):
                if one[0] == crc and one[1] == size:
                    found = one[3]
                    del early[i]
                    break
            missing += found is None
            entries.append(_Entry(channel, sequence, size, crc, found))
        return entries, missing

    def _progress(self) -> None:
        step = self._steps.get(self._have + 1)
        while step is not None and step.complete():
            self._have += 1
            for part in step.parts.values():
                for entry in part:  # what is left from earlier times came twice
                    early = self._early[entry.channel]
                    while early and early[0][2] <= step.utime:
                        early.popleft()
            self._whole.append((step.utime, self._have, step.state_hash, step))
            self._listed -= sum(map(len, step.parts.values()))
            del self._steps[self._have]
            step = self._steps.get(self._have + 1)

    def on_reply(self, reply: Any) -> None:
        """Handles a reply to GRANT or RESEND."""
        if not self._part:
            return
        granting = reply.kind == lcmtypes.request_t.GRANT
        if reply.code != lcmtypes.reply_t.OK:
            if reply.sequence == (self._grant[0] if granting else self._resends) and not (
                granting and self._taken
            ):
                self._fault = self._fault or _fault_of(reply)
        elif not granting:
            try:
                self._take_pieces(decode(lcmtypes.resend_reply_t, reply.body))
            except Exception:
                return  # damaged: it is requested again
        elif reply.sequence == self._grant[0] and not self._taken:
            self._taken = self._ask_now = True  # it was repeated: its ticks may be lost

    def _take_pieces(self, reply: Any) -> None:
        self._newest, self._waits_for = max(self._newest, reply.step), for_terminal(reply.waits_for)
        ticks = []
        for piece in reply.parts:
            step = self._steps.get(piece.step)
            if piece.channel_index == self._info.tick_channel:
                ticks.append(bytes(piece.data))
            elif step is not None:
                for part in step.parts.values():
                    for entry in part:
                        if (entry.channel, entry.sequence, len(entry.data)) == (
                            piece.channel_index,
                            piece.sequence,
                            piece.offset,
                        ):
                            self._add_piece(step, entry, bytes(piece.data))
        for tick in ticks:
            self.on_tick(tick)
        self._progress()
        self._ask_now = bool(reply.parts)  # more may be missing than goes into one reply

    @staticmethod
    def _add_piece(step: _Step, entry: _Entry, data: bytes) -> None:
        if entry.here or len(entry.data) + len(data) > entry.size:
            return
        entry.data += data
        if len(entry.data) < entry.size:
            return
        if zlib.crc32(entry.data) == entry.crc:
            entry.here = True
            step.missing -= 1
        else:
            entry.data = b""  # from the start again


def _wanted(step: int, channel: int, sequence: int, offset: int) -> Any:
    wanted = lcmtypes.resend_wanted_t()
    wanted.step, wanted.channel_index, wanted.sequence, wanted.offset = (
        step,
        channel,
        sequence,
        offset,
    )
    return wanted


@lru_cache(maxsize=4096)
def _encoded_name(name: str) -> bytes:
    encoded = name.encode() + b"\0"
    return _INT.pack(len(encoded)) + encoded


def _fault_of(reply: Any) -> RuedoError:
    codes = lcmtypes.reply_t
    text = f"{'GRANT' if reply.kind == lcmtypes.request_t.GRANT else 'RESEND'}: {reply.text}"
    if reply.code == codes.UNKNOWN_SESSION:
        return LeaseLost(text, "UNKNOWN_SESSION")
    if reply.code == codes.ENDED:
        return RunEnded(text)
    if reply.code in (codes.WRONG_RUN, codes.REFUSED):
        return NoServer(text)
    return RequestError(
        text,
        next(
            (k for k, v in vars(codes).items() if k.isupper() and v == reply.code), str(reply.code)
        ),
    )
