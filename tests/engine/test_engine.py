"""ruedo.Engine: arrays, commands, resets and errors. That its bytes are the server's is
tests/run/engine_test.cpp's.
"""

import copy
import math
import os
import pickle
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import ruedo
from ruedo import lcmtypes

# A two-wheeled robot without limits and watchdog, and a lidar of five beams that looks at a wall 2
# m ahead of it.
ROBOT = """<model name='{name}'><pose>0 {y} 0 0 0 0</pose><link name='body'><pose>0 0 0.15 0 0
0</pose><inertial><mass>10</mass></inertial> <collision name='c'><geometry><box><size>0.5 0.3
0.2</size></box></geometry></collision> <sensor name='scan'
type='gpu_lidar'><update_rate>10</update_rate><lidar><scan><horizontal><samples>5</samples><min_angle>-0.4</min_angle>
<max_angle>0.4</max_angle></horizontal></scan><range><min>0.05</min><max>8</max></range>
<noise><type>gaussian</type><stddev>0.01</stddev></noise></lidar></sensor></link>
{wheels}<ruedo:drive><ruedo:left_joint>left_joint</ruedo:left_joint><ruedo:right_joint>right_joint</ruedo:right_joint>
<ruedo:watchdog>0</ruedo:watchdog></ruedo:drive></model>
"""
WHEEL = """<link name='{side}'><pose>0 {y} 0.1 -1.5707963267948966 0
0</pose><inertial><mass>0.5</mass></inertial> <collision
name='c'><geometry><cylinder><radius>0.1</radius><length>0.05</length></cylinder></geometry></collision></link>
<joint name='{side}_joint' type='revolute'><parent>body</parent><child>{side}</child><axis><xyz
expressed_in='__model__'>0 1 0</xyz></axis></joint>
"""
WALL = "<static>true</static><link name='l'><collision name='c'><geometry><box><size>0.2 40 2</size></box></geometry></collision></link>"


def world(robots=1):
    wheels = WHEEL.format(side="left", y=0.2) + WHEEL.format(side="right", y=-0.2)
    models = "".join(ROBOT.format(name=f"r{i}", y=2 * i, wheels=wheels) for i in range(robots))
    return (
        "<sdf version='1.9' xmlns:ruedo='ruedo'><world name='w'><physics type='bullet'><max_step_size>0.005</max_step_size></physics>"
        "<model name='ground'><static>true</static><link name='l'><collision name='c'><geometry><plane><normal>0 0 1</normal></plane>"
        f"</geometry></collision></link></model><model name='wall'><pose>2.1 0 1 0 0 0</pose>{WALL}</model>{models}</world></sdf>"
    )


def engine(robots=1, **options):
    return ruedo.Engine("w.sdf", text=world(robots), **options)


def test_arrays_show_the_runs_without_a_copy():
    with engine(robots=2, worlds=3, noise=False) as e:
        assert e.robots == ("r0", "r1") and e.worlds == 3 and e.dt == 0.005
        ranges, position = e.observe("scan.ranges"), e["pose.pos"]
        assert ranges.shape == (3, 2, 5) and ranges.dtype == np.float32
        assert position.shape == (3, 2, 3) and position.dtype == np.float64
        assert e["scan.ranges"].ctypes.data == ranges.ctypes.data
        angles = np.linspace(-0.4, 0.4, 5)
        np.testing.assert_allclose(ranges[2, 1], 2.0 / np.cos(angles), rtol=1e-6)
        commands = np.zeros((3, 2, 2))
        commands[1, 0] = 0.4, 0.0  # m/s, rad/s
        commands[2, 1] = 0.0, math.pi / 2
        e.step(commands, 200)  # a second
        np.testing.assert_allclose(position[1, 0], [0.4, 0.0, 0.0], atol=1e-12)
        np.testing.assert_allclose(position[0], [[0.0, 0.0, 0.0], [0.0, 2.0, 0.0]], atol=1e-12)
        np.testing.assert_allclose(ranges[1, 0], 1.6 / np.cos(angles), rtol=1e-6)
        assert ranges[2, 1, 0] == pytest.approx(
            2.0 / math.sin(0.4), rel=1e-6
        )  # a quarter turn to the left: along the wall
        assert np.isinf(ranges[2, 1, 1:]).all()
        with pytest.raises(ValueError, match="read-only"):
            ranges[0] = 0
    assert math.isinf(ranges[2, 1, 4])  # what was observed stays readable


