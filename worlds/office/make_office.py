#!/usr/bin/env python3
"""Makes the office world: ../office.sdf, its meshes and its textures. Run it again after changing
the plan below.

The plan: 40 x 30 m, the origin in the middle of a corridor 4 m wide along x. North of it five
offices, south a meeting room, a large open office and a lounge; doors 1.2 m wide, with a lintel at
2.1 m. No ceiling.
"""

import math
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import textures

HEIGHT, THICK, DOOR, LINTEL = 2.6, 0.15, 1.2, 2.1

# Walls: (x0, y0, x1, y1, [door centres as distance from (x0, y0)]), along x or y.
WALLS = [
    (-20, -15, 20, -15, []),
    (-20, 15, 20, 15, []),
    (-20, -15, -20, 15, []),
    (20, -15, 20, 15, []),
    (-20, 2, 20, 2, [4, 12, 20, 28, 36]),
    (-20, -2, 20, -2, [4, 15, 27, 37]),
    (-12, 2, -12, 15, [10]),
    (-4, 2, -4, 15, []),
    (4, 2, 4, 15, [10]),
    (12, 2, 12, 15, []),
    (-10, -15, -10, -2, []),
    (12, -15, 12, -2, [4]),
]

# Floors: (x0, y0, x1, y1, texture, metres that one repeat covers).
FLOORS = [
    (-20, -2, 20, 2, "tiles", 1.2),
    (-20, 2, 20, 15, "carpet", 1.0),
    (-20, -15, -10, -2, "parquet", 1.6),
    (-10, -15, 12, -2, "carpet", 1.0),
    (12, -15, 20, -2, "parquet", 1.6),
]


def furniture():
    """(model, x, y, yaw in degrees)."""
    things = []
    for i in range(5):  # the northern offices, 8 m wide
        x = -16 + 8 * i
        things += [
            ("desk", x - 1.5, 11.5, -90),
            ("office_chair", x - 1.5, 10.6, 90),
            ("bookshelf", x + 2.0, 14.70, -90),
            ("bookshelf", x + 0.8, 14.70, -90),
            ("plant", x - 3.3, 14.3, 0),
            ("waste_bin", x - 0.2, 11.4, 0),
        ]
        if i % 2:
            things += [("desk", x + 2.9, 6.5, 180), ("office_chair", x + 2.0, 6.5, 0)]
        else:
            things += [("sofa", x - 3.4, 6.0, 0), ("plant", x - 3.4, 4.4, 0)]
    things += [
        ("meeting_table", -15, -9, 90),
        ("plant", -19.3, -14.3, 0),
        ("bookshelf", -19.7, -9, 0),
    ]
    things += [
        ("office_chair", -15 + side * 1.0, -9 + dy, 0 if side < 0 else 180)
        for side in (-1, 1)
        for dy in (-0.8, 0, 0.8)
    ]
    for row in range(3):  # the open office: desks back to back
        for column in range(4):
            x, y = -7.0 + 5.0 * column, -5.2 - 3.6 * row
            things += [
                ("desk", x - 0.42, y, 180),
                ("office_chair", x - 1.3, y, 0),
                ("desk", x + 0.42, y, 0),
                ("office_chair", x + 1.3, y, 180),
            ]
            if (row + column) % 2:
                things.append(("waste_bin", x - 0.1, y + 1.15, 0))
    things += [
        ("sofa", 13.0, -13.7, 0),
        ("sofa", 16, -14.3, 90),
        ("plant", 19.3, -14.3, 0),
        ("plant", 19.3, -2.8, 0),
        ("meeting_table", 17.0, -7.0, 0),
        ("office_chair", 17.0, -6.0, -90),
        ("office_chair", 17.0, -8.0, 90),
    ]
    things += [
        ("plant", -19.3, 1.2, 0),
        ("plant", 19.3, -1.2, 0),
        ("waste_bin", -5.5, 1.6, 0),
        ("waste_bin", 9.5, -1.6, 0),
    ]
    return things


# Posters on walls: (x, y of the picture's centre, the direction it faces, picture).
POSTERS = [
    (-11, -1.90, 90, 1),
    (-4, 1.90, -90, 2),
    (1, -1.90, 90, 3),
    (4, 1.90, -90, 1),
    (12, 1.90, -90, 2),
    (-19.90, 0, 0, 3),
    (19.90, 0, 180, 1),
    (-13.6, -14.9, 90, 2),
    (-2, -14.9, 90, 3),
    (5, -14.9, 90, 1),
]


def wall_boxes():
    """The walls as boxes ((cx, cy, cz), (sx, sy, sz)): pieces between doors, and lintels above
    them.
    """
    boxes = []
    for x0, y0, x1, y1, doors in WALLS:
        length = math.hypot(x1 - x0, y1 - y0)
        ux, uy = (x1 - x0) / length, (y1 - y0) / length

        def piece(a, b, z0, z1, ux=ux, uy=uy, x0=x0, y0=y0):
            middle, along = (a + b) / 2, b - a
            size = (along, THICK, z1 - z0) if ux else (THICK, along, z1 - z0)
            boxes.append(((x0 + ux * middle, y0 + uy * middle, (z0 + z1) / 2), size))

        # Outer walls extend over the corners; inner ones end at the middle of the wall they meet.
        start, end = -THICK / 2, length + THICK / 2
        for door in doors:
            piece(start, door - DOOR / 2, 0, HEIGHT)
            piece(door - DOOR / 2, door + DOOR / 2, LINTEL, HEIGHT)
            start = door + DOOR / 2
        piece(start, end, 0, HEIGHT)
    return boxes


