"""Tasks of one's own, the options of the shipped ones, and worlds that a program builds, in the
engine.
"""

import math
import random
import re
import struct
import zlib

import gymnasium
import numpy as np
import pytest
import ruedo
import ruedo.gym
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env
from ruedo.rooms import Room


def png(file, colour, pixels=4):
    """A picture of one colour, written without a library."""

    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    head = struct.pack(">IIBBBBB", pixels, pixels, 8, 2, 0, 0, 0)
    rows = (b"\0" + bytes(colour) * pixels) * pixels
    file.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b"")
    )
    return file


def seen_ahead(world, **options):
    """The middle of the picture that the robot sees."""
    camera = {"width": 16, "height": 16}
    settings = {f"p3at/camera.camera.image.{name}": size for name, size in camera.items()}
    settings["p3at/camera.encoding"] = "rgb"
    with ruedo.Engine(world, settings=settings, noise=False, **options) as engine:
        picture = engine.observe("camera.data")[0, 0].reshape(16, 16, 3)
        return picture[6:10, 6:10].reshape(-1, 3).astype(int).mean(axis=0)


@pytest.mark.parametrize("channel", range(3))
def test_shapes_of_a_built_world_have_their_colour(tmp_path, channel):
    """A box ahead of the camera, painted, and covered with a picture of that colour."""
    colour = [0.0, 0.0, 0.0]
    colour[channel] = 1.0
    others = [i for i in range(3) if i != channel]
    picture = png(tmp_path / "a & b.png", [round(255 * part) for part in colour])
    for paint in ({"colour": tuple(colour)}, {"texture": picture}):
        for world in (
            ruedo.World().box(2, 0, size=(0.2, 3, 3), **paint),
            ruedo.World().wall(2, -3, 2, 3, height=3, **paint),
            ruedo.World().cylinder(2.5, 0, radius=1, height=3, **paint),
        ):
            seen = seen_ahead(world.robot("p3at"))
            assert seen[channel] > 60 and (seen[others] < 30).all(), (paint, seen)


@pytest.mark.parametrize(
    "paint, error, text",
    [
        ({"colour": (1, 0)}, ValueError, "colour is (1, 0): it must be red, green and blue"),
        ({"colour": (1, 0, 2)}, ValueError, "its parts must be from 0 to 1"),
        ({"colour": "red"}, ValueError, "colour is 'red'"),
        ({"colour": (1, 0, math.nan)}, ValueError, "colour is nan"),
        ({"texture": "no/such.png"}, ValueError, "texture 'no/such.png': there is no such file"),
        ({"texture": 5}, TypeError, "texture is"),
        ({"texture": ""}, ValueError, "texture is an empty text"),
    ],
)
def test_paints_that_are_wrong_are_refused(paint, error, text):
    for build in (ruedo.World().box, ruedo.World().cylinder):
        with pytest.raises(error) as caught:
            build(1, 1, **paint)
        assert text in str(caught.value)


def test_the_engine_runs_a_built_world():
    """As launch() does: the wall's face is 2.95 m from the robot, whose scanner is 0.18 m ahead; a
    reset takes another world, with its wall 1 m nearer.
    """

    def built(distance):
        return ruedo.World().wall(distance, -5, distance, 5).robot("p3at")

    with ruedo.Engine(built(3.0), worlds=2, noise=False) as engine:
        assert engine.robots == ("p3at",)
        ranges = engine.observe("lrf.ranges")
        first = ranges[:, 0, 90].copy()
        assert first[0] == first[1] and 2.5 < first[0] < 2.95
        engine.reset(1, text=built(2.0))
        np.testing.assert_allclose(ranges[:, 0, 90], first - [0.0, 1.0], atol=1e-4)
        engine.reset(text=[built(2.0), str(built(3.0))])
        np.testing.assert_allclose(ranges[:, 0, 90], first - [1.0, 0.0], atol=1e-4)
        same = ruedo.Engine("world", text=str(built(2.0)), worlds=2, noise=False)
        assert same.state_hash() == engine.state_hash()
    with pytest.raises(TypeError, match="either a World or a text"):
        ruedo.Engine(built(1.0), text="<sdf/>")


def test_a_server_shows_the_texture_of_a_built_world(tmp_path):
    """Regression: an absolute path was refused."""
    picture = png(tmp_path / "a.png", (255, 0, 0))
    world = ruedo.World().box(2, 0, size=(0.2, 3, 3), texture=picture).robot("p3at")
    with ruedo.launch(world, lockstep=1, settings={"p3at/camera.encoding": "rgb"}) as sim:
        seen = sim.step(20).latest(sim.robot("p3at").camera).array()
        assert seen[100:110, 150:160, 0].min() > 60 and seen[100:110, 150:160, 1].max() < 30


