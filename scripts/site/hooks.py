"""Hooks of MkDocs: what makes pages that are written for a repository's browser a site.

Pages at the top of the repository join those of docs/, links to sources become plain text, the
course is made of its notebooks, and the commands' page is what `ruedo COMMAND --help` prints. RUEDO
is the program.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts/site"))

import course  # noqa: E402

FROM_THE_TOP = {
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
    "CHANGELOG.md": "changelog.md",
}
FENCES = re.compile(r"(^ *```.*?^ *```$)", re.MULTILINE | re.DOTALL)
BEFORE_LIST = re.compile(r"^((?![-*|#>]|\d+\. ).+)\n(?=(- |\d+\. )\S)", re.MULTILINE)
LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(([^)\s]+)\)")


def help_of(words):
    program = os.environ.get("RUEDO", str(ROOT / "build/release/bin/ruedo"))
    return subprocess.run(
        [program, *words, "--help"], stdout=subprocess.PIPE, text=True, check=True
    ).stdout


def commands_page():
    """The help of each command; its line of the summary where the help fails."""
    summary = help_of([])
    names = re.findall(
        r"^  ([a-z][a-z0-9-]+) {2,}(\S.*)$", summary.partition("Subcommands:")[2], re.MULTILINE
    )
    parts = ["# Commands\n\n`ruedo COMMAND --help` prints the same.\n"]
    for name, about in names:
        try:
            text = help_of([name])
        except subprocess.CalledProcessError:
            text = f"{about}\n"
        parts.append(f"## {name}\n\n```text\n{text}```\n")
    return "\n".join(parts)


def on_files(files, config):
    for source, name in FROM_THE_TOP.items():
        files.append(
            File.generated(config, name, content=(ROOT / source).read_text(encoding="utf-8"))
        )
    files.append(File.generated(config, "commands.md", content=commands_page()))
    for name, content in course.pages():
        files.append(File.generated(config, name, content=content))
    for name, picture in course.pictures():
        files.append(File.generated(config, name, abs_src_path=str(picture)))
    return files


def target_of(page, link):
    """The link within the site, or None where it leads out of it."""
    path, mark, anchor = link.partition("#")
    if "://" in link or not path:
        return link
    top = page in FROM_THE_TOP.values()
    folder = ROOT if top else (ROOT / "docs" / page).parent
    file = (folder / path).resolve()
    if file.parent == ROOT and file.name in FROM_THE_TOP:
        inside = FROM_THE_TOP[file.name]
    elif file == course.COURSE / "README.md":
        inside = "course/index.md"
    elif file.is_file() and file.is_relative_to(ROOT / "docs"):
        inside = str(file.relative_to(ROOT / "docs"))
    elif not file.exists() and not top:
        return link  # a page that is generated
    else:
        return None
    return os.path.relpath(inside, Path(page).parent) + mark + anchor


def on_page_markdown(markdown, page, config, files):
    name = page.file.src_uri
    for folder, pages in others() if name == "api/others.md" else ():
        if not pages:
            link = rf'<a href="{Path(folder).name}/index.html">(.*?)</a>'
            markdown = re.sub(link, r"\1 (not in this build)", markdown)
    if page.parent is None:
        page.meta["hide"] = ["navigation"]  # it has no pages beside it
    if name == "contributing.md":  # Python's Markdown indents lists by four columns
        markdown = re.sub(r"^   (?=\S)", "    ", markdown, flags=re.MULTILINE)

    def replaced(match):
        inside = target_of(name, match[2])
        return match[1] if inside is None else f"[{match[1]}]({inside})"

    parts = FENCES.split(markdown)
    for i, part in enumerate(parts):
        if i % 2:
            parts[i] = re.sub(r"^( *```\w+) (?:test|serves)$", r"\1", part, flags=re.MULTILINE)
        else:  # a list has an empty line before it there, and one within a list four columns
            part = re.sub(r"^  (?=- \S)", "    ", part, flags=re.MULTILINE)
            parts[i] = BEFORE_LIST.sub(r"\1\n\n", LINK.sub(replaced, part))
    return "".join(parts)


def others():
    """(folder in the site, pages) of Doxygen and javadoc; None where no build made them."""
    for variable, folder in (("RUEDO_CPP_PAGES", "api/cpp"), ("RUEDO_JAVA_PAGES", "api/java")):
        pages = Path(os.environ.get(variable, ""))
        yield folder, pages if (pages / "index.html").is_file() else None


def on_post_build(config):
    for folder, pages in others():
        if pages:
            shutil.copytree(pages, Path(config.site_dir) / folder, dirs_exist_ok=True)
