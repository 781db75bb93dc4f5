"""Makes the part of a client that follows from proto/*.lcm and proto/vocabulary.toml.

python3 proto/generator cpp|java|python|pages OUTPUT_FOLDER

The files are written where they have changed, and no other.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import cpp
import java
import pages
import python
from table import Fault, read

PROTO = Path(__file__).resolve().parents[1]
METHODS = PROTO.parent / "clients"


def files(language: str) -> dict[str, list[str]]:
    vocabulary = read(PROTO)
    if language == "cpp":
        return cpp.make(vocabulary, METHODS / "cpp/methods")
    if language == "java":
        return java.make(vocabulary, METHODS / "java/methods")
    if language == "python":
        return python.make(vocabulary)
    return pages.make(vocabulary)


def write(output: Path, made: dict[str, list[str]]) -> None:
    for name, lines in made.items():
        path = output / name
        text = "\n".join(lines) + "\n"
        if path.exists() and path.read_text(encoding="utf-8") == text:
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("language", choices=("cpp", "java", "python", "pages"))
    parser.add_argument("output", type=Path)
    options = parser.parse_args()
    try:
        write(options.output, files(options.language))
    except Fault as fault:
        print(fault, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
