"""C++: enumerations and samples as public headers, and how samples come off the wire."""

from __future__ import annotations

import textwrap
from pathlib import Path

from table import Argument, Enum, Field, Member, Record, Request, Vocabulary

MADE = "// Made from proto/vocabulary.toml; edit that."
SCALARS = {
    "boolean": ("bool", "false", "boolean"),
    "int8_t": ("int", "0", "int8"),
    "int16_t": ("int", "0", "int16"),
    "int32_t": ("int", "0", "int32"),
    "int64_t": ("int64_t", "0", "int64"),
    "float": ("double", "0.0", "float32"),
    "double": ("double", "0.0", "float64"),
    "string": ("std::string", "", "string"),
}
ARRAYS = {"boolean": "bool", "byte": "uint8_t", "string": "std::string"}  # others: the type itself
FIXED = {"3": "Vector3", "4": "Quaternion"}  # of doubles


def comment(text: str, indent: str = "") -> list[str]:
    return textwrap.wrap(
        text, 100, initial_indent=f"{indent}/// ", subsequent_indent=f"{indent}/// "
    )


def function(head: str, body: str) -> list[str]:
    """On one line where it fits, as clang-format has it."""
    line = f"{head} {{ {body} }}"
    return [line] if len(line) <= 100 else [f"{head} {{", f"  {body}", "}"]


def enum(one: Enum) -> list[str]:
    lines = [*comment(one.doc), f"enum class {one.name} : {one.type} {{"]
    for value in one.values:
        lines += comment(value.doc, "  ") + [f"  {value.name} = {value.value},"]
    if one.unknown is not None:
        lines += ["  /// of a later server", f"  unknown = {one.unknown},"]
    return [
        *lines,
        "};",
        "/// @param value of the enumeration",
        "/// @return the text that messages use",
        f"[[nodiscard]] const char* to_string({one.name} value);",
        "/// @cond",
        *function(
            f"inline std::ostream& operator<<(std::ostream& out, {one.name} value)",
            "return out << to_string(value);",
        ),
        "/// @endcond",
        "",
    ]


def enums_header(vocabulary: Vocabulary) -> list[str]:
    lines = [
        MADE,
        "/// @file",
        "// The enumerations of Ruedo's client for C++.",
        "#pragma once",
        "",
    ]
    lines += ["#include <cstdint>", "#include <ostream>", "", "namespace ruedo::client {", ""]
    for one in vocabulary.enums.values():
        lines += enum(one)
    return [*lines, "}  // namespace ruedo::client"]


def zero(one: Enum) -> str:
    return next((value.name for value in one.values if value.value == 0), "unknown")


def type_of(one: Field) -> str:
    member = one.member
    assert member
    if one.enum or one.part:
        return one.enum or f"std::vector<{one.part}>"
    return array_of(member) if member.dims else SCALARS[member.type][0]


def array_of(member: Member) -> str:
    (count,) = member.dims
    own = ARRAYS.get(member.type, member.type)
    if count in FIXED and own == "double":
        return FIXED[count]
    return f"std::array<{own}, {count}>" if count.isdigit() else f"std::vector<{own}>"


def declaration(one: Field, vocabulary: Vocabulary) -> str:
    member, type = one.member, type_of(one)
    assert member
    if one.enum:
        return f"{type} {one.name} = {one.enum}::{zero(vocabulary.enums[one.enum])};"
    if not member.dims:
        initial = SCALARS[member.type][1]
        return f"{type} {one.name} = {initial};" if initial else f"{type} {one.name};"
    return (
        f"{type} {one.name}{{}};"
        if member.dims[0].isdigit() and not one.part
        else f"{type} {one.name};"
    )


def record(one: Record, vocabulary: Vocabulary, methods: Path) -> list[str]:
    base = " : Sample" if vocabulary.has_utime(one) else ""
    lines = [*comment(one.doc), f"struct {one.name}{base} {{"]
    for member in one.of("cpp"):
        if member.alias:
            lines += comment(vocabulary.enums[member.enum].doc, "  ")
            lines += [f"  using {member.alias} = {member.enum};"]
        lines += [*comment(member.doc, "  "), f"  {declaration(member, vocabulary)}"]
    if "cpp" in one.methods:
        text = (methods / f"{one.name}.h").read_text(encoding="utf-8")
        lines += textwrap.indent(text, "  ").splitlines()
    return [*lines, "};", ""]


