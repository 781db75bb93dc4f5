"""What Debian's package holds besides an installation: debian_tree.py FOLDER MAINTAINER.

The changelog is CHANGELOG.md's, its date that of SOURCE_DATE_EPOCH; Python finds the client by a
.pth file.
"""

import gzip
import os
import re
import shutil
import sys
import textwrap
from email.utils import formatdate
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def changelog(text: str, maintainer: str, date: str) -> str:
    """Debian's form of CHANGELOG.md's newest version."""
    version, items = re.search(
        r"^## (\S+?),? .*?\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL
    ).groups()
    changes = [" ".join(item.split()) for item in re.split(r"^- ", items, flags=re.MULTILINE)[1:]]
    plain = [re.sub(r"[`*]|\[([^]]*)\]\([^)]*\)", r"\1", change) for change in changes]
    lines = [
        textwrap.fill(change, 78, initial_indent="  * ", subsequent_indent="    ")
        for change in plain
    ]
    body = "\n".join(lines)
    return f"ruedo ({version}) unstable; urgency=medium\n\n{body}\n\n -- {maintainer}  {date}\n"


def main(folder: Path, maintainer: str) -> None:
    date = formatdate(int(os.environ.get("SOURCE_DATE_EPOCH", "0")))
    text = changelog((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), maintainer, date)
    shutil.rmtree(folder, ignore_errors=True)
    doc = folder / "usr/share/doc/ruedo"
    overrides = folder / "usr/share/lintian/overrides"
    packages = folder / "usr/lib/python3/dist-packages"
    for one in (doc, overrides, packages):
        one.mkdir(parents=True)
    (doc / "changelog.gz").write_bytes(gzip.compress(text.encode(), 9, mtime=0))
    shutil.copy(ROOT / "packaging/debian/lintian-overrides", overrides / "ruedo")
    (packages / "ruedo.pth").write_text("/usr/lib/ruedo/python\n")
    for path in folder.rglob("*"):
        path.chmod(0o755 if path.is_dir() else 0o644)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
