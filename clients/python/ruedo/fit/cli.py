"""ruedo fit, retrace, import of recorded drives and diff --statistics. Exit codes: 0 good, 2 wrong
usage, 3 bad file, 4 environment.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable
from pathlib import Path as File
from typing import Any

from ..errors import BadWorld, LaunchError, NotSupported, RuedoError
from ..terminal import drop, flush, say, tell
from .errors import FitError, UsageError

GOOD, USAGE, BAD_INPUT, ENVIRONMENT = 0, 2, 3, 4


def main(words: list[str]) -> int:
    try:
        arguments = _parser().parse_args(words)
        code = int(arguments.action(arguments))
        flush()
        return code
    except FitError as error:
        tell(f"ruedo: {error}")
        return error.exit_code
    except (ImportError, NotSupported) as error:
        tell(f"ruedo: {error}; pip install 'ruedo[fit]'")
        return ENVIRONMENT
    except KeyboardInterrupt:
        tell("ruedo: interrupted")
        return ENVIRONMENT
    except BrokenPipeError:
        drop(1)
        return GOOD
    except BadWorld as error:
        tell(f"ruedo: {error}")
        return BAD_INPUT
    except RuedoError as error:
        tell(f"ruedo: {error}")
        return ENVIRONMENT
    except OSError as error:
        tell(f"ruedo: {f'{error.filename}: {error.strerror}' if error.filename else error}")
        return BAD_INPUT if error.filename and not File(error.filename).exists() else ENVIRONMENT


def _parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(prog="ruedo")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    text = "fit a robot's errors to logs of the real one"
    one = commands.add_parser("fit", help=text, description=text + " (docs/fit.md)")
    one.set_defaults(action=_fit)
    one.add_argument("LOG", nargs="+", help="drives of one robot, of any kind that Ruedo reads")
    one.add_argument("--robot", metavar="ROBOT", help="its model: a file, or one of Ruedo's (p3at)")
    one.add_argument(
        "--of", metavar="NAME", default="", help="of an LCM log with several robots: which"
    )
    one.add_argument(
        "--mount",
        type=_mount,
        metavar="X,Y,YAW",
        help="of the range finder on the robot, m and rad (default: as in the model)",
    )
    one.add_argument(
        "--world", metavar="WORLD", help="where the drives were: beams by what they met there"
    )
    one.add_argument("-o", "--output", metavar="FILE", help="the fitted model, SDF")
    one.add_argument("--report", metavar="FILE", help="an HTML page with plots")
    one.add_argument("--json", action="store_true", help="print the values as JSON")
    _add_import(commands)
    _add_retrace(commands)
    _add_diff(commands)
    return top


def _add_import(commands: Any) -> None:
    text = "a world from a recorded drive: walls from its scans along its path"
    one = commands.add_parser("import", help=text, description=text + " (docs/fit.md)")
    one.set_defaults(action=_import)
    one.add_argument("LOG", help="a log with scans and a path, of any kind that Ruedo reads")
    one.add_argument(
        "-o",
        "--out",
        required=True,
        metavar="WORLD",
        help="the world, .sdf; its map is put beside it",
    )
    one.add_argument(
        "--of", metavar="NAME", default="", help="of an LCM log with several robots: which"
    )
    one.add_argument(
        "--resolution",
        type=_number(0.005, 1),
        default=0.05,
        help="side of a cell, m (default 0.05)",
    )
    one.add_argument(
        "--height", type=_number(0.01, 100), default=1.0, help="of the walls, m (default 1)"
    )
    one.add_argument(
        "--mount",
        type=_mount,
        metavar="X,Y,YAW",
        help="of the range finder on the robot, m and rad (default: as the log says, or 0,0,0)",
    )


def _add_retrace(commands: Any) -> None:
    text = "drive a simulated robot along the path, or by the commands, of a real one"
    one = commands.add_parser("retrace", help=text, description=text + " (docs/fit.md)")
    one.set_defaults(action=_retrace)
    one.add_argument("LOG", help="a drive, of any kind that Ruedo reads")
    one.add_argument(
        "--world", required=True, metavar="WORLD", help="a file, such as ruedo import makes"
    )
    one.add_argument(
        "--robot", required=True, metavar="ROBOT", help="its model, such as ruedo fit makes"
    )
    one.add_argument(
        "-o", "--output", required=True, metavar="FILE", help="the log of the simulated drive"
    )
    one.add_argument(
        "--commands",
        action="store_true",
        help="give the robot the log's velocity commands (default: put it on the log's path)",
    )
    one.add_argument(
        "--delay",
        type=_number(0, 10),
        default=0.0,
        metavar="S",
        help="with --commands: seconds until a command acts (default 0)",
    )
    one.add_argument("--seed", type=int, default=1, help="of the simulated errors (default 1)")
    one.add_argument(
        "--of", metavar="NAME", default="", help="of an LCM log with several robots: which"
    )


def _add_diff(commands: Any) -> None:
    """What ruedo diff --statistics hands over."""
    text = "compare two drives by their distributions"
    one = commands.add_parser("diff", help=text, description=text + " (docs/fit.md)")
    one.set_defaults(action=_diff)
    one.add_argument("LOG", nargs=2, help="drives, of any kind that Ruedo reads")
    one.add_argument("--robot", metavar="ROBOT")
    one.add_argument("--html", metavar="FILE")
    one.add_argument("--json", action="store_true")


def _number(low: float, high: float) -> Callable[[str], float]:
    """The type of an option: a number in these bounds."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"{text!r}: allowed is a number from {low:g} to {high:g}"
            )
        return value

    return read


