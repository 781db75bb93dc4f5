"""Controllers that hang, crash, eat memory, or end: one failed case each, with output and reason.
Programs, too.
"""

import os
import sys

import pytest
from conftest import ruedo
from ruedo.campaign import Campaign
from ruedo.campaign.plan import METRICS

BAD = '''
import ctypes, os, sys, time


class Good:
    def __init__(self, speed):
        self.speed = speed

    def __call__(self, view):
        return (self.speed, 0.0) if view.time < 1.0 else "done"


def crash(view):
    print("about to divide")
    return 1 / 0


def hang(view):
    while True:
        time.sleep(0.1)


def hang_well(view):
    while True:
        try:
            time.sleep(0.1)
        except BaseException:
            pass


def eat(view):
    food = []
    while True:
        food.append(bytearray(10_000_000))


def die(view):
    ctypes.string_at(0)


def leave(view):
    sys.exit("no more")


def nonsense(view):
    return "left"
'''

PYTHON = '''
worlds: [arena]
controllers:
  - {name: good, python: "bad.py:Good"}
  - {name: crash, python: "bad.py:crash"}
  - {name: eat, python: "bad.py:eat"}
  - {name: die, python: "bad.py:die"}
  - {name: leave, python: "bad.py:leave"}
  - {name: nonsense, python: "bad.py:nonsense"}
  - {name: after, python: "bad.py:Good", hz: 5}
parameters: {speed: [0.2]}
disable: [p3at/camera]
limits: {duration: 2, wall: 300, memory_mb: 200}
'''

# A time of their own: too short for the others beside a load.
HANGING = '''
worlds: [arena]
controllers:
  - {name: hang, python: "bad.py:hang"}
  - {name: hang_well, python: "bad.py:hang_well"}
disable: [p3at/camera]
limits: {duration: 2, wall: 1.5}
'''


def test_each_bad_controller_is_one_failed_case(tmp_path):
    (tmp_path / "bad.py").write_text(BAD)
    (tmp_path / "c.yaml").write_text(PYTHON)
    results = Campaign(tmp_path / "c.yaml").run(workers=1)
    found = {case.controller: row for case, row in results.done}
    assert {name: row["status"] for name, row in found.items()} == {
        "good": "passed",
        "crash": "crashed",
        "eat": "memory",
        "die": "crashed",
        "leave": "crashed",
        "nonsense": "crashed",
        "after": "passed",
    }
    assert "ZeroDivisionError: division by zero" in found["crash"]["reason"]
    assert "about to divide" in found["crash"]["output"] and "line 15" in found["crash"]["output"]
    assert "more than 200 MB" in found["eat"]["reason"] and "SIGSEGV" in found["die"]["reason"]
    assert "no more" in found["leave"]["reason"]
    # 1 s at 0.2 m/s, after 0.3 m/s^2 from rest: 0.2 - 0.2^2 / (2 * 0.3) m.
    assert found["good"]["metrics"]["time_s"] == 1.0 and found["good"]["metrics"][
        "path_m"
    ] == pytest.approx(0.1333, abs=0.002)


def test_each_controller_that_hangs_is_one_failed_case(tmp_path):
    (tmp_path / "bad.py").write_text(BAD)
    (tmp_path / "c.yaml").write_text(HANGING)
    results = Campaign(tmp_path / "c.yaml").run(workers=1)
    found = {case.controller: row for case, row in results.done}
    assert list(found) == ["hang", "hang_well"]
    for row in found.values():
        assert row["status"] == "timeout"
        assert "more than 1.5 s of real time" in row["reason"]


WAITS = '''
def drive(view):
    return (0.2, 0.0) if view["lrf.ranges"].min() > 0.1 else (0.0, 0.0)


def looks(view):
    assert ("lrf.ranges" in view) == (view.time >= 1.0 and view.parameters["last"] == 1)
    return (0.2, 0.0) if "lrf.ranges" in view else (0.0, 0.0)


def misspelt(view):
    return view["lrf.range"]
'''

UNTIL_THE_FIRST_SCAN = '''
worlds: [arena]
controllers:
  - {name: drive, python: "waits.py:drive"}
  - {name: looks, python: "waits.py:looks"}
  - {name: misspelt, python: "waits.py:misspelt"}
parameters: {last: [1, 0]}
faults: [{kind: dropout, robot: p3at, target: lrf, at: 0, duration: "{last}"}]
disable: [p3at/camera]
limits: {duration: 2}
'''


def test_a_controller_waits_for_the_first_sample_that_it_reads(tmp_path):
    (tmp_path / "waits.py").write_text(WAITS)
    (tmp_path / "c.yaml").write_text(UNTIL_THE_FIRST_SCAN)
    results = Campaign(tmp_path / "c.yaml").run(workers=1)
    found = {(case.controller, case.parameters["last"]): row for case, row in results.done}
    # For a second, after 0.3 m/s^2 from rest: 0.2 - 0.2^2 / (2 * 0.3) m. Without samples: none.
    for name, last, way in (("drive", 1, 0.1333), ("looks", 1, 0.1333), ("looks", 0, 0.0)):
        assert found[name, last]["status"] == "passed", found[name, last]
        assert found[name, last]["metrics"]["path_m"] == pytest.approx(way, abs=0.002)
    assert found["misspelt", 1]["status"] == "crashed"
    waits = found["drive", 0]  # all the time, so that nothing it may do wrong was seen
    assert waits["status"] == "not judged" and "commanded nothing" in waits["reason"]


