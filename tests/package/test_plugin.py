"""docs/example-plugin, built outside of the source tree against an installed Ruedo: a sensor, a
drive and a message type of one's own, loaded by --plugin and by a world; what a log says of it; its
messages in the three clients and in echo; what is refused.
"""

import hashlib
import math
import os
import re
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from processes import TOOLS
from processes import run_tool as run

SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
CMAKE = os.environ.get("CMAKE_COMMAND", "cmake")
EXAMPLE = SOURCE / "docs/example-plugin"
EXACT_C = 30.0  # at the start: 20 + 170 / (1 + 4^2), by room.sdf


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ruedo")
    run(CMAKE, "--install", BUILD, "--prefix", folder / "first")
    (folder / "first").rename(folder / "moved")
    return folder / "moved"


@pytest.fixture(scope="module")
def project(prefix, tmp_path_factory):
    """The example, built and run as the page says."""
    folder = tmp_path_factory.mktemp("project") / "example"
    shutil.copytree(EXAMPLE, folder)
    page = (SOURCE / "docs/plugins.md").read_text(encoding="utf-8")
    block = re.search(r"<!-- test: plugin -->\n```sh\n(.*?)```", page, re.DOTALL).group(1)
    more = {"PATH": f"{prefix}/bin:{TOOLS['PATH']}", "CMAKE_GENERATOR": "Ninja"}
    said = run("bash", "-euxc", block, cwd=folder, more=more)
    assert "room.sdf: good" in said and "run.lcm: repeated byte for byte" in said
    return folder


@pytest.fixture(scope="module")
def ruedo(prefix):
    def call(*words, code=0, more={}, **options):  # noqa: B006
        return run(prefix / "bin/ruedo", *words, code=code, more=more, **options)

    return call


@pytest.fixture(scope="module")
def log(project, ruedo):
    file = project / "run.lcm"
    record(ruedo, project, file)
    return file


def record(ruedo, project, file, *options):
    given = ["--plugin", project / "build/libexample.so"]
    words = ["run", project / "room.sdf", "--rate", "max", "--duration", "3", "--record", file]
    return ruedo(*words, *given, *options)


class Served:
    """The room, served on LCM's default address in this network namespace."""

    def __init__(self, prefix, project, *options):
        words = [prefix / "bin/ruedo", "run", project / "room.sdf", "--watch-stdin", *options]
        self.process = subprocess.Popen(
            [str(word) for word in [*words, "--plugin", project / "build/libexample.so"]],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=TOOLS,
        )

    def __enter__(self):
        for line in self.process.stdout:  # the list of channels: it is there
            if "rover/temp" in line:
                return self
        raise AssertionError(f"no rover/temp; it ended with {self.process.wait()}")

    def __exit__(self, *_):
        self.process.communicate("")


def test_info_and_check_know_the_kinds(project, ruedo):
    given = ["--plugin", project / "build/libexample.so", project / "room.sdf"]
    assert re.search(r"rover/temp\s+thermometer_t\s+10 Hz", ruedo("info", *given))
    assert "good" in ruedo("check", *given)


def test_a_world_names_it_and_the_users_path_leads_there(project, ruedo):
    world = project / "room.sdf"
    said = ruedo("check", world, code=3)
    assert re.search(r"the plugin 'example' is in no folder of RUEDO_PLUGIN_PATH", said)
    assert re.search(r"room\.sdf:4", said)
    path = {"RUEDO_PLUGIN_PATH": f"/nowhere:{project / 'build'}"}
    assert "good" in ruedo("check", world, more=path)
    assert "good" in ruedo("check", "--sandbox", world, more=path)


def test_a_world_says_a_name_and_no_path(project, ruedo, tmp_path):
    text = (
        (project / "room.sdf")
        .read_text()
        .replace('filename="example"', f'filename="{project}/build/libexample.so"')
    )
    (tmp_path / "room.sdf").write_text(text)
    said = ruedo("check", tmp_path / "room.sdf", code=3)
    assert "libexample.so' is not allowed; allowed is the name of a file in a folder of" in said


