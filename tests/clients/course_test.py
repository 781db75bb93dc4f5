"""The course's notebooks run from start to end: as they are, which has not passed yet, and with the
model solution in the place of the program to complete, which passes.
"""

import json
import os
import re
import subprocess
import sys
import types

import matplotlib as mpl
import pytest
from conftest import SOURCE

mpl.use("Agg")
COURSE = SOURCE / "clients/python/examples/course"
sys.path[:0] = [str(COURSE), str(SOURCE / "clients/python/examples/labs/marking/students")]

import practise
import solution
from labs import LABS

EVENINGS = sorted(COURSE.glob("evening_[1-8]_*.ipynb"))
PARTS = ["The idea", "The task", "Your program", "A good result", "How it is marked", "Beyond"]
PRACTISED = {
    "evening_1_odometry": ["square", "umbmark"],
    "evening_2_ranges": ["sonar_avoidance"],
    "evening_3_wall_following": ["wall_following"],
    "evening_4_mapping": ["mapping"],
    "evening_5_localisation": ["particle_filter"],
    "evening_6_planning": ["planning"],
    "evening_7_vision": ["vision"],
    "evening_8_many_robots": ["many_robots"],
}


def cells(notebook, kind):
    found = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return ["".join(cell["source"]) for cell in found if cell["cell_type"] == kind]


def code(notebook):
    return "\n".join(cells(notebook, "code"))


def execute(notebook, monkeypatch):
    """Runs it in its folder; returns its names."""
    monkeypatch.chdir(notebook.parent)
    names = {"__name__": "__main__"}
    for source in cells(notebook, "code"):
        exec(compile(source.replace("%matplotlib inline", ""), notebook.name, "exec"), names)
    mpl.pyplot.close("all")
    return names


def run(notebook, monkeypatch, solved):
    """What practise() gave, in the notebook's folder. solved: by the solution."""
    attempts = []

    def recorded(program, *args, **kwargs):
        name = program.__name__
        attempts.append(attempt(getattr(solution, name) if solved else program, *args, **kwargs))
        return attempts[-1]

    attempt = practise.practise
    monkeypatch.setattr(practise, "practise", recorded)
    execute(notebook, monkeypatch)
    return attempts


def test_there_are_eight_evenings_and_each_lab_is_in_one():
    assert [path.stem for path in EVENINGS] == list(PRACTISED)
    assert sorted(lab for several in PRACTISED.values() for lab in several) == sorted(LABS)


@pytest.mark.parametrize("notebook", EVENINGS, ids=lambda path: path.stem)
def test_an_evening_runs_and_is_not_solved_yet(notebook, monkeypatch):
    attempts = run(notebook, monkeypatch, solved=False)
    assert [one.lab for one in attempts] == PRACTISED[notebook.stem]
    for one in attempts:
        assert not one.passed and not one.why.startswith("touched"), one


@pytest.mark.parametrize("notebook", EVENINGS, ids=lambda path: path.stem)
def test_an_evening_passes_with_the_solution(notebook, monkeypatch):
    for one in run(notebook, monkeypatch, solved=True):
        assert one.passed, one


def test_the_learners_evening_runs(monkeypatch):
    rates = execute(COURSE / "evening_10_learner.ipynb", monkeypatch)["rates"]
    assert rates["learnt"][0] >= 0.8 and rates["at random"][0] <= 0.1


@pytest.mark.parametrize("notebook", EVENINGS, ids=lambda path: path.stem)
def test_an_evening_has_its_parts_and_no_outputs(notebook):
    text = "\n".join(cells(notebook, "markdown"))
    assert re.findall(r"^## (.*)", text, re.MULTILINE) == PARTS
    assert (
        text.count("$$") >= 2
        and len(re.findall(r"^[123]\. ", text.partition("Beyond")[2], re.MULTILINE)) == 3
    )
    pictures = re.findall(r"!\[[^\]]+\]\((images/[^)]+)\)", text)
    assert len(pictures) == 2 and all((COURSE / picture).is_file() for picture in pictures)
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        assert cell.get("outputs", []) == [] and cell.get("execution_count") is None
    own = re.findall(
        r"^from (lab|mapping|particle_filter|practise)\b|^import (labs)",
        code(notebook),
        re.MULTILINE,
    )
    assert own[0][0] == "practise"  # it finds the others


def test_in_a_notebook_the_console_shows_the_robot(monkeypatch):
    """IPython and its frame stand in; the page is the server's own."""
    shown = []
    ipython = types.ModuleType("IPython")
    ipython.get_ipython = object
    display = types.ModuleType("IPython.display")
    display.IFrame = lambda address, width, height: address
    display.display = shown.append
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    monkeypatch.setattr(practise, "FASTER", 1000.0)

    def square(robot):
        from urllib.request import urlopen

        shown.append(urlopen(shown[0], timeout=30).status)

    assert not practise.practise(square).passed
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/", shown[0]) and shown[1:] == [200]


def test_errors_of_a_program_are_its_own():
    def vision(robot):
        robot.drive(float("nan"), 0.0)

    with pytest.raises(ValueError, match="not a finite number"):
        practise.practise(vision)

    def flying(robot):
        pass

    with pytest.raises(ValueError, match="no lab is called 'flying'; there are square, "):
        practise.practise(flying)


@pytest.mark.parametrize("start", ["square", "sonar_avoidance", "wall_following"])
def test_starts_in_cpp_and_java_run(start):
    java = "".join(word.capitalize() for word in start.split("_")) + "Start"
    commands = [[os.path.join(os.environ["RUEDO_STARTS_CPP"], f"start_{start}")]]
    if "RUEDO_PROBE_JAVA" in os.environ:
        jar = os.path.join(os.environ["RUEDO_BUILD_DIR"], "java/ruedo.jar")
        commands += [["java", "-cp", f"{jar}:{os.environ['RUEDO_PROBE_JAVA']}", java]]
    said = {
        subprocess.run(
            [*command, *["room.sdf"][: start == "wall_following"]],
            cwd=COURSE / "starts",
            capture_output=True,
            text=True,
            timeout=200,
            check=True,
        ).stdout
        for command in commands
    }
    assert len(said) == 1 and re.search(r"\d\.\d", said.pop())  # the same drive in both languages


def test_the_command_copies_the_course(tmp_path):
    ruedo = os.environ["RUEDO"]
    words = [ruedo, "course", "mine"]
    environment = os.environ | {"RUEDO_PYTHON": sys.executable}
    first, again = (
        subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True)
        for _ in range(2)
    )
    assert (first.returncode, first.stderr) == (0, "") and "mine/course" in first.stdout
    assert again.returncode == 1 and "mine is there already" in again.stderr
    for path in (*EVENINGS, COURSE / "practise.py", COURSE / "../labs/marking/labs.yaml"):
        copy = tmp_path / "mine" / path.resolve().relative_to(COURSE.parent)
        assert copy.read_bytes() == path.read_bytes()
    attempt = subprocess.run(
        [
            sys.executable,
            "-c",
            "from practise import practise; import lab, mapping; print(practise)",
        ],
        cwd=tmp_path / "mine/course",
        capture_output=True,
        text=True,
    )
    assert attempt.returncode == 0, attempt.stderr
