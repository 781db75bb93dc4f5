"""The cases of a campaign: every combination of its members, each with the hash of all that acts on
it.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import os
import random
import re
import shlex
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from statistics import NormalDist
from typing import Any

from ..arguments import MOST_SEED
from ..files import sha256_of
from .errors import SpecError
from .functions import Function
from .inputs import Folders, hash_of
from .schema import Source
from .worlds import WorldFiles

DEFAULT_MEMORY_MB = 4096
MOST_CASES = 1_000_000
# Of the table of results, before and after those of parameters.
COLUMNS = (
    *("number", "id", "world", "robot", "controller", "seed"),
    *("status", "passed", "what", "reason", "state_hash"),
)
# Of `ruedo regress --json`.
METRICS = (
    *("time_s", "x_m", "y_m", "path_m", "goal_distance_m", "goal_time_s"),
    *("contact_time_s", "clearance_m", "odometry_error_m"),
)
_FARTHEST_M = 1e6  # of an obstacle
_MOST_INTEGER = 2**63 - 1
_TEXTS_OF_EXPECT = (
    *("robot", "no_contact", "allow_requests", "allow_errors", "golden", "tolerances", "ignore"),
)
_TEXTS_OF_FAULT = ("robot", "kind", "target")
_HOLE = re.compile(r"(?<![${])\{([A-Za-z_]\w*)\}")


@dataclass(frozen=True)
class Case:
    """One run of a campaign.

    id: the first 16 digits of a SHA-256 of everything that acts on it: equal ids, equal results.
    what: all that a worker needs to run it. The rest says where in the campaign it stands.
    """

    number: int
    id: str
    world: str
    robot: str
    controller: str
    seed: int
    parameters: dict[str, Any]
    what: dict[str, Any] = field(repr=False)

    @property
    def place(self) -> str:
        """The key by which compare matches cases: all but the controller."""
        return json.dumps([self.world, self.robot, self.seed, self.parameters], sort_keys=True)


def substitute(value: Any, names: dict[str, Any], wrong: Callable[[str], Exception]) -> Any:
    """`{name}` becomes its value; a text that is nothing else becomes the value itself."""
    if isinstance(value, dict):
        return {key: substitute(one, names, wrong) for key, one in value.items()}
    if isinstance(value, list):
        return [substitute(one, names, wrong) for one in value]
    if not isinstance(value, str):
        return value

    def named(match: re.Match[str]) -> Any:
        if match.group(1) not in names:
            raise wrong(
                f"{{{match.group(1)}}} is not a parameter; there are {', '.join(sorted(names))} "
                "(a brace of your own is written twice, {{ and }})"
            )
        return names[match.group(1)]

    whole = _HOLE.fullmatch(value)
    if whole:
        return named(whole)
    text = _HOLE.sub(lambda match: _text(named(match)), value)
    return text.replace("{{", "{").replace("}}", "}")


def _text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _with_texts(members: dict[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    """The members, with those of these names as texts, even if a parameter made them numbers."""
    return {key: _text(value) if key in names else value for key, value in members.items()}


def points(parameters: dict[str, Any], sampling: dict[str, Any]) -> list[dict[str, Any]]:
    """Lists and grids are crossed; distributions are drawn together, as a Latin hypercube by
    default.
    """
    crossed, drawn = {}, {}
    values: Any
    for name, given in parameters.items():
        kind, values = ("list", given) if isinstance(given, list) else next(iter(given.items()))
        if kind == "list":
            crossed[name] = values
        elif kind == "grid":
            crossed[name] = _grid(values["from"], values["to"], values["steps"])
        else:
            drawn[name] = (kind, values)
    samples = _draw(drawn, sampling) if drawn else [{}]
    grid = [dict(zip(crossed, one)) for one in itertools.product(*crossed.values())]
    return [
        {name: {**at, **sample}[name] for name in parameters} for at in grid for sample in samples
    ]


def _grid(low: float, high: float, steps: int) -> list[float]:
    if steps == 1:
        return [low]
    return [_round(low + (high - low) * i / (steps - 1)) for i in range(steps)]


def _draw(
    drawn: dict[str, tuple[str, list[float]]], sampling: dict[str, Any]
) -> list[dict[str, Any]]:
    count = sampling.get("samples", 10)
    latin = sampling.get("method", "latin") == "latin"
    columns = {}
    for name, (kind, bounds) in drawn.items():
        # A column has draws of its own, so that another parameter leaves it as it is. Python
        # promises the numbers of random() for a seed, and of nothing else.
        draw = random.Random(f"{sampling.get('seed', 1)}/{name}")
        strata = sorted(range(count), key=lambda _: draw.random()) if latin else None
        column = [
            (strata[i] + draw.random()) / count if strata else draw.random() for i in range(count)
        ]
        columns[name] = [_at(kind, bounds, p) for p in column]
    return [{name: column[i] for name, column in columns.items()} for i in range(count)]


def _at(kind: str, bounds: list[float], p: float) -> float:
    low, high = bounds
    if kind == "uniform":
        return _round(low + (high - low) * p)
    if kind == "log_uniform":
        return _round(low * (high / low) ** p)
    if kind == "integers":
        return min(int(low + (high - low + 1) * p), int(high))
    return _round(low + high * NormalDist().inv_cdf(min(max(p, 1e-12), 1 - 1e-12)))


def _round(value: float) -> float:
    """9 digits: what is left of another machine's last bits of pow() and the like."""
    return float(f"{value:.9g}")


