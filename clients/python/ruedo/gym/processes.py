"""Episodes of a task in several processes: observations, rewards and ends go through shared memory.

An engine uses all cores, but what a task computes in Python (observations, rewards, new scenes)
uses one. `ProcessVectorEnv` divides that, too.
"""

from __future__ import annotations

import os
import pickle
import signal
from collections.abc import Callable, Sequence
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import load_env_creator
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ..arguments import shown, whole
from ..engine import MOST_WORLDS
from .environments import Info, MadeAnew, TaskVectorEnv, aligned_copy, check_options, seeds_of
from .task import Task, checked_actions

Layout = dict[str, tuple[int, tuple[int, ...], str]]  # where, shape, type of each array
_ROUND = 64  # bytes: arrays of their own begin at cache lines of their own
_PATIENCE_S = 10.0  # in which a worker ends that is asked to


class ProcessVectorEnv(MadeAnew, VectorEnv):
    """``num_envs`` environments of a task, as `TaskVectorEnv` has them, in ``workers`` processes
    with an engine each.

        envs = ProcessVectorEnv("ruedo/Navigate-v0", num_envs=256, workers=8, beams=24)

    task: its registered name, or the class, which other processes must be able to import: a program
    that creates this starts with ``if __name__ == "__main__":``. workers: by default one for each
    core. options: those of `TaskVectorEnv`, without rendering. The same seeds give the same
    results, bit for bit, as in one process.

    A worker that dies ends the others: the call raises RuntimeError, which names it. Curricula:
    ``envs.set_attr("obstacles", 16)``. `save` and `restore` are for one process.
    """

    def __init__(
        self,
        task: str | type[Task],
        num_envs: int = 1,
        *,
        workers: int | None = None,
        **options: Any,
    ) -> None:
        if options.pop("render_mode", None) is not None:
            raise ValueError("render_mode is for one process: TaskVectorEnv, or gymnasium.make_vec")
        self.num_envs = whole("num_envs", num_envs, 1, MOST_WORLDS)
        if workers is None:
            workers = min(len(os.sched_getaffinity(0)), num_envs)
        workers = whole("workers", workers, 1, num_envs)
        self._sent, self._failed = "", ""
        self._workers: list[_Worker] = []
        self._memory: SharedMemory | None = None
        self._arrays: dict[str, NDArray[Any]] = {}
        make = partial(_maker(task), **{"threads": 1, **options})
        edges = np.linspace(0, num_envs, workers + 1).astype(int).tolist()
        try:
            self._workers = [_Worker(k, make, slice(*edges[k : k + 2])) for k in range(workers)]
            self._begin()
        except BaseException:
            self.close()
            raise

    def _begin(self) -> None:
        observed, done, self.metadata = self._answers()[0]
        self.single_observation_space, self.single_action_space = observed, done
        self.observation_space = batch_space(observed, self.num_envs)
        self.action_space = batch_space(done, self.num_envs)
        layout, size = _layout(self.observation_space, self.action_space)
        self._memory = SharedMemory(create=True, size=size)
        self._arrays = _views(self._memory, layout)
        self._ask("share", (self._memory.name, layout))
        self._answers()

    # ---- Gymnasium's interface.

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Info | None = None
    ) -> tuple[Any, Info]:
        """As `TaskVectorEnv.reset`."""
        self._refuse_sent("reset()")
        check_options(options)
        seeds = seeds_of(seed, self.num_envs)
        masks = dict(options or {})
        mask = masks.get("reset_mask")
        if mask is not None and np.shape(mask) != (self.num_envs,):
            raise ValueError(
                f"reset_mask is True or False for each of {self.num_envs} environments, not {shown(mask)}"
            )
        for worker in self._workers:
            if mask is not None:
                masks["reset_mask"] = np.asarray(mask)[worker.rows]
            self._tell(worker, "reset", (seeds[worker.rows], {**masks}))
        info = _merged(self._answers(), [worker.rows for worker in self._workers], self.num_envs)
        return self._observations(), info

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Info]:
        """Takes one action in every environment."""
        self._refuse_sent("step()")
        self.send(actions)
        return self.recv()

    def send(self, actions: NDArray[Any]) -> None:
        """Begins a step; `recv` has its result. Refuses wrong actions."""
        self._refuse_sent("send()")
        self._check_alive()
        self._arrays["actions"][:] = checked_actions(actions, self.action_space)
        self._ask("step", None)
        self._sent = "send"

    def recv(
        self,
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Info]:
        """Waits for the step that `send` has begun, and returns or raises what `step` would."""
        if not self._sent:
            raise gymnasium.error.NoAsyncCallError("call send() before recv()", "recv")
        self._sent = ""
        info = _merged(self._answers(), [worker.rows for worker in self._workers], self.num_envs)
        rewards, terminated, truncated = (
            self._arrays[name].copy() for name in ("rewards", "terminated", "truncated")
        )
        return self._observations(), rewards, terminated, truncated, info

    def get_attr(self, name: str) -> list[Any]:
        """An attribute of the task, of each worker."""
        self._refuse_sent("get_attr()")
        self._ask("get", name)
        return self._answers()

    def set_attr(self, name: str, value: Any) -> None:
        """Sets an attribute of the task in all workers; scenes that begin later follow. Raises
        AttributeError.
        """
        self._refuse_sent("set_attr()")
        self._ask("set", (name, value))
        self._answers()

    def close_extras(self, **_: object) -> None:
        for worker in self._workers:
            worker.end()
        self._arrays.clear()
        if self._memory:
            self._memory.close()
            self._memory.unlink()
            self._memory = None

    # ---- The workers.

    def _observations(self) -> Any:
        if not isinstance(self.observation_space, spaces.Dict):
            return _own(self._arrays["observations"])
        return {name: _own(self._arrays[f"observations/{name}"]) for name in self.observation_space}

    def _refuse_sent(self, call: str) -> None:
        if self._sent:
            raise gymnasium.error.AlreadyPendingCallError(
                f"a step is under way: call recv() before {call}", self._sent
            )

    def _check_alive(self) -> None:
        if self._failed or self.closed:
            raise RuntimeError(self._failed or "the environments are closed")

    def _ask(self, what: str, value: Any) -> None:
        for worker in self._workers:
            self._tell(worker, what, value)

    def _tell(self, worker: _Worker, what: str, value: Any) -> None:
        self._check_alive()
        try:
            worker.pipe.send((what, value))
        except OSError:
            self._report_death(worker)

    def _answers(self) -> list[Any]:
        """Of all workers. Raises what the first of them raised."""
        self._check_alive()
        answers: list[Any] = []
        errors: list[Exception] = []
        for worker in self._workers:
            try:
                is_error, answer = worker.pipe.recv()
            except (EOFError, OSError):
                self._report_death(worker)
            (errors if is_error else answers).append(answer)
        if errors:
            raise errors[0]
        return answers

    def _report_death(self, dead: _Worker) -> None:
        self._failed = dead.epitaph()
        self.close()
        raise RuntimeError(self._failed)


