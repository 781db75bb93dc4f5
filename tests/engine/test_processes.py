"""Environments in several processes: bit for bit those of one process, and ends that are clean."""

import os
import signal

import gymnasium
import numpy as np
import pytest
import ruedo.gym
from ruedo.gym import ProcessVectorEnv, TaskVectorEnv


class Fragile(ruedo.gym.Navigate):
    """Fails as its attribute says."""

    breaks = ""

    def outcome(self):
        if self.breaks == "raise":
            raise ArithmeticError(f"of {self.num_envs}")
        return super().outcome()


def same(one, two):
    assert one.keys() == two.keys()
    for name in one:
        if isinstance(one[name], dict):
            same(one[name], two[name])
        elif one[name].dtype == object:
            for a, b in zip(one[name], two[name], strict=True):
                assert (a is None) == (b is None) and (a is None or np.array_equal(a, b))
        else:
            assert one[name].dtype == two[name].dtype
            assert np.array_equal(one[name], two[name], equal_nan=one[name].dtype.kind == "f")


CASES = {
    "Navigate-v0": {"beams": 6, "max_episode_steps": 9, "randomize": {"robot.mass": "uniform(1, 2)"}},
    "Push-v0": {"autoreset_mode": "SameStep", "max_episode_steps": 7, "actions": "discrete"},
    "Corridor-v0": {"observations": "dict", "sensors": ["lrf", "depth"], "pixels": 8, "beams": 5},
}  # fmt: skip


@pytest.mark.parametrize("task", CASES)
def test_it_agrees_bit_for_bit_with_one_process(task):
    """Five environments in three processes, through the ends of episodes."""
    name, options = f"ruedo/{task}", CASES[task]
    envs = ProcessVectorEnv(name, 5, workers=3, **options)
    one = gymnasium.make_vec(name, num_envs=5, **options)
    assert envs.observation_space == one.observation_space
    assert envs.action_space == one.action_space
    assert envs.metadata["autoreset_mode"] == one.metadata["autoreset_mode"]

    def agree(these, those):
        dicts = [observed if isinstance(observed, dict) else {"": observed}
                 for observed in (these[0], those[0])]  # fmt: skip
        same(*dicts)
        for a, b in zip(these[1:-1], those[1:-1], strict=True):
            assert a.dtype == b.dtype and np.array_equal(a, b)
        same(these[-1], those[-1])

    agree(envs.reset(seed=3), one.reset(seed=3))
    one.action_space.seed(1)
    for _ in range(20):
        actions = one.action_space.sample()
        agree(envs.step(actions), one.step(actions))
    mask = np.array([True, False, False, False, True])
    how = {"seed": [7, None, None, None, 8], "options": {"reset_mask": mask}}
    agree(envs.reset(**how), one.reset(**how))
    envs.close(), one.close()


class Counting(ruedo.gym.Navigate):
    def setup(self):
        super().setup()
        self.count = np.zeros(self.num_envs, int)

    def info(self):
        self.count += 1 + np.arange(self.num_envs)
        return {"count": self.count}


def test_info_of_a_task_comes_from_all_processes():
    """Also where the episodes of some of them go on."""
    options = {"autoreset_mode": "SameStep", "max_episode_steps": 3, "beams": 4}
    envs = ProcessVectorEnv(Counting, 3, workers=3, **options)
    envs.reset(seed=1)
    assert envs.step(np.zeros((3, 2)))[4]["count"].tolist() == [2, 2, 2]
    envs.reset(options={"reset_mask": np.array([False, True, False])})
    for _ in range(2):
        info = envs.step(np.zeros((3, 2)))[4]
    assert info["count"].tolist() == [6, 5, 6]  # one more where an episode begins
    assert info["final_info"]["count"].tolist() == [5, 0, 5]
    assert info["final_info"]["_count"].tolist() == [True, False, True]
    envs.close()


def test_observations_are_the_callers_own():
    envs = ProcessVectorEnv(ruedo.gym.Navigate, 2, workers=2, beams=4)
    first, _ = envs.reset(seed=1)
    kept = first.copy()
    envs.send(np.ones((2, 2)))
    with pytest.raises(gymnasium.error.AlreadyPendingCallError, match=r"recv\(\) before reset"):
        envs.reset()
    second = envs.recv()[0]
    assert np.array_equal(first, kept) and not np.array_equal(first, second)
    assert first.ctypes.data % 64 == 0
    with pytest.raises(gymnasium.error.NoAsyncCallError):
        envs.recv()
    envs.set_attr("obstacles", 1)
    assert envs.get_attr("obstacles") == [1, 1]
    with pytest.raises(AttributeError, match="Navigate has no attribute 'nothing'"):
        envs.set_attr("nothing", 1)
    envs.step(np.ones((2, 2)))  # goes on
    envs.close(), envs.close()
    with pytest.raises(RuntimeError, match="closed"):
        envs.reset()


def test_the_error_names_a_killed_worker_and_the_others_end():
    envs = ProcessVectorEnv(ruedo.gym.Navigate, 4, workers=2, beams=4)
    envs.reset(seed=1)
    processes = [worker.process for worker in envs._workers]
    memory = envs._memory.name
    os.kill(processes[1].pid, signal.SIGKILL)
    processes[1].join()
    text = rf"worker 1 \(process {processes[1].pid}, environments 2 to 3\) .* exit code -9"
    with pytest.raises(RuntimeError, match=text):
        for _ in range(2):  # it may be found when the answer is read
            envs.step(np.zeros((4, 2)))
    assert not any(process.is_alive() for process in processes)
    with pytest.raises(FileNotFoundError):
        ruedo.gym.processes.SharedMemory(memory)
    with pytest.raises(RuntimeError, match=text):
        envs.reset()
    envs.close()


def test_errors_of_a_task_arrive():
    envs = ProcessVectorEnv(Fragile, 3, workers=2, beams=4)
    envs.reset(seed=1)
    envs.set_attr("breaks", "raise")
    with pytest.raises(ArithmeticError, match="of 1"):
        envs.step(np.zeros((3, 2)))
    envs.set_attr("breaks", "")
    envs.step(np.zeros((3, 2)))
    envs.close()


def test_wrong_arguments_are_refused():
    for wrong, text in (
        ({"workers": 5}, "workers"),
        ({"workers": 0}, "workers"),
        ({"render_mode": "rgb_array"}, "render_mode is for one process"),
        ({"beems": 3}, "beems"),
        ({"beams": 0}, "beams"),
    ):
        with pytest.raises((ValueError, TypeError), match=text):
            ProcessVectorEnv(ruedo.gym.Navigate, 4, **wrong)
    with pytest.raises(TypeError, match=r"subclass of ruedo\.gym\.Task"):
        ProcessVectorEnv(TaskVectorEnv, 2)
    with pytest.raises(gymnasium.error.Error):
        ProcessVectorEnv("ruedo/Nowhere-v0", 2)
    envs = ProcessVectorEnv(ruedo.gym.Navigate, 2, workers=1, beams=4)
    with pytest.raises(ValueError, match="reset_mask"):
        envs.reset(options={"reset_mask": np.array([True])})
    with pytest.raises(ValueError, match="finite"):
        envs.reset()
        envs.step(np.full((2, 2), np.nan))
    envs.close()
