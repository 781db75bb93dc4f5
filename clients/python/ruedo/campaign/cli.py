"""The command line of campaigns. Exit codes: 0 good, 1 a case failed, 2 wrong usage, 3 bad file, 4
environment.
"""

from __future__ import annotations

import argparse
import importlib
import io
import json
import os
import re
import shlex
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..terminal import drop, flush, say, tell

MOST_WORKERS = 100_000
GOOD, FAILED, USAGE, BAD_INPUT, ENVIRONMENT = range(5)


def main(words: list[str]) -> int:
    try:
        from .errors import CampaignError
    except ImportError as error:
        tell(f"ruedo: {error}; pip install 'ruedo[campaign]'")
        return ENVIRONMENT
    for stream in (sys.stdout, sys.stderr):  # a file's name may be no text
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    for end in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(end) == signal.SIG_DFL:  # not ignored, as by nohup
            signal.signal(end, signal.default_int_handler)  # as Ctrl-C
    arguments = argparse.Namespace()
    try:
        arguments = _parser().parse_args(words)
        code = int(arguments.action(arguments))
        flush()
        return code
    except CampaignError as error:
        tell(f"ruedo: {error}")
        return error.exit_code
    except ImportError as error:
        tell(f"ruedo: {error}; pip install 'ruedo[campaign]'")
        return ENVIRONMENT
    except KeyboardInterrupt:
        tell(f"ruedo: interrupted{getattr(arguments, 'kept', '')}")
        return ENVIRONMENT
    except BrokenPipeError:
        drop(1)
        return GOOD
    except OSError as error:  # a file that cannot be written, a full disk
        said = f"{error.filename}: {error.strerror}" if error.filename else str(error)
        tell(f"ruedo: {said}")
        return ENVIRONMENT


class _Once(argparse.Action):
    """An option with a value, of which argparse would take the last one without a word."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        given = vars(namespace).setdefault("_given", set())
        if option_string and self.dest in given:
            raise argparse.ArgumentError(self, "is given twice")
        given.add(self.dest)
        setattr(namespace, self.dest, values)


class _Parser(argparse.ArgumentParser):
    """A parser that refuses repeated options; its subparsers are of this class, too."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.register("action", None, _Once)


