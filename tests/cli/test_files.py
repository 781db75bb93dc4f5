"""Files that users bring: ruedo import, ruedo map, --drive, --allow-absolute and ruedo check, as
users call them.
"""

import json
import os
import re
import subprocess
from pathlib import Path

import pytest

RUEDO = os.environ["RUEDO"]
ARENA = str(Path(os.environ["RUEDO_SOURCE_DIR"]) / "worlds" / "arena.sdf")

URDF = """<robot name="cart"><link name="base"><collision><origin xyz="0 0 0.2"/><geometry><box size="0.4 0.3 0.2"/></geometry></collision></link>
<link name="wl"><collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
<link name="wr"><collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
<joint name="jl" type="continuous"><parent link="base"/><child link="wl"/><origin xyz="0 0.2 0.1"/><axis xyz="0 1 0"/></joint>
<joint name="jr" type="continuous"><parent link="base"/><child link="wr"/><origin xyz="0 -0.2 0.1"/><axis xyz="0 1 0"/></joint></robot>"""


def ruedo(*arguments):
    return subprocess.run([RUEDO, *map(str, arguments)], capture_output=True, text=True, timeout=60)


def test_round_trip_of_a_map(tmp_path):
    one = ruedo("map", ARENA, "-o", tmp_path / "one.yaml", "--resolution", "0.1")
    assert one.returncode == 0 and re.search(
        r"\d+ x \d+ cells of 0.1 m, \d+ occupied", one.stdout
    ), one
    assert ruedo("import", tmp_path / "one.yaml", "-o", tmp_path / "walls.sdf").returncode == 0
    assert (
        ruedo(
            "map", tmp_path / "walls.sdf", "-o", tmp_path / "two.yaml", "--resolution", "0.1"
        ).returncode
        == 0
    )
    # Walls alone have no robot, and so no outside that is unknown.
    known = (tmp_path / "one.pgm").read_bytes().replace(b"\xcd", b"\xfe")
    assert (tmp_path / "two.pgm").read_bytes() == known
    assert ruedo("check", tmp_path / "walls.sdf", "--strict").returncode == 0


def test_import_of_a_bitmap_needs_its_size(tmp_path):
    (tmp_path / "cave.pgm").write_bytes(b"P5\n4 2\n255\n" + bytes([0, 255, 255, 0] * 2))
    assert "--resolution or --width" in ruedo("import", tmp_path / "cave.pgm").stderr
    sdf = ruedo("import", tmp_path / "cave.pgm", "--width", "16").stdout  # 4 m a pixel
    assert "<pose>-6 0 0.5 0 0 0</pose><geometry><box><size>4 8 1</size>" in sdf
    assert sdf.count("<collision") == 2


def test_import_reports_left_out_elements(tmp_path):
    (tmp_path / "lab.map").write_text("2D-Map\nCairn: Goal 0 0 0\nLINES\n0 0 1000 0\nDATA\n")
    done = ruedo("import", tmp_path / "lab.map", "-o", tmp_path / "lab.sdf")
    assert done.stdout.endswith("lab.sdf: 1 walls; left out: 1 Goal\n")
    (tmp_path / "lab.map").write_text("2D-Map\nCairn: \x1b[31mred\nLINES\n0 0 1000 0\nDATA\n")
    done = ruedo("import", tmp_path / "lab.map", "-o", tmp_path / "lab.sdf")
    assert done.stdout.endswith("lab.sdf: 1 walls; left out: 1 ?[31mred\n")


MAP = "image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n"


@pytest.mark.parametrize(
    "name, content, options, code, words",
    [
        ("m.yaml", MAP, ["--resolution", "1"], 2, "--resolution is not for a map's .yaml"),
        ("m.yaml", MAP, ["--width", "1"], 2, "--width is not for a map's .yaml"),
        ("m.yaml", MAP, ["--thickness", "1"], 2, "--thickness is not for a map's .yaml"),
        ("m.map", "2D-Map\nDATA\n1 1\n", ["--width", "1"], 2, "--width is not for a .map"),
        ("m.pgm", None, ["--thickness", "1", "--width", "1"], 2, "--thickness is not for a pic"),
        ("m.pgm", None, ["--resolution", "1", "--width", "1"], 2, "excludes"),
        ("m.pgm", None, ["--width", "100000"], 3, "allowed is 0.0001 to 1000 m"),
        ("m.pgm", None, ["--width", "0.001"], 0, ""),
        ("m.yaml", MAP.replace("m.pgm", "../s.pgm"), [], 3, "m.yaml:1: image: '../s.pgm' lies"),
        ("m.yaml", MAP.replace("m.pgm", "../s.pgm"), ["--allow-absolute"], 0, ""),
        ("m.yaml", MAP + "ocupied_thresh: 0.3\n", [], 0, "m.yaml:4: ocupied_thresh: is not a key"),
        ("m.map", "2D-Map\nDATA\n" + "1 1\n" * 1_500_000, [], 3, "more than 100000 walls"),
    ],
)
def test_import_takes_what_a_world_takes(name, content, options, code, words, tmp_path):
    """And what it wrote is a world that has no findings."""
    folder = tmp_path / "maps"
    folder.mkdir()
    for picture in (folder / "m.pgm", tmp_path / "s.pgm"):
        picture.write_bytes(b"P5\n4 2\n255\n" + bytes([0, 255, 255, 0] * 2))
    if content:
        (folder / name).write_text(content)
    done = ruedo("import", folder / name, "-o", folder / "w.sdf", *options)
    assert done.returncode == code and words in done.stderr, done
    assert (folder / "w.sdf").exists() == (code == 0)
    if code == 0:
        assert ruedo("check", folder / "w.sdf", "--strict").returncode == 0


