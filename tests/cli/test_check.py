"""ruedo check, as users call it: results for hostile and broken files, the JSON list, exit codes,
and colour on a terminal.
"""

import json
import os
import pty
import struct
import subprocess

import pytest

RUEDO = os.environ["RUEDO"]
PNG = b"\x89PNG\r\n\x1a\n"


def check(file, *options):
    return subprocess.run([RUEDO, "check", str(file), *options], capture_output=True, timeout=60)


def run_strictly(file, log):
    quick = ("--lcm", "memq://", "--rate", "max", "--duration", "0.1", "--record", str(log))
    return subprocess.run(
        [RUEDO, "run", str(file), "--strict", *quick], capture_output=True, timeout=60
    )


def world(inside):
    return f"<sdf version='1.9'>\n<world name='w'>\n{inside}\n</world></sdf>"


def in_link(inside):
    """In line 4 of a world of one static model."""
    return world(f"<model name='m'><static>true</static><link name='l'>\n{inside}\n</link></model>")


def mesh(name):
    return in_link(
        f"<collision name='c'><geometry><mesh><uri>{name}</uri></mesh></geometry></collision>"
    )


def heightmap(name):
    return in_link(
        f"<collision name='c'><geometry><heightmap><uri>{name}</uri><size>1 1 1</size></heightmap></geometry></collision>"
    )


def texture(name):
    return in_link(
        f"<visual name='v'><geometry><box><size>1 1 1</size></box></geometry><material><pbr><metal><albedo_map>{name}</albedo_map></metal></pbr></material></visual>"
    )


def png(width, height):
    return (
        PNG
        + struct.pack(">I", 13)
        + b"IHDR"
        + struct.pack(">II", width, height)
        + b"\x08\x02\0\0\0"
        + bytes(8)
    )