def _parser() -> argparse.ArgumentParser:
    top = _Parser(prog="ruedo", formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    _add_campaign(commands.add_parser("campaign", help="many runs, judged and reported"))
    for module, function in (("ruedo.hunt.cli", "add_hunt"), ("ruedo.hunt.why_cli", "add_why")):
        try:
            getattr(importlib.import_module(module), function)(commands)
        except ModuleNotFoundError as error:
            if not (error.name or "").startswith("ruedo.hunt"):
                raise
    return top


def number(low: int, high: int) -> Callable[[str], int]:
    """The type of an option: a whole number in these bounds."""

    def read(text: str) -> int:
        if not re.fullmatch("-?[0-9]{1,20}", text) or not low <= int(text) <= high:
            raise argparse.ArgumentTypeError(
                f"{text!r}: allowed is a whole number from {low} to {high}"
            )
        return int(text)

    return read


def _add_execution(one: argparse.ArgumentParser) -> None:
    """How the cases are run, and what is said of it."""
    one.add_argument(
        "--workers",
        type=number(1, MOST_WORKERS),
        metavar="N",
        help="processes on this machine (default: one a core)",
    )
    one.add_argument("--ray", metavar="auto|ADDRESS", help="on a Ray cluster")
    one.add_argument("--shard", metavar="I/N", help="every N-th case, from the I-th on")
    one.add_argument("--quiet", action="store_true", help="no progress; the sum at the end")
    one.add_argument("--json", action="store_true", help="the sum at the end as JSON")
    one.add_argument("--junit", metavar="FILE", help="write the results for CI")


def _add_report(one: argparse.ArgumentParser) -> None:
    one.add_argument(
        "-o", "--output", metavar="FILE", help="default: report.html in the results' folder"
    )
    one.add_argument(
        "--baseline", metavar="FOLDER", help="results of another campaign, to compare with"
    )
    one.add_argument(
        "--pages",
        type=number(0, 1000),
        default=3,
        metavar="N",
        help="failed runs, the worst, that are repeated and put beside the report as pages of the "
        "web console (default: 3)",
    )


def _add_slurm(one: argparse.ArgumentParser) -> None:
    one.add_argument("--tasks", type=number(1, 1_000_000), default=10, metavar="N")
    one.add_argument("--cores", type=number(1, MOST_WORKERS), default=8, help="of each task")
    one.add_argument("--time", type=_duration, default="04:00:00", metavar="H:M:S")


def _add_export(one: argparse.ArgumentParser) -> None:
    one.add_argument(
        "-o", "--output", required=True, metavar="FILE", help="*.csv, *.parquet or *.xml (JUnit)"
    )


def _add_campaign(parser: argparse.ArgumentParser) -> None:
    kinds = parser.add_subparsers(
        required=True, metavar="run|resume|status|report|show|repeat|slurm|join|export|compare"
    )

    def add(
        name: str, action: Callable[[argparse.Namespace], int], text: str
    ) -> argparse.ArgumentParser:
        one = kinds.add_parser(name, help=text, description=text)
        one.set_defaults(action=action)
        one.add_argument("FILE", help="the campaign's YAML file")
        one.add_argument(
            "--out",
            metavar="FOLDER",
            help="where the results are (default: FILE's name with .campaign)",
        )
        return one

    for name in ("run", "resume"):
        one = add(name, _run, "run all cases that have no result yet")
        one.set_defaults(kept="; finished cases are kept, `ruedo campaign resume` runs the others")
        _add_execution(one)
    add("status", _status, "how far it is, and how it goes").add_argument(
        "--json", action="store_true"
    )
    _add_report(add("report", _report, "write one HTML page that needs no network"))
    add("show", _show, "all there is of a case").add_argument(
        "CASE", help="its number, or the beginning of its id"
    )
    one = add("repeat", _repeat, "run a case again, with a log of all its messages")
    one.add_argument("CASE", help="its number, or the beginning of its id")
    one.add_argument("-o", "--output", metavar="LOG", help="default: ID.lcm here")
    _add_slurm(add("slurm", _slurm, "print a job array for Slurm; each task is a shard"))
    add("join", _join, "take over the results of shards").add_argument("FOLDERS", nargs="+")
    _add_export(add("export", _export, "write the table of results"))
    one = add(
        "compare",
        _compare,
        "Which cases became worse, with an exact test. A case is worse when it had passed and now has "
        "not (failed, not judged, crashed, timeout, memory, invalid). Exit code 1: one became worse, "
        "or there is no case in both.",
    )
    one.add_argument(
        "BASELINE",
        help="folder of the other campaign's results, or a controller of this one after a colon (:NAME)",
    )
    one.add_argument("--json", action="store_true")


def _duration(text: str) -> str:
    if not re.fullmatch(r"([0-9]+-)?[0-9]+(:[0-9]+){0,2}", text):
        raise argparse.ArgumentTypeError(f"{text!r}: it looks like H:M:S, or D-H:M:S")
    return text


def _campaign(arguments: argparse.Namespace) -> Any:
    from .campaign import Campaign

    return Campaign(arguments.FILE, out=arguments.out)


def _output(campaign: Any, option: str, file: str, *others: Path) -> Path:
    """Before any work: a file that the command may write."""
    from .outputs import check_output

    return check_output(option, file, [*campaign.files_read, *others])


def _run(arguments: argparse.Namespace) -> int:
    from .outputs import write_text
    from .progress import shown

    campaign = _campaign(arguments)
    junit = None
    if arguments.junit:
        campaign.out.mkdir(parents=True, exist_ok=True)  # the output may belong there
        junit = _output(campaign, "--junit", arguments.junit)
    if not arguments.quiet:
        _name_unknown_programs(campaign)
        _name_changes(campaign)
    with shown(campaign, arguments.shard, arguments.quiet or arguments.json) as progress:
        results = campaign.run(
            workers=arguments.workers, ray=arguments.ray, shard=arguments.shard, progress=progress
        )
    if campaign.outputs and not arguments.quiet:
        written = sorted(os.path.relpath(one, campaign.folder) for one in campaign.outputs)
        more = f" and {len(written) - 3} more" if len(written) > 3 else ""
        tell(
            f"ruedo: written while the cases ran: {', '.join(written[:3])}{more}; that counts as no "
            "input from now on (name an input in `inputs`)"
        )
    if junit:
        write_text(junit, results.junit(campaign.name))
    if arguments.json:
        say(json.dumps(_summary(campaign, results)))
    else:
        _print_summary(campaign, results)
    return FAILED if results.failed else GOOD


def _name_unknown_programs(campaign: Any) -> None:
    """Warns about controllers whose program files are unknown: cases are not run again when they
    change.
    """
    made = {case.controller: case.what["controller"] for case in campaign.cases}
    for name, one in made.items():
        if "command" in one and not one["files"]:
            tell(
                f"ruedo: controller {name}: no file of {campaign.folder} is found in its command, so "
                "that it is not run again when its program changes: name that in `inputs`"
            )


def _name_changes(campaign: Any) -> None:
    """Prints changed input files, since even a picture put into the folder makes all cases run
    again.
    """
    changed = campaign.changes()
    if changed:
        more = f" and {len(changed) - 3} more" if len(changed) > 3 else ""
        tell(
            f"ruedo: changed since the last run: {', '.join(changed[:3])}{more}; the cases that this "
            "belongs to need new results (what does not belong to a controller: see `files`)"
        )


def _results(campaign: Any) -> Any:
    """The results so far."""
    results = campaign.results()
    if len(results.done) < len(results.cases):
        _name_changes(campaign)
    return results


def _summary(campaign: Any, results: Any) -> dict[str, Any]:
    from .plan import is_expected

    statuses: dict[str, int] = {}
    for _, row in results.done:
        statuses[row["status"]] = statuses.get(row["status"], 0) + 1
    return {
        "campaign": campaign.name,
        "cases": len(results.cases),
        "done": len(results.done),
        "failed": len(results.failed),
        "status": dict(sorted(statuses.items())),
        "expected": any(is_expected(case.what) for case in results.cases),
        "folder": str(campaign.out),
    }


def _print_summary(campaign: Any, results: Any) -> None:
    summary = _summary(campaign, results)
    kinds = ", ".join(f"{count} {status}" for status, count in summary["status"].items()) or "none"
    say(
        f"{campaign.name}: {summary['done']} of {summary['cases']} cases: {kinds}; in {campaign.out}"
    )
    if not summary["expected"]:
        say("  nothing was expected but that the controllers run to their end (`expect`)")
    for case, row in results.failed[:10]:
        say(f"  {case.number} {case.id} {row['status']}: {row['reason']}")
    if len(results.failed) > 10:
        say(f"  ... and {len(results.failed) - 10} more: `ruedo campaign report`")


def _status(arguments: argparse.Namespace) -> int:
    campaign = _campaign(arguments)
    results = _results(campaign)
    if arguments.json:
        say(json.dumps(_summary(campaign, results)))
    else:
        _print_summary(campaign, results)
    return GOOD


def _report(arguments: argparse.Namespace) -> int:
    from .report import write_report

    campaign = _campaign(arguments)
    file = Path(arguments.output or campaign.out / "report.html")
    if arguments.output:
        compared = [Path(arguments.baseline) / "results.sqlite"] if arguments.baseline else []
        _output(campaign, "-o", arguments.output, *compared)
    _results(campaign)
    write_report(campaign, file, arguments.baseline, arguments.pages)
    say(str(file))
    return GOOD


def _show(arguments: argparse.Namespace) -> int:
    campaign = _campaign(arguments)
    case = campaign.case(arguments.CASE)
    results = _results(campaign)
    row = results.row(case)
    say(
        f"case {case.number}, id {case.id}: world {case.world}, {case.robot or 'its robot'}, controller {case.controller}, seed {case.seed}"
    )
    for name, value in case.parameters.items():
        say(f"  {name} = {value}")
    if row is None:
        say("not run yet")
        return GOOD
    say(f"{row['status']}{': ' + row['reason'] if row['reason'] else ''}")
    for name, value in row["metrics"].items():
        say(f"  {name} {value:.6g}")
    log = results.log(case)
    if log:
        say(f"log of what acted: {log} (ruedo verify {log})")
    say(
        f"again, with all messages: ruedo campaign repeat {shlex.quote(arguments.FILE)} {case.number}"
    )
    if row["output"]:
        say("---- the end of the controller's output\n" + row["output"].rstrip())
    return GOOD


def _repeat(arguments: argparse.Namespace) -> int:
    from .local import Crew

    campaign = _campaign(arguments)
    case = campaign.case(arguments.CASE)
    log = _output(campaign, "-o", arguments.output or f"{case.id}.lcm").resolve()
    with Crew(str(campaign.folder)) as crew:
        outcome = crew.run_one(case.what, full_log=str(log))
    row = _results(campaign).row(case)
    say(f"{outcome.status}{': ' + outcome.reason if outcome.reason else ''}")
    say(f"{log}: ruedo play {log} --view, ruedo verify {log}")
    if row is None:
        return GOOD
    same = (outcome.status, outcome.reason, outcome.state_hash) == (
        row["status"],
        row["reason"],
        row["state_hash"],
    )
    say(
        "as in the campaign, to the last bit of the state"
        if same
        else f"in the campaign it was another run: {row['status']}{': ' + row['reason'] if row['reason'] else ''}; a controller that is not "
        "in lockstep may differ from run to run (docs/regressions.md)"
    )
    return GOOD if same else FAILED


def _slurm(arguments: argparse.Namespace) -> int:
    campaign = _campaign(arguments)
    file = shlex.quote(str(Path(arguments.FILE).resolve()))
    out = str(campaign.out.resolve())
    count = min(arguments.tasks, len(campaign.cases))
    say(f"""#!/bin/bash
#SBATCH --job-name={campaign.name}
#SBATCH --array=1-{count}
#SBATCH --cpus-per-task={arguments.cores}
#SBATCH --time={arguments.time}
#SBATCH --output={out}.%a.out
# Each task has a folder of its own. After the last: ruedo campaign join {file}
# {shlex.quote(out)}.shard* A task that was cut off continues when this script is
# submitted again.
ruedo campaign run {file} --quiet --workers "$SLURM_CPUS_PER_TASK" \\
  --shard "$SLURM_ARRAY_TASK_ID/{count}" --out {shlex.quote(out)}.shard"$SLURM_ARRAY_TASK_ID"
[ $? -le 1 ]    # a case that failed is a result, not a failure of the task""")
    return GOOD


def _join(arguments: argparse.Namespace) -> int:
    campaign = _campaign(arguments)
    taken = campaign.join(arguments.FOLDERS)
    say(f"took over {taken} results")
    _print_summary(campaign, _results(campaign))
    return GOOD


def _export(arguments: argparse.Namespace) -> int:
    from .errors import UsageError
    from .outputs import replacing, write_text

    kind = Path(arguments.output).suffix
    if kind not in (".csv", ".parquet", ".xml"):
        raise UsageError(f"-o {arguments.output}: its name ends with .csv, .parquet or .xml")
    campaign = _campaign(arguments)
    file = _output(campaign, "-o", arguments.output)
    results = _results(campaign)
    if kind == ".parquet":
        with replacing(file) as part:
            results.parquet(str(part))
    else:
        write_text(file, results.csv() if kind == ".csv" else results.junit(campaign.name))
    say(f"{file}: {len(results.done)} of {len(results.cases)} cases")
    return GOOD


def _compare(arguments: argparse.Namespace) -> int:
    from .compare import compare_with

    campaign = _campaign(arguments)
    _results(campaign)
    comparison = compare_with(campaign, arguments.BASELINE)
    say(json.dumps(comparison.as_dict()) if arguments.json else comparison.text())
    return FAILED if comparison.worse else GOOD