def test_a_log_names_its_plugin_and_verify_finds_it(project, ruedo, log, tmp_path):
    plugin = project / "build/libexample.so"
    digest = hashlib.sha256(plugin.read_bytes()).hexdigest()
    assert f"--plugin=libexample.so@{digest}".encode() in log.read_bytes()
    said = ruedo("verify", log, code=3)
    assert said.count("\n") == 1 and "its run had the plugin libexample.so" in said
    for options in (
        ["--plugin", plugin],
        ["--sandbox", "--plugin", plugin],
        ["--threads", "1", "--plugin", plugin],
    ):
        assert "repeated byte for byte" in ruedo("verify", log, *options)
    path = {"RUEDO_PLUGIN_PATH": str(project / "build")}
    assert "repeated byte for byte" in ruedo("verify", log, more=path)
    assert "repeated byte for byte" in ruedo("verify", log, "--sandbox", more=path)
    (tmp_path / "libexample.so").write_bytes(plugin.read_bytes() + b"\0")
    said = ruedo("verify", log, more={"RUEDO_PLUGIN_PATH": str(tmp_path)}, code=3)
    assert said.count("\n") == 1 and "had another libexample.so" in said and digest in said


def test_the_same_bytes_with_any_number_of_threads(project, ruedo, log, tmp_path):
    record(ruedo, project, tmp_path / "one.lcm", "--threads", "1")
    assert (tmp_path / "one.lcm").read_bytes() == log.read_bytes()


def test_the_log_plays(project, ruedo, log, tmp_path):
    said = ruedo(
        "play", log, "--plugin", project / "build/libexample.so", "--html", tmp_path / "a.html"
    )
    assert (tmp_path / "a.html").stat().st_size > 10_000, said


def test_python_in_lockstep(prefix, project):
    """The thermometer's values, and the drive's way, by their models."""
    run("lcm-gen", "-p", "--ppath", project / "python", project / "thermometer_t.lcm")
    program = """
import math, ruedo
from example import thermometer_t
with ruedo.connect(timeout=60) as sim:
    rover = sim.robot("rover")
    temp, raw = rover.stream("temp", thermometer_t), rover.stream("temp", raw=True)
    seen = sim.step(400, [rover.velocity_command(0.5, 0.0)])
    first, data = seen.all(temp)[0], seen.all(raw)[0]
    print(first.utime, first.temperature, first.warmed, thermometer_t.decode(data).temperature)
    print(seen.latest(rover.pose).x, seen.latest(rover.pose).time)
    seen = sim.step(700)
    print(seen.latest(temp).temperature, seen.latest(temp).warmed)
    try: rover.device("temp").latest()
    except ruedo.TypeMismatch as error: print(error)
    from ruedo.lcmtypes import pose_t
    try: seen.all(rover.stream("temp", pose_t))
    except ruedo.TypeMismatch as error: print(error)
    try: rover.stream("tmp")
    except ruedo.UnknownName as error: print(error)
"""
    with Served(prefix, project, "--lockstep", "1"):
        path = f"{prefix}/lib/ruedo/python:{project}/python"
        lines = run(sys.executable, "-c", program, more={"PYTHONPATH": path}).splitlines()
    utime, temperature, warmed, raw = lines[0].split()
    assert (utime, warmed) == ("0", "True") and float(temperature) == pytest.approx(
        EXACT_C, abs=1e-9
    )
    assert raw == temperature
    x, t = map(float, lines[1].split())
    # v' = (0.5 - v) / 0.5 from rest: x = 0.5 (t - 0.5 (1 - exp(-t / 0.5))), by hand
    assert x == pytest.approx(0.5 * (t - 0.5 * (1 - math.exp(-t / 0.5))), abs=1e-9)
    assert lines[2].split() == ["20.0", "False"]  # at x = 2.5 m, behind the wall
    assert "rover/temp carries thermometer_t" in lines[3] and "lcm-gen" in lines[3]
    assert "does not read" in lines[4] and "pose_t" in lines[4]
    assert "publishes no 'tmp'" in lines[5] and "temp" in lines[5]


def readers(prefix, project):
    """The example's clients: command, environment."""
    run("lcm-gen", "-p", "--ppath", project / "python", project / "thermometer_t.lcm")
    path = f"{prefix}/lib/ruedo/python:{project}/python"
    yield [sys.executable, project / "read_temperature.py"], {"PYTHONPATH": path}
    yield [project / "build/read_temperature"], {}
    jar = prefix / "share/java/ruedo.jar"
    if jar.exists():
        run("lcm-gen", "-j", "--jpath", project / "java", project / "thermometer_t.lcm")
        sources = [project / "ReadTemperature.java", project / "java/example/thermometer_t.java"]
        lcm = next(Path(sys.prefix).glob("lib/python3*/site-packages/share/java/lcm.jar"))
        run("javac", "-cp", f"{jar}:{lcm}", "-d", project / "classes", *sources)
        classes = f"{jar}:{lcm}:{project / 'classes'}"
        yield ["java", "-cp", classes, "ReadTemperature"], {}


