"""The course's pages, from its notebooks, so that neither can part from the other: formulas become
MathML, which browsers draw without a library, and code cells are listed.
"""

import json
import re
from collections.abc import Iterator
from pathlib import Path

from latex2mathml.converter import convert

COURSE = Path(__file__).resolve().parents[2] / "clients/python/examples/course"
FORMULA = re.compile(r"\$\$(.+?)\$\$|(?<![\\$`])\$([^$`]+?)\$", re.DOTALL)
LANGUAGES = {".cpp": ("C++", "cpp"), ".java": ("Java", "java")}
STARTS = {  # those of other languages
    "evening_1_odometry": ("square.cpp", "SquareStart.java"),
    "evening_2_ranges": ("sonar_avoidance.cpp", "SonarAvoidanceStart.java"),
    "evening_3_wall_following": ("wall_following.cpp", "WallFollowingStart.java"),
}
MAGIC = re.compile(r"^%.*\n", re.MULTILINE)


def pages() -> Iterator[tuple[str, str]]:
    """(name in the site, Markdown)."""
    index = (COURSE / "README.md").read_text(encoding="utf-8")
    yield "course/index.md", index.replace(".ipynb)", ".md)")
    for notebook in COURSE.glob("*.ipynb"):
        yield f"course/{notebook.stem}.md", page(notebook)


def pictures() -> Iterator[tuple[str, Path]]:
    for picture in (COURSE / "images").iterdir():
        yield f"course/images/{picture.name}", picture


def page(notebook: Path) -> str:
    parts = []
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        text = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(with_formulas(text))
        else:
            parts.append(f"```python\n{MAGIC.sub('', text)}\n```")
    title, _, rest = parts[0].partition("\n")
    parts[0] = (
        f"{title}\n\n*This page is the notebook `course/{notebook.name}`, which "
        f"[`ruedo course`](index.md) copies to you.*\n{rest}"
    )
    return "\n\n".join([*parts, *starts(notebook)])


def starts(notebook: Path) -> Iterator[str]:
    for file in STARTS.get(notebook.stem, ()):
        title, language = LANGUAGES[Path(file).suffix]
        program = (COURSE / "starts" / file).read_text(encoding="utf-8")
        yield f"## A start in {title}\n\n`course/starts/{file}`\n\n```{language}\n{program}```"


def with_formulas(text: str) -> str:
    def formula(match: re.Match[str]) -> str:
        if match[1]:
            mathml = convert(match[1], display="block")
            return f'\n<div class="formula">{mathml}</div>\n'
        inline = convert(match[2]).replace("*", "&#x2A;")  # Markdown's emphasis
        return f"<span>{inline}</span>"  # a line that begins with <math> would be a block

    return FORMULA.sub(formula, text)
