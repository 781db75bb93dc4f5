"""Python as people expect it: arguments, worlds by name and by building, samples as values, errors
for wrong types, forks, logs.
"""

import contextlib
import copy
import gc
import math
import os
import pickle
import re
import resource
import struct
import subprocess
import sys
import threading
import time
import types
import warnings
import zlib
from functools import partial

import lcm
import numpy as np
import pytest
import ruedo
from conftest import HALL, PATIENCE, free_url, ruedo_run, tcp_server
from ruedo import lcmtypes, samples
from ruedo.decoding import decode
from ruedo.launching import _options
from ruedo.session.control import Session
from ruedo.transport.address import read_address
from ruedo.transport.multicast import MulticastTransport

QUICK = {"disable": ["p3at/camera"], "timeout": PATIENCE}


def scan(*ranges, utime=1):
    message = ruedo.lcmtypes.planar_lidar_t()
    message.utime, message.nranges, message.ranges, message.rad0, message.radstep = (
        utime,
        len(ranges),
        list(ranges),
        -0.5,
        0.25,
    )
    return samples.CONVERSIONS["planar_lidar_t"][1](message)


def test_multicast_messages_reach_lcm():
    """Of any size, around the largest datagram, of which "A/1" and its 0 take four bytes."""
    url = f"{free_url()}&recv_buf_size=8388608"
    heard, bus = [], lcm.LCM(url)
    bus.subscribe(".*", lambda channel, data: heard.append((channel, data)))
    transport = MulticastTransport(read_address(url))
    for size in (0, 1, 63_995, 63_996, 63_997, 127_996, 127_997, 640 * 480 * 3):
        data = bytes(i * 31 >> 3 & 255 for i in range(size))
        transport.publish("A/1", data)
        while not heard:
            assert bus.handle_timeout(int(1000 * PATIENCE)) > 0
        assert heard.pop() == ("A/1", data)
    transport.close()
    transport.publish("A/1", b"")  # after its end it is lost


def test_samples_are_values():
    one, same, other, later = (
        scan(1.0, math.inf),
        scan(1.0, math.inf),
        scan(1.0, 2.0),
        scan(1.0, math.inf, utime=2),
    )
    assert one == same and hash(one) == hash(same) and one in {same}
    assert one != other and one != later and one != "a scan" and len({one, same, other, later}) == 3
    assert (
        scan(math.nan) == scan(math.nan)
        and scan(0.0) == scan(-0.0)
        and hash(scan(0.0)) == hash(scan(-0.0))
    )
    assert samples.Imu(1, np.zeros(4), np.zeros(3), np.ones(3)) != samples.Imu(
        1, np.zeros(4), np.zeros(3), np.zeros(3)
    )


def filled(message_type):
    """With something of all that has a length."""
    message = message_type()
    for name, of, sizes in zip(
        message.__slots__, message.__typenames__, message.__dimensions__, strict=True
    ):
        kinds = {"string": "word", "byte": b"ab", "boolean": True, "float": 1.5, "double": 1.5}
        own = getattr(ruedo.lcmtypes, of.rpartition(".")[2], None)
        one = filled(own) if own else kinds.get(of, 2)
        for size in reversed(sizes or []):  # those with names are 2, as all numbers are
            one = b"ab" if of == "byte" else [one] * (2 if isinstance(size, str) else size)
        setattr(message, name, one)
    return message


@pytest.mark.parametrize("name", [name for name in dir(ruedo.lcmtypes) if name.endswith("_t")])
def test_a_truncated_message_does_not_decode(name):
    message_type = getattr(ruedo.lcmtypes, name)
    data = filled(message_type).encode()
    assert decode(message_type, data).encode() == data
    for size in range(len(data)):
        with pytest.raises((ValueError, struct.error)):
            decode(message_type, data[:size])
    with pytest.raises(ValueError, match="1 bytes too many"):
        decode(message_type, data + b"\0")


def test_samples_cannot_be_written_into():
    for array in (scan(1.0).ranges, scan(1.0).angles, scan(1.0).intensities):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 8.0
    with pytest.raises(AttributeError):
        scan(1.0).utime = 3


def test_they_are_shown_in_a_line():
    assert (
        repr(scan(*[1.5] * 180, math.inf))
        == "Scan(utime=1, ranges=<181, 1.5 to 1.5>, angles=<181, -0.5 to 44.5>, intensities=[])"
    )
    picture = samples.Image(5, 200, 200, "jpeg", 0, bytes(40000))
    assert (
        repr(picture)
        == "Image(utime=5, width=200, height=200, format='jpeg', row_stride=0, data=<40000 bytes>)"
    )


def test_arguments_instead_of_options():
    said = _options(
        3,
        "max",
        ["--record", "x"],
        True,
        ["p3at@0,0"],
        ["p3at/camera"],
        {"p3at/lrf.rate": 20, "p3at/lrf.on": True},
        False,
    )
    assert said == [
        "--seed",
        "3",
        "--rate",
        "max",
        "--lockstep",
        "1",
        "--spawn",
        "p3at@0,0",
        "--disable",
        "p3at/camera",
        "--set",
        "p3at/lrf.rate=20",
        "--set",
        "p3at/lrf.on=true",
        "--no-noise",
        "--record",
        "x",
    ]


@pytest.mark.parametrize(
    "wrong, says",
    [
        (
            {"args": "--lockstep 1"},
            r"args is '--lockstep 1': it must be a list, args=\['--lockstep', '1'\]",
        ),
        ({"disable": "p3at/camera"}, "disable is 'p3at/camera': it must be a list"),
        ({"settings": ["p3at/lrf.rate=20"]}, "settings is .*: it must be a dict"),
        ({"text": "<sdf/>"}, "either a world or its text"),
        ({"spawn": [5]}, "spawn is a list of texts; 5 is not a text"),
        ({"spawn": None}, "spawn is a list of texts, not None"),
        ({"lockstep": 1.5}, "lockstep is a whole number, not 1.5"),
        ({"seed": "x"}, "seed is a whole number, not 'x'"),
        ({"noise": "no"}, "noise is True or False, not 'no'"),
        ({"timeout": "long"}, "timeout is a number, not 'long'"),
    ],
)
def test_errors_of_arguments_give_the_right_form(wrong, says):
    with pytest.raises(TypeError, match=says):
        ruedo.launch(HALL, **wrong)