@pytest.mark.parametrize(
    "text", ["cart", "cart=jl", "=jl,jr", "cart=jl,", "cart=jl+,jr", "cart=jl,jr,x"]
)
def test_a_drive_option_says_what_it_looks_like(text):
    done = ruedo("info", ARENA, "--drive", text)
    assert done.returncode == 2 and "ROBOT=LEFT[+LEFT...],RIGHT[+RIGHT...]" in done.stderr


def test_a_urdf_without_a_plugin_gets_a_drive(tmp_path):
    (tmp_path / "cart.urdf").write_text(URDF)
    guessed = json.loads(
        ruedo("check", tmp_path / "cart.urdf", "--json").stdout
    )  # from the joints' names and places, with a finding
    assert len(guessed) == 1 and "--drive" in guessed[0]["text"], guessed
    robots = json.loads(
        ruedo("info", tmp_path / "cart.urdf", "--drive", "cart=jl,jr", "--json").stdout
    )["robots"]
    assert [(robot["name"], robot["drive"], robot["wheels"]) for robot in robots] == [
        ("cart", "kinematic", ["jl", "jr"])
    ]
    assert abs(robots[0]["track"] - 0.4) < 1e-9


def test_absolute_paths_are_let_in_by_the_user_only(tmp_path):
    far = tmp_path / "far" / "away"
    far.mkdir(parents=True)
    (far / "cart.urdf").write_text(URDF)
    world = tmp_path / "a" / "b" / "w.sdf"
    world.parent.mkdir(parents=True)
    world.write_text(
        f"<sdf version='1.9'><world name='w'><include><uri>{far}/cart.urdf</uri></include></world></sdf>"
    )
    refused = json.loads(ruedo("check", world, "--json").stdout)
    assert (
        len(refused) == 1 and "--allow-absolute" in refused[0]["text"] and refused[0]["line"] == 1
    )
    allowed = json.loads(ruedo("check", world, "--json", "--allow-absolute").stdout)
    assert len(allowed) == 1 and "--drive" in allowed[0]["text"], (
        allowed
    )  # that its drive is guessed


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root to become a user without rights")
def test_an_unreadable_file_is_reported(tmp_path):
    """Root may read everything, so this runs as an ordinary user."""
    world = Path("/tmp") / f"ruedo-denied-{os.getpid()}.sdf"
    world.write_text("<sdf version='1.9'/>")
    world.chmod(0)
    try:
        done = subprocess.run(
            [RUEDO, "check", world],
            capture_output=True,
            text=True,
            timeout=60,
            preexec_fn=lambda: os.setuid(65534),
        )
    except PermissionError:
        pytest.skip("the program lies where nobody may run it")
    finally:
        world.unlink()
    assert (
        done.returncode == 3 and f"{world}" in done.stdout and "Permission denied" in done.stdout
    ), done


def test_a_thousand_robots_load_at_once(tmp_path):
    """1 000 P3-AT up to their first step: time of the processor, and memory."""
    (tmp_path / "w.sdf").write_text(
        "<sdf version='1.9'><world name='w'><include><uri>model://ground_plane</uri></include><ruedo:fleet name='r'>"
        "<include><uri>model://p3at</uri></include><ruedo:count>1000</ruedo:count></ruedo:fleet></world></sdf>"
    )
    no_pictures = [word for i in range(1000) for word in ("--disable", f"r_{i + 1}/camera")]
    process = subprocess.Popen(
        [
            RUEDO,
            "run",
            str(tmp_path / "w.sdf"),
            "--lcm",
            "memq://",
            "--rate",
            "max",
            "--duration",
            "0.005",
            "--quiet",
            *no_pictures,
        ]
    )
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0
    assert used.ru_utime + used.ru_stime < 3.0  # s
    assert used.ru_maxrss < 1_000_000  # kB


