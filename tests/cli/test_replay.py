"""Runs that continue: logs played, snapshots restored, and controllers that the run waits for."""

import shlex
import shutil
import signal
import subprocess
import sys
import threading
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
    STARTED,
    Server,
    command,
    events,
    no_process_outlives_its_test,  # noqa: F401 (a fixture of every test here)
    program,
    record,
    until,
    url,
)
from ruedo.lcmtypes import log_header_t, request_t, snapshot_request_t, world_state_t

LOG_ONLY = {"ruedo/header", "ruedo/applied", "ruedo/state_hash"}


class Listener:
    """All messages of a bus. Over TCP: multicast may lose some where the listener gets no time to
    listen.
    """

    def __init__(self, address):
        self.got, self.stop = [], False
        self.bus = lcm.LCM(address)
        self.bus.subscribe(
            ".*", lambda channel, data: self.got.append((channel, bytes(data)))
        ).set_queue_capacity(0)
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
    """The address of a server of LCM over TCP that relays what the tests send. It serves an empty
    world.
    """
    world = tmp_path / "empty.sdf"
    world.write_text("<sdf version='1.9'><world name='empty'/></sdf>")
    process = subprocess.Popen(
        [RUEDO, "run", world, "--quiet", "--paused", "--lcm", "auto-tcp"],
        stdout=subprocess.PIPE,
        text=True,
    )
    STARTED.append(process)
    yield process.stdout.readline().split("'")[1]


def test_plays_at_its_own_time(tmp_path, exchange):
    """At a ten-thousandth of its speed, what comes a step later comes 50 s later: long after what
    is at the same time.
    """
    found = record(tmp_path / "a.lcm", seconds=2)
    first = [
        (channel, data)
        for stamp, channel, data in found
        if stamp == found[0][0] and channel not in LOG_ONLY
    ]
    assert first
    listener = Listener(exchange)
    try:
        until(lambda: ("mark", b"x") in listener.got or lcm.LCM(exchange).publish("mark", b"x"))
        STARTED.append(
            subprocess.Popen(
                [RUEDO, "play", tmp_path / "a.lcm", "--speed", "0.0001", "--lcm", exchange]
            )
        )

        def played():
            return [
                one
                for one in list(listener.got)
                if one[0] not in ("mark", "ruedo/info", "ruedo/tick") and not of_nothing(*one)
            ]

        until(lambda: len(played()) >= len(first))
        until(lambda: ("mark", b"y") in listener.got or lcm.LCM(exchange).publish("mark", b"y"))
        assert played() == first
    finally:
        listener.end()


def of_nothing(channel, data):
    return channel == "ruedo/world" and world_state_t.decode(data).n == 0


@pytest.mark.parametrize("stock", [False, True])
def test_plays_again(tmp_path, exchange, stock):
    found = record(tmp_path / "a.lcm", seconds=2)
    wanted = [(channel, data) for _, channel, data in found if stock or channel not in LOG_ONLY]
    listener = Listener(exchange)
    try:
        until(
            lambda: ("mark", b"x") in listener.got or lcm.LCM(exchange).publish("mark", b"x")
        )  # it listens from here on
        if stock:  # LCM's own player reads the log
            player = (
                shutil.which("lcm-logplayer", path=str(Path(sys.executable).parent))
                or "lcm-logplayer"
            )
            result = subprocess.run(
                [player, "-s", "4", "-l", exchange, str(tmp_path / "a.lcm")],
                capture_output=True,
                timeout=PATIENCE,
            )
            assert result.returncode == 0
        else:
            result = program("play", tmp_path / "a.lcm", "--speed", "4", "--lcm", exchange)
            assert result.returncode == 0 and f"{len(wanted)} messages, 2 s" in result.stdout

        def played():
            return [
                one
                for one in list(listener.got)
                if one[0] not in ("mark", "ruedo/info", "ruedo/tick", "ruedo/reply")  # play's own
                and not of_nothing(*one)
            ]

        until(lambda: len(played()) >= len(wanted))
        assert played() == wanted
    finally:
        listener.end()


