"""Writes fitted values into a robot's SDF file: its text stays as it is, but for these elements."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path as File

from .errors import FitError

_NAMESPACE = 'xmlns:ruedo="urn:ruedo"'
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


@dataclass(frozen=True)
class Setting:
    """A value for one element. path: names of elements below <model>, with [NAME] for a name."""

    path: str  # "ruedo:odometry/ruedo:slip_noise", "sensor[lrf]/lidar/noise/stddev"
    value: str
    source: str  # becomes the comment beside it


def write_fitted(robot: File, settings: list[Setting], out: File, source: str) -> None:
    """A copy of the model file `robot` with these values. Raises FitError where it is not SDF
    model.
    """
    text = robot.read_text(encoding="utf-8")
    if not re.search(r"<sdf\b", text) or not re.search(r"<model\b", text):
        raise FitError(f"{robot}: not an SDF model; fitted values are written into SDF models only")
    if "urn:ruedo" not in text:
        text = re.sub(r"<sdf\b", f"<sdf {_NAMESPACE}", text, count=1)
    for setting in settings:
        text = _set(robot, text, setting)
    if robot.parent.resolve() != out.parent.resolve():
        text = _with_uris(text, robot.parent, out.parent)
    head = text.index("<sdf")
    note = f"<!-- {_plain(source)} -->\n"
    out.write_text(text[:head] + note + text[head:], encoding="utf-8")


def _plain(text: str) -> str:
    return re.sub(r"-(?=-)|-$", "- ", text)


def _blank(text: str) -> str:
    """The text with comments blanked out, at the same places."""
    return _COMMENT.sub(lambda match: " " * len(match.group(0)), text)


def _find(text: str, tag: str, begin: int, end: int) -> tuple[int, int, int] | None:
    """Begin, begin of the content and end of the content of an element in text[begin:end]."""
    name, _, wanted = tag.partition("[")
    named = rf"\bname\s*=\s*[\"']{re.escape(wanted[:-1])}[\"']" if wanted else ""
    opening = re.compile(rf"<{name}(?=[\s>/])(?=[^>]*{named})[^>]*?(/?)>")
    match = opening.search(text, begin, end)
    if match is None:
        return None
    if match.group(1):
        return match.start(), match.end(), match.end()
    depth, at = 1, match.end()
    for one in re.compile(rf"<(/?){name}(?=[\s>/])[^>]*?(/?)>").finditer(text, at, end):
        depth += -1 if one.group(1) else (0 if one.group(2) else 1)
        if depth == 0:
            return match.start(), match.end(), one.start()
    return None


def _set(robot: File, text: str, setting: Setting) -> str:
    blank = _blank(text)
    place = _find(blank, "model", 0, len(blank))
    if place is None:
        raise FitError(f"{robot}: no <model>...</model>")
    _, begin, end = place
    tags = setting.path.split("/")
    while tags:
        found = _find(blank, tags[0], begin, end)
        if found is None:
            break
        start, begin, end = found
        tags = tags[1:]
        if begin == end and text[begin - 2] == "/":  # <element/>: nothing is in it
            name = re.match(r"<([\w:]+)", text[start:])
            assert name
            text = f"{text[: begin - 2]}></{name.group(1)}>{text[begin:]}"
            begin = end = begin - 1
            blank = _blank(text)
    note = f"  <!-- {_plain(setting.source)} -->"
    if not tags:
        close = text.index(">", end) + 1
        after = re.match(r"[ \t]*<!--.*?-->(?=\n)", text[close:])
        close_of_note = close + (after.end() if after and "fitted" in after.group(0) else 0)
        return text[:begin] + setting.value + text[end:close] + note + text[close_of_note:]
    if "[" in tags[0]:
        raise FitError(f"{robot}: no <{tags[0].replace('[', ' name=').rstrip(']')}> in the model")
    line = text.rfind("\n", 0, end) + 1
    indent = re.match(r"[ \t]*", text[line:]).group(0)  # type: ignore[union-attr]
    inner = setting.value
    for tag in reversed(tags):
        inner = f"<{tag}>{inner}</{tag}>"
    if text[line:end].strip():  # the closing tag stands on the line of other text
        return text[:end] + inner + text[end:]
    return f"{text[:line]}{indent}  {inner}{note}\n{text[line:]}"


def _with_uris(text: str, before: File, after: File) -> str:
    """Files that the model names beside itself, as seen from its new folder."""

    def moved(match: re.Match[str]) -> str:
        uri = match.group(2).strip()
        if "://" in uri or uri.startswith("/") or not (before / uri).exists():
            return match.group(0)
        return f"{match.group(1)}{os.path.relpath((before / uri).resolve(), after.resolve())}{match.group(3)}"

    return re.sub(r"(<uri>)([^<]*)(</uri>)", moved, text)
