"""What textbook programs use of the client, in each language: the api probes print what they see,
and the expected numbers follow from the worlds below.
"""

import math
import subprocess

import pytest
from conftest import APIS, HALL, PATIENCE, Said, chosen, ruedo_run


@pytest.fixture(params=list(chosen(APIS)))
def language(request):
    return request.param


def api(language, url, *command):
    done = subprocess.run(
        [*APIS[language], url, *command], capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return Said(done.stdout, done.stderr)


SERVO = "<ruedo:position_gain>20</ruedo:position_gain>"
# Rods that gravity turns about y: a shoulder and an elbow with servos, a wrist with a transmission,
# a finger that mimics it, and a pendulum on the wall that nothing drives.
ARM = (
    "<sdf version='1.9' xmlns:ruedo='urn:ruedo'><world name='w'><model name='arm'><ruedo:joints/>"
    "<link name='base'><pose>0 0 2 0 0 0</pose></link>"
    "<joint name='fixed' type='fixed'><parent>world</parent><child>base</child></joint>"
    + "".join(
        f"<link name='{name}'><pose>{x} {y} 2 0 0 0</pose><inertial><pose>0.2 0 0 0 0 0</pose><mass>1</mass><inertia>"
        "<ixx>0.001</ixx><iyy>0.0134</iyy><izz>0.0134</izz></inertia></inertial></link>"
        for name, x, y in (
            ("upper", 0.0, 0.0),
            ("fore", 0.4, 0.0),
            ("hand", 0.8, 0.0),
            ("tip", 1.2, 0.0),
            ("bob", 0.0, 1.0),
        )
    )
    + "".join(
        f"<joint name='{name}' type='{kind}'><parent>{parent}</parent><child>{child}</child><axis><xyz>0 1 0</xyz>"
        f"{mimic}{servo}<limit>{limit}</limit></axis></joint>"
        for name, parent, child, kind, limit, servo, mimic in (
            ("shoulder", "base", "upper", "revolute", "<lower>-1.5</lower><upper>1.5</upper><velocity>2</velocity><effort>80</effort>", SERVO, ""),
            ("elbow", "upper", "fore", "continuous", "<effort>60</effort>", SERVO, ""),
            ("wrist", "fore", "hand", "revolute", "<lower>-1</lower><upper>0.75</upper>", "", ""),
            ("finger", "hand", "tip", "revolute", "<lower>-1</lower><upper>1</upper>", "", "<mimic joint='wrist'><multiplier>1</multiplier><offset>0</offset><reference>0</reference></mimic>"),
            ("swing", "base", "bob", "continuous", "", "", ""),
        )
    )
    + "<transmission name='t'><type>transmission_interface/SimpleTransmission</type>"
    "<joint name='wrist'><hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface></joint></transmission>"
    "</model></world></sdf>"
)


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.sdf").write_text(ARM)
    return str(tmp_path / "arm.sdf")


def test_joints_by_their_names(language, arm):
    with ruedo_run(world=arm) as server:
        said = api(language, server.url, "joints")
    assert said.words("shoulder") == ["revolute", "True", "True", "-1.500000", "1.500000"]
    assert said.numbers("shoulder_most") == [2.0, 80.0]
    assert said.words("elbow") == ["continuous", "True", "True", "-inf", "inf"]
    assert said.numbers("elbow_most") == [math.inf, 60.0]
    assert said.words("wrist")[1:3] == ["True", "True"]
    assert said.words("finger")[1] == "False"
    assert said.words("swing")[1:3] == ["True", "False"]
    names = "shoulder, elbow, wrist, finger, swing"
    for key in ("unknown", "unknown_command"):
        assert said.one(key) == f"UnknownName: arm has no joint 'elbo'; it has {names}"
    assert said.one("unknown_state") == f"UnknownName: there is no joint 'elbo'; there is {names}"
    assert said.one("nan").startswith("ValueError: elbow is nan") or "NaN" in said.one("nan")
    assert said.one("mimic").startswith("NotSupported: ") and "takes no commands" in said.one("mimic")
    # The elbow was commanded nothing: its servo holds it against the moment of what it carries.
    assert said.numbers("reached") == pytest.approx([0.5, -0.25, 0.0], abs=2e-3)
    assert said.numbers("velocity") == pytest.approx([0.2], abs=1e-3)
    assert said.numbers("limited") == pytest.approx([0.75], abs=2e-3)


def test_joints_in_lockstep(language, arm):
    with ruedo_run("--lockstep", "1", world=arm) as server:
        said = api(language, server.url, "joints_in_lockstep")
    assert said.one("at_once").startswith("NotSupported: in lockstep a command acts at a step")
    assert said.numbers("reached") == pytest.approx([0.1], abs=2e-3)


def test_streams_are_joined_by_stamp_and_loops_keep_time(language):
    """A scan each 100 ms, a pose each 20 ms of sim time, at three times real time."""
    with ruedo_run("--no-noise", "--rate", "3", "--disable", "p3at/camera", world=HALL) as server:
        said = api(language, server.url, "in_step")
    assert said.words("joined")[0] == "10" and float(said.words("joined")[1]) == 0.0
    assert said.words("joined")[2] == "True"
    offset, error, moved = said.words("between")
    assert (offset, moved) == ("-7000", "True") and float(error) == pytest.approx(0.0, abs=1e-9)
    assert said.numbers("nearest") == [100_000]
    assert said.one("early").startswith("Timeout: p3at/odometry has no sample of 0 s: ")
    *gaps, phase = said.numbers("every")
    assert gaps == pytest.approx([0.25] * 3) and phase == 0.0
    assert said.one("period").startswith("ValueError: period is 0")
    assert said.words("ended") == ["True", "True"]


CRATE = (
    "<sdf version='1.9'><world name='w'><model name='ground'><static>true</static><link name='link'>"
    "<collision name='c'><geometry><plane><size>9 9</size></plane></geometry></collision></link></model>"
    "<model name='crate'><pose>0.5 -0.25 0.1 0 0 0.3</pose><link name='box'><inertial><mass>2.5</mass>"
    "<inertia><ixx>0.02</ixx><iyy>0.02</iyy><izz>0.02</izz></inertia></inertial><collision name='c'>"
    "<geometry><box><size>0.2 0.2 0.2</size></box></geometry></collision></link></model></world></sdf>"
)


def test_bodies_by_their_names(language, tmp_path):
    (tmp_path / "crate.sdf").write_text(CRATE)
    with ruedo_run("--paused", world=str(tmp_path / "crate.sdf")) as server:
        said = api(language, server.url, "bodies")
    assert said.words("crate")[0] == "False"
    assert [float(one) for one in said.words("crate")[1:]] == pytest.approx([2.5, 0.5, -0.25, 0.3])
    assert said.numbers("put") == pytest.approx([1.0, 2.0, 0.5])
    assert said.words("rises") == ["True"] * 3
    assert said.one("unknown") == (
        "UnknownName: there is no model or MODEL/LINK 'crat'; there is crate, ground"
    )
    assert said.words("all") == ["True", "crate/box"]


def test_frames_and_angles(language):
    """The products of quaternions by SciPy's rotations; the wall by the file."""
    from scipy.spatial.transform import Rotation

    with ruedo_run("--no-noise", "--disable", "p3at/camera", world=HALL) as server:
        said = api(language, server.url, "geometry")
    first = Rotation.from_euler("z", 0.3)
    place = first.apply([0.5, -1.0, 0.25]) + [1.0, 2.0, 0.0]
    turn = first * Rotation.from_quat([0.5, 0.5, 0.5, 0.5])
    x, y, z, w = turn.as_quat()
    got = said.numbers("product")
    assert got[:3] == pytest.approx(place, abs=1e-6)
    assert abs(sum(a * b for a, b in zip(got[3:], (w, x, y, z)))) == pytest.approx(1.0, abs=1e-5)
    assert said.numbers("identity") == pytest.approx([0, 0, 0, 1, 0, 0, 0], abs=1e-6)
    assert said.numbers("apply") == pytest.approx([1 + math.cos(0.3), 2 + math.sin(0.3), 0])
    expected = [math.remainder(one, math.tau) for one in (3.5, -3.5, 7.0, 0.25, -100.0)]
    assert said.numbers("angles") == pytest.approx(expected, abs=1e-6)
    assert said.numbers("wall") == pytest.approx([6.0], abs=1e-3)  # the wall's face