def test_play_warns_about_a_server_at_its_address(tmp_path):
    """Clients would not know whose messages they see."""
    record(tmp_path / "a.lcm", seconds=1)
    world = tmp_path / "empty.sdf"
    world.write_text("<sdf version='1.9'><world name='empty'/></sdf>")
    place = url(7843)
    run = [RUEDO, "run", world, "--quiet", "--paused", "--lcm", place]
    STARTED.append(subprocess.Popen(run, stdout=subprocess.DEVNULL))
    said = f"ruedo: a server is at {place}, too: pid {STARTED[-1].pid}, world empty"
    play = ("play", tmp_path / "a.lcm", "--speed", "max", "--lcm", place)
    until(lambda: program(*play).stderr.startswith(said))


def test_play_is_interrupted_cleanly(tmp_path):
    record(tmp_path / "a.lcm", seconds=2)
    listener = Listener(url(7827))
    process = subprocess.Popen(
        [RUEDO, "play", str(tmp_path / "a.lcm"), "--speed", "0.01", "--lcm", url(7827)],
        stdout=subprocess.PIPE,
        text=True,
    )
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
    result = program(
        "run",
        ARENA,
        *QUICK,
        "--rate",
        "max",
        "--duration",
        "3",
        "--restore",
        snapshot,
        "--record",
        tmp_path / "two.lcm",
        "--lcm",
        url(7829),
    )
    assert result.returncode == 0, result.stderr
    step_us = log_header_t.decode(events(snapshot)[0][2]).step_us
    one, two = events(tmp_path / "one.lcm"), events(tmp_path / "two.lcm")
    stop = next(
        i
        for i, (_, channel, data) in enumerate(one)
        if channel == "ruedo/applied" and one[i][0] >= 250 * step_us
    )
    assert one[:stop] == two[:stop]
    assert program("verify", tmp_path / "two.lcm").returncode == 0

    other = program("run", ARENA, *QUICK, "--no-noise", "--restore", snapshot, "--lcm", url(7829))
    assert other.returncode == 3 and "--no-noise" in other.stderr


def test_a_snapshot_in_the_same_process(tmp_path):
    server = Server(
        7830, "--rate", "max", "--paused", "--snapshots", tmp_path, "--record", tmp_path / "a.lcm"
    )
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
    result = program(
        "verify", tmp_path / "a.lcm"
    )  # without the snapshot's file, which the log does not need
    assert result.returncode == 0, result.stdout + result.stderr


def test_a_snapshot_of_a_past_state(tmp_path):
    """It leads to the state that was there then, whatever came later, and after a reset of the
    time; commands and requests that acted on that very state are not in it.
    """
    server = Server(7868, "--rate", "max", "--paused", "--snapshots", tmp_path)
    with server.connect() as simulation:

        def snapshot(step, epoch, name="past"):
            body = snapshot_request_t()
            body.name, body.epoch, body.step = name, epoch, step
            return simulation._session.request(request_t.SNAPSHOT, body).text

        command(simulation, 0.5, 0.4)
        simulation.step(100)
        then = simulation.state()
        simulation.spawn(text=BOX, x=2.5, y=-1.5, z=1.5)
        command(simulation, 0.1, -0.4)
        simulation.step(100)
        told = shlex.split(snapshot(100, 0))
        assert told[:2] == ["ruedo", "run"] and str(tmp_path / "past.snapshot") in told
        for step, epoch in ((201, 0), (-1, 0), (100, 1)):
            with pytest.raises(ruedo.RequestError, match="allowed are 0 to 200 of epoch 0"):
                snapshot(step, epoch)
        with pytest.raises(ruedo.RequestError, match="is not a name of a snapshot"):
            snapshot(100, 0, "../there")
        simulation.reset(what="time")
        epoch = simulation._info.epoch
        simulation.step(20)
        later = simulation.state()
        simulation.step(30)
        snapshot(20, epoch, "later")
        simulation.quit()
    server.end()
    for name, expected in (("past", then), ("later", later)):
        restored = Server(7869, "--paused", "--restore", tmp_path / f"{name}.snapshot")
        with restored.connect() as simulation:
            until(lambda step=expected.step: simulation.state().step == step)
            assert simulation.state().state_hash == expected.state_hash
            simulation.quit()
        restored.end()


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
    subprocess.run(
        [generator, "-p", "--ppath", str(folder), *map(str, folder.glob("*.lcm"))],
        check=True,
        capture_output=True,
    )
    (folder / "controller.py").write_text(CONTROLLER)
    return folder


