"""The vocabulary and the message types, read and held against each other: what the makers of each
language work from.
"""

from __future__ import annotations

import keyword
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

try:
    import tomllib
except ImportError:  # Python 3.10
    import tomli as tomllib

LANGUAGES = ("cpp", "java", "python")
# Bytes of a value on the wire, at least.
SIZES = {
    "boolean": 1,
    "byte": 1,
    "int8_t": 1,
    "int16_t": 2,
    "int32_t": 4,
    "int64_t": 8,
    "float": 4,
    "double": 8,
    "string": 5,
}


# Words of the three languages, and what every sample has.
WORDS = """
auto bool boolean break byte case catch char class const continue default delete do double else enum
explicit export extends false final finally float for friend goto if implements import inline int
instanceof interface long mutable namespace native new null operator package private protected
public register return short signed sizeof static struct super switch synchronized template this
throw throws transient true try typedef typename union unsigned using virtual void volatile while
utime time
"""
RESERVED = {*WORDS.split(), *keyword.kwlist}


class Fault(Exception):
    """Something in the vocabulary or a message type that is not as it must be."""


@dataclass
class Constant:
    type: str
    name: str
    value: int
    doc: str


@dataclass
class Member:
    """Of a message; dims are numbers or names of members."""

    type: str
    name: str
    dims: list[str]


@dataclass
class Message:
    name: str
    members: list[Member] = field(default_factory=list)
    constants: list[Constant] = field(default_factory=list)

    def member(self, name: str) -> Member:
        for member in self.members:
            if member.name == name:
                return member
        raise Fault(f"{self.name} has no member {name}: it has {_names(self.members)}")

    def counted_by(self, name: str) -> list[Member]:
        """The arrays of so many elements."""
        return [member for member in self.members if member.dims[:1] == [name]]


@dataclass
class Value:
    """Of an enumeration. text: as messages have it; name: as programs do, in small letters."""

    name: str
    value: int
    text: str
    doc: str
    sent: bool = True  # in messages; else clients alone have it


@dataclass
class Enum:
    name: str
    doc: str
    type: str  # of its values on the wire
    values: list[Value]
    unknown: int | None  # what stands for values of a later server, in C++

    @property
    def sent_texts(self) -> str:
        return ", ".join(f'"{value.text}"' for value in self.values if value.sent)


@dataclass
class Field:
    """Of a sample; member: of the message, None for an array of equal steps."""

    name: str
    member: Member | None
    doc: str = ""
    languages: tuple[str, ...] = LANGUAGES
    shape: str = ""
    sizes: tuple[str, ...] = ()
    optional: bool = False
    steps: tuple[str, ...] = ()
    enum: str = ""
    alias: str = ""
    part: str = ""
    terminal: bool = False


@dataclass
class Record:
    """A sample, or a part of samples."""

    name: str
    message: Message
    doc: str
    fields: list[Field]
    java: str = ""
    methods: tuple[str, ...] = ()
    open: bool = False  # other classes of the clients are one, too

    def of(self, language: str) -> list[Field]:
        return [one for one in self.fields if language in one.languages]


@dataclass
class Argument:
    """Of a request's method; default: of all its values, None where it must be given."""

    name: str
    member: Member
    doc: str
    default: float | str | None


@dataclass
class Request:
    kind: str  # of request_t's constants
    method: str
    by_hand: bool  # each client has the method by hand
    doc: str
    body: Message | None
    arguments: list[Argument]
    reply: Record | None
    result: Field | None  # the method returns this of the reply
    seconds: int
    errors: dict[str, str]


@dataclass
class Vocabulary:
    messages: dict[str, Message]
    enums: dict[str, Enum]
    samples: dict[str, Record]
    parts: dict[str, Record]
    replies: dict[str, Record]
    requests: list[Request]

    @property
    def made_requests(self) -> list[Request]:
        return [request for request in self.requests if not request.by_hand]

    def has_utime(self, record: Record) -> bool:
        """Whether it is a Sample in the clients."""
        return record.name not in self.parts and record.message.members[0].name == "utime"

    def smallest(self, type: str) -> int:
        """Bytes that a value has at least."""
        if type in SIZES:
            return SIZES[type]
        total = 0
        for member in self.messages[type].members:
            if all(dim.isdigit() for dim in member.dims):
                count = 1
                for dim in member.dims:
                    count *= int(dim)
                total += count * self.smallest(member.type)
        return total


