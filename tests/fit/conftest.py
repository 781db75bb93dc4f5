"""What the tests of fits share: the package of the build, and the program as its users start it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

SOURCE = Path(os.environ.get("RUEDO_SOURCE_DIR", Path(__file__).resolve().parents[2]))
BUILD = Path(os.environ.get("RUEDO_BUILD_DIR", SOURCE / "build/release"))
RUEDO = os.environ.setdefault("RUEDO", str(BUILD / "bin/ruedo"))
os.environ["RUEDO_PYTHON"] = sys.executable
sys.path.insert(0, str(BUILD / "python"))


def ruedo(*words, code=0, cwd=None):
    """The program's standard output and error; it must end with that exit code."""
    done = subprocess.run(
        [RUEDO, *map(str, words)], capture_output=True, text=True, timeout=300, cwd=cwd
    )
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout, done.stderr
