"""pytest's fixture ruedo_regression in each way of using the Python client that needs no pip; the
wheel's is in test_wheel.py, that of a pytest that ctest runs in test_installed.py."""

import os
import sys
import sysconfig
from pathlib import Path

import pytest
from processes import run

SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
CMAKE = os.environ.get("CMAKE_COMMAND", "cmake")
TEST = """
def test_it_runs(ruedo_regression):
    assert ruedo_regression("empty", duration=0.1, options=["--spawn", "p3at@0,0"]).log.exists()
"""
METADATA = """
from importlib.metadata import distributions, entry_points
print([(one.name, one.version) for one in distributions() if one.name == "ruedo"])
print(*(entry.load().__name__ for entry in entry_points(group="pytest11", name="ruedo")))
"""


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    """Finds no ruedo by itself, and all that it needs."""
    folder = tmp_path_factory.mktemp("venv")
    run(sys.executable, "-m", "venv", "--without-pip", folder)
    packages = next(folder.glob("lib/python*/site-packages"))
    (packages / "others.pth").write_text(sysconfig.get_path("purelib") + "\n")
    run(folder / "bin/python", "-c", "import ruedo", cwd="/", code=1)
    return folder / "bin/python"


@pytest.fixture(scope="module", params=["build", "installation"])
def package(request, tmp_path_factory):
    """The folder for PYTHONPATH."""
    if request.param == "build":
        return BUILD / "python"
    prefix = tmp_path_factory.mktemp("prefix")
    run(CMAKE, "--install", BUILD, "--prefix", prefix)
    return prefix / "lib/ruedo/python"


@pytest.mark.parametrize("autoload", [True, False])
def test_pytest_finds_the_fixture(python, package, tmp_path, autoload):
    """Regression: the build's package had no metadata. -p loads it where none are looked for."""
    (tmp_path / "test_it.py").write_text(TEST)
    more = {"PYTHONPATH": package, "PYTHONDONTWRITEBYTECODE": "1"}
    command = [python, "-m", "pytest", "-q", "-p", "no:cacheprovider", tmp_path]
    if not autoload:
        more["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
        command += ["-p", "ruedo.regression"]
    assert "1 passed" in run(*command, more=more, cwd=tmp_path)


def test_the_package_is_there_once(python, package):
    said = run(python, "-c", METADATA, more={"PYTHONPATH": package}, cwd="/")
    version = (SOURCE / "VERSION").read_text().strip()
    assert said == f"[('ruedo', '{version}')]\nruedo.regression\n"


def test_the_summary_lists_the_failures(python, package, tmp_path):
    """Not the first warning of the run."""
    (tmp_path / "w.sdf").write_text(
        "<sdf version='1.9'><world name='w'><nonsense/>"
        "<include><uri>model://p3at</uri></include></world></sdf>"
    )
    (tmp_path / "test_it.py").write_text(
        "def test_it_runs(ruedo_regression):\n"
        "    ruedo_regression('w.sdf', duration=0.1, goal=(9, 9), radius=0.1, by=0.1)\n"
    )
    more = {"PYTHONPATH": package, "PYTHONDONTWRITEBYTECODE": "1", "COLUMNS": "200"}
    command = [python, "-m", "pytest", "-q", "-p", "no:cacheprovider", tmp_path]
    said = run(*command, more=more, cwd=tmp_path, code=1)
    summary = said[said.index("short test summary") :]
    assert "RegressionFailed: FAILED: 0.1" in summary and "was not within 0.1 m" in summary
    assert "nonsense" in said
