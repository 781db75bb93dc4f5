"""Hunts find planted faults, shrink them, and keep each as a test that fails until it is fixed;
`why` says when it began.
"""

import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import lcm
import numpy as np
import pytest
import yaml
from conftest import PATIENCE, SOURCE, ruedo
from ruedo import Engine, World
from ruedo.hunt import Hunt
from ruedo.hunt.obstacles import with_boxes
from ruedo.hunt.regression import moved
from ruedo.lcmtypes import log_header_t, move_command_t, state_hash_t

EXAMPLE = SOURCE / "docs/campaign-example"


@pytest.fixture
def example(tmp_path):
    """The documentation's example in a folder of its own; returns a function that plants a
    fault.
    """
    for file in EXAMPLE.iterdir():
        if file.suffix in (".py", ".yaml"):
            (tmp_path / file.name).write_text(file.read_text())

    def plant(name, file="hunt.yaml", **hunt):
        content = yaml.safe_load((tmp_path / file).read_text())
        content["parameters"]["planted"] = [name]
        content["hunt"].update(hunt)
        (tmp_path / "hunt.yaml").write_text(yaml.safe_dump(content))
        return tmp_path

    return plant


def hunt(folder, *options, code=1):
    return json.loads(
        ruedo("hunt", "hunt.yaml", "--json", *options, folder=folder, code=code).stdout
    )


def test_loses_the_goal_when_the_first_echo_is_far(example):
    found = hunt(example("far"), "--cases", "60")
    assert found["found"] and "was not within" in found["reason"] and not found["faults"]
    assert (
        found["choices"]["width"] == round(found["choices"]["width"], 1)
        and found["choices"]["width"] > 4.0
    )
    assert found["choices"]["seed"] == 1


def test_turns_the_wrong_way_at_exactly_pi(example):
    found = hunt(example("pi"), "--cases", "60")
    assert (
        found["found"]
        and abs(found["choices"]["heading"]) == 3.141592653589793
        and not found["faults"]
    )


