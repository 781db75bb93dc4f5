"""A virtual environment with real ROS 2, made once.

    install.py RELEASE FOLDER

Ends with 77 where there is none for this Python.
"""

import shutil
import subprocess
import sys
import venv
from pathlib import Path

NONE_FOR_THIS_PYTHON = 77


def main():
    release, folder = sys.argv[1], Path(sys.argv[2])
    wanted = Path(__file__).with_name(f"{release}.txt")
    if sys.version_info[:2] != (3, 11):
        sys.exit(NONE_FOR_THIS_PYTHON)
    stamp = folder / "requirements.txt"
    if stamp.exists() and stamp.read_text() == wanted.read_text():
        return
    shutil.rmtree(folder, ignore_errors=True)
    venv.create(folder, with_pip=True)
    pip = [folder / "bin/python", "-m", "pip", "install", "--quiet", "--no-deps", "-r", wanted]
    subprocess.run(pip, check=True)
    shutil.copy(wanted, stamp)


main()