COLLISION = "model m/link l/collision c"
# The world's text; other files beside it; the exit code; the finding's kind, line and element,
# and a part of its text.
FILES = {
    "a sensor that is none": (
        in_link(
            "<sensor name='s' type='ray'><ray><scan><horizontal><samples>-1</samples></horizontal></scan><range><max>3</max></range></ray></sensor>"
        ),
        {},
        1,
        ("error", 4, "m/s", "; the sensor is left out"),
    ),
    "a lidar without rays": (
        in_link(
            "<sensor name='s' type='lidar'><lidar><scan><horizontal><samples>0</samples></horizontal></scan><range><max>3</max></range></lidar></sensor>"
        ),
        {},
        1,
        (
            "error",
            4,
            "m/s",
            "<horizontal/samples>: '0' is not allowed; allowed is a number from 1 to 1000000",
        ),
    ),
    "a sensor whose own element is wrong": (
        in_link("<sensor name='s' type='imu'><ruedo:phase>x</ruedo:phase></sensor>"),
        {},
        3,
        ("error", 4, "m/s", "ruedo:phase>: 'x' is not a number"),
    ),
    "broken mesh": (
        mesh("a.dae"),
        {"a.dae": b"<COLLADA>no"},
        1,
        ("error", 4, COLLISION, "the mesh 'a.dae' cannot be used: "),
    ),
    "bytes of the mesh in the importer's message": (
        mesh("a.stl"),
        {"a.stl": b"solid\xff\xfe" + bytes(range(256))},
        1,
        ("error", 4, COLLISION, "the mesh 'a.stl' cannot be used: "),
    ),
    "empty mesh": (
        mesh("a.stl"),
        {"a.stl": b""},
        1,
        ("error", 4, COLLISION, "the mesh 'a.stl' cannot be used: "),
    ),
    "unknown mesh": (
        mesh("a.blend"),
        {"a.blend": b"x"},
        1,
        ("error", 4, COLLISION, "'.blend' is not a known kind of mesh; known are obj, dae"),
    ),
    "folder as mesh": (
        mesh("sub"),
        {"sub/x": b""},
        1,
        ("error", 4, COLLISION, "the mesh 'sub' cannot be used: it is a folder; a file is needed"),
    ),
    "missing mesh": (
        mesh("none.dae"),
        {},
        1,
        ("error", 4, COLLISION, "the mesh 'none.dae' is not found; the shape is left out"),
    ),
    "missing picture": (
        heightmap("none.png"),
        {},
        3,
        ("error", 4, "", "the heightmap 'none.png' is not found"),
    ),
    "broken picture": (
        heightmap("a.png"),
        {"a.png": PNG + bytes(40)},
        3,
        ("error", 4, "", "it is not a picture that can be read (pgm, png, jpeg, bmp, tiff)"),
    ),
    "huge picture": (
        heightmap("a.png"),
        {"a.png": png(200000, 200000)},
        3,
        ("error", 4, "", "200000 x 200000 pixels; allowed are 8193 each way"),
    ),
    "missing texture": (
        texture("none.png"),
        {},
        0,
        ("unsupported", 4, "model m/link l/visual v", "the texture 'none.png' is not found"),
    ),
    "broken texture": (
        texture("a.png"),
        {"a.png": PNG + bytes(40)},
        0,
        ("unsupported", 0, "", "the texture is not a picture that can be read"),
    ),
    "include of a folder": (
        world("<include><uri>sub</uri></include>"),
        {"sub/x": b""},
        1,
        ("error", 3, "world/include", "'sub' is a folder without model.config or model.sdf"),
    ),
    "joint between models": (
        world(
            "<joint name='j' type='fixed'><parent>a::l</parent><child>b::l</child></joint>\n"
            + "".join(f"<model name='{name}'><link name='l'/></model>" for name in "ab")
        ),
        {},
        0,
        ("repaired", 4, "model a", "together they are one model, called 'a'"),
    ),
    "circle": (
        world("<include><uri>a.sdf</uri></include>"),
        {
            "a.sdf": b"<sdf version='1.9'><model name='a'><include><uri>a.sdf</uri></include></model></sdf>"
        },
        1,
        [
            (
                "error",
                1,
                "model a",
                "an include that never ends: a.sdf includes a.sdf; the part is left out",
            ),
            ("error", 1, "model a", "it has no link; the model is left out"),
        ],
    ),
    "number": (
        in_link("<pose>1e999 0 0 0 0 0</pose>"),
        {},
        1,
        [
            ("error", 4, "model m", "'1e999' is too large for a number; the link is left out"),
            ("error", 3, "model m", "it has no link; the model is left out"),
        ],
    ),
    "not a number": (
        in_link("<pose>nan 0 0 0 0 0</pose>"),
        {},
        1,
        [
            (
                "error",
                4,
                "model m",
                "'nan' is not finite; allowed is a number; the link is left out",
            ),
            ("error", 3, "model m", "it has no link; the model is left out"),
        ],
    ),
    "only a mark": ("\ufeff", {}, 3, ("error", 0, "", "the file is empty")),
}


@pytest.mark.parametrize("name", FILES)
def test_files_that_are_wrong(name, tmp_path):
    text, others, code, expected = FILES[name]
    for other, content in others.items():
        (tmp_path / other).parent.mkdir(exist_ok=True)
        (tmp_path / other).write_bytes(content)
    (tmp_path / "w.sdf").write_text(text, encoding="utf-8")
    done = check(tmp_path / "w.sdf", "--json")
    findings = json.loads(done.stdout.decode("utf-8"))
    expected = expected if isinstance(expected, list) else [expected]
    assert done.returncode == code and len(findings) == len(expected), findings
    text = check(tmp_path / "w.sdf").stdout.decode()
    for found, (kind, line, element, part) in zip(findings, expected):
        assert set(found) == {"kind", "file", "line", "element", "text"}
        assert found["file"].startswith(str(tmp_path)) and part in found["text"]
        assert (found["kind"], found["line"], found["element"]) == (kind, line, element)
        place = found["file"] + (f":{line}" if line else "")
        assert part in text and place in text and "\x1b" not in text
    assert check(tmp_path / "w.sdf", "--strict").returncode == (code or 1)
    done = run_strictly(tmp_path / "w.sdf", tmp_path / "run.lcm")
    assert done.returncode == (code or 1) and not (tmp_path / "run.lcm").exists()
    assert all(part in done.stderr.decode() for _, _, _, part in expected)


