# SPDX-License-Identifier: Apache-2.0
"""Arrays in and out: bit for bit, whatever their layout, and refused with a sentence where they make no sense."""
import gc
import unittest

import support
from support import grid, np

import delmesh
from delmesh import _arrays

# A tetrahedron and one vertex that no face uses; counter-clockwise seen from outside.
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [5, 5, 5]], float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


class Input(unittest.TestCase):
    def assert_same(self, positions, faces):
        mesh = delmesh.Mesh(positions, faces)
        np.testing.assert_array_equal(mesh.positions, POINTS)
        np.testing.assert_array_equal(mesh.faces, FACES)
        return mesh

    def test_layouts_of_positions(self):
        wide = np.full((5, 8), 99.0)
        wide[:, 2:5] = POINTS
        for dtype in (np.float32, np.float64):
            points = POINTS.astype(dtype)
            padded = np.zeros(5, [("co", dtype, 3), ("flag", np.int8), ("pad", np.int8, 7)])
            padded["co"] = points
            layouts = {"plain": points, "slice": wide.astype(dtype)[:, 2:5], "every second": np.repeat(points, 2, axis=0)[::2],
                       "backwards": points[::-1].copy()[::-1], "by columns": np.asfortranarray(points),
                       "in a record": padded["co"], "big-endian": points.astype(points.dtype.newbyteorder(">")),
                       "list": points.tolist()}
            for name, layout in layouts.items():
                with self.subTest(name, dtype=dtype):
                    mesh = self.assert_same(layout, FACES)
                    if name != "list":
                        self.assertEqual(mesh.positions.dtype, dtype)
        self.assertEqual(self.assert_same(POINTS.astype(np.float16), FACES).positions.dtype, np.float32)
        self.assertEqual(self.assert_same(POINTS.astype(int), FACES).positions.dtype, np.float64)

    def test_views_copy_nothing_that_lies_right(self):
        wide = np.zeros((7, 5))
        pairs = np.arange(8).reshape(4, 2)
        for array, components in ((wide[:, 1:4], 3), (wide[::2, :3], 3), (np.arange(12)[::3], 1), (pairs, 2)):
            view, kept = _arrays.view(array, "x", components, floating=True)
            if array.dtype.kind == "f":
                self.assertIs(kept, array)
            view, kept = _arrays.view(array.astype(np.int32)[::2], "x", components)
            self.assertEqual((view.data, view.stride, view.count), (kept.ctypes.data, kept.strides[0], len(kept)))
        view, kept = _arrays.view(np.broadcast_to(np.zeros(3), (4, 3)), "x", 3, floating=True)
        self.assertEqual(view.stride, 24)  # a stride of 0 would mean "packed"

    def test_types_of_indices(self):
        for dtype in (np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64, ">i4"):
            self.assert_same(POINTS, FACES.astype(dtype))
        self.assert_same(POINTS, FACES[:, ::-1].copy()[:, ::-1])
        self.assert_same(POINTS, FACES.tolist())

    def test_polygons_given_in_three_ways(self):
        quads = np.array([[0, 1, 2, 3], [3, 2, 4, 5]])
        points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 2, 0], [0, 2, 0]]
        meshes = [delmesh.Mesh(points, quads), delmesh.Mesh(points, corner_verts=quads.reshape(-1), face_sizes=[4, 4]),
                  delmesh.Mesh(points, corner_verts=quads.reshape(-1), face_offsets=[0, 4, 8])]
        for mesh in meshes:
            np.testing.assert_array_equal(mesh.faces, meshes[0].faces)
            np.testing.assert_array_equal(mesh.face_source, [0, 0, 1, 1])
            self.assertEqual((mesh.info.polygons, mesh.info.faces, mesh.info.boundary_edges), (2, 4, 6))

    def test_nothing_at_all(self):
        for faces in ([], np.empty((0, 3), np.int32), np.empty((0, 4), np.int64)):
            mesh = delmesh.Mesh(np.empty((0, 3)), faces)
            self.assertEqual((mesh.info.vertices, mesh.info.faces), (0, 0))
            self.assertEqual((mesh.positions.shape, mesh.faces.shape, mesh.edges.shape), ((0, 3), (0, 3), (0, 2)))
            with self.assertRaises(delmesh.NoSurface):
                delmesh.remesh(mesh)

    def test_refusals_name_the_argument(self):
        cases = [
            (delmesh.InvalidArgument, "'positions' had the shape", lambda: delmesh.Mesh(np.zeros((4, 2)), FACES)),
            (delmesh.InvalidArgument, "'positions' had the type complex128", lambda: delmesh.Mesh(POINTS.astype(complex), FACES)),
            (delmesh.InvalidArgument, "'faces' had the type float64", lambda: delmesh.Mesh(POINTS, FACES.astype(float))),
            (delmesh.InvalidArgument, "'faces' had the type bool", lambda: delmesh.Mesh(POINTS, FACES > 1)),
            (delmesh.InvalidArgument, "'faces' had the shape", lambda: delmesh.Mesh(POINTS, FACES[:, :2])),
            (delmesh.InvalidArgument, "'faces' held an index of 2\\^63",
             lambda: delmesh.Mesh(POINTS, FACES.astype(np.uint64) + np.uint64(2**63))),
            (delmesh.InvalidArgument, "Exactly one of 'faces'", lambda: delmesh.Mesh(POINTS)),
            (delmesh.InvalidArgument, "'marked_edges' had the shape", lambda: delmesh.Mesh(POINTS, FACES, marked_edges=[0, 1])),
            (delmesh.InvalidArgument, "'weld' was 'maybe'", lambda: delmesh.Mesh(POINTS, FACES, weld="maybe")),
            (delmesh.IndexOutOfRange, "5", lambda: delmesh.Mesh(POINTS, FACES + 2)),
            (delmesh.IndexOutOfRange, "-1", lambda: delmesh.Mesh(POINTS, FACES - 1)),
        ]
        for error, sentence, call in cases:
            with self.subTest(sentence), self.assertRaisesRegex(error, sentence):
                call()
        # The same errors as what Python programs expect.
        self.assertTrue(issubclass(delmesh.InvalidArgument, ValueError) and issubclass(delmesh.IndexOutOfRange, IndexError))
        self.assertTrue(issubclass(delmesh.MemoryLimit, MemoryError))

    def test_repairs_are_counted_or_refused(self):
        faces = np.vstack([FACES, FACES[:1], [[3, 3, 1]]])  # a second copy, and a vertex twice
        mesh = self.assert_same(POINTS, faces)
        self.assertEqual((mesh.info.duplicate_faces, mesh.info.degenerate_faces, mesh.info.isolated_vertices), (1, 1, 1))
        with self.assertRaises(delmesh.RepairRefused):
            delmesh.Mesh(POINTS, faces, strict=True)
        nan = POINTS.copy()
        nan[3, 1] = np.nan
        self.assertEqual(delmesh.Mesh(nan, FACES).info.non_finite_faces, 3)
        turned = FACES.copy()
        turned[2] = turned[2, ::-1]
        self.assertEqual(delmesh.Mesh(POINTS, turned).info.reoriented_faces, 1)
        self.assertEqual(delmesh.Mesh(POINTS, FACES, marked_edges=[[1, 2], [0, 4]]).info.unmatched_marked_edges, 1)

    def test_weld(self):
        soup, corners = POINTS[FACES].reshape(-1, 3), np.arange(12).reshape(-1, 3)
        self.assertEqual(delmesh.Mesh(soup, corners).info.components, 4)
        for weld in (True, "exact"):
            mesh = delmesh.Mesh(soup, corners, weld=weld)
            self.assertEqual((mesh.info.components, mesh.info.welded_vertices, mesh.info.euler_characteristic), (1, 8, 2))

    def test_one_sided(self):
        n = 7
        band = [[i, (i + 1) % n, n + i] for i in range(n - 1)] + [[i + 1, n + i + 1, n + i] for i in range(n - 1)]
        band += [[n - 1, n, 2 * n - 1], [n, 0, 2 * n - 1]]
        points = np.random.default_rng(0).uniform(size=(2 * n, 3))
        with self.assertRaises(delmesh.NonOrientable):
            delmesh.Mesh(points, band)

    def test_cutting_is_undone_by_vert_join(self):
        points = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0]]
        mesh = delmesh.Mesh(points, [[0, 1, 2], [0, 1, 3], [0, 1, 4]])  # three faces on one edge
        self.assertEqual(mesh.info.nonmanifold_edges, 1)
        self.assertGreater(mesh.info.copied_vertices, 0)
        np.testing.assert_array_equal(mesh.positions[mesh.vert_join], mesh.positions)
        self.assertEqual(sorted(map(tuple, np.sort(mesh.vert_join[mesh.faces], axis=1))), [(0, 1, 2), (0, 1, 3), (0, 1, 4)])
        np.testing.assert_array_equal(mesh.vert_source, mesh.vert_join)