def test_a_reset_clears_the_samples_of_the_earlier_run():
    with engine(robots=2, worlds=2, fault=["r0/scan:dropout@0,for=1"]) as e:
        with pytest.raises(ValueError, match=r"scan\.ranges has no sample yet"):
            e.observe("scan.ranges")
        e.step(None, 200)  # a second
        ranges, times = e.observe("scan.ranges"), e.observe("scan.utime")
        assert np.isfinite(ranges).all() and (times == 1_000_000).all()
        e.reset()
        with pytest.raises(ValueError, match=r"scan\.ranges has no sample yet"):
            e.observe("scan.ranges")
        assert np.isnan(ranges[:, 0]).all() and np.isfinite(ranges[:, 1]).all()
        assert (times == 0).all()
        e.step(None, 200)
        assert np.isfinite(ranges).all() and e.observe("scan.ranges").shape == (2, 2, 5)


def test_commands_are_broadcast_and_nan_means_no_command():
    with engine(robots=2, worlds=2) as e:
        x = e["pose.pos"][..., 0]
        e.step([0.2, 0.0], 100)
        np.testing.assert_allclose(x, 0.1, atol=1e-12)
        e.step([[math.nan, math.nan], [0.0, 0.0]], 100)  # r0 continues, r1 stops
        np.testing.assert_allclose(x, [[0.2, 0.1]] * 2, atol=1e-12)
        e.step(np.zeros((2, 2, 3)), 100)
        np.testing.assert_allclose(x, [[0.2, 0.1]] * 2, atol=1e-12)


# The first command acts first, by whichever call: the last one holds.
def test_commands_act_in_the_order_of_the_calls():
    stop = lcmtypes.velocity_command_t()
    with engine(worlds=2) as e:
        x = e["pose.pos"][:, 0, 0]
        e.step([0.2, 0.0], 100)  # at full speed
        e._core.drive(np.full((2, 1, 3), [0.4, 0.0, 0.0]))
        e.command(0, "r0/velocity", stop)
        e.step(n=100)
        np.testing.assert_allclose(x, [0.1, 0.3], atol=1e-12)
        e._core.drive(np.full((2, 1, 3), [0.4, 0.0, 0.0]))
        e._core.drive(np.zeros((2, 1, 3)))
        e.reset(1)
        e.step(n=100)
        np.testing.assert_allclose(x, [0.1, 0.0], atol=1e-12)


def test_the_hash_of_a_state_is_the_same_whoever_computed_it():
    runs = []
    for threads in (1, 2):
        with engine(worlds=5, threads=threads) as e:
            e.step([0.2, 0.1], 57)
            runs.append([e.state_hash(i) for i in range(5)])
            assert runs[-1] == [e.state_hash(i) for i in range(5)]
            e.reset(2)
            begun = e.state_hash(2)
            e.step([0.2, 0.1], 57)
            assert e.state_hash(2) == runs[-1][2] != begun
    assert runs[0] == runs[1]


def test_seeds_make_the_noise():
    with engine(worlds=3, seed=5) as several, engine(seed=7) as third:
        a, b = several["scan.ranges"], third["scan.ranges"]
        assert (a[2] == b[0]).all() and (a[0] != a[1]).any()
        several.step(None, 500), third.step(None, 500)
        assert (a[2] == b[0]).all()
        assert several.state_hash(2) == third.state_hash()


