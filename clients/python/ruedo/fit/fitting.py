"""A fit as a whole: from logs and a robot to values, elements for its file, and a report."""

from __future__ import annotations

import json
import math
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path as File
from typing import Any

import numpy as np

from ..engine import Engine
from ..launching import find_ruedo
from .align import find_path
from .beams import HEIGHT_M, fit_beams_in
from .drives import Drive
from .encoders import NAME as TICKS
from .encoders import fit_ticks
from .errors import FitError
from .estimate import Estimate, normal
from .mapping import own_mount
from .motion import fit_motion
from .odometry import OdometryFit, fit_odometry
from .progress import track
from .rangefinder import BeamModel, fit_rangefinder
from .recording import Array, Geometry, Recording, body_steps
from .resume import Kept
from .robot_file import Setting, write_fitted
from .streams import fit_imu, fit_timing


@dataclass
class Robot:
    """A robot's model: its file, its nominal measures, its devices of ruedo info."""

    name: str
    file: File
    geometry: Geometry
    info: dict[str, Any]
    devices: list[dict[str, Any]]


def read_robot(name: str) -> Robot:
    """By its file or the name of one of Ruedo's. Raises FitError."""
    placed = [] if File(name).exists() else [f"{name}@0,0"]
    world = "empty" if placed else name
    options = ["--json", "--quiet", *(f"--spawn={one}" for one in placed)]
    done = subprocess.run(
        [find_ruedo(), "info", *options, "--", world], capture_output=True, text=True
    )
    if done.returncode:
        raise FitError(done.stderr.strip().removeprefix("ruedo: ") or f"{name}: no robot")
    info = json.loads(done.stdout)
    driven = [one for one in info["robots"] if one["drive"]]
    if len(driven) != 1:
        raise FitError(f"{name}: {len(driven)} robots with a drive; a model of one is needed")
    robot = driven[0]
    kind = {"kinematic": "differential", "wheels": "differential"}.get(
        robot["drive"], robot["drive"]
    )
    if kind.endswith("tracked"):
        kind = "differential"
    with Engine(world, spawn=placed, allow_errors=True) as engine:
        file = _model_file([File(one) for one in engine.files_read], name)
    geometry = Geometry(kind.split(" ")[-1], robot["wheel_radius"], robot["track"])
    return Robot(robot["name"], file, geometry, robot, info["devices"])


def _model_file(files: list[File], name: str) -> File:
    """The robot's own file among those that were read."""
    if File(name).is_file():
        return File(name)
    for one in files:
        if one.parent.name == name or one.stem == name:
            return one
    raise FitError(f"{name}: its SDF file was not found; --robot also takes a file")


@dataclass
class Fit:
    """Estimates by part ("Odometry"), elements for the robot's file, and remarks."""

    recordings: list[Recording]
    parts: dict[str, list[Estimate]] = field(default_factory=dict)
    settings: list[Setting] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    odometry: OdometryFit | None = None
    beams: BeamModel | None = None

    def as_dict(self) -> dict[str, Any]:
        """The result for --json: {part: [{name, value, low, high, unit, why}]}."""
        return {
            "logs": [str(one.file) for one in self.recordings],
            "remarks": self.remarks,
            "parts": {
                part: [
                    {
                        "name": one.name,
                        "value": one.value,
                        "low": _finite(one.low),
                        "high": _finite(one.high),
                        "unit": one.unit,
                        "why": one.why,
                    }
                    for one in estimates
                ]
                for part, estimates in self.parts.items()
            },
            "settings": {one.path: one.value for one in self.settings},
        }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def fit(
    recordings: Sequence[Recording],
    robot: Robot | None = None,
    mount: Sequence[float] | None = None,
    kept: Kept | None = None,
    world: str | File | None = None,
) -> Fit:
    """Everything that the logs determine. mount: x, y (m), heading (rad) of the range finder on the
    robot; None: the model's, or the origin where the log gives the range finder's own poses. kept:
    where the results of each stage are kept until the last one is done. world: where the drives
    were. Raises FitError where nothing is determined, and RuedoError for the world.
    """
    answer = Fit(list(recordings))
    for one in recordings:
        find_path(one, mount_on(one, robot) if mount is None else np.asarray(mount, float))
        answer.remarks += [f"{one.file}: {finding}" for finding in one.findings]
    stages: list[Callable[[], None]] = [
        lambda: _fit_drive(answer, robot),
        lambda: _fit_scans(answer, robot, mount),
        lambda: _fit_beams(answer, robot, mount, world),
        lambda: _fit_motion(answer),
        lambda: _fit_streams(answer),
    ]
    done, found = (kept.load() if kept else None) or (0, {})
    vars(answer).update(found)
    for number, stage in track(list(enumerate(stages, 1))[done:], "fitting"):
        stage()
        if kept:
            kept.save((number, {k: v for k, v in vars(answer).items() if k != "recordings"}))
    if kept:
        kept.drop()
    if not answer.parts:
        raise FitError("; ".join(answer.remarks))
    return answer


