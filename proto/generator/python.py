"""Python: ruedo/vocabulary.py, the enumerations, and ruedo/samples.py, the samples."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable

from table import Argument, Enum, Field, Record, Request, Vocabulary

MADE = "# Made from proto/vocabulary.toml; edit that."
SCALARS = {
    "boolean": "bool",
    "int8_t": "int",
    "int16_t": "int",
    "int32_t": "int",
    "int64_t": "int",
    "float": "float",
    "double": "float",
    "string": "str",
}
ARRAYS = {"boolean": "bool_", "int8_t": "int64", "int16_t": "int64"}  # numpy's, else float64
ARRAYS |= {"int32_t": "int64", "int64_t": "int64"}


def docstring(text: str, indent: str = "") -> list[str]:
    if len(text) <= 100 - len(indent) - 6:
        return [f'{indent}"""{text}"""']
    lines = textwrap.wrap(text, 97 - len(indent), initial_indent='"""')
    return [*(indent + line for line in lines), f'{indent}"""']


def comment(text: str, indent: str = "    ") -> list[str]:
    return textwrap.wrap(text, 100, initial_indent=f"{indent}# ", subsequent_indent=f"{indent}# ")


def table_of(one: Enum) -> str:
    """MOTION_KINDS of MotionKind."""
    return "".join(f"_{c}" if c.isupper() else c for c in one.name).strip("_").upper() + "S"


def enum(one: Enum) -> list[str]:
    lines = ["", "", f"class {one.name}(Word):", *docstring(one.doc, "    "), ""]
    for value in one.values:
        lines += comment(value.doc) if value.doc else []
        lines.append(f'    {value.name.upper()} = "{value.text}"')
    lines += ["", "", f"{table_of(one)} = {{"]
    sent = [value for value in one.values if value.sent]
    lines += [f"    {value.value}: {one.name}.{value.name.upper()}," for value in sent]
    return [*lines, "}"]


def vocabulary_module(vocabulary: Vocabulary) -> list[str]:
    lines = [MADE]
    lines += docstring(
        "The enumerations: their members are texts, which compare equal to plain ones. Each table has"
        " them by their number in a message."
    )
    lines += ["", "from .values import Word"]
    lines += ["", *exported(vocabulary.enums)]
    for one in vocabulary.enums.values():
        lines += enum(one)
    return lines


def exported(names: Iterable[str]) -> list[str]:
    return ["__all__: list[str] = [", *(f'    "{name}",' for name in sorted(names)), "]"]


def is_array(one: Field) -> bool:
    """Whether it is one of numpy's."""
    member = one.member
    return member is None or bool(
        member.dims and not one.part and member.type not in ("string", "byte")
    )


def type_of(one: Field) -> str:
    member = one.member
    if one.part:
        return f"list[{one.part}]"
    if is_array(one):
        own = ARRAYS.get(member.type) if member else None
        return f"NDArray[np.{own}]" if own else "Floats"
    assert member
    if member.type == "byte":
        return "bytes"
    if member.dims:
        return "list[str]"
    return "str" if one.enum else SCALARS[member.type]


def shape_of(one: Field) -> str:
    if one.shape or not is_array(one):
        return one.shape
    if one.sizes:
        return "(m, n)"
    count = one.member.dims[0] if one.member else "n"
    return f"({count},)" if count.isdigit() else "(n,)"


def field(one: Field, vocabulary: Vocabulary) -> list[str]:
    texts = vocabulary.enums[one.enum].sent_texts if one.enum else ""
    doc = " ".join(part for part in (shape_of(one), one.doc) if part)
    doc = ": ".join(part for part in (doc, texts) if part)
    line = f"    {one.name}: {type_of(one)}"
    if len(line) + len(doc) + 4 <= 100:
        return [f"{line}  # {doc}"]
    return [*comment(doc), line]


def record(one: Record, vocabulary: Vocabulary) -> list[str]:
    base = "Sample" if vocabulary.has_utime(one) else "Value"
    mixin = f", {one.name}Methods" if "python" in one.methods else ""
    lines = ["", "", "@dataclass(frozen=True, eq=False, repr=False)"]
    lines += [f"class {one.name}({base}{mixin}):", *docstring(one.doc, "    "), ""]
    for member in one.of("python"):
        lines += field(member, vocabulary)
    return lines


def conversion(one: Field, vocabulary: Vocabulary) -> str:
    """An expression of the message m."""
    if one.member is None:
        return f"steps({', '.join(f'm.{name}' for name in one.steps)})"
    value = f"m.{one.member.name}"
    if one.part:
        return f"[_{stem(vocabulary.parts[one.part])}(part) for part in {value}]"
    if one.enum:
        return f"word({table_of(vocabulary.enums[one.enum])}, {value})"
    if one.sizes:
        sizes = ", ".join(f"m.{name}" for name in one.sizes)
        return f"shaped({value}, {sizes}{', optional=True' if one.optional else ''})"
    if is_array(one):
        own = ARRAYS.get(one.member.type)
        array = f"fixed(np.array({value}, np.{own}))" if own else f"floats({value})"
        numbers = one.shape.strip("()")
        return f"{array}.reshape({numbers})" if one.shape else array
    if one.member.type == "byte":
        return f"bytes({value})"
    if one.member.dims:
        return f"list({value})"
    if one.member.type == "boolean":
        return f"bool({value})"
    return f"for_terminal({value})" if one.terminal else value


