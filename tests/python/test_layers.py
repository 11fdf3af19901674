# SPDX-License-Identifier: Apache-2.0
"""Layers: in as a dict of arrays, out under the same names on the elements of the result; borders, marks, maps, refusals."""
import unittest

import support
from support import SHARED, cylinder, grid, np, read_obj

import delmesh
from delmesh import Layer

OPERATIONS = {"preserve": lambda *mesh, **more: [delmesh.remesh(*mesh, mode="preserve", **more).mesh],
              "flip": lambda *mesh, **more: [delmesh.remesh(*mesh, mode="flip", **more).mesh],
              "feature": lambda *mesh, **more: [delmesh.remesh(*mesh, mode="feature", **more).mesh],
              "decimate": lambda *mesh, **more: [delmesh.decimate(*mesh, ratio=0.3, **more).mesh],
              "family": lambda *mesh, **more: delmesh.lod_family(*mesh, ratios=[0.5, 0.1], **more).levels}


def edges_of(faces):
    return np.unique(np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1), axis=0)


def blended(values, index, weights):
    return (values[index].astype(float) * weights.reshape(*weights.shape, *[1] * (values.ndim - 1))).sum(axis=1)


def nearest(values, index, weights):
    return values[index[np.arange(len(index)), weights.argmax(axis=1)]]