def _fit_drive(answer: Fit, robot: Robot | None) -> None:
    first = answer.recordings[0]
    geometry = first.geometry or (robot.geometry if robot else None)
    if geometry is None:
        answer.remarks.append("odometry is not fitted: --robot gives the nominal radius and track")
        return
    if first.wheels is None and first.odometry is None:
        answer.remarks.append(
            f"odometry, slip and motion are not fitted: this {first.kind} has no raw odometry or encoders"
        )
        return
    try:
        found = fit_odometry(answer.recordings, geometry)
    except FitError as error:
        answer.remarks.append(f"odometry is not fitted: {error}")
        return
    answer.odometry = found
    found.estimates.append(fit_ticks(first))
    answer.parts["Odometry"] = found.estimates
    if geometry.kind == "differential" and robot is not None:
        _drive_settings(answer, found, robot)


def _fit_scans(answer: Fit, robot: Robot | None, mount: Sequence[float] | None) -> None:
    recording = next((one for one in answer.recordings if one.scans is not None), None)
    if recording is None:
        return
    assert recording.scans is not None
    device = None if robot is None else rangefinder_of(robot, recording.scans.ranges.shape[1])
    place = mount_on(recording, robot) if mount is None else np.asarray(mount, float)
    try:
        model, estimates = fit_rangefinder([recording], place)
    except FitError as error:
        answer.remarks.append(f"the range finder is not fitted: {error}")
        return
    answer.parts["Range finder"] = estimates
    answer.beams = model
    if robot is None:
        return
    if device is None:
        answer.remarks.append(
            f"{robot.file}: no range finder with {recording.scans.ranges.shape[1]} rays; the scans' "
            "values are reported and not written"
        )
        return
    sensor = f"sensor[{device['name']}]"
    source = f"fitted to {recording.file.name}, 95 %: "
    kind = "lidar" if "<lidar>" in robot.file.read_text(encoding="utf-8") else "ray"
    paths = {
        "range noise": [f"{sensor}/{kind}/noise/stddev", f"{sensor}/{kind}/noise/type"],
        "bearing noise": [f"{sensor}/ruedo:bearing_noise"],
        "resolution": [f"{sensor}/{kind}/range/resolution"],
    }
    for one in estimates:
        if one.value is None or one.name not in paths:
            continue
        interval = f"{one.low:.5g} to {one.high:.5g}" if math.isfinite(one.low) else one.why
        for path in paths[one.name]:
            value = "gaussian" if path.endswith("type") else f"{one.value:.5g}"
            answer.settings.append(Setting(path, value, source + interval))


def _fit_beams(
    answer: Fit, robot: Robot | None, mount: Sequence[float] | None, world: str | File | None
) -> None:
    recording = next((one for one in answer.recordings if one.scans is not None), None)
    if world is None or recording is None:
        return
    assert recording.scans is not None
    place = mount_on(recording, robot) if mount is None else np.asarray(mount, float)
    device = None if robot is None else rangefinder_of(robot, recording.scans.ranges.shape[1])
    height = HEIGHT_M if device is None else float(device["position"][2])
    try:
        answer.parts[f"Beams in {world}"] = fit_beams_in(world, recording, place, height)
    except FitError as error:
        answer.remarks.append(f"shares of beams are not fitted: {error}")


def rangefinder_of(robot: Robot, rays: int) -> dict[str, Any] | None:
    """The robot's planar range finder with so many rays, or its only one."""
    every = [one for one in robot.devices if one["kind"] == "lrf"]
    fitting = [one for one in every if one["width"] == rays]
    return fitting[0] if fitting else every[0] if len(every) == 1 else None


def mount_on(recording: Recording, robot: Robot | None) -> Array:
    """x, y (m) and heading (rad) of the range finder: zeros where the log has its own poses, else
    as the model says, or the log.
    """
    scans = recording.scans
    if robot is not None and scans is not None and scans.pose is None:
        device = rangefinder_of(robot, scans.ranges.shape[1])
        if device is not None:
            return mount_of(device)
    return own_mount(recording)


def mount_of(device: dict[str, Any]) -> Array:
    """x, y (m) and heading (rad) of a device on its robot."""
    w, x, y, z = device["orientation"]
    heading = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.array([*device["position"][:2], heading])


