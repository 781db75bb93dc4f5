"""Driving: commands that are repeated until changed, and motion primitives with a handle to wait
on.
"""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING, Protocol

from . import lcmtypes
from .errors import MotionError, Timeout, UnknownName
from .samples import Collisions, MotionStatus
from .session.link import Link

if TYPE_CHECKING:
    from .callbacks import Subscription
    from .stream import Stream
    from .world_info import WorldInfo

log = logging.getLogger("ruedo")

# A primitive is sent again until a status shows it: messages may be lost, and the server executes
# each once. One that no status has shown after so many statuses and seconds is lost, or was
# replaced at once.
_FIRST_AGAIN, _LAST_AGAIN = 0.1, 1.0  # s of real time
_UNSEEN_STATUSES = 20
_UNSEEN_SECONDS = 5.0


class _Robot(Protocol):
    """The robot that executes the primitives."""

    name: str

    @property
    def collisions(self) -> Stream[Collisions]: ...
    @property
    def motion(self) -> Stream[MotionStatus]: ...


class _Link(Link, Protocol):
    @property
    def drivers(self) -> Drivers: ...


class Motion:
    """A motion primitive under way. state: "sent", then the states of MotionStatus."""

    def __init__(self, connection: _Link, robot: str, id: int, kind: str, amount: float):
        self.id, self.kind = id, kind
        self.state = "sent"
        self.progress = 0.0  # m or rad done
        self.remaining = amount  # m or rad
        # Why it ended early or was refused: MotionStatus's, "removed", "new run"; "lost": no status
        # has shown it, though others came.
        self.reason = ""
        self.blocked_by = ""  # the body that blocked it
        self._connection, self._robot = connection, robot
        self._unseen = 0
        self._message = ("", b"")  # its channel and command
        self._again = _FIRST_AGAIN
        self._again_at = 0.0  # s of time.monotonic()
        self._utime = -1  # of the newest status; earlier ones are another run's, or of a reset that info will report
        self._shown = -1  # of the newest status that shows it
        self._sent = time.monotonic()
        self._news = threading.Condition()
        self._waiting: list[int] = []  # threads

    @property
    def done(self) -> bool:
        """True when the robot is not executing it any more, for whatever reason."""
        return self.state in ("done", "ended", "refused")

    def wait(self, timeout: float | None = None) -> Motion:
        """Waits for the end of the motion, at most timeout seconds of real time. Raises MotionError
        when it ended early or was refused, Timeout when it still runs; the robot keeps moving then.
        Warns where sim time stands still for 5 s of real time, and says why. Raises RunEnded.
        """
        self._connection.check_callbacks()
        deadline = None if timeout is None else time.monotonic() + timeout
        me = threading.get_ident()
        with self._news:
            self._waiting.append(me)
            try:
                self._await_end(deadline, timeout)
            finally:
                if me in self._waiting:
                    self._waiting.remove(me)
        if self.state != "done":
            raise MotionError(
                f"{self._robot}: {self.kind} {'was refused' if self.state == 'refused' else 'ended'}: "
                f"{self._why()}, {self.remaining:.3f} remain",
                self.reason,
            )
        return self

    def _await_end(self, deadline: float | None, timeout: float | None) -> None:
        """Waits for the motion's end, with the lock held."""
        if not self.done:
            self._connection.progress.wait()
        standstill = self._connection.standstill(f"{self._robot}: wait() for {self.kind}")
        while not self.done:
            if deadline is not None and time.monotonic() >= deadline:
                why = standstill.reason()
                raise Timeout(
                    f"{self._robot}: {self.kind} was not done within {timeout:g} s "
                    f"({self.remaining:.3f} remain{why and '; ' + why})"
                )
            self._connection.check_may_wait()
            left = 0.5 if deadline is None else max(0.0, min(0.5, deadline - time.monotonic()))
            self._news.wait(left)
            if not self.done:
                self._connection.check_server()
                if deadline is None:
                    standstill.look()
        self._connection.begin_after(self._utime)

    def _why(self) -> str:
        return f"{self.reason} by {self.blocked_by}" if self.blocked_by else self.reason

    def _update(self, status: MotionStatus, blocked_by: str = "") -> None:
        with self._news:
            if status.utime < self._utime and not self._connection.clock.is_far_ahead(self._utime):
                return
            self._utime = status.utime
            if status.id == self.id:
                self.progress, self.remaining = status.progress, status.remaining
                self.state, self.reason = status.state, status.reason
                self._shown = status.utime
                self.blocked_by = blocked_by if status.reason == "blocked" else ""
            elif status.state == "refused":
                pass  # another command, which changed nothing
            elif status.state == "ended" and status.utime == self._shown:
                pass  # what it ended itself: the network may exchange the two
            elif self.state != "sent":
                self.state, self.reason = (
                    "ended",
                    "replaced",
                )  # its own end fell between two statuses
            else:
                self._unseen += 1
                if (
                    self._unseen >= _UNSEEN_STATUSES
                    and time.monotonic() - self._sent >= _UNSEEN_SECONDS
                ):
                    self.state, self.reason = "ended", "lost"
            if self.done and self._waiting:
                self._connection.progress.use(status.utime, tuple(self._waiting))
                self._waiting.clear()
            self._news.notify_all()

    def _due_again(self, now: float) -> bool:
        """Whether it is to be sent now."""
        if self.state != "sent" or now < self._again_at:
            return False
        self._again_at = now + self._again
        self._again = min(2.0 * self._again, _LAST_AGAIN)
        return True

    def _begin_epoch(self) -> None:
        """Sim time was reset."""
        self._utime = self._shown = -1

    def _end(self, reason: str) -> None:
        with self._news:
            if not self.done:
                self.state, self.reason = "ended", reason
            self._news.notify_all()

    def __repr__(self) -> str:
        state = f"{self.state} ({self._why()})" if self.reason else self.state
        return f"<Motion {self.kind} of {self._robot}: {state}, {self.progress:.3f} done, {self.remaining:.3f} remain>"


