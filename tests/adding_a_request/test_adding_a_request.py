"""The request of CONTRIBUTING.md, added to a copy of the sources as the page says: how many files
that takes by hand, and that server, test and the three clients can be built of them.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(os.environ["RUEDO_SOURCE_DIR"])
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
BLOCK = re.compile(
    r"<!-- file: ([\w./]+)(?:, (behind|before): (.*?))? -->\n *```\w*\n(.*?)^ *```$",
    re.DOTALL | re.MULTILINE,
)
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
BLOCKS = [
    (name, where, mark, textwrap.dedent(text) if text.strip("\n").startswith("  ") else text)
    for name, where, mark, text in BLOCK.findall(PAGE)
]


def add(text, where, mark, lines):
    """Before or behind the line that has the mark."""
    if mark == "end":
        return text + lines
    assert text.count(mark) == 1, mark
    begin = text.rindex("\n", 0, text.index(mark)) + 1
    end = text.index("\n", begin) + 1
    at = begin if where == "before" else end
    return text[:at] + lines + text[at:]


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """The sources that the example touches, with it, and the C++ types of their messages."""
    folder = tmp_path_factory.mktemp("tree")
    for name in ("proto", "clients"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("LICENSE", "VERSION"):
        shutil.copy(ROOT / name, folder)
    for name, where, mark, lines in BLOCKS:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if where and not path.exists():
            shutil.copy(ROOT / name, path)
        path.write_text(add(path.read_text(), where, mark, lines) if where else lines)
    protos = [str(path) for path in sorted((folder / "proto").glob("*.lcm"))]
    run("lcm-gen", "-x", "--cpp-hpath", folder / "types", *protos)
    run(sys.executable, folder / "proto/generator", "cpp", folder / "generated")
    return folder


def run(*command, **options):
    tools = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    words = [str(word) for word in command]
    done = subprocess.run(words, capture_output=True, text=True, env=tools, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_it_takes_five_files_by_hand():
    assert sorted({name for name, *_ in BLOCKS}) == [
        "proto/gravity_reply_t.lcm",
        "proto/request_t.lcm",
        "proto/vocabulary.toml",
        "src/run/requests/requests.cpp",
        "tests/run/test_control.cpp",
    ]


def check_cpp(tree, of, path):
    """Compiles a file with the flags that the build has for one of its own."""
    commands = json.loads((BUILD / "compile_commands.json").read_text())
    found = [one for one in commands if one["file"].endswith(of)]
    words = shlex.split(found[0]["command"])
    compiler, *flags = words[words[0].endswith("ccache") : words.index("-o")]
    own = [f"-I{tree / 'types'}", f"-I{tree / 'generated/client'}"]
    own += [f"-I{tree / 'generated/include'}", f"-I{(ROOT / of).parent}"]
    run(compiler, *own, *flags, "-fsyntax-only", path, cwd=found[0]["directory"])


@pytest.mark.parametrize("name", ["src/run/requests/requests.cpp", "tests/run/test_control.cpp"])
def test_the_server_and_its_test_compile(tree, name):
    check_cpp(tree, name, tree / name)


def test_the_client_for_cpp_compiles(tree):
    program = tree / "gravity.cpp"
    program.write_text(
        '#include "ruedo/client.h"\n'
        "ruedo::client::Vector3 ask(const ruedo::client::Simulation& sim) { return sim.gravity(); }\n"
    )
    check_cpp(tree, "clients/cpp/session.cpp", tree / "generated/client/requests.cpp")
    check_cpp(tree, "clients/cpp/session.cpp", program)


def test_the_client_for_python_has_the_method(tree):
    """Its request is sent, and what the reply says comes back."""
    output = tree / "python"
    shutil.copytree(BUILD / "python/ruedo", output / "ruedo")
    run(sys.executable, tree / "clients/python/generate_types.py", tree / "proto", output)
    code = """
        import types, numpy, ruedo
        from ruedo import lcmtypes, simulation

        class Session:
            def request(self, kind, body=None, timeout=5.0):
                assert kind == lcmtypes.request_t.GET_GRAVITY == 21 and body is None
                reply = lcmtypes.gravity_reply_t()
                reply.gravity = [0.0, 0.5, -9.5]
                return types.SimpleNamespace(body=reply.encode())

        sim = object.__new__(simulation.Simulation)
        sim._session = Session()
        assert sim.gravity().tolist() == [0.0, 0.5, -9.5]
        print(type(sim).gravity.__doc__)
    """
    said = run(sys.executable, "-c", textwrap.dedent(code), cwd=output)
    assert "The acceleration of what falls in this world." in said


def test_the_client_for_java_has_the_method(tree):
    jar = tree / "java/ruedo.jar"
    settings = {
        "PROTO": tree / "proto",
        "SOURCES": tree / "clients/java",
        "OUTPUT": jar.parent,
        "VERSION": "1",
        "LICENSE": tree / "LICENSE",
        "LCM_GEN": "lcm-gen",
        "PYTHON": sys.executable,
        "JAVAC": "javac",
        "JAR": "jar",
    }
    words = [f"-D{name}={value}" for name, value in settings.items()]
    run(os.environ["CMAKE_COMMAND"], *words, "-P", tree / "clients/java/BuildJar.cmake")
    said = run("javap", "-cp", jar, "ruedo.Simulation", "ruedo.Requests")
    assert "public double[] gravity();" in said


def test_the_reference_has_it(tree):
    run(sys.executable, tree / "proto/generator", "pages", tree / "pages")
    page = (tree / "pages/messages.md").read_text()
    assert "| GET_GRAVITY | `gravity` | The acceleration of what falls in this world. |" in page
