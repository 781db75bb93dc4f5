"""What a shell gives the program: closed streams, full devices, empty variables, files that are
both read and written.
"""

import os
import resource
import shutil
import signal
import struct
import subprocess
import time

import pytest
from recorded import RUEDO, events, program, until

WORLD = """<sdf version='1.9'><world name='w'><include><uri>model://ground_plane</uri></include>
<include><uri>model://p3at</uri></include></world></sdf>"""
RUN = ["--disable", "p3at/camera", "--rate", "max", "--duration", "0.5", "--lcm", "memq://"]


@pytest.fixture
def world(tmp_path):
    path = tmp_path / "w.sdf"
    path.write_text(WORLD)
    return path


@pytest.fixture
def log(world):
    path = world.with_name("run.lcm")
    assert program("run", world, "--quiet", *RUN, "--record", path).returncode == 0
    return path


def shell(line, *arguments):
    return subprocess.run(
        ["sh", "-c", f'"$0" "$@" {line}', RUEDO, *map(str, arguments)], capture_output=True
    )


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_a_closed_standard_stream_is_not_reused_for_a_file(world, log, tmp_path, closed):
    """The next file that is opened would take its number, and what is printed would go there."""
    other = tmp_path / "other.lcm"
    assert shell(closed, "run", world, *RUN, "--record", other).returncode == 0
    assert events(other) == events(log)
    picture = tmp_path / "p.png"
    assert shell(closed, "render", world, "--size", "64x64", "-o", picture).returncode == 0
    content = picture.read_bytes()
    assert content.startswith(b"\x89PNG") and content.endswith(b"IEND\xae\x42\x60\x82")
    assert shell(closed, "import", tmp_path / "none.yaml").returncode == 3


@pytest.mark.parametrize("command", ["check", "info"])
@pytest.mark.parametrize("options", [[], ["--json"]])
def test_a_full_standard_output_is_reported(world, command, options):
    result = shell("> /dev/full", command, world, *options)
    assert result.returncode == 4 and result.stderr.count(b"\n") == 1, result
    assert b"No space left" in result.stderr


@pytest.mark.parametrize(
    ("code", "arguments"),
    [
        (0, ["check", "WORLD"]),
        (0, ["run", "WORLD", *RUN, "--quiet"]),
        (1, ["regress", "WORLD", "--goal", "9,9,0.1,0.2", "--duration", "0.3", "--record", "LOG"]),
        (2, ["check", "WORLD", "--no-such-option"]),
        (3, ["check", "BAD"]),
        (4, ["run", "WORLD", *RUN, "--quiet", "--record", "/proc/no.lcm"]),
    ],
)
def test_errors_that_cannot_be_printed_change_no_result(world, tmp_path, code, arguments):
    """The world has findings, which are printed there, too."""
    world.write_text(WORLD.replace("</world>", "<audio device='x'/></world>"))
    (tmp_path / "bad.sdf").write_text("<sdf>")
    places = {"WORLD": world, "LOG": tmp_path / "r.lcm", "BAD": tmp_path / "bad.sdf"}
    result = shell("2> /dev/full", *(places.get(each, each) for each in arguments))
    assert result.returncode == code, result