def test_a_file_that_is_not_a_world_is_refused():
    for call, says in (
        (lambda: ruedo.launch(5), "world is a file, the name of a world or a World, not 5"),
        (lambda: ruedo.launch(text=5), "text is a text, not 5"),
        (lambda: ruedo.World().robot(5), "model is a text, not 5"),
    ):
        with pytest.raises(TypeError, match=says):
            call()


@pytest.mark.parametrize(
    "call, says",
    [
        (lambda sim: sim.spawn(5), "model is a text, not 5"),
        (lambda sim: sim.spawn("p3at", "left"), "x is a number, not 'left'"),
        (lambda sim: sim.set_pose("p3at", 0.0, None), "y is a number, not None"),
        (lambda sim: sim.set_twist("p3at", 1.0), "linear is 3 numbers, not 1.0"),
        (lambda sim: sim.state(5), "name is a text, not 5"),
        (lambda sim: sim.step(0).latest("lrf"), "expected a device or stream.*not 'lrf'"),
        (
            lambda sim: sim.step(2, [5]),
            "expected a command, as robot.velocity_command.* makes it, not 5",
        ),
        (lambda sim: sim.step(2, 5), "commands is a list of what robot.velocity_command.*not 5"),
        (lambda sim: sim.step(2, sim.robot("p3at")), "commands is a list.*not <Robot p3at"),
        (lambda sim: sim.robot("p3at").velocity_command("a", 0), "v is a number, not 'a'"),
        (lambda sim: sim.robot("p3at").set_velocity(0.1, None), "omega is a number, not None"),
        (lambda sim: sim.robot("p3at").advance("1"), "value is a number, not '1'"),
        (lambda sim: sim.robot("p3at").advance(1, speed="1"), "speed is a number, not '1'"),
        (lambda sim: sim.robot("p3at").rotate("90"), "angle is a number, not '90'"),
        (lambda sim: sim.reset(seed="x"), "seed is a whole number, not 'x'"),
        (lambda sim: sim.robot("p3at").on_collision(5), "a callback is a function.*not 5"),
        (lambda sim: sim.robot("p3at").lrf.on_sample(5), "a callback is a function.*not 5"),
        (lambda sim: sim.on_new_run(5), "a callback is a function.*not 5"),
        (lambda sim: scan(1.0).points("world"), "expected a device or a pose.*not 'world'"),
        (lambda sim: scan(1.0).points(sim.robot("p3at").lrf, 5), "expected a.* pose.*not 5"),
        (lambda sim: sim.set_rate("fast"), "rate is a number, not 'fast'"),
    ],
)
def test_type_errors_of_calls_give_the_right_type(call, says):
    with ruedo.launch(HALL, lockstep=1, **QUICK) as sim, pytest.raises(TypeError, match=says):
        call(sim)


POST = """<sdf version="1.9"><world name="w"><model name="post"><static>true</static><link name="base">
<sensor name="lrf" type="gpu_lidar"><pose>0 0 1 0 0 0</pose><update_rate>10</update_rate><lidar><scan>
<horizontal><samples>31</samples><min_angle>-1</min_angle><max_angle>1</max_angle></horizontal></scan>
<range><min>0.1</min><max>8</max></range></lidar></sensor></link></model></world></sdf>"""


def test_a_robot_without_a_drive_has_faults():
    with ruedo.launch(text=POST) as sim:
        robot = sim.robot("post")
        assert robot.drive == "" and robot.lrf.latest(PATIENCE).ranges.max() == math.inf
        robot.inject("blocked", "lrf", value=0.5)
        while robot.lrf.next(PATIENCE).ranges.max() == math.inf:
            pass
        with pytest.raises(ruedo.NotSupported, match="^post cannot be driven: its model has no"):
            robot.set_velocity(0.1, 0.0)
    with ruedo.launch(text=POST, lockstep=1) as sim:
        robot = sim.robot("post")
        with pytest.raises(
            ruedo.NotSupported, match=r"sim.step\(n, \[robot.fault_command\('blocked', ...\)\]\)$"
        ):
            robot.inject("blocked", "lrf", value=0.5)
        seen = sim.step(100, [robot.fault_command("blocked", "lrf", value=0.5)])
        assert [scan.ranges.max() for scan in seen.all(robot.lrf)] == [math.inf] + 5 * [0.5]


def test_a_reader_counts_what_it_skips():
    with ruedo.launch(HALL, lockstep=1, **QUICK) as sim:
        odometry = sim.robot("p3at").odometry  # every 20 ms, which are 4 steps
        with pytest.raises(ruedo.Timeout):
            odometry.latest(timeout=0.01)  # subscribes
        for steps, skipped in ((20, 0), (20, 4), (4, 4), (40, 13)):
            seen = sim.step(steps).latest(odometry)
            assert odometry.latest(PATIENCE).utime == seen.utime
            assert odometry.dropped == skipped


class SlowSocket:
    """A connection whose publish() does not return before the reply has been received."""

    info = types.SimpleNamespace(run_id=7, version="1", features=-1)
    clock = types.SimpleNamespace(utime=0)

    def __init__(self):
        self.bus, self.kinds, self.waited = self, [], []
        self.session = Session(self, "slow")

    def publish(self, channel, data):
        request = decode(lcmtypes.request_t, data)
        reply = lcmtypes.reply_t()
        reply.run_id, reply.kind, reply.sequence = request.run_id, request.kind, request.sequence
        reply.session = 3
        self.kinds.append(request.kind)
        receiving = threading.Thread(
            target=self.session.receive, args=(reply.encode(),), daemon=True
        )
        receiving.start()
        receiving.join(60.0)
        self.waited.append(receiving.is_alive())

    def is_of_our_run(self, run_id):
        return run_id == 7

    def server_has_ended(self):
        return False

    def check_open(self):
        pass

    check_may_wait = check_server = check_open


