"""The policy that lies in the repository: in its environments, and through a server over LCM."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import ruedo.gym

EXAMPLE = Path(__file__).resolve().parents[2] / "clients/python/examples/navigate"
sys.path.insert(0, str(EXAMPLE))
from policy import Policy


# 184 of these rooms when it was trained; the seeds are fixed, and so are the results.
def test_it_reaches_its_goals_in_rooms_that_it_has_never_seen():
    policy = Policy.load()
    envs = ruedo.gym.NavigateVectorEnv(
        200, beams=policy.beams, split="test", autoreset_mode="Disabled"
    )
    observations, _ = envs.reset(seed=1)
    running, success = np.ones(200, bool), np.zeros(200, bool)
    for _ in range(envs.max_episode_steps):
        observations, _, terminated, truncated, info = envs.step(policy(observations))
        success |= running & info["success"]
        running &= ~(terminated | truncated)
        if not running.any():
            break
    envs.close()
    assert 180 <= success.sum() <= 190


def test_it_is_a_few_kb():
    assert (EXAMPLE / "policy.npz").stat().st_size < 10_000


WRONG = {
    "a text": lambda file: file.write_text("root:x:0"),
    "nothing": lambda file: file.write_text(""),
    "one array": lambda file: np.save(file.open("wb"), np.ones(3)),
    "no such names": lambda file: np.savez(file, a=np.ones(3), b=np.ones(3)),
    "no numbers": lambda file: np.savez(
        file, weights0=np.full((7, 2), np.nan), offsets0=np.ones(2)
    ),
    "three outputs": lambda file: np.savez(file, weights0=np.ones((7, 3)), offsets0=np.ones(3)),
    "no beams": lambda file: np.savez(file, weights0=np.ones((5, 2)), offsets0=np.ones(2)),
    "other offsets": lambda file: np.savez(file, weights0=np.ones((7, 2)), offsets0=np.ones(1)),
}


@pytest.mark.parametrize("what", WRONG)
def test_a_file_that_is_not_a_policy_is_refused(tmp_path, what):
    file = tmp_path / "policy.npz"
    WRONG[what](file)
    with pytest.raises(ValueError, match="policy.npz: is not a policy that save"):
        Policy.load(file)


def test_it_drives_a_server_that_does_not_wait():
    """At a rate, as in real time. Which rooms it reaches depends on the machine: it may be late."""
    run = subprocess.run(
        [sys.executable, EXAMPLE / "drive.py", "--rooms", "1", "--rate", "5"],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert re.search(r"^room 0: (success|collision|too late)$", run.stdout, re.MULTILINE)


def test_it_drives_a_server_over_lcm_and_its_run_verifies(tmp_path):
    run = subprocess.run(
        [sys.executable, EXAMPLE / "drive.py", "--rooms", "3", "--record", tmp_path],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert int(re.search(r"^(\d) of 3 rooms", run.stdout, re.MULTILINE).group(1)) >= 2, run.stdout
    for log in tmp_path.glob("*.lcm"):
        verify = subprocess.run(
            [os.environ["RUEDO"], "verify", log], capture_output=True, text=True, timeout=300
        )
        assert verify.returncode == 0, verify.stdout + verify.stderr
