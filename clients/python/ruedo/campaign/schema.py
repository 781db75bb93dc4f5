"""The JSON schema of a campaign's file, and errors for a wrong one: file, line,
allowed.
"""

from __future__ import annotations

import difflib
import re
from typing import Any

from ..arguments import MOST_SEED
from ..files import parse_yaml
from .errors import SpecError, missing

HALF = re.compile(r"[\ud800-\udfff]")  # surrogates, which no file can hold
# A controller may have the name of any file.
CONTROLLER_NAME = r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029]{1,255}\Z"
_PLAIN_NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,62}\Z"
NAME_RULES = {
    CONTROLLER_NAME: "1 to 255 characters of one line",
    _PLAIN_NAME: "1 to 63 letters, digits, '_', '-' and '.', first a letter or digit",
}
_NAME = {"type": "string", "pattern": _PLAIN_NAME}
_NUMBER = {"type": "number"}
_SEED = {"type": "integer", "minimum": 0, "maximum": MOST_SEED}
_COUNT = {"type": "integer", "minimum": 1, "maximum": 10**9}
_TEXTS = {"type": "array", "items": {"type": "string"}}
_VALUE = {"type": ["string", "number", "boolean"]}
_NUMBER_OR_NAME = {"type": ["number", "string"]}
_PAIR = {"type": "array", "items": _NUMBER, "minItems": 2, "maxItems": 2}


def _object(properties: dict[str, Any], required: tuple[str, ...] = ()) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": properties,
        "required": list(required),
        "additionalProperties": False,
    }


_GOAL = _object(
    {"x": _NUMBER_OR_NAME, "y": _NUMBER_OR_NAME, "radius": _NUMBER_OR_NAME, "by": _NUMBER_OR_NAME},
    ("x", "y", "radius"),
)
_GRID = _object({"from": _NUMBER, "to": _NUMBER, "steps": _COUNT}, ("from", "to", "steps"))
_PARAMETER = {
    "type": ["array", "object"],
    "items": _VALUE,
    "minItems": 1,
    "minProperties": 1,
    "maxProperties": 1,
    "properties": {
        "list": {"type": "array", "items": _VALUE, "minItems": 1},
        "grid": _GRID,
        "uniform": _PAIR,
        "log_uniform": _PAIR,
        "normal": _PAIR,
        "integers": {"type": "array", "items": {"type": "integer"}, "minItems": 2, "maxItems": 2},
    },
    "additionalProperties": False,
}
_WORLD = {
    "type": ["string", "object"],
    "properties": {
        "name": _NAME,
        "file": {"type": "string"},
        "generator": {"type": "string"},
        "parameters": {"type": "object"},
    },
    "additionalProperties": False,
}
_CONTROLLER = _object(
    {
        "name": {"type": "string", "pattern": CONTROLLER_NAME},
        "each": {"type": "string"},
        "command": {"type": "string"},
        "python": {"type": "string"},
        "files": _TEXTS,
        "inputs": _TEXTS,
        "others": _TEXTS,
        "lockstep": {"type": "integer", "minimum": 1, "maximum": 64},
        "no_client_wait": {"type": "boolean"},
        "wait_for": _TEXTS,
        "remap": _TEXTS,
        "hz": {"type": "number", "minimum": 1e-3, "maximum": 1e6},
        "environment": {"type": "object", "additionalProperties": _VALUE},
    },
    ("name",),
)
_FAULT = _object(
    {
        "robot": {"type": "string"},
        "kind": {"type": "string"},
        "target": {"type": "string"},
        "at": _NUMBER_OR_NAME,
        "duration": _NUMBER_OR_NAME,
        "value": _NUMBER_OR_NAME,
        "from": _NUMBER_OR_NAME,
        "to": _NUMBER_OR_NAME,
        "x": _NUMBER_OR_NAME,
        "y": _NUMBER_OR_NAME,
        "heading": _NUMBER_OR_NAME,
    },
    ("kind",),
)
_HUNT = _object(
    {
        "obstacles": _object(
            {
                "most": {"type": "integer", "minimum": 1, "maximum": 20},
                "area": {"type": "array", "items": _NUMBER, "minItems": 4, "maxItems": 4},
                "size": _PAIR,
            },
            ("most", "area"),
        ),
        "faults": {"type": "array", "items": _FAULT, "minItems": 1},
        "seeds": _COUNT,
    }
)
_EXPECT = _object(
    {
        "robot": {"type": "string"},
        "goal": {**_GOAL, "type": ["object", "array"], "items": _GOAL, "minItems": 1},
        "no_contact": {"type": "boolean"},
        "allow_requests": {"type": "boolean"},
        "allow_errors": {"type": "boolean"},
        "clearance": _NUMBER_OR_NAME,
        "odometry_error": _NUMBER_OR_NAME,
        "clearance_reach": {"type": "number", "minimum": 0, "maximum": 100},
        "golden": {"type": "string"},
        "tolerances": _TEXTS,
        "ignore": _TEXTS,
    }
)

