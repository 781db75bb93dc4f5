"""What others wrote of a release (parts.toml), and what of it is on this machine."""

import functools
import json
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import tomllib

TABLE = tomllib.loads(Path(__file__).with_name("parts.toml").read_text(encoding="utf-8"))
COMPILED = TABLE["compiled"]["debian"]
COMPILED_PYPI = TABLE["compiled"]["pypi"]
SITE = TABLE["site"]["pypi"]  # of which style, scripts and icons are in the documentation's wheel
# Of each C and C++ program: GCC's runtime exception and the C library's headers ask for nothing.
OF_EACH_PROGRAM = {"gcc", "glibc", "linux"}


def without_version(source: str) -> str:
    """llvm-toolchain-15 and llvm-toolchain-19 are one part."""
    return re.sub(r"-\d+(\.\d+)*$", "", source)


@functools.cache
def installed() -> dict[str, tuple[str, str]]:
    """{binary package: (source package without a version at its end, version)}, of Debian's."""
    lines = subprocess.run(
        ["dpkg-query", "-W", "-f=${Package}\t${source:Package}\t${source:Version}\n"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    words = (line.split("\t") for line in lines)
    return {name: (without_version(source), version) for name, source, version in words}


def packages_of(source: str) -> list[str]:
    """The binary packages here that are made from it."""
    return sorted(name for name, (of, _) in installed().items() if of == source)


def owners(files: Iterable[Path]) -> set[str]:
    """The binary packages that own files."""
    words = ["dpkg", "-S", *sorted(str(file) for file in files)]
    lines = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return {line.split(":")[0] for line in lines.stdout.splitlines()}


def licence_of(package: str) -> str:
    """Of one of Debian's binary packages. Raises KeyError if the table lacks it."""
    source, _ = installed()[package]
    return COMPILED[source][2] if source in COMPILED else TABLE["shared"][source]


def of_npm(build: Path) -> list[tuple[Path, str, str, str]]:
    """(folder, name, version, licence) of each package in the web console's page."""
    lock = build / "web/package-lock.json"
    if not lock.is_file():
        return []
    packages = json.loads(lock.read_text(encoding="utf-8"))["packages"]
    return [
        (
            build / "web" / folder,
            folder.removeprefix("node_modules/"),
            about["version"],
            about["license"],
        )
        for folder, about in packages.items()
        if folder and not about.get("dev")
    ]


def read_by(build: Path) -> tuple[set[str], set[str]]:
    """The source packages of Debian and the packages of PyPI whose files a build has compiled or
    linked into what is installed: what Ninja knows of headers, and the archives in its rules.
    """
    ninja = ["ninja", "-C", str(build), "-t", "deps"]
    files, of_ours = set(), False
    for line in subprocess.run(
        ninja, capture_output=True, text=True, check=True
    ).stdout.splitlines():
        if line and not line.startswith(" "):
            of_ours = not line.startswith(("tests/", "benchmarks/"))
        elif of_ours and line.strip():
            files.add((build / line.strip()).resolve())
    rules = (build / "build.ninja").read_text(encoding="utf-8")
    for rule in re.findall(r"^build (?!tests/|benchmarks/).*(?:\n  .*)*", rules, re.MULTILINE):
        files |= {Path(name).resolve() for name in re.findall(r"(?<!\S)/\S+\.a(?!\S)", rule)}
    sources = {
        installed()[name][0] for name in owners(f for f in files if f.is_relative_to("/usr"))
    }
    packages = {
        match.group(1)  # LCM's headers are in site-packages/include/lcm
        for file in files
        if (match := re.search(r"/site-packages/(?:include/)?(\w+)/", str(file)))
    }
    return sources - OF_EACH_PROGRAM, packages


def licences_of_python(package: str) -> list[Path]:
    """The files that a package of this virtual environment brings along."""
    found = Path(sys.prefix).glob(f"lib/python3*/site-packages/{package}-*.dist-info/licenses/**/*")
    return sorted(path for path in found if path.is_file())
