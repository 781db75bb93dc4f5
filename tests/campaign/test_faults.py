"""Faults as inputs of a run: their effects, from the world's file, an option or a client; and that
they repeat.
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


# ---- Another seed from a moment on. The robots stand: where a draw depends on the sample or the
# step alone, what is measured from then on is what the other seed would have measured all along.

INSTRUMENTS = """<static>true</static><pose>0 3 1 0 0 0</pose><link name='link'>
<sensor name='eye' type='camera'><update_rate>10</update_rate><camera><horizontal_fov>1.2</horizontal_fov>
<image><width>16</width><height>12</height></image><clip><near>0.05</near><far>50</far></clip>
<noise><type>gaussian</type><mean>0</mean><stddev>0.05</stddev></noise></camera><ruedo:encoding>rgb</ruedo:encoding></sensor>
<sensor name='pitot' type='air_speed'><update_rate>20</update_rate></sensor>
<sensor name='imu' type='imu'><update_rate>50</update_rate><imu><angular_velocity><x><noise type='gaussian'>
<stddev>0.1</stddev><bias_mean>1</bias_mean><bias_stddev>0.5</bias_stddev></noise></x></angular_velocity></imu></sensor>
</link>"""
WORLD = HALL.replace(
    "</world>",
    f"""<model name='mast'>{INSTRUMENTS}</model><wind><linear_velocity>5 0 0</linear_velocity></wind>