SERVED = [
    "camera",
    "depth",
    "depth_camera",
    "rgbd",
    "rgbd_camera",
    "ray",
    "lidar",
    "gpu_ray",
    "gpu_lidar",
    "sonar",
    "imu",
    "contact",
    "air_pressure",
    "air_speed",
    "altimeter",
    "gps",
    "magnetometer",
    "navsat",
    "boundingbox_camera",
    "logical_camera",
    "segmentation_camera",
    "thermal_camera",
    "wideanglecamera",
]
NOT_SERVED = [
    "custom",
    "dvl",
    "multicamera",
    "rfid",
    "rfidtag",
    "wireless_receiver",
    "wireless_transmitter",
]


def test_every_kind_of_sensor_is_served_or_reported(tmp_path):
    kinds = SERVED + NOT_SERVED
    sensors = "\n".join(
        f"<sensor name='s{i}' type='{kind}'><update_rate>10</update_rate></sensor>"
        for i, kind in enumerate(kinds)
    )
    joint = "<link name='arm'/><joint name='j' type='fixed'><parent>l</parent><child>arm</child>\n<sensor name='f' type='force_torque'/></joint>"
    (tmp_path / "w.sdf").write_text(
        world(f"<model name='m'><link name='l'>\n{sensors}\n</link>{joint}</model>")
    )
    named = {
        (f["line"], f["element"]): f["text"]
        for f in json.loads(check(tmp_path / "w.sdf", "--json").stdout)
        if f["kind"] == "unsupported"
    }
    wanted = {
        (
            4 + i,
            f"model m/sensor s{i}",
        ): f"sensors of type '{kind}' are not supported; the robot runs without it"
        for i, kind in enumerate(kinds)
        if kind in NOT_SERVED
    }
    assert named == wanted


def test_equal_findings_are_one_with_all_its_places(tmp_path):
    boxes = "\n".join(
        f"<collision name='{i}'><geometry><bx/></geometry></collision>" for i in range(3)
    )
    (tmp_path / "w.sdf").write_text(in_link(boxes))
    lines = check(tmp_path / "w.sdf").stdout.decode().splitlines()
    assert lines[0].startswith("error: ") and "did you mean <box>?" in lines[0]
    assert [line.split(":")[1].split()[0] for line in lines[1:4]] == ["4", "5", "6"]
    assert lines[4].endswith("w.sdf: 3 errors, 0 not supported, 0 repaired") and len(lines) == 5


def test_names_cannot_speak_to_the_terminal(tmp_path):
    """ESC, and the control character that some terminals take for ESC and '['."""
    hostile = "&#27;[31m&#155;0m"
    link = f"<link name='l{hostile}'><inertial><mass>-1</mass></inertial><sensor name='s{hostile}' type='x{hostile}'/></link>"
    (tmp_path / "w.sdf").write_text(
        f"<sdf version='1.9'><world name='w{hostile}'><model name='m{hostile}'>{link}</model></world></sdf>"
    )
    for command in (
        ["check"],
        ["info"],
        ["run", "--duration", "0.1", "--lcm", "memq://"],
        ["run", "--spawn", "p3at\x1b[0m@0,0"],
    ):
        done = subprocess.run(
            [RUEDO, command[0], str(tmp_path / "w.sdf"), *command[1:]],
            capture_output=True,
            timeout=60,
        )
        said = (done.stdout + done.stderr).decode()
        assert "?[31m?0m" in said or "p3at?[0m" in said, said
        assert not any(
            (ord(letter) < 32 and letter != "\n") or 127 <= ord(letter) < 160 for letter in said
        )


def test_a_terminal_has_colours_and_no_one_else(tmp_path):
    (tmp_path / "w.sdf").write_text(mesh("none.dae"))
    ours, theirs = pty.openpty()
    environment = {name: value for name, value in os.environ.items() if name != "NO_COLOR"}
    done = subprocess.run(
        [RUEDO, "check", tmp_path / "w.sdf"],
        stdout=theirs,
        env={**environment, "TERM": "xterm"},
        timeout=60,
    )
    os.close(theirs)
    shown = os.read(ours, 65536).decode()
    os.close(ours)
    assert done.returncode == 1 and "\x1b[" in shown and "error" in shown
