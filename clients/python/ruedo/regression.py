"""pytest's fixture `ruedo_regression`: runs a world with a client as fast as it goes, on a port of
its own, and fails with the first thing that is not as expected. It is there once the package
`ruedo` is installed.

    def test_drives_to_the_door(ruedo_regression):
        ruedo_regression("office.sdf", client=["python3", "drive.py"], duration=60,
                         goal=(3.0, 2.0), radius=0.3, by=50.0, no_contact=True,
                         golden="goldens/door.lcm", tolerances=["*/pose:pos=abs:1e-3"])

RUEDO_RENEW=1 in the environment writes the golden logs anew.
"""

from __future__ import annotations

import inspect
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from .arguments import (
    MOST_SEED,
    finite,
    number,
    numbers,
    path,
    shown,
    switch,
    text,
    texts,
    whole,
    word,
)
from .errors import RuedoError
from .launching import find_ruedo

_PARTING_S = 10.0  # that a run has to end its client
_LONGEST_S = 1e6  # the system cannot wait for ever at once
# Options that `ruedo regress` accepts once, and arguments set.
_SINGLE = {
    *("client", "duration", "seed", "record", "robot", "no_contact", "clearance"),
    *("odometry_error", "golden", "lockstep", "script"),
}
_VERDICT = "passed: "
_REASON = "\nFAILED: "  # begins the line of what failed first
_FAILED = 1  # the exit code of `ruedo regress` for a verdict; others are for what was not judged
_PASSED = "\nThe run is in "  # what `ruedo regress` prints in the end
_PathLike = str | os.PathLike[str]
_MOST_CLIENTS = 64  # in lockstep
_CONTROL = re.compile(r"[\x01-\x1f\x7f-\x9f]")  # what no option of `ruedo` may hold


class RegressionFailed(RuedoError, AssertionError):
    """The run is not as expected; the text says the first difference."""


@dataclass(frozen=True)
class Regression:
    """A run that was as expected, or with check=False any run that was judged."""

    log: Path  # of the whole run, a standard LCM log
    output: str  # what the client and `ruedo regress` printed
    passed: bool = True

    @property
    def evidence(self) -> str:
        """The evidence of a pass: "12000 steps; the client ended with 0 at 59.8 s; ..."; "" where
        it has not."""
        said = (line for line in reversed(self.output.splitlines()) if line.startswith(_VERDICT))
        return next(said).removeprefix(_VERDICT) if self.passed else ""


def _option(name: str, *values: object) -> list[str]:
    return [f"--{name}={_held(name, value)}" for value in values if value is not None]


def _held(name: str, value: object) -> str:
    given = word(name, str(value))
    if not given:  # the next option would count as its value
        raise ValueError(f"{name}: an empty text is not allowed")
    if odd := _CONTROL.search(given):
        raise ValueError(
            f"{name} is {shown(given)}, which holds the control character {ord(odd[0]):#04x}"
        )
    return given


def _countable(what: str, value: Any, kind: str = "number") -> Any:
    """The value; refuses a bool, Python's or NumPy's, which counts as 0 or 1."""
    if type(value).__name__ in ("bool", "bool_"):  # each pytest would wait for NumPy's import
        raise TypeError(f"{what} is a {kind}, not {value}")
    return value


def _whole(what: str, value: Any, high: int) -> int:
    return whole(what, _countable(what, value, "whole number"), 0, high)


def _above_0(what: str, value: Any) -> float:
    given = finite(what, _countable(what, value))
    if not given > 0.0:
        raise ValueError(f"{what} is {given}: it must be above 0")
    return given


def _distance(what: str, value: Any) -> float | None:
    return None if value is None else finite(what, _countable(what, value), 0.0)


def _line(what: str, words: Sequence[_PathLike] | str | None) -> str | None:
    """The command line for a shell."""
    if words is None:
        return None
    if isinstance(words, str):
        given = [words]
        line = words
    elif isinstance(words, Iterable) and not isinstance(words, (bytes, Mapping)):
        given = [word(f"a word of {what}", one) for one in words]
        line = shlex.join(given)
    else:
        raise TypeError(f"{what} is a list of words or a line for a shell, not {shown(words)}")
    if not given or not given[0].strip():
        raise ValueError(f"{what} is {shown(words)}, which names no program")
    return line


