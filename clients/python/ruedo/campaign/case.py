"""One case: its run, in the engine or with a server and a program, and what came of it.

The same on every machine and in every order: nothing here reads a clock but to end what hangs.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import signal
import subprocess
import tempfile
import time
import traceback
from collections import OrderedDict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..decoding import decode
from ..engine import Engine
from ..launching import find_ruedo
from ..logs import APPLIED_CHANNEL, HEADER_CHANNEL, STATE_HASH_CHANNEL
from .controller import DONE, NothingYet, View, make_controller, velocity_of
from .errors import CampaignError
from .functions import Function, own_state
from .outcome import Outcome, too_large, too_slow
from .output import Output, captured
from .processes import die_with_parent, end_descendants, ends_within, forks_end, limit_memory

_ROOM = 64 << 10  # bytes that a disk must have left
_ENGINES = 4  # that a worker keeps
_IDLE = (
    "the controller commanded nothing all the time; one that stands answers (0, 0), and one that "
    "only looks has no_client_wait: true"
)


class TimeIsUp(BaseException):
    """Raised inside a controller at the wall-clock limit; `except Exception` does not catch it."""


class BrokenRun(BaseException):
    """The simulation itself ended: a state that is not finite, say."""


class Runner:
    """Runs cases, one after the other. folder: of the campaign's file."""

    def __init__(self, folder: str) -> None:
        self._folder = Path(folder)
        self._engines: OrderedDict[str, Engine] = OrderedDict()

    def run(self, what: dict[str, Any], full_log: str = "") -> Outcome:
        """full_log: a file for all messages of the run; "": what acted on it is in the outcome.
        Raises CampaignError where the machine is at fault: a full disk.
        """
        outcome = Outcome()
        everything = bool(full_log or what["metrics"] or "golden" in what["expect"])
        try:
            with tempfile.TemporaryDirectory(
                prefix=_scratch_name(os.getpid()),
                dir=_scratch(everything, what),
                ignore_cleanup_errors=True,
            ) as scratch:
                log = full_log or os.path.join(scratch, "run.lcm")
                self._run(what, log, everything, scratch, outcome)
                if outcome.status != "passed":
                    _check_room({scratch, os.path.dirname(log)})
                if os.path.exists(log):
                    outcome.log, outcome.state_hash = thinned(log)
        except OSError as error:
            raise CampaignError(
                f"{error.filename or _scratch(everything, what) or tempfile.gettempdir()}: "
                f"{error.strerror}; finished cases are kept: make room, and resume"
            ) from None
        outcome.time_s = outcome.metrics.get("time_s", 0.0)
        return outcome

    def _run(
        self, what: dict[str, Any], log: str, everything: bool, scratch: str, outcome: Outcome
    ) -> None:
        output = Output(os.path.join(scratch, "output"))
        try:
            with own_state(), captured(output):
                if "python" in what["controller"]:
                    self._run_in_engine(what, log, everything, outcome)
                else:
                    self._run_command(what, log, scratch, output, outcome)
                self._measure(what, log, outcome)
        except Exception as error:
            outcome.fail("invalid", "case", _line(error))
        finally:
            end_descendants()
            outcome.output = output.text()
            output.close()

    # ---- In the engine.

    def _run_in_engine(
        self, what: dict[str, Any], log: str, everything: bool, outcome: Outcome
    ) -> None:
        engine = self._engine(what)
        expect, limits = what["expect"], what["limits"]
        robot = expect.get("robot") or (engine.robots[0] if engine.robots else "")
        engine.begin_run(
            what["seed"],
            goals=goals(what),
            no_contact=expect.get("no_contact", False),
            clearance=expect.get("clearance"),
            odometry_error=expect.get("odometry_error"),
            clearance_reach=expect.get("clearance_reach", 0.0),
            robot=expect.get("robot", ""),
            log=log,
            everything=everything,
        )
        acted = True
        try:
            with _time_limit(limits["wall"]), limit_memory(limits["memory_mb"]):
                acted = self._drive(engine, robot, what)
        except TimeIsUp:
            outcome.fail("timeout", "controller", too_slow(limits["wall"]))
        except BrokenRun as error:
            outcome.fail("invalid", "state", str(error))
        except MemoryError:
            outcome.fail("memory", "controller", too_large(limits["memory_mb"]))
        except SystemExit as error:
            if error.code not in (None, 0):
                outcome.fail(
                    "crashed", "controller", f"the controller ended with SystemExit: {error.code}"
                )
        except KeyboardInterrupt:  # the worker must end
            raise
        except BaseException as error:
            outcome.fail("crashed", "controller", f"the controller raised {named(error)}"[:300])
            traceback.print_exc()
        finally:
            verdict = engine.end_run()
        outcome.take(verdict, limits["memory_mb"])
        if not acted and not what["controller"].get("no_client_wait", False):
            outcome.fail("not judged", "controller", _IDLE)

    def _drive(self, engine: Engine, robot: str, what: dict[str, Any]) -> bool:
        """Whether the controller has commanded anything, or said that it is done."""
        made = what["controller"]
        steps = max(1, round(1.0 / (made.get("hz", 10.0) * engine.step_size)))
        last = max(1, round(what["limits"]["duration"] / engine.step_size))
        with forks_end():
            thing = Function(made["python"], self._folder).load()
            controller = make_controller(thing, what["parameters"])
        view = View(engine, robot, what["parameters"], what["seed"])
        index = engine.robots.index(robot) if robot in engine.robots else -1
        commands = _no_commands(len(engine.robots))
        acted = False
        while engine.steps() < last:
            try:
                with forks_end():
                    answer = controller(view)
            except NothingYet:
                answer = None
            if isinstance(answer, str) and answer == DONE:
                return True
            commands[:] = float("nan")
            if answer is not None:
                if index < 0:
                    raise ValueError(f"{robot or 'the world'} has no drive to take a velocity")
                commands[0, index] = velocity_of(answer)
                acted = True
            try:
                engine.step(commands if index >= 0 else None, min(steps, last - engine.steps()))
            except RuntimeError as error:
                raise BrokenRun(_line(error)) from None
        return acted or view.has_sent

    def _engine(self, what: dict[str, Any]) -> Engine:
        world = what["world"]
        options: dict[str, Any] = {
            "spawn": [world["spawn"]] if world["spawn"] else [],
            "settings": what["settings"],
            "disable": what["disable"],
            "noise": what["noise"],
            "allow_errors": what["expect"].get("allow_errors", False),
        }
        if what["faults"]:
            options["fault"] = [fault_text(one) for one in what["faults"]]
        key = json.dumps([world["file"], world["sha256"], options], sort_keys=True)
        engine = self._engines.pop(key, None) or Engine(
            world["file"], threads=1, seed=what["seed"], **options
        )
        self._engines[key] = engine
        while len(self._engines) > _ENGINES:
            self._engines.popitem(last=False)[1].close()
        return engine

    # ---- With a server and a program.

    def _run_command(
        self, what: dict[str, Any], log: str, scratch: str, output: Output, outcome: Outcome
    ) -> None:
        limits, made = what["limits"], what["controller"]
        verdict_file = os.path.join(scratch, "verdict.json")
        environment = {
            **os.environ,
            "RUEDO_PARAMETERS": json.dumps(what["parameters"], sort_keys=True),
            "RUEDO_SEED": str(what["seed"]),
            **{k: str(v) for k, v in made.get("environment", {}).items()},
        }
        process = subprocess.Popen(
            regress_command(what, log, verdict_file),
            cwd=self._folder,
            stdin=subprocess.DEVNULL,
            stdout=output.descriptor,
            stderr=subprocess.STDOUT,
            env=environment,
            start_new_session=True,
            preexec_fn=die_with_parent,
        )
        try:
            code = process.wait() if ends_within(process.pid, limits["wall"]) else None
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            end_descendants()
        outcome.output = output.text()
        if os.path.exists(verdict_file):
            verdict = json.loads(Path(verdict_file).read_text())
            outcome.take(verdict, limits["memory_mb"])
        elif code is None:
            outcome.fail("timeout", "controller", too_slow(limits["wall"]))
        else:
            said = [line for line in outcome.output.splitlines() if line.startswith("ruedo: ")]
            outcome.fail(
                "invalid",
                "case",
                said[-1][7:] if said else f"ruedo regress ended with exit code {code}",
            )

    # ---- Of both.

    def _measure(self, what: dict[str, Any], log: str, outcome: Outcome) -> None:
        if "golden" in what["expect"] and "python" in what["controller"]:
            self._compare_with_golden(what["expect"], log, outcome)
        until = time.monotonic() + what["limits"]["wall"]
        for metric in what["metrics"]:
            self._measure_one(metric, log, what["limits"], until, outcome)

    def _measure_one(
        self,
        metric: dict[str, Any],
        log: str,
        limits: dict[str, Any],
        until: float,
        outcome: Outcome,
    ) -> None:
        """All metrics of a case together have as long as its run."""
        status, said = "invalid", ""
        try:
            left = max(until - time.monotonic(), 1e-3)
            with _time_limit(left), limit_memory(limits["memory_mb"]), forks_end():
                value = float(Function(metric["python"], self._folder).load()(log))
            if math.isfinite(value):
                outcome.metrics[metric["name"]] = value
            else:
                said = f"{metric['python']} returned {value}, which measures nothing"
        except KeyboardInterrupt:
            raise
        except TimeIsUp:
            said = f"{metric['python']}: the metrics took more than {limits['wall']:g} s"
        except MemoryError:
            said = f"{metric['python']} wanted more than {limits['memory_mb']} MB of memory"
        except AssertionError as error:
            status, said = "failed", str(error)[:300] or f"{metric['python']} does not hold"
        except BaseException as error:
            said = f"{metric['python']} raised {named(error)}"[:300]
        if said:
            outcome.fail(status, "metric", said)

    def _compare_with_golden(self, expect: dict[str, Any], log: str, outcome: Outcome) -> None:
        kept = log + ".kept"
        _copy_channels(log, kept, lambda channel: channel.endswith("/pose"))
        command = diff_command(expect, str(self._folder / expect["golden"]), kept)
        done = subprocess.run(command, capture_output=True, text=True)
        first = next(iter((done.stdout or done.stderr).strip().splitlines()), "")
        if done.returncode == 1:
            reason = f"the run differs from {expect['golden']}: {first}"
            outcome.fail("failed", "golden", reason)
        elif done.returncode != 0:
            outcome.fail("invalid", "golden", first.removeprefix("ruedo: "))


