"""Tasks as environments of Gymnasium: episodes in the copies of one engine, the modes of autoreset,
pictures of the scene.
"""

from __future__ import annotations

import copy
import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ..arguments import check_known, finite, named, shown, texts, whole
from ..engine import MOST_WORLDS, Engine, Saved, SavedWorld
from ..errors import BadWorld
from ..rooms import TEST_ROOMS, Scene
from ..world import World
from .task import Outcome, Task, checked_actions

if TYPE_CHECKING:
    from typing_extensions import Self

    from .console import Console

PICTURE = 256  # pixels, the width and height of a rendered frame
MODES = (None, "rgb_array", "human")

MOST_SEED = 2**128 - 1  # that of numpy's SeedSequence

Info = dict[str, Any]
_INFO = ("success", "collision", "drawn", "final_obs", "final_info")  # besides what a task tells


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
    """A state that `TaskVectorEnv.save` returned; it does not change. ``len()``: how many
    episodes.
    """

    def __init__(self, episodes: list[_SavedEpisode]) -> None:
        self._episodes = episodes

    def __len__(self) -> int:
        return len(self._episodes)

    def __repr__(self) -> str:
        return f"<ruedo.gym.SavedEpisodes: {len(self)}>"


# Of `TaskVectorEnv`, for suggestions.
_OPTIONS = (
    *("num_envs", "split", "noise", "threads", "randomize", "settings", "disable"),
    *("max_episode_steps", "autoreset_mode", "render_mode"),
)