SCHEMA: dict[str, Any] = _object(
    {
        "name": _NAME,
        "worlds": {"type": "array", "items": _WORLD, "minItems": 1},
        "robots": {"type": "array", "items": {"type": "string"}, "minItems": 1},
        "controllers": {"type": "array", "items": _CONTROLLER, "minItems": 1},
        "parameters": {"type": "object", "additionalProperties": _PARAMETER},
        "sampling": _object(
            {
                "method": {"enum": ["latin", "random"]},
                "samples": _COUNT,
                "seed": {"type": "integer"},
            }
        ),
        "seeds": {
            "type": ["integer", "array", "object"],
            **{key: _COUNT[key] for key in ("minimum", "maximum")},
            "items": _SEED,
            "minItems": 1,
            "properties": {"first": _SEED, "count": _COUNT},
            "additionalProperties": False,
        },
        "set": {"type": "object", "additionalProperties": _VALUE},
        "disable": _TEXTS,
        "noise": {"type": "boolean"},
        "inputs": _TEXTS,
        "faults": {"type": "array", "items": _FAULT},
        "expect": _EXPECT,
        "metrics": {
            "type": "array",
            "items": _object(
                {"name": _NAME, "python": {"type": "string"}, "files": _TEXTS}, ("name", "python")
            ),
        },
        "limits": _object(
            {
                "duration": {
                    "type": "number",
                    "exclusiveMinimum": 0,
                    "minimum": 1e-3,
                    "maximum": 1e6,
                },
                "wall": {"type": "number", "exclusiveMinimum": 0, "maximum": 1e6},
                "memory_mb": {"type": "integer", "minimum": 16, "maximum": 1 << 30},
            },
            ("duration",),
        ),
        "hunt": _HUNT,
        "keep": _object(
            {"failures": {"type": "boolean"}, "sample": {"type": "integer", "minimum": 0}}
        ),
    },
    ("worlds", "controllers", "limits"),
)


class Source:
    """The lines of a campaign's members in its file; none for one made in Python."""

    def __init__(self, name: str, lines: dict[tuple[Any, ...], int] | None = None) -> None:
        self.name = name
        self._lines = lines or {}

    def error(self, path: tuple[Any, ...], text: str) -> SpecError:
        """path: of the member that is wrong, from the top."""
        line = next(
            (self._lines[path[:n]] for n in range(len(path), -1, -1) if path[:n] in self._lines),
            None,
        )
        where = f"{self.name}:{line}" if line else self.name
        member = "".join(f"[{one}]" if isinstance(one, int) else f".{one}" for one in path).lstrip(
            "."
        )
        return SpecError(f"{where}: {member + ': ' if member else ''}{text}")


def read_yaml(path: str, text: str) -> tuple[Any, Source]:
    """The file's content, and the line of each of its members."""
    try:
        import yaml
    except ImportError:
        raise missing("PyYAML", "campaign") from None
    try:
        node, content = parse_yaml(text)
    except yaml.MarkedYAMLError as error:
        line = f":{error.problem_mark.line + 1}" if error.problem_mark else ""
        raise SpecError(f"{path}{line}: no YAML: {error.problem or error.context}") from None
    except yaml.reader.ReaderError as error:
        at = text.count("\n", 0, error.position) + 1
        wrong = text[error.position : error.position + 1]
        raise SpecError(f"{path}:{at}: no YAML: it holds {wrong!r}") from None
    except yaml.YAMLError as error:
        raise SpecError(f"{path}: no YAML: {error}") from None
    lines: dict[tuple[Any, ...], int] = {}

    def walk(one: Any, at: tuple[Any, ...]) -> None:
        lines.setdefault(at, one.start_mark.line + 1)
        if isinstance(one, yaml.MappingNode):
            seen = set()
            for key, value in one.value:
                if key.value in seen:
                    raise SpecError(
                        f"{path}:{key.start_mark.line + 1}: '{key.value}' is there twice"
                    )
                seen.add(key.value)
                lines[(*at, key.value)] = key.start_mark.line + 1
                walk(value, (*at, key.value))
        elif isinstance(one, yaml.SequenceNode):
            for i, value in enumerate(one.value):
                walk(value, (*at, i))

    if node is not None:
        walk(node, ())
    return content, Source(path, lines)


