"""Runs that are repeated: logs verified and played, snapshots restored, controllers that the run waits for."""
import os
import random
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import lcm
import pytest
import ruedo
from ruedo.lcmtypes import applied_t, log_header_t, planar_lidar_t, state_hash_t, velocity_command_t, world_state_t

RUEDO = os.environ["RUEDO"]
SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
ARENA = str(SOURCE / "worlds" / "arena.sdf")
QUICK = ["--disable", "p3at/camera", "--quiet"]
LOG_ONLY = {"ruedo/header", "ruedo/applied", "ruedo/state_hash"}
PATIENCE = 400    # s, for what comes sooner or later, on a machine that does much else too


def url(port):
    return f"udpm://239.255.76.67:{port}?ttl=0&recv_buf_size=2097152"


def program(*arguments, **options):
    return subprocess.run([RUEDO, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE, **options)


def until(condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def events(path):
    log = lcm.EventLog(str(path), "r")
    found = [(event.timestamp, event.channel, event.data) for event in log]
    log.close()
    return found


def write(path, found):
    log = lcm.EventLog(str(path), "w", overwrite=True)
    for timestamp, channel, data in found:
        log.write_event(timestamp, channel, data)
    log.close()


def record(path, *arguments, world=ARENA, seconds=3, port=7821):
    result = program("run", world, *QUICK, "--rate", "max", "--duration", seconds, "--record", path, "--lcm", url(port), *arguments)
    assert result.returncode == 0, result.stderr
    return events(path)


class Server:
    """ruedo run in the background."""

    def __init__(self, port, *arguments, world=ARENA):
        self.url = url(port)
        self.process = subprocess.Popen([RUEDO, "run", world, *QUICK, "--lcm", self.url, *map(str, arguments)],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        STARTED.append(self.process)

    def connect(self):
        return ruedo.connect(self.url, timeout=PATIENCE)

    def end(self, how=None):
        """Its exit code, and what it said that was not read yet."""
        if how:
            self.process.send_signal(how)
        _, errors = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, errors


STARTED = []


@pytest.fixture(autouse=True)
def no_process_outlives_its_test():
    yield
    for process in STARTED:
        process.kill()
        process.wait()
    STARTED.clear()


def command(simulation, vx, omega):
    """One command to a paused server, which has it when it answers a request that was sent behind it."""
    message = velocity_command_t()
    message.vx, message.omega = vx, omega
    lcm.LCM(simulation.url).publish("p3at/velocity", message.encode())
    simulation.state()


BOX = ("<sdf version='1.9'><model name='crate'><link name='link'><inertial><mass>3</mass></inertial><collision name='c'><geometry>"
       "<box><size>0.3 0.3 0.3</size></box></geometry></collision></link></model></sdf>")


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """A log with commands at times of the client's own, a reset with another seed, and models that come and go."""
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
    hashes = [state_hash_t.decode(data) for _, channel, data in found if channel == "ruedo/state_hash"]
    assert [h.utime for h in hashes] == [0, 1_000_000, 2_000_000, 2_500_000]
    assert [h.last for h in hashes] == [False, False, False, True]
    assert len({h.state_hash for h in hashes}) == 4


def test_names_the_first_channel_step_and_field(tmp_path):
    found = record(tmp_path / "good.lcm")
    at = max(i for i, (stamp, channel, _) in enumerate(found) if channel == "p3at/lrf" and stamp <= 1_500_000)
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
    assert f" at step {stamp // step_us} (" in result.stdout and "the log has a message on" in result.stdout
    assert f"the repetition a message on p3at/lrf at stamp {stamp} us" in result.stdout


def test_another_command_is_another_run(driven, tmp_path):
    def drives(channel, data):
        return channel == "ruedo/applied" and applied_t.decode(data).channel == "p3at/velocity"

    found = events(driven)
    less = [event for event in found if not drives(*event[1:])]
    assert len(less) < len(found)
    write(tmp_path / "less.lcm", less)
    assert program("verify", tmp_path / "less.lcm").returncode == 1


def test_a_changed_file_is_named_first(tmp_path):
    world = tmp_path / "arena.sdf"
    text = Path(ARENA).read_text()
    world.write_text(text)
    record(tmp_path / "a.lcm", world=str(world), seconds=1)
    assert program("verify", tmp_path / "a.lcm").returncode == 0
    world.write_text(text + "\n")
    result = program("verify", tmp_path / "a.lcm")
    assert result.returncode == 3 and str(world) in result.stderr and "was changed" in result.stderr
    world.unlink()
    result = program("verify", tmp_path / "a.lcm")
    assert result.returncode == 3 and str(world) in result.stderr


def test_another_machine_is_said_first_and_is_no_nondeterminism(tmp_path):
    found = record(tmp_path / "a.lcm", seconds=1)
    header = log_header_t.decode(found[0][2])
    header.cpu, header.libc = "sse4.2", "glibc 2.19"
    header.libraries = ["libBulletCollision.so.1.0", *header.libraries]
    header.nlibraries += 1
    found[0] = (*found[0][:2], header.encode())
    write(tmp_path / "other.lcm", found)
    result = program("verify", tmp_path / "other.lcm")
    assert result.returncode == 0
    lines = result.stdout.splitlines()
    assert [line.split(":")[1].strip() for line in lines[:3]] == ["CPU features", "C library", "libraries"]
    assert "glibc 2.19" in lines[1] and "libBulletCollision.so.1.0" in lines[2] and "byte for byte" in lines[3]

    at = next(i for i, (_, channel, _) in enumerate(found) if channel == "p3at/odometry")
    found[at] = (*found[at][:2], found[at][2][:-1] + bytes([found[at][2][-1] ^ 1]))
    write(tmp_path / "both.lcm", found)
    result = program("verify", tmp_path / "both.lcm")
    assert result.returncode == 4
    assert result.stdout.startswith("not as in the log: ") and "may be why" in result.stdout


def test_killed_in_the_middle(tmp_path):
    log = tmp_path / "killed.lcm"
    server = Server(7823, "--rate", "max", "--record", log)
    until(lambda: log.exists() and log.stat().st_size > 3_000_000)
    assert server.end(signal.SIGKILL)[0] == -signal.SIGKILL
    with open(log, "r+b") as file:
        file.truncate(2_000_001)    # and cut within an event, wherever the kill was
    result = program("verify", log)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "cut off" in result.stdout and "verified up to there" in result.stdout

    whole = events(log)    # a kill between two events leaves no damage; that the end is missing is seen all the same
    write(tmp_path / "whole.lcm", whole)
    result = program("verify", tmp_path / "whole.lcm")
    assert result.returncode == 0 and "the end of the run is not in it; verified up to there" in result.stdout


def test_a_full_disk(tmp_path):
    log = tmp_path / "full.lcm"
    command = f"ulimit -f 2000; exec {RUEDO} run {ARENA} {' '.join(QUICK)} --rate max --duration 600 --record {log} --lcm '{url(7824)}'"
    # Python ignores SIGXFSZ; its child does too, and is told by the write that there is no room.
    result = subprocess.run(["sh", "-c", command], capture_output=True, text=True, timeout=PATIENCE, restore_signals=False)
    assert result.returncode == 4 and "readable up to" in result.stderr
    result = program("verify", log)
    assert result.returncode == 0 and "verified up to there" in result.stdout, result.stdout + result.stderr


def test_what_is_no_recording(tmp_path):
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
    for _ in range(20):
        bad = bytearray(good)
        for _ in range(dice.choice([1, 3])):
            bad[dice.randrange(len(bad))] ^= 1 << dice.randrange(8)
        (tmp_path / "bad.lcm").write_bytes(bad)
        assert program("verify", tmp_path / "bad.lcm").returncode in (0, 1, 3, 4)


@pytest.mark.parametrize("option, words", [("--disable=p3at/ca}era", "no device 'ca}era'"), ("--disable=P3at/camera", "no robot 'P3at'"),
                                           ("--set=p3at/lrf.update_rate", "--set 'p3at/lrf.update_rate'"), ("--remap=x", "--remap 'x'"),
                                           ("--remap=p3at/nothing=A", "p3at/nothing"), ("--spawn=p3at@1", "--spawn 'p3at@1'")])
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


class Listener:
    """All messages of a bus. Over TCP: multicast may lose some where the listener gets no time to listen."""

    def __init__(self, address):
        self.got, self.stop = [], False
        self.bus = lcm.LCM(address)
        self.bus.subscribe(".*", lambda channel, data: self.got.append((channel, bytes(data)))).set_queue_capacity(0)
        self.thread = threading.Thread(target=self.listen)
        self.thread.start()

    def listen(self):
        while not self.stop:
            self.bus.handle_timeout(50)

    def end(self):
        self.stop = True
        self.thread.join()


@pytest.fixture
def exchange(tmp_path):
    """The address of a server of LCM over TCP, which passes on what the tests send. It serves a world without a body."""
    world = tmp_path / "empty.sdf"
    world.write_text("<sdf version='1.9'><world name='empty'/></sdf>")
    process = subprocess.Popen([RUEDO, "run", world, "--quiet", "--paused", "--lcm", "auto-tcp"], stdout=subprocess.PIPE, text=True)
    STARTED.append(process)
    yield process.stdout.readline().split("'")[1]


def of_nothing(channel, data):
    return channel == "ruedo/world" and world_state_t.decode(data).n == 0


@pytest.mark.parametrize("stock", [False, True])
def test_plays_again(tmp_path, exchange, stock):
    found = record(tmp_path / "a.lcm", seconds=2)
    wanted = [(channel, data) for _, channel, data in found if stock or channel not in LOG_ONLY]
    listener = Listener(exchange)
    try:
        until(lambda: ("mark", b"x") in listener.got or lcm.LCM(exchange).publish("mark", b"x"))    # it listens from here on
        begin = time.monotonic()
        if stock:    # LCM's own player reads the log
            player = shutil.which("lcm-logplayer", path=str(Path(sys.executable).parent)) or "lcm-logplayer"
            result = subprocess.run([player, "-s", "4", "-l", exchange, str(tmp_path / "a.lcm")], capture_output=True, timeout=PATIENCE)
            assert result.returncode == 0
        else:
            result = program("play", tmp_path / "a.lcm", "--speed", "4", "--lcm", exchange)
            assert result.returncode == 0 and f"{len(wanted)} messages, 2 s" in result.stdout
        assert time.monotonic() - begin > 0.49    # 2 s, four times as fast

        def played():
            return [one for one in list(listener.got) if one[0] not in ("mark", "ruedo/info", "ruedo/tick") and not of_nothing(*one)]

        until(lambda: len(played()) >= len(wanted))
        assert played() == wanted
    finally:
        listener.end()


def test_play_is_interrupted_cleanly(tmp_path):
    record(tmp_path / "a.lcm", seconds=2)
    listener = Listener(url(7827))
    process = subprocess.Popen([RUEDO, "play", str(tmp_path / "a.lcm"), "--speed", "0.01", "--lcm", url(7827)], stdout=subprocess.PIPE, text=True)
    STARTED.append(process)
    try:
        until(lambda: listener.got)
    finally:
        listener.end()
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0 and "interrupted" in out


def test_a_snapshot_in_another_process(tmp_path):
    """The restored run's log is the log of the run that was never interrupted."""
    arguments = ["--rate", "max", "--paused", "--snapshots", tmp_path, "--duration", "3"]
    server = Server(7828, *arguments, "--record", tmp_path / "one.lcm")
    with server.connect() as simulation:
        command(simulation, 0.5, 0.4)
        simulation.step(150)
        simulation.spawn(text=BOX, x=2.5, y=-1.5, z=1.5)
        simulation.step(100)
        saved = simulation.snapshot("here")
        assert saved.step == 250
        command(simulation, 0.1, -0.4)
        with pytest.raises(ruedo.RuedoError):
            simulation.snapshot("../there")
        with pytest.raises(ruedo.RuedoError):
            simulation.restore("nowhere")
        simulation.resume()
    assert server.end()[0] == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["here.snapshot", "one.lcm"]

    snapshot = tmp_path / "here.snapshot"
    result = program("run", ARENA, *QUICK, "--rate", "max", "--duration", "3", "--restore", snapshot, "--record", tmp_path / "two.lcm",
                     "--lcm", url(7829))
    assert result.returncode == 0, result.stderr
    step_us = log_header_t.decode(events(snapshot)[0][2]).step_us
    one, two = events(tmp_path / "one.lcm"), events(tmp_path / "two.lcm")
    stop = next(i for i, (_, channel, data) in enumerate(one) if channel == "ruedo/applied" and one[i][0] >= 250 * step_us)
    assert one[:stop] == two[:stop]
    assert program("verify", tmp_path / "two.lcm").returncode == 0

    other = program("run", ARENA, *QUICK, "--no-noise", "--restore", snapshot, "--lcm", url(7829))
    assert other.returncode == 3 and "--no-noise" in other.stderr


def test_a_snapshot_in_the_same_process(tmp_path):
    server = Server(7830, "--rate", "max", "--paused", "--snapshots", tmp_path, "--record", tmp_path / "a.lcm")
    with server.connect() as simulation:
        def go_on():
            simulation.step(200)
            return simulation.state().state_hash

        command(simulation, 0.5, 0.4)
        simulation.step(100)
        saved = simulation.snapshot("here")
        after = go_on()
        simulation.reset(seed=9)
        simulation.step(50)
        restored = simulation.restore("here")
        assert (restored.step, restored.state_hash) == (saved.step, saved.state_hash)
        assert go_on() == after
        simulation.quit()
    assert server.end()[0] == 0
    result = program("verify", tmp_path / "a.lcm")    # without the snapshot's file, which the log does not need
    assert result.returncode == 0, result.stdout + result.stderr


CONTROLLER = '''
import sys, lcm, time
sys.path.insert(0, sys.argv[2])
import bot_core

bus = lcm.LCM(sys.argv[1])

def on_scan(channel, data):
    scan = bot_core.planar_lidar_t.decode(data)
    ahead = min(scan.ranges[len(scan.ranges) // 3 : -len(scan.ranges) // 3])
    command = bot_core.pose_t()
    command.utime = int(time.time() * 1e6) if "wall" in sys.argv else 0
    command.vel = [0.4 if ahead > 0.8 else 0.0, 0.0, 0.0]
    command.rotation_rate = [0.0, 0.0, 0.0 if ahead > 0.8 else 0.7]
    bus.publish("VELOCITY", command.encode())
    if scan.utime == 1000000:
        print("a second of scans", flush=True)

bus.subscribe("LASER", on_scan)
print("ready", flush=True)
while True:
    bus.handle()
'''


@pytest.fixture(scope="module")
def bot_core(tmp_path_factory):
    """What a program has that knows bot_core's types alone."""
    folder = tmp_path_factory.mktemp("bot_core")
    for name in ("planar_lidar_t", "pose_t"):
        text = (SOURCE / "proto" / f"{name}.lcm").read_text()
        (folder / f"{name}.lcm").write_text(text.replace("package ruedo;", "package bot_core;"))
    generator = shutil.which("lcm-gen", path=str(Path(sys.executable).parent)) or "lcm-gen"
    subprocess.run([generator, "-p", "--ppath", str(folder), *map(str, folder.glob("*.lcm"))], check=True, capture_output=True)
    (folder / "controller.py").write_text(CONTROLLER)
    return folder


def start_controller(bot_core, port, *clock):
    words = [sys.executable, str(bot_core / "controller.py"), url(port), str(bot_core), *clock]
    controller = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    STARTED.append(controller)
    assert controller.stdout.readline() == "ready\n"
    return controller


WAITING = ["--remap", "p3at/lrf=LASER", "--remap", "p3at/velocity=VELOCITY", "--wait-for", "p3at/velocity@10", "--set", "p3at/lrf.update_rate=10",
           "--rate", "max"]


def test_an_unmodified_controller_runs_repeatably(tmp_path, bot_core):
    logs = []
    for run, clock in enumerate(([], [], ["wall"])):    # the last one stamps its commands by the wall clock
        start_controller(bot_core, 7836 + run, *clock)
        logs.append(tmp_path / f"{run}.lcm")
        result = program("run", ARENA, *QUICK, *WAITING, "--duration", 20, "--record", logs[-1], "--lcm", url(7836 + run))
        assert result.returncode == 0, result.stderr
    assert logs[0].read_bytes() == logs[1].read_bytes()
    seen = [[event for event in events(log) if event[1] != "ruedo/applied"] for log in logs]
    assert seen[0] == seen[2] and logs[0].read_bytes() != logs[2].read_bytes()
    found = events(logs[0])
    applied = [stamp for stamp, channel, _ in found if channel == "ruedo/applied"]
    assert applied == [k * 100_000 for k in range(200)]    # message k acts on the state of its own scan
    assert {"LASER", "p3at/odometry"} <= {channel for _, channel, _ in found}
    assert program("verify", logs[0]).returncode == 0


def test_a_controller_that_dies_is_said(bot_core):
    controller = start_controller(bot_core, 7833)
    server = Server(7833, *WAITING)
    assert controller.stdout.readline() == "a second of scans\n"
    controller.kill()
    said = []
    while not said or "--wait-for wants message" not in said[-1]:
        said.append(server.process.stderr.readline())
        assert said[-1], said
    assert "VELOCITY" in said[-1]
    time.sleep(2.0)    # time enough to say it again
    code, errors = server.end(signal.SIGINT)
    assert code == 0 and "--wait-for wants message" not in errors


@pytest.mark.parametrize("value, words", [("p3at/velocty@10", "did you mean 'p3at/velocity'"), ("p3at/velocity", "CHANNEL@HZ"),
                                          ("p3at/velocity@0", "CHANNEL@HZ"), ("p3at/lrf@10", "no input channel"), ("p3at/velocity@x", "CHANNEL@HZ")])
def test_wait_for_is_read_strictly(value, words):
    result = program("run", ARENA, *QUICK, "--wait-for", value, "--lcm", url(7834))
    assert result.returncode == 2 and words in result.stderr


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
