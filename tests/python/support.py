# SPDX-License-Identifier: Apache-2.0
"""What the tests of the Python package share: the check for numpy, generated meshes, the shared data."""
import gzip
import os
import pathlib
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SHARED = pathlib.Path(os.environ.get("DELMESH_SHARED", ROOT.parent / "shared"))

try:
    import numpy as np
except ImportError:
    print(f"SKIPPED: {sys.executable} has no numpy")
    sys.exit(77)


def main():
    """Runs the tests of the calling file; skipped as a whole only when every test was."""
    program = unittest.main(module="__main__", exit=False, verbosity=1)
    result = program.result
    if result.testsRun and len(result.skipped) == result.testsRun:
        sys.exit(77)
    sys.exit(not result.wasSuccessful())


def grid(columns, rows, seed=1, noise=0.3, dtype=np.float64):
    """A bumpy sheet of 2 columns rows triangles: plenty of edges to flip and split."""
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    z = 0.8 * np.sin(0.7 * x) * np.cos(0.5 * y)
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3) + random.uniform(-noise, noise, (x.size, 3))
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1)
    b, c, d = a + 1, a + columns + 2, a + columns + 1
    return points.astype(dtype), np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def cylinder(around, rows, twist, jitter):
    """An open cylinder of quads, sheared; its UV map has a seam from end to end. -> positions, quads, UVs per corner, seam."""
    random = np.random.default_rng(around)
    angle = np.arange(around) * 2 * np.pi / around
    points = np.array([[np.cos(t + twist * j / rows), np.sin(t + twist * j / rows), 0.35 * j]
                       for j in range(rows + 1) for t in angle])
    points += random.normal(0, jitter, points.shape)
    quads = np.array([[j * around + i, j * around + (i + 1) % around, (j + 1) * around + (i + 1) % around, (j + 1) * around + i]
                      for j in range(rows) for i in range(around)])
    uvs = np.array([[(i + u) / around, (j + v) / rows] for j in range(rows) for i in range(around)
                    for u, v in ((0, 0), (1, 0), (1, 1), (0, 1))], np.float32)
    seam = np.array([[j * around, (j + 1) * around] for j in range(rows)])
    return points.astype(np.float32), quads, uvs, seam


def read_obj(path):
    """-> positions, polygons' corner vertices, offsets, UVs per corner."""
    points, coordinates, corners, texture, offsets = [], [], [], [], [0]
    with (gzip.open(path, "rt") if path.suffix == ".gz" else open(path)) as lines:
        for line in lines:
            word, *rest = line.split() or [""]
            if word == "v":
                points.append([float(x) for x in rest[:3]])
            elif word == "vt":
                coordinates.append([float(x) for x in rest[:2]])
            elif word == "f":
                for item in rest:
                    numbers = item.split("/")
                    corners.append(int(numbers[0]) - 1)
                    texture.append(int(numbers[1]) - 1)
                offsets.append(len(corners))
    return (np.array(points, np.float32), np.array(corners), np.array(offsets), np.array(coordinates, np.float32)[texture])
