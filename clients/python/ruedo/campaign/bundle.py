"""The files of a campaign, packed for machines that have no part of its folder."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..decoding import decode
from ..logs import HEADER_CHANNEL
from .worlds import model_of

Bundle = dict[str, bytes]


def pack(folder: Path, files: Iterable[str]) -> Bundle:
    """The files that lie in the folder, by their path in it; others have to be
    everywhere.
    """
    inside = sorted({os.path.relpath(file, folder) for file in files if _is_inside(file, folder)})
    return {name: (folder / name).read_bytes() for name in inside}


def name_of(bundle: Bundle) -> str:
    """The name of a bundle: a hash of its content."""
    digest = hashlib.sha256()
    for name, content in sorted(bundle.items()):
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()[:16]


def unpack(bundle: Bundle, name: str) -> str:
    """The folder that holds it: made once on each machine, whole or not there."""
    base = Path(tempfile.gettempdir()) / f"ruedo-campaign-{os.getuid()}"
    base.mkdir(mode=0o700, exist_ok=True)
    if base.stat().st_uid != os.getuid():
        raise OSError(f"{base} belongs to another user")
    folder = base / name
    if folder.is_dir():
        return str(folder)
    part = Path(tempfile.mkdtemp(dir=base))
    for relative, content in bundle.items():
        file = part / relative
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
        file.chmod(0o755)
    try:
        part.rename(folder)
    except OSError:  # another worker was first
        if not folder.is_dir():
            raise
    return str(folder)


def moved(what: dict[str, Any], folder: str, to: str) -> dict[str, Any]:
    """A case whose world and robot lie in another folder now."""
    world, model = what["world"], model_of(what["world"]["spawn"])
    spawn = _moved_file(model, folder, to) + world["spawn"][len(model) :]
    return {
        **what,
        "world": {**world, "file": _moved_file(world["file"], folder, to), "spawn": spawn},
    }


def log_moved(log: bytes, folder: str, to: str) -> bytes:
    """A log whose header names files of one folder, as if it had been made with those of the
    other.
    """
    import lcm

    from ..lcmtypes import log_header_t

    if not log or folder == to:
        return log
    with tempfile.TemporaryDirectory() as scratch:
        old, new = os.path.join(scratch, "old"), os.path.join(scratch, "new")
        Path(old).write_bytes(log)
        written = lcm.EventLog(new, "w", overwrite=True)
        for event in lcm.EventLog(old, "r"):
            data = event.data
            if event.channel == HEADER_CHANNEL:
                header = decode(log_header_t, data)
                header.world_file = _moved_path(header.world_file, folder, to)
                for file in header.files:
                    file.path = _moved_path(file.path, folder, to)
                spawn = "--spawn="
                header.options = [
                    spawn + _moved_path(option.removeprefix(spawn), folder, to)
                    if option.startswith(spawn)
                    else option
                    for option in header.options
                ]
                data = header.encode()
            written.write_event(event.timestamp, event.channel, data)
        written.close()
        return Path(new).read_bytes()


def _moved_file(file: str, folder: str, to: str) -> str:
    if not _is_inside(file, Path(folder)):
        return file
    return os.path.join(to, os.path.relpath(file, folder))


def _moved_path(path: str, folder: str, to: str) -> str:
    return to + path[len(folder) :] if path.startswith(folder + "/") else path


def _is_inside(file: str, folder: Path) -> bool:
    return (
        os.path.isabs(file)
        and Path(file).is_file()
        and Path(os.path.realpath(file)).is_relative_to(os.path.realpath(folder))
    )
