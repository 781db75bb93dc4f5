"""The simulation in the caller's process: many copies of a world, stepped together over all cores.

    engine = ruedo.Engine("arena", worlds=64, seed=1)
    ranges = engine.observe("lrf.ranges")          # (worlds, robots, beams), follows the runs
    commands = np.zeros((64, 1, 2))                # (worlds, driven robots, (m/s, rad/s))
    engine.step(commands, 20)                      # 20 steps of 5 ms

It is the server's own code and gives the server's own bytes: copy i has the seed ``seed + i``, and
its messages are those of ``ruedo run WORLD --seed seed+i --lockstep 1`` for the same commands at
the same steps. There is no network and no clock.
"""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _engine
from .arguments import (
    MOST_SEED,
    MOST_WHOLE,
    array,
    finite,
    named,
    options,
    shown,
    switch,
    texts,
    whole,
    word,
)
from .arguments import text as checked_text
from .errors import BadWorld, UnknownField
from .world import World

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["Engine", "SavedWorld"]

MOST_WORLDS = 2**31 - 1
_MOST_FIELD = 1000  # characters of DEVICE.FIELD


class Saved:
    """A saved state of an engine: it does not change, so that copies of it are itself, and
    does not leave the process.
    """

    __slots__ = ()

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: object) -> Self:
        return self

    def __reduce__(self) -> Any:
        raise TypeError(f"{self!r} cannot be pickled: it is of the engine that saved it")


class SavedWorld(Saved):
    """The saved state of a world of an :class:`Engine`; it does not change.

    world: its index in the engine. seed: its seed. steps: the steps since its reset. time: s.
    """

    __slots__ = ("_saved_core", "seed", "steps", "time", "world")

    def __init__(self, core: Any, world: int, seed: int, steps: int, time: float) -> None:
        self._saved_core = core
        self.world = world
        self.seed = seed
        self.steps = steps
        self.time = time

    def __repr__(self) -> str:
        return f"<ruedo.SavedWorld: world {self.world} at {self.time:g} s>"


class TimeOfCopies(float):
    """s, of copy 0; called with an index, of that copy."""

    _of_copy: Callable[[int], float]

    def __new__(cls, time: float, of: Callable[[int], float]) -> Self:
        made = super().__new__(cls, time)
        made._of_copy = of
        return made

    def __call__(self, world: int = 0) -> float:
        return self._of_copy(world)

    def __reduce__(self) -> Any:
        return float, (float(self),)


