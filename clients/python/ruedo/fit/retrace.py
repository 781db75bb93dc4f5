"""A simulated robot on the drive of a real one: on its path, or by its commands.

On the path the robot drives arcs from pose to pose, so that its wheels and its odometry turn as the
real ones did, and is put on a pose that it misses, as where a real robot slips sideways. The limits
of its drive do not hold then.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as File
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..launching import launch
from .align import find_path
from .errors import FitError
from .fitting import Robot, mount_of, mount_on, rangefinder_of
from .progress import track
from .recording import Path, Recording, body_steps, wrapped

if TYPE_CHECKING:
    from ..simulation import Simulation

_LEAST_S = 0.05  # between two poses on which the robot is put
_FASTEST_M_S = 5.0  # of a path; more is a jump
_KEPT = ("pose", "odometry", "motion", "collisions")  # kinds of devices; others as the log has them
_SLICE_S = 1.0  # of commands, sent together
_FREE = {  # on the path
    "max_speed": 100,
    "max_turn_rate": 100,
    "acceleration": 1e4,
    "deceleration": 1e4,
    "turn_acceleration": 1e4,
    "watchdog": 0,
    "pose_rate": 100,
}
_OFF = np.array(
    [0.005, 0.005, 0.01]
)  # m, m, rad; a robot that is farther off its path is put there


@dataclass(frozen=True)
class Retraced:
    """begin (s): of the real log's clock where the simulation's is 0. Jumps: of the path."""

    begin: float
    seconds: float
    jumps: int


def retrace(
    recording: Recording,
    world: str | File,
    robot: Robot,
    out: File,
    *,
    by_commands: bool = False,
    delay: float = 0.0,
    seed: int = 1,
) -> Retraced:
    """Records `out`. delay: s until a command acts. Raises FitError, LaunchError for the world."""
    path = robot_path(recording, robot)
    commands = recording.commands
    if by_commands and commands is None:
        recording.need("commands", "--commands needs velocity commands")
    x, y, heading = path.pose[0]
    lrf = None
    if recording.scans is not None:
        lrf = rangefinder_of(robot, recording.scans.ranges.shape[1])
    kept = (*_KEPT, *(["lrf"] if lrf else []), *(["imu"] if recording.imu is not None else []))
    settings = {} if by_commands else {f"{robot.name}/velocity.{k}": v for k, v in _FREE.items()}
    if lrf is not None and recording.scans is not None and len(recording.scans.time) > 1:
        rate = 1 / float(np.median(np.diff(recording.scans.time)))
        settings[f"{robot.name}/{lrf['name']}.update_rate"] = float(f"{min(rate, 100.0):.4g}")
    with launch(
        world,
        spawn=[f"{robot.file}:{robot.name}@{x:.9g},{y:.9g},{heading:.9g}"],
        disable=[f"{robot.name}/{one['name']}" for one in robot.devices if one["kind"] not in kept],
        settings=settings,
        seed=seed,
        rate="max",
        lockstep=1,
        record=out,
    ) as simulation:
        if by_commands:
            return _command(simulation, robot.name, recording, path, delay)
        return _impose(simulation, robot.name, path)


def robot_path(recording: Recording, robot: Robot) -> Path:
    """The path of base_link: where the log has the range finder's own poses, by its mount."""
    scans = recording.scans
    if scans is not None and scans.pose is not None:
        lrf = rangefinder_of(robot, scans.ranges.shape[1])
        if lrf is None:
            raise FitError(
                f"{robot.file}: no range finder, and the path of {recording.file} is that of one"
            )
        x, y, turn = mount_of(lrf)
        heading = scans.pose[:, 2] - turn
        sine, cosine = np.sin(heading), np.cos(heading)
        place = scans.pose[:, :2] - np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)
        path = Path(scans.time, np.column_stack([place, heading]), "SLAM")
    else:
        find_path(recording, mount_on(recording, robot))
        recording.need("truth", "a path is needed (SLAM, motion capture, /tf map->odom, pose)")
        assert recording.truth is not None
        path = recording.truth
    if len(path.time) < 2:
        raise FitError(f"{recording.file}: {len(path.time)} poses; a drive is needed")
    return path


def _steps_of(path: Path, step_s: float) -> NDArray[np.int64]:
    """The steps at which the robot is put: at the path's times, thinned out."""
    at = np.round((path.time - path.time[0]) / step_s).astype(np.int64)
    least = max(1, round(_LEAST_S / step_s))
    return np.unique(at // least * least)


def _impose(simulation: Simulation, name: str, path: Path) -> Retraced:
    h = simulation.step_size
    robot = simulation.robot(name)
    at = _steps_of(path, h)
    poses = path.at(path.time[0] + at * h)
    sideways = robot.drive.split(" ")[-1] in ("mecanum", "omni", "holonomic")
    jumps = 0
    now = poses[0]
    for n, goal in track(list(zip(np.diff(at).tolist(), poses[1:])), "retracing"):
        ahead, left, turn = body_steps(np.array([now, goal]))[0] / (n * h)
        jumped = np.hypot(ahead, left) > _FASTEST_M_S
        jumps += int(jumped)
        command = robot.velocity_command(
            0.0 if jumped else ahead,
            0.0 if jumped else turn,
            left if sideways and not jumped else 0.0,
        )
        seen = simulation.step(n, [command]).latest(robot.pose)
        if seen is not None:
            now = np.array([*seen.position[:2], seen.heading])
        now[2] = goal[2] + wrapped(now[2] - goal[2])
        if np.any(np.abs(now - goal) > _OFF):
            x, y, heading = goal.tolist()
            simulation.set_pose(name, x, y, heading)
            now = goal
    simulation.step(1, [robot.velocity_command(0.0, 0.0)])
    return Retraced(float(path.time[0]), float(at[-1] * h), jumps)


def _command(
    simulation: Simulation, name: str, recording: Recording, path: Path, delay: float
) -> Retraced:
    commands = recording.commands
    assert commands is not None
    h, begin = simulation.step_size, float(path.time[0])
    robot = simulation.robot(name)
    last = round((max(float(path.time[-1]), float(commands.time[-1])) - begin) / h)
    when = np.round((commands.time + delay - begin) / h).astype(np.int64)
    when = when[max(int(np.searchsorted(when, 0, side="right")) - 1, 0) :].clip(min=0)
    value = commands.value[len(commands.value) - len(when) :].tolist()
    size = round(_SLICE_S / h)
    for start in track(range(0, last, size), "retracing"):
        n = min(size, last - start)
        chosen = np.flatnonzero((when >= start) & (when < start + n))
        sent = [
            robot.velocity_command(v, omega, left).at(int(when[k]) - start)
            for k in chosen.tolist()
            for v, left, omega in (value[k],)
        ]
        simulation.step(n, sent)
    return Retraced(begin, last * h, 0)
