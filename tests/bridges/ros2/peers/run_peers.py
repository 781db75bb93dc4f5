"""Independent peers against `ruedo run --ros2`: builds each, runs it in a network namespace of its
own, and writes what came of it as the table in docs/ros2.md.

    run_peers.py RUEDO FOLDER   (scripts/test --peers; FOLDER: where the peers are built)

Fast DDS 2 by Debian 12's libfastrtps-dev, Fast DDS 3 in a Debian 13 that debootstrap makes below
FOLDER (wants root and the network), ros2-client by cargo. A peer that cannot be built here is a
row that says why. Ends with 1 when something of a peer that was built does not work.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
SOURCE = HERE.parents[3]
PAGE = SOURCE / "docs/ros2.md"
BEGIN, END = "<!-- peers -->\n", "<!-- end of peers -->\n"
PATIENCE_S = 900  # of a build, and of a peer


@dataclass
class Peer:
    name: str
    version: str
    program: Path | None  # None: not built
    why: str = ""
    root: Path | None = None  # the program is for the Debian there


def output(*command: object) -> str:
    return subprocess.run(
        [str(word) for word in command],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=PATIENCE_S,
        check=True,
    ).stdout


def why(error: Exception) -> str:
    if isinstance(error, subprocess.CalledProcessError):
        lines = [line for line in error.stdout.splitlines() if "rror" in line]
        return "not built: " + (lines[0].strip() if lines else f"status {error.returncode}")
    return f"not built: {error}"


def fast_dds(folder: Path) -> Peer:
    try:
        version = output("dpkg-query", "-W", "-f", "${Version}", "libfastrtps-dev")
        output("cmake", "-S", HERE / "fastdds", "-B", folder / "fastdds")
        output("cmake", "--build", folder / "fastdds")
    except (subprocess.SubprocessError, OSError) as error:
        return Peer("Fast DDS, Debian's", "2", None, why(error))
    return Peer("Fast DDS, Debian's", version.split("+")[0], folder / "fastdds/fastdds_peer")


def fast_dds_3(folder: Path) -> Peer:
    root = folder / "trixie"
    packages = "libfastdds-dev,g++,cmake,make"
    try:
        if not (root / "peer").exists():
            made = ["debootstrap", "--variant=minbase", f"--include={packages}", "trixie", root]
            output(*made)
        shutil.copytree(HERE / "fastdds", root / "peer", dirs_exist_ok=True)
        version = output("chroot", root, "dpkg-query", "-W", "-f", "${Version}", "libfastdds-dev")
        output("chroot", root, "cmake", "-S", "/peer", "-B", "/peer/build")
        output("chroot", root, "cmake", "--build", "/peer/build")
    except (subprocess.SubprocessError, OSError) as error:
        return Peer("Fast DDS, Debian's", "3", None, why(error))
    program = root / "peer/build/fastdds_peer"
    return Peer("Fast DDS, Debian's", version.split("+")[0], program, root=root)


def ros2_client(folder: Path) -> Peer:
    manifest = HERE / "rust/Cargo.toml"
    version = manifest.read_text(encoding="utf-8").split('version = "=', 1)[1].split('"')[0]
    name = "ros2-client (RustDDS), crates.io's"
    if not shutil.which("cargo"):
        return Peer(name, version, None, "not built: no cargo here")
    build = ["cargo", "build", "--release", "--locked", "--manifest-path", manifest]
    try:
        output(*build, "--target-dir", folder / "rust")
    except (subprocess.SubprocessError, OSError) as error:
        return Peer(name, version, None, why(error))
    return Peer(name, version, folder / "rust/release/ruedo-ros2-peer")


def rows(ruedo: str, peer: Peer, domain: int) -> list[tuple[str, str, str]]:
    """(name, type, result) of what the peer tried with a run of its own."""
    script = (
        '"$1" run "$2" --no-noise --ros2 --lcm auto > "$3" 2>&1 & run=$!; '
        'timeout "$5" ${6:+chroot "$6"} "$4" "$ROS_DOMAIN_ID"; kill $run; wait $run'
    )
    log = peer.program.with_suffix(".log")
    isolated = [sys.executable, SOURCE / "tests/clients/isolated.py", "bash", "-c", script, "peer"]
    program = peer.program if not peer.root else Path("/", peer.program.relative_to(peer.root))
    world, patience, root = SOURCE / "worlds/arena.sdf", str(PATIENCE_S), str(peer.root or "")
    found = subprocess.run(
        [*isolated, ruedo, world, log, program, patience, root],
        env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
        stdout=subprocess.PIPE,
        text=True,
    ).stdout
    told = [tuple(line.split("\t")) for line in found.splitlines()]
    return [row for row in told if len(row) == 3] or [("all", "", "fails: it said nothing")]


def table(peers: list[tuple[Peer, list[tuple[str, str, str]]]]) -> str:
    lines = [
        "| Peer | Version | Topic, service or action | Type | Result |",
        "|---|---|---|---|---|",
    ]
    for peer, tried in peers:
        for name, kind, result in tried:
            shown = f"`{name}`" if name.startswith("/") else name
            lines.append(f"| {peer.name} | {peer.version} | {shown} | {kind} | {result} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    ruedo, folder = sys.argv[1], Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    peers = []
    for domain, build in enumerate((fast_dds, fast_dds_3, ros2_client), start=41):
        peer = build(folder)
        tried = rows(ruedo, peer, domain) if peer.program else [("all", "", peer.why)]
        peers.append((peer, tried))
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    PAGE.write_text(before + BEGIN + table(peers) + END + rest.split(END)[1], encoding="utf-8")
    print(table(peers))
    failed = [row for _, tried in peers for row in tried if row[2].startswith("fails")]
    if failed:
        sys.exit(f"{len(failed)} of what peers tried does not work")


if __name__ == "__main__":
    main()