def diff_command(expect: dict[str, Any], golden: str, log: str) -> list[str]:
    """Exit code 0: they do not differ, 1: they do; else something is wrong with a log or a rule."""
    return [
        *(find_ruedo(), "diff", golden, log),
        *(f"--tolerance={rule}" for rule in expect.get("tolerances", [])),
        *(f"--ignore={rule}" for rule in expect.get("ignore", [])),
    ]


def regress_command(what: dict[str, Any], log: str, verdict: str = "") -> list[str]:
    """The `ruedo regress` that is a case with a program; to be run in the campaign's folder."""
    world, made, expect, limits = what["world"], what["controller"], what["expect"], what["limits"]
    client = f"ulimit -d {limits['memory_mb'] * 1024}; {made['command']}"
    command = [
        find_ruedo(),
        "regress",
        world["file"],
        "--client",
        client,
        "--seed",
        str(what["seed"]),
        "--duration",
        str(limits["duration"]),
        "--record",
        log,
        "--no-page",
    ]
    if verdict:
        command += ["--json", verdict]
    if world["spawn"]:
        command += ["--spawn", world["spawn"]]
    for key, value in what["settings"].items():
        command += ["--set", f"{key}={str(value).lower() if isinstance(value, bool) else value}"]
    for option, values in (
        ("disable", what["disable"]),
        ("wait-for", made.get("wait_for", ())),
        ("remap", made.get("remap", ())),
        ("goal", goals(what)),
        ("tolerance", expect.get("tolerances", ())),
        ("ignore", expect.get("ignore", ())),
        ("fault", [fault_text(one) for one in what["faults"]]),
    ):
        command += [f"--{option}={value}" for value in values]
    for option, value in (
        ("lockstep", made.get("lockstep")),
        ("robot", expect.get("robot")),
        ("golden", expect.get("golden")),
        ("clearance", expect.get("clearance")),
        ("odometry-error", expect.get("odometry_error")),
        ("clearance-reach", expect.get("clearance_reach")),
    ):
        if value is not None:
            command += [f"--{option}", str(value)]
    return (
        command
        + (["--no-contact"] if expect.get("no_contact") else [])
        + (["--no-client-wait"] if made.get("no_client_wait") else [])
        + (["--allow-requests"] if expect.get("allow_requests") else [])
        + (["--allow-errors"] if expect.get("allow_errors") else [])
        + ([] if what["noise"] else ["--no-noise"])
    )


