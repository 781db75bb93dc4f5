"""ruedo verify: a recorded run is repeated, and what is not the same is named; logs that are
damaged, cut off or no logs.
"""

import os
import random
import re
import shutil
import signal
import struct
import subprocess
from pathlib import Path

import lcm
import pytest
import ruedo
from recorded import (
    ARENA,
    BOX,
    PATIENCE,
    QUICK,
    RUEDO,
    SOURCE,
    Server,
    events,
    no_process_outlives_its_test,  # noqa: F401 (a fixture of every test here)
    program,
    record,
    until,
    url,
    write,
)
from ruedo.lcmtypes import (
    applied_t,
    joint_command_t,
    joint_state_t,
    log_header_t,
    planar_lidar_t,
    state_hash_t,
)

ARMS = str(SOURCE / "tests" / "golden" / "arms.sdf")


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """A log with commands at times of the client's own, a reset with another seed, and models that
    come and go.
    """
    log = tmp_path_factory.mktemp("driven") / "driven.lcm"
    server = Server(7822, "--rate", "20", "--record", log)
    with server.connect() as simulation:
        robot = simulation.robot("p3at")

        def drive(vx, omega):
            robot.set_velocity(vx, omega)
            while abs(robot.motion.next(PATIENCE).omega - omega) > 1e-6:
                pass

        drive(0.4, 0.3)
        simulation.sleep(2.0)
        simulation.reset_odometry("p3at")
        simulation.sleep(2.0)
        simulation.spawn(text=BOX, x=2.5, y=-1.5, z=1.5)
        simulation.sleep(2.0)
        simulation.reset(seed=5)
        drive(0.2, -0.4)
        simulation.sleep(2.0)
        simulation.pause()
        simulation.step(7)
        simulation.quit()
    assert server.end()[0] == 0
    return log


@pytest.mark.parametrize("threads", [1, 8])
def test_verifies_a_driven_run(driven, threads):
    result = program("verify", driven, "--threads", threads)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "repeated byte for byte" in result.stdout and "cut off" not in result.stdout
    channels = [channel for _, channel, _ in events(driven)]
    compared = sum(channel not in {"ruedo/header", "ruedo/applied"} for channel in channels)
    assert f" {compared} messages" in result.stdout
    assert channels.count("ruedo/applied") > 4


def test_state_hash_each_second_and_at_the_end(tmp_path):
    found = record(tmp_path / "a.lcm", seconds=2.5)
    hashes = [
        state_hash_t.decode(data) for _, channel, data in found if channel == "ruedo/state_hash"
    ]
    assert [h.utime for h in hashes] == [0, 1_000_000, 2_000_000, 2_500_000]
    assert [h.last for h in hashes] == [False, False, False, True]
    assert len({h.state_hash for h in hashes}) == 4


