"""Mutation testing, by cosmic-ray, of what makes a case's status of a verdict.

python_mutants.py BUILD
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
MODULES = {"campaign/outcome.py": HERE.parent / "campaign/unit/test_outcome.py"}
PATIENCE = 120  # s
SAME = re.compile(r'^\+.* is "', re.MULTILINE)  # as ==: Python holds such words once


def cosmic_ray(*words, folder, **options):
    command = [sys.executable, "-m", "cosmic_ray.cli", *words]
    return subprocess.run(command, cwd=folder, check=True, text=True, **options)


def lives(module, test, build, folder):
    """The mutants that no test kills, as differences, and how many there are."""
    (folder / "build").mkdir()
    shutil.copytree(build / "python", folder / "build/python")
    os.environ.update(
        PYTHONPATH=str(folder / "build/python"),
        RUEDO_BUILD_DIR=str(folder / "build"),
        PYTHONDONTWRITEBYTECODE="1",
    )
    (folder / "config.toml").write_text(
        f"""[cosmic-ray]
module-path = "build/python/ruedo/{module}"
timeout = {PATIENCE}
excluded-modules = []
test-command = "{sys.executable} -m pytest -qx -p no:cacheprovider {test}"
[cosmic-ray.distributor]
name = "local"
"""
    )
    cosmic_ray("init", "config.toml", "session.sqlite", folder=folder)
    cosmic_ray("baseline", "config.toml", folder=folder)
    cosmic_ray("exec", "config.toml", "session.sqlite", folder=folder)
    said = cosmic_ray("dump", "session.sqlite", folder=folder, capture_output=True).stdout
    results = [json.loads(line)[1] for line in said.splitlines()]
    results = [one for one in results if not SAME.search(one["diff"])]
    return [one["diff"] for one in results if one["test_outcome"] == "survived"], len(results)


def main():
    build = Path(sys.argv[1]).resolve()
    good = True
    for module, test in MODULES.items():
        with tempfile.TemporaryDirectory(prefix="ruedo-mutants-") as folder:
            left, count = lives(module, test, build, Path(folder))
        for difference in left:
            print("lives:", difference)
        print(f"{module}: {count - len(left)} of {count} mutants killed")
        good = good and len(left) <= 0.1 * count
    sys.exit(not good)


main()
