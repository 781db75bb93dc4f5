"""The wheels, installed into a virtual environment of its own and used from
anywhere: program, server, engine, picture, what C++ and Java need. In bare Debians it is tried by
packaging/try_in_debian.sh."""

import os
import re
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest
from processes import run as run_somewhere

SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
RUN_OF_A_SECOND = ["--rate", "max", "--duration", "1", "--quiet", "--lcm", "memq://"]


def run(*command):
    """A folder without any of Ruedo's files."""
    return run_somewhere(*command, cwd="/")


WHEELS = {  # of the test package.make_wheel
    name: next((BUILD / "wheels").glob(f"{name}-*.whl"))
    for name in ("ruedo", "ruedo_client", "ruedo_camera")
}


def make_venv(folder, *wheels):
    """With this environment's numpy and what else they depend on, so that nothing is fetched."""
    run(sys.executable, "-m", "venv", "--without-pip", folder)
    words = ["--quiet", "--no-deps", "--no-index"]
    run(sys.executable, "-m", "pip", "--python", folder / "bin/python", "install", *words, *wheels)
    program = "import sysconfig; print(sysconfig.get_path('purelib'))"
    packages = Path(run(folder / "bin/python", "-c", program).strip())
    (packages / "others.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return folder


@pytest.fixture(scope="module")
def venv(tmp_path_factory):
    return make_venv(tmp_path_factory.mktemp("wheel") / "venv", *WHEELS.values())


def test_the_wheels_are_for_debian_12_and_hold_licences():
    assert WHEELS["ruedo"].name.endswith("-py3-none-manylinux_2_36_x86_64.whl")
    assert WHEELS["ruedo_client"].name.endswith("-py3-none-any.whl")
    names = {name: zipfile.ZipFile(wheel).namelist() for name, wheel in WHEELS.items()}
    for of in names.values():
        assert any(name.endswith(".dist-info/LICENSE") for name in of)
        assert not [n for n in of if "glibc" in n or "/libc.so" in n or "/libm.so" in n]
    assert any(name.endswith(".dist-info/licenses/copyright") for name in names["ruedo"])
    licence = ".dist-info/licenses/debian/libosmesa6"
    assert any(name.endswith(licence) for name in names["ruedo_camera"])
    assert WHEELS["ruedo"].stat().st_size < 50e6  # at level 1 of zlib; scripts/release: 45 MB at 9
    everything = [name for of in names.values() for name in of]
    assert len(set(everything)) == len(everything)  # pip would remove another's file


def test_the_client_alone_is_small_and_drives(venv, tmp_path):
    """On a computer without the server, LCM and GLib: a run elsewhere, over TCP."""
    assert WHEELS["ruedo_client"].stat().st_size < 2e6
    client = make_venv(tmp_path / "venv", WHEELS["ruedo_client"])
    program = """
import sys
sys.modules["lcm"] = None
import ruedo
try: ruedo.launch("arena", program="/nowhere")
except (ruedo.LaunchError, TypeError) as error: print(error)
try: ruedo.Engine
except ImportError as error: print(error)
with ruedo.connect(sys.argv[1], timeout=30) as sim:
    sim.robot("p3at").advance(0.3).wait()
    print("at %.2f" % sim.robot("p3at").pose.latest().x)
"""
    words = [venv / "bin/ruedo", "run", "arena", "--disable", "p3at/camera", "--rate", "20"]
    url = f"unix://{tmp_path}/bus"
    server = subprocess.Popen([*words, "--lcm", url, "--quiet"], stdout=subprocess.DEVNULL, cwd="/")
    try:
        said = run(client / "bin/python", "-c", program, url)
    finally:
        server.terminate()
        server.wait()
    assert "at 0.30" in said and "it comes with Ruedo's wheel" in said


def test_a_missing_renderer_is_reported(tmp_path):
    venv = make_venv(tmp_path / "venv", WHEELS["ruedo"], WHEELS["ruedo_client"])
    render = f"RUEDO_RENDERER=osmesa {venv}/bin/ruedo render arena -o {tmp_path}/a.png 2>&1"
    said = run("sh", "-c", f"{render}; test $? = 4")
    assert "no renderer for cameras" in said and "pip install 'ruedo[camera]'" in said
    run(venv / "bin/ruedo", "run", "arena", "--disable", "p3at/camera", *RUN_OF_A_SECOND)


def test_nothing_is_loaded_from_outside(venv):
    """Except for what every Debian has."""
    prefix = run(venv / "bin/ruedo", "--prefix").strip()
    loaded = [
        line.split()
        for file in (f"{prefix}/bin/ruedo", *Path(prefix).glob("lib/ruedo/libruedo_*.so"))
        for line in run("ldd", file).splitlines()
        if "=>" in line
    ]
    outside = {words[0] for words in loaded if not words[2].startswith(str(venv))}
    assert outside <= {
        "libstdc++.so.6",
        "libm.so.6",
        "libgcc_s.so.1",
        "libc.so.6",
        "libz.so.1",
        "libdl.so.2",
        "libpthread.so.0",
        "librt.so.1",
    }


def test_the_program_finds_worlds_importer_and_renderer(venv, tmp_path):
    ruedo = venv / "bin/ruedo"
    assert str(venv) in run(ruedo, "info", "office")
    run(ruedo, "render", "office", "-o", tmp_path / "office.png")
    assert (tmp_path / "office.png").stat().st_size > 10_000
    run(
        ruedo,
        "run",
        "arena",
        "--rate",
        "max",
        "--duration",
        "1",
        "--seed",
        "7",
        "--record",
        tmp_path / "a.lcm",
        "--lcm",
        f"unix://{tmp_path}/bus",
    )
    assert "byte for byte" in run(ruedo, "verify", tmp_path / "a.lcm")


def test_launch_and_engine_are_of_the_wheel(venv):
    said = run(
        venv / "bin/python",
        "-c",
        """
import ruedo
print(ruedo.find_ruedo())
with ruedo.launch("arena", rate="max") as sim:
    robot = sim.robot("p3at")
    robot.advance(0.5).wait()
    assert abs(robot.pose.latest().x - 0.5) < 1e-3
with ruedo.Engine("arena", disable=["p3at/camera"]) as engine:
    engine.step([0.1, 0.0], 20)
    print(engine["lrf.ranges"].shape)
""",
    ).split("\n")
    assert said[0].startswith(str(venv)) and said[1] == "(1, 1, 181)"


def test_a_program_that_uses_the_clients_api(venv, tmp_path):
    said = run(venv / "bin/python", Path(__file__).parent / "api/api.py", tmp_path)
    assert said.endswith("rate 20\ndrove True\njoint position\nray 0.95\n")


def test_an_unknown_world_is_reported_with_the_existing_ones(venv):
    said = run(
        venv / "bin/python",
        "-c",
        "import ruedo\ntry: ruedo.launch('arenna')\nexcept ruedo.LaunchError as error: print(error)",
    )
    assert "arena" in said and "searched" in said and str(venv) in said


def test_it_brings_the_cpp_package_and_the_jar(venv):
    prefix = Path(run(venv / "bin/ruedo", "--prefix").strip())
    assert list(prefix.glob("lib/**/cmake/ruedo/ruedoConfig.cmake")) and list(
        prefix.glob("lib/**/libruedo_client.a")
    )
    assert (prefix / "include/ruedo/client.h").is_file()
    with zipfile.ZipFile(run(venv / "bin/ruedo", "--jar").strip()) as jar:
        assert "Automatic-Module-Name: ruedo" in jar.read("META-INF/MANIFEST.MF").decode()


def test_pytest_and_cmake_find_what_regressions_need(venv, tmp_path):
    """The fixture by the wheel's metadata; RUEDO_PYTHON_DIR was a folder that is not there."""
    (tmp_path / "test_it.py").write_text(
        "def test_it(ruedo_regression):\n"
        "    assert ruedo_regression('arena', duration=0.1).log.exists()\n"
    )
    pytest_of_the_wheel = [venv / "bin/python", "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    assert "1 passed" in run(*pytest_of_the_wheel, tmp_path)
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.22)\nproject(x NONE)\n"
        "find_package(ruedo REQUIRED COMPONENTS regression)\nenable_testing()\n"
        'ruedo_add_regression(NAME python WORLD arena DURATION 1 CLIENT python3 -c "import ruedo")\n'
    )
    prefix = run(venv / "bin/ruedo", "--prefix").strip()
    run("cmake", "-S", tmp_path, "-B", tmp_path / "b", f"-DCMAKE_PREFIX_PATH={prefix}")
    properties = (tmp_path / "b/CTestTestfile.cmake").read_text()
    folder = re.search(r"PYTHONPATH=path_list_prepend:([^\"]+)", properties).group(1)
    assert (Path(folder) / "ruedo/regression.py").is_file()
