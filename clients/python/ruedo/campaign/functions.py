"""Functions that a campaign names: "FILE.py:NAME" beside its file, or "package.module:NAME"."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import os
import sys
from pathlib import Path
from typing import Any


class Function:
    """A function or class, its name, and the hash of the file that it stands in.

    Modules that the file imports are not in the hash: name them in the controller's `files`.
    """

    def __init__(self, name: str, folder: Path) -> None:
        self.name = name
        module, colon, attribute = name.partition(":")
        if not colon or not module or not attribute.isidentifier():
            raise ValueError(f"is {name!r}; it looks like FILE.py:NAME or MODULE:NAME")
        self.file = folder / module if module.endswith(".py") else _file_of(module, folder)
        if not os.path.isfile(self.file):
            raise ValueError(f"is {name!r}, and there is no file {self.file}")
        self._attribute = attribute
        self.sha256 = hashlib.sha256(self.file.read_bytes()).hexdigest()

    def load(self) -> Any:
        """The object. Raises what its module raises, ValueError when it has none of that name."""
        module = load_file(self.file, self.sha256)
        if not hasattr(module, self._attribute):
            raise ValueError(f"{self.file} has no {self._attribute}")
        return getattr(module, self._attribute)


def load_file(file: Path, sha256: str) -> Any:
    """The module of a file, read once for one content; its folder is where it imports from."""
    name = f"ruedo_campaign_{sha256[:16]}_{file.stem}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ValueError(f"{file} is no Python file")
    if str(file.parent) not in sys.path:
        sys.path.insert(0, str(file.parent))
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _file_of(module: str, folder: Path) -> Path:
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    try:
        spec = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        spec = None
    if spec is None or spec.origin is None:
        raise ValueError(f"names the module {module!r}, which Python does not find")
    return Path(spec.origin)
