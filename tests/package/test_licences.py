"""What others wrote of a release is listed with its licence: packaging/parts.toml against what the
build has read and the wheel holds, and what copyright file and SBOM say of it.
"""

import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from processes import run

SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
sys.path.insert(0, str(SOURCE / "packaging"))

import parts

# Of https://spdx.org/licenses: those that occur.
SPDX = set(
    re.findall(
        r"\S+",
        """
    Apache-2.0 BSD-2-Clause BSD-3-Clause BSL-1.0 CC0-1.0 EPL-2.0 GPL-2.0-only IJG ISC LGPL-2.1-only
    LGPL-2.1-or-later LLVM-exception LicenseRef-public-domain MIT MPL-2.0
    X11-distribute-modifications-variant Zlib libpng-2.0 libtiff
    """,
    )
)


@pytest.fixture(scope="module")
def read():
    return parts.read_by(BUILD)


@pytest.fixture(scope="module")
def wheels():
    return sorted((BUILD / "wheels").glob("*.whl"))  # of the test package.make_wheel


@pytest.fixture(scope="module")
def sbom(wheels, tmp_path_factory):
    out = tmp_path_factory.mktemp("sbom") / "ruedo.spdx.json"
    run(sys.executable, SOURCE / "scripts/make_sbom.py", BUILD, out, *wheels)
    return json.loads(out.read_text())


def test_exactly_the_compiled_parts_are_listed(read):
    sources, packages = read
    assert sources == set(parts.COMPILED)
    assert packages == set(parts.COMPILED_PYPI)


def test_the_copyright_file_has_each_part(read):
    text = (BUILD / "licences/copyright").read_text(encoding="utf-8")
    for name, how, _ in [*parts.COMPILED.values(), *parts.COMPILED_PYPI.values()]:
        after = text.partition(f"\n{name}: {how}\n")[2]
        assert len(after.partition("=" * 78)[2].partition("=" * 78)[0]) > 500, name


@pytest.mark.parametrize("kind", ["ruedo-", "ruedo_camera-"])
def test_a_wheel_has_the_licence_of_each_library(wheels, kind):
    wheel = next(wheel for wheel in wheels if wheel.name.startswith(kind))
    names = zipfile.ZipFile(wheel).namelist()
    licences = {Path(name).name for name in names if "/licenses/debian/" in name}
    libraries = {
        re.sub(r"-[0-9a-f]{8}(?=\.so)", "", Path(name).name)
        for name in names
        if name.startswith("ruedo.libs/")
    }
    stubs = {"libGLX", "libedit", "libgdal", "libgdcm", "libjbig", "libblas", "liblapack"}
    stubs |= {"libxml2", "libz3"}
    real = {name for name in libraries if not name.startswith(tuple(stubs))}
    owners = {name: parts.owners([Path("*") / name]) for name in real}
    assert {name for name, packages in owners.items() if not packages & licences} == set()


def test_the_table_is_of_what_the_wheels_hold(wheels):
    names = [name for wheel in wheels for name in zipfile.ZipFile(wheel).namelist()]
    licences = {Path(name).name for name in names if "/licenses/debian/" in name}
    used = {parts.installed()[package][0] for package in licences}
    assert used <= set(parts.COMPILED) | set(parts.TABLE["shared"])
    assert set(parts.TABLE["shared"]) <= used


def test_nothing_is_of_the_host_or_under_the_gpl(wheels):
    """The host's choice of a BLAS, and a library that would put the wheel under its licence."""
    entries = [entry for wheel in wheels for entry in zipfile.ZipFile(wheel).infolist()]
    sizes = {Path(entry.filename).name: entry.file_size for entry in entries}
    for start in ("liblapack", "libblas", "libjbig"):
        found = {name: size for name, size in sizes.items() if name.startswith(start)}
        assert len(found) == 1 and max(found.values()) < 100_000, found  # functions that return 0
    assert not [name for name in sizes if re.match("lib(atlas|openblas|gfortran|mkl)", name)]


def test_the_sbom_has_the_licence_of_each_part(sbom):
    names = {package["name"] for package in sbom["packages"]}
    assert {"nlohmann-json3 (source)", "libllvm15", "three", "lcm", "nanobind"} <= names
    for package in sbom["packages"]:
        licence = package["licenseDeclared"]
        words = set(re.split(r" (?:AND|OR|WITH) ", licence))
        assert words <= SPDX, f"{package['name']}: {licence}"
        assert package["licenseConcluded"] == licence
    assert len({package["SPDXID"] for package in sbom["packages"]}) == len(sbom["packages"])


NOTICES = (
    r"copyright|\(c\) *(19|20)[0-9]{2}|SPDX-License|licen[sc]ed under|general public licen[sc]e"
)
# Of others' licences these speak: the tables of what a release holds, and those who make them.
OF_OTHERS = (
    "packaging/",
    "tests/package/",
    "scripts/make_sbom.py",
    "scripts/make_wheel.py",
    "scripts/release",
    "cmake/RuedoInstall.cmake",
    "docs/platforms.md",
)


def test_no_file_of_the_tree_is_under_anothers_licence():
    """The tree has one licence, and whoever copies a file into it brings its notice along."""
    words = ["git", "-C", SOURCE, "grep", "-I", "-i", "-l", "-E", NOTICES]
    done = subprocess.run(words, stdout=subprocess.PIPE, text=True)
    if done.returncode > 1:
        pytest.skip("no checkout of git's")
    assert "LICENSE" in done.stdout.split()
    found = [name for name in done.stdout.split() if not name.startswith(OF_OTHERS)]
    assert found == ["LICENSE"]