@pytest.mark.parametrize(
    "wrong",
    [
        ("--set", "p3at/lrf.update_rate=abc"),
        ("--remap", "a=b"),
        ("--wait-for", "nosuch@10"),
        ("--restore", ARENA),
        ("--view", "banana"),
        ("--view", "1.2.3.4:8080"),
        ("--foxglove", "banana"),
        ("--foxglove", "1.2.3.4:8765"),
        ("--ros2", "nosuch"),
        ("--ros2", "--remap", "/nosuch=/b"),
        ("--ros2", "--wait-for", "/nosuch@10"),
        ("--view", "127.0.0.1:18765", "--foxglove", "127.0.0.1:18765"),
    ],
)
@pytest.mark.parametrize("ring", [(), ("--record-limit", "16MB")])
def test_a_run_that_is_refused_leaves_the_log_of_an_earlier_one(wrong, ring, tmp_path):
    log, numbered = tmp_path / "run.lcm", tmp_path / "run.000007.lcm"
    for file in (log, numbered):
        file.write_text("kept")
    refused = ruedo("run", ARENA, "--lcm", "memq://", "--record", log, *ring, *wrong)
    assert refused.returncode in (2, 3, 4), refused
    assert log.read_text() == numbered.read_text() == "kept"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--set", "p3at/lrf.update_rate=abc"], "update_rate"),
        (["--set", "p3at/nosuch.update_rate=5"], "nosuch"),
        (["--set", "p3at/lrf.update_rate=5", "--set", "p3at/lrf.update_rate=9"], "already, to 5"),
        (["--disable", "p3at/nosuch"], "nosuch"),
        (["--fault", "p3at/nosuch:freeze@1"], "nosuch"),
        (["--xacro-arg", "a:=b"], "no file of this world is xacro"),
        (["--spawn", "p3dx:world@-3,3"], "the name 'world' is reserved"),
        (["--spawn", "p3dx:ruedo@-3,3"], "reserved"),
        (["--spawn", "p3dx:__x__@-3,3"], "reserved"),
    ],
)
def test_all_commands_that_load_a_world_refuse_the_same_options(options, said, tmp_path):
    for command in (
        ["run", "--lcm", "memq://", "--duration", "0"],
        ["check"],
        ["info"],
        ["map", "-o", tmp_path / "m.yaml"],
        ["render", "-o", tmp_path / "p.png"],
    ):
        done = ruedo(command[0], ARENA, *command[1:], *options)
        assert done.returncode == 2 and said in done.stderr + done.stdout, (command, done)
    assert not any(tmp_path.iterdir())


def test_a_channel_gets_one_name(tmp_path):
    twice = ["--remap", "p3at/lrf=A", "--remap", "p3at/lrf=B"]
    log = tmp_path / "run.lcm"
    for command in (
        ["run", ARENA, "--lcm", "memq://", "--duration", "0"],
        ["regress", ARENA, "--duration", "0.1", "--record", log],
    ):
        done = ruedo(*command, *twice)
        assert done.returncode == 2, done
        assert "'p3at/lrf=B': p3at/lrf has a new name already: A" in done.stderr


def test_names_of_ros_are_for_bags(tmp_path):
    log = tmp_path / "run.lcm"
    run = ["run", ARENA, "--quiet", "--lcm", "memq://", "--duration", "0.1", "--record", log]
    assert ruedo(*run).returncode == 0
    for option in (["--remap", "/scan=/x"], ["--distro", "jazzy"]):
        done = ruedo("export", log, tmp_path / "x.mcap", *option)
        assert done.returncode == 2 and "they need --ros2" in done.stderr, done
    done = ruedo("export", log, "--ros2", tmp_path / "bag", "--remap", "/nosuch=/x")
    assert done.returncode == 2 and "no ROS topic or service '/nosuch'" in done.stderr, done
    assert sorted(tmp_path.iterdir()) == [log]


def test_record_limit_removes_what_it_has_written_alone(tmp_path):
    """And not a log that is called by the time of day."""
    mine = tmp_path / "run.091500.lcm"
    run = ["run", ARENA, "--quiet", "--lcm", "memq://", "--rate", "max", "--duration", "0.5"]
    assert ruedo(*run, "--record", mine).returncode == 0
    (tmp_path / "run.000001.lcm").write_text("a text")
    kept = mine.read_bytes()
    (tmp_path / "run.000000.lcm").write_bytes(kept)
    for _ in range(2):
        ring = ruedo(*run, "--record", tmp_path / "run.lcm", "--record-limit", "16MB")
        assert ring.returncode == 0, ring
        assert mine.read_bytes() == kept
        assert (tmp_path / "run.000001.lcm").read_text() == "a text"
        names = ["run.000000.lcm", "run.000001.lcm", "run.000002.lcm", "run.091500.lcm", "run.lcm"]
        assert sorted(path.name for path in tmp_path.iterdir()) == names
