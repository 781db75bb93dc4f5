"""Real networks: LCM over TCP from the server itself, no multicast route, one server per address,
two hosts.
"""

import math
import os
import re
import shlex
import socket
import subprocess
import sys
import urllib.parse

import pytest
from bare_test import bare, c_client, scans_of
from conftest import HERE, PATIENCE, PROBES, RUEDO, Server, free_url, probe, ruedo_run, tcp_server
from docs_code import blocks

HALL = str(HERE / "hall.sdf")
QUICK = ["--disable", "p3at/camera"]
PLAIN = {key: value for key, value in os.environ.items() if key != "LCM_DEFAULT_URL"}


def unrouted(*command):
    """The command, in a network without multicast; skips where that cannot be had."""
    for flags in ("-n", "-rn"):
        wrapped = ["unshare", flags, "sh", "-c", "ip link set lo up && exec \"$@\"", "sh"]
        if subprocess.run([*wrapped, "true"], capture_output=True).returncode == 0:
            return [*wrapped, *command]
    pytest.skip("no network namespaces here")


def test_the_libraries_work_over_tcp(language):
    with tcp_server("--no-noise", *QUICK) as server:
        assert server.url.startswith("tcpq://")
        said = probe(language, server.url, "velocity", "p3at", "0.3", "0.2", "2")
        moved, turned, time = said.numbers("moved")
        assert time > 1.5 and turned == pytest.approx(0.2 * time, abs=1e-3)
        assert moved == pytest.approx(2 * 0.3 / 0.2 * math.sin(0.2 * time / 2), abs=1e-3)
        assert abs(said.numbers("stopped")[0]) < 1e-6


@pytest.mark.parametrize("url", ["udpm://239.255.76.67", "udpm://:7667", "udpm://"])
def test_missing_parts_of_an_address_are_lcms_defaults(language, url):
    with ruedo_run("--disable", "p3at/camera", world=HALL, url="udpm://239.255.76.67:7667?ttl=0"):
        said = probe(language, url, "velocity", "p3at", "0.3", "0.2", "2")
    assert said.numbers("moved")[2] > 1.5  # s that it drove


def test_bare_python_over_tcp(tmp_path):
    page = blocks("protocol.md")
    (tmp_path / "client.py").write_text(
        page["bare_python"].replace("from ruedo import", "from ruedo.lcmtypes import")
    )
    with tcp_server("--no-noise", *QUICK) as server:
        environment = {**os.environ, "LCM_DEFAULT_URL": server.url}
        scans_of([sys.executable, "client.py"], environment, 2, tmp_path)


@pytest.mark.parametrize("version", ["1.5.3", "1.3.1"])
def test_bare_c_over_tcp(tmp_path, version):
    from bare_test import library_of

    c_client(tmp_path, *library_of(version))
    with tcp_server("--no-noise", *QUICK) as server:
        scans_of([str(tmp_path / "client")], bare(server), 3)


def test_raw_pictures_over_tcp():
    """921 600 bytes each; over multicast, with the buffers that Linux gives, none arrives."""
    import ruedo

    settings = [
        "--set",
        "p3at/camera.encoding=rgb",
        "--set",
        "p3at/camera.camera.image.width=640",
        "--set",
        "p3at/camera.camera.image.height=480",
    ]
    with tcp_server(*settings) as server, ruedo.connect(server.url, timeout=PATIENCE) as sim:
        camera = sim.robot("p3at").camera
        for _ in range(5):
            image = camera.next(PATIENCE)
            assert image.format == "rgb" and len(image.data) == 3 * 640 * 480


