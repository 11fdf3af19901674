# SPDX-License-Identifier: Apache-2.0
"""Tests of the independent certifier itself.

    test_certifier.py known|random|manifest PATH_OF_DM_CERTIFIER

known     meshes made by hand, with answers that follow from geometry: exact ties, ties moved by one unit in the last place both
          ways, obtuse boundaries, zero area, broken topology, extreme scales, and every file format
random    random meshes full of near ties, against rational arithmetic (fractions) written here
manifest  the exact counts that MANIFEST.tsv of the shared data states, which another program made
"""
import csv
import gzip
import json
import math
import os
import random
import struct
import subprocess
import sys
import tempfile
import unittest
from fractions import Fraction
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("DELMESH_SHARED", ROOT.parent / "shared"))
CERTIFIER = ""


def run(path, *options):
    done = subprocess.run([CERTIFIER, *options, str(path)], capture_output=True, text=True, timeout=60)
    return done.returncode, json.loads(done.stdout) if done.stdout else done.stderr


def off_text(points, faces):
    lines = ["OFF", f"{len(points)} {len(faces)} 0"]
    lines += [" ".join(repr(float(x)) for x in p) for p in points]
    lines += [" ".join(str(i) for i in (len(f), *f)) for f in faces]
    return "\n".join(lines) + "\n"


class WithFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def certify(self, points, faces, *options):
        path = self.folder / "mesh.off"
        path.write_text(off_text(points, faces))
        return run(path, *options)

    def expect(self, points, triangles, *options, status, **counts):
        got_status, answer = self.certify(points, triangles, *options)
        self.assertIsInstance(answer, dict, answer)
        self.assertEqual({k: answer[k] for k in counts}, counts)
        self.assertEqual(got_status, status)
        self.assertEqual(answer["delaunay"], status == 0)


def grid(n, diagonal=lambda i, j: 0):
    points = [(float(i), float(j), 0.0) for j in range(n + 1) for i in range(n + 1)]
    faces = []
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i
            b, c, d = a + 1, a + n + 2, a + n + 1
            faces += [(a, b, c), (a, c, d)] if diagonal(i, j) == 0 else [(a, b, d), (b, c, d)]
    return points, faces


TETRAHEDRON = ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])


def up(x):
    return math.nextafter(x, math.inf)


def down(x):
    return math.nextafter(x, -math.inf)


