# SPDX-License-Identifier: Apache-2.0
"""SurfaceMap: what is carried to the result is what the source has there, on the same side of every seam."""
import unittest

import support
from support import SHARED, cylinder, grid, np, read_obj

import delmesh

MODES = ("preserve", "flip", "feature")
CYLINDERS = [(24, 9, 0.9, 0), (24, 9, 0.9, 0.03), (5, 6, 2, 0), (3, 4, 3, 0.05), (40, 30, 5, 0.01)]


def uv_seams(corner_verts, offsets, uvs):
    """Edges whose two sides differ in UVs, by brute force."""
    sides = {}
    for begin, end in zip(offsets[:-1], offsets[1:]):
        for c in range(begin, end):
            d = c + 1 if c + 1 < end else begin
            ends = sorted([(corner_verts[c], tuple(uvs[c])), (corner_verts[d], tuple(uvs[d]))])
            sides.setdefault((ends[0][0], ends[1][0]), set()).add((ends[0][1], ends[1][1]))
    return np.array([edge for edge, values in sides.items() if len(values) > 1]).reshape(-1, 2)


class Law:
    """The checks, for any source."""

    def carry(self, mode, points, corner_verts, offsets, uvs, seams, **options):
        source = delmesh.Mesh(points, corner_verts=corner_verts, face_offsets=offsets, marked_edges=seams)
        result, report = delmesh.remesh(source, mode=mode, **options)
        self.assertTrue(report.certified)
        carried = delmesh.SurfaceMap(source, result, corner_verts, offsets)
        self.assertEqual(carried.corners.shape, (3 * len(result.faces), 3))
        np.testing.assert_allclose(carried.corner_weights.sum(axis=1), 1, atol=1e-14)
        # A corner takes its values at source vertices of its own vertex.
        used = carried.corner_weights != 0
        np.testing.assert_array_equal(corner_verts[carried.corners][used],
                                      carried.verts[result.faces.reshape(-1)][used])
        return source, result, carried, carried.corner_values(uvs).reshape(-1, 3, 2)

    def check_labels_do_not_matter(self, source, result, corner_verts, offsets, uvs, uv):
        """After many flips a face's source polygon can be anywhere: sides are told by how faces hang together, not by it."""
        class Relabelled:
            face_source = np.random.default_rng(5).permutation(result.face_source)

            def __getattr__(self, name):
                return getattr(result, name)

        carried = delmesh.SurfaceMap(source, Relabelled(), corner_verts, offsets)
        np.testing.assert_array_equal(carried.corner_values(uvs).reshape(-1, 3, 2), uv)

    def check_source_vertices(self, result, corner_verts, uvs, uv):
        """Every corner at a source vertex has, bit for bit, one of that vertex's UVs."""
        have = {(int(v), *map(float, value)) for v, value in zip(corner_verts, uvs)}
        source = result.vert_source[result.faces]
        for v, value in zip(source[source >= 0], uv[source >= 0]):
            self.assertIn((int(v), *map(float, value)), have)

    def check_linear(self, source, result, corner_verts, offsets, uvs, uv, tolerance):
        """preserve: each face lies inside a triangle of the source, found without the map; its UVs are that triangle's."""
        triangle_corners = delmesh.SurfaceMap(source, source, corner_verts, offsets).corners[:, 0].reshape(-1, 3)
        by_polygon = {}
        for t, polygon in enumerate(source.face_source):
            by_polygon.setdefault(int(polygon), []).append(t)
        places = source.positions.astype(float)[source.faces]
        out = result.positions.astype(float)[result.faces]
        worst = 0
        for f, polygon in enumerate(result.face_source):
            best = None
            for t in by_polygon[int(polygon)]:
                a, b, c = places[t]
                basis = np.stack([b - a, c - a, np.cross(b - a, c - a)], axis=1)
                u, v, height = np.linalg.solve(basis, (out[f] - a).T)
                weights = np.stack([1 - u - v, u, v], axis=1)
                # The triangle that holds the face's centre, in its plane and across it.
                off = max(0, -weights.mean(axis=0).min()) + abs(height.mean()) * np.linalg.norm(basis[:, 2])**0.5
                if best is None or off < best[0]:
                    best = off, weights @ uvs[triangle_corners[t]].astype(float)
            worst = max(worst, np.abs(best[1] - uv[f]).max())
        self.assertLess(worst, tolerance)