def test_replies_are_received_while_a_request_is_sent():
    socket = SlowSocket()
    kinds = lcmtypes.request_t
    socket.session.request(kinds.PAUSE, timeout=PATIENCE)
    socket.session.leave()
    assert socket.kinds == [kinds.JOIN, kinds.PAUSE, kinds.LEAVE]
    assert socket.waited == [False] * 3


def test_a_timeout_in_lockstep_advises_to_step():
    with ruedo.launch(HALL, lockstep=1, **QUICK) as sim:
        robot = sim.robot("p3at")
        with pytest.raises(ruedo.Timeout, match=r"in lockstep.*sim\.step\(20\)\.latest\(robot"):
            robot.lrf.next(timeout=0.2)


def test_clients_that_start_number_their_primitives_apart():
    """Whether they have a name of their own, the same one, or none."""
    with ruedo_run("--paused", world=HALL) as server, contextlib.ExitStack() as all_of_them:
        ids = []
        for name in 8 * [None, "driver", "guest"]:
            sim = all_of_them.enter_context(ruedo.connect(server.url, name=name, timeout=PATIENCE))
            stop = sim.robot("p3at").move_command("stop", 0.0)
            ids.append(lcmtypes.move_command_t.decode(stop.data).id)
        assert len(set(ids)) == 24


def test_equal_runs_in_lockstep_number_their_primitives_alike():
    """Their logs have these numbers."""
    ids = []
    for _ in range(2):
        with ruedo.launch(HALL, lockstep=1, **QUICK) as sim:
            sim.step(10)
            with (
                ruedo.connect(sim.url, name="guest", timeout=PATIENCE) as guest,
                ruedo.connect(sim.url, name="guest", timeout=PATIENCE) as its_like,
            ):
                stops = [
                    each.robot("p3at").move_command("stop", 0.0) for each in (sim, guest, its_like)
                ]
                ids.append([lcmtypes.move_command_t.decode(stop.data).id for stop in stops])
    assert ids[0] == ids[1] and len(set(ids[0])) == 3


