"""The binary interface of ruedo::engine against the last version's (docs/compatibility.md): what a
program that was linked with that one needs is there and unchanged.

    test_abi.py DUMP    writes today's, for a release
"""

import gzip
import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
LAST = Path(__file__).with_name("engine.abi.gz")
NEW_ONLY = 4  # abidiff's bits: the interface changed; with 8, so that old programs break
# Text after the class is not part of it.
HIDDEN = r"""
[suppress_function]
  symbol_name_regexp = .*(4Impl|__get_helper).*
  drop = true
[suppress_type]
  name_regexp = .*(Impl|world::|physics::|engine::|scene::|sensors::|robot::|run::).*
  drop = true
"""
EXPORTED = """{
  global: extern "C++" { ruedo::Engine::*; ruedo::SavedWorld::*; ruedo::EngineOptions::*; };
  local: *;
};
"""


def dump(folder: Path, headers: Path = SOURCE / "include/ruedo") -> Path:
    """As abidw says it of a library of engine.cpp alone, with debug information."""
    (folder / "hidden.ini").write_text(HIDDEN)
    (folder / "exported").write_text(EXPORTED)
    for unit in json.loads((BUILD / "compile_commands.json").read_text()):
        if unit["file"].endswith("clients/cpp/engine/engine.cpp"):
            command = shlex.split(unit["command"])
    kept = [word for word in command[1 : command.index("-o")] if word not in ("-O2", "-DNDEBUG")]
    before = [f"-I{headers.parent}"] if headers.parent != SOURCE / "include" else []
    library = folder / "engine.so"
    link = ["-g", "-O0", "-shared", f"-Wl,--version-script={folder}/exported"]
    source = command[command.index("-c") + 1]
    run("g++", *before, *kept, *link, source, "-o", library)
    out = folder / "engine.abi"
    options = "--drop-private-types --no-corpus-path --no-comp-dir-path --no-show-locs"
    words = [*options.split(), "--exported-interfaces-only", "--headers-dir", headers]
    run("abidw", "--suppressions", folder / "hidden.ini", *words, library, "--out-file", out)
    return out


def run(*command):
    subprocess.run([str(word) for word in command], check=True, cwd=BUILD)


def difference(old: Path, new: Path) -> tuple[int, str]:
    done = subprocess.run(["abidiff", old, new], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


@pytest.fixture(scope="module")
def today(tmp_path_factory):
    if shutil.which("abidw") is None:
        pytest.skip("no libabigail here (package abigail-tools)")
    return dump(tmp_path_factory.mktemp("abi"))


@pytest.fixture(scope="module")
def last(tmp_path_factory):
    file = tmp_path_factory.mktemp("last") / "engine.abi"
    file.write_bytes(gzip.decompress(LAST.read_bytes()))
    return file


def test_programs_of_the_last_version_find_what_they_need(today, last):
    code, told = difference(last, today)
    assert code in (0, NEW_ONLY), told


def test_a_removed_function_and_a_moved_member_are_found(today, tmp_path):
    headers = tmp_path / "include/ruedo"
    shutil.copytree(SOURCE / "include/ruedo", headers)
    text = (headers / "engine.h").read_text()
    at = text.index("struct EngineOptions {") + len("struct EngineOptions {")
    (headers / "engine.h").write_text(f"{text[:at]}\n  double first = 0.0;\n{text[at:]}")
    code, told = difference(today, dump(tmp_path, headers))
    assert code & NEW_ONLY and "EngineOptions" in told, told


if __name__ == "__main__":
    folder = BUILD / "abi"
    folder.mkdir(exist_ok=True)
    Path(sys.argv[1]).write_bytes(gzip.compress(dump(folder).read_bytes(), 9, mtime=0))
