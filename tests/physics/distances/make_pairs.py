"""Writes pairs.txt: pairs of shapes and their distances by coal 3.0.3, a library that has
nothing in common with Ruedo. Needs `pip install coal numpy`.

    make_pairs.py [PAIRS_OF_EACH_KIND [SEED]] > pairs.txt

A line is two shapes and a distance (m). A shape is KIND X Y Z QW QX QY QZ COUNT NUMBER...: its
pose, then sizes as in world::Geometry, a plane's normal, the points of a hull, or three corners
for each triangle of a mesh. Sizes are 1 mm to 10 m, distances 0 and 0.1 mm to 5 m.
"""

import sys

import coal
import numpy as np

MOVING = ["box", "sphere", "cylinder", "capsule", "cone", "ellipsoid", "hull"]
FIXED = ["plane", "mesh"]


def rounded(values):
    return [float(f"{v:.7g}") for v in values]


def log_uniform(rng, low, high, count=1):
    return np.exp(rng.uniform(np.log(low), np.log(high), count))


def shape(rng, kind):
    """Its numbers, and coal's shape."""
    size = log_uniform(rng, 1e-3, 10.0)[0]
    count = {"sphere": 1, "cylinder": 2, "capsule": 2, "cone": 2, "box": 3, "ellipsoid": 3}
    if kind in count:
        numbers = rounded(np.clip(size * log_uniform(rng, 0.1, 10.0, count[kind]), 1e-3, 10.0))
        made = {
            "box": coal.Box,
            "sphere": coal.Sphere,
            "cylinder": coal.Cylinder,
            "capsule": coal.Capsule,
            "cone": coal.Cone,
            "ellipsoid": coal.Ellipsoid,
        }[kind](*numbers)
        return numbers, made
    if kind == "plane":
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        return [float(v) for v in normal], coal.Halfspace(normal, 0.0)
    points = size * rng.uniform(-0.5, 0.5, (12 if kind == "hull" else 18, 3))
    points = points.astype(np.float32).astype(float)
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(points) // 3, len(points))
    corners, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    corners.extend(points)
    triangles.extend([coal.Triangle(i, i + 1, i + 2) for i in range(0, len(points), 3)])
    model.addSubModel(corners, triangles)
    model.endModel()
    if kind == "hull":
        model.buildConvexHull(True, "Qt")
        return list(points.ravel()), model.convex
    return list(points.ravel()), model


def rotation(rng):
    q = rng.normal(size=4) if rng.uniform() < 0.7 else np.array([1.0, 0.0, 0.0, 0.0])
    return q / np.linalg.norm(q)


def matrix(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def distance(a, X_a, b, X_b):
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = 1e-9
    request.gjk_max_iterations = 1000
    d = coal.distance(a, X_a, b, X_b, request, result)
    return d, result.getNearestPoint1(), result.getNearestPoint2()


def pair(rng, one, two):
    (numbers_a, a), (numbers_b, b) = shape(rng, one), shape(rng, two)
    q_a, q_b = rotation(rng), rotation(rng)
    R_a, R_b = matrix(q_a), matrix(q_b)
    away = rng.normal(size=3)
    if two == "plane":  # outside of its half-space
        away = -(R_b @ np.array(numbers_b))
    away /= np.linalg.norm(away)
    p_a, p_b = rng.uniform(-3, 3, 3), np.zeros(3)
    p_b = p_a + 60.0 * away
    d, on_a, on_b = distance(a, coal.Transform3s(R_a, p_a), b, coal.Transform3s(R_b, p_b))
    if d <= 0.0:
        return None
    wanted = (
        log_uniform(rng, 1e-4, 5.0)[0] if rng.uniform() < 0.85 else -log_uniform(rng, 1e-4, 1.0)[0]
    )
    p_b = p_b + (on_a - on_b) / d * (d - wanted)
    p_a, p_b = np.array(rounded(p_a)), np.array([float(f"{v:.12g}") for v in p_b])
    d, _, _ = distance(a, coal.Transform3s(R_a, p_a), b, coal.Transform3s(R_b, p_b))

    def text(kind, p, q, numbers):
        values = [f"{v:.12g}" for v in [*p, *q]]
        return " ".join([kind, *values, str(len(numbers)), *(f"{v:.9g}" for v in numbers)])

    return f"{text(one, p_a, q_a, numbers_a)} {text(two, p_b, q_b, numbers_b)} {max(d, 0.0):.9g}"


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    rng = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    for one in MOVING:
        for two in MOVING + FIXED:
            for _ in range(count):
                if line := pair(rng, one, two):
                    print(line)


if __name__ == "__main__":
    main()
