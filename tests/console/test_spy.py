"""ruedo.jar makes lcm-spy decode every channel: its own database of types, of LCM's jar, finds and
reads each type.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import lcm
import pytest

SOURCE = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
JAR = BUILD / "java" / "ruedo.jar"
LCM_JAR = Path(lcm.__file__).resolve().parents[1] / "share" / "java" / "lcm.jar"
sys.path.insert(0, str(BUILD / "python"))

pytestmark = pytest.mark.skipif(
    not (shutil.which("java") and JAR.exists()), reason="needs a JDK, and ruedo.jar of the build"
)


def spied(messages):
    """{name: (class, bytes encoded again)} of {name: bytes}, as lcm-spy decodes them."""
    lines = "".join(f"{name} {data.hex()}\n" for name, data in messages.items())
    done = subprocess.run(
        ["java", "-cp", f"{JAR}:{LCM_JAR}", SOURCE / "tests/console/SpyTypes.java"],
        input=lines,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    found = [
        line.split() for line in done.stdout.splitlines() if line.startswith("= ")
    ]  # the database itself is talkative
    return {
        name: (kind, bytes.fromhex(data) if data != "-" else b"") for _, name, kind, data in found
    }


def test_lcm_spy_knows_every_type():
    import ruedo.lcmtypes as types

    names = sorted(path.stem for path in (SOURCE / "proto").glob("*.lcm"))
    assert len(names) > 40
    messages = {name: getattr(types, name)().encode() for name in names}
    found = spied(messages)
    assert found == {name: (name, messages[name]) for name in names}


def test_lcm_spy_decodes_every_channel_of_a_run(tmp_path):
    log = tmp_path / "run.lcm"
    subprocess.run(
        [
            BUILD / "bin" / "ruedo",
            "run",
            SOURCE / "worlds/arena.sdf",
            "--lcm",
            "memq://",
            "--quiet",
            "--rate",
            "max",
            "--duration",
            "1",
            "--record",
            log,
        ],
        check=True,
        timeout=120,
    )
    messages = {event.channel: event.data for event in lcm.EventLog(str(log))}
    assert len(messages) >= 10
    found = spied(messages)
    assert {name: data for name, (_, data) in found.items()} == messages
    assert found["p3at/lrf"][0] == "planar_lidar_t" and found["p3at/camera"][0] == "image_t"


def test_a_type_that_is_in_no_jar_is_not_found():
    assert spied({"stranger": bytes(range(16))}) == {"stranger": ("unknown", b"")}