def test_joints_are_observed():
    """Behind their names, which are texts."""
    from ruedo.rooms import make_arm_place

    with ruedo.Engine("arm", text=make_arm_place(1).sdf, worlds=2) as engine:
        positions = engine.observe("joints.joint_position")
        assert positions.shape == (2, 1, 2) and positions.dtype == np.float32
        order = ruedo.lcmtypes.joint_command_t()
        order.n, order.name, order.value = 2, ["shoulder", "elbow"], [0.0, 0.5]
        order.mode = bytes([order.VELOCITY] * 2)
        engine.command(1, "arm/joint_command", order)
        engine.step(n=200)
        np.testing.assert_allclose(positions[:, 0], [[0, 0], [0, 0.5]], atol=5e-3)
        np.testing.assert_allclose(engine["joints.joint_velocity"][1, 0, 1], 0.5, atol=1e-2)


def test_depth_is_observed_below_its_camera():
    """A wall 2 m ahead of the robot's centre fills the picture; depths are along the camera's
    axis, and so are the same everywhere.
    """
    settings = {"p3at/camera.camera.image.width": 8, "p3at/camera.camera.image.height": 8}
    world = ruedo.World().wall(2.05, -9, 2.05, 9, height=9).robot("p3at")
    with ruedo.Engine(world, settings={**settings, "p3at/camera.depth": "true"}) as engine:
        depth = engine.observe("camera/depth.data")[0, 0].view(np.float32).reshape(8, 8)
        assert 1.5 < depth[0, 0] < 2.0
        np.testing.assert_allclose(depth[:4], depth[0, 0], atol=1e-3)
        with pytest.raises(ValueError, match="no robot has a device 'camera/dept'"):
            engine.observe("camera/dept.data")


# ---- A task of one's own. The robot stands at a random distance from a wall, and is to stop a
# metre from it.


DISTANCE = spaces.Box(0.0, 20.0, (1,), np.float32)


class Approach(ruedo.gym.Task):
    observation_space = DISTANCE
    action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
    max_episode_steps = 60
    disable = ("robot/camera", "robot/sonar_front", "robot/sonar_rear")

    def __init__(self, farthest=4.0):
        self.farthest = farthest

    def scene(self, number):
        self.made = getattr(self, "made", 0) + 1
        x = -1.5 - (self.farthest - 1.5) * random.Random(number).random()
        return ruedo.World().wall(0.05, -3, 0.05, 3).robot("p3at", x, name="robot")

    def setup(self):
        self.x = self.position("robot")[:, 0]
        self.best = np.zeros(self.num_envs)

    def begin(self, episodes):
        self.best[episodes] = -self.x[episodes]

    def commands(self, actions):
        return np.stack([0.5 * actions[:, 0], np.zeros(self.num_envs)], axis=1)[:, None]

    def outcome(self):
        progress = self.best + self.x
        self.best = -self.x
        return progress, -self.x < 1.0, self.touching()

    def observe(self):
        return -self.x[:, None]


def test_a_task_of_ones_own_passes_gymnasiums_check():
    ruedo.gym.register("mine/Approach-v0", Approach)
    assert gymnasium.spec("mine/Approach-v0").max_episode_steps == 60
    env = gymnasium.make("mine/Approach-v0", farthest=3.0)
    check_env(env.unwrapped, skip_render_check=True)
    env.close()
    del gymnasium.registry["mine/Approach-v0"]


def test_a_custom_task_defines_its_outcome():
    """Rewards are the way that was made; the end comes 1 m before the wall."""
    envs = ruedo.gym.TaskVectorEnv(Approach, 3, autoreset_mode="Disabled", noise=False)
    observations, info = envs.reset(seed=4)
    assert info == {} and observations.dtype == np.float32
    assert ((observations > 1.5) & (observations < 4.0)).all() and len(set(observations.flat)) == 3
    begin, total = observations[:, 0].copy(), np.zeros(3)
    over = np.zeros(3, bool)
    for _ in range(60):
        before = observations.copy()
        observations, rewards, terminated, _, info = envs.step(np.ones((3, 1)))
        assert (observations[~over] < before[~over]).all()  # not a view, which would have changed
        total += np.where(over, 0.0, rewards)
        over |= terminated
        np.testing.assert_array_equal(info["success"], observations[:, 0] < 1.0)
    np.testing.assert_allclose(total[over], begin[over] - 1.0, atol=0.06)
    assert over.any()
    envs.close()


