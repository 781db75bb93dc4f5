"""The documentation's examples, run as they stand: every fenced block that begins with ```sh test
or ```python test.

A block runs in an empty folder that has the tree's worlds/ and clients/ in it, the built ruedo in
the path and a network of its own, so that nothing leaves the machine. Commands run under bash -eu;
a Python program finds a server with worlds/arena.sdf, and goes to pytest when it is a test. Links
to files are followed, too.
"""

import functools
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BINARIES = Path(os.environ.get("RUEDO_BINARY_DIR", ROOT / "build/release")) / "bin"
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
TIMEOUT_S = 400
NETWORK = "ip link set lo up; ip route add 224.0.0.0/4 dev lo; "


# Serves the arena until the program ends, which begins once the server answers. One that finds none
# within the 2 s of connect() was held up, or the server was: it begins again.
SERVED = """ruedo run worlds/arena.sdf --quiet & server=$!
trap 'kill $server; wait $server || true' EXIT
until python -c 'import ruedo; ruedo.connect().close()'; do kill -0 $server; done
until python block.py > said 2>&1; do kill -0 $server; grep -q 'no Ruedo server answered' said || { cat said; exit 1; }; done
cat said
"""


def blocks(text):
    """(line number, language, content) of each tested block."""
    for match in re.finditer(r"^```(sh|python) test\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        yield text.count("\n", 0, match.start()) + 1, match.group(1), match.group(2)


def isolated():
    """The command line that gives a program a network of its own, or [] where the system
    refuses.
    """
    for flags in (["-n"], ["-rn"]):
        command = ["unshare", *flags, "sh", "-c", NETWORK + 'exec "$@"', "sh"]
        if subprocess.run([*command, "true"], capture_output=True).returncode == 0:
            return command
    return []


def run_block(language, content, folder):
    for name in ("worlds", "clients", "docs"):
        (folder / name).symlink_to(ROOT / name)
    if language == "python":
        (folder / "block.py").write_text(content, encoding="utf-8")
        content = "python -m pytest -q block.py" if "def test_" in content else SERVED
    environment = {
        **os.environ,
        "PATH": f"{BINARIES}:{ROOT / '.venv/bin'}:{os.environ['PATH']}",
        "PYTHONPATH": str(BINARIES.parent / "python"),
    }
    return subprocess.run(
        [*isolated(), "bash", "-euo", "pipefail", "-c", content],
        cwd=folder,
        env=environment,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=TIMEOUT_S,
    )


CASES = [
    pytest.param(language, content, id=f"{document.relative_to(ROOT)}:{line}")
    for document in DOCUMENTS
    if document.exists()
    for line, language, content in blocks(document.read_text(encoding="utf-8"))
]


@pytest.mark.parametrize("language, content", CASES)
def test_examples_of_the_documentation(language, content, tmp_path):
    if not isolated():
        pytest.skip("no network namespaces here (unshare -n and -rn are refused)")
    assert (BINARIES / "ruedo").exists(), f"build it first: {BINARIES}/ruedo"
    result = run_block(language, content, tmp_path)
    assert result.returncode == 0, f"{content}\n{result.stdout}"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda d: str(d.relative_to(ROOT)))
def test_links_lead_somewhere(document):
    prose = re.sub(
        r"^```.*?^```", "", document.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL
    )
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", prose):
        if "://" not in target:
            assert (document.parent / target).exists(), f"{document.name}: {target}"


COMMAND = re.compile(r"(?:^ +|`|^)ruedo ([a-z][a-z0-9-]*)((?: [^`\n]*)?)", re.MULTILINE)


def commands(text):
    """(command, its options) of each `ruedo COMMAND ...` in a page, run by a test or not."""
    for match in COMMAND.finditer(text.replace("\\\n", " ")):
        words = re.sub(r'"[^"]*"|#.*', "", match[2])  # a client's own options
        yield match[1], set(re.findall(r"(?<![\w-])--([a-z][\w-]*)", words.partition(" && ")[0]))


@functools.cache
def options_of(command):
    """Those that its help lists, and those of its own commands."""

    def said(*words):
        python = os.pathsep.join(
            [str(BINARIES.parent / "python"), os.environ.get("PYTHONPATH", "")]
        )
        environment = os.environ | {"RUEDO_PYTHON": sys.executable, "PYTHONPATH": python}
        return subprocess.run(
            [BINARIES / "ruedo", *words, "--help"],
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
            timeout=TIMEOUT_S,
            check=True,
        ).stdout

    text = said(command)
    for one in re.findall(r"^ +([a-z]+\|[a-z|]+)$", text, re.MULTILINE)[:1]:
        text += "".join(said(command, word) for word in one.split("|"))
    return set(re.findall(r"(?<![\w-])--([a-z][\w-]*)", text)) | {"help"}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda d: str(d.relative_to(ROOT)))
def test_options_of_commands_exist(document):
    for command, options in commands(document.read_text(encoding="utf-8")):
        assert options <= options_of(command), (command, options - options_of(command))


def test_commands_are_found():
    text = "`ruedo map w --height`\n    ruedo run W --client \"x --y\" --rate max  # --z\n"
    assert list(commands(text)) == [("map", {"height"}), ("run", {"client", "rate"})]


def test_packages_of_the_scripts_are_listed():
    script = (ROOT / "scripts/lib.sh").read_text(encoding="utf-8")
    page = (ROOT / "docs/install.md").read_text(encoding="utf-8").split()
    for group in re.findall(r"readonly (?:BUILD|TEST)_PACKAGES=\((.*?)\)", script, re.DOTALL):
        for specification in group.replace('"', "").replace("?", "").split():
            assert set(specification.split("|")) & set(page), specification


def test_a_failing_block_is_seen(tmp_path):
    assert run_block("sh", "true | false\ntrue\n", tmp_path).returncode != 0


def test_a_failing_test_is_seen(tmp_path):
    assert run_block("python", "def test_it():\n    assert False\n", tmp_path).returncode != 0


def test_blocks_are_found():
    text = "a\n```sh test\nls x\n```\nb\n```sh\nnot this\n```\n"
    assert list(blocks(text)) == [(2, "sh", "ls x\n")]
    assert shutil.which("bash")
