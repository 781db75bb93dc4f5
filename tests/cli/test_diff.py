"""ruedo diff as CI calls it: exit codes, the first difference, tolerances, JUnit XML, and the
page.
"""

import os
import resource
import subprocess
from xml.etree import ElementTree

import lcm
import pytest
from ruedo.lcmtypes import planar_lidar_t, pose_t

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


def test_the_first_difference_is_reported(logs, tmp_path):
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
def test_an_empty_comparison_does_not_pass(logs, pattern):
    done = diff(*logs, "--ignore", pattern)
    assert done.returncode == 2 and "--ignore leaves nothing to compare" in done.stderr, done
    assert "same" not in done.stdout


@pytest.mark.parametrize("content", ["", "header"])
def test_logs_without_a_message_are_not_the_same(logs, tmp_path, content):
    """Nothing that was compared is not a proof."""
    empty, said = tmp_path / "empty.lcm", "nothing was compared: there is no message to compare"
    log = lcm.EventLog(str(empty), "w", overwrite=True)
    if content:
        log.write_event(0, "ruedo/header", b"of a run")
    log.close()
    for options in [], ["--partial"]:
        done = diff(empty, empty, "--html", tmp_path / "page.html", *options)
        assert done.returncode == 1 and f"not the same: {said}" in done.stdout, done
    page = (tmp_path / "page.html").read_text()
    assert said in page and "The logs differ" in page
    done = diff(logs[0], empty)
    assert done.returncode == 1 and "10 messages of r/pose are missing" in done.stdout, done
    assert said not in diff(logs[0], logs[0]).stdout


def test_a_truncated_log_differs(logs, tmp_path):
    """A log that was cut in half equalled itself."""
    cut = tmp_path / "cut.lcm"
    content = logs[0].read_bytes()
    cut.write_bytes(content[: len(content) // 2 + 5])  # in the midst of an event
    for pair in ((cut, cut), (logs[0], cut), (cut, logs[0])):
        done = diff(*pair, "--junit", tmp_path / "junit.xml")
        assert done.returncode == 1, done
        assert f"{cut}: cut off in the event that begins at byte " in done.stdout
        suite = ElementTree.parse(tmp_path / "junit.xml").getroot()
        failures = suite.findall(".//failure")
        assert suite.get("failures") == str(len(failures))
        assert any("cut off" in each.get("message") for each in failures)

        done = diff(*pair, "--partial")
        assert done.returncode == 0 and done.stdout.startswith("same: 5 messages"), done
        assert f"note: {cut}: cut off" in done.stdout
    assert diff(logs[1], cut, "--partial").returncode == 0, "they differ after the cut alone"
    other = logs[1].read_bytes()
    cut.write_bytes(other[: len(other) - 5])
    assert diff(logs[0], cut, "--partial").returncode == 1


def test_unreadable_logs_are_reported(logs, tmp_path):
    done = diff(*logs, "--tolerance", "r/pose=abs:much")
    assert done.returncode == 2 and "much" in done.stderr
    done = diff(logs[0], tmp_path / "nowhere.lcm")
    assert done.returncode == 3 and "nowhere.lcm" in done.stderr
    done = diff(*logs, "--html", "/nowhere/page.html")
    assert done.returncode == 4 and "/nowhere/page.html" in done.stderr


def scans(path, every):
    """A log of scans, each with these ranges."""
    log = lcm.EventLog(str(path), "w", overwrite=True)
    for k, ranges in enumerate(every):
        scan = planar_lidar_t()
        scan.utime, scan.nranges, scan.ranges = 1000 * k, len(ranges), ranges
        log.write_event(scan.utime, "r/lrf", scan.encode())
    log.close()
    return path


def test_arrays_of_other_lengths_are_matched_by_their_places(tmp_path):
    golden = scans(tmp_path / "golden.lcm", [[1.0, 2.0, 3.0], [1.0, 2.0]])
    new = scans(tmp_path / "new.lcm", [[1.0, 2.5, 3.0, 4.0], [1.0]])
    said = diff(golden, new).stdout
    assert "nranges of r/lrf at 0.000000 s: golden 3, new 4 (2 values differ, by 1 at most)" in said
    assert (
        "ranges[1] of r/lrf at 0.000000 s: golden 2, new 2.5 (3 values differ, by 0.5 at most)"
        in said
    )
    assert diff(new, golden, "--ignore", "r/lrf:*ranges").returncode == 0
    assert diff(golden, new, "--tolerance", "*:ranges=abs:1", "--ignore", "*:nranges").returncode


def test_differences_take_little_longer_than_what_a_tolerance_covers(tmp_path):
    """Each of two million values was written as text: it took three times as long."""
    even = [float(i) for i in range(1000)]
    golden = scans(tmp_path / "golden.lcm", [even] * 2000)
    new = scans(tmp_path / "new.lcm", [[one + 0.5 for one in even]] * 2000)

    def seconds(*options):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = diff(golden, new, *options)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done

    runs = [(seconds("--tolerance", "*:ranges=abs:1"), seconds()) for _ in range(5)]
    covered, differ = (min(run[i][0] for run in runs) for i in range(2))
    assert runs[0][0][1].returncode == 0
    assert "(2000000 values differ, by 0.5 at most)" in runs[0][1][1].stdout
    assert differ < 2 * covered, (covered, differ)
