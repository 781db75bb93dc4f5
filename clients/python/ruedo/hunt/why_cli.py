"""ruedo why."""

from __future__ import annotations

import argparse
import json
from typing import Any

from ..campaign.cli import number
from ..campaign.outputs import check_output
from ..terminal import say


def add_why(commands: Any) -> None:
    one = commands.add_parser(
        "why",
        help="until when a failed run could have been saved, and what would have saved it",
        description="Since when a failed run could not be saved, and which single change would have saved it. LOG is one that "
        "a campaign kept, or another one of a run without requests that acted in which the robot touched something. "
        "The last line says what was not tried.",
    )
    one.set_defaults(action=_why)
    one.add_argument("LOG")
    one.add_argument("-o", "--output", metavar="FILE", help="a plot: .svg, .png or .pdf")
    one.add_argument(
        "--seeds",
        type=number(0, 1000),
        default=5,
        metavar="N",
        help="other seeds to try (default 5)",
    )
    one.add_argument("--json", action="store_true")


def _why(arguments: argparse.Namespace) -> int:
    from .why import check_plot, files_read, plot, why

    if arguments.output:
        check_plot(arguments.output)
        check_output("-o", arguments.output, files_read(arguments.LOG))
    answer = why(arguments.LOG, arguments.seeds)
    if arguments.output and (answer.rescues or answer.seeds):
        plot(answer, arguments.output)
    say(json.dumps(answer.as_dict()) if arguments.json else answer.text())
    return 0
