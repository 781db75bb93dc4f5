"""The reference for people: docs/messages.md, of samples, enumerations and requests."""

from __future__ import annotations

import cpp
import java
import python
from table import Argument, Enum, Record, Request, Vocabulary

HEAD = """# Samples, enumerations and requests

The words of the clients, as `proto/vocabulary.toml` has them; `python3 proto/generator pages docs` makes this page from it and
`proto/*.lcm`. Java has the same names in camel case. Units are SI and angles radians unless a field says otherwise; x is ahead, y left,
z up; quaternions are w, x, y, z. Every sample has `utime`, the sim time in microseconds of the state that it shows, and `time`, the same in
seconds. [Protocol](protocol.md) has the channels, and [Compatibility](compatibility.md) what may change.

`read_log` gives a recorded sample by the same names: in C++ and Java as the classes below, in Python as columns of the same names.
"""


def row(*cells: str) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def types(record: Record, vocabulary: Vocabulary) -> list[str]:
    lines = ["| Field | C++ | Python | Java | |", "|---|---|---|---|---|"]
    for one in record.fields:
        shown = {"cpp": "", "python": "", "java": ""}
        if "cpp" in one.languages:
            shown["cpp"] = cpp.declaration(one, vocabulary).split(f" {one.name}")[0]
        if "java" in one.languages:
            shown["java"] = java.type_of(one, vocabulary)
        if "python" in one.languages:
            shape = python.shape_of(one)
            array = python.ARRAYS.get(one.member.type if one.member else "", "float64").rstrip("_")
            shown["python"] = array if python.is_array(one) else python.type_of(one)
            shown["python"] += f" {shape}" if shape else ""
        cells = [f"`{shown[name]}`" if shown[name] else "" for name in ("cpp", "python", "java")]
        doc = f"{one.enum}: {one.doc}" if one.enum and one.doc else one.enum or one.doc
        lines.append(row(f"`{one.name}`", *cells, doc))
    return lines


def record(one: Record, vocabulary: Vocabulary) -> list[str]:
    return [
        "",
        f"### {one.name}",
        "",
        f"`{one.message.name}`. {one.doc}",
        "",
        *types(one, vocabulary),
    ]


def enum(one: Enum) -> list[str]:
    lines = ["", f"### {one.name}", "", one.doc, "", "| Number | Text | |", "|---|---|---|"]
    for value in one.values:
        doc = value.doc if value.sent else "in no message: the clients' own"
        lines.append(row(str(value.value), f'`"{value.text}"`', doc))
    return lines


def described(one: Argument) -> str:
    default = "" if one.default is None else f" ({one.default!r} where it is not given)"
    return f"`{one.name}`: {one.doc}{default}"


def request(one: Request) -> str:
    arguments = "; ".join(described(given) for given in one.arguments)
    if one.by_hand:
        arguments = f"as `{one.body.name}` has them" if one.body else ""
    result = one.reply.name if one.reply else ""
    result = f"its {one.result.name}: {one.result.doc}" if one.result else result
    errors = "; ".join(f"{code}: {why}" for code, why in one.errors.items())
    return row(one.kind, f"`{one.method}`", one.doc, arguments, result, errors)


def make(vocabulary: Vocabulary) -> dict[str, list[str]]:
    lines = [*HEAD.splitlines(), "", "## Samples"]
    for one in vocabulary.samples.values():
        lines += record(one, vocabulary)
    lines += ["", "## Parts of samples"]
    for one in vocabulary.parts.values():
        lines += record(one, vocabulary)
    lines += [
        "",
        "## Enumerations",
        "",
        "In C++ and Java classes of these names; texts in Python, and in the samples of Java.",
    ]
    for words in vocabulary.enums.values():
        lines += enum(words)
    lines += ["", "## Requests", ""]
    lines += [
        "Methods of `Simulation`. Each may also end with NotSupported, where the server has no such request, Timeout and NoServer."
        " A refusal is a RequestError with one of the codes; every request may have WRONG_RUN, WRONG_EPOCH, OLD_SEQUENCE,"
        " UNKNOWN_SESSION and ENDED."
    ]
    lines += [
        "",
        "| Request | Method | | Arguments | Returns | Refusals |",
        "|---|---|---|---|---|---|",
    ]
    lines += [request(asked) for asked in vocabulary.requests]
    lines += ["", "## Replies"]
    for one in vocabulary.replies.values():
        lines += record(one, vocabulary)
    return {"messages.md": lines}