def test_each_client_reads_the_type(prefix, project):
    """In lockstep, live as messages, and as bytes."""
    for command, more in readers(prefix, project):
        with Served(prefix, project, "--lockstep", "1"):
            lines = run(*command, more=more).splitlines()
        assert lines[:2] == ["0 s: 30.000000", "0.1 s: 30.000000"] or lines[0] == "0.0 s: 30.000000"
        assert len(lines) == 3, lines  # the states at 0, 0.1 and 0.2 s
        with Served(prefix, project):
            assert run(*command, more=more) == "30.000000, 25 bytes\n"  # 8 + 8 + 8 + 1


def test_echo_reads_lcm_files(prefix, project, ruedo):
    with Served(prefix, project):
        unknown = ruedo("echo", "rover/temp", "-n", "1")
        known = ruedo("echo", "rover/temp", "-n", "1", "--types", project)
    assert re.search(
        r"25 bytes of a type that Ruedo does not know .*0x[0-9a-f]{16}.*--types", unknown
    )
    assert "(thermometer_t, 25 bytes)" in known and "temperature = 30" in known


@pytest.mark.parametrize(
    "text, words",
    [
        ("struct a_t { double x", "a.lcm:1: it ends within a type"),
        ("struct a_t\n{ double x[n]; }", "a.lcm:2: the length 'n' of 'x' is not a field before it"),
        ("struct a_t { b_t x; }", "'x' is of the type 'b_t', which is in no .lcm file"),
        ("struct a_t { a_t x; }", "the type 'a_t': it holds itself"),
    ],
)
def test_malformed_types_are_reported(ruedo, tmp_path, text, words):
    (tmp_path / "a.lcm").write_text(text)
    said = ruedo("echo", "rover/temp", "--types", tmp_path, code=3)
    assert said.count("\n") == 1 and words in said


def test_diff_and_export_read_lcm_files(project, ruedo, log, tmp_path):
    """A temperature with other last digits: by its field, where the type is known."""
    from lcm import EventLog

    events = list(EventLog(str(log), "r"))
    other = EventLog(str(tmp_path / "other.lcm"), "w", overwrite=True)
    changed = False
    for event in events:
        data = event.data
        if event.channel == "rover/temp" and not changed:
            data, changed = data[:-9] + struct.pack(">d", 30.5) + data[-1:], True  # the float64
        other.write_event(event.timestamp, event.channel, data)
    other.close()
    assert changed
    types = ["--types", project]
    plain = ruedo("diff", log, tmp_path / "other.lcm", code=1)
    named = ruedo("diff", log, tmp_path / "other.lcm", *types, code=1)
    assert "temperature" not in plain and re.search(r"temperature.*30\.5", named), named
    rule = ["--tolerance", "rover/temp:temperature=abs:0.6"]
    ruedo("diff", log, tmp_path / "other.lcm", *types, *rule)
    more = {"RUEDO_PLUGIN_PATH": str(project / "build")}
    assert "are left out" in ruedo("export", log, tmp_path / "plain.mcap", more=more)
    assert "left out" not in ruedo("export", log, tmp_path / "named.mcap", *types, more=more)
    assert b"ruedo.thermometer_t" in (tmp_path / "named.mcap").read_bytes()


@pytest.mark.parametrize("named_by", ["argument", "path"])
def test_the_engine_in_the_process_has_them(prefix, project, named_by):
    library = project / "build/libexample.so"
    given = f", plugin=[{str(library)!r}]" if named_by == "argument" else ""
    program = (
        "import ruedo\n"
        f"with ruedo.Engine({str(project / 'room.sdf')!r}, record=True{given}) as engine:\n"
        "    engine.step(None, 40)\n"
        "    print(sum(m[2] == 'rover/temp' for m in engine.messages()))\n"
    )
    more = {"PYTHONPATH": f"{prefix}/lib/ruedo/python"}
    if named_by == "path":
        more["RUEDO_PLUGIN_PATH"] = f"{project}/build"
    assert run(sys.executable, "-c", program, more=more) == "2\n"


