"""The site: it builds without a warning, loads nothing from elsewhere, its first page has five
links for each reader, and its prose stays short.
"""

import os
import re
import shutil
import subprocess
import sys
import urllib.request
import zipfile
from html.parser import HTMLParser
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "console"))
from harness import CHROMIUM, NODE, needs_browser

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts/site"))
from wrap import wrap

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
# Pages whose tables and texts scripts write from measurements or from proto/.
APPENDIX = {
    "corpus.md",
    "experiments.md",
    "messages.md",
    "performance.md",
    "physics.md",
    "public-worlds.md",
    "reality.md",
    "robots/README.md",
}
PAGES = [
    *(ROOT / name for name in ("CONTRIBUTING.md", "SECURITY.md")),
    *(
        p
        for p in sorted((ROOT / "docs").rglob("*.md"))
        if str(p.relative_to(ROOT / "docs")) not in APPENDIX
    ),
]
MOST_BYTES = 200_000  # without the course, which is a book of its own, made of notebooks
READERS = ["Student", "ROS developer", "Engineer with CI", "Researcher who trains", "Maintainer"]


def prose(text):
    """Without code, comments and the rows of tables."""
    text = re.sub(r"^ *```.*?^ *```$|<!--.*?-->", "", text, flags=re.MULTILINE | re.DOTALL)
    lines = [line for line in text.splitlines() if not line.lstrip().startswith("|")]
    return "\n".join(line for line in lines if not line.startswith("    "))


class Loaded(HTMLParser):
    """What a browser fetches for a page without a click, and where its links lead."""

    def __init__(self):
        super().__init__()
        self.loads, self.links = [], []

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        if tag in ("script", "img", "iframe", "source", "video") and given.get("src"):
            self.loads.append(given["src"])
        if tag == "link" and given.get("rel") in ("stylesheet", "icon", "preconnect", "preload"):
            self.loads.append(given["href"])
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])


def parsed(page):
    found = Loaded()
    found.feed(page.read_text(encoding="utf-8"))
    return found