class Telling(Approach):
    """Draws the robot's mass, and tells how far it is from the wall."""

    randomize = {"robot.mass": "uniform(0.5, 2)"}

    def info(self):
        return {"distance": -self.x}


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_a_task_draws_and_tells_values_of_its_own(mode):
    envs = ruedo.gym.TaskVectorEnv(Telling, 3, autoreset_mode=mode, max_episode_steps=4)
    assert envs.task.max_episode_steps == 4
    observations, info = envs.reset(seed=1)
    assert len(set(info["drawn"]["robot.mass"])) == 3
    for _ in range(4):
        np.testing.assert_array_equal(np.float32(info["distance"]), observations[:, 0])
        assert info["_distance"].all()
        observations, _, _, truncated, info = envs.step(np.ones((3, 1)))
    assert truncated.all()
    if mode == "SameStep":
        ends = [one[0] for one in info["final_obs"]]
        np.testing.assert_array_equal(np.float32(info["final_info"]["distance"]), ends)
        assert (info["distance"] != info["final_info"]["distance"]).all()
    envs.close()
    env = ruedo.gym.TaskEnv(Telling, randomize={"robot.mass": "choice(3)"})
    _, info = env.reset(seed=1)
    assert info["drawn"] == {"robot.mass": 3.0} and isinstance(info["distance"], float)
    env.close()


def test_episodes_of_a_custom_task_are_saved_with_its_state():
    envs = ruedo.gym.TaskVectorEnv(Approach, 2)
    envs.reset(seed=1)
    envs.step(np.ones((2, 1)))
    saved = envs.save()
    first = [envs.step(np.ones((2, 1)))[1] for _ in range(5)]
    envs.restore(saved)
    again = [envs.step(np.ones((2, 1)))[1] for _ in range(5)]
    assert np.array_equal(first, again)
    envs.close()


def test_the_state_of_a_task_may_change_between_episodes():
    """A curriculum."""
    envs = ruedo.gym.TaskVectorEnv(Approach, 64, farthest=1.6, autoreset_mode="Disabled")
    near, _ = envs.reset(seed=1)
    envs.task.farthest = 6.0
    far, _ = envs.reset(seed=1)
    assert near.max() < 1.61 and far.max() > 5.0
    envs.close()


class InFile(ruedo.gym.Task):
    observation_space = spaces.Box(-50.0, 50.0, (2,), np.float64)
    max_episode_steps = -1
    world = "arena"

    def outcome(self):
        nothing = np.zeros(self.num_envs)
        return nothing, nothing > 0, nothing > 0

    def observe(self):
        return self.position("p3at")[:, :2]


WORLD = """<sdf version='1.9'><world name='w'><include><uri>model://sun</uri></include>
<include><uri>model://ground_plane</uri></include>
<include><uri>mine</uri><pose>1 2 0 0 0 0</pose></include></world></sdf>"""
MODEL = """<sdf version='1.9'><include><uri>model://p3at</uri><name>p3at</name></include></sdf>"""


@pytest.mark.parametrize("render_mode", [None, "rgb_array"])
def test_a_tasks_world_is_a_file_a_name_or_built(tmp_path, render_mode):
    """What a file names lies beside it. Episodes differ by what is drawn."""
    (tmp_path / "w.sdf").write_text(WORLD.replace("<uri>mine</uri>", "<uri>model://p3at</uri>"))
    built = ruedo.World().robot("p3at", 3, 4)
    for world, where in (
        ("arena", None),
        (tmp_path / "w.sdf", [1, 2]),
        (str(tmp_path / "w.sdf"), [1, 2]),
        (built, [3, 4]),
    ):
        task = type("There", (InFile,), {"world": world})
        envs = ruedo.gym.TaskVectorEnv(task, 2, render_mode=render_mode)
        observations, _ = envs.reset(seed=2)
        assert where is None or np.allclose(observations, where, atol=1e-6)
        assert render_mode is None or np.ptp(envs.render()[1]) > 0
        envs.close()
        envs = ruedo.gym.TaskVectorEnv(task, 2, randomize={"p3at.x": "uniform(-0.3, 0.3)"})
        observations, info = envs.reset(seed=2)
        assert np.allclose(info["drawn"]["p3at.x"], observations[:, 0], atol=1e-6)
        assert observations[0, 0] != observations[1, 0]
        envs.close()


