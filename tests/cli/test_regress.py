"""ruedo regress and its golden logs: what is written, what is told, and the exit codes."""

import json
import subprocess

import pytest
from recorded import RUEDO, events, program

WORLD = """<sdf version='1.9'><world name='w'><include><uri>model://ground_plane</uri></include>
<include><uri>model://p3at</uri></include></world></sdf>"""
RUN = ["--duration", "0.5", "--disable", "p3at/camera", "--no-page", "--record"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A world, and the golden log of its run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "w.sdf").write_text(WORLD)
    done = regress("--renew")
    assert done.returncode == 0 and "renewed g.lcm" in done.stdout, done
    return tmp_path


def regress(*options, golden="g.lcm"):
    return program("regress", "w.sdf", *RUN, "run.lcm", "--golden", golden, *options)


def test_a_truncated_golden_log_does_not_pass(folder):
    """In its last event, which left all others to be the same."""
    golden = folder / "g.lcm"
    for size in golden.stat().st_size - 5, golden.stat().st_size // 2 - 5:
        golden.write_bytes(golden.read_bytes()[:size])
        done = regress()
        assert done.returncode == 1 and "passed" not in done.stdout, done
        assert "the run differs from g.lcm (g.lcm: cut off in the event that begins" in done.stderr


@pytest.mark.parametrize("value", ["1", "true", "YES", "on", "0", "False", "no", "OFF", ""])
def test_the_environment_variable_renews(folder, monkeypatch, value):
    before = (folder / "g.lcm").read_bytes()
    monkeypatch.setenv("RUEDO_RENEW", value)
    done = regress("--spawn", "p3at:other@3,0")
    renewed = value.lower() in ("1", "true", "yes", "on")
    assert done.returncode == (0 if renewed else 1), done
    assert ("renewed g.lcm" in done.stdout) == renewed
    assert ((folder / "g.lcm").read_bytes() != before) == renewed


def test_another_value_of_the_variable_is_refused(folder, monkeypatch):
    monkeypatch.setenv("RUEDO_RENEW", "nope")
    done = regress()
    assert done.returncode == 2, done
    assert (
        'RUEDO_RENEW is "nope"; allowed are 1, true, yes, on and 0, false, no, off' in done.stderr
    )


@pytest.mark.parametrize(
    "failing",
    [["--script", "false"], ["--client", "exit 3"], ["--goal", "40,0,0.1,0.2"]],
    ids=lambda words: words[0],
)
def test_a_run_that_failed_renews_no_golden_log(folder, failing):
    """The script judged when the golden log had been written already."""
    before = (folder / "g.lcm").read_bytes()
    done = regress("--spawn", "p3at:other@3,0", "--renew", *failing)
    assert done.returncode == 1 and "renewed" not in done.stdout, done
    assert (folder / "g.lcm").read_bytes() == before


@pytest.mark.parametrize("renew", [[], ["--renew"]], ids=str)
def test_each_kept_pattern_has_to_fit(folder, renew):
    """One that was misspelt beside a right one left its channel out without a word."""
    before = (folder / "g.lcm").read_bytes()
    done = regress("--keep", "*/pose", "--keep", "*/odometri", *renew)
    assert done.returncode == 2 and "--keep */odometri: " in done.stderr, done
    assert "p3at/odometry" in done.stderr and "*/pose:" not in done.stderr
    assert (folder / "g.lcm").read_bytes() == before


def test_a_run_equals_its_golden_log(folder):
    assert {channel for _, channel, _ in events("g.lcm")} == {"p3at/pose"}
    done = regress()
    assert done.returncode == 0 and "passed" in done.stdout and not done.stderr, done
    done = regress("--spawn", "p3at:other@3,0")
    assert done.returncode == 1 and "FAILED: the run differs from g.lcm" in done.stderr, done


def test_a_failure_comes_before_the_findings_and_names_its_files(folder):
    """What a reader of CI's output looks for; and the copy that was compared is gone."""
    (folder / "w.sdf").write_text(WORLD.replace("<include>", "<nonsense/><include>", 1))
    options = [each for each in RUN if each != "--no-page"]
    done = program(
        *("regress", "w.sdf", *options, "run.lcm", "--golden", "g.lcm", "--html", "d.html"),
        *("--spawn", "p3at:other@3,0"),
    )
    assert done.returncode == 1 and done.stderr.startswith("FAILED: the run differs from"), done
    assert done.stderr.index("plots of what differs: d.html") < done.stderr.index("nonsense")
    assert (folder / "d.html").stat().st_size > 0
    assert done.stdout.endswith("The run is in run.lcm, and as a page in run.lcm.html\n")
    assert (folder / "run.lcm.html").stat().st_size > 0
    assert not (folder / "run.lcm.kept").exists()


@pytest.mark.parametrize(
    ("option", "file"),
    [("--golden", "run.lcm.kept"), ("--html", "run.lcm.html"), ("--junit", "./run.lcm.kept")],
)
def test_files_that_the_run_writes_itself_are_refused(folder, option, file):
    """Before, a golden log of this name was written over, and the run held to itself."""
    (folder / file).write_text("kept")
    done = regress(option, file) if option != "--golden" else regress(golden=file)
    assert done.returncode == 2 and f"{option} {file}: this run writes" in done.stderr, done
    assert (folder / file).read_text() == "kept"


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (["--keep", "nosuch"], 2, "no message of the run is on such a channel"),
        (["--client", "true", "--lockstep", "1"], 1, "not judged: no step was run"),
    ],
    ids=str,
)
def test_a_run_with_nothing_to_keep_costs_no_golden_log(folder, options, code, said):
    """Regression: the golden log was emptied before it was known what would be written."""
    before = (folder / "g.lcm").read_bytes()
    done = regress("--renew", *options)
    assert done.returncode == code and said in done.stderr, done
    assert (folder / "g.lcm").read_bytes() == before


