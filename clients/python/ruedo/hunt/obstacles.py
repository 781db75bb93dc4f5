"""Obstacles, in the text of a world: boxes that a hunt puts there, and models that are left out."""

from __future__ import annotations

from xml.parsers import expat

Box = tuple[float, float, float]  # x, y, side (m)


def with_boxes(text: bytes, boxes: list[Box]) -> bytes:
    """Raises ValueError for a text without a world to put them into."""
    models = "".join(
        f"<model name='hunted_{i}'><static>true</static><pose>{x!r} {y!r} 0.5 0 0 0</pose><link name='link'>"
        f"<collision name='c'><geometry><box><size>{side!r} {side!r} 1</size></box></geometry></collision>"
        f"<visual name='v'><geometry><box><size>{side!r} {side!r} 1</size></box></geometry></visual></link></model>"
        for i, (x, y, side) in enumerate(boxes)
    )
    end = _end_of_world(text)
    return text[:end] + models.encode() + text[end:]


def _end_of_world(text: bytes) -> int:
    """The offset of the closing `</world>`, comments aside."""
    found: list[int] = []
    parser = expat.ParserCreate()

    def ends(name: str) -> None:
        if name == "world" and text.startswith(b"</", parser.CurrentByteIndex):
            found.append(parser.CurrentByteIndex)

    parser.EndElementHandler = ends
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise ValueError(f"obstacles cannot be put into it: {error}") from None
    if not found:
        raise ValueError("obstacles need a world with models, and it has none")
    return found[0]


def models_of(text: bytes) -> list[tuple[str, int, int]]:
    """The models that stand in a world, and what it includes: name, begin and end in the text.
    Raises ValueError for no XML.
    """
    found: list[tuple[str, int, int]] = []
    path: list[str] = []
    begin, name, said = 0, "", ""
    parser = expat.ParserCreate()

    def begins(tag: str, attributes: dict[str, str]) -> None:
        nonlocal begin, name, said
        path.append(tag)
        said = ""
        if path[1:] in (["world", "model"], ["world", "include"]):
            begin, name = parser.CurrentByteIndex, attributes.get("name", "")

    def says(more: str) -> None:
        nonlocal said
        said += more

    def ends(tag: str) -> None:
        nonlocal name, said
        if path[1:] == ["world", "include", "name"]:
            name = said.strip()
        elif path[1:] == ["world", "include", "uri"]:
            name = name or said.strip().rpartition("/")[2]
        elif path[1:] in (["world", "model"], ["world", "include"]):
            found.append((name, begin, text.index(b">", parser.CurrentByteIndex) + 1))
        path.pop()

    parser.StartElementHandler, parser.EndElementHandler = begins, ends
    parser.CharacterDataHandler = says
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise ValueError(f"its models cannot be found: {error}") from None
    return found


def without_model(text: bytes, name: str) -> bytes:
    for one, begin, end in models_of(text):
        if one == name:
            return text[:begin] + text[end:]
    raise ValueError(f"it has no model {name!r}")