class Known(WithFolder):
    def test_tetrahedron(self):
        self.expect(*TETRAHEDRON, status=0, vertices=4, faces=4, edges=6, boundary_edges=0, components=1, boundary_loops=0,
                    euler_characteristic=2, nld_interior=0, zero_area_faces=0, nonmanifold_edges=0, misoriented_edges=0)

    def test_right_angled_grid_is_all_ties_and_delaunay(self):
        n = 7
        for diagonal in (lambda i, j: 0, lambda i, j: 1, lambda i, j: (i ^ j) & 1):
            self.expect(*grid(n, diagonal), status=0, nld_interior=0, nld_boundary=0, faces=2 * n * n, boundary_edges=4 * n,
                        edges=3 * n * n + 2 * n, euler_characteristic=1, components=1, boundary_loops=1)

    def test_two_right_angles_moved_by_one_ulp(self):
        # The apex (1, 0) of the unit square's diagonal: inwards makes its angle obtuse, outwards acute; the other one is 90.
        for x, nld in ((1.0, 0), (down(1.0), 1), (up(1.0), 0)):
            self.expect([(0, 0, 0), (x, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)], status=nld, nld_interior=nld)

    def test_acute_and_obtuse_tie_moved_by_one_ulp_flat_and_folded(self):
        # (0, 8) and (0, -2) lie on the circle through (-4, 0) and (4, 0); folding about that edge changes no angle. The first
        # face has obtuse angles nowhere; the second has one at its apex, opposite to the shared edge only.
        for scale in (1.0, 2.0 ** 40, 2.0 ** -140, 2.0 ** -900):
            for y, nld in ((-2.0, 0), (up(-2.0), 1), (down(-2.0), 0)):
                for fold in (lambda t: (0.0, t, 0.0), lambda t: (0.0, 0.0, t), lambda t: (0.0, 0.0, -t)):
                    points = [(-4.0, 0, 0), (4.0, 0, 0), (0, 8.0, 0), fold(y)]
                    points = [tuple(scale * x for x in p) for p in points]
                    self.expect(points, [(0, 1, 2), (1, 0, 3)], status=nld, nld_interior=nld, nld_boundary=0)

    def test_far_from_the_origin(self):
        # The same tie, where subtraction in double is exact but products of the coordinates are not.
        shift = 2.0 ** 50
        for y, nld in ((-2.0, 0), (-1.0, 1), (-3.0, 0)):
            points = [(shift - 4.0, shift, -shift), (shift + 4.0, shift, -shift), (shift, shift + 8.0, -shift),
                      (shift, shift + y, -shift)]
            self.expect(points, [(0, 1, 2), (1, 0, 3)], status=nld, nld_interior=nld)

    def test_mixed_magnitudes(self):
        # Apexes at distances 2^-500 and 1 of a unit edge: the exact path has integers of thousands of bits.
        tiny = 2.0 ** -500
        self.expect([(0, 0, 0), (1, 0, 0), (0.5, tiny, 0), (0.5, -1, 0)], [(0, 1, 2), (1, 0, 3)], status=1, nld_interior=1)
        # Its angle is 180 - a, the other one's is 2^501 times as flat: together above 180.
        self.expect([(0, 0, 0), (tiny, 0, 0), (tiny / 2, 1, 0), (tiny / 2, -tiny / 2, 0)], [(0, 1, 2), (1, 0, 3)], status=0,
                    nld_interior=0)

    def test_denormals(self):
        unit = 5e-324
        self.expect([(0, 0, 0), (unit, 0, 0), (0, unit, 0)], [(0, 1, 2)], status=0, nld_boundary=0, zero_area_faces=0)
        self.expect([(0, 0, 0), (3 * unit, 0, 0), (unit, unit, 0)], [(0, 1, 2)], status=1, nld_boundary=1, zero_area_faces=0)

    def test_obtuse_boundary_counts_unless_ignored(self):
        points, faces = [(0, 0, 0), (2, 0, 0), (1, 0.5, 0)], [(0, 1, 2)]
        self.expect(points, faces, status=1, nld_boundary=1, nld_interior=0, boundary_loops=1)
        self.expect(points, faces, "--boundary", "ignore", status=0, nld_boundary=1)
        self.expect([(0, 0, 0), (2, 0, 0), (1, 1, 0)], faces, status=0, nld_boundary=0)  # exactly 90
        self.expect([(0, 0, 0), (2, 0, 0), (1, down(1.0), 0)], faces, status=1, nld_boundary=1)

    def test_zero_area(self):
        self.expect([(0, 0, 0), (1, 1, 1), (3, 3, 3)], [(0, 1, 2)], "--boundary", "ignore", status=1, zero_area_faces=1)
        self.expect([(0, 0, 0), (1, 1, 1), (3, 3, up(3.0))], [(0, 1, 2)], "--boundary", "ignore", status=0, zero_area_faces=0)
        self.expect([(0, 0, 0), (0, 0, 0), (0, 0, 0)], [(0, 1, 2)], status=1, zero_area_faces=1)
        self.expect([(0.1, 0.2, 0.3), (0.1, 0.2, 0.3), (5, 6, 7)], [(0, 1, 2)], status=1, zero_area_faces=1)
        # Two faces of zero area with their apexes between the edge's ends: an angle of 180 each.
        self.expect([(0, 0, 0), (4, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2), (1, 0, 3)], status=1, zero_area_faces=2,
                    nld_interior=1)
        # One apex outside: angles 180 and 0 make a tie.
        self.expect([(0, 0, 0), (4, 0, 0), (1, 0, 0), (5, 0, 0)], [(0, 1, 2), (1, 0, 3)], status=1, zero_area_faces=2,
                    nld_interior=0)

    def test_topology(self):
        points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, -1, 0), (0, 0, -1), (-1, 0, 0)]
        self.expect(points, [(0, 1, 2), (1, 0, 3), (0, 1, 4)], status=1, nonmanifold_edges=1)
        self.expect(points, [(0, 1, 2), (0, 1, 4)], status=1, misoriented_edges=1, nonmanifold_edges=0)
        self.expect(points, [(0, 1, 2), (0, 5, 6)], status=1, nonmanifold_vertices=1, components=2, euler_characteristic=1)
        self.expect(points, [(0, 1, 2)], status=0, vertices=7, euler_characteristic=1, nonmanifold_vertices=0)
        self.expect(points, [(0, 0, 2)], status=1, zero_area_faces=1, nonmanifold_edges=1)

    def test_annulus_has_two_loops(self):
        n = 12
        ring = [(r * math.cos(math.tau * k / n), r * math.sin(math.tau * k / n), 0.0) for r in (1.0, 1.5) for k in range(n)]
        faces = []
        for k in range(n):
            a, b = k, (k + 1) % n
            faces += [(a, n + a, n + b), (a, n + b, b)]
        _, answer = self.certify(ring, faces)
        self.assertEqual((answer["boundary_loops"], answer["components"], answer["euler_characteristic"]), (2, 1, 0))

    def test_f32_rounds_and_source_compares(self):
        x = 1.0 + 2.0 ** -30  # 1 as a float32: then the square is a tie, before it is not
        points, faces = [(0, 0, 0), (x, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 3), (1, 2, 3)]
        self.expect(points, faces, status=1, nld_interior=1, nld_boundary=0)
        self.expect(points, faces, "--f32", status=0, nld_interior=0, nld_boundary=0)
        other = self.folder / "source.off"
        other.write_text(off_text([(0, 0, 0), (1, 0, 0), (1, 1, 0)], []))
        self.expect(points, faces, "--source", str(other), status=1, moved_vertices=1)
        self.expect(points, faces, "--f32", "--source", str(other), status=0, moved_vertices=0)
        other.write_text(off_text(points + [(7, 7, 7)], []))
        self.expect(points, faces, "--source", str(other), status=1, moved_vertices=1)

    def test_within_finds_the_far_side(self):
        points, faces = grid(4)
        flat = self.folder / "flat.off"
        flat.write_text(off_text(points, faces))
        raised = list(points)
        raised[12] = (2.0, 2.0, 2.0 ** -40)  # the middle vertex, and a little of its six faces
        for reach, far in ((2.0 ** -40, False), (down(2.0 ** -40), True), (0.0, True)):
            _, answer = self.certify(raised, faces, "--source", str(flat), "--within", repr(reach))
            self.assertEqual(answer["far_samples"] > 0, far, reach)
        # A hole is seen from the other side only; the same mesh is at distance 0.
        _, answer = self.certify(points, faces[:-2], "--source", str(flat), "--within", "1e-3")
        self.assertGreater(answer["far_samples"], 0)
        _, answer = self.certify(points, faces, "--source", str(flat), "--within", "0")
        self.assertEqual(answer["far_samples"], 0)

    def test_every_format_reads_the_same(self):
        points, faces = [(0.1, 0, 0), (1, -0.0, 0), (1, 1, 0.3), (0, 1, 1e-30)], [(0, 1, 2), (0, 2, 3)]
        points = [struct.unpack("3f", struct.pack("3f", *p)) for p in points]
        text = lambda p: " ".join(repr(x) for x in p)
        files = {"a.off": off_text(points, faces).encode()}
        files["a.obj"] = ("# c\n" + "".join(f"v {text(p)} 1 1 1\n" for p in points) + "vt 0 0\nvn 0 0 1\n" +
                          "f 1/1/1 2//1 3/1\nf -4 -2 -1\n").encode()
        files["quad.obj"] = ("".join(f"v {text(p)}\r\n" for p in points) + "f 1 2 3 4\r\n").encode()
        head = ("element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar q\n"
                "element face 2\nproperty list uchar int vertex_indices\nend_header\n")
        files["a.ply"] = ("ply\nformat ascii 1.0\n" + head + "".join(f"{text(p)} 9\n" for p in points) +
                          "".join(f"3 {a} {b} {c}\n" for a, b, c in faces)).encode()
        for order, name in (("<", "little"), (">", "big")):
            body = b"".join(struct.pack(order + "3fB", *p, 9) for p in points)
            body += b"".join(struct.pack(order + "B3i", 3, *f) for f in faces)
            files[name + ".ply"] = f"ply\nformat binary_{name}_endian 1.0\n{head}".encode() + body
            body = struct.pack(order + "3i", 4, 2, 0) + b"".join(struct.pack(order + "3f", *p) for p in points)
            files[name + "1.off"] = b"OFF BINARY\n" + body + b"".join(struct.pack(order + "4i", 3, *f) for f in faces)
            files[name + "2.off"] = b"OFF BINARY\n" + body + b"".join(struct.pack(order + "5i", 3, *f, 0) for f in faces)
        strip = ("ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                 "element tristrips 1\nproperty list int int vertex_indices\nend_header\n")
        files["strip.ply"] = (strip + "".join(f"{text(p)}\n" for p in points) + "8 0 1 2 -1 0 2 3 3\n").encode()
        facets = [[points[v] for v in f] for f in faces]
        files["b.stl"] = bytes(80) + struct.pack("<I", 2) + b"".join(
            struct.pack("<12fH", 0, 0, 0, *t[0], *t[1], *t[2], 0) for t in facets)
        files["t.stl"] = ("solid x\n" + "".join("facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {text(p)}\n" for p in t) +
                                                "endloop\nendfacet\n" for t in facets) + "endsolid x\n").encode()
        answers = {}
        for name, data in files.items():
            path = self.folder / name
            path.write_bytes(data)
            answers[name] = run(path)
        for name, answer in answers.items():
            self.assertEqual(answer, answers["a.off"], name)
        self.assertEqual(answers["a.off"][1]["edges"], 5)

    def test_unreadable_is_status_2(self):
        for name, data in (("a.off", b"OFF\n1 1 0\n0 0 0\n3 0 1 2\n"), ("b.off", b"OFF\n1 0 0\n0 zero 0\n"),
                           ("c.off", b"OFF\n3 1 0\n0 0 0\n"), ("a.obj", b"v 0 0 0\nf 1 2 3\n"), ("a.ply", b"ply\n"),
                           ("a.stl", b"x"), ("a.xyz", b""), ("d.off", b"OFF\n3 1 0\nnan 0 0 1 0 0 0 1 0 3 0 1 2\n")):
            path = self.folder / name
            path.write_bytes(data)
            self.assertEqual(run(path)[0], 2, name)
        self.assertEqual(run(self.folder / "missing.off")[0], 2)


