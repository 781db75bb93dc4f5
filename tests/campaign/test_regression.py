"""run_regression(): what it is given is checked, and nothing of it stays."""

import contextlib
import math
import os
import re
import signal
import subprocess
import sys

import pytest
from ruedo.regression import RegressionFailed, run_regression

WORLD = (
    "<sdf version='1.9'><world name='w'><include><uri>model://p3at</uri></include></world></sdf>"
)

WRONG = [  # what is given, what the error says
    ({"ignore": "*/camera"}, r"ignore is a list of texts, not one: ignore=\['\*/camera'\]"),
    ({"tolerances": "*/pose:pos=abs:1e-3"}, "tolerances is a list of texts, not one"),
    ({"keep": "*/pose"}, "keep is a list of texts, not one"),
    ({"options": "--no-contact"}, "options is a list of texts, not one"),
    ({"wait_for": "a@1"}, "wait_for is a list of texts, not one"),
    ({"goal": (0.0, 0.0, 9.0), "radius": 1, "by": 1}, "goal is 2 numbers, not 3"),
    ({"goal": 5, "radius": 1, "by": 1}, "goal is 2 numbers, not 5"),
    ({"goal": (0.0,), "radius": 1, "by": 1}, "goal is 2 numbers, not 1"),
    ({"goal": (0.0, float("nan")), "radius": 1, "by": 1}, "goal is nan: it must be a finite"),
    ({"goal": (0.0, 0.0), "radius": "1,1", "by": 1}, "radius is a number, not '1,1'"),
    ({"goal": (0.0, 0.0), "radius": 1, "by": "x"}, "by is a number, not 'x'"),
    ({"goal": (0.0, 0.0)}, "a goal needs its radius"),
    ({"radius": 1}, "radius and by need a goal"),
    ({"by": 3.0}, "radius and by need a goal"),
    ({"no_contact": "no"}, "no_contact is True or False, not 'no'"),
    ({"robot": ""}, "robot: an empty text is not allowed"),
    ({"keep": [""], "golden": "g"}, "keep: an empty text is not allowed"),
    ({"keep": ["\0"]}, "keep is .*, which holds the character 0"),
    ({"client": []}, r"client is \[\], which names no program"),
    ({"client": ""}, "client is '', which names no program"),
    ({"script": []}, r"script is \[\], which names no program"),
    ({"client": 5}, "client is a list of words or a line for a shell, not 5"),
    ({"client": b"true"}, "client is a list of words or a line for a shell, not b'true'"),
    ({"client": ["true", 1]}, "a word of client is a text or a path, not 1"),
    ({"client": [b"true"]}, "a word of client is a text or a path, not b'true'"),
    ({"client": "\0"}, "client is .*, which holds the character 0"),
    ({"client": "\ud800"}, "client is .*, with half a character in it"),
    ({"script": ["\0"]}, "a word of script is .*, which holds the character 0"),
    ({"timeout": "x"}, "timeout is a number, not 'x'"),
    ({"timeout": float("nan")}, "timeout is nan: it must be above 0 s"),
    ({"timeout": 0}, "timeout is 0.0: it must be above 0 s"),
    ({"golden": 5}, "golden is a text or a path, not 5"),
    ({"golden": ""}, "golden is an empty text: it must be a path"),
    ({"record": 5}, "record is a text or a path, not 5"),
    ({"folder": 5}, "folder is a text or a path, not 5"),
    ({"options": ["\0"]}, "options is .*, which holds the character 0"),
    ({"client": ["", "x"]}, r"client is \['', 'x'\], which names no program"),
    ({"client": [" "]}, r"client is \[' '\], which names no program"),
    ({"client": ["sh", "-c", "a\nb"]}, "client is .*, which holds the control character 0x0a"),
    ({"keep": ["a\tb"], "golden": "g"}, "keep is .*, which holds the control character 0x09"),
    ({"goal": (True, 0.0), "radius": 1, "by": 1}, "goal is a number, not True"),
    ({"goal": (0.0, 0.0), "radius": True, "by": 1}, "radius is a number, not True"),
    ({"goal": (0.0, 0.0), "radius": 0, "by": 1}, "radius is 0.0: it must be above 0"),
    ({"goal": (0.0, 0.0), "radius": 1, "by": -1}, "by is -1.0: it must be above 0"),
    ({"duration": True}, "duration is a number, not True"),
    ({"duration": "5"}, "duration is a number, not '5'"),
    ({"duration": float("inf")}, "duration is inf: it must be a finite number"),
    ({"duration": 0}, "duration is 0.0: it must be above 0"),
    ({"seed": True}, "seed is a whole number, not True"),
    ({"seed": 1.5}, "seed is a whole number, not 1.5"),
    ({"seed": -1}, "seed is -1; allowed are 0 to 18446744073709551615"),
    ({"lockstep": True}, "lockstep is a whole number, not True"),
    ({"lockstep": 65}, "lockstep is 65; allowed are 0 to 64"),
    ({"clearance": True}, "clearance is a number, not True"),
    ({"clearance": -0.1}, "clearance is -0.1: it must be a finite number, 0 or more"),
    ({"odometry_error": "1"}, "odometry_error is a number, not '1'"),
    ({"timeout": True}, "timeout is a number, not True"),
    ({"check": "no"}, "check is True or False, not 'no'"),
    ({"robot": 5}, "robot is a text, not 5"),
    ({"keep": ["a"]}, "keep needs a golden log"),
    ({"tolerances": ["a:b=abs:1"]}, "tolerances needs a golden log"),
    ({"ignore": ["a"]}, "ignore needs a golden log"),
    ({"options": [""]}, "option: an empty text is not allowed"),
    ({"options": ["--help"]}, "options has --help, which prints something in place of a run"),
    ({"options": ["--no-noise", "-h"]}, "options has -h, which prints something"),
    ({"options": ["--version"]}, "options has --version, which prints something"),
    ({"options": ["--record", "x.lcm"]}, "options has --record, which the argument record sets"),
    ({"options": ["--odometry-error=1"]}, "--odometry-error, which the argument odometry_error"),
    ({"options": ["--no-contact"]}, "options has --no-contact, which the argument no_contact sets"),
    ({"options": ["--renew"]}, "options has --renew, with which every run passes"),
    ({"world": 5}, "world is a text or a path, not 5"),
    ({"world": "\0"}, "world is .*, which holds the character 0"),
]


