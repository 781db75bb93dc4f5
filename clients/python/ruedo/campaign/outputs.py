"""What commands write: never over what they read, and whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import UsageError

_LONGEST_STEM = 200  # of a name, which has 255 bytes at most


def check_output(option: str, file: str, read: Iterable[str | os.PathLike[str]]) -> Path:
    """Before any work. read: the files that the command reads. Raises UsageError for one of them,
    OSError where no file can be.
    """
    path = Path(file)
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), file)
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), file)
    for other in read:
        if path.exists() and os.path.exists(other) and path.samefile(other):
            raise UsageError(
                f"{option} {file} is one of the files that are read for this, which would be lost"
            )
    return path


@contextmanager
def replacing(file: str | os.PathLike[str]) -> Iterator[Path]:
    """Where to write what takes the file's name at the end: when that fails, what was there before
    stays. Devices and FIFOs are written to as they are. Raises OSError that names the file.
    """
    path = Path(file)
    if path.exists() and not path.is_file():
        yield path
        return
    target = Path(os.path.realpath(path))  # a symbolic link stays one
    part = target.with_name(f"{target.name[:_LONGEST_STEM]}.part{os.getpid()}")
    try:
        if path.exists() and not os.access(path, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        yield part
        if path.exists():
            shutil.copymode(path, part)
        os.replace(part, target)
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, os.strerror(error.errno), str(path)) from None
    finally:
        with suppress(OSError):
            part.unlink()


def write_text(file: str | os.PathLike[str], text: str) -> None:
    """As UTF-8. Raises OSError."""
    with replacing(file) as part:
        part.write_text(text, encoding="utf-8")