class MadeAnew:
    """Copied or pickled, an environment is made anew with the same arguments, as by Gymnasium's
    EzPickle; it needs a reset().
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
    """``num_envs`` episodes of a task, each in a scene of its own, in one engine on all cores.

        envs = TaskVectorEnv(MyTask, num_envs=64)

    task: a subclass of `Task`. Options that are not listed here go to its constructor. split: which
    scenes, "train" or "test"; no scene is in both. noise: False gives ideal sensors. threads: at
    most so many cores, 0 for all. randomize, settings and disable: as those of `ruedo.Engine`; what
    was drawn is in ``info["drawn"]`` when an episode begins. max_episode_steps: actions until an
    episode is truncated; None: the task's own number, -1: never.
    """

    metadata: Info = {
        "render_modes": ["rgb_array", "human"],
        "render_fps": 10,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        task: type[Task],
        num_envs: int = 1,
        *,
        split: Literal["train", "test"] = "train",
        noise: bool = True,
        threads: int = 0,
        randomize: Mapping[str, str] | None = None,
        settings: Mapping[str, object] | None = None,
        disable: Iterable[str] = (),
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: Literal["rgb_array", "human"] | None = None,
        **options: Any,
    ) -> None:
        if not isinstance(task, type) or not issubclass(task, Task):
            raise TypeError(f"task is a subclass of ruedo.gym.Task, not {shown(task)}")
        num_envs = whole("num_envs", num_envs, 1, MOST_WORLDS)
        if split not in ("train", "test"):
            raise ValueError(f"split is {shown(split)}; allowed are 'train' and 'test'")
        if render_mode not in MODES:
            raise ValueError(
                f"render_mode is {shown(render_mode)}; allowed are None, 'rgb_array' and 'human'"
            )
        if render_mode == "human" and num_envs != 1:
            raise ValueError("render_mode 'human' is for one environment: the console shows one")
        if "set" in options:
            warnings.warn("set is deprecated: it is settings", DeprecationWarning, stacklevel=2)
            settings = options.pop("set")
        inits = [vars(one)["__init__"] for one in task.__mro__[:-1] if "__init__" in vars(one)]
        check_known(task.__name__, options, inits, _OPTIONS)
        self.task = task(**options)
        limit = self.task.max_episode_steps if max_episode_steps is None else max_episode_steps
        self.max_episode_steps = whole("max_episode_steps", limit, -1)
        if limit == 0:
            raise ValueError("max_episode_steps is 0; allowed are 1 and more, and -1: never")
        self.task.max_episode_steps = limit
        self.num_envs = num_envs
        self.autoreset_mode = checked_mode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.render_mode = render_mode
        self._first = 0 if split == "train" else TEST_ROOMS
        self._options: Info = {
            "settings": _both("settings", self.task, settings, '{"robot/lrf.update_rate": 10}'),
            "disable": [*texts("disable", self.task.disable), *texts("disable", disable)],
            "noise": noise,
            "randomize": _both("randomize", self.task, randomize, '{"robot.x": "uniform(-2, 2)"}'),
        }
        self._begin_spaces()
        self._begin_engine(threads)
        self._console: Console | None = None
        self._background: ThreadPoolExecutor | None = None
        self._sent: Future[Any] | None = None
        self._actions = np.zeros(num_envs, int)
        self._over = np.ones(num_envs, bool)  # wait for a reset
        self._unbegun = np.ones(num_envs, bool)  # have waited since they were made
        self._is_set_up = False

    def _begin_spaces(self) -> None:
        observed = getattr(self.task, "observation_space", None)
        if not isinstance(observed, spaces.Space):
            raise TypeError(
                f"{type(self.task).__name__}.observation_space is a space of Gymnasium, not {shown(observed)}"
            )
        done = self.task.action_space
        if not isinstance(done, (spaces.Box, spaces.Discrete, spaces.MultiDiscrete)):
            raise TypeError(
                f"{type(self.task).__name__}.action_space is a Box, Discrete or MultiDiscrete, not {shown(done)}"
            )
        if type(self.task).commands is Task.commands and (
            not isinstance(done, spaces.Box) or done.shape != (2,)
        ):
            raise TypeError(
                f"{type(self.task).__name__} has no commands(), and its action_space is not that of two "
                f"numbers, a speed and a turn rate, but {done}"
            )
        self.single_observation_space = observed
        self.single_action_space = done
        self.observation_space = batch_space(observed, self.num_envs)
        self.action_space = batch_space(done, self.num_envs)

    def _begin_engine(self, threads: int) -> None:
        """And the scene that all environments have until their first episode."""
        self._file = self._world_file()
        self._fixed = type(self.task).scene is Task.scene and self.task.world is not None
        scene = self._scene(self._first)
        self._engine = Engine(
            self._file or type(self.task).__name__,
            text=self._text(scene),
            worlds=self.num_envs,
            threads=threads,
            allow_absolute=self._file is None,  # a text of this program, with files that it chose
            **self._options,
        )
        if self.render_mode == "human" and not self._engine.robots:
            raise ValueError("render_mode 'human' needs a robot with a drive; the scene has none")
        for finding in self._engine.findings:
            warnings.warn(f"{type(self.task).__name__}: {finding}", stacklevel=2)
        seconds = finite("action_seconds", self.task.action_seconds)
        self._steps = round(seconds / self._engine.step_size)
        if self._steps < 1 or abs(self._steps * self._engine.step_size - seconds) > 1e-9:
            raise ValueError(
                f"{type(self.task).__name__}.action_seconds is {shown(seconds)}: it must be a multiple "
                f"of the world's step, {self._engine.step_size:g} s"
            )
        self._scenes = [scene] * self.num_envs
        self.task.engine, self.task.num_envs = self._engine, self.num_envs
        self.task.scenes = self._scenes

    def _set_up(self) -> None:
        """Before the first episode, and no earlier: sensors are looked for, and a picture is drawn
        where one is a camera. Gymnasium makes an environment to look at its spaces before it forks,
        and after a picture none can be drawn in a fork.
        """
        if self._is_set_up:
            return
        self._generators = [np.random.default_rng() for _ in range(self.num_envs)]
        self.task.setup()
        self._is_set_up = True

    def _world_file(self) -> str | None:
        """The world's file of a task whose world is a file or a name."""
        world = self.task.world
        if world is None or isinstance(world, World):
            return None
        if not isinstance(world, (str, os.PathLike)):
            raise TypeError(
                f"{type(self.task).__name__}.world is a file, the name of a world or a World, not {shown(world)}"
            )
        with Engine(world, **self._options) as engine:
            return engine.files_read[0]

    def _scene(self, number: int) -> Scene:
        if self._fixed:
            text = Path(self._file).read_text(encoding="utf-8") if self._file else self.task.world
            return Scene(number, str(text))
        scene = self.task.scene(number)
        if isinstance(scene, Scene):
            return scene
        if not isinstance(scene, (str, World)):
            raise TypeError(
                f"{type(self.task).__name__}.scene() gives a World, a text or a Scene, not {shown(scene)}"
            )
        return Scene(number, str(scene))

    # ---- Gymnasium's interface.

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Info | None = None
    ) -> tuple[NDArray[Any], Info]:
        """Begins new episodes in all environments, or where ``options["reset_mask"]`` says.

        seed: environment i draws its scenes from ``seed + i``; or one for each; None continues the
        current draws.
        """
        self._refuse_sent("reset()")
        seeds = seeds_of(seed, self.num_envs)
        begin = self._masked(options)
        self._set_up()
        for i in begin:
            if seeds[i] is not None:
                self._generators[i] = np.random.default_rng(seeds[i])
        info: Info = {}
        self._begin(begin, info)
        return self._observe(), info | self._told()

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[NDArray[Any], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Info]:
        """Takes one action in every environment."""
        self._refuse_sent("step()")
        return self._act(checked_actions(actions, self.action_space))

    def send(self, actions: NDArray[Any]) -> None:
        """Begins a step in the background; `recv` has its result. Refuses wrong actions."""
        self._refuse_sent("send()")
        checked = checked_actions(actions, self.action_space)
        if self._background is None:
            self._background = ThreadPoolExecutor(1, f"{type(self.task).__name__} step")
        self._sent = self._background.submit(self._act, checked.copy())

    def recv(
        self,
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Info]:
        """Waits for the step that `send` has begun, and returns or raises what `step` would."""
        if self._sent is None:
            raise gymnasium.error.NoAsyncCallError("call send() before recv()", "recv")
        sent, self._sent = self._sent, None
        return sent.result()

    def _refuse_sent(self, call: str) -> None:
        if self._sent is not None:
            raise gymnasium.error.AlreadyPendingCallError(
                f"a step is under way: call recv() before {call}", "send"
            )

    def _act(
        self, actions: NDArray[np.float64]
    ) -> tuple[NDArray[Any], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Info]:
        if self.autoreset_mode is not AutoresetMode.NEXT_STEP:
            self._check_begun(range(self.num_envs), "the first step()")
        elif not self._is_set_up:
            raise gymnasium.error.ResetNeeded("call reset() before the first step()")
        info: Info = {}
        begun = None  # these show their beginning: their first action is the next one
        if self.autoreset_mode is AutoresetMode.NEXT_STEP and self._over.any():
            begun = self._over.copy()
            self._begin(np.flatnonzero(begun), info)
        acted = np.ones(self.num_envs, bool) if begun is None else ~begun
        commands = self._commands(actions, acted)
        if begun is not None and commands is not None:
            commands[begun] = np.nan
        self._engine.step(commands, self._steps, worlds=None if begun is None else ~begun)
        if self._console and commands is not None:
            self._console.step(commands[0], self._steps)
        self._actions += 1
        rewards, success, failure = self._outcome(begun)
        if begun is not None:
            self._actions[begun] = 0
        terminated = success | failure
        late = self._actions >= self.max_episode_steps
        truncated = late & ~terminated if self.max_episode_steps >= 0 else np.zeros_like(late)
        self._over = terminated | truncated
        info |= {"success": success, "_success": acted, "collision": failure, "_collision": acted}
        observations = self._observe()
        info |= self._told()
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._over.any():
            observations = self._begin_at_once(observations, info)
        return observations, rewards, terminated, truncated, info

    def _commands(
        self, actions: NDArray[Any], acting: NDArray[np.bool_]
    ) -> NDArray[np.float64] | None:
        self.task.acting = acting.copy()
        self.task.acting.setflags(write=False)  # of this call alone: no part of an episode
        given = self.task.commands(actions)
        if given is None:
            return None
        commands = np.array(given, np.float64)
        if commands.ndim != 3 or len(commands) != self.num_envs:
            raise ValueError(
                f"{type(self.task).__name__}.commands() gives the shape {commands.shape}, not "
                f"({self.num_envs}, driven robots, 2 or 3)"
            )
        return commands

    def _outcome(self, begun: NDArray[np.bool_] | None) -> Outcome:
        """Nothing where an episode has only begun."""
        given = self.task.outcome()
        if not isinstance(given, tuple) or len(given) != 3:
            raise ValueError(
                f"{type(self.task).__name__}.outcome() gives rewards, successes and failures, not {shown(given)}"
            )
        rewards, success, failure = given
        outcome = Outcome(
            np.array(rewards, np.float64), np.array(success, bool), np.array(failure, bool)
        )
        for name, values in zip(("rewards", "success", "failure"), outcome):
            if values.shape != (self.num_envs,):
                raise ValueError(
                    f"{type(self.task).__name__}.outcome() gives {name} of the shape {values.shape}, "
                    f"not {(self.num_envs,)}"
                )
        if begun is not None:
            for values in outcome:
                values[begun] = 0
        if not np.isfinite(outcome.rewards).all():
            i = int(np.flatnonzero(~np.isfinite(outcome.rewards))[0])
            raise ValueError(
                f"{type(self.task).__name__}.outcome() gives the reward {outcome.rewards[i]} in environment {i}"
            )
        return outcome

    def _told(self) -> Info:
        """The task's own part of the info, with Gymnasium's masks."""
        told: Info = {}
        for name, given in self.task.info().items():
            values = np.array(given)
            if values.shape != (self.num_envs,) or values.dtype.kind not in "biuf":
                raise ValueError(
                    f"{type(self.task).__name__}.info()[{name!r}] is {shown(given)}, not {self.num_envs} numbers"
                )
            if name in _INFO:
                raise ValueError(
                    f"{type(self.task).__name__}.info() has {name!r}, which `info` has"
                )
            told |= {name: values, f"_{name}": np.ones(self.num_envs, bool)}
        return told

    def _observe(self) -> Any:
        observed = self.task.observe()
        if not isinstance(self.observation_space, spaces.Dict):
            return self._checked_observation("", observed, self.observation_space)
        names = list(self.observation_space)
        if not isinstance(observed, Mapping) or set(observed) != set(names):
            given = list(observed) if isinstance(observed, Mapping) else shown(observed)
            raise ValueError(
                f"{type(self.task).__name__}.observe() gives a dict of {names}, not {given}"
            )
        return {
            name: self._checked_observation(f"[{name!r}]", observed[name], space)
            for name, space in self.observation_space.items()
        }

    def _checked_observation(self, which: str, observed: Any, space: spaces.Space[Any]) -> Any:
        values = np.asarray(observed)
        if values.shape != space.shape:
            raise ValueError(
                f"{type(self.task).__name__}.observe(){which} gives the shape {values.shape}; "
                f"observation_space asks for {space.shape}"
            )
        kind = values.dtype.kind
        if kind not in "biuf" or (
            kind == "f" and space.dtype is not None and space.dtype.kind != "f"
        ):
            raise ValueError(
                f"{type(self.task).__name__}.observe(){which} gives {values.dtype}; observation_space "
                f"asks for {space.dtype}"
            )
        if kind == "f" and np.isnan(values).any():
            i = int(np.argwhere(np.isnan(values))[0][0])
            raise ValueError(
                f"{type(self.task).__name__}.observe(){which} gives nan in environment {i}"
            )
        return aligned_copy(values, space.dtype)

    def _begin_at_once(self, observations: Any, info: Info) -> Any:
        info["final_obs"] = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(self._over).tolist():
            info["final_obs"][i] = row_of(observations, i)
        over = self._over.copy()
        info["final_info"] = {
            name: over if name.startswith("_") else values.copy()
            for name, values in info.items()
            if name != "final_obs"
        }
        info["_final_obs"] = info["_final_info"] = over
        self._begin(np.flatnonzero(self._over), info)
        observations = self._observe()
        info |= self._told()
        return observations

    def save(self, indices: int | Sequence[int] | NDArray[Any] | None = None) -> SavedEpisodes:
        """The episodes of these environments (an index, several, a mask, or None for all) as they
        stand, with all that decides what follows: the world, goals, how many actions there were,
        and the seeds of the episodes to come. It costs some 0.1 ms each, however long they have
        run.
        """
        self._refuse_sent("save()")
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
        self._refuse_sent("restore()")
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
        self._set_up()
        self._restore_worlds(episodes, into)
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
        self._refuse_sent("render()")
        if self.render_mode != "rgb_array":
            return None
        frames = self._engine.observe("overview.data")[:, 0]
        return tuple(frames.reshape(self.num_envs, PICTURE, PICTURE, 3).copy())

    def close_extras(self, **_: object) -> None:
        if self._background:
            self._background.shutdown()
        if self._console:
            self._console.close()
        self._engine.close()

    @property
    def scenes(self) -> list[Any]:
        """The scene of each environment's episode."""
        return list(self._scenes)

    def _rows(self) -> dict[str, NDArray[Any]]:
        """The per-episode arrays of this class and of the task; the engine's are its own."""
        return {
            f"{type(keeper).__name__}.{name}": value
            for keeper in (self, self.task)
            for name, value in vars(keeper).items()
            if isinstance(value, np.ndarray)
            and value.flags.writeable
            and value.shape[:1] == (self.num_envs,)
        }

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
        """Restores one world into many in one call if it can, which uses all cores."""
        if len(into) > 1 and all(episode is episodes[0] for episode in episodes):
            self._engine.restore(episodes[0].world, into)
            return
        for i, episode in zip(into, episodes):
            self._engine.restore(episode.world, i)

    def _begin(self, indices: NDArray[np.intp], info: Info) -> None:
        seeds = []
        for i in indices:
            draw = self._generators[i].integers
            number = self._first + int(draw(TEST_ROOMS))
            scene = self._scenes[i]
            self._scenes[i] = replace(scene, number=number) if self._fixed else self._scene(number)
            seeds.append(int(draw(2**31)))
        texts = [self._text(self._scenes[i]) for i in indices]
        try:
            self._engine.reset(indices, seed=seeds, text=None if self._fixed else texts)
        except BadWorld:
            self._name_refused_scene(indices, seeds, texts)
            raise
        self._actions[indices] = 0
        self._over[indices] = False
        self._unbegun[indices] = False
        self.task.begin(indices)
        self._tell_drawn(indices, info)
        if self.render_mode == "human":
            self._show(texts[0], seeds[0])

    def _name_refused_scene(
        self, indices: NDArray[np.intp], seeds: Sequence[int], texts: Sequence[str]
    ) -> None:
        """Raises BadWorld for the first of the scenes that the engine does not take."""
        for i, seed, text in zip(indices.tolist(), seeds, texts):
            try:
                self._engine.reset(i, seed=seed, text=None if self._fixed else text)
            except BadWorld as error:
                scene = f"{type(self.task).__name__}.scene({self._scenes[i].number})"
                raise BadWorld(f"{scene}: {error}") from None

    def _tell_drawn(self, indices: NDArray[np.intp], info: Info) -> None:
        """The values that randomize drew for the episodes that begin; NaN in the other rows."""
        if not self._options["randomize"]:
            return
        info["_drawn"] = np.zeros(self.num_envs, bool)
        info["_drawn"][indices] = True
        info["drawn"] = {}
        for i in indices:
            for target, value in self._engine.drawn(int(i)).items():
                values = info["drawn"].setdefault(target, np.full(self.num_envs, np.nan))
                values[i] = value

    def _show(self, text: str, seed: int) -> None:
        from .console import Console

        if self._console is None:
            self._console = Console()
        self._console.begin(self._file, text, seed, self._options, self._engine.robots)

    def _text(self, scene: Scene) -> str:
        return scene.seen_from_above() if self.render_mode == "rgb_array" else scene.sdf


