"""Logs and snapshots on both families of processors: aarch64, in an emulator, records the messages
that x86-64 records, and each verifies the log of the other, and goes on from its snapshot.
"""

import os
import subprocess
from pathlib import Path

import lcm
import pytest
import ruedo
from programs import needs_arm64, program

HERE = Path(__file__).resolve().parent
FAMILIES = ["native", "aarch64"]
# Name: world without pictures, which differ, and a second of it or less.
WORLDS = {
    "arena": ["arena", "--disable", "p3at/camera", "--duration", "1"],
    "wheels": [str(HERE / "wheels.sdf"), "--disable", "four/camera", "--duration", "1"],
    "arms": [str(HERE / "arms.sdf"), "--duration", "1"],
    "meshes": ["office", "--disable", "p3at/camera", "--duration", "0.2"],
}
QUICK = ["--rate", "max", "--seed", "7", "--quiet", "--lcm", "memq://"]
pytestmark = needs_arm64


def ruedo_on(family, *words):
    return subprocess.run(
        [*program("bin/ruedo", family), *map(str, words)], capture_output=True, text=True
    )


def messages(log):
    """Without the header, which says on what machine it was recorded."""
    found = lcm.EventLog(str(log), "r")
    all_of_them = [(event.timestamp, event.channel, event.data) for event in found]
    found.close()
    assert all_of_them[0][1] == "ruedo/header"
    return all_of_them[1:]


@pytest.mark.parametrize("name", WORLDS)
def test_the_same_log_which_each_verifies_of_the_other(name, tmp_path):
    logs = {family: tmp_path / f"{family}.lcm" for family in FAMILIES}
    for family, log in logs.items():
        result = ruedo_on(family, "run", *WORLDS[name], *QUICK, "--record", log)
        assert result.returncode == 0, result.stderr
    assert messages(logs["aarch64"]) == messages(logs["native"])
    for family, log in logs.items():
        other = next(one for one in FAMILIES if one != family)
        result = ruedo_on(other, "verify", log)
        assert result.returncode == 0, result.stdout + result.stderr
        assert "byte for byte" in result.stdout and "aarch64" in result.stdout


@pytest.mark.parametrize("family", FAMILIES)
def test_a_snapshot_goes_on_where_it_was_saved_on_the_other(family, tmp_path, monkeypatch):
    server = tmp_path / "ruedo"
    server.write_text(f'#!/bin/sh\nexec {" ".join(program("bin/ruedo", family))} "$@"\n')
    server.chmod(0o755)
    monkeypatch.setenv("RUEDO", os.fspath(server))
    world = ["arena", "--disable", "p3at/camera"]
    with ruedo.launch(
        "arena", seed=7, rate="max", paused=True, disable=["p3at/camera"], snapshots=tmp_path,
        record=tmp_path / "whole.lcm", timeout=120,
    ) as simulation:  # fmt: skip
        simulation.step(50)
        simulation.snapshot("half")
        simulation.step(50)
    whole = messages(tmp_path / "whole.lcm")
    for other in FAMILIES:
        log = tmp_path / f"{other}.lcm"
        words = ["--restore", tmp_path / "half.snapshot", "--duration", "1", "--record", log]
        result = ruedo_on(other, "run", *world, *QUICK, *words)
        assert result.returncode == 0, result.stderr
        sensors = [one for one in messages(log) if one[1].startswith("p3at/")]
        expected = [one for one in whole if one[1].startswith("p3at/")]
        shorter = min(len(sensors), len(expected))
        assert shorter > 100 and sensors[:shorter] == expected[:shorter]