def test_a_reset_equals_a_fresh_run():
    with engine(worlds=4, seed=1) as e:
        ranges, beginning = e["scan.ranges"], e["scan.ranges"].copy()
        e.step([0.3, 0.1], 50)
        assert e.steps(1) == 50 and e.time(1) == 0.25
        e.reset(np.array([False, True, False, True]))
        assert [e.steps(i) for i in range(4)] == [50, 0, 50, 0]
        assert (ranges[[1, 3]] == beginning[[1, 3]]).all()
        e.reset(2, seed=1)  # another copy's seed
        assert (ranges[2] == beginning[0]).all()
        e.reset()
        assert (ranges[0] == beginning[0]).all() and (ranges[2] == beginning[0]).all()


def test_a_copy_may_get_another_world():
    with engine(worlds=2, noise=False) as e:
        x, ranges, touching = e["pose.pos"][..., 0], e["scan.ranges"], e.touching()
        e.reset(
            1, text=world().replace("<pose>2.1 0 1", "<pose>1.1 0 1")
        )  # the wall is a metre nearer
        assert ranges[0, 0, 2] == pytest.approx(2.0) and ranges[1, 0, 2] == pytest.approx(1.0)
        e.step([0.5, 0.0], 20)
        assert touching.tolist() == [[0], [0]]
        e.step([0.5, 0.0], 280)  # 1.5 s; the robot's front is 0.25 m ahead of its centre
        assert x[0, 0] == pytest.approx(0.75, abs=1e-9) and x[1, 0] == pytest.approx(0.75, abs=2e-3)
        e.step([0.5, 0.0], 100)
        assert x[0, 0] == pytest.approx(1.0, abs=1e-9) and x[1, 0] == pytest.approx(0.75, abs=2e-3)
        assert (
            touching[0, 0] == 0 and touching[1, 0] >= 99
        )  # the first of them may still be on its way
        assert e.collisions(0) == {} and e.collisions(1) == {"r0": ["wall/l"]}
        e.reset(1)  # keeps its world
        assert ranges[1, 0, 2] == pytest.approx(1.0) and touching[1, 0] == 0
        with pytest.raises(ruedo.BadWorld, match=r"it has 'r1/\w+', unlike"):
            e.reset(0, text=world(robots=2))
        with pytest.raises(ruedo.BadWorld, match=r"it lacks 'r0/\w+'"):
            e.reset(0, text=world(robots=0))
        assert ranges[0, 0, 2] == pytest.approx(1.0, abs=1e-6)  # as it was


def test_messages_are_those_of_the_channels():
    with engine(worlds=2, record=True) as e:
        e.step(None, 40)
        told = [
            lcmtypes.planar_lidar_t.decode(data)
            for world, step, channel, data in e.messages()
            if world == 1 and channel == "r0/scan"
        ]
        assert [scan.utime for scan in told] == [100_000, 200_000]  # 10 Hz
        assert (np.float32(told[-1].ranges) == e["scan.ranges"][1, 0]).all()
        move = lcmtypes.move_command_t()
        move.id, move.kind, move.value, move.speed = 1, lcmtypes.move_command_t.ADVANCE, 0.1, 0.2
        e.command(0, "r0/move", move)
        e.step(None, 400)
        np.testing.assert_allclose(e["pose.pos"][:, 0, 0], [0.1, 0.0], atol=1e-9)


class Wrong:
    """What looks like a message: encodes as that text, or as the type with a wrong field."""

    def __init__(self, what):
        self._what = what

    def encode(self):
        if isinstance(self._what, str):
            return self._what
        message = self._what()
        message.utime = "now"
        return message.encode()