class _Worker:
    """A process with the environments of these rows, and the pipe to it."""

    def __init__(self, number: int, make: Callable[..., TaskVectorEnv], rows: slice) -> None:
        self.number, self.rows = number, rows
        context = get_context("spawn")  # engines and learners have threads, which a fork loses
        self.pipe, other = context.Pipe()
        self.process = context.Process(
            target=_work, args=(other, make, rows), name=f"ruedo worker {number}", daemon=True
        )
        self.process.start()
        other.close()

    def epitaph(self) -> str:
        self.process.join(_PATIENCE_S)
        return (
            f"worker {self.number} (process {self.process.pid}, environments {self.rows.start} to "
            f"{self.rows.stop - 1}) ended with exit code {self.process.exitcode}"
        )

    def end(self) -> None:
        """It ends as soon as it finds the pipe closed."""
        self.pipe.close()
        self.process.join(_PATIENCE_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()


def _maker(task: str | type[Task]) -> Callable[..., TaskVectorEnv]:
    """Resolved here: a worker has not registered the tasks of this program."""
    if not isinstance(task, str):
        return partial(TaskVectorEnv, task)
    make: Any = gymnasium.spec(task).vector_entry_point
    return load_env_creator(make) if isinstance(make, str) else make  # type: ignore[return-value]


def _work(pipe: Connection, make: Callable[..., TaskVectorEnv], rows: slice) -> None:
    """Answers (False, result), or (True, error), to each request until the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which ends this
    part: _Part | None = None
    try:
        while True:
            try:
                if part is None:
                    part = _Part(make(num_envs=rows.stop - rows.start), rows)
                    answer = part.spaces()
                else:
                    what, value = pipe.recv()
                    answer = getattr(part, what)(value)
                pipe.send((False, answer))
            except (EOFError, OSError):
                return
            except Exception as error:
                pipe.send((True, _portable(error)))
                if part is None:
                    return
    finally:
        if part:
            part.close()


def _portable(error: Exception) -> Exception:
    """The same error, or its text where another process could not read it."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error


class _Part:
    """The environments of one worker; each method answers a request."""

    def __init__(self, envs: TaskVectorEnv, rows: slice) -> None:
        self._envs, self._rows = envs, rows
        self._memory: SharedMemory | None = None
        self._arrays: dict[str, NDArray[Any]] = {}

    def spaces(self) -> tuple[Any, ...]:
        envs = self._envs
        return envs.single_observation_space, envs.single_action_space, envs.metadata

    def share(self, place: tuple[str, Layout]) -> None:
        name, layout = place
        self._memory = SharedMemory(name)
        self._arrays = {
            name: whole[self._rows] for name, whole in _views(self._memory, layout).items()
        }

    def reset(self, how: tuple[list[int | None], Info]) -> Info:
        seeds, options = how
        observations, info = self._envs.reset(seed=seeds, options=options)
        self._write(observations)
        return info

    def step(self, _: None) -> Info:
        observations, rewards, terminated, truncated, info = self._envs.step(
            self._arrays["actions"]
        )
        self._write(observations)
        ends = {"rewards": rewards, "terminated": terminated, "truncated": truncated}
        for name, values in ends.items():
            self._arrays[name][:] = values
        return info

    def get(self, name: str) -> Any:
        return getattr(self._envs.task, name)

    def set(self, what: tuple[str, Any]) -> None:
        name, value = what
        task = self._envs.task
        if not hasattr(task, name):
            raise AttributeError(f"{type(task).__name__} has no attribute {name!r}")
        setattr(task, name, value)

    def close(self) -> None:
        self._envs.close()
        self._arrays.clear()
        if self._memory:
            self._memory.close()

    def _write(self, observations: Any) -> None:
        if not isinstance(observations, dict):
            observations = {"": observations}
        for name, values in observations.items():
            self._arrays[f"observations/{name}" if name else "observations"][:] = values


def _layout(observed: spaces.Space[Any], done: spaces.Space[Any]) -> tuple[Layout, int]:
    """And how many bytes."""
    n = done.shape[0] if done.shape else 0
    fields: dict[str, tuple[tuple[int, ...], Any]] = {
        "actions": (done.shape or (n,), np.float64),
        "rewards": ((n,), np.float64),
        "terminated": ((n,), np.bool_),
        "truncated": ((n,), np.bool_),
    }
    if isinstance(observed, spaces.Dict):
        of_each = {f"observations/{name}": space for name, space in observed.items()}
    else:
        of_each = {"observations": observed}
    for name, space in of_each.items():
        fields[name] = (space.shape or (), space.dtype)
    layout, end = {}, 0
    for name, (shape, dtype) in fields.items():
        layout[name] = (end, shape, np.dtype(dtype).str)
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize
        end += -(-size // _ROUND) * _ROUND
    return layout, end


def _views(memory: SharedMemory, layout: Layout) -> dict[str, NDArray[Any]]:
    return {
        name: np.ndarray(shape, dtype, memory.buf, begin)
        for name, (begin, shape, dtype) in layout.items()
    }


def _own(values: NDArray[Any]) -> NDArray[Any]:
    return aligned_copy(values, values.dtype)


def _merged(parts: Sequence[Info], rows: Sequence[slice], num_envs: int) -> Info:
    """The info of all environments. What a worker does not have is False, NaN, None or 0 there."""
    merged: Info = {}
    for name in dict.fromkeys(name for part in parts for name in part):
        have = [(part[name], these) for part, these in zip(parts, rows) if name in part]
        if isinstance(have[0][0], dict):
            merged[name] = _merged(
                [values for values, _ in have], [these for _, these in have], num_envs
            )
            continue
        dtype = have[0][0].dtype
        missing = {"b": False, "f": np.nan, "O": None}.get(dtype.kind, 0)
        merged[name] = np.full(num_envs, missing, dtype)
        for values, these in have:
            merged[name][these] = values
    return merged
