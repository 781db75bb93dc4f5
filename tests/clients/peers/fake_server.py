"""A server that lies, for what the real one never does: other versions of a type, broken messages,
silence.

    fake_server.py URL [--wrong-type] [--garbage] [--wrong-info] [--paused]

One robot "p3at" with an LRF at 20 Hz and an odometry that never says anything.
"""

import struct
import sys
import time

from ruedo import lcmtypes  # where the system has no GLib, LCM finds the one of Ruedo's wheel

# isort: split
import lcm


def fingerprint(type_name):
    """As a signed number, which it is in an info."""
    return (getattr(lcmtypes, type_name)().get_hash() ^ 1 << 63) - (1 << 63)


def info(options):
    message = lcmtypes.world_info_t()
    message.run_id, message.nparts, message.version, message.world, message.step_us = (
        7,
        1,
        "9.9.9",
        "fake",
        5000,
    )
    message.paused = "--paused" in options
    robot = lcmtypes.robot_info_t()
    robot.name, robot.drive, robot.watchdog_us = "p3at", "kinematic", 600000
    message.robots, message.nrobots = [robot], 1
    for name, kind, type_name, rate in (
        ("LRF", "lrf", "planar_lidar_t", 20.0),
        ("odometry", "odometry", "odometry_t", 50.0),
    ):
        device = lcmtypes.device_info_t()
        device.robot, device.name, device.kind, device.rate = "p3at", name, kind, rate
        device.orientation = [1.0, 0.0, 0.0, 0.0]
        channel = lcmtypes.channel_info_t()
        channel.name, channel.robot, channel.device, channel.type, channel.rate = (
            f"p3at/{name}",
            "p3at",
            name,
            type_name,
            rate,
        )
        channel.fingerprint = fingerprint(type_name)
        if name == "LRF" and "--wrong-type" in options:
            channel.fingerprint ^= 1
        message.devices.append(device)
        message.channels.append(channel)
    message.ndevices, message.nchannels = len(message.devices), len(message.channels)
    return message


def scan(utime):
    message = lcmtypes.planar_lidar_t()
    message.utime, message.nranges, message.ranges, message.rad0, message.radstep = (
        utime,
        3,
        [1.0, 2.0, 3.0],
        -0.5,
        0.5,
    )
    return message.encode()


def garbage(utime):
    """The right fingerprint, then a length that lies, or too little, in turn."""
    good = scan(utime)
    lies = [
        good[:16] + struct.pack(">i", n) + good[20:] for n in (-1, 0x7FFFFFFF, 0x20000001, 1000)
    ]
    return (lies + [good[:8], good[:11], good[:-1], b""])[utime // 50000 % 8]


def main():
    url, options = sys.argv[1], sys.argv[2:]
    bus = lcm.LCM(url)
    print("up", flush=True)
    start, utime = time.monotonic(), 0
    while True:
        if utime % 200000 == 0:
            encoded = info(options).encode()
            bus.publish(
                "ruedo/info", b"\0" * 8 + encoded[8:] if "--wrong-info" in options else encoded
            )
        bus.publish("p3at/LRF", garbage(utime) if "--garbage" in options else scan(utime))
        tick = lcmtypes.tick_t()
        tick.utime, tick.run_id = utime, 7
        bus.publish("ruedo/tick", tick.encode())
        utime += 50000
        time.sleep(max(0.0, start + utime * 1e-6 - time.monotonic()))


if __name__ == "__main__":
    main()
