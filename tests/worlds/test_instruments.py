"""Instruments in a world that runs: what physics does, weighed and measured.

And the same bytes again in a second run.
"""

import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

BINARY_DIR = Path(
    os.environ.get("RUEDO_BINARY_DIR", Path(__file__).resolve().parents[2] / "build/release")
)
G = 9.8
TILT = 0.2  # rad
NOISE = "<noise type='gaussian'><stddev>0.5</stddev><bias_mean>0.25</bias_mean><bias_stddev>0.1</bias_stddev><dynamic_bias_stddev>0.01</dynamic_bias_stddev><dynamic_bias_correlation_time>10</dynamic_bias_correlation_time></noise>"


def link(name, pose, mass, size):
    x, y, z = size
    moments = f"<ixx>{mass / 12 * (y * y + z * z)}</ixx><iyy>{mass / 12 * (x * x + z * z)}</iyy><izz>{mass / 12 * (x * x + y * y)}</izz>"
    return f"<link name='{name}'><pose>{pose}</pose><inertial><mass>{mass}</mass><inertia>{moments}</inertia></inertial><collision name='c'><geometry><box><size>{x} {y} {z}</size></box></geometry></collision>"


def scale(name, parent, child, kind="fixed"):
    axis = "" if kind == "fixed" else "<axis><xyz>0 1 0</xyz></axis>"
    return f"<joint name='{name}_joint' type='{kind}'><parent>{parent}</parent><child>{child}</child>{axis}<sensor name='{name}' type='force_torque'><update_rate>20</update_rate><force_torque><frame>parent</frame></force_torque></sensor></joint>"


# A table of 2 kg that is tilted, with a box of 5 kg that friction holds; a pendulum of 3 kg that
# hangs still; a stone that falls with its instruments.
WORLD = f"""<sdf version='1.9'><world name='w'>
<spherical_coordinates><latitude_deg>45</latitude_deg><longitude_deg>8</longitude_deg><elevation>0</elevation><heading_deg>0</heading_deg></spherical_coordinates>
<model name='table'><pose>0 0 1 0 {TILT} 0</pose><ruedo:joints/>{link("foot", "0 0 -0.5 0 0 0", 1, (0.1, 0.1, 0.1))}</link>{link("plate", "0 0 0 0 0 0", 2, (1, 1, 0.1))}</link>
  <joint name='floor' type='fixed'><parent>world</parent><child>foot</child></joint>{scale("cell", "foot", "plate")}</model>
<model name='load'><pose>{0.1505 * math.sin(TILT)} 0 {1 + 0.1505 * math.cos(TILT)} 0 {TILT} 0</pose>{link("l", "0 0 0 0 0 0", 5, (0.2, 0.2, 0.2))}</link></model>
<model name='hanging'><pose>5 0 2 0 0 0</pose><ruedo:joints/>{link("bob", "0 0 -0.5 0 0 0", 3, (0.1, 0.1, 0.1))}</link>
  <joint name='pin' type='revolute'><pose>0 0 0.5 0 0 0</pose><parent>world</parent><child>bob</child><axis><xyz>0 1 0</xyz></axis><sensor name='pin' type='force_torque'><update_rate>20</update_rate></sensor></joint></model>
<model name='stone'><pose>10 0 100 0 0 0</pose>{link("l", "0 0 0 0 0 0", 1, (0.1, 0.1, 0.1))}
  <sensor name='height' type='altimeter'><update_rate>20</update_rate></sensor>
  <sensor name='gps' type='navsat'><update_rate>20</update_rate></sensor>
  <sensor name='noisy' type='navsat'><update_rate>20</update_rate><navsat><position_sensing><horizontal>{NOISE}</horizontal><vertical>{NOISE}</vertical></position_sensing></navsat></sensor>
  <sensor name='pitot' type='air_speed'><pose>0 0 0 0 1.5707963267948966 0</pose><update_rate>20</update_rate></sensor></link>
  <plugin name='p3d' filename='libgazebo_ros_p3d.so'><updateRate>20</updateRate></plugin></model>
</world></sdf>"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The bytes of two logs, with 1 and with 4 threads, and {channel: messages} of the first."""
    sys.path.insert(0, str(BINARY_DIR / "python"))
    import lcm
    from ruedo import lcmtypes

    folder = tmp_path_factory.mktemp("instruments")
    (folder / "w.sdf").write_text(WORLD)
    for threads in ("1", "4"):
        command = f"run w.sdf --rate max --duration 2 --quiet --lcm memq:// --threads {threads} --record {threads}.lcm"
        subprocess.run([BINARY_DIR / "bin/ruedo", *command.split()], cwd=folder, check=True)
    types = {
        cls._get_packed_fingerprint(): cls
        for cls in (
            lcmtypes.force_torque_t,
            lcmtypes.altimeter_t,
            lcmtypes.navsat_t,
            lcmtypes.air_speed_t,
            lcmtypes.pose_t,
        )
    }
    seen = {}
    for event in lcm.EventLog(str(folder / "1.lcm"), "r"):
        if event.data[:8] in types:
            message = types[event.data[:8]].decode(event.data)
            seen.setdefault(event.channel, []).append(message)
    return [(folder / f"{threads}.lcm").read_bytes() for threads in ("1", "4")], seen


def test_the_same_bytes_with_any_number_of_threads(runs):
    one, four = runs[0]
    assert one == four and len(one) > 10_000


def test_a_scale_weighs_its_load_at_any_tilt(runs):
    last = runs[1]["table/cell"][-1]
    # In the axes of the foot, which is tilted as well; friction along the plate is weighed, too.
    weight = 7 * G
    assert last.force == pytest.approx(
        (weight * math.sin(TILT), 0, -weight * math.cos(TILT)), abs=0.02
    )


def test_a_pendulum_hangs_in_its_pin(runs):
    last = runs[1]["hanging/pin"][-1]
    assert last.force == pytest.approx((0, 0, -3 * G), abs=1e-6)
    assert last.torque == pytest.approx((0, 0, 0), abs=1e-6)


def test_a_falling_stone(runs):
    seen = runs[1]
    for height, fix, air, pose in zip(
        seen["stone/height"], seen["stone/gps"], seen["stone/pitot"], seen["stone/p3d"], strict=True
    ):
        t = height.utime * 1e-6
        assert fix.utime == air.utime == pose.utime == height.utime
        assert height.velocity == pytest.approx(-G * t, abs=1e-9)
        assert height.altitude == pytest.approx(-G * t * t / 2, abs=G * t * 0.005)  # a step's worth
        assert fix.velocity[2] == pytest.approx(height.velocity, abs=1e-4)
        assert fix.altitude == pytest.approx(100 + height.altitude, abs=1e-4)
        assert fix.latitude_deg == pytest.approx(45, abs=1e-6)
        assert air.differential_pressure == pytest.approx(0.5 * 1.2133 * (G * t) ** 2, rel=2e-3)
        assert pose.pos[2] == pytest.approx(100 + height.altitude, abs=1e-9)
        assert pose.vel[2] == pytest.approx(height.velocity, abs=1e-9)
        if t > 0:
            assert pose.accel[2] == pytest.approx(-G, abs=1e-6)


def test_noise_is_off_unless_written(runs):
    ideal, noisy = ([m.altitude for m in runs[1][f"stone/{name}"]] for name in ("gps", "noisy"))
    differences = [a - b for a, b in zip(noisy, ideal, strict=True)]
    assert 0.2 < (sum(d * d for d in differences) / len(differences)) ** 0.5 < 1.2