class TexturedMesh:
    """Quads with texture coordinates, written as OBJ."""

    def __init__(self):
        self.vertices, self.coordinates, self.faces = [], [], {}

    def quad(self, texture, corners, uvs):
        first = len(self.vertices) + 1
        self.vertices += corners
        self.coordinates += uvs
        self.faces.setdefault(texture, []).append(range(first, first + 4))

    def write(self, path):
        with open(path.with_suffix(".mtl"), "w", encoding="ascii", newline="\n") as out:
            out.writelines(
                f"newmtl {name}\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nmap_Kd ../textures/{name}.png\n\n"
                for name in self.faces
            )
        with open(path.with_suffix(".obj"), "w", encoding="ascii", newline="\n") as out:
            out.write(f"mtllib {path.stem}.mtl\n")
            out.writelines("v {:.4f} {:.4f} {:.4f}\n".format(*v) for v in self.vertices)
            out.writelines("vt {:.4f} {:.4f}\n".format(*t) for t in self.coordinates)
            for name, faces in self.faces.items():
                out.write(f"usemtl {name}\n")
                out.writelines("f " + " ".join(f"{i}/{i}" for i in face) + "\n" for face in faces)


def floor_mesh():
    """4 mm above the ground plane, so that a depth buffer separates them."""
    mesh = TexturedMesh()
    for x0, y0, x1, y1, texture, repeat in FLOORS:
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        mesh.quad(
            texture,
            [(x, y, 0.004) for x, y in corners],
            [(x / repeat, y / repeat) for x, y in corners],
        )
    return mesh


def wall_mesh(boxes, repeat=1.0):
    mesh = TexturedMesh()
    for (cx, cy, cz), (sx, sy, sz) in boxes:
        x0, x1, y0, y1, z0, z1 = (
            cx - sx / 2,
            cx + sx / 2,
            cy - sy / 2,
            cy + sy / 2,
            cz - sz / 2,
            cz + sz / 2,
        )
        for corners, axes in (
            ([(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)], (0, 2)),
            ([(x1, y1, z0), (x0, y1, z0), (x0, y1, z1), (x1, y1, z1)], (0, 2)),
            ([(x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1)], (1, 2)),
            ([(x0, y1, z0), (x0, y0, z0), (x0, y0, z1), (x0, y1, z1)], (1, 2)),
            ([(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)], (0, 1)),
            ([(x0, y1, z0), (x1, y1, z0), (x1, y0, z0), (x0, y0, z0)], (0, 1)),
        ):
            mesh.quad(
                "plaster", corners, [(c[axes[0]] / repeat, c[axes[1]] / repeat) for c in corners]
            )
    return mesh


def world_sdf(boxes):
    lines = [
        '<?xml version="1.0"?>',
        "<!-- An office of 40 x 30 m with a P3-AT in the corridor. Made by office/make_office.py: change the plan there. -->",
        '<sdf version="1.9">',
        '  <world name="office">',
        '    <physics name="5ms" type="bullet"><max_step_size>0.005</max_step_size><real_time_factor>1</real_time_factor></physics>',
        "    <scene><ambient>0.50 0.50 0.52 1</ambient><background>0.62 0.74 0.88 1</background><shadows>true</shadows></scene>",
        "    <gravity>0 0 -9.81</gravity>",
        "",
        "    <include><uri>model://sun</uri></include>",
        "    <include><uri>model://ground_plane</uri></include>",
        "    <include><uri>model://p3at</uri><pose>0 0 0 0 0 0</pose></include>",
        "",
    ]
    lines += [
        '    <model name="building">',
        "      <static>true</static>",
        '      <link name="link">',
        '        <visual name="floor"><cast_shadows>false</cast_shadows><geometry><mesh><uri>office/meshes/floor.obj</uri></mesh></geometry></visual>',
        '        <visual name="walls"><geometry><mesh><uri>office/meshes/walls.obj</uri></mesh></geometry></visual>',
    ]
    for i, (centre, size) in enumerate(boxes):
        lines.append(
            '        <collision name="wall_%d"><pose>%.4g %.4g %.4g 0 0 0</pose><geometry><box><size>%.4g %.4g %.4g</size></box></geometry></collision>'
            % (i, *centre, *size)
        )
    for i, (x, y, looks, picture) in enumerate(POSTERS):
        lines.append(
            '        <visual name="poster_%d"><pose>%g %g 1.5 0 0 %.6g</pose><geometry><box><size>0.02 0.9 1.2</size></box></geometry>'
            '<material><diffuse>1 1 1 1</diffuse><pbr><metal><albedo_map>office/textures/poster_%d.png</albedo_map></metal></pbr></material></visual>'
            % (i, x, y, math.radians(looks), picture)
        )
    lines += ["      </link>", "    </model>", ""]
    counts = {}
    for model, x, y, yaw in furniture():
        counts[model] = counts.get(model, 0) + 1
        lines.append(
            "    <include><uri>model://%s</uri><name>%s_%d</name><pose>%.4g %.4g 0 0 0 %.6g</pose></include>"
            % (model, model, counts[model], x, y, math.radians(yaw))
        )
    return "\n".join(lines + ["  </world>", "</sdf>", ""])


def main(folder=HERE):
    boxes = wall_boxes()
    for name in ("meshes", "textures"):
        (folder / name).mkdir(exist_ok=True)
    floor_mesh().write(folder / "meshes/floor")
    wall_mesh(boxes).write(folder / "meshes/walls")
    textures.write_all(folder / "textures")
    (folder.parent / "office.sdf").write_text(world_sdf(boxes), encoding="ascii", newline="\n")


if __name__ == "__main__":
    main()
