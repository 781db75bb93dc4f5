"""What the tasks have in common: episodes in the copies of one engine, Gymnasium's modes of
autoreset, pictures of the scene.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ..arguments import array, shown, whole
from ..engine import MOST_WORLDS, Engine, Saved, SavedWorld
from ..rooms import TEST_ROOMS, Scene

if TYPE_CHECKING:
    from typing_extensions import Self

    from .console import Console

STEPS = 20  # of the world in an action: 0.1 s
PICTURE = 256  # pixels, the width and height of a rendered frame
MODES = (None, "rgb_array", "human")

MOST_SEED = 2**128 - 1  # that of numpy's SeedSequence

Info = dict[str, Any]
Outcome = tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]


class _SavedEpisode:
    """An episode of one environment as it was."""

    def __init__(
        self,
        world: SavedWorld,
        scene: Scene,
        generator: np.random.Generator,
        rows: dict[str, NDArray[Any]],
    ) -> None:
        self.world, self.scene, self.generator, self.rows = world, scene, generator, rows


class SavedEpisodes(Saved):
    """What `TaskVectorEnv.save` gave; it does not change. ``len()``: how many episodes."""

    def __init__(self, episodes: list[_SavedEpisode]) -> None:
        self._episodes = episodes

    def __len__(self) -> int:
        return len(self._episodes)

    def __repr__(self) -> str:
        return f"<ruedo.gym.SavedEpisodes: {len(self)}>"


class MadeAnew:
    """Copied or pickled, an environment is made anew with the same arguments, as by Gymnasium's
    EzPickle; it wants a reset.
    """

    _made_with: tuple[tuple[Any, ...], Info]

    def __new__(cls, *arguments: Any, **options: Any) -> Self:
        one = super().__new__(cls)
        one._made_with = arguments, options
        return one

    def __reduce__(self) -> Any:
        spec = getattr(self, "spec", None)
        return _make_anew, (type(self), *self._made_with), {"spec": spec}


def _make_anew(kind: type, arguments: tuple[Any, ...], options: Info) -> Any:
    return kind(*arguments, **options)


class TaskVectorEnv(MadeAnew, VectorEnv):
    """``num_envs`` episodes of a task, each in a scene of its own.

    A task says which scene has which number (`_scene`), what an action commands (`_commands`), what
    came of it (`_outcome`) and what is observed (`_observe`). What it keeps of its episodes are
    arrays with a row for each environment, as attributes of its own: `save` saves these.
    """

    metadata: Info = {
        "render_modes": ["rgb_array", "human"],
        "render_fps": 10,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }
    most_actions = 400

    def __init__(
        self,
        num_envs: int,
        observations: spaces.Space[Any],
        actions: spaces.Space[Any],
        *,
        split: Literal["train", "test"],
        noise: bool,
        threads: int,
        autoreset_mode: AutoresetMode | str,
        render_mode: Literal["rgb_array", "human"] | None,
        settings: dict[str, object] | None = None,
        disabled: tuple[str, ...] = (),
        randomize: dict[str, str] | None = None,
    ) -> None:
        num_envs = whole("num_envs", num_envs, 1, MOST_WORLDS)
        if split not in ("train", "test"):
            raise ValueError(f"split is {shown(split)}; allowed are 'train' and 'test'")
        if render_mode not in MODES:
            raise ValueError(
                f"render_mode is {shown(render_mode)}; allowed are None, 'rgb_array' and 'human'"
            )
        if render_mode == "human" and num_envs != 1:
            raise ValueError("render_mode 'human' is for one environment: the console shows one")
        self.num_envs = num_envs
        self.autoreset_mode = checked_mode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.render_mode = render_mode
        self.single_observation_space = observations
        self.single_action_space = actions
        self.observation_space = batch_space(observations, num_envs)
        self.action_space = batch_space(actions, num_envs)
        self._first = 0 if split == "train" else TEST_ROOMS
        self._options: Info = {
            "set": settings or {},
            "disable": list(disabled),
            "noise": noise,
            "randomize": randomize or {},
        }
        scene = self._scene(self._first)
        self._scenes = [scene] * num_envs
        self._engine = Engine(
            type(self).__name__,
            text=self._text(scene),
            worlds=num_envs,
            threads=threads,
            **self._options,
        )
        self._console: Console | None = None
        self._places = self._engine.observe("pose.pos")
        self._turned = self._engine.observe("pose.orientation")
        # Pictures are observed when they are first wanted: Gymnasium makes an environment to look
        # at its spaces before it forks, and after a picture none can be drawn in a fork.
        self._actions = np.zeros(num_envs, int)
        self._over = np.ones(num_envs, bool)  # wait for a reset
        self._unbegun = np.ones(num_envs, bool)  # have waited since they were made

    # ---- What a task says.

    def _scene(self, number: int) -> Scene:
        """The scene of that number."""
        raise NotImplementedError

    def _begun(self, indices: NDArray[np.intp]) -> None:
        """New episodes have begun in these environments."""

    def _commands(self, actions: NDArray[Any]) -> NDArray[np.float64]:
        """(environments, robots, (m/s, rad/s))"""
        raise NotImplementedError

    def _outcome(self) -> Outcome:
        """Rewards, who has succeeded, who has failed."""
        raise NotImplementedError

    def _observe(self) -> NDArray[Any]:
        raise NotImplementedError

    # ---- Gymnasium's interface.

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Info | None = None
    ) -> tuple[NDArray[Any], Info]:
        """Begins new episodes in all environments, or where ``options["reset_mask"]`` says.

        seed: environment i draws its scenes from ``seed + i``; or one for each; None goes on with
        the draws that there are.
        """
        seeds = self._seeds(seed)
        begin = self._masked(options)
        if not hasattr(self, "_generators"):
            self._generators = [np.random.default_rng() for _ in range(self.num_envs)]
        for i in begin:
            if seeds[i] is not None:
                self._generators[i] = np.random.default_rng(seeds[i])
        self._begin(begin)
        return self._observe(), {}

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[NDArray[Any], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Info]:
        """One action of 0.1 s in every environment."""
        return self._act(checked_actions(actions, self.action_space))

    def _act(
        self, actions: NDArray[np.float64]
    ) -> tuple[NDArray[Any], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Info]:
        if self.autoreset_mode is not AutoresetMode.NEXT_STEP:
            self._check_begun(range(self.num_envs), "the first step()")
        elif not hasattr(self, "_generators"):
            raise gymnasium.error.ResetNeeded("call reset() before the first step()")
        begun = None  # these show their beginning: their first action is the next one
        if self.autoreset_mode is AutoresetMode.NEXT_STEP and self._over.any():
            begun = self._over.copy()
            self._begin(np.flatnonzero(begun))
        commands = self._commands(actions)
        if begun is not None:
            commands[begun] = np.nan
        self._engine.step(commands, STEPS, worlds=None if begun is None else ~begun)
        if self._console:
            self._console.step(commands[0])
        self._actions += 1
        rewards, success, failure = self._outcome()
        if begun is not None:
            rewards[begun], success[begun], failure[begun] = 0.0, False, False
            self._actions[begun] = 0
        terminated = success | failure
        truncated = (self._actions >= self.most_actions) & ~terminated
        self._over = terminated | truncated
        info: Info = {"success": success, "collision": failure}
        observations = self._observe()
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._over.any():
            observations = self._begin_at_once(observations, info)
        return observations, rewards, terminated, truncated, info

    def _begin_at_once(self, observations: NDArray[Any], info: Info) -> NDArray[Any]:
        info["final_obs"] = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(self._over):
            info["final_obs"][i] = observations[i]
        info["final_info"] = {name: info[name].copy() for name in ("success", "collision")}
        info["_final_obs"] = info["_final_info"] = self._over.copy()
        self._begin(np.flatnonzero(self._over))
        return self._observe()

    def save(self, indices: int | Sequence[int] | NDArray[Any] | None = None) -> SavedEpisodes:
        """The episodes of these environments (an index, several, a mask, or None for all) as they
        stand, with all that decides what follows: the world, goals, how many actions there were,
        and the seeds of the episodes to come. It costs some 0.1 ms each, however long they have
        run.
        """
        these = self._indices(indices)
        self._check_begun(these, "save()")
        return SavedEpisodes(
            [
                _SavedEpisode(
                    self._engine.save(i),
                    self._scenes[i],
                    copy.deepcopy(self._generators[i]),
                    {name: rows[i].copy() for name, rows in self._rows().items()},
                )
                for i in these
            ]
        )

    def restore(
        self, saved: SavedEpisodes, indices: int | Sequence[int] | NDArray[Any] | None = None
    ) -> tuple[NDArray[Any], Info]:
        """Makes episodes what they were: for the same actions, what follows is what followed, byte
        for byte. Returns the observations of all environments, as `reset` does.

        indices: which environments (a mask, too); as many as were saved, or any number where it was
        one. None: those that were saved.
        """
        if not isinstance(saved, SavedEpisodes):
            raise TypeError(f"restore() takes what save() gave, not {shown(saved)}")
        if self.render_mode == "human":
            raise ValueError(
                "render_mode 'human' repeats an episode from its beginning, and cannot go back"
            )
        episodes = saved._episodes
        into = (
            [episode.world.world for episode in episodes]
            if indices is None
            else self._indices(indices)
        )
        if len(episodes) == 1:
            episodes = episodes * len(into)
        if len(episodes) != len(into):
            raise ValueError(
                f"{len(episodes)} episodes were saved: they go into as many environments, "
                f"not {len(into)}"
            )
        if len(set(into)) != len(into):
            raise ValueError("an environment is to be restored twice at once")
        self._restore_worlds(episodes, into)
        if not hasattr(self, "_generators"):  # one that was never reset
            self._generators = [np.random.default_rng() for _ in range(self.num_envs)]
        for i, episode in zip(into, episodes):
            self._scenes[i] = episode.scene
            self._generators[i] = copy.deepcopy(episode.generator)
            for name, rows in self._rows().items():
                rows[i] = episode.rows[name]
        return self._observe(), {}

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Seen from above: a picture of (256, 256, 3) for each environment; None where the console
        shows it.
        """
        if self.render_mode != "rgb_array":
            return None
        frames = self._engine.observe("overview.data")[:, 0]
        return tuple(frames.reshape(self.num_envs, PICTURE, PICTURE, 3).copy())

    def close_extras(self, **_: object) -> None:
        if self._console:
            self._console.close()
        self._engine.close()

    @property
    def scenes(self) -> list[Any]:
        """The scene of each environment's episode."""
        return list(self._scenes)

    def _rows(self) -> dict[str, NDArray[Any]]:
        """What this class and the task keep of the episodes; the engine's arrays are its own."""
        return {
            name: value
            for name, value in vars(self).items()
            if isinstance(value, np.ndarray)
            and value.flags.writeable
            and value.shape[:1] == (self.num_envs,)
        }

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if not isinstance(seed, (list, tuple, range, np.ndarray)) or np.ndim(seed) == 0:
            first = whole("seed", seed, 0, MOST_SEED - self.num_envs + 1)
            return [first + i for i in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"{len(seed)} seeds for {self.num_envs} environments")
        return [None if one is None else whole("seed", one, 0, MOST_SEED) for one in seed]

    def _masked(self, options: Info | None) -> NDArray[np.intp]:
        check_options(options)
        if not options:
            return np.arange(self.num_envs)
        if others := options.keys() - {"reset_mask"}:  # misspelt: all would be reset
            raise ValueError(f"options has {shown(others.pop())}; there is reset_mask")
        return self._of_mask("reset_mask", np.asarray(options["reset_mask"]))

    def _of_mask(self, what: str, mask: NDArray[Any]) -> NDArray[np.intp]:
        if mask.dtype != bool or mask.shape != (self.num_envs,):
            raise ValueError(
                f"{what} is True or False for each of {self.num_envs} environments, not {shown(mask)}"
            )
        return np.flatnonzero(mask)

    def _indices(self, indices: int | Sequence[int] | NDArray[Any] | None) -> list[int]:
        if indices is None:
            return list(range(self.num_envs))
        given = np.asarray(indices)
        if given.dtype == bool:
            given = self._of_mask("a mask", given)
        return [
            whole("an environment's index", i, 0, self.num_envs - 1) for i in np.atleast_1d(given)
        ]

    def _check_begun(self, indices: Iterable[int], call: str) -> None:
        if waiting := [i for i in indices if self._unbegun[i]]:
            which = "" if len(waiting) == self.num_envs else f" for environment {waiting[0]}"
            raise gymnasium.error.ResetNeeded(f"call reset(){which} before {call}")

    def _restore_worlds(self, episodes: list[_SavedEpisode], into: list[int]) -> None:
        """Of one world into many in one call: that takes all cores."""
        if len(into) > 1 and all(episode is episodes[0] for episode in episodes):
            self._engine.restore(episodes[0].world, into)
            return
        for i, episode in zip(into, episodes):
            self._engine.restore(episode.world, i)

    def _begin(self, indices: NDArray[np.intp]) -> None:
        seeds = []
        for i in indices:
            draw = self._generators[i].integers
            self._scenes[i] = self._scene(self._first + int(draw(TEST_ROOMS)))
            seeds.append(int(draw(2**31)))
        texts = [self._text(self._scenes[i]) for i in indices]
        self._engine.reset(indices, seed=seeds, text=texts)
        self._actions[indices] = 0
        self._over[indices] = False
        self._unbegun[indices] = False
        self._begun(indices)
        if self.render_mode == "human":
            self._show(texts[0], seeds[0])

    def _show(self, text: str, seed: int) -> None:
        from .console import Console

        if self._console is None:
            self._console = Console()
        self._console.begin(text, seed, self._options, self._engine.robots)

    def _text(self, scene: Scene) -> str:
        return scene.seen_from_above() if self.render_mode == "rgb_array" else scene.sdf

    def _headings(self, robot: int = 0) -> NDArray[np.float64]:
        w, x, y, z = self._turned[:, robot].T
        heading: NDArray[np.float64] = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        return heading


