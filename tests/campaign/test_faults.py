"""Faults as inputs of a run: what each does to what, in the world's file, as an option, and from a
client; and they repeat.
"""

import math
import re
import time

import pytest
import ruedo as client
from conftest import PATIENCE, SOURCE, ruedo
from ruedo import World
from ruedo.lcmtypes import fault_t, odometry_t, planar_lidar_t, pose_t

DISABLED = ["p3at/camera", "p3at/sonar_front", "p3at/sonar_rear"]
HALL = str(World("hall").wall(6, -3, 6, 3).wall(-3, -4, 6, -4).robot("p3at"))


def run(*faults, v=0.3, omega=0.0, seconds=3.0, text=HALL, send=None, noise=False):
    """{device: [(s, message)]} of a robot that is told to drive; send: (s, fault_t), a command."""
    engine = client.Engine(
        "hall", text=text, noise=noise, disable=DISABLED, fault=faults, record=True
    )
    messages = list(engine.messages())
    steps = round(0.1 / engine.dt)
    while engine.time() < seconds - 1e-9:
        if send and abs(engine.time() - send[0]) < 1e-9:
            engine.command(0, "p3at/fault", send[1])
        engine.step([[v, omega]], steps)
        messages += engine.messages()
    types = {"p3at/lrf": planar_lidar_t, "p3at/odometry": odometry_t, "p3at/pose": pose_t}
    found = {name.split("/")[1]: [] for name in types}
    for _, step, channel, data in messages:
        if channel in types:
            found[channel.split("/")[1]].append((step * engine.dt, types[channel].decode(data)))
    return found


def at(messages, second):
    return min(messages, key=lambda one: abs(one[0] - second))[1]


@pytest.fixture(scope="module")
def good():
    return run()


def test_dropout(good):
    found = run("p3at/lrf:dropout@1,for=1")
    assert [t for t, _ in found["lrf"]] == [t for t, _ in good["lrf"] if not 1.0 <= t < 2.0]
    assert [m.encode() for t, m in found["lrf"] if t >= 2.0] == [
        m.encode() for t, m in good["lrf"] if t >= 2.0
    ]


def test_freeze_repeats_the_first_scan_with_new_stamps(good):
    found = run("p3at/lrf:freeze@1,for=1")
    frozen = [(t, m) for t, m in found["lrf"] if 1.0 <= t < 2.0]
    assert len(frozen) > 5 and all(m.ranges == at(good["lrf"], 1.0).ranges for _, m in frozen)
    assert [m.utime for _, m in frozen] == [round(t * 1e6) for t, _ in frozen]
    assert (
        at(found["lrf"], 2.0).encode()
        == at(good["lrf"], 2.0).encode()
        != at(good["lrf"], 1.0).encode()
    )


def test_lag(good):
    found = run("p3at/lrf:lag@1,value=0.5")
    assert not [t for t, _ in found["lrf"] if 1.0 <= t < 1.5 - 1e-9]
    for t, message in [(t, m) for t, m in found["lrf"] if t >= 1.5 - 1e-9]:
        assert message.encode() == at(good["lrf"], t - 0.5).encode()


def test_bias_and_scale(good):
    for fault, change in (
        ("bias@1,value=0.25", lambda r: r + 0.25),
        ("scale@1,value=2", lambda r: 2 * r),
    ):
        found = run("p3at/lrf:" + fault)
        assert at(found["lrf"], 0.5).ranges == at(good["lrf"], 0.5).ranges
        expected = [change(r) if math.isfinite(r) else r for r in at(good["lrf"], 2.0).ranges]
        assert at(found["lrf"], 2.0).ranges == pytest.approx(expected, rel=1e-6)


def test_blocked(good):
    found, before = (
        at(run("p3at/lrf:blocked@0,value=0.1,from=0,to=0.25")["lrf"], 1.0).ranges,
        at(good["lrf"], 1.0).ranges,
    )
    n = len(before)
    assert (
        list(found[: int(n * 0.25)]) == pytest.approx([0.1] * int(n * 0.25))
        and found[int(n * 0.25) + 1 :] == before[int(n * 0.25) + 1 :]
    )


def test_a_clock_that_drifts(good):
    for t, message in run("p3at/lrf:clock_drift@1,value=0.1")["lrf"]:
        assert message.utime == round(1e6 * (t + max(0.0, 0.1 * (t - 1.0))))


