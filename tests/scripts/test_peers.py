"""Benchmarks beside programs that somebody has built. Stand-ins take their options and worlds, and
write what these write.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks/peers"))
import gz_rooms
import mvsim_rooms
import programs
import rooms

WALL = rooms.Box((3.0, 0.0, 0.5), (0.2, 6.0, 1.0))
ROOMS = rooms.Rooms([WALL], [rooms.Start(1.0, 0.0, 1.57), rooms.Start(1.0, 6.0, 1.57)])

# Records two scans a robot.
GZ = """
import sqlite3, sys, xml.etree.ElementTree as ET
from pathlib import Path
words = sys.argv[1:]
if words == ["sim", "--version"]:
    sys.exit(print("Gazebo Sim, version 11.0.0"))
value = lambda name: words[words.index(name) + 1]
assert words[:3] == ["sim", "-s", "-r"] and value("--iterations") == "40", words
world = ET.parse(words[-1]).getroot().find("world")
lidars = [one.findtext("topic") for one in world.iter("sensor")]
assert len(lidars) == 2 and len(list(world.iter("collision"))) == 4
assert float(world.findtext("physics/real_time_factor")) == 0.0
assert float(world.findtext("physics/max_step_size")) == 0.005
log = Path(value("--record-path"))
log.mkdir()
base = sqlite3.connect(log / "state.tlog")
base.executescript("CREATE TABLE topics (id INTEGER PRIMARY KEY, name TEXT, message_type_id);"
    "CREATE TABLE messages (id INTEGER PRIMARY KEY, time_recv INTEGER, topic_id, message BLOB);")
for i, name in enumerate(lidars):
    base.execute("INSERT INTO topics VALUES (?, ?, 1)", (i, f"/{name}"))
    base.executemany("INSERT INTO messages VALUES (NULL, 0, ?, '')", [(i,)] * SCANS)
base.commit()
"""
# Simulates three seconds, and ends at SIGINT.
MVSIM = """
import os, re, signal, sys
words = sys.argv[1:]
if words == ["--version"]:
    sys.exit(print("mvsim v0.14.2"))
assert words[0] == "launch" and "--headless" in words, words
world = open(words[1]).read()
assert re.findall('<vehicle name="(.*?)"', world) == ["r0", "r1"]
assert world.count("<block ") == 1 and "<simul_timestep>0.01</simul_timestep>" in world
signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
with open("unseen.txt", "w") as truth:
    for step in range(301):
        truth.write(f"{1e6 + 0.01 * step:f} 0 0 0 0 0 0 1\\n")
    truth.write("1000009.0")  # a line that is not whole
os.rename("unseen.txt", "truth.r0.txt")
signal.pause()
"""


def program(folder: Path, text: str) -> str:
    file = folder / "program"
    file.write_text(f"#!{sys.executable}\n{text}")
    file.chmod(0o755)
    return str(file)


def test_gz_sim_takes_its_steps_and_scans(tmp_path: Path) -> None:
    path = program(tmp_path, GZ.replace("SCANS", "2"))
    run = gz_rooms.run(path, ROOMS, str(tmp_path), 0.2)
    assert run.sim_s == pytest.approx(0.2, abs=1e-12) and run.wall_s > 0.0 and run.cpu_s > 0.0
    assert gz_rooms.version(path) == "11.0.0"


def test_gz_sim_without_scans_is_refused(tmp_path: Path) -> None:
    path = program(tmp_path, GZ.replace("SCANS", "0"))
    with pytest.raises(ValueError, match="0 of 4 scans were taken: is there a lidar without a GPU"):
        gz_rooms.run(path, ROOMS, str(tmp_path), 0.2)


def test_mvsim_has_simulated_what_its_true_paths_say(tmp_path: Path) -> None:
    path = program(tmp_path, MVSIM)
    run = mvsim_rooms.run(path, ROOMS, str(tmp_path), 0.0)
    assert run.sim_s == pytest.approx(3.0, abs=1e-9) and run.cpu_s > 0.0
    assert mvsim_rooms.version(path) == "0.14.2"


@pytest.mark.parametrize("peer", [gz_rooms, mvsim_rooms])
def test_a_program_that_fails_says_why(peer, tmp_path: Path) -> None:
    path = program(tmp_path, "raise SystemExit('no such plugin')")
    with pytest.raises(ValueError, match="no such plugin"):
        peer.run(path, ROOMS, str(tmp_path), 0.2)


WORLD = """<sdf><world name="rooms"><include><uri>model://p3at</uri><pose>1 0 0 0 0 1.57</pose></include>
</world></sdf>"""


@pytest.mark.parametrize("long_s", [14.0, 4.0])
def test_a_row_is_the_longer_run_without_the_shorter(
    long_s: float,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Loading takes 3 s, and 2 s of CPU time; a second of sim time 0.25 s and 0.5 s."""
    world = tmp_path / "rooms.sdf"
    world.write_text(WORLD)
    monkeypatch.setattr(sys, "argv", ["peer", str(world), "--program", "x", "--duration", "10"])
    asked = []

    def run(_program, its_rooms, _folder, seconds):
        assert len(its_rooms.starts) == 1
        asked.append(seconds)
        sim_s = 4.0 if len(asked) == 1 else long_s
        return programs.Run(sim_s, 3.0 + 0.25 * sim_s, 2.0 + 0.5 * sim_s)

    if long_s <= 4.0:
        with pytest.raises(SystemExit, match="a longer run did not simulate more"):
            programs.main("peer", 0.005, run, lambda _: "1.0.0")
        return
    programs.main("peer", 0.005, run, lambda _: "1.0.0")
    row = json.loads(capsys.readouterr().out)
    assert asked == [2.0, 12.0]
    assert row["simulator"] == "peer 1.0.0" and row["robots"] == 1 and row["step_ms"] == 5.0
    assert row["real_time_factor"] == pytest.approx(4.0)
    assert row["cpu_s_per_sim_s"] == pytest.approx(0.5)


@pytest.mark.parametrize("peer", ["gz", "mvsim"])
@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("/nowhere/program", "cannot be started: No such file or directory"),
        ("/bin/cat", "not its version"),
        ("/bin/false", "not its version"),
    ],
)
def test_another_program_is_refused_before_any_run(peer: str, path: str, said: str) -> None:
    command = [sys.executable, str(ROOT / "benchmarks/compare"), "--busy", f"--{peer}", path]
    done = subprocess.run([*command, "--ruedo", "/bin/false"], capture_output=True, text=True)
    assert done.returncode == 1
    assert f"--{peer}: `{path} " in done.stderr and said in done.stderr
