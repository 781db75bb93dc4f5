"""For every bad file: what `check` can load `run` runs, and what it cannot load `run` refuses with
the same words. Absurd values are each reported with their place and what is allowed; the world runs
if it can do without them.
"""

import json
import os
import subprocess
from pathlib import Path

import pytest
from test_check import FILES, in_link, world

RUEDO = os.environ["RUEDO"]
PATIENCE = 300  # s

LIDAR = (
    "<sensor name='s' type='ray'>{0}<ray><scan><horizontal><samples>{samples}</samples><min_angle>{low}</min_angle><max_angle>{high}</max_angle>"
    "</horizontal></scan><range><min>{near}</min><max>{far}</max></range></ray></sensor>"
)


def lidar(inside="", samples="8", low="-1", high="1", near="0.1", far="10"):
    return in_link(LIDAR.format(inside, samples=samples, low=low, high=high, near=near, far=far))


def link(inside):
    """A link that moves, in line 4."""
    return world(f"<model name='m'><link name='l'>\n{inside}\n</link></model>")


def shape(geometry):
    return in_link(f"<collision name='c'><geometry>{geometry}</geometry></collision>")


def joint(inside="", mass="1", more=""):
    return world(
        "<gravity>0 0 -9.8</gravity><model name='m'>" + more + "<link name='a'/>"
        f"<link name='b'><pose>1 0 0 0 0 0</pose><inertial><mass>{mass}</mass></inertial></link>"
        f"<joint name='j' type='revolute'><parent>a</parent><child>b</child><axis><xyz>0 1 0</xyz>{inside}</axis></joint></model>"
    )


def path(*waypoints):
    return world(
        "<model name='m'><link name='l'/><ruedo:path>"
        + "".join(f"<ruedo:waypoint>{w}</ruedo:waypoint>\n" for w in waypoints)
        + "</ruedo:path></model>"
    )


def trajectory(*times):
    return world(
        "<actor name='a'><script><trajectory id='0' type='w'>"
        + "".join(f"<waypoint><time>{t}</time><pose>0 0 0 0 0 0</pose></waypoint>\n" for t in times)
        + "</trajectory></script></actor>"
    )