class Output(unittest.TestCase):
    def test_every_bit_comes_back(self):
        random = np.random.default_rng(3)
        for dtype, bits in ((np.float32, np.uint32), (np.float64, np.uint64)):
            points = grid(20, 20, dtype=dtype)[0]
            values = random.integers(0, np.iinfo(bits).max, points.size, dtype=bits).view(dtype).reshape(points.shape)
            faces = grid(20, 20)[1]
            mesh = delmesh.Mesh(values, faces)
            np.testing.assert_array_equal(mesh.positions.view(bits), values.view(bits))
        tiny = np.array([[-0.0, 5e-324, 1e308], [2.0, -5e-324, 0], [3, 4, 5]])
        np.testing.assert_array_equal(delmesh.Mesh(tiny, [[0, 1, 2]]).positions.view(np.int64), tiny.view(np.int64))

    def test_arrays_fit_together(self):
        points, faces = grid(9, 7)
        mesh = delmesh.Mesh(points, faces, marked_edges=faces[:5, :2])
        ends = np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=-1)
        np.testing.assert_array_equal(np.sort(mesh.edges[mesh.corner_edges], axis=2), np.sort(ends, axis=2))
        twins = mesh.corner_twins.reshape(-1)
        inner = twins >= 0
        np.testing.assert_array_equal(twins[twins[inner]], np.flatnonzero(inner))
        boundary = (mesh.edge_flags & delmesh.EDGE_BOUNDARY) != 0
        self.assertEqual(boundary.sum(), (~inner).sum())
        marked = (mesh.edge_flags & delmesh.EDGE_MARKED) != 0
        self.assertEqual(marked.sum(), len({frozenset(e) for e in faces[:5, :2].tolist()}))
        verts, weights = mesh.vert_map
        np.testing.assert_array_equal(verts, np.repeat(np.arange(len(points))[:, None], 3, axis=1))
        np.testing.assert_array_equal(weights, np.tile([1.0, 0, 0], (len(points), 1)))
        self.assertEqual(mesh.info.vertices - mesh.info.edges + mesh.info.faces, mesh.info.euler_characteristic)
        mesh.validate()

    def test_read_into_the_caller_s_memory(self):
        mesh = delmesh.Mesh(POINTS.astype(np.float32), FACES)
        rows = np.full((5, 6), 7.0)
        self.assertIs(mesh.read("positions", rows[:, 1:4]).base, rows)
        np.testing.assert_array_equal(rows[:, 1:4], POINTS)
        self.assertTrue((rows[:, [0, 4, 5]] == 7).all())
        for dtype in (np.int32, np.int64, np.uint32):
            np.testing.assert_array_equal(mesh.read("faces", np.zeros((4, 3), dtype)), FACES)
        np.testing.assert_array_equal(mesh.read("edge_flags", np.ones(12, np.uint8)[::2]), [0] * 6)
        frozen = np.zeros((4, 3), np.int32)
        frozen.flags.writeable = False
        for out in (frozen, np.zeros((4, 3), np.int16), np.zeros((4, 6), np.int32)[:, ::2], np.zeros((5, 3), np.int32),
                    np.zeros((4, 2), np.int32), np.zeros((4, 3), np.float32), FACES.tolist()):
            with self.assertRaises(delmesh.InvalidArgument):
                mesh.read("faces", out)
        with self.assertRaisesRegex(delmesh.InvalidArgument, "'out' had 5 elements and 'faces' has 4"):
            mesh.read("faces", np.zeros((5, 3), np.int32))
        with self.assertRaisesRegex(delmesh.InvalidArgument, "'name' was 'colour', which is not one of positions, faces"):
            mesh.read("colour", np.zeros(4))
        with self.assertRaises(delmesh.TooLarge):  # -1 in an unsigned array
            delmesh.Mesh(POINTS[:3], [[0, 1, 2]]).read("corner_twins", np.zeros((1, 3), np.uint32))

    def test_arrays_are_read_only_and_keep_their_memory(self):
        points, faces = grid(30, 30)
        mesh = delmesh.Mesh(points, faces)
        arrays = [mesh.positions, mesh.faces, mesh.edges, mesh.corner_edges]
        copies = [array.copy() for array in arrays]
        with self.assertRaises(ValueError):
            arrays[0][0, 0] = 1
        view = arrays[0][5:7, 1]
        expected = copies[0][5:7, 1]
        del mesh
        gc.collect()
        for _ in range(20):  # memory that was given back would be used again by now
            delmesh.Mesh(points + 1, faces).edges
        for array, copy in zip(arrays, copies):
            np.testing.assert_array_equal(array, copy)
        del arrays
        gc.collect()
        np.testing.assert_array_equal(view, expected)


if __name__ == "__main__":
    support.main()
