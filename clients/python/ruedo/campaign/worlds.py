"""The worlds of a campaign: files and what they refer to, by content; and worlds that functions
make.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..engine import Engine
from ..files import read_bytes, sha256_of
from .errors import SpecError
from .functions import Function, own_state
from .processes import forks_end

# In time that grows with the text alone, whatever it is.
_URI = re.compile(r"<uri>([^<]+)</uri>|filename=[\"']([^\"']+)[\"']")
MOST_WORLD_BYTES = 64 << 20  # of a world's file


class WorldFiles:
    """folder: of the campaign's file. store: generated worlds go there, named by their content."""

    def __init__(self, folder: Path, store: Path) -> None:
        self._folder, self._store = folder, store
        self.allow_errors = False  # of worlds, as the campaign expects
        self._made: dict[str, str] = {}
        self._hashed: dict[tuple[str, str], str] = {}
        self._read: dict[tuple[Any, ...], str] = {}
        self._rest: dict[str, list[str]] = {}
        self._read_with: dict[tuple[str, str], list[str]] = {}
        self.files: dict[str, str] = {}  # all that were read, with their hashes

    def find(self, name: str) -> str:
        """A file beside the campaign's, or the name of a world that comes with Ruedo."""
        beside = self._folder / name
        return str(beside) if os.path.isfile(beside) else name

    def find_robot(self, spawn: str) -> str:
        """Likewise of a robot, MODEL[:NAME]@X,Y."""
        model = model_of(spawn)
        beside = self._folder / model
        return str(beside) + spawn[len(model) :] if os.path.isfile(beside) else spawn

    def generate(self, generator: Function, parameters: dict[str, Any]) -> str:
        """The file of the world that generator(**parameters) makes: SDF as text, or a
        ruedo.World.
        """
        key = f"{generator.sha256}{generator.name}{sorted(parameters.items())!r}"
        if key not in self._made:
            try:
                with own_state(), forks_end():
                    text = str(generator.load()(**parameters))
            except (Exception, SystemExit) as error:
                raise ValueError(
                    f"{generator.name}({_arguments(parameters)}) raised {type(error).__name__}: {error}"
                ) from None
            if "<sdf" not in text and "<robot" not in text:
                raise ValueError(
                    f"{generator.name}({_arguments(parameters)}) made no world, but {text[:60]!r}"
                )
            self._made[key] = str(keep_text(text, self._store))
        return self._made[key]

    def sha256(self, world: str, spawn: str) -> str:
        """The hash of the world's file and of all files that it and the spawned model read.

        Worlds that refer to the same files are read once: what is not in the text does not change.
        """
        model = model_of(spawn)
        known = self._hashed.get((world, model))
        if known:
            return known
        own = ""
        if os.path.isfile(world):
            text = read_bytes(world, MOST_WORLD_BYTES)
            own = hashlib.sha256(text).hexdigest()
            named = _URI.findall(text.decode(errors="replace"))
            uris = tuple(sorted({a.strip() or b for a, b in named}))
            key: tuple[Any, ...] = (os.path.dirname(os.path.abspath(world)), uris, model)
        else:
            key = (world, model)
        if key not in self._read:
            spawned = [spawn] if spawn else []
            with Engine(world, spawn=spawned, allow_errors=self.allow_errors) as engine:
                read = engine.files_read
            rest = [file for file in read if not _same(file, world)]
            digest = hashlib.sha256()
            for file in rest:
                self.files[file] = sha256_of(file)
                digest.update(bytes.fromhex(self.files[file]))
            self._read[key] = digest.hexdigest()
            self._rest[self._read[key]] = rest
        if own:
            self.files[os.path.abspath(world)] = own
        self._hashed[(world, model)] = hashlib.sha256((own + self._read[key]).encode()).hexdigest()
        self._read_with[(world, model)] = self._rest[self._read[key]]
        return self._hashed[(world, model)]

    def read_with(self, world: str, spawn: str) -> list[str]:
        """The other files that it was read from, and where Ruedo's own is only named, that one
        first.
        """
        self.sha256(world, spawn)
        return self._read_with[(world, model_of(spawn))]


def model_of(spawn: str) -> str:
    """The model of an argument of --spawn: `model://robot` has a colon, too."""
    model = spawn.rpartition("@")[0]
    before, colon, name = model.rpartition(":")
    return before if colon and "/" not in name else model


def beside(world: str, files: list[str], folder: Path) -> tuple[Path, dict[str, Path]]:
    """Of the files that a world and its robot refer to, those that have to go with them to another
    place: where each of them is then, seen from there, and where the world's own folder is. Others,
    such as Ruedo's own, are found from everywhere.
    """
    root = Path(os.path.realpath(folder))
    home = Path(os.path.realpath(world)).parent if os.path.isfile(world) else root
    real = {file: Path(os.path.realpath(file)) for file in files}
    own = {
        file: path
        for file, path in real.items()
        if path.is_relative_to(home) or path.is_relative_to(root)
    }
    base = Path(os.path.commonpath([home, *(path.parent for path in own.values())]))
    return home.relative_to(base), {file: path.relative_to(base) for file, path in own.items()}


def copy_beside(places: dict[str, Path], folder: Path) -> None:
    for file, place in places.items():
        to = folder / place
        if not to.exists():
            to.parent.mkdir(parents=True, exist_ok=True)
            part = to.with_name(f".{to.name}.{os.getpid()}")
            shutil.copyfile(file, part)
            part.rename(to)


def changed(
    world: dict[str, Any],
    files: list[str],
    folder: Path,
    store: Path,
    change: Callable[[bytes], bytes],
) -> Path:
    """A case's world with another text, beside copies of the files that it refers to. Raises
    SpecError for a text that cannot be changed so.
    """
    file = world["file"] if os.path.isfile(world["file"]) else files[0]
    home, places = beside(world["file"], files, folder)
    store = store / world["sha256"][:16] if places else store
    copy_beside(places, store)
    try:
        text = change(read_bytes(file, MOST_WORLD_BYTES))
    except (ValueError, OSError) as error:
        raise SpecError(f"{file}: {error}") from None
    return keep_text(text, store / home)


def keep_text(text: str | bytes, store: Path) -> Path:
    """A file of that text in the folder, named by its content; whole or not there."""
    content = text.encode() if isinstance(text, str) else text
    ending = ".sdf" if b"<sdf" in content else ".urdf"
    name = hashlib.sha256(content).hexdigest()[:16] + ending
    file = store / name
    if not file.exists():
        store.mkdir(parents=True, exist_ok=True)
        part = store / f".{name}.{os.getpid()}"
        part.write_bytes(content)
        part.rename(file)
    return file.resolve()


def _same(a: str, b: str) -> bool:
    return os.path.realpath(a) == os.path.realpath(b)


def _arguments(parameters: dict[str, Any]) -> str:
    return ", ".join(f"{name}={value!r}" for name, value in parameters.items())
