"""Programs as the tests of packages start them."""

import os
import subprocess
import sys
from pathlib import Path

# Without what helps to find another Ruedo than the one under test.
CLEAN = {
    name: value
    for name, value in os.environ.items()
    if not name.startswith(("RUEDO", "LCM_")) and name not in ("PYTHONPATH", "LD_LIBRARY_PATH")
}
# With what comes from PyPI: lcm-gen.
TOOLS = {**CLEAN, "PATH": f"{Path(sys.executable).parent}:{CLEAN['PATH']}"}


def run(*command, code=0, more=None, env=CLEAN, **options):
    """What a program wrote, to both of its outputs.

    It fails, and shows that, when the program ends with another code (None: any will do). more:
    variables beside those of env.
    """
    done = subprocess.run(
        [str(word) for word in command],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**env, **(more or {})},
        timeout=900,
        check=False,
        **options,
    )
    assert code is None or done.returncode == code, done.stdout
    return done.stdout


def run_tool(*command, **options):
    """As run(), with what comes from PyPI on the PATH."""
    return run(*command, env=TOOLS, **options)
