"""What benchmarks say of the machine: how busy it is, and how many threads a program used."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks/peers"))
import machine

# user nice system idle iowait irq softirq steal guest guest_nice; guest is part of user
IDLE = "cpu  1000 10 300 90000 500 20 30 0 700 0\ncpu0 1 1 1 1 1 1 1 1 1 1\n"


@pytest.mark.parametrize(
    ("later", "busy"),
    [
        ("cpu  1000 10 300 90200 500 20 30 0 700 0\n", 0.0),
        ("cpu  1050 10 300 90100 550 20 30 0 750 0\n", 0.25),  # 50 of 200 ticks
        ("cpu  1100 20 350 90000 500 25 35 30 800 0\n", 1.0),
    ],
)
def test_the_busy_part_is_what_is_not_idle_and_no_wait(later: str, busy: float) -> None:
    assert machine.busy_part(IDLE, later) == pytest.approx(busy, abs=1e-12)


def test_a_busy_machine_is_refused_unless_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stat = tmp_path / "stat"
    stat.write_text(IDLE)
    later = "cpu  1050 10 300 90100 550 20 30 0 750 0\n"
    monkeypatch.setattr(machine.time, "sleep", lambda _: stat.write_text(later))
    with pytest.raises(SystemExit, match="other programs use 25 % of the cores; allowed: 10 %"):
        machine.check_free(False, stat)
    stat.write_text(IDLE)
    machine.check_free(True, stat)
    stat.write_text(later)
    monkeypatch.setattr(
        machine.time,
        "sleep",
        lambda _: stat.write_text("cpu  1060 10 300 90290 550 20 30 0 760 0\n"),
    )
    machine.check_free(False, stat)  # 10 of 200 ticks
    assert "5 % busy before the run" in capsys.readouterr().out


# The program says how many threads it has, its child's included, and waits until it was counted.
PROGRAM = """
import subprocess, sys, threading
ready = threading.Barrier(4)
def work():
    ready.wait()
    for _ in sys.stdin:
        pass
for _ in range(3):
    threading.Thread(target=work, daemon=True).start()
ready.wait()
child = subprocess.Popen([sys.executable, "-c", "print(1, flush=True); input()"],
                         stdin=subprocess.PIPE, stdout=subprocess.PIPE)
child.stdout.readline()
print("ready", flush=True)
input()
"""


def test_threads_are_those_of_a_program_and_its_children() -> None:
    with machine.subprocess.Popen(
        [sys.executable, "-c", PROGRAM],
        stdin=machine.subprocess.PIPE,
        stdout=machine.subprocess.PIPE,
    ) as program:
        assert program.stdout and program.stdin
        program.stdout.readline()
        assert machine.threads_of(program.pid) == 5
        program.kill()
    assert machine.threads_of(program.pid) == 0


def test_a_row_is_the_last_line_of_json_with_its_threads(
    capsys: pytest.CaptureFixture[str],
) -> None:
    code = "print('one'); print('{\"cpu_s\": 3.0, \"sim_s\": 2.0}')"
    row = machine.row_of([sys.executable, "-c", code], 60.0)
    assert row and row["cpu_s_per_sim_s"] == 1.5 and "threads" in row
    assert machine.row_of([sys.executable, "-c", "raise SystemExit('no map')"], 60.0) is None
    assert machine.row_of([sys.executable, "-c", "import time; time.sleep(60)"], 0.0) is None
    said = capsys.readouterr().err
    assert "no map" in said and "longer than 0 s" in said
