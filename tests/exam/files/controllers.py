"""Controllers of campaigns and hunts, good ones and broken ones."""

import json
import os
import sys
import time

import speeds


def ahead(view):
    """1.2 m ahead of the robot's front is the box."""
    return speeds.AHEAD, 0.0


def stand(view):
    return 0.0, 0.0


def fast(view):
    return 0.5, 0.0


def careful(view):
    """Stands before the box."""
    return (0.5 if view["lrf.ranges"].min() > 0.8 else 0.0), 0.0


def raises(view):
    raise RuntimeError("it is broken")


def raises_late(view):
    return 1 / max(0.0, 1.0 - view.time), 0.0


def exits(view):
    sys.exit(3)


def dies(view):
    os._exit(0)


def hangs(view):
    time.sleep(100)


def eats(view):
    return len(bytearray(1 << 34)), 0.0


def nonsense(view):
    return "left"


def one_number(view):
    return (0.2,)


def not_finite(view):
    return float("nan"), 0.0


def nothing(view):
    return None


def done_at_once(view):
    return "done"


def misreads(view):
    return view["lrf.range"].min(), 0.0


class Made:
    def __call__(self, view):
        return 0.2, 0.0


class Unmade(Made):
    def __init__(self):
        raise ValueError("no such robot")


class Wants(Made):
    def __init__(self, gain):
        self.gain = gain


def gain(view):
    return view.parameters["gain"] * 0.2, 0.0


def length(log):
    return os.path.getsize(log)


def not_a_number(log):
    return float("nan")


def endless(log):
    return float("inf")


def none(log):
    return None


def breaks(log):
    raise KeyError("p3at/pose")


class Planted:
    """Drives to x = 1, slowly, or has a fault of that name."""

    def __init__(self, planted="", turn=0.0):
        self.planted, self.turn = planted, turn

    def __call__(self, view):
        x = view["pose.pos"][0]
        if self.planted == "overshoots" and self.turn > 0.9:
            return 0.7, 0.0
        if self.planted == "stops" and self.turn < -0.9:
            return 0.0, 0.0
        if self.planted == "crashes" and self.turn == 0.0:
            raise ZeroDivisionError("turn")
        if self.planted == "blind":
            return 0.5, 0.0
        ahead = view["lrf.ranges"][60:121].min()
        if self.planted == "squeezes" and self.turn > 0.5:
            return (0.4 if ahead > 0.3 else 0.0), 0.0
        if ahead < 0.5 or x > 0.9:
            return 0.0, 0.0
        return 0.25, 0.0


def from_json(view):
    with open(os.path.join(os.path.dirname(__file__), "gain.json")) as file:
        return json.load(file)["speed"], 0.0


def from_text(view):
    with open(os.path.join(os.path.dirname(__file__), "gain.txt")) as file:
        return float(file.read()), 0.0


def from_picture(view):
    with open(os.path.join(os.path.dirname(__file__), "gain.svg")) as file:
        return float(file.read()), 0.0
