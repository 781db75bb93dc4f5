"""RESTORE of a state, and a server that begins with one: what follows is what followed, whatever is
in the world. The worlds and commands are those of test_snapshots.py.
"""

import os
import subprocess
import time
from functools import partial

import pytest
import ruedo
from ruedo import lcmtypes
from snapshots import Commands, RandomWorld, joint_names

RUEDO = os.environ["RUEDO"]
PATIENCE = 400  # s


class Listener:
    """All that is published; of ruedo/world without the epoch."""

    def __init__(self, url):
        self.simulation = ruedo.connect(url, timeout=PATIENCE)
        self.got = []
        for channel in self.simulation._info.channel_list:
            if not channel.input:
                self.simulation._connection.bus.subscribe(
                    channel.name, partial(self.hear, channel.name)
                )

    def hear(self, channel, data):
        data = bytes(data)
        if channel == "ruedo/world":
            self.got.append((channel, data[:16] + data[20:]))
        elif not channel.startswith("ruedo/"):
            self.got.append((channel, data))

    def since(self, begin):
        """What came up to now: an answer comes behind what was published before it."""
        self.simulation.state()
        return self.got[begin:]


def decide(simulation, commands, decisions, steps):
    bus = simulation._connection.bus
    for decision in decisions:
        velocities, others = commands[decision]
        for name, velocity in zip(commands.robots, velocities):
            if velocity[0] == velocity[0]:
                message = lcmtypes.velocity_command_t()
                message.vx, message.vy, message.omega = velocity
                bus.publish(name + "/velocity", message.encode())
        for channel, message in others:
            bus.publish(channel, message.encode())
        simulation.state()  # sent behind the commands: when it is answered, the server has them
        simulation.step(steps)


class Server:
    """Of a world in a folder; the user's key is in that of `user`."""

    def __init__(self, folder, options, user="me"):
        self.url = f"unix://{folder}/bus"
        (folder / "bus").unlink(missing_ok=True)
        self.said = folder / f"{user}.txt"
        with self.said.open("w") as said:
            self.process = subprocess.Popen(
                [RUEDO, "run", folder / "w.sdf", "--paused", "--rate=max", "--snapshots", folder]
                + ["--lcm", self.url, *options],
                env={**os.environ, "XDG_STATE_HOME": str(folder / user)},
                stdout=said,
                stderr=subprocess.STDOUT,
            )
        while not (folder / "bus").exists():
            assert self.process.poll() is None, self.said.read_text()
            time.sleep(0.02)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.process.kill()
        self.process.wait()

    @property
    def ran_again(self):
        return "re-simulating" in self.said.read_text()


@pytest.mark.parametrize("seed", [1, 2, 3, 7, 9, 12])
def test_random_worlds_continue_equally_after_a_restore(seed, tmp_path):
    world = RandomWorld(seed, pictures=seed % 4 == 1)
    (tmp_path / "w.sdf").write_text(world.text)
    with ruedo.Engine(
        "w.sdf",
        text=world.text,
        spawn=world.spawn,
        fault=world.fault,
        record=True,
        allow_errors=True,
    ) as engine:
        joints = joint_names(engine)
        before, then = (Commands(10 * seed + i, engine, joints) for i in range(2))
    options = [f"--spawn={one}" for one in world.spawn] + [f"--fault={one}" for one in world.fault]

    def go_on(simulation, listener):
        begin = len(listener.since(0))
        decide(simulation, then, range(6), 25)
        return listener.since(begin)

    with Server(tmp_path, options) as server:
        with ruedo.connect(server.url, timeout=PATIENCE) as simulation:
            listener = Listener(server.url)
            decide(simulation, before, range(8), 40)
            saved = simulation.snapshot("here")
            followed = go_on(simulation, listener)
            assert len(followed) > 100
            for where in ("the same world", "another seed's", "from the file"):
                if where == "another seed's":
                    simulation.reset(seed=77)
                    simulation.step(30)
                if where == "from the file":
                    os.utime(tmp_path / "here.snapshot")
                back = simulation.restore("here")
                assert (back.step, back.state_hash) == (saved.step, saved.state_hash)
                assert go_on(simulation, listener) == followed, where
            twice = simulation.snapshot("twice")
            later = go_on(simulation, listener)
    for user, name, state, then_followed in (
        ("me", "here", saved, followed),
        ("me", "twice", twice, later),
        ("somebody", "twice", twice, later),
    ):
        snapshot = tmp_path / f"{name}.snapshot"
        with Server(tmp_path, [*options, "--restore", snapshot], user) as server:
            with ruedo.connect(server.url, timeout=PATIENCE) as simulation:
                listener = Listener(server.url)
                back = simulation.state()
                while back.step < state.step:  # it runs there again
                    back = simulation.state()
                assert (back.step, back.state_hash) == (state.step, state.state_hash)
                assert go_on(simulation, listener) == then_followed, (user, name)
            assert server.ran_again == (user != "me" or bool(world.fault)), (user, name)
