"""Walking people and things on paths, as every kind of sensor sees them; and the same in a second
run.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

BINARY_DIR = Path(
    os.environ.get("RUEDO_BINARY_DIR", Path(__file__).resolve().parents[2] / "build/release")
)
RADIUS = 0.25  # m, of an actor's cylinder
FACE = (
    0.3  # m, from the robot's middle to its bumper; the other sensors are in the middle, 1 m high
)
SCAN = "<scan><horizontal><samples>1</samples><min_angle>0</min_angle><max_angle>0</max_angle></horizontal>{}</scan><range><min>0.1</min><max>10</max></range>"


def sensor(name, kind, inside):
    return f"<sensor name='{name}' type='{kind}'><pose>0 0 1 0 0 0</pose><update_rate>10</update_rate>{inside}</sensor>"


# It walks at 1 m/s towards the robot, from 5 m; a trolley crosses behind it, at 6 m, twice as fast,
# and comes again.
WORLD = f"""<sdf version='1.9'><world name='w'><include><uri>model://ground_plane</uri></include>
<model name='r'><link name='l'><pose>0 0 0.15 0 0 0</pose><inertial><mass>500</mass><inertia><ixx>9</ixx><iyy>9</iyy><izz>9</izz></inertia></inertial>
  <collision name='foot'><geometry><box><size>{FACE} {FACE} 0.3</size></box></geometry></collision>
  <collision name='bumper'><pose>0 0 0.3 0 0 0</pose><geometry><box><size>{2 * FACE} 0.6 0.2</size></box></geometry></collision>
  {sensor("lrf", "lidar", "<lidar>" + SCAN.format("") + "</lidar>")}
  {sensor("cloud", "gpu_lidar", "<lidar>" + SCAN.format("<vertical><samples>2</samples><min_angle>0</min_angle><max_angle>0.02</max_angle></vertical>") + "</lidar>")}
  {sensor("sonar", "sonar", "<sonar><min>0.1</min><max>10</max><radius>0.1</radius></sonar><ruedo:sonar><ruedo:rays>1</ruedo:rays></ruedo:sonar>")}
  {sensor("eye", "depth_camera", "<camera><horizontal_fov>0.6</horizontal_fov><image><width>31</width><height>31</height></image><clip><near>0.1</near><far>20</far></clip></camera>")}
  <sensor name='touch' type='contact'><update_rate>10</update_rate><contact><collision>bumper</collision></contact></sensor>
</link></model>
<actor name='walker'><skin><filename>walk.dae</filename></skin><script><loop>false</loop><trajectory id='0' type='walk'>
  <waypoint><time>0</time><pose>5 0 1 0 0 0</pose></waypoint><waypoint><time>5</time><pose>0 0 1 0 0 0</pose></waypoint></trajectory></script></actor>
<model name='trolley'><link name='l'><collision name='c'><geometry><box><size>1 1 2</size></box></geometry></collision></link>
  <ruedo:path><ruedo:waypoint>0 6 -2 1 0 0 0</ruedo:waypoint><ruedo:waypoint>2 6 2 1 0 0 0</ruedo:waypoint></ruedo:path></model>
</world></sdf>"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The bytes of two runs' logs, and {device: [(sim time in s, message)]} of the first."""
    sys.path.insert(0, str(BINARY_DIR / "python"))
    import lcm
    from ruedo import lcmtypes

    folder = tmp_path_factory.mktemp("actors")
    (folder / "w.sdf").write_text(WORLD)
    for name in ("one", "two"):
        subprocess.run(
            [
                BINARY_DIR / "bin/ruedo",
                "run",
                "w.sdf",
                "--no-noise",
                "--rate",
                "max",
                "--duration",
                "4.6",
                "--quiet",
                "--lcm",
                "memq://",
                "--record",
                f"{name}.lcm",
            ],
            cwd=folder,
            check=True,
            timeout=300,
        )
    kinds = {
        "r/lrf": lcmtypes.planar_lidar_t,
        "r/cloud": lcmtypes.lidar_t,
        "r/sonar": lcmtypes.sonar_t,
        "r/eye/depth": lcmtypes.image_t,
        "r/touch": lcmtypes.contact_t,
    }
    seen = {channel: [] for channel in kinds}
    for event in lcm.EventLog(str(folder / "one.lcm")):
        if event.channel in kinds:
            message = kinds[event.channel].decode(event.data)
            seen[event.channel].append((message.utime * 1e-6, message))
    return seen, (folder / "one.lcm").read_bytes(), (folder / "two.lcm").read_bytes()


def middle_of(picture):
    import struct

    at = (picture.height // 2) * picture.row_stride + 4 * (picture.width // 2)
    return struct.unpack_from("<f", picture.data, at)[0]


@pytest.mark.parametrize(
    "channel, distance, tolerance",
    [
        ("r/lrf", lambda m: m.ranges[0], 5e-4),
        ("r/cloud", lambda m: m.ranges[0], 5e-4),
        ("r/sonar", lambda m: m.range[0], 5e-4),
        ("r/eye/depth", middle_of, 0.01),
    ],
)  # drawn with flat sides
def test_a_walker_is_where_its_trajectory_says(runs, channel, distance, tolerance):
    seen = [(time, distance(message)) for time, message in runs[0][channel] if time < 4.0]
    assert len(seen) >= 39
    assert max(abs(found - (5.0 - time - RADIUS)) for time, found in seen) < tolerance


def test_a_walker_is_felt(runs):
    """Its cylinder reaches the bumper after 5 - 0.25 - 0.3 m."""
    pressed = [time for time, message in runs[0]["r/touch"] if message.pressed]
    assert min(pressed) == pytest.approx(4.5, abs=0.051)


def test_the_same_again(runs):
    assert runs[1] == runs[2]
