"""Obstacles of a hunt, as boxes in the text of its world."""

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
    """Where its `</world>` begins: not one in a comment."""
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
