"""MVSim on the benchmark's map, at its best: no window, steps of 10 ms, rays in the plane, nothing
published. Differential robots under its PID controller of twists.

`mvsim launch` goes at a given rate without end, so it gets one that it cannot reach, and ends at
SIGINT; how far it came is in the true paths that it writes.
"""

from __future__ import annotations

import math
import signal
import subprocess
import time
from pathlib import Path

import programs
import rooms as bench

STEP_S = 0.01
UNREACHED = 1e6  # times real time
ENDS_WITHIN_S = 10.0
LOADS_WITHIN_S = 300.0

VEHICLE = """
<vehicle:class name="robot">
  <dynamics class="differential">
    <l_wheel pos="0.0  0.2" mass="1.0" width="0.08" diameter="0.22"/>
    <r_wheel pos="0.0 -0.2" mass="1.0" width="0.08" diameter="0.22"/>
    <chassis mass="18.0" zmin="0.05" zmax="0.28">
      <shape><pt>-0.25 -0.25</pt><pt>-0.25 0.25</pt><pt>0.25 0.25</pt><pt>0.25 -0.25</pt></shape>
    </chassis>
    <controller class="twist_pid"><KP>5</KP><KI>2</KI><KD>0</KD><max_torque>15</max_torque>
      <V>{speed}</V><W>{turn_rate_deg}</W></controller>
  </dynamics>
  <friction class="default"><mu>0.7</mu><C_damping>0.1</C_damping></friction>
</vehicle:class>
"""

LASER = """
<sensor class="laser" name="lrf"><pose_3d>0 0 {height} 0 0 0</pose_3d><fov_degrees>{fov}</fov_degrees>
<nrays>{rays}</nrays><sensor_period>{period}</sensor_period><max_range>{range}</max_range>
<range_std_noise>0</range_std_noise><angle_std_noise_deg>0</angle_std_noise_deg>
<raytrace_3d>false</raytrace_3d></sensor>
"""


def make_xml(rooms: bench.Rooms) -> str:
    walls = "".join(
        f'<block name="w{i}"><init_pose>{b.center[0]} {b.center[1]} 0</init_pose><static>true</static>'
        f'<zmin>0</zmin><zmax>{b.size[2]}</zmax>'
        f'<geometry type="box" lx="{b.size[0]}" ly="{b.size[1]}" lz="{b.size[2]}"/></block>'
        for i, b in enumerate(rooms.walls)
    )
    laser = LASER.format(
        height=bench.LRF_HEIGHT_M,
        fov=bench.LRF_RAYS - 1,
        rays=bench.LRF_RAYS,
        period=1.0 / bench.LRF_RATE_HZ,
        range=bench.LRF_RANGE_M,
    )
    robots = "".join(
        f'<vehicle name="r{i}" class="robot"><init_pose>{s.x} {s.y} {math.degrees(s.yaw)}</init_pose>'
        f"{laser}</vehicle>"
        for i, s in enumerate(rooms.starts)
    )
    vehicle = VEHICLE.format(
        speed=bench.SPEED_M_S, turn_rate_deg=math.degrees(bench.TURN_RATE_RAD_S)
    )
    return (
        f'<mvsim_world version="1.0"><simul_timestep>{STEP_S}</simul_timestep>'
        "<save_ground_truth_trajectory>truth.txt</save_ground_truth_trajectory>"
        f"<ground_truth_rate>{1.0 / STEP_S}</ground_truth_rate>"
        f"{vehicle}{walls}{robots}</mvsim_world>"
    )


def simulated_s(path: Path) -> float:
    """From the first to the last line of a true path, each of which begins with its time."""
    times = [
        float(line.split()[0]) for line in path.read_text().splitlines() if line.count(" ") == 7
    ]
    return times[-1] - times[0] if times else 0.0


def end(process: subprocess.Popen[bytes]) -> None:
    process.send_signal(signal.SIGINT)
    try:
        process.wait(ENDS_WITHIN_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def run(program: str, rooms: bench.Rooms, folder: str, seconds: float) -> programs.Run:
    """seconds: of wall time, from the beginning of the simulation."""
    world, truth = Path(folder, "rooms.world.xml"), Path(folder, "truth.r0.txt")
    world.write_text(make_xml(rooms))
    for before in Path(folder).glob("truth*"):
        before.unlink()
    command = [program, "launch", str(world), "--headless", "--realtime-factor", str(UNREACHED)]
    cpu_began = programs.cpu_s()
    with subprocess.Popen(
        [*command, "-v", "ERROR"], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        loads_until = time.monotonic() + LOADS_WITHIN_S
        while not truth.exists() and process.poll() is None and time.monotonic() < loads_until:
            time.sleep(0.01)
        began = time.perf_counter()
        while process.poll() is None and time.perf_counter() - began < seconds and truth.exists():
            time.sleep(0.01)
        wall_s = time.perf_counter() - began
        if process.poll() is not None or not truth.exists():
            end(process)
            said = process.stderr.read().decode(errors="replace").strip()[-300:]
            raise ValueError(f"`{' '.join(command[:3])}` did not simulate: {said}")
        end(process)
    return programs.Run(simulated_s(truth), wall_s, programs.cpu_s() - cpu_began)


def version(program: str) -> str:
    return programs.version_of(program, ["--version"], r"mvsim v(\d+\.\d+\.\d+)")


if __name__ == "__main__":
    programs.main("MVSim", STEP_S, run, version)
