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
from .worlds import model_of


def check_names(cases: Iterable[Case], source: Source, folder: Path) -> None:
    """Of each world with each model of a robot the first case, since parameters change values, as a
    rule, and no names. Raises SpecError.
    """
    first: dict[tuple[str, str], dict[str, Any]] = {}
    for case in cases:
        first.setdefault((case.world, model_of(case.robot)), case.what)
    for what in first.values():
        _check_world(what, source)
    for what in list(first.values())[:1]:
        _check_golden(what["expect"], source, folder)


def _check_world(what: dict[str, Any], source: Source) -> None:
    robot = what["expect"].get("robot", "")
    faults = [fault_text(one) for one in what["faults"]]
    parts: list[tuple[tuple[Any, ...], dict[str, Any]]] = [
        *((("set", name), {"settings": {name: value}}) for name, value in what["settings"].items()),
        *((("disable", i), {"disable": [one]}) for i, one in enumerate(what["disable"])),
        *((("faults", i), {"fault": [one]}) for i, one in enumerate(faults)),
        *([(("expect", "robot"), {"robot": robot})] if robot else []),
    ]
    if not parts:
        return
    try:
        _load(what, robot, settings=what["settings"], disable=what["disable"], fault=faults)
    except ValueError as error:
        for path, options in parts:
            try:
                _load(what, **options)
            except ValueError as of_this:
                raise source.error(path, str(of_this)) from None
        raise source.error((), str(error)) from None


def _load(what: dict[str, Any], robot: str = "", **options: Any) -> None:
    """Raises ValueError."""
    spawn = what["world"]["spawn"]
    options |= {"spawn": [spawn] if spawn else []}
    options |= {"allow_errors": what["expect"].get("allow_errors", False)}
    with Engine(what["world"]["file"], **options) as engine:
        if robot:
            engine.begin_run(what["seed"], robot=robot)


def _check_golden(expect: dict[str, Any], source: Source, folder: Path) -> None:
    """Checks the golden log and its rules: a log that is compared with itself must not differ."""
    if "golden" not in expect:
        return
    golden = str(folder / expect["golden"])
    done = subprocess.run(diff_command(expect, golden, golden), capture_output=True, text=True)
    if done.returncode != 0:
        lines = (done.stderr + done.stdout).splitlines()
        said = next((line for line in lines if line and "warning: " not in line), "it is not a log")
        at = "golden"
        if golden not in said and done.returncode != 1:  # it is a rule that is wrong
            at = "ignore" if "--ignore" in said else "tolerances"
        raise source.error(
            ("expect", at), said.removeprefix("ruedo: ").removeprefix("not the same: ")
        )