def _names(items: Any) -> str:
    return ", ".join(item.name for item in items)


def read_message(path: Path) -> Message:
    text = path.read_text(encoding="utf-8")
    found = re.search(r"struct\s+(\w+)\s*\{(.*)\}", text, re.DOTALL)
    if not found:
        raise Fault(f"{path}: it has no struct")
    message = Message(found[1])
    for line in found[2].splitlines():
        code, _, comment = line.partition("//")
        constant = re.match(r"\s*const\s+(\w+)\s+(\w+)\s*=\s*(-?\d+);", code)
        member = re.match(r"\s*(\w+)\s+(\w+)((?:\[\w+\])*);", code)
        if constant:
            message.constants.append(
                Constant(constant[1], constant[2], int(constant[3]), comment.strip())
            )
        elif member:
            message.members.append(Member(member[1], member[2], re.findall(r"\w+", member[3])))
    return message


def _checked(where: str, given: dict[str, Any], allowed: str) -> dict[str, Any]:
    for key in given:
        if key not in allowed.split():
            raise Fault(f"{where}: {key} is unknown; allowed are {allowed.replace(' ', ', ')}")
    return given


def _texts(given: dict[str, Any]) -> str:
    """unit, range, frame and doc, and the note behind a semicolon."""
    head = ", ".join(given[key] for key in ("unit", "range", "frame", "doc") if given.get(key))
    return "; ".join(text for text in (head, given.get("note", "")) if text)


def _field(where: str, name: str, given: dict[str, Any], message: Message) -> Field:
    _checked(
        f"{where}.{name}",
        given,
        "from unit range frame doc note languages shape sizes optional steps enum alias part terminal",
    )
    if name in RESERVED:
        raise Fault(f"{where}.{name}: the name means something else in C++, Java or Python")
    steps = tuple(given.get("steps", ()))
    for other in (*steps, *given.get("sizes", ())):
        message.member(other)
    return Field(
        name,
        None if steps else message.member(given.get("from", name)),
        _texts(given),
        tuple(given.get("languages", LANGUAGES)),
        given.get("shape", ""),
        tuple(given.get("sizes", ())),
        given.get("optional", False),
        steps,
        given.get("enum", ""),
        given.get("alias", ""),
        given.get("part", ""),
        given.get("terminal", False),
    )


def _record(kind: str, name: str, given: dict[str, Any], messages: dict[str, Message]) -> Record:
    where = f"{kind}.{name}"
    _checked(where, given, "message doc fields java methods open")
    if given.get("message") not in messages:
        raise Fault(f"{where}: there is no message {given.get('message')}")
    message = messages[given["message"]]
    fields = [_field(where, one, of, message) for one, of in given["fields"].items()]
    return Record(
        name,
        message,
        given["doc"],
        fields,
        given.get("java", name),
        tuple(given.get("methods", ())),
        given.get("open", False),
    )


def _enum(name: str, given: dict[str, Any], messages: dict[str, Message]) -> Enum:
    _checked(f"enums.{name}", given, "doc constants names words upper clients unknown")
    upper, names, words = (given.get(key) for key in ("upper", "names", "words"))
    values, type_of_values = [], ""
    for pattern in given["constants"]:
        type, _, prefix = pattern.rstrip("*").partition(".")
        if type not in messages:
            raise Fault(f"enums.{name}: there is no message {type}")
        for constant in messages[type].constants:
            if constant.name.startswith(prefix):
                plain, type_of_values = constant.name[len(prefix) :], constant.type
                own = (names or {}).get(plain, plain.lower())
                text = plain if upper else (words or {}).get(own, own.replace("_", " "))
                values.append(Value(own, constant.value, text, constant.doc))
    values += [
        Value(own, value, own.replace("_", " "), "", sent=False)
        for own, value in given.get("clients", {}).items()
    ]
    if len({one.value for one in values}) < len(values):
        raise Fault(f"enums.{name}: two of its constants have the same value")
    values.sort(key=lambda one: one.value)
    return Enum(name, given["doc"], type_of_values, values, given.get("unknown"))