def _both(what: str, task: Task, given: Mapping[str, Any] | None, example: str) -> Info:
    """The task's own, and what replaces it."""
    return {**named(what, getattr(task, what), example), **named(what, given, example)}


def aligned_copy(values: NDArray[Any], dtype: Any) -> NDArray[Any]:
    """Not a view of the engine's memory, which changes with the next action, and at an address from
    which JAX takes it without another copy (a multiple of 64 bytes).
    """
    size = values.size * np.dtype(dtype).itemsize
    memory = np.empty(size + 64, np.uint8)
    begin = -memory.ctypes.data % 64
    copied: NDArray[Any] = memory[begin : begin + size].view(dtype).reshape(values.shape)
    copied[...] = values
    return copied


def seeds_of(seed: int | Sequence[int | None] | None, num_envs: int) -> list[int | None]:
    """The seed of each environment."""
    if seed is None:
        return [None] * num_envs
    if not isinstance(seed, (list, tuple, range, np.ndarray)) or np.ndim(seed) == 0:
        first = whole("seed", seed, 0, MOST_SEED - num_envs + 1)
        return [first + i for i in range(num_envs)]
    if len(seed) != num_envs:
        raise ValueError(f"{len(seed)} seeds for {num_envs} environments")
    return [None if one is None else whole("seed", one, 0, MOST_SEED) for one in seed]