@pytest.mark.parametrize(
    "call, error, text",
    [
        (
            lambda e: e.step(None, 2.5),
            TypeError,
            "n is a whole number of steps, not 2.5; a step is 0.005 s",
        ),
        (lambda e: e.step(None, 0), ValueError, "n is 0; allowed are 1 to"),
        (lambda e: e.step("fast"), TypeError, "commands are numbers, (m/s, rad/s)"),
        (lambda e: e.step(None, 1, [0]), ValueError, "a mask, True or False for each of 2 worlds"),
        (lambda e: e.observe(5), TypeError, "named by a text, DEVICE.FIELD, not by 5"),
        (
            lambda e: e.command(0, "r0/velocity", 5),
            TypeError,
            "one of ruedo.lcmtypes, or its bytes",
        ),
        (lambda e: e.reset(0, seed=1.5), TypeError, "seed is a whole number, not 1.5"),
        (lambda e: e.reset(0, seed=2**64), ValueError, "seed is 18446744073709551616; allowed are"),
        (lambda e: e.reset([0, 0]), ValueError, "world 0 is to be reset twice at once"),
        (lambda e: e.reset(0, text=5), TypeError, "text is a list of texts, not 5"),
        (lambda e: e.collisions("r0"), TypeError, "a world's index is a whole number, not 'r0'"),
        (lambda e: e.step(3), ValueError, "their shape is ()"),
        (
            lambda e: e.step(np.zeros((7, 2))),
            ValueError,
            "do not fit (worlds, robots, 2) = (2, 1, 2)",
        ),
        (lambda e: e.observe("ranges"), ValueError, "not a DEVICE.FIELD"),
        (
            lambda e: e.observe("lrf.rangs"),
            ValueError,
            "'rangs' is not a field of numbers in planar_lidar_t; there are utime, nranges, ranges",
        ),
        (
            lambda e: e.observe("camera.data"),
            ValueError,
            "no robot has a device 'camera'; there are r0/collisions, r0/motion",
        ),
        (lambda e: e.reset(2), IndexError, "world 2 of 2"),
        (lambda e: e.reset([0, 1], seed=[1]), ValueError, "1 seeds for 2 worlds"),
        (
            lambda e: e.command(0, "r0/scan", b""),
            ValueError,
            "no robot takes commands on 'r0/scan'",
        ),
        (lambda e: e.step([math.inf, 0]), ValueError, "finite numbers, or NaN for none"),
        (lambda e: e.step([10**400, 0]), TypeError, "commands are numbers, (m/s, rad/s)"),
        (lambda e: e.step([1j, 0]), TypeError, "commands are numbers, (m/s, rad/s)"),
        (lambda e: e.step(np.array([1, 2], "m8[s]")), TypeError, "commands are numbers"),
        (lambda e: e.step(np.ma.masked_array([1.0, 2.0], [0, 1])), TypeError, "are numbers"),
        (lambda e: e.observe("scan.\ud800"), ValueError, "with half a character in it"),
        (lambda e: e.observe("scan.ran\0ges"), ValueError, "which holds the character 0"),
        (lambda e: e.observe("x" * 100_000 + ".y"), ValueError, "xxx... is not a DEVICE.FIELD"),
        (lambda e: e.command(0, "r0/velocity\0", b""), ValueError, "which holds the character 0"),
        (lambda e: e.command(0, "r0/velocity", Wrong("text")), TypeError, "one of ruedo.lcmtypes"),
        (
            lambda e: e.command(0, "r0/velocity", Wrong(lcmtypes.velocity_command_t)),
            TypeError,
            "a field of this Wrong is not what its type says: ",
        ),
        (lambda e: e.reset(0, seed=b"abc"), TypeError, "seed is a whole number, not b'abc'"),
        (lambda e: e.reset(0, text="\0"), ValueError, "which holds the character 0"),
        (lambda e: e.begin_run(1, goals="1,1,1,1"), TypeError, "goals is a list of texts"),
        (
            lambda e: e.begin_run(1, goals=[5]),
            TypeError,
            "goals is a list of texts; 5 is not a text",
        ),
        (lambda e: e.begin_run(1, no_contact="no"), TypeError, "no_contact is True or False"),
        (lambda e: e.begin_run(1, clearance=math.nan), ValueError, "a finite number, 0 or more"),
        (lambda e: e.begin_run(1, clearance="x"), TypeError, "clearance is a number, not 'x'"),
        (lambda e: e.begin_run(1, odometry_error=-1), ValueError, "odometry_error is -1: it must"),
        (lambda e: e.begin_run(1, clearance_reach=math.nan), ValueError, "clearance_reach is nan"),
        (lambda e: e.begin_run(1, robot=None), TypeError, "robot is a text, not None"),
        (
            lambda e: (e.begin_run(1), e.reset(0)),
            ValueError,
            "a run that is judged goes ahead alone: end_run() comes first",
        ),
        (lambda e: (e.close(), e.step()), RuntimeError, "closed"),
        (lambda e: (e.close(), e.messages()), RuntimeError, "closed"),
        (lambda e: (e.close(), e.end_run()), RuntimeError, "closed"),
    ],
)
def test_errors_have_their_reason(call, error, text):
    with engine(worlds=2) as e, pytest.raises(error) as caught:
        call(e)
    assert text in str(caught.value)