class Engine:
    """Copies of one world.

    world: a file, the name of a world that comes with Ruedo or lies in a folder of RUEDO_PATH, or a
    :class:`World`; with ``text``, what the text is called. worlds: how many copies. seed: of copy
    0; copy i has ``seed + i``. noise: False gives ideal sensors. threads: at most so many cores, 0
    for all. spawn
    ("p3at:guest@1,2,0.5"), drive ("rover=left_joint,right_joint"), settings
    ({"p3at/LRF.update_rate": 10}) and disable ("p3at/camera") and fault ("p3at/lrf:freeze@3") are
    those of ``ruedo run``.
    randomize: what is drawn anew for each seed, see :meth:`drawn`: {"p3at.x": "uniform(-2, 2)",
    "p3at/lrf.lidar.noise.stddev": "log_uniform(0.003, 0.03)"}. plugin: shared libraries with
    sensors or drives of your own, which stay for the life of the process. record: keep the messages
    of the last call, for :meth:`messages`. allow_errors: take a world in which something is missing
    or wrong as it is. allow_absolute: absolute paths in files may lead out of the folders that are
    searched, as they may in a :class:`World`.

    Raises BadWorld, which is both a ValueError and the LaunchError that launch() raises, for what
    is wrong in the file, with file, line, value and what is allowed; ValueError for an argument;
    OSError for what the machine lacks. Not for several threads at once; ``step`` lets
    other Python threads run. A process that was forked may use engines, but draws no pictures where
    the one before had drawn some: OSError.
    """

    @options(set="settings")
    def __init__(
        self,
        world: str | os.PathLike[str] | World = "world",
        *,
        text: str | None = None,
        worlds: int = 1,
        seed: int = 1,
        noise: bool = True,
        threads: int = 0,
        spawn: Iterable[str] = (),
        drive: Iterable[str] = (),
        settings: Mapping[str, object] | None = None,
        disable: Iterable[str] = (),
        fault: Iterable[str] = (),
        randomize: Mapping[str, str] | None = None,
        plugin: Iterable[str | os.PathLike[str]] = (),
        record: bool = False,
        allow_errors: bool = False,
        allow_absolute: bool = False,
    ) -> None:
        if isinstance(world, World):
            if text is not None:
                raise TypeError("Engine() needs either a World or a text")
            world, text, allow_absolute = "world", str(world), True
        _check_world(world)
        if not isinstance(text, (str, type(None))):
            raise TypeError(f"text is a world's SDF as text, not {shown(text)}")
        if text is not None:
            checked_text("text", text)
        if isinstance(plugin, Iterable) and not isinstance(plugin, str):
            plugin = [os.fspath(one) if isinstance(one, os.PathLike) else one for one in plugin]
        worlds = whole("worlds", worlds, 1, MOST_WORLDS)
        seed = whole("seed", seed, 0, MOST_SEED - worlds + 1)
        chosen = named("settings", settings, '{"p3at/lrf.update_rate": 10}')
        draws = named("randomize", randomize, '{"p3at.x": "uniform(-2, 2)"}')
        self._core = _made(
            os.fsencode(world),
            text=text,
            worlds=worlds,
            seed=seed,
            noise=switch("noise", noise),
            threads=whole("threads", threads, 0, 4096),
            spawn=texts("spawn", spawn),
            drive=texts("drive", drive),
            set=texts("settings", [f"{key}={value}" for key, value in chosen.items()]),
            disable=texts("disable", disable),
            fault=texts("fault", fault),
            randomize=texts("randomize", [f"{one}={drawn}" for one, drawn in draws.items()]),
            plugin=texts("plugin", plugin),
            record=switch("record", record),
            allow_errors=switch("allow_errors", allow_errors),
            allow_absolute=switch("allow_absolute", allow_absolute),
        )
        self._worlds = self._core.worlds()
        self._seeds = [seed + i for i in range(self._worlds)]
        self._robots: tuple[str, ...] = tuple(self._core.driven())
        self._step_us: int = self._core.step_us()

    @property
    def worlds(self) -> int:
        """How many copies there are."""
        return self._worlds

    @property
    def robots(self) -> tuple[str, ...]:
        """The robots with a drive, in the order of the world file: the second axis of commands."""
        return self._robots

    @property
    def step_size(self) -> float:
        """Length of a step, s."""
        return self._step_us * 1e-6

    @property
    def dt(self) -> float:
        """Deprecated: `step_size`, as a Simulation calls it."""
        return self.step_size

    @property
    def devices(self) -> list[tuple[str, str, str]]:
        """(robot, device, kind) of every sensor."""
        return self._core.devices()

    @property
    def findings(self) -> list[str]:
        """Unsupported and repaired elements of the world file: file, line, element, what was
        done.
        """
        return self._core.findings()

    @property
    def files_read(self) -> list[str]:
        """The files that the world was read from, in the order of reading."""
        return [os.fsdecode(path) for path in self._core.files_read()]

    def begin_run(
        self,
        seed: int,
        *,
        goals: Iterable[str] = (),
        no_contact: bool = False,
        clearance: float | None = None,
        odometry_error: float | None = None,
        clearance_reach: float = 0.0,
        robot: str = "",
        log: str = "",
        everything: bool = False,
    ) -> None:
        """Resets copy 0 with that seed, and judges it as ``ruedo regress`` does.

        goals: "X,Y,RADIUS,BY". clearance_reach: m, smaller clearances are measured. log: a file
        that ``ruedo verify`` repeats; with everything: all messages, else only what acted on the
        run and hashes of its state. Until :meth:`end_run`, copy 0 is neither reset nor restored.
        """
        seed = whole("seed", seed, 0, MOST_SEED)
        self._core.begin_run(
            seed,
            goals=texts("goals", goals),
            no_contact=switch("no_contact", no_contact),
            clearance=None if clearance is None else finite("clearance", clearance, 0.0),
            odometry_error=(
                None if odometry_error is None else finite("odometry_error", odometry_error, 0.0)
            ),
            clearance_reach=finite("clearance_reach", clearance_reach, 0.0),
            robot=checked_text("robot", robot),
            log=checked_text("log", log),
            everything=switch("everything", everything),
        )
        self._seeds[0] = seed

    def end_run(self) -> dict[str, Any]:
        """The verdict, as `ruedo regress --json` writes it: {"outcome": "passed", "failed" or "not
        judged", "evidence": [{"what", "text"}], "failures": [{"what", "judged", "time_s", "text"}],
        "metrics": {name: number}, "track": [[s, m, m]]}. time_s is None where there is no moment.
        """
        verdict: dict[str, Any] = json.loads(self._core.end_run())
        return verdict

    def steps(self, world: int = 0) -> int:
        """The number of the state that a copy is in; 0 after a reset."""
        return self._core.current_step(self._checked(world))

    @property
    def time(self) -> TimeOfCopies:
        """Sim time of copy 0, s, as a Simulation has it; ``engine.time(i)`` is copy i's."""
        return TimeOfCopies(self.steps(0) * self._step_us * 1e-6, self._time_of)

    def _time_of(self, world: int) -> float:
        return self.steps(world) * self._step_us * 1e-6

    def state_hash(self, world: int = 0) -> int:
        """A hash of the whole state of a copy, bit for bit: the one of the server's ticks."""
        return self._core.state_hash(self._checked(world))

    def observe(self, name: str) -> NDArray[Any]:
        """An array of (worlds, robots, ...) that always shows the newest message of each robot's
        device.

        name: DEVICE.FIELD; the device by its name ("LRF.ranges") or its kind ("lrf.ranges",
        "odometry.theta", "pose.pos"), with the channel below it for a camera's
        ("camera/depth.data"), the field as in the message type. It is a view of the engine's
        memory, cannot be written to, and is written anew by ``step`` and ``reset``: copy what you
        keep. Robots are those that have the device, in the order of the world file.
        """
        if not isinstance(name, str):
            raise TypeError(f"a field is named by a text, DEVICE.FIELD, not by {shown(name)}")
        device, dot, field = checked_text("a field", name).rpartition(".")
        if not dot or not device or not field or len(name) > _MOST_FIELD:
            raise ValueError(f"{shown(name)} is not a DEVICE.FIELD; for example 'lrf.ranges'")
        try:
            values: NDArray[Any] = self._core.observe(device, field)
        except ValueError as error:
            raise UnknownField(str(error)) from None
        return values

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.observe(name)

    def step(
        self,
        commands: ArrayLike | None = None,
        n: int = 1,
        worlds: NDArray[np.bool_] | None = None,
    ) -> None:
        """Steps every copy n times, or only the copies that the mask `worlds` selects.

        commands: velocities on the states that there are, broadcast to (worlds, robots, 2) as (m/s
        ahead, rad/s) or (worlds, robots, 3) as (m/s ahead, m/s left, rad/s); a row with NaN
        commands nothing: the last command holds until the robot's watchdog ends it (600 ms of sim
        time by default).

        Every 200 steps signals are looked at: what their handlers raise (Ctrl-C) ends it there.
        All copies have computed as many steps then; :meth:`steps` says where they are.
        """
        if not hasattr(n, "__index__"):
            raise TypeError(
                f"n is a whole number of steps, not {shown(n)}; a step is {self.step_size:g} s"
            )
        count = whole("n", n, 1)
        which = None
        if worlds is not None:
            mask = np.asarray(worlds)
            if mask.dtype != bool or mask.shape != (self._worlds,):
                raise ValueError(
                    f"worlds is a mask, True or False for each of {self._worlds} worlds, not {shown(worlds)}"
                )
            which = np.ascontiguousarray(mask).view(np.uint8)
        if commands is not None:
            self._core.drive(self._velocities(commands), which)
        self._core.step(count, which)

    def command(self, world: int, channel: str, message: Any) -> None:
        """A message on one of the channels that take commands ("p3at/move"), on the state that the
        copy is in.

        message: one of ``ruedo.lcmtypes``, or its bytes.
        """
        if not isinstance(channel, str):
            raise TypeError(
                f"a channel is named by a text, ROBOT/velocity, not by {shown(channel)}"
            )
        checked_text("a channel", channel)
        self._core.command(self._checked(world), channel, _bytes_of(message))

    def touching(self) -> NDArray[np.int32]:
        """(worlds, driven robots): in how many of the states of the last ``step`` a robot ran into
        something that neither carries it nor lies on it.

        Like what ``observe`` gives, it is a view. ``collisions`` names what was touched.
        """
        counts: NDArray[np.int32] = self._core.touching()
        return counts

    def collisions(self, world: int = 0) -> dict[str, list[str]]:
        """The robots of a copy that ran into something in the states of the last ``step``, each
        with the names of the bodies; empty when none did.
        """
        met = self._core.collisions(self._checked(world))
        return {robot: bodies for robot, bodies in zip(self._robots, met) if bodies}

    def reset(
        self,
        worlds: int | Sequence[int] | NDArray[Any] | None = None,
        seed: int | Sequence[int] | None = None,
        text: str | World | Sequence[str | World] | None = None,
    ) -> None:
        """Makes copies as they were at the beginning; what follows equals a fresh run.

        worlds: an index, several, a mask, or None for all. seed: of each of them, or one for the
        first, counted up; None: the one that the copy has. text: another world for these copies
        from now on, as SDF or a :class:`World`, or one for each of them, with the same robots and
        devices. The files that texts name are read once, when they are first named.
        """
        indices = self._indices(worlds)
        count = len(indices)
        if seed is None:
            seeds = [self._seeds[index] for index in indices]
        elif isinstance(seed, (list, tuple, range, np.ndarray)) and np.ndim(seed) > 0:
            seeds = [whole("seed", one, 0, MOST_SEED) for one in seed]
            if len(seeds) != count:
                raise ValueError(f"{len(seeds)} seeds for {count} worlds")
        else:
            first = whole("seed", seed, 0, MOST_SEED - max(count - 1, 0))
            seeds = [first + i for i in range(count)]
        if text is None:
            worlds_of = []
        else:
            given = [text] * count if isinstance(text, (str, World)) else text
            if isinstance(given, (list, tuple)):
                given = [str(one) if isinstance(one, World) else one for one in given]
            worlds_of = texts("text", given)
            if len(worlds_of) != count:
                raise ValueError(f"{len(worlds_of)} texts for {count} worlds")
        try:
            self._core.reset(indices, seeds, worlds_of)
        except _engine.InputError as error:
            raise BadWorld(str(error)) from None
        for index, one in zip(indices, seeds):
            self._seeds[index] = one

    def save(self, world: int = 0) -> SavedWorld:
        """A copy as it stands, with all that decides what follows: bodies, contacts, drives,
        sensors, people, faults, random numbers, and what was commanded already.

        It costs about as much as a reset, however long the copy has run.
        """
        index = self._checked(world)
        saved = self._core.save(index)
        return SavedWorld(saved, index, self._seeds[index], self.steps(index), self._time_of(index))

    def restore(
        self,
        saved: SavedWorld,
        worlds: int | Sequence[int] | NDArray[Any] | None = None,
    ) -> None:
        """Makes copies what :meth:`save` gave: for the same commands, what follows is what followed
        there, byte for byte, and arrays show what they showed then.

        worlds: an index, several, a mask, or None for the one that was saved. From then on they
        have its seed, too.
        """
        if not isinstance(saved, SavedWorld):
            raise TypeError(f"restore() takes what save() gave, not {shown(saved)}")
        indices = [saved.world] if worlds is None else self._indices(worlds)
        self._core.restore(saved._saved_core, indices)
        for index in indices:
            self._seeds[index] = saved.seed

    def drawn(self, world: int = 0) -> dict[str, float]:
        """The values drawn for a copy, by target, from ``randomize`` and its seed.

        Targets are MODEL.x, .y, .z and .yaw (where it stands at the start), MODEL.mass (a factor),
        MODEL.friction, LIGHT.brightness (a factor) and ROBOT/DEVICE.KEY as in ``settings``; "*" in
        MODEL or LIGHT stands for any text, and each that it names draws for itself. Distributions
        are uniform(LOW, HIGH), log_uniform(LOW, HIGH), normal(MEAN, STDDEV) and choice(VALUE, ...).
        A value depends on the seed and its target alone. Robots that are put somewhere are drawn
        again while they would share space with something.
        """
        return dict(self._core.drawn(self._checked(world)))

    def messages(self) -> list[tuple[int, int, str, bytes]]:
        """(world, step, channel, bytes) of every message of the last call of ``step`` or ``reset``;
        with ``record=True``.
        """
        return self._core.messages()

    def close(self) -> None:
        """Lets go of the copies. Everything but reading what was observed raises afterwards."""
        self._core.close()

    def __enter__(self) -> Engine:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __reduce__(self) -> Any:
        raise TypeError(
            "a ruedo.Engine can be neither copied nor pickled: make another one with the same "
            "arguments; save() and restore() keep and put back what it computes"
        )

    def __repr__(self) -> str:
        return f"<ruedo.Engine: {self._worlds} worlds, robots {', '.join(self._robots) or 'none'}, steps of {self.step_size * 1e3:g} ms>"

    def _velocities(self, commands: ArrayLike) -> NDArray[np.float64]:
        given = array("commands are numbers, (m/s, rad/s) for each robot of each world", commands)
        if given.ndim == 0 or given.shape[-1] not in (2, 3):
            raise ValueError(
                f"commands have 2 values for a robot (m/s, rad/s) or 3 (m/s ahead, m/s left, rad/s) in their last axis; "
                f"their shape is {given.shape}"
            )
        values = given.shape[-1]
        shape = (self._worlds, len(self._robots), values)
        rows = np.zeros((*shape[:2], 3))
        try:
            rows[..., :: 4 - values] = given  # of two: m/s ahead and rad/s
        except ValueError:
            raise ValueError(
                f"commands of shape {given.shape} do not fit (worlds, robots, {values}) = {shape}"
            ) from None
        return rows

    def _checked(self, world: int) -> int:
        index = whole("a world's index", world, -MOST_WHOLE)
        if not 0 <= index < self._worlds:
            raise IndexError(f"world {index} of {self._worlds}")
        return index

    def _indices(self, worlds: int | Sequence[int] | NDArray[Any] | None) -> list[int]:
        if worlds is None:
            return list(range(self._worlds))
        given = np.asarray(worlds)
        if given.dtype == bool:
            if given.shape != (self._worlds,):
                raise ValueError(
                    f"a mask has one value for each of {self._worlds} worlds; its shape is {given.shape}"
                )
            return [int(i) for i in np.flatnonzero(given)]
        return [self._checked(i) for i in np.atleast_1d(given)]


