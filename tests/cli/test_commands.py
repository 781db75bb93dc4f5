"""The program as its users start it: exit codes, messages, signals, logs, and the bus."""

import contextlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import lcm
import pytest

RUEDO = os.environ["RUEDO"]
WORLDS = Path(os.environ["RUEDO_SOURCE_DIR"]) / "worlds"
ARENA = str(WORLDS / "arena.sdf")
QUICK = ["--disable", "p3at/camera", "--quiet"]
PATIENCE = 400  # s, for what comes sooner or later, on a machine that does much else too


def url(port):
    return f"udpm://239.255.76.67:{port}?ttl=0"


def ruedo(*arguments, **options):
    return subprocess.run(
        [RUEDO, *arguments], capture_output=True, text=True, timeout=PATIENCE, **options
    )


def one_line(text):
    return text.strip().count("\n") == 0 and text.startswith("ruedo: ")


@pytest.mark.parametrize(
    "arguments, code, words",
    [
        (["rn"], 2, "did you mean 'run'"),
        (["run"], 2, "WORLD"),
        (["run", ARENA, "--spwan", "x"], 2, "did you mean '--spawn'"),
        (["run", ARENA, "--rate", "-1"], 2, "or max"),
        (["run", ARENA, "--rate", "fast"], 2, "or max"),
        (["run", ARENA, "--duration", "x"], 2, "seconds"),
        (["run", ARENA, "--lcm", "foo"], 2, "udpm://"),
        (["run", ARENA, "--spawn", "p3at"], 2, "MODEL[:NAME]@X,Y[,YAW]"),
        (["run", ARENA, "--spawn", "p3at@1"], 2, "MODEL[:NAME]@X,Y[,YAW]"),
        (["run", ARENA, "--set", "p3at.rate=1"], 2, "ROBOT/DEVICE.KEY=VALUE"),
        (["run", ARENA, "--set", "p3at/lrf.update_rate=fast"], 2, "'fast' is not a rate"),
        (["run", ARENA, "--set", "p3at/lrf.range.max=-1"], 2, "--set p3at/lrf.range.max: "),
        (["run", ARENA, "--set", "p3at/lrf.range.max=0.001"], 2, "must be above <min> 0.02"),
        (["run", ARENA, "--set", "p3at/lrf.always_on=maybe"], 2, "there is no 'always_on'"),
        (["run", ARENA, "--set", "p3at/velocity.wheelbase=1"], 2, "there is no 'wheelbase'"),
        (["run", ARENA, "--set", "p3at/velocity.max_speed=fast"], 2, "'fast' is not a number"),
        (["run", ARENA, "--disable", "camera"], 2, "ROBOT/DEVICE"),
        (["run", ARENA, "--remap", "p3at/lrff=LASER"], 2, "did you mean 'p3at/lrf'"),
        (["run", ARENA, "--remap", "p3at/lrf=" + "x" * 64], 2, "63"),
        (["run", ARENA, "--remap", "ruedo/info=X"], 2, "'ruedo/info' keeps its name"),
        (["run", ARENA, "--remap", "p3at/lrf=p3at/pose"], 2, "p3at/pose"),
        (["run", ARENA, "--control", "maybe"], 2, "control"),
        (["run", "/nowhere.sdf"], 3, "/nowhere.sdf"),
        (["run", ARENA, "--record", "/nowhere/at.all"], 4, "/nowhere/at.all"),
        (["check", "/nowhere.sdf"], 3, ""),
    ],
)
def test_reports_errors(arguments, code, words):
    result = ruedo(*arguments)
    assert result.returncode == code, result.stderr
    assert words in result.stderr


def test_a_world_by_name_is_not_overwritten():
    """`ruedo map rooms -o rooms` blamed a file rooms, which is not there."""
    result = ruedo("map", "rooms", "-o", "rooms")
    assert result.returncode == 2 and "'rooms': the name ends in .yaml" in result.stderr


def test_echo_of_an_unknown_channel_lists_those_that_there_are(tmp_path):
    address = f"unix://{tmp_path}/bus"
    server = subprocess.Popen([RUEDO, "run", ARENA, *QUICK, "--lcm", address])
    try:
        while not (tmp_path / "bus").exists():
            assert server.poll() is None
            time.sleep(0.01)
        told = ruedo("echo", "p3at/pos", "--timeout", "4", "--lcm", address)
    finally:
        server.terminate()
        server.wait()
    assert told.returncode == 1
    line = told.stderr.splitlines()[0]
    assert line.startswith("ruedo: the server has no channel 'p3at/pos'; did you mean 'p3at/pose'?")
    assert "p3at/odometry, " in line


