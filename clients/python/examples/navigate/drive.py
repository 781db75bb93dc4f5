"""Drives Navigate-v0's rooms for tests by the policy that train.py learnt: through a server, over
LCM, as it would drive a robot.

    python drive.py [--rooms 20] [--first 0] [--record FOLDER] [--url URL] [--rate 1]

Each room is a server of its own, with noise: in lockstep, or in real time with --rate. A line for
each room says whether the robot reached its goal without touching anything; the last one says how
often it did. Touches are those of a bumper around its body, without the wheels. --record keeps the
runs as FOLDER/room-NUMBER.lcm, which `ruedo verify` repeats. Neither torch nor Gymnasium is needed.
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


class InLockstep:
    """The server computes a decision's steps when the command for them is there."""

    def __init__(self, sim: ruedo.Simulation, robot: ruedo.Robot):
        self._sim, self._robot = sim, robot
        self._seen = sim.step(STEPS)

    def see(self) -> tuple[ruedo.Scan, ruedo.Pose, ruedo.Odometry, bool]:
        """The newest samples, and whether the bumper was pressed since the last ones."""
        newest = (self._robot.lrf, self._robot.pose, self._robot.odometry)
        scan, pose, odometry = (self._seen.latest(device) for device in newest)
        touched = any(touch.pressed for touch in self._seen.all(self._robot.contact))
        return scan, pose, odometry, touched

    def act(self, v: float, omega: float) -> None:
        self._seen = self._sim.step(STEPS, [self._robot.velocity_command(v, omega)])


class InRealTime:
    """The server waits for nobody: what the policy takes to decide counts."""

    def __init__(self, sim: ruedo.Simulation, robot: ruedo.Robot):
        self._robot, self._touched = robot, False
        self._ticks = iter(sim.every(0.005 * STEPS))  # s of sim time
        robot.contact.on_sample(self._touch)

    def _touch(self, touch: ruedo.Contact) -> None:
        self._touched |= touch.pressed

    def see(self) -> tuple[ruedo.Scan, ruedo.Pose, ruedo.Odometry, bool]:
        robot = self._robot
        return robot.lrf.latest(), robot.pose.latest(), robot.odometry.latest(), self._touched

    def act(self, v: float, omega: float) -> None:
        self._robot.set_velocity(v, omega)
        next(self._ticks)


def drive(
    policy: Policy,
    room: Room,
    seed: int,
    record: Path | None = None,
    url: str | None = None,
    rate: float | None = None,
) -> str:
    """ "success", "collision" or "too late". rate: sim time per real time; None: in lockstep."""
    text = room.sdf.replace("<name>robot</name>", f"<name>robot</name>{BUMPER}")
    if record:  # the log refers to its world's file
        world = record.with_suffix(".sdf")
        world.write_text(text, encoding="utf-8")
    with ruedo.launch(
        world if record else None,
        text=None if record else text,
        seed=seed,
        lockstep=rate is None,
        rate=rate,
        url=url,
        settings={"robot/lrf.lidar.scan.horizontal.samples": policy.beams},
        disable=["robot/camera", "robot/sonar_front", "robot/sonar_rear"],
        args=["--record", str(record)] if record else [],
    ) as sim:
        robot = sim.robot("robot")
        body = InLockstep(sim, robot) if rate is None else InRealTime(sim, robot)
        for _ in range(MOST_DECISIONS):
            scan, pose, odometry, touched = body.see()
            if touched:
                return "collision"
            if math.dist(pose.position[:2], room.goal) < GOAL_M:
                return "success"
            ahead, turn = policy(observation(scan, pose, odometry, room.goal))
            body.act((float(ahead) + 1.0) / 2.0 * 0.5, float(turn))
    return "too late"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rooms", type=int, default=20, help="how many (default 20)")
    parser.add_argument("--first", type=int, default=0, help="number of the first (default 0)")
    parser.add_argument("--record", type=Path, help="folder for the runs")
    parser.add_argument("--url", default="auto", help='default "auto": LCM on a free port')
    parser.add_argument("--rate", type=float, help="sim time per real time (default: lockstep)")
    arguments = parser.parse_args()
    policy = Policy.load()
    if arguments.record:
        arguments.record.mkdir(parents=True, exist_ok=True)
    results = []
    for number in range(arguments.first, arguments.first + arguments.rooms):
        record = arguments.record / f"room-{number}.lcm" if arguments.record else None
        room = make_room(TEST_ROOMS + number)
        results.append(drive(policy, room, number + 1, record, arguments.url, arguments.rate))
        print(f"room {number}: {results[-1]}", flush=True)
    print(
        f"{results.count('success')} of {len(results)} rooms: {results.count('success') / len(results):.0%}"
    )


if __name__ == "__main__":
    main()
