"""The request of CONTRIBUTING.md, added to a copy of the sources as the page says: how many files
that takes by hand, and that server, test and the three clients can be built of them. With it a
sample of a message that has members of every type.
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


EVERY_TYPE = """package ruedo;
struct every_type_t
{
    int64_t utime;
    int8_t  mode;
    int32_t unread[2];
    int16_t small;
    boolean flag;
    float   single;
    string  label;
    float   bias[2];
    string  pair[2];
    int8_t  n8;
    int16_t n;
    int32_t whole[n];
    int16_t shorts[n];
    string  names[n];
    contact_point_t two[2];
    int32_t size;
    byte    raw[size];
    int64_t big[2];
    const int8_t MODE_OFF = 0;
    const int8_t MODE_ON = 5;    // it is on
}
"""
WORDS = """
[enums.EveryMode]
doc = "How it is."
constants = ["every_type_t.MODE_*"]
unknown = 127

[samples.EveryType]
message = "every_type_t"
doc = "A message with members of every type."
[samples.EveryType.fields]
mode = { enum = "EveryMode", doc = "how it is" }
is_small = { from = "small", doc = "few" }
flag = { doc = "or not" }
single = { unit = "m" }
label = { terminal = true, doc = "for people" }
bias = { unit = "rad/s" }
pair = { doc = "two texts" }
whole = { doc = "numbers" }
shorts = { doc = "numbers" }
names = { doc = "texts" }
two = { part = "ContactPoint", doc = "points" }
raw = { doc = "bytes" }
big = { doc = "numbers" }
"""


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
    (folder / "proto/every_type_t.lcm").write_text(EVERY_TYPE)
    with (folder / "proto/vocabulary.toml").open("a") as words:
        words.write(WORDS)
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
    check_cpp(tree, "clients/cpp/session.cpp", tree / "generated/client/sample_decoders.cpp")


def test_the_client_for_python_has_the_method(tree):
    """Its request is sent, and what the reply says comes back."""
    output = tree / "python"
    shutil.copytree(tree / "clients/python/ruedo", output / "ruedo")
    run(sys.executable, tree / "clients/python/generate_types.py", tree / "proto", output)
    code = """
        import types, numpy, ruedo
        from ruedo import lcmtypes, simulation

        class Session:
            def request(self, kind, body=None, timeout=5.0):
                assert kind == lcmtypes.request_t.GET_GRAVITY == 22 and body is None
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


def test_a_sample_of_every_type_in_python(tree):
    code = """
        import ruedo
        from ruedo import decoding, lcmtypes, samples

        message = lcmtypes.every_type_t()
        message.utime, message.mode, message.small, message.flag, message.single = 7, 5, -3, True, 0.5
        message.label, message.bias, message.pair = "a\x1bb", [0.25, -0.5], ["left", "right"]
        message.n, message.whole, message.shorts, message.names = 2, [1, -2], [3, 4], ["x", "y"]
        for point, name in zip(message.two, ("wall", "box")):
            point.body = name
        message.size, message.raw, message.big = 3, b"abc", [2**40, -1]
        type, convert = samples.CONVERSIONS["every_type_t"]
        made = convert(decoding.decode(type, message.encode()))
        assert isinstance(made, ruedo.EveryType) and made.time == 7e-6
        assert made.mode == "on" and made.is_small == -3 and made.flag is True
        assert made.single == 0.5 and made.label == "a?b" and made.bias.tolist() == [0.25, -0.5]
        assert made.pair == ["left", "right"] and made.names == ["x", "y"] and made.raw == b"abc"
        assert made.whole.tolist() == [1, -2] and made.shorts.tolist() == [3, 4]
        assert made.big.tolist() == [2**40, -1] and [p.body for p in made.two] == ["wall", "box"]
    """
    run(sys.executable, "-c", textwrap.dedent(code), cwd=tree / "python")


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
    said = run("javap", "-cp", jar, "ruedo.EveryType")
    assert "public final short[] shorts;" in said and "List<java.lang.String> pair;" in said


def test_the_reference_has_it(tree):
    run(sys.executable, tree / "proto/generator", "pages", tree / "pages")
    page = (tree / "pages/messages.md").read_text()
    assert "| GET_GRAVITY | `gravity` | The acceleration of what falls in this world. |" in page
