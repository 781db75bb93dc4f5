"""Our robots alone on a plane, as a running server sees them: no device may see its own robot or
the floor.
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
WORLD = """<sdf version="1.9"><world name="plane">
  <include><uri>model://ground_plane</uri></include>
  <include><uri>model://p3at</uri></include>
  <include><uri>model://p3dx</uri><pose>50 0 0 0 0 0</pose></include>
</world></sdf>"""


@pytest.fixture(scope="module")
def last_messages(tmp_path_factory):
    """{channel: the last message of two seconds}, decoded where this test looks at it."""
    sys.path.insert(0, str(BINARY_DIR / "python"))
    import lcm
    from ruedo import lcmtypes

    folder = tmp_path_factory.mktemp("plane")
    (folder / "plane.sdf").write_text(WORLD)
    subprocess.run(
        [
            BINARY_DIR / "bin/ruedo",
            "run",
            "plane.sdf",
            "--no-noise",
            "--rate",
            "max",
            "--duration",
            "2",
            "--quiet",
            "--lcm",
            "memq://",
            "--record",
            "plane.lcm",
        ],
        cwd=folder,
        check=True,
        timeout=120,
    )
    last = {event.channel: event.data for event in lcm.EventLog(str(folder / "plane.lcm"))}
    kinds = {"sonar": lcmtypes.sonar_t, "lrf": lcmtypes.planar_lidar_t}
    return {
        channel: kind.decode(data)
        for channel, data in last.items()
        for name, kind in kinds.items()
        if f"/{name}" in channel
    }


@pytest.mark.parametrize("channel", ["p3at/sonar_front", "p3at/sonar_rear", "p3dx/sonar_front"])
def test_sonars_hear_nothing(last_messages, channel):
    reading = last_messages[channel]
    assert list(reading.range) == [5.0] * 8
    assert len(set(reading.fired_utime)) == 8, "one transducer after the other"
    assert max(reading.fired_utime) - min(reading.fired_utime) == 7 * 40_000


@pytest.mark.parametrize("channel, count", [("p3at/lrf", 181), ("p3dx/lrf", 683)])
def test_range_finders_see_nothing(last_messages, channel, count):
    assert list(last_messages[channel].ranges) == [math.inf] * count
