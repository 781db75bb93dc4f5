"""The documentation's examples, run as they stand: every fenced block that begins with ```sh test
or ```python test.

A block runs in an empty folder that has the tree's worlds/ and clients/ in it, the built ruedo in
the path and a network of its own, so that nothing leaves the machine. Commands run under bash -eu;
a Python program finds a server with worlds/arena.sdf, and goes to pytest when it is a test. Links
to files are followed, too.
"""

import os
import re
import shutil
import subprocess
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
