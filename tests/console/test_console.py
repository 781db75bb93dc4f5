"""The web console from outside: its pages and its socket, used properly and abused."""

import contextlib
import os
import re
import socket
import struct
import subprocess
import sys

import pytest
from harness import (
    ARENA,
    BUILD,
    COMMAND,
    NODE,
    PLAY,
    RUEDO,
    SEEK,
    SEEN,
    TRAFFIC,
    WANT,
    Socket,
    get,
    running,
)


@pytest.fixture(scope="module")
def server():
    with running("--disable", "p3at/camera") as process:
        yield process


def test_pages_are_served_from_the_program(server):
    status, page, headers = get(server.port, "/")
    assert status == 200 and b"<title>Ruedo</title>" in page
    assert "default-src 'self'" in headers["Content-Security-Policy"]
    for path in re.findall(rb'(?:src|href)="(/[^"]+)"', page):
        assert get(server.port, path.decode())[0] == 200
    status, scene, _ = get(server.port, "/scene.json")
    assert status == 200 and b'"world": "arena"' in scene
    assert get(server.port, "/scene/links")[0] == 200


@pytest.mark.parametrize(
    "path",
    [
        "/../../etc/passwd",
        "/scene/textures/../../etc/passwd",
        "/scene/textures/99999999999999999999",
        "/scene/textures/-1",
        "/%2e%2e/%2e%2e/etc/passwd",
        "//etc/passwd",
        "/scene/",
        "/main.js/x",
    ],
)
def test_no_path_escapes(server, path):
    status, body, _ = get(server.port, path)
    assert status in (400, 403, 404) and b"root:" not in body


def test_only_local_names_and_its_own_pages(server):
    for host in ("evil.example", f"127.0.0.1:{server.port}.evil.com", "localhost.evil.com"):
        assert get(server.port, "/", Host=host)[0] == 403, host
    assert get(server.port, "/", method="POST")[0] == 405
    assert Socket(server.port, Host="evil.example").status != 101
    assert Socket(server.port, Origin="http://evil.example").status != 101
    assert Socket(server.port, path="/elsewhere").status != 101
    own = Socket(server.port, Origin=f"http://localhost:{server.port}")
    assert own.status == 101 and b'"hello"' in own.receive()[1]
    own.close()


def test_elsewhere_a_token_is_needed():
    with running("--lcm", "auto", "--disable", "p3at/camera", view="0.0.0.0:0") as process:
        token = process.url.split("token=")[1]
        assert get(process.port, "/")[0] == 403
        assert get(process.port, "/scene.json")[0] == 403
        assert get(process.port, "/?token=" + "0" * 32)[0] == 403
        assert Socket(process.port).status != 101
        status, _, headers = get(process.port, f"/?token={token}")
        assert (
            status == 200
            and "HttpOnly" in headers["Set-Cookie"]
            and "SameSite=Strict" in headers["Set-Cookie"]
        )
        assert get(process.port, "/scene.json", Cookie=f"ruedo_token={token}")[0] == 200
        assert Socket(process.port, Cookie=f"ruedo_token={token}").status == 101


def test_messages_come_as_they_are_published(server):
    viewer = Socket(server.port)
    viewer.send(bytes([WANT]) + b"p3at/pose\nruedo/world")
    times = []
    while len(times) < 10:
        times += [struct.unpack_from("!q", message, 8)[0] for message in viewer.frame().values()]
    assert sorted(times) == times or len(set(times)) > 3
    viewer.close()


def test_a_slow_viewer_gets_no_more_than_it_takes(server):
    slow = Socket(server.port)
    slow.send(bytes([WANT]) + b"p3at/pose")
    slow.socket.settimeout(100)
    frames = 0
    while frames < 2:
        opcode, _data = slow.receive()
        frames += opcode == 2
    slow.socket.settimeout(3)
    with pytest.raises(TimeoutError):
        while True:
            opcode, _data = slow.receive()
            assert opcode != 2  # none after those, for none was taken
    slow.close()