class TaskEnv(MadeAnew, gymnasium.Env):
    """One episode of a task at a time."""

    metadata: Info = {"render_modes": ["rgb_array", "human"], "render_fps": 10}
    task: type[TaskVectorEnv]

    def __init__(
        self, render_mode: Literal["rgb_array", "human"] | None = None, **options: Any
    ) -> None:
        if several := {"num_envs", "autoreset_mode"} & options.keys():
            raise TypeError(f"{min(several)} is for gymnasium.make_vec(): this is one environment")
        self._one = self.task(
            num_envs=1, autoreset_mode=AutoresetMode.DISABLED, render_mode=render_mode, **options
        )
        self.observation_space = self._one.single_observation_space
        self.action_space = self._one.single_action_space
        self.render_mode = render_mode

    def reset(
        self, *, seed: int | None = None, options: Info | None = None
    ) -> tuple[NDArray[Any], Info]:
        check_options(options)
        if seed is not None:
            seed = whole("seed", seed, 0, MOST_SEED)
        super().reset(seed=seed)
        observations, _ = self._one.reset(seed=seed)
        return observations[0], {}

    def step(self, action: NDArray[Any]) -> tuple[NDArray[Any], float, bool, bool, Info]:
        one = checked_actions(action, self.action_space)
        observations, rewards, terminated, truncated, info = self._one._act(one[None])
        return (
            observations[0],
            float(rewards[0]),
            bool(terminated[0]),
            bool(truncated[0]),
            {name: bool(values[0]) for name, values in info.items()},
        )

    def save(self) -> SavedEpisodes:
        """The episode as it stands: `TaskVectorEnv.save`."""
        return self._one.save()

    def restore(self, saved: SavedEpisodes) -> tuple[NDArray[Any], Info]:
        """Makes the episode what it was. Returns the observation."""
        observations, _ = self._one.restore(saved, 0)
        return observations[0], {}

    def render(self) -> NDArray[np.uint8] | None:
        frames = self._one.render()
        return None if frames is None else frames[0]

    @property
    def scene(self) -> Any:
        """The scene of this episode."""
        return self._one.scenes[0]

    def close(self) -> None:
        self._one.close()


