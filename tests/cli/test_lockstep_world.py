"""Lockstep with models that come and go and snapshots; logs that know the files they were made
from; a server that is killed.
"""

import os
import signal
import subprocess
import threading
from pathlib import Path

import lcm
import pytest
import ruedo
from ruedo.lcmtypes import velocity_command_t

RUEDO = os.environ["RUEDO"]
SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
ARENA = str(SOURCE / "worlds" / "arena.sdf")
HALL = str(SOURCE / "tests" / "clients" / "hall.sdf")
QUICK = ["--disable", "p3at/camera", "--quiet"]
PATIENCE = 400  # s, for what comes sooner or later, on a machine that does much else too
BOX = (
    "<sdf version='1.9'><model name='crate'><link name='link'><inertial><mass>3</mass></inertial><collision name='c'><geometry>"
    "<box><size>0.3 0.3 0.3</size></box></geometry></collision></link></model></sdf>"
)


def url(port):
    return f"udpm://239.255.76.67:{port}?ttl=0&recv_buf_size=2097152"


def program(*arguments):
    return subprocess.run(
        [RUEDO, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE
    )


STARTED = []


def serve(port, *arguments, world=ARENA, quick=QUICK):
    STARTED.append(
        subprocess.Popen(
            [RUEDO, "run", str(world), *quick, "--lcm", url(port), *map(str, arguments)],
            stderr=subprocess.PIPE,
            text=True,
        )
    )
    return STARTED[-1]


@pytest.fixture(autouse=True)
def no_server_outlives_its_test():
    yield
    for server in STARTED:
        server.kill()
        server.wait()
    STARTED.clear()


def published(log):
    """The messages of every published channel in a log: equal for equal runs."""
    return [
        (event.timestamp, event.channel, event.data)
        for event in lcm.EventLog(str(log), "r")
        if event.channel not in ("ruedo/header", "ruedo/applied", "ruedo/state_hash")
    ]


def in_lockstep(port, log, clients):
    """Two robots' worth of changes at fixed steps, by the first of `clients`; all of them step
    beside it.
    """
    steps, length = 120, 6
    server = serve(
        port,
        "--lockstep",
        clients,
        "--lease",
        PATIENCE,
        "--duration",
        steps * 0.005,
        "--record",
        log,
        world=HALL,
    )
    meet = threading.Barrier(clients)
    seen, names = {}, []

    def act(simulation, step):
        if step == 30:
            names.append(simulation.spawn("p3at", 3.0, 1.0, 0.5))
            names.append(simulation.spawn(text=BOX, x=-3.0, y=2.0, z=1.0))
        elif step == 60:
            simulation.set_pose("p3at", 0.5, -0.5, 1.0)
        elif step == 90:
            simulation.remove("p3at_2")

    def drive(index):
        with ruedo.connect(url(port), timeout=PATIENCE, name=f"client{index}") as simulation:
            robot = simulation.robot("p3at")
            messages = []
            for step in range(0, steps, length):
                if index == 0:
                    act(simulation, step)
                meet.wait(PATIENCE)  # a change acts on the state that all have come to
                commands = [robot.velocity_command(0.3, 0.1 * index).at(k) for k in range(length)]
                if index == 0 and 30 <= step < 90:
                    commands.append(simulation.robot("p3at_2").velocity_command(0.2, -0.2))
                messages += simulation.step(length, commands, PATIENCE).messages
                meet.wait(PATIENCE)
            seen[index] = messages

    threads = [threading.Thread(target=drive, args=(i,)) for i in range(clients)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    assert sorted(seen) == list(range(clients))
    server.communicate(timeout=PATIENCE)
    assert server.returncode == 0
    assert names == ["p3at_2", "crate"]
    assert all(seen[i] == seen[0] for i in seen)
    return seen[0]


@pytest.mark.parametrize("clients", [1, 2])
def test_changes_in_lockstep_repeat_and_verify(tmp_path, clients):
    runs = [
        in_lockstep(7900 + clients, tmp_path / f"{name}.lcm", clients) for name in ("one", "two")
    ]
    assert runs[0] == runs[1]
    of_guest = [message.step for message in runs[0] if message.channel == "p3at_2/pose"]
    assert (min(of_guest), max(of_guest)) == (
        31,
        87,
    )  # 50 Hz from the first state that shows it, to before its removal
    assert published(tmp_path / "one.lcm") == published(tmp_path / "two.lcm")
    verified = program("verify", tmp_path / "one.lcm")
    assert verified.returncode == 0, verified.stdout + verified.stderr
    assert "repeated byte for byte" in verified.stdout


def test_lockstep_continues_from_a_snapshot(tmp_path):
    def drive(simulation, steps):
        robot = simulation.robot("p3at")
        return [simulation.step(1, [robot.velocity_command(0.3, 0.2)]) for _ in range(steps)]

    server = serve(
        7903,
        "--lockstep",
        1,
        "--snapshots",
        tmp_path,
        "--record",
        tmp_path / "whole.lcm",
        "--duration",
        0.5,
    )
    with ruedo.connect(url(7903), timeout=PATIENCE) as simulation:
        drive(simulation, 40)
        simulation.snapshot("here")
        with pytest.raises(ruedo.RuedoError, match="start one with --restore"):
            simulation.restore("here")
        uninterrupted = drive(simulation, 60)
    server.communicate(timeout=PATIENCE)
    server = serve(
        7903,
        "--lockstep",
        1,
        "--restore",
        tmp_path / "here.snapshot",
        "--record",
        tmp_path / "rest.lcm",
        "--duration",
        0.5,
    )
    with ruedo.connect(url(7903), timeout=PATIENCE) as simulation:
        restored = drive(simulation, 60)
    server.communicate(timeout=PATIENCE)
    assert server.returncode == 0
    assert restored[0].step == 41
    for then, now in zip(uninterrupted, restored):
        assert (then.step, then.state_hash, then.messages) == (
            now.step,
            now.state_hash,
            now.messages,
        )
    # Every channel, beyond what the client saw: all after the snapshot's state.
    after = [event for event in published(tmp_path / "whole.lcm") if event[0] > 200_000]
    assert after and after == [
        event for event in published(tmp_path / "rest.lcm") if event[0] > 200_000
    ]
    assert program("verify", tmp_path / "rest.lcm").returncode == 0


def test_every_message_after_a_restore_in_the_same_process(tmp_path):
    """Of all channels: what follows a restore is what followed the snapshot."""
    log = tmp_path / "log.lcm"
    server = serve(
        7904,
        "--rate",
        "max",
        "--paused",
        "--snapshots",
        tmp_path,
        "--record",
        log,
        quick=["--quiet"],
    )
    with ruedo.connect(url(7904), timeout=PATIENCE) as simulation:
        simulation.spawn(text=BOX, x=2.5, y=-1.5, z=1.5)
        message = velocity_command_t()
        message.vx, message.omega = 0.4, 0.3
        lcm.LCM(url(7904)).publish("p3at/velocity", message.encode())  # once: nothing repeats it
        simulation.state()  # sent behind the command: when it is answered, the server has that
        simulation.step(80)
        simulation.snapshot("here")
        simulation.step(120)
        simulation.restore("here")
        simulation.step(120)
        simulation.quit()
    server.communicate(timeout=PATIENCE)
    # (time, channel, message); of ruedo/world without the epoch, its first member after the time
    found = [
        (
            int.from_bytes(data[8:16], "big"),
            channel,
            data[:16] + data[20:] if channel == "ruedo/world" else data,
        )
        for _, channel, data in published(log)
    ]
    begins = [
        i for i, (utime, *_) in enumerate(found) if utime == 0 and (i == 0 or found[i - 1][0] > 0)
    ]
    assert len(begins) == 2
    first, again = (
        [one for one in part if one[0] > 80 * 5000]
        for part in (found[: begins[1]], found[begins[1] :])
    )
    assert {
        f"p3at/{device}"
        for device in (
            "lrf",
            "sonar_front",
            "sonar_rear",
            "camera",
            "odometry",
            "pose",
            "motion",
            "collisions",
        )
    } < {channel for _, channel, _ in first}
    assert first == again
    assert program("verify", log).returncode == 0


MESH_WORLD = """<sdf version='1.9'><world name='w'><include><uri>model://ground_plane</uri></include>
<model name='part'><static>true</static><link name='l'><collision name='c'><geometry><mesh><uri>part.obj</uri></mesh></geometry></collision>
<visual name='v'><geometry><mesh><uri>part.obj</uri></mesh></geometry></visual></link></model></world></sdf>"""
OBJ = "mtllib part.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl m\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def touch_up(path):
    """One byte of a comment: the same mesh, another file."""
    path.write_bytes(path.read_bytes() + b"#")


@pytest.mark.parametrize("changed", ["part.obj", "part.mtl", "part.png"])
def test_a_changed_mesh_is_reported_first(tmp_path, changed):
    (tmp_path / "part.obj").write_text(OBJ)
    (tmp_path / "part.mtl").write_text("newmtl m\nKd 1 0 0\nmap_Kd part.png\n")
    (tmp_path / "part.png").write_bytes(b"no picture, but a file")
    world, log = tmp_path / "w.sdf", tmp_path / "log.lcm"
    world.write_text(MESH_WORLD)
    assert (
        program(
            "run",
            world,
            "--quiet",
            "--rate",
            "max",
            "--duration",
            0.1,
            "--record",
            log,
            "--lcm",
            url(7905),
        ).returncode
        == 0
    )
    assert program("verify", log).returncode == 0
    touch_up(tmp_path / changed)
    result = program("verify", log)
    assert result.returncode == 3
    assert changed in result.stderr and "was changed since" in result.stderr


def test_a_changed_mesh_of_a_spawned_model_is_reported(tmp_path):
    world, log = tmp_path / "w.sdf", tmp_path / "log.lcm"
    world.write_text(
        "<sdf version='1.9'><world name='w'><include><uri>model://ground_plane</uri></include></world></sdf>"
    )
    (tmp_path / "guest.obj").write_text(OBJ.replace("part", "guest"))
    (tmp_path / "guest.sdf").write_text(
        "<sdf version='1.9'><model name='guest'><link name='l'><inertial><mass>1</mass></inertial><collision name='c'>"
        "<geometry><mesh><uri>guest.obj</uri></mesh></geometry></collision></link></model></sdf>"
    )
    server = serve(
        7906, "--rate", "max", "--paused", "--record", log, world=world, quick=["--quiet"]
    )
    with ruedo.connect(url(7906), timeout=PATIENCE) as simulation:
        assert simulation.spawn("guest.sdf", 0.0, 0.0, z=1.0) == "guest"
        assert simulation.spawn("guest.sdf", 3.0, 0.0, z=1.0) == "guest_2"
        simulation.step(20)
        simulation.quit()
    server.communicate(timeout=PATIENCE)
    assert program("verify", log).returncode == 0
    touch_up(tmp_path / "guest.obj")
    result = program("verify", log)
    assert result.returncode == 3
    assert "guest.obj" in result.stderr and "was changed since" in result.stderr


def test_a_killed_server_is_noticed():
    server = serve(7907)
    with ruedo.connect(url(7907), timeout=PATIENCE) as simulation:
        simulation.sleep(0.1)
        server.send_signal(signal.SIGSTOP)  # a debugger, say: no client has left
        lrf = simulation.robot("p3at").lrf
        with pytest.raises(ruedo.Timeout):
            while True:  # some are under way
                lrf.next(timeout=7.0)
        server.send_signal(signal.SIGCONT)
        simulation.sleep(0.1)
        server.kill()
        with pytest.raises(ruedo.NoServer, match="nothing was heard"):
            simulation.sleep(1e9)  # for ever, if it were not noticed
