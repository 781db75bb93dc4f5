"""The table of hosts: variables, folders, limits and streams as users' machines have them.

A row, in rows/SUBJECT.txt: NAME ~ the host, in bash ~ a command, in bash ~ CODE TEXT
The two run one after the other in a folder with the files of files/. The command ends with that
code, and prints that text (one that begins with ! must not be printed). A signal is 128 and more.
A row that asks for what a machine lacks (`needs ...`) is skipped there. RUEDO_HOSTS names a SUBJECT
whose rows alone are tried.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import pytest

HERE = Path(__file__).parent
SKIPPED = 77
PATIENCE = 120  # s
BEGIN = f"""
needs() {{ "$@" >/dev/null 2>&1 || exit {SKIPPED}; }}
run="ruedo run box.sdf --lcm memq:// --rate max --duration 0.2 --quiet"
live="ruedo run box.sdf --lcm memq:// --rate 1 --duration 30 --quiet"
written() {{ until test -s "$1"; do sleep 0.05; done; }}
in_network() {{ unshare -n bash -c 'ip link set lo up; ip link add eth9 type veth peer name far; ip addr add 10.9.0.1/24 dev eth9;
  ip link set far up; ip link set eth9 up multicast on; exec "$@"' -- timeout 30 "$@"; }}
ros2() {{ in_network ruedo run box.sdf --lcm memq:// --rate max --duration 0.2 --ros2; }}
cut_off() {{ unshare -n bash -c 'ip link set lo up; ip link add v0 type veth peer name v1; ip addr add 10.9.0.1/24 dev v0
  ip link set v0 up; ip link set v1 up; ip route add 224.0.0.0/4 dev v0
  (sleep 1; eval "$1"; sleep 1; eval "$2") &
  exec ruedo run box.sdf --lcm "udpm://239.255.76.67:7667?ttl=1" --rate 1 --duration 4 --quiet' -- "$@" 2>&1; }}
picture() {{ ruedo render box.sdf --camera eye/camera -o "$1"; }}
"""


@dataclass
class Row:
    name: str
    host: str
    command: str
    code: int
    text: str


def rows(subject):
    for line in (HERE / f"rows/{subject}.txt").read_text(encoding="utf-8").splitlines():
        if line.strip() and not line.startswith("#"):
            name, host, command, verdict = (one.strip() for one in line.split(" ~ "))
            code, _, text = verdict.partition(" ")
            yield Row(name, host, command, int(code), text)


def every_row():
    for file in sorted(HERE.glob(f"rows/{os.environ.get('RUEDO_HOSTS', '*')}.txt")):
        for row in rows(file.stem):
            yield pytest.param(row, id=f"{file.stem}-{row.name}")


def environment(folder):
    """Next to nothing of this machine's."""
    programs = [Path(os.environ["RUEDO"]).parent, Path(sys.executable).parent]
    return {
        "PATH": ":".join([*map(str, programs), os.environ.get("PATH", "")]),
        "HOME": str(folder),
        "PYTHONPATH": os.environ.get("PYTHONPATH", ""),
        "RUEDO": os.environ["RUEDO"],
    }


@pytest.fixture
def folder():
    """One that other users may enter, too."""
    with tempfile.TemporaryDirectory(prefix="hosts-") as place:
        Path(place).chmod(0o755)
        yield shutil.copytree(HERE / "files", Path(place, "host"))


@pytest.mark.parametrize("row", list(every_row()))
def test_row(row, folder):
    done = subprocess.run(
        ["bash", "-c", f"{BEGIN}\n{row.host or ':'}\n{row.command}"],
        cwd=folder,
        env=environment(folder),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=PATIENCE,
    )
    said = done.stdout.decode(errors="replace")
    code = done.returncode if done.returncode >= 0 else 128 - done.returncode
    if code == SKIPPED:
        pytest.skip(row.host)
    assert code == row.code, f"{row}\nexit code {code}\n{said}"
    unwanted = row.text.startswith("!")
    assert (row.text.lstrip("!") in said) is not unwanted, f"{row}\n{said}"
