"""Finished stages of a fit, kept in the user's cache: an interrupted fit continues."""

from __future__ import annotations

import hashlib
import os
import pickle
from collections.abc import Iterable
from pathlib import Path as File
from typing import Any

from .. import __version__


def cache_folder() -> File | None:
    """$XDG_CACHE_HOME/ruedo or ~/.cache/ruedo, as for meshes."""
    cache, home = os.environ.get("XDG_CACHE_HOME", ""), os.environ.get("HOME", "")
    if cache.startswith("/"):
        return File(cache) / "ruedo"
    return File(home) / ".cache/ruedo" if home.startswith("/") else None


class Kept:
    """What the stages of one fit found: by these files' bytes, these options and this code."""

    def __init__(self, files: Iterable[str | File], options: object):
        digest = hashlib.sha256(repr((__version__, options)).encode())
        for name in [*files, *sorted(File(__file__).parent.glob("*.py"))]:
            file = File(name)
            for one in sorted(file.rglob("*")) if file.is_dir() else [file]:
                if one.is_file():
                    with one.open("rb") as opened:
                        while chunk := opened.read(1 << 20):
                            digest.update(chunk)
        folder = cache_folder()
        self.file = folder / "fit" / f"{digest.hexdigest()}.stages" if folder else None

    def load(self) -> Any:
        """What save() got last, or None. A damaged file, or another user's, counts as none."""
        if self.file is None:
            return None
        try:
            if self.file.stat().st_uid != os.getuid():  # a pickle runs code
                return None
            return pickle.loads(self.file.read_bytes())
        except Exception:
            return None

    def save(self, value: Any) -> None:
        """At once or not at all; without a folder to write to, the fit is just not kept."""
        if self.file is None:
            return
        try:
            self.file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            part = self.file.with_suffix(f".{os.getpid()}")
            part.write_bytes(pickle.dumps(value))
            part.replace(self.file)
        except OSError:
            self.file = None

    def drop(self) -> None:
        if self.file is not None:
            self.file.unlink(missing_ok=True)
