"""A run ends soon after it is told to, however much work its modules have before them."""
import os
import signal
import subprocess
import time

import pytest

RUEDO = os.environ["RUEDO"]

# As fast as they go, batches of 160 ms are on their way, four at a time: with 200 cameras at 30 Hz thousands of pictures,
# which take minutes.
WORLD = """<sdf version='1.9'><world name='w'><include><uri>model://ground_plane</uri></include>
<ruedo:fleet name='r'><include><uri>model://p3at</uri></include><ruedo:count>200</ruedo:count></ruedo:fleet></world></sdf>"""


@pytest.mark.parametrize("told", [signal.SIGTERM, signal.SIGINT])
def test_it_does_not_wait_for_pictures(told, tmp_path):
    (tmp_path / "w.sdf").write_text(WORLD)
    # LCM over memory: nothing leaves the process.
    with subprocess.Popen([RUEDO, "run", tmp_path / "w.sdf", "--rate", "max", "--lcm", "memq://"], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as server:
        try:
            for _ in range(3):    # the list of channels, which is printed when all is loaded
                assert server.stdout.readline()
            time.sleep(3)
            begin = time.monotonic()
            server.send_signal(told)
            server.communicate(timeout=60)
            took = time.monotonic() - begin
            assert server.returncode == 0 and took < 20, took
        finally:
            server.kill()
