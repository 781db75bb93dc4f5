"""Java: a class for each sample and each enumeration, and how samples come off the wire."""

from __future__ import annotations

import textwrap
from pathlib import Path

from table import Argument, Enum, Field, Member, Record, Request, Vocabulary

MADE = "// Made from proto/vocabulary.toml; edit that."
SCALARS = {
    "boolean": ("boolean", "bool"),
    "int8_t": ("int", "int8"),
    "int16_t": ("int", "int16"),
    "int32_t": ("int", "int32"),
    "int64_t": ("long", "int64"),
    "float": ("double", "float32"),
    "double": ("double", "float64"),
    "string": ("String", "string"),
}
ARRAYS = {
    "boolean": ("boolean[]", "bools"),
    "byte": ("byte[]", "bytes"),
    "int8_t": ("byte[]", "bytes"),
    "int16_t": ("short[]", "int16s"),
    "int32_t": ("int[]", "int32s"),
    "int64_t": ("long[]", "int64s"),
    "float": ("float[]", "floats"),
    "double": ("double[]", "doubles"),
    "string": ("List<String>", "strings"),
}


def camel(name: str) -> str:
    head, *rest = name.split("_")
    return head + "".join(word[:1].upper() + word[1:] for word in rest)


def escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def javadoc(text: str, indent: str = "") -> list[str]:
    text = text if text.endswith(".") else text + "."
    text = escaped(text)
    if len(indent) + len(text) + 7 <= 100:
        return [f"{indent}/** {text} */"]
    lines = textwrap.wrap(
        text, 100, initial_indent=f"{indent} * ", subsequent_indent=f"{indent} * "
    )
    return [f"{indent}/**", *lines, f"{indent} */"]


def listed(head: str, items: list[str], tail: str, indent: str, fill: bool) -> list[str]:
    """As google-java-format has them: on one line, or (fill) all on the next, or one on each."""
    line = f"{indent}{head}({', '.join(items)}){tail}"
    if len(line) <= 100:
        return [line]
    next_line = f"{indent}        {', '.join(items)}){tail}"
    if fill and len(next_line) <= 100:
        return [f"{indent}{head}(", next_line]
    rows = [f"{indent}        {item}," for item in items[:-1]]
    return [f"{indent}{head}(", *rows, f"{indent}        {items[-1]}){tail}"]


def type_of(one: Field, vocabulary: Vocabulary) -> str:
    member = one.member
    assert member
    if one.part:
        return f"List<{vocabulary.parts[one.part].java}>"
    if member.dims:
        return ARRAYS[member.type][0]
    return "String" if one.enum else SCALARS[member.type][0]


def doc_of(one: Field, vocabulary: Vocabulary) -> str:
    if not one.enum:
        return one.doc
    return ": ".join(part for part in (vocabulary.enums[one.enum].sent_texts, one.doc) if part)


def body(one: Record, vocabulary: Vocabulary, indent: str, own: str) -> list[str]:
    """Fields and constructor of a class."""
    lines = []
    fields = one.of("java")
    shown = {field.name: type_of(field, vocabulary).replace(f"{own}.", "") for field in fields}
    for field in fields:
        lines += javadoc(doc_of(field, vocabulary), indent)
        lines += [f"{indent}public final {shown[field.name]} {camel(field.name)};", ""]
    sample = vocabulary.has_utime(one)
    arguments = ["long utime"] if sample else []
    arguments += [f"{shown[field.name]} {camel(field.name)}" for field in fields]
    name = one.java.split(".")[-1]
    lines += listed(name, arguments, " {", indent, fill=True)
    lines += [f"{indent}    super(utime);"] if sample else []
    lines += [f"{indent}    this.{camel(f.name)} = {camel(f.name)};" for f in fields]
    return [*lines, f"{indent}}}"]


def nested(one: Record, vocabulary: Vocabulary, own: str) -> list[str]:
    name = one.java.split(".")[-1]
    lines = ["", *javadoc(one.doc, "    "), f"    public static final class {name} {{"]
    return [*lines, *body(one, vocabulary, "        ", own), "    }"]


