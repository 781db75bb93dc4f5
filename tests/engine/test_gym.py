"""ruedo.gym against Gymnasium's and PettingZoo's own checks, and against what a scene's geometry
says.
"""

import copy
import math
import os
import pickle
import subprocess
import sys
import urllib.request
import xml.etree.ElementTree as ET

import gymnasium
import numpy as np
import pytest
import ruedo.gym
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from pettingzoo.test import parallel_api_test
from ruedo.rooms import (
    TEST_ROOMS,
    make_corridor,
    make_crowd_hall,
    make_fleet_room,
    make_landmark_room,
    make_push_room,
    make_room,
)

TASKS = ["Navigate", "Corridor", "Crowd", "Push", "Camera", "Hills", "Reach"]


@pytest.mark.parametrize("task", TASKS)
def test_gymnasium_finds_nothing_wrong(task, recwarn):
    env = gymnasium.make(f"ruedo/{task}-v0")
    check_env(env.unwrapped, skip_render_check=True)
    env.close()
    assert [
        str(w.message)
        for w in recwarn
        if "ruedo" in str(w.filename) or "env" in str(w.message).lower()
    ] == []


@pytest.mark.parametrize("task", TASKS)
def test_an_episode_repeats_from_its_seed(task):
    def episode(envs):
        seen = [envs.reset(seed=3)[0]]
        envs.action_space.seed(5)
        for _ in range(15):
            observations, rewards, *ends, _ = envs.step(envs.action_space.sample())
            seen += [observations, rewards, *ends]
        return seen

    runs = []
    for threads in (1, 2):
        envs = gymnasium.make_vec(f"ruedo/{task}-v0", num_envs=3, threads=threads)
        runs += [episode(envs), episode(envs)]
        envs.close()
    for other in runs[1:]:
        assert all(np.array_equal(a, b) for a, b in zip(runs[0], other))


def followed(envs, actions):
    """What these actions lead to: arrays with a row for each environment."""
    told = []
    for action in actions:
        observations, rewards, terminated, truncated, info = envs.step(action)
        told += [observations, rewards, terminated, truncated, info["success"], info["collision"]]
        told.append(np.array([scene.number for scene in envs.scenes]))
    return told


def same(one, other):
    return len(one) == len(other) and all(np.array_equal(a, b) for a, b in zip(one, other))


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("task", TASKS)
def test_a_restored_episode_continues_equally(task, mode):
    """Through the ends of episodes, in their own environments and in others."""
    envs = gymnasium.make_vec(
        f"ruedo/{task}-v0", num_envs=3, autoreset_mode=AutoresetMode(mode)
    ).unwrapped
    envs.max_episode_steps = 25
    envs.reset(seed=3)
    envs.action_space.seed(5)
    actions = [envs.action_space.sample() for _ in range(40)]
    for action in actions[:12]:
        envs.step(action)
    saved = envs.save()
    assert len(saved) == 3 and repr(saved) == "<ruedo.gym.SavedEpisodes: 3>"
    shown = envs._observe()
    one = envs.save(1)
    after = followed(envs, actions)
    envs.reset(seed=9)
    observations, info = envs.restore(saved)
    assert np.array_equal(observations, shown) and info == {}
    assert same(followed(envs, actions), after)
    envs.restore(saved, [2, 0, 1])
    turned = followed(envs, [action[[1, 2, 0]] for action in actions])
    assert same(turned, [rows[[1, 2, 0]] for rows in after])
    envs.restore(one, range(3))
    alike = followed(envs, [action[[1, 1, 1]] for action in actions])
    assert same(alike, [rows[[1, 1, 1]] for rows in after])
    envs.close()