def test_garbage_and_a_hundred_viewers_do_not_hurt(server):
    viewers = [Socket(server.port) for _ in range(100)]
    assert all(viewer.status == 101 for viewer in viewers)
    for viewer in viewers:
        viewer.send(bytes([WANT]) + b"p3at/pose\np3at/lrf\nruedo/world\n" + b"x" * 50)
    garbage = [
        b"",
        b"\0",
        b"\xff" * 100,
        bytes([COMMAND]),
        bytes([COMMAND, 255]),
        bytes([COMMAND, 3]) + b"abc" + b"\0" * 70000,
        bytes([PLAY, 1]),
        bytes([PLAY, 1]) + b"\xff" * 8,
        bytes([SEEK]) + b"\xff" * 8,
        bytes([WANT]) + b"\n" * 100000,
        bytes([COMMAND, 13]) + b"p3at/velocity" + b"junk",
        bytes([COMMAND, 13]) + b"ruedo/request" + os.urandom(5000),
    ]
    for payload in garbage:
        wild = Socket(server.port)
        wild.send(payload)
        wild.close()
    big = Socket(server.port)
    with pytest.raises((ConnectionError, TimeoutError, ValueError, BrokenPipeError)):
        big.send(b"\2" * (2 << 20))
        while True:
            big.receive()
    for raw in (b"\0" * 1000, b"GET " + b"a" * 20000, b"GET / HTTP/9.9\r\n\r\n", os.urandom(4000)):
        with socket.create_connection(("127.0.0.1", server.port), timeout=20) as plain:
            plain.sendall(raw)
    for viewer in viewers[::10]:
        assert viewer.frame()
    for viewer in viewers:
        viewer.close()
    assert server.poll() is None and get(server.port, "/")[0] == 200


def test_half_open_connections_give_way(server):
    """More connections than the console accepts; each has sent the beginning of a request, or
    nothing.
    """
    waiting = [socket.create_connection(("127.0.0.1", server.port), timeout=20) for _ in range(400)]
    for one in waiting[::2]:
        with contextlib.suppress(OSError):  # it has given way
            one.sendall(b"GET / HT")
    assert get(server.port, "/")[0] == 200
    viewer = Socket(server.port)
    assert viewer.status == 101
    viewer.close()
    for one in waiting:
        one.close()


ASK = """
import socket, sys
port = int(sys.argv[1])
for text in sys.argv[2:]:
    one = socket.create_connection(("127.0.0.1", port), timeout=20)
    one.sendall(text.encode().decode("unicode_escape").encode())
    print(one.recv(12).decode())
"""


