"""Collects seeds for the fuzzers: seeds.py OUT FOLDER... copies what is small among the files of
the folders (worlds, robots, meshes, pictures, maps), each where its fuzzer takes it, with the byte
before it that says what it is."""

import shutil
import sys
from pathlib import Path

MESHES = [".obj", ".dae", ".stl", ".ply", ".gltf", ".glb", ".3ds", ".fbx"]
PICTURES = [".png", ".jpg", ".pgm", ".bmp"]
MOST_BYTES = {
    "world": 64 * 1024,
    "urdf": 64 * 1024,
    "spawn": 64 * 1024,
    "mesh": 16 * 1024,
    "map": 8 * 1024,
}  # larger ones only take time to decode

# Of fuzz_lockstep: another client and what it asks, with its numbers. 0, or nothing more, is the
# usual one.
STEPS, JOIN, LEAVE = b"\0\7\xc7", b"\0\0", b"\0\3\0"
TAKE_PART, GRANT = b"\0\1\1" + bytes(5), b"\0\1\0\0\xef" + bytes(3)
RESEND = b"\0\2\0\xff" + bytes(4 * 255 + 1)
CONVERSATIONS = [
    5 * STEPS,
    JOIN + TAKE_PART + 3 * (STEPS + GRANT) + LEAVE + STEPS,
    JOIN + TAKE_PART + 20 * (b"\0\7\2" + GRANT + RESEND),
    JOIN + TAKE_PART + STEPS + b"\0\6\x1d" + STEPS + JOIN + TAKE_PART + STEPS,
    b"".join(bytes([0, 4, kind, 0]) for kind in range(1, 30)) + STEPS,
]

HAND_MADE = {
    "map": [
        b"\x02image: map.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.5]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        b"\x032D-Map\nLineMinPos: 0 0\nResolution: 20\nCairn: Goal 0 0 0\nLINES\n0 0 1000 0\nDATA\n5 5\n",
        b"\x00P5\n3 3\n255\nabcdefghi",
        b"\x01P5\n3 3\n255\n\x00\xff\x00\x00\x00\xff\xff\x00\x00",
    ],
    "yaml": [
        b"image: map.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.5]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\nmode: trinary\n",
        b"image: map.pgm\nresolution: 1e-300\norigin: [1e300, nan, inf]\n",
        b"image: [map.pgm\n",
        b"image: ../map.pgm\nresolution: 1\norigin: [0, 0]\n",
    ],
    "spawn": [
        b"<sdf version='1.9'><model name='m'><link name='l'/></model></sdf>",
        b"<robot name='r'><link name='l'/></robot>",
        b"<sdf version='1.9'><model name='m'><include><uri>../x</uri></include></model></sdf>",
    ],
    "log": [b"\x00", b"\x00\xed\xa1\xda\x01" + bytes(24), b"\x01" + bytes(200)],
    "lockstep": [
        policy + conversation for policy in (b"\0", b"\1") for conversation in CONVERSATIONS
    ],
    "messages": [bytes([kind]) + bytes(size) for kind in range(17) for size in (16, 32, 40, 64)],
    "mesh": [
        b"\x00v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        b"\x02solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
        b"endloop\nendfacet\nendsolid s\n",
    ],
}


def target_of(path):
    """The fuzzer that takes a file, and the byte before it; None for others."""
    kind = path.suffix.lower()
    if kind in (".sdf", ".world"):
        return "world", b""
    if kind == ".urdf":
        return "urdf", b""
    if kind in MESHES:
        return "mesh", bytes([MESHES.index(kind)])
    if kind in PICTURES:
        return "map", b"\x00"
    return None


def main(out, *folders):
    shutil.rmtree(out, ignore_errors=True)
    for name in ("world", "urdf", "spawn", "mesh", "map", "yaml", "messages", "log", "lockstep"):
        (out / name).mkdir(parents=True)
        for number, seed in enumerate(HAND_MADE.get(name, [])):
            (out / name / f"hand_{number}").write_bytes(seed)
    for folder in folders:
        for number, path in enumerate(sorted(Path(folder).rglob("*"))):
            target = target_of(path)
            if (
                target
                and target[0] == "world"
                and path.name == "model.sdf"
                and path.stat().st_size <= MOST_BYTES["spawn"]
            ):
                (out / "spawn" / f"{Path(folder).name}_{number}").write_bytes(path.read_bytes())
            if target and path.is_file() and path.stat().st_size <= MOST_BYTES[target[0]]:
                (out / target[0] / f"{Path(folder).name}_{number}").write_bytes(
                    target[1] + path.read_bytes()
                )


main(Path(sys.argv[1]), *sys.argv[2:])
