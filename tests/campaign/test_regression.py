"""run_regression(): what it is given is checked, and nothing of it stays."""

import contextlib
import os
import re
import signal

import pytest
from ruedo.regression import RegressionFailed, run_regression

WRONG = [  # what is given, what the error says
    ({"ignore": "*/camera"}, r"ignore is a list of texts, not one: ignore=\['\*/camera'\]"),
    ({"tolerances": "*/pose:pos=abs:1e-3"}, "tolerances is a list of texts, not one"),
    ({"keep": "*/pose"}, "keep is a list of texts, not one"),
    ({"options": "--no-contact"}, "options is a list of texts, not one"),
    ({"wait_for": "a@1"}, "wait_for is a list of texts, not one"),
    ({"goal": (0.0, 0.0, 9.0), "radius": 1, "by": 1}, "goal is 2 numbers, not 3"),
    ({"goal": (0.0,), "radius": 1, "by": 1}, "goal is 2 numbers, not 1"),
    ({"goal": (0.0, float("nan")), "radius": 1, "by": 1}, "goal is nan: it must be a finite"),
    ({"goal": (0.0, 0.0), "radius": "1,1", "by": 1}, "goal is a number, not '1,1'"),
    ({"goal": (0.0, 0.0)}, "a goal needs its radius"),
]


@pytest.mark.parametrize("given, text", WRONG, ids=str)
def test_a_wrong_argument_is_told(tmp_path, given, text):
    """Regression: a text counted as its letters, of which `*` ignored everything."""
    with pytest.raises((TypeError, ValueError), match=text):
        run_regression("arena", duration=1, record=tmp_path / "run.lcm", **given)


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


def test_who_keeps_a_regressions_output_open_keeps_nobody_waiting(tmp_path):
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
