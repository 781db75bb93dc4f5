"""The joints of a robot by their names: states, limits and commands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

from . import lcmtypes
from .arguments import finite, shown, text
from .errors import NotSupported, UnknownName
from .samples import JointLimits, Joints
from .session.control import reply_of
from .session.link import Link
from .stream import Stream
from .vocabulary import JOINT_MODES, JointMode

if TYPE_CHECKING:
    from .session.control import Session

# Modes for a detachable joint, a lift or a door instead of a joint: the server knows the names.
_OF_OTHERS = (JointMode.ATTACHED, JointMode.FLOOR, JointMode.OPEN)


class _Link(Link, Protocol):
    @property
    def session(self) -> Session: ...


class _Robot(Protocol):
    name: str

    @property
    def joints(self) -> JointStream: ...
    def command_joints(self, values: Mapping[str, float], *, mode: str) -> None: ...


class Joint:
    """A joint of a robot, from ``robot.joints["elbow"]``.

    kind: "revolute", "continuous", "prismatic", ... lower, upper: rad or m, infinite where there is
    no limit. max_velocity: rad/s or m/s. max_effort: N m or N. takes_commands: False of a joint
    that mimics another. holds: True where the file has a controller, a transmission or a servo for
    it: it holds its position until its first command. The others are free until then.
    """

    def __init__(self, robot: _Robot, limits: JointLimits, index: int):
        self._robot = robot
        self.name: str = limits.names[index]
        self.kind: str = limits.kinds[index]
        self.lower = float(limits.lower[index])
        self.upper = float(limits.upper[index])
        self.max_velocity = float(limits.max_velocities[index])
        self.max_effort = float(limits.max_efforts[index])
        self.takes_commands = bool(limits.takes_commands[index])
        self.holds = bool(limits.holds[index])

    @property
    def position(self) -> float:
        """rad or m, of the newest sample. Setting it commands it: the joint moves there within its
        limits, and holds it until its next command. Raises NotSupported in lockstep.
        """
        return self._state.position(self.name)

    @position.setter
    def position(self, value: float) -> None:
        self._robot.command_joints({self.name: value}, mode="position")

    @property
    def velocity(self) -> float:
        """rad/s or m/s; setting it commands it, until the joint's next command."""
        return self._state.velocity(self.name)

    @velocity.setter
    def velocity(self, value: float) -> None:
        self._robot.command_joints({self.name: value}, mode="velocity")

    @property
    def effort(self) -> float:
        """N m or N; setting it commands it, until the joint's next command."""
        return self._state.effort(self.name)

    @effort.setter
    def effort(self, value: float) -> None:
        self._robot.command_joints({self.name: value}, mode="effort")

    @property
    def _state(self) -> Joints:
        return self._robot.joints.latest()

    def __repr__(self) -> str:
        return (
            f"<Joint {self._robot.name}/{self.name}: {self.kind}, {self.lower:g} to {self.upper:g}>"
        )


class JointStream(Stream[Joints]):
    """The states of a robot's joints, and the joints themselves by their names."""

    _of_robot: _Robot

    _link: _Link

    def attach(self, robot: _Robot, link: _Link) -> JointStream:
        """Says whose joints they are."""
        self._of_robot, self._link = robot, link
        return self

    def __getitem__(self, name: str) -> Joint:
        """Raises UnknownName, which lists the joints."""
        limits = limits_of(self._link, self._of_robot.name)
        return Joint(
            self._of_robot, limits, limits.names.index(checked(self._of_robot.name, limits, name))
        )

    @property
    def names(self) -> list[str]:
        """The names of all joints, in the order of the samples."""
        return list(limits_of(self._link, self._of_robot.name).names)


def limits_of(link: _Link, robot: str) -> JointLimits:
    """Asked for once, and again where the world has changed."""
    known = link.info.joint_limits
    if robot not in known:
        body = lcmtypes.name_request_t()
        body.name = robot
        reply = link.session.request(lcmtypes.request_t.GET_JOINT_LIMITS, body)
        known[robot] = reply_of(reply, "joint_limits_t")
    return known[robot]


def checked(robot: str, limits: JointLimits, name: str) -> str:
    """Raises UnknownName."""
    if text("name", name) not in limits.names:
        raise UnknownName(
            f"{robot} has no joint {shown(name)}; it has {', '.join(limits.names) or 'none'}"
        )
    return name


def message(robot: str, limits: JointLimits, values: Mapping[str, float], mode: str) -> Any:
    """A joint_command_t without its time. Raises UnknownName, NotSupported, TypeError and
    ValueError.
    """
    if not isinstance(values, Mapping):
        raise TypeError(f'values is a dict, {{"elbow": 0.3}}, not {shown(values)}')
    modes = {str(one): number for number, one in JOINT_MODES.items()}
    if mode not in modes:
        raise ValueError(f"mode is {shown(mode)}: it must be one of {', '.join(map(repr, modes))}")
    command = lcmtypes.joint_command_t()
    command.n = len(values)
    for name, value in values.items():
        if mode not in _OF_OTHERS:
            index = limits.names.index(checked(robot, limits, name))
            if not limits.takes_commands[index]:
                raise NotSupported(
                    f"the {limits.kinds[index]} joint {name} of {robot} takes no commands"
                )
        command.name.append(text("name", name))
        command.value.append(finite(name, value))
    command.mode = bytes([modes[mode]] * command.n)
    return command
