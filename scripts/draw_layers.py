"""Draws the map of docs/architecture.md: what each layer does, and which of the others it uses.

    scripts/draw_layers.py        writes docs/images/layers.svg (needs Graphviz's dot)

The layers and arrows are the ruedo_layer() lines of the top CMakeLists.txt, without arrows that
follow from others; the words are those of the page's table.
"""

import html
import re
import subprocess
import sys
import textwrap
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from walls import layers  # noqa: E402

PAGE, PICTURE = "docs/architecture.md", "docs/images/layers.svg"
WIDTH = 30  # characters of a box's lines


def words(root):
    """{layer: what it does}, from the page's table of layers."""
    page = (root / PAGE).read_text(encoding="utf-8")
    table = page[page.index("| Layer |") :].split("\n\n")[0]
    rows = [line.split("|") for line in table.splitlines()[2:]]
    return {row[1].strip(" `"): row[2].strip().replace("`", "") for row in rows}


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


def graph(known, texts):
    """The map in Graphviz's language."""
    lines = [
        "digraph layers {",
        'graph [ranksep=0.35, nodesep=0.25, bgcolor=white, fontname="sans-serif"]',
        'node [shape=box, style="rounded,filled", fillcolor="#f4f6f8", color="#5b6b7b", fontname="sans-serif", fontsize=11, margin="0.12,0.07"]',
        'edge [color="#5b6b7b", arrowsize=0.7]',
    ]
    for layer in known:
        text = "<br/>".join(
            html.escape(line) for line in textwrap.wrap(texts[layer], WIDTH, break_long_words=False)
        )
        lines.append(f'"{layer}" [label=<<b>{layer}</b><br/>{text}>]')
    lines += [f'"{layer}" -> "{other}"' for layer, other in sorted(arrows(known))]
    return "\n".join([*lines, "}"])


def main():
    known = layers(ROOT)
    drawn = subprocess.run(
        ["dot", "-Tsvg"],
        input=graph(known, words(ROOT)),
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    svg = re.sub(r"<!--.*?-->\n?", "", drawn[drawn.index("<svg") :], flags=re.DOTALL)
    (ROOT / PICTURE).write_text(svg, encoding="utf-8")


if __name__ == "__main__":
    main()
