"""Ruedo's client for Python: connect to a robot simulation, read its sensors, drive its robots.

    import ruedo

    with ruedo.launch("arena") as sim:          # a server of its own, which waits for this program
        robot = sim.robot("p3at")
        robot.set_velocity(0.3, 0.0)            # m/s, rad/s; holds until changed
        while robot.lrf.next().nearest(-0.5, 0.5) > 0.8:
            pass
        robot.stop().wait()

Begin      launch(world)      a private server; connect() joins one that runs
           World()            a world that the program builds
           Engine(world)      many worlds in this process, without a server
Use        Simulation         robots, time, sleep, step, pause, reset, spawn, set_pose, state
           Robot              set_velocity, stop, advance, rotate, turn_to, arc; its sensors
           Device, Stream     latest(), next(), on_sample() of a sensor
           Motion             wait(), done, reason of a primitive
           Command            a command for a step of lockstep
Samples    Scan, Odometry, Pose, Image, Imu, ...: fields with units
Logs       open_log(file)     arrays by channel and time; read_log(file) gives data frames
           load_map(file)     an occupancy map
Errors     RuedoError         and below it NoServer, Timeout, MotionError, UnknownName, ...
Modules    ruedo.markers      what programs draw for people
           ruedo.gym          environments for learning
           ruedo.lcmtypes     the message types themselves

Units are SI, angles radians; x ahead, y left, z up. `help(ruedo.Robot)` and so on has the details,
`dir(ruedo)` every name, and the command `ruedo docs` opens the documentation.
"""

from importlib.util import find_spec
from types import SimpleNamespace
from typing import TYPE_CHECKING

from ._installation import load_glib

load_glib()  # before anything imports lcm

try:
    from . import lcmtypes
    from ._version import __version__ as __version__
except ImportError as _error:
    raise ImportError(
        "ruedo's message types were not generated: install the package (pip install clients/python) or "
        "build the target python_types and use BUILD/python"
    ) from _error

_HAS_NUMPY = find_spec("numpy") is not None  # programs of plain LCM need the message types alone
if TYPE_CHECKING or _HAS_NUMPY:
    from . import markers, samples, vocabulary
    from .bodies import Body, Twist
    from .callbacks import Subscription
    from .errors import (
        BadWorld,
        LaunchError,
        LeaseLost,
        MotionError,
        NoServer,
        NotSupported,
        RequestError,
        RuedoError,
        RunEnded,
        Timeout,
        TypeMismatch,
        UnknownName,
    )
    from .geometry import Transform, normalize_angle
    from .joints import Joint, JointStream
    from .launch import find_ruedo, launch
    from .lockstep import Command, Message, Observations
    from .logs import Log, LogChannel, open_log, read_log
    from .maps import Map, load_map
    from .maps import OccupancyMap as OccupancyMap
    from .motion import Motion
    from .robot import Camera, Device, Robot
    from .samples import *  # noqa: F403
    from .simulation import Simulation, connect
    from .stream import Reader, Stream
    from .values import Sample
    from .vocabulary import *  # noqa: F403
    from .world import World
else:
    samples = vocabulary = SimpleNamespace(__all__=[])


if TYPE_CHECKING:
    from .engine import Engine as Engine
    from .engine import SavedWorld as SavedWorld


def __dir__() -> list[str]:
    """The names that users should see."""
    return sorted([*__all__, "__version__"])


def _late(name: str) -> object:
    """``ruedo.Engine`` and its snapshots need the compiled part of the package: loaded on first
    use.
    """
    if not _HAS_NUMPY and not name.startswith("_"):
        raise ImportError(f"ruedo.{name} needs NumPy, without which there is ruedo.lcmtypes alone")
    if name not in ("Engine", "SavedWorld"):
        raise AttributeError(f"module 'ruedo' has no attribute {name!r}")
    try:
        from . import engine
    except ImportError as error:
        raise ImportError(
            f"ruedo.{name} is not in this installation of the client: it comes with Ruedo's wheel, for Python 3.11 "
            f"and newer, and with a build of Ruedo, for the Python that built it ({error})"
        ) from error
    return getattr(engine, name)


if not TYPE_CHECKING:  # else checkers take any name for one of the package's
    __getattr__ = _late


__all__ = [
    "BadWorld",
    "Body",
    "Camera",
    "Command",
    "Device",
    "Joint",
    "JointStream",
    "LaunchError",
    "LeaseLost",
    "Log",
    "LogChannel",
    "Map",
    "Message",
    "Motion",
    "MotionError",
    "NoServer",
    "NotSupported",
    "Observations",
    "Reader",
    "RequestError",
    "Robot",
    "RuedoError",
    "RunEnded",
    "Sample",
    "Simulation",
    "Stream",
    "Subscription",
    "Timeout",
    "Transform",
    "Twist",
    "TypeMismatch",
    "UnknownName",
    "World",
    "connect",
    "find_ruedo",
    "launch",
    "lcmtypes",
    "load_map",
    "markers",
    "normalize_angle",
    "open_log",
    "read_log",
]
__all__ += samples.__all__ + vocabulary.__all__
if find_spec("ruedo._engine"):
    __all__ += ["Engine", "SavedWorld"]


class _Names(list[str]):
    """`help(ruedo)` asks which names are in ``__all__``, and would print each class in full."""

    def __contains__(self, name: object) -> bool:
        return False


if not TYPE_CHECKING:
    __all__ = _Names(__all__)  # noqa: PLE0605