def messages_header(vocabulary: Vocabulary, methods: Path) -> list[str]:
    lines = [MADE, "/// @file", "// The samples of Ruedo's client for C++.", "#pragma once", ""]
    lines += [f"#include <{one}>" for one in ("array", "cstdint", "string", "vector")]
    lines += ["", '#include "ruedo/client_enums.h"', '#include "ruedo/client_types.h"']
    lines += ["", "namespace ruedo::client {", ""]
    records = (
        *vocabulary.parts.values(),
        *vocabulary.samples.values(),
        *vocabulary.replies.values(),
    )
    for one in records:
        lines += record(one, vocabulary, methods)
    return [*lines, "}  // namespace ruedo::client"]


def read_count(member: Member, one: Record, vocabulary: Vocabulary) -> str:
    size = sum(vocabulary.smallest(array.type) for array in one.message.counted_by(member.name))
    read = f"in.fits(in.{SCALARS[member.type][2]}(), {size})"
    return read if member.type != "int32_t" else f"in.count({size})"


def read_value(member: Member, field: Field | None) -> str:
    if not member.dims:
        read = "text" if field and field.terminal else SCALARS[member.type][2]
        value = f"in.{read}()"
        return f"known<{field.enum}>({value})" if field and field.enum else value
    (count,) = member.dims
    own = ARRAYS.get(member.type, member.type)
    return (
        f"read_array<{own}, {count}>(in)" if count.isdigit() else f"read_values<{own}>(in, {count})"
    )


def read_members(one: Record, vocabulary: Vocabulary, at: str) -> list[str]:
    """Statements up to the last member that is wanted."""
    fields = {field.member.name: field for field in one.of("cpp") if field.member}
    wanted = [name for name in (m.name for m in one.message.members) if name in fields]
    lines = []
    for member in one.message.members:
        field = fields.get(member.name)
        if field and field.part:
            part = vocabulary.parts[field.part]
            lines.append(f"{at}{field.name}.resize({member.dims[0]});")
            lines.append(
                f"for ({part.name}& part : {at}{field.name}) part = read_{stem(part)}(in);"
            )
        elif field:
            lines.append(f"{at}{field.name} = {read_value(member, field)};")
        elif member.name == "utime":
            lines.append(f"{at}utime = in.int64();")
        elif one.message.counted_by(member.name):
            lines.append(f"const size_t {member.name} = {read_count(member, one, vocabulary)};")
        else:
            lines.append(f"{read_value(member, None)};")
        if wanted and member.name == wanted[-1]:
            break
    for field in one.of("cpp"):
        if field.sizes:
            sizes = ", ".join(f"{at}{fields[name].name}" for name in field.sizes)
            check = f"check_product({at}{field.name}.size(), {sizes});"
            lines.append(f"if (!{at}{field.name}.empty()) {check}" if field.optional else check)
    return lines


def stem(one: Record) -> str:
    return one.message.name.removesuffix("_t")


def part_reader(one: Record, vocabulary: Vocabulary) -> list[str]:
    return [
        f"{one.name} read_{stem(one)}(WireReader& in) {{",
        f"  {one.name} part;",
        *(f"  {line}" for line in read_members(one, vocabulary, "part.")),
        "  return part;",
        "}",
        "",
    ]


def decoder(one: Record, vocabulary: Vocabulary) -> list[str]:
    return [
        f"std::shared_ptr<const Sample> decode_{stem(one)}(WireReader& in) {{",
        f"  auto s = std::make_shared<{one.name}>();",
        *(f"  {line}" for line in read_members(one, vocabulary, "s->")),
        "  return s;",
        "}",
        "",
    ]


def texts(one: Enum) -> list[str]:
    lines = [f"const char* to_string({one.name} value) {{", "  switch (value) {"]
    lines += [f'    case {one.name}::{value.name}: return "{value.text}";' for value in one.values]
    lines += [f"    case {one.name}::unknown: break;"] if one.unknown is not None else []
    return [*lines, "  }", '  return "unknown";', "}", ""]