@pytest.mark.parametrize("options", [{"lockstep": 1}, {"url": "auto"}])
def test_a_closed_simulation_leaves_nothing_open(options):
    """No file and no socket is left to the garbage collector, which pytest and `python -X dev`
    would report; the errors of a server that ended are still told.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        faults = []
        sys.unraisablehook, before = lambda one: faults.append(one.exc_value), sys.unraisablehook
        try:
            with ruedo.launch(HALL, **options, **QUICK) as sim:
                sim.robot("p3at").lrf.on_sample(lambda scan: None)
                sim.step(20) if sim.lockstep else sim.state()
            del sim
            with pytest.raises(ruedo.LaunchError, match="--set p3at/lrf.x"):
                ruedo.launch(HALL, settings={"p3at/lrf.x": 1}, **options, **QUICK)
            gc.collect()
        finally:
            sys.unraisablehook = before
    assert faults == []


def test_worlds_are_found_by_name():
    with ruedo.launch("arena", rate="max", **QUICK) as sim:
        assert sim.world == "arena"
    with pytest.raises(ruedo.LaunchError, match="exit code 3.*arenna"):
        ruedo.launch("arenna")


def test_a_world_is_built_and_run():
    """A wall whose face is 3 m ahead of the robot, which carries its LRF 0.16 m ahead of its
    middle; a ball's worth of a box.
    """
    world = (
        ruedo.World("mine")
        .wall(3.05, -2, 3.05, 2)
        .box(0.0, 2.0, mass=3.0, name="crate")
        .cylinder(0.0, -2.0)
        .robot("p3at")
    )
    with ruedo.launch(world, lockstep=1, noise=False, **QUICK) as sim:
        assert sim.world == "mine" and [robot.name for robot in sim.robots] == ["p3at"]
        assert {body.name: body.mass for body in sim.bodies if body.name.startswith("crate")} == {
            "crate/link": 3.0
        }
        seen = sim.step(0)
        assert seen.latest(sim.robot("p3at").lrf).nearest(-0.05, 0.05) == pytest.approx(
            3.0 - 0.16, abs=1e-3
        )
        assert repr(seen) == f"Observations(step=0, time=0, {len(seen.messages)} messages)"
        with pytest.raises(
            TypeError, match="n is 2.5: it must be a whole number of steps; 0.005 s is one"
        ):
            sim.step(2.5)
        with pytest.raises(TypeError, match=r"put it into a list, \[command\]"):
            sim.step(2, sim.robot("p3at").velocity_command(0.1, 0.0))
        with pytest.raises(TypeError, match="timeout is 'lrf'"):
            sim.robot("p3at").lrf.latest("lrf")
        assert sim.step(np.int64(2)).step == 2


@pytest.mark.parametrize(
    "call",
    [
        lambda: ruedo.World().box(math.nan, 0.0),
        lambda: ruedo.World().box(0, 0, size=(1, 0, 1)),
        lambda: ruedo.World().wall(1, 1, 1, 1),
        lambda: ruedo.World().cylinder(0, 0, mass=-1),
        lambda: ruedo.World(step=0.0),
    ],
)
def test_a_world_of_nonsense_is_refused(call):
    with pytest.raises(ValueError, match="it must be"):
        call()


def test_the_text_of_a_world():
    with ruedo.launch(text=open(HALL).read(), rate="max", **QUICK) as sim:
        assert sim.world == "hall"


async def coroutine(sample):
    await NotImplemented


async def coroutines(sample):
    yield


def generator(sample):
    yield


class Awaited:
    async def __call__(self, sample):
        await NotImplemented


@pytest.mark.parametrize(
    "callback", [coroutine, coroutines, generator, Awaited(), partial(coroutine)], ids=repr
)
def test_a_coroutine_function_is_refused_as_a_callback(callback):
    with ruedo.launch(HALL, lockstep=1, **QUICK) as sim:
        robot = sim.robot("p3at")
        for register in robot.lrf.on_sample, robot.on_collision, sim.on_new_run:
            with pytest.raises(TypeError, match="a callback is a plain function.*would never run"):
                register(callback)


@pytest.mark.parametrize("made", [coroutine, generator])
def test_an_unawaited_coroutine_of_a_callback_is_an_error(made):
    with (
        pytest.raises(TypeError, match="a callback returned .* which nothing runs"),
        ruedo.launch(HALL, lockstep=1, **QUICK) as sim,
    ):
        sim.robot("p3at").odometry.on_sample(lambda sample: (made(sample), None)[0])
        sim.step(100)


def test_callbacks_are_taken_back_and_readers_do_not_meet():
    with ruedo.launch(HALL, **QUICK) as sim:
        odometry = sim.robot("p3at").odometry
        heard, failing = [], []

        def fail(sample):
            failing.append(sample)
            if len(failing) == 1:
                sys.exit("a callback wants to end the program")

        with odometry.on_sample(heard.append), odometry.on_sample(fail) as failed:
            with pytest.raises(
                ruedo.RuedoError,
                match=r"a callback on p3at/odometry raised SystemExit\('a callback",
            ):
                while True:
                    odometry.next(PATIENCE)
            while len(heard) < 3 or len(failing) < 2:
                odometry.next(PATIENCE)
        count = len(heard)
        assert failed.closed and "closed" in repr(failed)
        first, second = odometry.reader(), odometry.reader()
        for reader in (first, second):
            now = reader.next(PATIENCE)
            assert reader.next(PATIENCE).utime > now.utime
        assert len(heard) == count and len(failing) >= 2
        sim.close()
        for call in (
            odometry.latest,
            odometry.next,
            first.next,
            sim.pause,
            sim.state,
            lambda: sim.sleep(1.0),
            lambda: sim.step(1),
            lambda: sim.robot("p3at").set_velocity(0.1, 0.0),
            lambda: sim.robot("p3at").rotate(1.0),
            lambda: odometry.on_sample(print),
            lambda: sim.on_new_run(print),
            lambda: sim.markers("layer"),
            lambda: sim.robot("p3at").inject("freeze", "lrf"),
            sim.quit,
        ):
            with pytest.raises(ruedo.NoServer, match="^this simulation was closed$"):
                call()
        assert "this simulation was closed" in repr(sim)


def test_a_restarted_server_is_noticed():
    url = free_url()
    events = []
    with ruedo_run("--disable", "p3at/camera", world=HALL, url=url) as first:
        sim = ruedo.connect(url, timeout=PATIENCE)
        sim.on_new_run(events.append)
        robot = sim.robot("p3at")
        motion = robot.advance(0.1, speed=0.001)
        first.end()
    with ruedo_run("--disable", "p3at/camera", world=HALL, url=url), sim:
        robot.pose.next(PATIENCE)
        while not events:
            robot.pose.next(PATIENCE)
        assert events == [sim] and (motion.state, motion.reason) == ("ended", "new run")
        assert robot.rotate(0.1).wait(PATIENCE).done


@pytest.mark.parametrize("first_ends_first", [True, False])
def test_two_simulations_in_a_process_end_in_either_order(first_ends_first):
    with ruedo.launch(HALL, **QUICK) as first, ruedo.launch(HALL, **QUICK) as second:
        odometry, other = first.robot("p3at").odometry, second.robot("p3at").odometry
        other.latest(PATIENCE)
        done = threading.Event()

        def close_the_second(sample: ruedo.Odometry) -> None:
            second.close()
            done.set()

        with odometry.on_sample(close_the_second) as closing:
            assert done.wait(PATIENCE) and not closing.closed
        with pytest.raises(ruedo.NoServer, match="^this simulation was closed$"):
            other.next()
        before = odometry.latest(PATIENCE)
        assert odometry.next(PATIENCE).utime > before.utime  # the first continues
        for sim in (first, second) if first_ends_first else (second, first):
            sim.close()
        for stream in (odometry, other):
            with pytest.raises(ruedo.NoServer, match="^this simulation was closed$"):
                stream.next()


def test_a_callback_of_a_new_run_may_close_the_simulation(caplog):
    url = free_url()
    done = threading.Event()

    def close(sim: ruedo.Simulation) -> None:
        sim.close()
        done.set()

    with ruedo_run("--disable", "p3at/camera", world=HALL, url=url) as first:
        sim = ruedo.connect(url, timeout=PATIENCE)
        sim.on_new_run(close)
        first.end()
    with ruedo_run("--disable", "p3at/camera", world=HALL, url=url):
        assert done.wait(PATIENCE)
        for call in (sim.robot("p3at").odometry.next, sim.pause):
            with pytest.raises(ruedo.NoServer, match="^this simulation was closed$"):
                call()
    assert [record.getMessage() for record in caplog.records] == [
        f"another run has begun at {url}: commands are not repeated into it"
    ]


def test_a_callback_that_waits_is_reported_so_at_once():
    with ruedo.launch(HALL, **QUICK) as sim:
        robot, said, done = sim.robot("p3at"), [], threading.Event()
        motion = robot.advance(0.1, speed=0.001)
        waits = [
            lambda: [robot.odometry.next(PATIENCE) for _ in range(2)],  # one is there
            lambda: sim.sleep(1.0),
            sim.pause,
            sim.state,
            lambda: sim.step(1),
            lambda: sim.restore("s"),
            motion.wait,
        ]

        def hear(_sample):
            if done.is_set():
                return
            for wait in waits:
                try:
                    wait()
                    said.append("none")
                except ruedo.RuedoError as error:
                    said.append(str(error))
            done.set()

        with robot.odometry.on_sample(hear):
            assert done.wait(PATIENCE)
        assert len(said) == len(waits)
        assert all(text.startswith("a callback cannot wait for the server") for text in said), said
        with pytest.raises(ruedo.RuedoError, match="a server takes 4194304 bytes at most"):
            sim.spawn("t", 0.0, 0.0, text="<sdf>" + "x" * (5 << 20))
        assert sim.state().step >= 0


def test_two_callbacks_may_close_each_others_simulation():
    with ruedo.launch(HALL, **QUICK) as first, ruedo.launch(HALL, **QUICK) as second:
        both, done = threading.Barrier(2), [threading.Event(), threading.Event()]

        def closes(other, end):
            def hear(_sample):
                if not end.is_set():
                    both.wait(PATIENCE)
                    other.close()
                    end.set()

            return hear

        first.robot("p3at").odometry.on_sample(closes(second, done[0]))
        second.robot("p3at").odometry.on_sample(closes(first, done[1]))
        assert all(end.wait(PATIENCE) for end in done)


class _Interrupted:
    """A socket while whose sending a signal comes in, or a finalizer runs."""

    def __init__(self, end, handler):
        self._end, self._handler = end, handler

    def __getattr__(self, name):
        return getattr(self._end, name)

    def sendall(self, data):
        handler, self._handler = self._handler, None
        if handler:
            handler()
        self._end.sendall(data)


def test_a_signal_handler_may_close_the_simulation():
    """The call holds locks then, that of the socket among them."""
    with ruedo.launch(HALL, **QUICK) as sim:
        sim.state()
        transport = sim._connection.bus._transport
        transport._socket = _Interrupted(transport._socket, sim.close)
        said = []

        def asks():
            try:
                sim.state()
            except ruedo.NoServer as error:
                said.append(str(error))

        caller = threading.Thread(target=asks, daemon=True)
        caller.start()
        caller.join(PATIENCE)
        assert said == ["this simulation was closed"]
        for thread in threading.enumerate():
            if thread.name == "ruedo-close":
                thread.join(PATIENCE)
        assert sim._connection._server.ended()


def test_a_close_that_is_interrupted_leaves_nothing_open(monkeypatch):
    def leave():
        raise KeyboardInterrupt

    sim = ruedo.launch(HALL, **QUICK)
    monkeypatch.setattr(sim._session, "leave", leave)
    with pytest.raises(KeyboardInterrupt):
        sim.close()
    assert sim._connection._server.ended()
    assert not sim._connection.bus._thread.is_alive()


def test_the_child_of_a_fork_is_reported():
    with ruedo.launch(HALL, **QUICK) as sim:
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                sim.step(20) if sim.lockstep else sim.state()
            except ruedo.NoServer as error:
                os.write(writer, str(error).encode())
            sim.close()
            os._exit(0)
        os.waitpid(child, 0)
        assert (
            os.read(reader, 1000).decode()
            == "this simulation is the parent process's: connect() again after a fork"
        )
        assert sim.state().step >= 0  # and the parent's continues


def test_errors_cross_processes_and_simulations_do_not():
    """What cannot be unpickled hangs a pool of processes."""
    for error in (
        ruedo.RequestError("no such model", "UNKNOWN_NAME"),
        ruedo.LeaseLost("silent", "REFUSED"),
        ruedo.MotionError("blocked", "blocked"),
        ruedo.NoServer("gone"),
    ):
        same = pickle.loads(pickle.dumps(error))
        assert (type(same), str(same), vars(same)) == (type(error), str(error), vars(error))
    with ruedo.launch(HALL, **QUICK) as sim:
        for what in (sim, sim.robot("p3at"), sim.robot("p3at").odometry):
            for out in (pickle.dumps, copy.deepcopy):
                with pytest.raises(TypeError, match=f"hand on its url, '{sim.url}', and connect"):
                    out(what)


@pytest.mark.parametrize(
    "name", ["x" * 64, "é" * 32, "a\nb", "a\x1bb", "a\u202eb", "x" * 10_000_000]
)
def test_a_name_that_no_server_takes_is_refused_at_once(name):
    for call in (ruedo.connect, ruedo.launch):
        with pytest.raises(ValueError, match="a client's name has 1 to 63 bytes of UTF-8"):
            call("unix:///nowhere", name=name)


@pytest.mark.parametrize("in_turn", [True, False])
def test_a_leave_is_repeated_a_few_times(in_turn, monkeypatch):
    """All of them are lost. Also by who does not get its turn."""
    with ruedo_run(*("--lockstep", "1", "--disable", "p3at/camera"), world=HALL) as server:
        sim = ruedo.connect(server.url, name="first", timeout=PATIENCE)
        sim.step(1, timeout=PATIENCE)
        session, leaves = sim._connection.session, []
        monkeypatch.setattr(session, "publish", lambda *request: leaves.append(request))
        with contextlib.nullcontext() if in_turn else session.turn():
            sim.close()
        assert len(leaves) == 5 and len(set(leaves)) == 1


@pytest.mark.parametrize("kind", ["launched", "unix", "tcpq"])
def test_a_server_that_has_ended_is_not_waited_for(kind, monkeypatch, tmp_path):
    """Its answer to a LEAVE is awaited for much longer than the test may take."""
    monkeypatch.setattr("ruedo.session.control._MOST_LEAVES", int(100.0 * PATIENCE))
    if kind == "launched":
        sim = ruedo.launch(HALL, **QUICK)
        sim.pause()
        sim._connection._server._process.kill()
        sim.close()
        return
    local = {"world": HALL, "url": f"unix://{tmp_path}/bus"}
    with ruedo_run(**local) if kind == "unix" else tcp_server() as server:
        sim = ruedo.connect(server.url, timeout=PATIENCE)
        sim.pause()
        server.process.kill()
        server.process.wait()
    sim.close()


def test_a_log_as_pandas_has_it(tmp_path):
    import pandas

    log = lcm.EventLog(str(tmp_path / "run.lcm"), "w", overwrite=True)
    for k in range(3):
        odometry = ruedo.lcmtypes.odometry_t()
        odometry.utime, odometry.x, odometry.n, odometry.angle, odometry.rate, odometry.ticks = (
            20000 * k,
            0.5 * k,
            1,
            [float(k)],
            [1.0],
            [k],
        )
        log.write_event(k, "p3at/odometry", odometry.encode())
    log.write_event(9, "other", b"something else")
    log.close()
    frames = ruedo.read_log(tmp_path / "run.lcm")
    assert list(frames) == ["p3at/odometry"] and isinstance(
        frames["p3at/odometry"], pandas.DataFrame
    )
    frame = frames["p3at/odometry"]
    assert (
        list(frame["x"]) == [0.0, 0.5, 1.0]
        and list(frame.index) == pytest.approx([0.0, 0.02, 0.04])
        and frame["wheel_angles"].iloc[2] == [2.0]
    )
    members = ruedo.read_log(tmp_path / "run.lcm", raw=True)["p3at/odometry"]
    assert members["angle"].iloc[2] == [2.0] and "wheel_angles" not in members
    assert ruedo.read_log(tmp_path / "run.lcm", ["nothing"]) == {}


class At:
    """Something placed: 1 m ahead and 0.5 m up, a quarter turn to the left."""

    position = np.array([1.0, 0.0, 0.5])
    orientation = np.array([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])


def test_points_of_a_scan():
    found = scan(2.0, math.inf, 1.0, -math.inf).points()  # at -0.5, 0 and 0.5 rad from the third on
    assert np.allclose(found, [[2 * math.cos(-0.5), 2 * math.sin(-0.5)], [1.0, 0.0]])
    ahead = scan(math.inf, math.inf, 2.0)  # along the device's x axis
    assert np.allclose(ahead.points(At()), [[1.0, 2.0, 0.5]])
    assert np.allclose(ahead.points(At(), At()), [[1.0 - 2.0, 1.0, 1.0]])
    with pytest.raises(TypeError, match="needs the device"):
        ahead.points(pose=At())


def test_notebooks_show_pictures_and_scans():
    pixels = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
    picture = samples.Image(5, 3, 2, "rgb", 9, pixels.tobytes())
    png = picture._repr_png_()
    assert png.startswith(b"\x89PNG\r\n\x1a\n") and picture._repr_jpeg_() is None
    body = png[png.index(b"IDAT") + 4 :]
    rows = np.frombuffer(zlib.decompressobj().decompress(body), np.uint8).reshape(2, 10)
    assert (rows[:, 1:].reshape(2, 3, 3) == pixels).all() and (rows[:, 0] == 0).all()
    assert samples.Image(5, 3, 2, "jpeg", 0, b"\xff\xd8")._repr_jpeg_() == b"\xff\xd8"
    depth = samples.Image(5, 2, 1, "float32", 8, np.array([1.0, math.inf], np.float32).tobytes())
    assert depth._repr_png_().startswith(b"\x89PNG")
    svg = scan(math.inf, math.inf, 2.0)._repr_svg_()
    assert svg.startswith("<svg") and svg.count("<circle") == 1


def test_a_map_is_an_array(tmp_path):
    (tmp_path / "m.pgm").write_bytes(
        b"P5\n# a comment\n3 2\n255\n" + bytes([0, 254, 205, 254, 254, 0])
    )
    (tmp_path / "m.yaml").write_text(
        "image: m.pgm\nresolution: 0.5\norigin: [-1, -2, 0]\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    grid = ruedo.load_map(tmp_path / "m.yaml")
    assert grid.cells.tolist() == [
        [0, 0, 100],
        [100, 0, -1],
    ]  # the picture's last row is the southernmost
    assert grid.resolution == 0.5 and grid.origin == (-1.0, -2.0, 0.0)
    assert (
        grid.at(0.4, -1.9) == 100
        and grid.at(-0.9, -1.4) == 100
        and grid.at(-0.9, -1.9) == 0
        and grid.at(5, 5) == -1
    )


@pytest.mark.parametrize(
    "text, says",
    [
        ("image: m.pgm\n", "resolution, origin is missing"),
        ("[1, 2]", "expected a map with image, resolution and origin"),
        (
            "image: m.pgm\nresolution: -1\norigin: [0, 0, 0]\n",
            "resolution is -1: expected a number above 0, at most ",
        ),
        ("image: m.pgm\nresolution: 1\norigin: [0, 0]\n", "origin is .*: expected three numbers"),
        (
            "image: m.pgm\nresolution: 1\norigin: [0, 0, 0]\n",
            "expected an 8-bit PGM of 9 x 9 pixels, found 1 bytes",
        ),
    ],
)
def test_errors_of_a_malformed_map(text, says, tmp_path):
    (tmp_path / "m.pgm").write_bytes(b"P5 9 9 255\n1")
    (tmp_path / "m.yaml").write_text(text)
    with pytest.raises(ValueError, match=f"m.(yaml|pgm): {says}"):
        ruedo.load_map(tmp_path / "m.yaml")


YAML_BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 9)
)
MERGE_BOMB = "a0: &a0 {x: 1}\n" + "".join(
    f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 10)}]}}\n" for i in range(1, 9)
)


@pytest.mark.parametrize(
    "what, says",
    [
        (YAML_BOMB, "it stands for more than 100000 values"),
        (MERGE_BOMB, "it stands for more than 100000 values"),
        ("&a [*a]", "it stands for more than 100000 values"),
        ("[" * 100_000, "it is nested too deep"),
        ("2000-99-99", "'2000-99-99' is not of type timestamp"),
        ("x" * (1 << 20) + "y", "it has 1048577 bytes; allowed are 1048576"),
        (os.mkfifo, "it is not a regular file"),
        (lambda path: os.symlink("/dev/zero", path), "it is not a regular file"),
        (os.mkdir, "it is not a regular file"),
    ],
)
def test_a_hostile_map_or_picture_is_refused_at_once(what, says, tmp_path):
    """Not after hours, and not for gigabytes."""
    hostile, good = tmp_path / "hostile", tmp_path / "m.yaml"
    hostile.write_text(what) if isinstance(what, str) else what(hostile)
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(resource.RLIMIT_DATA, (4 << 30, hard))
    try:
        with pytest.raises((ValueError, OSError), match=says):
            ruedo.load_map(hostile)
        good.write_text("image: hostile\nresolution: 1\norigin: [0, 0, 0]\n")
        with pytest.raises((ValueError, OSError)):
            ruedo.load_map(good)
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


@pytest.mark.parametrize(
    "picture, says",
    [
        (b"P5" + b"9" * 5000 + b" 1 255\n1", "is not a PGM"),
        (b"P5 0 5 255\n", "expected an 8-bit PGM of 0 x 5 pixels"),
        (b"P5 999999999 999999999 255\n1", "pixels, found 1 bytes"),
        (b"P5" + b"#\n" * 100_000, "is not a PGM"),
        (b"\x89PNG\r\n\x1a\n" + b"\xff" * 50, "is not a picture that can be read"),
    ],
)
def test_a_broken_picture_of_a_map_is_reported(picture, says, tmp_path):
    if not picture.startswith(b"P5"):
        pytest.importorskip("PIL")
    (tmp_path / "m.pgm").write_bytes(picture)
    (tmp_path / "m.yaml").write_text("image: m.pgm\nresolution: 1\norigin: [0, 0, 0]\n")
    with pytest.raises(ValueError, match=f"m.pgm: .*{says}"):
        ruedo.load_map(tmp_path / "m.yaml")


def test_degrees_are_warned_of():
    from ruedo.robot import _radians

    for call, angle, usual in (("rotate", 90, 4 * math.pi), ("turn_to", -45, 2 * math.pi)):
        with pytest.warns(
            UserWarning, match=rf"{call}\({angle}\) is .* turns: angles are in radians"
        ):
            _radians(call, angle, usual)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for angle in (math.pi, 3 * math.pi, 2, -6, 13.37):
            _radians("rotate", angle, 4 * math.pi)


def test_show_opens_the_console_of_its_server(monkeypatch):
    import webbrowser
    from urllib.request import urlopen

    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    with ruedo.launch(HALL, view=True, **QUICK) as sim:
        address = sim.show()
        assert opened == [address]
        with urlopen(address, timeout=PATIENCE) as page:
            assert page.status == 200 and "text/html" in page.headers["Content-Type"]
    with (
        ruedo.launch(HALL, **QUICK) as sim,
        pytest.raises(ruedo.NotSupported, match="view=True"),
    ):
        sim.show()


@pytest.mark.parametrize("scheme", ["udpm", "tcpq", "unix"])
def test_a_closed_simulation_leaves_nothing_running(scheme, tmp_path):
    """Neither threads nor files: LCM's own receiving thread would go on for ever."""

    def held() -> tuple[int, int]:
        gc.collect()  # an exception holds the frames of connect()
        return len(os.listdir("/proc/self/task")), len(os.listdir("/proc/self/fd"))

    def settles_at_most_at(before: tuple[int, int]) -> bool:
        deadline = time.monotonic() + PATIENCE  # a joined thread ends a little later
        while not all(now <= then for now, then in zip(held(), before, strict=True)):
            if time.monotonic() > deadline:
                return False
        return True

    options = ("--disable", "p3at/camera")
    url = f"unix://{tmp_path}/bus" if scheme == "unix" else None
    server = tcp_server(*options) if scheme == "tcpq" else ruedo_run(*options, world=HALL, url=url)
    with server:
        ruedo.connect(server.url, timeout=PATIENCE).close()
        before = held()
        kept = []  # by a program that does not let go of what it closed
        for _ in range(5):
            kept.append(ruedo.connect(server.url, timeout=PATIENCE))
            kept[-1].robot("p3at").odometry.next()
            kept[-1].close()
        assert settles_at_most_at(before), (held(), before)
    if scheme == "udpm":
        before = held()
        for _ in range(3):
            with pytest.raises(ruedo.NoServer):
                ruedo.connect(server.url, timeout=0.2)
        assert settles_at_most_at(before), (held(), before)