def test_an_encoder_that_is_stuck(good):
    found = run("p3at/left:encoder_stuck@1,for=1")
    left = at(good["odometry"], 1.0).angle[0]
    for t, message in found["odometry"]:
        if 1.05 < t < 1.95:
            assert message.angle[0] == pytest.approx(left, abs=0.02) and message.angle[-1] > left
    assert (
        at(found["odometry"], 2.9).theta > 0.2
    )  # the right side alone seems to drive: a turn to the left
    assert at(found["pose"], 2.9).pos == at(good["pose"], 2.9).pos


def test_wheels_that_slip(good):
    found = run("p3at:wheel_slip@0,value=0.5")
    way = at(found["pose"], 2.9).pos[0] - at(found["pose"], 2.0).pos[0]
    shown = at(found["odometry"], 2.9).x - at(found["odometry"], 2.0).x
    assert way == pytest.approx(0.9 * 0.15, rel=0.02) and shown == pytest.approx(
        0.9 * 0.3, rel=0.02
    )


def test_a_weak_motor_turns_the_robot():
    found = run("p3at/left:weak_motor@0,value=0.5")
    speed = at(found["odometry"], 2.9)
    track = float(
        re.search(
            r"<ruedo:track>([\d.]+)", (SOURCE / "worlds/robots/p3at/model.sdf").read_text()
        ).group(1)
    )
    assert speed.v == pytest.approx(0.75 * 0.3, rel=0.02) and speed.omega == pytest.approx(
        0.15 / track, rel=0.05
    )


def test_commands_lost_late_and_doubled(good):
    assert at(run("p3at:commands_lost@0,value=1")["pose"], 2.9).pos[0] == pytest.approx(
        0.0, abs=1e-3
    )
    late = run("p3at:commands_late@0,value=1")
    assert at(late["pose"], 2.9).pos[0] == pytest.approx(at(good["pose"], 1.9).pos[0], abs=1e-6)
    assert at(late["pose"], 0.9).pos[0] == pytest.approx(0.0, abs=1e-3)
    doubled = run("p3at:commands_doubled@0,value=0.05")
    assert at(doubled["pose"], 2.9).pos[0] == pytest.approx(at(good["pose"], 2.9).pos[0], abs=1e-6)


def test_some_commands_are_lost_the_same_each_time():
    one, two = (run("p3at:commands_lost@0,value=0.7", v=0.4)["pose"] for _ in range(2))
    assert [m.encode() for _, m in one] == [m.encode() for _, m in two]


def test_kidnapped(good):
    found = run("p3at:kidnapped@1,x=1.5,y=-2,heading=1.5707963")
    assert at(found["pose"], 1.02).pos[:2] == pytest.approx((1.5, -2.0), abs=0.02)
    assert at(found["pose"], 2.9).pos[1] > -1.9  # it drives on, to the left now
    assert abs(at(found["odometry"], 2.9).y) < 0.05  # and knows nothing of it


def message(kind, target="", duration=0.0, value=0.0):
    made = fault_t()
    made.kind, made.target, made.duration, made.value, made.view_end = (
        kind,
        target,
        duration,
        value,
        1.0,
    )
    return made


def test_a_command_does_what_the_option_does():
    option = run("p3at/lrf:freeze@1,for=1")
    command = run(send=(1.0 - 0.1, message("freeze", "lrf", 1.0)))
    assert len({tuple(m.ranges) for t, m in command["lrf"] if 0.95 < t < 1.85}) == 1
    assert len({tuple(m.ranges) for t, m in option["lrf"] if 1.0 <= t < 2.0}) == 1


WRONG = [
    (
        "p3at/lrf:freze@1",
        "kind 'freze' is not allowed; allowed are dropout, freeze.*did you mean 'freeze'",
    ),
    ("p3at/lrf:lag@1", "value 0 of lag is not allowed; allowed are 1e-06 to 60"),
    ("p3at/lrf:freeze", "it looks like ROBOT/DEVICE:KIND@SECONDS"),
    ("p3at/lrf:freeze@x", "'x' is no number"),
    ("p3at/lrf:freeze@1,four=2", "'four' is not allowed; allowed are for, value"),
    ("p3at/laser:freeze@1", "there is no device 'laser' to be faulty; p3at has .*lrf"),
    ("r2d2/lrf:freeze@1", "a fault of robot 'r2d2'; the world has p3at"),
    ("p3at/odometry:blocked@1,value=1", "blocked is no fault of a odometry"),
    (
        "p3at/lrf:weak_motor@1,value=0.5",
        "target 'lrf' of weak_motor is not allowed; allowed are left, right",
    ),
    ("p3at/lrf:blocked@1,from=0.7,to=0.2", "the smaller first"),
    ("p3at:freeze@1", "freeze needs a device"),
]