def _argument(where: str, name: str, given: dict[str, Any], body: Message) -> Argument:
    _checked(f"{where}.{name}", given, "from unit range frame doc note default")
    member = body.member(given.get("from", name))
    if name in RESERVED:
        raise Fault(f"{where}.{name}: the name means something else in C++, Java or Python")
    if member.dims and (member.type != "double" or not member.dims[0].isdigit()):
        raise Fault(f"{where}.{name}: of arrays only doubles of a fixed number can be arguments")
    if member.type not in ("double", "string", "boolean", "int32_t", "int64_t"):
        raise Fault(f"{where}.{name}: no argument is of the type {member.type}: make it by hand")
    return Argument(name, member, _texts(given), given.get("default"))


def _request(
    kind: str, given: dict[str, Any], messages: dict[str, Message], replies: dict[str, Record]
) -> Request:
    where = f"requests.{kind}"
    _checked(where, given, "method by_hand doc body arguments reply result seconds errors")
    kinds = [constant.name for constant in messages["request_t"].constants]
    codes = [constant.name for constant in messages["reply_t"].constants]
    if kind not in kinds:
        raise Fault(f"{where}: request_t has no such constant; it has {', '.join(kinds)}")
    for name, known in (("body", messages), ("reply", replies)):
        if name in given and given[name] not in known:
            raise Fault(f"{where}: there is no {name} {given[name]}")
    for code in given.get("errors", {}):
        if code not in codes:
            raise Fault(f"{where}: {code} is not a code of reply_t: {', '.join(codes)} are")
    body = messages.get(given.get("body", ""))
    if given.get("arguments") and not body:
        raise Fault(f"{where}: arguments need a body")
    arguments = [
        _argument(where, name, of, body) for name, of in given.get("arguments", {}).items() if body
    ]
    reply = replies.get(given.get("reply", ""))
    result = [field for field in reply.fields if field.name == given.get("result")] if reply else []
    if "result" in given and not result:
        raise Fault(f"{where}: the reply has no field {given['result']}")
    return Request(
        kind,
        given.get("method") or given["by_hand"],
        "by_hand" in given,
        given["doc"],
        body,
        arguments,
        reply,
        result[0] if result else None,
        given.get("seconds", 5),
        given.get("errors", {}),
    )


def read(proto: Path) -> Vocabulary:
    """Raises Fault, with the place."""
    path = proto / "vocabulary.toml"
    try:
        given = tomllib.loads(path.read_text(encoding="utf-8"))
        _checked("the file", given, "enums samples parts replies requests")
        messages = {one.stem: read_message(one) for one in sorted(proto.glob("*.lcm"))}
        records = {
            kind: {name: _record(kind, name, of, messages) for name, of in given[kind].items()}
            for kind in ("samples", "parts", "replies")
        }
        enums = {name: _enum(name, of, messages) for name, of in given["enums"].items()}
        requests = [
            _request(kind, of, messages, records["replies"])
            for kind, of in given["requests"].items()
        ]
        vocabulary = Vocabulary(messages, enums, **records, requests=requests)
        for record in (record for kind in records.values() for record in kind.values()):
            _check_references(record, vocabulary)
    except (Fault, KeyError, tomllib.TOMLDecodeError) as error:
        missing = " is missing" if isinstance(error, KeyError) else ""
        raise Fault(f"{path}: {error}{missing}") from None
    return vocabulary


def _check_references(record: Record, vocabulary: Vocabulary) -> None:
    for one in record.fields:
        where = f"{record.name}.{one.name}"
        if one.enum and one.enum not in vocabulary.enums:
            raise Fault(f"{where}: there is no enumeration {one.enum}")
        if one.part and one.part not in vocabulary.parts:
            raise Fault(f"{where}: there is no part {one.part}")
        for language in one.languages:
            if language not in LANGUAGES:
                raise Fault(f"{where}: {language} is not a language: {', '.join(LANGUAGES)} are")
        _check_member(where, one)
    if record.name in vocabulary.samples and not vocabulary.has_utime(record):
        raise Fault(f"{record.name}: its message does not begin with int64_t utime")


def _check_member(where: str, one: Field) -> None:
    member = one.member
    if not member:
        return
    if len(member.dims) > 1:
        raise Fault(f"{where}: an array of arrays: give it a type of its own, and a part")
    if member.type not in SIZES and not (one.part and member.dims):
        raise Fault(f"{where}: of the type {member.type} it must be an array, and needs a part")
    if member.dims and one.enum:
        raise Fault(f"{where}: an enumeration is of single values")
    if member.type == "byte" and not member.dims:
        raise Fault(f"{where}: a single byte: int8_t is a number")
