"""Hostile load for a minute (RUEDO_SOAK_SECONDS; ten in the nightly run): a server over multicast
and one over TCP get all that they should not get, while a good client goes on working; their memory
stays flat."""

import os
import random
import re
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

BUILD = Path(os.environ["RUEDO_BUILD_DIR"])
RUEDO = str(BUILD / "bin/ruedo")
HOSTILE = os.environ["RUEDO_HOSTILE"]
HALL = str(Path(os.environ["RUEDO_SOURCE_DIR"]) / "tests/clients/hall.sdf")
SECONDS = float(os.environ.get("RUEDO_SOAK_SECONDS", "60"))
FLOOD, FLOOD_RATE, RATE = (
    300_000,
    100_000,
    4_000,
)  # messages, messages/s: at the start; then for long, in half of the time for each network
LOAD = int(RATE * SECONDS / 2)
PATIENCE = 400.0  # s, for what comes sooner or later, on a machine that does much else too
MOST_GROWTH_KB = 8_000
sys.path.insert(0, str(BUILD / "python"))

import ruedo


def resident_kb(process):
    return int(
        re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{process.pid}/status").read_text()).group(1)
    )


class TcpHarm(threading.Thread):
    """Connections that mean harm, one after the other; some stay."""

    def __init__(self, port):
        super().__init__()
        self.port, self.end, self.count, self.kept = port, False, 0, []

    def run(self):
        noise = random.Random(1)
        hello = struct.pack(">II", 0x287617FB, 0x0100)
        while not self.end:
            try:
                one = socket.create_connection(("127.0.0.1", self.port), 2.0)
                one.settimeout(0.2)
                kind = self.count % 7
                if kind == 0:
                    one.sendall(noise.randbytes(noise.randrange(1, 2000)))
                elif kind == 1:
                    one.sendall(hello + noise.randbytes(noise.randrange(1, 2000)))
                elif kind == 2:
                    one.sendall(hello + struct.pack(">II", 1, 0xFFFFFFFF))
                elif kind == 3:
                    one.sendall(
                        hello + struct.pack(">II1sI", 1, 1, b"x", 4_000_000) + b"y" * 100_000
                    )  # and no more
                elif kind == 4:
                    one.sendall(
                        hello + struct.pack(">II2s", 2, 2, b".*")
                    )  # everything, and reads nothing
                elif kind == 5:
                    one.sendall(hello)
                    for _ in range(200):
                        one.sendall(
                            struct.pack(
                                ">II13sI64s", 1, 13, b"p3at/velocity", 64, noise.randbytes(64)
                            )
                        )
                self.kept.append(one)
                self.count += 1
            except OSError:
                pass
            while len(self.kept) > 200:
                self.kept.pop(0).close()
            time.sleep(0.002)
        for one in self.kept:
            one.close()


@pytest.mark.parametrize("scheme", ["udpm", "tcpq"])
def test_nothing_stops_and_nothing_grows(scheme):
    port = 20_000 + os.getpid() % 10_000  # below those that the hostile senders' sockets get
    url = f"udpm://239.255.76.67:{port}?ttl=0" if scheme == "udpm" else f"tcpq://127.0.0.1:{port}"
    with subprocess.Popen(
        [RUEDO, "run", HALL, "--quiet", "--disable", "p3at/camera", "--lcm", url],
        stderr=subprocess.PIPE,
        text=True,
    ) as server:
        said = []
        threading.Thread(target=lambda: said.extend(server.stderr), daemon=True).start()
        begin = time.monotonic()
        try:
            count, sizes = soak(server, url, scheme, port)
        finally:
            server.terminate()
            server.wait(PATIENCE)
    assert server.returncode == 0
    third = len(sizes) // 3
    first, last = max(sizes[:third]), max(sizes[-third:])
    print(
        f"{scheme}: {count} bad inputs; {first} kB at first, {last} kB at the end; {len(said)} lines"
    )
    assert count >= FLOOD + LOAD
    assert last < first + MOST_GROWTH_KB, sizes
    assert len(said) < 30 + 4 * (
        time.monotonic() - begin
    )  # each part reports errors once a second at most


def soak(server, url, scheme, port):
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            sim = ruedo.connect(url, timeout=5.0)
            break
        except ruedo.NoServer:
            assert server.poll() is None and time.monotonic() < deadline
    harm = TcpHarm(port)
    if scheme == "tcpq":
        harm.start()
    sizes, count, refused = [], 0, 0
    try:
        lrf = sim.robot("p3at").lrf
        count += sent_by(
            subprocess.Popen(
                [HOSTILE, url, str(FLOOD), str(FLOOD_RATE)], stdout=subprocess.PIPE, text=True
            )
        )
        load = subprocess.Popen(
            [HOSTILE, url, str(LOAD), str(RATE), "2"], stdout=subprocess.PIPE, text=True
        )
        while load.poll() is None:
            assert server.poll() is None, "the server ended"
            lrf.next(PATIENCE)
            try:
                sim.state()
            except ruedo.RequestError:  # its session went to one of the many that joined
                refused += 1
            sizes.append(resident_kb(server))
            time.sleep(0.1)
        count += sent_by(load)
        sim.robot("p3at").rotate(0.3).wait(PATIENCE)  # without the load it follows its commands
    finally:
        harm.end = True
        if scheme == "tcpq":
            harm.join()
            count += harm.count
        sim.close()
    assert refused <= len(sizes) / 2
    return count, sizes


def sent_by(process):
    return sum(
        int(line.split()[0])
        for line in process.communicate(timeout=2 * SECONDS + PATIENCE)[0].splitlines()
        if line[0].isdigit()
    )
