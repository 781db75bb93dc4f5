"""Wraps the prose of Markdown pages at 100 columns: wrap.py FILE... Tables, code, headings and
pictures stay as they are.
"""

import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

WIDTH = 100
ITEM = re.compile(r"( *)([-*]|\d+\.) +")
KEPT = re.compile(r"\s*(\||#|<|:::|!\[|$)|    ")  # of lines outside of lists
# Characters that begin a list, a heading or a quotation at the start of a line.
SIGN = re.compile(r" (?=([-+*#>]|\d+[.)]) )")


def wrapped(text: str, first: str, rest: str) -> list[str]:
    glued = SIGN.sub("\x01", " ".join(text.split()))
    lines = textwrap.wrap(
        glued,
        WIDTH,
        initial_indent=first,
        subsequent_indent=rest,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace("\x01", " ") for line in lines]


def blocks(lines: list[str]) -> Iterator[tuple[str, list[str]]]:
    """("kept" or "prose", lines): prose is a paragraph or an item of a list."""
    paragraph: list[str] = []
    fenced = in_list = False
    for line in lines:
        fence = line.lstrip().startswith("```")
        item = ITEM.match(line)
        if not line.strip():
            kept = True
        elif not line.startswith(" ") and not item:
            in_list = in_list and bool(paragraph)  # a lazy continuation, or the end of the list
            kept = bool(KEPT.match(line))
        else:
            in_list = in_list or (bool(item) and not line.startswith("    "))
            kept = bool(KEPT.match(line.lstrip() if in_list else line))
        if fenced or fence or kept or item:
            if paragraph:
                yield "prose", paragraph
            paragraph = []
        if fenced or fence or kept:
            fenced = fenced != fence
            yield "kept", [line]
        else:
            paragraph.append(line)
    if paragraph:
        yield "prose", paragraph


def wrap(text: str) -> str:
    result = []
    for kind, lines in blocks(text.split("\n")):
        if kind == "kept":
            result += lines
            continue
        item = ITEM.match(lines[0])
        indent = re.match(" *", lines[0])[0]
        first = item[0] if item else indent
        rest = " " * len(first) if item else indent
        body = " ".join([lines[0][len(first) :], *lines[1:]])
        result += wrapped(body, first, rest)
    return "\n".join(result)


if __name__ == "__main__":
    for name in sys.argv[1:]:
        Path(name).write_text(wrap(Path(name).read_text(encoding="utf-8")), encoding="utf-8")