def test_a_task_without_end_is_never_truncated():
    envs = ruedo.gym.TaskVectorEnv(InFile, 1)
    envs.reset()
    for _ in range(30):
        assert not envs.step(np.zeros((1, 2)))[3].any()
    envs.close()


def robots(count):
    world = ruedo.World()
    for i in range(count):
        world.robot("p3at", 2.0 * i, name=f"robot_{i + 1}" if i else "robot")
    return world


WRONG = {
    "no space": ({"observation_space": 3}, TypeError, "observation_space is a space"),
    "no world": ({"scene": ruedo.gym.Task.scene}, NotImplementedError, "neither a world nor"),
    "no scene": ({"scene": lambda self, number: 3}, TypeError, "a World, a text or a Scene, not 3"),
    "time": ({"action_seconds": 0.0075}, ValueError, "must be a multiple of the world's step"),
    "never": ({"action_seconds": 0.0}, ValueError, "must be a multiple of the world's step"),
    "observation": ({"observe": lambda self: np.zeros(3)}, ValueError, r"shape \(3,\); .*\(2, 1\)"),
    "commands": ({"commands": lambda self, a: a}, ValueError, r"commands\(\) gives the shape"),
    "rewards": (
        {"outcome": lambda self: (0.0, np.zeros(2), np.zeros(2))},
        ValueError,
        r"outcome\(\) gives rewards of the shape \(\), not \(2,\)",
    ),
    "robot": (
        {"setup": lambda self: self.position("nobody")},
        ValueError,
        r"Wrong: 'nobody' has no 'pose'; \['robot'\] have",
    ),
    "pair": (
        {"outcome": lambda self: (np.zeros(2), np.zeros(2))},
        ValueError,
        r"Wrong\.outcome\(\) gives rewards, successes and failures, not",
    ),
    "no reward": (
        {"outcome": lambda self: (np.array([0.0, np.nan]), np.zeros(2), np.zeros(2))},
        ValueError,
        r"outcome\(\) gives the reward nan in environment 1",
    ),
    "nothing seen": (
        {"observe": lambda self: np.array([[np.nan], [1.0]])},
        ValueError,
        r"observe\(\) gives nan in environment 0",
    ),
    "text seen": (
        {"observe": lambda self: np.array([["a"], ["b"]])},
        ValueError,
        r"observe\(\) gives <U1; observation_space asks for float32",
    ),
    "half a colour": (
        {"observation_space": spaces.Box(0, 255, (1,), np.uint8)},
        ValueError,
        r"observe\(\) gives float64; observation_space asks for uint8",
    ),
    "one of two terms": (
        {
            "observation_space": spaces.Dict({"a": DISTANCE, "b": DISTANCE}),
            "observe": lambda self: {"a": -self.x[:, None]},
        },
        ValueError,
        r"gives a dict of \['a', 'b'\], not \['a'\]",
    ),
    "told": ({"info": lambda self: {"x": 3.0}}, ValueError, r"info\(\)\['x'\] is 3.0, not 2 num"),
    "told twice": (
        {"info": lambda self: {"success": self.x}},
        ValueError,
        r"info\(\) has 'success', which `info` has",
    ),
    "no commands": ({"commands": ruedo.gym.Task.commands}, TypeError, r"has no commands\(\), and"),
    "horizon": ({"max_episode_steps": 0}, ValueError, "is 0; allowed are 1 and more, and -1"),
    "seconds": ({"action_seconds": "0.1"}, TypeError, "action_seconds"),
    "disable": ({"disable": "robot/camera"}, TypeError, "disable is a list of texts"),
    "draws": ({"randomize": "robot.x"}, TypeError, "randomize is a dict"),
    "scene": (
        {"scene": lambda self, number: robots(1 if number == 0 else 2)},
        ruedo.BadWorld,
        r"Wrong\.scene\([1-9]\d+\): \S*Wrong: it has 'robot_2/\w+', unlike",
    ),
    "file of a scene": (
        {"scene": lambda self, number: robots(1).robot("nobody") if number else robots(1)},
        ruedo.BadWorld,
        r"Wrong\.scene\([1-9]\d+\): .*nobody",
    ),
    "actions": ({"action_space": spaces.Text(3)}, TypeError, "is a Box, Discrete or MultiDiscrete"),
}


