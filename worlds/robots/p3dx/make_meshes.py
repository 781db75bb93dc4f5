#!/usr/bin/env python3
"""Makes the P3-DX's meshes (meshes/*.obj) from the robot's dimensions: run it again after changing
one.
"""

import math
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from solids import COLOURS, Solids, faceted

# Transducers (x m, y m, heading deg) counter-clockwise from the right rear side. The front array
# carries the sonars of ARIA's p3dx-sh; the rear rim has the same facets.
FRONT = [
    (0.069, -0.136, -90),
    (0.114, -0.119, -50),
    (0.148, -0.078, -30),
    (0.166, -0.027, -10),
    (0.166, 0.027, 10),
    (0.148, 0.078, 30),
    (0.114, 0.119, 50),
    (0.069, 0.136, 90),
]
REAR = [
    (-0.157, 0.136, 90),
    (-0.203, 0.119, 130),
    (-0.237, 0.078, 150),
    (-0.255, 0.027, 170),
    (-0.255, -0.027, -170),
    (-0.237, -0.078, -150),
    (-0.203, -0.119, -130),
    (-0.157, -0.136, -90),
]
SONAR_HEIGHT = 0.220
DECK_TOP = 0.248
WHEEL_RADIUS, WHEEL_HALF_WIDTH = 0.0915, 0.0203
CASTER_X, CASTER_RADIUS = -0.211, 0.0375


def body():
    solids = Solids()
    lower = [
        (-0.200, -0.120),
        (0.100, -0.120),
        (0.135, -0.085),
        (0.135, 0.085),
        (0.100, 0.120),
        (-0.200, 0.120),
        (-0.225, 0.095),
        (-0.225, -0.095),
    ]
    solids.prism("red", lower, 0.075, 0.195)
    solids.prism("red", faceted(FRONT + REAR), 0.195, 0.242)
    # The deck: an ellipse squeezed to the body's rim, wider over the wheels.
    deck = []
    for i in range(48):
        a = 2 * math.pi * i / 48
        c, s = math.cos(a), math.sin(a)
        deck.append(
            (
                -0.045 + 0.221 * math.copysign(abs(c) ** 0.8, c),
                0.191 * math.copysign(abs(s) ** 0.8, s),
            )
        )
    solids.prism("black", deck, 0.242, DECK_TOP)
    for x, y, heading in FRONT:
        a = math.radians(heading)
        solids.lathe(
            "gold",
            [(0, 0), (0, 0.018), (0.004, 0.016), (0.004, 0)],
            (x, y, SONAR_HEIGHT),
            (math.cos(a), math.sin(a), 0),
            segments=12,
        )
    # Caster: swivel and wheel, which the drive does not turn.
    solids.box("grey", (CASTER_X - 0.015, -0.024, 0.030), (CASTER_X + 0.045, 0.024, 0.076))
    solids.lathe(
        "tyre",
        [(-0.016, 0), (-0.016, CASTER_RADIUS), (0.016, CASTER_RADIUS), (0.016, 0)],
        (CASTER_X, 0, CASTER_RADIUS),
        (0, 1, 0),
    )
    solids.write(HERE / "meshes/body", COLOURS)


def wheel():
    """In the wheel's own frame: it turns about y."""
    solids = Solids()
    h, r = WHEEL_HALF_WIDTH, WHEEL_RADIUS
    solids.lathe(
        "tyre",
        [(-h, 0), (-h, r - 0.006), (-h + 0.006, r), (h - 0.006, r), (h, r - 0.006), (h, 0)],
        (0, 0, 0),
        (0, 1, 0),
        segments=32,
    )
    solids.lathe(
        "hub",
        [
            (-h - 0.002, 0),
            (-h - 0.002, 0.045),
            (-h, 0.052),
            (h, 0.052),
            (h + 0.002, 0.045),
            (h + 0.002, 0),
        ],
        (0, 0, 0),
        (0, 1, 0),
        segments=10,
    )
    solids.write(HERE / "meshes/wheel", COLOURS)


def devices():
    """The Hokuyo URG-04LX on the deck, its scan plane 0.06 m above it: 50 x 50 x 70 mm."""
    solids = Solids()
    x, z = 0.110, DECK_TOP + 0.060
    solids.box("dark", (x - 0.025, -0.025, DECK_TOP), (x + 0.025, 0.025, DECK_TOP + 0.040))
    solids.lathe(
        "window",
        [(-0.020, 0), (-0.020, 0.021), (0.006, 0.021), (0.010, 0.017), (0.010, 0)],
        (x, 0, z),
        (0, 0, 1),
    )
    solids.write(HERE / "meshes/devices", COLOURS)


if __name__ == "__main__":
    body()
    wheel()
    devices()
