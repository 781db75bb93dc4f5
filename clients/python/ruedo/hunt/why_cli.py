"""ruedo why."""

from __future__ import annotations

import argparse
import json
from typing import Any


def add_why(commands: Any) -> None:
    one = commands.add_parser(
        "why",
        help="since when a failed run could not be saved, and what would have saved it",
        description="Since when a failed run could not be saved, and which single change would have saved it. LOG is one that "
        "a campaign kept, or another one of a run with commands alone in which the robot touched something.",
    )
    one.set_defaults(action=_why)
    one.add_argument("LOG")
    one.add_argument("-o", "--output", metavar="FILE", help="a plot: .svg, .png or .pdf")
    one.add_argument("--json", action="store_true")


def _why(arguments: argparse.Namespace) -> int:
    from .why import plot, why

    answer = why(arguments.LOG)
    if arguments.output and answer.rescues:
        plot(answer, arguments.output)
    print(
        json.dumps(
            {
                "failed_s": answer.failed_s,
                "reason": answer.reason,
                "too_late_s": answer.too_late_s,
                "rescues": answer.rescues,
                "changes": answer.changes,
            }
        )
        if arguments.json
        else answer.text()
    )
    return 0
