"""A long run in lockstep (RUEDO_DAY_SECONDS of sim time; a day in the nightly run), once alone and
once beside programs that send what they should not, join and die, and bring bad models: the same
log, and memory that stays flat."""

from __future__ import annotations

import contextlib
import os
import random
import subprocess
import threading
import time
from pathlib import Path

import ruedo
from soak_test import HALL, HOSTILE, MOST_GROWTH_KB, PATIENCE, RATE, RUEDO, resident_kb

SECONDS = int(os.environ.get("RUEDO_DAY_SECONDS", "300"))
BAD_MODELS = [
    one.read_bytes().decode("utf-8", "replace")
    for kind in ("world", "spawn", "urdf")
    for one in sorted((Path(os.environ["RUEDO_SOURCE_DIR"]) / "tests/fuzz/kept" / kind).iterdir())
    if one.name != "mass_1e300"  # that is repaired, and said
]


class Harm(threading.Thread):
    """Floods the server's address, and joins with bad models, until it is told to end."""

    def __init__(self, url: str, folder: Path):
        super().__init__()
        self.url, self.folder, self.end = url, folder, False
        self.messages = self.models = self.files = self.rounds = 0
        self.accepted: list[str] = []

    def run(self) -> None:
        seed = 0
        while not self.end:
            seed += 1
            flood = subprocess.Popen(
                [HOSTILE, self.url, str(5 * RATE), str(RATE), str(seed), "only-bad"],
                stdout=subprocess.PIPE,
                text=True,
            )
            self.bring_models()
            self.check_files()
            said = flood.communicate(timeout=PATIENCE)[0]
            self.messages += sum(int(line.split()[0]) for line in said.splitlines())
            self.rounds += 1

    def bring_models(self) -> None:
        try:
            with ruedo.connect(self.url, timeout=5) as guest:
                for text in BAD_MODELS:
                    try:
                        guest.spawn(text=text, x=3, y=3)
                        self.accepted.append(text)
                    except (ruedo.RuedoError, ValueError):  # the client itself refuses some
                        self.models += 1
        except ruedo.RuedoError:  # no place for one more
            pass

    def check_files(self) -> None:
        for i, text in enumerate(BAD_MODELS):
            path = self.folder / f"bad_{i}.sdf"
            path.write_text(text)
            code = subprocess.run([RUEDO, "check", path], capture_output=True).returncode
            assert code in (0, 1, 3), (code, path)
            self.files += 1


def a_day(log: Path, url: str, harm: Harm | None) -> list[int]:
    """Sizes of the server, in kB."""
    commands = random.Random(1)
    sizes = []
    with subprocess.Popen(
        [RUEDO, "run", HALL, "--quiet", "--disable", "p3at/camera", "--lcm", url]
        + ["--lockstep", "1", "--lease", str(PATIENCE)]
        + ["--record", str(log), "--record-limit", "16MB"],
        stderr=subprocess.DEVNULL,
    ) as server:
        try:
            sim = connected(url, server)
            if harm:
                harm.start()
            for second in range(SECONDS):
                command = sim.robot("p3at").velocity_command(
                    commands.uniform(-0.5, 0.5), commands.uniform(-1, 1)
                )
                sim.step(round(1 / sim.step_size), [command], timeout=PATIENCE)
                while second == SECONDS // 3 and harm and harm.is_alive() and harm.rounds == 0:
                    with contextlib.suppress(ruedo.Timeout):
                        sim.state()  # what is bad comes once, however busy the machine is
                if second % max(1, SECONDS // 300) == 0:
                    sizes.append(resident_kb(server))
            end_of(harm)
            sim.quit()  # whose answer no signal overtakes, as it may the leave of close()
            server.wait(PATIENCE)
            sim.close()
        finally:
            end_of(harm)
            server.terminate()
            server.wait(PATIENCE)
    assert server.returncode == 0
    return sizes


def end_of(harm: Harm | None) -> None:
    if harm and harm.is_alive():
        harm.end = True
        harm.join()


def files_of(log: Path) -> dict[str, bytes]:
    """What acted, and the ring of the newest messages, by the ends of their names."""
    files = {
        one.name.removeprefix(log.stem): one.read_bytes()
        for one in log.parent.glob(f"{log.stem}*.lcm")
    }
    assert len(files) > 1  # the ring is there
    return files


def differences(quiet: dict[str, bytes], loud: dict[str, bytes]) -> list[str]:
    """The files that differ, with sizes and the place (pytest's own comparison of megabytes takes
    a quarter of an hour)."""
    differing = []
    for name in sorted(quiet.keys() | loud.keys()):
        one, other = quiet.get(name, b""), loud.get(name, b"")
        if one != other:
            pairs = enumerate(zip(one, other, strict=False))
            at = next((i for i, (a, b) in pairs if a != b), min(len(one), len(other)))
            differing.append(
                f"{name}: {len(one)} and {len(other)} bytes, from {at} on: "
                f"{one[at - 60 : at + 100]!r} and {other[at - 60 : at + 100]!r}"
            )
    return differing


def connected(url: str, server: subprocess.Popen) -> ruedo.Simulation:
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            return ruedo.connect(url, timeout=5.0)
        except ruedo.NoServer:
            assert server.poll() is None and time.monotonic() < deadline


def test_the_log_is_the_same_beside_a_flood(tmp_path: Path) -> None:
    quiet, loud = tmp_path / "quiet.lcm", tmp_path / "loud.lcm"
    port = 20_000 + os.getpid() % 10_000  # below those that the flood's sockets get
    url = f"udpm://239.255.76.67:{port}?ttl=0"
    a_day(quiet, url, None)
    harm = Harm(url, tmp_path)
    sizes = a_day(loud, url, harm)
    third = len(sizes) // 3
    first, last = max(sizes[: third + 1]), max(sizes[-third:])
    print(
        f"{SECONDS} s: {harm.messages} bad messages, {harm.models} bad models, {harm.files} bad files, "
        f"{len(harm.accepted)} accepted; {first} kB at first, {last} kB at the end"
    )
    assert not harm.accepted
    assert harm.messages > 0
    assert last < first + MOST_GROWTH_KB, sizes
    differing = differences(files_of(quiet), files_of(loud))
    assert not differing, differing