def decoders(vocabulary: Vocabulary) -> list[str]:
    samples = vocabulary.samples.values()
    types = sorted(one.message.name for one in samples)
    lines = [MADE, "// How samples come off the wire, and the texts of enumerations."]
    lines += [f'#include "ruedo/{type}.hpp"' for type in types]
    lines += ['#include "samples/sample_types.h"', '#include "samples/wire_values.h"', ""]
    lines += ["namespace ruedo::client {", "namespace {", ""]
    for part in vocabulary.parts.values():
        lines += part_reader(part, vocabulary)
    for sample in samples:
        lines += decoder(sample, vocabulary)
    lines.append("const SampleDecoder kDecoders[] = {")
    for sample in samples:
        type = sample.message.name
        lines.append(f'    {{"{type}", {type}::getHash(), decode_{stem(sample)}}},')
    lines += ["};", "", "}  // namespace", ""]
    for one in vocabulary.enums.values():
        lines += texts(one)
    lines += ["const SampleDecoder* find_decoder(const std::string& type) {"]
    lines += ["  for (const SampleDecoder& decoder : kDecoders) {"]
    lines += ["    if (type == decoder.type) return &decoder;", "  }", "  return nullptr;", "}"]
    return [*lines, "", "}  // namespace ruedo::client"]


def argument(one: Argument) -> str:
    """As a declaration has it."""
    if one.member.dims:
        default = " = {}" if one.default is not None else ""
        return f"const {array_of(one.member)}& {one.name}{default}"
    own = SCALARS[one.member.type][0]
    type = "const std::string&" if own == "std::string" else own
    default = f' = "{one.default}"' if own == "std::string" else f" = {one.default}"
    return f"{type} {one.name}" + (default if one.default is not None else "")


def returned(one: Request) -> str:
    if one.result:
        return type_of(one.result)
    return one.reply.name if one.reply else "void"


def wrapped(head: str, items: list[str], tail: str) -> list[str]:
    """A function's head as clang-format has it: arguments below each other where they wrap."""
    lines, indent = [head], " " * len(head)
    for i, item in enumerate(items):
        text = item + (", " if i + 1 < len(items) else tail)
        if len(lines[-1] + text.rstrip()) > 100:
            lines[-1] = lines[-1].rstrip()
            lines.append(indent)
        lines[-1] += text
    return lines if items else [head + tail]


def request_declaration(one: Request) -> list[str]:
    lines = comment(one.doc, "  ")
    for given in one.arguments:
        lines += comment(f"@param {given.name} {given.doc}", "  ")
    if one.reply:
        doc = one.result.doc if one.result else "the state" if one.reply.name == "State" else ""
        lines += comment(f"@return {doc or one.reply.doc}", "  ")
    errors = "; ".join(f"{code}: {why}" for code, why in one.errors.items())
    lines += comment(f"@throws RequestError {errors}", "  ") if errors else []
    items = [argument(given) for given in one.arguments]
    kept = "[[nodiscard]] " if one.kind.startswith("GET_") else ""
    return [*lines, *wrapped(f"  {kept}{returned(one)} {one.method}(", items, ") const;")]


def requests_header(vocabulary: Vocabulary) -> list[str]:
    lines = [MADE, "/// @file", "// The requests of Ruedo's client for C++.", "#pragma once", ""]
    lines += [f"#include <{one}>" for one in ("array", "memory", "string", "utility")]
    lines += ["", '#include "ruedo/client_messages.h"']
    lines += ["", "namespace ruedo::client {", "", "class Core;", ""]
    lines += comment(
        "What Simulation asks the server for. Each throws NotSupported where the server has no such"
        " request, RequestError when it refuses, Timeout and NoServer."
    )
    lines += ["class Requests {", " public:"]
    for one in vocabulary.made_requests:
        lines += request_declaration(one)
    lines += ["", " protected:", "  /// @cond"]
    lines += ["  explicit Requests(std::shared_ptr<Core> core) : core_(std::move(core)) {}"]
    lines += ["  Requests(Requests&&) noexcept = default;"]
    lines += ["  Requests& operator=(Requests&&) noexcept = default;", "  ~Requests() = default;"]
    lines += ["  std::shared_ptr<Core> core() const;  // throws NoServer once it was moved from"]
    lines += ["  std::shared_ptr<Core> core_;", "  /// @endcond", "};", ""]
    return [*lines, "}  // namespace ruedo::client"]