def test_saved_episodes_go_where_they_belong():
    envs = ruedo.gym.NavigateVectorEnv(num_envs=2, beams=5)
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        envs.save()
    envs.reset(seed=1)
    saved = envs.save()
    with pytest.raises(TypeError, match=r"restore\(\) takes what save\(\) gave, not 3"):
        envs.restore(3)
    with pytest.raises(ValueError, match="2 episodes were saved: they go into as many"):
        envs.restore(saved, [0])
    with pytest.raises(ValueError, match="twice at once"):
        envs.restore(saved, [0, 0])
    with pytest.raises(ValueError, match="an environment's index is 2; allowed are 0 to 1"):
        envs.save(2)
    other = ruedo.gym.NavigateVectorEnv(num_envs=2, beams=5)
    with pytest.raises(ValueError, match="another engine saved that world"):
        other.restore(saved)
    envs.close(), other.close()
    env = gymnasium.make("ruedo/Push-v0").unwrapped
    env.reset(seed=4)
    actions = np.random.default_rng(1).uniform(-1, 1, (30, 2))
    episode = env.save()
    first = [env.step(action)[0] for action in actions]
    env.restore(episode)
    assert same([env.step(action)[0] for action in actions], first)
    env.close()


def test_seeds_and_masks_of_many():
    envs = ruedo.gym.NavigateVectorEnv(3, beams=5, autoreset_mode="Disabled")
    alone = ruedo.gym.NavigateEnv(beams=5)

    def rooms():
        return [scene.number for scene in envs.scenes]

    envs.reset(seed=5)
    counted = rooms()
    alone.reset(seed=np.int64(5))
    assert alone.scene.number == counted[0]
    for seeds in ([5, 6, 7], (5, 6, 7), np.array([5, 6, 7]), np.int64(5)):
        envs.reset(seed=seeds)
        assert rooms() == counted
    envs.reset()
    later = rooms()
    assert not set(later) & set(counted)
    envs.reset(seed=[5, None, None])  # the others go on with the draws that they have
    assert rooms()[0] == counted[0] and not set(rooms()[1:]) & {*counted, *later}
    envs.reset(seed=5)
    envs.reset(seed=50, options={"reset_mask": np.array([False, True, False])})
    assert [rooms()[0], rooms()[2]] == [counted[0], counted[2]] and rooms()[1] != counted[1]
    envs.reset()
    assert [rooms()[0], rooms()[2]] == [later[0], later[2]] and rooms()[1] != later[1]
    envs.close(), alone.close()


@pytest.mark.parametrize(
    "wrong, text",
    [
        ({"seed": -1}, "seed is -1; allowed are 0 to"),
        ({"seed": 1.5}, "seed is a whole number, not 1.5"),
        ({"seed": "5"}, "seed is a whole number, not '5'"),
        ({"seed": [1]}, "1 seeds for 2 environments"),
        ({"seed": [1, "a"]}, "seed is a whole number, not 'a'"),
        ({"options": {"reset_mask": [True]}}, "True or False for each of 2 environments"),
        ({"options": {"reset_mask": [1, 0]}}, "True or False for each of 2 environments"),
        ({"options": {"reset_mask": None}}, "True or False for each of 2 environments"),
        ({"options": {"reset_maks": [True, False]}}, "'reset_maks'; there is reset_mask"),
        ({"options": 1}, "options is a dict, not 1"),
        ({"seed": b"ab"}, "seed is a whole number, not b'ab'"),
    ],
)
def test_a_reset_that_is_refused_changes_nothing(wrong, text):
    envs = ruedo.gym.NavigateVectorEnv(2, beams=5)
    envs.reset(seed=3)
    saved, ahead = envs.save(), [np.ones((2, 2))] * 150
    after = followed(envs, ahead)
    envs.restore(saved)
    with pytest.raises((ValueError, TypeError), match=text):
        envs.reset(**wrong)
    assert same(followed(envs, ahead), after)
    envs.close()


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))]
)
@pytest.mark.parametrize(
    "make",
    [
        lambda: gymnasium.make("ruedo/Navigate-v0", beams=7),
        lambda: gymnasium.make_vec("ruedo/Crowd-v0", num_envs=2, beams=7, people=3),
        lambda: ruedo.gym.FleetEnv(2, beams=7),
    ],
)
def test_a_copied_environment_is_one_of_its_own(make, copied):
    """Made with the same arguments, as by Gymnasium's EzPickle; a wrapper's shallow copy is of the
    wrapper alone.
    """
    env = make()
    first = env.reset(seed=2)[0]
    other = copied(env.unwrapped)
    if isinstance(env, gymnasium.Env):
        assert other.spec == env.unwrapped.spec
    env.close()
    again = other.reset(seed=2)[0]
    assert repr(again) == repr(first)
    other.close()


