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

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

from ._installation import load_glib

load_glib()  # before anything imports lcm

try:
    from ._version import __version__ as __version__
except ImportError as _error:
    raise ImportError(
        "ruedo's message types were not generated: install the package (pip install clients/python) or "
        "build the target python_types and use BUILD/python"
    ) from _error

if TYPE_CHECKING:
    from . import lcmtypes, markers, samples, vocabulary
    from .bodies import Body, Twist
    from .callbacks import Subscription
    from .engine import Engine as Engine
    from .engine import SavedWorld as SavedWorld
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
    from .launching import find_ruedo, launch
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
    __all__ += ["Engine", "SavedWorld"]

# The same names, by module. Each is loaded on first use, so that `import ruedo` takes little time.
_NAMES = {
    "bodies": "Body Twist",
    "callbacks": "Subscription",
    "errors": "BadWorld LaunchError LeaseLost MotionError NoServer NotSupported RequestError "
    "RuedoError RunEnded Timeout TypeMismatch UnknownName",
    "geometry": "Transform normalize_angle",
    "joints": "Joint JointStream",
    "launching": "find_ruedo launch",
    "lockstep": "Command Message Observations",
    "logs": "Log LogChannel open_log read_log",
    "maps": "Map load_map OccupancyMap",
    "motion": "Motion",
    "robot": "Camera Device Robot",
    "simulation": "Simulation connect",
    "stream": "Reader Stream",
    "values": "Sample",
    "world": "World",
}
_HOMES = {name: module for module, names in _NAMES.items() for name in names.split()}
_GENERATED = ("vocabulary", "samples")  # modules that have their names in __all__
_MODULES = ("lcmtypes", "markers", *_GENERATED, *_NAMES)
_COMPILED = ("Engine", "SavedWorld")
_HIDDEN = ("OccupancyMap",)  # for programs of earlier versions


class _Names(list[str]):
    """`help(ruedo)` asks which names are in ``__all__``, and would print each class in full."""

    def __contains__(self, name: object) -> bool:
        return False


def _listed() -> list[str]:
    names = {"lcmtypes", "markers", *_HOMES}
    for module in _GENERATED:
        names.update(import_module(f".{module}", __name__).__all__)
    if find_spec("ruedo._engine"):
        names.update(_COMPILED)
    return sorted(names - set(_HIDDEN))


def __dir__() -> list[str]:
    """The names that users should see."""
    return sorted([*_listed(), "__version__"])


def _home(name: str) -> str:
    """The module that has the name; "": none."""
    if name in _HOMES:
        return _HOMES[name]
    for module in _GENERATED:
        if name in import_module(f".{module}", __name__).__all__:
            return module
    return ""


def _compiled(name: str) -> object:
    try:
        return getattr(import_module(".engine", __name__), name)
    except ImportError as error:
        raise ImportError(
            f"ruedo.{name} is not in this installation of the client: it comes with Ruedo's wheel, for Python 3.11 "
            f"and newer, and with a build of Ruedo, for the Python that built it ({error})"
        ) from error


def _late(name: str) -> object:
    """What is used for the first time."""
    if name == "__all__":
        return _Names(_listed())
    no_such_name = AttributeError(f"module 'ruedo' has no attribute {name!r}")
    listed = name in _MODULES or name in _HOMES
    if name.startswith("_") or (not listed and find_spec(f"ruedo.{name}")):
        raise no_such_name  # of a module `from . import name` asks first, and imports it then
    if name != "lcmtypes" and find_spec("numpy") is None:
        raise ImportError(f"ruedo.{name} needs NumPy, without which there is ruedo.lcmtypes alone")
    if name in _MODULES:
        return import_module(f".{name}", __name__)
    if name in _COMPILED:
        found = _compiled(name)
    elif home := _home(name):
        found = getattr(import_module(f".{home}", __name__), name)
    else:
        raise no_such_name
    globals()[name] = found
    return found


if not TYPE_CHECKING:  # else checkers take any name for one of the package's
    __getattr__ = _late
