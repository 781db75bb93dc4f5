"""A log and a client of the last version: they work, or the error says what to do (README.md here
says what is kept).
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
RUEDO = BUILD / "bin/ruedo"
sys.path.insert(0, str(BUILD / "python"))


@pytest.fixture
def log(tmp_path):
    shutil.copy(HERE / "run.lcm", tmp_path)
    return tmp_path / "run.lcm"


def program(*words):
    return subprocess.run(
        [str(word) for word in (RUEDO, *words)], capture_output=True, text=True, timeout=300
    )


def test_its_log_repeats_or_says_which_version_it_needs(log):
    """Its world lay in a folder that is not here: Ruedo's own worlds are found again."""
    done = program("verify", log)
    if done.returncode == 3:  # a file of the world was changed since
        assert "was changed since" in done.stderr
        return
    assert done.returncode in (0, 4), done.stdout + done.stderr
    assert "Ruedo: the log has 0.1.0 (build " in done.stdout
    if done.returncode == 4:
        assert "pip install ruedo==0.1.0" in done.stdout


def test_its_log_can_be_read(log, tmp_path):
    import ruedo

    assert len(ruedo.read_log(log)["p3at/pose"]["utime"]) == 26  # 50 Hz, 0 to 0.5 s
    done = program("export", log, tmp_path / "run.mcap")
    assert done.returncode == 0 and (tmp_path / "run.mcap").stat().st_size > 10_000, done.stderr
    done = program("diff", log, log)
    assert done.returncode == 0, done.stdout


def test_its_client_drives_this_server():
    code = (
        "import ruedo\n"
        "assert ruedo.__file__.endswith('client.zip/ruedo/__init__.py')\n"
        "with ruedo.launch('arena', rate='max', seed=1) as sim:\n"
        "    robot = sim.robot('p3at')\n"
        "    robot.advance(0.5).wait(60)\n"
        "    print(round(robot.pose.latest().x, 3), len(robot.lrf.next(60).ranges))\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(HERE / "client.zip"), "RUEDO": str(RUEDO)}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "0.5 181\n"


# The basis of programs and other versions (docs/compatibility.md): types by members and constants;
# names of the package, and of the members of its classes.
INVENTORY = """
import inspect, json, ruedo
types = {
    name: {
        "fingerprint": type._get_packed_fingerprint().hex(),
        "constants": {n: v for n, v in vars(type).items() if n.isupper() and isinstance(v, int)},
    }
    for name, type in vars(ruedo.lcmtypes).items()
    if hasattr(type, "_get_packed_fingerprint")
}
names = {}
classes = {name for name, one in vars(ruedo).items() if inspect.isclass(one)}  # deprecated, too
classes |= set(getattr(ruedo, "_HIDDEN", ()))  # where they are loaded on first use
for name in {*ruedo.__all__, *classes}:
    one = getattr(ruedo, name)
    members = list(inspect.signature(one).parameters) if inspect.isfunction(one) else dir(one)
    members += getattr(one, 'deprecated_options', ())
    names[name] = [m for m in members if not m.startswith("_")] if name != "lcmtypes" else []
    fields = getattr(one, "__dataclass_fields__", None)
    names[name] += list(fields) if fields else []
print(json.dumps([types, names]))
"""


def inventory(place):
    done = subprocess.run(
        [sys.executable, "-c", INVENTORY],
        env={**os.environ, "PYTHONPATH": str(place)},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_types_and_names_of_the_last_version_are_still_there():
    (old_types, old_names), (types, names) = (
        inventory(place) for place in (HERE / "client.zip", BUILD / "python")
    )
    assert len(old_types) > 40 and len(old_names) > 40
    for name, old in old_types.items():
        assert types[name]["fingerprint"] == old["fingerprint"], f"{name} has other members"
        for constant, value in old["constants"].items():
            assert types[name]["constants"].get(constant) == value, f"{name}.{constant}"
    for name, members in old_names.items():
        assert set(members) <= set(names[name]), f"ruedo.{name}"


def test_its_client_makes_requests_and_steps_in_lockstep():
    code = (
        "import ruedo\n"
        "with ruedo.launch('arena', seed=1) as sim:\n"
        "    sim.pause(); sim.step(10); sim.set_rate(2.0)\n"
        "    sim.set_pose('p3at', 1.0, 0.5); sim.reset_odometry('p3at')\n"
        "    print(sim.state('p3at').position[:2].tolist())\n"
        "    try: sim.remove('nobody')\n"
        "    except ruedo.RequestError as error: print(error.code)\n"
        "with ruedo.launch('arena', lockstep=1, seed=1) as sim:\n"
        "    print(sim.step(100).step)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(HERE / "client.zip"), "RUEDO": str(RUEDO)}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "[1.0, 0.5]\nUNKNOWN_NAME\n100\n"
