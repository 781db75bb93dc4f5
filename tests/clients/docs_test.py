"""The programs of docs/clients.md run as they stand there."""

import os
import shutil
import subprocess
import sys
import time

import pytest
from conftest import BUILD, HERE, PATIENCE, SOURCE, ruedo_run
from docs_code import blocks


@pytest.fixture
def server():
    with ruedo_run("--disable", "p3at/camera", world=str(HERE / "hall.sdf")) as server:
        yield server


def run(command, server, folder):
    """Once more when it, or the server, was held up for the 2 s of connect()."""
    deadline = time.monotonic() + PATIENCE
    while True:
        done = subprocess.run(
            command,
            env={**os.environ, "LCM_DEFAULT_URL": server.url},
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
        said = done.stdout + done.stderr
        if "no Ruedo server answered" not in said or time.monotonic() > deadline:
            assert done.returncode == 0, said
            return done.stdout


def test_python(server, tmp_path):
    (tmp_path / "ten.py").write_text(blocks("clients.md")["python"])
    assert "Odometry(" in run([sys.executable, "ten.py"], server, tmp_path)


def test_python_builds_a_world(tmp_path):
    (tmp_path / "world.py").write_text(blocks("clients.md")["world_python"])
    done = subprocess.run(
        [sys.executable, "world.py"], cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.stdout.startswith("Scan(utime=0, ranges=<181, "), done.stderr


def test_python_docstring_of_the_package(server, tmp_path):
    """The example in `help(ruedo)`."""
    import ruedo

    example = ruedo.__doc__.partition("\nBegin ")[0]
    lines = [line[4:] for line in example.splitlines() if line.startswith("    ")]
    (tmp_path / "doc.py").write_text("\n".join(lines))
    run([sys.executable, "doc.py"], server, tmp_path)


def test_help_of_the_package_is_a_page():
    import pydoc

    import ruedo

    text = pydoc.plain(pydoc.render_doc(ruedo))
    assert len(text) < 4000, len(text)
    assert "launch(world)" in text and "ruedo docs" in text
    stars = {}
    exec("from ruedo import *", stars)
    assert {"Robot", "connect", "Scan", "MotionState"} <= set(stars)


def compiled(folder, block):
    """Compiled against the header and the library alone, as a user's program is."""
    from pathlib import Path

    import lcm

    (folder / "ten.cpp").write_text(blocks("clients.md")[block])
    library = next(Path(lcm.__file__).resolve().parent.parent.glob("**/liblcm.so"))
    subprocess.run(
        [
            os.environ.get("CXX", "c++"),
            "-std=c++17",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-I",
            str(SOURCE / "include"),
            "-I",
            str(BUILD / "generated/include"),
            "ten.cpp",
            str(BUILD / "clients/cpp/libruedo_client.a"),
            str(library),
            f"-Wl,-rpath,{library.parent}",
            "-pthread",
            "-o",
            "ten",
        ],
        cwd=folder,
        check=True,
    )
    return "./ten"


def test_cpp(server, tmp_path):
    assert run([compiled(tmp_path, "cpp")], server, tmp_path).startswith("181 rays, 5.")


def test_cpp_launches_with_arguments(tmp_path):
    program = compiled(tmp_path, "launch_cpp")
    done = subprocess.run([program], cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE)
    assert done.stdout == "2 robots\n", done.stderr


def test_java(server, tmp_path):
    if not shutil.which("javac"):
        pytest.skip("no JDK here")
    (tmp_path / "Ten.java").write_text(blocks("clients.md")["java"])
    jar = f"{BUILD}/java/ruedo.jar"
    subprocess.run(["javac", "--release", "11", "-cp", jar, "Ten.java"], cwd=tmp_path, check=True)
    assert run(["java", "-cp", f"{jar}:.", "Ten"], server, tmp_path).startswith("181 rays, 5.")
