"""The version stands in the file VERSION, and everything that has one takes it from there."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
VERSION = (SOURCE / "VERSION").read_text(encoding="utf-8").strip()


def said(*command, cwd=None, **more):
    return subprocess.run(
        [str(word) for word in command],
        capture_output=True,
        text=True,
        check=True,
        cwd=cwd,
        env={**os.environ, **more},
    ).stdout.strip()


def test_it_is_a_version():
    assert re.fullmatch(r"\d+\.\d+\.\d+", VERSION)


def test_the_program_has_it():
    assert said(BUILD / "bin/ruedo", "--version") == f"ruedo {VERSION}"


def test_the_python_package_has_it():
    program = "import ruedo; print(ruedo.__version__)"
    assert said(sys.executable, "-c", program, PYTHONPATH=str(BUILD / "python")) == VERSION
    assert said(sys.executable, "setup.py", "--version", cwd=SOURCE / "clients/python") == VERSION


@pytest.mark.skipif(not (BUILD / "java").is_dir(), reason="built without Java")
def test_the_jar_has_it():
    with zipfile.ZipFile(BUILD / "java/ruedo.jar") as jar:
        manifest = jar.read("META-INF/MANIFEST.MF").decode()
    assert f"Implementation-Version: {VERSION}" in manifest


def test_the_changes_begin_with_it():
    text = (SOURCE / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(r"^## (\S+?),? ", text, re.MULTILINE).group(1) == VERSION


def test_the_version_is_written_nowhere_else():
    """Where files name this project's version; the versions of logs and of other projects do not
    matter here.
    """
    places = {
        "CMakeLists.txt": r"project\(ruedo VERSION \d",
        "clients/python/pyproject.toml": r'^version = "',
        "clients/python/ruedo/__init__.py": r'__version__ = "',
        "web/package.json": r'^  "version"',
        "README.md": r"ruedo[-_]\d",
    }
    for name, words in places.items():
        text = (SOURCE / name).read_text(encoding="utf-8")
        assert not re.search(words, text, re.MULTILINE), f"{name}: {words}"
