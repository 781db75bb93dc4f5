"""ruedo.gym against Gymnasium's own checks, and against what a room's geometry says."""

import math

import gymnasium
import numpy as np
import pytest
import ruedo.gym
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from ruedo.rooms import TEST_ROOMS, make_room


def test_gymnasium_finds_nothing_wrong(recwarn):
    env = gymnasium.make("ruedo/Navigate-v0", beams=9)
    check_env(env.unwrapped, skip_render_check=True)
    env.close()
    assert [
        str(w.message)
        for w in recwarn
        if "ruedo" in str(w.filename) or "env" in str(w.message).lower()
    ] == []


def test_an_episode_repeats_from_its_seed():
    def episode(envs):
        seen = [envs.reset(seed=3)[0]]
        envs.action_space.seed(5)
        for _ in range(60):
            observations, rewards, *ends, _ = envs.step(envs.action_space.sample())
            seen += [observations, rewards, *ends]
        return seen

    runs = []
    for threads in (1, 2):
        envs = gymnasium.make_vec("ruedo/Navigate-v0", num_envs=4, beams=16, threads=threads)
        runs += [episode(envs), episode(envs)]
        envs.close()
    for other in runs[1:]:
        assert all(np.array_equal(a, b) for a, b in zip(runs[0], other))


def test_the_goal_is_where_the_room_says():
    env = ruedo.gym.NavigateEnv(beams=5, noise=False)
    observation, _ = env.reset(seed=11)
    (x, y, heading), goal = env.room.start, env.room.goal
    distance, bearing = math.dist((x, y), goal), math.atan2(goal[1] - y, goal[0] - x) - heading
    np.testing.assert_allclose(
        observation[5:],
        [min(distance / 8, 1), math.cos(bearing), math.sin(bearing), 0, 0],
        atol=1e-4,
    )
    nearer = 0.0
    for _ in range(40):  # turns towards the goal, and drives there
        bearing = math.atan2(observation[7], observation[6])
        observation, reward, terminated, _truncated, _info = env.step(
            np.array([-1.0 if abs(bearing) > 0.3 else 1.0, np.clip(2 * bearing, -1, 1)])
        )
        nearer += reward + 0.01
        if terminated:
            break
    end = distance - nearer if not terminated else None
    if end is not None:
        assert observation[5] == pytest.approx(min(end / 8, 1), abs=1e-4)
    env.close()


# A robot that drives straight on touches a wall or an obstacle sooner or later; the mode says what
# is seen then.
@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_modes_of_autoreset(mode):
    envs = ruedo.gym.NavigateVectorEnv(2, beams=8, autoreset_mode=mode)
    envs.reset(seed=1)
    ahead = np.tile(np.array([1.0, 0.0], np.float32), (2, 1))
    for _ in range(200):
        observations, rewards, terminated, truncated, info = envs.step(ahead)
        if terminated.any():
            break
    which = int(np.flatnonzero(terminated)[0])
    assert info["collision"][which] or info["success"][which]
    assert abs(rewards[which]) > 4.9
    if mode is AutoresetMode.SAME_STEP:
        assert (
            info["_final_obs"][which]
            and info["final_obs"][which].shape == observations[which].shape
        )
        assert (
            observations[which][-2] == 0.0
            and info["final_obs"][which][-2] != observations[which][-2]
        )
    elif mode is AutoresetMode.NEXT_STEP:
        room = envs.rooms[which].number
        observations, rewards, terminated, truncated, _ = envs.step(ahead)
        assert (
            envs.rooms[which].number != room
            and rewards[which] == 0.0
            and not terminated[which]
            and not truncated[which]
        )
        assert observations[which][-2] == 0.0
    else:
        room = envs.rooms[which].number
        mask = np.zeros(2, bool)
        mask[which] = True
        envs.reset(options={"reset_mask": mask})
        assert envs.rooms[which].number != room
    envs.close()


def test_rooms_are_the_same_everywhere_and_their_start_is_free():
    for number in range(200):
        room = make_room(number)
        assert room == make_room(number)
        assert math.dist(room.start[:2], room.goal) >= 4.0
    first = make_room(0)
    assert first.start != make_room(1).start
    envs = ruedo.gym.NavigateVectorEnv(1, split="test", beams=4)
    envs.reset(seed=0)
    assert envs.rooms[0].number >= TEST_ROOMS
    envs.close()


@pytest.mark.parametrize(
    "options, text",
    [
        ({"beams": 1}, "beams is 1; allowed are 2 to 1024"),
        ({"split": "all"}, "allowed are 'train' and 'test'"),
        ({"render_mode": "human"}, "draw nothing yet"),
    ],
)
def test_wrong_options_are_refused(options, text):
    with pytest.raises(ValueError, match=text):
        ruedo.gym.NavigateVectorEnv(2, **options)