def test_saved_episodes_cannot_be_pickled():
    env = ruedo.gym.NavigateEnv(beams=5)
    env.reset(seed=1)
    saved = env.save()
    assert copy.deepcopy({"node": saved})["node"] is saved and copy.copy(saved) is saved
    with pytest.raises(TypeError, match="SavedEpisodes: 1> cannot be pickled"):
        pickle.dumps(saved)
    env.close()


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
        observation, reward, terminated, *_ = env.step(
            np.array([-1.0 if abs(bearing) > 0.3 else 1.0, np.clip(2 * bearing, -1, 1)])
        )
        nearer += reward + 0.01
        if terminated:
            break
    if not terminated:
        assert observation[5] == pytest.approx(min((distance - nearer) / 8, 1), abs=1e-4)
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
    room = envs.scenes[which].number
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
        observations, rewards, terminated, truncated, _ = envs.step(ahead)
        assert (
            envs.scenes[which].number != room
            and rewards[which] == 0.0
            and not terminated[which]
            and not truncated[which]
        )
        assert observations[which][-2] == 0.0
    else:
        mask = np.zeros(2, bool)
        mask[which] = True
        envs.reset(options={"reset_mask": mask})
        assert envs.scenes[which].number != room
    envs.close()


def test_rooms_are_the_same_everywhere_and_their_start_is_free():
    for number in range(200):
        room = make_room(number)
        assert room == make_room(number)
        assert math.dist(room.start[:2], room.goal) >= 4.0
        corridor = make_corridor(number)
        assert (
            corridor == make_corridor(number)
            and 12.0
            <= sum(math.dist(a, b) for a, b in zip(corridor.middle, corridor.middle[1:]))
            <= 18.0
        )
        push = make_push_room(number)
        assert 0.8 <= math.dist(push.box[:2], push.goal) <= 1.6
        assert math.dist(push.box[:2], push.start[:2]) >= 1.0
        assert (
            math.dist(make_landmark_room(number).start[:2], make_landmark_room(number).goal) > 1.5
        )
        _, goals = make_fleet_room(number, 5)
        assert len(set(goals)) == 5
    assert make_room(0).start != make_room(1).start


@pytest.mark.parametrize("task", TASKS)
def test_test_rooms_are_disjoint_from_training_rooms(task):
    for split, numbers in (
        ("train", range(TEST_ROOMS)),
        ("test", range(TEST_ROOMS, 2 * TEST_ROOMS)),
    ):
        envs = gymnasium.make_vec(f"ruedo/{task}-v0", num_envs=2, split=split)
        envs.reset(seed=0)
        assert all(scene.number in numbers for scene in envs.unwrapped.scenes)
        envs.close()


# The walls of a piece are half the corridor's width from its middle: the wall's face is 0.05 m
# nearer.
def test_a_corridor_is_as_wide_as_it_says():
    for number in range(20):
        corridor = make_corridor(number)
        (ax, ay), (bx, by) = corridor.middle[2:4]
        heading = math.atan2(by - ay, bx - ax)
        for side in (1, -1):
            wall = ET.fromstring(corridor.sdf).find(f".//model[@name='wall{side}_3']")
            x, y, _, _, _, turned = (float(v) for v in wall.findtext("pose").split())
            across = -(x - ax) * math.sin(heading) + (y - ay) * math.cos(heading)
            assert across == pytest.approx(side * corridor.width / 2, abs=2e-3)
            assert turned == pytest.approx(heading, abs=2e-3)


