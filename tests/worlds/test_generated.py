"""The generated files are up to date with their scripts: meshes of the robots, the office world,
its textures.
"""

import importlib.util
import shutil
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

WORLDS = Path(__file__).resolve().parents[2] / "worlds"


def run_copy(tmp_path, script):
    """Runs a generator in a copy of worlds/ without its outputs, and returns that copy."""
    copy = tmp_path / "worlds"
    shutil.copytree(
        WORLDS,
        copy,
        ignore=shutil.ignore_patterns("*.obj", "*.mtl", "*.png", "office.sdf", "__pycache__"),
    )
    subprocess.run([sys.executable, copy / script], check=True)
    return copy


def png_pixels(path):
    """The inflated scan lines of a PNG with one IDAT chunk: equal for equal pictures, whatever the
    compressor.
    """
    data = path.read_bytes()
    position, pixels = 8, b""
    while position < len(data):
        size, kind = (
            int.from_bytes(data[position : position + 4], "big"),
            data[position + 4 : position + 8],
        )
        if kind in (b"IHDR", b"IDAT"):
            content = data[position + 8 : position + 8 + size]
            pixels += zlib.decompress(content) if kind == b"IDAT" else content
        position += 12 + size
    return pixels


def test_bases_equal_the_scripts_output(tmp_path):
    subprocess.run([sys.executable, WORLDS / "robots/make_bases.py", tmp_path], check=True)
    made = sorted(path for path in tmp_path.rglob("*") if path.is_file())
    assert len(made) == 16
    for path in made:
        assert path.read_text() == (WORLDS / "robots" / path.relative_to(tmp_path)).read_text(), (
            path
        )


def test_worlds_equal_the_scripts_output(tmp_path):
    subprocess.run([sys.executable, WORLDS / "make_worlds.py", tmp_path], check=True)
    made = sorted(path for path in tmp_path.rglob("*") if path.is_file())
    assert len(made) == 7
    for path in made:
        kept = WORLDS / path.relative_to(tmp_path)
        if path.suffix == ".png":
            assert png_pixels(path) == png_pixels(kept), kept
        else:
            assert path.read_text() == kept.read_text(), kept


@pytest.mark.parametrize(
    "script, outputs",
    [
        ("robots/p3at/make_meshes.py", "robots/p3at/meshes"),
        ("robots/p3dx/make_meshes.py", "robots/p3dx/meshes"),
        ("office/make_office.py", "office"),
    ],
)
def test_files_equal_the_scripts_output(tmp_path, script, outputs):
    copy = run_copy(tmp_path, script)
    made = [p for p in (copy / outputs).rglob("*") if p.suffix in (".obj", ".mtl", ".png")]
    assert made
    for path in made:
        kept = WORLDS / path.relative_to(copy)
        if path.suffix == ".png":
            assert png_pixels(path) == png_pixels(kept), kept
        else:
            assert path.read_text() == kept.read_text(), kept


def test_office_world_equals_the_scripts_output(tmp_path):
    copy = run_copy(tmp_path, "office/make_office.py")
    assert (copy / "office.sdf").read_text() == (WORLDS / "office.sdf").read_text()


def test_doors_let_a_pioneer_through():
    spec = importlib.util.spec_from_file_location("make_office", WORLDS / "office/make_office.py")
    office = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(WORLDS / "office"))
    spec.loader.exec_module(office)
    sys.path.pop(0)
    for x0, y0, _x1, y1, doors in office.WALLS:
        for door in doors:
            x, y = (x0 + door, y0) if y0 == y1 else (x0, y0 + door)
            things = [t[:3] for t in office.furniture()] + [
                ("poster", *t[:2]) for t in office.POSTERS
            ]
            blocked = [thing for thing, tx, ty in things if abs(tx - x) < 1.0 and abs(ty - y) < 1.0]
            assert not blocked, f"door at ({x}, {y}): {blocked}"