@pytest.mark.parametrize("what", WRONG)
def test_an_error_in_a_task_is_reported(what):
    attributes, error, text = WRONG[what]
    with pytest.raises(error, match=text):
        envs = ruedo.gym.TaskVectorEnv(type("Wrong", (Approach,), attributes), 2)
        envs.reset(seed=1)
        envs.step(np.zeros((2, 1)))


def test_unsupported_elements_of_a_world_are_warnings():
    sensor = '<sensor name="touch" type="bumper"/>'
    odd = f'<model name="odd"><static>1</static><link name="l">{sensor}</link></model>'

    class Odd(Approach):
        def scene(self, number):
            return super().scene(number).sdf(odd)

    with pytest.warns(UserWarning, match="Odd: .*bumper"):
        ruedo.gym.TaskVectorEnv(Odd).close()


def test_names_of_robots_are_theirs_alone():
    world = ruedo.World().robot("p3at", name="robot")
    with pytest.raises(ValueError, match="name is 'robot', which another model has"):
        world.robot("p3at", 2.0, name="robot")
    world.robot("p3at", 2.0).robot("p3at", 4.0)
    with ruedo.Engine(world) as engine:
        assert engine.robots == ("robot", "p3at", "p3at_2")


def test_the_error_about_a_missing_robot_names_its_missing_model():
    world = ruedo.World().robot("p3", name="robot")
    with pytest.raises(ruedo.BadWorld, match=r"there is no robot 'robot'.*\bp3\b"):
        ruedo.Engine(world, disable=["robot/camera"])


def test_sdf_is_not_the_name_of_a_world():
    with pytest.raises(ValueError, match=r"SDF itself is Engine\(text="):
        ruedo.Engine(str(ruedo.World()))


def test_a_class_that_is_not_a_task_is_refused():
    for wrong in (3, int, Approach(), None):
        with pytest.raises(TypeError, match=r"task is a subclass of ruedo\.gym\.Task"):
            ruedo.gym.TaskVectorEnv(wrong)
        with pytest.raises(TypeError, match=r"task is a subclass of ruedo\.gym\.Task"):
            ruedo.gym.register("mine/Wrong-v0", wrong)
    with pytest.raises(
        TypeError, match=r"Approach\(\) has no option fartest: did you mean farthest"
    ):
        ruedo.gym.TaskVectorEnv(Approach, fartest=3)


class Goal(ruedo.gym.GoalTask):
    """In an empty place: straight on is the goal."""

    def scene(self, number):
        world = ruedo.World().robot(self.robot, name="robot").wall(9, -1, 9, 1)
        return Room(number, str(world), (0.0, 0.0, 0.0), (3.0, 0.0))


def test_a_goal_task_needs_a_scene_alone():
    env = ruedo.gym.TaskEnv(Goal, robot="turtle", beams=4, noise=False)
    observation, _ = env.reset()
    np.testing.assert_allclose(observation[4:], [3 / 8, 1, 0, 0, 0], atol=1e-3)
    terminated, total, steps = False, 0.0, 0
    while not terminated:
        _, reward, terminated, _, info = env.step([1.0, 0.0])
        total, steps = total + reward, steps + 1
    assert info["success"] and total == pytest.approx(3.0 - 0.4 + 5.0 - 0.01 * steps, abs=0.06)
    env.close()


# ---- Options of the shipped tasks.


@pytest.mark.parametrize("task", ["Navigate", "Corridor", "Crowd", "Push", "Camera", "Hills"])
@pytest.mark.parametrize(
    "options",
    [
        {"robot": "turtle", "sensors": ["lrf"], "beams": 7},
        {"robot": "p3dx", "sensors": ["sonar", "odometry"]},
        {"sensors": ["camera", "depth", "lrf", "odometry"], "pixels": 16, "observations": "dict"},
        {"sensors": ["odometry"], "actions": "discrete", "rewards": {"success": 1.0}},
    ],
    ids=["turtle", "sonar", "dict", "discrete"],
)
def test_gymnasium_finds_nothing_wrong_with_options(task, options):
    env = gymnasium.make(f"ruedo/{task}-v0", **options)
    check_env(env.unwrapped, skip_render_check=True)
    env.close()


