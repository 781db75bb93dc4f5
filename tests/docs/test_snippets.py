"""Every command and snippet of the documentation is run by a test, or is listed here with the
reason why not; and the snippets of campaigns, CMake and pytest, with what they need around them.
"""

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from test_docs import BINARIES, DOCUMENTS, ROOT, run_block

COMMAND = re.compile(
    r"(?:\w+=\S+ )?(pip|ruedo|scripts/|cmake|ctest|python3?|export|git|sudo|apt-get|mkdir|source|ros2|"
    r"podman|mvn|packaging/|unshare|benchmarks/|build/|java|<)"
)
# Page and beginning of a block: why no test runs it as it stands.
INSTALLS = "installs Ruedo: packaging/try_in_debian.sh and tests/package do so in bare systems"
ROS = "needs an installation of ROS 2: tests/bridges/ros2/workspace does it where there is one"
PACKAGES = "installs the system's packages: test_packages_of_the_scripts_are_listed"
LEARNS = "downloads learning libraries, and learns or measures for most of an hour"
NOT_RUN = {
    ("README.md", "pip install ruedo"): INSTALLS,
    ("README.md", "scripts/run"): "CI runs scripts/test; a release is made by scripts/release",
    ("CONTRIBUTING.md", "cmake --build"): "tests/adding_a_request builds and tests the same",
    ("adding-a-sensor.md", "<sensor"): "its type is unknown before tests/adding_a_sensor builds it",
    ("adding-a-sensor.md", "scripts/test"): "the same: tests/adding_a_sensor",
    (
        "architecture.md",
        "Middleware",
    ): "stands for a class of the reader's: tests/run/sinks_test.cpp",
    ("campaigns.md", "pip install 'ruedo[campaign]'"): "test_campaign runs the file that follows",
    ("campaigns.md", "pip install 'ruedo[hunt]'"): "test_hunt runs the file that follows",
    ("cmake.md", "add_subdirectory"): "tests/package/test_three_ways.py does each",
    ("environments.md", "from stable_baselines3"): "needs torch: tests/engine/test_learners.py",
    ("environments.md", "from torchrl"): "the same",
    ("environments.md", "from ray.rllib"): "the same",
    ("environments.md", "python3 -m venv LEARN"): LEARNS,
    ("environments.md", "python3 -m venv PEERS"): LEARNS,
    ("getting-started.md", "python3 -m venv"): INSTALLS,
    ("install.md", "python3 -m venv"): INSTALLS,
    ("install.md", "git clone"): "CI runs scripts/test on a fresh clone",
    ("install.md", "apt-get"): PACKAGES,
    ("nav2.md", "sudo apt"): ROS,
    ("nav2.md", "mkdir -p ~/ws"): ROS,
    ("nav2.md", "export ROS"): ROS,
    ("nav2.md", "ros2 launch"): ROS,
    ("nav2.md", "ros2 run"): ROS,
    (
        "networks.md",
        "export LCM_DEFAULT_URL",
    ): "tests/clients/networks_test.py sets it in each test",
    (
        "performance.md",
        "ruedo bench",
    ): "measures for an hour; its options: test_options_of_commands_exist",
    ("performance.md", "unshare"): "the same",
    ("platforms.md", "packaging/try_in_debian.sh"): "tests/package/test_debian.py",
    ("platforms.md", "mvn"): "tests/package/test_maven.py",
    ("platforms.md", "python3 -m venv"): INSTALLS,
    ("platforms.md", "RUEDO_ARCH"): "the packages for aarch64, in an emulator: by hand",
    ("platforms.md", "scripts/release"): "needs podman, and its images from elsewhere",
    ("plugins.md", "find_package"): "the core of docs/example-plugin: tests/package/test_plugin.py",
    ("plugins.md", "<ruedo:drive"): "part of docs/example-plugin: tests/package/test_plugin.py",
    ("regressions.md", "cmake --install"): "tests/package/test_installed.py",
    ("regressions.md", "cmake --build"): "tests/package/test_installed.py",
    ("ros2.md", "export ROS"): ROS,
    ("ros2.md", "ruedo regress"): ROS,
    ("ros2.md", "RUEDO_ROS_WS"): ROS,
}
FENCE = re.compile(r"^( *)```([^\n]*)\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)
TESTS = "\n".join(
    file.read_text(encoding="utf-8")
    for file in sorted((ROOT / "tests").rglob("*.py"))
    if file.name != "test_snippets.py" or file.parent.name != "docs"
)


def snippets(text):
    """(comment above, words behind ```, content) of each fence, and ("", "", content) of each
    indented block that begins as commands or XML do.
    """
    for match in FENCE.finditer(text):
        above = text[: match.start()].rstrip("\n").rpartition("\n")[2].strip()
        yield above, match[2], match[3]
    rest = FENCE.sub("", text)
    for match in re.finditer(r"(?<=\n\n)(?:    .*\n)+", rest):
        if COMMAND.match(match[0].strip()):
            yield "", "", match[0]


def is_run(above, words, content):
    """By test_docs.py, by docs.evening, by another test that names it; or it is only output."""
    name = re.fullmatch(r"<!-- (?:test: (\w[\w ]*)|file: .*) -->", above)
    if name and name[1]:
        mine = Path(__file__).read_text(encoding="utf-8")
        found = re.compile(rf"[\"']{name[1]}[\"']|<!-- test: {name[1]} -->")
        return found.search(TESTS + mine) is not None
    return (
        bool(name) or words.endswith((" test", " serves")) or "title=" in words or words == "text"
    )


def test_every_command_and_snippet_is_run():
    unused = dict(NOT_RUN)
    for document in DOCUMENTS:
        for above, words, content in snippets(document.read_text(encoding="utf-8")):
            if is_run(above, words, content):
                continue
            beginning = content.strip()
            listed = [k for k in NOT_RUN if k[0] == document.name and beginning.startswith(k[1])]
            assert listed, f"{document.relative_to(ROOT)}: no test runs {beginning[:200]}"
            unused.pop(listed[0], None)
    assert not unused


def test_snippets_are_found():
    text = "a\n\n    ruedo run x\n\n    v = 1\n\n<!-- test: y -->\n```cpp\nz\n```\n"
    assert list(snippets(text)) == [
        ("<!-- test: y -->", "cpp", "z\n"),
        ("", "", "    ruedo run x\n"),
    ]
    unknown = "<!-- test: " + "no such snippet -->"
    assert not is_run("", "cpp", "z") and not is_run(unknown, "cpp", "z")


def block(page, name):
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.search(rf"<!-- test: {name} -->\n```\w+\n(.*?)^```", text, re.MULTILINE | re.DOTALL)[
        1
    ]


def run(content, folder):
    result = run_block("sh test", content, folder)
    assert result.returncode == 0, result.stdout
    return result.stdout


WORLD = """from ruedo import World
def corridor(width):
    walls = World("corridor").wall(-2, width / 2, 6, width / 2).wall(-2, -width / 2, 6, -width / 2)
    return walls.robot("p3at")
"""
PROGRAM = """
if __name__ == "__main__":
    import ruedo, sys
    with ruedo.connect(timeout=60) as sim:
        command = sim.robots[0].velocity_command(float(sys.argv[2]), 0)
        sim.step(200, [command])
"""
METRICS = "def smoothness(log):\n    return 1.0\n"


def test_campaign(tmp_path):
    """The file has the cases that it says; with fewer of them it runs, from Python too."""
    text = block("campaigns.md", "campaign")
    (tmp_path / "corridor.yaml").write_text(text)
    (tmp_path / "world.py").write_text(WORLD)
    (tmp_path / "drive.py").write_text(block("campaigns.md", "campaign_function") + PROGRAM)
    (tmp_path / "metrics.py").write_text(METRICS)
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib/own.py").touch()
    count = "import ruedo.campaign as c; print(len(c.Campaign('corridor.yaml').cases))"
    # Worlds, controllers, widths, samples, seeds.
    assert int(run(f'python -c "{count}"', tmp_path).split()[-1]) == 2 * 2 * 5 * 20 * 10
    for more, less in (("samples: 20", "samples: 1"), ("seeds: 10", "seeds: 1")):
        text = text.replace(more, less)
    text = text.replace("steps: 5", "steps: 1").replace("duration: 40", "duration: 1")
    (tmp_path / "corridor.yaml").write_text(text)
    (tmp_path / "all.py").write_text(block("campaigns.md", "campaign_python"))
    said = run("python all.py", tmp_path)
    assert "controller" in said and "program" in said and "function" in said, said
    status = run("ruedo campaign status corridor.yaml", tmp_path)
    assert "crashed" not in status and "invalid" not in status, status


def test_hunt(tmp_path):
    """Of the page's settings, in the file of docs/campaign-example."""
    example = ROOT / "docs/campaign-example"
    shutil.copy(example / "corridor.py", tmp_path)
    text = (example / "hunt.yaml").read_text(encoding="utf-8").partition("\nhunt:")[0]
    (tmp_path / "hunt.yaml").write_text(f"{text}\n{block('campaigns.md', 'campaign_hunt')}")
    said = run("ruedo hunt hunt.yaml --cases 3 --keep regressions/corridor || [ $? = 1 ]", tmp_path)
    assert "3" in said


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    folder = tmp_path_factory.mktemp("prefix")
    cmake = shutil.which("cmake")
    subprocess.run(
        [cmake, "--install", BINARIES.parent, "--prefix", folder],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return folder


CMAKE = "cmake -G Ninja -DCMAKE_PREFIX_PATH={} . && cmake --build . && "


def test_cmake_targets(prefix, tmp_path):
    """A program that links what docs/cmake.md says."""
    lines = [block("cmake.md", "cmake_package"), "add_executable(robot robot.cpp)\n"]
    lines += [block("cmake.md", "cmake_link")]
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.22)\nproject(robot CXX)\n" + "".join(lines)
    )
    (tmp_path / "robot.cpp").write_text(
        "#include <ruedo/client.h>\nint main() { ruedo::client::launch(\"arena\"); }\n"
    )
    run(CMAKE.format(prefix) + "./robot", tmp_path)


def test_cmake_regression(prefix, tmp_path):
    """docs/regressions.md: once to make the golden log, once to compare with it."""
    for file in (ROOT / "docs/example-project").iterdir():
        if file.suffix in (".sdf", ".cpp"):
            shutil.copy(file, tmp_path)
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.22)\nproject(robot CXX)\n"
        + block("regressions.md", "regression_cmake")
    )
    said = run(CMAKE.format(prefix) + "cmake --build . --target renew-goldens && ctest", tmp_path)
    assert "100% tests passed, 0 tests failed out of 1" in said


def test_pytest_regression(tmp_path):
    for file in (ROOT / "docs/example-project").iterdir():
        if file.name in ("gate.sdf", "through_the_gate.py"):
            shutil.copy(file, tmp_path)
    text = block("regressions.md", "regression_pytest")
    faster = text.replace("seed=7", "seed=7, options=['--disable=p3at/camera']")
    (tmp_path / "test_gate.py").write_text(faster)
    words = "python -m pytest -q test_gate.py"
    said = run(f"RUEDO_RENEW=1 {words}; {words}", tmp_path)
    assert said.count("1 passed") == 2