def sample(one: Record, vocabulary: Vocabulary, methods: Path) -> list[str]:
    parts = [part for part in vocabulary.parts.values() if part.java.startswith(f"{one.name}.")]
    lines = body(one, vocabulary, "    ", one.name)
    imports = []
    if any(type_of(f, vocabulary).startswith("List") for f in one.of("java")):
        imports.append("import java.util.List;")
    if "java" in one.methods:
        text = (methods / f"{one.name}.java.in").read_text(encoding="utf-8")
        imports += [line for line in text.splitlines() if line.startswith("import ")]
        own = "".join(line for line in text.splitlines(True) if not line.startswith("import "))
        lines += ["", *textwrap.indent(own.strip("\n"), "    ").splitlines()]
    for part in parts:
        lines += nested(part, vocabulary, one.name)
    final = "" if one.open else "final "
    base = " extends Sample" if vocabulary.has_utime(one) else ""
    head = [MADE, "package ruedo;", "", *grouped(imports), *javadoc(one.doc)]
    return [*head, f"public {final}class {one.name}{base} {{", *lines, "}"]


def grouped(imports: list[str]) -> list[str]:
    """By their first package, java before javax, a line between."""
    lines: list[str] = []
    for package in ("java", "javax"):
        own = sorted(line for line in imports if line.startswith(f"import {package}."))
        lines += [*own, ""] if own else []
    return lines


def enum(one: Enum) -> list[str]:
    lines = [MADE, "package ruedo;", "", *javadoc(one.doc), f"public enum {one.name} {{"]
    for i, value in enumerate(one.values):
        end = ";" if i + 1 == len(one.values) else ","
        if value.doc:
            lines += ([""] if i else []) + javadoc(value.doc, "    ")
        lines.append(f'    {value.name.upper()}({value.value}, "{value.text}"){end}')
    unknown = 'String.format("0x%08x", value)' if "32" in one.type else "Integer.toString(value)"
    return [
        *lines,
        "",
        *javadoc("In a message", "    "),
        "    public final int value;",
        "",
        "    private final String text;",
        "",
        f"    {one.name}(int value, String text) {{",
        "        this.value = value;",
        "        this.text = text;",
        "    }",
        "",
        *javadoc("Of a value in a message; one of a later server as a number", "    "),
        "    static String text(int value) {",
        f"        for ({one.name} one : values()) {{",
        "            if (one.value == value) return one.text;",
        "        }",
        f"        return {unknown};",
        "    }",
        "",
        *javadoc("The text that samples and messages use", "    "),
        "    @Override",
        "    public String toString() {",
        "        return text;",
        "    }",
        "}",
    ]


def read_value(member: Member, field: Field | None) -> str:
    if not member.dims:
        read = "text" if field and field.terminal else SCALARS[member.type][1]
        value = f"in.{read}()"
        return f"{field.enum}.text({value})" if field and field.enum else value
    count = member.dims[0] if member.dims[0].isdigit() else camel(member.dims[0])
    value = f"in.{ARRAYS[member.type][1]}({count})"
    return f"List.copyOf({value})" if member.type == "string" else value


def read_count(member: Member, one: Record, vocabulary: Vocabulary) -> str:
    size = sum(vocabulary.smallest(array.type) for array in one.message.counted_by(member.name))
    return (
        f"in.count({size})"
        if member.type == "int32_t"
        else f"in.fits(in.{SCALARS[member.type][1]}(), {size})"
    )


def read_parts(field: Field, member: Member, vocabulary: Vocabulary) -> list[str]:
    part, name = vocabulary.parts[field.part], camel(field.name)
    return [
        f"List<{part.java}> {name} = new ArrayList<>();",
        f"for (int i = 0; i < {camel(member.dims[0])}; i++) {name}.add({camel(stem(part))}(in));",
    ]


def stem(one: Record) -> str:
    return one.message.name.removesuffix("_t")