def fault_text(fault: dict[str, Any]) -> str:
    """The fault as an argument of `--fault`: ROBOT/TARGET:KIND@AT,for=S,value=V."""
    target = fault.get("robot", "") + ("/" + fault["target"] if fault.get("target") else "")
    numbers = "".join(
        f",{name}={fault[key]}"
        for key, name in (
            ("duration", "for"),
            ("value", "value"),
            ("from", "from"),
            ("to", "to"),
            ("x", "x"),
            ("y", "y"),
            ("heading", "heading"),
        )
        if key in fault
    )
    return f"{target}:{fault['kind']}@{fault.get('at', 0)}{numbers}"


def thinned(log: str) -> tuple[bytes, str]:
    """A log of the run's inputs and state hashes, and the last of the hashes."""
    from ..lcmtypes import state_hash_t

    kept = log + ".thin"
    last = _copy_channels(
        log,
        kept,
        {HEADER_CHANNEL, APPLIED_CHANNEL, STATE_HASH_CHANNEL}.__contains__,
        STATE_HASH_CHANNEL,
    )
    content = Path(kept).read_bytes()
    os.unlink(kept)
    return content, f"{decode(state_hash_t, last).state_hash & (2**64 - 1):016x}" if last else ""


def _copy_channels(log: str, to: str, kept: Any, last_of: str = "") -> bytes:
    import lcm

    written = lcm.EventLog(to, "w", overwrite=True)
    last = b""
    for event in lcm.EventLog(log, "r"):
        if kept(event.channel):
            written.write_event(event.timestamp, event.channel, event.data)
            last = event.data if event.channel == last_of else last
    written.close()
    return last


