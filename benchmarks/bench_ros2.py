"""What a message costs by LCM and by --ros2: a hundred P3-ATs, processor time of the server (user
and system, which other load hardly changes) for each message that goes out. Then how fast a
controller over plain DDS drives the arena's robot, for which the run waits (--wait-for): without
its camera (640 x 480, 15 Hz), with a camera that nobody reads, with one that is read.

bench_ros2.py [SECONDS] [ROUNDS]      RUEDO names the program; needs cyclonedds from PyPI

Each way is run in turn: nowhere (memq), LCM's multicast on this machine, --ros2 with nobody, and
with a reader of scan, odom and joint_states of every robot. A message's cost is what a run takes
more than one that sends nothing, over the messages that it sent. In a network namespace of its own:
tests/clients/isolated.py python3 benchmarks/bench_ros2.py
"""

from __future__ import annotations

import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[1]
ROBOTS = 100
WORLD = f"""<?xml version="1.0"?><sdf version="1.9" xmlns:ruedo="urn:ruedo"><world name="cost">
<physics type="bullet"><max_step_size>0.005</max_step_size></physics><include><uri>model://ground_plane</uri></include>
<ruedo:fleet name="p3at"><include><uri>model://p3at</uri></include><ruedo:count>{ROBOTS}</ruedo:count></ruedo:fleet>
</world></sdf>"""
RUEDO = os.environ.get("RUEDO", "ruedo")
# Pictures would be most of the work.
OPTIONS = [f"--disable=p3at_{i}/camera" for i in range(1, ROBOTS + 1)]
DOMAIN = 77
PORT = 7693  # of LCM
# A reader in a process of its own, which takes samples as bytes: what it costs is not counted.
READER = """
import sys, time
from dataclasses import dataclass
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import uint8
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

participant = DomainParticipant(int(sys.argv[1]))
qos = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(1))
readers = []
for name in ("sensor_msgs LaserScan scan", "nav_msgs Odometry odom", "sensor_msgs JointState joint_states"):
    package, kind, topic = name.split()
    @dataclass
    class Message(IdlStruct, typename=f"{package}::msg::dds_::{kind}_"):
        first: uint8
    for i in range(1, int(sys.argv[2]) + 1):
        readers.append(DataReader(participant, Topic(participant, f"rt/p3at_{i}/{topic}", Message), qos=qos))
print("ready", flush=True)
while True:
    time.sleep(1)
"""

PICTURES = (
    READER[: READER.index("for name")]
    + """
@dataclass
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    first: uint8
reader = DataReader(participant, Topic(participant, "rt/image_raw", Image), qos=qos)
while True:
    time.sleep(1)
"""
)


@dataclass
class Way:
    name: str
    lcm: str
    ros2: bool = False
    read: bool = False


WAYS = (
    Way("nowhere", "memq://"),
    Way("LCM's multicast", f"udpm://239.255.76.67:{PORT}?ttl=0"),
    Way("--ros2, nobody reads", "memq://", ros2=True),
    Way("--ros2, all is read", "memq://", ros2=True, read=True),
)


