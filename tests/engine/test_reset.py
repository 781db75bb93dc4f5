"""A reset equals a fresh start, byte for byte, whatever was before and whatever is in the world:
messages, pictures and hashes of copies that were used for something else against those of an engine
that was just made. The random worlds and commands are those of snapshots.py; test_randomize.py does
the same with 1 000 episodes of domain randomisation.
"""

import random

import pytest
import ruedo
from ruedo.rooms import (
    make_corridor,
    make_crowd_hall,
    make_fleet_room,
    make_landmark_room,
    make_push_room,
    make_room,
)
from snapshots import Commands, RandomWorld, joint_names, run


def check(options, seed, episodes=3):
    """Copies of other seeds and other pasts, in which joints were driven, things let go of and
    people met, some of them put back by restore.
    """
    rng = random.Random(seed)
    with ruedo.Engine(**options, worlds=2, seed=seed, record=True) as used:
        joints = joint_names(used)
        before = Commands(10 * seed, used, joints)
        for episode in range(episodes):
            steps, own = rng.choice([7, 20, 33]), seed + 100 + episode
            run(used, 0, before, range(rng.randint(0, 15)), steps)
            if episode == 2:
                used.restore(used.save(1), 0)
            used.reset(0, seed=own)
            with ruedo.Engine(**options, worlds=1, seed=own, record=True) as fresh:
                then = Commands(10 * seed + 1, fresh, joints)
                assert used.state_hash(0) == fresh.state_hash()
                told = run(fresh, 0, then, range(6), steps)
            assert len(told[0]) > 0
            assert run(used, 0, then, range(6), steps) == told, episode


@pytest.mark.parametrize("seed", [1, 2, 3, 5, 7, 9, 12, 14])
def test_random_worlds_reset_to_a_fresh_run(seed):
    world = RandomWorld(seed, pictures=seed % 4 == 1)
    options = {"world": "w.sdf", "text": world.text, "spawn": world.spawn, "fault": world.fault}
    check({**options, "allow_errors": True}, seed)  # robots may stand in something


@pytest.mark.parametrize("world", ["crossing", "terrain", "warehouse", "fleet", "office"])
def test_our_worlds_reset_to_a_fresh_run(world):
    with ruedo.Engine(world) as engine:
        cameras = [f"{robot}/{name}" for robot, name, kind in engine.devices if kind == "camera"]
    check({"world": world, "disable": cameras}, 5, episodes=2)


def fleet_room(number):
    return make_fleet_room(number, 3)[0]


@pytest.mark.parametrize(
    "make",
    [make_room, make_corridor, make_crowd_hall, make_push_room, make_landmark_room, fleet_room],
)
def test_scenes_of_the_tasks_reset_to_a_fresh_run(make):
    """Each time another scene, with what is drawn of it; the room of the red pillar with its
    camera.
    """
    rng = random.Random(3)
    first = make(0).sdf
    with ruedo.Engine("first", text=first) as engine:
        robots, devices = engine.robots, engine.devices
    options = {
        "disable": []
        if make is make_landmark_room
        else [f"{robot}/{name}" for robot, name, kind in devices if kind == "camera"],
        "randomize": {
            f"{robots[0]}.mass": "uniform(0.8, 1.3)",
            "ground_plane.friction": "uniform(0.3, 1)",
        },
        "record": True,
    }
    with ruedo.Engine("task", text=first, worlds=3, **options) as used:
        for episode in range(10):
            scene, seed, copy = (
                make(rng.randrange(2_000_000)).sdf,
                rng.randrange(2**31),
                episode % 3,
            )
            commands = [[[rng.uniform(-0.2, 0.6), rng.uniform(-1, 1)]] for _ in range(12)]
            used.reset(copy, seed=seed, text=scene)
            with ruedo.Engine("task", text=scene, seed=seed, **options) as fresh:
                assert used.drawn(copy) == fresh.drawn()
                assert used.state_hash(copy) == fresh.state_hash()
                assert (used["lrf.ranges"][copy] == fresh["lrf.ranges"][0]).all()
                for command in commands:
                    for engine in (used, fresh):
                        engine.step(command, 20)
                    told = [one[1:] for one in used.messages() if one[0] == copy]
                    assert told == [one[1:] for one in fresh.messages()] and told
                    assert used.state_hash(copy) == fresh.state_hash()
