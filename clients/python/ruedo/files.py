"""Files that others wrote: what is read of them goes through here.

A file is opened once and never waited for, so that a FIFO cannot stall the program, a device cannot
feed it for ever, and what was looked at is what is read. YAML is bounded by what it stands for, not
by how it is written.
"""

from __future__ import annotations

import errno
import functools
import hashlib
import os
import re
import stat
from typing import Any, BinaryIO

MOST_YAML_BYTES = 1 << 20
_MOST_BITS = 14_000  # of a number, which Python can print
MOST_YAML_VALUES = 100_000  # with each alias counted as its target


def open_regular(path: str | os.PathLike[str]) -> BinaryIO:
    """A regular file, to be read. Raises OSError."""
    file = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    if stat.S_ISREG(os.fstat(file).st_mode):
        return open(file, "rb")
    os.close(file)
    raise OSError(f"{os.fspath(path)}: it is not a regular file")


def open_lock(path: str | os.PathLike[str]) -> int:
    """The descriptor of a regular file to lock; creates the file if necessary. Raises OSError."""
    file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NONBLOCK | os.O_CLOEXEC, 0o666)
    if stat.S_ISREG(os.fstat(file).st_mode):
        return file
    os.close(file)
    raise OSError(errno.EINVAL, "it is not a regular file", os.fspath(path))


def read_bytes(path: str | os.PathLike[str], most: int) -> bytes:
    """Raises OSError, also for a file of more than `most` bytes."""
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > most:
            raise OSError(f"{os.fspath(path)}: it has {size} bytes; allowed are {most}")
        return file.read(most)


def sha256_of(path: str | os.PathLike[str]) -> str:
    """The hash of the file as `sha256sum` prints it. Raises OSError."""
    digest = hashlib.sha256()
    with open_regular(path) as file:
        while piece := file.read(1 << 20):
            digest.update(piece)
    return digest.hexdigest()


def parse_yaml(text: str) -> tuple[Any, Any]:
    """PyYAML's node, and the content. Raises yaml.YAMLError, also for what is nested too deep,
    stands for more than MOST_YAML_VALUES values, or is a number for YAML only.
    """
    import yaml

    loader = _with_exponents(yaml.SafeLoader)
    try:
        node = yaml.compose(text, Loader=loader)
        if node is not None and _values(node, {}) > MOST_YAML_VALUES:
            raise yaml.YAMLError(f"it stands for more than {MOST_YAML_VALUES} values")
        return node, yaml.load(text, Loader=loader)
    except RecursionError:
        raise yaml.YAMLError("it is nested too deep") from None
    except (ValueError, OverflowError) as error:  # a date or a number that there is not
        raise yaml.YAMLError(str(error)) from None


def dump_yaml(content: Any) -> str:
    """YAML text that parse_yaml() reads as the same value."""
    import yaml

    dumper = _with_exponents(yaml.SafeDumper)
    return str(yaml.dump(content, Dumper=dumper, sort_keys=False, allow_unicode=True))


@functools.cache
def _with_exponents(of: Any) -> Any:
    """A loader or dumper to which 1e9 and 2.5e3 are numbers, as in YAML 1.2; YAML 1.1 knows 2.5e+3
    alone.
    """
    made: Any = type(of.__name__, (of,), {})
    exponent = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+\Z")
    made.add_implicit_resolver("tag:yaml.org,2002:float", exponent, list("-+.0123456789"))
    return made


def _values(node: Any, known: dict[int, int]) -> int:
    """The number of values of a node and all below it, each counted once per alias."""
    import yaml

    if id(node) not in known:
        known[id(node)] = MOST_YAML_VALUES + 1  # one that contains itself has endless values
        inner: list[Any] = []
        if isinstance(node, yaml.ScalarNode):
            _check_number(node)
            _check_value(node)
        elif isinstance(node, yaml.MappingNode):
            inner = [part for pair in node.value for part in pair]
        elif isinstance(node, yaml.SequenceNode):
            inner = node.value
        known[id(node)] = 1 + sum(_values(part, known) for part in inner)
    return known[id(node)]


def _check_number(node: Any) -> None:
    """YAML 1.1 reads 010 as 8, and 1:30 as 90."""
    import yaml

    if node.tag in ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float") and (
        ":" in node.value or re.fullmatch(r"[-+]?0[0-9_]+", node.value)
    ):
        raise yaml.MarkedYAMLError(
            problem=f"{node.value} is not the number that it looks like: write it in the decimal "
            "system, without a 0 before it, or in quotes as a text",
            problem_mark=node.start_mark,
        )


def _check_value(node: Any) -> None:
    """Checks a tagged value, since a tag may contradict it: `!!bool maybe`."""
    import yaml

    try:
        value = yaml.constructor.SafeConstructor().construct_object(node)
    except yaml.YAMLError:  # an unknown tag, which is reported when all is read
        return
    except Exception:  # whatever a constructor stumbles over
        kind = node.tag.rpartition(":")[2]
        raise yaml.MarkedYAMLError(
            problem=f"{node.value[:40]!r} is not of type {kind}", problem_mark=node.start_mark
        ) from None
    if isinstance(value, int) and value.bit_length() > _MOST_BITS:
        raise yaml.MarkedYAMLError(
            problem="a number of thousands of digits", problem_mark=node.start_mark
        )
