"""Height maps of the size that Gazebo's users have: time, memory, and the surface that robots, rays
and cameras meet, against its formula; what is too large ends a run.
"""

import math
import os
import re
import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest
import ruedo

RUEDO = os.environ["RUEDO"]
SIDE, HIGH = 409.6, 20.0  # m
WORLD = """<sdf version='1.9' xmlns:ruedo='https://ruedo.org'><world name='w'>
<model name='ground'><static>true</static><link name='l'><collision name='c'><geometry><heightmap>
<uri>hills.png</uri><size>{size}</size></heightmap></geometry></collision>
<visual name='v'><geometry><heightmap><uri>hills.png</uri><size>{size}</size>
</heightmap></geometry></visual></link></model></world></sdf>"""


def png(path, rows):
    """A grey picture of 16 bits."""
    rows = np.asarray(rows, dtype=">u2")
    height, width = rows.shape
    lines = np.zeros((height, 1 + 2 * width), dtype=np.uint8)
    lines[:, 1:] = rows.view(np.uint8).reshape(height, 2 * width)

    def chunk(kind, data):
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    head = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    data = zlib.compress(lines.tobytes(), 1)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")
    )


def surface(x, y):
    """Hills of 20 m, whose slope is at most 0.31."""
    return HIGH * (0.5 + 0.25 * np.sin(0.05 * x) + 0.25 * np.sin(0.04 * y + 0.3))


def hills(folder, pixels):
    steps = np.arange(pixels) / (pixels - 1)
    x, y = (steps - 0.5) * SIDE, (0.5 - steps) * SIDE
    heights = surface(x[None, :], y[:, None])
    png(folder / "hills.png", np.round(heights / HIGH * 65535))
    world = folder / "hills.sdf"
    world.write_text(WORLD.format(size=f"{SIDE} {SIDE} {HIGH}"))
    return world


def run(*arguments, **options):
    return subprocess.run(
        [RUEDO, *map(str, arguments)], capture_output=True, text=True, timeout=300, **options
    )


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    return hills(tmp_path_factory.mktemp("large"), 4097)


def test_4097_by_4097_loads_in_seconds_and_500_mb(large):
    used = f"import resource, subprocess, sys; done = subprocess.run({[RUEDO]!r} + sys.argv[1:]);"
    used += "u = resource.getrusage(resource.RUSAGE_CHILDREN);"
    used += "print('used', u.ru_utime + u.ru_stime, u.ru_maxrss); sys.exit(done.returncode)"
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            used,
            "run",
            str(large),
            "--rate",
            "max",
            "--duration",
            "0.1",
            "--quiet",
        ],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0 and "left out" not in done.stderr, done.stderr
    seconds, kilobytes = map(float, re.search(r"used (\S+) (\S+)", done.stdout).groups())
    assert kilobytes < 500e3, kilobytes
    assert seconds < 6, seconds  # of CPU time: 3 s on a machine that does nothing else


def normal(x, y):
    slope = np.array(
        [0.05 * 0.25 * HIGH * math.cos(0.05 * x), 0.04 * 0.25 * HIGH * math.cos(0.04 * y + 0.3)]
    )
    up = np.array([-slope[0], -slope[1], 1.0])
    return up / np.linalg.norm(up)


def turned(q, v):
    """The vector v in the world; q: w, x, y, z."""
    w, axis = q[0], np.asarray(q[1:])
    return v + 2 * np.cross(axis, np.cross(axis, v) + w * np.asarray(v))


def range_to_surface(origin, direction, most):
    """By small steps, and then by bisection."""
    steps = np.arange(0, most, 0.05)
    points = origin + steps[:, None] * direction
    below = np.flatnonzero(points[:, 2] < surface(points[:, 0], points[:, 1]))
    if len(below) == 0:
        return math.inf
    low, high = steps[below[0] - 1], steps[below[0]]
    for _ in range(40):
        middle = (low + high) / 2
        at = origin + middle * direction
        low, high = (low, middle) if at[2] < surface(at[0], at[1]) else (middle, high)
    return low


def test_a_robot_stands_on_the_surface_and_its_scanner_sees_it(large):
    settings = {"r/lrf.lidar.range.max": 100}
    with ruedo.Engine(large, spawn=["p3at:r@-20,30,0.4"], noise=False, settings=settings) as e:
        e.step(None, 1000)
        position, q = e["pose.pos"][0, 0].copy(), e["pose.orientation"][0, 0].copy()
        ranges = e.observe("lrf.ranges")[0, 0].copy()
    expected = normal(position[0], position[1])
    assert np.dot(turned(q, [0, 0, 1]), expected) > math.cos(math.radians(0.5))
    # base_link is at the ground
    assert position[2] == pytest.approx(surface(position[0], position[1]), abs=2e-3)
    scanner = position + turned(q, [0.16, 0, 0.3905])
    seen = 0
    for angle, measured in zip(np.linspace(-math.pi / 2, math.pi / 2, 181), ranges, strict=True):
        ray = turned(q, [math.cos(angle), math.sin(angle), 0])
        there = range_to_surface(scanner, ray, 100)
        if not there < 99:
            continue
        at = scanner + there * ray
        steepness = -np.dot(ray, normal(at[0], at[1]))
        if steepness > 0.05:  # a height is exact to 0.2 mm
            assert measured == pytest.approx(there, abs=1e-3 + 3e-4 / steepness), angle
            seen += 1
    assert seen > 30


def test_a_heightmap_that_is_too_large_ends_the_run(tmp_path):
    world = hills(tmp_path, 33)
    (tmp_path / "hills.png").write_bytes(b"P5 9000 16 255\n" + bytes(9000 * 16))
    done = run("run", world, "--rate", "max", "--duration", 1)
    assert done.returncode == 3
    assert re.search(
        r"hills.sdf:2: <heightmap>: the heightmap 'hills.png' cannot be used: "
        r"it has 9000 x 16 pixels; allowed are 8193 each way",
        done.stderr,
    )


@pytest.mark.parametrize(
    ("picture", "text"),
    [
        (None, "the heightmap 'hills.png' is not found"),
        (b"no picture", "it is not a picture that can be read"),
        (
            b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x10\0\0\0\x10",
            "it is not a picture that can be read",
        ),
    ],
)
def test_a_run_ends_without_its_ground(tmp_path, picture, text):
    world = hills(tmp_path, 33)
    (tmp_path / "hills.png").unlink()
    if picture:
        (tmp_path / "hills.png").write_bytes(picture)
    done = run("run", world, "--rate", "max", "--duration", 1)
    assert done.returncode == 3 and text in done.stderr, done
    visual = re.sub("<collision.*?</collision>", "", world.read_text(), flags=re.DOTALL)
    world.write_text(visual)
    done = run("run", world, "--rate", "max", "--duration", 1)
    assert done.returncode == 0 and text in done.stderr, done
