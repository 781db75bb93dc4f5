"""Procedural textures of the office: small PNGs that repeat, drawn pixel by pixel from a seeded
generator.
"""

import random
import struct
import zlib


def write_png(path, rows):
    """Writes rows of (red, green, blue) in 0 to 255."""
    height, width = len(rows), len(rows[0])
    raw = b"".join(
        b"\0" + bytes(min(255, max(0, round(c))) for pixel in row for c in pixel) for row in rows
    )

    def chunk(kind, data):
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(raw, 9))
        + chunk(b"IEND", b"")
    )


def shaded(colour, factor):
    return tuple(c * factor for c in colour)


def speckled(size, colour, spread, seed):
    """Even colour with a grain: plaster, carpet."""
    rng = random.Random(seed)
    return [
        [shaded(colour, 1 + spread * (rng.random() - 0.5)) for _ in range(size)]
        for _ in range(size)
    ]


def tiles(size, colour, joint, seed):
    """Two by two square tiles with joints."""
    rng = random.Random(seed)
    tones = [1 + 0.06 * (rng.random() - 0.5) for _ in range(4)]
    half = size // 2
    return [
        [
            joint
            if x % half < 2 or y % half < 2
            else shaded(colour, tones[2 * (y // half) + x // half] + 0.02 * rng.random())
            for x in range(size)
        ]
        for y in range(size)
    ]


def planks(size, colour, count, seed):
    """Boards along x with grain, their ends staggered."""
    rng = random.Random(seed)
    board = size // count
    rows = []
    for y in range(size):
        if y % board == 0:
            tone, end = 1 + 0.22 * (rng.random() - 0.5), rng.randrange(size)
        grain = 1 + 0.07 * (rng.random() - 0.5)
        rows.append(
            [
                shaded(
                    colour,
                    0.6
                    if y % board == 0 or x == end
                    else tone * grain * (1 + 0.02 * (rng.random() - 0.5)),
                )
                for x in range(size)
            ]
        )
    return rows


def poster(width, height, seed):
    """An abstract painting: coloured fields between black lines, in a white margin."""
    rng = random.Random(seed)
    palette = [
        (200, 40, 30),
        (30, 70, 150),
        (235, 200, 50),
        (240, 238, 230),
        (240, 238, 230),
        (40, 120, 80),
    ]
    xs = [0] + sorted(rng.sample(range(15, width - 15), 3)) + [width]
    ys = [0] + sorted(rng.sample(range(15, height - 15), 4)) + [height]
    fields = [[rng.choice(palette) for _ in xs[1:]] for _ in ys[1:]]
    rows = []
    for y in range(height):
        row = []
        for x in range(width):
            i, j = sum(y >= e for e in ys[1:]), sum(x >= e for e in xs[1:])
            margin = min(x, y, width - 1 - x, height - 1 - y) < 6
            line = min(abs(x - e) for e in xs) < 2 or min(abs(y - e) for e in ys) < 2
            row.append((250, 250, 248) if margin else (20, 20, 20) if line else fields[i][j])
        rows.append(row)
    return rows


def write_all(folder):
    write_png(folder / "carpet.png", speckled(64, (96, 108, 122), 0.30, 1))
    write_png(folder / "plaster.png", speckled(64, (222, 218, 206), 0.05, 2))
    write_png(folder / "tiles.png", tiles(64, (176, 170, 160), (120, 116, 110), 3))
    write_png(folder / "parquet.png", planks(128, (168, 122, 78), 8, 4))
    write_png(folder / "wood.png", planks(64, (186, 146, 100), 2, 5))
    for i in range(3):
        write_png(folder / f"poster_{i + 1}.png", poster(96, 128, 10 + i))