def _goal(goal: tuple[float, float] | None, radius: float | None, by: float | None) -> list[str]:
    if goal is None:
        if radius is not None or by is not None:
            raise ValueError("radius and by need a goal")
        return []
    if radius is None or by is None:
        raise ValueError("a goal needs its radius (m) and by (s)")
    for one in goal if isinstance(goal, (tuple, list)) else ():
        _countable("goal", one)
    x, y = (finite("goal", one) for one in numbers("goal", goal, 2))
    return [f"--goal={x!r},{y!r},{_above_0('radius', radius)!r},{_above_0('by', by)!r}"]


def _golden(golden: _PathLike | None, **rules: Sequence[str]) -> list[str]:
    """The golden log, and how it is compared: {option of `ruedo regress`: values}."""
    given = {name: texts(name, values) for name, values in rules.items()}
    if golden is None:
        for name in (name for name, values in given.items() if values):
            raise ValueError(f"{name} needs a golden log")
        return []
    return [
        *_option("golden", os.path.abspath(path("golden", golden))),
        *(
            option
            for name, values in given.items()
            for option in _option("tolerance" if name == "tolerances" else name, *values)
        ),
    ]


def _options(options: Sequence[str]) -> list[str]:
    """Others than those that arguments set, and than those with which nothing is judged."""
    given = [_held("option", one) for one in texts("options", options)]
    for name in (one.partition("=")[0] for one in given):
        if name in ("--help", "-h", "--version"):
            raise ValueError(f"options has {name}, which prints something in place of a run")
        if name == "--renew":
            raise ValueError("options has --renew, with which every run passes: set RUEDO_RENEW=1")
        argument = name.removeprefix("--").replace("-", "_")
        if name.startswith("--") and argument in _SINGLE:
            raise ValueError(f"options has {name}, which the argument {argument} sets")
    return given


def _patience(timeout: float) -> float:
    seconds = number("timeout", _countable("timeout", timeout))
    if not seconds > 0.0:
        raise ValueError(f"timeout is {seconds}: it must be above 0 s")
    return min(seconds, _LONGEST_S)


def _reason_first(output: str) -> str:
    """pytest's summary shows the first line of an exception."""
    at = f"\n{output}".find(_REASON)
    return output if at < 0 else f"{output[at:].rstrip()}\n{output[:at]}".rstrip()


def _output_of(
    command: list[str], folder: _PathLike | None, timeout: float, check: bool
) -> tuple[str, bool]:
    """The output of a run, and whether it passed."""
    __tracebackhide__ = True
    process = subprocess.Popen(
        command,
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    )
    try:
        output, _ = process.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        raise RegressionFailed(
            f"the regression took more than {timeout:g} s of real time; {shlex.join(command)}\n"
            f"{_stopped(process)}"
        ) from None
    except BaseException:
        _stopped(process)
        raise
    if process.returncode == _FAILED and not check:
        return output, False
    if process.returncode != 0:
        raise RegressionFailed(
            f"{_reason_first(output)}\n(exit code {process.returncode} of {shlex.join(command)})"
        )
    if _PASSED not in f"\n{output}":  # as after an option that prints something in place of a run
        raise RegressionFailed(f"{output}\n(there was no run by {shlex.join(command)})")
    return output, True


def _stopped(process: subprocess.Popen[str]) -> str:
    """Stops the run, which ends its client. Returns the output, if no other process keeps it
    open.
    """
    for end in (process.terminate, process.kill):
        end()
        with suppress(subprocess.TimeoutExpired):
            return process.communicate(timeout=_PARTING_S)[0]
    return ""