def asked_by_another(port, *requests):
    """How the answers to another process begin."""
    given = [request.replace("\r\n", "\\r\\n") for request in requests]
    done = subprocess.run(
        [sys.executable, "-c", ASK, str(port), *given],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    return done.stdout.split("\n")[:-1]


def page(port, *headers, path="/"):
    return "\r\n".join([f"GET {path} HTTP/1.1", f"Host: localhost:{port}", *headers, "", ""])


UPGRADE = (
    "Connection: Upgrade",
    "Upgrade: websocket",
    "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
)


def taken(port, *headers, path="/", count=400):
    """That many connections of this process, each with an answer as long as there are places."""
    held = []
    for _ in range(count):
        one = socket.create_connection(("127.0.0.1", port), timeout=20)
        with contextlib.suppress(OSError):  # the server closed it
            one.sendall(page(port, *headers, path=path).encode())
            one.recv(1)
        held.append(one)
    return held


def test_one_process_cannot_take_all_places():
    """It asks on each connection, so that none is silent, and answers each ping: nothing but their
    number is wrong.
    """
    with running("--lcm", "auto", "--disable", "p3at/camera") as process:
        port = process.port
        held = taken(port)
        assert asked_by_another(port, page(port)) == ["HTTP/1.1 200"]
        held += taken(port, *UPGRADE, path="/socket")
        upgrade = page(port, *UPGRADE, path="/socket")
        answers = asked_by_another(port, page(port), upgrade, page(port, path="/scene.json"))
        assert answers == ["HTTP/1.1 200", "HTTP/1.1 101", "HTTP/1.1 200"]
        for one in held:
            one.close()


def test_no_connection_becomes_many():
    """HTTP/2 has its own in each, which were never counted off: a few hundred locked all out."""
    with running("--lcm", "auto", "--disable", "p3at/camera") as process:
        port = process.port
        up = page(
            port,
            "Connection: Upgrade, HTTP2-Settings",
            "Upgrade: h2c",
            "HTTP2-Settings: AAMAAABkAARAAAAAAAIAAAAA",
        ).encode()
        with socket.create_connection(("127.0.0.1", port), timeout=20) as one:
            one.sendall(up)
            assert b"101" not in one.recv(100)
        assert get(port, "/")[0] == 200


@pytest.mark.parametrize(
    "first",
    [
        "GET / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n",
        "OPTIONS / HTTP/1.1\r\nHost: localhost\r\n\r\n",
        "POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0x5\r\n\r\n",
        "DELETE / HTTP/1.1\r\nHost: evil.example\r\nTransfer-Encoding: chunked\r\n\r\n",
    ],
)
def test_a_request_body_is_not_read_as_a_request(server, first):
    """What another site's page may send is not taken for a request of the console's own page."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=20) as one:
        one.sendall((first + page(server.port, *UPGRADE, path="/socket")).encode())
        answer = b""
        with contextlib.suppress(OSError):
            while more := one.recv(4096):
                answer += more
    assert answer.startswith(b"HTTP/1.1") and b" 101 " not in answer


def test_viewers_change_no_byte(tmp_path):
    """The log of a run without the console, and of one with viewers that watch everything, one of
    them slow.
    """
    common = ["--duration", "3", "--seed", "7", "--record"]
    subprocess.run(
        [
            RUEDO,
            "run",
            ARENA,
            "--lcm",
            "memq://",
            "--quiet",
            "--rate",
            "max",
            *common,
            tmp_path / "alone.lcm",
        ],
        check=True,
        timeout=120,
    )
    with running("--lcm", "auto", "--rate", "2", *common, tmp_path / "viewed.lcm") as process:
        viewers = [Socket(process.port) for _ in range(3)]
        for viewer in viewers:
            viewer.send(bytes([TRAFFIC, 1]))
            viewer.send(
                bytes([WANT])
                + b"p3at/pose\np3at/lrf\np3at/camera\np3at/odometry\np3at/sonar_front\nruedo/world\nruedo/tick"
            )
        ended = b""
        try:
            while b'"ended"' not in ended:
                opcode, ended = viewers[0].receive()
                if opcode == 2:
                    viewers[0].send(bytes([SEEN]))
        except (ValueError, OSError):
            pass
        assert process.wait(60) == 0
        assert b'"ended"' in ended  # in words, before the connection ends
    assert (tmp_path / "alone.lcm").read_bytes() == (tmp_path / "viewed.lcm").read_bytes()


def test_malformed_addresses_are_reported():
    for address, code in (("nonsense:x", 2), ("192.0.2.1:80", 4)):
        done = subprocess.run(
            [RUEDO, "run", ARENA, "--lcm", "memq://", "--view", address],
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert done.returncode == code and "--view" in done.stderr


def test_types_decode_in_typescript_as_in_python(tmp_path):
    """The description made of proto/*.lcm gives the fingerprints that lcm-gen's code has, for every
    type.
    """
    sys.path.insert(0, str(BUILD / "python"))
    import ruedo.lcmtypes as types

    script = tmp_path / "prints.mjs"
    script.write_text(f"""import {{ build }} from "{BUILD}/web/node_modules/esbuild/lib/main.js";
const out = await build({{ stdin: {{ contents: 'import {{fingerprint}} from "./src/wire/lcm"; import {{kTypes}} from "./generated/messages"; for (const t in kTypes) console.log(t, BigInt.asUintN(64, fingerprint(t)).toString());',
  resolveDir: "{BUILD}/web", loader: "ts" }}, bundle: true, write: false, preserveSymlinks: true, format: "esm" }});
await import("data:text/javascript," + encodeURIComponent(out.outputFiles[0].text));
""")
    lines = subprocess.run(
        [NODE, script], capture_output=True, text=True, check=True, timeout=60
    ).stdout.split("\n")[:-1]
    assert len(lines) > 30
    for line in lines:
        name, value = line.split()
        kind = getattr(types, name)
        assert int(value) == struct.unpack(">Q", kind._get_packed_fingerprint())[0], name