def test_a_golden_log_outlives_a_full_disk(folder):
    """Regression: it was cut off."""
    (folder / "disk").mkdir()
    full = (
        "mount -t tmpfs -o size=64k tmpfs disk && echo kept > disk/g.lcm; cat /dev/zero > disk/fill"
        '; cat /dev/zero >> disk/fill; "$@"; echo $?; cat disk/g.lcm; ls disk'
    )
    command = [RUEDO, "regress", "w.sdf", *RUN, "run.lcm", "--golden", "disk/g.lcm", "--renew"]
    done = subprocess.run(
        ["unshare", "-rm", "sh", "-c", full, "sh", *command],
        capture_output=True,
        text=True,
        errors="replace",
    )
    assert done.stdout.split()[-4:] == ["4", "kept", "fill", "g.lcm"], done
    assert "disk/g.lcm cannot be written: No space left on device" in done.stderr


@pytest.mark.parametrize("keep", [[], ["--keep", "nosuch"]], ids=str)
def test_a_failure_is_reported_whatever_the_golden_log_says(folder, keep):
    """Regression: `--keep */pose: no message is on such a channel` was all that was said of a
    client that had failed at once.
    """
    done = regress("--client", "false", "--lockstep", "1", "--json", "verdict.json", *keep)
    assert done.returncode == 1, done
    fault = "the client ended with exit code 1"
    assert f"FAILED: {fault}" in done.stderr
    assert json.loads((folder / "verdict.json").read_text())["faults"][0] == fault


def test_a_run_without_what_the_golden_log_holds_differs(folder):
    done = regress("--client", "true", "--lockstep", "1")
    assert done.returncode == 1 and "messages of p3at/pose are missing" in done.stderr, done


def test_a_missing_golden_log_is_reported(folder):
    done = regress("--client", "true", "--lockstep", "1", golden="none.lcm")
    assert done.returncode == 1, done
    assert "FAILED: there is no golden log none.lcm yet" in done.stderr


def test_a_rule_for_no_channel_is_pointed_out(folder):
    done = regress("--ignore", "nosuch", "--tolerance", "p3at/pse:pos=abs:1")
    assert done.returncode == 0, done
    assert done.stderr.splitlines() == [
        "ruedo: warning: --tolerance p3at/pse: neither log has such a channel",
        "ruedo: warning: --ignore nosuch: neither log has such a channel",
    ]


@pytest.mark.parametrize("pattern", ["*", "p3at/pose"])
def test_an_empty_comparison_does_not_pass(folder, pattern):
    done = regress("--ignore", pattern)
    assert done.returncode == 2 and "--ignore leaves nothing to compare" in done.stderr, done


TABLE = """<model name='table'><static>true</static><pose>{x} 0 0.24 0 0 0</pose><link name='top'>
<collision name='c'><geometry><box><size>1 1 0.08</size></box></geometry></collision></link></model>"""
FRONT = 0.257  # m: the deck of the robot; it is 0.221 to 0.278 m high


@pytest.mark.parametrize(
    ("gap", "asked", "told"),
    [
        (0.017, "0.1", "p3at/base_link was 0.017 m from table/top at (0.274, "),
        (0.017, "0.016", None),
        (0.017, "0", None),
        (-0.001, "0", "p3at/base_link was 0.000 m from table/top at (0.25"),
    ],
)
def test_clearance_is_exact(tmp_path, monkeypatch, gap, asked, told):
    """Regression: horizontal rays at five heights passed above and below a table top, and a
    clearance of 0 was not measured.
    """
    monkeypatch.chdir(tmp_path)
    table = TABLE.format(x=FRONT + gap + 0.5)
    (tmp_path / "w.sdf").write_text(WORLD.replace("</world>", table + "</world>"))
    options = [*RUN, "run.lcm", "--clearance", asked, "--json", "verdict.json"]
    options += ["--allow-errors"] if gap < 0.0 else []  # it stands in the table
    done = program("regress", "w.sdf", *options)
    if told is None:
        assert done.returncode == 0, done
    else:
        assert done.returncode == 1 and told in done.stderr, done
        assert f"at least {asked} m are required" in done.stderr
    metrics = json.loads((tmp_path / "verdict.json").read_text())["metrics"]
    if asked == "0.1":
        assert metrics["clearance_m"] == pytest.approx(gap, abs=1e-5)


def test_a_run_that_advances_may_last_longer_than_the_timeout(tmp_path):
    (tmp_path / "w.sdf").write_text(WORLD)
    options = ["--no-page", "--disable", "p3at/camera", "--rate", "1", "--duration", "1.5"]
    done = program("regress", "w.sdf", *options, "--timeout", "0.4", "--no-contact", cwd=tmp_path)
    assert done.returncode == 0 and "passed" in done.stdout, done


def test_a_client_that_ends_before_the_first_step_ends_the_run_after_it(folder):
    """The run would last a thousand seconds, and one without a step is not judged."""
    done = program(
        *("regress", "w.sdf", "--no-page", "--rate", "1", "--duration", "1000"),
        *("--client", "true", "--no-client-wait", "--no-contact"),
    )
    assert done.returncode == 0 and "passed" in done.stdout, done


def test_a_full_disk_does_not_pass(folder):
    (folder / "run.lcm.kept").unlink(missing_ok=True)
    (folder / "run.lcm.kept").symlink_to("/dev/full")
    done = regress("--keep", "p3at/*")
    assert done.returncode == 4 and "No space left on device" in done.stderr, done
