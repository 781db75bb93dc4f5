"""Wanders without bumping into things, by laser range finder and sonar; saves a camera picture and
compares odometry with the true pose at the end.

    python wander.py [--robot NAME] [--duration SECONDS] [--url URL] [--launch WORLD] [--picture
    FILE]
"""

import argparse
import math

import ruedo

CLEARANCE = 0.7  # m; nearer than this, it turns away
SPEED = 0.35  # m/s
TURN_RATE = 0.6  # rad/s


def nearest_echo(reading: ruedo.SonarReading, elements, left: bool) -> float:
    """The nearest echo (m) of the transducers that look ahead, on the left or the right."""
    headings = elements[:, 5]
    ahead = (abs(headings) < 1.0) & ((headings >= 0.0) == left) & (reading.fired_utime >= 0)
    return float(reading.ranges[ahead].min(initial=math.inf))


def wander(robot: ruedo.Robot, duration: float) -> None:
    sonar = next((d for d in robot.devices if d.type == "sonar_t"), None)
    start = now = robot.lrf.latest().time
    turning = (
        0.0  # rad/s while it turns away; it keeps to one side, or it would get stuck in corners
    )
    while now - start < duration:
        scan = robot.lrf.next()
        now = scan.time
        left, right = scan.nearest(0.0, 1.2), scan.nearest(-1.2, 0.0)
        if sonar:
            reading = sonar.latest()
            left = min(left, nearest_echo(reading, sonar.elements, True))
            right = min(right, nearest_echo(reading, sonar.elements, False))
        if min(left, right) > CLEARANCE:
            turning = 0.0
            robot.set_velocity(SPEED, 0.0)
        else:
            turning = turning or (TURN_RATE if left > right else -TURN_RATE)
            robot.set_velocity(0.0, turning)


def moved(
    start: tuple[float, float, float], end: tuple[float, float, float]
) -> tuple[float, float, float]:
    """The second x, y, heading (m, rad) in the frame of the first."""
    x, y, turned = (b - a for a, b in zip(start, end))
    cos, sin = math.cos(start[2]), math.sin(start[2])
    return cos * x + sin * y, cos * y - sin * x, math.remainder(turned, math.tau)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--robot", help="default: the first")
    parser.add_argument(
        "--duration", type=float, default=math.inf, help="s of sim time; default: until Ctrl-C"
    )
    parser.add_argument("--url", help="of the server; default: LCM_DEFAULT_URL")
    parser.add_argument("--launch", metavar="WORLD", help="start a private server with this world")
    parser.add_argument("--picture", default="wander.jpg")
    options = parser.parse_args()

    with ruedo.launch(options.launch) if options.launch else ruedo.connect(options.url) as sim:
        robot = sim.robot(options.robot) if options.robot else sim.robots[0]
        pose, odometry = robot.pose.latest(), robot.odometry.latest()
        pose_start, odometry_start = (
            (pose.x, pose.y, pose.heading),
            (odometry.x, odometry.y, odometry.theta),
        )
        try:
            print(
                f"{robot.name} wanders in {sim.world}{'; Ctrl-C ends it' if options.duration == math.inf else ''}",
                flush=True,
            )
            wander(robot, options.duration)
        except KeyboardInterrupt:
            pass
        robot.stop().wait(10.0)

        if any(d.type == "image_t" for d in robot.devices):
            robot.camera.latest().save(options.picture)
            print(f"camera    {options.picture}")
        pose, odometry = robot.pose.next(), robot.odometry.next()
        truth = moved(pose_start, (pose.x, pose.y, pose.heading))
        belief = moved(odometry_start, (odometry.x, odometry.y, odometry.theta))
        print(
            f"true pose x {truth[0]:.3f} m, y {truth[1]:.3f} m, heading {truth[2]:.3f} rad from where it began"
        )
        print(
            f"odometry  x {belief[0]:.3f} m, y {belief[1]:.3f} m, heading {belief[2]:.3f} rad, "
            f"which is {math.dist(truth[:2], belief[:2]):.3f} m off"
        )


if __name__ == "__main__":
    try:
        main()
    except ruedo.RuedoError as error:
        raise SystemExit(f"wander: {error}") from None
