"""Servers that lie or do not exist: each fault is reported clearly, and nothing breaks."""

import contextlib
import os
import signal
import subprocess
import sys
import time

import pytest
from conftest import HERE, PATIENCE, PROBES, Server, free_url, probe

# isort: split
from fake_server import fingerprint, info, scan
from lying_datagrams import LyingDatagrams, cut, fragment
from lying_stream import (
    HELLO,
    LyingStream,
    frame,
    grants_and_ever_new_infos,
    grants_and_huge_ticks,
)
from ruedo import lcmtypes


def fake(*options):
    url = free_url()
    server = Server([sys.executable, str(HERE / "peers/fake_server.py"), url, *options], url)
    assert (
        server.process.stdout.readline() == "up\n"
    )  # a client waits 2 s, an interpreter may take longer to start
    return server


def test_a_missing_server_is_reported_within_two_seconds_with_the_url(language):
    url = free_url()
    start = time.monotonic()
    said = probe(language, url, "connect").one("failed")
    assert (
        time.monotonic() - start < 120.0
    )  # two seconds, and the start of the program on a busy machine
    assert (
        said.startswith("NoServer: ")
        and url in said
        and "within 2 s" in said
        and "ruedo doctor" in said
    )


@pytest.mark.parametrize("url", ["http://example.org", "nonsense", "udpm://239.255.76.67:notaport"])
def test_a_malformed_url_is_refused(language, url):
    assert probe(language, url, "connect").one("failed").startswith("NoServer: ")


def test_nothing_listens_on_a_tcp_port(language):
    said = probe(language, "tcpq://127.0.0.1:9", "connect").one("failed")
    assert said.startswith("NoServer: ") and "tcpq://127.0.0.1:9" in said and "ruedo doctor" in said


def test_a_server_of_another_version_is_reported(language):
    with fake("--wrong-info") as server:
        said = probe(language, server.url, "list").one("failed")
    assert said.startswith(
        "TypeMismatch: ruedo/info carries another version of world_info_t (fingerprint 0000000000000000)"
    )


def test_a_channel_of_another_version_and_a_silent_one(language):
    with fake("--wrong-type") as server:
        said = probe(language, server.url, "streams", "p3at", "60", "0.6")
    lrf, odometry = said.one("lrf"), said.one("odometry")
    assert (
        lrf.startswith("TypeMismatch: p3at/LRF carries another version of planar_lidar_t")
        and "9.9.9" in lrf
    )
    assert "e3d17423180b5e8d" in lrf  # bot_core's fingerprint, which this client reads
    assert (
        odometry.startswith("Timeout: no sample on p3at/odometry within 0.6 s")
        and "50 Hz" in odometry
    )


def test_good_samples_come_through(language):
    with fake() as server:
        assert probe(language, server.url, "streams", "p3at", "60", "0").one("lrf") == "none"


def test_a_pause_is_reported_as_the_reason_of_silence(language):
    with fake("--paused") as server:
        assert "paused" in probe(language, server.url, "streams", "p3at", "60", "0.3").one(
            "odometry"
        )


def test_broken_messages_are_errors_and_no_crash(language):
    with fake("--garbage") as server:
        said = probe(language, server.url, "streams", "p3at", "60", "2")
    assert said.one("lrf").startswith("TypeMismatch: p3at/LRF")
    assert said.one("odometry").startswith("Timeout: ")


def test_a_request_that_the_server_does_not_have(language):
    with fake() as server:
        said = probe(language, server.url, "quit").one("failed")
    assert said.startswith("NotSupported: this server (Ruedo 9.9.9) has no QUIT request")


INFO = frame("ruedo/info", info([]).encode())
STUCK = {
    "in a head": HELLO + INFO + b"\0\0",
    "in a name": HELLO + INFO + frame("ruedo/tick", b"")[:11],
    "in a message": HELLO + INFO + frame("ruedo/info", bytes(100), size=5000),
}


@pytest.fixture(params=["tcpq", "unix"])
def stream_url(request, tmp_path):
    if request.param == "unix":
        return f"unix://{tmp_path}/liar"
    return free_url().replace("udpm://239.255.76.67", "tcpq://127.0.0.2").replace("?ttl=0", "")


@pytest.mark.parametrize("sent", STUCK.values(), ids=STUCK.keys())
def test_an_endless_message_delays_no_other(language, stream_url, sent):
    with LyingStream(stream_url, sent):
        said = probe(language, stream_url, "streams", "p3at", "0.3", "0.3")
    assert said.one("lrf").startswith("Timeout: ") and said.one("odometry").startswith("Timeout: ")