HUGE = ("1e300", "-1e300", "1e101", "nan", "inf", "1e10000")
# World, and a part of the error; None: it is good, or named and run.
BAD = {
    **{f"gravity {v}": (world(f"<gravity>{v} 0.1 -9.7</gravity>"), "gravity") for v in HUGE},
    **{
        f"gravity of the old kind {v}": (
            world(
                f"<physics type='ode'><gravity>{v} 0.1 -9.7</gravity></physics>"
                + joint()[len("<sdf version='1.9'>\n<world name='w'>\n") : -len("\n</world></sdf>")]
            ),
            "gravity",
        )
        for v in HUGE
    },
    **{f"pose {v}": (in_link(f"<pose>{v} 0 0 0 0 0</pose>"), "pose") for v in HUGE},
    **{f"box {v}": (shape(f"<box><size>1 {v} 1</size></box>"), "size") for v in HUGE},
    **{f"sphere {v}": (shape(f"<sphere><radius>{v}</radius></sphere>"), "radius") for v in HUGE},
    **{f"plane {v}": (shape(f"<plane><normal>0 0 {v}</normal></plane>"), "normal") for v in HUGE},
    **{
        f"mass {v}": (link(f"<inertial><mass>{v}</mass></inertial>"), "mass")
        for v in ("1e300", "nan", "inf", "1e10000")
    },
    **{
        f"moment {v}": (link(f"<inertial><inertia><ixx>{v}</ixx></inertia></inertial>"), "ixx")
        for v in ("1e300", "-1e300", "inf")
    },
    **{
        f"density {v}": (
            link(
                f"<inertial auto='true'><density>{v}</density></inertial><collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision>"
            ),
            "density",
        )
        for v in HUGE
    },
    **{
        f"rate {v}": (lidar(f"<update_rate>{v}</update_rate>"), "update_rate")
        for v in (*HUGE, "-3", "1e9", "1000001", "0.0000000001", "1e-300")
    },
    **{
        f"phase {v}": (lidar(f"<ruedo:phase>{v}</ruedo:phase>"), "phase")
        for v in (*HUGE, "-1", "9.3e12", "1e13", "1000000001")
    },
    **{
        f"samples {v}": (lidar(samples=v), "samples")
        for v in (*HUGE, "-1", "1e18", "9223372036854775807")
    },
    **{f"range {v}": (lidar(far=v), "max") for v in HUGE},
    **{
        f"axis {v}": (joint(f"<dynamics><damping>{v}</damping></dynamics>"), "damping")
        for v in HUGE
    },
    **{
        f"step {v}": (
            world(f"<physics type='ode'><max_step_size>{v}</max_step_size></physics>"),
            "max_step_size",
        )
        for v in (*HUGE, "0", "-1", "1e-9", "2")
    },
    **{f"waypoint at {v}": (path("0 0 0 0 0 0 0", f"{v} 1 0 0 0 0 0"), "waypoint") for v in HUGE},
    **{f"waypoint to {v}": (path("0 0 0 0 0 0 0", f"1 {v} 0 0 0 0 0"), "waypoint") for v in HUGE},
    "waypoints out of order": (path("1 0 0 0 0 0 0", "0 1 0 0 0 0 0"), "not after the one before"),
    "no waypoint": (path(), "has no waypoint"),
    "waypoint of three numbers": (path("1 2 3"), "waypoint"),
    "times of an actor out of order": (trajectory(1, 0), None),
    **{f"time of an actor {v}": (trajectory(0, v), "time") for v in HUGE},
    "mass of nothing": (link("<inertial><mass>1e-300</mass></inertial>"), None),
    "three hundred faults that multiply": (
        world(
            "<include><uri>model://p3at</uri></include>"
            + "<ruedo:fault><ruedo:robot>p3at</ruedo:robot><ruedo:target>left</ruedo:target>"
            "<ruedo:kind>wheel_slip</ruedo:kind><ruedo:at>0</ruedo:at><ruedo:value>0.95</ruedo:value>"
            "</ruedo:fault>" * 300
        ),
        None,
    ),
    "axis of a heavy world": (joint(mass="1e9"), None),
    **{
        name: (text, None)
        for name, (text, others, code, _) in FILES.items()
        if not others and code < 3
    },
    **{
        name: (text, "")
        for name, (text, others, code, _) in FILES.items()
        if not others and code == 3
    },
}


def ruedo(*arguments):
    return subprocess.run([RUEDO, *arguments], capture_output=True, timeout=PATIENCE)


@pytest.mark.parametrize("name", BAD)
def test_check_and_run_agree(name, tmp_path):
    text, part = BAD[name]
    file = tmp_path / "w.sdf"
    file.write_text(text, encoding="utf-8")
    checked = ruedo("check", str(file), "--json")
    run = ruedo("run", str(file), "--quiet", "--rate", "max", "--duration", "0.1")
    findings = json.loads(checked.stdout)
    errors = [f for f in findings if f["kind"] == "error"]
    assert (checked.returncode, run.returncode) in ((0, 0), (1, 0), (3, 3)), (checked, run)
    if part is None:
        assert run.returncode == 0, (checked, run)
        return
    message = run.stderr.decode()
    assert any(part in error["text"] for error in errors), (checked, run)
    if run.returncode == 3:
        assert len(errors) == 1 and message.count("\n") == 1, (checked, run)
        assert (
            f"{file}:{errors[0]['line']}: {errors[0]['text']}" in message or errors[0]["line"] == 0
        ), (checked, run)
    else:
        assert checked.returncode == 1 and all(error["text"] in message for error in errors), (
            checked,
            run,
        )


WALL = "<model name='wall'><static>true</static><link name='l'><collision name='c'><geometry><box><size>1 1 2</size></box></geometry></collision></link></model>"


