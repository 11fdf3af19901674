# SPDX-License-Identifier: Apache-2.0
"""Every cell of the table "What survives what" of docs/attributes.md, on a tube whose texture has a seam from end to end."""
import unittest

from support import ROOT, cylinder, main, np

import delmesh
from delmesh import Layer

OPERATIONS = ("preserve", "flip", "feature", "levels")
KEPT = delmesh.EDGE_UV | delmesh.EDGE_NORMAL | delmesh.EDGE_COLOR | delmesh.EDGE_MATERIAL | delmesh.EDGE_FACE_SET


def table():
    """-> [(row, operation, cell)]"""
    text = (ROOT / "docs" / "attributes.md").read_text(encoding="utf-8")
    lines = text[text.index("## What survives what"):].split("\n\n")[2].strip().split("\n")
    rows = [[cell.strip().strip("`") for cell in line.strip("|").split("|")] for line in lines]
    assert tuple(rows[0][1:]) == OPERATIONS, rows[0]
    return [(row[0], operation, cell) for row in rows[2:] for operation, cell in zip(OPERATIONS, row[1:])]


def lengths(points, edges):
    ends = points.astype(float)[edges]
    return np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)


class Source:
    """The tube, with something of everything. Borders are arrays of edges: pairs of vertices."""

    def __init__(self):
        random = np.random.default_rng(3)
        self.points, self.quads, self.uvs, self.seam = cylinder(24, 9, 0.9, 0.03)
        sides = np.stack([self.quads, np.roll(self.quads, -1, axis=1)], axis=-1).reshape(-1, 2)
        self.edges, index, count = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
        index = index.reshape(-1)
        self.boundary = self.edges[count == 1]
        v, c, f, e = len(self.points), self.quads.size, len(self.quads), len(self.edges)
        column = np.tile(np.arange(24), 9)
        self.marks = np.where(self.edges[:, 0] // 24 == self.edges[:, 1] // 24, 0, delmesh.EDGE_SHARP)
        self.marks[self.edges.max(axis=1) % 24 > 5] = 0  # some of the lines along the tube
        normals = random.normal(size=(c, 3))
        self.layers = {"uv": self.uvs, "UVMap.001": Layer(np.roll(self.uvs, 1, axis=1), kind="uv", border="free"),
                       "normal": (normals / np.linalg.norm(normals, axis=1)[:, None]).astype(np.float32),
                       "colour": random.integers(0, 256, (c, 4), np.uint8), "heat": random.random(v),
                       "name": np.arange(v), "material": column // 8, "face_set": column // 12,
                       "area": random.random(f), "bevel": 1 + random.random(e)}
        half = (column // 12).astype(np.float32)
        self.asked = {"normal": Layer(np.repeat(np.stack([half, 1 - half, 0 * half], axis=1), 4, axis=0), border="keep"),
                      "colour": Layer(np.repeat(half, 4), border="keep")}
        owner = [[] for _ in range(e)]
        for corner, edge in enumerate(index):
            owner[edge].append(corner // 4)
        jumps = lambda ids: np.array([len(o) == 2 and ids[o[0]] != ids[o[1]] for o in owner])
        self.borders = {"UV": self.seam, "MATERIAL": self.edges[jumps(column // 8)], "FACE_SET": self.edges[jumps(column // 12)],
                        "NORMAL": self.edges[jumps(half)], "COLOR": self.edges[jumps(half)],
                        "SHARP": self.edges[self.marks > 0], "BOUNDARY": self.boundary}

    def run(self, operation, layers):
        mesh = delmesh.Mesh(self.points, self.quads, layers=layers, edges=self.edges, edge_marks=self.marks)
        if operation == "levels":
            return delmesh.lod_family(mesh, ratios=[0.3, 0.2]).levels
        return [delmesh.remesh(mesh, mode=operation).mesh]


class Survival(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.source = Source()
        cls.made = {operation: cls.source.run(operation, cls.source.layers) for operation in OPERATIONS}
        cls.made_asked = {operation: cls.source.run(operation, cls.source.asked) for operation in OPERATIONS}

    def test_every_cell(self):
        cells = table()
        self.assertEqual({row for row, _, _ in cells}, set(self.ROWS))
        for row, operation, cell in cells:
            check, *arguments = self.ROWS[row]
            meshes = self.made_asked if "asked" in row else self.made
            for mesh in meshes[operation]:
                with self.subTest(row=row, operation=operation, cell=cell, faces=len(mesh.faces)):
                    self.assertIn(cell, check.WORDS)
                    check(self, mesh, cell, operation, *arguments)

    # ---- What the words of the table mean

    def positions(self, mesh, cell, operation):
        of_source = mesh.vert_source >= 0
        self.assertTrue((mesh.positions[of_source] == self.source.points[mesh.vert_source[of_source]]).all())
        if cell == "the same":
            self.assertEqual(sorted(mesh.vert_source[of_source]), list(range(len(self.source.points))))
        else:
            self.assertLess(len(mesh.positions), len(self.source.points))
            self.assertFalse(of_source.all())
    positions.WORDS = ("the same", "fewer, moved")

    def values(self, mesh, cell, operation, name):
        """Through the map. exact: source vertices have their own values, and added ones on source edges what is between two."""
        layer = self.source.layers[name]
        given = layer.values if isinstance(layer, Layer) else layer
        at_corners = len(given) == self.source.quads.size
        index, weights = (array.reshape(-1, 3) for array in mesh.corner_map) if at_corners else mesh.vert_map
        picked = given[index].astype(float)
        out = mesh.layers[name]
        self.assertEqual(out.dtype, given.dtype)
        if cell == "the nearest":
            np.testing.assert_array_equal(out, given[index[np.arange(len(index)), weights.argmax(axis=1)]])
            return
        expected = (picked * weights.reshape(*weights.shape, *[1] * (picked.ndim - 2))).sum(axis=1)
        if name == "normal":
            expected /= np.linalg.norm(expected, axis=1)[:, None]
        np.testing.assert_allclose(out, expected, atol=0.5001 if given.dtype == np.uint8 else 1e-6)
        whole = weights.max(axis=1) == 1
        self.assertTrue(whole.any())
        own = given[index[np.arange(len(index)), weights.argmax(axis=1)]]
        np.testing.assert_allclose(out[whole], own[whole], atol=1e-7 if name == "normal" else 0)
        verts = self.source.quads.reshape(-1)[index] if at_corners else index
        of = mesh.faces.reshape(-1) if at_corners else np.arange(len(mesh.positions))
        if cell == "exact":
            np.testing.assert_array_equal(whole, mesh.vert_source[of] >= 0)
            np.testing.assert_array_equal(verts[whole, 0], mesh.vert_source[of][whole])
        if operation == "preserve":  # where the map leads is where the vertex is
            there = (self.source.points.astype(float)[verts] * weights[..., None]).sum(axis=1)
            np.testing.assert_allclose(there, mesh.positions[of], atol=1e-6)
    values.WORDS = ("exact", "the nearest", "of the place")

    def border(self, mesh, cell, operation, name):
        """whole: as long as it was. along itself: its ends are where they were, between which there is nothing else."""
        flagged = (mesh.edge_flags & getattr(delmesh, f"EDGE_{name}")) != 0
        edges, border = mesh.edges[flagged], self.source.borders[name]
        self.assertGreater(len(edges), 0)
        was = {tuple(sorted(edge)) for edge in border.tolist()}
        for edge in self.source.edges[mesh.edge_source[flagged]].tolist():
            self.assertIn(tuple(sorted(edge)), was)
        now, before = lengths(mesh.positions, edges).sum(), lengths(self.source.points, border).sum()
        if cell == "whole":
            self.assertAlmostEqual(now, before, delta=1e-4)
        else:
            self.assertLess(len(edges), len(border))
            self.assertLess(abs(now - before), 0.15 * before)
        ends = lambda all_edges, points: np.sort(np.linalg.norm(points[[v for v, n in zip(*np.unique(
            all_edges, return_counts=True)) if n % 2]].astype(float), axis=1))
        np.testing.assert_allclose(ends(edges, mesh.positions), ends(border, self.source.points), atol=0.05)
    border.WORDS = ("whole", "collapses along itself")

    def no_face_across(self, mesh, cell, operation, name):
        """The faces that a face's corners lie on have one value of the layer."""
        corners, _ = mesh.corner_map
        if name == "uv":  # one turn around the tube is 0 to 1: a triangle across the seam would have both
            u = mesh.layers["uv"].reshape(-1, 3, 2)[..., 0]
            self.assertLess((u.max(axis=1) - u.min(axis=1)).max(), 0.5)
            return
        ids = self.source.layers[name]
        np.testing.assert_array_equal(ids[corners.reshape(-1, 9) // 4], np.repeat(ids[mesh.face_source][:, None], 9, axis=1))
    no_face_across.WORDS = ("never",)

    def of_faces(self, mesh, cell, operation, *names):
        for name in names:
            np.testing.assert_array_equal(mesh.layers[name], self.source.layers[name][mesh.face_source])
        self.assertEqual(set(mesh.layers["material"]), {0, 1, 2})
    of_faces.WORDS = ("of the face it comes from",)

    def of_edges(self, mesh, cell, operation, name):
        which, given = mesh.edge_source, self.source.layers[name]
        np.testing.assert_array_equal(mesh.layers[name], np.where(which >= 0, given[which], 0))
        line = (mesh.edge_flags & (KEPT | delmesh.EDGE_SHARP | delmesh.EDGE_BOUNDARY)) != 0
        self.assertTrue((which[line] >= 0).all())
        self.assertEqual((which[~line] >= 0).any(), cell == "on what is left of each edge")
    of_edges.WORDS = ("on what is left of each edge", "on boundaries and kept borders")

    def rows(self, mesh, cell, operation):
        v = len(self.source.points)
        offsets, groups = 2 * np.arange(v + 1), np.stack([np.zeros(v), 1 + np.arange(v) % 5], axis=1).astype(np.int32)
        weights = np.stack([np.full(v, 0.25), np.full(v, 0.75)], axis=1)
        first, index, values = delmesh.transfer_rows(mesh, offsets, groups.reshape(-1), weights.reshape(-1), limit=16)
        dense = np.zeros((v, 6))
        dense[np.arange(v)[:, None], groups] = weights
        made = np.zeros((len(mesh.positions), 6))
        made[np.repeat(np.arange(len(first) - 1), np.diff(first)), index] = values
        at, shares = mesh.vert_map
        np.testing.assert_allclose(made, (dense[at] * shares[..., None]).sum(axis=1), atol=1e-12)
        np.testing.assert_allclose(made[:, 0], 0.25, atol=1e-12)
        own = mesh.vert_source >= 0
        if cell == "exact":
            np.testing.assert_array_equal(made[own], dense[mesh.vert_source[own]])
    rows.WORDS = ("exact", "of the place")

    ROWS = {"positions": (positions,),
            "UVs, any number of maps": (values, "uv"), "normals of corners": (values, "normal"),
            "colours and other numbers of corners": (values, "colour"), "numbers of vertices": (values, "heat"),
            "whole numbers of vertices and corners": (values, "name"), "sparse weights of vertices": (rows,),
            "values of faces": (of_faces, "material", "face_set", "area"), "values of edges": (of_edges, "bevel"),
            "borders of UVs": (border, "UV"), "borders of materials": (border, "MATERIAL"),
            "borders of face sets": (border, "FACE_SET"), "borders of normals, if asked for": (border, "NORMAL"),
            "borders of colours, if asked for": (border, "COLOR"), "marks of edges": (border, "SHARP"),
            "boundaries": (border, "BOUNDARY"), "a face across a UV border": (no_face_across, "uv"),
            "a face across a border of materials": (no_face_across, "material")}


if __name__ == "__main__":
    main()
