"""What a campaign's file names in its worlds, and what it compares with: found wrong before the
first run, with its line, and not in each of a thousand cases.
"""

from __future__ import annotations

import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..engine import Engine
from .case import diff_command, fault_text
from .plan import Case
from .schema import Source


def check_names(cases: Iterable[Case], source: Source, folder: Path) -> None:
    """Of each world with each robot the first case, since parameters change values, as a rule, and
    no names. Raises SpecError.
    """
    first: dict[tuple[str, str], dict[str, Any]] = {}
    for case in cases:
        first.setdefault((case.world, case.robot), case.what)
    for what in first.values():
        _check_world(what, source)
    for what in list(first.values())[:1]:
        _check_golden(what["expect"], source, folder)


def _check_world(what: dict[str, Any], source: Source) -> None:
    spawn = what["world"]["spawn"]

    def load(path: tuple[Any, ...], robot: str = "", **options: Any) -> None:
        try:
            with Engine(what["world"]["file"], spawn=[spawn] if spawn else [], **options) as engine:
                if robot:
                    engine.begin_run(what["seed"], robot=robot)
        except ValueError as error:
            raise source.error(path, str(error)) from None

    for name, value in what["settings"].items():
        load(("set", name), set={name: value})
    for i, one in enumerate(what["disable"]):
        load(("disable", i), disable=[one])
    for i, fault in enumerate(what["faults"]):
        load(("faults", i), fault=[fault_text(fault)])
    if "robot" in what["expect"]:
        load(("expect", "robot"), robot=what["expect"]["robot"])


def _check_golden(expect: dict[str, Any], source: Source, folder: Path) -> None:
    """It does not differ from itself, if it is a log and its rules are some."""
    if "golden" not in expect:
        return
    golden = str(folder / expect["golden"])
    done = subprocess.run(diff_command(expect, golden, golden), capture_output=True, text=True)
    if done.returncode != 0:
        said = (done.stderr or done.stdout).strip().splitlines()
        at = "golden" if expect["golden"] in (said or [""])[0] else "tolerances"
        raise source.error(("expect", at), (said or ["it is no log"])[0].removeprefix("ruedo: "))
