"""Lab 1: a square by motion primitives, and how far the odometry's end is from the true one."""

from __future__ import annotations

import math

import ruedo


def finish(sim: ruedo.Simulation, robot: ruedo.Robot, move: ruedo.Command) -> ruedo.Observations:
    """Steps until the primitive is over; the last observations."""
    seen = sim.step(20, [move])
    while not any(status.state in ("done", "ended") for status in seen.all(robot.motion)):
        seen = sim.step(20)
    return seen


def square(side: float = 2.0, track_error: float = 0.0) -> tuple[ruedo.Odometry, ruedo.Pose]:
    """Drives it once. track_error: the relative error of the track that the robot assumes."""
    with ruedo.launch(
        ruedo.World().robot("p3at"),
        lockstep=1,
        disable=["p3at/camera"],
        settings={"p3at/odometry.track_error": track_error},
    ) as sim:
        robot = sim.robot("p3at")
        for _ in range(4):
            finish(sim, robot, robot.move_command("advance", side))
            seen = finish(sim, robot, robot.move_command("rotate", math.pi / 2))
        return seen.latest(robot.odometry), seen.latest(robot.pose)


def main() -> None:
    odometry, pose = square(track_error=0.02)
    print(f"the robot ends at {pose.x:.3f}, {pose.y:.3f}, {math.degrees(pose.heading):.1f} degrees")
    print(
        f"its odometry says {odometry.x:.3f}, {odometry.y:.3f}, {math.degrees(odometry.heading):.1f} degrees"
    )


if __name__ == "__main__":
    main()
