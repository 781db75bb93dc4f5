"""docs/corpus.md says of every public robot what it does: here it does it again. And at least 95 %
of them drive.
"""

import os
import re
from pathlib import Path

import pytest
from robots_table import ROBOTS, STAND_THERE_TOO, TITLE, table
from sections import section

ROOT = Path(os.environ["RUEDO_SOURCE_DIR"])
CORPUS = ROOT.parent / "shared" / "corpus"
pytestmark = pytest.mark.skipif(
    not CORPUS.is_dir(),
    reason=f"the public files are not here ({CORPUS}); they are not part of Ruedo",
)

ROWS = dict(
    re.findall(r"^\| ([^|]*) (\|.*)$", section(ROOT / "docs/corpus.md", TITLE), re.MULTILINE)
)


@pytest.mark.parametrize("name", ROBOTS)
def test_row(name):
    made = table(Path(os.environ["RUEDO"]), CORPUS, [name]).splitlines()[2]
    assert made == f"| {name} {ROWS[name]}"


def test_most_drive_as_commanded():
    def drives(row):
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        way, turn = re.fullmatch(r"([\d.]+) m", cells[1]), re.fullmatch(r"([\d.]+) rad", cells[2])
        return (
            way
            and turn
            and abs(float(way.group(1)) - 0.6) < 0.01
            and abs(float(turn.group(1)) - 1.0) < 0.01
        )

    driven_there = set(ROBOTS) - STAND_THERE_TOO
    good = {name for name in driven_there if drives(ROWS[name])}
    assert len(good) >= 0.95 * len(driven_there), sorted(driven_there - good)