def test_terms_of_a_dict_are_those_of_the_array():
    array, terms = (
        ruedo.gym.NavigateVectorEnv(2, beams=6, observations=kind) for kind in ("array", "dict")
    )
    flat, named = array.reset(seed=3)[0], terms.reset(seed=3)[0]
    for _ in range(5):
        assert list(named) == ["goal", "ranges", "velocity"]  # as Gymnasium sorts them
        row = np.concatenate([named[name] for name in ("ranges", "goal", "velocity")], axis=1)
        assert np.array_equal(row, flat) and terms.observation_space.contains(named)
        act = np.array([[1.0, 0.2], [0.3, -1.0]])
        flat, named = array.step(act)[0], terms.step(act)[0]
    array.close(), terms.close()


def test_dict_observations_end_in_final_obs():
    envs = ruedo.gym.NavigateVectorEnv(
        2, beams=4, observations="dict", max_episode_steps=3, autoreset_mode="SameStep"
    )
    envs.reset(seed=1)
    for _ in range(3):
        observations, _, _, truncated, info = envs.step(np.ones((2, 2)))
    assert truncated.all() and info["_final_obs"].all()
    for i, final in enumerate(info["final_obs"]):
        assert final["velocity"][0] > 0.0 and observations["velocity"][i, 0] == 0.0
    envs.close()


def test_pictures_and_depth_show_what_is_ahead():
    """Depth of the pixel ahead is the range of the beam ahead, less what the camera is further
    behind or ahead; both in units of 8 m.
    """
    env = ruedo.gym.NavigateEnv(
        sensors=["lrf", "camera", "depth"], beams=181, pixels=32, observations="dict", noise=False
    )
    for seed in range(3):
        seen, _ = env.reset(seed=seed)
        assert seen["camera"].dtype == np.uint8 and np.ptp(seen["camera"]) > 0
        if seen["ranges"][80:101].max() - seen["ranges"][80:101].min() < 0.01:  # a wall or box
            assert abs(seen["depth"][15, 16, 0] - seen["ranges"][90]) < 0.3 / 8
            break
    else:
        pytest.fail("no scene has something flat ahead")
    env.close()


def test_discrete_actions_are_rows_of_choices():
    discrete = ruedo.gym.NavigateVectorEnv(5, beams=4, actions="discrete")
    continuous = ruedo.gym.NavigateVectorEnv(5, beams=4)
    assert discrete.single_action_space == spaces.Discrete(5)
    discrete.reset(seed=1), continuous.reset(seed=1)
    for _ in range(3):
        one = discrete.step(np.arange(5))
        other = continuous.step([[1, 0], [0, 1], [0, -1], [-1, 1], [-1, -1]])
        assert all(np.array_equal(a, b) for a, b in zip(one[:4], other[:4]))
    for wrong in ([0, 1, 2, 3, 5], [0.5] * 5, [-1] * 5):
        with pytest.raises(ValueError, match="actions are choices of"):
            discrete.step(wrong)
    discrete.close(), continuous.close()


def test_weights_of_rewards():
    """Of the same actions: the weighted sums of what the episode is known to do."""
    plain = ruedo.gym.NavigateVectorEnv(3, beams=4, noise=False, autoreset_mode="Disabled")
    weighted = ruedo.gym.NavigateVectorEnv(
        3,
        beams=4,
        noise=False,
        rewards={"progress": 3.0, "step": -0.5, "failure": -70.0},
        autoreset_mode="Disabled",
    )
    plain.reset(seed=2), weighted.reset(seed=2)
    ends = 0
    for _ in range(120):
        _, one, *_, info = plain.step(np.ones((3, 2)) * [1.0, 0.0])
        _, other, *_ = weighted.step(np.ones((3, 2)) * [1.0, 0.0])
        progress = one + 0.01 - 5.0 * info["success"] + 5.0 * info["collision"]
        ends += info["collision"].sum()
        expected = 3.0 * progress - 0.5 + 5.0 * info["success"] - 70.0 * info["collision"]
        np.testing.assert_allclose(other, expected, atol=1e-9)
    assert ends > 0
    plain.close(), weighted.close()


# Seconds of the table in docs/environments.md, of 0.1 s each.
SECONDS = {
    "Navigate": 40, "Corridor": 80, "Crowd": 60, "Push": 60, "Camera": 40, "Hills": 60, "Reach": 10,
}  # fmt: skip


@pytest.mark.parametrize("task", SECONDS)
def test_max_episode_steps_is_the_specs_and_may_be_given(task):
    name = f"ruedo/{task}-v0"
    assert gymnasium.spec(name).max_episode_steps == 10 * SECONDS[task]
    envs = gymnasium.make_vec(name, num_envs=2, max_episode_steps=3)
    one = gymnasium.make(name, max_episode_steps=3)
    envs.reset(seed=1), one.reset(seed=1)
    still = np.array([-1.0, 0.0], np.float32)
    many = [envs.step(np.stack([still] * 2))[3].tolist() for _ in range(3)]
    assert many == [[False] * 2, [False] * 2, [True] * 2]
    assert [one.step(still)[3] for _ in range(3)] == [False, False, True]
    envs.close(), one.close()