class Driver:
    """The commands to one robot: what is repeated, and the primitives under way. A connection has
    one for each name.
    """

    def __init__(self, connection: _Link, robot: _Robot):
        self._connection, self._robot = connection, robot
        self._lock = threading.Lock()
        self._held: tuple[str, bytes] | None = None
        self._held_at = 0  # us, when it last went out by sim time
        self._motions: list[Motion] = []
        self._statuses: Subscription | None = None
        self._collisions: Subscription | None = None
        self._blocked_by = ""
        self._running = False  # a status has shown the held command
        self._watchdog_told = False
        self._ended = ""

    def keep_sending(self, channel: str, data: bytes) -> None:
        """Publishes the command now, and again until the next one."""
        self._listen()
        with self._lock:
            self._held = (channel, data) if not self._ended else None
            self._running = False
            self._connection.bus.publish(channel, data)
        self._connection.drivers.keep_repeating(self)

    def repeat(self) -> None:
        """Repeats the held command, and the newest primitive until a status shows it, by real
        time.
        """
        with self._lock:
            newest = self._motions[-1] if self._motions else None
            if self._held:
                self._connection.bus.publish(*self._held)
            elif newest and newest._due_again(time.monotonic()):
                self._connection.bus.publish(*newest._message)

    def repeat_at(self, utime: int) -> None:
        """Repeats the held command, by sim time."""
        if self._held is None or 0 <= utime - self._held_at < 1e6 * self.period():
            return
        with self._lock:
            self._held_at = utime
            if self._held:
                self._connection.bus.publish(*self._held)

    def period(self) -> float:
        """s of real time between repetitions: a quarter of the watchdog's time, at most 0.1."""
        watchdog = self._watchdog()
        return min(0.1, max(0.01, watchdog / 4.0)) if watchdog > 0.0 else 0.1

    def move(self, channel: str, command: lcmtypes.move_command_t, kind: str) -> Motion:
        self._listen()
        motion = Motion(self._connection, self._robot.name, command.id, kind, abs(command.value))
        with self._lock:
            self._held = None  # a repetition after this would replace the primitive
            self._motions = [m for m in self._motions if not m.done] + [motion]
            motion._message = (channel, command.encode())
            motion._due_again(time.monotonic())
            self._connection.bus.publish(*motion._message)
        self._connection.drivers.keep_repeating(self)
        return motion

    def end(self, reason: str) -> None:
        """Stops when the robot or the run is gone: the next robot of that name gets no commands."""
        with self._lock:
            self._ended, self._held = reason, None
            motions, self._motions = self._motions, []
            listening = (self._statuses, self._collisions)
            self._statuses = self._collisions = None
        for subscription in listening:
            if subscription:
                subscription.close()
        for motion in motions:
            motion._end(reason)

    def begin_epoch(self) -> None:
        """Sim time was reset."""
        with self._lock:
            for motion in self._motions:
                motion._begin_epoch()

    def _watchdog(self) -> float:
        robot = self._connection.info.robots.get(self._robot.name)  # None: removed meanwhile
        return float(robot.watchdog_us) * 1e-6 if robot else 0.0

    def _listen(self) -> None:
        with self._lock:
            if self._ended:  # while the command was being made
                raise UnknownName(f"{self._robot.name} is gone: {self._ended}")
            if self._statuses is None:
                try:  # of a step they come before the status
                    self._collisions = self._robot.collisions.on_arrival(self._on_collisions)
                except UnknownName:
                    pass  # switched off: a motion that is blocked does not know by what
                self._statuses = self._robot.motion.on_arrival(self._on_status)

    def _on_collisions(self, collisions: Collisions) -> None:
        with self._lock:
            self._blocked_by = collisions.blocked_by

    def _on_status(self, status: MotionStatus) -> None:
        with self._lock:
            motions, blocked_by = list(self._motions), self._blocked_by
            self._running = self._running or (
                self._held is not None and status.id == 0 and status.state == "running"
            )
            stopped = (
                self._running
                and self._held is not None
                and status.reason == "watchdog"
                and not self._watchdog_told
            )
            self._watchdog_told = self._watchdog_told or stopped
        if stopped:
            log.warning(
                "%s: stopped by its watchdog: no command came for %g s of sim time",
                self._robot.name,
                self._watchdog(),
            )
        for motion in motions:
            if not motion.done:
                motion._update(status, blocked_by)


