"""ROS 2's command line against a run, with each middleware that the workspace has."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from ros import MIDDLEWARES, Ros, needs
from server import PATIENCE, RUEDO, SOURCE, Run


@pytest.fixture(params=MIDDLEWARES)
def ros(request):
    with Run("--no-noise", "--disable", "p3at/camera") as run:
        ros = Ros(run, request.param)
        run.process.stdout.readline()  # it is there
        yield ros
        subprocess.run(["ros2", "daemon", "stop"], env=ros.environment, capture_output=True)


@needs("ros2topic")
def test_topics(ros):
    ros.finds("/scan [sensor_msgs/msg/LaserScan]", "topic", "list", "-t")
    # With the type `ros2 topic echo` waits for the topic, and without it gives up at once.
    kind = "sensor_msgs/msg/LaserScan"
    assert "frame_id: lrf" in ros("topic", "echo", "--once", "/scan", kind)
    rate = ros.until(r"average rate: ([\d.]+)", "topic", "hz", "/scan", "--use-sim-time")
    assert float(rate[1]) == pytest.approx(10, rel=0.2)


FLEET = SOURCE / "worlds/fleet.sdf"


@needs("tf2_py", "tf2_ros_py", "tf2_msgs")
@pytest.mark.parametrize("layout, frame", [("both", "alice/lrf"), ("namespaced", "lrf")])
@pytest.mark.parametrize("middleware", MIDDLEWARES)
def test_nodes_in_a_robots_namespace_know_its_frames(middleware, layout, frame):
    told = json.loads(subprocess.check_output([RUEDO, "info", "--json", FLEET], timeout=PATIENCE))
    [at] = [
        device["position"]
        for device in told["devices"]
        if (device["robot"], device["name"]) == ("alice", "lrf")
    ]
    with Run("--no-noise", "--ros2-tf", layout, world=FLEET) as run:
        ros = Ros(run, middleware)
        scan = subprocess.check_output(
            ["ros2", "topic", "echo", "--once", "/alice/scan", "sensor_msgs/msg/LaserScan"],
            env=ros.environment,
            timeout=PATIENCE,
            text=True,
        )
        assert f"frame_id: {frame}\n" in scan
        found = {}
        for target in ("base_link", "odom"):
            words = [sys.executable, Path(__file__).with_name("tf_of.py"), "alice", target, frame]
            place = subprocess.check_output(words, env=ros.environment, timeout=PATIENCE)
            found[target] = list(map(float, place.split()))
        assert found["base_link"] == pytest.approx(at, abs=1e-6)
        assert found["odom"] == pytest.approx(at, abs=0.1)  # without a command
        subprocess.run(["ros2", "daemon", "stop"], env=ros.environment, capture_output=True)


@needs("ros2param")
def test_parameters(ros):
    ros.finds("rate", "param", "list", "/ruedo")
    assert "1.0" in ros("param", "get", "/ruedo", "rate")
    assert "successful" in ros("param", "set", "/ruedo", "rate", "2.0")
    assert "rate: 2.0" in ros("param", "dump", "/ruedo")


@needs("ros2service", "simulation_interfaces")
def test_services(ros):
    kind = "simulation_interfaces/srv/"
    state = ros("service", "call", "/get_simulation_state", kind + "GetSimulationState")
    assert "state=1" in state
    ros(
        "service",
        "call",
        "/set_simulation_state",
        kind + "SetSimulationState",
        "{state: {state: 2}}",
    )
    step = ros("service", "call", "/step_simulation", kind + "StepSimulation", "{steps: 3}")
    assert "result=1" in step


@needs("ros2action", "ros2service", "simulation_interfaces")
def test_the_action(ros):
    kind = "simulation_interfaces/srv/SetSimulationState"
    ros("service", "call", "/set_simulation_state", kind, "{state: {state: 2}}")
    kind = "simulation_interfaces/action/SimulateSteps"
    done = ros("action", "send_goal", "--feedback", "/simulate_steps", kind, "{steps: 3}")
    # `ros2 action` ends with the result; the last feedback may come behind it.
    assert "completed_steps: 1" in done and "SUCCEEDED" in done


@needs("ros2bag", "rosbag2_storage_mcap", "rosbag2_storage_default_plugins")
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_bags(ros, tmp_path, storage):
    words = ["bag", "record", "-s", storage, "-o", str(tmp_path / "bag"), "/scan", "/odom", "/tf"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with subprocess.Popen(["ros2", *words], env=ros.environment, **pipes) as recording:
        for line in recording.stdout:
            if "Subscribed to topic '/scan'" in line:
                break
        # Another reader's message is one that the recorder has, too.
        ros("topic", "echo", "--once", "/scan", "sensor_msgs/msg/LaserScan")
        recording.send_signal(signal.SIGINT)
        recording.stdout.read()
    told = ros("bag", "info", tmp_path / "bag")
    assert re.search(r"Topic: /scan \| Type: sensor_msgs/msg/LaserScan \| Count: [1-9]", told)


@needs("ros2bag", "rosbag2_storage_mcap")
def test_exported_bags(ros, tmp_path):
    run = [RUEDO, "run", "arena", "--rate", "max", "--duration", "2", "--quiet", "--lcm", "auto"]
    subprocess.run([*run, "--record", tmp_path / "run.lcm"], check=True, timeout=PATIENCE)
    subprocess.run([RUEDO, "export", tmp_path / "run.lcm", "--ros2", tmp_path / "bag"], check=True)
    assert "Topic: /scan" in ros("bag", "info", tmp_path / "bag")
    ros("bag", "play", tmp_path / "bag", "--rate", 4)


@needs("ros2launch", "ruedo_ros")
def test_a_launch_file_starts_a_simulation(ros):
    options = "options:=--duration 2 --rate max"
    told = ros("launch", "ruedo_ros", "sim.launch.py", "world:=arena", "robot:=p3at", options)
    assert "[ruedo-1]: process has finished cleanly" in told