def cpu(world: Path, way: Way, seconds: float) -> float:
    """Processor time in s of a run of that length; its log, once, says how many messages."""
    command = [RUEDO, "run", world, "--rate", "1", "--duration", str(seconds), "--lcm", way.lcm]
    command += ["--quiet", *OPTIONS, *(["--ros2"] if way.ros2 else [])]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:  # else nothing is sent
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        listener.bind(("", PORT))
        process = subprocess.Popen(
            [str(word) for word in command],
            env={**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"{way.name}: the run ended with status {status}")
    return usage.ru_utime + usage.ru_stime


def messages(world: Path, folder: Path, seconds: float) -> dict[str, int]:
    """{channel's last part: count} of a run's log, which holds what LCM gets."""
    import lcm

    log = folder / "run.lcm"
    command = [RUEDO, "run", world, "--rate", "max", "--duration", str(seconds), "--lcm", "memq://"]
    subprocess.run([*map(str, command), "--quiet", *OPTIONS, "--record", log], check=True)
    found: dict[str, int] = {}
    for event in lcm.EventLog(str(log), "r"):
        if event.channel.startswith("p3at_"):
            last = event.channel.split("/", 1)[1]
            found[last] = found.get(last, 0) + 1
    return found


def main() -> None:
    if sys.argv[1:] == ["driven"]:
        report_driven()
        return
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 3
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        world = folder / "cost.sdf"
        world.write_text(WORLD, encoding="utf-8")
        counts = messages(world, folder, seconds)
        spent: dict[str, list[float]] = {way.name: [] for way in WAYS}
        for _ in range(rounds):
            for way in WAYS:
                reader = None
                if way.read:
                    arguments = [sys.executable, "-c", READER, str(DOMAIN), str(ROBOTS)]
                    reader = subprocess.Popen(arguments, stdout=subprocess.PIPE)
                    reader.stdout.readline()
                spent[way.name].append(cpu(world, way, seconds))
                if reader:
                    reader.kill()
                    reader.wait()
    report(spent, counts, seconds)
    report_driven()


def report_driven() -> None:
    """Also by itself: `bench_ros2.py driven`."""
    for camera, seconds in (("off", 60), ("unread", 60), ("read", 20)):
        factor, cpu_s = driven(seconds, camera)
        print(
            f"a controller of 10 Hz, the camera {camera:6}: {factor:5.1f} times real time, "
            f"{cpu_s / seconds * 1e3:6.1f} ms of CPU a second of sim time"
        )


def driven(seconds: int, camera: str) -> tuple[float, float]:
    """Times real time, and processor time in s, of a run that waits for a controller."""
    arguments = [sys.executable, "-c", PICTURES, str(DOMAIN)]
    reader = subprocess.Popen(arguments) if camera == "read" else None
    command = [RUEDO, "run", SOURCE / "worlds/arena.sdf", "--ros2", "--rate", "max", "--quiet"]
    command += ["--duration", str(seconds), "--lcm", "memq://", "--wait-for", "/cmd_vel@10"]
    command += ["--disable=p3at/camera"] if camera == "off" else []
    process = subprocess.Popen(
        [str(word) for word in command],
        env={**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    controller = subprocess.Popen(
        [
            sys.executable,
            SOURCE / "tests/bridges/ros2/controller.py",
            str(DOMAIN),
            str(seconds * 10),
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    controller.stdout.readline()  # its first answer
    begin = time.monotonic()
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.monotonic() - begin
    for process in filter(None, (controller, reader)):
        process.kill()
        process.wait()
    if status != 0:
        sys.exit(f"with a controller: the run ended with status {status}")
    return seconds / wall, usage.ru_utime + usage.ru_stime


def report(spent: dict[str, list[float]], counts: dict[str, int], seconds: float) -> None:
    median = {name: statistics.median(times) for name, times in spent.items()}
    everything = sum(counts.values())
    read = counts["lrf"] + 2 * counts["odometry"]  # odom and joint_states are made of odometry
    print(f"{ROBOTS} P3-AT, {seconds:g} s of sim time, {everything} messages; medians of runs")
    for name, times in spent.items():
        print(f"{name:22} {median[name]:6.2f} s of CPU   {sorted(round(t, 2) for t in times)}")
    nowhere = median["nowhere"]
    by_lcm = (median["LCM's multicast"] - nowhere) / everything
    by_ros2 = (median["--ros2, all is read"] - median["--ros2, nobody reads"]) / read
    print(f"a message by LCM     {by_lcm * 1e6:6.1f} us ({everything} messages)")
    print(
        f"a message by --ros2  {by_ros2 * 1e6:6.1f} us ({read} messages: scan, odom, joint_states)"
    )


if __name__ == "__main__":
    main()
