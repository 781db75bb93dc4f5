"""A class of thirty in every lab, marked as a teacher would: one campaign, one report. Nightly.

class_of_labs.py FOLDER leaves the campaign, and its report marks.html, in FOLDER/labs/marking.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import yaml
from ruedo.campaign import Campaign

HERE = Path(__file__).resolve().parent
SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
RUEDO = str(Path(os.environ["RUEDO_BINARY_DIR"], "bin/ruedo"))
GOOD = ["solution", "slower", "prints", "uses_threads"]
# What the reason says, in whatever lab; "": why it failed is the lab's own.
OTHERS = {
    # bad
    "stands_still": "",
    "spins": "",
    "goes_in_circles": "",
    "goes_straight_on": "",
    "goes_backwards": "",
    "hands_in_zeros": "",
    "wanders_at_random": "",
    "ends_at_once": "",
    # hanging
    "sleeps": "did not drive for 20 s",
    "loops_without_end": "did not drive for 20 s",
    "hands_in_without_end": "did not drive for 20 s",
    # crashing
    "crashes": "ZeroDivisionError: division by zero",
    "recurses": "RecursionError",
    "is_no_python": "SyntaxError",
    "exits_hard": "",
    "takes_all_memory": "MemoryError",
    "drives_at_nan": "not a finite number",
    "says_a_long_line": "said more than 1 MB at once",
    # cheating
    "says_passed": "neither a command nor a result",
    "reads_labs": "Permission denied",
    "writes_results": "Permission denied",
    "reads_the_solution": "Permission denied",
    "reads_the_referees_environment": "Permission denied",
    "stops_the_server": "Operation not permitted",
    "reads_the_truth": "Operation not permitted",
    "drives_without_reading": "drove without a look at the readings",
}


def hand_in(name, folder, labs):
    """A program of tests/exam/files/labs; what it has for the square, it does in every lab."""
    solution = folder / "solution.py"
    if name == "solution":
        return
    (source,) = (HERE / "files/labs").glob(f"*/{name}.*")
    text = f"{source.read_text()}\nfor _lab in {labs}:\n    globals()[_lab] = "
    if name in GOOD:
        text = f"_solved = {{}}\nexec({solution.read_text()!r}, _solved)\n{text}around(_solved[_lab])\n"
    else:
        text += "globals().get('square')\n"
    (folder / f"{name}.py").write_text(text)


def main(folder):
    assert len(GOOD) + len(OTHERS) == 30
    shutil.copytree(SOURCE / "clients/python/examples/labs", folder / "labs")
    marking = folder / "labs/marking"
    labs = yaml.safe_load((marking / "labs.yaml").read_text())["parameters"]["lab"]
    for name in [*GOOD, *OTHERS]:
        hand_in(name, marking / "students", labs)
    python = Path(sys.executable)
    subprocess.run(
        [RUEDO, "campaign", "run", "labs.yaml", "--quiet", "--workers", "2"],
        cwd=marking,
        env=os.environ
        | {"RUEDO_PYTHON": str(python), "PATH": f"{python.parent}:{os.environ['PATH']}"},
        check=False,
    )
    subprocess.run(
        [RUEDO, "campaign", "report", "labs.yaml", "--pages", "0", "-o", "marks.html"],
        cwd=marking,
        env=os.environ | {"RUEDO_PYTHON": str(python)},
        check=True,
    )
    assert all(name in (marking / "marks.html").read_text() for name in [*GOOD, *OTHERS, *labs])
    frame = Campaign(marking / "labs.yaml").results().frame()
    assert len(frame) == 30 * len(labs)
    wrong = [
        (row.controller, row.lab, row.status, row.reason)
        for row in frame.itertuples()
        if row.passed != (row.controller in GOOD)
        or OTHERS.get(row.controller, "") not in row.reason
    ]
    assert not wrong, "\n".join(map(str, wrong))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as folder:
            main(Path(folder))
