"""docs/getting-started.md as a newcomer follows it: a world drawn in a browser with the page's
tools, and the page's own programs in that world.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/console"))
from harness import BUILD, browse, needs_browser, serving

PAGE = (ROOT / "docs/getting-started.md").read_text(encoding="utf-8")
PROGRAMS = dict(
    re.findall(r'^```python title="(\w+\.py)"\n(.*?)^```', PAGE, re.MULTILINE | re.DOTALL)
)


def run(program, folder):
    (folder / program).write_text(PROGRAMS[program], encoding="utf-8")
    words = ["-m", "pytest", "-q", program] if program.startswith("test_") else [program]
    result = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(BUILD / "python"), "RUEDO": str(BUILD / "bin/ruedo")},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """With the world that was drawn."""
    folder = tmp_path_factory.mktemp("evening")
    with serving("edit", "room.sdf", "--view", "127.0.0.1:0", cwd=folder) as process:
        browse(process.url, folder, "../../docs/evening")
    return folder


@needs_browser
def test_the_robot_drives_in_the_world_that_was_drawn(folder):
    (line,) = run("drive.py", folder).splitlines()  # a collision would be another one
    x, y = map(float, line.split())
    # A room of 4 x 3 m about the origin: it has gone somewhere, and it is still inside.
    assert abs(x) < 2 and abs(y) < 1.5 and (x + 0.8) ** 2 + (y + 0.5) ** 2 > 0.1


@needs_browser
def test_its_test_passes(folder):
    assert "1 passed" in run("test_room.py", folder)