@pytest.fixture(scope="module")
def site():
    """As the target makes it, with Doxygen's and javadoc's pages."""
    result = subprocess.run(
        ["cmake", "--build", BUILD, "--target", "ruedo-site"],
        capture_output=True,
        text=True,
        timeout=1200,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return BUILD / "site"


def test_pages_load_nothing_from_elsewhere(site):
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 50
    for page in pages:
        for address in parsed(page).loads:
            assert not re.match(r"(https?:)?//", address), f"{page.name}: {address}"
    for sheet in site.rglob("*.css"):
        for address in re.findall(
            r"(?:url|@import)\s*\(?['\"]?((?:https?:)?//[^'\")]+)",
            sheet.read_text(encoding="utf-8"),
        ):
            pytest.fail(f"{sheet.name}: {address}")


def test_links_of_the_site_lead_somewhere(site):
    for page in site.rglob("*.html"):
        if (
            page.is_relative_to(site / "api/cpp")
            or page.is_relative_to(site / "api/java")
            or page.name == "404.html"
        ):
            continue
        for link in parsed(page).links:
            path = link.partition("#")[0].partition("?")[0]
            if path and "://" not in path and not path.startswith(("mailto:", "javascript:")):
                assert (page.parent / path).exists(), f"{page.relative_to(site)}: {link}"


def test_pages_load_few_bytes(site):
    files = [path for path in site.rglob("*") if path.is_file()]
    assert not [path for path in files if path.suffix == ".map"]
    # Most of it pictures; what is left is compressed to a quarter in the wheel.
    assert sum(path.stat().st_size for path in files) < 16e6


def test_there_is_a_page_of_each_command_sample_and_class(site):
    for page, words in {
        "commands.html": ["regress", "nav2-params", "--lockstep"],
        "messages.html": ["Odometry", "GET_STATE"],
        "api/python.html": [
            "ruedo.robot.Robot.advance",
            "ruedo.engine.Engine.observe",
            "ruedo.world.World.wall",
        ],
        "world-files.html": ["ruedo:watchdog"],
    }.items():
        text = (site / page).read_text(encoding="utf-8")
        for word in words:
            assert word in text, (page, word)


@pytest.mark.parametrize(
    ("page", "needs"),
    [
        ("api/python.html", "python3"),
        ("api/cpp/classruedo_1_1client_1_1Robot.html", "doxygen"),
        ("api/java/ruedo/Robot.html", "javadoc"),
    ],
)
def test_each_client_has_its_reference(site, page, needs):
    if not shutil.which(needs):
        pytest.skip(f"no {needs} here: the site is built without its pages")
    text = (site / page).read_text(encoding="utf-8")
    assert all(word in text for word in ("advance", "rotate", "stop")), page
    if needs != "python3":
        folder = page.split("/")[1]
        assert f"{folder}/index.html" in parsed(site / "api/others.html").links


def test_the_course_has_a_page_of_each_evening(site):
    """With its formulas, which no library draws, its pictures and its program."""
    evenings = sorted((ROOT / "clients/python/examples/course").glob("evening_*.ipynb"))
    assert len(evenings) == 10
    for notebook in evenings:
        text = (site / f"course/{notebook.stem}.html").read_text(encoding="utf-8")
        assert '<math xmlns="http://www.w3.org/1998/Math/MathML"' in text and "$" not in text, (
            notebook
        )
        assert "The idea" in text and "Beyond" in text
    first = (site / "course/evening_1_odometry.html").read_text(encoding="utf-8")
    assert all(word in first for word in ("LaunchOptions", "SquareStart", "images/odometry.svg"))


def test_search_has_all_pages(site):
    index = (site / "search/search_index.json").read_text(encoding="utf-8")
    assert all(word in index for word in ("advance", "Coming from Webots", "dead reckoning"))


def test_each_reader_has_five_links():
    text = (ROOT / "docs/index.md").read_text(encoding="utf-8")
    sections = dict(re.findall(r"^## ([^\n]+)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL))
    assert list(sections) == READERS
    for reader, section in sections.items():
        assert len(re.findall(r"^\d\. \[", section, re.MULTILINE)) == 5, reader


def test_the_glossary_is_short_and_in_order():
    text = (ROOT / "docs/glossary.md").read_text(encoding="utf-8")
    words = re.findall(r"^\| ([a-z ]+) \|", text, re.MULTILINE)
    assert words == sorted(words) and 30 <= len(words) <= 40, len(words)


def test_prose_is_short():
    sizes = {
        str(p.relative_to(ROOT)): len(prose(p.read_text(encoding="utf-8")).encode()) for p in PAGES
    }
    longest = sorted(sizes.items(), key=lambda item: -item[1])[:8]
    print(f"prose: {sum(sizes.values())} bytes of {len(sizes)} pages; longest: {longest}")
    assert sum(sizes.values()) <= MOST_BYTES, longest


@pytest.mark.parametrize(
    "page", [p for p in PAGES if p.name != "architecture.md"], ids=lambda p: p.name
)
def test_prose_is_wrapped(page):
    """scripts/site/wrap.py FILE wraps it; scripts write architecture.md."""
    text = page.read_text(encoding="utf-8")
    assert wrap(text) == text


def test_prose_is_what_is_left_of_a_page():
    assert prose("a\n```sh\nb\n```\n| c |\n    d\n<!-- e -->\nf") == "a\n\n\nf"


@pytest.fixture
def address(site):
    """Of the site, as `ruedo docs` serves it."""
    environment = os.environ | {
        "RUEDO": str(BUILD / "bin/ruedo"),
        "PYTHONPATH": str(BUILD / "python"),
    }
    program = "import sys; from ruedo.docs import main; sys.exit(main(['docs', *sys.argv[1:]]))"
    words = [sys.executable, "-c", program, "--no-browser"]
    with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            line = process.stdout.readline()
            yield re.search(r"http://127\.0\.0\.1:\d+/index\.html", line)[0]
        finally:
            process.terminate()


def test_ruedo_docs_serves_it(address):
    with urllib.request.urlopen(address, timeout=30) as answer:
        assert b"Ten minutes" in answer.read()


@needs_browser
def test_a_reader_finds_a_page_by_typing(address):
    """In the dark and in the light, on a desktop and on a phone, and with no other host."""
    result = subprocess.run(
        [NODE, ROOT / "tests/docs/search.mjs", address, "coming from webots"],
        cwd=BUILD / "web",
        env=os.environ | {"CHROMIUM": CHROMIUM},
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    found = "true /from/webots.html Webots - Ruedo"
    expected = [f"default {found}", f"slate {found}", f"slate {found}"]
    assert (result.returncode, result.stdout.splitlines()) == (0, expected), result.stderr


def test_its_wheel_is_small_and_has_licences(site, tmp_path):
    sys.path.insert(0, str(ROOT / "scripts"))
    import make_wheel

    (tmp_path / "tree").mkdir()
    (file,) = make_wheel.pack_docs(BUILD, tmp_path / "tree", tmp_path, "0.1.0", 9)
    assert file.stat().st_size < 6e6
    names = zipfile.ZipFile(file).namelist()
    assert "ruedo/share/doc/ruedo/site/index.html" in names
    for package in ("mkdocs", "mkdocs-material", "mkdocstrings-python"):
        assert any(f"/licenses/{package}/" in name for name in names), package
    nothing = tmp_path / "a build without a site"
    assert make_wheel.pack_docs(nothing, tmp_path / "none", tmp_path, "0.1.0", 1) == []


@needs_browser
def test_pages_fit_a_desktop_and_a_phone(site):
    pages = [str(page.relative_to(site)) for page in sorted(site.rglob("*.html"))]
    own = [page for page in pages if not page.startswith(("api/cpp", "api/java", "404"))]
    result = subprocess.run(
        [NODE, ROOT / "tests/docs/pages.mjs", site, *own],
        cwd=BUILD / "web",
        env=os.environ | {"CHROMIUM": CHROMIUM},
        capture_output=True,
        text=True,
        timeout=1500,
        check=False,
    )
    assert (result.returncode, result.stdout) == (0, ""), result.stdout + result.stderr