BAD = {
    "throws.cpp": (
        '#include <ruedo/sensor.h>\n#include <stdexcept>\nstruct Bad { Bad() { throw std::runtime_error("no oven"); } } bad;\n',
        "threw while it was loaded: no oven",
    ),
    "empty.cpp": ("#include <ruedo/sensor.h>\n", "registers no sensor and no drive"),
    "twice.cpp": (
        "#include <ruedo/drive.h>\nstatic const ruedo::RegisterDrive kOne{{\"wheels\", {}}};\n",
        "has a drive of type 'wheels', which there is already",
    ),
    "constructor.cpp": (
        '#include <ruedo/drive.h>\n#include <stdexcept>\nstatic const ruedo::RegisterDrive kOne{{"lagging",'
        ' [](const ruedo::DriveSetup&) -> std::unique_ptr<ruedo::DriveModel> { throw std::runtime_error("no wheels"); }}};\n',
        "no wheels",
    ),
    "rebuilt.cpp": (
        "#include <chrono>\n#include <filesystem>\n#include <dlfcn.h>\nstatic const bool kRebuilt = [] { Dl_info own{}; "
        "dladdr(&kRebuilt, &own); std::filesystem::last_write_time(own.dli_fname, "
        "std::filesystem::file_time_type::clock::now()); return true; }();\n",
        "was written anew while it was loaded",
    ),
    "step.cpp": (
        '#include <ruedo/drive.h>\nstruct Bad : ruedo::DriveModel { ruedo::BaseVelocity step(const ruedo::DriveInput&) override '
        '{ return {0.0 / 0.0, 0, 0}; } };\nstatic const ruedo::RegisterDrive kOne{{"lagging", [](const ruedo::DriveSetup&) '
        '{ return std::make_unique<Bad>(); }}};\n',
        "rover: its drive 'lagging' gave the velocity",
    ),
}


# Faults of a sensor's function, in "sample"; the drive's and the constructors' go through the same
# code.
AT_WORK = """#include <cfenv>
#include <cstdlib>
#include <stdexcept>
#include <ruedo/sensor.h>
#include "thermometer_t.hpp"
namespace {
struct Bad : ruedo::SensorOf<Bad> {
  explicit Bad(const ruedo::SensorSetup& setup)
      : channel(setup.channel<example::thermometer_t>()), add(setup.add_channel) {}
  void sample(const ruedo::SampleInput& input, ruedo::Outbox& out) override {
    example::thermometer_t message;
    message.utime = input.snapshot.time;
    message.temperature = 1.0 / 3.0 + 0.1 * static_cast<double>(input.sample);
    message.warmed = false;
    const std::string mode = std::getenv("MODE");
    if (mode == "throw") throw std::runtime_error("no \\x1b[31moven\\nthere");
    if (mode == "int") throw 42;
    if (mode == "exit") std::exit(0);
    if (mode == "terminate") std::terminate();
    if (mode == "crash") std::abort();
    if (mode == "round") std::fesetround(FE_UPWARD);
    if (mode == "channel") out.publish(9999, message);
    if (mode == "step") out.begin_step(7777);
    if (mode == "late") add("late", "late_t", 7);
    out.publish(channel, message);
  }
  int channel;
  std::function<int(const std::string&, const std::string&, int64_t)> add;
};
const ruedo::RegisterSensor kOne{{.module = "thermometer", .order = 100, .types = {"thermometer"},
  .attach_to = "", .device_name = "", .default_rate = {10, 1},
  .make = [](const ruedo::SensorSetup& setup) -> std::unique_ptr<ruedo::Sensor> {
    const std::string mode = std::getenv("MODE");
    if (mode == "null") return nullptr;
    if (mode == "name") setup.add_channel("a b", "t", 5);
    return std::make_unique<Bad>(setup);
  }}};
}
"""


def build(folder, prefix, targets):
    (folder / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.25)\nproject(bad CXX)\n"
        f"find_package(ruedo REQUIRED COMPONENTS plugin)\n{targets}"
    )
    run(CMAKE, "-G", "Ninja", "-S", folder, "-B", folder / "build", f"-DCMAKE_PREFIX_PATH={prefix}")
    run(CMAKE, "--build", folder / "build")


@pytest.fixture(scope="module")
def at_work(prefix, project):
    folder = project / "at_work"
    folder.mkdir()
    (folder / "bad.cpp").write_text(AT_WORK)
    text = f"add_library(bad MODULE bad.cpp)\ntarget_include_directories(bad PRIVATE {project}/build/types/example)\n"
    text += "target_link_libraries(bad PRIVATE ruedo::plugin)\n"
    build(folder, prefix, text)
    world = (project / "room.sdf").read_text()
    world = re.sub(r"<plugin.*/>|<time_constant>.*</time_constant>", "", world)
    world = re.sub(r"<thermometer>.*</thermometer>", "", world)
    (folder / "room.sdf").write_text(world.replace('type="lagging"', 'type="kinematic"'))
    return folder