def test_a_daemon_thread_may_be_at_work_when_the_program_ends():
    """Python unwinds such a thread as it comes back."""
    program = (
        "import threading, time, ruedo\n"
        f"e = ruedo.Engine('w.sdf', text={world()!r})\n"
        "def work():\n  while True: e.step(n=1)\n"
        "threading.Thread(target=work, daemon=True).start()\n"
        "time.sleep(0.2)\n"
    )
    for _ in range(5):
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")


def test_more_threads_than_cores_give_no_warning():
    """Regression: TBB wrote a warning to the program's standard error."""
    program = f"import ruedo\nruedo.Engine('w.sdf', text={world()!r}, threads=4096).step(n=9)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


class Enough(Exception):
    pass


def step_beside(engine, others, command=None):
    """A long step that a signal ends as soon as `others` has run beside it, in a second thread."""

    def beside():
        while not is_refused(engine.steps):  # until the step has begun
            time.sleep(0)
        try:
            others()
        finally:
            os.kill(os.getpid(), signal.SIGALRM)

    def enough(*_):
        raise Enough

    before = signal.signal(signal.SIGALRM, enough)
    thread = threading.Thread(target=beside)
    try:
        thread.start()
        with pytest.raises(Enough):
            engine.step(command, 2**62)
    finally:
        thread.join()
        signal.signal(signal.SIGALRM, before)


def is_refused(use):
    try:
        use()
    except RuntimeError as error:
        assert "at work in another thread" in str(error)
        return True
    return False


def test_a_signal_ends_a_step_that_is_long():
    """After as many steps in all copies, and the engine goes on from there."""
    with engine(worlds=3) as e, engine(worlds=3) as straight:
        step_beside(e, lambda: time.sleep(0.1), [0.1, 0.0])
        steps = e.steps()
        assert steps > 0 and {e.steps(i) for i in range(3)} == {steps}
        e.step(n=7)
        straight.step([0.1, 0.0], steps + 7)
        assert [e.state_hash(i) for i in range(3)] == [straight.state_hash(i) for i in range(3)]


def test_a_long_step_counts_touches_as_short_ones_do():
    with engine(noise=False) as e, engine(noise=False) as pieces:
        e.step([1.0, 0.0], 1000)  # the wall is 1.75 m ahead
        sums = np.zeros_like(e.touching())
        for _ in range(20):
            pieces.step([1.0, 0.0], 50)
            sums += pieces.touching()
        assert 100 < e.touching()[0, 0] == sums[0, 0]
        assert e.collisions() == {"r0": ["wall/l"]}


@pytest.mark.parametrize("lag", [1, 7, 20, 33])
def test_a_lag_does_not_depend_on_the_steps_of_a_call(lag):
    """Regression: what a faulty lidar had kept came with the next sample that was due in the same
    call, or in a later one; in a server that depended on real time.
    """

    def came(*calls, **options):
        scans = []
        with engine(record=True, **options) as e:
            for n in calls:
                e.step([0.2, 0.0], n)
                scans += [(step, data) for _, step, name, data in e.messages() if name == "r0/scan"]
        return scans

    in_time = came(150)
    assert [step for step, _ in in_time] == [20, 40, 60, 80, 100, 120, 140]
    late = [(step + lag if step >= 40 else step, data) for step, data in in_time]
    for calls in ([150], [1] * 150, [50, 3, 97]):
        found = came(*calls, fault=[f"r0/scan:lag@0.2,value={0.005 * lag}"])
        assert found == [each for each in late if each[0] <= 150], calls