def goals(what: dict[str, Any]) -> list[str]:
    by = what["limits"]["duration"]
    return [
        f"{float(one['x'])!r},{float(one['y'])!r},{float(one['radius'])!r},{float(one.get('by', by))!r}"
        for one in what["expect"].get("goal", [])
    ]


def _scratch(everything: bool, what: dict[str, Any]) -> str | None:
    """The folder of a case's files while it runs: in memory when they are a few kB, since a closed
    log waits for its disk.
    """
    small = not everything and "python" in what["controller"]
    return "/dev/shm" if small and os.access("/dev/shm", os.W_OK | os.X_OK) else None


def _scratch_name(process: int) -> str:
    return f"ruedo-case-{process}-"


def remove_scratch(process: int) -> None:
    """Removes the scratch files that a killed process left."""
    for place in {"/dev/shm", tempfile.gettempdir()}:
        for folder in Path(place).glob(_scratch_name(process) + "*"):
            shutil.rmtree(folder, ignore_errors=True)


def _no_commands(robots: int) -> Any:
    import numpy as np

    return np.full((1, robots, 3), np.nan)


def named(error: BaseException) -> str:
    """The exception's type, and its text if it has one."""
    try:
        return f"{type(error).__name__}: {error}"
    except Exception:
        return type(error).__name__


def _line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:300]


def _check_room(folders: Iterable[str]) -> None:
    """Raises OSError if the disk is full: then no fault is the case's."""
    for folder in folders:
        with tempfile.TemporaryFile(dir=folder) as file:
            os.posix_fallocate(file.fileno(), 0, _ROOM)


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    def ring(*_: object) -> None:
        raise TimeIsUp

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
