"""Files that commands write: never over their input, and whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import UsageError

_LONGEST_STEM = 200  # of a name, which has 255 bytes at most
_MOST_LINKS = 40  # as in the kernel


def check_output(option: str, file: str, read: Iterable[str | os.PathLike[str]]) -> Path:
    """Before any work. read: the files that the command reads. Raises UsageError for one of them,
    OSError where no file can be.
    """
    path = Path(file)
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), file)
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), file)
    check_writable(path)
    for other in read:
        if path.exists() and os.path.exists(other) and path.samefile(other):
            raise UsageError(
                f"{option} {file} is one of the files that are read for this, which would be lost"
            )
    return path


def check_writable(path: Path) -> None:
    """Raises OSError if the file, or for a new file its folder, is not writable."""
    place = path if path.exists() else path.parent
    if not os.access(place, os.W_OK):
        read_only = os.statvfs(place).f_flag & os.ST_RDONLY
        code = errno.EROFS if read_only else errno.EACCES
        raise OSError(code, os.strerror(code), str(path))


@contextmanager
def replacing(file: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary file that takes the file's name at the end: when that fails, what was there
    before stays. Devices, FIFOs and open descriptors (/dev/stdout) are written to as they are.
    Raises OSError that names the file.
    """
    path = Path(file)
    descriptor = _descriptor_of(path)
    if descriptor is None and path.exists() and not path.is_file():
        yield path
        return
    target = Path(os.path.realpath(path))  # a symbolic link stays one
    in_place = descriptor is not None or (path.exists() and not os.access(target.parent, os.W_OK))
    folder = Path(tempfile.gettempdir()) if in_place else target.parent
    part = folder / f"{target.name[:_LONGEST_STEM]}.part{os.getpid()}"
    try:
        if path.exists() and not os.access(path, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        yield part
        if descriptor is not None:
            with part.open("rb") as whole, os.fdopen(os.dup(descriptor), "wb") as out:
                shutil.copyfileobj(whole, out)
        elif in_place:
            shutil.copyfile(part, target)
        else:
            _take_its_place(part, target)
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, os.strerror(error.errno), str(path)) from None
    finally:
        with suppress(OSError):
            part.unlink()


def _take_its_place(part: Path, target: Path) -> None:
    if target.exists():
        shutil.copymode(target, part)
    try:
        os.replace(part, target)
    except OSError as error:
        if error.errno != errno.EBUSY or not target.exists():  # busy: it is mounted by itself
            raise
        shutil.copyfile(part, target)


def _descriptor_of(path: Path) -> int | None:
    """The descriptor of this process that a path names, as /dev/stdout does."""
    descriptors = f"/proc/{os.getpid()}/fd"
    for _ in range(_MOST_LINKS):
        if not path.is_symlink():
            break
        folder = Path(os.path.realpath(path.parent))
        if str(folder) == descriptors:
            return int(path.name)
        path = folder / os.readlink(path)
    return None


def write_text(file: str | os.PathLike[str], text: str) -> None:
    """Writes a file in UTF-8. Raises OSError."""
    with replacing(file) as part:
        part.write_text(text, encoding="utf-8")
