# SPDX-License-Identifier: Apache-2.0
"""The operators Delaunay LOD Family and Check Delaunay."""
import bpy
import numpy as np
from support import Case, add_object, add_uv, corner_verts, fingerprint, folded_sheet, monkey, part, points, select, uv

DEFAULTS = {"by": "RATIO", "lod0": "ORIGINAL", "source": "BASE", "structure": "COLLECTION", "prepare": "FLIP", "replace": True,
            "boundary": "NONOBTUSE", "density_group": "", "fit": False, "uv_weight": 1, "normal_weight": 0}


def lod(*objects, **options):
    """What a call does not name is as in the call before, so all that the tests use is named."""
    select(*objects)
    return bpy.ops.object.delmesh_lod("EXEC_DEFAULT", True, **{**DEFAULTS, **options})


def check(*objects, **options):
    select(*objects)
    return bpy.ops.object.delmesh_check("EXEC_DEFAULT", True, **options)


def faces(name):
    return len(bpy.data.objects[name].data.polygons)


def sheet(name, x, columns=24, rows=24):
    """A wavy sheet of quads from x to x + 1; neighbours share a border."""
    u, v = np.meshgrid(np.arange(columns + 1) / columns, np.arange(rows + 1) / rows)
    place = np.stack([u + x, v, 0.1 * np.sin(9 * (u + x)) * np.cos(7 * v)], axis=-1).reshape(-1, 3)
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1)
    return add_object(name, place, np.stack([a, a + 1, a + columns + 2, a + columns + 1], axis=-1))