def test_max_episode_steps_may_be_longer_than_the_tasks_own():
    still = np.array([-1.0, 0.0], np.float32)
    for limit, late in ((405, 405), (-1, None)):
        env = gymnasium.make("ruedo/Navigate-v0", beams=2, max_episode_steps=limit)
        envs = gymnasium.make_vec("ruedo/Navigate-v0", num_envs=1, beams=2, max_episode_steps=limit)
        env.reset(seed=1), envs.reset(seed=1)
        one = [env.step(still)[3] for _ in range(405)]
        many = [envs.step(still[None])[3][0] for _ in range(405)]
        assert one == many and [i + 1 for i, x in enumerate(one) if x] == ([late] if late else [])
        env.close(), envs.close()


def test_final_info_has_gymnasiums_masks():
    """As Gymnasium's own vector environments have them."""
    envs = ruedo.gym.NavigateVectorEnv(
        3, beams=4, max_episode_steps=50, autoreset_mode="SameStep", noise=False
    )
    sync = gymnasium.vector.SyncVectorEnv(
        [lambda: gymnasium.make("ruedo/Navigate-v0", beams=4, noise=False, max_episode_steps=50)]
        * 3,
        autoreset_mode="SameStep",
    )
    envs.reset(seed=[1, 2, 3]), sync.reset(seed=[1, 2, 3])
    ends = 0
    for _ in range(60):
        act = np.tile(np.float32([1.0, 0.0]), (3, 1))
        info, other = envs.step(act)[4], sync.step(act)[4]
        assert info.keys() == other.keys()
        if "final_info" not in other:
            continue
        ends += 1
        over = other["_final_info"]
        assert np.array_equal(info["_final_info"], over)
        assert info["final_info"].keys() == other["final_info"].keys()
        for name, values in other["final_info"].items():
            assert np.array_equal(info["final_info"][name][over], values[over])
    assert ends >= 1
    envs.close(), sync.close()


def test_drawn_values_are_in_the_info():
    draws = {
        "robot.mass": "uniform(0.8, 1.2)",
        "robot/lrf.lidar.noise.stddev": "choice(0.01, 0.03)",
    }
    envs = ruedo.gym.NavigateVectorEnv(3, beams=4, randomize=draws, max_episode_steps=2)
    _, info = envs.reset(seed=1)
    first = {name: info["drawn"][name] for name in draws}
    assert info["_drawn"].all() and len(set(first["robot.mass"])) == 3
    assert ((first["robot.mass"] >= 0.8) & (first["robot.mass"] <= 1.2)).all()
    assert set(first["robot/lrf.lidar.noise.stddev"]) <= {0.01, 0.03}
    for i in range(3):
        assert envs._engine.drawn(i) == {name: values[i] for name, values in first.items()}
    infos = [envs.step(np.zeros((3, 2)))[4] for _ in range(3)]
    assert ["drawn" in one for one in infos] == [False, False, True]
    assert (
        infos[2]["_drawn"].all() and (infos[2]["drawn"]["robot.mass"] != first["robot.mass"]).all()
    )
    envs.reset(seed=5, options={"reset_mask": np.array([False, True, False])})
    envs.close()
    env = ruedo.gym.NavigateEnv(beams=4, randomize=draws)
    assert env.reset(seed=1)[1]["drawn"] == {name: values[0] for name, values in first.items()}
    env.close()


def test_settings_and_devices_of_ones_own():
    envs = ruedo.gym.NavigateVectorEnv(
        1, beams=4, settings={"robot/lrf.lidar.range.max": 1.5}, sensors=["lrf", "sonar"]
    )
    ranges = np.concatenate([envs.reset()[0][0, :4] for _ in range(10)])
    assert ((ranges <= 1.6 / 8) | (ranges == 1.0)).all() and (ranges < 1.0).any()
    envs.close()
    with pytest.raises(ValueError, match="no field of numbers|no robot has a device"):
        ruedo.gym.NavigateVectorEnv(1, disable=["robot/lrf"]).reset()