<plugin filename='gz-sim-wind-effects-system' name='gz::sim::systems::WindEffects'><horizontal><magnitude>
<time_for_rise>0</time_for_rise><noise><mean>0</mean><stddev>1</stddev></noise></magnitude></horizontal></plugin>
<ruedo:crowd name='people'><ruedo:count>6</ruedo:count><ruedo:area>-8 -4 -2 4</ruedo:area></ruedo:crowd></world>""",
)
BY_SAMPLE = ["p3at/lrf", "p3at/sonar_front", "mast/eye", "mast/pitot"]  # or by step


def standing(seed, *faults, send=None, seconds=3.0):
    """{channel: [(step, bytes)]}; send: (step, fault_t)."""
    with client.Engine(
        "w", text=WORLD, seed=seed, disable=["p3at/camera"], fault=faults, record=True
    ) as engine:
        messages = list(engine.messages())
        for step in [send[0]] if send else []:
            engine.step(None, step)
            messages += engine.messages()
            engine.command(0, "p3at/fault", send[1])
        engine.step(None, round(seconds / engine.dt) - engine.steps())
        found = {}
        for _, step, channel, data in [*messages, *engine.messages()]:
            found.setdefault(channel, []).append((step, data))
    return found


def split(messages, step):
    return [one for one in messages if one[0] < step], [one for one in messages if one[0] >= step]


@pytest.fixture(scope="module")
def seeds():
    return {seed: standing(seed) for seed in (1, 7)}


@pytest.mark.parametrize("by", ["option", "message"])
def test_from_its_moment_on_every_draw_is_of_another_seed(seeds, by):
    first = 300 if by == "option" else 251  # a message acts on a state: the next one shows it
    how = {"send": (250, message("reseeded", value=7))} if by == "message" else {}
    found = standing(1, *([":reseeded@1.5,value=7"] if by == "option" else []), **how)
    assert found.keys() == seeds[1].keys()
    for channel in found:
        assert split(found[channel], first)[0] == split(seeds[1][channel], first)[0], channel
    for channel in BY_SAMPLE:
        shown = first + (100 if "sonar" in channel else 0)  # transducers are measured in turn
        ours, before, other = (split(one[channel], shown)[1] for one in (found, seeds[1], seeds[7]))
        assert ours == other != before and len(ours) > 10, channel
    for channel in ("mast/imu", "ruedo/world"):  # with a past: a bias, people where they are
        ours, before, other = (
            split(one[channel], first + 100)[1] for one in (found, seeds[1], seeds[7])
        )
        assert ours != before and ours != other, channel


def test_equal_branches_are_equal_and_the_last_of_two_seeds_holds(seeds):
    one, two = (standing(1, ":reseeded@1,value=7") for _ in range(2))
    assert one == two
    there_and_back = standing(1, ":reseeded@2,value=1", ":reseeded@1,value=7")
    for channel in BY_SAMPLE:
        assert split(there_and_back[channel], 400)[0] == split(one[channel], 400)[0]
        shown = 400 + (100 if "sonar" in channel else 0)
        assert split(there_and_back[channel], shown)[1] == split(seeds[1][channel], shown)[1]


def test_lost_commands_are_others_from_then_on():
    def way(*faults):
        return [m.encode() for _, m in run("p3at:commands_lost@0,value=0.5", *faults)["pose"]]

    same, other = way(), way(":reseeded@1.5,value=7")
    moment = same.index(next(a for a, b in zip(same, other) if a != b))
    assert len(same) == len(other) and moment >= len(same) // 2


def test_a_picture_that_is_read_late_is_of_the_seed_of_its_moment():
    """Of each two cameras, which one thread draws, the second is due after the other seed has come
    (5 / 13 s), and the first, of 0.3 s, is read after that."""
    eye = INSTRUMENTS[
        INSTRUMENTS.index("<sensor name='eye'") : INSTRUMENTS.index("<sensor name='pitot'")
    ]
    eyes = "".join(
        eye.replace("'eye'", f"'eye_{i}'").replace(">10<", f">{13 if i % 2 else 10}<")
        for i in range(16)
    )
    text = WORLD.replace(eye, eyes)

    def pictures(seed, *faults, record):
        """The newest picture of the first camera at 0.395 s."""
        with client.Engine(
            "w", text=text, seed=seed, disable=["p3at/camera"], fault=faults, record=record
        ) as engine:
            engine.step(None, 79)
            assert engine["eye_0.utime"][0, 0] == 300_000
            return engine["eye_0.data"].tobytes()

    drawn = {seed: pictures(seed, record=True) for seed in (1, 7)}
    assert drawn[1] != drawn[7]
    assert pictures(1, ":reseeded@0.35,value=7", record=False) == drawn[1]


def test_a_spawned_robot_and_a_reset_use_the_new_seed(tmp_path):
    (tmp_path / "w.sdf").write_text(HALL)

    def scans(seed, begin, log):
        with client.launch(
            tmp_path / "w.sdf",
            lockstep=True,
            seed=seed,
            disable=DISABLED,
            args=["--record", str(log)],
        ) as sim:
            sim.step(50, [sim.robot("p3at").fault_command("reseeded", value=begin)])
            late = sim.spawn("p3at", 0.0, 2.0, name="late")
            found = []
            for times in range(2):
                for _ in range(10):
                    seen = sim.step(20)
                    found += [
                        list(seen.latest(one.lrf).ranges)
                        for one in (sim.robot("p3at"), sim.robot(late))
                    ]
                if times == 0:
                    sim.reset("time")
        assert "repeated byte for byte" in ruedo("verify", log, folder=tmp_path).stdout
        return found

    assert scans(1, 7, tmp_path / "one.lcm") == scans(7, 7, tmp_path / "two.lcm")


def test_another_seed_is_in_the_log_and_repeats(tmp_path):
    (tmp_path / "w.sdf").write_text(WORLD)
    option = (
        "--fault",
        ":reseeded@1,value=7",
        "--fault",
        ":reseeded@2,value=123456789012345",
    )
    ruedo(
        "run",
        "w.sdf",
        "--rate",
        "max",
        "--duration",
        "3",
        "--record",
        "w.lcm",
        *option,
        folder=tmp_path,
    )
    for threads in ("1", "2"):
        assert (
            "repeated byte for byte"
            in ruedo("verify", "w.lcm", "--threads", threads, folder=tmp_path).stdout
        )


WRONG = [
    (
        "p3at/lrf:freze@1",
        "kind 'freze' is not allowed; allowed are dropout, freeze.*did you mean 'freeze'",
    ),
    ("p3at/lrf:lag@1", "value 0 of lag is not allowed; allowed are 1e-06 to 60"),
    ("p3at/lrf:freeze", "it looks like ROBOT/DEVICE:KIND@SECONDS"),
    ("p3at/lrf:freeze@x", "'x' is not a number"),
    ("p3at/lrf:freeze@1,four=2", "'four' of freeze is not allowed; allowed are for"),
    ("p3at/laser:freeze@1", "there is no device 'laser' to be faulty; p3at has .*lrf"),
    ("r2d2/lrf:freeze@1", "a fault of robot 'r2d2'; the world has p3at"),
    ("p3at/odometry:blocked@1,value=1", "blocked is not a fault of an odometry"),
    (
        "p3at/lrf:weak_motor@1,value=0.5",
        "target 'lrf' of weak_motor is not allowed; allowed are left, right",
    ),
    ("p3at/lrf:blocked@1,from=0.7,to=0.2", "the smaller first"),
    ("p3at:freeze@1", "freeze needs a device"),
    (":reseeded@1,value=1.5", "value 1.5 of reseeded is not allowed; a seed is a whole number"),
    (":reseeded@1,value=-1", "value -1 of reseeded is not allowed; allowed are 0 to 1e.15"),
    (":reseeded@1,for=2", "'for' of reseeded is not allowed; allowed are value"),
    ("p3at/lrf:reseeded@1", "reseeded has no target, and 'lrf' is one"),
    ("p3at:reseeded@1,value=7", "reseeded is of the world, not of the robot 'p3at'"),
    ("p3at/lrf:lag@1,value=0.01,value=0.02", "'value' is given twice"),
    ("p3at/lrf:freeze@1,for=1,for=2", "'for' is given twice"),
    (
        "p3at/left:weak_motor@1,value=0.5,x=3",
        "'x' of weak_motor is not allowed; allowed are for, value",
    ),
    ("p3at:kidnapped@1,x=1,for=1", "'for' of kidnapped is not allowed; allowed are x, y, heading"),
    ("p3at/odometry:blocked@0,value=1", "^--fault 'p3at/odometry:blocked@0,value=1'"),
]


@pytest.mark.parametrize("text,says", WRONG)
def test_wrong_faults_are_reported(text, says):
    with pytest.raises(ValueError, match=says):
        client.Engine("hall", text=HALL, disable=DISABLED, fault=[text])


def test_wrong_faults_from_a_program_are_reported():
    engine = client.Engine("hall", text=HALL, disable=DISABLED)
    with pytest.raises(ValueError, match="p3at/fault: kind 'burn' is not allowed"):
        engine.command(0, "p3at/fault", message("burn"))
    turned = message("weak_motor", "left", value=0.5)
    turned.heading = 1.0
    with pytest.raises(ValueError, match="'heading' of weak_motor is not allowed"):
        engine.command(0, "p3at/fault", turned)
    with pytest.raises(ValueError, match="value nan of lag"):
        engine.command(0, "p3at/fault", message("lag", "lrf", value=math.nan))
    engine.step(None, 10)


FILE = """<ruedo:fault><ruedo:robot>p3at</ruedo:robot><ruedo:target>lrf</ruedo:target><ruedo:kind>{kind}</ruedo:kind>
<ruedo:at>1</ruedo:at><ruedo:for>1</ruedo:for></ruedo:fault></world>"""


def test_in_the_worlds_file_it_is_the_same_and_repeats(tmp_path):
    text = HALL.replace("</world>", FILE.format(kind="freeze"))
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
        scans = []
        robot.lrf.on_sample(scans.append)  # each of them, however late this program is

        def wait_for_scan(is_wanted):
            until = time.monotonic() + PATIENCE
            while True:
                while not scans:
                    assert time.monotonic() < until
                    time.sleep(0.01)
                if is_wanted(scans.pop(0).ranges):
                    return

        wait_for_scan(lambda ranges: ranges.min() > 1.0)
        robot.inject("blocked", "lrf", duration=1.0, value=0.1)
        wait_for_scan(lambda ranges: ranges.max() == pytest.approx(0.1))
        wait_for_scan(lambda ranges: ranges.min() > 1.0)
        with pytest.raises(ValueError, match="value"):
            robot.inject("lag", "lrf", value=math.nan)
    assert "repeated byte for byte" in ruedo("verify", log, folder=tmp_path).stdout
    assert b"p3at/fault" in log.read_bytes()