def reader(one: Record, vocabulary: Vocabulary) -> list[str]:
    """Reads the members one by one, since the order on the wire is not that of the class."""
    fields = {field.member.name: field for field in one.of("java") if field.member}
    wanted = [member.name for member in one.message.members if member.name in fields]
    lines = [
        "",
        f"    private static {one.java} {camel(stem(one))}(WireReader in) throws IOException {{",
    ]
    for member in one.message.members:
        field = fields.get(member.name)
        if field and field.part:
            lines += ["        " + line for line in read_parts(field, member, vocabulary)]
        elif field:
            type = type_of(field, vocabulary)
            lines.append(f"        {type} {camel(field.name)} = {read_value(member, field)};")
        elif one.message.counted_by(member.name):
            count = read_count(member, one, vocabulary)
            lines.append(f"        int {camel(member.name)} = {count};")
        elif member.name == "utime":
            lines.append("        long utime = in.int64();")
        else:
            lines.append(f"        {read_value(member, None)};")
        if wanted and member.name == wanted[-1]:
            break
    for field in one.of("java"):
        if field.sizes:
            sizes = ", ".join(camel(fields[name].name) for name in field.sizes)
            own = f"{camel(field.name)}.length"
            check = f"WireReader.checkProduct({own}, {sizes});"
            lines.append(
                f"        if ({own} > 0) {check}" if field.optional else f"        {check}"
            )
    arguments = ["utime"] if vocabulary.has_utime(one) else []
    for field in one.of("java"):
        name = camel(field.name)
        arguments.append(f"List.copyOf({name})" if field.part else name)
    lines += listed(f"return new {one.java}", arguments, ";", "        ", fill=True)
    return [*lines, "    }"]


def decoders(vocabulary: Vocabulary) -> list[str]:
    samples, parts = list(vocabulary.samples.values()), vocabulary.parts.values()
    records = (*samples, *vocabulary.replies.values())
    types = sorted(["reply_t", *(one.message.name for one in records)])
    lines = [MADE, "package ruedo;", "", *(f"import ruedo.lcmtypes.{type};" for type in types), ""]
    lines += [
        "import java.io.IOException;",
        "import java.util.ArrayList;",
        "import java.util.HashMap;",
    ]
    lines += ["import java.util.List;", "import java.util.Map;", ""]
    lines += [*javadoc("How samples come off the wire"), "final class Decoders {"]
    lines += javadoc("By the name of the message type", "    ")
    lines += ["    static final Map<String, Conversions.Conversion> ALL = new HashMap<>();", ""]
    lines.append("    static {")
    for one in samples:
        type = one.message.name
        arguments = [f'"{type}"', f"{type}.LCM_FINGERPRINT", f"Decoders::{camel(stem(one))}"]
        lines += listed("add", arguments, ";", "        ", fill=True)
    lines += ["    }", "", "    private Decoders() {}", ""]
    head = "private static void add"
    parameters = ["String type", "long fingerprint", "Conversions.Decoder decoder"]
    lines += listed(head, parameters, " {", "    ", fill=True)
    lines += ["        ALL.put(type, new Conversions.Conversion(fingerprint, decoder));", "    }"]
    for one in (*parts, *samples, *vocabulary.replies.values()):
        lines += reader(one, vocabulary)
    for one in vocabulary.replies.values():
        lines += reply(one)
    return [*lines, "}"]


def reply(one: Record) -> list[str]:
    type = one.message.name
    arguments = ["reply", f'"{type}"', f"{type}.LCM_FINGERPRINT", f"Decoders::{camel(stem(one))}"]
    head = f"    static {one.name} {short(one)}Of(reply_t reply) {{"
    call = listed("return Session.body", arguments, ";", "        ", fill=True)
    return ["", *javadoc("Throws TypeMismatch", "    "), head, *call, "    }"]


def short(one: Record) -> str:
    return camel(stem(one).removesuffix("_reply"))


TYPES = {"string": "String", "double": "double", "boolean": "boolean", "int32_t": "int"}


