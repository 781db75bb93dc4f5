"""Generates the message types as the Python package ruedo.lcmtypes, with lcm-gen, from the .lcm
files; samples and enumerations from the vocabulary beside them; and ruedo._version.

    generate_types.py PROTO_FOLDER OUTPUT_FOLDER [--lcm-gen PROGRAM]

They come out in OUTPUT_FOLDER/ruedo/lcmtypes; the version is that of the file VERSION beside
PROTO_FOLDER. The types' package is `ruedo`, as the client's own; so that they do not meet, it is
renamed on the way, which LCM's fingerprints do not depend on.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path


def find_lcm_gen() -> str:
    """lcm-gen beside this Python (lcm is a build requirement), else on the PATH."""
    beside = Path(sys.executable).parent / "lcm-gen"
    found = str(beside) if beside.exists() else shutil.which("lcm-gen")
    if not found:
        raise SystemExit("lcm-gen was not found: pip install lcm==1.5.3")
    return found


def read_version(proto: Path) -> str:
    """The repository's version, which stands in one file."""
    return (proto.parent / "VERSION").read_text(encoding="utf-8").strip()


def generate(proto: Path, output: Path, lcm_gen: str | None = None) -> None:
    files = sorted(proto.glob("*.lcm"))
    if not files:
        raise SystemExit(f"{proto} has no .lcm files")
    with tempfile.TemporaryDirectory() as scratch:
        for file in files:
            renamed = re.sub(
                r"^package ruedo;", "package ruedo.lcmtypes;", file.read_text(), flags=re.MULTILINE
            )
            (Path(scratch) / file.name).write_text(renamed)
        made = Path(scratch) / "python"
        subprocess.run(
            [
                lcm_gen or find_lcm_gen(),
                "-p",
                "--ppath",
                str(made),
                *(str(Path(scratch) / f.name) for f in files),
            ],
            check=True,
        )
        target = output / "ruedo" / "lcmtypes"
        shutil.rmtree(target, ignore_errors=True)
        shutil.copytree(made / "ruedo" / "lcmtypes", target)
    subprocess.run([sys.executable, str(proto / "generator"), "python", str(output)], check=True)
    (output / "ruedo" / "_version.py").write_text(f'__version__ = "{read_version(proto)}"\n')


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("proto", type=Path)
    parser.add_argument("output", type=Path)
    parser.add_argument("--lcm-gen")
    options = parser.parse_args()
    generate(options.proto, options.output, options.lcm_gen)
