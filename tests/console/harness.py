"""What the console's tests share: a viewed run or log, its pages, its socket, and a browser."""

import base64
import gzip
import http.client
import json
import math
import os
import re
import shutil
import socket
import struct
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
RUEDO = BUILD / "bin" / "ruedo"
ARENA = SOURCE / "worlds" / "arena.sdf"
NODE = os.environ.get("RUEDO_NODE") or shutil.which("node")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
SEEN, WANT, COMMAND, TRAFFIC, PLAY, SEEK = range(1, 7)
# A browser test is skipped only where scripts/test could not have installed the browser.
MISSING = [name for name, path in (("node", NODE), ("chromium", CHROMIUM)) if not path]
needs_browser = pytest.mark.skipif(
    bool(MISSING) and not shutil.which("apt-get"), reason=f"needs {' and '.join(MISSING)}"
)
sys.path.insert(0, str(BUILD / "python"))  # the message types


@contextmanager
def running(*arguments, view="127.0.0.1:0", world=ARENA):
    """A viewed run as users start it: on the default transport, unless the arguments name another
    one.
    """
    with serving("run", world, "--quiet", "--view", view, *arguments) as process:
        yield process


def playing(log, *arguments, view="127.0.0.1:0"):
    """A viewed log."""
    return serving("play", log, "--view", view, *arguments)


@contextmanager
def serving(*arguments, cwd=None):
    process = subprocess.Popen(
        [RUEDO, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=cwd
    )
    try:
        urls = []
        for line in process.stdout:
            found = re.match(r"View it at (http://\S+)", line)
            if found:
                urls.append(found.group(1))
                break
        assert urls, process.stderr.read()
        process.url = urls[0]
        process.port = int(re.search(r":(\d+)/", urls[0]).group(1))
        yield process
    finally:
        process.terminate()
        process.wait(30)


def world_of_robots(path, count):
    """A world of so many Pioneers in rows, with bodies and wheels but without sensors."""
    model = (SOURCE / "worlds/robots/p3dx/model.sdf").read_text()
    shutil.copytree(SOURCE / "worlds/robots/p3dx/meshes", path / "meshes", dirs_exist_ok=True)
    (path / "plain.sdf").write_text(re.sub(r"<sensor.*?</sensor>", "", model, flags=re.DOTALL))
    columns = round(math.sqrt(1.6 * count))  # 1 000: 40 of 25
    x0, y0 = -0.6 * columns, -0.6 * (count // columns)
    robots = "".join(
        f"<include><uri>plain.sdf</uri><name>r{i}</name>"
        f"<pose>{1.2 * (i % columns) + x0} {1.2 * (i // columns) + y0} 0 0 0 {i % 7}</pose></include>"
        for i in range(count)
    )
    world = path / f"robots_{count}.sdf"
    world.write_text(f"""<?xml version="1.0"?><sdf version="1.9"><world name="fleet">
<include><uri>model://sun</uri></include><include><uri>model://ground_plane</uri></include>
{robots}</world></sdf>""")
    return world


def log_of_robots(path, count):
    """4 s of them."""
    world, log = world_of_robots(path, count), path / f"robots_{count}.lcm"
    options = ["--lcm", "memq://", "--quiet", "--rate", "max", "--duration", "4", "--record", log]
    subprocess.run([RUEDO, "run", world, *options], check=True, timeout=500)
    return log


def get(port, path, method="GET", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.putrequest(method, path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read()
    return (
        answer.status,
        gzip.decompress(body) if answer.headers.get("Content-Encoding") == "gzip" else body,
        answer.headers,
    )


class Socket:
    """A WebSocket of few words."""

    def __init__(self, port, path="/socket", **headers):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=20)
        lines = [
            f"GET {path} HTTP/1.1",
            "Upgrade: websocket",
            "Connection: Upgrade",
            "Sec-WebSocket-Version: 13",
            "Sec-WebSocket-Key: " + base64.b64encode(os.urandom(16)).decode(),
        ]
        lines += [
            f"{name}: {value}" for name, value in ({"Host": f"localhost:{port}"} | headers).items()
        ]
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self.file = self.socket.makefile("rb")
        self.status = int((self.file.readline() or b"x 0").split()[1])
        while self.status == 101 and self.file.readline() not in (b"\r\n", b""):
            pass

    def send(self, payload, opcode=2):
        size = (
            struct.pack("!B", 0x80 | len(payload))
            if len(payload) < 126
            else struct.pack("!BQ", 0xFF, len(payload))
        )
        self.socket.sendall(bytes([0x80 | opcode]) + size + bytes(4) + payload)

    def receive(self):
        opcode, size = self.file.read(2)
        if size == 126:
            (size,) = struct.unpack("!H", self.file.read(2))
        elif size == 127:
            (size,) = struct.unpack("!Q", self.file.read(8))
        return opcode & 15, self.file.read(size)

    def frame(self):
        """{channel number: bytes} of the next frame of messages."""
        while True:
            opcode, data = self.receive()
            if opcode == 2 and data[0] == 1:
                self.send(bytes([SEEN]))
                break
        found, at = {}, 4
        while at < len(data):
            channel, size = struct.unpack_from("<II", data, at)
            found[channel] = data[at + 8 : at + 8 + size]
            at += 8 + size
        return found

    def close(self):
        self.socket.close()

    def command(self, channel, message):
        """Publishes a message as a viewer."""
        self.send(bytes([COMMAND, len(channel)]) + channel.encode() + message.encode())


@contextmanager
def browser(url, folder, scenario, given=None):
    """The browser as it goes through a scenario (scenarios/browser.mjs)."""
    if MISSING:
        pytest.fail(
            f"{' and '.join(MISSING)} missing: scripts/test installs what is needed", pytrace=False
        )
    command = [NODE, SOURCE / "tests/console/scenarios/browser.mjs", url, folder, scenario] + (
        [json.dumps(given)] if given else []
    )
    process = subprocess.Popen(
        command,
        cwd=BUILD / "web",
        env=os.environ | {"CHROMIUM": CHROMIUM},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def browse(url, folder, scenario, given=None):
    """What the browser saw in a scenario, line by line; fails, in one line, where something went
    wrong.
    """
    with browser(url, folder, scenario, given) as process:
        said, _ = process.communicate(timeout=1200)
    return judged(scenario, folder, said.splitlines(), process.returncode)


def judged(scenario, folder, said, code):
    for line in said:
        if line.startswith("measured: "):
            print(line)
    wrong = [line for line in said if line.startswith("error:")]
    if wrong or code != 0:
        seen = [line for line in said if line not in wrong]
        what = " | ".join(wrong) or f"the browser ended with {code}"
        pytest.fail(
            f"{scenario}: {what} (last seen: {seen[-1] if seen else 'nothing'}; picture: {Path(folder) / 'failed.png'})",
            pytrace=False,
        )
    return said