def believed_measures(recording: Recording, geometry: Geometry) -> Array:
    """Radii and track that the robot's own odometry computes with: from its encoders and its
    odometry where a log has both, else the nominal ones.
    """
    nominal = Drive(geometry).nominal()
    if recording.wheels is None or recording.odometry is None:
        return nominal
    time = recording.wheels.time
    steps = body_steps(recording.odometry.at(time))
    turned = np.diff(recording.wheels.turned, axis=0)
    if np.any(np.abs(turned).sum(axis=0) == 0):
        return nominal
    ahead, *_ = np.linalg.lstsq(turned / 2, steps[:, 0], rcond=None)
    turn, *_ = np.linalg.lstsq(turned * [-ahead[0], ahead[1]], steps[:, 2:], rcond=None)
    track = 1 / float(turn.mean()) if turn.mean() > 0 else nominal[2]
    return np.array([*ahead, track])


def _fit_streams(answer: Fit) -> None:
    if timing := fit_timing(answer.recordings):
        answer.parts["Timing"] = timing
    if answer.recordings[0].imu is not None:
        answer.parts["IMU"] = fit_imu(answer.recordings[0])


def _fit_motion(answer: Fit) -> None:
    first = answer.recordings[0]
    motion = fit_motion(first)
    if not motion:
        if first.commands is None and (first.wheels or first.odometry):
            answer.remarks.append(
                f"delay, acceleration and limits are not fitted: this {first.kind} has no velocity "
                "commands"
            )
        return
    answer.parts["Motion"] = motion
    source = f"fitted to {answer.recordings[0].file.name}, 95 %: "
    elements = {
        "speed: acceleration": "acceleration",
        "speed: deceleration": "deceleration",
        "turn rate: acceleration": "turn_acceleration",
        "speed: limit": "max_speed",
        "turn rate: limit": "max_turn_rate",
    }
    for one in motion:
        if one.value is not None and one.name in elements:
            path = f"ruedo:drive/ruedo:{elements[one.name]}"
            interval = f"{one.low:.5g} to {one.high:.5g}"
            answer.settings.append(Setting(path, f"{one.value:.5g}", source + interval))


def _drive_settings(answer: Fit, found: OdometryFit, robot: Robot) -> None:
    """The drive gets the true measures; its odometry the errors of those that the robot believes
    in.
    """
    names = ", ".join(one.file.name for one in answer.recordings)
    believed = believed_measures(answer.recordings[0], found.drive.geometry)
    relative = np.sqrt(np.diag(found.covariance))[:3] / found.parameters
    errors = believed / found.parameters - 1
    estimates = []
    for name, error, std, known in zip(
        ("left radius error", "right radius error", "track error"),
        errors,
        relative,
        found.determined,
    ):
        if known:
            estimates.append(
                normal(name, float(error), float(std), "", "believed over true, less 1")
            )
    answer.parts["Odometry"] = found.estimates + estimates
    source = f"fitted to {names}, 95 %: "

    def put(path: str, value: str, one: list[Estimate]) -> None:
        text = "; ".join(f"{e.low:.5g} to {e.high:.5g}" for e in one)
        answer.settings.append(Setting(path, value, source + text))

    by_name = {one.name: one for one in answer.parts["Odometry"] if one.value is not None}
    if found.determined[:2].all():
        radius = float(found.parameters[:2].mean())
        sides = [by_name["left radius"], by_name["right radius"]]
        put("ruedo:drive/ruedo:wheel_radius", f"{radius:.6g}", sides)
        sides = [by_name["left radius error"], by_name["right radius error"]]
        put("ruedo:odometry/ruedo:radius_error", f"{errors[0]:.5g} {errors[1]:.5g}", sides)
    if found.determined[2]:
        put("ruedo:drive/ruedo:track", f"{found.parameters[2]:.6g}", [by_name["track"]])
        put("ruedo:odometry/ruedo:track_error", f"{errors[2]:.5g}", [by_name["track error"]])
    if TICKS in by_name:
        ticks, why = round(by_name[TICKS].value or 0), by_name[TICKS].why
        answer.settings.append(
            Setting("ruedo:odometry/ruedo:ticks_per_turn", f"{ticks}", source + why)
        )
    if "slip noise" in by_name:
        put("ruedo:odometry/ruedo:slip_noise", f"{found.slip:.5g}", [by_name["slip noise"]])


def save(answer: Fit, robot: Robot, out: File) -> None:
    """The fitted robot as a file that runs."""
    if out.resolve() == robot.file.resolve():
        raise FitError(f"{out}: it is the robot's own file; the fitted one needs another name")
    names = ", ".join(one.file.name for one in answer.recordings)
    write_fitted(robot.file, answer.settings, out, f"{robot.name}, fitted by ruedo fit to {names}.")