# Following the middle: the way is its length, and the rewards are the way, less 0.01 each step, and
# 5 at the end.
def test_a_corridor_leads_to_its_end():
    env = ruedo.gym.CorridorEnv(noise=False, beams=8)
    env.reset(seed=4)
    middle = np.array(env.scene.middle)
    length = np.linalg.norm(np.diff(middle, axis=0), axis=1).sum()
    core, total, steps, target = env._one, 0.0, 0, 1
    terminated = truncated = False
    while not terminated and not truncated:
        x, y = core.task.position("robot")[0, :2]
        if target < len(middle) - 1 and math.dist((x, y), middle[target]) < 0.5:
            target += 1
        bearing = math.remainder(
            math.atan2(middle[target][1] - y, middle[target][0] - x)
            - core.task.heading("robot")[0],
            math.tau,
        )
        _, reward, terminated, truncated, info = env.step(
            np.array([1.0 if abs(bearing) < 0.3 else -0.8, np.clip(3 * bearing, -1, 1)])
        )
        total += reward
        steps += 1
    assert info["success"] and not info["collision"]
    assert total == pytest.approx(length - 0.5 + 5.0 - 0.01 * steps, abs=0.15)
    env.close()


# In front of a robot that stands still people pass; without them nothing changes, without noise.
def test_a_hall_has_the_requested_number_of_people():
    for people in (0, 1, 7, 50):
        sdf = ET.fromstring(make_crowd_hall(3, people=people).sdf)
        counts = [int(one.text) for one in sdf.iter("{urn:ruedo}count")]
        assert sum(counts) == people
    for people, changes in ((0, False), (8, True)):
        env = ruedo.gym.CrowdEnv(people=people, noise=False, beams=181)
        first, _ = env.reset(seed=5)
        scans = [env.step(np.array([-1.0, 0.0]))[0][:181] for _ in range(50)]
        changed = max(np.abs(scan - first[:181]).max() for scan in scans)
        assert changed > 0.1 if changes else changed < 1e-6
        env.close()


# A robot that waits for people in its way comes through; rewards are the metres nearer, less
# 0.01 each step, and 5 at the goal.
def test_a_robot_that_waits_comes_through_a_crowd():
    env = ruedo.gym.CrowdEnv(beams=61, people=4, split="test")
    came = 0
    for seed in range(4):
        observation, _ = env.reset(seed=seed)
        first = math.dist(env.scene.start[:2], env.scene.goal)
        total, steps, over = 0.0, 0, False
        while not over:
            ranges, (_, cosine, sine) = observation[:61], observation[61:64]
            bearing = math.atan2(sine, cosine)
            clear = 8 * ranges[15:46].min() > 0.7 and abs(bearing) < 0.4
            action = np.array([1.0 if clear else -1.0, np.clip(2 * bearing, -1, 1)])
            observation, reward, terminated, truncated, info = env.step(action)
            total, steps, over = total + reward, steps + 1, terminated or truncated
        if not info["success"]:
            continue
        came += 1
        place = env.task.position("robot")[0, :2]
        nearer = first - math.dist(place, env.scene.goal)
        assert total == pytest.approx(nearer + 5.0 - 0.01 * steps, abs=2e-3)
    assert came >= 2
    env.close()


def test_wrong_numbers_of_people_are_refused():
    with pytest.raises(ValueError, match="people is 51; allowed are 0 to 50"):
        ruedo.gym.CrowdVectorEnv(1, people=51)
    with pytest.raises(TypeError, match="no option obstacles"):
        ruedo.gym.CrowdVectorEnv(1, obstacles=3)


