"""Files from strangers: logs that name files that they must not, and small files that would cost
much. Each ends soon, with one line.
"""

import hashlib
import os
import resource
import struct
import subprocess

import pytest
import ruedo
from recorded import ARENA, PATIENCE, RUEDO, events, program, until, url, write
from ruedo.lcmtypes import log_file_t, log_header_t

WORLD = "<sdf version='1.9'><world name='w'><model name='m'><link name='l'><sensor name='imu' type='imu'/></link></model></world></sdf>"
SECRET = "<secret>the words of another</secret>"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A log of a small world, in a folder of its own, as events."""
    folder = tmp_path_factory.mktemp("stranger") / "worlds"
    folder.mkdir()
    (folder / "w.sdf").write_text(WORLD)
    log = folder / "good.log"
    result = program(
        "run",
        folder / "w.sdf",
        "--quiet",
        "--rate",
        "max",
        "--duration",
        "0.2",
        "--record",
        log,
        "--lcm",
        url(7841),
    )
    assert result.returncode == 0, result
    return folder, events(log)


def with_header(recorded, name, change):
    """The log with another header."""
    folder, events = recorded
    changed = []
    for timestamp, channel, data in events:
        if channel == "ruedo/header":
            header = log_header_t.decode(data)
            change(header)
            header.nfiles, header.noptions = len(header.files), len(header.options)
            data = header.encode()
        changed.append((timestamp, channel, data))
    write(folder / name, changed)
    return folder / name


def names(path, digest="0" * 64):
    def change(header):
        file = log_file_t()
        file.path, file.sha256 = str(path), digest
        header.files.append(file)

    return change


def test_the_log_itself_is_good(recorded):
    folder, _ = recorded
    assert program("verify", folder / "good.log").returncode == 0


@pytest.mark.parametrize("kind", ["zero", "fifo", "outside", "dotted"])
def test_a_log_that_names_other_files(recorded, kind, tmp_path):
    folder, _ = recorded
    secret = tmp_path / "secret.txt"
    secret.write_text(SECRET)
    fifo, dotted = folder / "pipe", folder / ".hidden"
    if kind == "fifo" and not fifo.exists():
        os.mkfifo(fifo)
    dotted.write_text(SECRET)
    path = {"zero": "/dev/zero", "fifo": fifo, "outside": secret, "dotted": dotted}[kind]
    log = with_header(recorded, f"{kind}.log", names(path))
    result = program("verify", log)
    digest = hashlib.sha256(SECRET.encode()).hexdigest()
    assert result.returncode == 3 and result.stderr.count("\n") == 1, result
    assert digest not in result.stdout + result.stderr
    exported = program("export", log, tmp_path / "out.mcap")
    assert exported.returncode == 0 and digest not in exported.stderr


def test_a_log_allows_nothing_by_itself(recorded, tmp_path):
    (tmp_path / "model.sdf").write_text(
        "<sdf version='1.9'><model name='far'><link name='l'/></model></sdf>"
    )
    folder, _ = recorded
    (folder / "absolute.sdf").write_text(
        WORLD.replace("<model", f"<include><uri>{tmp_path}/model.sdf</uri></include><model", 1)
    )

    def change(header):
        header.options.append("--allow-absolute")
        header.files = list(header.files)
        header.files[0].path = header.world_file = str(folder / "absolute.sdf")
        header.files[0].sha256 = hashlib.sha256((folder / "absolute.sdf").read_bytes()).hexdigest()

    result = program("verify", with_header(recorded, "absolute.log", change))
    assert result.returncode == 0, (
        result
    )  # without the model from elsewhere the run is the one that was recorded


def ten_seconds():
    resource.setrlimit(resource.RLIMIT_CPU, (10, 10))


@pytest.mark.parametrize("kind", ["outside", "deep", "deep and many", "long", "many"])
def test_files_of_a_logs_header_cost_little(recorded, kind, tmp_path):
    """A file of 3 GB outside the folders that a log reaches, by a path that leads out or by a link,
    is not hashed; nor is one name looked for at each of thousands of places."""
    folder, _ = recorded
    large = tmp_path / "large"
    large.touch()
    os.truncate(large, 3 << 30)
    link = folder / "link"
    link.unlink(missing_ok=True)
    link.symlink_to(large)
    wanted = {
        "outside": [os.path.relpath(large, folder), "gone/link"] * 20,
        "deep": ["a/" * 2000 + "x"],
        "deep and many": ["a/" * 1000 + "x"] * 50,
        "long": ["a/" * 20000 + "x"],
        "many": ["x"] * 20000,
    }[kind]

    def change(header):
        for path in wanted:
            names(path)(header)

    log = with_header(recorded, f"{kind}.log", change)
    for command in (["verify", log], ["export", log, tmp_path / "out.mcap"]):
        result = program(*command, preexec_fn=ten_seconds)
        assert result.returncode == (3 if command[0] == "verify" else 0), result
        assert str(log) in result.stderr and result.stderr.count("\n") == 1, result
        assert len(result.stderr) < 8000
    link.unlink()


@pytest.mark.parametrize("command", ["export", "html", "video", "verify"])
def test_escapes_of_a_log_stay_out_of_the_terminal(recorded, command, tmp_path):
    """What a log names is part of one line."""

    def change(header):
        names("/nowhere/\x1b[31mred\x1b]0;title\x07\nruedo: forged")(header)

    log = with_header(recorded, "escapes.log", change)
    result = program(
        *{
            "export": ["export", log, tmp_path / "out.mcap"],
            "html": ["play", log, "--html", tmp_path / "out.html"],
            "video": ["render", log, "--video", tmp_path / "out.webm", "--size", "64x64"],
            "verify": ["verify", log],
        }[command]
    )
    said = result.stdout + result.stderr
    assert "?[31mred" in said and "\x1b" not in said and "\x07" not in said, result
    assert "\nruedo: forged" not in said and "ruedo: forged" in said, result


@pytest.mark.parametrize("option", ["--set=m/imu.update_rate=\x1b[31m", "--set=nobody/x.y=1"])
def test_an_option_that_is_wrong_in_a_log_is_the_logs_fault(recorded, option):
    log = with_header(recorded, "option.log", lambda header: header.options.append(option))
    result = program("verify", log)
    assert result.returncode == 3 and result.stderr.startswith(f"ruedo: {log}: its run had --set")
    assert result.stderr.count("\n") == 1 and "\x1b" not in result.stderr


@pytest.mark.parametrize("command", [["check"], ["run", "--duration", "1"], ["info"]])
def test_a_value_with_line_ends_writes_no_line_of_ours(command, tmp_path):
    world = tmp_path / "w.sdf"
    world.write_text(
        "<sdf version='1.9' xmlns:ruedo='r'><world name='w'><model name='m'><link name='l'/>"
        "<ruedo:drive type='x&#10;ruedo: error: forged'/></model></world></sdf>"
    )
    result = program(*command, world)
    lines = [line for line in (result.stdout + result.stderr).splitlines() if "forged" in line]
    assert result.returncode == 3 and len(lines) == 1 and "'x ruedo: error" in lines[0], result


def test_escapes_and_megabytes_of_a_request_stay_out_of_the_terminal(tmp_path):
    world, bus, said = (tmp_path / name for name in ("w.sdf", "bus", "said"))
    world.write_text(WORLD)
    command = [RUEDO, "run", world, "--quiet", "--lcm", f"unix://{bus}"]
    with said.open("w") as out, subprocess.Popen(command, stderr=out) as server:
        try:
            until(bus.exists)
            with ruedo.connect(f"unix://{bus}", timeout=PATIENCE) as sim:
                box = "<sdf version='1.9'><model name='b'><link name='l'><collision name='c'><geometry><mesh><uri>nowhere\x1b[2J\x9b\u202e</uri></mesh></geometry></collision></link></model></sdf>"
                sim.spawn(text=box, name="b", x=2, y=2)
                driver = sim.robot(sim.spawn("p3at", x=5, y=5))
                driver.inject("x\nruedo: error: forged" + 50_000 * "x")
            until(lambda: "nowhere" in said.read_text() and "forged" in said.read_text())
        finally:
            server.terminate()
    text = said.read_text()
    assert not any(obeyed in text for obeyed in ("\x1b", "\x9b", "\u202e"))
    assert "\nruedo: error: forged" not in text
    assert max(map(len, text.splitlines())) < 1100


def tiff(width, height):
    entries = [
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, 1, 8),
        (259, 3, 1, 5),
        (262, 3, 1, 1),
        (273, 4, 1, 200),
        (277, 3, 1, 1),
        (278, 4, 1, height),
        (279, 4, 1, 30),
    ]
    return (
        b"II*\0"
        + struct.pack("<IH", 8, len(entries))
        + b"".join(struct.pack("<HHII", *e) for e in entries)
        + bytes(4)
        + bytes(30000)
    )


def many_shapes():
    """Two bodies of 700 boxes each, all in one place."""
    box = "<collision name='c{}'><geometry><box><size>1 1 1</size></box></geometry></collision>"
    link = "<link name='l'>" + "".join(box.format(i) for i in range(700)) + "</link>"
    models = "".join(f"<model name='m{i}'>{link}</model>" for i in range(2))
    return f"<sdf version='1.9'><world name='w'>{models}</world></sdf>".encode()


def links_in_one_place():
    """One model, whose links may not touch each other, but are looked at."""
    box = "<link name='l{}'><collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision></link>"
    links = "".join(box.format(i) for i in range(5000))
    return (
        f"<sdf version='1.9'><world name='w'><model name='m'>{links}</model></world></sdf>".encode()
    )


COSTLY = {
    "a large TIFF as a map": (
        "map.tiff",
        tiff(30000, 30000),
        ["import", "{0}", "--resolution", "0.1"],
        "30000 x 30000 pixels",
    ),
    "a checkerboard": (
        "map.pgm",
        b"P5\n4000 4000\n255\n" + (bytes([0, 255] * 2000) + bytes([255, 0] * 2000)) * 2000,
        ["import", "{0}", "--resolution", "0.1"],
        "walls",
    ),
    "attributes": (
        "w.sdf",
        (
            "<sdf version='1.9'><world name='w' "
            + " ".join(f"a{i}='1'" for i in range(10000))
            + "/></sdf>"
        ).encode(),
        ["check", "{0}"],
        "64 attributes",
    ),
    "boxes in one place": (
        "w.sdf",
        (
            "<sdf version='1.9'><world name='w'>"
            + "".join(
                f"<model name='m{i}'><link name='l'><collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision></link></model>"
                for i in range(3000)
            )
            + "</world></sdf>"
        ).encode(),
        ["check", "{0}"],
        "200000 pairs",
    ),
    "shapes in one another": ("w.sdf", many_shapes(), ["check", "{0}"], "200000 pairs"),
    "shapes in one another, at work": (
        "w.sdf",
        many_shapes(),
        ["run", "{0}", "--duration", "0.1", "--lcm", "memq://"],
        "200000 pairs",
    ),
    "links in one place": ("w.sdf", links_in_one_place(), ["check", "{0}"], "10000000 pairs"),
    "depth": (
        "w.sdf",
        b"<sdf version='1.9'>" + b"<a>" * 300 + b"</a>" * 300 + b"</sdf>",
        ["check", "{0}"],
        "nested too deep",
    ),
    "text": (
        "w.sdf",
        b"<sdf version='1.9'><world name='w'><gravity>"
        + b"1 " * 600000
        + b"</gravity></world></sdf>",
        ["check", "{0}"],
        "a text of",
    ),
}


def three_gigabytes():
    resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))


@pytest.mark.parametrize(
    "kind, value, words",
    [
        (resource.RLIMIT_NOFILE, 5, "ulimit -n"),
        (resource.RLIMIT_NOFILE, 12, "ulimit -n"),
        (resource.RLIMIT_AS, 600_000_000, "ulimit -v"),
        (resource.RLIMIT_STACK, 64 << 10, "ulimit -s"),
    ],
)
@pytest.mark.parametrize("command", ["run", "check"])
def test_limits_of_the_shell_are_reported(kind, value, words, command, recorded):
    result = program(
        command, recorded[0] / "w.sdf", preexec_fn=lambda: resource.setrlimit(kind, (value, value))
    )
    assert result.returncode == 4 and result.stderr.count("\n") == 1 and words in result.stderr, (
        result
    )


@pytest.mark.parametrize("name", COSTLY)
def test_expensive_files_are_refused(name, tmp_path):
    file, content, arguments, words = COSTLY[name]
    (tmp_path / file).write_bytes(content)
    result = program(
        *[a.format(tmp_path / file) for a in arguments], preexec_fn=three_gigabytes
    )  # what is refused is never made
    assert result.returncode == 3 and words in result.stdout + result.stderr, result


def test_a_large_picture_is_not_distorted(tmp_path):
    """Where each pixel lies is found by iteration: a minute for 8192 x 8192."""
    image = "<image><width>8192</width><height>{}</height></image>"
    camera = "<camera>{}<distortion><k1>0.1</k1></distortion></camera>"
    sensor = "<sensor name='s' type='camera'>{}</sensor>"
    for height, code, words in (
        (1465, 1, "8192 x 1465 pixels is not distorted; at most 12000000 pixels are"),
        (8, 0, "good"),
    ):
        (tmp_path / "w.sdf").write_text(
            "<sdf version='1.9'><world name='w'><model name='m'><link name='l'>"
            + sensor.format(camera.format(image.format(height)))
            + "</link></model></world></sdf>"
        )
        result = program("check", tmp_path / "w.sdf")
        assert result.returncode == code and words in result.stdout, result


def test_a_thing_may_stand_on_many_feet(tmp_path):
    """How its contacts share the load was a matrix of their number squared: 51 GB."""
    foot = "<collision name='c{}'><pose>{} {} 0.05 0 0 0</pose><geometry><box><size>.1 .1 .1</size></box></geometry></collision>"
    feet = "".join(foot.format(i, i % 150, i // 150) for i in range(20000))
    ground = "<model name='ground'><static>true</static><link name='l'><collision name='c'><geometry><plane/></geometry></collision></link></model>"
    (tmp_path / "w.sdf").write_text(
        f"<sdf version='1.9'><world name='w'>{ground}<model name='m'><link name='l'>{feet}</link></model></world></sdf>"
    )
    options = ["--duration", "0.01", "--rate", "max", "--lcm", "memq://"]
    result = program("run", tmp_path / "w.sdf", *options, preexec_fn=three_gigabytes)
    assert result.returncode == 0, result


def test_people_may_walk_a_million_metres(tmp_path):
    """Their floor is divided into blocks, whose number was that of its square metres."""
    (tmp_path / "w.sdf").write_text(
        "<sdf version='1.9' xmlns:ruedo='ruedo'><world name='w'><ruedo:crowd name='p'>"
        "<ruedo:count>10</ruedo:count><ruedo:area>-1e6 -1e6 1e6 1e6</ruedo:area>"
        "</ruedo:crowd></world></sdf>"
    )
    result = program("check", tmp_path / "w.sdf", preexec_fn=three_gigabytes)
    assert result.returncode == 0, result


# As where a container or `ulimit -u` allows so many at a time.
FEW_THREADS = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

static atomic_int left;
__attribute__((constructor)) static void begin(void) { left = atoi(getenv("THREADS")); }

struct work {
  void* (*what)(void*);
  void* with;
};

static void* run(void* given) {
  struct work work = *(struct work*)given;
  free(given);
  void* result = work.what(work.with);
  atomic_fetch_add(&left, 1);
  return result;
}

int pthread_create(pthread_t* thread, const pthread_attr_t* how, void* (*what)(void*), void* with) {
  if (atomic_fetch_sub(&left, 1) <= 0) {
    atomic_fetch_add(&left, 1);
    return EAGAIN;
  }
  int (*make)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  *(void**)&make = dlsym(RTLD_NEXT, "pthread_create");
  struct work* work = malloc(sizeof *work);
  *work = (struct work){what, with};
  return make(thread, how, run, work);
}
"""