def at_work_run(ruedo, at_work, mode, *options, code):
    words = ["run", at_work / "room.sdf", "--plugin", at_work / "build/libbad.so"]
    words += ["--duration", "1", "--rate", "max", "--quiet", *options]
    return ruedo(*words, code=code, more={"MODE": mode})


@pytest.mark.parametrize(
    "mode, code, words",
    [
        ("throw", 4, "no ?[31moven there"),
        ("int", 4, "threw something other than a std::exception"),
        ("exit", 4, "ended the process"),
        ("terminate", 4, "ended the process by std::terminate()"),
        ("crash", -6, "crashed: SIGABRT"),
        ("channel", 4, "published on the channel 9999, which it did not announce"),
        ("step", 4, "published for step 7777 in step 0"),
        ("late", 4, "channels are announced while the sensor is made, not later"),
        ("null", 4, "its kind made no sensor"),
        ("name", 4, "'a b' is not a name of a channel or a type: printable ASCII"),
    ],
)
def test_a_plugins_fault_is_reported_in_one_line(ruedo, at_work, mode, code, words):
    said = at_work_run(ruedo, at_work, mode, code=code)
    assert said.count("\n") == 1 and f"the plugin libbad.so, rover/temp: {words}" in said, said


def test_the_rounding_that_a_plugin_sets_is_its_own(ruedo, at_work, tmp_path):
    for mode in ("none", "round"):
        at_work_run(ruedo, at_work, mode, "--record", tmp_path / mode, code=0)
    assert (tmp_path / "none").read_bytes() == (tmp_path / "round").read_bytes()


@pytest.fixture(scope="module")
def bad(prefix, project):
    """Plugins that are wrong, each in a way of its own."""
    folder = project / "bad"
    folder.mkdir()
    text = ""
    for name, (code, _) in BAD.items():
        (folder / name).write_text(code)
        stem = name.split(".")[0]
        text += f"add_library({stem} MODULE {name})\ntarget_link_libraries({stem} PRIVATE ruedo::plugin)\n"
    text += "add_library(plain MODULE empty.cpp)\n"
    text += f"target_include_directories(plain PRIVATE {prefix}/include /usr/include/eigen3)\n"
    text += "set_target_properties(plain PROPERTIES CXX_STANDARD 20)\n"
    build(folder, prefix, text)
    good = (project / "build/libexample.so").read_bytes()
    built_for = re.search(rb"ruedo_plugin_built_for=\d+\.\d+\.", good).group(0)
    other = good.replace(built_for, built_for[:-2] + b"9.")
    (folder / "build/libother.so").write_bytes(other)
    (folder / "build/libtext.so").write_text("not a library")
    (folder / "build/libcut.so").write_bytes(good[: len(good) // 2])
    return folder / "build"


@pytest.mark.parametrize(
    "name, code, words",
    [
        *((f"lib{name.split('.')[0]}.so", None, words) for name, (_, words) in BAD.items()),
        (
            "libplain.so",
            3,
            "is not a plugin of Ruedo: it was not linked with CMake's target ruedo::plugin",
        ),
        ("libother.so", 3, "was built for another Ruedo"),
        ("libtext.so", 3, "is not a shared library"),
        ("libcut.so", 3, "is a shared library whose end is missing"),
        ("libnone.so", 3, "there is no such plugin"),
        (".", 3, "is a folder; a file is needed"),
    ],
)
def test_a_bad_plugin_is_one_line(project, ruedo, bad, tmp_path, name, code, words):
    world = tmp_path / "room.sdf"
    text = (project / "room.sdf").read_text()
    world.write_text(
        re.sub(r"<plugin.*/>", "", re.sub(r"<sensor.*</sensor>", "", text, flags=re.DOTALL))
    )
    said = ruedo(
        "run",
        world,
        "--plugin",
        bad / name,
        "--duration",
        "1",
        "--rate",
        "max",
        "--quiet",
        code=None,
    )
    lines = [line for line in said.splitlines() if words in line]
    assert len(lines) == 1 and "terminate" not in said, said
    if code == 3:
        assert said.count("\n") == 1 and str(bad / name).rstrip("/.") in said
        assert ruedo("info", world, "--plugin", bad / name, code=3) == said
