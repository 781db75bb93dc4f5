"""Builds the site: build.py BUILD FOLDER. BUILD is a build folder, with the program and the Python
client; Doxygen's and javadoc's pages come along where they are there. Needs no network.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def main(build: Path, folder: Path) -> None:
    environment = os.environ | {
        "NO_MKDOCS_2_WARNING": "1",
        "RUEDO": str(build / "bin/ruedo"),
        "RUEDO_PYTHON_PACKAGE": str(build / "python"),
        "RUEDO_CPP_PAGES": str(build / "docs/api"),
        "RUEDO_JAVA_PAGES": str(build / "java/work/javadoc"),
    }
    subprocess.run(
        [
            sys.executable,
            "-m",
            "mkdocs",
            "build",
            "--quiet",
            "--strict",
            "-f",
            ROOT / "mkdocs.yml",
            "-d",
            folder,
        ],
        env=environment,
        check=True,
    )
    for unused in (
        *folder.rglob("*.map"),
        folder / "assets/javascripts/lunr",
        folder / "sitemap.xml.gz",
    ):
        shutil.rmtree(unused) if unused.is_dir() else unused.unlink()


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve())