def test_a_forged_length_is_not_waited_for(language, stream_url):
    with LyingStream(stream_url, HELLO + INFO + frame("x", bytes(100), size=(1 << 32) - 1)):
        probe(language, stream_url, "connect")


@pytest.mark.parametrize("sent", [b"", HELLO[:5], bytes(8) + INFO])
def test_a_peer_without_a_hello_is_not_a_server(language, stream_url, sent):
    with LyingStream(stream_url, sent):
        said = probe(language, stream_url, "connect").one("failed")
    assert said.startswith("NoServer: ") and stream_url in said


def test_a_server_that_reads_nothing_is_left(stream_url):
    """What it does not take within seconds is lost, as it is where there is no server."""
    from ruedo.transport.transport import open_transport

    with LyingStream(stream_url, HELLO + INFO):
        transport = open_transport(stream_url)
        for _ in range(16):
            transport.publish("x", bytes(1 << 20))
        transport.close()


def driven_info(**channels):
    """With these channels of the robot's more: their types by name."""
    driven = info([])
    driven.features = (1 << 40) - 1
    for name, type_name in channels.items():
        channel = lcmtypes.channel_info_t()
        channel.name, channel.robot, channel.type = f"p3at/{name}", "p3at", type_name
        channel.input = "_command_" in type_name
        channel.fingerprint = fingerprint(type_name)
        driven.channels.append(channel)
    driven.nchannels = len(driven.channels)
    return driven


def test_a_primitive_that_no_status_shows_is_lost(language, stream_url):
    """It is not said to be replaced: nobody may have driven the robot."""
    known = driven_info(motion="motion_status_t", move="move_command_t")
    known.features &= ~(1 << lcmtypes.request_t.GRANT)  # not in lockstep
    tick, status = lcmtypes.tick_t(), lcmtypes.motion_status_t()
    tick.run_id = known.run_id
    with LyingStream(stream_url, HELLO + frame("ruedo/info", known.encode())) as server:
        process = subprocess.Popen(
            [*PROBES[language], stream_url, "primitives", "p3at"], stdout=subprocess.PIPE, text=True
        )
        while process.poll() is None:
            tick.utime = status.utime = status.utime + 50000
            server.send(frame("ruedo/tick", tick.encode()) + frame("p3at/motion", status.encode()))
            time.sleep(0.05)
        said = process.stdout.read()
    assert said.startswith("failed MotionError: p3at: stop ended: lost, "), said


def test_a_late_status_ends_a_primitive(language, stream_url):
    """Of one step come the end of what ran, and what runs now: datagrams may change places."""
    known = driven_info(motion="motion_status_t", move="move_command_t")
    known.features &= ~(1 << lcmtypes.request_t.GRANT)  # not in lockstep

    def moved(move):
        status = lcmtypes.motion_status_t()
        for utime, id, state in (
            (5000, move.id, status.STATE_RUNNING),
            (5000, 1, status.STATE_ENDED),
            (10000, move.id, status.STATE_DONE),
        ):
            status.utime, status.id, status.state = utime, id, state
            yield frame("p3at/motion", status.encode())

    sent = HELLO + frame("ruedo/info", known.encode())
    with LyingStream(stream_url, sent, lambda request: [], moved):
        said = probe(language, stream_url, "primitives", "p3at")
    assert "stop" not in said.one("failed"), said.text  # but that it has no pose


@pytest.mark.parametrize("lie", [lambda _: grants_and_huge_ticks, grants_and_ever_new_infos])
def test_messages_in_lockstep_take_bounded_memory(lie, language, stream_url):
    driven = driven_info(pose="pose_t", velocity="velocity_command_t", tick="tick_t")
    known = HELLO + frame("ruedo/info", driven.encode())
    with LyingStream(stream_url, known, lie(driven)) as server:
        process = subprocess.Popen(
            [*PROBES[language], stream_url, "lockstep", "name", "p3at", "5", "1", "0.1"],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "JAVA_TOOL_OPTIONS": "-Xmx100m"},  # garbage is not in question
        )
        until = time.monotonic() + PATIENCE
        while not server.granted.wait(0.1) and is_alive(process):
            assert time.monotonic() < until
        took_all = server.granted.is_set() and is_alive(process)
        os.kill(process.pid, signal.SIGKILL)  # kill() would wait for it
        said = process.stdout.read()
        _, _, used = os.wait4(process.pid, 0)
    assert took_all or "failed Timeout: " in said, said  # a minute was not enough for all of it
    assert used.ru_maxrss < 200_000, said  # KiB
    assert "OutOfMemory" not in said


