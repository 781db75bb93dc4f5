"""Drives Navigate-v0's rooms for tests by the policy that train.py learnt: through a server, over
LCM, as it would drive a robot.

    python drive.py [--rooms 20] [--first 0] [--record FOLDER] [--url URL]

Each room is a server in lockstep of its own, with noise; it is printed whether the robot reached
its goal without touching anything, and at the end how often. Touches are those of a bumper around
its body, without the wheels. --record keeps the runs as FOLDER/room-NUMBER.lcm, which `ruedo
verify` repeats. Neither torch nor Gymnasium is needed.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
import ruedo
from policy import Policy
from ruedo.rooms import TEST_ROOMS, Room, make_room

STEPS = 20  # of 5 ms in a decision
MOST_DECISIONS = 400
GOAL_M = 0.4
BUMPER = "<sensor name='bumper' type='contact'><update_rate>10</update_rate></sensor>"


def observation(
    scan: ruedo.Scan, pose: ruedo.Pose, odometry: ruedo.Odometry, goal: tuple[float, float]
) -> np.ndarray:
    """As ruedo.gym.navigate describes it."""
    x, y = goal[0] - pose.position[0], goal[1] - pose.position[1]
    bearing = math.atan2(y, x) - pose.heading
    rest = [
        min(math.hypot(x, y) / 8.0, 1.0),
        math.cos(bearing),
        math.sin(bearing),
        odometry.v / 0.5,
        odometry.omega,
    ]
    return np.concatenate([np.clip(scan.ranges / 8.0, 0.0, 1.0), rest]).astype(np.float32)


def drive(policy: Policy, room: Room, seed: int, record: Path | None, url: str | None) -> str:
    """ "success", "collision" or "too late"."""
    text = room.sdf.replace("<name>robot</name>", f"<name>robot</name>{BUMPER}")
    if record:  # the log refers to its world's file
        world = record.with_suffix(".sdf")
        world.write_text(text, encoding="utf-8")
    with ruedo.launch(
        world if record else None,
        text=None if record else text,
        seed=seed,
        lockstep=1,
        url=url,
        settings={"robot/lrf.lidar.scan.horizontal.samples": policy.beams},
        disable=["robot/camera", "robot/sonar_front", "robot/sonar_rear"],
        args=["--record", str(record)] if record else [],
    ) as sim:
        robot = sim.robot("robot")
        seen = sim.step(STEPS)
        for _ in range(MOST_DECISIONS):
            pose = seen.latest(robot.pose)
            if any(touch.pressed for touch in seen.all(robot.contact)):
                return "collision"
            if math.dist(pose.position[:2], room.goal) < GOAL_M:
                return "success"
            what = observation(seen.latest(robot.lrf), pose, seen.latest(robot.odometry), room.goal)
            ahead, turn = policy(what)
            command = robot.velocity_command((float(ahead) + 1.0) / 2.0 * 0.5, float(turn))
            seen = sim.step(STEPS, [command])
    return "too late"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rooms", type=int, default=20, help="how many (default 20)")
    parser.add_argument("--first", type=int, default=0, help="number of the first (default 0)")
    parser.add_argument("--record", type=Path, help="folder for the runs")
    parser.add_argument("--url", default="auto", help='default "auto": LCM on a free port')
    arguments = parser.parse_args()
    policy = Policy.load()
    if arguments.record:
        arguments.record.mkdir(parents=True, exist_ok=True)
    results = []
    for number in range(arguments.first, arguments.first + arguments.rooms):
        record = arguments.record / f"room-{number}.lcm" if arguments.record else None
        room = make_room(TEST_ROOMS + number)
        results.append(drive(policy, room, number + 1, record, arguments.url))
        print(f"room {number}: {results[-1]}", flush=True)
    print(
        f"{results.count('success')} of {len(results)} rooms: {results.count('success') / len(results):.0%}"
    )


if __name__ == "__main__":
    main()
