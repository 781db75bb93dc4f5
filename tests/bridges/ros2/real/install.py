"""A virtual environment with real ROS 2 and the interfaces that PyPI lacks, made once.

    install.py RELEASE FOLDER

Ends with 77 where there is none for this Python.
"""

import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

NONE_FOR_THIS_PYTHON = 77


def main():
    release, folder = sys.argv[1], Path(sys.argv[2])
    here = Path(__file__).parent
    wanted = "".join(
        (here / name).read_text() for name in (f"{release}.txt", "interfaces.txt", "generate.py")
    )
    if sys.version_info[:2] != (3, 11):
        sys.exit(NONE_FOR_THIS_PYTHON)
    stamp = folder / "made-from.txt"
    if stamp.exists() and stamp.read_text() == wanted:
        return
    shutil.rmtree(folder, ignore_errors=True)
    venv.create(folder, with_pip=True)
    python = folder / "bin/python"
    pip = [python, "-m", "pip", "install", "--quiet", "--no-deps", "-r", here / f"{release}.txt"]
    subprocess.run(pip, check=True)
    environment = {**os.environ, "LD_LIBRARY_PATH": str(folder / "lib")}
    subprocess.run([python, here / "generate.py"], env=environment, check=True)
    stamp.write_text(wanted)


main()