# Messages of the interpreter or of NumPy about something inside, never ours.
INNER = (
    "unsupported operand|not supported between|object is not|has no attribute|codec can't|"
    "too large to convert|cannot convert|only length-1|ambiguous|to unpack|could not convert"
)
WRONG = [
    *(None, True, "\ud800", "x" * 1_000_000, b"x", math.inf, math.nan, 10**400, -1, 0.5, 1j),
    *([], [None] * 3, {}, (1,), object(), float, np.array([1.0, 2.0]), np.array([])),
]


def test_errors_are_reported_in_a_line_of_our_own():
    """Each call with each wrong argument: it is taken, or one line names what is wrong."""
    with ruedo.launch(HALL, **QUICK) as sim:
        robot, inner = sim.robot("p3at"), []

        def short(x):
            return x[:100] if isinstance(x, str) else x

        calls = [
            sim.robot,
            sim.set_rate,
            lambda x: sim.remove(short(x)),  # the server repeats it
            robot.device,
            robot.advance,
            robot.inject,
            lambda x: robot.arc(0.1, x),
            lambda x: robot.set_velocity(x, 0.0),
            lambda x: robot.inject("dropout", x),
            lambda x: robot.inject("dropout", "lrf", view=x, duration=0.1),
            lambda x: robot.inject("kidnapped", place=x),
            lambda x: sim.markers(x, []),
            lambda x: sim.markers("a", x),
            lambda x: sim.markers("a", [], frame=x),
            lambda x: sim.set_pose("nobody", x=x, y=0.0),
            lambda x: ruedo.World().wall(0, 0, 1, x),
            lambda x: ruedo.World().box(x, 0, size=(1, 1, 1)),
            lambda x: ruedo.connect("no url" if x is None else short(x), timeout=0.05),
            lambda x: ruedo.connect(sim.url, name=x, timeout=PATIENCE).close(),
        ]
        for call in calls:
            for wrong in WRONG:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    try:
                        call(wrong)
                    except (TypeError, ValueError, ruedo.RuedoError) as error:
                        said = str(error)
                        if len(said) > 1000 or "\n" in said or re.search(INNER, said):
                            inner.append((said[:200], repr(wrong)[:50]))
    assert not inner