def stem(one: Record) -> str:
    return one.message.name.removesuffix("_t")


def converter(one: Record, vocabulary: Vocabulary) -> list[str]:
    lines = ["", "", f"def _{stem(one)}(m: Any) -> {one.name}:"]
    arrays = (
        member
        for member in one.message.members
        if member.type in vocabulary.messages and not member.dims[0].isdigit()
    )
    lines += [f"    counted(m.{array.dims[0]})" for array in arrays]
    head = ["m.utime"] if vocabulary.has_utime(one) else []
    values = [*head, *(conversion(field, vocabulary) for field in one.of("python"))]
    return [*lines, f"    return {one.name}(", *(f"        {value}," for value in values), "    )"]


def column(one: Field, vocabulary: Vocabulary) -> str:
    """An expression of the columns c of the message's members."""

    def members(names: Iterable[str]) -> str:
        return ", ".join(f'c["{name}"]' for name in names)

    if one.member is None:
        return f"steps_column({members(one.steps)})"
    value = members([one.member.name])
    if one.enum:
        return f"words_of({table_of(vocabulary.enums[one.enum])}, {value})"
    if one.sizes:
        return f"shaped_column({value}, {members(one.sizes)}{', optional=True' if one.optional else ''})"
    numbers = one.shape.strip("()")
    return f"{value}.reshape(-1, {numbers})" if one.shape and is_array(one) else value


def is_flat(one: Record) -> bool:
    """Whether its columns are made of the members' columns: it has no parts, nothing to escape."""
    return not any(field.part or field.terminal for field in one.of("python"))


def column_converter(one: Record, vocabulary: Vocabulary) -> list[str]:
    lines = ["", "", f"def _{stem(one)}_columns(c: dict[str, Any]) -> dict[str, Any]:"]
    head = ['"utime": c["utime"]'] if vocabulary.has_utime(one) else []
    fields = [f'"{field.name}": {column(field, vocabulary)}' for field in one.of("python")]
    return [*lines, "    return {", *(f"        {line}," for line in [*head, *fields]), "    }"]


def samples_module(vocabulary: Vocabulary) -> list[str]:
    lines = [MADE]
    lines += docstring(
        "What devices deliver: one frozen class for each kind of sample, with numpy arrays. SI units"
        " and radians. x ahead, y left, z up; quaternions w, x, y, z. `utime` is the sim time of the"
        " state shown, in integer microseconds; `time` is the same in seconds."
    )
    records = (
        *vocabulary.parts.values(),
        *vocabulary.samples.values(),
        *vocabulary.replies.values(),
    )
    used = {field.enum for one in records for field in one.fields if field.enum}
    tables = sorted(table_of(vocabulary.enums[name]) for name in used)
    mixins = sorted(f"{one.name}Methods" for one in records if "python" in one.methods)
    values = (
        "Sample Value counted fixed floats shaped shaped_column steps steps_column word words_of"
    )
    lines += ["", "from __future__ import annotations", ""]
    lines += ["from collections.abc import Callable", "from dataclasses import dataclass"]
    lines += ["from typing import Any", "", "import numpy as np"]
    lines += ["from numpy.typing import NDArray", "", "from . import lcmtypes"]
    lines += ["from .errors import for_terminal", "from .geometry import Floats"]
    lines += imported("sample_methods", mixins)
    lines += imported("values", values.split())
    lines += [f"from .vocabulary import {', '.join(tables)}"]
    lines += ["", *exported(one.name for one in records)]
    for one in records:
        lines += record(one, vocabulary)
    for one in records:
        lines += converter(one, vocabulary)
    lines += ["", "", "# Message type -> (generated class, conversion to a sample)."]
    lines += comment("A type that is not here is delivered as generated.", "")
    lines.append("CONVERSIONS: dict[str, tuple[Any, Callable[[Any], Any]]] = {")
    for one in vocabulary.samples.values():
        type = one.message.name
        lines.append(f'    "{type}": (lcmtypes.{type}, _{stem(one)}),')
    flat = [one for one in vocabulary.samples.values() if is_flat(one)]
    lines.append("}")
    for one in flat:
        lines += column_converter(one, vocabulary)
    lines += ["", "", "# Message type -> the columns of its samples, from those of its members."]
    lines.append("COLUMNS: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {")
    lines += [f'    "{one.message.name}": _{stem(one)}_columns,' for one in flat]
    lines += ["}", "", "", "# The same of the bodies of replies."]
    lines.append("REPLIES: dict[str, tuple[Any, Callable[[Any], Any]]] = {")
    for one in vocabulary.replies.values():
        type = one.message.name
        lines.append(f'    "{type}": (lcmtypes.{type}, _{stem(one)}),')
    return [*lines, "}"]