class Cylinders(Law, unittest.TestCase):
    def test_uv_law(self):
        for shape in CYLINDERS:
            points, quads, uvs, seam = cylinder(*shape)
            verts, offsets = quads.reshape(-1), np.arange(0, quads.size + 1, 4)
            np.testing.assert_array_equal(np.unique(uv_seams(verts, offsets, uvs), axis=0), np.unique(seam, axis=0))
            for mode in MODES:
                with self.subTest(mode, shape=shape):
                    source, result, carried, uv = self.carry(mode, points, verts, offsets, uvs, seam)
                    self.check_source_vertices(result, verts, uvs, uv)
                    # The unrolled cylinder is covered once: no face jumps over the seam, none is turned over.
                    e, g = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
                    area = (e[:, 0] * g[:, 1] - e[:, 1] * g[:, 0]) / 2
                    self.assertAlmostEqual(area.sum(), 1, places=5)
                    self.assertGreater(area.min(), -1e-6)
                    self.check_labels_do_not_matter(source, result, verts, offsets, uvs, uv)
                    if mode == "preserve":
                        self.check_linear(source, result, verts, offsets, uvs, uv, 1e-5)

    def test_splits_of_edges_that_flips_made(self):
        # Thin cylinders, where such a split can be near the seam on both sides: its side is found by walking.
        for shape, options in (((3, 20, 1, 0.05), {}), ((4, 12, 1, 0.05), {}), ((4, 20, 1, 0.05), {"max_normal_turn": 15}),
                               ((6, 12, 1, 0.05), {"max_normal_turn": 15}), ((8, 20, 1, 0.05), {"max_normal_turn": 15})):
            with self.subTest(shape=shape):
                points, quads, uvs, seam = cylinder(*shape)
                _, _, _, uv = self.carry("flip", points, quads.reshape(-1), np.arange(0, quads.size + 1, 4), uvs, seam, **options)
                e, g = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
                self.assertGreater((e[:, 0] * g[:, 1] - e[:, 1] * g[:, 0]).min(), -1e-6)

    def test_positions_follow_the_same_map(self):
        for mode in MODES:
            points, quads, uvs, seam = cylinder(24, 9, 0.9, 0.03)
            _, result, carried, _ = self.carry(mode, points, quads.reshape(-1), np.arange(0, quads.size + 1, 4), uvs, seam)
            np.testing.assert_allclose(carried.vert_values(points), result.positions, atol=1e-6)
            corners = carried.corner_values(points[quads.reshape(-1)])
            np.testing.assert_allclose(corners, result.positions[result.faces.reshape(-1)], atol=1e-6)

    def test_edges(self):
        points, quads, uvs, seam = cylinder(24, 9, 0.9, 0.03)
        edges = np.unique(np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1), axis=0)
        lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        is_seam = {tuple(sorted(e)) for e in seam.tolist()}
        marked = np.array([tuple(e) in is_seam for e in edges.tolist()])
        for mode in MODES:
            _, result, carried, _ = self.carry(mode, points, quads.reshape(-1), np.arange(0, quads.size + 1, 4), uvs, seam)
            which = carried.edge_source(edges)
            length = np.linalg.norm(np.diff(result.positions[result.edges].astype(float), axis=1)[:, 0], axis=1)
            pieces = np.bincount(which[which >= 0], length[which >= 0], len(edges))
            whole = marked if mode != "preserve" else np.ones(len(edges), bool)  # nothing of a marked edge is lost
            np.testing.assert_allclose(pieces[whole], lengths[whole], rtol=1e-5)