@pytest.mark.parametrize("text,says", WRONG)
def test_wrong_ones_are_told(text, says):
    with pytest.raises(ValueError, match=says):
        client.Engine("hall", text=HALL, disable=DISABLED, fault=[text])


def test_wrong_ones_from_a_program_are_told():
    engine = client.Engine("hall", text=HALL, disable=DISABLED)
    with pytest.raises(ValueError, match="p3at/fault: kind 'burn' is not allowed"):
        engine.command(0, "p3at/fault", message("burn"))
    with pytest.raises(ValueError, match="value nan of lag"):
        engine.command(0, "p3at/fault", message("lag", "lrf", value=math.nan))
    engine.step(None, 10)


FILE = """<ruedo:fault><ruedo:robot>p3at</ruedo:robot><ruedo:target>lrf</ruedo:target><ruedo:kind>{kind}</ruedo:kind>
<ruedo:at>1</ruedo:at><ruedo:for>1</ruedo:for></ruedo:fault></world>"""


def test_in_the_worlds_file_it_is_the_same_and_repeats(tmp_path):
    text = HALL.replace("</world>", FILE.format(kind="freeze")).replace(
        "<sdf ", "<sdf xmlns:ruedo='urn:ruedo' "
    )
    assert [m.encode() for _, m in run(text=text)["lrf"]] == [
        m.encode() for _, m in run("p3at/lrf:freeze@1,for=1")["lrf"]
    ]
    (tmp_path / "w.sdf").write_text(text)
    ruedo(
        "run",
        "w.sdf",
        "--rate",
        "max",
        "--duration",
        "3",
        "--record",
        "w.lcm",
        "--fault",
        "p3at/left:encoder_stuck@1",
        "--fault",
        "p3at:kidnapped@2,x=1,y=1",
        "--disable",
        "p3at/camera",
        folder=tmp_path,
    )
    for threads in ("1", "2"):
        assert (
            "repeated byte for byte"
            in ruedo("verify", "w.lcm", "--threads", threads, folder=tmp_path).stdout
        )
    (tmp_path / "bad.sdf").write_text(text.replace("freeze", "melt"))
    assert re.search(
        r"bad.sdf:\d+: <ruedo:fault>: kind 'melt' is not allowed",
        ruedo("check", "bad.sdf", folder=tmp_path, code=3).stderr
        + ruedo("run", "bad.sdf", folder=tmp_path, code=3).stderr,
    )


def test_from_a_client_it_is_in_the_log_and_repeats(tmp_path):
    (tmp_path / "w.sdf").write_text(HALL)
    with client.launch(
        tmp_path / "w.sdf",
        lockstep=True,
        args=["--record", str(tmp_path / "run.lcm")],
        disable=DISABLED,
    ) as sim:
        robot = sim.robot("p3at")
        sim.step(100, [robot.velocity_command(0.3, 0.0)])
        scans = []
        for i in range(10):
            seen = sim.step(
                20,
                [robot.velocity_command(0.3, 0.0)]
                + ([robot.fault_command("freeze", "lrf")] if i == 2 else []),
            )
            scan = seen.latest(robot.lrf)
            scans += [tuple(scan.ranges)] if scan is not None else []
    assert len(set(scans[4:])) == 1 < len(set(scans))
    assert "repeated byte for byte" in ruedo("verify", "run.lcm", folder=tmp_path).stdout
    log = (tmp_path / "run.lcm").read_bytes()
    assert b"p3at/fault" in log


def test_injected_in_a_run_it_acts_at_once_and_ends(tmp_path):
    (tmp_path / "w.sdf").write_text(HALL)
    log = tmp_path / "run.lcm"
    with client.launch(
        tmp_path / "w.sdf", noise=False, args=["--record", str(log)], disable=DISABLED
    ) as sim:
        robot = sim.robot("p3at")
        scans = robot.lrf.reader()

        def wait_for_scan(is_wanted):
            until = time.monotonic() + PATIENCE
            while not is_wanted(scans.next(PATIENCE).ranges):
                assert time.monotonic() < until

        wait_for_scan(lambda ranges: ranges.min() > 1.0)
        robot.inject("blocked", "lrf", duration=1.0, value=0.1)
        wait_for_scan(lambda ranges: ranges.max() == pytest.approx(0.1))
        wait_for_scan(lambda ranges: ranges.min() > 1.0)
        with pytest.raises(ValueError, match="value"):
            robot.inject("lag", "lrf", value=math.nan)
    assert "repeated byte for byte" in ruedo("verify", log, folder=tmp_path).stdout
    assert b"p3at/fault" in log.read_bytes()