class Levels(Case):
    def monkey(self, name="Suzanne", subdivide=1):
        ob = monkey(subdivide)
        ob.name = name
        return ob

    def test_names_and_places(self):
        ob = self.monkey()
        ob.location = (1, 2, 3)
        before, count = fingerprint(ob.data), len(ob.data.polygons)
        self.assertEqual(lod(ob, ratios="0.5,0.1"), {"FINISHED"})
        self.assertEqual(fingerprint(ob.data), before)
        self.assertEqual((ob.name, [o.name for o in bpy.context.selected_objects]), ("Suzanne", ["Suzanne"]))
        levels = bpy.data.collections["Suzanne_LODs"]
        self.assertEqual([o.name for o in levels.objects], ["Suzanne_LOD0", "Suzanne_LOD1", "Suzanne_LOD2"])
        self.assertEqual(bpy.data.objects["Suzanne_LOD0"].data, ob.data)
        for name, ratio in (("Suzanne_LOD1", 0.5), ("Suzanne_LOD2", 0.1)):
            self.assertAlmostEqual(faces(name) / count, ratio, delta=0.005)
            self.check_valid(bpy.data.objects[name].data)
            self.assertEqual(bpy.data.objects[name].data.name, name)
            self.assertEqual(tuple(bpy.data.objects[name].location), (1, 2, 3))
            self.assertEqual([m.name for m in bpy.data.objects[name].data.materials], [m.name for m in ob.data.materials])

    def test_the_finest_level(self):
        ob = self.monkey()
        lod(ob, ratios="0.5", lod0="NONE")
        self.assertEqual([o.name for o in bpy.data.collections["Suzanne_LODs"].objects], ["Suzanne_LOD1"])
        lod(ob, ratios="0.5", lod0="REMESHED")
        self.assertEqual([o.name for o in bpy.data.collections["Suzanne_LODs"].objects], ["Suzanne_LOD0", "Suzanne_LOD1"])
        self.check_valid(bpy.data.objects["Suzanne_LOD0"].data)
        self.assertGreaterEqual(faces("Suzanne_LOD0"), len(ob.data.polygons))

    def test_running_again_replaces(self):
        ob = self.monkey()
        lod(ob, ratios="0.5,0.2")
        meshes = len(bpy.data.meshes)
        lod(ob, ratios="0.4,0.3")
        self.assertEqual(len(bpy.data.meshes), meshes)
        self.assertEqual(sorted(o.name for o in bpy.data.objects), ["Suzanne", "Suzanne_LOD0", "Suzanne_LOD1", "Suzanne_LOD2"])
        lod(ob, ratios="0.4", replace=False)
        self.assertIn("Suzanne_LOD1.001", bpy.data.objects)

    def test_targets(self):
        ob = self.monkey()
        size = float(np.linalg.norm(np.ptp(points(ob.data), axis=0)))
        lod(ob, by="COUNT", counts="300, 1000")  # in any order
        self.assertIn(faces("Suzanne_LOD1"), (999, 1000))  # a collapse takes two faces away, on the boundary one
        self.assertIn(faces("Suzanne_LOD2"), (299, 300))
        ob.scale = (2, 2, 2)
        bpy.context.view_layer.update()
        delmesh = part("native").load()
        lod(ob, by="DEVIATION", deviations="0.02,0.1", prepare="PRESERVE")
        source = points(ob.data).astype(np.float32), corner_verts(ob.data).reshape(-1, 3)
        for name, allowed in (("Suzanne_LOD1", 0.01), ("Suzanne_LOD2", 0.05)):  # the scene's unit is half of the object's
            mesh = bpy.data.objects[name].data
            result = points(mesh).astype(np.float32), corner_verts(mesh).reshape(-1, 3)
            self.assertLess(delmesh.distance(source, result).hausdorff_sampled, allowed * 1.001)
        self.assertLess(faces("Suzanne_LOD2"), faces("Suzanne_LOD1"))
        counts = faces("Suzanne_LOD1")
        lod(ob, by="SCREEN", screen_sizes=f"{size / 0.01 / 1080:.9f}", pixel_error=1, screen_height=1080,
            prepare="PRESERVE")  # the same distance
        self.assertAlmostEqual(faces("Suzanne_LOD1"), counts, delta=2)
        for text in ("", "a,b", "0.5,-1", "nan", "0.5;x"):
            with self.subTest(text), self.assertRaisesRegex(RuntimeError, "is no list of numbers"):
                lod(ob, ratios=text)

    def test_below_an_empty(self):
        ob = self.monkey()
        root = bpy.data.objects.new("root", None)
        bpy.context.scene.collection.objects.link(root)
        root.location, ob.parent, ob.rotation_euler, ob.location = (5, 0, 0), root, (0.1, 0.5, 0.2), (1, 1, 0)
        bpy.context.view_layer.update()
        for structure in ("UNITY", "UNREAL"):
            lod(ob, ratios="0.5", structure=structure)
            bpy.context.view_layer.update()
            empty = bpy.data.objects["Suzanne_LODs"]
            self.assertEqual(empty.parent, root)
            self.assertEqual(empty.get("fbx_type"), "LodGroup" if structure == "UNREAL" else None)
            self.assertEqual(sorted(child.name for child in empty.children), ["Suzanne_LOD0", "Suzanne_LOD1"])
            for level in (*empty.children, empty):
                np.testing.assert_allclose(np.array(level.matrix_world), np.array(ob.matrix_world), atol=1e-6)

    def test_with_modifiers(self):
        ob = self.monkey(subdivide=0)
        ob.modifiers.new("sub", "SUBSURF").levels = 2
        bones = bpy.data.objects.new("bones", bpy.data.armatures.new("bones"))
        bpy.context.scene.collection.objects.link(bones)
        ob.modifiers.new("rig", "ARMATURE").object = bones
        ob.vertex_groups.new(name="bone").add(range(len(ob.data.vertices)), 1.0, "REPLACE")
        meshes, triangles = len(bpy.data.meshes), 2 * sum(len(p.vertices) for p in ob.data.polygons) * 4
        lod(ob, ratios="0.25", source="EVALUATED")
        level = bpy.data.objects["Suzanne_LOD1"]
        self.assertAlmostEqual(len(level.data.polygons) / triangles, 0.25, delta=0.01)
        self.check_valid(level.data)
        self.assertEqual([m.type for m in level.modifiers], ["ARMATURE"])
        self.assertEqual([m.type for m in ob.modifiers], ["SUBSURF", "ARMATURE"])
        self.assertTrue(ob.modifiers["rig"].show_viewport)
        self.assertEqual([g.name for g in level.vertex_groups], ["bone"])
        self.assertAlmostEqual(level.data.vertices[0].groups[0].weight, 1, places=5)
        self.assertEqual([uv.name for uv in level.data.uv_layers], [uv.name for uv in ob.data.uv_layers])
        self.assertEqual(len(bpy.data.meshes), meshes + 1, "nothing temporary is left")

    def test_density(self):
        ob = sheet("sheet", 0)
        ob.vertex_groups.new(name="more").add([v.index for v in ob.data.vertices if v.co.x < 0.5], 1.0, "REPLACE")
        shares = []
        for group in ("", "more"):
            lod(ob, ratios="0.2", density_group=group, density_factor=30)
            mesh = bpy.data.objects["sheet_LOD1"].data
            shares.append(np.mean([p.center.x < 0.5 for p in mesh.polygons]))
        self.assertLess(shares[0], 0.6)
        self.assertGreater(shares[1], 0.65)

    def test_textures_fit(self):
        ob = sheet("sheet", 0, 48, 48)
        place = points(ob.data)[corner_verts(ob.data)]
        add_uv(ob.data, "bent", place[:, :2] ** 2)
        errors = []
        for fit in (False, True):
            lod(ob, ratios="0.02", uv_weight=0, fit=fit)
            mesh = bpy.data.objects["sheet_LOD1"].data
            corners = points(mesh)[corner_verts(mesh)].reshape(-1, 3, 3)
            off = uv(mesh, "bent").reshape(-1, 3, 2).mean(axis=1) - corners.mean(axis=1)[:, :2] ** 2
            area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
            errors.append(np.average((off ** 2).sum(axis=1), weights=area))
        self.assertLess(errors[1], 0.8 * errors[0])

    def test_kits_still_fit(self):
        for rotation in (0, 0.7):
            with self.subTest(rotation=rotation):
                self.setUp()
                left, middle, right = (sheet(name, x) for name, x in (("left", 0), ("middle", 1), ("right", 2)))
                middle.data.transform(bpy.data.objects["middle"].matrix_world.Translation((-1, 0, 0)))
                middle.location = (1, 0, 0)
                for ob in (left, middle, right):
                    ob.rotation_euler = (0, 0, 0)
                bpy.context.view_layer.update()
                lod(left, middle, right, ratios="0.2", boundary="IGNORE")
                self.assertLess(faces("middle_LOD1"), 0.25 * 1152)
                borders = {}
                for name in ("left", "middle", "right"):
                    level = bpy.data.objects[f"{name}_LOD1"]
                    place = points(level.data) + np.array(level.location)
                    for x in (1, 2):
                        on = np.abs(place[:, 0] - x) < 1e-5
                        borders[name, x] = place[on][np.argsort(place[on, 1])]
                np.testing.assert_allclose(borders["left", 1], borders["middle", 1], atol=1e-6)
                np.testing.assert_allclose(borders["middle", 2], borders["right", 2], atol=1e-6)
                self.assertEqual(len(borders["left", 1]), 25)

    def test_wires_stay(self):
        ob = sheet("sheet", 0)
        place = [*points(ob.data), (0, 0, 1), (0, 0, 2), (5, 5, 5)]
        n = len(place)
        wired = add_object("wired", place, [list(p.vertices) for p in ob.data.polygons], edges=[(0, n - 3), (n - 3, n - 2)])
        wired.data.attributes.new("height", "FLOAT", "POINT").data.foreach_set(
            "value", np.array(place, np.float32)[:, 2].copy())
        lod(wired, ratios="0.1")
        mesh = bpy.data.objects["wired_LOD1"].data
        self.assertFalse(mesh.validate())
        loose = [tuple(sorted(tuple(mesh.vertices[v].co) for v in e.vertices)) for e in mesh.edges if e.is_loose]
        self.assertEqual(sorted(loose), [((0, 0, 0), (0, 0, 1)), ((0, 0, 1), (0, 0, 2))])
        self.assertIn((5, 5, 5), [tuple(v.co) for v in mesh.vertices])
        heights = np.array([d.value for d in mesh.attributes["height"].data])
        np.testing.assert_array_equal(heights[-3:], points(mesh)[-3:, 2])

    def test_one_level_is_shown(self):
        ob = self.monkey()
        lod(ob, ratios="0.5,0.1")
        for level, shown in ((1, ["Suzanne_LOD1"]), (0, ["Suzanne_LOD0"]),
                             (-1, ["Suzanne", "Suzanne_LOD0", "Suzanne_LOD1", "Suzanne_LOD2"])):
            bpy.context.scene.delmesh.shown_level = level
            self.assertEqual(sorted(o.name for o in bpy.context.scene.objects if o.visible_get()), shown)

    def test_undo(self):
        ob = self.monkey()
        select(ob)
        bpy.ops.ed.undo_push()
        lod(ob, ratios="0.5,0.1")
        bpy.ops.ed.undo()
        self.assertEqual([o.name for o in bpy.data.objects], ["Suzanne"])
        bpy.ops.ed.redo()
        self.assertIn("Suzanne_LOD2", bpy.data.objects)


