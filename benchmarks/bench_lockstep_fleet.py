"""Lockstep from Python with many robots of 24 beams: robot decisions a second at 10 Hz, over each
transport in turn. A decision reads the robot's scan, and commands a velocity.

bench_lockstep_fleet.py [DECISIONS] [ROUNDS] [ROBOTS,...]
bench_lockstep_fleet.py --world ROBOTS > FILE      for the same from C++ and Java

Starts servers of its own; prints the median of each.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path

import ruedo

TRANSPORTS = {"local socket": None, "multicast": "auto"}


def wheel(side: str, y: float) -> str:
    return f"""<link name="{side}"><pose>0 {y} 0.1 -1.5707963267948966 0 0</pose><inertial><mass>0.5</mass></inertial>
      <collision name="c"><geometry><cylinder><radius>0.1</radius><length>0.05</length></cylinder></geometry></collision></link>
      <joint name="{side}_joint" type="revolute"><parent>body</parent><child>{side}</child>
      <axis><xyz expressed_in="__model__">0 1 0</xyz></axis></joint>"""


def robot(i: int) -> str:
    return f"""<model name="r{i}"><pose>{3.0 * (i % 16)} {3.0 * (i // 16)} 0 0 0 0</pose><link name="body"><pose>0 0 0.15 0 0 0</pose>
      <inertial><mass>10</mass></inertial><collision name="c"><geometry><box><size>0.5 0.3 0.2</size></box></geometry></collision>
      <sensor name="lrf" type="gpu_lidar"><update_rate>10</update_rate><lidar><scan><horizontal><samples>24</samples>
      <min_angle>-3.01</min_angle><max_angle>3.14</max_angle></horizontal></scan><range><min>0.1</min><max>8</max></range></lidar></sensor>
      </link>{wheel("left", 0.2)}{wheel("right", -0.2)}
      <ruedo:drive><ruedo:left_joint>left_joint</ruedo:left_joint><ruedo:right_joint>right_joint</ruedo:right_joint></ruedo:drive></model>"""


def world(count: int) -> str:
    return f"""<?xml version="1.0"?><sdf version="1.9" xmlns:ruedo="ruedo"><world name="fleet">
      <physics type="bullet"><max_step_size>0.005</max_step_size></physics><include><uri>model://ground_plane</uri></include>
      {"".join(robot(i) for i in range(count))}</world></sdf>"""


def rate(file: Path, url: str | None, count: int, decisions: int) -> float:
    with ruedo.launch(file, args=["--lockstep", "1"], url=url) as sim:
        robots = [sim.robot(f"r{i}") for i in range(count)]
        scanners = [one.lrf for one in robots]
        seen = sim.step(20)
        begin = time.perf_counter()
        for _ in range(decisions):
            scans = [seen.latest(one) for one in scanners]
            if any(scan is None or scan.ranges[12] < 0.0 for scan in scans):
                raise ruedo.RuedoError("a robot has no scan")
            seen = sim.step(20, [one.velocity_command(0.2, 0.5) for one in robots])
        return count * decisions / (time.perf_counter() - begin)


def main() -> None:
    if sys.argv[1:2] == ["--world"]:
        print(world(int(sys.argv[2])))
        return
    decisions = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    counts = [
        int(count) for count in (sys.argv[3] if len(sys.argv) > 3 else "1,16,64,256").split(",")
    ]
    with tempfile.TemporaryDirectory() as folder:
        for count in counts:
            file = Path(folder) / f"{count}.sdf"
            file.write_text(world(count))
            rates: dict[str, list[float]] = {name: [] for name in TRANSPORTS}
            for _ in range(rounds):
                for name, url in TRANSPORTS.items():
                    try:
                        rates[name].append(rate(file, url, count, max(10, decisions // count)))
                    except ruedo.RuedoError as error:
                        print(f"{count} robots, {name}: {error}", flush=True)
            said = ", ".join(
                f"{name} {statistics.median(each):.0f}" for name, each in rates.items() if each
            )
            print(f"{count} robots: {said} robot-decisions/s", flush=True)


if __name__ == "__main__":
    main()
