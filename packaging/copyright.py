"""The licences of all that an installation holds, as one text: copyright.py BUILD OUT.

Ruedo's own first; then, of what is linked in or comes along, the texts that Debian's packages,
Python's and npm's have. What the Debian package takes from other packages as shared libraries, and
auditwheel copies into the wheel, is not in here: those have files of their own there
(scripts/make_wheel.py).
"""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# {what: (what it is for, a file of the Debian package that it comes from)}
FROM_DEBIAN = {
    "musl": ("elementary functions, linked into the programs", "*-linux-musl/libc.a"),
    "Bullet": ("changed copies in lib/ruedo", "*/libBulletDynamics-float64.so.*"),
    "urdfdom": ("a changed copy in lib/ruedo", "*/liburdfdom_model.so.*"),
    "Assimp": ("a changed copy in lib/ruedo", "*/libassimp.so.*"),
    "CLI11": ("headers, compiled into the programs", "*/include/CLI/App.hpp"),
    "Eigen": ("headers, compiled into the programs", "*/eigen3/Eigen/Core"),
}


def debian(pattern: str) -> str:
    """What the package says that owns such a file; "" where no package does."""
    done = subprocess.run(["dpkg", "-S", pattern], capture_output=True, text=True)
    names = sorted({line.split(":")[0] for line in done.stdout.splitlines()})
    texts = [Path("/usr/share/doc", name, "copyright") for name in names]
    return next((read(text) for text in texts if text.is_file()), "")


def read(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace")


def python(package: str) -> str:
    """The licences that a Python package of the virtual environment brings along."""
    found = Path(sys.prefix).glob(f"lib/python3*/site-packages/{package}-*.dist-info/licenses/**/*")
    return "\n".join(read(path) for path in sorted(found) if path.is_file())


def npm(build: Path) -> dict[str, str]:
    """{package: licence} of what the web console's page is made of."""
    lock = build / "web/package-lock.json"
    if not lock.is_file():
        return {}
    texts = {}
    for folder, about in json.loads(read(lock))["packages"].items():
        if not folder or about.get("dev"):
            continue
        found = sorted((build / "web" / folder).glob("LICEN[CS]E*"))
        if not found:
            raise SystemExit(f"copyright.py: {folder} has no file LICENSE")
        name = f"{folder.removeprefix('node_modules/')} {about['version']}"
        texts[name] = "\n".join(read(path) for path in found)
    return texts


def sections(build: Path) -> dict[str, str]:
    found = {}
    for name, (what, pattern) in FROM_DEBIAN.items():
        found[f"{name}: {what}"] = debian(pattern)
    found["LCM 1.5.3: lib/ruedo/liblcm.so.1 and its Python module"] = python("lcm")
    found["nanobind: compiled into Python's engine module"] = python("nanobind")
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
