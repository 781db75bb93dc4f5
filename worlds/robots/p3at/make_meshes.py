#!/usr/bin/env python3
"""Makes the P3-AT's meshes (meshes/*.obj) from the robot's dimensions: run it again after changing
one.
"""

import math
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from solids import COLOURS, Solids, arc, faceted, lms200, vc_c4

# Transducers (x m, y m, heading deg) counter-clockwise from the right rear side; the two arrays of
# ARIA's p3at.
SONARS = [
    (-0.144, -0.136, -90),
    (0.147, -0.136, -90),
    (0.193, -0.119, -50),
    (0.227, -0.079, -30),
    (0.245, -0.027, -10),
    (0.245, 0.027, 10),
    (0.227, 0.079, 30),
    (0.193, 0.119, 50),
    (0.147, 0.136, 90),
    (-0.144, 0.136, 90),
    (-0.189, 0.119, 130),
    (-0.223, 0.079, 150),
    (-0.241, 0.027, 170),
    (-0.241, -0.027, -170),
    (-0.223, -0.079, -150),
    (-0.189, -0.119, -130),
]
SONAR_HEIGHT = {True: 0.250, False: 0.247}  # front, rear
DECK_TOP = 0.2775
WHEELS_X, AXLE_Z = (0.135, -0.134), 0.111


def body():
    solids = Solids()
    lower = [
        (-0.172, -0.134),
        (0.172, -0.134),
        (0.196, -0.110),
        (0.196, 0.110),
        (0.172, 0.134),
        (-0.172, 0.134),
        (-0.211, 0.080),
        (-0.211, -0.080),
    ]
    solids.prism("red", lower, 0.081, 0.221)
    solids.prism("red", faceted(SONARS), 0.221, 0.271)
    # The deck: round at both ends, wide over the front wheels, narrower behind.
    wide, narrow, radius = 0.191, 0.166, 0.225
    front, rear = math.asin(wide / radius), math.asin(narrow / radius)
    right = [(-0.026, -narrow), (0.008, -wide)]
    left = [(x, -y) for x, y in reversed(right)]
    deck = (
        arc(0.032, radius, -front, front, 16)
        + left
        + arc(-0.026, radius, math.pi - rear, math.pi + rear, 16)
        + right
    )
    solids.prism("black", deck, 0.271, DECK_TOP)
    for x, y, heading in SONARS:
        a = math.radians(heading)
        solids.lathe(
            "gold",
            [(0, 0), (0, 0.019), (0.004, 0.017), (0.004, 0)],
            (x, y, SONAR_HEIGHT[x > 0]),
            (math.cos(a), math.sin(a), 0),
            segments=12,
        )
    for x in WHEELS_X:
        for side in (-1, 1):
            solids.box(
                "grey",
                (x - 0.024, min(side * 0.130, side * 0.173), AXLE_Z - 0.023),
                (x + 0.024, max(side * 0.130, side * 0.173), AXLE_Z + 0.023),
            )
    solids.write(HERE / "meshes/body", COLOURS)


def wheel():
    """In the wheel's own frame: it turns about y."""
    solids = Solids()
    half = 0.048
    profile = [
        (-half, 0),
        (-half, 0.102),
        (-half + 0.009, 0.111),
        (half - 0.009, 0.111),
        (half, 0.102),
        (half, 0),
    ]
    solids.lathe("tyre", profile, (0, 0, 0), (0, 1, 0), segments=32)
    solids.lathe(
        "hub",
        [(-0.050, 0), (-0.050, 0.046), (-0.046, 0.056), (0.046, 0.056), (0.050, 0.046), (0.050, 0)],
        (0, 0, 0),
        (0, 1, 0),
        segments=10,
    )
    solids.write(HERE / "meshes/wheel", COLOURS)


def devices():
    """The SICK LMS200 and the camera on top of it; the poses are those of the sensors in
    model.sdf.
    """
    solids = Solids()
    lms200(solids, 0.160, DECK_TOP + 0.113)
    vc_c4(solids, 0.190, DECK_TOP + 0.185 + 0.055)
    solids.write(HERE / "meshes/devices", COLOURS)


if __name__ == "__main__":
    body()
    wheel()
    devices()