@pytest.fixture
def pytest_on():
    """Runs a test file by a pytest of its own, from another folder; what it says."""

    def run(file, text, *options):
        file.write_text(text)
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *options, file]
        environment = {**os.environ, "RUEDO_RENEW": "1"}
        return subprocess.run(
            command, cwd="/", env=environment, capture_output=True, text=True, timeout=100
        ).stdout

    return run


def plain(given):
    return ascii(given).replace("\\", "/")


@pytest.mark.parametrize("given, text", WRONG, ids=plain)
def test_a_wrong_argument_is_reported(tmp_path, given, text):
    """Regression: a text counted as its letters, of which `*` ignored everything, and what was
    expected without a goal was left out.
    """
    rest = {"world": "arena", "duration": 1, "record": tmp_path / "run.lcm", "folder": tmp_path}
    with pytest.raises((TypeError, ValueError), match=text) as caught:
        run_regression(**{**rest, **given})
    assert "\n" not in str(caught.value) and not os.listdir(tmp_path)


@pytest.mark.parametrize(
    "given, text",
    [
        ("5, duration=1", "world is a text or a path, not 5"),
        ("'arena', duration=1, golden=5", "golden is a text or a path, not 5"),
        ("'arena', duration=1, tolerance=[]", "no argument 'tolerance': there are client, durat"),
    ],
)
def test_the_fixture_reports_it_too(pytest_on, tmp_path, given, text):
    said = pytest_on(
        tmp_path / "test_it.py",
        f"def test_it(ruedo_regression):\n    ruedo_regression({given})\n",
    )
    assert "1 failed in" in said and f"TypeError: {text}" in said, said