_CLOSES_IN_A_CALLBACK = """
import sys, threading, time, ruedo
start = threading.Thread.start
def late(thread):
    if thread.name == "ruedo-close":
        threading.Event().wait(0.5)  # without a processor
    start(thread)
threading.Thread.start = late
sim = ruedo.connect(sys.argv[1], name="leaver", timeout=400.0)
sim.robot("p3at").odometry.on_sample(lambda _: sim.close())
threading.Thread(target=sim.step, args=(1000,), daemon=True).start()
while not sim._connection.closed:
    time.sleep(0.001)
"""


def test_a_program_does_not_end_before_what_a_callback_closes():
    """The callback is in a daemon thread, which ends with the program wherever it stands."""
    with ruedo_run(
        *("--lockstep", "1", "--lease", str(10.0 * PATIENCE), "--disable", "p3at/camera"),
        world=HALL,
    ) as server:
        for _ in range(3):
            subprocess.run(
                [sys.executable, "-c", _CLOSES_IN_A_CALLBACK, server.url],
                check=True,
                timeout=PATIENCE,
            )
        with ruedo.connect(server.url, name="next", timeout=PATIENCE) as sim:
            sim.step(1, timeout=PATIENCE)


_NEVER_RETURNS = """
import logging, sys, threading, time, ruedo
begun, end = threading.Event(), threading.Event()
def stuck(_):
    begun.set()
    end.wait()  # line 6
def is_named(record):
    end.set()
    return True
sim = ruedo.connect(sys.argv[1], timeout=400.0)
sim.robot("p3at").odometry.on_sample(stuck)
begun.wait()
if sys.argv[2:]:
    logging.getLogger("ruedo").addFilter(is_named)
    sim.close()
"""