def test_a_curriculum_changes_the_task():
    envs = ruedo.gym.NavigateVectorEnv(4, beams=4, obstacles=0, autoreset_mode="Disabled")
    for obstacles in (0, 5, 20):
        envs.task.obstacles = obstacles
        envs.reset()
        assert all(scene.sdf.count("name='obstacle") == obstacles for scene in envs.scenes)
    envs.close()


def test_hills_and_people_are_as_many_as_the_option_says():
    for task, option, counts in (
        (ruedo.gym.HillsVectorEnv, "hills", (0, 3, 20)),
        (ruedo.gym.CrowdVectorEnv, "people", (0, 4)),
    ):
        for count in counts:
            envs = task(1, beams=4, **{option: count})
            envs.reset(seed=1)
            sdf = envs.scenes[0].sdf
            found = sdf.count("<model name='hill") if option == "hills" else people_of(sdf)
            assert found == count, (option, sdf)
            envs.close()


def people_of(sdf):
    return sum(int(count) for count in re.findall(r"<ruedo:count>(\d+)</ruedo:count>", sdf))


def test_sonar_and_depth_have_the_scale_of_the_scan():
    """A wall 2.05 m ahead of the robot: what each measures, divided by 8 m."""

    class Facing(ruedo.gym.DriveTask):
        def scene(self, number):
            world = ruedo.World().robot(self.robot, name="robot").wall(2.05, -3, 2.05, 3, height=3)
            return Room(number, str(world), (0.0, 0.0, 0.0), (1.0, 0.0))

        def outcome(self):
            nothing = np.zeros(self.num_envs)
            return nothing, nothing > 0, nothing > 0

    env = ruedo.gym.TaskEnv(
        Facing, sensors=["lrf", "sonar", "depth"], beams=3, pixels=8, observations="dict",
        noise=False,
    )  # fmt: skip
    env.reset(seed=1)
    for _ in range(5):  # of 0.1 s: each sonar has measured
        seen = env.step([-1.0, 0.0])[0]
    engine = env.task.engine
    metres = engine.observe("lrf.ranges")[0, 0]
    np.testing.assert_allclose(seen["ranges"], np.minimum(metres / 8, 1.0), rtol=1e-6)
    assert seen["ranges"][1] == pytest.approx(metres[1] / 8) and 1.5 < metres[1] < 2.0
    assert seen["sonar"].min() == pytest.approx(1.7 / 8, abs=0.3 / 8)
    assert seen["sonar"].max() == pytest.approx(5 / 8)  # their range
    assert seen["depth"].shape == (8, 8, 1)
    assert seen["depth"][3, 4, 0] == pytest.approx(seen["ranges"][1], abs=0.3 / 8)
    env.close()


@pytest.mark.parametrize(
    "options, error, text",
    [
        ({"sensors": ["radar"]}, ValueError, "sensors has 'radar'; there are lrf, sonar, odometry"),
        ({"sensors": "lrf"}, TypeError, "sensors is a list of texts, not one"),
        ({"robot": "p3dx", "sensors": ["camera"]}, ValueError, "p3dx has no such sensor"),
        ({"robot": "nobody"}, ValueError, "nobody"),
        ({"robot": 5}, TypeError, "robot is"),
        ({"sensors": ["camera"]}, ValueError, "observations='dict' gives each by its name"),
        ({"pixels": 4}, ValueError, "pixels is 4; allowed are 8 to 1024"),
        ({"observations": "list"}, ValueError, "observations is 'list'; allowed are 'array'"),
        ({"actions": 5}, ValueError, "actions is 5; allowed are 'continuous' and 'discrete'"),
        ({"rewards": {"speed": 1}}, ValueError, "rewards has 'speed'; there are progress, success"),
        ({"rewards": {"step": "x"}}, (TypeError, ValueError), r"rewards\['step'\]"),
        ({"rewards": [1]}, TypeError, "rewards is a dict"),
        ({"max_episode_steps": 1.5}, TypeError, "max_episode_steps is a whole number, not 1.5"),
        ({"max_episode_steps": -2}, ValueError, "max_episode_steps is -2"),
        ({"settings": 3}, TypeError, "settings is a dict"),
        ({"beems": 3}, TypeError, r"Navigate\(\) has no option beems: did you mean beams\?"),
        ({"setings": {}}, TypeError, r"has no option setings: did you mean settings\?"),
    ],
)
def test_wrong_options_of_tasks_are_refused(options, error, text):
    with pytest.raises(error, match=text):
        ruedo.gym.NavigateVectorEnv(2, **options)
