"""The results that learners start from: the policies that lie in the repository, replayed by NumPy
alone, and the command that makes them, with a stand-in for the learner.
"""

import json
import math
import sys
import time
import types
from pathlib import Path

import numpy as np
import pytest

LEARNERS = Path(__file__).resolve().parents[2] / "clients/python/examples/learners"
sys.path.insert(0, str(LEARNERS))
import replay
import results

POLICIES = sorted((LEARNERS / "results").glob("*/*.npz"))


@pytest.mark.parametrize("file", POLICIES, ids=lambda file: file.stem)
def test_a_policy_succeeds_as_often_as_its_record_says(file):
    assert file.stat().st_size < 100_000
    task = file.stem.rpartition("-")[0].rpartition("-")[0]
    said = json.loads(file.with_suffix(".json").read_text())["test_success"]
    found = replay.success_rate(task, replay.Policy.load(file), **results.TASKS[task])
    assert found == pytest.approx(said, abs=0.03)  # of 100: another processor rounds differently


def test_a_policy_is_its_layers(tmp_path):
    """Two inputs, a hidden layer of two and one of another kind, computed by hand."""
    layers = [
        (np.array([[1.0, 0.0], [0.0, 2.0]]), np.array([0.5, 0.0])),
        (np.array([[1.0], [1.0]]), np.array([-0.25])),
    ]
    replay.Policy(layers, "relu", "tanh").save(tmp_path / "policy.npz")
    policy = replay.Policy.load(tmp_path / "policy.npz")
    seen = np.array([[0.5, 0.25], [-1.0, 0.5]])
    assert policy(seen).ravel() == pytest.approx([math.tanh(1.25), math.tanh(0.75)])
    policy = replay.Policy(layers, "tanh", "clip")
    assert policy(seen).ravel() == pytest.approx(
        [1.0 if (one := math.tanh(1.0) + math.tanh(0.5) - 0.25) > 1 else one,
         math.tanh(-0.5) + math.tanh(1.0) - 0.25]
    )  # fmt: skip


class Learner:
    """Counts steps, keeps them in its file, and breaks in the call that it is told to break in."""

    breaks_in = 0

    def __init__(self, num_timesteps):
        self.num_timesteps, self.calls = num_timesteps, 0

    def learn(self, _, callback, reset_num_timesteps):
        self.calls += 1
        assert reset_num_timesteps == (self.num_timesteps == 0)
        if self.calls == Learner.breaks_in:
            raise KeyboardInterrupt
        ended = {"infos": [{}, {"episode": {"r": 2.0}, "is_success": True}]}
        while callback(ended, {}):
            self.num_timesteps += 10
            time.sleep(0)

    def save(self, file):
        file.write_text(str(self.num_timesteps))


@pytest.fixture
def learner(monkeypatch):
    """Which runs began, and whether they went on."""
    begun = []

    def begin(run, goes_on):
        begun.append((run.name, goes_on))
        steps = int(run.model.read_text()) if goes_on else 0
        return Learner(steps), types.SimpleNamespace(close=lambda: None)

    layer = (np.ones((3, 2)), np.zeros(2))
    torch = types.SimpleNamespace(set_num_threads=lambda n: None)
    monkeypatch.setitem(sys.modules, "torch", torch)
    monkeypatch.setattr(results.Run, "_begin", begin)
    monkeypatch.setattr(results, "policy_of", lambda _: replay.Policy([layer], "tanh", "clip"))
    monkeypatch.setattr(replay, "success_rate", lambda *_, **__: 0.75)
    monkeypatch.setattr(Learner, "breaks_in", 0)
    return begun


def train(out, monkeypatch, *words):
    given = ["results.py", "--out", str(out), "--tasks", "Reach-v0", "--algorithms", "ppo", *words]
    monkeypatch.setattr(sys, "argv", given)
    results.main()


def test_a_run_goes_on_where_it_was_ended(tmp_path, monkeypatch, learner):
    words = ("--seeds", "1", "--minutes", "0.004")
    Learner.breaks_in = 3
    with pytest.raises(KeyboardInterrupt):
        train(tmp_path, monkeypatch, *words)
    run = results.Run(tmp_path, "Reach-v0", "ppo", 1)
    before = run.rows()
    assert len(before) == 2 and not run.record.exists()
    Learner.breaks_in = 0
    train(tmp_path, monkeypatch, *words)
    rows = run.rows()
    assert rows[:2] == before and len(rows) > 2
    for name in ("steps", "cpu_s"):
        assert sorted(row[name] for row in rows) == [row[name] for row in rows]
    assert all(row["success"] == 1.0 and row["return"] == 2.0 for row in rows)
    assert rows[-1]["cpu_s"] >= 0.239
    done = json.loads(run.record.read_text())
    assert done["test_success"] == 0.75 and done["steps"] >= before[-1]["steps"]
    # A run that is complete is left out; the next seed is not.
    train(tmp_path, monkeypatch, "--seeds", "2", "--minutes", "0.004")
    one, two = "Reach-v0-ppo-1", "Reach-v0-ppo-2"
    assert learner == [(one, False), (one, True), (two, False)]
    assert "| Reach-v0 | PPO | 2 |" in (tmp_path / "results.md").read_text()
    assert "<svg" in (tmp_path / "results.svg").read_text()


def test_more_minutes_continue_a_complete_run(tmp_path, monkeypatch, learner):
    """Fewer leave it as it is. Without its checkpoint, as in a clone, it begins anew."""
    train(tmp_path, monkeypatch, "--seeds", "1", "--minutes", "0.004")
    run = results.Run(tmp_path, "Reach-v0", "ppo", 1)
    before = run.rows()
    train(tmp_path, monkeypatch, "--seeds", "1", "--minutes", "0.002")
    assert run.rows() == before
    train(tmp_path, monkeypatch, "--seeds", "1", "--minutes", "0.006")
    rows = run.rows()
    assert rows[: len(before)] == before and rows[-1]["cpu_s"] >= 0.359
    assert json.loads(run.record.read_text())["cpu_s"] >= 0.359
    run.model.unlink()
    train(tmp_path, monkeypatch, "--seeds", "1", "--minutes", "0.008")
    assert run.rows()[0]["cpu_s"] < before[-1]["cpu_s"] and run.rows()[-1]["cpu_s"] >= 0.479
    assert [goes_on for _, goes_on in learner] == [False, True, False]


def test_the_band_is_students():
    curves = [
        [{"cpu_s": 0.0, "success": one}, {"cpu_s": 10.0, "success": one}] for one in (0.2, 0.4, 0.6)
    ]
    mean, half = results.band(curves, "success", np.array([1.0, 9.0]))
    assert mean == pytest.approx([0.4, 0.4])
    assert half == pytest.approx([4.303 * 0.2 / math.sqrt(3)] * 2)
