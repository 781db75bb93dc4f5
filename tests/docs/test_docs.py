"""The documentation's examples, run as they stand: every fenced block that begins with ```sh test,
```python test, ```xml test or ```sh serves.

A block runs in an empty folder that has the tree's worlds/ and clients/ in it, the built ruedo in
the path and a network of its own, so that nothing leaves the machine. Commands run under bash -eu;
a Python program finds a server with worlds/arena.sdf, and goes to pytest when it is a test. XML is
a part of a world or of a robot, which ruedo check finds good. Of ```sh serves each command runs
until it serves, and Ctrl C ends it. <!-- before: NAME --> above a block prepares its folder. Links
to files are followed, too.
"""

import functools
import os
import re
import shutil
import signal
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
# within the 2 s of connect() did not run, or the server did not: it begins again.
SERVED = """ruedo run worlds/arena.sdf --quiet & server=$!
trap 'kill $server; wait $server || true' EXIT
until python -c 'import ruedo; ruedo.connect().close()'; do kill -0 $server; done
until python block.py > said 2>&1; do kill -0 $server; grep -q 'no Ruedo server answered' said || { cat said; exit 1; }; done
cat said
"""


RECORD = (
    "ruedo run worlds/arena.sdf --disable p3at/camera --rate max --duration 0.5 --quiet --record "
)
BEFORE = {
    "log": RECORD + "run.lcm",
    "two logs": f"{RECORD}run.lcm; {RECORD}golden.lcm",
    "bag": f"{RECORD}run.lcm; ruedo export run.lcm --ros2 run",
    "drive": "cd tests/fit; python -c \"from drives import drive; "
    "drive('$OLDPWD/drive.lcm', 'p3at', {}, 1, legs=8)\"",
    "CARMEN log": "cd tests/fit; python -c \"import gzip; from test_import import *; "
    "text = ''.join(flaser(room_scan(p), p, t) for p, t in course()); "
    "open('$OLDPWD/drive.log.gz', 'wb').write(gzip.compress(text.encode()))\"",
    "robots": "python tests/docs/robots.py",
}


def blocks(text):
    """(line number, kind, content, name of what prepares the folder) of each tested block."""
    for match in re.finditer(
        r"^(?:<!-- before: ([^\n]*) -->\n)?```(sh test|python test|xml test|sh serves)\n(.*?)^```",
        text,
        re.MULTILINE | re.DOTALL,
    ):
        yield text.count("\n", 0, match.start()) + 1, match[2], match[3], match[1]


def isolated():
    """The command line that gives a program a network of its own, or [] where the system
    refuses.
    """
    for flags in (["-n"], ["-rn"]):
        command = ["unshare", *flags, "sh", "-c", NETWORK + 'exec "$@"', "sh"]
        if subprocess.run([*command, "true"], capture_output=True).returncode == 0:
            return command
    return []


def isolated_shell(content, folder):
    """The command line, with the options for subprocess, of commands in such a folder."""
    for name in ("worlds", "clients", "docs", "tests"):
        if not (folder / name).is_symlink():
            (folder / name).symlink_to(ROOT / name)
    environment = {
        **os.environ,
        "PATH": f"{BINARIES}:{ROOT / '.venv/bin'}:{os.environ['PATH']}",
        "PYTHONPATH": str(BINARIES.parent / "python"),
    }
    return [*isolated(), "bash", "-euo", "pipefail", "-c", content], {
        "cwd": folder,
        "env": environment,
        "text": True,
        "stdout": subprocess.PIPE,
        "stderr": subprocess.STDOUT,
    }


def run_block(kind, content, folder):
    if kind == "python test":
        (folder / "block.py").write_text(content, encoding="utf-8")
        content = "python -m pytest -q block.py" if "def test_" in content else SERVED
    command, options = isolated_shell(content, folder)
    return subprocess.run(command, **options, timeout=TIMEOUT_S)


def serve(command, folder):
    """Runs a command until it says that it serves, and ends it by Ctrl C."""
    ready = "ruedo/markers"  # the last line of a run's channels
    if " --view" in command or command.startswith(("ruedo play", "ruedo edit")):
        ready = "View it at http://"
    if " --foxglove" in command:
        ready = "Foxglove: ws://"
    words, options = isolated_shell(f"exec {command}", folder)
    with subprocess.Popen(words, **options) as process:
        said = ""
        for line in process.stdout:
            said += line
            if ready in line:
                process.send_signal(signal.SIGINT)
        code = process.wait(TIMEOUT_S)
        assert code == 0 and ready in said, f"{command}: {code}\n{said}"


WORLD = """<sdf version="1.9"><world name="w"><include><uri>model://ground_plane</uri></include>
{world}<model name="box">{object}<static>true</static><link name="link"/></model>
<include><uri>model://p3at</uri>{robot}</include></world></sdf>"""


def check_xml(content, folder):
    """As a part of a world, or of an object or a robot in it."""
    said = []
    for place in (places := ("world", "object", "robot")):
        parts = dict.fromkeys(places, "") | {place: content}
        (folder / "world.sdf").write_text(WORLD.format(**parts), encoding="utf-8")
        result = run_block("sh test", "ruedo check world.sdf", folder)
        if result.returncode == 0:
            return
        said.append(result.stdout)
    pytest.fail("\n".join([content, *said]))


CASES = [
    pytest.param(kind, content, before, id=f"{document.relative_to(ROOT)}:{line}")
    for document in DOCUMENTS
    if document.exists()
    for line, kind, content, before in blocks(document.read_text(encoding="utf-8"))
]


@pytest.mark.parametrize("kind, content, before", CASES)
def test_examples_of_the_documentation(kind, content, before, tmp_path):
    if not isolated():
        pytest.skip("no network namespaces here (unshare -n and -rn are refused)")
    assert (BINARIES / "ruedo").exists(), f"build it first: {BINARIES}/ruedo"
    if before:
        result = run_block("sh test", BEFORE[before], tmp_path)
        assert result.returncode == 0, f"{before}\n{result.stdout}"
    if kind == "sh serves":
        for line in content.splitlines():
            command = line.partition(" #")[0].strip()
            if command.startswith(("ruedo run", "ruedo edit", "ruedo play")):
                serve(command, tmp_path)
            else:
                assert run_block("sh test", command, tmp_path).returncode == 0, command
        return
    if kind == "xml test":
        check_xml(content, tmp_path)
        return
    result = run_block(kind, content, tmp_path)
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
    for group in re.findall(
        r"readonly (?:BUILD_LIBRARIES|\w+_PACKAGES)=\((.*?)\)", script, re.DOTALL
    ):
        group = re.sub(r"\$\{\w+\[@\]\}", "", group)  # another list
        for specification in group.replace('"', "").replace("?", "").split():
            assert set(specification.split("|")) & set(page), specification


def test_a_failing_block_is_seen(tmp_path):
    assert run_block("sh test", "true | false\ntrue\n", tmp_path).returncode != 0


def test_a_failing_test_is_seen(tmp_path):
    assert run_block("python test", "def test_it():\n    assert False\n", tmp_path).returncode != 0


def test_blocks_are_found():
    text = (
        "a\n```sh test\nls x\n```\nb\n```sh\nnot this\n```\n<!-- before: y -->\n```xml test\n```\n"
    )
    assert list(blocks(text)) == [(2, "sh test", "ls x\n", None), (9, "xml test", "", "y")]
    assert shutil.which("bash")