class Checks(Case):
    def found(self, ob):
        return ob.data.delmesh_check

    def test_before_and_after(self):
        ob = folded_sheet()
        self.assertFalse(self.found(ob).is_of(ob.data))
        check(ob, select=False)
        self.assertTrue(self.found(ob).is_of(ob.data))
        self.assertFalse(self.found(ob).delaunay)
        self.assertGreater(self.found(ob).nld_interior, 10)
        self.assertGreater(self.found(ob).negative_cotangents, 10)
        bpy.ops.object.delmesh_remesh(mode="FLIP")
        self.assertFalse(self.found(ob).is_of(ob.data))
        check(ob)
        self.assertEqual((self.found(ob).delaunay, self.found(ob).nld_interior, self.found(ob).nld_boundary), (True, 0, 0))
        self.assertGreater(self.found(ob).min_angle, 1)
        self.assertEqual(ob.mode, "OBJECT")

    def test_edges_are_selected(self):
        # A rhombus across its long diagonal, which is not Delaunay, and a square beside it, which is.
        ob = add_object("rhombus", [(-3, 0, 0), (0, -1, 0), (3, 0, 0), (0, 1, 0), (10, 0, 0), (11, 0, 0), (11, 1, 0), (10, 1, 0)],
                        [[0, 1, 2], [0, 2, 3], [4, 5, 6, 7]])
        check(ob, boundary="IGNORE")
        self.assertEqual(ob.mode, "EDIT")
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assertEqual([tuple(sorted(e.vertices)) for e in ob.data.edges if e.select], [(0, 2)])
        self.assertEqual((self.found(ob).nld_interior, self.found(ob).nld_boundary), (1, 0))

    def test_numbers_are_the_package_s(self):
        ob = monkey(1)
        delmesh = part("native").load()
        mesh = points(ob.data).astype(np.float32), corner_verts(ob.data).reshape(-1, 3)
        for rule in ("NONOBTUSE", "IGNORE"):
            check(ob, select=False, boundary=rule)
            certificate, quality = delmesh.certify(mesh, boundary=rule.lower()), delmesh.measure(mesh)
            found = self.found(ob)
            self.assertEqual((found.nld_interior, found.nld_boundary, found.zero_area_faces, found.negative_cotangents),
                             (certificate.nld_interior, certificate.nld_boundary, 0, quality.negative_cotangents))
            self.assertAlmostEqual(found.min_angle, quality.min_angle, places=4)
