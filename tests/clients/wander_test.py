"""The example of each language: 20 s of sim time in the arena without touching anything; and ended
as a user ends it.
"""

import signal
import subprocess
import sys

import lcm
import pytest
from conftest import ARENA, BUILD, PATIENCE, SOURCE, chosen, heed_ctrl_c, ruedo_run
from witness import attempts

EXAMPLES = {
    "python": [sys.executable, str(SOURCE / "clients/python/examples/wander.py")],
    "cpp": [str(BUILD / "bin/ruedo-wander-cpp")],
    "java": ["java", "-cp", f"{BUILD}/java/ruedo.jar:{BUILD}/java/ruedo-examples.jar", "Wander"],
}


NO_SERVER = "no Ruedo server answered"


def numbers(line):
    return [
        float(word.strip(",;"))
        for word in line.split()
        if word.strip(",;").replace(".", "").replace("-", "").isdigit()
    ]


def wander(language, log, picture):
    with ruedo_run("--record", str(log), world=ARENA) as server:
        return subprocess.run(
            [
                *EXAMPLES[language],
                "--url",
                server.url,
                "--duration",
                "20",
                "--picture",
                str(picture),
            ],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )


def reasons_in(log):
    """Why its motions ended."""
    from ruedo import lcmtypes

    statuses = (
        event.data for event in lcm.EventLog(str(log), "r") if event.channel == "p3at/motion"
    )
    return {lcmtypes.motion_status_t.decode(status).reason for status in statuses}


@pytest.mark.parametrize("language", list(chosen(EXAMPLES)))
def test_wander(language, tmp_path):
    from ruedo import lcmtypes

    status = lcmtypes.motion_status_t
    log, picture = tmp_path / "run.log", tmp_path / "seen.jpg"
    for witness in attempts():  # the watchdog stops one that does not run for 0.6 s
        done = wander(language, log, picture)
        reasons = reasons_in(log)
        # It continues, or reports why not; a crashed program is stopped, too, with another message.
        was_stopped = status.REASON_WATCHDOG in reasons and (
            done.returncode == 0 or "watchdog" in done.stderr
        )
        if not was_stopped or not witness.excuses():
            break
    assert done.returncode == 0, done.stdout + done.stderr
    assert picture.read_bytes()[:3] == b"\xff\xd8\xff"  # a JPEG
    lines = {line.split("  ")[0].split(" x")[0].strip(): line for line in done.stdout.splitlines()}
    truth, odometry = numbers(lines["true pose"]), numbers(lines["odometry"])
    assert odometry[:2] == pytest.approx(
        truth[:2], abs=0.05
    )  # the robot started at the world's origin

    way, heard = 0.0, 0
    for event in lcm.EventLog(str(log), "r"):
        if event.channel == "p3at/pose":
            pose = lcmtypes.pose_t.decode(event.data)
            way += abs(pose.vel[0]) * 0.02
            heard += 1
    assert heard >= 1000 and way > 2.0  # it did move
    # Nothing blocked it, and its watchdog never had to stop it.
    assert reasons <= {status.REASON_NONE, status.REASON_REPLACED}
    # An untouched kinematic drive follows its wheels exactly, so a bump would show as odometry that
    # is off.
    assert (
        odometry[2] == pytest.approx(truth[2], abs=0.05)
        or abs(abs(odometry[2] - truth[2]) - 6.2832) < 0.05
    )


@pytest.mark.parametrize("language", list(chosen(EXAMPLES)))
def test_ctrl_c_ends_the_example_in_order(language, tmp_path):
    picture = tmp_path / "seen.jpg"
    with ruedo_run(world=ARENA) as server:
        for witness in attempts():
            example = subprocess.Popen(
                [*EXAMPLES[language], "--url", server.url, "--picture", str(picture)],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                preexec_fn=heed_ctrl_c,
            )
            first = example.stdout.readline()
            if first:
                example.send_signal(signal.SIGINT)
            said, errors = example.communicate(timeout=PATIENCE)
            if "watchdog" not in errors or not witness.excuses():
                break
        assert "Ctrl-C ends it" in first
    assert [line.split()[0] for line in said.splitlines()] == ["camera", "true", "odometry"], (
        said + errors
    )
    assert picture.read_bytes()[:3] == b"\xff\xd8\xff"
    assert not errors
    assert example.returncode == (
        130 if language == "java" else 0
    )  # a JVM that a signal ends says so


@pytest.mark.parametrize("language", list(chosen(EXAMPLES)))
def test_options_are_explained(language):
    asked = subprocess.run(
        [*EXAMPLES[language], "--help"], capture_output=True, text=True, timeout=PATIENCE
    )
    wrong = subprocess.run(
        [*EXAMPLES[language], "--robbot", "p3at"], capture_output=True, text=True, timeout=PATIENCE
    )
    assert asked.returncode == 0 and "--picture" in asked.stdout + asked.stderr
    assert wrong.returncode == 2 and "--robot" in wrong.stderr
