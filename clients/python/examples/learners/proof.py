"""The trained policy of ../navigate as a controller of campaigns and hunts, and the rooms that it
has never seen. proof.ipynb uses both; so do campaign.yaml and hunt.yaml.
"""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
from ruedo.rooms import TEST_ROOMS, make_room

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "navigate"))
from policy import Policy

SPEED_M_S, GOAL_M = 0.5, 0.4
GAIN = 6.0  # rad/s for each metre nearer than the guard


def room(number: float, obstacles: int = 8) -> str:
    """Test room ``number`` of Navigate-v0, moved so that its goal is at (0, 0): a campaign has one
    goal for all of its rooms.
    """
    made = make_room(TEST_ROOMS + int(number), obstacles=obstacles)

    def moved(pose: re.Match[str]) -> str:
        x, y = float(pose[1]) - made.goal[0], float(pose[2]) - made.goal[1]
        return f"<pose>{x:.4f} {y:.4f}"

    return re.sub(r"<pose>(\S+) (\S+)", moved, made.sdf)


class Learned:
    """Observes what Navigate-v0 does, and drives as the policy says.

    guard: m from the range finder; it turns away from what is nearer. 0: the policy alone.
    """

    def __init__(self, guard: float = 0.0) -> None:
        self.policy, self.guard = Policy.load(), guard

    def __call__(self, view: Any) -> tuple[float, float] | str:
        x, y, _ = view["pose.pos"]
        if math.hypot(x, y) < GOAL_M:
            return "done"  # as the environment's episode ends
        w, _, _, z = view["pose.orientation"]
        ranges = view["lrf.ranges"]
        bearing = math.atan2(-y, -x) - 2.0 * math.atan2(z, w)
        rest = [
            min(math.hypot(x, y) / 8.0, 1.0),
            math.cos(bearing),
            math.sin(bearing),
            float(view["odometry.v"]) / 0.5,
            float(view["odometry.omega"]),
        ]
        observation = np.concatenate([np.clip(ranges / 8.0, 0.0, 1.0), rest])
        ahead, turn = self.policy(observation.astype(np.float32))
        return self.guarded((float(ahead) + 1.0) / 2.0 * SPEED_M_S, float(turn), ranges)

    def guarded(self, speed: float, turn: float, ranges: Any) -> tuple[float, float]:
        """ranges: m, from right to left over 180 degrees."""
        half = len(ranges) // 2
        right, left = (max(0.0, self.guard - side.min()) for side in (ranges[:half], ranges[half:]))
        return speed, float(np.clip(turn + GAIN * (right - left), -1.0, 1.0))
