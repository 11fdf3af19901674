# SPDX-License-Identifier: Apache-2.0
"""Laws over real cages at several rates: both evaluations agree, counts, boundaries, creases, seams, places of levels."""
import collections
import gzip
import unittest

from support import SHARED, main, np

import delmesh

DATA = SHARED / "data" / "clean"
NAMES = ("catmark_car.obj", "catmark_rook.obj", "catmark_torus_creases0.obj", "spot_control_mesh.obj", "fandisk_quads.off")
RATES = (4, 8, 16)

try:
    delmesh.Cage([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    REASON = "" if DATA.is_dir() else f"{DATA} is missing"
except delmesh.Unsupported:
    REASON = "the library was built without OpenSubdiv"


class File:
    """An OBJ or OFF file: points, faces, UVs per corner or None, creases {(low, high): sharpness}."""

    def __init__(self, path):
        self.points, self.faces, texture, indices, self.creases = [], [], [], [], {}
        with (gzip.open(path, "rt") if path.suffix == ".gz" else open(path, encoding="utf-8")) as lines:
            if path.suffix == ".off":
                numbers = iter(lines.read().split()[1:])
                verts, faces, _ = (int(next(numbers)) for _ in range(3))
                self.points = [[float(next(numbers)) for _ in range(3)] for _ in range(verts)]
                self.faces = [[int(next(numbers)) for _ in range(int(next(numbers)))] for _ in range(faces)]
                lines = ()
            for word, *rest in (line.split() or [""] for line in lines):
                if word == "v":
                    self.points.append([float(x) for x in rest[:3]])
                elif word == "vt":
                    texture.append([float(x) for x in rest[:2]])
                elif word == "f":
                    self.faces.append([int(corner.split("/")[0]) - 1 for corner in rest])
                    indices += [corner.split("/")[1] if "/" in corner else "" for corner in rest]
                elif word == "t" and rest[0] == "crease":
                    count = int(rest[1].split("/")[0])
                    line = [int(x) for x in rest[2:2 + count]]
                    for pair in zip(line, line[1:]):
                        self.creases[tuple(sorted(pair))] = float(rest[2 + count])
        self.points = np.array(self.points)
        self.uvs = np.array([texture[int(i) - 1] for i in indices]) if texture and all(indices) else None
        self.sizes = np.array([len(face) for face in self.faces])
        self.corners = np.concatenate([np.array(face) for face in self.faces])
        edges = collections.Counter(tuple(sorted(pair)) for face in self.faces for pair in zip(face, face[1:] + face[:1]))
        self.rim = {edge for edge, n in edges.items() if n == 1}
        self.boundary = len(self.rim)
        self.creases = {pair: sharpness for pair, sharpness in self.creases.items() if pair in edges}
        self.diagonal = np.linalg.norm(self.points.max(axis=0) - self.points.min(axis=0))

    def cage(self, sharpness=None, **more):
        creases = None
        if self.creases:
            creases = np.array(list(self.creases)), np.array([sharpness or value for value in self.creases.values()])
        layers = {} if self.uvs is None else {"uv": self.uvs}
        return delmesh.Cage(self.points, corner_verts=self.corners, face_sizes=self.sizes, creases=creases, layers=layers, **more)


@unittest.skipIf(REASON, REASON)
class Laws(unittest.TestCase):
    def test_both_evaluations(self):
        for name in NAMES:
            file = File(DATA / name)
            ends = collections.Counter(v for pair in file.creases for v in pair)
            # With the file's sharpness, with none that is left at any of the rates, and for ever
            for sharpness in ([None, 2.0, 10.0] if file.creases else [None]):
                cage = file.cage(sharpness)
                for rate in RATES:
                    with self.subTest(name, sharpness=sharpness, rate=rate):
                        far = cage.subdivide(rate, evaluation="far", precision="float64").mesh
                        bfr = cage.subdivide(rate).mesh
                        self.assertEqual((far.info.vertices, far.info.faces, far.info.edges),
                                         (bfr.info.vertices, bfr.info.faces, bfr.info.edges))
                        for mesh in (far, bfr):
                            self.assertEqual(mesh.info.boundary_edges, rate * file.boundary)
                            self.assertEqual(mesh.info.copied_vertices, 0)
                            self.assertEqual(np.count_nonzero(mesh.edge_flags & delmesh.EDGE_CREASE), rate * len(file.creases))
                        quads = np.count_nonzero(file.sizes == 4)
                        n_gons = file.sizes[file.sizes != 4].sum()
                        self.assertEqual(bfr.info.faces, 2 * quads * rate**2 + n_gons * rate**2 // 2)
                        apart = np.linalg.norm(cage.values(far, file.points) - far.positions, axis=1) / file.diagonal
                        # What Far gets wrong (docs/subdivide.md): creases that are sharp still, and the ends of creases.
                        creased = np.zeros(far.info.vertices, bool)
                        creased[far.edges[(far.edge_flags & delmesh.EDGE_CREASE) != 0]] = True
                        self.assertLess(apart[~creased].max(), 1e-8)
                        if sharpness == 2.0:
                            self.assertLess(apart.max(), 1e-8)
                        elif sharpness == 10.0:
                            self.assertLessEqual(np.count_nonzero(apart > 1e-8), sum(n == 1 for n in ends.values()))
                            self.assertLess(apart.max(), 4e-3 / rate)

    def test_creases_are_sharp(self):
        """Where two edges that are sharp for ever meet, the limit is that of their own line, whatever is beside it: the cubic
        B-spline. Where more meet, the vertex stays."""
        for name in NAMES:
            file = File(DATA / name)
            if not file.creases:
                continue
            sharp = collections.defaultdict(list)
            for a, b in file.rim | set(file.creases):
                sharp[a].append(b)
                sharp[b].append(a)
            rim = {v for edge in file.rim for v in edge}
            inside = {v: ends for v, ends in sharp.items() if v not in rim}
            x = file.points
            expected = [x[v] for v, ends in inside.items() if len(ends) > 2]
            expected += [(x[ends[0]] + 4 * x[v] + x[ends[1]]) / 6 for v, ends in inside.items() if len(ends) == 2]
            vertices = len(expected)
            for a, b in file.creases:
                if len(inside.get(a, ())) == 2 == len(inside.get(b, ())):
                    before, after = (sum(inside[v]) - other for v, other in ((a, b), (b, a)))
                    expected.append((x[before] + 23 * x[a] + 23 * x[b] + x[after]) / 48)
            self.assertGreaterEqual(min(vertices, len(expected) - vertices), 8, name)
            dense = file.cage(10.0).subdivide(8, precision="float64").mesh
            line = dense.positions[np.unique(dense.edges[(dense.edge_flags & delmesh.EDGE_CREASE) != 0])]
            for point in expected:
                self.assertLess(np.linalg.norm(line - point, axis=1).min(), 1e-6 * file.diagonal, name)

    def test_seams_are_the_cages(self):
        file = File(DATA / "spot_control_mesh.obj")
        cage = file.cage()
        first = np.concatenate([[0], np.cumsum(file.sizes)])
        square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
        # The cage's borders: edges whose two faces have other UVs at an end
        sides = collections.defaultdict(list)
        for f, face in enumerate(file.faces):
            for k, (a, b) in enumerate(zip(face, face[1:] + face[:1])):
                at = {a: tuple(file.uvs[first[f] + k]), b: tuple(file.uvs[first[f] + (k + 1) % len(face)])}
                sides[min(a, b), max(a, b)].append((f, k, at))
        seams = {(f, k) for uses in sides.values() if len(uses) == 2 and uses[0][2] != uses[1][2] for f, k, _ in uses}
        dense = cage.subdivide(16, precision="float64").mesh
        self.assertEqual(np.count_nonzero(dense.edge_flags & delmesh.EDGE_UV), 16 * len(seams) // 2)
        for mesh in [dense, *delmesh.lod_family(dense, ratios=[0.3, 0.03]).levels]:
            faces, places = mesh.corner_cage
            uvs, tested = mesh.layers["uv"], 0
            for f, k in seams:
                if file.sizes[f] != 4:
                    continue
                a, b = square[k], square[(k + 1) % 4]
                along = (places - a) @ (b - a)
                on = (faces == f) & (np.abs(places - a - along[..., None] * (b - a)).max(axis=2) == 0)
                ends = file.uvs[first[f] + k], file.uvs[first[f] + (k + 1) % 4]
                expected = ends[0] + along[on][:, None] * (ends[1] - ends[0])
                self.assertLess(np.abs(uvs[on] - expected).max(initial=0), 1e-7)
                tested += np.count_nonzero(on)
            self.assertGreater(tested, len(seams) // 2)

    def test_poses_follow_the_limit(self):
        for name in NAMES:
            file = File(DATA / name)
            cage = file.cage()
            dense = cage.subdivide(8, precision="float64")
            phase = np.linspace(0, 2, 3)
            for t in phase:
                pose = file.points + 0.05 * file.diagonal * np.sin(t + 3 * file.points[:, [1, 2, 0]] / file.diagonal)
                moved = cage.reevaluate(dense, pose)
                limit = cage.values(dense, pose)
                self.assertLess(np.abs(moved.vertices - limit).max(), 1e-6 * file.diagonal)
                certified = delmesh.certify(moved)
                self.assertEqual(moved.report.nld_interior, certified.nld_interior)


if __name__ == "__main__":
    main()