def check_values(content: dict[str, Any], source: Source) -> None:
    """Checks what a schema cannot. Raises SpecError."""
    for path, value in _leaves(content, ()):
        if isinstance(value, float) and not math.isfinite(value):
            raise source.error(path, f"is {value}; allowed is a finite number")
        if isinstance(value, int) and not -_MOST_INTEGER <= value <= MOST_SEED:
            raise source.error(
                path, f"is a number of {len(str(abs(value)))} digits; allowed are 19"
            )
    for name, given in content.get("parameters", {}).items():
        _check_parameter(name, given, source)
    for member, ways in (("worlds", ("file", "generator")), ("controllers", ("command", "python"))):
        names: set[str] = set()
        for i, one in enumerate(content[member]):
            if isinstance(one, str):
                continue
            if sum(way in one for way in ways) != 1:
                raise source.error((member, i), f"needs either {ways[0]} or {ways[1]}")
            if one.get("name") in names:
                raise source.error(
                    (member, i, "name"), f"is {one['name']!r}, which another entry has already"
                )
            names |= {one["name"]} if "name" in one else set()
    seeds = content.get("seeds", 1)
    if isinstance(seeds, dict) and seeds.get("first", 1) + seeds.get("count", 1) - 1 > MOST_SEED:
        raise source.error(("seeds",), f"go beyond {MOST_SEED}, which is the last")
    if obstacles := content.get("hunt", {}).get("obstacles"):
        x1, y1, x2, y2 = obstacles["area"]
        if not (x1 <= x2 and y1 <= y2 and max(map(abs, obstacles["area"])) <= _FARTHEST_M):
            raise source.error(
                ("hunt", "obstacles", "area"),
                f"is {obstacles['area']}; allowed is [x1, y1, x2, y2], the least values first, "
                f"of at most {_FARTHEST_M:g} m",
            )
        if "size" in obstacles and not 0 < obstacles["size"][0] <= obstacles["size"][1]:
            raise source.error(
                ("hunt", "obstacles", "size"),
                f"is {obstacles['size']}; allowed is [from, to], both above 0",
            )
    _check_columns(content, source)
    _check_count(content, source)


def _check_columns(content: dict[str, Any], source: Source) -> None:
    """Parameters and metrics are columns of the table of results, beside its own."""
    taken = {*COLUMNS, *METRICS}
    for name in content.get("parameters", {}):
        if name in taken:
            raise source.error(
                ("parameters", name),
                f"is a column of the results: {', '.join((*COLUMNS, *METRICS))}",
            )
    taken |= set(content.get("parameters", {}))
    for i, metric in enumerate(content.get("metrics", [])):
        if metric["name"] in taken:
            raise source.error(
                ("metrics", i, "name"),
                f"is {metric['name']!r}, which another column of the results is called",
            )
        taken.add(metric["name"])


