"""ruedo hunt."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..campaign.cli import MOST_WORKERS, number
from ..campaign.errors import CampaignError
from ..campaign.plan import MOST_CASES
from ..terminal import say, tell

if TYPE_CHECKING:
    from .hunt import Found


def add_hunt(commands: Any) -> None:
    one = commands.add_parser(
        "hunt",
        help="search for the case that breaks a controller",
        description="Search for the case that breaks a controller, shrink it, and keep it as a regression test. "
        "Exit code 1: one was found.",
    )
    one.set_defaults(action=_hunt)
    one.add_argument("FILE", help="a campaign's YAML file with ranges, and `hunt`")
    one.add_argument(
        "--cases",
        type=number(1, MOST_CASES),
        default=200,
        metavar="N",
        help="most cases to search (default 200)",
    )
    one.add_argument(
        "--shrink",
        type=number(0, MOST_CASES),
        default=100,
        metavar="N",
        help="most cases to shrink (default 100)",
    )
    one.add_argument("--seed", type=number(0, 2**32 - 1), default=1, metavar="N")
    one.add_argument("--by", choices=("optuna", "hypothesis", "random"), default="optuna")
    one.add_argument("--workers", type=number(1, MOST_WORKERS), metavar="N")
    one.add_argument("--out", metavar="FOLDER", help="of the made worlds")
    one.add_argument(
        "--keep", metavar="FOLDER", help="keep what is found there, as a regression test"
    )
    one.add_argument("--quiet", action="store_true")
    one.add_argument("--json", action="store_true")


def _hunt(arguments: argparse.Namespace) -> int:
    from .hunt import Hunt
    from .regression import check_keep

    if arguments.keep:
        check_keep(Path(arguments.keep))
    hunt = Hunt(arguments.FILE, out=arguments.out)
    best = 1.0

    def progress(count: int, outcome: dict[str, Any], score: float) -> None:
        nonlocal best
        if score < best:
            best = score
            tell(f"{count}: score {score:.3f} {outcome['status']} {outcome['reason']}")

    found = hunt.run(
        cases=arguments.cases,
        seed=arguments.seed,
        by=arguments.by,
        workers=arguments.workers,
        shrink_cases=arguments.shrink,
        progress=None if arguments.quiet or arguments.json else progress,
    )
    if found is None:
        say(
            json.dumps({"found": False, "cases": arguments.cases})
            if arguments.json
            else f"{hunt.name}: nothing was found in {arguments.cases} cases"
        )
        return 0
    kept: str | None = arguments.keep
    wrong: Exception | None = None
    if kept:
        try:
            found.keep(kept)
        except (CampaignError, OSError) as error:  # the find itself is not lost
            kept, wrong = None, error
    say(_as_json(found, kept) if arguments.json else _as_text(found, hunt.name, kept))
    if wrong:
        raise wrong
    return 1


def _as_json(found: Found, kept: str | None) -> str:
    return json.dumps(
        {
            "found": True,
            "cases": found.cases,
            "shrink_cases": found.shrink_cases,
            "status": found.status,
            "reason": found.reason,
            "choices": found.choices,
            "faults": found.content["faults"],
            "kept": kept,
        }
    )


def _as_text(found: Found, name: str, kept: str | None) -> str:
    lines = [
        f"{name}: {found.status} after {found.cases} cases, shrunk by {found.shrink_cases} more: {found.reason}"
    ]
    lines += [f"  {choice} = {value}" for choice, value in found.choices.items()]
    for fault in found.content["faults"]:
        lines.append(f"  fault: {', '.join(f'{key} {value}' for key, value in fault.items())}")
    lines.append(
        f"kept in {kept}: pytest {kept}"
        if kept
        else "keep it as a regression test with --keep FOLDER"
    )
    return "\n".join(lines)