@pytest.mark.parametrize("value", [0.9, 0.5, 0.0])
@pytest.mark.parametrize("kind, field", [("ADVANCE", "v"), ("ROTATE", "omega")])
def test_weak_motors_leave_a_part_of_a_primitives_speed(kind, field, value):
    """Regression: a motor without force had all of it, and turns had the limit in m/s."""

    def fastest(**options):
        move = lcmtypes.move_command_t()
        move.id, move.kind, move.value = 1, getattr(lcmtypes.move_command_t, kind), 2.0
        with ruedo.Engine("empty", spawn=["p3at:p3at@0,0"], noise=False, **options) as e:
            e.command(0, "p3at/move", move)
            e.step(n=400)
            return e[f"odometry.{field}"].item()

    healthy = fastest()
    assert healthy > 0.5
    weak = fastest(fault=[f"p3at:weak_motor@0,value={value}"])
    assert weak == pytest.approx(value * healthy, rel=1e-3, abs=1e-5)


def test_messages_are_recorded_in_a_judged_run_too():
    with engine(record=True) as e:
        e.begin_run(1)
        first = e.messages()
        e.step(n=40)
        during = e.messages()
        e.end_run()
        e.step(n=40)
        assert {name for *_, name, _ in first} and {step for _, step, *_ in during} >= {20, 40}
        assert {step for _, step, *_ in e.messages()} >= {60, 80}


def test_a_seed_may_be_an_array_of_one_number():
    with engine(worlds=2) as e:
        e.reset(1, seed=np.array(5))
        with engine(worlds=2, seed=4) as other:
            assert e.state_hash(1) == other.state_hash(1)


def test_a_refused_call_changes_nothing():
    with engine(worlds=2) as e:
        before = [e.state_hash(i) for i in range(2)]
        for refused in ({"seed": -1}, {"seed": [3]}, {"seed": 7, "text": "<sdf"}):
            with pytest.raises(ValueError):
                e.reset(**refused)
        e.reset()
        assert [e.state_hash(i) for i in range(2)] == before
        e.step(None, 40)  # with the noise of the seeds that it had
        with engine(worlds=2) as fresh:
            fresh.step(None, 40)
            assert (e["scan.ranges"] == fresh["scan.ranges"]).all()


@pytest.mark.parametrize(
    "options, error, text",
    [
        (
            {"world": "no_such"},
            ValueError,
            "no world of that name; there are arena, crossing, empty, field, fleet, maze, office",
        ),
        ({"world": "no/such.sdf"}, ValueError, "no/such.sdf: no such file"),
        ({"world": 5}, TypeError, "world is a file, the name of a world or a World, not 5"),
        ({"world": "arena", "worlds": 0}, ValueError, "worlds is 0; allowed are 1 to"),
        ({"world": "arena", "worlds": 2.5}, TypeError, "worlds is a whole number, not 2.5"),
        ({"world": "arena", "seed": -1}, ValueError, "seed is -1; allowed are 0 to"),
        ({"world": "arena", "noise": "no"}, TypeError, "noise is True or False, not 'no'"),
        ({"world": "arena", "settings": ["a=1"]}, TypeError, "settings is a dict, {"),
        (
            {"world": "arena", "disable": [5]},
            TypeError,
            "disable is a list of texts; 5 is not a text",
        ),
        ({"text": 5}, TypeError, "text is a world's SDF as text, not 5"),
        ({"world": "arena", "disable": "p3at/camera"}, TypeError, "disable is a list of texts"),
        ({"world": "arena", "spawn": ["p3at"]}, ValueError, "MODEL[:NAME]@X,Y[,YAW]"),
        ({"world": ""}, ValueError, "world is '': it is a file or the name of a world"),
        ({"world": "arena\0"}, ValueError, "world is 'arena\\x00', which holds the character 0"),
        ({"world": "\ud800"}, ValueError, "with half a character in it"),
        ({"text": "\ud800"}, ValueError, "with half a character in it"),
        ({"world": "arena", "spawn": ["p3at@1,2\0"]}, ValueError, "which holds the character 0"),
        ({"world": "arena", "set": {"\0": 1}}, ValueError, "which holds the character 0"),
        ({"world": "arena", "noise": np.ones(2, bool)}, TypeError, "noise is True or False"),
        (
            {"world": "arena", "plugin": [1]},
            TypeError,
            "plugin is a list of texts; 1 is not a text",
        ),
        ({"world": "arena", "plugin": None}, TypeError, "plugin is a list of texts, not None"),
        ({"world": "arena", "set": {"p3at/LRF.update_rate": "fast"}}, ValueError, "update_rate"),
    ],
)
def test_bad_worlds_are_refused(options, error, text):
    with pytest.raises(error) as caught:
        ruedo.Engine(**options)
    assert text in str(caught.value)