def test_a_worlds_name_may_begin_as_an_option_does(tmp_path):
    """Regression: `--help` was an option, and the help a run that had passed."""
    with pytest.raises(RegressionFailed, match="--help: no such file"):
        run_regression("--help", duration=1, record=tmp_path / "run.lcm")
    (tmp_path / "-w.sdf").write_text(WORLD)
    run = run_regression("-w.sdf", duration=0.1, record=tmp_path / "run.lcm", folder=tmp_path)
    assert run.log.exists() and "passed" in run.output


def test_the_environment_variable_renews_as_in_the_command(tmp_path, monkeypatch):
    """Regression: `yes` was refused here, and taken there."""
    (tmp_path / "w.sdf").write_text(WORLD)
    given = {"duration": 0.1, "golden": tmp_path / "g.lcm", "record": tmp_path / "run.lcm"}
    monkeypatch.setenv("RUEDO_RENEW", "nope")
    with pytest.raises(RegressionFailed, match="allowed are 1, true, yes, on and 0, false, no, o"):
        run_regression(tmp_path / "w.sdf", **given)
    assert os.listdir(tmp_path) == ["w.sdf"]
    monkeypatch.setenv("RUEDO_RENEW", "yes")
    assert "renewed" in run_regression(tmp_path / "w.sdf", **given).output


def test_a_run_that_fails_is_returned_where_that_is_expected(tmp_path):
    given = {"duration": 0.1, "record": tmp_path / "run.lcm", "check": False}
    (tmp_path / "w.sdf").write_text(WORLD)
    run = run_regression(tmp_path / "w.sdf", script="false", **given)
    assert not run.passed and run.evidence == "" and "the script ended with" in run.output
    assert run_regression(tmp_path / "w.sdf", **given).passed


@pytest.mark.parametrize(
    "given, text",
    [
        ({"world": "nosuch"}, "nosuch"),
        ({"options": ["--nosuch"]}, "--nosuch"),
        ({"timeout": 0.001}, "took more than 0.001 s"),
    ],
    ids=plain,
)
def test_a_run_that_did_not_start_is_not_an_expected_failure(tmp_path, given, text):
    rest = {"world": "arena", "duration": 1, "record": tmp_path / "run.lcm", "check": False}
    with pytest.raises(RegressionFailed, match=text):
        run_regression(**{**rest, **given})


SETUP_FAILS = """
@pytest.fixture
def broken(ruedo_regression):
    {}
def test_it(ruedo_regression, broken):
    pass
"""


@pytest.mark.parametrize(
    "test, said",
    [
        ("def test_it(ruedo_regression):\n    assert False", "1 failed in"),
        (SETUP_FAILS.format("assert False"), "1 error in"),
        (SETUP_FAILS.format("pytest.skip()"), "1 skipped in"),
        ("@pytest.mark.xfail\ndef test_it(ruedo_regression):\n    assert False", "1 xfailed in"),
        ("@pytest.mark.skip\ndef test_it(ruedo_regression): pass", "1 skipped in"),
    ],
)
@pytest.mark.parametrize("of", ["", "from ruedo.regression import ruedo_regression\n"])
def test_a_test_that_fails_before_its_run_shows_its_own_error(pytest_on, tmp_path, of, test, said):
    """Also where the fixture alone was imported, and no plugin is loaded."""
    more = ["-p", "no:ruedo"] if of else []
    told = pytest_on(tmp_path / "test_it.py", f"import pytest\n{of}{test}\n", *more)
    assert said in told, told


