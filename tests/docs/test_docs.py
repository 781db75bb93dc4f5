"""The documentation's commands, run as they stand: every fenced block that begins with ```sh test.

A block runs under bash -eu in an empty folder that has the tree's worlds/ and clients/ in it, the built ruedo in the path and a
network of its own, so that nothing leaves the machine and documents can be tested side by side. Links to files are followed, too.
"""
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BINARIES = Path(os.environ.get("RUEDO_BINARY_DIR", ROOT / "build/release")) / "bin"
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
TIMEOUT_S = 120
NETWORK = "ip link set lo up; ip route add 224.0.0.0/4 dev lo; "


def blocks(text):
    """(line number, commands) of each tested block."""
    for match in re.finditer(r"^```sh test\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        yield text.count("\n", 0, match.start()) + 1, match.group(1)


def isolated():
    """The command line that gives a program a network of its own, or [] where the system refuses."""
    for flags in (["-n"], ["-rn"]):
        command = ["unshare", *flags, "sh", "-c", NETWORK + 'exec "$@"', "sh"]
        if subprocess.run([*command, "true"], capture_output=True).returncode == 0:
            return command
    return []


def run_block(commands, folder):
    for name in ("worlds", "clients", "docs"):
        (folder / name).symlink_to(ROOT / name)
    environment = {**os.environ, "PATH": f"{BINARIES}:{ROOT / '.venv/bin'}:{os.environ['PATH']}", "RUEDO_SOURCE": str(ROOT)}
    return subprocess.run([*isolated(), "bash", "-euo", "pipefail", "-c", commands], cwd=folder, env=environment, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=TIMEOUT_S)


CASES = [pytest.param(commands, id=f"{document.name}:{line}") for document in DOCUMENTS if document.exists()
         for line, commands in blocks(document.read_text(encoding="utf-8"))]


@pytest.mark.parametrize("commands", CASES)
def test_commands_of_the_documentation(commands, tmp_path):
    if not isolated():
        pytest.skip("no network namespaces here (unshare -n and -rn are refused)")
    assert (BINARIES / "ruedo").exists(), f"build it first: {BINARIES}/ruedo"
    result = run_block(commands, tmp_path)
    assert result.returncode == 0, f"{commands}\n{result.stdout}"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda d: d.name)
def test_links_lead_somewhere(document):
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", document.read_text(encoding="utf-8")):
        if "://" not in target:
            assert (document.parent / target).exists(), f"{document.name}: {target}"


def test_packages_of_the_scripts_are_listed():
    script = (ROOT / "scripts/lib.sh").read_text(encoding="utf-8")
    page = (ROOT / "docs/getting-started.md").read_text(encoding="utf-8").split()
    for group in re.findall(r"readonly (?:BUILD|TEST)_PACKAGES=\((.*?)\)", script, re.DOTALL):
        for specification in group.replace('"', "").replace("?", "").split():
            assert set(specification.split("|")) & set(page), specification


def test_a_failing_block_is_seen(tmp_path):
    assert run_block("true | false\ntrue\n", tmp_path).returncode != 0


def test_blocks_are_found():
    text = "a\n```sh test\nls x\n```\nb\n```sh\nnot this\n```\n"
    assert list(blocks(text)) == [(2, "ls x\n")]
    assert shutil.which("bash")
