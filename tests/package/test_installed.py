"""Installs Ruedo into a folder, moves that, and runs docs/example-project against it; then what
each of a regression's expectations says when it does not hold."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from processes import run

SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
CMAKE = os.environ.get("CMAKE_COMMAND", "cmake")
EXAMPLE = SOURCE / "docs/example-project"


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ruedo")
    run(CMAKE, "--install", BUILD, "--prefix", folder / "first")
    (folder / "first").rename(folder / "moved")
    return folder / "moved"


@pytest.fixture(scope="module")
def project(prefix, tmp_path_factory):
    """The example, built."""
    folder = tmp_path_factory.mktemp("project")
    shutil.copytree(EXAMPLE, folder / "gate")
    build = folder / "gate/build"
    run(
        CMAKE,
        "-G",
        "Ninja",
        "-S",
        folder / "gate",
        "-B",
        build,
        f"-DCMAKE_PREFIX_PATH={prefix}",
        f"-DPython3_EXECUTABLE={sys.executable}",
        "-DCMAKE_BUILD_TYPE=Release",
    )
    run(CMAKE, "--build", build)
    return folder / "gate"


def ctest(project, *options, code=0):
    return run("ctest", "--test-dir", project / "build", "--output-on-failure", *options, code=code)


def regress(
    prefix, *options, code=0, folder=None, world=EXAMPLE / "gate.sdf", client=True, more=None
):
    words = [
        prefix / "bin/ruedo",
        "regress",
        world,
        "--record",
        folder / "run.lcm",
        "--seed",
        "7",
        "--duration",
        "12",
        *options,
    ]
    if client:
        words += ["--lockstep", "1", "--client", f"{sys.executable} {EXAMPLE}/through_the_gate.py"]
    return run(*words, code=code, more={"PYTHONPATH": f"{prefix}/lib/ruedo/python", **(more or {})})


def test_the_moved_program_finds_its_own(prefix):
    said = run("ldd", prefix / "bin/ruedo")
    assert re.search(rf"liblcm.so.1 => {re.escape(str(prefix))}", said), said
    run(prefix / "bin/ruedo", "check", prefix / "share/ruedo/worlds/arena.sdf", cwd="/")
    # Worlds and importer come from beside the program, not from where it was built.
    traced = subprocess.run(["strings", prefix / "bin/ruedo"], capture_output=True, text=True)
    if traced.returncode == 0:
        said = run(prefix / "bin/ruedo", "info", EXAMPLE / "gate.sdf", "--json", cwd="/", code=None)
        assert str(SOURCE / "worlds") not in said


def test_slow_libraries_are_loaded_on_demand(prefix):
    """`ruedo --version` and all that draws nothing start without the renderer's compiler and
    OpenCV's codecs: measured, 16 ms of CPU instead of 126. Who draws finds them.
    """
    loaded = run("ldd", prefix / "bin/ruedo")
    assert not re.search("libOSMesa|libLLVM|imgcodecs|libgdal", loaded), loaded
    late = {path.name for path in (prefix / "lib/ruedo").glob("libruedo_*.so")}
    assert late >= {"libruedo_codecs.so"}
    run(prefix / "bin/ruedo", "render", "arena", "-o", prefix / "arena.png", cwd="/")
    assert (prefix / "arena.png").read_bytes().startswith(b"\x89PNG")


def test_the_message_types_are_there_for_c_plus_plus(prefix, tmp_path):
    (tmp_path / "a.cpp").write_text(
        "#include <ruedo/pose_t.hpp>\n#include <cstdio>\n"
        'int main() { std::printf("%llx", static_cast<unsigned long long>(ruedo::pose_t::getHash())); }\n'
    )
    flags = run(
        *("pkg-config", "--cflags", "--libs", "ruedo"),
        more={"PKG_CONFIG_PATH": str(next(prefix.glob("lib/**/pkgconfig")))},
    )
    run("sh", "-c", f"g++ -std=c++17 a.cpp -o a {flags.strip()}", cwd=tmp_path)
    assert run(tmp_path / "a") == "2e16efb052b0105e"  # bot_core's


def test_no_file_says_where_it_was_built(prefix):
    """Elsewhere that would lead nowhere, and two clones would give different bytes."""
    places = [str(BUILD).encode(), str(SOURCE / ".venv").encode()]
    files = [path for path in prefix.rglob("*") if path.is_file() and not path.is_symlink()]
    found = [path for path in files if any(place in path.read_bytes() for place in places)]
    assert len(files) > 300 and found == []


def test_the_licences_of_all_that_is_inside_are_there(prefix):
    text = (prefix / "share/doc/ruedo/copyright").read_text()
    for name in ("musl", "Bullet", "urdfdom", "Assimp", "CLI11", "Eigen", "LCM", "nanobind"):
        assert re.search(rf"^{name}\b.*:", text, re.MULTILINE), name
    for name in ("robin-map:", "three ", "uplot ", "Zlib|zlib", "Mozilla Public License"):
        assert re.search(name, text), name


def test_the_moved_engine_finds_its_own(prefix):
    program = (
        "import ruedo\n"
        "try: ruedo.Engine('nowhere')\n"
        "except ValueError as error: print(error)\n"
        "with ruedo.Engine('arena', disable=['p3at/camera']) as engine:\n"
        "    engine.step([0.1, 0.0], 20)\n"
        "    print(engine['lrf.ranges'].shape)\n"
    )
    said = run(
        sys.executable, "-c", program, cwd="/", more={"PYTHONPATH": f"{prefix}/lib/ruedo/python"}
    )
    assert f"(searched in {prefix}/share/ruedo/worlds)" in said and said.endswith("(1, 1, 181)\n")


def test_pkg_config_leads_to_library_and_server(prefix, tmp_path):
    """Of the same installation, with what pkg-config prints as it is: no shell reads it again."""
    (tmp_path / "a.cpp").write_text(
        '#include <ruedo/client.h>\n#include <iostream>\n'
        "int main() {\n"
        "  try { auto sim = ruedo::client::launch(\"nowhere\"); }\n"
        "  catch (const std::exception& error) { std::cout << error.what(); }\n"
        "}\n"
    )
    flags = run(
        *("pkg-config", "--cflags", "--libs", "ruedo"),
        more={"PKG_CONFIG_PATH": str(next(prefix.glob("lib/**/pkgconfig")))},
    ).split()
    run("g++", "-std=c++17", "a.cpp", "-o", "a", *flags, cwd=tmp_path)
    said = run(tmp_path / "a")
    assert f"searched in {prefix.resolve()}/share/ruedo/worlds" in said, said


@pytest.mark.parametrize("language", ["python", "cpp", "java"])
def test_a_program_that_uses_the_clients_api(language, prefix, tmp_path):
    """Launch options, streams joined by stamp, driving, bodies, joints and maps."""
    here = Path(__file__).parent / "api"
    more = {}
    if language == "python":
        words = [sys.executable, here / "api.py"]
        more = {"PYTHONPATH": f"{prefix}/lib/ruedo/python"}
    elif language == "cpp":
        flags = run(
            *("pkg-config", "--cflags", "--libs", "ruedo"),
            more={"PKG_CONFIG_PATH": str(next(prefix.glob("lib/**/pkgconfig")))},
        ).split()
        run("g++", "-std=c++17", here / "api.cpp", "-o", tmp_path / "api", *flags)
        words = [tmp_path / "api"]
    else:
        jar = prefix / "share/java/ruedo.jar"
        if not (shutil.which("javac") and jar.exists()):
            pytest.skip("no JDK here")
        run("javac", "-Xlint:all", "-cp", jar, "-d", tmp_path, here / "Api.java")
        words = ["java", "-cp", f"{jar}:{tmp_path}", "Api"]
    lines = run(*words, tmp_path, cwd=tmp_path, more=more).splitlines()
    said = [line for line in lines if not line.startswith("ruedo: ")]  # a busy machine is warned of
    assert said == ["rate 20", "drove True", "joint position", "ray 0.95"]


def test_an_installed_project_starts(prefix, tmp_path):
    """Each of the libraries; from and to folders with blanks in their names."""
    ours = tmp_path / "with a blank/ruedo"
    shutil.copytree(prefix, ours, symlinks=True)
    uses = {
        "client": "ruedo/client.h> \nint main() { ruedo::client::LaunchOptions options; }",
        "engine": "ruedo/engine.h> \nint main() { try { ruedo::Engine engine(\"nowhere\"); }"
        " catch (const std::exception& error) { std::puts(error.what()); } }",
        "lcmtypes": "lcm/lcm-cpp.hpp>\nint main() { lcm::LCM bus(\"memq://\"); return !bus.good(); }",
    }
    lines = [
        "cmake_minimum_required(VERSION 3.22)",
        "project(x CXX)",
        "find_package(ruedo REQUIRED)",
    ]
    for name, text in uses.items():
        (tmp_path / f"{name}.cpp").write_text(f"#include <cstdio>\n#include <{text}\n")
        lines += [f"add_executable({name} {name}.cpp)"]
        lines += [f"target_link_libraries({name} PRIVATE ruedo::{name})"]
        lines += [f"install(TARGETS {name})"]
    (tmp_path / "CMakeLists.txt").write_text("\n".join(lines) + "\n")
    build, installed = tmp_path / "b", tmp_path / "in stalled"
    run(CMAKE, "-S", tmp_path, "-B", build, f"-DCMAKE_PREFIX_PATH={ours}")
    run(CMAKE, "--build", build)
    run(CMAKE, "--install", build, "--prefix", installed)
    shutil.rmtree(build)
    said = {name: run(installed / "bin" / name) for name in uses}
    assert f"searched in {ours}/share/ruedo/worlds" in said["engine"]
    assert "liblcm" not in run("ldd", installed / "bin/client")


def test_pkg_config_survives_blanks(prefix, tmp_path):
    ours = tmp_path / "with a blank"
    shutil.copytree(prefix, ours, symlinks=True)
    (tmp_path / "a.cpp").write_text(
        "#include <ruedo/client.h>\n#include <ruedo/pose_t.hpp>\n"
        "int main() { ruedo::client::LaunchOptions options; ruedo::pose_t pose; }\n"
    )
    build = 'eval g++ -std=c++17 a.cpp -o a "$(pkg-config --cflags --libs ruedo)"'
    more = {"PKG_CONFIG_PATH": str(next(ours.glob("lib/**/pkgconfig")))}
    run("sh", "-ec", build, cwd=tmp_path, more=more)
    run(tmp_path / "a")


def test_the_example_from_nothing_to_green(project):
    """Without goldens it says what to do; renewed, all is green, in parallel; twice gives the
    same.
    """
    said = ctest(project, "-R", "^gate$", code=None)
    assert "there is no golden log" in said and "RUEDO_RENEW=1" in said
    said = run(CMAKE, "--build", project / "build", "--target", "renew-goldens")
    golden = project / "goldens/gate.lcm"
    first = golden.read_bytes()
    assert 1_000 < len(first) < 400_000
    assert "100% tests passed" in ctest(project, "-j", "3")
    run(CMAKE, "--build", project / "build", "--target", "renew-goldens")
    assert golden.read_bytes() == first  # repeatable: byte by byte


def test_another_way_is_the_first_difference(prefix, tmp_path):
    golden = tmp_path / "golden.lcm"
    keep = ["--golden", golden, "--keep", "p3at/pose", "--tolerance", "p3at/pose:*=abs:1e-6"]
    regress(prefix, *keep, "--renew", folder=tmp_path)
    regress(prefix, *keep, folder=tmp_path)
    said = regress(prefix, *keep, folder=tmp_path, code=1, more={"SPEED": "0.41"})
    assert "the run differs from" in said and "p3at/pose" in said


@pytest.mark.parametrize(
    "options, code, words",
    [
        (["--goal", "4,0,0.3,5"], 1, r"5\.000 s: p3at was not within 0.3 m of \(4, 0\) by 5 s"),
        (
            ["--clearance", "0.6"],
            1,
            r"s: p3at/\w+ was 0\.5\d\d m from (left|right)_post/link at \(.+\), at least 0\.6 m",
        ),
        (
            ["--odometry-error", "0.0000001"],
            1,
            r"s: p3at's odometry was \S+ m off, at most 1e-07 m",
        ),
        (["--script", "test -s $RUEDO_LOG && exit 7"], 1, r"the script ended with exit code 7"),
        (["--robot", "nobody"], 2, r"--robot 'nobody': the world has p3at"),
        (["--goal", "4,0,0.3"], 2, r"X,Y,RADIUS,BY"),
        (["--golden", "never.lcm"], 1, r"there is no golden log never.lcm yet"),
        (
            ["--golden", "never.lcm", "--renew", "--keep", "nothing/*"],
            2,
            r"--keep nothing/\*: no message",
        ),
    ],
)
def test_a_failed_expectation_is_reported(prefix, options, code, words, tmp_path):
    said = regress(prefix, *options, folder=tmp_path, code=code)
    assert re.search(words, said), said


def test_a_contact_is_reported(prefix, tmp_path):
    """Straight ahead into a wall."""
    world = SOURCE / "tests/clients/hall.sdf"
    client = 'import ruedo\nsim = ruedo.connect(timeout=30)\nsim.step(2300, [sim.robot("p3at").move_command("advance", 7.0)])\n'
    (tmp_path / "blind.py").write_text(client)
    said = regress(
        prefix,
        "--no-contact",
        "--lockstep",
        "1",
        "--client",
        f"{sys.executable} {tmp_path}/blind.py",
        folder=tmp_path,
        world=world,
        client=False,
        code=1,
    )
    assert re.search(r"p3at/\w+ touched wall/link at \(6\.0", said), said


def test_a_client_that_fails_fails_the_regression(prefix, tmp_path):
    said = regress(prefix, "--client", "exit 3", folder=tmp_path, client=False, code=1)
    assert "the client ended with exit code 3" in said


def test_without_namespaces_it_is_tcp(prefix, tmp_path):
    """The client is told an address of this machine's loopback device."""
    said = regress(
        prefix,
        "--shared-network",
        "--client",
        "echo url $LCM_DEFAULT_URL; sleep 1",
        "--no-client-wait",
        folder=tmp_path,
        client=False,
    )
    assert re.search(r"url tcpq://127\.0\.0\.1:\d+", said), said