PROGRAM = '''
import json, os, subprocess, sys, time
import ruedo

how = sys.argv[1]
if how == "eat":
    food = [bytearray(10_000_000) for _ in range(1000)]
with ruedo.connect(timeout=60.0) as sim:
    robot = sim.robot("p3at")
    for _ in range(10):
        sim.step(20, [robot.velocity_command(json.loads(os.environ["RUEDO_PARAMETERS"])["speed"], 0.0)])
    if how == "crash":
        print("it is broken")
        sys.exit(3)
    if how == "leave_behind":
        open("child", "w").write(str(subprocess.Popen(["sleep", "1000"]).pid))
    while how == "hang":
        time.sleep(1)
'''

PROGRAMS = '''
worlds: [arena]
controllers:
  - {name: good, command: "PYTHON program.py good", lockstep: 1}
  - {name: crash, command: "PYTHON program.py crash", lockstep: 1}
  - {name: eat, command: "PYTHON program.py eat", lockstep: 1}
  - {name: leave_behind, command: "PYTHON program.py leave_behind", lockstep: 1}
  - {name: missing, command: "./no_such_program", lockstep: 1}
parameters: {speed: [0.3]}
disable: [p3at/camera]
expect: {goal: {x: 0.1, y: 0, radius: 0.15, by: 2}, no_contact: true}
limits: {duration: 2, wall: 300, memory_mb: 2000}
'''

# A time of its own, as above.
HANGING_PROGRAM = '''
worlds: [arena]
controllers:
  - {name: hang, command: "PYTHON program.py hang", lockstep: 1}
parameters: {speed: [0.3]}
disable: [p3at/camera]
limits: {duration: 2, wall: 5}
'''


def test_each_bad_program_is_one_failed_case(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    (tmp_path / "c.yaml").write_text(PROGRAMS.replace("PYTHON", sys.executable))
    campaign = Campaign(tmp_path / "c.yaml")
    assert "program.py" in campaign.cases[0].what["controller"]["files"]
    results = campaign.run(workers=2)
    found = {case.controller: row for case, row in results.done}
    assert {name: row["status"] for name, row in found.items()} == {
        "good": "passed",
        "crash": "crashed",
        "eat": "memory",
        "leave_behind": "passed",
        "missing": "crashed",
    }, found
    assert (
        found["crash"]["reason"] == "the controller ended with exit code 3"
        and "it is broken" in found["crash"]["output"]
    )
    assert "127" in found["missing"]["reason"] and "no_such_program" in found["missing"]["output"]
    assert found["good"]["metrics"]["goal_distance_m"] < 0.15
    # A name that is not listed there could be taken by a parameter.
    assert set(found["good"]["metrics"]) <= set(METRICS)
    left = (tmp_path / "child").read_text().strip()
    assert left and not os.path.exists(f"/proc/{left}")
    log = results.log(next(case for case in results.cases if case.controller == "crash"))
    assert "repeated byte for byte" in ruedo("verify", log, folder=tmp_path).stdout
    assert {name: row["state_hash"] for name, row in found.items()}["good"] == found[
        "leave_behind"
    ]["state_hash"]


def test_a_program_that_hangs_is_one_failed_case(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    (tmp_path / "c.yaml").write_text(HANGING_PROGRAM.replace("PYTHON", sys.executable))
    [(_, row)] = Campaign(tmp_path / "c.yaml").run(workers=1).done
    assert row["status"] == "timeout" and "more than 5 s of real time" in row["reason"]


METRIC = '''
import lcm
from ruedo.lcmtypes import odometry_t


def fastest(log):
    return max(odometry_t.decode(e.data).v for e in lcm.EventLog(log) if e.channel == "p3at/odometry")


def broken(log):
    raise KeyError("x")


def wanted(log):
    assert fastest(log) > 1, "was slow"


def asserts(log):
    assert fastest(log) > 1
'''


def test_own_metrics_and_golden_logs(tmp_path):
    (tmp_path / "bad.py").write_text(BAD)
    (tmp_path / "metric.py").write_text(METRIC)
    text = (
        PYTHON.partition("  - {name: crash")[0]
        + "parameters: {speed: [0.2, 0.4]}\ndisable: [p3at/camera]\nlimits: {duration: 2}\n"
    )
    (tmp_path / "c.yaml").write_text(
        text + "metrics: [{name: fastest_m_s, python: 'metric.py:fastest'}]\n"
    )
    slow, fast = (
        row["metrics"]["fastest_m_s"]
        for _, row in Campaign(tmp_path / "c.yaml").run(workers=1).done
    )
    assert slow == pytest.approx(0.2, abs=0.01) and fast == pytest.approx(
        0.3, abs=0.01
    )  # after 1 s at 0.3 m/s^2
    (tmp_path / "c.yaml").write_text(text + "metrics: [{name: b, python: 'metric.py:broken'}]\n")
    row = Campaign(tmp_path / "c.yaml").run(workers=1).done[0][1]
    assert (row["status"], row["what"]) == ("invalid", "metric") and "KeyError" in row["reason"]
    for name, reason in ("wanted", "was slow"), ("asserts", "metric.py:asserts does not hold"):
        (tmp_path / "c.yaml").write_text(
            text + f"metrics: [{{name: b, python: 'metric.py:{name}'}}]\n"
        )
        row = Campaign(tmp_path / "c.yaml").run(workers=1).done[0][1]
        assert (row["status"], row["what"], row["reason"]) == ("failed", "metric", reason)
    ruedo("campaign", "repeat", "c.yaml", "0", "-o", "golden.lcm", folder=tmp_path, code=0)
    (tmp_path / "c.yaml").write_text(
        text + "expect: {golden: golden.lcm, ignore: ['[!p]*', 'p3at/[!p]*', 'ruedo/*']}\n"
    )
    same, other = (row for _, row in Campaign(tmp_path / "c.yaml").run(workers=1).done)
    assert same["status"] == "passed" and (other["status"], other["what"]) == (
        "failed",
        "golden",
    ), (same, other)
