"""Functions that a campaign names: "FILE.py:NAME" beside its file, or "package.module:NAME"."""

from __future__ import annotations

import hashlib
import importlib.machinery
import importlib.util
import os
import sys
import sysconfig
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from ..files import read_bytes

_MOST_BYTES = 16 << 20  # of a file
_PACKAGES = {"site-packages", "dist-packages"}  # folders in which packages are installed
_INSTALLED = (sysconfig.get_path("stdlib"), str(Path(__file__).resolve().parents[1]))


class Function:
    """A function or class, its name, and the hash of the file that it stands in.

    Modules that the file imports are not in the hash, but in that of its folder (inputs.py).
    """

    def __init__(self, name: str, folder: Path) -> None:
        self.name = name
        module, colon, attribute = name.partition(":")
        if not colon or not module or not attribute.isidentifier():
            raise ValueError(f"is {name!r}; it looks like FILE.py:NAME or MODULE:NAME")
        is_file = module.endswith(".py")
        self.file = folder / module if is_file else _file_of(module, folder)
        if not os.path.isfile(self.file):
            raise ValueError(f"is {name!r}, but there is no file {self.file}")
        self._imports_from = [str(self.file.parent), *([] if is_file else [str(folder)])]
        self._attribute = attribute
        try:
            self._source = read_bytes(self.file, _MOST_BYTES)
        except OSError as error:
            raise ValueError(f"is {name!r}, which cannot be read: {error}") from None
        self.sha256 = hashlib.sha256(self._source).hexdigest()

    @property
    def is_installed(self) -> bool:
        """Whether it is in a package: files beside it are not the campaign's."""
        return _is_packaged(str(self.file))

    def load(self) -> Any:
        """The object, of the text that was hashed. Raises what its module raises, ValueError when
        it has none of that name.
        """
        sys.path[:0] = [one for one in self._imports_from if one not in sys.path]
        module = self._module()
        if not hasattr(module, self._attribute):
            raise ValueError(f"{self.file} has no {self._attribute}")
        return getattr(module, self._attribute)

    def _module(self) -> ModuleType:
        """Read once within own_state()."""
        digest = hashlib.sha256(os.fsencode(self.file) + self._source).hexdigest()[:16]
        name = f"ruedo_campaign_{digest}_{self.file.stem}"
        if name in sys.modules:
            return sys.modules[name]
        spec = importlib.util.spec_from_file_location(name, self.file)
        if spec is None or not isinstance(spec.loader, importlib.machinery.SourceFileLoader):
            raise ValueError(f"{self.file} is not a Python file")
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        try:
            exec(spec.loader.source_to_code(self._source, str(self.file)), module.__dict__)
        except BaseException:
            sys.modules.pop(name, None)
            raise
        return module


@contextmanager
def own_state() -> Iterator[None]:
    """What users' functions import within, and what they leave in it, is forgotten at the end, and
    so are the folder and the environment that they changed: a run sees nothing of another one, nor
    its modules of the same names.
    """
    before, path, places = set(sys.modules), sys.path, list(sys.path)
    environment, here = dict(os.environ), os.open(".", os.O_RDONLY | os.O_CLOEXEC)
    try:
        yield
    finally:
        os.fchdir(here)
        os.close(here)
        if os.environ != environment:
            os.environ.clear()
            os.environ.update(environment)
        sys.path, path[:] = path, places
        for name in _of_users(set(sys.modules) - before):
            del sys.modules[name]


def _of_users(names: set[str]) -> set[str]:
    """Packages that are installed stay, and those with libraries, which Python loads once."""
    stay = {name.partition(".")[0] for name in names if _is_installed(sys.modules[name])}
    return {name for name in names if name.partition(".")[0] not in stay}


def _is_installed(module: Any) -> bool:
    spec = getattr(module, "__spec__", None)
    if isinstance(getattr(spec, "loader", None), importlib.machinery.ExtensionFileLoader):
        return True
    file = getattr(module, "__file__", None) or next(iter(getattr(module, "__path__", ())), None)
    if not isinstance(file, str):
        return True  # built in
    return _is_packaged(file)


def _is_packaged(file: str) -> bool:
    return bool(_PACKAGES & set(Path(file).parts)) or file.startswith(
        tuple(one + os.sep for one in _INSTALLED)
    )


def _file_of(module: str, folder: Path) -> Path:
    """The file of a module, without importing it: its package may do anything."""
    first, *rest = module.split(".")
    try:
        find = importlib.machinery.PathFinder.find_spec
        spec = find(first, [str(folder)]) or importlib.util.find_spec(first)
        for i in range(2, len(rest) + 2):
            inside = spec.submodule_search_locations if spec else None
            spec = find(".".join([first, *rest][:i]), inside) if inside else None
    except (ImportError, ValueError):
        spec = None
    if spec is None or spec.origin is None:
        raise ValueError(f"names the module {module!r}, which Python does not find")
    return Path(spec.origin)
