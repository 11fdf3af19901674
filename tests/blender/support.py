# SPDX-License-Identifier: Apache-2.0
"""What the tests of the add-on share: making and reading meshes by plain means, and laws of results."""
import importlib
import os
import subprocess
import sys
import unittest

import bpy  # first: as a module it brings the others
import bmesh
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

DEFAULTS = {"mode": "PRESERVE", "boundary": "NONOBTUSE", "max_normal_turn": np.pi, "keep_uv_borders": True, "keep_materials": True,
            "growth_limit": 0, "as_copy": False}
MODES = ("PRESERVE", "FLIP", "FEATURE")
ADDON = "delmesh"  # its module; the extension's is longer


def install():
    global ADDON
    zips = os.environ.get("DELMESH_ADDON_ZIPS", "").splitlines()
    package = next((name for name in zips if ("legacy" in name) == (bpy.app.version < (4, 2))), None)
    if package and bpy.app.version >= (4, 2):
        validate(package)
        bpy.ops.extensions.package_install_files(repo="user_default", filepath=package, enable_on_install=True)
        ADDON = "bl_ext.user_default.delmesh"
        return
    if package:
        bpy.ops.preferences.addon_install(filepath=package, overwrite=True)
    bpy.ops.preferences.addon_enable(module=ADDON)


def validate(package):
    """Blender's own check of extensions, in a Python of its own as it ends its process."""
    import bl_pkg
    tool = os.path.join(os.path.dirname(bl_pkg.__file__), "cli", "blender_ext.py")
    done = subprocess.run([sys.executable, tool, "validate", package], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def part(name):
    return importlib.import_module(f"{ADDON}.{name}")


# ---- Making and reading meshes, by plain means ------------------------------------------------------------------------------


def add_object(name, points, faces, edges=()):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, p)) for p in points], list(edges), [list(map(int, f)) for f in faces])
    ob = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(ob)
    return ob


def select(*objects):
    for ob in bpy.context.scene.objects:
        ob.select_set(ob in objects)
    bpy.context.view_layer.objects.active = objects[0] if objects else None


def remesh(*objects, **options):
    """What a call does not name is as in the call before, so all that the tests use is named."""
    select(*objects)
    return bpy.ops.object.delmesh_remesh("EXEC_DEFAULT", True, **{**DEFAULTS, **options})


def add_uv(mesh, name, values):
    layer = mesh.uv_layers.new(name=name)
    for data, value in zip(layer.data, values):
        data.uv = value


def uv(mesh, name):
    values = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers[name].data.foreach_get("uv", values)
    return values.reshape(-1, 2)


def points(mesh):
    return np.array([v.co for v in mesh.vertices])


def corner_verts(mesh):
    return np.array([loop.vertex_index for loop in mesh.loops])


def fingerprint(mesh):
    """Everything that must not change when an error comes."""
    return (points(mesh).tobytes(), [tuple(p.vertices) for p in mesh.polygons], [tuple(e.vertices) for e in mesh.edges],
            [(layer.name, uv(mesh, layer.name).tobytes()) for layer in mesh.uv_layers],
            [p.material_index for p in mesh.polygons], [p.use_smooth for p in mesh.polygons])


class SourceSurface:
    """A copy of a mesh as it was, to be asked where a point of it is and what UVs and material it has there."""

    def __init__(self, mesh):
        mesh.calc_loop_triangles()
        self.points, self.verts = points(mesh), corner_verts(mesh)
        self.triangles = np.array([t.loops for t in mesh.loop_triangles])
        self.polygons = np.array([t.polygon_index for t in mesh.loop_triangles])
        self.materials = np.array([p.material_index for p in mesh.polygons])
        self.uvs = {layer.name: uv(mesh, layer.name) for layer in mesh.uv_layers}
        self.tree = BVHTree.FromPolygons([Vector(p) for p in self.points], self.verts[self.triangles].tolist(), epsilon=0)

    def triangle_at(self, place):
        return self.tree.find_nearest(Vector(place))[2]

    def weights(self, triangle, places):
        """Barycentric weights of places (n, 3) in the plane of a triangle, in double."""
        a, b, c = self.points[self.verts[self.triangles[triangle]]].astype(float)
        solution = np.linalg.lstsq(np.stack([b - a, c - a], axis=1), (places - a).T, rcond=None)[0].T
        return np.column_stack([1 - solution.sum(axis=1), solution])


# ---- Models -----------------------------------------------------------------------------------------------------------------