def test_version_and_help():
    assert ruedo("--version").stdout.startswith("ruedo ")
    text = ruedo("--help").stdout
    for command in ("run", "check", "info", "doctor"):
        assert f"  {command} " in text


def test_the_version_for_scripts():
    told = json.loads(ruedo("--version", "--json").stdout)
    assert ruedo("--version").stdout == f"ruedo {told['version']}\n"
    assert len(told["build"].split(", ")[0]) == 12 and "GNU" in told["build"]
    assert told["console"] is True and told["ros2"] in (True, False)


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (["=ru"], ["run"]),
        (["run", "=ar"], ["arena", " files"]),
        (["run", "arena", "--disable", "=p3at/ca"], ["p3at/camera"]),
        (["run", "arena", "--ros2-stamped", "="], ["on", "off"]),
        (["run", "arena", "--ros2-sta"], None),
        (["run", "arena", "=--ros2-sta"], ["--ros2-stamped"]),
        (["regress", "arena", "--fault", "=p3at/lrf:fr"], ["p3at/lrf:freeze@"]),
        (["run", "arena", "--record", "="], [" files"]),
        (["=--vers"], ["--version"]),
        (["nonsense", "="], [" files"]),
    ],
)
def test_completion(words, found):
    done = ruedo("complete", "--", *words)
    if found is None:
        assert done.returncode == 2 and "has to begin with =" in done.stderr
    else:
        assert done.stdout.splitlines() == found, done
    assert "complete" not in ruedo("--help").stdout


def test_bash_completes(tmp_path):
    """The words of a line; worlds beside files."""
    (tmp_path / "arch.sdf").touch()
    script = (
        f"PATH={os.path.dirname(RUEDO)}:$PATH; . {WORLDS.parent}/packaging/completion/ruedo.bash; "
        "COMP_WORDS=(ruedo run ar) COMP_CWORD=2; _ruedo; echo ${COMPREPLY[@]}; "
        "COMP_WORDS=(ruedo run arena --disable '') COMP_CWORD=4; _ruedo; echo ${COMPREPLY[@]}"
    )
    done = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, cwd=tmp_path, timeout=PATIENCE
    )
    first, second = done.stdout.splitlines()
    assert first.split() == ["arena", "arch.sdf"]
    assert {"p3at/lrf", "p3at/camera"} <= set(second.split()), done