def imported(module: str, names: list[str]) -> list[str]:
    line = f"from .{module} import {', '.join(names)}"
    if len(line) <= 100:
        return [line]
    return [f"from .{module} import (", *(f"    {name}," for name in names), ")"]


CHECKS = {
    "string": ("text", "str"),
    "double": ("number", "float"),
    "boolean": ("switch", "bool"),
    "int32_t": ("whole", "int"),
    "int64_t": ("whole", "int"),
}


def parameter(one: Argument) -> str:
    own = CHECKS[one.member.type][1]
    if one.member.dims:
        count = int(one.member.dims[0])
        values = ", ".join([str(one.default)] * count)
        return f"{one.name}: Sequence[float]" + (
            f" = ({values})" if one.default is not None else ""
        )
    default = f'"{one.default}"' if own == "str" else one.default
    return f"{one.name}: {own}" + (f" = {default}" if one.default is not None else "")


def checked(one: Argument) -> str:
    if one.member.dims:
        return f'arguments.numbers("{one.name}", {one.name}, {one.member.dims[0]})'
    return f'arguments.{CHECKS[one.member.type][0]}("{one.name}", {one.name})'


def paragraphs(texts: list[str]) -> list[str]:
    """A docstring, each text from the beginning of a line."""
    if len(texts) == 1:
        return docstring(texts[0], "        ")
    first = textwrap.wrap(texts[0], 89)
    rest = [line for text in texts[1:] for line in textwrap.wrap(text, 92)]
    lines = [f'"""{first[0]}', *first[1:], "", *rest, '"""']
    return [f"        {line}" if line else "" for line in lines]


def request(one: Request) -> list[str]:
    result = type_of(one.result) if one.result else one.reply.name if one.reply else "None"
    head = f"    def {one.method}("
    items = ["self", *(parameter(given) for given in one.arguments)]
    line = f"{head}{', '.join(items)}) -> {result}:"
    inner = f"        {', '.join(items)}"
    lines = [""]
    if len(line) <= 100:
        lines.append(line)
    elif len(inner) <= 100:
        lines += [head, inner, f"    ) -> {result}:"]
    else:
        lines += [head, *(f"        {item}," for item in items), f"    ) -> {result}:"]
    texts = [one.doc, *(f"{given.name}: {given.doc}." for given in one.arguments)]
    if one.errors:
        errors = "; ".join(f"{code}: {why}" for code, why in one.errors.items())
        texts.append(f"Raises RequestError. {errors}.")
    lines += paragraphs(texts)
    arguments = [f"lcmtypes.request_t.{one.kind}"]
    if one.body:
        lines.append(f"        body = lcmtypes.{one.body.name}()")
        lines += [f"        body.{given.member.name} = {checked(given)}" for given in one.arguments]
        arguments.append("body")
    arguments += [f"timeout={one.seconds}.0"] if one.seconds != 5 else []
    call = f"self._session.request({', '.join(arguments)})"
    if not one.reply:
        return [*lines, f"        {call}"]
    type = one.reply.message.name
    own = f".{one.result.name}" if one.result else ""
    return [
        *lines,
        f"        reply = {call}",
        f'        made: {one.reply.name} = reply_of(reply, "{type}")',
        f"        return made{own}",
    ]


def requests_module(vocabulary: Vocabulary) -> list[str]:
    requests = vocabulary.made_requests
    lines = [MADE, '"""What clients ask the server for."""', ""]
    lines += ["from __future__ import annotations", ""]
    if any(given.member.dims for one in requests for given in one.arguments):
        lines += ["from collections.abc import Sequence", ""]
    results = {type_of(one.result) for one in requests if one.result}
    names = {one.reply.name for one in requests if one.reply}
    names |= {one.result.part for one in requests if one.result and one.result.part}
    if any(type.startswith("NDArray") for type in results):
        lines += ["import numpy as np", "from numpy.typing import NDArray", ""]
    lines += ["from . import arguments, lcmtypes"]
    lines += ["from .geometry import Floats"] if "Floats" in results else []
    lines += imported("samples", sorted(names))
    lines += ["from .session.control import Session, reply_of"]
    lines += ["", "", "class Requests:"]
    lines += docstring(
        "Each raises NotSupported where the server has no such request, RequestError when it refuses,"
        " Timeout and NoServer.",
        "    ",
    )
    lines += ["", "    _session: Session"]
    for one in requests:
        lines += request(one)
    return lines


def make(vocabulary: Vocabulary) -> dict[str, list[str]]:
    return {
        "ruedo/vocabulary.py": vocabulary_module(vocabulary),
        "ruedo/samples.py": samples_module(vocabulary),
        "ruedo/requests.py": requests_module(vocabulary),
    }