# Rates by the arm's Jacobian (v = J q'), of the links' lengths: the tip goes straight to the
# target. Rewards are the way that it came nearer.
def test_an_arm_reaches_its_target():
    env = ruedo.gym.ReachEnv()
    for seed in range(5):
        observation, _ = env.reset(seed=seed)
        np.testing.assert_allclose(observation[:6], [1, 1, 0, 0, 0, 0], atol=1e-5)
        (x, y), total, steps = env.scene.target, 0.0, 0
        np.testing.assert_allclose(observation[6:], [x - 0.9, y], atol=1e-5)
        over = False
        while not over:
            cosines, sines, way = observation[:2], observation[2:4], observation[6:]
            shoulder, elbow = np.arctan2(sines, cosines)
            a, b = shoulder, shoulder + elbow
            jacobian = np.array(
                [
                    [-0.5 * math.sin(a) - 0.4 * math.sin(b), -0.4 * math.sin(b)],
                    [0.5 * math.cos(a) + 0.4 * math.cos(b), 0.4 * math.cos(b)],
                ]
            )
            damped = jacobian.T @ np.linalg.inv(jacobian @ jacobian.T + 0.01 * np.eye(2))
            rates = damped @ way * 3.0
            if abs(elbow) < 0.2:
                rates[1] -= 1.0 if y > 0 else -1.0  # out of the stretched pose
            observation, reward, terminated, truncated, info = env.step(np.clip(rates / 2, -1, 1))
            total, steps, over = total + reward, steps + 1, terminated or truncated
        assert info["success"] and np.hypot(*observation[6:]) < 0.03
        nearer = math.dist((0.9, 0.0), (x, y)) - np.hypot(*observation[6:])
        assert total == pytest.approx(nearer + 5.0 - 0.01 * steps, abs=1e-4)
    env.close()


# Straight to the goal, over hills: the robot rises by what geometry says of where it is, and leans
# towards the hill's foot.
def test_a_robot_drives_over_hills():
    env = ruedo.gym.HillsEnv(beams=5, noise=False, hills=6, split="test")
    came = 0
    highest = steepest = 0.0
    for seed in range(6):
        observation, _ = env.reset(seed=seed)
        hills = []
        for model in ET.fromstring(env.scene.sdf).iter("model"):
            if model.get("name").startswith("hill"):
                x, y, z = (float(v) for v in model.findtext("pose").split()[:3])
                hills.append((x, y, z, float(model.findtext(".//radius"))))
        over = False
        while not over:
            bearing = math.atan2(observation[7], observation[6])
            action = np.array([1.0 if abs(bearing) < 0.5 else -1.0, np.clip(2 * bearing, -1, 1)])
            observation, _, terminated, truncated, info = env.step(action)
            over = terminated or truncated
            px, py, pz = env.task.position("robot")[0]
            tops = [
                z + math.sqrt(max(r * r - (px - x) ** 2 - (py - y) ** 2, 0.0))
                for x, y, z, r in hills
            ]
            assert pz == pytest.approx(max(0.0, *tops), abs=0.12)  # wheels stand around it
            highest, steepest = max(highest, pz), max(steepest, np.hypot(*observation[8:10]))
        came += info["success"]
    assert came >= 3 and highest > 0.1 and 0.05 < steepest < math.sin(0.7)
    env.close()


# The robot drives to behind the box, as seen from the place, and pushes.
def test_a_box_can_be_pushed_to_its_place():
    env = ruedo.gym.PushEnv()
    for seed in range(3):
        env.reset(seed=seed)
        core, goal = env._one, np.array(env.scene.goal)
        done = info = False
        while not done:
            robot, box = core.task.position("robot")[0, :2], core.task.position("box")[0, :2]
            way = (goal - box) / np.linalg.norm(goal - box)
            side = np.array([-way[1], way[0]])
            behind, beside = (robot - box) @ way, (robot - box) @ side
            if behind < -0.3 and abs(beside) < 0.12:
                target = box + 0.3 * way  # push
            elif behind < -0.55:
                target = box - 0.75 * way
            else:  # round the box
                target = box - 1.0 * way + (0.9 if beside > 0 else -0.9) * side
                if behind > 0.2:
                    target = box + (1.0 if beside > 0 else -1.0) * side
            ahead = target - robot
            bearing = math.remainder(
                math.atan2(ahead[1], ahead[0]) - core.task.heading("robot")[0], math.tau
            )
            speed = 0.6 if abs(bearing) < 0.3 else 0.0
            _, _, terminated, truncated, info = env.step(
                np.array([speed, np.clip(2.5 * bearing, -1, 1)])
            )
            done = terminated or truncated
        if info["success"]:
            break
    assert info["success"]
    env.close()