def test_trusts_a_frozen_scan_and_the_find_is_kept_as_a_test(example):
    folder = example("frozen", "hunt-faults.yaml")
    found = hunt(folder, "--cases", "150", "--keep", "kept/frozen")
    assert found["found"] and [fault["kind"] for fault in found["faults"]] == ["freeze"]
    assert sum(found["choices"][f"obstacle{i}"] for i in range(2)) == 1
    kept = folder / "kept/frozen"
    assert {"world.sdf", "regression.yaml", "test_frozen.py", "CMakeLists.txt", "run.lcm"} <= {
        file.name for file in kept.iterdir()
    }
    assert "repeated byte for byte" in ruedo("verify", kept / "run.lcm", folder=folder).stdout
    (folder / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.20)\nproject(mine NONE)\nenable_testing()\n"
        "add_subdirectory(kept/frozen)\n"
    )
    ctest = ["ctest", "--test-dir", "build", "--output-on-failure"]
    subprocess.run(["cmake", "-S", ".", "-B", "build"], cwd=folder, check=True)
    failed = subprocess.run(ctest, cwd=folder, capture_output=True, text=True, timeout=PATIENCE)
    assert failed.returncode != 0 and "touched" in failed.stdout, failed.stdout
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(kept)]
    failed = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert failed.returncode == 1 and "touched" in failed.stdout, failed.stdout + failed.stderr
    ruedo(
        "campaign",
        "run",
        kept / "regression.yaml",
        "--out",
        "again",
        "--quiet",
        folder=folder,
        code=1,
    )
    why = ruedo(
        "why", next((folder / "again/logs").iterdir()), "-o", "why.svg", folder=folder
    ).stdout
    assert (
        re.search(r"it could be avoided up to [\d.]+ s", why)
        and "avoids it: without the fault freeze" in why
    )
    ends = float(re.search(r"avoids it: the fault freeze ends at ([\d.]+) s", why).group(1))
    assert 0.0 < ends < float(re.search(r"failed: ([\d.]+) s", why).group(1))
    assert (folder / "why.svg").read_text().startswith("<?xml")
    text = (kept / "regression.yaml").read_text()
    (kept / "regression.yaml").write_text(text.replace("- frozen", "- ''"))  # mended
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stdout
    done = subprocess.run(ctest, cwd=folder, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stdout


LUCKY = """
import lcm
import numpy as np


class Lucky:
    \"\"\"At 2 s it tosses a coin, the last bit of a noisy range, and drives into the wall or stays.\"\"\"

    def __init__(self, bad):
        self.bad, self.bit = bad, None

    def __call__(self, view):
        if view.time < 2.0 - 1e-9:
            return 0.0, 0.0
        if self.bit is None:
            self.bit = int(view["lrf.ranges"][90:91].view(np.uint32)[0]) & 1
        return (0.8 if self.bit == self.bad else 0.0), 0.0
"""
DISABLED = ["p3at/camera", "p3at/sonar_front", "p3at/sonar_rear"]


def test_why_branches_to_other_seeds_from_a_moment_on(tmp_path):
    """The robot stands until the toss: the coin of a seed is the same in a branch to it as in a run
    of its own. So it is known which seeds avoid it from 2 s on; from 2.25 s on none does."""
    world = tmp_path / "wall.sdf"
    world.write_text(str(World("wall").wall(1.5, -2, 1.5, 2).robot("p3at")))
    (tmp_path / "lucky.py").write_text(LUCKY)
    coins = {}
    for seed in range(1, 8):
        with Engine(world, seed=seed, disable=DISABLED) as engine:
            engine.observe("lrf.ranges")
            engine.step(None, round(2.0 / engine.dt))
            ranges = np.asarray(engine.observe("lrf.ranges"))[0, 0]
            coins[seed] = int(ranges[90:91].view(np.uint32)[0]) & 1
    bad = coins[1]
    saved = sum(coins[seed] != bad for seed in range(2, 8))
    assert 0 < saved < 6
    campaign = {
        "name": "toss",
        "worlds": [{"name": "wall", "file": "wall.sdf"}],
        "controllers": [{"name": "lucky", "python": "lucky.py:Lucky"}],
        "parameters": {"bad": [bad]},
        "disable": DISABLED,
        "expect": {"no_contact": True},
        "limits": {"duration": 5},
    }
    (tmp_path / "toss.yaml").write_text(yaml.safe_dump(campaign))
    ruedo("campaign", "run", "toss.yaml", "--quiet", folder=tmp_path, code=1)
    log = next((tmp_path / "toss.campaign/logs").iterdir())
    text = ruedo("why", log, "--seeds", "6", "-o", "why.svg", folder=tmp_path).stdout
    assert f"{saved} of 6 other seeds from 2 s on avoid it\n" in text
    assert "0 of 6 other seeds from 2.25 s on avoid it\n" in text
    found = json.loads(ruedo("why", log, "--seeds", "6", "--json", folder=tmp_path).stdout)["seeds"]
    assert found == sorted(found, key=lambda one: -one["from_s"])
    assert {one["tried"] for one in found} == {6}
    for one in found:
        assert one["avoided"] == (saved if one["from_s"] <= 2.0 else 0), one
    assert "other seeds" in (tmp_path / "why.svg").read_text()
    assert "--seeds" in ruedo("why", log, "--seeds", "-1", folder=tmp_path, code=2).stderr


def test_why_branches_a_log_of_no_campaign_with_the_same_commands(tmp_path):
    """One command, at 2 s, would drive the robot into the wall, and half of all commands are lost:
    in a branch to a seed the same ones as in a run of its own."""
    world = tmp_path / "wall.sdf"
    world.write_text(str(World("wall").wall(1.0, -2, 1.0, 2).robot("p3at")))
    ahead = move_command_t()
    ahead.kind, ahead.value, ahead.speed = ahead.ADVANCE, 2.0, 0.5

    def run(seed, log=""):
        """Whether it touched the wall."""
        with Engine(
            world, seed=seed, disable=DISABLED, fault=["p3at:commands_lost@0,value=0.5"]
        ) as engine:
            engine.begin_run(seed, no_contact=True, log=str(log))
            engine.step(None, round(2.0 / engine.dt))
            engine.command(0, "p3at/move", ahead)
            engine.step(None, round(4.0 / engine.dt))
            return bool(engine.end_run()["failures"])

    touched = {seed: run(seed) for seed in range(1, 8)}
    failed = next(seed for seed in touched if touched[seed])
    log = tmp_path / "run.lcm"
    assert run(failed, log)
    others = [seed for seed in range(1, 7) if seed != failed][:5]
    saved = sum(not touched[seed] for seed in others)
    assert saved > 0
    text = ruedo("why", log, folder=tmp_path).stdout
    assert f"{saved} of 5 other seeds from 2 s on avoid it\n" in text
    assert "0 of 5 other seeds from 2.25 s on avoid it\n" in text


LOCKSTEP = """
import ruedo
with ruedo.connect(timeout=60.0) as sim:
    robot = sim.robot("p3at")
    while True:
        sim.step(20, [robot.velocity_command(0.5, 0.0)])
"""


def test_why_of_a_program_in_lockstep(tmp_path):
    """Regression: that it had joined was a request that acted, and no such log was answered. What
    is not tried is said."""
    (tmp_path / "wall.sdf").write_text(str(World("wall").wall(1.5, -2, 1.5, 2).robot("p3at")))
    (tmp_path / "drive.py").write_text(LOCKSTEP)
    campaign = {
        "worlds": [{"name": "wall", "file": "wall.sdf"}],
        "controllers": [
            {
                "name": "c",
                "command": f"{sys.executable} drive.py",
                "lockstep": 1,
                "no_client_wait": False,
            }
        ],
        "disable": DISABLED,
        "expect": {"no_contact": True},
        "limits": {"duration": 5},
    }
    (tmp_path / "c.yaml").write_text(yaml.safe_dump(campaign))
    ruedo("campaign", "run", "c.yaml", "--quiet", folder=tmp_path, code=1)
    log = next((tmp_path / "c.campaign/logs").iterdir())
    said = ruedo("why", log, "--seeds", "0", folder=tmp_path).stdout
    assert re.search(r"it could be avoided up to [\d.]+ s", said), said
    assert "not tried: several changes at once" in said


def test_why_leaves_models_out_and_knows_of_other_parameters(tmp_path):
    world = World("hall").wall(1.5, -2, 1.5, 2).wall(-3, -2, -3, 2).robot("p3at")
    (tmp_path / "hall.sdf").write_text(str(world))
    (tmp_path / "drive.py").write_text(
        "def drive(view):\n    return view.parameters['speed'], 0.0\n"
    )
    (tmp_path / "c.yaml").write_text(
        "worlds: [hall.sdf]\ncontrollers: [{name: c, python: 'drive.py:drive'}]\n"
        f"parameters: {{speed: [0.5, 0.1]}}\ndisable: {json.dumps(DISABLED)}\n"
        "expect: {no_contact: true}\nlimits: {duration: 4}\n"
    )
    ruedo("campaign", "run", "c.yaml", "--quiet", folder=tmp_path, code=1)
    log = next((tmp_path / "c.campaign/logs").iterdir())
    found = json.loads(ruedo("why", log, "--seeds", "0", "--json", folder=tmp_path).stdout)
    changes = {what: good for what, good, _ in found["changes"]}
    assert changes.pop("speed = 0.1 (case 1)") and not changes.pop("without noise")
    walls = {what: good for what, good in changes.items() if "wall" in what}
    assert list(walls.values()) == [True, False], changes  # what was touched is tried first
    assert "p3at" not in str(changes)


def test_a_robot_placed_in_an_obstacle_does_not_count_as_a_failure(tmp_path):
    """Regression: what was kept stayed red, whatever became of the controller."""
    obstacles = {"most": 1, "area": [-0.01, -0.01, 0.01, 0.01], "size": [0.4, 0.5]}
    folder = blind(tmp_path, "stand", obstacles=obstacles)
    found = Hunt(folder / "hunt.yaml").run(cases=10, seed=1, by="random", workers=1)
    assert found is None


BROKEN = {  # and the expected error
    "no message": "at 1 s",
    "a far step": "at 1 s",
    "a wrong option": r"bad\.lcm: --set p3at/lrf\.update_rate: .*'\?\[31m' is not a rate",
    "a seed above 2^63": "this run did not fail: nothing was touched",
}


@pytest.mark.parametrize("harm", BROKEN)
def test_why_reports_the_damage_of_a_log(tmp_path, harm):
    """Regressions: but for the second, which ran for ever, they gave a traceback."""
    log, bad = tmp_path / "run.lcm", tmp_path / "bad.lcm"
    options = ["--rate", "max", "--duration", "2", "--lcm", "memq://", "--record", str(log)]
    world = tmp_path / "wall.sdf"
    world.write_text(str(World("wall").wall(1.0, -2, 1.0, 2).robot("p3at")))
    ruedo("run", world, "--quiet", "--disable", "p3at/camera", *options, folder=tmp_path)
    written = lcm.EventLog(str(bad), "w", overwrite=True)
    for event in lcm.EventLog(str(log), "r"):
        data = event.data
        if event.channel == "ruedo/state_hash" and event.timestamp == 1_000_000:
            state = state_hash_t.decode(data)
            state.step = 2**40
            if harm == "a far step":
                data = state.encode()
            elif harm == "no message":
                data = data[:8] + b"\x01" + data[9:-20]
        if event.channel == "ruedo/header":
            header = log_header_t.decode(data)
            if harm == "a wrong option":
                header.options.append("--set=p3at/lrf.update_rate=\x1b[31m")
                header.noptions += 1
            elif harm == "a seed above 2^63":
                header.seed = -1  # as it is written
            data = header.encode()
        written.write_event(event.timestamp, event.channel, data)
    written.close()
    said = ruedo("why", bad, folder=tmp_path, code=3).stderr
    assert "bad.lcm: " in said and re.search(BROKEN[harm], said), said
    assert said.count("\n") == 1


def test_a_kept_program_runs_in_its_folder_and_again_when_it_changes(tmp_path):
    """Regressions: a folder's name was not quoted, and its files were looked for elsewhere, so that
    an old result stood for a mended program."""
    home = tmp_path / "lab's 1"
    home.mkdir()
    (home / "drive.py").write_text("")
    command = "python3 drive.py --gain 0.5"
    kept = moved({"name": "mine", "command": command, "files": ["*.toml"]}, home, home / "kept/a b")
    assert shlex.split(kept["command"]) == ["cd", "../..", "&&", *command.split()]
    assert (kept["files"], kept["inputs"]) == (["../../*.toml"], ["../../drive.py"])
    aside = moved({"name": "mine", "command": command}, home, tmp_path / "kept")
    assert shlex.split(aside["command"]) == ["cd", "../lab's 1", "&&", *command.split()]
    assert "files" not in aside
    assert aside["inputs"] == ["../lab's 1", "../lab's 1/drive.py"]  # the folder, too
    for python in ("drive.py:run", "drive:run"):
        made = moved({"name": "mine", "python": python}, home, tmp_path / "kept")
        assert made["python"] == "../lab's 1/drive.py:run"
    made = moved({"name": "mine", "python": "json:dumps"}, home, tmp_path / "kept")
    assert made["python"] == "json:dumps"


def test_a_sound_controller_passes_its_hunt(example):
    assert hunt(example("", "hunt-faults.yaml"), "--cases", "16", code=0) == {
        "found": False,
        "cases": 16,
    }


def test_the_same_seed_finds_the_same_with_any_number_of_workers(example):
    folder = example("far")
    one, two = (
        hunt(folder, "--cases", "30", "--shrink", "10", "--seed", "3", "--workers", n)
        for n in ("1", "2")
    )
    assert one == two


def test_by_hypothesis(example):
    found = hunt(example("far"), "--cases", "60", "--by", "hypothesis", "--shrink", "20")
    assert found["found"] and "was not within" in found["reason"]


def test_obstacles_are_few_in_the_end(example):
    folder = example(
        "", "hunt.yaml", obstacles={"most": 3, "area": [1.0, -1.0, 3.0, 1.0], "size": [0.3, 0.9]}
    )
    content = yaml.safe_load((folder / "hunt.yaml").read_text())
    content["controllers"] = [{"name": "blind", "python": "blind.py:blind"}]
    content["parameters"] = {"width": [4.0], "heading": [0.0]}
    content["expect"] = {"no_contact": True}
    content["limits"]["duration"] = 6
    (folder / "blind.py").write_text("def blind(view):\n    return 0.5, 0.0\n")
    (folder / "hunt.yaml").write_text(yaml.safe_dump(content))
    found = Hunt(folder / "hunt.yaml").run(cases=40, seed=1)
    assert found is not None and "hunted_0" in found.reason
    assert (
        sum(found.choices[f"obstacle{i}"] for i in range(3)) == 1
        and found.content["limits"]["duration"] < 6
    )


BLIND = """
def ahead(view):
    return 0.5, 0.0
def stand(view):
    return 0.0, 0.0
def always(view):
    raise RuntimeError("always")
def careless(view):
    if view.parameters["fault_rate"] > 0.5:
        raise RuntimeError("too fast")
    return 0.1, 0.0
"""
BOX = """<sdf version='1.9'><model name='box'><static>true</static><link name='link'>
<collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision></link></model></sdf>"""
INCLUDES = """<?xml version='1.0' encoding='ISO-8859-1'?>
<sdf version='1.9'><world name='w'><!-- caf\xe9 </world> -->
<include><uri>inc/box.sdf</uri><pose>2 0 0.5 0 0 0</pose></include>
<include><uri>ground_plane</uri></include><include><uri>p3at</uri></include></world></sdf>
<!-- was: </world> -->
"""
AWAY = {"most": 1, "area": [-6, -6, -5, -5]}  # where it never comes


def blind(folder, name="ahead", text="", **hunt):
    """hunt.yaml: in a world that includes a box ahead of the robot; `text` says what is other."""
    (folder / "inc").mkdir(exist_ok=True)
    (folder / "inc/box.sdf").write_text(BOX)
    (folder / "w.sdf").write_bytes(INCLUDES.encode("latin-1"))
    (folder / "blind.py").write_text(BLIND)
    content = {
        "worlds": ["w.sdf"],
        "controllers": [{"name": "blind", "python": f"blind.py:{name}"}],
        "disable": DISABLED,
        "expect": {"no_contact": True},
        "limits": {"duration": 8},
        "hunt": hunt,
        **yaml.safe_load(text or "{}"),
    }
    (folder / "hunt.yaml").write_text(yaml.safe_dump(content))
    return folder


@pytest.mark.parametrize("obstacles", [{}, {"obstacles": AWAY}], ids=["plain", "obstacles"])
def test_included_files_are_kept_with_a_world(tmp_path, obstacles):
    """Regressions: a world with obstacles, and one that was kept, was without it: the kept test
    passed at once.
    """
    folder = blind(tmp_path, **obstacles)
    found = hunt(folder, "--cases", "4", "--shrink", "0", "--keep", "kept/box")
    assert "touched box/link" in found["reason"] and found["kept"] == "kept/box"
    assert (folder / "kept/box/inc/box.sdf").read_text() == BOX
    shutil.rmtree(folder / "inc")
    said = ruedo("campaign", "run", "kept/box/regression.yaml", folder=folder, code=1).stdout
    assert "touched box/link" in said


@pytest.mark.parametrize("world", ["w.sdf", "empty"])
def test_the_robots_file_is_kept_with_a_find(tmp_path, world):
    """Regression: what was kept named a robot that is elsewhere."""
    sensor = "<sensor name='imu' type='imu'/></link>"  # which makes it a robot
    robot = BOX.replace("<static>true</static>", "").replace("</link>", sensor)
    folder = blind(
        tmp_path, "always", text=f"worlds: [{world}]\nrobots: ['own/cart.sdf@-3,0']\ndisable: []"
    )
    (folder / "own").mkdir()
    (folder / "own/cart.sdf").write_text(robot)
    found = hunt(folder, "--cases", "1", "--shrink", "0", "--keep", "kept/box")
    assert "always" in found["reason"]
    kept = yaml.safe_load((folder / "kept/box/regression.yaml").read_text())
    assert kept["robots"] == ["own/cart.sdf@-3,0"]
    assert (folder / "kept/box/own/cart.sdf").read_text() == robot


def test_a_kept_case_that_does_not_fail_again_is_reported(tmp_path):
    """And the find is not lost."""
    folder = blind(tmp_path, "once")
    (folder / "blind.py").write_text(
        "from pathlib import Path\n\ndef once(view):\n    mark = Path(__file__ + '.ran')\n"
        "    if not mark.exists():\n        mark.touch()\n        raise RuntimeError('once')\n"
        "    return 'done'\n"
    )
    options = ("--cases", "1", "--shrink", "0", "--keep", "kept", "--workers", "1")
    done = ruedo("hunt", "hunt.yaml", *options, folder=folder, code=4)
    assert "kept: what was kept there does not fail as it did" in done.stderr
    assert "RuntimeError: once" in done.stdout


@pytest.mark.parametrize("there", ["kept/mine.txt", "kept"])
def test_a_find_gets_a_folder_of_its_own(tmp_path, there):
    """Before any case is run."""
    folder = blind(tmp_path, "once")
    (folder / there).parent.mkdir(exist_ok=True)
    (folder / there).write_text("mine")
    done = ruedo("hunt", "hunt.yaml", "--cases", "1", "--keep", "kept", folder=folder, code=2)
    assert done.stderr == ("ruedo: kept is there already: keep what is found in a new folder\n"), (
        done
    )
    assert (folder / there).read_text() == "mine"


def test_a_find_is_not_kept_where_no_folder_can_be(tmp_path):
    folder = blind(tmp_path, "once")
    (folder / "kept").symlink_to("nowhere")
    done = ruedo("hunt", "hunt.yaml", "--cases", "1", "--keep", "kept", folder=folder, code=2)
    assert "kept is there already" in done.stderr


def test_the_plot_of_why_is_checked_before_any_work(tmp_path):
    log = tmp_path / "log.svg"
    with Engine("arena") as engine:
        engine.begin_run(1, log=str(log))
        engine.step(None, 10)
        engine.end_run()
    content = log.read_bytes()
    for file, code, words in (
        ("out.txt", 2, "-o out.txt: its name ends with .svg, .png or .pdf"),
        (
            "log.svg",
            2,
            "-o log.svg is one of the files that are read for this, which would be lost",
        ),
        ("nowhere/a.svg", 4, "nowhere/a.svg: No such file or directory"),
    ):
        done = ruedo("why", "log.svg", "-o", file, "--seeds", "0", folder=tmp_path, code=code)
        assert done.stderr == f"ruedo: {words}\n", done
        assert log.read_bytes() == content


def test_obstacles_go_into_the_world_and_not_into_a_comment():
    """Regression: into the last thing that looked like its end."""
    text = with_boxes(INCLUDES.encode("latin-1"), [(1.0, 2.0, 0.5)])
    assert text.replace(b"</world>", b"", 1).index(b"hunted_0") < text.index(b"</world></sdf>")
    assert text.count(b"hunted_0") == 1 and text.endswith(
        b"</model></world></sdf>\n<!-- was: </world> -->\n"
    )
    for wrong in (b"<sdf version='1.9'/>", b"<sdf><world/></sdf>", b"<sdf><world></sdf>"):
        with pytest.raises(ValueError, match="obstacles"):
            with_boxes(wrong, [])


WRONG = [  # more of the file, its `hunt`, what the message says
    ("worlds: [arena, empty]", {}, "worlds: has 2 members; a hunt has one"),
    ("robots: ['p3at@1,2', 'p3at@2,2']", {}, "robots: has 2 members; a hunt has one"),
    (
        "controllers: [{name: a, python: 'blind.py:ahead'}, {name: b, python: 'blind.py:always'}]",
        {},
        "controllers: has 2 members; a hunt has one",
    ),
    ("parameters: {duration: {uniform: [1, 2]}}", {}, "parameters.duration: is what a hunt itself"),
    ("parameters: {fault: [a, b]}", {}, "parameters.fault: is what a hunt itself chooses"),
    ("parameters: {obstacle0_x: [1, 2]}", {}, "parameters.obstacle0_x: is what a hunt itself"),
    ("", {"faults": [{"kind": "freze", "target": "lrf"}]}, r"faults\[0\]: .*did you mean 'freeze'"),
    ("", {"faults": [{"kind": "freeze", "target": "lrff"}]}, r"faults\[0\]: .*no device 'lrff'"),
    (
        "",
        {"faults": [{"kind": "freeze", "target": "lrf"}, {"kind": "freeze", "target": "{nope}"}]},
        r"faults\[1\]: .*{nope} is not a parameter",
    ),
    ("", {"obstacles": {"most": 1, "area": [-1e308, 0, 1e308, 0]}}, "area: is .*of at most 1e.06"),
]


@pytest.mark.parametrize("text, members, said", WRONG)
def test_a_wrong_hunt_is_reported_with_file_and_line(tmp_path, text, members, said):
    """Regressions: tracebacks, hunts without end for what cannot be found, and parameters that
    took the place of what the hunt chose.
    """
    folder = blind(tmp_path, text=text, **members)
    done = ruedo("hunt", "hunt.yaml", "--cases", "2", folder=folder, code=3).stderr
    assert done.count("\n") == 1 and re.search(rf"hunt.yaml:\d+: .*{said}", done), done


def test_a_parameter_may_have_the_name_of_a_faults_member(tmp_path):
    """Regression: its ends were left out, and it was not told."""
    folder = blind(tmp_path, "careless", text="parameters: {fault_rate: {uniform: [0, 1]}}")
    assert hunt(folder, "--cases", "4", "--shrink", "0")["choices"]["fault_rate"] == 1.0


def test_by_hypothesis_the_last_case_may_be_the_find(tmp_path):
    """Regression: it was asked again whether that fails, without a case left, and it was lost."""
    folder = blind(tmp_path, "always")
    found = hunt(folder, "--cases", "1", "--shrink", "0", "--by", "hypothesis")
    assert found["found"] and "RuntimeError: always" in found["reason"]


def test_obstacles_stand_in_a_world_of_ruedos_own(tmp_path):
    """Regression: its name was taken for a file's."""
    obstacles = {"most": 1, "area": [1, 0, 1, 0]}
    made = Hunt(blind(tmp_path, text="worlds: [arena]", obstacles=obstacles) / "hunt.yaml")
    case = made.case({**made.space.neutral(), "obstacle0": True})
    text = Path(case.what["world"]["file"]).read_text()
    assert "hunted_0" in text and "parcel" in text
