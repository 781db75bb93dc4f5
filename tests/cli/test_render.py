"""ruedo render: pictures of the right size that show something, and what it says of wrong
options.
"""

import math
import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

RUEDO = os.environ["RUEDO"]
sys.path.insert(0, str(Path(RUEDO).parents[1] / "python"))
ARENA = str(Path(os.environ["RUEDO_SOURCE_DIR"]) / "worlds/arena.sdf")


def render(*arguments):
    return subprocess.run(
        [RUEDO, "render", *map(str, arguments)], capture_output=True, text=True, timeout=120
    )


def read_png(path):
    """The pixels, rows x columns x RGB, of a PNG of 8 bits a colour that is not interlaced."""
    data = Path(path).read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour, *_, interlaced = struct.unpack(">IIBBBBB", body)
            assert (depth, colour, interlaced) == (8, 2, 0)
        if kind == b"IDAT":
            packed += body
        at += 12 + length
    lines = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + 3 * width)
    rows = np.zeros(
        (height + 1, 3 * width + 3), int
    )  # a row above and a pixel to the left, both black
    for y in range(height):
        kind, above, row = lines[y, 0], rows[y], rows[y + 1]
        for x in range(3 * width):
            a, b, c = int(row[x]), int(above[x + 3]), int(above[x])
            nearest = min((a, b, c), key=lambda v: abs(a + b - c - v))
            row[x + 3] = (int(lines[y, x + 1]) + (0, a, b, (a + b) // 2, nearest)[kind]) % 256
    return rows[1:, 3:].reshape(height, width, 3)


def test_world_from_above_and_its_rays(tmp_path):
    pictures = {}
    for name, options in {"plain": [], "again": [], "rays": ["--rays"]}.items():
        path = tmp_path / f"{name}.png"
        result = render(ARENA, "--view", "top", "--size", "160x120", "-o", str(path), *options)
        assert result.returncode == 0, result.stderr
        assert result.stderr == ""
        pictures[name] = read_png(path)
        assert pictures[name].shape == (120, 160, 3)
    assert len(np.unique(pictures["plain"].reshape(-1, 3), axis=0)) > 50
    assert (pictures["plain"] == pictures["again"]).all()
    changed = (pictures["plain"] != pictures["rays"]).any(axis=2)
    # The laser's half disc and the cones cover much of the arena, and nothing outside.
    assert 0.02 < changed.mean() < 0.7
    red, green, blue = (pictures["rays"][changed] - pictures["plain"][changed]).mean(axis=0)
    assert red > green + 10 and red > blue + 10


def test_a_box_where_it_must_be(tmp_path):
    # 2 m wide, its near face 4 m ahead of an eye that sees 1.2 rad across, on the picture's middle.
    world = tmp_path / "box.sdf"
    world.write_text(
        """<sdf version="1.9"><world name="w"><scene><background>0 0 1 1</background><shadows>false</shadows></scene>
  <model name="box"><static>true</static><pose>5 0 1 0 0 0</pose><link name="l"><visual name="v">
    <geometry><box><size>2 2 2</size></box></geometry>
    <material><diffuse>0 1 0 1</diffuse><ambient>0 1 0 1</ambient></material></visual></link></model>
</world></sdf>"""
    )
    path = tmp_path / "box.png"
    result = render(str(world), "--view", "0,0,1,0,0,0", "--size", "120x120", "-o", str(path))
    assert result.returncode == 0, result.stderr
    pixels = read_png(path)
    green = (pixels[..., 1] > pixels[..., 2]) & (pixels[..., 1] > pixels[..., 0])
    rows, columns = np.nonzero(green)
    assert abs(rows.mean() - 59.5) < 1 and abs(columns.mean() - 59.5) < 1
    side = rows.max() - rows.min() + 1
    assert side == columns.max() - columns.min() + 1 and green.sum() == side * side
    assert abs(side - 120 * (1 / 4) / np.tan(0.6)) < 1.5
    assert (pixels[0, 0] == (0, 0, 255)).all()


def test_a_roof_is_taken_off(tmp_path):
    def box(name, at, size, colour):
        geometry = f"<geometry><box><size>{size}</size></box></geometry>"
        return f"<model name='{name}'><static>true</static><pose>{at} 0 0 0</pose><link name='l'><visual name='v'>{geometry}<material><ambient>{colour} 1</ambient><diffuse>{colour} 1</diffuse></material></visual></link></model>"

    (tmp_path / "w.sdf").write_text(
        "<sdf version='1.9'><world name='w'>"
        + box("floor", "0 0 0", "8 8 0.1", "0.2 0.2 0.2")
        + box("roof", "0 0 3", "8 8 0.2", "0.3 0.3 0.3")
        + box("thing", "1 1 0.5", "1 1 1", "1 0 0")
        + "</world></sdf>"
    )

    def reds(*options):
        out = tmp_path / "w.png"
        result = render(tmp_path / "w.sdf", "--size", "100x100", "-o", out, *options)
        assert result.returncode == 0, result.stderr
        picture = read_png(out)
        return int(((picture[:, :, 0] > 60) & (picture[:, :, 1] < 40)).sum()), result.stdout

    for view in ("top", "iso"):
        count, said = reds("--view", view)
        assert count > 50 and "is left out" in said and "--cut none" in said
        assert reds("--view", view, "--cut", "none")[0] == 0
        assert reds("--view", view, "--cut", "2.5")[0] > 50
    assert "is left out" not in render(ARENA, "-o", tmp_path / "a.png").stdout


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Two seconds of a robot that drives along the x axis."""
    folder = tmp_path_factory.mktemp("video")
    path = folder / "run.lcm"
    world = folder / "mover.sdf"
    world.write_text("""<?xml version="1.0"?>
<sdf version="1.9" xmlns:ruedo="https://ruedo.org/sdf"><world name="mover">
<include><uri>model://ground_plane</uri></include><include><uri>model://sun</uri></include>
<model name="box"><pose>0 0 3 0 0 0</pose><link name="link">
<inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>
<visual name="v"><geometry><box><size>1 1 1</size></box></geometry>
<material><ambient>1 0 0 1</ambient><diffuse>1 0 0 1</diffuse></material></visual>
<collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision>
</link></model></world></sdf>""")
    subprocess.run(
        [RUEDO, "run", world, "--lcm", "memq://", "--quiet", "--rate", "max"]
        + ["--duration", "2", "--record", path],
        check=True,
        timeout=120,
    )
    return path


@pytest.mark.parametrize("kind", ["webm", "mp4"])
def test_a_log_is_a_video(log, tmp_path, kind):
    """A box that falls from 3 m: 2 s at 10 pictures a second are 21 of them. The file's head says
    what it is; the writer reads nothing, so OpenCV's reader is asked where Python has it.
    """
    path = tmp_path / f"run.{kind}"
    seen = ("--view=-8,0,1.5,0,0,0", "--size", "320x240")
    result = render(log, "--video", path, "--fps", "10", *seen)
    assert result.returncode == 0, result.stderr
    assert result.stdout == f"{path}: 21 frames of 320 x 240 pixels, 2.1 s\n"
    head = path.read_bytes()
    if kind == "webm":
        assert head[:4] == b"\x1a\x45\xdf\xa3" and b"webm" in head[:64] and b"V_VP8" in head
    else:
        assert head[4:8] == b"ftyp" and b"avc1" in head
    part = tmp_path / f"part.{kind}"
    result = render(log, "--video", part, "--from", "0.5", "--to", "1.5", "--rate", "0.5", *seen)
    assert result.stdout == f"{part}: 61 frames of 320 x 240 pixels, 2.03333 s\n", result.stderr


DRAWN = """<?xml version="1.0"?><sdf version="1.9"><world name="drawn">
<include><uri>model://sun</uri></include><include><uri>model://ground_plane</uri></include>
<include><uri>model://p3at</uri><pose>1 2 0 0 0 1.5707963267948966</pose></include>
</world></sdf>"""


def frames_of(video, width, height):
    """Its pictures, by the program that writes them."""
    command = ["ffmpeg", "-v", "error", "-i", video, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    raw = subprocess.run(command, check=True, capture_output=True, timeout=60).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, height, width, 3).astype(int)


def test_a_video_has_the_drawings_of_clients(tmp_path):
    """Seen from straight above: up in the picture is x, left is y."""
    import ruedo

    made = ruedo.markers
    world, log, video = tmp_path / "w.sdf", tmp_path / "run.lcm", tmp_path / "run.mp4"
    world.write_text(DRAWN)
    with ruedo.launch(world, args=["--disable", "p3at/camera", "--record", str(log)]) as sim:
        sim.sleep(0.3)
        sim.markers(
            "world",
            [
                made.points([[0, 0, 0.02]], (1, 0, 0), 1),
                made.path([[-3, -3, 0.02], [-3, 3, 0.02]], (1, 1, 0), 0.5),
                made.points([[3, 0, -1]], (1, 0, 0), 1),  # below the ground
                made.text("#####", (-1.5, 0, 0.1), (1, 0, 1), 1),
            ],
        )
        sim.markers("robot", [made.map([[100, 0]], 1, (1, -0.5), color=(0, 0, 1))], frame="p3at")
        sim.state()  # answered behind them
        sim.sleep(0.3)
        sim.markers("world")
        sim.state()
        sim.sleep(0.3)
    size = 320
    seen = ("--view=0,0,12,0,1.5707963267948966,0", "--size", f"{size}x{size}", "--fps", "20")
    result = render(log, "--video", video, *seen)
    assert result.returncode == 0, result.stderr
    frames = frames_of(video, size, size)

    def spot(frame, color):
        """(pixels, middle row, middle column) of what has a colour."""
        channels = np.array(color, bool)
        like = (frame[..., channels] > 150).all(-1) & (frame[..., ~channels] < 110).all(-1)
        rows, columns = np.nonzero(like)
        return len(rows), rows.mean() if len(rows) else 0, columns.mean() if len(rows) else 0

    middle = (size - 1) / 2
    shown = [spot(frame, (1, 0, 0))[0] > 20 for frame in frames]
    first, last = shown.index(True), len(shown) - 1 - shown[::-1].index(True)
    assert (
        2 < first < last < len(frames) - 3
    )  # not before it was drawn, nor after it was taken away
    frame = frames[(first + last) // 2]
    red, yellow, blue = (spot(frame, c) for c in ((1, 0, 0), (1, 1, 0), (0, 0, 1)))
    assert red[1:] == pytest.approx((middle, middle), abs=1.5)
    scale = (yellow[1] - middle) / 3  # pixels a metre
    assert yellow[2] == pytest.approx(middle, abs=2) and scale > 8
    assert red[0] == pytest.approx(math.pi * (scale / 2) ** 2, rel=0.25)  # and nothing below ground
    assert yellow[0] == pytest.approx(6 * 0.5 * scale**2, rel=0.25)
    # In front of the robot, which looks along y from (1, 2): x from 0.5 to 1.5, y from 3 to 4.
    assert blue[1:] == pytest.approx((middle - 1 * scale, middle - 3.5 * scale), abs=2)
    assert blue[0] == pytest.approx(scale**2, rel=0.25)
    pink = spot(frame, (1, 0, 1))
    assert pink[0] > 20 and pink[1:] == pytest.approx((middle + 1.5 * scale, middle), abs=4)
    assert spot(frames[-1], (0, 0, 1))[0] == pytest.approx(blue[0], rel=0.2)  # a layer of its own


def test_picture_of_a_camera(tmp_path):
    path = tmp_path / "camera.png"
    result = render(ARENA, "--camera", "p3at/camera", "--size", "96x72", "-o", str(path))
    assert result.returncode == 0, result.stderr
    pixels = read_png(path)
    assert pixels.shape == (72, 96, 3)
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 20
    sky, ground = pixels[0].mean(axis=0), pixels[-1].mean(axis=0)
    assert sky[2] > sky[0] + 20 and ground[2] <= ground[0] + 5  # blue above, not below


@pytest.mark.parametrize(
    "arguments, code, words",
    [
        ([], 2, "--output"),
        (["-o", "x.bmp"], 2, ".png"),
        (["-o", "/nowhere/x.png"], 4, "/nowhere/x.png"),
        (["-o", "x.png", "--camera", "p3at"], 2, "ROBOT/DEVICE"),
        (
            ["-o", "x.png", "--camera", "p3at/lrf"],
            2,
            "--camera p3at/lrf: there is no such camera; there are: p3at/camera",
        ),
        (["-o", "x.png", "--camera", "p3at/camrea"], 2, "did you mean p3at/camera"),
        (["-o", "x.png", "--camera", "p3at/camera", "--rays"], 2, "--rays"),
        (["-o", "x.png", "--view", "below"], 2, "top, iso"),
        (["-o", "x.png", "--size", "0x9"], 2, "WIDTHxHEIGHT"),
        (["-o", "x.png", "--fps", "5"], 2, "--fps goes with --video"),
        (["-o", "x.png", "--cut", "low"], 2, "--cut low: allowed are a height in m, auto and none"),
    ],
)
def test_reports_errors(arguments, code, words):
    result = render(ARENA, *arguments)
    assert result.returncode == code, result.stderr
    assert words in result.stderr


@pytest.mark.parametrize(
    "arguments, code, words",
    [
        (["x.avi"], 2, "--video x.avi: allowed are names that end in .webm or .mp4"),
        (["x.mp4", "-o", "x.png"], 2, "--video goes with --view, not with --output"),
        (["x.mp4", "--cut", "2.5"], 2, "--video goes with --view, not with --cut"),
        (["x.mp4", "--set", "p3at/lrf.update_rate=1"], 2, "not with --set"),
        (["x.mp4", "--no-noise"], 2, "not with --no-noise"),
        (["x.mp4", "--size", "31x20"], 2, "--size 31x20: a video's sides are even"),
        (["x.mp4", "--size", "4000x20"], 2, "3840 pixels at most"),
        (["x.mp4", "--fps", "0"], 2, "--fps"),
        (["x.mp4", "--rate", "nan"], 2, "--rate"),
        (["x.mp4", "--from", "3"], 3, "--from 3: the log has 0 to 2 s"),
        (["x.mp4", "--to", "-1"], 3, "--to -1: the log has 0 to 2 s"),
        (["x.mp4", "--from", "1", "--to", "0.5"], 2, "--from: it must be before --to"),
        (["x.mp4", "--rate", "0.001", "--fps", "120"], 3, "240001 frames: a video has 100000"),
        (["x.mp4", "--follow", "boks"], 2, "--follow boks: there is no such robot"),
        (["/nowhere/x.mp4", "--size", "64x64"], 4, "/nowhere/x.mp4 cannot be written"),
        (["x.mp4", "--from", "nan"], 3, "--from nan: the log has 0 to 2 s"),
    ],
)
def test_reports_errors_of_a_video(log, tmp_path, arguments, code, words):
    earlier = tmp_path / "x.mp4"
    earlier.write_bytes(b"an earlier video")
    result = subprocess.run(
        [RUEDO, "render", log, "--video", *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        cwd=tmp_path,
    )
    assert result.returncode == code, result.stderr
    assert words in result.stderr.splitlines()[0], result.stderr
    assert earlier.read_bytes() == b"an earlier video"


def test_a_damaged_log_is_reported(log, tmp_path):
    damaged = tmp_path / "damaged.lcm"
    content = Path(log).read_bytes()
    damaged.write_bytes(content[: len(content) // 2] + bytes(5000))
    result = render(str(damaged), "--video", str(tmp_path / "x.webm"), "--size", "64x64")
    assert result.returncode == 0, result
    assert f"ruedo: {damaged}: " in result.stderr and result.stderr.count("\n") == 1, result