def test_a_camera_sees_the_red_pillar_ahead():
    env = ruedo.gym.CameraEnv()
    picture, _ = env.reset(seed=2)
    assert picture.shape == (64, 64, 3)

    def red(picture):
        return (picture[..., 0] > 90) & (picture[..., 1] < 60) & (picture[..., 2] < 60)

    for _ in range(120):  # turns until it is ahead
        if red(picture)[:, 27:37].sum() > 10:
            break
        picture, *_ = env.step(np.array([-1.0, 0.7]))
    assert red(picture).any()
    core = env._one
    ahead = core.task.goals[0] - core.task.position("robot")[0, :2]
    bearing = math.remainder(
        math.atan2(ahead[1], ahead[0]) - core.task.heading("robot")[0], math.tau
    )
    assert abs(bearing) < 0.2
    env.close()


# From above, x goes up in the picture and y to the left; the robot is red, the room's floor grey.
def test_a_frame_shows_the_scene_from_above():
    envs = gymnasium.make_vec("ruedo/Push-v0", num_envs=2, render_mode="rgb_array")
    envs.reset(seed=5)
    frames = envs.render()
    assert len(frames) == 2 and frames[0].shape == (256, 256, 3) and frames[0].dtype == np.uint8
    for frame, scene in zip([frame.astype(int) for frame in frames], envs.unwrapped.scenes):
        green = (frame[..., 1] > frame[..., 0] + 40) & (frame[..., 1] > frame[..., 2] + 40)
        rows, columns = np.nonzero(green)
        metres = 8.6 * 2 * math.tan(0.475) / 256  # a pixel, on the floor
        assert (127.5 - rows.mean()) * metres == pytest.approx(scene.goal[0], abs=0.15)
        assert (127.5 - columns.mean()) * metres == pytest.approx(scene.goal[1], abs=0.15)
    envs.close()


