"""Adds what is generated from ../../proto (message types, samples) and the version to what is
built. The rest is in pyproject.toml.
"""

import runpy
import sys
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = Path(__file__).resolve().parent
PROTO = HERE.parent.parent / "proto"
sys.path.insert(0, str(HERE))

from generate_types import generate, read_version


class BuildWithTypes(build_py):
    def run(self):
        super().run()
        if PROTO.is_dir():  # else: built from an sdist, which brings the types along
            generate(PROTO, HERE if getattr(self, "editable_mode", False) else Path(self.build_lib))


class SdistWithTypes(sdist):
    def run(self):
        generate(PROTO, HERE)
        super().run()


# With proto/ at hand the build makes the types; from an sdist they are a package like any other.
packages = [
    f"ruedo{part}" for part in ("", ".campaign", ".fit", ".gym", ".hunt", ".session", ".transport")
] + ([] if PROTO.is_dir() else ["ruedo.lcmtypes"])
version = (
    read_version(PROTO)
    if PROTO.is_dir()
    else runpy.run_path(str(HERE / "ruedo/_version.py"))["__version__"]
)
setup(
    version=version,
    packages=packages,
    cmdclass={"build_py": BuildWithTypes, "sdist": SdistWithTypes},
)