def test_worlds_are_found_by_name_from_anywhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.sdf").write_text(world())
    monkeypatch.setenv("RUEDO_PATH", str(tmp_path))
    assert ruedo.Engine("mine").robots == ("r0",)
    e = ruedo.Engine(
        "arena",
        spawn=["p3at:guest@1,1"],
        settings={"p3at/lrf.update_rate": 10},
        disable=["p3at/camera", "guest/camera"],
    )
    assert e.robots == ("p3at", "guest") and "2 " not in repr(e)
    assert e["lrf.ranges"].shape == (1, 2, 181)


def test_a_second_thread_is_refused():
    with engine(worlds=8) as e:
        refused = []
        uses = (e.step, e.reset, e.steps, e.close)
        step_beside(e, lambda: refused.extend(is_refused(use) for use in uses))
        assert refused == [True] * len(uses)
        e.step()


def test_an_engine_is_not_copied():
    with engine() as e:
        for call in (copy.copy, copy.deepcopy, pickle.dumps):
            with pytest.raises(TypeError, match="neither copied nor pickled: make another one"):
                call(e)


def test_copies_that_share_a_world_outlive_the_first():
    engine = ruedo.Engine("arena", worlds=4, disable=["p3at/camera"])
    engine.reset()
    before = engine.observe("lrf.ranges").copy()
    for _ in range(3):
        engine.reset()
    assert (engine.observe("lrf.ranges") == before).all()


@pytest.mark.parametrize("integrator", ["arc", "trapezoid"])
def test_slip_is_unbiased(integrator):
    """Ten metres straight on: the wheels' way is 10 m in the mean. The heading walks at random by
    sigma^2 2 L / track^2, so that the mean of x falls behind by the mean of its cosine:
    (1 - exp(-k L)) / k with k = (sigma / track)^2."""
    sigma, track, length, runs = 0.02, 0.4, 10.0, 300
    slip = f"<ruedo:odometry><ruedo:slip_noise>{sigma}</ruedo:slip_noise><ruedo:integrator>{integrator}</ruedo:integrator></ruedo:odometry>"
    text = world().replace("<ruedo:drive>", slip + "<ruedo:drive>")
    with ruedo.Engine("w.sdf", text=text, worlds=runs, seed=1) as e:
        e.step([-1.0, 0.0], 2000)  # away from the wall
        way = -0.1 * e["odometry.angle"].mean(axis=(1, 2))
        ahead = -e["odometry.x"][:, 0]
    k = (sigma / track) ** 2
    wanted = (1 - math.exp(-k * length)) / k
    for values, mean in ((way, length), (ahead, wanted)):
        assert abs(values.mean() - mean) < 3.29 * values.std() / math.sqrt(runs)


def falling(name, x, more=""):
    return f"""<model name='{name}'><pose>{x} 0 5 0.3 0.2 0.1</pose><link name='body'><inertial><mass>2</mass>
        <inertia><ixx>.02</ixx><iyy>.03</iyy><izz>.04</izz></inertia></inertial>
        <sensor name='imu' type='imu'><update_rate>100</update_rate></sensor></link>{more}</model>"""


