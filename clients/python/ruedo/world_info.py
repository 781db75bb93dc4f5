"""Puts the parts of ruedo/info together, and finds things in it by robot."""

from __future__ import annotations

import struct
from collections import defaultdict
from typing import TYPE_CHECKING, Any

from . import lcmtypes
from .bodies import Body
from .decoding import decode
from .errors import CONTROL, TypeMismatch

if TYPE_CHECKING:
    from .samples import JointLimits

_HEAD = struct.Struct(">qqqihh")  # fingerprint, utime, run_id, epoch, part, nparts
_MOST_PARTS, _MOST_BYTES = 1024, 64 << 20  # of an info


class WorldInfo:
    """A complete ruedo/info; immutable."""

    def __init__(self, parts: list[Any]):
        head = parts[0]
        self.utime: int = head.utime  # of the first message that said this
        self.run_id: int = head.run_id
        self.epoch: int = head.epoch
        self.version: str = head.version
        self.world: str = head.world
        self.seed: int = head.seed
        self.step_us: int = head.step_us
        self.features: int = head.features
        self.paused: bool = head.paused
        self.joint_limits: dict[str, JointLimits] = {}  # of the requested robots
        self.robots: dict[str, Any] = {r.name: r for p in parts for r in p.robots}
        self.devices: dict[str, list[Any]] = defaultdict(list)  # by robot
        self.channels: dict[str, list[Any]] = defaultdict(list)  # by robot
        self.device_channels: dict[tuple[str, str], Any] = {}  # the first output of each
        self.channel_list: list[Any] = [
            c for p in parts for c in p.channels
        ]  # as ruedo/tick counts them
        self.fingerprints: dict[str, int] = {c.name: c.fingerprint for c in self.channel_list}
        self.tick_channel = next(
            (i for i, c in enumerate(self.channel_list) if c.type == "tick_t"), -1
        )
        # One that was removed has no name.
        self.bodies: list[Body] = [
            Body(b.name, b.is_static, b.mass) for p in parts for b in p.bodies if b.name
        ]
        for part in parts:
            for device in part.devices:
                self.devices[device.robot].append(device)
            for channel in part.channels:
                self.channels[channel.robot].append(channel)
                if not channel.input:
                    self.device_channels.setdefault((channel.robot, channel.device), channel)


def _refuse_control_characters(part: Any) -> None:
    """Names are printed, and a terminal obeys control characters."""
    names = [part.version, part.world]
    for robot in part.robots:
        names += [robot.name, robot.model, robot.drive, *robot.wheels]
    for device in part.devices:
        names += [device.robot, device.name, device.kind]
    for channel in part.channels:
        names += [channel.name, channel.robot, channel.device, channel.type]
    names += [body.name for body in part.bodies]
    if CONTROL.search("".join(names)):
        raise ValueError("a name with control characters")


def run_id_of(message: bytes) -> int | None:
    """The run id of a world_info_t; None if this client cannot read it."""
    if len(message) < _HEAD.size or message[:8] != lcmtypes.world_info_t._get_packed_fingerprint():
        return None
    run_id: int = _HEAD.unpack_from(message)[2]
    return run_id


class WorldInfoAssembler:
    """Takes messages of ruedo/info as they come. Used by the receiving thread alone.

    The parts of one info share run, epoch and utime. An info with the same content as the last one,
    which is the rule, is recognised by its bytes and not decoded: with a thousand robots decoding
    takes half a second.
    """

    def __init__(self) -> None:
        self._group: tuple[int, int, int, int] | None = None
        self._parts: dict[int, bytes] = {}
        self._last: list[bytes] = []

    def add(self, data: bytes) -> WorldInfo | None:
        """The info, when this message completed a new one. Raises TypeMismatch for another version
        of the type, and for more than a server sends.
        """
        expected = lcmtypes.world_info_t._get_packed_fingerprint()
        if data[:8] != expected:
            raise TypeMismatch(
                f"ruedo/info carries another version of world_info_t (fingerprint {data[:8].hex()}) than this "
                f"client reads ({expected.hex()}): install the client of the server's version"
            )
        if len(data) < _HEAD.size:
            return None
        _, utime, run_id, epoch, part, nparts = _HEAD.unpack_from(data)
        if not 0 <= part < nparts:
            return None
        if self._group != (run_id, epoch, utime, nparts):
            self._group, self._parts = (run_id, epoch, utime, nparts), {}
        self._parts[part] = data
        self._check_size(nparts)
        if len(self._parts) < nparts:
            return None
        parts = [self._parts[i] for i in range(nparts)]
        self._group, self._parts = None, {}
        content = [p[16:] for p in parts]  # all but fingerprint and utime
        if content == self._last:
            return None
        try:
            decoded = [decode(lcmtypes.world_info_t, p) for p in parts]
            for part_info in decoded:
                _refuse_control_characters(part_info)
            info = WorldInfo(decoded)
        except Exception as error:
            raise TypeMismatch(
                f"a message on ruedo/info is not a valid world_info_t ({error})"
            ) from None
        self._last = content
        return info

    def _check_size(self, nparts: int) -> None:
        """Drops an incomplete info that needs too much memory. Raises TypeMismatch."""
        size = sum(map(len, self._parts.values()))
        if nparts <= _MOST_PARTS and size <= _MOST_BYTES:
            return
        self._group, self._parts = None, {}
        raise TypeMismatch(
            f"ruedo/info has {nparts} parts of {size} bytes so far: a client takes {_MOST_PARTS} parts of "
            f"{_MOST_BYTES} bytes together at most"
        )