def test_no_route_is_one_line_with_its_cure():
    result = subprocess.run(
        ["unshare", "-rn", RUEDO, "run", ARENA, "--lcm", url(7800)],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    if "unshare" in result.stderr:
        pytest.skip("no network namespaces here")
    assert result.returncode == 4
    assert one_line(result.stderr) and "ip route add" in result.stderr
    result = subprocess.run(
        ["unshare", "-rn", RUEDO, "doctor"], capture_output=True, text=True, timeout=PATIENCE
    )
    assert result.returncode == 4
    faults = [line for line in result.stdout.splitlines() if line.startswith("FAULT")]
    assert len(faults) == 1 and "ip route add" in faults[0]


def test_a_firewall_is_one_line_with_its_cure():
    closed = (
        "ip link set lo up; ip link set lo multicast on; ip route add 239.255.76.67/32 dev lo; nft add table inet f; "
        "nft add chain inet f in '{ type filter hook input priority 0; }'; nft add rule inet f in udp dport 7667 drop; "
    )
    isolated = ["unshare", "-rn", "sh", "-ec"]
    if subprocess.run([*isolated, closed], capture_output=True).returncode != 0:
        pytest.skip("no network namespaces, or no nftables here")
    for port, faults in ((7667, ["FAULT  multicast"]), (7668, [])):
        address = f"udpm://239.255.76.67:{port}?ttl=0"
        result = subprocess.run(
            [*isolated, closed + f"{RUEDO} doctor --lcm '{address}'"],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
        found = [line for line in result.stdout.splitlines() if line.startswith("FAULT")]
        assert [line[:16] for line in found] == faults and result.returncode == (4 if faults else 0)
        assert all(
            "does not come back" in line and f"let the firewall pass UDP port {port}" in line
            for line in found
        )


# A listener that never reads: the server and doctor report the lost datagrams, with the cure.
LISTENS_AND_NEVER_READS = """
import socket, struct, subprocess, sys
listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
listener.bind(("", 7667))
group = struct.pack("4s4s", socket.inet_aton("239.255.76.67"), socket.inet_aton("127.0.0.1"))
listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)
ruedo, world = sys.argv[1:]
url = "udpm://239.255.76.67:7667?ttl=0"
server = subprocess.Popen(
    [ruedo, "run", world, "--disable", "p3at/camera", "--lcm", url],
    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
for line in server.stdout:
    if "datagrams" in line:
        print(line)
        break
server.terminate()
server.wait()
print(subprocess.run([ruedo, "doctor", "--lcm", url], capture_output=True, text=True).stdout)
"""


def test_lost_datagrams_are_reported_with_their_cure():
    network = "ip link set lo up multicast on; ip route add 239.255.76.67/32 dev lo; "
    isolated = ["unshare", "-rn", "sh", "-ec"]
    if subprocess.run([*isolated, network], capture_output=True).returncode != 0:
        pytest.skip("no network namespaces here")
    said = subprocess.run(
        [*isolated, network + 'exec "$@"', "sh", sys.executable]
        + ["-c", LISTENS_AND_NEVER_READS, RUEDO, ARENA],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    ).stdout.splitlines()
    warning = next(line for line in said if "were lost on this machine" in line)
    hint = next(line for line in said if line.split()[:2] == ["hint", "datagrams"])
    for line in (warning, hint):
        assert "--lcm unix:///PATH" in line and "net.core.rmem_max" in line


def datagrams_sent():
    heads, values = (
        line.split()
        for line in Path("/proc/net/snmp").read_text().splitlines()
        if line.startswith("Udp: ")
    )
    return int(values[heads.index("OutDatagrams")])


def listens(port):
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    listener.bind(("", port))
    return listener


@pytest.mark.skipif(len(socket.if_nameindex()) > 1, reason="not in a network of its own")
def test_nothing_is_sent_where_nobody_listens():
    sent = {}
    for is_heard in (False, True):
        before = datagrams_sent()
        with listens(7741) if is_heard else contextlib.nullcontext():
            address = ["--lcm", url(7741), "--rate", "max", "--duration", "2"]
            done = ruedo("run", ARENA, *QUICK, *address)
        assert done.returncode == 0, done.stderr
        sent[is_heard] = datagrams_sent() - before
    assert sent[False] <= 2 and sent[True] > 500, sent  # the server tests whether it hears itself


def test_a_listener_that_comes_late_is_heard():
    bus, got = lcm.LCM(url(7743)), []
    with subprocess.Popen(
        [RUEDO, "run", ARENA, "--disable", "p3at/camera", "--lcm", url(7743)],
        stdout=subprocess.PIPE,
        text=True,
    ) as server:
        assert "arena" in server.stdout.readline()
        bus.subscribe("p3at/odometry", lambda channel, data: got.append(data))
        until = time.monotonic() + PATIENCE
        while not got and time.monotonic() < until:
            bus.handle_timeout(1000)
        server.terminate()
    assert got


def needs(*command):
    """s of real time, of the best of some tries, since on a busy machine each may have to wait; s
    of processors' time.
    """
    took, used = 1e9, 0.0
    for _ in range(20):
        before, begin = os.times(), time.monotonic()
        subprocess.run(command, capture_output=True, timeout=PATIENCE)
        after, took = os.times(), min(took, time.monotonic() - begin)
        used = (
            after.children_user
            + after.children_system
            - before.children_user
            - before.children_system
        )
        if took < 1.0:
            break
    return took, used


def test_the_network_is_judged_within_a_second():
    """LCM by itself takes ten for a network that carries nothing."""
    unrouted = ["unshare", "-rn"]
    if subprocess.run([*unrouted, "true"], capture_output=True).returncode != 0:
        unrouted = []
    for command in (
        [RUEDO, "doctor", "--lcm", url(7805)],
        [*unrouted, RUEDO, "doctor"],
        [*unrouted, RUEDO, "run", ARENA, "--duration", "0", "--lcm", url(7805)],
    ):
        took, used = needs(*command)
        assert took < 5.0 and used < 1.0, (
            command,
            took,
            used,
        )  # five, where there is always something else to do


def test_doctor_is_content_here():
    result = ruedo("doctor", "--lcm", url(7801))
    assert result.returncode == 0, result.stdout
    assert "LCM 1.5.3" in result.stdout


def test_info_as_json():
    info = json.loads(ruedo("info", ARENA, "--json").stdout)
    assert [robot["name"] for robot in info["robots"]] == ["p3at"]
    channels = {channel["name"]: channel for channel in info["channels"]}
    assert channels["p3at/lrf"]["type"] == "planar_lidar_t"
    assert channels["p3at/lrf"]["fingerprint"] == "e3d17423180b5e8d"  # bot_core's
    assert channels["p3at/odometry"]["rate"] == 50
    assert channels["p3at/velocity"]["input"] is True
    lrf = next(device for device in info["devices"] if device["name"] == "lrf")
    assert lrf["width"] == 181 and abs(lrf["fov_horizontal"] - 3.14159265) < 1e-6


def test_info_of_what_moves_without_wheels():
    lines = ruedo("info", WORLDS / "robots" / "puck" / "model.sdf").stdout.splitlines()
    assert "  no wheels" in lines


def test_check_finds_all_with_lines(tmp_path):
    world = tmp_path / "bad.sdf"
    world.write_text(
        """<?xml version="1.0"?>
<sdf version="1.9">
  <world name="w">
    <include><uri>model://p3at</uri></include>
    <model name="m"><link name="l">
      <sensor name="s1" type="lidar"><lidar><scan><horizontal><samples>-1</samples></horizontal></scan></lidar></sensor>
      <sensor name="s2" type="dvl"/>
    </link></model>
  </world>
</sdf>
"""
    )
    result = ruedo("check", str(world), "--json")
    findings = json.loads(result.stdout)
    assert result.returncode == 1
    quick = ("--lcm", "memq://", "--rate", "max", "--duration", "0.1")
    assert ruedo("run", str(world), *quick).returncode == 0  # without the sensor
    kinds = {(finding["kind"], finding["line"]) for finding in findings}
    assert ("error", 6) in kinds and ("unsupported", 7) in kinds
    result = ruedo("check", str(world))
    assert f"{world}:6" in result.stdout and "samples" in result.stdout
    assert ruedo("check", ARENA, "--strict").returncode == 0
    assert ruedo("run", ARENA, "--strict", *quick).returncode == 0


def events(path):
    log = lcm.EventLog(str(path), "r")
    return [(event.timestamp, event.channel, event.data) for event in log]


def test_two_runs_write_the_same_bytes(tmp_path):
    logs = [tmp_path / name for name in ("a", "b", "c")]
    for log, threads in zip(logs, ("1", "2", "8")):
        result = ruedo(
            "run",
            ARENA,
            *QUICK,
            "--lcm",
            url(7802),
            "--rate",
            "max",
            "--duration",
            "5",
            "--record",
            str(log),
            "--threads",
            threads,
        )
        assert result.returncode == 0, result.stderr
    assert logs[0].read_bytes() == logs[1].read_bytes() == logs[2].read_bytes()
    assert events(logs[0])[0][1] == "ruedo/header"
    other = tmp_path / "other"
    ruedo(
        "run",
        ARENA,
        *QUICK,
        "--lcm",
        url(7802),
        "--rate",
        "max",
        "--duration",
        "5",
        "--record",
        str(other),
        "--seed",
        "2",
    )
    assert other.read_bytes() != logs[0].read_bytes()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_it_cleanly(tmp_path, number):
    log = tmp_path / "log"
    with subprocess.Popen(
        [RUEDO, "run", ARENA, "--disable", "p3at/camera", "--lcm", url(7803), "--record", str(log)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert select.select([process.stdout], [], [], PATIENCE)[0]  # the channels: it runs
        receiver = lcm.LCM(url(7803))
        seen = []
        receiver.subscribe("p3at/pose", lambda channel, data: seen.append(data))
        while len(seen) < 10:
            assert receiver.handle_timeout(1000 * PATIENCE) > 0
        process.send_signal(number)
        _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    recorded = events(log)
    assert len([1 for event in recorded if event[1] == "p3at/pose"]) >= 10
    stamps = [event[0] for event in recorded]
    assert stamps == sorted(stamps)
    # The log is whole: it ends with its last event.
    assert sum(28 + len(channel) + len(data) for _, channel, data in recorded) == log.stat().st_size


def test_survives_a_flood_of_channel_names():
    with subprocess.Popen(
        [RUEDO, "run", ARENA, *QUICK, "--lcm", url(7804)], stderr=subprocess.PIPE, text=True
    ) as process:
        sender = lcm.LCM(url(7804))
        seen = []
        sender.subscribe("p3at/pose", lambda channel, data: seen.append(data))
        while not seen:
            assert sender.handle_timeout(1000 * PATIENCE) > 0

        def resident_kb():
            status = Path(f"/proc/{process.pid}/status").read_text()
            return int(status.split("VmRSS:")[1].split()[0])

        def flood(count, start):
            for i in range(start, start + count):
                sender.publish(f"unknown/{i:040x}", b"x" * 8)
                if i % 200 == 0:
                    sender.handle_timeout(1)

        flood(20_000, 0)
        before = resident_kb()
        flood(60_000, 20_000)
        assert resident_kb() < before + 4_000  # without renewal it would be 12 MB
        seen.clear()
        while len(seen) < 5:
            assert sender.handle_timeout(1000 * PATIENCE) > 0
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
