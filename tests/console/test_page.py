"""`ruedo play LOG --html`: one file that shows a run without a server, no larger than asked for;
and regress leaves it where it fails.
"""

import contextlib
import re
import subprocess
import time

import pytest
from harness import ARENA, RUEDO, Socket, browse, needs_browser, running
from test_browser import states


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A run of a robot that drives along a curve at half a metre a second."""
    from ruedo.lcmtypes import velocity_command_t

    path = tmp_path_factory.mktemp("page") / "run.lcm"
    command = velocity_command_t()
    command.vx, command.omega = 0.5, 0.4
    with running("--record", path, "--duration", "5") as process:
        driver = Socket(process.port)
        while process.poll() is None:
            with contextlib.suppress(OSError):  # when it has just ended
                driver.command("p3at/velocity", command)
            time.sleep(0.1)
    return path


def page_of(log, path, *arguments):
    return subprocess.run(
        [RUEDO, "play", log, "--html", path, *arguments],
        capture_output=True,
        text=True,
        timeout=120,
    )


@needs_browser
@pytest.mark.parametrize("size", ["20", "2"])
def test_it_works_from_the_disk(log, tmp_path, size):
    folder = tmp_path / "alone"
    folder.mkdir()
    path = folder / "out.html"
    done = page_of(log, path, "--html-size", size)
    assert done.returncode == 0, done.stderr
    assert path.stat().st_size <= float(size) * 1e6 and done.stdout.startswith(
        f"{path}: {path.stat().st_size / 1e6:.1f} MB"
    )
    found = list(states(log, 0))
    moments = [
        {"time": t, "body": 0, "pose": [x, y]}
        for t, _, x, y, _ in (
            found[round(share * (len(found) - 1))] for share in (0.9, 0.1, 1.0, 0.5)
        )
    ]
    interval = re.search(r"a message of a channel each ([\d.]+) s", done.stdout)
    near = 1e-3 + 0.5 * (
        2 * float(interval.group(1)) if interval else 0
    )  # m; the newest message may be that old
    assert abs(found[-1][2]) + abs(found[-1][3]) > 0.5  # it has moved
    browse(
        path.as_uri(),
        tmp_path,
        "disk",
        {
            "moments": moments,
            "near": near,
            "pictures": "without pictures" not in done.stdout,
            "folder": str(folder),
        },
    )


def test_a_page_that_does_not_fit_is_reported(log, tmp_path):
    done = page_of(log, tmp_path / "out.html", "--html-size", "1")
    if done.returncode == 0:
        assert (tmp_path / "out.html").stat().st_size <= 1e6
    else:
        assert (
            done.returncode == 3
            and "run.lcm" in done.stderr
            and "MB" in done.stderr
            and not (tmp_path / "out.html").exists()
        )
    for arguments, words in ((("--html-size", "0.5"), "--html-size"), (("--view",), "--view")):
        done = page_of(log, tmp_path / "no.html", *arguments)
        assert done.returncode == 2 and words in done.stderr
    assert page_of(log, "/nowhere/out.html").returncode == 4
    assert page_of(tmp_path / "none.lcm", tmp_path / "no.html").returncode == 3


def test_a_failed_regression_leaves_its_page(tmp_path):
    done = subprocess.run(
        [
            RUEDO,
            "regress",
            ARENA,
            "--duration",
            "0.5",
            "--disable",
            "p3at/camera",
            "--goal",
            "3,3,0.1,0.4",
            "--record",
            tmp_path / "run.lcm",
        ],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 1 and "FAILED" in done.stderr
    assert (tmp_path / "run.lcm.html").read_bytes().startswith(
        b"<!doctype html>"
    ) and "run.lcm.html" in done.stdout


@pytest.mark.parametrize("size", [3, 5])
def test_a_page_is_nearly_as_large_as_it_may_be(log, tmp_path, size):
    """Of a log that is much larger; half of a page was empty."""
    import lcm

    log = lcm.EventLog(str(log), "r")
    found = [(event.timestamp, event.channel, event.data) for event in log]
    log.close()
    path = tmp_path / "long.lcm"
    written = lcm.EventLog(str(path), "w", overwrite=True)
    for again in range(20_000_000 // sum(len(data) for _, _, data in found) + 1):
        for timestamp, channel, data in found:
            if again == 0 or not channel.startswith("ruedo/"):
                written.write_event(timestamp + again * 5_000_000, channel, data)
    written.close()
    done = page_of(path, tmp_path / "out.html", "--html-size", str(size))
    assert done.returncode == 0, done.stderr
    assert 0.95 * size * 1e6 <= (tmp_path / "out.html").stat().st_size <= size * 1e6, done.stdout
