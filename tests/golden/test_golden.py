"""The runs of golden_runs.cpp make the bytes that are kept in hashes.txt: on this processor with
one thread and with two, or on the emulated one that RUEDO_PROCESSOR names (aarch64, or one of
`qemu-x86_64 -cpu help`) with two.
"""

import os
import subprocess
from pathlib import Path

import pytest
from programs import needs_arm64, program

HERE = Path(__file__).resolve().parent
EXPECTED = dict(
    line.split() for line in (HERE / "hashes.txt").read_text(encoding="ascii").splitlines()
)
PROCESSOR = os.environ["RUEDO_PROCESSOR"]
THREADS = [1, 2] if PROCESSOR == "native" else [2]
COMMAND = program("tests/golden/golden_runs", PROCESSOR)
if PROCESSOR == "aarch64":
    pytestmark = needs_arm64


@pytest.mark.parametrize("threads", THREADS)
@pytest.mark.parametrize("name", EXPECTED)
def test_same_bytes(name, threads):
    words = [*COMMAND, "--threads", str(threads), name]
    result = subprocess.run(words, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert result.stdout.split() == [name, EXPECTED[name]], (
        f"{name} on {PROCESSOR}; if results changed on purpose: target renew-golden-hashes"
    )
