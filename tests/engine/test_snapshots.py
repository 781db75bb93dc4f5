"""Engine.save and restore: what follows is what followed, byte for byte, whatever is in the world.

Random worlds of snapshots.py: shapes of all kinds in heaps and stacks, on planes, boxes and slopes,
furniture of meshes, arms with joints of all kinds, robots on kinematic and on real wheels, a sensor
of each kind with noise that wanders, faults, people, wind, belts, doors, what is held and let go.
"""

import random
import threading

import numpy as np
import pytest
import ruedo
from ruedo import lcmtypes
from snapshots import Commands, RandomWorld, joint_names, run


def check(engine, seed):
    """From one saved state, the same again: in the copy itself, in others, in new ones, midway."""
    rng = random.Random(seed)
    joints = joint_names(engine)
    before, then, other = (Commands(10 * seed + i, engine, joints) for i in range(3))
    steps, decisions = rng.choice([7, 20, 33]), rng.randint(4, 10)
    run(engine, 0, before, range(rng.randint(0, 25)), steps)
    saved = engine.save(0)
    assert saved.steps == engine.steps(0)
    told = run(engine, 0, then, range(decisions), steps)
    run(engine, 1, other, range(rng.randint(0, 15)), steps)
    engine.restore(saved)
    assert run(engine, 0, then, range(decisions), steps) == told, "in itself"
    engine.restore(saved, [0, 1])  # twice, and into one of another seed with another past
    assert engine.steps(1) == saved.steps
    assert run(engine, 1, then, range(decisions), steps) == told, "in another copy"
    assert run(engine, 0, then, range(decisions), steps) == told, "in itself, again"
    run(engine, 1, other, range(4), steps)
    engine.restore(saved, 1)
    assert run(engine, 1, then, range(decisions), steps) == told, "in the other copy, again"
    engine.reset(0, seed=seed + 77)
    engine.restore(saved)
    half = decisions // 2
    first = run(engine, 0, then, range(half), steps)
    engine.restore(engine.save(0), 2)
    rest = run(engine, 2, then, range(half, decisions), steps)
    assert first + rest == told, "after a reset, and from a state of a restored copy"


@pytest.mark.parametrize("seed", [1, 2, 3, 7, 9, 12, 14, 17])
def test_random_worlds_continue_equally_after_a_restore(seed):
    world = RandomWorld(seed, pictures=seed % 4 == 1)
    with ruedo.Engine(
        "w.sdf",
        text=world.text,
        spawn=world.spawn,
        fault=world.fault,
        worlds=3,
        seed=seed,
        record=True,
        allow_errors=True,  # robots may stand in something
    ) as engine:
        check(engine, seed)


@pytest.mark.parametrize("world", ["crossing", "terrain", "warehouse", "fleet"])
def test_our_worlds_continue_equally_after_a_restore(world):
    with ruedo.Engine(
        world,
        worlds=3,
        record=True,
        disable=[
            f"{robot}/{device}"
            for robot, device, kind in ruedo.Engine(world).devices
            if kind == "camera"
        ],
    ) as engine:
        check(engine, 5)


def arena(**options):
    return ruedo.Engine("arena", disable=["p3at/camera"], **options)


def hashes(engine, world, decisions=5):
    seen = []
    commands = np.full((engine.worlds, 1, 2), [0.5, 0.4])
    for _ in range(decisions):
        engine.step(commands, 20)
        seen.append((engine.state_hash(world), engine["lrf.ranges"][world].tobytes()))
    return seen