def _check_world(world: Any) -> None:
    """Raises TypeError and ValueError."""
    if not isinstance(world, (str, os.PathLike)):
        raise TypeError(f"world is a file, the name of a world or a World, not {shown(world)}")
    if not word("world", world):
        raise ValueError("world is '': it is a file or the name of a world")
    if str(world).lstrip().startswith("<"):
        raise ValueError("world is a file or the name of a world; SDF itself is Engine(text=...)")


def _made(world: bytes, **given: Any) -> Any:
    """Raises BadWorld."""
    try:
        return _engine.Engine(world, **given)
    except ValueError as error:
        raise BadWorld(str(error)) from None


def _bytes_of(message: Any) -> bytes:
    """The bytes of a message of ruedo.lcmtypes, or the given bytes."""
    if isinstance(message, bytes):
        return message
    if isinstance(message, str) or not hasattr(message, "encode"):
        raise TypeError(f"a message is one of ruedo.lcmtypes, or its bytes, not {shown(message)}")
    try:
        encoded = message.encode()
    except (struct.error, TypeError, ValueError, AttributeError, IndexError) as error:
        name = type(message).__name__
        raise TypeError(f"a field of this {name} is not what its type says: {error}") from None
    if not isinstance(encoded, bytes):
        raise TypeError(f"a message is one of ruedo.lcmtypes, or its bytes, not {shown(message)}")
    return encoded