class Sides(Law, unittest.TestCase):
    """Each polygon has its own number at all its corners, so every edge is a seam: the result's corners must have the number of
    the polygon that their face came from, at splits too."""

    def check(self, mode, points, corner_verts, offsets, **options):
        sizes = np.diff(offsets)
        numbers = np.repeat(np.arange(len(sizes)), sizes).astype(np.float32)
        values = np.stack([numbers, -numbers], axis=1)
        ends = [(c, c + 1 if c + 1 < e else b) for b, e in zip(offsets[:-1], offsets[1:]) for c in range(b, e)]
        edges = np.unique(np.sort(np.asarray(corner_verts)[np.array(ends)], axis=1), axis=0)
        _, result, _, uv = self.carry(mode, points, corner_verts, offsets, values, edges, **options)
        expected = np.repeat(result.face_source, 3).reshape(-1, 3)
        np.testing.assert_array_equal(uv[..., 0], expected)
        np.testing.assert_array_equal(uv[..., 1], -expected)
        return result

    def test_sheet(self):
        for mode in MODES:
            points, faces = grid(12, 12)
            result = self.check(mode, points, faces.reshape(-1), np.arange(0, faces.size + 1, 3))
            self.assertGreater(len(result.faces), len(faces))

    def test_quads_and_a_ring_of_three(self):
        for mode in MODES:
            points, quads, _, _ = cylinder(3, 4, 3, 0.05)
            self.check(mode, points, quads.reshape(-1), np.arange(0, quads.size + 1, 4))

    def test_sheets_that_meet_in_one_edge(self):
        # A fan of five sheets, each two triangles deep, on one long edge: cut open by the import.
        angle = np.arange(5) * 2 * np.pi / 5
        points = [[0, 0, 0], [0, 0, 6]] + [[np.cos(t), np.sin(t), z] for t in angle for z in (2.2, 4.1)]
        faces = [[0, 1, 2 + 2 * i + 1] for i in range(5)] + [[0, 2 + 2 * i + 1, 2 + 2 * i] for i in range(5)]
        for mode in MODES:
            result = self.check(mode, points, np.array(faces).reshape(-1), np.arange(0, 31, 3))
            self.assertGreater(result.info.vertices, len(points))
            self.assertEqual(len(np.unique(result.face_source)), 10)

    def test_cones_that_meet_in_one_vertex(self):
        # No seam at all: which cone a corner at the common tip belongs to is only told by how the faces hang together.
        for mode in MODES:
            points, faces = [[0, 0, 0]], []
            for side in (1, -1):
                first = len(points)
                for ring in range(1, 5):
                    angle = np.arange(9) * 2 * np.pi / 9 + 1.1 * ring
                    points += [[side * ring * 0.5, ring * np.cos(t), ring * np.sin(t)] for t in side * angle]
                faces += [[0, first + i, first + (i + 1) % 9] for i in range(9)]
                for ring in range(3):
                    a, b = first + 9 * ring, first + 9 * ring + 9
                    for i in range(9):
                        j = (i + 1) % 9
                        faces += [[a + i, b + i, b + j], [a + i, b + j, a + j]]
            faces = np.array(faces)
            component = np.repeat([1, 2], len(faces) // 2)
            values = np.repeat(component, 3).astype(np.float32)[:, None] * [1, 1]
            offsets = np.arange(0, faces.size + 1, 3)
            source, result, _, uv = self.carry(mode, points, faces.reshape(-1), offsets, values, None)
            self.check_labels_do_not_matter(source, result, faces.reshape(-1), offsets, values, uv)
            self.assertEqual(result.info.components, 2)
            np.testing.assert_array_equal(uv[..., 0], np.repeat(component[result.face_source], 3).reshape(-1, 3))

    def test_faces_turned_over_by_the_import(self):
        points, faces = grid(6, 6)
        faces[::7] = faces[::7, ::-1]
        for mode in MODES:
            self.check(mode, points, faces.reshape(-1), np.arange(0, faces.size + 1, 3))

    def test_polygons_of_all_sizes(self):
        # A disc of rings: triangles, quads and a 12-gon.
        t = np.arange(12) * 2 * np.pi / 12
        points = [[r * np.cos(a), r * np.sin(a), 0.3 * r * np.sin(3 * a)] for r in (1, 2.5) for a in t]
        polygons = [list(range(12))] + [[i, 12 + i, 12 + (i + 1) % 12, (i + 1) % 12] for i in range(11)]
        polygons += [[11, 23, 12], [11, 12, 0]]
        offsets = np.cumsum([0] + [len(p) for p in polygons])
        for mode in MODES:
            self.check(mode, points, np.concatenate(polygons), offsets)


class Values(unittest.TestCase):
    def test_kinds(self):
        points, faces = grid(12, 12)
        source = delmesh.Mesh(points, faces)
        result, report = delmesh.remesh(source)
        carried = delmesh.SurfaceMap(source, result)
        count = len(points)
        numbers = np.arange(count, dtype=np.int32)
        np.testing.assert_array_equal(carried.vert_values(numbers)[:count], numbers)
        # Integers and booleans are not blended: a split vertex has the value of the nearest of its sources.
        verts, weights = result.vert_map
        np.testing.assert_array_equal(carried.vert_values(numbers),
                                      verts[np.arange(len(verts)), weights.argmax(axis=1)])
        self.assertEqual(carried.vert_values(numbers > 3).dtype, bool)
        values = points.astype(np.float32)
        values[0] = [np.nan, np.inf, -0.0]
        moved = carried.vert_values(values)
        np.testing.assert_array_equal(moved[:count].view(np.uint32), values.view(np.uint32))
        self.assertEqual(moved.dtype, np.float32)
        np.testing.assert_array_equal(carried.face_values(np.arange(len(faces))), result.face_source)
        self.assertGreater(report.splits, 0)

    def test_other_polygons_are_refused(self):
        points, faces = grid(4, 4)
        mesh = delmesh.Mesh(points, faces)
        with self.assertRaises(ValueError):
            delmesh.SurfaceMap(mesh, mesh, faces.reshape(-1)[::-1].copy())


class RealMeshes(Law, unittest.TestCase):
    """Textured models: the seams are those of their makers."""

    def test_uv_law(self):
        names = ("blub_triangulated.obj", "spot_control_mesh.obj", "spot_subdiv.obj.gz")
        paths = [path for path in (SHARED / "data" / "clean" / name for name in names) if path.is_file()]
        if not paths:
            self.skipTest(f"no meshes in {SHARED}/data")
        for path in paths:
            points, verts, offsets, uvs = read_obj(path)
            seams = uv_seams(verts, offsets, uvs)
            self.assertGreater(len(seams), 10)
            for mode in MODES:
                with self.subTest(path.name, mode=mode):
                    # No flips between faces that are only nearly coplanar: they would not be inside one triangle any more.
                    source, result, carried, uv = self.carry(mode, points, verts, offsets, uvs, seams, tolerance=0)
                    self.check_source_vertices(result, verts, uvs, uv)
                    if mode == "preserve":
                        self.check_linear(source, result, verts, offsets, uvs, uv, 1e-5)


if __name__ == "__main__":
    support.main()