def test_arrays_and_commands_are_restored_too():
    with arena(worlds=2, seed=3) as engine:
        ranges, touching = engine["lrf.ranges"], engine.touching()
        while not touching[0].any():  # into a wall
            engine.step(np.full((2, 1, 2), [1.0, 0.0]), 20)
            assert engine.time() < 60
        move = lcmtypes.move_command_t()
        move.id, move.kind, move.value = 5, lcmtypes.move_command_t.ROTATE, 0.5
        engine.command(0, "p3at/move", move)  # for the coming step
        saved = engine.save(0)
        shown, touched = ranges[0].copy(), touching[0].copy()
        met = engine.collisions(0)
        assert met
        engine.step(None, 100)
        after, motion = engine.state_hash(0), engine["motion.id"][0].copy()
        assert motion == [5]
        engine.reset(seed=9)
        assert not (ranges[0] == shown).all() and touching[0] == 0
        engine.restore(saved, [1, 0])
        for world in (0, 1):
            assert (ranges[world] == shown).all() and touching[world] == touched
            assert engine.collisions(world) == met
        engine.step(None, 100)
        assert [engine.state_hash(world) for world in (0, 1)] == [after, after]
        engine.reset()  # with the seed of what was restored
        assert engine.state_hash(0) == engine.state_hash(1) == arena(seed=3).state_hash()


def test_a_world_that_was_drawn_and_another_one_are_put_back():
    with arena(
        worlds=2, randomize={"p3at.x": "uniform(-2, 2)", "p3at.mass": "uniform(0.5, 2)"}
    ) as engine:
        engine.step(np.full((2, 1, 2), [0.5, 0.4]), 100)
        saved, drawn = engine.save(1), engine.drawn(1)
        after = hashes(engine, 1)
        engine.reset([0, 1], seed=50)
        engine.restore(saved, [0, 1])
        assert engine.drawn(0) == engine.drawn(1) == drawn
        assert hashes(engine, 1) == after
        engine.restore(saved, [0])
        assert hashes(engine, 0) == after


def test_threads_and_cores_change_nothing():
    with arena(worlds=8, threads=2) as engine:
        engine.step(np.full((8, 1, 2), [0.5, 0.4]), 300)
        saved = [engine.save(world) for world in range(8)]
        after = hashes(engine, 3)
        thread = threading.Thread(target=lambda: engine.restore(saved[3], range(8)))
        thread.start()
        thread.join()
        assert hashes(engine, 7) == after
        for world, one in enumerate(saved):
            engine.restore(one, world)
        assert hashes(engine, 3) == after
    with arena(worlds=1, threads=1, seed=4) as engine:
        engine.step(np.full((1, 1, 2), [0.5, 0.4]), 300)
        assert hashes(engine, 0) == after


def test_an_unread_picture_after_a_restore_is_the_due_one():
    def driven():
        engine = ruedo.Engine("arena", seed=2, settings={"p3at/camera.ruedo:encoding": "rgb"})
        engine.step(np.full((1, 1, 2), [0.3, 0.5]), 150)
        return engine

    with driven() as engine:
        expected = engine["camera.data"][0].copy()
    with driven() as engine:
        saved = engine.save()
        engine.step(None, 200)
        seen = engine["camera.data"]
        assert not (seen[0] == expected).all()
        engine.restore(saved)
        assert (seen[0] == expected).all()


def test_errors_have_their_reason():
    with arena() as engine, arena() as other:
        saved = engine.save()
        assert repr(saved) == "<ruedo.SavedWorld: world 0 at 0 s>"
        with pytest.raises(ValueError, match="another engine saved that world"):
            other.restore(saved)
        with pytest.raises(TypeError, match=r"restore\(\) takes what save\(\) gave, not 7"):
            engine.restore(7)
        with pytest.raises(IndexError, match="world 1 of 1"):
            engine.save(1)
        with pytest.raises(IndexError, match="world 1 of 1"):
            engine.restore(saved, 1)
        with pytest.raises(ValueError, match="world 0 is to be restored twice at once"):
            engine.restore(saved, [0, 0])
        engine.begin_run(3)
        with pytest.raises(ValueError, match=r"end_run\(\) comes first"):
            engine.restore(saved)
        engine.end_run()
        engine.restore(saved)
        engine.close()
        with pytest.raises(RuntimeError, match="the engine was closed"):
            engine.restore(saved)