@pytest.mark.parametrize(
    ("how", "what"), [([], "the program ends without it"), (["close"], "close() waits for it")]
)
def test_a_callback_that_does_not_return_is_reported(tmp_path, how, what):
    """The program ends, although its end waits for callbacks; close() does for ever."""
    program = tmp_path / "program.py"
    program.write_text(_NEVER_RETURNS)
    with ruedo_run("--disable", "p3at/camera", world=HALL) as server:
        done = subprocess.run(
            [sys.executable, program, server.url, *how],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
    assert done.returncode == 0
    assert done.stderr == f"a callback has not returned for 5 s, at {program}:6: {what}\n"


_ENDS_BESIDE_A_CALLBACK = """
import sys, threading, time, ruedo
begun = threading.Event()
def busy(_):
    sim.close()
    begun.set()
    while True:
        time.sleep(0.0001)
sim = ruedo.connect(sys.argv[1], timeout=400.0)
sim.robot("p3at").odometry.on_sample(busy)
threading.Thread(target=sim.step, args=(1000,), daemon=True).start()
begun.wait()
"""


def test_a_program_may_end_beside_a_callback_in_a_daemon_thread():
    """Python unwinds that thread, through the compiled function that calls back, too."""
    for _ in range(3):
        with ruedo_run("--lockstep", "1", "--disable", "p3at/camera", world=HALL) as server:
            done = subprocess.run(
                [sys.executable, "-c", _ENDS_BESIDE_A_CALLBACK, server.url],
                capture_output=True,
                text=True,
                timeout=PATIENCE,
            )
        assert done.returncode == 0, done.stderr


def test_a_slow_send_delays_no_receiver():
    """Of a large request, to a server that has much else to do."""
    ends = []

    def publish(channel, data):
        asked = lcmtypes.request_t.decode(data)
        reply = lcmtypes.reply_t()
        reply.run_id, reply.session, reply.sequence, reply.kind = 7, 3, asked.sequence, asked.kind
        receiving = threading.Thread(target=session.receive, args=(reply.encode(),))
        receiving.start()
        receiving.join(10.0)
        ends.append(not receiving.is_alive())

    connection = types.SimpleNamespace(
        info=types.SimpleNamespace(features=-1, run_id=7),
        clock=types.SimpleNamespace(utime=0),
        bus=types.SimpleNamespace(publish=publish),
        is_of_our_run=lambda run_id: True,
        check_may_wait=lambda: None,
        check_open=lambda: None,
        check_server=lambda: None,
    )
    session = Session(connection, "sender")
    assert session.request(lcmtypes.request_t.GET_STATE).session == 3
    assert ends == [True, True]  # JOIN, GET_STATE


def test_message_types_need_no_numpy():
    """A plain LCM program on a computer without it."""
    program = (
        "import importlib.util as u\nfind = u.find_spec\n"
        "u.find_spec = lambda name, *rest: None if name == 'numpy' else find(name, *rest)\n"
        "import sys\nsys.modules['numpy'] = None\n"
        "from ruedo.lcmtypes import pose_t\nprint(len(pose_t().encode()))\nimport ruedo\n"
        "try: ruedo.connect\nexcept ImportError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.splitlines() == [
        str(len(lcmtypes.pose_t().encode())),
        "ruedo.connect needs NumPy, without which there is ruedo.lcmtypes alone",
    ], done.stderr
