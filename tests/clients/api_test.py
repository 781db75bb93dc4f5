"""What textbook programs use of the client, in each language: the api probes print what they see,
and the expected numbers follow from the worlds below.
"""

import itertools
import math
import subprocess
import sys

import pytest
from conftest import (
    APIS,
    BUILD,
    HALL,
    PATIENCE,
    RUEDO,
    Said,
    Server,
    chosen,
    free_url,
    ruedo_run,
    tcp_server,
)


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
            (
                "shoulder",
                "base",
                "upper",
                "revolute",
                "<lower>-1.5</lower><upper>1.5</upper><velocity>2</velocity><effort>80</effort>",
                SERVO,
                "",
            ),
            ("elbow", "upper", "fore", "continuous", "<effort>60</effort>", SERVO, ""),
            ("wrist", "fore", "hand", "revolute", "<lower>-1</lower><upper>0.75</upper>", "", ""),
            (
                "finger",
                "hand",
                "tip",
                "revolute",
                "<lower>-1</lower><upper>1</upper>",
                "",
                "<mimic joint='wrist'><multiplier>1</multiplier><offset>0</offset><reference>0</reference></mimic>",
            ),
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
    assert said.one("mimic").startswith("NotSupported: ") and "takes no commands" in said.one(
        "mimic"
    )
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
    """A scan each 100 ms, a pose each 20 ms of sim time, at twice real time; nothing is lost."""
    with tcp_server("--no-noise", "--rate", "2", "--disable", "p3at/camera") as server:
        said = api(language, server.url, "in_step")
    assert said.words("joined")[0] == "10" and float(said.words("joined")[1]) == 0.0
    assert said.words("joined")[2] == "True"
    assert said.numbers("three") == [0, 0, 0]  # poses and odometry come each 20 ms
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


def test_driving_lasts_for_its_block_and_a_published_command_lapses(language):
    with ruedo_run("--no-noise", "--rate", "4", "--disable", "p3at/camera", world=HALL) as server:
        said = api(language, server.url, "driving")
    assert said.words("went") == ["True"]
    assert said.numbers("published") == pytest.approx([0.1], abs=1e-6)


def receiver(name, pose):
    return (
        f"<model name='{name}'><static>true</static><pose>{pose}</pose><link name='link'>"
        "<sensor name='gps' type='navsat'><update_rate>5</update_rate></sensor>"
        "<sensor name='imu' type='imu'><update_rate>5</update_rate></sensor></link></model>"
    )


def test_fixes_in_metres_and_headings(language, tmp_path):
    """East, north and up of one receiver from the other are the places of the file."""
    (tmp_path / "gps.sdf").write_text(
        "<sdf version='1.9'><world name='w'><spherical_coordinates><surface_model>EARTH_WGS84</surface_model>"
        "<latitude_deg>47.5</latitude_deg><longitude_deg>-8.25</longitude_deg><elevation>400</elevation>"
        "<heading_deg>0</heading_deg></spherical_coordinates>"
        + receiver("here", "0 0 0 0 0 0")
        + receiver("there", "30 -40 5 0 0 0.7")
        + "</world></sdf>"
    )
    with ruedo_run("--no-noise", world=str(tmp_path / "gps.sdf")) as server:
        said = api(language, server.url, "fixes")
    assert said.numbers("enu") == pytest.approx([30.0, -40.0, 5.0], abs=2e-3)
    assert said.numbers("heading") == pytest.approx([0.7], abs=1e-6)
    assert said.one("none").startswith("UnknownName: here has no magnetometer; it has ")


