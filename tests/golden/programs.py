"""Ruedo's programs of the two families of processors: this machine's own build and that of the
preset arm64, which runs in qemu's emulation.
"""

import os
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2]
ARM64 = SOURCE / "build/arm64"
ON_ARM64 = SOURCE / "scripts/on_arm64"
needs_arm64 = pytest.mark.skipif(
    not (ARM64 / "bin/ruedo").exists(), reason="build/arm64 is not there (docs/platforms.md, ARM)"
)


def program(name: str, processor: str) -> list[str]:
    """The words that run a program of the build on a processor: "native", "aarch64", or one of
    `qemu-x86_64 -cpu help`.
    """
    if processor == "aarch64":
        return [str(ON_ARM64), str(ARM64 / name)]
    native = str(Path(os.environ["RUEDO_BINARY_DIR"]) / name)
    return [native] if processor == "native" else ["qemu-x86_64", "-cpu", processor, native]
