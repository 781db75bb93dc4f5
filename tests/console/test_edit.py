"""ruedo edit: worlds drawn, moved and saved in a browser, on the default transport; what is saved,
and what is refused."""

import json
import math
import os
import re
import shutil
import struct
import subprocess
import time
from xml.etree import ElementTree

import pytest
from harness import (
    ARENA,
    BUILD,
    RUEDO,
    SEEN,
    SOURCE,
    WANT,
    Socket,
    browse,
    browser,
    get,
    judged,
    needs_browser,
    running,
    serving,
)

KINDS = {"JOIN": 1, "SPAWN": 8, "REMOVE": 9, "SET_POSE": 10, "SAVE": 20}


def editing(*arguments, folder):
    return serving("edit", *arguments, "--view", "127.0.0.1:0", cwd=folder)


class Client:
    """Requests over the console's socket, as a page makes them."""

    def __init__(self, port):
        from ruedo.lcmtypes import join_t

        self.socket = Socket(port)
        self.session = self.sequence = 0
        self.socket.send(bytes([WANT]) + b"ruedo/reply")
        join = join_t()
        join.client = "test"
        self.session = self.ask("JOIN", join, sequence=4711).session

    def ask(self, kind, body=None, sequence=0):
        from ruedo.lcmtypes import reply_t, request_t

        request = request_t()
        request.epoch = -1
        request.session = self.session
        self.sequence += 1 if self.session else 0
        request.sequence = sequence or self.sequence
        request.kind = KINDS[kind]
        request.body = body.encode() if body else b""
        request.size = len(request.body)
        self.socket.command("ruedo/request", request)
        while True:
            opcode, data = self.socket.receive()
            if opcode != 2:
                continue
            self.socket.send(bytes([SEEN]))
            at = 4
            while at < len(data):
                (size,) = struct.unpack_from("<I", data, at + 4)
                reply = reply_t.decode(data[at + 8 : at + 8 + size])
                at += 8 + size
                if reply.sequence == request.sequence and reply.kind == request.kind:
                    return reply

    def ask_of(self, kind, name):
        from ruedo.lcmtypes import name_request_t

        body = name_request_t()
        body.name = name
        return self.ask(kind, body)

    def remove(self, name):
        return self.ask_of("REMOVE", name)