# The console shows a server's run, which continues with the same state.
@pytest.mark.parametrize("task", ["Crowd", "Navigate"])
def test_the_console_shows_the_same_episode(task, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    env = gymnasium.make(f"ruedo/{task}-v0", render_mode="human", beams=8)
    for seed in (3, 4):  # at one address
        env.reset(seed=seed)
        for _ in range(20):
            env.step(np.array([-0.5, 0.4], np.float32))
        core = env.unwrapped._one
        core._engine.step(n=1)
        shown = core._console._simulation.step(1)
        assert shown.step == 401 and shown.state_hash % 2**64 == core._engine.state_hash(0)
    assert len(opened) == 1
    with urllib.request.urlopen(opened[0], timeout=60) as page:
        assert page.status == 200
    env.close()


def test_pettingzoo_finds_nothing_wrong():
    env = ruedo.gym.FleetEnv(3, beams=6)
    parallel_api_test(env, num_cycles=40)
    env.close()


def fleet_followed(env, actions):
    """What these actions lead to, through the ends of robots and of the episode, into the next."""
    told = []
    for action in actions:
        if not env.agents:
            told.append(env.reset())
        told.append(env.step({name: action[i] for i, name in enumerate(env.possible_agents)}))
        told.append((list(env.agents), list(env._goals), env._engine.state_hash()))
        told.append(None if env.render_mode is None else env.render().tobytes())
    with np.printoptions(threshold=10**6, floatmode="unique"):
        return repr(told)


@pytest.mark.parametrize("render_mode", [None, "rgb_array"])
def test_a_restored_fleet_continues_equally(render_mode):
    env = ruedo.gym.FleetEnv(4, beams=6, render_mode=render_mode)
    env.most_actions = 120
    env.reset(seed=3)
    actions = np.random.default_rng(5).uniform([0, -0.4], [1, 0.4], (160, 4, 2))
    for action in actions:
        env.step({name: action[i] for i, name in enumerate(env.possible_agents)})
        if len(env.agents) < 4:  # one has run into something
            break
    assert 0 < len(env.agents) < 4
    saved, agents, shown = env.save(), list(env.agents), env._observations()
    assert repr(saved) == f"<ruedo.gym.SavedFleet: at {env._engine.time():g} s>"
    after = fleet_followed(env, actions)
    for seed in (9, None):
        env.reset(seed=seed)
        observations, infos = env.restore(saved)
        assert env.agents == agents == list(observations) and infos == {one: {} for one in agents}
        for i, name in enumerate(env.possible_agents):
            assert name not in agents or np.array_equal(observations[name], shown[i])
        assert fleet_followed(env, actions) == after
    env.close()


def test_a_saved_fleet_goes_where_it_belongs():
    env, other = (ruedo.gym.FleetEnv(2, beams=5) for _ in range(2))
    for call in (env.save, lambda: env.step({})):
        with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
            call()
    env.reset(seed=1), other.reset(seed=1)
    with pytest.raises(TypeError, match=r"restore\(\) takes what save\(\) gave, not 3"):
        env.restore(3)
    with pytest.raises(ValueError, match="another engine saved that world"):
        other.restore(env.save())
    assert other.agents == ["robot0", "robot1"]
    env.close(), other.close()


def test_a_fleet_sees_its_goals():
    env = ruedo.gym.FleetEnv(2, beams=5, noise=False)
    observations, _ = env.reset(seed=1)
    again, _ = env.reset(seed=1)
    for name in env.agents:
        assert (observations[name] == again[name]).all()
    place, goal = env._places[1, :2], env._goals[1]
    assert observations["robot1"][5] == pytest.approx(math.dist(place, goal) / 8, abs=1e-6)
    env.close()


@pytest.mark.parametrize(
    "options, text",
    [
        ({"beams": 1}, "beams is 1; allowed are 2 to 1024"),
        ({"split": "all"}, "allowed are 'train' and 'test'"),
        ({"render_mode": "ansi"}, "allowed are None, 'rgb_array' and 'human'"),
        ({"render_mode": "human"}, "'human' is for one environment"),
        ({"beams": 2.5}, "beams is a whole number, not 2.5"),
        ({"obstacles": -1}, "obstacles is -1; allowed are 0 to 100"),
        ({"randomize": ["p3at.x"]}, "randomize is a dict"),
        ({"autoreset_mode": "x"}, "autoreset_mode is 'x'; allowed are 'NextStep', 'SameStep'"),
    ],
)
def test_wrong_options_are_refused(options, text):
    with pytest.raises((ValueError, TypeError), match=text):
        ruedo.gym.NavigateVectorEnv(2, **options)


@pytest.mark.parametrize("option", ["num_envs", "autoreset_mode"])
def test_options_of_many_are_for_many(option):
    with pytest.raises(TypeError, match=f"{option} is for gymnasium.make_vec"):
        gymnasium.make("ruedo/Push-v0", disable_env_checker=True, **{option: 3})


@pytest.mark.parametrize("mode", ["Disabled", "SameStep"])
def test_an_environment_that_was_never_reset_gives_no_rewards(mode):
    envs = ruedo.gym.NavigateVectorEnv(3, beams=2, autoreset_mode=mode)
    first = {"reset_mask": np.array([True, False, False])}
    envs.reset(seed=1, options=first)
    with pytest.raises(gymnasium.error.ResetNeeded, match="for environment 1 before the first"):
        envs.step(np.zeros((3, 2)))
    with pytest.raises(gymnasium.error.ResetNeeded, match="for environment 2 before save"):
        envs.save([0, 2])
    envs.restore(envs.save(0), [1, 2])
    rewards = envs.step(np.zeros((3, 2)))[1]
    assert rewards[0] == rewards[1] == rewards[2]
    envs.close()


def test_a_mask_selects_the_saved_episodes():
    """Regression: it was taken for the indices 1, 0 and 1."""
    envs = ruedo.gym.NavigateVectorEnv(3, beams=2)
    envs.reset(seed=1)
    saved = envs.save(np.array([True, False, True]))
    assert [one.world.world for one in saved._episodes] == [0, 2]
    envs.restore(saved, [False, True, True])
    assert envs.scenes[1] is envs.scenes[0]
    with pytest.raises(ValueError, match="a mask is True or False for each of 3 environments"):
        envs.save([True, False])
    envs.close()


ASYNC = """
import gymnasium, numpy as np, ruedo.gym
options = {"render_mode": "rgb_array"} if "Camera" not in TASK else {}
envs = gymnasium.make_vec(TASK, num_envs=2, vectorization_mode="async", **options)
first, _ = envs.reset(seed=1)
after = envs.step(np.zeros((2, 2), np.float32))[0]
frames = envs.render() if options else first
assert np.ptp(frames[1]) > 0
envs.close()
one = ruedo.gym.CameraVectorEnv(2, autoreset_mode="Disabled")
if not options:
    assert (one.reset(seed=1)[0] == first).all() and (one.step(np.zeros((2, 2)))[0] == after).all()
print("well")
"""


@pytest.mark.parametrize("task", ["Navigate", "Camera"])
def test_environments_with_pictures_run_in_gymnasiums_processes(task):
    """Which are forked. Regression: Mesa's threads were not, and were waited for without end."""
    program = ASYNC.replace("TASK", f"'ruedo/{task}-v0'")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "well\n"), done.stderr


