"""An arm picks up a box: inverse kinematics of two links and a hand that points down.

The carrier's shoulder turns the upper arm (0.30 m) and the forearm (0.26 m) in a vertical plane,
the turret turns that plane, and the hand (0.10 m, fingers 0.07 m) points at the ground.
"""

import math

import ruedo

SHOULDER = (-0.06, 0.35)  # m: x of the turret in base_link, height of the shoulder
UPPER, FORE, HAND = 0.30, 0.26, 0.17  # m; to the fingers' tips
BOX = (0.45, 0.0, 0.05)  # m: x, y and side


def joints_at(x, y, z):
    """Joint positions for fingertips at x, y, z of base_link. Raises ValueError out of reach."""
    r, h = math.hypot(x - SHOULDER[0], y), z + HAND - SHOULDER[1]
    reach = math.hypot(r, h)
    if not abs(UPPER - FORE) < reach < UPPER + FORE:
        raise ValueError(f"{x}, {y}, {z} is out of reach")
    inner = math.acos((UPPER**2 + FORE**2 - reach**2) / (2 * UPPER * FORE))
    at_shoulder = math.acos((UPPER**2 + reach**2 - FORE**2) / (2 * UPPER * reach))
    upper = math.pi / 2 - math.atan2(h, r) - at_shoulder  # from upright, forwards
    fore = math.pi - inner
    return {
        "turret_joint": math.atan2(y, x - SHOULDER[0]),
        "upper_arm_joint": upper,
        "forearm_joint": fore,
        "hand_joint": math.pi - upper - fore,
    }


def grip(robot, close):
    """close: m that each finger moves inwards."""
    robot.command_joints({"left_finger_joint": close, "right_finger_joint": close})


def pick(world=None):
    """Height to which the box was lifted, m, and how far the arm was from what was asked, rad."""
    x, y, side = BOX
    world = world or (
        ruedo.World()
        .robot("carrier")
        .box(x, y, size=(side, side, side), mass=0.2, colour=(0.9, 0.5, 0.1), name="parcel")
    )
    with ruedo.launch(world, rate="max", noise=False, disable=["carrier/lrf"]) as sim:
        robot, parcel = sim.robot("carrier"), sim.body("parcel")
        for height in (0.25, 0.02):
            robot.command_joints(joints_at(x, y, height))
            sim.sleep(2.0)
        grip(robot, 0.025)
        sim.sleep(1.0)
        goal = joints_at(x - 0.1, y + 0.1, 0.3)
        robot.command_joints(goal)
        sim.sleep(3.0)
        state = robot.joints.latest()
        off = max(abs(state.position(name) - value) for name, value in goal.items())
        return parcel.pose.z, off


if __name__ == "__main__":
    print("lifted to %.2f m, joints within %.3f rad" % pick())