def libsdformat_reads(world):
    """{model: x, y, z, roll, pitch, yaw} as libsdformat has them; None where there is none (Debian
    13). Fails for what it complains about.
    """
    reader = BUILD / "tests/worlds/sdf_reads"
    if not reader.exists():
        return None
    done = subprocess.run([reader, world], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    models = (line.split("\t") for line in done.stdout.splitlines())
    return {name: [float(v) for v in pose.split()] for name, pose in models}


def listed(world):
    """What ruedo check says of a world."""
    return subprocess.run([RUEDO, "check", world], capture_output=True, text=True, check=False)


@needs_browser
def test_a_world_is_made_in_the_browser(tmp_path):
    with editing("lab.sdf", "--record", "run.lcm", folder=tmp_path) as process:
        seen = browse(process.url, tmp_path, "edit")
    for what in (
        "it opens with the page World",
        "it says where it saves to",
        "a wall stands where it was drawn",
        "a room stands where it was drawn",
        "a door is cut",
        "pictures of the library are there",
        "a robot from the library stands there",
        "a click selects",
        "numbers move it",
        "numbers turn it",
        "a handle moves it",
        "along one axis, with a snap",
        "the tree's search selects",
        "a wall is moved",
        "a copy stands beside it",
        "it is deleted",
        "undo takes both back",
        "redo does it again",
        "it is scaled",
        "physics settles it",
        "it is saved",
        "nothing is left to save",
    ):
        assert what in seen
    saved = (tmp_path / "lab.sdf").read_text()
    empty = (SOURCE / "worlds/empty.sdf").read_text()
    assert saved.startswith(empty[: empty.index("  </world>")].rstrip())  # what it began with
    assert re.findall(r"<(?:model|visual) name=\"(.*?)\"", saved).count("wall_above") == 2
    check = listed(tmp_path / "lab.sdf")
    assert check.returncode == 0, check.stdout + check.stderr
    # Each model is in the file where the page showed it.
    poses = json.loads(next(line for line in seen if line.startswith("poses: ")).split(": ", 1)[1])
    with editing("lab.sdf", folder=tmp_path) as process:
        scene = json.loads(get(process.port, "/scene.json")[1])
        found = {model["name"]: model["pose"] for model in scene["models"] if model["fast"]}
        for name, pose in found.items():
            assert pose == pytest.approx(poses[name], abs=1e-5)
        assert {model["name"] for model in scene["models"]} == set(poses)
    if (others := libsdformat_reads(tmp_path / "lab.sdf")) is not None:
        assert set(others) == set(poses)
        for name, (x, y, z, qw, _, _, qz) in ((name, poses[name]) for name in found):
            assert others[name][:3] == pytest.approx([x, y, z], abs=1e-5)
            turn = others[name][5] - 2 * math.atan2(qz, qw)
            assert math.remainder(turn, 2 * math.pi) == pytest.approx(0, abs=1e-5)
    # The run with all these changes is repeated bit for bit.
    verified = subprocess.run(
        [RUEDO, "verify", tmp_path / "run.lcm"], capture_output=True, text=True, check=False
    )
    assert verified.returncode == 0, verified.stdout + verified.stderr


STANDING = """<?xml version="1.0"?>
<sdf version="1.9"><world name="it stands">
  <include><uri>model://sun</uri></include>
  <include><uri>model://ground_plane</uri></include>
  <!-- in the air -->
  <model name="na\u00efve &lt;b&gt; box / 1"><pose>1 2 1.25 0 0 0</pose><link name="l">
    <collision name="c"><geometry><box><size>.5 .5 .5</size></box></geometry></collision>
    <visual name="v"><geometry><box><size>.5 .5 .5</size></box></geometry></visual></link></model>
  <include><uri>model://p3dx</uri><pose>-2 0 0 0 0 0.5</pose></include>
</world></sdf>
"""
NAME = "na\u00efve <b> box / 1"


def poses_of(world):
    """{model or uri: its <pose> as numbers}."""
    return {
        each.get("name") or each.findtext("uri"): [float(v) for v in each.findtext("pose").split()]
        for each in ElementTree.parse(world).iter()
        if each.tag in ("model", "include") and each.find("pose") is not None
    }


@needs_browser
def test_a_world_that_stands_is_seen_and_edited(tmp_path):
    """Nothing was stepped before somebody looked, and a model's name is any text."""
    world = tmp_path / "w.sdf"
    world.write_text(STANDING, encoding="utf-8")
    before = poses_of(world)
    with editing("w.sdf", folder=tmp_path) as process:
        given = {"model": NAME, "pose": [1, 2, 1.25, 1, 0, 0, 0]}
        browse(process.url, tmp_path, "standing", given)
    assert listed(world).returncode == 0
    after = poses_of(world)
    assert after.keys() == before.keys()
    if (others := libsdformat_reads(world)) is not None:
        assert others[NAME] == pytest.approx(after[NAME], abs=1e-9)
    for name, pose in before.items():
        assert after[name] == pytest.approx(pose, abs=2e-3)
    assert "<!-- in the air -->" in world.read_text(encoding="utf-8")


def comes_to_know(process, utime):
    """A page that comes now gets the bodies' state of that time."""
    from ruedo.lcmtypes import world_state_t

    viewer = Socket(process.port)
    viewer.send(bytes([WANT]) + b"ruedo/world")
    while True:
        (message,) = viewer.frame().values()
        state = world_state_t.decode(message)
        if state.utime == utime:
            break
    assert state.n > 0
    viewer.close()


def test_a_late_client_of_a_paused_run_gets_its_state(tmp_path):
    import ruedo

    with running("--paused", "--disable", "p3at/camera") as process:
        time.sleep(1)  # its first state is published
        comes_to_know(process, 0)
        time.sleep(1)
        with ruedo.connect(timeout=60) as sim:
            sim.step(200)  # without a viewer
            utime = round(200 * sim.step_size * 1e6)
        comes_to_know(process, utime)


@needs_browser
def test_saving_over_a_changed_file_needs_a_confirmation(tmp_path):
    world = tmp_path / "w.sdf"
    world.write_bytes(ARENA.read_bytes())
    said = []
    with (
        editing("w.sdf", folder=tmp_path) as process,
        browser(process.url, tmp_path, "save") as page,
    ):
        for line in page.stdout:
            said.append(line.rstrip())
            if line.startswith("change the file"):
                world.write_text("<mine/>")
                page.stdin.write("done\n")
                page.stdin.flush()
        judged("save", tmp_path, said, page.wait(60))
    saved = (tmp_path / "w_2.sdf").read_text()
    assert world.read_text() == saved and "box_1" not in saved and "box_2" in saved


def test_unchanged_parts_are_saved_to_the_byte(tmp_path):
    with editing(ARENA, "--save-as", "mine.sdf", folder=tmp_path) as process:
        reply = Client(process.port).ask("SAVE")
        assert (reply.code, reply.text) == (0, "")
    assert (tmp_path / "mine.sdf").read_bytes() == ARENA.read_bytes()


def test_the_named_file_is_written_and_no_other(tmp_path):
    world = tmp_path / "w.sdf"
    world.write_bytes(ARENA.read_bytes())
    world.chmod(0o640)
    with editing("w.sdf", folder=tmp_path) as process:
        client = Client(process.port)
        assert client.remove("box_1").code == 0
        assert client.ask("SAVE").code == 0
        text = ARENA.read_text()
        begin = text.index('    <model name="box_1">')
        end = text.index("</model>\n", begin) + len("</model>\n")
        assert world.read_text() == text[:begin] + text[end:]
        assert world.stat().st_mode & 0o777 == 0o640
        assert [path.name for path in tmp_path.iterdir()] == ["w.sdf"]  # nothing is left beside it
        # Another program's change is not lost.
        world.write_text("<mine/>")
        reply = client.ask("SAVE")
        assert reply.code == 3 and "changed" in reply.text
        assert world.read_text() == "<mine/>"
        # Unless that is wished: beside it, or in its place.
        assert client.ask_of("SAVE", "../other.sdf").code not in (0, 3)
        (tmp_path / "w_2.sdf").symlink_to("nowhere")
        reply = client.ask_of("SAVE", "copy")
        assert (reply.code, reply.text) == (0, "w_3.sdf")
        saved = text[:begin] + text[end:]
        assert world.read_text() == "<mine/>" and (tmp_path / "w_3.sdf").read_text() == saved
        assert client.ask("SAVE").code == 3
        assert client.ask_of("SAVE", "overwrite").code == 0 and world.read_text() == saved
        names = {path.name for path in tmp_path.iterdir()}
        assert names == {"w.sdf", "w_2.sdf", "w_3.sdf"} and not (tmp_path / "nowhere").exists()


def test_a_file_created_meanwhile_is_not_overwritten(tmp_path):
    """A new world's file is there by now, as whatever: what cannot be read is kept, too."""
    world = tmp_path / "new.sdf"
    with editing("new.sdf", folder=tmp_path) as process:
        client = Client(process.port)
        for make in (
            lambda: os.mkfifo(world),
            lambda: world.symlink_to("nowhere"),
            world.mkdir,
            lambda: (world.touch(), os.truncate(world, 65 << 20)),
        ):
            make()
            before = world.lstat()
            reply = client.ask("SAVE")
            assert reply.code == 3 and "exists by now" in reply.text
            assert world.lstat().st_ino == before.st_ino
            world.rmdir() if world.is_dir() else world.unlink()
        assert client.ask("SAVE").code == 0


def test_a_new_world_is_as_private_as_its_user_wants(tmp_path):
    before = os.umask(0o077)
    try:
        with editing("new.sdf", folder=tmp_path) as process:
            assert Client(process.port).ask("SAVE").code == 0
    finally:
        os.umask(before)
    assert (tmp_path / "new.sdf").stat().st_mode & 0o777 == 0o600


def test_only_a_server_that_edits_saves(tmp_path):
    with serving("run", ARENA, "--quiet", "--view", "127.0.0.1:0", cwd=tmp_path) as process:
        reply = Client(process.port).ask("SAVE")
        assert reply.code == 8 and "ruedo edit" in reply.text
        # No path leads out of what is served.
        for path in (
            "/library/../../etc/passwd",
            "/library/x/scene.json",
            "/library/99999/scene.json",
            "/scene/models/-1",
            "/scene/models/1e3",
            "/scene/models/99999",
            "/library/0",
            "/library/18446744073709551616/scene.json",
            "/library/0/scene/textures/9",
        ):
            assert get(process.port, path)[0] == 404
        assert b"<model" in get(process.port, "/scene/models/3")[1]
    assert list(tmp_path.iterdir()) == []


def said(*arguments, folder):
    result = subprocess.run(
        [RUEDO, "edit", *arguments, "--view", "127.0.0.1:0"],
        capture_output=True,
        text=True,
        cwd=folder,
        timeout=60,
        check=False,
    )
    return result.returncode, result.stderr


def test_edit_refuses_first_if_it_cannot_save(tmp_path):
    (tmp_path / "world.sdf").write_text("<sdf/>")
    (tmp_path / "r.urdf").write_text("<robot name='r'><link name='l'/></robot>")
    for arguments, code, words in [
        ([], 2, "world.sdf is there already"),
        (["arena"], 2, "--save-as"),
        (["r.urdf"], 2, "--save-as"),
        (["arena", "--save-as", "notes.txt"], 2, "FILE.sdf"),
        (["arena", "--save-as", "/no/such/folder/w.sdf"], 4, "cannot be written"),
        (["no_such_world"], 3, "no world of that name"),
    ]:
        found = said(*arguments, folder=tmp_path)
        assert found[0] == code and words in found[1], (arguments, found)
    assert (tmp_path / "world.sdf").read_text() == "<sdf/>"


MODEL = """<sdf version="1.9"><model name="{name}"><static>1</static><link name="l">
<visual name="v"><geometry><mesh><uri>{mesh}</uri></mesh></geometry></visual></link></model></sdf>"""
TETRAHEDRON = "solid t\n%sendsolid t\n" % "".join(
    f"facet normal 0 0 0\nouter loop\n{''.join(f'vertex {corner}' + chr(10) for corner in face)}"
    "endloop\nendfacet\n"
    for face in (
        ("0 0 0", "0 1 0", "1 0 0"),
        ("0 0 0", "1 0 0", "0 0 1"),
        ("0 0 0", "0 0 1", "0 1 0"),
        ("1 0 0", "0 1 0", "0 0 1"),
    )
)


def drawn(process):
    """What a page gets of the world's looks."""
    scene = json.loads(get(process.port, "/scene.json")[1])
    return [model["name"] for model in scene["models"]], get(process.port, "/scene/meshes")[1]


def test_a_world_saved_in_another_folder_opens_the_same(tmp_path, monkeypatch):
    """With the models and meshes that lie beside the first one. Where they are out of reach, an
    error comes before anything is edited.
    """
    first = tmp_path / "one" / "worlds"
    for name, mesh, into in (("thing", "t.stl", "models/thing"), ("other", "m/t.stl", ".")):
        (first / into / mesh).parent.mkdir(parents=True)
        (first / into / mesh).write_text(TETRAHEDRON)
        text = MODEL.format(name=name, mesh=mesh)
        (first / into / "model.sdf").write_text(text)
    model = re.search("<model.*</model>", text, re.DOTALL)[0]
    (first / "model.sdf").unlink()
    (first / "w.sdf").write_text(
        f"""<sdf version="1.9"><world name="w"><include><uri>model://thing</uri></include>{model}
</world></sdf>"""
    )
    beside, far = tmp_path / "one/elsewhere", tmp_path / "two/worlds"
    beside.mkdir()
    far.mkdir(parents=True)
    for to in (beside, first / "m"):
        with editing("w.sdf", "--save-as", to / "w.sdf", folder=first) as process:
            before = drawn(process)
            assert Client(process.port).ask("SAVE").text == ""
        with editing("w.sdf", folder=to) as process:
            assert drawn(process) == before and "thing" in before[0] and len(before[1]) > 100
        assert listed(to / "w.sdf").returncode == 0
    code, words = said(first / "w.sdf", "--save-as", "w.sdf", folder=far)
    path = f"{first / 'm'}:{first / 'models'}"
    assert code == 2 and f"RUEDO_PATH={path}" in words and not (far / "w.sdf").exists()
    monkeypatch.setenv("RUEDO_PATH", path)
    with editing(first / "w.sdf", "--save-as", "w.sdf", folder=far) as process:
        assert Client(process.port).ask("SAVE").text == ""
    with editing("w.sdf", folder=far) as process:
        assert drawn(process) == before


def test_a_library_lists_models_only(tmp_path):
    """Not a folder of meshes that models share, with a model.config that names no model."""
    shutil.copy(ARENA, tmp_path / "w.sdf")
    for name, sdf in (
        ("shared", ""),
        ("lost", "<sdf>gone.sdf</sdf>"),
        ("good", "<sdf>a.sdf</sdf>"),
    ):
        (tmp_path / "models" / name).mkdir(parents=True)
        (tmp_path / "models" / name / "model.config").write_text(f"<model>{sdf}</model>")
    (tmp_path / "models/good/t.stl").write_text(TETRAHEDRON)
    (tmp_path / "models/good/a.sdf").write_text(MODEL.format(name="good", mesh="t.stl"))
    with editing("w.sdf", folder=tmp_path) as process:
        names = [each["name"] for each in json.loads(get(process.port, "/library.json")[1])]
        assert names[-1] == "good" and not {"shared", "lost"} & set(names)
        for i in range(len(names)):
            assert get(process.port, f"/library/{i}/scene.json")[0] == 200


def test_a_urdf_is_saved_as_a_world(tmp_path):
    (tmp_path / "r.urdf").write_text(
        "<robot name='r'><link name='l'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' "
        "iyz='0' izz='1'/></inertial><collision><geometry><box size='1 1 1'/></geometry></collision>"
        "</link></robot>"
    )
    with editing("r.urdf", "--save-as", "w.sdf", folder=tmp_path) as process:
        assert Client(process.port).ask("SAVE").code == 0
    assert listed(tmp_path / "w.sdf").returncode == 0
    assert "<uri>r.urdf</uri>" in (tmp_path / "w.sdf").read_text()
