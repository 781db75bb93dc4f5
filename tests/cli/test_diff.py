"""ruedo diff as CI calls it: exit codes, the first difference, tolerances, JUnit XML, and the
page.
"""

import os
import subprocess
from xml.etree import ElementTree

import lcm
import pytest
from ruedo.lcmtypes import pose_t

RUEDO = os.environ["RUEDO"]


def diff(*arguments):
    return subprocess.run(
        [RUEDO, "diff", *map(str, arguments)], capture_output=True, text=True, timeout=400
    )


@pytest.fixture
def logs(tmp_path):
    """Ten poses of 0.1 m each; in the other log all from the seventh on are 2 mm off."""
    for name, off in (("golden", 0.0), ("new", 0.002)):
        log = lcm.EventLog(str(tmp_path / f"{name}.lcm"), "w", overwrite=True)
        for k in range(10):
            pose = pose_t()
            pose.utime = 20_000 * k
            pose.pos = [0.1 * k + (off if k >= 6 else 0.0), 0.0, 0.0]
            pose.orientation = [1.0, 0.0, 0.0, 0.0]
            log.write_event(pose.utime, "r/pose", pose.encode())
        log.close()
    return tmp_path / "golden.lcm", tmp_path / "new.lcm"


def test_a_log_equals_itself(logs, tmp_path):
    done = diff(logs[0], logs[0], "--junit", tmp_path / "junit.xml")
    assert done.returncode == 0, done.stdout + done.stderr
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot()
    assert not suite.findall(".//failure") and suite.findall(".//testcase")


def test_the_first_difference_is_named_and_reported(logs, tmp_path):
    done = diff(*logs, "--junit", tmp_path / "junit.xml", "--html", tmp_path / "page.html")
    assert done.returncode == 1
    assert "r/pose" in done.stdout and "pos[0]" in done.stdout and "0.602" in done.stdout
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot()
    [failure] = suite.findall(".//failure")
    assert "pos[0]" in (failure.get("message") or "") + (failure.text or "")
    page = (tmp_path / "page.html").read_text()
    assert "<svg" in page and "pos[0]" in page


@pytest.mark.parametrize(
    "options, code",
    [
        (["--tolerance", "r/pose:pos=abs:0.003"], 0),
        (["--tolerance", "r/pose:pos=abs:0.001"], 1),
        (["--tolerance", "*:pos=rel:0.01"], 0),
        (["--ignore", "r/pose:pos"], 0),
        (["--ignore", "other"], 1),
    ],
)
def test_tolerances_decide(logs, options, code):
    done = diff(*logs, *options)
    assert done.returncode == code, done.stdout + done.stderr


def test_rules_that_fit_no_channel_are_pointed_out(logs):
    """They may be meant for other logs as well, so that the result is the same."""
    done = diff(
        logs[0], logs[0], "--ignore", "r/pse", "--ignore", "ruedo/header", "--ignore", "*:x"
    )
    assert done.returncode == 0, done
    assert done.stderr == "ruedo: warning: --ignore r/pse: neither log has such a channel\n"
    done = diff(*logs, "--tolerance", "r/pse:pos=abs:1", "--tolerance", "r/p*:pos=abs:1e-6")
    assert done.returncode == 1, done
    assert done.stderr == "ruedo: warning: --tolerance r/pse: neither log has such a channel\n"


@pytest.mark.parametrize("pattern", ["*", "r/pose", "r/*:*"])
def test_nothing_left_to_compare_is_no_pass(logs, pattern):
    done = diff(*logs, "--ignore", pattern)
    assert done.returncode == 2 and "--ignore leaves nothing to compare" in done.stderr, done
    assert "same" not in done.stdout


def test_two_logs_without_messages_are_called_so(logs, tmp_path):
    empty = tmp_path / "empty.lcm"
    empty.touch()
    done = diff(empty, empty, "--html", tmp_path / "page.html")
    assert done.returncode == 0 and "both logs are without any message" in done.stdout, done
    assert "both logs are without any message" in (tmp_path / "page.html").read_text()
    assert "without any message" not in diff(logs[0], logs[0]).stdout


def test_what_cannot_be_read_is_said(logs, tmp_path):
    done = diff(*logs, "--tolerance", "r/pose=abs:much")
    assert done.returncode == 2 and "much" in done.stderr
    done = diff(logs[0], tmp_path / "nowhere.lcm")
    assert done.returncode == 3 and "nowhere.lcm" in done.stderr
    done = diff(*logs, "--html", "/nowhere/page.html")
    assert done.returncode == 4 and "/nowhere/page.html" in done.stderr