def _check_parameter(name: str, given: Any, source: Source) -> None:
    if not name.isidentifier() or name in (
        "seed",
        "case",
        "world",
        "robot",
        "controller",
        "folder",
    ):
        raise source.error(
            ("parameters", name),
            "is not a name of a parameter: letters, digits and '_', and "
            "not seed, case, world, robot, controller or folder",
        )
    kind = None if isinstance(given, list) else next(iter(given))
    if kind in ("uniform", "log_uniform", "integers"):
        low, high = given[kind]
        if low > high or (kind == "log_uniform" and low <= 0):
            raise source.error(
                ("parameters", name, kind),
                f"is {given[kind]}; allowed is [low, high]"
                + (", both above 0" if kind == "log_uniform" else ""),
            )
        if not math.isfinite(high / low if kind == "log_uniform" else high - low):
            raise source.error(
                ("parameters", name, kind),
                f"is {given[kind]}; they are too far from each other",
            )
    if kind == "grid":
        low, high, steps = (given[kind][key] for key in ("from", "to", "steps"))
        if not math.isfinite((high - low) * max(steps - 1, 1)):
            raise source.error(
                ("parameters", name, kind),
                f"goes from {low} to {high}; they are too far from each other",
            )
    if kind == "normal" and not math.isfinite(abs(given[kind][0]) + 10 * abs(given[kind][1])):
        raise source.error(("parameters", name, kind), f"is {given[kind]}; that is too large")
    if kind == "normal" and given[kind][1] < 0:
        raise source.error(
            ("parameters", name, kind),
            f"is {given[kind]}; allowed is [mean, sigma], sigma 0 or more",
        )


def _check_count(content: dict[str, Any], source: Source) -> None:
    """Before any of them is made: a short file may ask for more than any machine holds."""
    drawn, count = False, 1
    values: Any
    for given in content.get("parameters", {}).values():
        kind, values = ("list", given) if isinstance(given, list) else next(iter(given.items()))
        drawn |= kind not in ("list", "grid")
        count *= len(values) if kind == "list" else values["steps"] if kind == "grid" else 1
    seeds = content.get("seeds", 1)
    count *= content.get("sampling", {}).get("samples", 10) if drawn else 1
    count *= len(content["worlds"]) * len(content.get("robots", [""])) * len(content["controllers"])
    count *= (
        seeds
        if isinstance(seeds, int)
        else seeds.get("count", 1)
        if isinstance(seeds, dict)
        else len(seeds)
    )
    if count > MOST_CASES:
        raise source.error(
            (),
            f"{count} cases (worlds, robots, controllers, parameters and seeds, multiplied); "
            f"allowed are {MOST_CASES}: make several campaigns of it",
        )


def _check_numbers(
    value: Any, texts: tuple[str, ...], path: tuple[Any, ...], source: Source
) -> None:
    """Checks numbers that the file may give as names of parameters, once these are replaced."""
    for at, one in _leaves(value, path):
        if any(name in texts for name in at):
            continue
        if isinstance(one, bool) or not isinstance(one, (int, float)):
            raise source.error(at, f"is {one!r}; allowed is a number")


def _check_expectations(expect: dict[str, Any], source: Source) -> None:
    """The ranges of `ruedo regress`: beyond them an expectation always holds, or never."""
    for name in ("tolerances", "ignore"):
        if name in expect and "golden" not in expect:
            raise source.error(("expect", name), "needs expect.golden, the log to compare with")
    for at, one in _leaves(expect, ("expect",)):
        if at[-1] in ("radius", "by") and not one > 0:
            raise source.error(at, f"is {one}; allowed is more than 0")
        for name, most in (("clearance", 100.0), ("odometry_error", 1e6)):
            if at[-1] == name and not 0 <= one <= most:
                raise source.error(at, f"is {one}; allowed is 0 to {most:g}")