SPEED_M_S = 0.5
TURN_RAD_S = 1.0
RANGE_M = 8.0


def drive_commands(actions: NDArray[Any]) -> NDArray[np.float64]:
    """Actions in [-1, 1]: the speed ahead, from 0 to 0.5 m/s, and the turn rate, 1 rad/s at 1."""
    commands = clipped(np.asarray(actions, np.float64).reshape(-1, 1, 2), -1.0, 1.0)
    commands[..., 0] += 1.0
    commands *= (0.5 * SPEED_M_S, TURN_RAD_S)
    return commands


def drive_rewards(
    progress: NDArray[np.float64], success: NDArray[np.bool_], collision: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Of a step towards a goal: progress in m, + 5 for success, - 5 for a collision, - 0.01."""
    rewards: NDArray[np.float64] = progress + 5.0 * success - 5.0 * collision - 0.01
    return rewards


def seen(ranges: NDArray[np.float32]) -> NDArray[np.float32]:
    """A scan as a network likes it: divided by 8 m and cut at 1; what is nearer than the device can
    measure is 0.
    """
    return clipped(ranges * np.float32(1.0 / RANGE_M), 0.0, 1.0)


def clipped(values: NDArray[Any], low: Any, high: Any) -> NDArray[Any]:
    """np.clip, in a third of its time with few values."""
    result: NDArray[Any] = np.minimum(np.maximum(values, low), high)
    return result


def checked_beams(beams: int) -> int:
    return whole("beams", beams, 2, 1024)


def checked_actions(actions: Any, space: spaces.Space[Any]) -> NDArray[np.float64]:
    """Finite numbers in the space's shape. Raises TypeError and ValueError."""
    given = array(f"actions are numbers of shape {space.shape}", actions)
    if given.shape != space.shape:
        raise ValueError(f"actions have the shape {space.shape}, not {given.shape}")
    if not np.isfinite(given).all():
        raise ValueError(f"actions are finite numbers, not {shown(actions)}")
    return given


def checked_mode(mode: Any) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError:
        allowed = ", ".join(repr(one.value) for one in AutoresetMode)
        raise ValueError(f"autoreset_mode is {shown(mode)}; allowed are {allowed}") from None


def check_options(options: Any) -> None:
    """Of a reset. Raises TypeError."""
    if not isinstance(options, (dict, type(None))):
        raise TypeError(f"options is a dict, not {shown(options)}")


DRIVE = spaces.Box(-1.0, 1.0, (2,), np.float32)
