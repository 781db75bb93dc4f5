"""proto/vocabulary.toml and what is made of it: faults in it are found, its page is up to date, the
vectors have each value, and each message that a stream can carry has a sample or is a record.
"""

import itertools
import math
import re
import shutil
import subprocess
import sys

import pytest
import tomllib
from conftest import HERE, PATIENCE, SOURCE

PROTO = SOURCE / "proto"


def generate(proto, language, output):
    return subprocess.run(
        [sys.executable, str(proto / "generator"), language, str(output)],
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.mark.parametrize(
    "old, new, error",
    [
        ('message = "imu_t"', 'message = "imo_t"', "samples.Imu: there is no message imo_t"),
        ('from = "pos"', 'from = "place"', "pose_t has no member place: it has utime, pos, vel"),
        ('vx = { unit = "m/s"', 'vx = { units = "m/s"', "OdometryTwist.vx: units is unknown"),
        ('part = "Box2D"', 'part = "Box"', "Boxes2D.boxes: there is no part Box"),
        ('enum = "MotionState"', 'enum = "State"', "there is no enumeration State"),
        ("sent = 64", "sent = 4", "enums.MotionState: two of its constants have the same value"),
        ("[requests.QUIT]", "[requests.STOP]", "requests.STOP: request_t has no such constant"),
        ('body = "rate_request_t"', 'body = "rate_t"', "requests.RATE: there is no body rate_t"),
        ("{ UNKNOWN_NAME =", "{ NO_NAME =", "NO_NAME is not a code of reply_t"),
        ('languages = ["python"]', 'languages = ["perl"]', "Scan.angles: perl is not a language"),
        ('[samples.Imu]\nmessage = "imu_t"\n', "[samples.Imu]\n", "there is no message None"),
        ("[samples.Imu]", "[samples.Imu", "at line"),
    ],
)
def test_a_fault_names_its_place(tmp_path, old, new, error):
    shutil.copytree(PROTO, tmp_path / "proto", ignore=shutil.ignore_patterns("__pycache__"))
    path = tmp_path / "proto/vocabulary.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    done = generate(tmp_path / "proto", "python", tmp_path / "out")
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert done.stderr.startswith(f"{path}: ") and error in done.stderr
    assert not (tmp_path / "out").exists()


def test_the_page_is_up_to_date(tmp_path):
    done = generate(PROTO, "pages", tmp_path)
    assert done.returncode == 0, done.stderr
    made, kept = (path / "messages.md" for path in (tmp_path, SOURCE / "docs"))
    assert made.read_text() == kept.read_text(), "python3 proto/generator pages docs"


def constants(type, prefix=""):
    """By the .lcm file: numbers of its constants of that prefix."""
    text = (PROTO / f"{type}.lcm").read_text()
    return {int(n) for n in re.findall(rf"const \w+ {prefix}\w+\s*= (-?\d+);", text)}


def test_the_vectors_have_each_value_of_each_enumeration():
    from ruedo import lcmtypes

    seen = {"kind": set(), "state": set(), "reason": set(), "format": set()}
    lines = (HERE / "vectors/messages.txt").read_text().splitlines()
    for line, meaning in itertools.pairwise(lines):
        if meaning == "  broken" or not line.startswith(("motion_status_t", "image_t")):
            continue
        type, data = line.split()
        message = getattr(lcmtypes, type).decode(bytes.fromhex(data))
        if type == "image_t":
            seen["format"].add(message.pixelformat)
        else:
            for name in ("kind", "state", "reason"):
                seen[name].add(getattr(message, name))
    assert seen == {
        "kind": constants("motion_status_t", "KIND_") | constants("move_command_t"),
        "state": constants("motion_status_t", "STATE_"),
        "reason": constants("motion_status_t", "REASON_"),
        "format": constants("image_t", "PIXEL_FORMAT_"),
    }


def test_the_conversations_refuse_with_each_code():
    text = (HERE / "vectors/conversations.json").read_text()
    codes = set(re.findall(r"const int32_t (\w+)", (PROTO / "reply_t.lcm").read_text()))
    assert set(re.findall(r'"refuse": "(\w+)", "text": "why"', text)) == codes - {"OK"}


ONE = [1.0, 0.0, 0.0, 0.0]
SPAWN = {"on_ground": True, "orientation": ONE, "position": [0.0, 0.0, 0.0]}
PLACE = {"position": [0.0, 0.0, 0.0], "orientation": ONE}
STILL = {"linear": [0.0, 0.0, 0.0], "angular": [0.0, 0.0, 0.0]}
NOWHERE = {"position": [math.nan, 0.0, 0.0]}
# The refusals that the table has: a body that the server refuses so.
REFUSALS = {
    ("STEP", "BAD_REQUEST"): {"steps": 0},
    ("STEP", "REFUSED"): {"steps": 1},  # the run is not paused
    ("RATE", "BAD_REQUEST"): {"rate": -1.0},
    ("RATE", "REFUSED"): {"rate": 1.0},  # in lockstep
    ("RESET", "BAD_REQUEST"): {"what": 9, "seed": -1},
    ("SPAWN", "BAD_REQUEST"): {"model": "nothing", **SPAWN},
    ("SPAWN", "REFUSED"): {"model": "p3at", **SPAWN},  # there stands one
    ("REMOVE", "UNKNOWN_NAME"): {"name": "nobody"},
    ("SET_POSE", "BAD_REQUEST"): {"name": "p3at", **PLACE, **NOWHERE},
    ("SET_POSE", "UNKNOWN_NAME"): {"name": "nobody", **PLACE},
    ("SET_TWIST", "BAD_REQUEST"): {"name": "p3at", **STILL, "linear": [math.inf, 0.0, 0.0]},
    ("SET_TWIST", "UNKNOWN_NAME"): {"name": "nobody", **STILL},
    ("GET_STATE", "UNKNOWN_NAME"): {"name": "nobody"},
    ("GET_JOINT_LIMITS", "UNKNOWN_NAME"): {"name": "nobody"},
    ("RESET_ODOMETRY", "UNKNOWN_NAME"): {"name": "nobody"},
    ("RESTORE", "UNKNOWN_NAME"): {"name": "nothing"},
    ("RESTORE", "REFUSED"): {"name": "damaged"},
    ("SNAPSHOT", "BAD_REQUEST"): {"name": "a/b"},
    ("SNAPSHOT", "REFUSED"): {"name": "lost"},  # its folder is gone: the last of all
}


def test_the_server_refuses_as_the_table_says(tmp_path):
    import ruedo
    from ruedo import lcmtypes

    table = tomllib.loads((PROTO / "vocabulary.toml").read_text())["requests"]
    listed = {(kind, code) for kind, of in table.items() for code in of.get("errors", {})}
    assert listed == set(REFUSALS)
    folder = tmp_path / "snapshots"
    folder.mkdir()
    saving = ruedo.launch("arena", args=["--snapshots", str(folder)])
    with saving as sim, ruedo.launch("arena", lockstep=1) as locked:
        sim.snapshot("damaged")
        for path in folder.iterdir():
            path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
        for (kind, code), values in REFUSALS.items():
            body = getattr(lcmtypes, table[kind]["body"])()
            for name, value in values.items():
                setattr(body, name, value)
            if (kind, code) == ("SNAPSHOT", "REFUSED"):
                shutil.rmtree(folder)
            asked = locked if (kind, code) == ("RATE", "REFUSED") else sim
            with pytest.raises(ruedo.RequestError) as refused:
                asked._session.request(getattr(lcmtypes.request_t, kind), body, PATIENCE)
            assert refused.value.code == code, (kind, code, str(refused.value))