@pytest.mark.parametrize(
    "arguments", [["check", "arena"], ["render", "arena", "--size", "64x64", "-o", "PICTURE"]]
)
def test_a_full_disk_costs_no_mesh_and_no_picture(tmp_path, arguments):
    """Of the temporary folder and of the caches, Mesa's too."""
    disk, picture = tmp_path / "disk", tmp_path / "picture.png"
    disk.mkdir()
    full = "mount -t tmpfs -o size=64k tmpfs $0 && ! cat /dev/zero > $0/fill && exec \"$@\""
    result = subprocess.run(
        ["unshare", "-rm", "sh", "-c", full, disk, RUEDO]
        + [str(picture) if each == "PICTURE" else each for each in arguments],
        env={**os.environ, "TMPDIR": str(disk), "XDG_CACHE_HOME": str(disk)},
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result
    assert "importer" not in result.stdout + result.stderr


def test_a_file_size_limit_is_a_full_disk(world, tmp_path):
    limit = 4096

    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    path = tmp_path / "large.lcm"
    result = program("run", world, "--quiet", *RUN, "--record", path, preexec_fn=limited)
    assert result.returncode == 4 and "File too large" in result.stderr, result


@pytest.mark.parametrize("option", ["--record", "--restore", "--snapshots", "--lcm", "--types"])
def test_an_empty_variable_counts_as_unset(world, option):
    result = program("run", world, "--quiet", *RUN[:-2], option, "")
    assert result.returncode == 2 and option in result.stderr, result
    assert "an empty value is not allowed" in result.stderr


@pytest.mark.parametrize("odd", ["\033[2J", "\r", "\x7f", "\x9b"])
def test_a_name_cannot_speak_to_the_terminal(world, log, tmp_path, odd):
    for file, command in (
        (world, ["check"]),
        (world, ["run", "--duration", "1"]),
        (log, ["export"]),
        (log, ["play", "--html"]),
        (log, ["verify"]),
    ):
        name = tmp_path / f"a{odd}b{file.suffix}"
        name.write_bytes(file.read_bytes())
        result = program(*command, name)
        assert result.returncode == 2 and "the control character 0x" in result.stderr, result
        assert odd not in result.stdout + result.stderr.rstrip("\n"), result
    latin = os.fsencode(tmp_path) + b"/caf\xe9" + os.fsencode(world.suffix)
    shutil.copy(world, latin)
    assert program("check", os.fsdecode(latin), errors="replace").returncode == 0


def test_no_command_overwrites_its_input(world, log, tmp_path):
    map_file = tmp_path / "map.yaml"
    assert program("map", world, "-o", map_file).returncode == 0
    linked = tmp_path / "linked.lcm"
    linked.symlink_to(log)
    for path, command in (
        (world, ["run", world, *RUN, "--record", world]),
        (world, ["render", world, "-o", world]),
        (world, ["map", world, "-o", world]),
        (map_file, ["import", map_file, "-o", map_file]),
        (log, ["export", log, log]),
        (log, ["export", log, linked]),
        (log, ["play", log, "--html", log]),
        (log, ["render", log, "--video", log]),
        (log, ["diff", log, log, "--junit", log]),
        (log, ["regress", world, "--golden", log, "--record", log, "--duration", "1"]),
    ):
        before = path.read_bytes()
        result = program(*command)
        assert result.returncode == 2 and "which would be lost" in result.stderr, result
        assert path.read_bytes() == before
    for one, other in (
        (tmp_path / "new", tmp_path / "new"),
        (tmp_path / "new", f"{tmp_path}/./new"),
        ("new", "./new"),
        ("new", f"{os.getcwd()}/new"),
    ):
        two = ["--junit", one, "--html", other]
        assert "is the same file as" in program("diff", log, log, *two).stderr


def test_output_into_a_file_leaves_the_rest_of_it(log):
    line = "--junit /dev/stdout"
    together = f'(echo before; "$0" "$@" {line}; echo after) > all; cat all'
    done = subprocess.run(
        ["sh", "-c", together, RUEDO, "diff", log, log],
        capture_output=True,
        text=True,
        cwd=log.parent,
    )
    assert done.stdout.startswith("before\n") and done.stdout.endswith("after\n"), done
    assert "<testsuite" in done.stdout


@pytest.fixture
def made_of_files(world):
    """A world of many files, none of which a command line names."""
    folder = world.parent
    (folder / "part.sdf").write_text(
        "<sdf version='1.9'><model name='part'><static>true</static><link name='l'><visual name='v'>"
        "<geometry><mesh><uri>t.obj</uri></mesh></geometry><material><pbr><metal><albedo_map>p.png"
        "</albedo_map></metal></pbr></material></visual><visual name='h'><geometry><heightmap>"
        "<uri>h.pgm</uri><size>1 1 1</size></heightmap></geometry></visual></link></model></sdf>"
    )
    (folder / "t.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "h.pgm").write_bytes(b"P5\n3 3\n255\n" + bytes(range(9)))
    made = program("render", world, "--size", "64x64", "-o", folder / "p.png")
    assert made.returncode == 0, made
    world.write_text(
        WORLD.replace("</world>", "<include><uri>part.sdf</uri></include></world>").replace(
            "'w'", "'many'"
        )
    )
    return world


def test_outputs_never_overwrite_inputs(made_of_files, tmp_path):
    world, log = made_of_files, tmp_path / "many.lcm"
    assert program("run", world, "--quiet", *RUN, "--record", log).returncode == 0
    (tmp_path / "m.yaml").write_text("image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    (tmp_path / "m.pgm").write_bytes(b"P5\n2 2\n255\n" + bytes(4))
    (tmp_path / "linked.sdf").symlink_to("part.sdf")
    kept = {path: path.read_bytes() for path in tmp_path.iterdir()}
    for command in (
        ["import", "m.yaml", "-o", "m.pgm"],
        *(
            ["run", world, "--quiet", *RUN, "--record", file]
            for file in ("part.sdf", "linked.sdf", "t.obj", "p.png", "h.pgm")
        ),
        ["regress", world, "--duration", "0.1", "--record", "t.obj"],
        ["render", world, "--size", "64x64", "-o", "p.png"],
        ["map", world, "-o", "h.yaml"],
        ["export", log, world],
        ["export", log, "t.obj"],
        ["play", log, "--html", world],
        ["play", log, "--html", "p.png"],
    ):
        result = program(*command, cwd=tmp_path)
        assert result.returncode == 2 and "which would be lost" in result.stderr, (command, result)
        assert result.stderr.count("\n") == 1
        assert {path: path.read_bytes() for path in tmp_path.iterdir()} == kept, command


def test_a_log_may_lie_beside_message_types(world, tmp_path):
    """It is looked at, since it is called as they are, and may be written anew."""
    (tmp_path / "mine.lcm").write_text("struct mine_t { int32_t x; }")
    log = tmp_path / "run.lcm"
    for _ in range(2):
        command = ["run", world, "--quiet", *RUN, "--types", tmp_path, "--record"]
        assert program(*command, log).returncode == 0
    result = program(*command, tmp_path / "mine.lcm")
    assert result.returncode == 2 and "which would be lost" in result.stderr, result


def test_two_runs_do_not_record_into_one_file(world, tmp_path):
    log = tmp_path / "both.lcm"
    command = ["run", str(world), "--quiet", "--lcm", "memq://", "--paused", "--record", str(log)]
    with subprocess.Popen([RUEDO, *command]) as first:
        try:
            until(log.exists)
            until(lambda: log.stat().st_size > 0)  # its header
            second = program(*command, "--duration", "0")
            assert second.returncode == 4, second
            assert "another run records into it" in second.stderr
        finally:
            first.terminate()


def test_a_page_for_a_fifo_can_be_given_up(log, tmp_path):
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    with subprocess.Popen(
        [RUEDO, "play", log, "--html", fifo], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        time.sleep(2)  # no test of how fast: it may end before it waits
        process.send_signal(signal.SIGTERM)
        assert process.wait(400) != 0


# Files in place of .lcm files, and their errors.
NO_TYPES = {
    "text": ("hello, world\n", "holds no message type"),
    "fifo": (os.mkfifo, "is not a regular file"),
    "device": (lambda path: os.symlink("/dev/zero", path), "is not a regular file"),
    "large": (lambda path: os.truncate(os.open(path, os.O_CREAT | os.O_RDWR), 20 << 30), "bytes"),
    "deep": (
        "struct a0 { int8_t x; }"
        + "".join(f"struct a{i} {{ a{i - 1} x; }}" for i in range(1, 20_000)),
        "structs in structs more than 16 deep",
    ),
    "many": (
        "struct a0 { int8_t x; }"
        + "".join(f"struct a{i} {{ a{i - 1} x, y; }}" for i in range(1, 16)),
        "more than 10000 fields",
    ),
    "wide": (
        "struct a { " + "".join(f"int8_t x{i}; " for i in range(20_000)) + "}",
        "more than 10000 fields",
    ),
    "nothing": ("struct e { } struct a { e x[2000000000]; }", "which holds nothing"),
}


@pytest.mark.parametrize("kind", NO_TYPES)
def test_hostile_types_are_refused_at_once(log, tmp_path, kind):
    content, says = NO_TYPES[kind]
    path = tmp_path / "types.lcm"
    path.write_text(content) if isinstance(content, str) else content(path)

    def limited():
        resource.setrlimit(resource.RLIMIT_CPU, (20, 21))
        resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))

    command = ["play", log, "--types", path, "--lcm", "memq://", "--speed", "max"]
    result = program(*command, preexec_fn=limited)
    assert result.returncode == 3 and says in result.stderr, result
    assert result.stderr.count("\n") == 1


def test_a_folder_of_types_may_hold_logs(log, tmp_path):
    command = ["play", log, "--types", tmp_path, "--lcm", "memq://", "--speed", "max"]
    result = program(*command)
    assert result.returncode == 3 and "no .lcm file of message types" in result.stderr, result
    (tmp_path / "own.lcm").write_text("struct own_t { double x; }")
    assert program(*command).returncode == 0


def test_a_picture_of_gigabytes_is_not_read(tmp_path):
    head = struct.pack(">I4sIIBBBBB", 13, b"IHDR", 64, 64, 8, 2, 0, 0, 0)
    with open(tmp_path / "huge.png", "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + head)
        file.truncate(20 << 30)
    (tmp_path / "t.sdf").write_text(
        "<sdf version='1.9'><world name='w'><model name='m'><static>1</static><link name='l'>"
        "<visual name='v'><geometry><box><size>1 1 1</size></box></geometry><material><pbr><metal>"
        "<albedo_map>huge.png</albedo_map></metal></pbr></material></visual></link></model></world></sdf>"
    )

    def limited():
        resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
        resource.setrlimit(resource.RLIMIT_CPU, (30, 31))

    result = program(
        *("render", tmp_path / "t.sdf", "--size", "64x64", "-o", tmp_path / "p.png"),
        preexec_fn=limited,
    )
    assert result.returncode in (0, 3), result  # drawn without it, or refused


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("p.png", ["render", "WORLD", "--size", "64x64", "-o"]),
        ("w.sdf", ["bench", "--write-world"]),
        ("d.html", ["diff", "LOG", "LOG", "--html"]),
        ("e.mcap", ["export", "LOG"]),
        ("h.html", ["play", "LOG", "--html"]),
        ("v.webm", ["render", "LOG", "--size", "64x64", "--video"]),
    ],
)
def test_existing_files_outlive_a_full_disk(world, log, tmp_path, name, arguments):
    places = {"WORLD": str(world), "LOG": str(log)}
    arguments = [places.get(each, each) for each in arguments]
    disk = tmp_path / "disk"
    disk.mkdir()
    full = (
        "mount -t tmpfs -o size=64k tmpfs $0 && echo kept > $0/$1 && ! cat /dev/zero > $0/fill "
        "&& ! cat /dev/zero >> $0/fill "
        '&& at=$0 && name=$1 && shift && "$@" $at/$name; echo $?; cat $at/$name; ls $at'
    )
    result = subprocess.run(
        ["unshare", "-rm", "sh", "-c", full, disk, name, RUEDO, *arguments],
        capture_output=True,
        text=True,
    )
    assert result.stdout.split()[-4:] == ["4", "kept", *sorted([name, "fill"])], result
    written = "the video" if name == "v.webm" else name
    assert f"{written} cannot be written" in result.stderr
    assert "No space left on device" in result.stderr


def test_a_rewritten_file_keeps_its_link_and_its_mode(world, tmp_path):
    target, link = tmp_path / "p.png", tmp_path / "link.png"
    target.write_bytes(b"old")
    target.chmod(0o640)
    link.symlink_to(target)
    assert program("render", world, "--size", "64x64", "-o", link).returncode == 0
    assert link.is_symlink() and target.read_bytes().startswith(b"\x89PNG")
    assert target.stat().st_mode & 0o777 == 0o640
    assert sorted(p.name for p in tmp_path.glob("p.png*")) == ["p.png"]


def test_a_file_in_a_folder_that_takes_no_others_is_written(world, tmp_path):
    """Here: one that is mounted by itself, as into a container."""
    source, target = tmp_path / "source.sdf", tmp_path / "w2.sdf"
    source.write_text("old")
    target.touch()
    result = subprocess.run(
        ["unshare", "-rm", "sh", "-c", 'mount --bind $1 $2 && "$0" bench --write-world $2']
        + [RUEDO, source, target],
        capture_output=True,
    )
    assert result.returncode == 0, result
    assert "<sdf" in source.read_text()
    assert sorted(p.name for p in tmp_path.glob("*.part*")) == []