class Drivers:
    """The drivers of a connection, by robot, and the thread that repeats their commands. Safe to
    use from any thread.
    """

    def __init__(self, connection: _Link):
        self._connection = connection
        self._lock = threading.Lock()
        self._all: dict[str, Driver] = {}
        self.repeating: set[Driver] = set()  # those with a command to repeat
        self._wake = threading.Condition()
        self._thread: threading.Thread | None = None

    def get(self, robot: _Robot) -> Driver:
        self._connection.check_open()
        with self._lock:
            return self._all.setdefault(robot.name, Driver(self._connection, robot))

    def keep_repeating(self, driver: Driver) -> None:
        with self._wake:
            self.repeating.add(driver)
            if self._thread is None:
                self._thread = threading.Thread(
                    target=self._repeat_until_closed, name="ruedo-repeat", daemon=True
                )
                self._thread.start()
            self._wake.notify_all()

    def repeat(self) -> None:
        for driver in tuple(self.repeating):
            driver.repeat()

    def repeat_at(self, utime: int) -> None:
        """Repeats commands by sim time, for a simulation that runs faster than real time."""
        for driver in tuple(self.repeating):
            driver.repeat_at(utime)

    def wake(self) -> None:
        """The thread sees whether the connection was closed."""
        with self._wake:
            self._wake.notify_all()

    def begin_epoch(self) -> None:
        """Sim time was reset."""
        with self._lock:
            drivers = list(self._all.values())
        for driver in drivers:
            driver.begin_epoch()

    def end_removed(self, info: WorldInfo) -> None:
        """Ends those of robots that are gone."""
        with self._lock:
            gone = [self._all.pop(name) for name in list(self._all) if name not in info.robots]
        self._end(gone, "removed")

    def end_all(self, reason: str) -> None:
        with self._lock:
            drivers = list(self._all.values())
            self._all.clear()
        self._end(drivers, reason)

    def _end(self, drivers: list[Driver], reason: str) -> None:
        with self._wake:
            self.repeating.difference_update(drivers)
        for driver in drivers:
            driver.end(reason)

    def _repeat_until_closed(self) -> None:
        """Feeds the watchdogs in real time."""
        period = 0.1
        while True:
            with self._wake:
                if not self._connection.closed:
                    self._wake.wait(period)
                if self._connection.closed:
                    return
            if not self._connection.another_run:
                self.repeat()
            period = min((driver.period() for driver in tuple(self.repeating)), default=0.1)
