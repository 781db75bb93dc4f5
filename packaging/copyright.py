"""The licences of all that an installation holds, as one text: copyright.py BUILD OUT.

Ruedo's own first; then, of what is linked in or comes along (parts.toml), the texts that Debian's
packages, Python's and npm's have. What the Debian package takes from other packages as shared
libraries, and auditwheel copies into the wheel, is not in here: those have files of their own there
(scripts/make_wheel.py).
"""

import sys
from pathlib import Path

import parts

ROOT = Path(__file__).resolve().parents[1]


def read(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace")


def debian(source: str) -> str:
    """What a package says that is made from it; "" where none is installed."""
    texts = [Path("/usr/share/doc", name, "copyright") for name in parts.packages_of(source)]
    return next((read(text) for text in texts if text.is_file()), "")


def npm(build: Path) -> dict[str, str]:
    """{package: licence} of what the web console's page is made of."""
    texts = {}
    for folder, name, version, _ in parts.of_npm(build):
        found = sorted(folder.glob("LICEN[CS]E*"))
        if not found:
            raise SystemExit(f"copyright.py: {folder} has no file LICENSE")
        texts[f"{name} {version}"] = "\n".join(read(path) for path in found)
    return texts


def sections(build: Path) -> dict[str, str]:
    found = {f"{name}: {how}": debian(source) for source, (name, how, _) in parts.COMPILED.items()}
    for package, (name, how, _) in parts.COMPILED_PYPI.items():
        texts = [read(path) for path in parts.licences_of_python(package)]
        found[f"{name}: {how}"] = "\n".join(texts)
    header = "lib/python3*/site-packages/nanobind/ext/robin_map/include/tsl/robin_map.h"
    found["robin-map: compiled into Python's engine module"] = "".join(
        read(path).partition("*/")[0].lstrip("/* \n") for path in Path(sys.prefix).glob(header)
    )
    for name, text in npm(build).items():
        found[f"{name}: in the page of the web console"] = text
    return {name: text for name, text in found.items() if text}


def main(build: Path, out: Path) -> None:
    rule = "=" * 78
    text = f"Ruedo\n{rule}\n\n{read(ROOT / 'LICENSE')}"
    for name, licence in sections(build).items():
        text += f"\n\n{rule}\n{name}\n{rule}\n\n{licence.strip()}\n"
    out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