def _mount(text: str) -> tuple[float, ...]:
    try:
        values = tuple(float(one) for one in text.split(","))
    except ValueError:
        values = ()
    if len(values) != 3 or not all(abs(one) < 100 for one in values):
        raise argparse.ArgumentTypeError(f"{text!r}: allowed are three numbers, X,Y,YAW (m, rad)")
    return values


def _import(arguments: argparse.Namespace) -> int:
    from .mapping import own_mount
    from .read import read
    from .worlds import make_world

    recording = read(arguments.LOG, arguments.of)
    mount = tuple(own_mount(recording)) if arguments.mount is None else arguments.mount
    made = make_world(recording, File(arguments.out), mount, arguments.resolution, arguments.height)
    for finding in recording.findings + [one.text() for one in made.moving]:
        tell(f"{recording.file}: {finding}")
    say(made.summary)
    return GOOD


def _retrace(arguments: argparse.Namespace) -> int:
    from .fitting import read_robot
    from .read import read
    from .retrace import retrace

    _check_folder(arguments.output)
    if arguments.delay and not arguments.commands:
        raise UsageError("--delay is for --commands: a path has no delay")
    recording = read(arguments.LOG, arguments.of)
    robot = read_robot(arguments.robot)
    for finding in recording.findings:
        tell(f"{recording.file}: {finding}")
    try:
        done = retrace(
            recording, arguments.world, robot, File(arguments.output),
            by_commands=arguments.commands, delay=arguments.delay, seed=arguments.seed,
        )  # fmt: skip
    except LaunchError as error:
        raise FitError(str(error).split("\n(`")[0]) from None
    if done.jumps:
        tell(f"{recording.file}: the path jumps in {done.jumps} places, over which nothing drives")
    what = "by its commands" if arguments.commands else "on its path"
    say(
        f"{arguments.output}: {done.seconds:.1f} s of {robot.name} {what}; "
        f"its time 0 is {done.begin:.6g} s of {recording.file.name}"
    )
    return GOOD


def _diff(arguments: argparse.Namespace) -> int:
    from .fitting import read_robot
    from .read import read
    from .statistics import compare

    _check_folder(arguments.html)
    robot = read_robot(arguments.robot) if arguments.robot else None
    first, second = (read(one) for one in arguments.LOG)
    found = compare(first, second, robot)
    for remark in found.remarks:
        tell(f"ruedo: {remark}")
    if arguments.html:
        from .report import write_comparison

        write_comparison(found, File(arguments.html))
    say(json.dumps(found.as_dict()) if arguments.json else found.text())
    return GOOD


def _check_folder(file: str | None) -> None:
    if file and not File(file).absolute().parent.is_dir():
        raise UsageError(f"{file}: its folder does not exist")


def _fit(arguments: argparse.Namespace) -> int:
    from .beams import check_world
    from .fitting import fit, read_robot, save
    from .read import read
    from .resume import Kept

    if arguments.output and not arguments.robot:
        raise UsageError("-o needs --robot: the model into which the values are written")
    _check_folder(arguments.output)
    _check_folder(arguments.report)
    robot = read_robot(arguments.robot) if arguments.robot else None
    recordings = [read(one, arguments.of) for one in arguments.LOG]
    world = arguments.world
    if world:
        check_world(world)
    files = [*arguments.LOG, *([robot.file] if robot else [])]
    files += [world] if world and File(world).is_file() else []
    kept = Kept(files, (arguments.of, arguments.mount, world))
    answer = fit(recordings, robot, arguments.mount, kept, world)
    if arguments.output:
        assert robot is not None
        save(answer, robot, File(arguments.output))
    if arguments.report:
        from .report import write_report

        write_report(answer, File(arguments.report))
    for remark in answer.remarks:
        tell(f"ruedo: {remark}")
    if arguments.json:
        say(json.dumps(answer.as_dict()))
    else:
        for part, estimates in answer.parts.items():
            say(part)
            for one in estimates:
                say(f"  {one.text()}")
    return GOOD


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