def _leaves(value: Any, path: tuple[Any, ...]) -> Iterator[tuple[tuple[Any, ...], Any]]:
    if isinstance(value, dict):
        for key, one in value.items():
            yield from _leaves(one, (*path, key))
    elif isinstance(value, list):
        for i, one in enumerate(value):
            yield from _leaves(one, (*path, i))
    else:
        yield path, value


def seeds_of(given: Any) -> list[int]:
    """A number is a count from 1 on."""
    if isinstance(given, int):
        return list(range(1, given + 1))
    if isinstance(given, dict):
        return [given.get("first", 1) + i for i in range(given.get("count", 1))]
    return list(dict.fromkeys(given))


class Planner:
    """Makes the cases of a checked campaign. folder: where its paths begin; store: where made
    worlds go.

    worlds, folders: of an earlier plan of the same folder, which has read them already.
    """

    def __init__(
        self,
        content: dict[str, Any],
        source: Source,
        folder: Path,
        store: Path,
        version: str,
        worlds: WorldFiles | None = None,
        folders: Folders | None = None,
    ) -> None:
        self._content, self._source, self._folder, self._version = content, source, folder, version
        self._worlds = worlds or WorldFiles(folder, store)
        self._worlds.allow_errors = content.get("expect", {}).get("allow_errors", False)
        self._folders = folders or Folders(store.parent)
        self._hashes: dict[str, str] = {}
        self._beside_files: dict[str, str] = {}
        self._beside_hashes: dict[tuple[Any, ...], list[str]] = {}
        self._functions: dict[str, Function] = {}

    def cases(self) -> list[Case]:
        """All of them, in the order of the file."""
        content = self._content
        grid = points(content.get("parameters", {}), content.get("sampling", {}))
        robots = content.get("robots", [""])
        made: list[Case] = []
        for (w, world), robot, controller, at, seed in itertools.product(
            enumerate(content["worlds"]),
            robots,
            enumerate(content["controllers"]),
            grid,
            seeds_of(content.get("seeds", 1)),
        ):
            made.append(self._case(len(made), w, world, robot, controller, at, seed))
        seen: set[str] = set()
        for case in made:
            if case.id in seen:
                raise SpecError(
                    f"{self._source.name}: case {case.number} is the same as another one: two of its "
                    "worlds, robots, controllers or parameters do not differ in what they do"
                )
            seen.add(case.id)
        return made

    @property
    def files(self) -> dict[str, str]:
        """All that the cases are made from, with their hashes."""
        return (
            self._worlds.files
            | self._beside_files
            | {str(self._folder / name): sha256 for name, sha256 in self._hashes.items()}
            | {str(function.file): function.sha256 for function in self._functions.values()}
        )

    @property
    def named_files(self) -> set[str]:
        """The files that the campaign names, with its worlds."""
        return self.files.keys() - self._beside_files.keys()

    def _case(
        self,
        number: int,
        w: int,
        world: Any,
        robot: str,
        controller: tuple[int, dict[str, Any]],
        at: dict[str, Any],
        seed: int,
    ) -> Case:
        c, asked = controller
        names = {**at, "seed": seed, "folder": str(self._folder)}

        def fill(path: tuple[Any, ...], value: Any) -> Any:
            return substitute(value, names, lambda text: self._source.error(path, text))

        content = self._content
        expect = self._expect(fill)
        faults = fill(("faults",), content.get("faults", []))
        _check_numbers(faults, _TEXTS_OF_FAULT, ("faults",), self._source)
        limits = content["limits"]
        what: dict[str, Any] = {
            "world": self._world(w, world, robot, fill, at, seed),
            "settings": fill(("set",), content.get("set", {})),
            "disable": [_text(one) for one in fill(("disable",), content.get("disable", []))],
            "noise": content.get("noise", True),
            "seed": seed,
            "parameters": at,
            "controller": self._controller(c, asked, fill),
            "expect": expect,
            "faults": [_with_texts(one, _TEXTS_OF_FAULT) for one in faults],
            "metrics": [
                self._metric(("metrics", i), one)
                for i, one in enumerate(content.get("metrics", []))
            ],
            "limits": {
                "duration": limits["duration"],
                "wall": limits.get("wall", 300),
                "memory_mb": limits.get("memory_mb", DEFAULT_MEMORY_MB),
            },
        }
        digest = hashlib.sha256(canonical([self._version, _acting(what)])).hexdigest()[:16]
        return Case(
            number,
            digest,
            what["world"]["name"],
            what["world"]["robot"],
            asked["name"],
            seed,
            at,
            what,
        )

    def _expect(self, fill: Callable[..., Any]) -> dict[str, Any]:
        expect = fill(("expect",), self._content.get("expect", {}))
        _check_numbers(expect, _TEXTS_OF_EXPECT, ("expect",), self._source)
        _check_expectations(expect, self._source)
        if isinstance(expect.get("goal"), dict):
            expect["goal"] = [expect["goal"]]
        made = _with_texts(expect, ("robot", "golden"))
        if "golden" in made:
            made["golden_sha256"] = self._sha256(("expect", "golden"), made["golden"])
        return made

    def _world(
        self,
        w: int,
        world: Any,
        robot: str,
        fill: Callable[..., Any],
        at: dict[str, Any],
        seed: int,
    ) -> dict[str, Any]:
        asked = {"file": world} if isinstance(world, str) else world
        path = ("worlds", w)
        spawn = _text(fill(("robots",), robot))
        try:
            if "file" in asked:
                file = self._worlds.find(_text(fill(path, asked["file"])))
                name = asked.get("name", Path(file).stem)
            else:
                generator = self._function((*path, "generator"), asked["generator"])
                given = fill((*path, "parameters"), asked.get("parameters", {}))
                file = self._worlds.generate(generator, given)
                name = asked.get("name", asked["generator"].rpartition(":")[2])
            spawned = self._worlds.find_robot(spawn)
            hashed = self._worlds.sha256(file, spawned)
        except (ValueError, OSError) as error:
            raise self._source.error(path, str(error)) from None
        return {"name": name, "file": file, "robot": spawn, "spawn": spawned, "sha256": hashed}

    def _controller(
        self, c: int, asked: dict[str, Any], fill: Callable[..., Any]
    ) -> dict[str, Any]:
        path = ("controllers", c)
        made = {
            key: fill((*path, key), value)
            for key, value in asked.items()
            if key not in ("name", "files", "inputs", "others")
        }
        made = _with_texts(made, ("command", "python"))
        files = self._named((*path, "files"), asked.get("files", []))
        for at, patterns in (
            (path, asked.get("inputs", [])),
            ((), self._content.get("inputs", [])),
        ):
            files |= self._named((*at, "inputs"), patterns)
        homes = [self._folder]
        if "command" in made:
            for word in sorted(words_of(made["command"])):
                if word and os.path.isfile(self._folder / word):  # or too long for a name
                    files[word] = self._sha256((*path, "command"), word)
                    homes += [] if os.path.isabs(word) else [(self._folder / word).parent]
        else:
            function = self._function((*path, "python"), made["python"])
            files["python"] = function.sha256
            homes += [] if function.is_installed else [function.file.parent]
        if "files" not in asked:  # which says exactly what counts
            made["beside"] = self._beside(path, homes, asked.get("others", []))
        return {**made, "files": files}

    def _metric(self, path: tuple[Any, ...], asked: dict[str, Any]) -> dict[str, Any]:
        function = self._function((*path, "python"), asked["python"])
        made = {**asked, "sha256": function.sha256}
        made["files"] = self._named((*path, "files"), asked.get("files", []))
        if "files" not in asked and not function.is_installed:
            others = [
                one for made_by in self._content["controllers"] for one in made_by.get("others", [])
            ]
            made["beside"] = self._beside(path, [function.file.parent], others)
        return made

    def _named(self, path: tuple[Any, ...], patterns: list[str]) -> dict[str, str]:
        """The files that match, with their hashes; of a folder those that may matter."""
        named: dict[str, str] = {}
        for i, pattern in enumerate(patterns):
            for one in files_called(pattern, self._folder, (*path, i), self._source, path[-1]):
                name = str(one.relative_to(self._folder))
                if one.is_dir():
                    named[name] = hash_of(self._below((*path, i), one))
                else:
                    named[name] = self._sha256((*path, i), str(one))
        return named

    def _beside(self, path: tuple[Any, ...], homes: list[Path], others: list[str]) -> list[str]:
        """Hashes of what lies in the controller's folders. others: files that are other
        controllers'.
        """
        key = (tuple(homes), tuple(others))
        if key not in self._beside_hashes:
            but = {
                os.path.realpath(one) for pattern in others for one in self._folder.glob(pattern)
            }
            roots = dict.fromkeys(os.path.realpath(home) for home in homes)
            outer = [one for one in roots if not any(one.startswith(up + os.sep) for up in roots)]
            hashes = []
            for root in outer:
                found = self._below(path, Path(root)).items()
                kept = {name: one for name, one in found if os.path.join(root, name) not in but}
                hashes.append(hash_of(kept))
            self._beside_hashes[key] = hashes
        return self._beside_hashes[key]

    def _below(self, path: tuple[Any, ...], folder: Path) -> dict[str, str]:
        try:
            found = self._folders.below(folder)
        except (ValueError, OSError) as error:
            raise self._source.error(path, str(error)) from None
        self._beside_files |= {os.path.join(folder, name): one for name, one in found.items()}
        return found

    def _function(self, path: tuple[Any, ...], name: str) -> Function:
        if name not in self._functions:
            try:
                self._functions[name] = Function(name, self._folder)
            except ValueError as error:
                raise self._source.error(path, str(error)) from None
        return self._functions[name]

    def _sha256(self, path: tuple[Any, ...], name: str) -> str:
        if name not in self._hashes:
            try:
                self._hashes[name] = sha256_of(self._folder / name)
            except OSError as error:
                raise self._source.error(
                    path, f"{name} cannot be read: {error.strerror or error}"
                ) from None
        return self._hashes[name]


