"""ruedo.gym in the hands of learning libraries: Stable-Baselines3's interface and arrays that other
libraries take without a copy. The libraries themselves are gigabytes: stand-ins of their interfaces
are in NumPy.
"""

import importlib
import json
import subprocess
import sys
import types

import gymnasium
import numpy as np
import pytest
import ruedo.gym


class VecEnv:
    """What Stable-Baselines3 2.9's base class does for its subclasses."""

    def __init__(self, num_envs, observation_space, action_space):
        self.num_envs = num_envs
        self.observation_space, self.action_space = observation_space, action_space
        self.reset_infos = [{} for _ in range(num_envs)]
        self._reset_seeds(), self._reset_options()
        self.render_mode = self.get_attr("render_mode")[0]

    def _reset_seeds(self):
        self._seeds = [None] * self.num_envs

    def _reset_options(self):
        self._options = [{} for _ in range(self.num_envs)]

    def _get_indices(self, indices):
        if indices is None:
            return range(self.num_envs)
        return [indices] if isinstance(indices, int) else indices

    def step(self, actions):
        self.step_async(actions)
        return self.step_wait()

    def seed(self, seed):
        self._seeds = [seed + i for i in range(self.num_envs)]
        return self._seeds


@pytest.fixture
def sb3(monkeypatch):
    """ruedo.gym.sb3, over Stable-Baselines3 where it is installed."""
    try:
        import stable_baselines3  # noqa: F401
    except ImportError:
        for name in ("stable_baselines3", "stable_baselines3.common"):
            monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
        module = types.ModuleType("stable_baselines3.common.vec_env")
        module.VecEnv = VecEnv
        monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.delitem(sys.modules, "ruedo.gym.sb3", raising=False)
    yield importlib.import_module("ruedo.gym.sb3")
    sys.modules.pop("ruedo.gym.sb3", None)


def test_a_rollout_is_that_of_the_vector_environment(sb3):
    """Through the ends of episodes, by success, collision and time."""
    options = {"beams": 6, "max_episode_steps": 60}
    env = sb3.SB3VecEnv("ruedo/Navigate-v0", num_envs=6, **options)
    envs = ruedo.gym.NavigateVectorEnv(6, autoreset_mode="SameStep", **options)
    env.seed(4)
    assert np.array_equal(env.reset(), envs.reset(seed=4)[0]) and env._seeds == [None] * 6
    actions = (
        np.random.default_rng(1).uniform([0.8, -0.2], [1, 0.2], (150, 6, 2)).astype(np.float32)
    )
    returns, lengths, ends = np.zeros(6), np.zeros(6, int), []
    for action in actions:
        observations, rewards, dones, infos = env.step(action)
        expected = envs.step(action)
        assert np.array_equal(observations, expected[0]) and rewards.dtype == np.float32
        assert np.array_equal(rewards, expected[1].astype(np.float32))
        assert np.array_equal(dones, expected[2] | expected[3]) and len(infos) == 6
        returns, lengths = returns + expected[1], lengths + 1
        for i, info in enumerate(infos):
            if not dones[i]:
                assert info == {}
                continue
            ends.append((info["is_success"], info["collision"], info["TimeLimit.truncated"]))
            assert sum(ends[-1]) == 1  # for one of these reasons
            assert np.array_equal(info["terminal_observation"], expected[4]["final_obs"][i])
            assert info["episode"]["l"] == lengths[i]
            assert info["episode"]["r"] == pytest.approx(returns[i])
            returns[i], lengths[i] = 0.0, 0
    assert {end[1:] for end in ends} >= {(True, False), (False, True)}
    env.close(), envs.close()


def test_attributes_are_of_the_task_that_all_share(sb3):
    env = sb3.SB3VecEnv(ruedo.gym.Navigate, 3, beams=5, render_mode="rgb_array")
    assert env.get_attr("obstacles") == [8, 8, 8] and env.get_attr("obstacles", [0, 2]) == [8, 8]
    assert env.get_attr("render_mode", 1) == ["rgb_array"]
    env.set_attr("obstacles", 2)
    env.reset()
    assert all(scene.sdf.count("name='obstacle") == 2 for scene in env.envs.scenes)
    assert [one.shape for one in env.get_images()] == [(256, 256, 3)] * 3
    assert env.env_is_wrapped(object) == [False] * 3
    with pytest.raises(AttributeError):
        env.get_attr("nothing")
    with pytest.raises(AttributeError, match="Navigate has no attribute 'nothing'"):
        env.set_attr("nothing", 1)
    with pytest.raises(ValueError, match="which all environments share"):
        env.set_attr("obstacles", 1, indices=[0])
    with pytest.raises(NotImplementedError, match="call save of .envs"):
        env.env_method("save")
    env.close()


def test_drawn_values_are_in_reset_infos(sb3):
    draws = {"robot.mass": "uniform(0.8, 1.2)"}
    env = sb3.SB3VecEnv("ruedo/Navigate-v0", 2, beams=5, randomize=draws)
    env.reset()
    assert [one["drawn"] for one in env.reset_infos] == [env.envs._engine.drawn(i) for i in (0, 1)]
    env.close()


