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

import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from .arguments import finite, number, numbers, path, shown, switch, texts, word
from .errors import RuedoError
from .launch import find_ruedo

_PARTING_S = 10.0  # that a run has to end its client
_LONGEST_S = 1e6  # the system cannot wait for ever at once
_PASSED = "\nThe run is in "  # what `ruedo regress` prints in the end
_PathLike = str | os.PathLike[str]


class RegressionFailed(RuedoError, AssertionError):
    """The run is not as expected; the text says the first difference."""


@dataclass(frozen=True)
class Regression:
    """A run that was as expected."""

    log: Path  # of the whole run, a standard LCM log
    output: str  # what the client and `ruedo regress` printed


def _option(name: str, *values: object) -> list[str]:
    given = [word(name, str(value)) for value in values if value is not None]
    if "" in given:  # the next option would count as its value
        raise ValueError(f"an empty text is no {name}")
    return [f"--{name}={value}" for value in given]


def _line(what: str, words: Sequence[_PathLike] | str | None) -> str | None:
    """For a shell."""
    if words is None:
        return None
    if isinstance(words, str):
        line = words
    elif isinstance(words, Iterable) and not isinstance(words, (bytes, Mapping)):
        line = shlex.join(word(f"a word of {what}", one) for one in words)
    else:
        raise TypeError(f"{what} is a list of words or a line for a shell, not {shown(words)}")
    if not line.strip():
        raise ValueError(f"{what} is {shown(words)}, which names no program")
    return line


def _goal(goal: tuple[float, float] | None, radius: float | None, by: float | None) -> list[str]:
    if goal is None:
        if radius is not None or by is not None:
            raise ValueError("radius and by belong to a goal, and there is none")
        return []
    if radius is None or by is None:
        raise ValueError("a goal needs its radius (m) and by (s)")
    x, y = (finite("goal", one) for one in numbers("goal", goal, 2))
    return [f"--goal={x!r},{y!r},{finite('radius', radius)!r},{finite('by', by)!r}"]


def _patience(timeout: float) -> float:
    seconds = number("timeout", timeout)
    if not seconds > 0.0:
        raise ValueError(f"timeout is {seconds}: it must be above 0 s")
    return min(seconds, _LONGEST_S)


def _output_of(command: list[str], folder: _PathLike | None, timeout: float) -> str:
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
    if process.returncode != 0:
        raise RegressionFailed(
            f"{output}\n(exit code {process.returncode} of {shlex.join(command)})"
        )
    if _PASSED not in f"\n{output}":  # as after an option that prints something in place of a run
        raise RegressionFailed(f"{output}\n(there was no run by {shlex.join(command)})")
    return output


def _stopped(process: subprocess.Popen[str]) -> str:
    """Lets it end its client, too; what it has printed, if nobody else keeps its output open."""
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
) -> Regression:
    """`ruedo regress` with these options; raises RegressionFailed.

    client, script: words, or a line for a shell; the client finds the run by LCM_DEFAULT_URL, the
    script its log by RUEDO_LOG. duration, by: s of sim time; goal, radius, clearance,
    odometry_error: m. lockstep: clients to wait for. options: more of `ruedo regress`, such as
    ["--spawn", "p3at@1,2"]. folder: where client and script run. timeout: s of real time.
    """
    __tracebackhide__ = True
    timeout = _patience(timeout)
    record = os.path.abspath(path("record", record))
    command = [
        find_ruedo(),
        "regress",
        *_option("seed", seed),
        *_option("record", record),
        *_goal(goal, radius, by),
        *_option("client", _line("client", client)),
        *_option("script", _line("script", script)),
        *_option("robot", robot),
        *_option("clearance", clearance),
        *_option("odometry-error", odometry_error),
        *_option("lockstep", lockstep or None),
        *_option("golden", None if golden is None else os.path.abspath(path("golden", golden))),
        *_option("keep", *texts("keep", keep)),
        *_option("tolerance", *texts("tolerances", tolerances)),
        *_option("ignore", *texts("ignore", ignore)),
        *_option("wait-for", *texts("wait_for", wait_for)),
        *(["--no-contact"] if switch("no_contact", no_contact) else ()),
        *(word("options", one) for one in texts("options", options)),
        *_option("duration", duration),  # no value of the last of the options, as "--" would be
        "--",  # a world's name may begin as an option does
        path("world", world),
    ]
    folder = None if folder is None else path("folder", folder)
    return Regression(Path(record), _output_of(command, folder, timeout))


@pytest.fixture
def ruedo_regression(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[..., Regression]:
    """run_regression() with the log in the test's temporary folder; world and golden are relative
    to the test's file, and client and script run beside it."""
    here = request.path.parent

    def run(world: _PathLike, **options: Any) -> Regression:
        __tracebackhide__ = True  # a failure shows the test's own line
        options.setdefault("record", tmp_path / "run.lcm")
        options.setdefault("folder", here)
        if options.get("golden") is not None:
            options["golden"] = here / path("golden", options["golden"])
        beside = here / path("world", world)
        result = run_regression(beside if beside.exists() else world, **options)
        print(result.output, file=sys.stderr)
        return result

    return run
