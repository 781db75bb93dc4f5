"""Environments for learning, by Gymnasium and PettingZoo: episodes of a task in the caller's
process, many at once.

    import gymnasium
    import ruedo.gym

    env = gymnasium.make("ruedo/Navigate-v0")
    envs = gymnasium.make_vec("ruedo/Navigate-v0", num_envs=64, beams=24)     # one engine, all
    cores

ruedo/Navigate-v0, ruedo/Corridor-v0, ruedo/Crowd-v0, ruedo/Push-v0 and ruedo/Camera-v0;
`FleetEnv` for several robots. docs/environments.md says what each observes, does, is rewarded for
and succeeds with; the modules of this package say the same in short.
"""

from __future__ import annotations

try:
    import gymnasium
except ImportError as _error:
    raise ImportError("ruedo.gym needs gymnasium: pip install gymnasium") from _error

from .camera import CameraEnv, CameraVectorEnv
from .corridor import CorridorEnv, CorridorVectorEnv
from .crowd import CrowdEnv, CrowdVectorEnv
from .navigate import NavigateEnv, NavigateVectorEnv
from .push import PushEnv, PushVectorEnv

__all__ = [
    "CameraEnv",
    "CameraVectorEnv",
    "CorridorEnv",
    "CorridorVectorEnv",
    "CrowdEnv",
    "CrowdVectorEnv",
    "FleetEnv",
    "NavigateEnv",
    "NavigateVectorEnv",
    "PushEnv",
    "PushVectorEnv",
]


def __getattr__(name: str) -> object:
    """``FleetEnv`` needs PettingZoo, which the others do not."""
    if name != "FleetEnv":
        raise AttributeError(f"module 'ruedo.gym' has no attribute {name!r}")
    try:
        from .fleet import FleetEnv
    except ImportError as error:
        raise ImportError("ruedo.gym.FleetEnv needs PettingZoo: pip install pettingzoo") from error
    return FleetEnv


for _task in ("Navigate", "Corridor", "Crowd", "Push", "Camera"):
    gymnasium.register(
        f"ruedo/{_task}-v0",
        entry_point=f"ruedo.gym:{_task}Env",
        vector_entry_point=f"ruedo.gym:{_task}VectorEnv",
    )