class Carrying(unittest.TestCase):
    """What numpy gathers through the maps is what the layers say."""

    def setUp(self):
        random = np.random.default_rng(7)
        self.points, self.quads, self.uvs, self.seam = cylinder(24, 9, 0.9, 0.03)
        self.edges = edges_of(self.quads)
        v, c, f, e = len(self.points), self.quads.size, len(self.quads), len(self.edges)
        normals = random.normal(size=(c, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        self.layers = {"uv": self.uvs, "UVMap.001": random.random((c, 2)), "normals": normals.astype(np.float32),
                       "Colour": random.integers(0, 256, (c, 4), np.uint8), "anything": random.random((c, 2, 3)),
                       "rest position": self.points, "material": np.arange(f) % 3, "face_set": np.arange(f, dtype=np.uint8) // 30,
                       "face colour": random.random((f, 3)), "names": np.arange(v), "selected": np.arange(f) % 2 == 0,
                       "bevel": random.random(e).astype(np.float32), "group": Layer(np.arange(c, dtype=np.int16), policy="linear"),
                       "half": random.random(v).astype(np.float16), "big": np.arange(v, dtype=np.uint64) + np.uint64(2**63),
                       "swapped": random.random(v).astype(">f4"), "weights": Layer(random.random((v, 3)), policy="weights")}

    def check(self, mesh, layers):
        corners, corner_weights = (array.reshape(-1, 3) for array in mesh.corner_map)
        np.testing.assert_allclose(corner_weights.sum(axis=1), 1, atol=1e-14)
        self.assertEqual(list(mesh.layers), list(layers))
        counts = {"vertex": mesh.info.vertices, "corner": mesh.info.corners, "face": mesh.info.faces, "edge": mesh.info.edges}
        domains = {len(self.points): "vertex", self.quads.size: "corner", len(self.quads): "face", len(self.edges): "edge"}
        for name, given in layers.items():
            with self.subTest(name):
                values = given.values if isinstance(given, Layer) else given
                out, domain = mesh.layers[name], domains[len(values)]
                self.assertEqual((out.dtype, out.shape), (values.dtype, (counts[domain], *values.shape[1:])))
                if domain == "face":
                    np.testing.assert_array_equal(out, values[mesh.face_source])
                    continue
                if domain == "edge":
                    which = mesh.edge_source
                    np.testing.assert_array_equal(out, np.where(which >= 0, values[which], 0))
                    continue
                index, weights = (corners, corner_weights) if domain == "corner" else mesh.vert_map
                if name in ("names", "big"):
                    np.testing.assert_array_equal(out, nearest(values, index, weights))
                    continue
                expected = blended(values, index, weights)
                if name in ("normals", "weights"):
                    one = np.linalg.norm(expected, axis=1) if name == "normals" else expected.sum(axis=1)
                    expected /= one[:, None]
                tolerance = {"i": 0.5, "u": 0.5}.get(values.dtype.kind, 1e-6 if values.dtype.itemsize > 2 else 1e-3)
                np.testing.assert_allclose(out.astype(float), expected, atol=tolerance * 1.0001)

    def test_every_operation(self):
        for name, run in OPERATIONS.items():
            with self.subTest(name):
                for mesh in run(self.points, self.quads, layers=self.layers, edges=self.edges):
                    self.assertTrue(delmesh.certify(mesh).delaunay)
                    self.check(mesh, self.layers)

    def test_the_mesh_itself(self):
        mesh = delmesh.Mesh(self.points, self.quads, layers=self.layers, edges=self.edges)
        self.check(mesh, self.layers)
        corners, weights = mesh.corner_map
        np.testing.assert_array_equal(weights, np.broadcast_to([1, 0, 0], weights.shape))
        np.testing.assert_array_equal(self.quads.reshape(-1)[corners[..., 0]], mesh.faces)
        np.testing.assert_array_equal(corners[..., 0] // 4, np.repeat(mesh.face_source, 3).reshape(-1, 3))

    def test_positions_follow_the_same_map(self):
        at_corners = self.points[self.quads.reshape(-1)]
        for mode in ("preserve", "flip", "feature"):
            r = delmesh.remesh(self.points, self.quads, mode=mode, layers={"uv": self.uvs, "place": at_corners})
            np.testing.assert_allclose(r.layers["place"], r.vertices[r.faces.reshape(-1)], atol=1e-6)

    def test_textures_stay_on_their_side(self):
        for name, run in OPERATIONS.items():
            for mesh in run(self.points, self.quads, layers={"uv": self.uvs}):
                uv = mesh.layers["uv"].reshape(-1, 3, 2)
                u = uv[..., 0]
                self.assertLess((u.max(axis=1) - u.min(axis=1)).max(), 0.5 if name != "family" else 0.75, name)
                seam = (mesh.edge_flags & delmesh.EDGE_UV) != 0
                length = np.linalg.norm(np.diff(mesh.positions[mesh.edges[seam]].astype(float), axis=1), axis=2).sum()
                self.assertGreater(length, 3)  # from end to end
                if name in ("preserve", "flip", "feature"):
                    ends = self.points[self.seam].astype(float)
                    self.assertAlmostEqual(length, np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum(), places=5)

    def test_one_operation_after_the_other(self):
        first = delmesh.remesh(self.points, self.quads, mode="flip", layers=self.layers, edges=self.edges)
        second = delmesh.decimate(first, ratio=0.5)
        self.assertEqual(list(second.layers), list(self.layers))
        corners, weights = (array.reshape(-1, 3) for array in second.corner_map)
        np.testing.assert_allclose(second.layers["uv"], blended(first.layers["uv"], corners, weights), atol=1e-6)
        self.assertTrue((second.mesh.edge_flags & delmesh.EDGE_UV).any())
        np.testing.assert_array_equal(second.layers["material"], first.layers["material"][second.mesh.face_source])

    def test_values_by_face_come_out_by_face(self):
        by_face = self.uvs.reshape(*self.quads.shape, 2)
        flat = delmesh.remesh(self.points, self.quads, layers={"uv": self.uvs}).layers["uv"]
        r = delmesh.remesh(self.points, self.quads, layers={"uv": by_face, "id": Layer(self.quads, domain="corner")})
        self.assertEqual((r.layers["uv"].shape, r.layers["id"].shape), ((*r.faces.shape, 2), r.faces.shape))
        np.testing.assert_array_equal(r.layers["uv"].reshape(-1, 2), flat)
        again = delmesh.remesh(r, mode="flip")
        self.assertEqual(again.layers["uv"].shape, (*again.faces.shape, 2))
        rows = delmesh.remesh(self.points, self.quads, layers={"rows": self.quads}).layers["rows"]  # four numbers per face
        self.assertEqual(rows.shape[1:], (4,))

    def test_layouts(self):
        expected = delmesh.remesh(self.points, self.quads, layers={"uv": self.uvs}).layers["uv"]
        wide = np.full((len(self.uvs), 7), np.nan, np.float32)
        wide[:, 3:5] = self.uvs
        record = np.zeros(len(self.uvs), [("uv", np.float32, 2), ("pad", np.int8, 3)])
        record["uv"] = self.uvs
        locked = self.uvs.copy()
        locked.flags.writeable = False
        layouts = {"slice": wide[:, 3:5], "every second": np.repeat(self.uvs, 2, axis=0)[::2],
                   "backwards": self.uvs[::-1].copy()[::-1],
                   "by columns": np.asfortranarray(self.uvs), "unaligned": record["uv"], "read-only": locked,
                   "swapped": self.uvs.astype(">f4"), "three times": np.stack([self.uvs] * 3, axis=1)[:, 1]}
        for name, layout in layouts.items():
            with self.subTest(name):
                before = layout.tobytes()
                out = delmesh.remesh(self.points, self.quads, layers={"uv": layout}).layers["uv"]
                np.testing.assert_array_equal(out, expected)
                self.assertEqual(out.dtype, layout.dtype)
                self.assertEqual(layout.tobytes(), before)
        same = np.broadcast_to(np.float32(3), (len(self.points), 2))
        self.assertTrue((delmesh.remesh(self.points, self.quads, layers={"same": same}).layers["same"] == 3).all())
        listed = delmesh.remesh(self.points, self.quads, layers={"uv": self.uvs.tolist()}).layers["uv"]
        np.testing.assert_allclose(listed, expected, atol=1e-7)

    def test_arrays_may_change_afterwards(self):
        uvs, points = self.uvs.copy(), self.points.copy()
        mesh = delmesh.Mesh(points, self.quads, layers={"uv": uvs})
        result = delmesh.remesh(points, self.quads, layers={"uv": uvs})
        expected = result.layers["uv"].copy()
        uvs[:] = np.nan
        np.testing.assert_array_equal(result.layers["uv"], expected)
        np.testing.assert_array_equal(delmesh.remesh(mesh).layers["uv"], expected)

    def test_mixed_polygons(self):
        points = [[0, 0, 0], [2, 0, 0], [2, 1, 0.5], [0, 1, 0], [3, 0.5, 1]]
        verts, sizes, uv = [0, 1, 2, 3, 1, 4, 2], [4, 3], np.arange(14.0).reshape(7, 2)
        for more in ({"face_sizes": sizes}, {"face_offsets": [0, 4, 7]}):
            r = delmesh.remesh(delmesh.Mesh(points, corner_verts=verts, layers={"uv": uv, "material": np.array([5, 9])}, **more))
            corners, weights = (array.reshape(-1, 3) for array in r.corner_map)
            np.testing.assert_allclose(r.layers["uv"], blended(uv, corners, weights))
            np.testing.assert_array_equal(corners.max(axis=1) >= 4, np.repeat(r.mesh.face_source, 3) == 1)
            np.testing.assert_array_equal(r.layers["material"], np.array([5, 9])[r.mesh.face_source])

    def test_transfer_of_what_comes_later(self):
        r = delmesh.remesh(self.points, self.quads, layers={"uv": self.uvs})
        np.testing.assert_array_equal(r.mesh.transfer(self.uvs, domain="corner"), r.layers["uv"])
        numbers = np.arange(len(self.points))
        np.testing.assert_array_equal(r.mesh.transfer(numbers, domain="vertex", policy="nearest"),
                                      nearest(numbers, *r.mesh.vert_map))
        for arguments, sentence in (({"domain": "loop"}, "'domain' was 'loop', which is not one of vertex, corner, face, edge"),
                                    ({"domain": "face", "policy": "mean"},
                                     "'policy' was 'mean', which is not one of linear, nearest"),
                                    ({"domain": "face"}, "had 864 elements, and there were 216 source faces")):
            with self.assertRaisesRegex(delmesh.InvalidArgument, sentence):
                r.mesh.transfer(self.uvs, **arguments)
        with self.assertRaisesRegex(delmesh.InvalidArgument, "2\\^63 or more"):
            r.mesh.transfer(np.full(len(self.points), 2**64 - 1, np.uint64), domain="vertex")

    def test_fit(self):
        grid = np.arange(21.0)
        x, y = (each.ravel() for each in np.meshgrid(grid, grid))
        points = np.stack([x, y, 0 * x], axis=1)
        first = (np.arange(20)[:, None] * 21 + np.arange(20)).reshape(-1, 1)
        faces = first + np.array([0, 1, 22, 21])
        values = np.stack([np.sin(x / 4), np.cos(y / 5)], axis=1)
        source = delmesh.Mesh(points, faces)

        def error(r, at_corners):
            w = np.array([(1 - i / 6 - j / 6, i / 6, j / 6) for i in range(1, 6) for j in range(1, 6 - i)])
            at = np.einsum("nk,fkd->fnd", w, r.vertices[r.faces].astype(float))
            off = np.einsum("nk,fkd->fnd", w, at_corners) - np.stack([np.sin(at[..., 0] / 4), np.cos(at[..., 1] / 5)], axis=-1)
            a, b, c = np.swapaxes(r.vertices[r.faces].astype(float), 0, 1)
            return (np.cross(b - a, c - a)[:, 2] * (off**2).sum(axis=(1, 2))).sum()

        layers = {"plain": Layer(values, weight=1), "at vertices": Layer(values, fit=True), "at corners": Layer(values[faces], fit=True)}
        r = delmesh.decimate(source.vertices, faces, ratio=0.1, layers=layers)
        plain = error(r, r.layers["plain"][r.faces])
        self.assertLess(error(r, r.layers["at vertices"][r.faces]), 0.6 * plain)
        np.testing.assert_allclose(r.layers["at corners"], r.layers["at vertices"][r.faces], atol=1e-12)
        again = r.mesh.transfer(values, domain="vertex", fit=delmesh.Mesh(points, faces))
        np.testing.assert_array_equal(again, r.layers["at vertices"])
        with self.assertRaisesRegex(delmesh.InvalidArgument, "had no map of its corners"):
            delmesh.decimate(points, faces, ratio=0.1, layers={"v": Layer(values, fit=True)}, map=False)
        with self.assertRaisesRegex(delmesh.InvalidArgument, "only DELMESH_TRANSFER_LINEAR and _DIRECTION can fit"):
            delmesh.decimate(points, faces, ratio=0.1, layers={"id": Layer(np.arange(len(x)), domain="vertex", fit=True)})
        with self.assertRaisesRegex(delmesh.InvalidArgument, "'domain' was 2, outside 0 to 1"):
            r.mesh.transfer(np.ones(len(faces)), domain="face", fit=source)

    def test_nothing_at_all(self):
        mesh = delmesh.Mesh(np.empty((0, 3)), [], layers={"uv": Layer(np.empty((0, 2)), domain="corner")})
        self.assertEqual(mesh.layers["uv"].shape, (0, 2))
        r = delmesh.remesh(self.points, self.quads, layers={})
        self.assertEqual(dict(r.layers), {})
        with self.assertRaises(TypeError):
            r.layers["new"] = self.uvs  # a view of what is there
        r = delmesh.remesh(self.points, self.quads, layers={"p": self.points})
        for mesh in (r.mesh, delmesh.Mesh(self.points, self.quads, layers={"p": self.points})):
            with self.assertRaises(ValueError):  # nor are they changed under a mesh that hands them on
                mesh.layers["p"][0] = 1


class Kinds(unittest.TestCase):
    """Which borders are kept, by name and by word."""

    def setUp(self):
        self.points, self.quads, self.uvs, self.seam = cylinder(24, 9, 0.9, 0.03)
        self.halves = (np.arange(len(self.quads)) // 24 > 4).astype(np.int64)  # one ring of edges between them
        self.at_corners = np.repeat(self.halves, 4).astype(np.float32)

    def flags(self, layers, **options):
        """The bits of all edges of the result that are not those of every mesh."""
        r = delmesh.remesh(self.points, self.quads, mode="flip", layers=layers, **options)
        return int(np.bitwise_or.reduce(r.mesh.edge_flags)) & ~(delmesh.EDGE_SOURCE | delmesh.EDGE_BOUNDARY)

    def test_names(self):
        two = np.stack([self.at_corners] * 2, axis=1)
        for name, values, bit in (("uv", two, delmesh.EDGE_UV), ("UVMap", two, delmesh.EDGE_UV),
                                  ("texcoord0", two, delmesh.EDGE_UV),
                                  ("normal", two, 0), ("color", two, 0), ("Colour", two, 0), ("mask", two, 0),
                                  ("material_index", self.halves, delmesh.EDGE_MATERIAL),
                                  ("face_set", self.halves, delmesh.EDGE_FACE_SET),
                                  ("number", self.halves, 0), ("material", self.halves.astype(float), 0), ("my uv", two, 0)):
            self.assertEqual(self.flags({name: values}), bit, name)

    def test_a_name_does_not_change_values_that_cannot_be_meant(self):
        halves, heights = np.full(len(self.points), 0.5), self.points[:, 2].copy()
        layers = {"normal_strength": halves, "material_height": heights, "height": heights}
        carried = delmesh.remesh(self.points, self.quads, layers=layers).layers
        self.assertGreater(len(carried["height"]), len(heights))  # some are interpolated
        np.testing.assert_array_equal(carried["normal_strength"], 0.5)
        np.testing.assert_array_equal(carried["material_height"], carried["height"])

    def test_words(self):
        one, ids = self.at_corners, self.halves
        for layer, bit in ((Layer(one, kind="other"), delmesh.EDGE_LAYER), (Layer(one, border="keep"), delmesh.EDGE_LAYER),
                           (Layer(one, kind="other", border="free"), 0), (Layer(one, weight=1), delmesh.EDGE_LAYER),
                           (Layer(one, kind="normal", border="keep"), delmesh.EDGE_NORMAL), (Layer(one, kind="normal"), 0),
                           (Layer(one, kind="color", border="keep"), delmesh.EDGE_COLOR),
                           (Layer(ids, kind="material"), delmesh.EDGE_MATERIAL), (Layer(ids, kind="material", border="free"), 0),
                           (Layer(ids, border="keep"), delmesh.EDGE_FACE_SET),
                           (Layer(ids > 0, kind="face_set"), delmesh.EDGE_FACE_SET),
                           (Layer(one, border="keep", tolerance=0.9), delmesh.EDGE_LAYER),
                           (Layer(one, border="keep", tolerance=1), 0)):
            self.assertEqual(self.flags({"x": layer}), bit, layer)
        self.assertEqual(self.flags({"normals": Layer(one, border="keep")}), delmesh.EDGE_NORMAL)

    def test_borders_are_counted(self):
        mesh = delmesh.Mesh(self.points, self.quads, layers={"uv": self.uvs, "other": self.at_corners, "material": self.halves,
                                                             "colour": self.at_corners})
        self.assertEqual(mesh.layer_borders, {"uv": len(self.seam), "material": 24, "colour": 24})
        self.assertEqual(delmesh.remesh(mesh).mesh.layer_borders, {})

    def test_release(self):
        layers = {"uv": self.uvs, "material": self.halves}
        uv, material = delmesh.EDGE_UV, delmesh.EDGE_MATERIAL
        self.assertEqual(self.flags(layers), uv | material)
        points, faces = grid(12, 12)
        ids = np.arange(len(faces))
        flips = {}
        for release in ("material", ("uv",), ["uv", "material"], material, ()):
            r = delmesh.remesh(points, faces, mode="flip", layers={"material": ids, "uv": np.repeat(ids, 6).reshape(-1, 3, 2)},
                               release=release)
            flips[str(release)] = r.report.flips
        plain = delmesh.remesh(points, faces, mode="flip").report.flips
        self.assertGreater(plain, 0)
        self.assertEqual(flips, {"material": 0, "('uv',)": 0, "['uv', 'material']": plain, str(material): 0, "()": 0})
        one = delmesh.remesh(points, faces, mode="flip", layers={"material": ids}, release="material")
        self.assertEqual(one.report.flips, plain)
        for run in (lambda **more: delmesh.remesh(self.points, self.quads, **more),
                    lambda **more: delmesh.lod_family(self.points, self.quads, ratios=[0.5], **more)):
            with self.assertRaisesRegex(delmesh.InvalidArgument, "'release' was 'seams', which is not one of marked, sharp, seam"):
                run(release="seams")
            with self.assertRaisesRegex(delmesh.InvalidArgument, "release"):
                run(release=delmesh.EDGE_BOUNDARY)
        kept, free = (delmesh.decimate(points, faces, ratio=0.1, layers={"material": ids}, release=release)
                      for release in ((), "material"))
        self.assertLess(len(free.faces), len(kept.faces))

    def test_uvs_of_vertices_keep_the_texture_on_flat_places(self):
        points, faces = grid(6, 6, noise=0.3)
        points[:, 2] = 0
        bent = points[:, :2] ** 2
        free, kept = (delmesh.remesh(points, faces, layers={name: bent}) for name in ("mask", "uv"))
        self.assertGreater(free.report.flips, 0)
        self.assertLess(kept.report.flips, free.report.flips)
        loose = delmesh.remesh(points, faces, layers={"uv": Layer(bent, affine_tolerance=100)})
        np.testing.assert_array_equal(loose.faces, free.faces)

    def test_marks(self):
        edges = edges_of(self.quads)
        marks = np.zeros(len(edges), np.uint8)
        marks[::5], marks[1::5] = delmesh.EDGE_SHARP, delmesh.EDGE_SEAM | delmesh.EDGE_CREASE
        r = delmesh.remesh(self.points, self.quads, mode="flip", edges=edges, edge_marks=marks, map=True)
        which = r.edge_source
        own = r.mesh.edge_flags & (delmesh.EDGE_SHARP | delmesh.EDGE_SEAM | delmesh.EDGE_CREASE | delmesh.EDGE_MARKED)
        np.testing.assert_array_equal(own[which >= 0], marks[which[which >= 0]])
        self.assertFalse(own[which < 0].any())
        lengths = np.linalg.norm(np.diff(self.points[edges].astype(float), axis=1)[:, 0], axis=1)
        pieces = np.linalg.norm(np.diff(r.vertices[r.mesh.edges].astype(float), axis=1)[:, 0], axis=1)
        whole = np.bincount(which[which >= 0], pieces[which >= 0], len(edges))
        np.testing.assert_allclose(whole[marks > 0], lengths[marks > 0], rtol=1e-5)
        marked = delmesh.remesh(self.points, self.quads, mode="flip", edges=edges, edge_marks=marks > 0).mesh
        self.assertTrue((marked.edge_flags & delmesh.EDGE_MARKED).any())
        self.assertFalse((marked.edge_flags & delmesh.EDGE_SHARP).any())

    def test_map(self):
        plain = delmesh.remesh(self.points, self.quads)
        for name in ("corner_map", "edge_source"):
            with self.assertRaisesRegex(delmesh.InvalidArgument, f"'{name}.*' is not there: the mesh was made without map=True"):
                getattr(plain, name)
        mapped = delmesh.remesh(self.points, self.quads, map=True)
        self.assertEqual(mapped.corner_map[0].shape, (len(mapped.faces), 3, 3))
        out = np.empty((mapped.mesh.info.corners, 3), np.int64)
        np.testing.assert_array_equal(mapped.mesh.read("corner_map_corners", out).reshape(-1, 3, 3), mapped.corner_map[0])
        with self.assertRaisesRegex(delmesh.InvalidArgument, "'out' had 1 elements and 'corner_map_corners' has"):
            mapped.mesh.read("corner_map_corners", out[:1])
        vertices_only = delmesh.remesh(self.points, self.quads, layers={"p": self.points}, map=False)
        np.testing.assert_array_equal(vertices_only.layers["p"][:len(self.points)], self.points)
        with self.assertRaisesRegex(delmesh.InvalidArgument, "The option 'map' was off, and the layer 'uv' of corners needs it"):
            delmesh.remesh(self.points, self.quads, layers={"uv": self.uvs}, map=False)


class Refusals(unittest.TestCase):
    def setUp(self):
        self.points, self.quads, self.uvs, _ = cylinder(24, 9, 0.9, 0.03)

    def test_words(self):
        for arguments, sentence in (({"domain": "loop"},
                                     "The domain of a layer was 'loop', which is not one of vertex, corner, face, edge"),
                                    ({"kind": "texture"},
                                     "The kind of a layer was 'texture', which is not one of uv, normal, color"),
                                    ({"border": None}, "The border of a layer was None, which is not one of default, keep, free"),
                                    ({"policy": 1}, "The policy of a layer was 1, which is not one of linear, nearest, direction")):
            with self.assertRaisesRegex(delmesh.InvalidArgument, sentence):
                Layer(self.uvs, **arguments)

    def test_layers(self):
        uvs, ids, verts = self.uvs, np.arange(len(self.quads)), np.arange(len(self.points))
        for layers, sentence in (
                ({"x": uvs[1:]}, "The layer 'x' had 863 elements, and there were 240 vertices, 864 corners, 216 faces"),
                ({"x": Layer(uvs, domain="face")}, "The layer 'x' had 864 elements, and there were 216 faces"),
                ({"x": Layer(uvs, domain="edge")}, "The layer 'x' was of edges, and no 'edges' were given"),
                ({"x": np.array(["a"] * 864)}, "The layer 'x' had the type <U1, which is no real number that can be carried"),
                ({"x": uvs.astype(complex)}, "The layer 'x' had the type complex128"),
                ({"x": uvs.astype("datetime64[s]")}, "The layer 'x' had the type datetime64"),
                ({"x": 3.0}, r"The layer 'x' had the shape \(\) and not \(n, ...\)"),
                ({"x": np.empty((864, 0))}, r"The layer 'x' had the shape \(864, 0\)"),
                ({"x": Layer(ids, kind="uv")}, "The layer 'x' was of faces, and the kind 'uv' is of corners"),
                ({"x": Layer(uvs, kind="material")}, "The layer 'x' was of corners, and the kind 'material' is of faces"),
                ({"x": Layer(verts, border="keep")}, "The layer 'x' was of vertices, which have no borders to keep"),
                ({"x": Layer(ids * 0.5, kind="material")}, "The layer 'x' had the type float64 and the shape .*; borders of faces"),
                ({"x": Layer(ids, policy="direction")},
                 "The layer 'x' had the type int64, and the policy 'direction' is for floats"),
                ({"material": ids << 40}, "The layer 'material' held a number that is not in the range of int32"),
                ({"a": verts, "uv": uvs[:, :1]}, r"The view 'layers\[uv\].values' had 1 components; UV maps have 2 or 3"),
                ({"a": uvs, "x": Layer(uvs, kind="other", tolerance=-1)}, r"tolerance"),
                ({"x": Layer(uvs, weight=float("nan"))}, "weight"),
                ({"x": np.zeros((864, 300))}, "had 300 components, outside 1 to 256"),
                ({f"uv{i}": uvs for i in range(65)}, "layer_count")):
            for run in (delmesh.Mesh, delmesh.remesh, lambda *mesh, **more: delmesh.decimate(*mesh, ratio=0.5, **more)):
                if run is delmesh.Mesh and "components, outside" in sentence:
                    continue  # told when it is carried
                with self.subTest(sentence), self.assertRaisesRegex(delmesh.InvalidArgument, sentence):
                    run(self.points, self.quads, layers=layers)
        mesh = delmesh.Mesh(self.points, self.quads)
        for values, sentence in ((np.array(["a"] * 240), "The argument 'values' had the type <U1"),
                                 (verts * 1j, "The argument 'values' had the type complex128"),
                                 (verts.astype(np.longdouble), "The argument 'values' had the type"),
                                 (3.0, r"The argument 'values' had the shape \(\)"),
                                 (np.empty((240, 0)), r"The argument 'values' had the shape \(240, 0\)")):
            with self.subTest(sentence), self.assertRaisesRegex(delmesh.InvalidArgument, sentence):
                mesh.transfer(values, domain="vertex")
        for layers in ([uvs], {3: uvs}):
            with self.assertRaisesRegex(TypeError, "expected 'layers' as {name: array}"):
                delmesh.remesh(self.points, self.quads, layers=layers)

    def test_sizes_that_say_too_little(self):
        points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
        four = np.arange(4)
        with self.assertRaisesRegex(delmesh.InvalidArgument, "'x' had 4 elements, as many as there were vertices and faces: "
                                                             "say which"):
            delmesh.Mesh(points, faces, layers={"x": four})
        for layers, source in (({"x": Layer(four, domain="vertex")}, "vert_source"),
                               ({"x": Layer(four, domain="face")}, "face_source"),
                               ({"material": four}, "face_source"), ({"colour": four}, "vert_source"),
                               ({"x": Layer(four, kind="face_set")}, "face_source")):
            mesh = delmesh.Mesh(points, faces, layers=layers)
            np.testing.assert_array_equal(list(mesh.layers.values())[0], four[getattr(mesh, source)])

    def test_edges(self):
        edges = edges_of(self.quads)
        for more, error, sentence in (
                ({"edge_marks": [1]}, delmesh.InvalidArgument, "The view 'edge_marks' had 1 elements, and 'edge_verts' 0 edges"),
                ({"edges": edges, "edge_marks": [2]}, delmesh.InvalidArgument, "'edge_marks' had 1 elements"),
                ({"edges": edges, "edge_marks": np.ones(len(edges), int)}, delmesh.InvalidArgument, "mark"),
                ({"edges": edges[:, :1]}, delmesh.InvalidArgument, "'edge_verts' had the shape"),
                ({"edges": edges + 1000}, delmesh.IndexOutOfRange, "edge_verts")):
            with self.subTest(sentence), self.assertRaisesRegex(error, sentence):
                delmesh.remesh(self.points, self.quads, **more)

    def test_a_mesh_has_its_layers_already(self):
        mesh = delmesh.Mesh(self.points, self.quads)
        for given in (mesh, delmesh.remesh(mesh)):
            for more in ({"layers": {"uv": self.uvs}}, {"edges": [[0, 1]]}, {"edge_marks": [2]}):
                with self.assertRaisesRegex(delmesh.InvalidArgument, "a Mesh gets them when it is made"):
                    delmesh.remesh(given, **more)

    def test_indices_are_the_librarys_to_refuse(self):
        bad = self.quads.copy()
        bad[5, 2] = 10**6
        with self.assertRaisesRegex(delmesh.IndexOutOfRange, "1000000"):
            delmesh.remesh(self.points, bad, layers={"uv": self.points[:, :2]})

    def test_cancelled_between(self):
        token = delmesh.CancelToken()
        mesh = delmesh.Mesh(self.points, self.quads, layers={"uv": self.uvs})
        token.cancel()
        with self.assertRaises(delmesh.Cancelled):
            mesh.transfer(self.uvs, domain="corner", cancel=token)


class Sparse(unittest.TestCase):
    def setUp(self):
        random = np.random.default_rng(3)
        self.points, self.faces = grid(20, 20)
        dense = random.random((len(self.points), 6)) * (random.random((len(self.points), 6)) < 0.6)
        self.dense = dense
        rows, self.indices = np.nonzero(dense)
        self.values = dense[rows, self.indices]
        self.offsets = np.r_[0, np.cumsum(np.bincount(rows, minlength=len(dense)))]
        self.result = delmesh.remesh(self.points, self.faces)

    def expand(self, rows):
        dense = np.zeros((len(rows.offsets) - 1, 6))
        dense[np.repeat(np.arange(len(dense)), np.diff(rows.offsets)), rows.indices] = rows.values
        return dense

    def test_like_dense_ones(self):
        expected = blended(self.dense, *self.result.mesh.vert_map)
        for given in (self.result, self.result.mesh):
            made = delmesh.transfer_rows(given, self.offsets, self.indices, self.values, limit=6, normalise=False)
            np.testing.assert_allclose(self.expand(made), expected, atol=1e-12)
        one = self.expand(delmesh.transfer_rows(self.result, self.offsets, self.indices, self.values, limit=6))
        total = expected.sum(axis=1, keepdims=True)
        np.testing.assert_allclose(one, np.divide(expected, total, where=total > 0, out=np.zeros_like(expected)), atol=1e-12)
        self.assertTrue(((one > 0).sum(axis=1) > 4).any())
        few = delmesh.transfer_rows(self.result, self.offsets, self.indices, self.values)
        self.assertEqual(np.diff(few.offsets).max(), 4)
        kept = delmesh.transfer_rows(self.result, self.offsets, self.indices, self.values, limit=2, normalise="sum")
        np.testing.assert_allclose(self.expand(kept).sum(axis=1), expected.sum(axis=1), atol=1e-12)
        self.assertEqual(np.diff(kept.offsets).max(), 2)

    def test_types(self):
        for index, value in ((np.int32, np.float32), (np.uint32, np.float64), (np.int64, np.float32)):
            made = delmesh.transfer_rows(self.result, self.offsets.astype(index), self.indices.astype(index),
                                         self.values.astype(value))
            self.assertEqual([array.dtype for array in made], [index, index, value])
        empty = delmesh.transfer_rows(self.result, np.zeros_like(self.offsets), [], [])
        self.assertEqual((len(empty.indices), len(empty.values), empty.offsets.max()), (0, 0, 0))

    def test_refusals(self):
        good = {"offsets": self.offsets, "indices": self.indices, "values": self.values}
        broken = self.values.copy()
        broken[7] = np.inf
        for change, error, sentence in (
                ({"limit": 0}, delmesh.InvalidArgument, "'limit' was 0, outside 1 to 65535"),
                ({"limit": 2**32 + 4}, delmesh.InvalidArgument, "'limit' was 4294967300, outside 1 to 65535"),
                ({"normalise": "all"}, delmesh.InvalidArgument, "'normalise' was 'all', which is not one of True, False, sum"),
                ({"normalise": [1]}, delmesh.InvalidArgument, r"'normalise' was \[1\], which is not one of"),
                ({"offsets": self.offsets[1:]}, delmesh.InvalidArgument, "'source.offsets' had 441 elements"),
                ({"values": self.values[1:]}, delmesh.InvalidArgument, "'source.indices' had"),
                ({"values": self.values.astype(str)}, delmesh.InvalidArgument, "'values' had the type"),
                ({"values": broken}, delmesh.InvalidArgument, "inf"),
                ({"indices": -self.indices - 1}, delmesh.IndexOutOfRange, "Index 0 of 'source' was -")):
            with self.subTest(sentence), self.assertRaisesRegex(error, sentence):
                delmesh.transfer_rows(self.result, **{**good, **change})


class RealMeshes(unittest.TestCase):
    """Textured models: every corner has its values, and corners that meet across an edge that is no border agree."""

    def test_uv_law(self):
        names = ("blub_triangulated.obj", "spot_control_mesh.obj", "spot_subdiv.obj.gz")
        paths = [path for path in (SHARED / "data" / "clean" / name for name in names) if path.is_file()]
        if not paths:
            self.skipTest(f"no meshes in {SHARED}/data")
        for path in paths:
            points, verts, offsets, uvs = read_obj(path)
            source = delmesh.Mesh(points, corner_verts=verts, face_offsets=offsets, layers={"uv": uvs})
            self.assertGreater(source.layer_borders["uv"], 10)
            for name, run in OPERATIONS.items():
                for mesh in run(source):
                    with self.subTest(path.name, operation=name):
                        corners, weights = (array.reshape(-1, 3) for array in mesh.corner_map)
                        uv = mesh.layers["uv"]
                        np.testing.assert_allclose(uv, blended(uvs, corners, weights), atol=1e-6)
                        twins = mesh.corner_twins.reshape(-1)
                        smooth = (mesh.edge_flags[mesh.corner_edges.reshape(-1)] & (delmesh.EDGE_UV | delmesh.EDGE_BOUNDARY)) == 0
                        here = np.flatnonzero(smooth)
                        across = twins[here]
                        across_next = across // 3 * 3 + (across + 1) % 3
                        np.testing.assert_array_equal(uv[here], uv[across_next])


if __name__ == "__main__":
    support.main()