def run_regression(
    world: _PathLike,
    *,
    client: Sequence[_PathLike] | str | None = None,
    duration: float,
    seed: int = 1,
    record: _PathLike = "run.lcm",
    robot: str | None = None,
    goal: tuple[float, float] | None = None,
    radius: float | None = None,
    by: float | None = None,
    no_contact: bool = False,
    clearance: float | None = None,
    odometry_error: float | None = None,
    golden: _PathLike | None = None,
    keep: Sequence[str] = (),
    tolerances: Sequence[str] = (),
    ignore: Sequence[str] = (),
    lockstep: int = 0,
    wait_for: Sequence[str] = (),
    script: Sequence[_PathLike] | str | None = None,
    options: Sequence[str] = (),
    folder: _PathLike | None = None,
    timeout: float = 300.0,
    check: bool = True,
) -> Regression:
    """`ruedo regress` with these options; raises RegressionFailed.

    client, script: words, or a line for a shell; the client finds the run by LCM_DEFAULT_URL, the
    script its log by RUEDO_LOG. duration, by: s of sim time; goal, radius, clearance,
    odometry_error: m. lockstep: clients to wait for. options: more of `ruedo regress`, such as
    ["--spawn", "p3at@1,2"]. folder: where client and script run. timeout: s of real time. check:
    False returns a run that has failed, too; one that was not run is still raised.
    """
    __tracebackhide__ = True
    timeout, check = _patience(timeout), switch("check", check)
    record = os.path.abspath(path("record", record))
    command = [
        find_ruedo(),
        "regress",
        *_option("seed", _whole("seed", seed, MOST_SEED)),
        *_option("record", record),
        *_goal(goal, radius, by),
        *_option("client", _line("client", client)),
        *_option("script", _line("script", script)),
        *_option("robot", None if robot is None else text("robot", robot)),
        *_option("clearance", _distance("clearance", clearance)),
        *_option("odometry-error", _distance("odometry_error", odometry_error)),
        *_option("lockstep", _whole("lockstep", lockstep, _MOST_CLIENTS) or None),
        *_golden(golden, keep=keep, tolerances=tolerances, ignore=ignore),
        *_option("wait-for", *texts("wait_for", wait_for)),
        *(["--no-contact"] if switch("no_contact", no_contact) else ()),
        *_options(options),
        # After the options: else "--" would be the value of the last one.
        *_option("duration", _above_0("duration", duration)),
        "--",  # a world's name may begin as an option does
        path("world", world),
    ]
    folder = None if folder is None else path("folder", folder)
    return Regression(Path(record), *_output_of(command, folder, timeout, check))


_ARGUMENTS = [name for name in inspect.signature(run_regression).parameters if name != "world"]


_phase = pytest.StashKey[pytest.CallInfo[None]]()  # of a test, the one that ended last


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> None:
    item.stash[_phase] = call


class _Runs:
    """The calls of one test. None of their verdicts may be lost."""

    def __init__(self, here: Path, logs: Path) -> None:
        self._here, self._logs = here, logs
        self._records: list[Path] = []
        self.begun = self._ended = 0
        self._failures: list[Exception] = []

    def __call__(self, world: _PathLike, **options: Any) -> Regression:
        __tracebackhide__ = True  # a failure shows the test's own line
        self.begun += 1
        try:
            return self._run(world, options)
        except Exception as error:
            self._failures.append(error)
            raise
        finally:
            self._ended += 1

    def _run(self, world: _PathLike, options: dict[str, Any]) -> Regression:
        __tracebackhide__ = True
        for name in options:
            if name not in _ARGUMENTS:
                raise TypeError(f"no argument {name!r}: there are {', '.join(_ARGUMENTS)}")
        name = f"run-{len(self._records) + 1}.lcm" if self._records else "run.lcm"
        given = {"record": self._logs / name, "folder": self._here, **options}
        for name in ("record", "folder", "golden"):
            if given.get(name) is not None:
                given[name] = self._here / path(name, given[name])
        if given["record"] in self._records:
            raise ValueError(f"record is {given['record']}, the log of an earlier run of this test")
        self._records.append(given["record"])
        beside = self._here / path("world", world)
        result = run_regression(beside if beside.exists() else world, **given)
        print(result.output, file=sys.stderr)
        return result

    def lost(self) -> str:
        """The reason why a test that passed must fail: it missed a run or its failure; "": none."""
        if not self.begun:
            return "the test takes ruedo_regression and has not called it: nothing was judged"
        if self._ended < self.begun:
            return "the test ended before a run that it began: that was not judged"
        if self._failures:
            return (
                "the test went on after a regression that failed; where that is expected, "
                f"ruedo_regression(..., check=False) returns the run: {self._failures[0]}"
            )
        return ""


@pytest.fixture
def ruedo_regression(
    request: pytest.FixtureRequest, tmp_path: Path
) -> Iterator[Callable[..., Regression]]:
    """run_regression() with a log for each run in the test's temporary folder. Paths are relative
    to the test's file, and client and script run beside it. A run that failed fails the test,
    whatever becomes of the exception, and so does a test that never calls it."""
    here = sys.modules[__name__]
    if not request.config.pluginmanager.is_registered(here):  # the fixture alone was imported
        request.config.pluginmanager.register(here)
    runs = _Runs(request.path.parent, tmp_path)
    yield runs
    phase = request.node.stash[_phase]
    if phase.when != "call":  # the setup of another fixture failed, or skipped the test
        return
    ended_by = phase.excinfo
    is_green = ended_by is None or (runs.begun and ended_by.errisinstance(pytest.skip.Exception))
    if is_green and (lost := runs.lost()):
        pytest.fail(lost, pytrace=False)