def is_alive(process):
    """Leaves its end to be waited for."""
    return os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None


@pytest.mark.parametrize("name", ["\x1b]0;owned\x07", "\u202edenwo"])
def test_a_name_reaches_no_terminal(name, language, stream_url):
    """Of its control characters, and marks of right-to-left text, nothing comes out."""
    lies = info([])
    lies.robots[0].name = name
    with LyingStream(stream_url, HELLO + frame("ruedo/info", lies.encode())):
        said = probe(language, stream_url, "list").one("failed")
    assert name[0] not in said and "a name with control characters" in said


def test_a_refusal_reaches_no_terminal(language, stream_url):
    def refuse(request):
        reply = lcmtypes.reply_t()
        reply.run_id, reply.sequence, reply.kind = 7, request.sequence, request.kind
        reply.code, reply.text = reply.REFUSED, "\x1b]0;\u202eowned\x07"
        return [frame("ruedo/reply", reply.encode())]

    knows_all = info([])
    knows_all.features = (1 << 40) - 1
    with LyingStream(stream_url, HELLO + frame("ruedo/info", knows_all.encode()), refuse):
        said = probe(language, stream_url, "quit").one("failed")
    assert said.endswith("JOIN: ?]0;?owned?")


def test_a_false_type_outlasts_no_info(stream_url):
    import ruedo

    false, true = (
        frame("ruedo/info", info(options).encode()) for options in (["--wrong-type"], [])
    )
    with (
        LyingStream(stream_url, HELLO + false) as server,
        ruedo.connect(stream_url, timeout=PATIENCE) as sim,
    ):
        lrf = sim.robot("p3at").lrf
        with pytest.raises(ruedo.TypeMismatch, match="another version of planar_lidar_t"):
            lrf.latest()
        deadline, scans = time.monotonic() + PATIENCE, []
        while not scans and time.monotonic() < deadline:
            server.send(true + frame("p3at/LRF", scan(1)))
            with contextlib.suppress(ruedo.TypeMismatch, ruedo.Timeout):
                scans.append(lrf.latest(0.1))
        assert scans and len(sim.robot("p3at").lrf.latest().ranges) == 3


def test_parts_of_an_info_that_are_kept_have_bounds():
    from ruedo.errors import TypeMismatch
    from ruedo.world_info import WorldInfoAssembler

    def add(nparts, size):
        assembler, part = WorldInfoAssembler(), info([])
        part.nparts = nparts
        for part.part in range(nparts - 1):
            assembler.add(part.encode() + bytes(size))

    add(1024, 50_000)
    with pytest.raises(TypeMismatch, match="ruedo/info has 32767 parts of"):
        add(32767, 100)
    with pytest.raises(TypeMismatch, match="1024 parts of 67108864 bytes together at most"):
        add(100, 1 << 20)


def test_a_hundred_thousand_devices(language, stream_url):
    """Of which each is listed, in a time that grows as their number does."""
    many = info([])
    devices, channels = many.devices[:1], many.channels[:1]
    channels[0].device = "another"  # the first device has none
    many.devices, many.channels = 100_000 * devices, 100_000 * channels
    many.ndevices = many.nchannels = 100_000
    with LyingStream(stream_url, HELLO + frame("ruedo/info", many.encode())):
        said = probe(language, stream_url, "list", timeout=120.0)
    assert said.one("robot").startswith("p3at")


def test_datagrams_that_are_cut_off_are_passed_over(language):
    """One of them was enough: LCM's receiver reads behind its end."""
    url = free_url()
    with LyingDatagrams(url, lambda turn: cut()):
        assert probe(language, url, "streams", "p3at", "60", "2").one("lrf") == "none"


@pytest.mark.parametrize("size", [100, 60_000])
def test_fragments_that_never_make_a_message_take_no_memory(language, size):
    """64 senders announce 60 MB each, again and again. In Java each datagram left garbage, which
    was collected late."""

    def lies(turn):
        return [fragment(turn, 60 << 20, 0, 0, 1000, b"p3at/LRF\0" + bytes(size))]

    url = free_url()
    with LyingDatagrams(url, lies, 64):
        process = subprocess.Popen(
            [*PROBES[language], url, "streams", "p3at", "60", "8"],
            stdout=subprocess.PIPE,
            text=True,
        )
        said = process.stdout.read()
        _, status, used = os.wait4(process.pid, 0)
    assert status == 0 and "lrf none" in said, said
    assert used.ru_maxrss < 200_000  # KiB
