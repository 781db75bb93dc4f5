"""RESTORE of a state that the server itself saved: what follows is what followed, whatever is in
the world. The worlds and commands are those of test_snapshots.py.
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


@pytest.mark.parametrize("seed", [1, 2, 3, 7, 9, 12])
def test_random_worlds_go_on_as_they_went_on(seed, tmp_path):
    world = RandomWorld(seed, pictures=seed % 4 == 1)
    file = tmp_path / "w.sdf"
    file.write_text(world.text)
    with ruedo.Engine(
        "w.sdf", text=world.text, spawn=world.spawn, fault=world.fault, record=True
    ) as engine:
        joints = joint_names(engine)
        before, then = (Commands(10 * seed + i, engine, joints) for i in range(2))
    options = [f"--spawn={one}" for one in world.spawn] + [f"--fault={one}" for one in world.fault]
    url = f"unix://{tmp_path}/bus"
    server = subprocess.Popen(
        [RUEDO, "run", file, "--paused", "--rate=max", "--quiet", "--snapshots", tmp_path]
        + ["--lcm", url, *options]
    )
    try:
        while not (tmp_path / "bus").exists():
            assert server.poll() is None
            time.sleep(0.02)
        with ruedo.connect(url, timeout=PATIENCE) as simulation:
            listener = Listener(url)

            def go_on():
                begin = len(listener.since(0))
                decide(simulation, then, range(6), 25)
                return listener.since(begin)

            decide(simulation, before, range(8), 40)
            saved = simulation.snapshot("here")
            followed = go_on()
            assert len(followed) > 100
            for where in ("the same world", "another seed's", "there again"):
                if where == "another seed's":
                    simulation.reset(seed=77)
                    simulation.step(30)
                if where == "there again":
                    os.utime(tmp_path / "here.snapshot")  # so that it is read
                back = simulation.restore("here")
                assert (back.step, back.state_hash) == (saved.step, saved.state_hash)
                assert go_on() == followed, where
            simulation.quit()
        server.wait(PATIENCE)
    finally:
        server.kill()
        server.wait()
