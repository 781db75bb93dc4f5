"""Environments for learning, by Gymnasium and PettingZoo: episodes of a task in the caller's
process, many at once.

    import gymnasium
    import ruedo.gym

    env = gymnasium.make("ruedo/Navigate-v0")
    envs = gymnasium.make_vec("ruedo/Navigate-v0", num_envs=64, beams=24)     # one engine, all
    cores

ruedo/Navigate-v0, ruedo/Corridor-v0, ruedo/Crowd-v0, ruedo/Push-v0, ruedo/Camera-v0,
ruedo/Hills-v0 and ruedo/Reach-v0;
`FleetEnv` for several robots. docs/environments.md says what each observes, does, is rewarded for
and succeeds with; the modules of this package say the same in short. `Task` is the base class for
tasks of your own (docs/tasks.md).
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

try:
    import gymnasium
except ImportError as _error:
    raise ImportError("ruedo.gym needs gymnasium: pip install gymnasium") from _error

from .camera import Camera, CameraEnv, CameraVectorEnv
from .corridor import Corridor, CorridorEnv, CorridorVectorEnv
from .crowd import Crowd, CrowdEnv, CrowdVectorEnv
from .drive import DriveTask, GoalTask
from .environments import SavedEpisodes, TaskEnv, TaskVectorEnv
from .hills import Hills, HillsEnv, HillsVectorEnv
from .navigate import Navigate, NavigateEnv, NavigateVectorEnv
from .processes import ProcessVectorEnv
from .push import Push, PushEnv, PushVectorEnv
from .reach import Reach, ReachEnv, ReachVectorEnv
from .task import Outcome, Task

__all__ = [
    "Camera",
    "CameraEnv",
    "CameraVectorEnv",
    "Corridor",
    "CorridorEnv",
    "CorridorVectorEnv",
    "Crowd",
    "CrowdEnv",
    "CrowdVectorEnv",
    "DriveTask",
    "FleetEnv",
    "GoalTask",
    "Hills",
    "HillsEnv",
    "HillsVectorEnv",
    "Navigate",
    "NavigateEnv",
    "NavigateVectorEnv",
    "Outcome",
    "ProcessVectorEnv",
    "Push",
    "PushEnv",
    "PushVectorEnv",
    "Reach",
    "ReachEnv",
    "ReachVectorEnv",
    "SavedEpisodes",
    "Task",
    "TaskEnv",
    "TaskVectorEnv",
    "register",
]


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)


if TYPE_CHECKING:
    from .fleet import FleetEnv as FleetEnv
else:

    def __getattr__(name: str) -> object:
        """``FleetEnv`` needs PettingZoo, which the others do not."""
        if name != "FleetEnv":
            raise AttributeError(f"module 'ruedo.gym' has no attribute {name!r}")
        try:
            from .fleet import FleetEnv
        except ImportError as error:
            raise ImportError(
                "ruedo.gym.FleetEnv needs PettingZoo: pip install pettingzoo"
            ) from error
        return FleetEnv


def register(name: str, task: type[Task]) -> None:
    """Registers a task of your own, so that `gymnasium.make(name)` and `make_vec` create it:
    register("mine/Dock-v0", Dock).
    """
    if not isinstance(task, type) or not issubclass(task, Task):
        raise TypeError(f"task is a subclass of ruedo.gym.Task, not {task!r}")
    gymnasium.register(
        name,
        entry_point=partial(TaskEnv, task),
        vector_entry_point=partial(TaskVectorEnv, task),
        max_episode_steps=task.max_episode_steps if task.max_episode_steps >= 0 else None,
    )


for _task in (Navigate, Corridor, Crowd, Push, Camera, Hills, Reach):
    gymnasium.register(
        f"ruedo/{_task.__name__}-v0",
        entry_point=f"ruedo.gym:{_task.__name__}Env",
        vector_entry_point=f"ruedo.gym:{_task.__name__}VectorEnv",
        max_episode_steps=_task.max_episode_steps,
    )
