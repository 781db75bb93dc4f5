"""Leader and follower: the follower keeps a place behind the leader by input-output linearisation
of a point ahead of its axle (Siciliano et al., Robotics, section 11.5.2)."""

import math

import numpy as np
import ruedo

AHEAD, GAIN, GAP = 0.2, 1.5, 1.2  # m, 1/s, m


def towards(pose, goal, feed_forward):
    """(v, omega) that bring the point AHEAD of the axle to the goal (m), which moves (m/s)."""
    cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
    point = np.array([pose.x + AHEAD * cosine, pose.y + AHEAD * sine])
    rate = feed_forward + GAIN * (np.asarray(goal) - point)
    v = cosine * rate[0] + sine * rate[1]
    return float(v), float((cosine * rate[1] - sine * rate[0]) / AHEAD)


def follow(seconds=40.0):
    """The follower's distances from the leader (m), ten a second."""
    world = (
        ruedo.World().robot("p3at", 0, 0, name="leader").robot("p3at", -2.5, 0.8, name="follower")
    )
    options = {"disable": ["leader/camera", "follower/camera"], "noise": False}
    gaps = []
    with ruedo.launch(world, lockstep=1, **options) as sim:
        leader, follower = sim.robot("leader"), sim.robot("follower")
        seen = sim.step(20)
        while seen.time < seconds:
            first, second = seen.latest(leader.pose), seen.latest(follower.pose)
            gaps.append(math.hypot(first.x - second.x, first.y - second.y))
            behind = first.transform.apply((AHEAD - GAP, 0.0))[:2]
            velocity = first.transform.apply(first.velocity) - first.position
            v, omega = towards(second, behind, velocity[:2])
            turning = 0.25 * math.sin(0.3 * seen.time)
            commands = [
                leader.velocity_command(0.3, turning),
                follower.velocity_command(max(-0.6, min(v, 0.6)), max(-1.5, min(omega, 1.5))),
            ]
            seen = sim.step(20, commands)
    return gaps


if __name__ == "__main__":
    gaps = follow()
    print(f"from {gaps[0]:.2f} m to {gaps[-1]:.2f} m behind the leader")