def test_a_log_that_is_played_feeds_the_program_that_drove(language, tmp_path):
    """connect() works on it; what would change the run is refused; its end is the run's."""
    import ruedo

    log = str(tmp_path / "run.lcm")
    with ruedo.launch(HALL, rate="max", noise=False, record=log, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        robot.advance(1.0).wait()
        sim.sleep(1.0)
        reached = robot.pose.latest().x
    url = free_url()
    with Server([RUEDO, "play", log, "--lcm", url, "--wait"], url):  # in real time
        said = api(language, url, "played")
    assert said.words("world") == ["hall", "True"]
    assert said.one("drive").startswith("NotSupported: ")
    assert said.one("pause").startswith("NotSupported: ")
    count, last, time = said.numbers("went")
    assert count > 3 and time > 1.0 and last == pytest.approx(reached, abs=1e-3)


def test_a_queue_keeps_the_newest_and_counts_the_others(language):
    """Seven scans, each 100 ms: the first is read, then of six the newest four wait."""
    with tcp_server("--paused", "--no-noise", "--disable", "p3at/camera") as server:
        said = api(language, server.url, "queue")
    assert said.numbers("queue") == [3e5, 4e5, 5e5, 6e5, 2, 4, 4]
    assert said.numbers("newest") == [9e5, 4]  # of three more the last
    for depth in (0, 1001):
        error = said.one(f"depth{depth}")
        assert error.startswith("ValueError: ") and f"is {depth}; allowed are 1 to 1000" in error


def test_every_scan_reaches_a_slow_loop_with_a_queue():
    """At real time, a loop that is slower than the scanner for a while, and faster after that."""
    import ruedo

    with ruedo.launch(HALL, noise=False, disable=["p3at/camera"]) as sim:
        lrf = sim.robot("p3at").lrf.reader(queue_depth=50)
        newest, stamps = sim.robot("p3at").lrf, []
        for scan in lrf:
            stamps.append(scan.utime)
            if len(stamps) == 3:
                newest.latest()
                sim.sleep(1.5)
                assert newest.next().utime - scan.utime > 1_000_000
            if len(stamps) == 15:
                break
        assert lrf.dropped == 0 and newest.dropped > 5
    gaps = {b - a for a, b in itertools.pairwise(stamps)}
    assert gaps == {100_000}


PIXELS = bytes([0, 254, 205, 77, 76, 255, 128, 0, 254, 254, 0, 0])  # from the top
HEAD = b"P5 # a comment\n# another\n4 3\n255\n"
MAP_FILES = {
    "given": "# of a room\nimage: 'given.pgm'\nmode: trinary\nresolution: 0.05  # m\norigin:\n- -1.5\n- 2\n- 1e-3\n"
    "negate: 0\noccupied_thresh: 0.7\nfree_thresh: 0.2\n",
    "missing": "image: given.pgm\n",
    "resolution": "image: given.pgm\nresolution: 0\norigin: [0, 0, 0]\n",
    "origin": "image: given.pgm\nresolution: 0.1\norigin: [0, 0]\n",
    "short": "image: short.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n",
    "picture": "image: picture.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n",
}


def test_maps_are_read_and_written(language, tmp_path):
    """Occupied where more than 0.7 of 255 is missing, free where less than 0.2 is."""
    import ruedo

    for name, text in MAP_FILES.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    (tmp_path / "given.pgm").write_bytes(HEAD + PIXELS)
    (tmp_path / "short.pgm").write_bytes(HEAD + PIXELS[1:])
    (tmp_path / "picture.pgm").write_bytes(b"nothing of the kind")
    with ruedo_run("--paused", "--disable", "p3at/camera", world=HALL) as server:
        said = api(language, server.url, "map_files", str(tmp_path))
    assert said.numbers("map") == [3, 4, 0.05, -1.5, 2.0, 0.001]
    assert said.numbers("cells") == [0, 0, 100, 100, 100, 0, -1, 100, 100, 0, 0, -1]
    saved = ruedo.load_map(tmp_path / "saved.yaml")
    assert saved.cells.ravel().tolist() == said.numbers("cells")
    assert saved.origin == (-1.5, 2.0, 0.001) and saved.resolution == 0.05
    assert said.one("name").startswith("ValueError: ") and "ends in .yaml" in said.one("name")
    for what, words in (
        ("none", "none.yaml"),
        ("missing", "missing.yaml: resolution, origin is missing"),
        ("resolution", "resolution.yaml: resolution is "),
        ("origin", "origin.yaml: origin is "),
        ("short", "short.pgm: expected an 8-bit PGM of 4 x 3 pixels, found 11 bytes"),
        ("picture", "picture.pgm"),
    ):
        assert words in said.one(what)


def test_maps_of_worlds_are_read_alike(language, tmp_path):
    """What `ruedo map` writes, by each reader as by Python's, which has PyYAML."""
    import ruedo

    subprocess.run([RUEDO, "map", "arena", "-o", tmp_path / "given.yaml"], check=True)
    with ruedo_run("--paused", "--disable", "p3at/camera", world=HALL) as server:
        said = api(language, server.url, "map_files", str(tmp_path))
    given = ruedo.load_map(tmp_path / "given.yaml")
    assert said.numbers("map") == [*given.cells.shape, given.resolution, *given.origin]
    assert said.numbers("cells") == given.cells.ravel().tolist()
    assert (ruedo.load_map(tmp_path / "saved.yaml").cells == given.cells).all()


def camera(name, type, more, after=""):
    return (
        f"<sensor name='{name}' type='{type}'><update_rate>5</update_rate>{after}<camera><horizontal_fov>1.5707963267948966"
        f"</horizontal_fov><image><width>{200 if name == 'right' else 100}</width><height>100</height></image>"
        f"<clip><near>0.05</near><far>50</far></clip>{more}</camera></sensor>"
    )


def test_devices_of_a_kind_by_their_names(language, tmp_path):
    """A crate 4.5 m ahead of a rig of four cameras."""
    depth = "<ruedo:depth>true</ruedo:depth>"
    (tmp_path / "rig.sdf").write_text(
        "<sdf version='1.9' xmlns:ruedo='urn:ruedo'><world name='w'><model name='crate'><static>true</static>"
        "<pose>5 0 1 0 0 0</pose><plugin filename='gz-sim-label-system' name='gz::sim::systems::Label'><label>7</label>"
        "</plugin><link name='l'><visual name='v'><geometry><box><size>1 1 1</size></box></geometry></visual></link>"
        "</model><model name='rig'><static>true</static><pose>0 0 1 0 0 0</pose><link name='link'>"
        + camera("left", "camera", "")
        + camera("right", "camera", "", depth)
        + camera("flat", "boundingbox", "<box_type>2d</box_type>")
        + camera("solid", "boundingbox", "<box_type>3d</box_type>")
        + "</link></model></world></sdf>"
    )
    with ruedo_run("--no-noise", world=str(tmp_path / "rig.sdf")) as server:
        said = api(language, server.url, "devices_by_name")
    assert said.numbers("width") == [200] and said.numbers("depth") == [200]
    assert said.words("boxes") == ["crate", "7"]
    assert said.words("solid")[0] == "crate"
    assert [float(one) for one in said.words("solid")[1:]] == pytest.approx([5.0, 0.0, 0.0])


def test_launch_has_options_by_name_and_suggests(tmp_path):
    import ruedo

    with pytest.raises(
        TypeError, match=r"launch\(\) has no option lockstpe: did you mean lockstep\?"
    ):
        ruedo.launch(HALL, lockstpe=1)
    with pytest.raises(TypeError, match=r"no option worlds_; it has world, |did you mean"):
        ruedo.launch(HALL, worlds_=1)
    with (
        pytest.warns(
            DeprecationWarning, match=r"launch\(set=\.\.\.\) is deprecated: it is settings"
        ),
        ruedo.launch(HALL, lockstep=1, set={"p3at/lrf.range.max": 3.0}) as sim,
    ):
        assert sim.robot("p3at").lrf.range_max == 3.0
    log = str(tmp_path / "run.lcm")
    with ruedo.launch(HALL, rate="max", duration=1.5, record=log, disable=["p3at/camera"]) as sim:
        times = [pose.time for pose in sim.robot("p3at").pose]  # ends with the run
    assert times[-1] <= 1.5
    with ruedo.launch(HALL, paused=True, disable=["p3at/camera"]) as sim:
        assert sim.state().step == 0


def test_asyncio_reads_streams_without_threads_of_the_users():
    import asyncio

    import ruedo

    async def read(sim, counts):
        async for scan in sim.robot("p3at").lrf:
            counts.append(scan.utime)
            if len(counts) == 5:
                return

    async def both(sim):
        scans, ticks, poses = [], [], []

        async def beat():
            async for t in sim.every(0.1):
                ticks.append(t)
                if len(ticks) == 5:
                    return

        async def follow():
            async for pose in sim.robot("p3at").pose.reader():
                poses.append(pose.utime)
                if len(poses) == 20:
                    return

        await asyncio.wait_for(asyncio.gather(read(sim, scans), beat(), follow()), PATIENCE)
        return scans, ticks, poses

    with ruedo.launch(HALL, noise=False, disable=["p3at/camera"]) as sim:
        scans, ticks, poses = asyncio.run(both(sim))
    assert scans == sorted(set(scans)) and poses == sorted(set(poses))
    assert [round(one / 0.1, 6) % 1.0 for one in ticks] == pytest.approx([0.0] * 5)


def test_the_jars_messages_are_lcms_too(tmp_path):
    """LCM's own library publishes one of ruedo.jar, and reads it again, whichever comes first."""
    import shutil
    from pathlib import Path

    import lcm

    if "java" not in APIS or not shutil.which("javac"):
        pytest.skip("no JDK here")
    own = str(next(Path(lcm.__file__).resolve().parents[2].glob("**/share/java/lcm.jar"), ""))
    own = own or str(Path(sys.prefix) / "lib/python3/site-packages/share/java/lcm.jar")
    (tmp_path / "Both.java").write_text(
        "import lcm.lcm.*; import ruedo.lcmtypes.pose_t; public class Both { public static void main(String[] a)"
        " throws Exception { LCM lcm = new LCM(\"memq://\"); lcm.subscribe(\"P\", (l, c, in) -> { try {"
        " System.out.println(new pose_t(in).utime); } catch (java.io.IOException e) { throw new RuntimeException(e); } });"
        " pose_t pose = new pose_t(); pose.utime = 42; LCMEncodable one = pose; lcm.publish(\"P\", one);"
        " Thread.sleep(500); System.exit(0); } }"
    )
    for both in (f"{BUILD}/java/ruedo.jar:{own}", f"{own}:{BUILD}/java/ruedo.jar"):
        path = f"{both}:{tmp_path}"
        subprocess.run(["javac", "-cp", path, "-d", tmp_path, tmp_path / "Both.java"], check=True)
        done = subprocess.run(
            ["java", "-cp", path, "Both"], capture_output=True, text=True, timeout=PATIENCE
        )
        assert done.stdout == "42\n", done.stderr


def test_a_plain_lcm_program_reaches_a_launched_run():
    import lcm
    import ruedo

    with ruedo.launch(HALL, url="auto", noise=False, disable=["p3at/camera"]) as sim:
        bus, seen = lcm.LCM(sim.url), []
        bus.subscribe("p3at/pose", lambda _, data: seen.append(ruedo.lcmtypes.pose_t.decode(data)))
        while len(seen) < 3:
            bus.handle_timeout(1000)
        assert seen[0].pos[2] == pytest.approx(0.0, abs=0.2)


def test_a_state_is_saved_and_restored_as_an_engine_does(language, tmp_path):
    with ruedo_run(
        "--paused", "--disable", "p3at/camera", "--snapshots", str(tmp_path), world=HALL
    ) as server:
        said = api(language, server.url, "saves")
    assert said.words("back") == ["0", "0"]


def test_maps_give_the_same_in_each_language(language):
    """Rays by the geometry of the room, distances by SciPy's."""
    import numpy as np
    from scipy.ndimage import distance_transform_edt

    with ruedo_run("--disable", "p3at/camera", world=HALL) as server:
        said = api(language, server.url, "chart")
    assert said.words("at") == ["0", "100", "-1"]
    *rays, short = said.numbers("rays")
    assert short == math.inf
    to_pillar = math.atan2(1.8, 1.55)
    for i, ray in enumerate(rays):
        cosine, sine = math.cos(0.1 * i), math.sin(0.1 * i)
        across = (4.4 if cosine > 0 else 3.4) / abs(cosine)
        along = (3.65 if sine > 0 else 2.15) / abs(sine) if sine else math.inf
        if abs(0.1 * i - to_pillar) > 0.06:
            assert ray == pytest.approx(min(across, along), abs=2e-6)
    cells = np.zeros((60, 80))
    cells[[0, -1], :] = cells[:, [0, -1]] = cells[40, 50] = 100
    expected = distance_transform_edt(cells != 100)[::7, ::9] * 0.1
    assert said.numbers("field") == pytest.approx(expected.ravel().tolist(), abs=1e-6)
    assert said.words("grown") == ["True", "False"]


def test_a_subscription_during_a_sample_gets_the_next_one(monkeypatch):
    """Between its decoding, for which nobody had asked, and the calls."""
    import ruedo

    with ruedo.launch(HALL, disable=["p3at/camera"]) as sim:
        pose, seen, listening = sim.robot("p3at").pose, [], []
        pose.latest()
        lost_before = pose._lost_before

        def listen(utime):
            if not listening:
                listening.append(pose.on_arrival(seen.append))
            return lost_before(utime)

        monkeypatch.setattr(pose, "_lost_before", listen)
        while len(seen) < 3:
            pose.next()
        assert None not in seen
