"""A project that uses Ruedo by find_package, by add_subdirectory and by FetchContent: the same
target, and nothing of Ruedo's own flags, options and names reaches it. The page docs/cmake.md names
every option and preset."""

import json
import os
import re
from pathlib import Path

import pytest
from processes import run_tool as run

SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
CMAKE = os.environ.get("CMAKE_COMMAND", "cmake")
PROJECT = Path(__file__).parent / "part"
FLAGS = "-O0"


def cached(name):
    """Of the build that is tested: its compiler and its cache, where it has one."""
    text = (BUILD / "CMakeCache.txt").read_text(encoding="utf-8")
    return re.search(rf"^{name}:\w+=(.*)$", text, re.MULTILINE)


def use(how, folder, *options, generator="Ninja", standard=17):
    """Configures and builds the project; gives what its program says."""
    options = [
        f"-DHOW={how}",
        f"-DSTANDARD={standard}",
        "-DCMAKE_BUILD_TYPE=Release",
        f"-DCMAKE_CXX_FLAGS_RELEASE={FLAGS}",
        *options,
    ]
    for name in ("CMAKE_CXX_COMPILER_LAUNCHER", "CMAKE_CXX_COMPILER"):
        if found := cached(name):
            options.append(f"-D{name}={found.group(1)}")
    run(CMAKE, "-G", generator, "-S", PROJECT, "-B", folder, f"-DFLAGS={FLAGS}", *options)
    run(CMAKE, "--build", folder, "--parallel", "2")
    return run(folder / "program").splitlines()


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """The sources as a release has them: what git knows, and what is there and not ignored."""
    file = tmp_path_factory.mktemp("archive") / "ruedo.tar.gz"
    names = run("git", "-C", SOURCE, "ls-files", "-co", "--exclude-standard").splitlines()
    kept = [name for name in names if (SOURCE / name).exists() and not name.startswith("docs/")]
    run(
        "tar",
        "czf",
        file,
        "-C",
        SOURCE,
        "--transform=s,^,ruedo/,",
        "-T",
        "-",
        input="\n".join(kept),
    )
    return file


def test_find_package(tmp_path):
    """The client, and the engine as its page shows it."""
    run(CMAKE, "--install", BUILD, "--prefix", tmp_path / "ruedo")
    page = (SOURCE / "docs/engine.md").read_text(encoding="utf-8")
    code = re.search(r"<!-- test: engine cpp -->\n```cpp\n(.*?)```", page, re.DOTALL).group(1)
    (tmp_path / "embedded.cpp").write_text(code)
    program, error = use(
        "package",
        tmp_path / "build",
        f"-DCMAKE_PREFIX_PATH={tmp_path / 'ruedo'}",
        f"-DEMBEDDED={tmp_path / 'embedded.cpp'}",
    )
    assert Path(program).resolve() == tmp_path / "ruedo/bin/ruedo"
    assert "/nowhere" in error
    assert run(tmp_path / "build/embedded", cwd="/") == "5 s, 181 beams\n"


def test_add_subdirectory(tmp_path):
    """By another generator and standard, beside shared libraries and targets `lcm`, `lcm-gen` and
    `core` of the project's own.
    """
    program, error = use(
        "subdirectory",
        tmp_path / "build",
        f"-DRUEDO_SOURCE={SOURCE}",
        "-DBUILD_SHARED_LIBS=ON",
        generator="Unix Makefiles",
        standard=23,
    )
    assert program == str(tmp_path / "build/ruedo/bin/ruedo")
    assert "/nowhere" in error


def test_fetch_content(tmp_path, archive):
    program, error = use("fetch", tmp_path / "build", f"-DRUEDO_SOURCE={archive}")
    assert program == str(tmp_path / "build/_deps/ruedo-build/bin/ruedo")
    assert "/nowhere" in error


def test_without_lcm_the_error_says_how_to_install_it(tmp_path, archive):
    run("tar", "xzf", archive, "-C", tmp_path)
    said = run(
        CMAKE,
        "-G",
        "Ninja",
        "-S",
        tmp_path / "ruedo",
        "-B",
        tmp_path / "b",
        "-DRUEDO_TESTS=OFF",
        f"-Dlcm_DIR={tmp_path}",
        code=None,
    )
    assert "LCM 1.5.3 was not found: pip install lcm==1.5.3" in " ".join(said.split())


def test_the_page_names_every_option_and_preset():
    page = (SOURCE / "docs/cmake.md").read_text(encoding="utf-8")
    declared = set()
    for file in [SOURCE / "CMakeLists.txt", *(SOURCE / "cmake").glob("*.cmake")]:
        declared |= set(
            re.findall(
                r"^\s*(?:option\(|set\()(RUEDO_\w+)(?: \"[^\"]*\" CACHE| \")",
                file.read_text(encoding="utf-8"),
                re.MULTILINE,
            )
        )
    assert {"RUEDO_TESTS", "RUEDO_SANITIZE", "RUEDO_FUZZ"} <= declared
    internal = {"RUEDO_IMPORTER"}  # tests/fuzz gives it to the build that it makes
    assert sorted(name for name in declared - internal if f"`{name}`" not in page) == []
    presets = json.loads((SOURCE / "CMakePresets.json").read_text(encoding="utf-8"))
    for preset in presets["configurePresets"]:
        assert preset.get("hidden") or (f"| `{preset['name']}` |" in page and preset["description"])


def test_nothing_is_forced_and_nothing_depends_on_the_top():
    files = [
        SOURCE / name
        for name in run("git", "-C", SOURCE, "ls-files").splitlines()
        if name.endswith((".cmake", "CMakeLists.txt", ".cmake.in"))
    ]
    for file in files:
        text = file.read_text(encoding="utf-8")
        assert not re.search(r"\bFORCE\b|\bCMAKE_SOURCE_DIR\b", text), file
        assert file.name == "RuedoRegression.cmake" or "CMAKE_BINARY_DIR" not in text, file


@pytest.mark.parametrize("folder", ["web", "scripts/lint_tools"])
def test_debians_npm_reads_the_lock_file(folder):
    """npm 9.2, of Debian 12 and 13, takes no lock file beside an alias in "overrides"; its `npm ci`
    then says that there is none. Newer ones do not mind.
    """
    package = json.loads((SOURCE / folder / "package.json").read_text(encoding="utf-8"))
    assert not [v for v in package.get("overrides", {}).values() if str(v).startswith("npm:")]