def test_a_missing_library_is_reported_by_name(monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    monkeypatch.delitem(sys.modules, "ruedo.gym.sb3", raising=False)
    with pytest.raises(ImportError, match="pip install stable-baselines3"):
        importlib.import_module("ruedo.gym.sb3")


# ---- RLlib and TorchRL take vector environments as they are: what each reads of them. Tried with
# Ray 2.60 (its SingleAgentEnvRunner of 64 environments, and PPO's learner on what that sampled) and
# TorchRL on torch 2.15.


def test_infos_of_an_env_runner_of_rllib():
    """RLlib creates environments in this way, and reads infos through this wrapper."""
    options = {"num_envs": 6, "beams": 6, "max_episode_steps": 40}
    envs = gymnasium.make_vec(
        "ruedo/Navigate-v0", vectorization_mode="vector_entry_point", **options
    )
    assert envs.metadata["autoreset_mode"] is gymnasium.vector.AutoresetMode.NEXT_STEP
    listed = gymnasium.wrappers.vector.DictInfoToList(envs)
    listed.reset(seed=4)
    over, ended = np.zeros(6, bool), 0
    for _ in range(60):
        _, rewards, terminated, truncated, infos = listed.step(np.tile([1.0, 0.0], (6, 1)))
        for i, info in enumerate(infos):
            assert info.keys() == (set() if over[i] else {"success", "collision"})
            assert not over[i] or (rewards[i] == 0 and not terminated[i])  # the next one begins
            assert not terminated[i] or info["success"] != info["collision"]
        over = terminated | truncated
        ended += over.sum()
    assert ended >= 6  # each, at the latest after 40 actions
    listed.close()


def test_info_that_torchrl_reads():
    """With SAME_STEP, and every entry a number for each environment; a missing last observation
    counts as zeros.
    """
    options = {"num_envs": 4, "beams": 6, "max_episode_steps": 5, "autoreset_mode": "SameStep"}
    envs = gymnasium.make_vec("ruedo/Navigate-v0", **options)
    envs.reset(seed=1)

    def leaves(info):
        for name, values in info.items():
            if isinstance(values, dict):
                yield from leaves(values)
            else:
                yield name, values

    for step in range(1, 11):
        actions = np.full((4, 2), 0.1)
        *_, truncated, info = envs.step(actions)
        assert truncated.all() == (step % 5 == 0)
        for name, values in leaves(info):
            rows = [np.zeros(11, np.float32) if row is None else row for row in values]
            assert np.stack(rows).shape == ((4, 11) if name == "final_obs" else (4,))
    envs.close()


# ---- Arrays, and steps in the background.


def test_other_libraries_take_arrays_without_a_copy():
    """By DLPack: observations are the caller's own, and the engine's views cannot be written to."""
    envs = ruedo.gym.NavigateVectorEnv(4, beams=6)
    first, _ = envs.reset(seed=1)
    assert first.ctypes.data % 64 == 0  # or JAX copies
    taken = np.from_dlpack(first)
    assert np.shares_memory(taken, first) and first.flags.writeable and first.flags.c_contiguous
    kept = first.copy()
    second, rewards, *_ = envs.step(np.ones((4, 2)))
    assert not np.shares_memory(first, second) and np.array_equal(taken, kept)
    assert np.shares_memory(np.from_dlpack(rewards), rewards)
    view = envs.task.engine.observe("lrf.ranges")
    seen = np.from_dlpack(view)
    before = seen.copy()
    assert np.shares_memory(seen, view) and not seen.flags.writeable
    envs.step(np.ones((4, 2)))
    assert np.array_equal(seen, view) and not np.array_equal(seen, before)
    envs.close()


def test_the_learner_receives_the_values_of_step():
    envs, other = (ruedo.gym.NavigateVectorEnv(3, beams=6, max_episode_steps=9) for _ in range(2))
    envs.reset(seed=1), other.reset(seed=1)
    for action in np.random.default_rng(1).uniform(-1, 1, (30, 3, 2)):
        sent = action.copy()
        envs.send(sent)
        sent[:] = np.nan  # the caller's own again
        one, two = envs.recv(), other.step(action)
        assert all(np.array_equal(a, b) for a, b in zip(one[:4], two[:4]))
    envs.close(), other.close()


def test_calls_out_of_order_are_refused():
    envs = ruedo.gym.NavigateVectorEnv(2, beams=4)
    with pytest.raises(gymnasium.error.NoAsyncCallError, match=r"call send\(\) before recv\(\)"):
        envs.recv()
    envs.send(np.zeros((2, 2)))
    with pytest.raises(gymnasium.error.ResetNeeded):  # as step() says it
        envs.recv()
    envs.reset(seed=1)
    with pytest.raises(ValueError, match="finite numbers"):
        envs.send(np.full((2, 2), np.nan))
    envs.send(np.zeros((2, 2)))
    saved = None
    for call in (
        lambda: envs.send(np.zeros((2, 2))),
        lambda: envs.step(np.zeros((2, 2))),
        envs.reset,
        envs.save,
        envs.render,
    ):
        with pytest.raises(gymnasium.error.AlreadyPendingCallError, match=r"call recv\(\) before"):
            saved = call()
    assert saved is None
    envs.recv()
    envs.send(np.zeros((2, 2)))
    envs.close()  # waits for it


# ---- The benchmark.


def bench(*arguments):
    command = [sys.executable, "-m", "ruedo.gym.bench", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def test_the_benchmark_prints_a_row_for_each_simulator():
    done = bench("--envs", "3", "--beams", "5", "--seconds", "0.1", "--json")
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert [row["simulator"].partition(",")[0] for row in rows[:2]] == ["Ruedo", "Ruedo"]
    assert all((row["envs"], row["beams"]) == (3, 5) and row["steps_per_s"] > 0 for row in rows)
    done = bench("--envs", "2", "--beams", "5", "--seconds", "0.1")
    assert "2 environments, 5 beams" in done.stdout and "\nMuJoCo - " in done.stdout


def test_the_benchmark_refuses_wrong_sizes():
    for wrong in (["--envs", "0"], ["--beams", "1"], ["--seconds", "nan"], ["--envs", "x"]):
        done = bench(*wrong)
        assert done.returncode == 2 and "--envs" in done.stderr, done.stderr