def is_expected(what: dict[str, Any]) -> bool:
    """Whether more is asked of a case than that it runs."""
    expect = what["expect"]
    names = ("goal", "clearance", "odometry_error", "golden")
    return expect.get("no_contact", False) or any(name in expect for name in names)


def words_of(command: str) -> set[str]:
    """The words of a shell's line, as written and with quotes removed."""
    words = set(re.split(r"[\s'\"=]+", command))
    reader = shlex.shlex(command, posix=True, punctuation_chars=True)
    reader.whitespace_split, reader.commenters = True, ""
    with suppress(ValueError):  # of a quote that does not end, the shell's matter
        words.update(reader)
    return words


def files_called(
    pattern: str, folder: Path, path: tuple[Any, ...], source: Source, member: str = ""
) -> list[Path]:
    """Those in the folder that a member of the campaign means, at least one; of `inputs` folders,
    too.
    """
    try:
        found = sorted(
            one
            for one in folder.glob(pattern)
            if one.is_file() or (member == "inputs" and one.is_dir())
        )
    except (ValueError, NotImplementedError, IndexError, OSError):  # "", "/etc/*", ".", "aaa..."
        found = []
    if not found:
        raise source.error(path, f"is {pattern!r}, which matches no file in {folder}")
    return found


def canonical(value: Any) -> bytes:
    """The value as JSON: equal values give equal bytes."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True).encode()


def _acting(what: dict[str, Any]) -> dict[str, Any]:
    """The inputs without folder names: the same on every machine."""
    world = {key: what["world"][key] for key in ("robot", "sha256")}
    expect = {key: value for key, value in what["expect"].items() if key != "golden"}
    return {**what, "world": world, "expect": expect}


def shard_of(cases: list[Case], shard: str) -> list[Case]:
    """I/N: every N-th case, from the I-th on (1 is the first)."""
    match = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", shard)
    if not match or not 1 <= int(match.group(1)) <= int(match.group(2)):
        raise SpecError(f"--shard {shard}: it looks like I/N with I from 1 to N, for example 2/4")
    found = cases[int(match.group(1)) - 1 :: int(match.group(2))]
    if not found:
        raise SpecError(f"--shard {shard}: there are {len(cases)} cases, and none is in it")
    return found