def request(one: Request) -> list[str]:
    items = [argument(given).split(" = ")[0] for given in one.arguments]
    lines = wrapped(f"{returned(one)} Requests::{one.method}(", items, ") const {")
    body = "{}"
    if one.body:
        lines.append(f"  {one.body.name} body{{}};")
        for given in one.arguments:
            if given.member.dims:
                range = f"{given.name}.begin(), {given.name}.end()"
                lines.append(f"  std::copy({range}, body.{given.member.name});")
            else:
                lines.append(f"  body.{given.member.name} = {given.name};")
        lines.append("  const std::vector<uint8_t> bytes = encoded(body);")
        body = "bytes"
    call = f"core()->session().request(request_t::{one.kind}, {body}, {one.seconds}.0);"
    if not one.body and not one.reply:
        return [*function(lines[0].removesuffix(" {"), call), ""]
    if not one.reply:
        return [*lines, f"  {call}", "}", ""]
    result = f".{one.result.name}" if one.result else ""
    return [
        *lines,
        f"  const Reply reply = {call}",
        f"  return {stem(one.reply).removesuffix('_reply')}_of(reply){result};",
        "}",
        "",
    ]


def reply_reader(one: Record, vocabulary: Vocabulary) -> list[str]:
    type = one.message.name
    return [
        f"{one.name} {stem(one).removesuffix('_reply')}_of(const Reply& reply) {{",
        "  try {",
        "    WireReader in(reply.body.data(), reply.body.size());",
        f'    if (in.int64() != {type}::getHash()) throw WireError("another version of the type");',
        f"    {one.name} s;",
        *(f"    {line}" for line in read_members(one, vocabulary, "s.")),
        "    return s;",
        "  } catch (const WireError& error) {",
        f'    wrong_body("{type}", error);',
        "  }",
        "}",
        "",
    ]


def requests_source(vocabulary: Vocabulary) -> list[str]:
    types = {one.body.name for one in vocabulary.made_requests if one.body}
    types |= {one.message.name for one in vocabulary.replies.values()} | {"request_t"}
    lines = [
        MADE,
        "// Requests and their replies.",
        "#include <algorithm>",
        "",
        '#include "core.h"',
    ]
    lines += [f'#include "ruedo/{type}.hpp"' for type in sorted(types)]
    lines += ['#include "samples/wire_values.h"', "", "namespace ruedo::client {", ""]
    for reply in vocabulary.replies.values():
        lines += reply_reader(reply, vocabulary)
    for one in vocabulary.made_requests:
        lines += request(one)
    return [*lines, "}  // namespace ruedo::client"]


def replies_header(vocabulary: Vocabulary) -> list[str]:
    lines = [MADE, "// What replies say.", "#pragma once", "", '#include "ruedo/client_messages.h"']
    lines += ["", "namespace ruedo::client {", "", "struct Reply;", ""]
    lines += ["// They throw TypeMismatch for a body that is of another version."]
    for one in vocabulary.replies.values():
        lines.append(f"{one.name} {stem(one).removesuffix('_reply')}_of(const Reply& reply);")
    return [*lines, "", "}  // namespace ruedo::client"]


def sample_list(vocabulary: Vocabulary) -> list[str]:
    names = [f"  X({one.name}, {one.message.name})" for one in vocabulary.samples.values()]
    names.insert(0, "#define RUEDO_SAMPLE_TYPES(X)")
    width = max(map(len, names)) + 1
    lines = [f"{line:<{width}}\\" for line in names[:-1]] + names[-1:]
    return [
        MADE,
        "// All kinds of samples, each with its message type.",
        "#pragma once",
        "",
        *lines,
    ]


def make(vocabulary: Vocabulary, methods: Path) -> dict[str, list[str]]:
    return {
        "include/ruedo/client_enums.h": enums_header(vocabulary),
        "include/ruedo/client_messages.h": messages_header(vocabulary, methods),
        "include/ruedo/client_requests.h": requests_header(vocabulary),
        "client/replies.h": replies_header(vocabulary),
        "client/requests.cpp": requests_source(vocabulary),
        "client/sample_list.h": sample_list(vocabulary),
        "client/sample_decoders.cpp": decoders(vocabulary),
    }