def test_a_missing_run_fails(tmp_path, monkeypatch):
    """As by another program than ruedo."""
    monkeypatch.setenv("RUEDO", "/bin/true")
    with pytest.raises(RegressionFailed, match="there was no run"):
        run_regression("arena", duration=1, record=tmp_path / "run.lcm")


def test_each_run_of_a_test_has_a_log_of_its_own(pytest_on, tmp_path):
    """Regression: the second wrote over the first, which its result still named."""
    (tmp_path / "w.sdf").write_text(WORLD)
    said = pytest_on(
        tmp_path / "test_it.py",
        "def test_it(ruedo_regression):\n"
        "    one, two = (ruedo_regression('w.sdf', duration=0.1, seed=n).log for n in (1, 2))\n"
        "    assert one.read_bytes() != two.read_bytes()\n"
        "    ruedo_regression('w.sdf', duration=0.1, record=one)\n",
    )
    assert re.search("ValueError: record is .*, the log of an earlier run of this test", said), said


def test_paths_are_relative_to_the_tests_file(pytest_on, tmp_path):
    """All of them, wherever pytest is started."""
    (tmp_path / "sub/logs").mkdir(parents=True)
    (tmp_path / "sub/w.sdf").write_text(WORLD)
    said = pytest_on(
        tmp_path / "sub/test_it.py",
        "def test_it(ruedo_regression):\n"
        "    ruedo_regression('w.sdf', duration=0.1, record='logs/a.lcm', folder='logs',\n"
        "                     golden='g.lcm', script='touch here')\n",
    )
    assert "1 passed" in said, said
    for name in ("logs/a.lcm", "logs/here", "g.lcm"):
        assert (tmp_path / "sub" / name).exists()


def test_an_option_without_its_value_is_reported(tmp_path):
    with pytest.raises(RegressionFailed, match="--json"):
        run_regression("arena", duration=1, record=tmp_path / "run.lcm", options=["--json"])


def test_arguments_are_not_parsed_by_a_shell(tmp_path):
    """Also empty ones, and names of files that are no UTF-8."""
    (tmp_path / "caf\udce9").write_text("no UTF-8")
    (tmp_path / "w.sdf").write_text(WORLD)
    words = ["sh", "-c", 'test -z "$1" && test -f "$2"', "sh", "", tmp_path / "caf\udce9"]
    record = tmp_path / "run.lcm"
    run_regression(tmp_path / "w.sdf", duration=0.1, script=words, record=record, timeout=math.inf)
    words[5] = "caf"
    with pytest.raises(RegressionFailed, match="the script ended with exit code 1"):
        run_regression(tmp_path / "w.sdf", duration=0.1, script=words, record=record)


def test_a_client_that_hangs_is_ended_with_its_run(tmp_path):
    """Regression: it stayed, and the message held b'...'."""
    client = "echo $$ > child; echo 'I hang'; exec sleep 1000"
    with pytest.raises(RegressionFailed, match="took more than 15 s of real time") as caught:
        run_regression(
            "arena",
            duration=1,
            client=client,
            lockstep=1,
            record=tmp_path / "run.lcm",
            folder=tmp_path,
            timeout=15,
        )
    assert "I hang" in str(caught.value) and not re.search(r"\bb['\"]", str(caught.value))
    assert not os.path.exists(f"/proc/{(tmp_path / 'child').read_text().strip()}")


def test_a_process_that_keeps_the_output_open_delays_no_regression(tmp_path):
    """A client that leaves its run, and heeds nothing."""
    client = (
        "setsid sh -c 'trap \"\" TERM HUP; echo $$ > child; sleep 1000; sleep 1000' & sleep 1000"
    )
    with pytest.raises(RegressionFailed, match="took more than 15 s of real time"):
        run_regression("arena", duration=1, client=client, lockstep=1, folder=tmp_path, timeout=15)
    child = tmp_path / "child"
    if child.exists():
        with contextlib.suppress(ProcessLookupError):
            os.killpg(int(child.read_text()), signal.SIGKILL)