def test_without_multicast_the_server_takes_tcp_and_clients_find_it(language, tmp_path):
    script = f"""
        {shlex.quote(RUEDO)} run {HALL} --disable p3at/camera > out 2> err & server=$!
        trap 'kill $server; wait $server' EXIT
        until grep -q '^hall' out; do kill -0 $server; sleep 0.05; done
        {shlex.join(PROBES[language])} '' list
    """
    done = subprocess.run(
        unrouted("sh", "-ec", script),
        cwd=tmp_path,
        env=PLAIN,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    said, warned = (tmp_path / "out").read_text(), (tmp_path / "err").read_text()
    assert done.returncode == 0, done.stdout + done.stderr + warned
    assert "world hall" in done.stdout
    assert said.splitlines()[0] == "export LCM_DEFAULT_URL='tcpq://127.0.0.1:7700'"
    assert len([line for line in warned.splitlines() if "no multicast route" in line]) == 1


def test_launch_needs_no_multicast(language):
    """It takes a local socket."""
    command = [*PROBES[language], "-", "launch", HALL, "--disable", "p3at/camera"]
    with subprocess.Popen(
        unrouted(*command), env=PLAIN, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as client:
        words = next(line for line in client.stdout if line.startswith("url")).split()
        assert words[1].startswith("unix:///")
        assert client.stdout.readline().split() == ["ready", "True"]
        client.terminate()
        said = client.stderr.read()
    assert "no multicast route" not in said


@pytest.mark.parametrize("scheme", ["udpm", "tcpq"])
def test_a_second_server_refuses_and_reports_the_first(scheme):
    with ruedo_run(*QUICK, world=HALL) if scheme == "udpm" else tcp_server(*QUICK) as first:
        second = subprocess.run(
            [RUEDO, "run", HALL, "--lcm", first.url],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
        assert second.returncode == 4
        [line] = second.stderr.splitlines()
        assert (
            first.url in line
            and f"pid {first.process.pid}, world hall, run " in line
            and "--lcm auto" in line
        )
        import ruedo

        run = re.search(r"run (-?\d+)", line).group(1)
        with ruedo.connect(first.url, timeout=PATIENCE) as sim:
            assert str(sim._info.run_id) == run
    with ruedo_run(*QUICK, world=HALL, url=first.url):  # and once that has ended, it is free
        pass


def test_users_of_one_machine_do_not_meet():
    """Another user's server on the same address is refused, too, and names the first; --lcm auto
    finds its own place.
    """
    import pwd

    other = pwd.getpwnam("nobody").pw_uid
    try:
        done = subprocess.run(
            [RUEDO, "check", HALL], user=other, capture_output=True, timeout=PATIENCE
        )
    except PermissionError:
        pytest.skip("no right to become another user, or that one may not read this build")
    if done.returncode != 0:
        pytest.skip("another user may not read this tree")
    with ruedo_run(*QUICK, world=HALL) as first:
        second = subprocess.run(
            [RUEDO, "run", HALL, "--lcm", first.url],
            user=other,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
        assert (
            second.returncode == 4 and f"pid {first.process.pid}, world hall, run " in second.stderr
        )
        command = [RUEDO, "run", HALL, "--quiet", "--lcm", "auto", "--duration", "0.1", *QUICK]
        third = subprocess.run(
            command, user=other, capture_output=True, text=True, timeout=PATIENCE
        )
        assert (
            third.returncode == 0
            and "export LCM_DEFAULT_URL='" in third.stdout
            and first.url not in third.stdout
        )


def auto_url(process):
    line = process.stdout.readline()
    match = re.fullmatch(r"export LCM_DEFAULT_URL='(\S+)'\n", line)
    assert match, line
    return match.group(1)


def test_auto_takes_a_port_of_its_own():
    import ruedo

    def start():
        return subprocess.Popen(
            [RUEDO, "run", HALL, "--quiet", "--lcm", "auto", *QUICK],
            stdout=subprocess.PIPE,
            text=True,
        )

    servers = [start() for _ in range(3)]
    try:
        urls = [auto_url(server) for server in servers]
        assert len(set(urls)) == 3 and all(
            url.startswith("udpm://239.255.76.67:") and url.endswith("?ttl=0") for url in urls
        )
        for url in urls:
            with ruedo.connect(url, timeout=PATIENCE) as sim:
                assert sim.world == "hall"
    finally:
        for server in servers:
            server.terminate()
            server.wait(PATIENCE)


def test_auto_without_multicast_is_tcp():
    command = unrouted(RUEDO, "run", HALL, "--quiet", "--lcm", "auto", "--duration", "0.1", *QUICK)
    said = subprocess.run(command, env=PLAIN, capture_output=True, text=True, timeout=PATIENCE)
    assert re.match(r"export LCM_DEFAULT_URL='tcpq://127\.0\.0\.1:\d+'\n", said.stdout), (
        said.stdout + said.stderr
    )


def test_two_hosts_that_share_an_address_both_warn(tmp_path):
    """Two network namespaces and a cable between them."""
    script = """
        ip link set lo up
        unshare -n sh -c 'ip link set lo up; echo ready; read go; ip link set vb up; ip addr add 10.0.0.2/24 dev vb; ip route add 224.0.0.0/4 dev vb; exec "$@"' \
            sh "$@" < pipe > second & other=$!
        exec 3> pipe
        until grep -q ready second; do sleep 0.02; done
        ip link add va type veth peer name vb netns $other
        ip link set va up; ip addr add 10.0.0.1/24 dev va; ip route add 224.0.0.0/4 dev va
        echo go >&3
        "$@" > first & this=$!
        until grep -q 'another server' first && grep -q 'another server' second; do kill -0 $this $other; sleep 0.05; done
        sleep 2    # to say it again, if they would
        kill $this $other
        wait $this
        wait $other
    """
    os.mkfifo(tmp_path / "pipe")
    command = [
        "sh",
        "-c",
        f'exec {shlex.quote(RUEDO)} run {HALL} --quiet --disable p3at/camera --lcm "udpm://239.255.76.67:7667?ttl=1" 2>&1',
        "sh",
    ]
    flags = "-n" if os.geteuid() == 0 else "-rn"
    done = subprocess.run(
        ["unshare", flags, "sh", "-ec", script, "sh", *command],
        cwd=tmp_path,
        env=PLAIN,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    if "Operation not" in done.stderr or "unshare" in done.stderr:
        pytest.skip("no network namespaces with a cable here: " + done.stderr)
    assert done.returncode == 0, done.stderr
    runs = []
    for name in ("first", "second"):
        text = (tmp_path / name).read_text()
        said = [line for line in text.splitlines() if "another server" in line]
        assert len(said) == 1, (name, text)
        runs.append(
            re.search(r"run (-?\d+), world hall; this one is run (-?\d+)", said[0]).groups()
        )
    assert runs[0] == runs[1][::-1]


def test_a_message_larger_than_the_buffer_is_reported_once():
    buffer = int(open("/proc/sys/net/core/rmem_default").read())
    if buffer > 900_000:
        pytest.skip(f"receive buffers of {buffer} bytes: a raw picture fits")
    settings = [
        "--set",
        "p3at/camera.encoding=rgb",
        "--set",
        "p3at/camera.camera.image.width=640",
        "--set",
        "p3at/camera.camera.image.height=480",
        "--duration",
        "2",
    ]
    url = free_url()
    command = [RUEDO, "run", HALL, "--quiet", "--lcm", url, *settings]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:  # else nothing is sent
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        listener.bind(("", urllib.parse.urlsplit(url).port))
        with Server(command, url) as server:
            server.process.wait(PATIENCE)
            lines = server.end().splitlines()
    said = [line for line in lines if "does not fit into a receive buffer" in line]
    assert (
        len(said) == 1
        and "921" in said[0]
        and "sysctl -w net.core.rmem_max" in said[0]
        and "p3at/camera" in said[0]
    )


def test_doctor_reports_the_server_of_an_address():
    with ruedo_run(*QUICK, world=HALL) as server:
        done = subprocess.run(
            [RUEDO, "doctor", "--lcm", server.url], capture_output=True, text=True, timeout=PATIENCE
        )
        assert re.search(
            rf"^ok +server +{re.escape(server.url)}: pid {server.process.pid}, world hall, run ",
            done.stdout,
            re.MULTILINE,
        )
    done = subprocess.run(
        [RUEDO, "doctor", "--lcm", server.url], capture_output=True, text=True, timeout=PATIENCE
    )
    assert re.search(
        r"^hint +server +no server answers on udpm://.*ruedo run", done.stdout, re.MULTILINE
    )


@pytest.mark.parametrize("other", ["udpm://239.255.76.67:7667?ttl=1", "tcpq://10.0.0.2:7700"])
def test_doctor_finds_the_server_of_another_host(tmp_path, other):
    """It asks on the bus; the claims of servers are seen on their own host alone."""
    script = """
        ip link set lo up
        unshare -n sh -c 'ip link set lo up; echo ready; read go; exec "$@"' sh "$@" < pipe > second & other=$!
        exec 3> pipe
        until grep -q ready second; do sleep 0.02; done
        ip link add va type veth peer name vb netns $other
        ip link set va up; ip addr add 10.0.0.1/24 dev va; ip route add 224.0.0.0/4 dev va
        nsenter -t $other -n sh -ec 'ip link set vb up; ip addr add 10.0.0.2/24 dev vb; ip route add 224.0.0.0/4 dev vb'
        echo go >&3
        until "$1" echo ruedo/info -n 1 --timeout 60 --lcm "$LCM_DEFAULT_URL" > /dev/null; do kill -0 $other; sleep 0.1; done
        "$1" doctor || true
        kill $other
        wait $other || true
    """
    os.mkfifo(tmp_path / "pipe")
    flags = "-n" if os.geteuid() == 0 else "-rn"
    done = subprocess.run(
        ["unshare", flags, "sh", "-ec", script, "sh", RUEDO, "run", HALL, "--quiet", *QUICK]
        + ["--lcm", other],
        cwd=tmp_path,
        env={**PLAIN, "LCM_DEFAULT_URL": other},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    if "Operation not" in done.stderr or "unshare" in done.stderr:
        pytest.skip("no network namespaces with a cable here: " + done.stderr)
    assert done.returncode == 0, done.stderr
    answers = rf"^ok +server +{re.escape(other)}: run -?\d+, world hall, ruedo [^ ]+ answers"
    assert len(re.findall(answers, done.stdout, re.MULTILINE)) == 1, done.stdout
    assert "hint   server" not in done.stdout