@pytest.fixture(scope="module")
def few_threads(tmp_path_factory):
    folder = tmp_path_factory.mktemp("threads")
    (folder / "few.c").write_text(FEW_THREADS)
    command = ["cc", "-shared", "-fPIC", "-o", folder / "few.so", folder / "few.c", "-ldl"]
    subprocess.run(command, check=True)
    return folder / "few.so"


@pytest.mark.parametrize(
    "words",
    [
        ("run", ARENA, "--lcm", "memq://", "--rate", "max", "--duration", "0.2", "--quiet"),
        ("run", ARENA, "--lcm", "memq://", "--rate", "max", "--duration", "0.2", "--ros2"),
        ("render", ARENA, "-o", "picture.png"),
    ],
    ids=["run", "ros2", "render"],
)
def test_too_few_threads_end_with_one_line(few_threads, tmp_path, words):
    """Regressions: Mesa waited for ever for those it has not, Cyclone DDS aborted."""
    codes = set()
    for count in range(40):
        done = program(
            *words,
            cwd=tmp_path,
            env={**os.environ, "LD_PRELOAD": str(few_threads), "THREADS": str(count)},
        )
        codes.add(done.returncode)
        if done.returncode == 4:
            assert "no thread can be started" in done.stderr, (count, done.stderr)
        else:
            assert done.returncode == 0, (count, done.returncode, done.stderr)
    assert 4 in codes


# As under `ulimit -v`, for one thread.
NO_MEMORY = r"""
#include <cstdlib>
#include <cstring>
#include <new>
#include <pthread.h>

void* operator new(std::size_t size) {
  char name[16] = "";
  pthread_getname_np(pthread_self(), name, sizeof name);
  if (std::strcmp(name, std::getenv("WITHOUT_MEMORY")) == 0) throw std::bad_alloc();
  return std::malloc(size);
}
void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }
"""


def test_a_thread_without_memory_ends_with_one_line(recorded, tmp_path):
    (tmp_path / "none.cpp").write_text(NO_MEMORY)
    command = ["c++", "-shared", "-fPIC", "-o", tmp_path / "none.so", tmp_path / "none.cpp"]
    subprocess.run(command, check=True)
    result = program(
        *("run", recorded[0] / "w.sdf", "--quiet", "--lcm", "memq://"),
        *("--foxglove", "127.0.0.1:0", "--rate", "max", "--duration", "10"),
        env={**os.environ, "LD_PRELOAD": str(tmp_path / "none.so"), "WITHOUT_MEMORY": "foxglove"},
    )
    assert result.returncode == 4, result
    assert result.stderr == "ruedo: there is not enough memory\n"
