"""A lab in a notebook: the program runs here, with the robot and the marks that it has when it is
marked (labs/marking), and the console shows it.
"""

from __future__ import annotations

import json
import math
import random
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import ruedo

LABS = Path(__file__).resolve().parents[1] / "labs"
sys.path[:0] = [str(LABS), str(LABS / "marking")]

import labs
from lab import Robot
from referee import Fault, Ride, understood

FASTER = 4.0  # than real time, while somebody watches


class Attempt(NamedTuple):
    """why: it has not passed; "" where it has. run: as the judge sees it; run.way is where the
    robot truly was, (n, 2) m, ten a second. odometry: where it believed to be, (n, 3) m, m, rad.
    """

    lab: str
    seed: int
    why: str
    run: labs.Run
    odometry: np.ndarray

    @property
    def passed(self) -> bool:
        return not self.why

    def __repr__(self) -> str:
        return f"{self.lab}, seed {self.seed}: " + (
            f"not yet: {self.why}" if self.why else "passed"
        )

    def plot(self, axes: Any = None) -> Any:
        """From above: walls, the true way, what odometry made of it, goals, what was handed in."""
        axes = ruedo.notebook.axes_of(axes)
        for begin, end in labs.walls(self.lab, self.seed):
            axes.plot(*zip(begin, end), color="black", linewidth=3)
        for x, y in labs.posts(self.lab, self.seed):
            axes.add_patch(_circle(x, y, labs.POST, "grey"))
        for colour, (x, y) in labs.beacons(self.lab, self.seed).items():
            axes.add_patch(_circle(x, y, labs.BEACON, colour))
        for x, y in labs.goals(self.lab, self.seed):
            axes.plot(x, y, "*", color="green", markersize=12)
        if self.lab == "mapping" and len(self.run.handed):
            axes.plot(*self.run.handed[:, :2].T, ".", color="tab:orange", label="handed in")
        if self.lab in ("square", "umbmark"):
            axes.plot(*self.odometry[:, :2].T, "--", color="tab:orange", label="odometry")
        if self.lab == "particle_filter" and len(self.run.handed):
            axes.plot(*self.run.handed[0, :2], "x", color="tab:red", label="handed in")
        for name, way in self.run.ways.items():
            axes.plot(*way.T, label="way" if len(self.run.ways) == 1 else name)
            axes.plot(*way[-1], "o", color="black")
        axes.set(aspect="equal", xlabel="x (m)", ylabel="y (m)", title=repr(self)[:70])
        axes.legend(loc="upper right", fontsize="small")
        return axes


def practise(
    program: Callable[[Robot], None], seed: int = 1, *, watch: bool | None = None
) -> Attempt:
    """Drives the lab of the program's name. seed: draws the room, the start and the odometry's
    error. watch: the console, below the cell (default: in a notebook). Errors of the program are
    raised here.
    """
    lab = program.__name__
    if lab not in labs.LABS:
        raise ValueError(f"no lab is called {lab!r}; there are {', '.join(labs.LABS)}")
    watch = _in_notebook() if watch is None else watch
    error = random.Random(f"error {seed}").uniform(-0.025, 0.025)
    with tempfile.TemporaryDirectory(prefix="ruedo-") as folder:
        log = Path(folder, "run.lcm")
        with ruedo.launch(
            labs.world(lab, seed),
            lockstep=1,
            seed=seed,
            record=log,
            view=watch,
            disable=["p3at/camera"],
            settings={"p3at/odometry.track_error": error, "p3at/odometry.slip_noise": 0.0005},
        ) as sim:
            if watch:
                _show(sim)
            robot = _Here(Ride(sim, lab), labs.given(lab, seed), FASTER if watch else math.inf)
            try:
                program(robot)
            except _Over:
                pass
            robot.ride.end(robot.handed, "")
        run = labs.read(str(log))
    why = f"touched {robot.touched}" if robot.touched else ""
    try:
        labs.LABS[lab].judge(run)
    except labs.Failed as failed:
        why = why or str(failed)
    return Attempt(lab, seed, why, run, np.array(robot.odometries))


class _Over(BaseException):
    """The lab's time is over; no `except Exception` of a program stops it."""


class _Here(Robot):
    def __init__(self, ride: Ride, given: dict[str, Any], rate: float) -> None:
        self.ride, self.handed, self.touched = ride, np.zeros((0, 3)), ""
        self._rate, self._began = rate, time.monotonic()
        self.odometries: list[np.ndarray] = []
        self._take(_as_sent(given))
        self._see()

    def _say(self, kind: str, what: Any) -> None:
        try:
            kind, told = understood(json.dumps([kind, what]).encode(), len(self.ride.robots))
        except Fault as error:
            raise ValueError(str(error)) from None
        if kind == "result":
            self.handed = told
        else:
            if self.ride.over:
                raise _Over
            self.ride.drive(told)

    def _hear(self) -> None:
        self._see()
        rest = self._began + self.time / self._rate - time.monotonic()
        time.sleep(max(0.0, rest))
        if self.ride.over:
            raise _Over

    def _see(self) -> None:
        self._take(_as_sent(self.ride.readings()))
        self.odometries.append(self.odometry)
        for robot in self.ride.robots:
            for touch in self.ride.seen.all(robot.collisions):
                self.touched = self.touched or ", ".join(touch.bodies)


def _as_sent(readings: dict[str, Any]) -> dict[str, Any]:
    sent: dict[str, Any] = json.loads(json.dumps(readings))
    return sent


def _in_notebook() -> bool:
    return "IPython" in sys.modules and sys.modules["IPython"].get_ipython() is not None


def _show(sim: ruedo.Simulation) -> None:
    frame = sim.show()
    if _in_notebook():
        from IPython.display import display

        display(frame)


def _circle(x: float, y: float, radius: float, colour: str) -> Any:
    from matplotlib.patches import Circle

    return Circle((x, y), radius, color=colour)