def test_a_seed_that_only_an_unsigned_number_holds(tmp_path):
    log, seed = tmp_path / "seed.lcm", 2**64 - 1
    record(log, "--seed", seed, seconds=1)
    repeated = program("verify", log)
    assert repeated.returncode == 0, repeated.stderr
    assert f"seed {seed}" in repeated.stdout
    record(tmp_path / "other.lcm", "--seed", seed // 2, seconds=1)
    assert program("diff", log, tmp_path / "other.lcm").returncode == 1
    page = program("play", log, "--html", tmp_path / "page.html")
    assert page.returncode == 0, page.stderr


def test_names_the_first_channel_step_and_field(tmp_path):
    found = record(tmp_path / "good.lcm")
    at = max(
        i
        for i, (stamp, channel, _) in enumerate(found)
        if channel == "p3at/lrf" and stamp <= 1_500_000
    )
    stamp, channel, data = found[at]
    scan = planar_lidar_t.decode(data)
    ranges = list(scan.ranges)
    ranges[17] = struct.unpack(">f", struct.pack(">f", ranges[17] + 0.25))[0]
    scan.ranges = ranges
    found[at] = (stamp, channel, scan.encode())
    write(tmp_path / "bad.lcm", found)
    result = program("verify", tmp_path / "bad.lcm")
    assert result.returncode == 1
    step_us = log_header_t.decode(found[0][2]).step_us
    assert f"p3at/lrf at step {stamp // step_us} (" in result.stdout
    assert "ranges[17] is " in result.stdout and f"{ranges[17]:.4g}"[:4] in result.stdout

    del found[at]
    write(tmp_path / "short.lcm", found)
    result = program("verify", tmp_path / "short.lcm")
    assert result.returncode == 1
    assert (
        f" at step {stamp // step_us} (" in result.stdout
        and "the log has a message on" in result.stdout
    )
    assert f"the repetition a message on p3at/lrf at stamp {stamp} us" in result.stdout


def test_another_command_is_another_run(driven, tmp_path):
    def drives(channel, data):
        return channel == "ruedo/applied" and applied_t.decode(data).channel == "p3at/velocity"

    found = events(driven)
    less = [event for event in found if not drives(*event[1:])]
    assert len(less) < len(found)
    write(tmp_path / "less.lcm", less)
    assert program("verify", tmp_path / "less.lcm").returncode == 1


def test_a_changed_file_is_reported_first(tmp_path):
    world = tmp_path / "arena.sdf"
    text = Path(ARENA).read_text() + "<!-- mine: Ruedo's own would be found by its hash -->\n"
    world.write_text(text)
    record(tmp_path / "a.lcm", world=str(world), seconds=1)
    assert program("verify", tmp_path / "a.lcm").returncode == 0
    world.write_text(text + "\n")
    result = program("verify", tmp_path / "a.lcm")
    assert result.returncode == 3 and str(world) in result.stderr and "was changed" in result.stderr
    world.unlink()
    result = program("verify", tmp_path / "a.lcm")
    assert result.returncode == 3 and str(world) in result.stderr


def test_a_log_of_another_installation_that_is_still_there(tmp_path):
    """Its models are copies of ours that are in none of our folders."""
    for folder in ("there/bin", "there/share/ruedo", "mine/worlds"):
        (tmp_path / folder).mkdir(parents=True)
    shutil.copy(RUEDO, tmp_path / "there/bin")
    shutil.copytree(SOURCE / "worlds", tmp_path / "there/share/ruedo/worlds")
    world = tmp_path / "mine/worlds/mine.sdf"
    world.write_text(
        "<sdf version='1.9'><world name='mine'>"
        "<include><uri>model://ground_plane</uri></include><include><uri>model://p3at</uri></include>"
        "</world></sdf>"
    )
    log = tmp_path / "log.lcm"
    run = ["run", world, *QUICK, "--rate", "max", "--duration", "1", "--record", log]
    subprocess.run([tmp_path / "there/bin/ruedo", *run, "--lcm", "memq://"], check=True)
    header = next(
        log_header_t.decode(data) for _, name, data in events(log) if name == "ruedo/header"
    )
    assert any(str(tmp_path / "there") in file.path for file in header.files)
    done = program("verify", log)
    assert done.returncode == 0 and "byte for byte" in done.stdout, done.stderr


def test_another_machine_is_reported_first_as_the_cause(tmp_path):
    found = record(tmp_path / "a.lcm", seconds=1)
    header = log_header_t.decode(found[0][2])
    header.cpu, header.libc = "aarch64", "glibc 2.19"
    header.libraries = ["libBulletCollision.so.1.0", *header.libraries]
    header.nlibraries += 1
    found[0] = (*found[0][:2], header.encode())
    write(tmp_path / "other.lcm", found)
    result = program("verify", tmp_path / "other.lcm")
    assert result.returncode == 0
    lines = result.stdout.splitlines()
    assert [line.split(":")[1].strip() for line in lines[:2]] == ["processor", "libraries"]
    assert (
        "aarch64" in lines[0]
        and "libBulletCollision.so.1.0" in lines[1]
        and "byte for byte" in lines[2]
    )

    at = next(i for i, (_, channel, _) in enumerate(found) if channel == "p3at/odometry")
    found[at] = (*found[at][:2], found[at][2][:-1] + bytes([found[at][2][-1] ^ 1]))
    write(tmp_path / "both.lcm", found)
    result = program("verify", tmp_path / "both.lcm")
    assert result.returncode == 4
    assert result.stdout.startswith("not as in the log: ") and "may be the cause" in result.stdout


def test_another_cpu_or_c_library_must_verify(tmp_path):
    found = record(tmp_path / "a.lcm", seconds=1)
    header = log_header_t.decode(found[0][2])
    header.cpu, header.libc = "x86-64 sse4.2", "glibc 2.19"
    at = next(i for i, (_, channel, _) in enumerate(found) if channel == "p3at/odometry")
    found[at] = (*found[at][:2], found[at][2][:-1] + bytes([found[at][2][-1] ^ 1]))
    for options, code in (([], 1), (["--fast-pixels"], 4)):  # those are drawn with what the CPU has
        header.options, header.noptions = options, len(options)
        found[0] = (*found[0][:2], header.encode())
        write(tmp_path / "other.lcm", found)
        result = program("verify", tmp_path / "other.lcm")
        assert result.returncode == code, result.stdout + result.stderr


def test_killed_in_the_middle(tmp_path):
    log = tmp_path / "killed.lcm"
    server = Server(7823, "--rate", "max", "--record", log)
    until(lambda: log.exists() and log.stat().st_size > 3_000_000)
    assert server.end(signal.SIGKILL)[0] == -signal.SIGKILL
    begin = log.read_bytes().index(b"\xed\xa1\xda\x01", 2_000_000)  # of an event
    os.truncate(log, begin + 40)  # and cut within it, wherever the kill was
    result = program("verify", log)
    assert result.returncode == 1 and "not verified to the end: cut off" in result.stdout, result
    assert "repeated byte for byte" not in result.stdout and "--partial" in result.stdout
    result = program("verify", log, "--partial")
    assert result.returncode == 0, result.stdout + result.stderr
    assert "cut off" in result.stdout and "verified up to there" in result.stdout

    whole = events(
        log
    )  # a kill between two events leaves no damage; that the end is missing is seen all the same
    write(tmp_path / "whole.lcm", whole)
    assert program("verify", tmp_path / "whole.lcm").returncode == 1
    result = program("verify", tmp_path / "whole.lcm", "--partial")
    assert (
        result.returncode == 0
        and "the end of the run is not in it; verified up to there" in result.stdout
    )


def test_a_full_disk(tmp_path):
    log = tmp_path / "full.lcm"
    command = f"ulimit -f 2000; exec {RUEDO} run {ARENA} {' '.join(QUICK)} --rate max --duration 600 --record {log} --lcm '{url(7824)}'"
    # Python ignores SIGXFSZ; its child does too, and the write fails for lack of room.
    result = subprocess.run(
        ["sh", "-c", command],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        restore_signals=False,
    )
    assert result.returncode == 4 and "readable up to" in result.stderr
    assert program("verify", log).returncode == 1
    result = program("verify", log, "--partial")
    assert result.returncode == 0 and "verified up to there" in result.stdout, (
        result.stdout + result.stderr
    )


def test_a_log_with_only_a_header_does_not_verify(tmp_path):
    found = record(tmp_path / "a.lcm", seconds=1)
    log = tmp_path / "header.lcm"
    write(log, found[:1])
    for options in [], ["--partial"]:
        result = program("verify", log, *options)
        assert result.returncode == 1 and "nothing was compared" in result.stdout, result
        assert "repeated byte for byte" not in result.stdout
    log.write_bytes(log.read_bytes()[:-5])
    result = program("verify", log)
    assert result.returncode == 3 and "cut off in the event that begins at byte 0" in result.stderr


def test_a_log_that_is_damaged_after_the_runs_end_is_not_whole(tmp_path):
    record(tmp_path / "a.lcm", seconds=1)
    with (tmp_path / "a.lcm").open("ab") as log:
        log.write(b"more")
    result = program("verify", tmp_path / "a.lcm")
    assert result.returncode == 1 and "not verified to the end: cut off" in result.stdout, result


def test_another_build_of_the_same_sources_must_verify(tmp_path):
    """The linker gives each program of a build another id."""
    found = record(tmp_path / "a.lcm", seconds=1)
    header = log_header_t.decode(found[0][2])
    release, source, build = re.fullmatch(
        r"(\S+) \(source (\w+), .*, build (\w+)\)", header.version
    ).groups()

    def verified(version):
        header.version = version
        found[0] = (*found[0][:2], header.encode())
        write(tmp_path / "other.lcm", found)
        return program("verify", tmp_path / "other.lcm")

    own = header.version
    assert "not as in the log" not in verified(own.replace(build, "beef")).stdout
    for other in own.replace(source, "beef"), f"{release} (build {build})":
        result = verified(other)
        assert result.returncode == 0, result
        assert result.stdout.startswith(f"not as in the log: Ruedo: the log has {release} ("), (
            result
        )


def test_files_without_a_recording_are_refused(tmp_path):
    (tmp_path / "empty.lcm").write_bytes(b"")
    (tmp_path / "text.lcm").write_text("hello, world")
    write(tmp_path / "other.lcm", [(0, "A", b"x")])
    for name in ("empty", "text", "other", "nowhere"):
        result = program("verify", tmp_path / f"{name}.lcm")
        assert result.returncode == 3 and f"{name}.lcm" in result.stderr


def test_damaged_logs_are_answered(tmp_path):
    record(tmp_path / "good.lcm", seconds=1)
    good = (tmp_path / "good.lcm").read_bytes()
    dice = random.Random(3)
    header = good.index(
        b"p3at/", 100
    )  # the first message of a robot: before it, almost all is text
    for k in range(60):
        bad = bytearray(good)
        for _ in range(dice.choice([1, 3])):
            bad[dice.randrange(len(bad) if k % 3 == 0 else header)] ^= 1 << dice.randrange(8)
        (tmp_path / "bad.lcm").write_bytes(bad)
        assert program("verify", tmp_path / "bad.lcm").returncode in (0, 1, 3, 4)


@pytest.mark.parametrize(
    "option, words",
    [
        ("--disable=p3at/ca}era", "no device 'ca}era'"),
        ("--disable=P3at/camera", "no robot 'P3at'"),
        ("--set=p3at/lrf.update_rate", "--set 'p3at/lrf.update_rate'"),
        ("--remap=x", "--remap 'x'"),
        ("--remap=p3at/nothing=A", "p3at/nothing"),
        ("--spawn=p3at@1", "--spawn 'p3at@1'"),
    ],
)
def test_a_damaged_option_is_the_logs_fault(tmp_path, option, words):
    found = record(tmp_path / "good.lcm", seconds=1)
    header = log_header_t.decode(found[0][2])
    header.options = [*header.options, option]
    header.noptions += 1
    found[0] = (*found[0][:2], header.encode())
    write(tmp_path / "bad.lcm", found)
    result = program("verify", tmp_path / "bad.lcm")
    assert result.returncode == 3, result.stderr
    assert "bad.lcm: its run had " in result.stderr and words in result.stderr


def test_a_lockstep_log_verifies(tmp_path):
    server = Server(7835, "--lockstep", "1", "--record", tmp_path / "a.lcm")
    with server.connect() as simulation:
        robot = simulation.robot("p3at")
        for k in range(40):
            simulation.step(5, [robot.velocity_command(0.3, 0.02 * k)])
        simulation.quit()
    assert server.end()[0] == 0
    assert sum(channel == "ruedo/applied" for _, channel, _ in events(tmp_path / "a.lcm")) >= 40
    result = program("verify", tmp_path / "a.lcm")
    assert result.returncode == 0, result.stdout + result.stderr


LIFT = """<sdf version="1.9"><world name="house"><model name="Lift1"><link name="platform"><inertial>
<mass>1200</mass><inertia><ixx>100</ixx><iyy>100</iyy><izz>100</izz></inertia></inertial><collision
name="c"><geometry><box><size>1 1 0.1</size></box></geometry></collision></link>
<joint name="cabin_joint" type="prismatic"><parent>world</parent><child>platform</child><axis>
<xyz>0 0 1</xyz></axis></joint><plugin name="lift" filename="liblift.so"><floor name="L1"
elevation="0"/><floor name="L2" elevation="1.5"/><v_max_cabin>2</v_max_cabin><a_nom_cabin>1
</a_nom_cabin><f_max_cabin>25323</f_max_cabin><cabin_joint_name>cabin_joint</cabin_joint_name>
</plugin></model></world></sdf>"""


def test_a_lift_that_is_called_is_repeated(tmp_path, monkeypatch):
    world, log = tmp_path / "house.sdf", tmp_path / "lift.lcm"
    world.write_text(LIFT)
    page = (SOURCE / "docs/world-files.md").read_text(encoding="utf-8")
    snippet = re.search(r"<!-- test: lift -->\n```python\n(.*?)```", page, re.DOTALL)[1]
    server = Server(7838, "--lockstep", "1", "--record", log, world=world)
    with server.connect() as simulation:
        monkeypatch.setenv("LCM_DEFAULT_URL", server.url)
        exec(snippet, {})
        simulation.quit()
    assert server.end()[0] == 0
    heights = [
        joint_state_t.decode(data).joint_position[0]
        for _, channel, data in events(log)
        if channel == "Lift1/joints"
    ]
    assert heights[0] == pytest.approx(0.0, abs=1e-6)
    assert heights[-1] == pytest.approx(1.5, abs=0.005)
    result = program("verify", log)
    assert result.returncode == 0, result.stdout + result.stderr


def test_gains_and_limits_by_message_are_repeated(tmp_path):
    """In lockstep, and from a client's own time beside a run that goes on."""
    modes = joint_command_t

    def told(*entries):
        message = joint_command_t()
        message.n = len(entries)
        names, kinds, values = zip(*entries, strict=True)
        message.name, message.mode, message.value = list(names), bytes(kinds), list(values)
        return message.encode()

    orders = [
        told(("pan", modes.POSITION, 1.0), ("fork", modes.POSITION, 0.4)),
        told(("pan", modes.POSITION_GAIN, 2.5), ("fork", modes.RATE_GAIN, 900.0)),
        told(("tilt", modes.VELOCITY_LIMIT, 1.5), ("tilt", modes.POSITION, 0.8)),
        told(("fork", modes.EFFORT_LIMIT, 25.0), ("pan", modes.EFFORT_LIMIT, 0.3)),
        told(("pan", modes.POSITION, -1.0), ("tilt", modes.EFFORT, 0.05)),
    ]
    lockstep, own_time = tmp_path / "lockstep.lcm", tmp_path / "own_time.lcm"
    server = Server(7836, "--lockstep", "1", "--record", lockstep, world=ARMS)
    with server.connect() as simulation:
        for order in orders:
            simulation.step(40, [ruedo.Command("lift/joint_command", order)])
        simulation.quit()
    assert server.end()[0] == 0
    server = Server(7837, "--rate", "20", "--record", own_time, world=ARMS)
    with server.connect() as simulation:
        bus = lcm.LCM(simulation.url)
        for order in [*orders, None, *orders]:
            if order is None:
                simulation.reset(seed=3)  # the file's gains again
            else:
                bus.publish("lift/joint_command", order)
                simulation.state("lift")  # answered after it came: none takes another's place
            simulation.sleep(0.4)
        simulation.quit()
    assert server.end()[0] == 0
    for log, least in ((lockstep, len(orders)), (own_time, 2 * len(orders))):
        applied = [
            applied_t.decode(data) for _, channel, data in events(log) if channel == "ruedo/applied"
        ]
        assert sum(each.channel == "lift/joint_command" for each in applied) >= least
        result = program("verify", log, "--threads", 2)
        assert result.returncode == 0, result.stdout + result.stderr
        assert "repeated byte for byte" in result.stdout
    # With another gain it is another run.
    found = events(lockstep)
    for i, (utime, channel, data) in enumerate(found):
        if channel == "ruedo/applied" and applied_t.decode(data).data == orders[1]:
            applied = applied_t.decode(data)
            applied.data = told(("pan", modes.POSITION_GAIN, 2.0), ("fork", modes.RATE_GAIN, 900.0))
            found[i] = (utime, channel, applied.encode())
    write(tmp_path / "other.lcm", found)
    result = program("verify", tmp_path / "other.lcm")
    assert result.returncode == 1, result.stdout + result.stderr
