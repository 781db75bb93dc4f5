"""Launch actions: a simulation, and a run that the referee judges.

Both are processes of `ruedo`, which is found by the environment variable RUEDO or on the PATH. They
end with the launch, also where that is killed: they watch their standard input, which the kernel
then closes.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import threading
from collections.abc import Iterable
from pathlib import Path

from launch.actions import ExecuteProcess
from launch.some_substitutions_type import SomeSubstitutionsType
from launch.substitutions import FindExecutable

_RECORDED = Path(__file__).with_name("recorded.py")
_PATIENCE_S = "60"  # for a bag to be written after the end


def ruedo() -> SomeSubstitutionsType:
    """The program."""
    return os.environ.get("RUEDO") or FindExecutable(name="ruedo")


class Simulation(ExecuteProcess):
    """`ruedo run WORLD --ros2`."""

    def __init__(
        self,
        world: SomeSubstitutionsType,
        *,
        spawn: Iterable[str] = (),
        bag: SomeSubstitutionsType | None = None,
        lcm: str = "memq://",
        arguments: Iterable[SomeSubstitutionsType] = (),
        **options: object,
    ) -> None:
        """world: a file, or the name of one of Ruedo's. spawn: models, "turtle@3,0". bag: a new
        folder, into which the run is written as a rosbag2 bag when it ends. lcm: where LCM
        clients find the run; memq:// admits none, and pictures that no node reads are not drawn.
        arguments: further options of `ruedo run`. options: of ExecuteProcess.
        """
        words = [ruedo(), "run", world, "--ros2", "--watch-stdin", "--quiet", "--lcm", lcm]
        for model in spawn:
            words += ["--spawn", model]
        words += arguments
        if bag is not None:
            words = [sys.executable, str(_RECORDED), bag, *words]
            options = {"sigterm_timeout": _PATIENCE_S, "sigkill_timeout": _PATIENCE_S, **options}
        super().__init__(cmd=words, **{"name": "ruedo", "output": "screen", **options})


class Regression(ExecuteProcess):
    """`ruedo regress WORLD --ros2`: a run that ends by itself, and has a verdict then.

    The nodes are those of the launch. The run begins at once and in real time, or with wait_for
    when a node publishes there, and then as fast as that allows.
    """

    def __init__(
        self,
        world: SomeSubstitutionsType,
        *,
        duration: float,
        goal: tuple[float, float] | None = None,
        radius: float = 0.3,
        by: float | None = None,
        no_contact: bool = False,
        clearance: float | None = None,
        odometry_error: float | None = None,
        robot: str | None = None,
        wait_for: Iterable[str] = (),
        record: str | os.PathLike[str] | None = None,
        arguments: Iterable[SomeSubstitutionsType] = (),
        **options: object,
    ) -> None:
        """duration, by: s of sim time (by: at the end at the latest); goal, radius, clearance,
        odometry_error: m; robot: whom they are about, else the first of the world. wait_for:
        "/cmd_vel@20". record: the log of the run. arguments: further options of `ruedo regress`.
        options: of ExecuteProcess.
        """
        self._folder = tempfile.TemporaryDirectory(prefix="ruedo-")
        self._file = Path(self._folder.name, "verdict.json")
        self._over = threading.Event()
        self._code: int | None = None
        words = [ruedo(), "regress", world, "--ros2", "--shared-network"]
        words += ["--duration", str(duration), "--json", str(self._file)]
        if goal is not None:
            words += ["--goal", ",".join(map(str, (*goal, radius, by or duration)))]
        if no_contact:
            words += ["--no-contact"]
        for name, value in (
            ("--clearance", clearance),
            ("--odometry-error", odometry_error),
            ("--robot", robot),
            ("--record", record),
        ):
            if value is not None:
                words += [name, str(value)]
        for channel in wait_for:
            words += ["--wait-for", channel]
        options = {"name": "ruedo_regress", "output": "screen", **options}
        self._then = options.pop("on_exit", None)
        super().__init__(cmd=[*words, *arguments], on_exit=self._end, **options)

    def _end(self, event: object, context: object) -> object:
        self._code = event.returncode
        self._over.set()
        return self._then(event, context) if callable(self._then) else self._then

    def verdict(self, timeout: float = 600.0) -> dict:
        """As `ruedo regress --json` writes it: {"outcome": "passed", "failed" or "not judged",
        "evidence": ..., "failures": ...}. Waits for the end of the run, so not in the thread of
        the launch. timeout: s of real time. Raises RuntimeError for what could not be run.
        """
        if not self._over.wait(timeout):
            raise RuntimeError(f"the regression has not ended within {timeout:g} s of real time")
        if not self._file.exists():
            raise RuntimeError(
                f"the regression was not run: `ruedo regress` ended with {self._code}; its output "
                "says why"
            )
        return json.loads(self._file.read_text(encoding="utf-8"))

    def assert_passed(self, timeout: float = 600.0) -> None:
        """Waits for the end of the run; AssertionError with the referee's words if it failed."""
        found = self.verdict(timeout)
        words = "; ".join(one["text"] for one in found["failures"])
        assert found["outcome"] == "passed", f"{found['outcome']}: {words}"