def start_controller(bot_core, port, *clock):
    words = [sys.executable, str(bot_core / "controller.py"), url(port), str(bot_core), *clock]
    controller = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    STARTED.append(controller)
    assert controller.stdout.readline() == "ready\n"
    return controller


WAITING = [
    "--remap",
    "p3at/lrf=LASER",
    "--remap",
    "p3at/velocity=VELOCITY",
    "--wait-for",
    "p3at/velocity@10",
    "--set",
    "p3at/lrf.update_rate=10",
    "--rate",
    "max",
]


def test_an_unmodified_controller_runs_repeatably(tmp_path, bot_core):
    logs = []
    for run, clock in enumerate(
        ([], [], ["wall"])
    ):  # the last one stamps its commands by the wall clock
        start_controller(bot_core, 7836 + run, *clock)
        logs.append(tmp_path / f"{run}.lcm")
        result = program(
            "run",
            ARENA,
            *QUICK,
            *WAITING,
            "--duration",
            20,
            "--record",
            logs[-1],
            "--lcm",
            url(7836 + run),
        )
        assert result.returncode == 0, result.stderr
    assert logs[0].read_bytes() == logs[1].read_bytes()
    seen = [[event for event in events(log) if event[1] != "ruedo/applied"] for log in logs]
    assert seen[0] == seen[2] and logs[0].read_bytes() != logs[2].read_bytes()
    found = events(logs[0])
    applied = [stamp for stamp, channel, _ in found if channel == "ruedo/applied"]
    assert applied == [
        k * 100_000 for k in range(200)
    ]  # message k acts on the state of its own scan
    assert {"LASER", "p3at/odometry"} <= {channel for _, channel, _ in found}
    assert program("verify", logs[0]).returncode == 0


def test_a_controller_that_dies_is_reported(bot_core):
    controller = start_controller(bot_core, 7833)
    server = Server(7833, *WAITING)
    assert controller.stdout.readline() == "a second of scans\n"
    controller.kill()
    said, stall = [], "it waits for the input of --wait-for, message"
    while not said or stall not in said[-1]:
        said.append(server.process.stderr.readline())
        assert said[-1], said
    assert "VELOCITY" in said[-1]
    signs = []  # of life, one each second: time enough to say it again
    bus = lcm.LCM(url(7833))
    bus.subscribe("ruedo/info", lambda channel, data: signs.append(data))
    until(lambda: bus.handle_timeout(100) and len(signs) >= 3)
    code, errors = server.end(signal.SIGINT)
    # Each missing message is reported once; so is a slow controller.
    stalls = [line.strip() for line in said + errors.splitlines() if stall in line]
    assert code == 0 and len(set(stalls)) == len(stalls), stalls


@pytest.mark.parametrize(
    "value, words",
    [
        ("p3at/velocty@10", "did you mean 'p3at/velocity'"),
        ("p3at/velocity", "CHANNEL@HZ"),
        ("p3at/velocity@0", "CHANNEL@HZ"),
        ("p3at/lrf@10", "no input channel"),
        ("p3at/velocity@x", "CHANNEL@HZ"),
    ],
)
def test_wait_for_is_read_strictly(value, words):
    result = program("run", ARENA, *QUICK, "--wait-for", value, "--lcm", url(7834))
    assert result.returncode == 2 and words in result.stderr