def test_a_falling_imu_measures_0_from_its_first_sample_on():
    """A stone, and robots of both drives: an accelerometer in free fall shows 0, not 9.81."""
    wheels = WHEEL.format(side="left", y=0.2) + WHEEL.format(side="right", y=-0.2)
    drive = "<ruedo:drive type='{}'><ruedo:left_joint>left_joint</ruedo:left_joint><ruedo:right_joint>right_joint</ruedo:right_joint></ruedo:drive>"
    text = (
        "<sdf version='1.9' xmlns:ruedo='https://ruedo.org'><world name='w'>"
        + falling("stone", 0)
        + falling("kinematic", 3, wheels + drive.format("kinematic"))
        + falling("wheels", 6, wheels + drive.format("wheels"))
        + "</world></sdf>"
    )
    with ruedo.Engine(text=text, noise=False) as e:
        felt = e["imu.linear_acceleration"]
        for _ in range(20):
            assert felt == pytest.approx(np.zeros((1, 3, 3)), abs=1e-6)
            e.step(None, 2)


CAMERA = """<sensor name='eye' type='camera'><update_rate>20</update_rate><camera><horizontal_fov>1.2</horizontal_fov>
<image><width>32</width><height>24</height></image><clip><near>0.05</near><far>50</far></clip>
<noise><type>gaussian</type><mean>0</mean><stddev>0.02</stddev></noise></camera>
<ruedo:encoding>rgb</ruedo:encoding></sensor></link>"""


def with_camera(**options):
    return ruedo.Engine(
        "w.sdf", text=world().replace("</sensor></link>", "</sensor>" + CAMERA), **options
    )


def test_a_picture_read_late_is_the_due_one():
    """Noise too: it follows the number of the sample. 0.32 s are 64 steps: the newest picture is
    that of 0.3 s, which no later one of the same call replaces."""
    with with_camera(worlds=2) as early, with_camera(worlds=2) as late:
        seen = early["eye.data"]
        begun = seen.copy()
        for e in (early, late):
            e.step([0.3, 0.1], 64)
        assert late["eye.data"].shape == (2, 1, 32 * 24 * 3)
        assert (late["eye.utime"] == 300_000).all()
        assert (late["eye.data"] == seen).all() and (seen != begun).any()
        for e in (early, late):
            e.step([0.3, 0.1], 20)
            e.reset([1])
            e.step([0.3, 0.1], 7)
        assert (late["eye.data"] == seen).all()
        assert (late["eye.utime"][:, 0] == [450_000, 0]).all()


@pytest.mark.parametrize("fault", ["r0/scan:lag@0,value=0.05", "r0/eye:freeze@0.1"])
def test_pictures_and_faults(fault):
    """A camera that nobody reads has no renderer while others are faulty; one that is faulty
    itself gives what it gives to who reads it from the beginning.
    """
    with with_camera(fault=[fault]) as early, with_camera(fault=[fault]) as late:
        seen = early["eye.data"]
        for e in (early, late):
            e.step([0.3, 0.1], 64)
        assert (late["eye.data"] == seen).all()
        assert late["eye.utime"] == early["eye.utime"]


def test_pictures_are_drawn_only_when_read(monkeypatch):
    """Without a renderer all goes well until a picture is read."""
    monkeypatch.setenv("RUEDO_RENDERER", "none")
    with with_camera(worlds=2) as e:
        e.step([0.3, 0.1], 40)
        e.reset()
        assert (e["scan.ranges"] > 0).all()
        with pytest.raises(OSError, match="RUEDO_RENDERER=none"):
            e.observe("eye.data")
        e.step(n=40)  # it continues
        monkeypatch.delenv("RUEDO_RENDERER")
        assert (e["eye.utime"] == 200_000).all()
    monkeypatch.setenv("RUEDO_RENDERER", "none")
    with with_camera(record=True) as e, pytest.raises(OSError, match="RUEDO_RENDERER=none"):
        e.step()  # messages() has all
