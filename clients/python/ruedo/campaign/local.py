"""Cases on this machine's cores: a process each, that may be killed without harm to the others."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from pathlib import Path
from pickle import UnpicklingError
from typing import Any, Literal

from .case import remove_scratch
from .errors import CampaignError
from .outcome import Outcome, too_slow
from .plan import Case
from .processes import ends_within, kill_with_descendants

_START = 300.0  # s that a worker has to begin a case; it may have been started for it
_GRACE = 5.0  # s beyond a case's own limit, before its worker is killed
_PARTING = 2.0  # s that a worker has to end what it has started
_TRIES = 2  # of a case whose worker was killed

Done = tuple[Case, dict[str, Any], float]  # the case, its outcome, and how long it took (s)


class Worker:
    """A process that runs one case at a time."""

    def __init__(self, folder: str) -> None:
        ours, theirs = socket.socketpair()
        package = str(Path(__file__).resolve().parents[2])
        path = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "ruedo.campaign.worker", str(theirs.fileno()), folder],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                start_new_session=True,  # what it leaves behind can be ended
                env={**os.environ, "PYTHONPATH": path},
            )
        except OSError as error:
            raise CampaignError(f"a worker cannot be started: {error.strerror}") from None
        theirs.close()
        self.pipe = Connection(ours.detach())
        self.case: Case | None = None
        self.tries = 0
        self._has_begun = False
        self._until = 0.0

    def give(self, case: Case, tries: int = 1, full_log: str = "") -> None:
        self.case, self.tries = case, tries
        self._has_begun = False
        self._until = time.monotonic() + _START
        try:
            self.pipe.send((case.id, case.what, full_log))
        except OSError:
            pass  # it was killed while idle: its pipe is at its end

    def left_s(self) -> float:
        """Seconds left for the process to begin the case, or to answer."""
        return max(0.0, self._until - time.monotonic())

    def take(self) -> tuple[dict[str, Any], float] | Literal["begun"] | None:
        """The outcome, and how long it took; None: it is gone, or not itself any more. Raises
        CampaignError where its machine cannot run the case.
        """
        assert self.case is not None
        try:
            said = self.pipe.recv()
        except (EOFError, OSError, UnpicklingError):
            return None
        if not self._has_begun and said == self.case.id:
            self._has_begun = True
            turns = 2 if self.case.what["metrics"] else 1  # they have as long as the run
            self._until = time.monotonic() + turns * self.case.what["limits"]["wall"] + _GRACE
            return "begun"
        case, outcome, wall_s = said
        if isinstance(outcome, CampaignError):
            self.case = None
            raise outcome
        return (outcome, wall_s) if case == self.case.id else None

    def tell_to_end(self) -> None:
        if self._process.returncode is None:
            os.kill(self._process.pid, signal.SIGTERM)

    def end(self) -> int:
        """Ends the process with its children, and returns its exit code; kills it if it hangs."""
        self.tell_to_end()
        if self._process.returncode is None:
            if not ends_within(self._process.pid, _PARTING):
                kill_with_descendants(self._process.pid)
            with suppress(ProcessLookupError):  # what a worker that died could not end
                os.killpg(self._process.pid, signal.SIGKILL)
        code = self._process.wait()
        self.pipe.close()
        remove_scratch(self._process.pid)
        return code


class Crew:
    """Workers that stay from one batch of cases to the next. What a controller does to its process,
    or that it hangs, ends its case alone.
    """

    def __init__(self, folder: str, workers: int = 1) -> None:
        self._folder, self._most = folder, workers
        self._workers: list[Worker] = []

    def __enter__(self) -> Crew:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> None:
        for one in self._workers:
            one.tell_to_end()
        for one in self._workers:
            one.end()
        self._workers = []

    def run(self, cases: Iterable[Case], full_log: str = "") -> Iterator[Done]:
        """Outcomes as they come. A case whose worker is killed has a second try, no third one.

        full_log: of a single case, as of Runner.run().
        """
        waiting = deque((case, 1) for case in cases)
        while len(self._workers) < min(self._most, len(waiting)):
            self._workers.append(Worker(self._folder))
        while waiting or any(one.case for one in self._workers):
            for one in self._workers:
                if one.case is None and waiting:
                    one.give(*waiting.popleft(), full_log)
            yield from self._collect(waiting)

    def run_one(self, what: dict[str, Any], full_log: str = "") -> Outcome:
        """Runs a case that need not be the campaign's, such as one with other faults."""
        case = Case(0, "one", "", "", "", what["seed"], {}, what)
        ((_, outcome, _),) = self.run([case], full_log)
        return Outcome(**outcome)

    def _collect(self, waiting: deque[tuple[Case, int]]) -> Iterator[Done]:
        busy = [one for one in self._workers if one.case]
        ready = wait([one.pipe for one in busy], min(one.left_s() for one in busy))
        for one in busy:
            assert one.case is not None
            case, tries = one.case, one.tries
            answer = one.take() if one.pipe in ready else None
            if answer == "begun":
                continue
            if answer:
                one.case = None
                if waiting:
                    one.give(*waiting.popleft())  # before the result is dealt with: no core waits
                yield case, *answer
                continue
            late = one.left_s() == 0.0
            if one.pipe not in ready and not late:
                continue
            code = one.end()
            self._workers[self._workers.index(one)] = Worker(self._folder)
            if one.pipe not in ready:
                limit = case.what["limits"]["wall"]
                yield case, failed("timeout", too_slow(limit)), limit
            elif tries < _TRIES:
                waiting.appendleft((case, tries + 1))
            else:
                reason = f"the controller took its process with it ({how(code)}), {_TRIES} times"
                yield case, failed("crashed", reason), 0.0


def failed(status: str, reason: str) -> dict[str, Any]:
    """The outcome of a case that took its worker with it."""
    outcome = Outcome()
    outcome.fail(status, "controller", reason)
    return outcome.as_dict()


def how(code: int) -> str:
    if code >= 0:
        return f"exit code {code}"
    try:
        return signal.Signals(-code).name
    except ValueError:
        return f"signal {-code}"


def cores() -> int:
    return len(os.sched_getaffinity(0))