FORKED = """
import os, sys, ruedo.gym
env = ruedo.gym.CameraEnv()
env.reset(seed=1)
child = os.fork()
if child:
    sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
for call in (lambda: env.step([0, 0]), lambda: ruedo.gym.CameraEnv().reset()):
    try:
        call()
        sys.exit(1)
    except OSError as error:
        assert "forked from one with pictures can draw none" in str(error), error
env.close()
ruedo.gym.PushEnv().reset(seed=1)
sys.exit(7)
"""


@pytest.mark.parametrize("renderer", ["osmesa", "egl"])
def test_a_fork_after_drawing_cannot_draw(renderer):
    """It says so, closes what it has of the other's, and ends as any process does."""
    done = subprocess.run(
        [sys.executable, "-c", FORKED],
        capture_output=True,
        text=True,
        env={**os.environ, "RUEDO_RENDERER": renderer},
    )
    assert done.returncode == 7, done.stderr


def test_wrong_actions_are_refused():
    envs = ruedo.gym.NavigateVectorEnv(2, beams=2)
    good = np.zeros((2, 2), np.float32)
    with pytest.raises(gymnasium.error.ResetNeeded):
        envs.step(good)
    envs.reset(seed=1)
    for actions, text in (
        (good[:1], r"the shape \(2, 2\), not \(1, 2\)"),
        (good * math.nan, "finite numbers"),
        ("ahead", "actions are numbers of shape"),
        (good * 1j, "actions are numbers of shape"),
        ([[10**400, 0]] * 2, "actions are numbers of shape"),
    ):
        with pytest.raises((ValueError, TypeError), match=text):
            envs.step(actions)
    envs.step(good)
    envs.close()
    fleet = ruedo.gym.FleetEnv(2, beams=2)
    fleet.reset(seed=1)
    for actions, text in (
        ({"robot0": good[0]}, "no action for robot1"),
        ({"robot0": good[0], "robot1": good[0], "robot2": good[0]}, "'robot2' is not one of"),
        (good, "actions are a dict"),
    ):
        with pytest.raises((ValueError, TypeError), match=text):
            fleet.step(actions)
    with pytest.raises(TypeError, match="seed is a whole number, not '3'"):
        fleet.reset(seed="3")
    fleet.close()