def check(content: Any, source: Source) -> None:
    """Raises SpecError for the first member that is wrong."""
    try:
        import jsonschema
    except ImportError:
        raise missing("jsonschema", "campaign") from None
    _check_plain(content, source, ())
    types = jsonschema.Draft202012Validator.TYPE_CHECKER.redefine("integer", _is_whole)
    validators: Any = jsonschema.validators
    validator = validators.extend(jsonschema.Draft202012Validator, type_checker=types)
    errors = sorted(
        validator(SCHEMA).iter_errors(content),
        key=lambda error: (  # a name that is misspelt says more than that the right one is missing
            [str(one) for one in error.absolute_path],
            error.validator != "additionalProperties",
        ),
    )
    if errors:
        _raise(errors[0], source)


def _is_whole(_: Any, value: Any) -> bool:
    """Whether it is an int: for JSON's schemas 2.0 is a whole number, too."""
    return isinstance(value, int) and not isinstance(value, bool)


def _check_plain(value: Any, source: Source, path: tuple[Any, ...]) -> None:
    """YAML has more than files: dates, sets, bytes, halves of characters, names that are not
    texts.
    """
    if isinstance(value, str) and HALF.search(value):
        raise source.error(path, f"is {_short(value)}, which holds half of a character")
    if isinstance(value, str) and "\0" in value:
        raise source.error(path, f"is {_short(value)}, which holds the character 0")
    if isinstance(value, dict):
        for key, one in value.items():
            if not isinstance(key, str):
                raise source.error(
                    path, f"has {key!r} for a name; put it in quotes to make it a text"
                )
            _check_plain(key, source, path)
            _check_plain(one, source, (*path, key))
    elif isinstance(value, list):
        for i, one in enumerate(value):
            _check_plain(one, source, (*path, i))
    elif value is not None and not isinstance(value, (str, int, float)):
        raise source.error(path, f"is a {type(value).__name__}; put it in quotes to make it a text")


def _raise(error: Any, source: Source) -> None:
    path = tuple(error.absolute_path)
    value = error.instance
    kind, wanted = error.validator, error.validator_value
    if kind == "additionalProperties":
        known = sorted(error.schema["properties"])
        wrong = next(key for key in value if key not in known)
        near = difflib.get_close_matches(str(wrong), known, 1)
        hint = f"; did you mean '{near[0]}'?" if near else ""
        raise source.error((*path, wrong), f"is not known; allowed are {', '.join(known)}{hint}")
    if kind == "required":
        raise source.error(
            path, f"needs {' and '.join(repr(one) for one in wanted if one not in value)}"
        )
    if kind == "type":
        types = [wanted] if isinstance(wanted, str) else wanted
        raise source.error(
            path, f"is {_short(value)}; allowed is {' or '.join(_TYPES[one] for one in types)}"
        )
    if kind == "enum":
        raise source.error(path, f"is {_short(value)}; allowed are {', '.join(map(str, wanted))}")
    allowed = {
        "minimum": "{} or more",
        "exclusiveMinimum": "more than {}",
        "maximum": "{} or less",
        "minItems": "{} members or more",
        "maxItems": "{} members or fewer",
        "minProperties": "one of list, grid, uniform, log_uniform, normal, integers",
        "maxProperties": "one of list, grid, uniform, log_uniform, normal, integers, not several",
        "pattern": NAME_RULES[wanted] if kind == "pattern" else "",
    }
    raise source.error(
        path, f"is {_short(value)}; allowed is {allowed.get(kind, error.message).format(wanted)}"
    )


_TYPES = {
    "string": "a text",
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
    "array": "a list",
    "object": "members with names",
    "null": "nothing",
}


def _short(value: Any) -> str:
    text = "nothing" if value is None else repr(value)
    return text if len(text) < 60 else text[:57] + "..."
