"""Writes what docs/architecture.md says of the layers: its two tables, and their map.

    scripts/draw_layers.py        (the map needs Graphviz's dot)

The layers and arrows are the ruedo_layer() lines of the top CMakeLists.txt, without arrows that
follow from others; the words are the first paragraphs of the READMEs below src/; which libraries
belong to one layer alone, tests/walls.py says.
"""

import html
import re
import subprocess
import sys
import textwrap
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from walls import LIBRARIES, layer_of, layers  # noqa: E402

PAGE, PICTURE = "docs/architecture.md", "docs/images/layers.svg"
WIDTH = 30  # characters of a box's lines


def purpose(root, room):
    """The first paragraph of a room's README."""
    text = (root / "src" / room / "README.md").read_text(encoding="utf-8")
    return " ".join(text.split("\n\n")[1].split())


def arrows(known):
    """(layer, a layer that it uses), without those that other arrows lead to."""
    found = set()
    for layer, uses in known.items():
        below = uses - {layer}
        found |= {
            (layer, other)
            for other in below
            if not any(other in known[between] - {between} for between in below)
        }
    return found


def with_tables(page, root):
    """The page, with the tables of the layers and of the folders in them."""
    known = layers(root)
    rows = []
    for layer in reversed(known):
        own = ", ".join(
            name for name, (_, homes) in LIBRARIES.items() if homes - {"bench"} == {layer}
        )
        rows.append(f"| [`{layer}`](../src/{layer}) | {purpose(root, layer).rstrip('.')} | {own} |")
    folders = []
    for path in sorted((root / "src").rglob("README.md")):
        room = path.parent.relative_to(root / "src").as_posix()
        layer = layer_of(room + "/", known)
        if layer and room != layer:
            folders.append(f"| [`{room}`](../src/{room}) | {purpose(root, room).rstrip('.')} |")
    for head, lines in (("| Layer |", rows), ("| Folder |", folders)):
        begin = page.index(head)
        begin = page.index("\n", page.index("\n", begin) + 1) + 1  # behind the row of dashes
        page = page[:begin] + "\n".join(lines) + page[page.index("\n\n", begin) :]
    return page


def graph(known, root):
    """The map in Graphviz's language."""
    lines = [
        "digraph layers {",
        'graph [ranksep=0.35, nodesep=0.25, bgcolor=white, fontname="sans-serif"]',
        'node [shape=box, style="rounded,filled", fillcolor="#f4f6f8", color="#5b6b7b", fontname="sans-serif", fontsize=11, margin="0.12,0.07"]',
        'edge [color="#5b6b7b", arrowsize=0.7]',
    ]
    for layer in known:
        words = textwrap.wrap(purpose(root, layer).rstrip("."), WIDTH, break_long_words=False)
        text = "<br/>".join(html.escape(line) for line in words)
        lines.append(f'"{layer}" [label=<<b>{layer}</b><br/>{text}>]')
    lines += [f'"{layer}" -> "{other}"' for layer, other in sorted(arrows(known))]
    return "\n".join([*lines, "}"])


def main():
    page = ROOT / PAGE
    page.write_text(with_tables(page.read_text(encoding="utf-8"), ROOT), encoding="utf-8")
    drawn = subprocess.run(
        ["dot", "-Tsvg"],
        input=graph(layers(ROOT), ROOT),
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    svg = re.sub(r"<!--.*?-->\n?", "", drawn[drawn.index("<svg") :], flags=re.DOTALL)
    (ROOT / PICTURE).write_text(svg, encoding="utf-8")


if __name__ == "__main__":
    main()