def exact_edge(o1, o2, p, q):
    """NLD by rational arithmetic; None for o2 makes it a boundary edge."""
    def corner(o):
        u = [Fraction(a) - Fraction(b) for a, b in zip(p, o)]
        v = [Fraction(a) - Fraction(b) for a, b in zip(q, o)]
        n = [u[i] * v[(i + 1) % 3] - u[(i + 1) % 3] * v[i] for i in range(3)]
        return sum(a * b for a, b in zip(u, v)), sum(a * a for a in n)
    d1, s1 = corner(o1)
    if o2 is None:
        return d1 < 0
    d2, s2 = corner(o2)
    # sign of sqrt(s1) d2 + sqrt(s2) d1, from the signed squares of the two terms
    square = (s1 * d2 * abs(d2)) + (s2 * d1 * abs(d1))
    return square < 0 or (s1 == s2 == 0 and d1 < 0 and d2 < 0)


class Random(WithFolder):
    def test_counts_agree_with_fractions(self):
        rng = random.Random(1)
        seen = 0
        for trial in range(60):
            n = 6
            points, faces = grid(n, lambda i, j: rng.randrange(2))
            kind, scale = trial % 4, 2.0 ** rng.randrange(-60, 60)
            for i, p in enumerate(points):
                if kind == 0:  # anything
                    p = [x + rng.uniform(-0.6, 0.6) for x in p]
                elif kind == 1:  # a sheared lattice with a few coordinates moved by one unit in the last place
                    p = [p[0] + p[1], 3 * p[1] - p[0], p[0] * 0.5]
                    p = [rng.choice((x, x, up(x), down(x))) for x in p]
                elif kind == 2:  # small integers: many exact ties and zero areas
                    p = [float(rng.randrange(3)) for _ in p]
                else:  # a rotated square lattice as float32 numbers
                    p = [0.6 * p[0] - 0.8 * p[1] + 3, 0.8 * p[0] + 0.6 * p[1], 1 / 3]
                    p = struct.unpack("3f", struct.pack("3f", *p))
                points[i] = tuple(scale * x for x in p)
            edges = {}
            for f in faces:
                for k in range(3):
                    edges.setdefault(frozenset((f[k], f[(k + 1) % 3])), []).append(f[(k + 2) % 3])
            interior = boundary = 0
            for edge, apexes in edges.items():
                p, q = (points[v] for v in edge)
                if len(apexes) == 2:
                    interior += exact_edge(points[apexes[0]], points[apexes[1]], p, q)
                else:
                    boundary += exact_edge(points[apexes[0]], None, p, q)
            _, answer = self.certify(points, faces)
            self.assertEqual((answer["nld_interior"], answer["nld_boundary"]), (interior, boundary), (trial, kind))
            seen += interior
        self.assertGreater(seen, 500)

    def rotation(self, rng):
        """A random orthogonal basis, in floating point."""
        a, b = ([rng.gauss(0, 1) for _ in range(3)] for _ in range(2))
        length = math.dist(a, (0, 0, 0))
        a = [x / length for x in a]
        along = sum(x * y for x, y in zip(a, b))
        b = [y - along * x for x, y in zip(a, b)]
        length = math.dist(b, (0, 0, 0))
        b = [x / length for x in b]
        return a, b, [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    def near_ties(self, seed, make, exact, key):
        """Batches of separate pieces with full mantissas, where floating point alone would guess the sign."""
        rng = random.Random(seed)
        total = 0
        for _ in range(40):
            points, faces, wanted = [], [], 0
            for _ in range(50):
                place, offset = self.rotation(rng), [rng.uniform(-3, 3) for _ in range(3)]
                piece, triangles = make(rng)
                piece = [tuple(offset[k] + sum(p[i] * place[i][k] for i in range(3)) for k in range(3)) for p in piece]
                wanted += exact(piece)
                faces += [tuple(len(points) + i for i in t) for t in triangles]
                points += piece
            _, answer = self.certify(points, faces)
            self.assertEqual(answer[key], wanted)
            total += wanted
        self.assertTrue(500 < total < 1500, total)  # both signs, about as often

    def test_interior_near_ties(self):
        def make(rng):
            a, b, c, d = sorted(rng.uniform(0, math.tau) for _ in range(4))
            p, o1, q, o2 = ([math.cos(t), math.sin(t)] for t in (a, b, c, d))
            # fold the second face about the edge: the angle stays
            axis = [q[0] - p[0], q[1] - p[1]]
            length = math.hypot(*axis)
            axis = [x / length for x in axis]
            along = (o2[0] - p[0]) * axis[0] + (o2[1] - p[1]) * axis[1]
            height = (o2[1] - p[1]) * axis[0] - (o2[0] - p[0]) * axis[1]
            fold = rng.uniform(-1.5, 1.5)
            o2 = [p[0] + along * axis[0] - math.cos(fold) * height * axis[1],
                  p[1] + along * axis[1] + math.cos(fold) * height * axis[0], math.sin(fold) * height]
            return [(*p, 0.0), (*q, 0.0), (*o1, 0.0), o2], [(0, 1, 2), (1, 0, 3)]
        self.near_ties(2, make, lambda piece: exact_edge(piece[2], piece[3], piece[0], piece[1]), "nld_interior")

    def test_boundary_near_ties(self):
        def make(rng):
            t = rng.uniform(0.1, math.pi - 0.1)
            return [(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (math.cos(t), math.sin(t), 0.0)], [(0, 1, 2)]
        self.near_ties(3, make, lambda piece: exact_edge(piece[2], None, piece[0], piece[1]), "nld_boundary")

    def test_zero_area_near_ties(self):
        # Points on the line (x, 3 x, 5 x), exactly, and one unit in the last place beside it. Their differences are not exact.
        rng = random.Random(4)
        points, faces, wanted = [], [], 0
        for _ in range(2000):
            for scale in (1.0, 2.0 ** -12, 2.0 ** -25):
                x = scale * rng.getrandbits(50)
                points.append((x, 3 * x, 5 * x))
            if rng.random() < 0.5:
                points[-1] = (points[-1][0], up(points[-1][1]), points[-1][2])
            else:
                wanted += 1
            faces.append(tuple(range(len(points) - 3, len(points))))
        _, answer = self.certify(points, faces)
        self.assertEqual(answer["zero_area_faces"], wanted)

    def test_small_coordinates_far_below_the_largest(self):
        # One vertex at 2^900 sets the scale; the tie is at 2^-900, where only the exact path, on unscaled numbers, can see it.
        s = 2.0 ** -900
        far = [(2.0 ** 900, 0, 0), (0, 2.0 ** 900, 0), (0, 0, 2.0 ** 900)]
        for y, nld in ((-2.0, 0), (up(-2.0), 1), (down(-2.0), 0)):
            points = [(-4 * s, 0, 0), (4 * s, 0, 0), (0, 8 * s, 0), (0, y * s, 0)] + far
            self.expect(points, [(0, 1, 2), (1, 0, 3), (4, 5, 6)], status=nld, nld_interior=nld, zero_area_faces=0)


class Manifest(WithFolder):
    def test_counts_agree(self):
        if not (SHARED / "data" / "MANIFEST.tsv").exists():
            self.skipTest("the shared data is not there")
        with open(SHARED / "data" / "MANIFEST.tsv", newline="") as table:
            rows = [r for r in csv.DictReader(table, delimiter="\t") if r["group"] in ("clean", "compare", "paper")]
        self.assertGreaterEqual(len(rows), 50)
        keys = {"faces": "F", "edges": "E", "boundary_edges": "bndE", "components": "comps", "boundary_loops": "bloops",
                "euler_characteristic": "chi", "nld_interior": "NLDint", "nld_boundary": "NLDbnd",
                "zero_area_faces": "zeroAreaF", "nonmanifold_edges": "nmE", "misoriented_edges": "flipE"}
        for row in rows:
            source = SHARED / "data" / row["group"] / row["name"]
            data = source.read_bytes()
            path = self.folder / (row["name"][:-3] if row["name"].endswith(".gz") else row["name"])
            path.write_bytes(gzip.decompress(data) if row["name"].endswith(".gz") else data)
            status, answer = run(path)
            with self.subTest(mesh=row["name"]):
                self.assertIn(status, (0, 1), answer)
                self.assertEqual({k: answer[k] for k in keys}, {k: int(row[v]) for k, v in keys.items()})
            path.unlink()


if __name__ == "__main__":
    part, CERTIFIER = sys.argv[1].capitalize(), sys.argv[2]
    program = unittest.main(argv=[sys.argv[0], part], exit=False)
    if program.result.skipped and not program.result.failures and not program.result.errors:
        sys.exit(77)
    sys.exit(0 if program.result.wasSuccessful() and program.result.testsRun > 0 else 1)