@pytest.mark.parametrize("x, stuck", [(0.2, True), (3, False)])
def test_a_robot_in_a_wall_is_reported(x, stuck, tmp_path):
    file = tmp_path / "w.sdf"
    file.write_text(
        world(WALL + f"\n<include><uri>model://p3at</uri><pose>{x} 0 0 0 0 0</pose></include>"),
        encoding="utf-8",
    )
    checked = ruedo("check", str(file), "--json")
    run = ruedo(
        "run",
        str(file),
        "--quiet",
        "--rate",
        "max",
        "--duration",
        "0.1",
        "--disable",
        "p3at/camera",
    )
    named = [f for f in json.loads(checked.stdout) if "stands in 'wall'" in f["text"]]
    assert (
        (len(named) == 1) == stuck
        and ("stands in 'wall'" in run.stderr.decode()) == stuck
        and run.returncode == 0
    )
    assert checked.returncode == stuck
    spawned = ruedo("check", str(Path(os.environ["RUEDO_SOURCE_DIR"]) / "worlds/arena.sdf"))
    assert spawned.returncode == 0, spawned


@pytest.mark.parametrize("value", ["nan", "-nan", "inf", "1e300", "1e10000"])
@pytest.mark.parametrize(
    "words",
    [
        "map w.sdf -o m.yaml --resolution",
        "map w.sdf -o m.yaml --height",
        "play a.lcm --html a.html --html-size",
        "regress w.sdf --record a.lcm --clearance",
        "regress w.sdf --record a.lcm --odometry-error",
        "regress w.sdf --record a.lcm --clearance-reach",
        "echo --timeout",
        "run w.sdf --lease",
        "run w.sdf --duration",
        "run w.sdf --rate",
    ],
)
def test_a_value_that_is_not_a_number_is_reported(words, value, tmp_path):
    """A NaN lies in no range: an expectation with it would hold, a map be cut nowhere."""
    done = subprocess.run(
        [RUEDO, *words.split(), value], capture_output=True, text=True, cwd=tmp_path, timeout=60
    )
    option = words.split()[-1]
    assert done.returncode in (2, 3), done
    assert option in done.stderr and value in done.stderr, done


def of_a_sensor(words, folder):
    """A command with a world of one sensor, w.sdf."""
    (folder / "w.sdf").write_text(in_link("<sensor name='s' type='imu'/>"))
    return subprocess.run(
        [RUEDO, *words.split()], capture_output=True, text=True, cwd=folder, timeout=60
    )


@pytest.mark.parametrize(
    "options, text",
    [
        ("--seed -1", "--seed: '-1' is not allowed; a seed is a whole number from 0 to"),
        ("--golden g.lcm --tolerance pose=abs:x", "pose=abs:x"),
        *(
            (option, f"{option.split()[0]} requires --golden")
            for option in (
                "--tolerance x",
                "--ignore x",
                "--keep x",
                "--renew",
                "--html a.html",
            )
        ),
    ],
)
def test_regress_refuses_options_without_effect(options, text, tmp_path):
    done = of_a_sensor(f"regress w.sdf --record a.lcm --duration 0.1 {options}", tmp_path)
    assert done.returncode == 2 and text in done.stderr, done.stderr
    assert not (tmp_path / "a.lcm").exists()  # told before the run, which may take hours


@pytest.mark.parametrize(
    "option, other",
    [
        ("--lease 3", "--lockstep"),
        ("--lease-policy drop", "--lockstep"),
        ("--ros2-clock 10", "--ros2"),
        ("--ros2-services fastrtps", "--ros2"),
    ],
)
def test_run_refuses_options_without_effect(option, other, tmp_path):
    done = of_a_sensor(f"run w.sdf --lcm memq:// --duration 0 {option}", tmp_path)
    assert done.returncode == 2, done
    assert f"{option.split()[0]} requires {other}" in done.stderr, done
