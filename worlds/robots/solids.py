"""Simple solids, written as Wavefront OBJ: prisms over an outline and bodies of revolution.

The robots' meshes are made with it (robots/*/make_meshes.py). Metres, x ahead, y left, z up; faces
are counter-clockwise seen from outside.
"""

import itertools
import math
from pathlib import Path


class Solids:
    """Collects faces by material and writes them as NAME.obj with NAME.mtl beside it."""

    def __init__(self):
        self._vertices = []
        self._faces = {}

    def _face(self, material, points):
        first = len(self._vertices) + 1
        self._vertices += points
        self._faces.setdefault(material, []).append(range(first, first + len(points)))

    def prism(self, material, outline, z0, z1):
        """The upright prism between z0 and z1 over a counter-clockwise outline [(x, y)],
        star-shaped about its centre.
        """
        cx = sum(x for x, _ in outline) / len(outline)
        cy = sum(y for _, y in outline) / len(outline)
        for (ax, ay), (bx, by) in zip(outline, outline[1:] + outline[:1]):
            self._face(material, [(ax, ay, z0), (bx, by, z0), (bx, by, z1), (ax, ay, z1)])
            self._face(material, [(cx, cy, z1), (ax, ay, z1), (bx, by, z1)])
            self._face(material, [(cx, cy, z0), (bx, by, z0), (ax, ay, z0)])

    def box(self, material, low, high):
        """The box between two corners (x, y, z)."""
        (x0, y0, z0), (x1, y1, z1) = low, high
        self.prism(material, [(x0, y0), (x1, y0), (x1, y1), (x0, y1)], z0, z1)

    def lathe(self, material, profile, centre, axis, segments=24):
        """The closed body that a profile [(along the axis, radius)] sweeps about `axis` (unit
        vector) through `centre`.

        The profile begins and ends on the axis (radius 0), ascending along it.
        """
        u = _any_normal(axis)
        v = _cross(axis, u)

        def point(along, radius, i):
            a = 2 * math.pi * (i % segments) / segments
            return tuple(
                centre[k] + along * axis[k] + radius * (math.cos(a) * u[k] + math.sin(a) * v[k])
                for k in range(3)
            )

        for (s0, r0), (s1, r1) in itertools.pairwise(profile):
            for i in range(segments):
                corners = [
                    point(s0, r0, i),
                    point(s0, r0, i + 1),
                    point(s1, r1, i + 1),
                    point(s1, r1, i),
                ]
                if r0 == 0:
                    corners.pop(0)
                elif r1 == 0:
                    corners.pop()
                self._face(material, corners)

    def write(self, path, colours):
        """Writes PATH.obj and PATH.mtl; `colours` gives (red, green, blue, shine) of each material,
        in [0, 1].
        """
        path = Path(path)
        with open(path.with_suffix(".mtl"), "w", encoding="ascii", newline="\n") as out:
            for material in self._faces:
                r, g, b, shine = colours[material]
                out.write(
                    f"newmtl {material}\nKa {r} {g} {b}\nKd {r} {g} {b}\nKs {shine} {shine} {shine}\nNs 40\n\n"
                )
        with open(path.with_suffix(".obj"), "w", encoding="ascii", newline="\n") as out:
            out.write(f"mtllib {path.stem}.mtl\n")
            out.writelines(
                f"v {x + 0.0:.5f} {y + 0.0:.5f} {z + 0.0:.5f}\n".replace("-0.00000", "0.00000")
                for x, y, z in self._vertices
            )
            for material, faces in self._faces.items():
                out.write(f"usemtl {material}\n")
                out.writelines("f " + " ".join(map(str, face)) + "\n" for face in faces)


def arc(centre_x, radius, first_rad, last_rad, steps):
    """Points (x, y) on a circle about (centre_x, 0), both ends included."""
    angles = [first_rad + (last_rad - first_rad) * i / steps for i in range(steps + 1)]
    return [(centre_x + radius * math.cos(a), radius * math.sin(a)) for a in angles]


def faceted(transducers):
    """The outline whose faces carry sonar transducers (x_m, y_m, heading_deg), listed
    counter-clockwise.

    Each transducer lies in its face and looks along the face's normal; neighbouring faces are cut
    with each other.
    """
    lines = []
    for x, y, heading in transducers:
        n = (math.cos(math.radians(heading)), math.sin(math.radians(heading)))
        lines.append((n, n[0] * x + n[1] * y))
    corners = []
    for i, (n1, d1) in enumerate(lines):
        n0, d0 = lines[i - 1]
        det = n0[0] * n1[1] - n0[1] * n1[0]
        if abs(det) > 1e-6:  # two transducers may share a face
            corners.append(((d0 * n1[1] - d1 * n0[1]) / det, (n0[0] * d1 - n1[0] * d0) / det))
    return corners


def lms200(solids, x, z):
    """The housing of a SICK LMS200 around its scan plane at height z, axis at x: 156 x 155 x 185
    mm.
    """
    solids.box("blue", (x - 0.094, -0.0775, z - 0.113), (x + 0.062, 0.0775, z - 0.035))
    solids.box(
        "blue", (x - 0.094, -0.0775, z - 0.035), (x - 0.030, 0.0775, z + 0.035)
    )  # behind the window
    solids.lathe(
        "window", [(-0.035, 0), (-0.035, 0.055), (0.035, 0.055), (0.035, 0)], (x, 0, z), (0, 0, 1)
    )
    solids.box("blue", (x - 0.094, -0.0775, z + 0.035), (x + 0.062, 0.0775, z + 0.072))


def vc_c4(solids, x, z):
    """A Canon VC-C4 whose lens ends at x, its optical axis at height z: foot, fork, head and
    lens.
    """
    solids.box("dark", (x - 0.105, -0.050, z - 0.055), (x - 0.015, 0.050, z - 0.030))
    for side in (-1, 1):
        y = sorted((side * 0.036, side * 0.046))
        solids.box("dark", (x - 0.080, y[0], z - 0.030), (x - 0.040, y[1], z + 0.020))
    solids.lathe(
        "dark",
        [(-0.100, 0), (-0.100, 0.026), (-0.090, 0.034), (-0.015, 0.034), (-0.015, 0)],
        (x, 0, z),
        (1, 0, 0),
    )
    solids.lathe(
        "glass",
        [(-0.015, 0), (-0.015, 0.020), (-0.002, 0.020), (-0.006, 0.014), (-0.006, 0)],
        (x, 0, z),
        (1, 0, 0),
    )


COLOURS = {
    "red": (0.72, 0.04, 0.03, 0.3),
    "black": (0.05, 0.05, 0.05, 0.15),
    "dark": (0.12, 0.12, 0.13, 0.2),
    "tyre": (0.09, 0.09, 0.09, 0.02),
    "hub": (0.90, 0.73, 0.16, 0.3),
    "gold": (0.72, 0.58, 0.22, 0.5),
    "grey": (0.55, 0.55, 0.56, 0.4),
    "blue": (0.10, 0.22, 0.52, 0.2),
    "window": (0.02, 0.02, 0.03, 0.6),
    "glass": (0.03, 0.03, 0.05, 0.8),
}


def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _any_normal(a):
    helper = (0, 0, 1) if abs(a[2]) < 0.9 else (1, 0, 0)
    n = _cross(helper, a)
    length = math.sqrt(sum(c * c for c in n))
    return tuple(c / length for c in n)
