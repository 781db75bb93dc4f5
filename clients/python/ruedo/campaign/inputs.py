"""What a controller may read beside the file that a campaign names: every file in its folder counts
when it is asked whether a result still stands for it, but for what Ruedo itself writes there.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
from collections.abc import Iterator
from pathlib import Path

from ..files import parse_yaml, read_bytes, sha256_of

# Programs and settings. Of other files it is not known whether cases read or write them.
_READ = re.compile(
    r".*\.(py[cx]?|so|sh|bash|m?js|lua|rb|pl|m|jl|c|cc|cpp|cxx|h|hh|hpp|java|class|jar"
    r"|json|ya?ml|toml|ini|cfg|conf|csv|npy|npz|mat|pkl|pickle|h5|hdf5|pth?|onnx|tflite|safetensors|pgm)",
    re.IGNORECASE,
)
_WRITTEN = (".lcm", ".html")  # logs, pages
FIGURE_TITLE = "drawn by ruedo why"  # in its files
_FIGURES = (".svg", ".png", ".pdf")
_JUNIT = re.compile(rb"(<\?xml[^>]*>)?\s*<testsuite")
_MOST_FILES, _MOST_LOOKED_AT, _MOST_BYTES = 2000, 50_000, 256 << 20
_TABLE = b"number,id,world,robot,controller,seed,"  # as `ruedo campaign export` begins
_MOST_MARK_BYTES = 1 << 16  # of a figure's head, and of Parquet's footer with the names of columns
_MOST_SPEC_BYTES = 1 << 20


class Folders:
    """Files and their hashes, each read once. out: the campaign's results, which never count."""

    def __init__(self, out: Path) -> None:
        self._out = os.path.realpath(out)
        self._known: dict[str, dict[str, str]] = {}
        self._outputs: set[str] = set()

    def leave_out(self, outputs: set[str]) -> None:
        """Files that cases have written, by their real paths."""
        self._outputs = outputs

    def written_since(self) -> set[str]:
        """The files that have come or changed since below() read their folders, without programs
        and settings: cases may have written them.
        """
        again = Folders(Path(self._out))
        again.leave_out(self._outputs)
        written = set()
        for place, before in self._known.items():
            # The next plan reads this folder again, and reports what it cannot read.
            with contextlib.suppress(ValueError, OSError):
                now = again.below(Path(place))
                written |= {
                    os.path.join(place, name)
                    for name in now
                    if now[name] != before.get(name) and not is_read(name)
                }
        return written

    def below(self, folder: Path) -> dict[str, str]:
        """The files below a folder that count, by their path in it, with their hashes. Raises
        ValueError for more of them than anybody's controller has, OSError.
        """
        place = os.path.realpath(folder)
        if place not in self._known:
            found: dict[str, str] = {}
            size = 0
            for file in self._files(place):
                size += os.path.getsize(file)
                if len(found) == _MOST_FILES or size > _MOST_BYTES:
                    raise _too_many(folder)
                found[os.path.relpath(file, place)] = sha256_of(file)
            self._known[place] = found
        return self._known[place]

    def _files(self, folder: str) -> Iterator[str]:
        seen: set[str] = set()
        looked_at = 0
        for place, folders, files in os.walk(folder, followlinks=True):
            looked_at += len(folders) + len(files)
            if looked_at > _MOST_LOOKED_AT:
                raise _too_many(Path(folder))
            real = os.path.realpath(place)
            if real in seen or real == self._out or "results.sqlite" in files:
                folders.clear()
                continue
            seen.add(real)
            folders[:] = sorted(one for one in folders if not _is_passed_over(one))
            for name in sorted(files):
                file = os.path.join(place, name)
                if name.startswith(".") or file in self._outputs or not os.path.isfile(file):
                    continue
                if not _is_written(file):
                    yield file


def hash_of(files: dict[str, str]) -> str:
    """One hash of all these files and their names."""
    return hashlib.sha256(repr(sorted(files.items())).encode(errors="backslashreplace")).hexdigest()


def is_read(file: str) -> bool:
    """Whether the file is an input by its name: a program or settings, which cases do not write."""
    return _READ.fullmatch(os.path.basename(file)) is not None


def _is_passed_over(folder: str) -> bool:
    return folder.startswith(".") or folder == "__pycache__" or ".campaign" in folder


def _is_written(file: str) -> bool:
    """Whether Ruedo wrote it, or it is a campaign: neither is an input of another campaign."""
    _, kind = os.path.splitext(file)
    if kind in (".yaml", ".yml"):
        return _is_campaign(file)
    if kind == ".pyc":  # Python prefers the source
        return os.path.isfile(file[:-1])
    if kind not in (".csv", ".parquet", ".xml", *_FIGURES):
        return kind in _WRITTEN
    with open(file, "rb") as one:
        if kind in _FIGURES:
            head = one.read(_MOST_MARK_BYTES)
            one.seek(max(0, os.path.getsize(file) - _MOST_MARK_BYTES))
            return FIGURE_TITLE.encode() in head + one.read()
        if kind == ".xml":
            return _JUNIT.match(one.read(200)) is not None
        if kind == ".csv":
            return one.read(len(_TABLE)) == _TABLE
        one.seek(max(0, os.path.getsize(file) - _MOST_MARK_BYTES))
        footer = one.read()
    return all(name in footer for name in _TABLE.strip(b",").split(b","))


def _is_campaign(file: str) -> bool:
    """A campaign's file is part of the ids of its own cases, not of another campaign's."""
    import yaml

    try:
        _, content = parse_yaml(read_bytes(file, _MOST_SPEC_BYTES).decode())
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return False
    return isinstance(content, dict) and {"worlds", "controllers", "limits"} <= set(content)


def _too_many(folder: Path) -> ValueError:
    return ValueError(
        f"has more in its folder {folder} than can be looked through ({_MOST_FILES} files, "
        f"{_MOST_BYTES >> 20} MB): name the files that belong to it in `files`"
    )