def folded_sheet(name="sheet", columns=8, rows=9):
    """Parallelograms in strips, bent between the strips: flat quads with diagonals and borders that are not Delaunay. Two UV
    maps: one smooth, one with a seam down the middle, both linear in each strip. Two materials."""
    place, at = [], []
    y = z = 0.0
    for j in range(rows + 1):
        place += [(i + 1.7 * j, y, z) for i in range(columns + 1)]
        y, z = y + np.cos(0.5 * (j // 3)), z + np.sin(0.5 * (j // 3))
    faces = [[j * (columns + 1) + i, j * (columns + 1) + i + 1, (j + 1) * (columns + 1) + i + 1, (j + 1) * (columns + 1) + i]
             for j in range(rows) for i in range(columns)]
    ob = add_object(name, place, faces)
    for j in range(rows):
        for i in range(columns):
            at += [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
    at = np.array(at, float)
    add_uv(ob.data, "smooth", at / (columns, rows))
    right = np.repeat([i >= columns // 2 for j in range(rows) for i in range(columns)], 4)
    add_uv(ob.data, "split", at / (columns, rows) * 0.4 + right[:, None] * (0.5, 0.25))
    for color in ("red", "blue"):
        ob.data.materials.append(bpy.data.materials.new(color))
    for polygon in ob.data.polygons:
        polygon.material_index = int((polygon.index % columns) // 3 + polygon.index // columns // 4) % 2
    return ob


def monkey(subdivide=0):
    """Suzanne: open at the eyes, with UV seams; triangulated, so that the surface is one thing to everyone."""
    bpy.ops.mesh.primitive_monkey_add()
    ob = bpy.context.object
    work = bmesh.new()
    work.from_mesh(ob.data)
    if subdivide:
        bmesh.ops.subdivide_edges(work, edges=work.edges[:], cuts=subdivide, use_grid_fill=True)
    bmesh.ops.triangulate(work, faces=work.faces[:])
    # Blender allows no two faces with the same vertices, and the triangulation makes two, back to back: a pocket without volume.
    work.faces.ensure_lookup_table()
    seen = {}
    for face in work.faces:
        seen.setdefault(frozenset(face.verts), []).append(face)
    bmesh.ops.delete(work, geom=[f for faces in seen.values() if len(faces) > 1 for f in faces], context="FACES_ONLY")
    work.to_mesh(ob.data)
    work.free()
    assert not ob.data.validate()
    place = points(ob.data)[corner_verts(ob.data)]
    right = np.array([p.center.x > 0 for p in ob.data.polygons]).repeat(3)
    add_uv(ob.data, "mirrored", np.where(right[:, None], place[:, [0, 2]] + 2, place[:, [0, 2]]))
    for color in ("skin", "eyes"):
        ob.data.materials.append(bpy.data.materials.new(color))
    for polygon in ob.data.polygons:
        polygon.material_index = int(polygon.center.z > 0.3)
    return ob


def moebius(name="band", n=9):
    angle = np.arange(n) * 2 * np.pi / n
    place = [((2 + s * np.cos(t / 2)) * np.cos(t), (2 + s * np.cos(t / 2)) * np.sin(t), s * np.sin(t / 2))
             for s in (-0.5, 0.5) for t in angle]
    faces = [[i, i + 1, n + i + 1, n + i] for i in range(n - 1)] + [[n - 1, n, 0, 2 * n - 1]]
    return add_object(name, place, faces)


class Case(unittest.TestCase):
    def setUp(self):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
        if ADDON not in bpy.context.preferences.addons:
            bpy.ops.preferences.addon_enable(module=ADDON)

    def check_valid(self, mesh):
        """Blender finds nothing to repair, and the package certifies it."""
        before = fingerprint(mesh)
        self.assertFalse(mesh.validate(verbose=True))
        self.assertEqual(fingerprint(mesh), before)
        self.assertTrue(all(len(p.vertices) == 3 for p in mesh.polygons))
        arrays = points(mesh).astype(np.float32), corner_verts(mesh).reshape(-1, 3)
        self.assertTrue(part("native").load().certify(arrays).delaunay)

    def check_surface(self, source, mesh, tolerance=1e-6):
        """preserve: UVs at the corners and materials are those of the source triangle in which the face lies."""
        places, verts = points(mesh).astype(float), corner_verts(mesh).reshape(-1, 3)
        carried = {name: uv(mesh, name).reshape(-1, 3, 2) for name in source.uvs}
        for f, polygon in enumerate(mesh.polygons):
            corner_places = places[verts[f]]
            triangle = source.triangle_at(corner_places.mean(axis=0))
            self.assertEqual(polygon.material_index, source.materials[source.polygons[triangle]])
            weights = source.weights(triangle, corner_places)
            for name, values in source.uvs.items():
                expected = weights @ values[source.triangles[triangle]].astype(float)
                np.testing.assert_allclose(carried[name][f], expected, atol=tolerance, err_msg=f"{name}, face {f}")

    def check_source_vertices(self, source, mesh):
        """Any mode: a corner at a vertex of the source has one of that vertex's UVs, bit for bit."""
        verts = corner_verts(mesh)
        old = verts < len(source.points)
        np.testing.assert_array_equal(points(mesh)[:len(source.points)], source.points)
        for name, values in source.uvs.items():
            have = {(v, *value) for v, value in zip(source.verts.tolist(), values.tolist())}
            for v, value in zip(verts[old].tolist(), uv(mesh, name)[old].tolist()):
                self.assertIn((v, *value), have)