def row_of(values: Any, i: int) -> Any:
    """One environment's row of arrays with a row for each."""
    if isinstance(values, dict):
        return {name: row_of(value, i) for name, value in values.items()}
    return values[i]


class TaskEnv(MadeAnew, gymnasium.Env):
    """One episode of a task at a time: `TaskVectorEnv` for one environment. options: its options.

    When `gymnasium.make` has created it, Gymnasium's ``TimeLimit`` counts the actions, and
    ``max_episode_steps`` is `make`'s.
    """

    metadata: Info = {"render_modes": ["rgb_array", "human"], "render_fps": 10}

    def __init__(
        self,
        task: type[Task],
        render_mode: Literal["rgb_array", "human"] | None = None,
        **options: Any,
    ) -> None:
        if several := {"num_envs", "autoreset_mode"} & options.keys():
            raise TypeError(f"{min(several)} is for gymnasium.make_vec(): this is one environment")
        self._one = TaskVectorEnv(
            task, autoreset_mode=AutoresetMode.DISABLED, render_mode=render_mode, **options
        )
        self.observation_space = self._one.single_observation_space
        self.action_space = self._one.single_action_space
        self.render_mode = render_mode

    @property
    def task(self) -> Task:
        return self._one.task

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Any, Info]:
        check_options(options)
        if seed is not None:
            seed = whole("seed", seed, 0, MOST_SEED)
        super().reset(seed=seed)
        observations, info = self._one.reset(seed=seed)
        return row_of(observations, 0), _of_one(info)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, Info]:
        one = checked_actions(action, self.action_space)
        observations, rewards, terminated, truncated, info = self._one._act(one[None])
        late = bool(truncated[0]) and self.spec is None  # else TimeLimit counts
        return row_of(observations, 0), float(rewards[0]), bool(terminated[0]), late, _of_one(info)

    def save(self) -> SavedEpisodes:
        """The episode as it stands: `TaskVectorEnv.save`. Gymnasium's ``TimeLimit`` is not part of
        it.
        """
        return self._one.save()

    def restore(self, saved: SavedEpisodes) -> tuple[Any, Info]:
        """Restores the episode. Returns the observation."""
        observations, _ = self._one.restore(saved, 0)
        return row_of(observations, 0), {}

    def render(self) -> NDArray[np.uint8] | None:
        frames = self._one.render()
        return None if frames is None else frames[0]

    @property
    def scene(self) -> Any:
        """The scene of this episode."""
        return self._one.scenes[0]

    def close(self) -> None:
        self._one.close()


def _of_one(info: Info) -> Info:
    """The info of the only environment, without Gymnasium's masks."""
    return {
        name: _of_one(values) if isinstance(values, dict) else values[0].item()
        for name, values in without_masks(info).items()
    }


def without_masks(info: Info) -> Info:
    """The info of a vector environment, without Gymnasium's masks."""
    return {name: values for name, values in info.items() if not name.startswith("_")}


def checked_mode(mode: Any) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError:
        allowed = ", ".join(repr(one.value) for one in AutoresetMode)
        raise ValueError(f"autoreset_mode is {shown(mode)}; allowed are {allowed}") from None


def check_options(options: Any) -> None:
    """Checks the options of a reset. Raises TypeError."""
    if not isinstance(options, (dict, type(None))):
        raise TypeError(f"options is a dict, not {shown(options)}")