def declared(one: Argument) -> str:
    """As a method has it."""
    type = "double[]" if one.member.dims else TYPES.get(one.member.type, "long")
    return f"{type} {camel(one.name)}"


def default(one: Argument) -> str:
    if one.member.dims:
        return f"new double[{one.member.dims[0]}]"
    return f'"{one.default}"' if isinstance(one.default, str) else str(one.default)


def block(texts: list[str]) -> list[str]:
    """A Javadoc comment: a text, and tags with their continuation lines."""
    lines = textwrap.wrap(escaped(texts[0]), 93)
    lines += [""] if texts[1:] else []
    for tag in texts[1:]:
        lines += textwrap.wrap(escaped(tag), 93, subsequent_indent="    ")
    if len(lines) == 1 and len(lines[0]) <= 89:
        return [f"    /** {lines[0]} */"]
    return ["    /**", *(f"     * {line}".rstrip() for line in lines), "     */"]


def request(one: Request, vocabulary: Vocabulary) -> list[str]:
    result = one.reply.name if one.reply else "void"
    result = type_of(one.result, vocabulary) if one.result else result
    head = f"public {result} {camel(one.method)}"
    tags = [f"@param {camel(given.name)} {given.doc}" for given in one.arguments]
    if one.errors:
        errors = "; ".join(f"{code}: {why}" for code, why in one.errors.items())
        tags.append(f"@throws RuedoException.RequestError {errors}")
    lines = ["", *block([one.doc, *tags])]
    lines += listed(head, [declared(given) for given in one.arguments], " {", "    ", fill=True)
    if one.body:
        lines.append(f"        {one.body.name} body = new {one.body.name}();")
        lines += [f"        body.{g.member.name} = {camel(g.name)};" for g in one.arguments]
    arguments = [f"request_t.{one.kind}", "body" if one.body else "null", f"{one.seconds}.0"]
    if one.reply:
        lines.append(f"        reply_t reply = session().request({', '.join(arguments)});")
        own = f".{camel(one.result.name)}" if one.result else ""
        lines.append(f"        return Decoders.{short(one.reply)}Of(reply){own};")
    else:
        lines.append(f"        session().request({', '.join(arguments)});")
    return [*lines, "    }", *shorter(one, head)]


def shorter(one: Request, head: str) -> list[str]:
    """The method without what has a default."""
    needed = [given for given in one.arguments if given.default is None]
    if len(needed) == len(one.arguments):
        return []
    names = " and ".join(camel(g.name) for g in one.arguments if g.default is not None)
    lines = ["", *block([f"The same without {names}."])]
    lines += listed(head, [declared(given) for given in needed], " {", "    ", fill=True)
    given = [camel(g.name) if g.default is None else default(g) for g in one.arguments]
    back = "return " if one.reply else ""
    return [*lines, f"        {back}{camel(one.method)}({', '.join(given)});", "    }"]


def requests(vocabulary: Vocabulary) -> list[str]:
    made = vocabulary.made_requests
    types = {one.body.name for one in made if one.body} | {"request_t", "reply_t"}
    imports = [f"import ruedo.lcmtypes.{type};" for type in sorted(types)]
    lines = [MADE, "package ruedo;", "", *imports, ""]
    lines += javadoc(
        "What {@link Simulation} asks the server for. Each throws NotSupported where the server has"
        " no such request, RequestError when it refuses, Timeout and NoServer"
    )
    lines += ["public abstract class Requests {", "    Requests() {}", ""]
    lines.append("    abstract Session session();")
    for one in made:
        lines += request(one, vocabulary)
    return [*lines, "}"]


def make(vocabulary: Vocabulary, methods: Path) -> dict[str, list[str]]:
    made = {f"ruedo/{one.name}.java": enum(one) for one in vocabulary.enums.values()}
    for one in (*vocabulary.samples.values(), *vocabulary.replies.values()):
        made[f"ruedo/{one.name}.java"] = sample(one, vocabulary, methods)
    made["ruedo/Requests.java"] = requests(vocabulary)
    made["ruedo/Decoders.java"] = decoders(vocabulary)
    return made
