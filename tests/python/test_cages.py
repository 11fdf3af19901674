# SPDX-License-Identifier: Apache-2.0
"""Cages: the limit surface, layers at the places of levels, poses, refusals."""
import os
import unittest

try:
    import resource
except ImportError:  # Windows
    resource = None

from support import SHARED, main, np, read_obj

import delmesh

CUBE = np.array([[1 if i & 1 else -1, 1 if i & 2 else -1, 1 if i & 4 else -1] for i in range(8)], float)
FACES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
EDGES = np.array([(face[k], face[(k + 1) % 4]) for face in FACES for k in range(4)])
UVS = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32), (6, 1, 1))

try:
    delmesh.Cage(CUBE, FACES)
    HAS_CAGES = True
except delmesh.Unsupported:
    HAS_CAGES = False


@unittest.skipUnless(HAS_CAGES, "the library was built without OpenSubdiv")
class Cages(unittest.TestCase):
    def test_limit_of_a_cube(self):
        made = delmesh.subdivide(CUBE, FACES, 7)
        self.assertEqual((made.report.rate, len(made.faces), len(made.vertices)), (7, 588, 296))
        self.assertLess(np.abs(made.vertices - 0.5).max(axis=1).min(), 1e-6)  # (9 v + 4 (1,1,1) - (1,1,1)) / 24
        self.assertEqual(made.mesh.info.boundary_edges, 0)
        self.assertEqual(made.vertices.dtype, np.float32)
        self.assertEqual(delmesh.subdivide(CUBE, FACES, triangles=300).report.rate, 5)
        self.assertEqual(delmesh.subdivide(CUBE, FACES, edge_length=0.5, scheme="bilinear").report.rate, 4)
        far = delmesh.subdivide(CUBE, FACES, 8, evaluation="far", precision=np.float64)
        self.assertLess(np.abs(far.mesh.cage.values(far, CUBE) - far.vertices).max(), 1e-7)

    def test_creases_corners_holes(self):
        sharp = delmesh.subdivide(CUBE, FACES, 4, creases=(EDGES, np.full(24, 10.0)))
        self.assertLess(np.abs(np.abs(sharp.vertices).max(axis=1) - 1).max(), 1e-6)
        self.assertEqual(np.count_nonzero(sharp.mesh.edge_flags & delmesh.EDGE_CREASE), 48)
        corner = delmesh.subdivide(CUBE, FACES, 4, corners=([7], [10.0]))
        self.assertLess(np.abs(corner.vertices - 1).max(axis=1).min(), 1e-6)
        hole = delmesh.subdivide(CUBE, FACES, 4, holes=[2])
        self.assertEqual((len(hole.faces), hole.mesh.info.boundary_edges, hole.report.left_out_faces), (160, 16, 1))

    def test_polygons_of_mixed_sizes(self):
        cage = delmesh.Cage(CUBE, corner_verts=np.concatenate([FACES[1:].reshape(-1), [0, 2, 3, 0, 3, 1]]),
                            face_sizes=[4] * 5 + [3] * 2)
        made = cage.subdivide(6)
        self.assertEqual(made.mesh.info.euler_characteristic, 2)
        self.assertEqual(made.mesh.info.polygons, 7)
        self.assertEqual(repr(cage), "<delmesh.Cage: 8 vertices, 7 faces>")

    def test_layers_go_along_and_are_limits(self):
        heat = CUBE[:, 2].copy()
        wear = UVS[..., 0].copy()
        cage = delmesh.Cage(CUBE, FACES, layers={"uv": UVS, "material": np.arange(6) // 2, "heat": heat, "wear": wear})
        dense = cage.subdivide(12)
        self.assertEqual(dense.layers["uv"].shape, (len(dense.faces), 3, 2))
        self.assertEqual(set(dense.layers), {"uv", "material", "heat", "wear"})
        self.assertTrue(np.array_equal(dense.layers["material"], dense.mesh.face_source // 2))
        triangles = FACES[:, [0, 1, 2, 0, 2, 3]].reshape(-1)  # of corners alone: whose sizes nothing says
        loop = delmesh.Cage(CUBE, corner_verts=triangles, scheme="loop", layers={"number": np.arange(12)})
        level = loop.subdivide(2)
        self.assertTrue(np.array_equal(level.layers["number"], level.mesh.face_source))
        self.assertLess(np.abs(dense.layers["heat"] - dense.vertices[:, 2]).max(), 1e-6)
        self.assertEqual(np.count_nonzero(dense.mesh.edge_flags & delmesh.EDGE_UV), 12 * 12)
        family = delmesh.lod_family(dense, ratios=[0.5, 0.05])
        remeshed = delmesh.remesh(dense, mode="flip")
        for mesh in [*family.levels, remeshed.mesh]:
            self.assertIs(mesh.cage, cage)
            self.assertTrue(delmesh.certify(mesh).delaunay)
            self.assertTrue(np.array_equal(mesh.layers["material"], mesh.cage_faces // 2))
            faces, places = mesh.corner_cage
            # Linear along the boundaries of islands, where the whole of this map is: UVs of a cage's edge are its places.
            edge = ((places == 0) | (places == 1)).any(axis=2)
            self.assertLess(np.abs(mesh.layers["uv"][edge] - places[edge]).max(), 1e-6)
            self.assertTrue(np.array_equal(cage.values(mesh, UVS.reshape(-1, 2), layer="uv"), mesh.layers["uv"]))
            normals = cage.normals(mesh)
            self.assertLess(np.abs(np.linalg.norm(normals, axis=2) - 1).max(), 1e-12)
            self.assertGreater((normals * mesh.positions[mesh.faces]).sum(axis=2).min(), 0.3)

    def test_poses(self):
        cage = delmesh.Cage(CUBE, FACES, layers={"uv": UVS})
        level = delmesh.decimate(cage.subdivide(12), ratio=0.2)
        same = cage.reevaluate(level, CUBE)
        self.assertEqual(same.vertices.tobytes(), level.vertices.tobytes())
        self.assertEqual((same.report.moved_vertices, same.report.delaunay), (0, 1))
        self.assertIs(same.mesh.cage, cage)
        self.assertTrue(np.array_equal(same.layers["uv"], level.layers["uv"]))
        turned = CUBE[:, [1, 2, 0]] * 3 + 1
        moved = cage.reevaluate(level, turned)
        self.assertLess(np.abs(moved.vertices - (level.vertices[:, [1, 2, 0]] * 3 + 1)).max(), 2e-6)
        again = cage.reevaluate(moved, CUBE * [1, 1, 2])  # of the cage's own pose: as from the level, but for what moved
        self.assertEqual(len(again.vertices), len(level.vertices))

    def test_refusals(self):
        for arguments, sentence in ((dict(creases=([[0, 9]], [1.0])), "crease 0 had vertex 9"),
                                    (dict(creases=([[0, 1]], [-1.0])), "sharpness 0 was -1"),
                                    (dict(holes=[6]), "was face 6"), (dict(scheme="loop"), "Loop scheme takes triangles only"),
                                    (dict(layers={"uv": UVS[:3]}), "The layer 'uv' had")):
            with self.assertRaisesRegex(delmesh.DelmeshError, sentence):
                delmesh.Cage(CUBE, FACES, **arguments)
        with self.assertRaisesRegex(delmesh.InvalidArgument, "'scheme' was 'doo'"):
            delmesh.Cage(CUBE, FACES, scheme="doo")
        with self.assertRaises(TypeError):
            delmesh.subdivide(CUBE, FACES)
        for rate in (0, 10**6, 2.5):
            with self.assertRaisesRegex(delmesh.InvalidArgument, "value"):
                delmesh.subdivide(CUBE, FACES, rate)
        dense = delmesh.subdivide(CUBE, FACES, 4)
        plain = delmesh.remesh(dense, map=False)
        with self.assertRaisesRegex(delmesh.InvalidArgument, "does not come from a cage"):
            plain.mesh.cage_faces
        with self.assertRaisesRegex(delmesh.InvalidArgument, "had no places on a cage"):
            dense.mesh.cage.normals(plain)
        with self.assertRaises(delmesh.Cancelled):
            delmesh.subdivide(CUBE, FACES, 64, progress=lambda fraction, stage: False)

    @unittest.skipUnless(resource and os.path.exists("/proc/self/statm"), "address space cannot be limited here")
    def test_many_faces_around_a_vertex(self):
        """On a boundary no two of them are alike, so that OpenSubdiv would keep what it refines around each: 2.5 GB."""
        n = 300
        angle = np.linspace(0, np.pi, n + 1)
        points = np.concatenate([[[0, 0, 0.3]], np.stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(5 * angle)], axis=-1)])
        faces = np.stack([np.zeros(n, int), np.arange(1, n + 1), np.arange(2, n + 2)], axis=-1)
        limit = resource.getrlimit(resource.RLIMIT_AS)
        with open("/proc/self/statm", encoding="ascii") as statm:
            used = int(statm.read().split()[0]) * resource.getpagesize()  # the more cores, the more
        resource.setrlimit(resource.RLIMIT_AS, (used + (1 << 30), limit[1]))
        try:
            dense = delmesh.subdivide(points, faces, 4, boundary="edge", context=delmesh.Context(threads=1))
        finally:
            resource.setrlimit(resource.RLIMIT_AS, limit)
        self.assertEqual(len(dense.faces), 24 * n)

    def test_real_cage(self):
        path = SHARED / "data" / "clean" / "spot_control_mesh.obj"
        if not path.is_file():
            self.skipTest(f"{path} is missing")
        points, corners, offsets, uvs = read_obj(path)
        cage = delmesh.Cage(points, corner_verts=corners, face_offsets=offsets, layers={"uv": uvs})
        dense = cage.subdivide(8)
        self.assertEqual(dense.mesh.info.boundary_edges, 0)
        far = cage.subdivide(8, evaluation="far", precision="float64")
        diagonal = np.linalg.norm(points.max(axis=0) - points.min(axis=0))
        self.assertLess(np.abs(cage.values(far, points.astype(float)) - far.vertices).max(), 1e-5 * diagonal)
        family = delmesh.lod_family(dense, ratios=[0.3, 0.1])
        self.assertTrue(all(level.certified for level in family.report.levels))
        for level in family.levels:
            exact = cage.values(level, uvs, layer="uv")
            self.assertTrue(np.array_equal(exact, level.layers["uv"]))


if __name__ == "__main__":
    main()
