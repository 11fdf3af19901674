# SPDX-License-Identifier: Apache-2.0
"""Surfaces, layers and the operator Delaunay Remesh."""
import os
import sys

import bmesh
import bpy
import numpy as np
import support
from support import (MODES, Case, SourceSurface, add_object, add_uv, corner_verts, fingerprint, folded_sheet, moebius, monkey, part,
                     points, remesh, select, uv)


class Surfaces(Case):
    def test_cube(self):
        for mode in MODES:
            bpy.ops.mesh.primitive_cube_add()
            ob = bpy.context.object
            source = SourceSurface(ob.data)
            self.assertEqual(remesh(ob, mode=mode), {"FINISHED"})
            self.assertEqual((len(ob.data.vertices), len(ob.data.polygons), len(ob.data.edges)), (8, 12, 18))
            self.check_valid(ob.data)
            self.check_source_vertices(source, ob.data)

    def test_quads_with_seams_and_materials(self):
        for mode in MODES:
            ob = folded_sheet("sheet " + mode)
            source = SourceSurface(ob.data)
            red = sum(p.area for p in ob.data.polygons if p.material_index == 0)
            remesh(ob, mode=mode)
            self.assertGreater(len(ob.data.vertices), len(source.points), "the borders had to be split")
            self.check_valid(ob.data)
            self.check_source_vertices(source, ob.data)
            self.assertEqual([layer.name for layer in ob.data.uv_layers], ["smooth", "split"])
            if mode == "PRESERVE":
                self.check_surface(source, ob.data)
                self.assertAlmostEqual(sum(p.area for p in ob.data.polygons if p.material_index == 0), red, places=4)
            # The seam: no face of the second map reaches from one island into the other.
            islands = uv(ob.data, "split").reshape(-1, 3, 2)
            left, right = islands[..., 0].max(axis=1) <= 0.2 + 1e-6, islands[..., 0].min(axis=1) >= 0.7 - 1e-6
            self.assertTrue((left ^ right).all())

    def test_monkey(self):
        for mode in MODES:
            for cuts in (0, 1):
                with self.subTest(mode, cuts=cuts):
                    ob = monkey(cuts)
                    source = SourceSurface(ob.data)
                    remesh(ob, mode=mode)
                    self.check_valid(ob.data)
                    self.check_source_vertices(source, ob.data)
                    self.assertEqual(len(ob.data.materials), 2)
                    if mode == "PRESERVE":
                        self.check_surface(source, ob.data, 2e-6)  # UV coordinates up to 3: one unit in the last place is 2.4e-7

    def test_uv_maps_that_bend_in_flat_places(self):
        # A flat sheet whose map is curved: every flip there moves the texture. Kept in PRESERVE, as the option says.
        for keep in (True, False):
            ob = folded_sheet("flat %s" % keep, 6, 3)  # three rows: no fold
            while ob.data.uv_layers:
                ob.data.uv_layers.remove(ob.data.uv_layers[0])
            work = bmesh.new()
            work.from_mesh(ob.data)
            bmesh.ops.triangulate(work, faces=work.faces[:])
            work.to_mesh(ob.data)
            work.free()
            ob.data.materials.clear()
            add_uv(ob.data, "curved", (points(ob.data)[corner_verts(ob.data)][:, :2] / 10)**2)
            source = SourceSurface(ob.data)
            remesh(ob, mode="PRESERVE", keep_uv_borders=keep, keep_materials=False)
            self.check_valid(ob.data)
            if keep:
                self.check_surface(source, ob.data)
            else:
                with self.assertRaises(AssertionError):
                    self.check_surface(source, ob.data, 1e-3)

    def test_options_change_the_result(self):
        counts = {}
        for options in ({"mode": "PRESERVE"}, {"mode": "FLIP"}, {"mode": "FEATURE", "feature_angle": 0.1},
                        {"mode": "FLIP", "max_normal_turn": 0.1}, {"mode": "PRESERVE", "boundary": "IGNORE"}):
            ob = monkey()
            remesh(ob, **options)
            counts[str(options)] = len(ob.data.polygons)
        self.assertEqual(len(set(counts.values())), 5, counts)


class NothingLost(Case):
    def make(self):
        ob = folded_sheet()
        mesh = ob.data
        count = len(mesh.vertices)
        first = ob.vertex_groups.new(name="first")
        for v in range(count):
            first.add([v], v / count, "REPLACE")
        second = ob.vertex_groups.new(name="second")
        second.add([0, 5, 7], 0.625, "REPLACE")
        second.lock_weight = True
        ob.vertex_groups.active_index = 1
        mesh.attributes.new("height", "FLOAT", "POINT").data.foreach_set("value", points(mesh)[:, 2].astype(np.float32))
        mesh.attributes.new("number", "INT", "FACE").data.foreach_set("value", np.arange(len(mesh.polygons), dtype=np.int32) * 3)
        arrows = mesh.attributes.new("arrow", "FLOAT_VECTOR", "POINT")
        arrows.data.foreach_set("vector", points(mesh).astype(np.float32).reshape(-1))
        mesh.attributes.new("rail", "INT", "EDGE").data.foreach_set("value", np.arange(len(mesh.edges), dtype=np.int32))
        corners = points(mesh)[corner_verts(mesh)]
        colors = np.column_stack([corners / 20 + 0.2, np.ones(len(corners))]).astype(np.float32)
        mesh.color_attributes.new("paint", "FLOAT_COLOR", "CORNER").data.foreach_set("color", colors.reshape(-1))
        mesh.color_attributes.new("bytes", "BYTE_COLOR", "POINT")
        mesh.attributes.active_color_index = 1
        mesh.uv_layers.active_index = 1
        mesh.uv_layers["split"].active_render = True
        for edge in mesh.edges:
            edge.use_seam = edge.index % 5 == 0
            edge.use_edge_sharp = edge.index % 7 == 0
        for polygon in mesh.polygons:
            polygon.use_smooth = polygon.index % 3 == 0
        mesh["note"] = "custom"
        ob.modifiers.new("bend", "SUBSURF").levels = 2
        return ob

    @staticmethod
    def edge_length(mesh, wanted):
        place = points(mesh)
        return sum(np.linalg.norm(place[e.vertices[0]] - place[e.vertices[1]]) for e in mesh.edges if wanted(e))

    def test_layers(self):
        for mode in MODES:
            ob = self.make()
            mesh, name = ob.data, ob.data.name
            count = len(mesh.vertices)
            seams = self.edge_length(mesh, lambda e: e.use_seam)
            sharp = self.edge_length(mesh, lambda e: e.use_edge_sharp)
            numbers = {p.index: p.use_smooth for p in mesh.polygons}
            remesh(ob, mode=mode)
            self.check_valid(mesh)
            self.assertEqual((ob.data.name, ob.data, mesh["note"], ob.modifiers["bend"].levels), (name, mesh, "custom", 2))
            # Vertex groups: as they were at the source's vertices, in between at the new ones.
            self.assertEqual([g.name for g in ob.vertex_groups], ["first", "second"])
            self.assertEqual((ob.vertex_groups.active_index, ob.vertex_groups["second"].lock_weight), (1, True))
            for v in range(count):
                weights = {g.group: g.weight for g in mesh.vertices[v].groups}
                self.assertEqual(weights[0], np.float32(v / count))
                self.assertEqual(weights.get(1), 0.625 if v in (0, 5, 7) else None)
            new = [{g.group: g.weight for g in mesh.vertices[v].groups} for v in range(count, len(mesh.vertices))]
            self.assertTrue(new and all(0 < w[0] < 1 for w in new))
            # Attributes that are linear in the position still are.
            place = points(mesh)
            heights = np.array([d.value for d in mesh.attributes["height"].data])
            np.testing.assert_array_equal(heights[:count], place[:count, 2])
            arrows = np.array([d.vector for d in mesh.attributes["arrow"].data])
            paint = np.array([d.color for d in mesh.attributes["paint"].data])
            if mode == "PRESERVE":
                np.testing.assert_allclose(heights, place[:, 2], atol=2e-6)
                np.testing.assert_allclose(arrows, place, atol=2e-6)
                np.testing.assert_allclose(paint[:, :3], place[corner_verts(mesh)] / 20 + 0.2, atol=2e-6)
            self.assertEqual(mesh.attributes["bytes"].domain, "POINT")
            self.assertEqual(mesh.attributes.active_color_index, 1)
            # By polygon: the number tells which, and the smooth flag must be that polygon's.
            for polygon, number in zip(mesh.polygons, mesh.attributes["number"].data):
                self.assertEqual(polygon.use_smooth, numbers[number.value // 3])
            # Marked edges: not a piece is lost, nor added.
            self.assertAlmostEqual(self.edge_length(mesh, lambda e: e.use_seam), seams, places=3)
            self.assertAlmostEqual(self.edge_length(mesh, lambda e: e.use_edge_sharp), sharp, places=3)
            rails = np.array([d.value for d in mesh.attributes["rail"].data])
            self.assertGreater(len(np.unique(rails)), 20)
            self.assertEqual(mesh.uv_layers.active_index, 1)
            self.assertTrue(mesh.uv_layers["split"].active_render)

    def test_wire_and_lone_vertices_stay(self):
        ob = add_object("wire", [(0, 0, 0), (3, 0, 0), (3, 1, 0), (0, 1, 0), (9, 9, 9), (5, 5, 5), (6, 6, 6)],
                        [[0, 1, 2, 3]], edges=[(5, 6)])
        remesh(ob)
        np.testing.assert_array_equal(points(ob.data)[:7][4:], [(9, 9, 9), (5, 5, 5), (6, 6, 6)])
        self.assertIn((5, 6), [tuple(sorted(e.vertices)) for e in ob.data.edges])
        self.assertFalse(ob.data.validate())

    def test_sheets_stay_joined(self):
        fan = [[0, 1, 2 + i] for i in range(3)]
        for mode in MODES:
            ob = add_object("fan", [(0, 0, 0), (0, 0, 5), (1, 0, 1), (-1, 1, 2.5), (-1, -1, 4)], fan)
            remesh(ob, mode=mode)
            self.assertFalse(ob.data.validate(verbose=True))
            uses = {}
            for polygon in ob.data.polygons:
                for key in polygon.edge_keys:
                    uses[key] = uses.get(key, 0) + 1
            axis = [n for (a, b), n in uses.items() if all(ob.data.vertices[v].co.xy.length == 0 for v in (a, b))]
            self.assertTrue(axis and all(n == 3 for n in axis), "every piece of the edge still has three faces")
            self.assertEqual(len({tuple(v.co) for v in ob.data.vertices}), len(ob.data.vertices))


    def test_two_sheets_with_the_same_face_stay_apart(self):
        # A rhombus twice, with one diagonal and with the other, and a flap on each side: three sheets. Two become the same.
        place = [(0, -1, 0), (3, 0, 0), (0, 1, 0), (-3, 0, 0), (2, -2, 4), (2, 2, 4), (-2, 2, 4), (-2, -2, 4)]
        ob = add_object("sheets", place, [[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3], [0, 1, 4], [1, 2, 5], [2, 3, 6], [3, 0, 7]])
        for mode in MODES:
            remesh(ob, mode=mode)
            self.assertFalse(ob.data.validate(verbose=True))


class Region(Case):
    """Edit mode: only selected faces."""

    def edit(self, ob, chosen, **options):
        select(ob)
        bpy.context.tool_settings.mesh_select_mode = (False, False, True)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="DESELECT")
        work = bmesh.from_edit_mesh(ob.data)
        for face, value in zip(work.faces, chosen):
            face.select_set(bool(value))
        bmesh.update_edit_mesh(ob.data)
        result = bpy.ops.object.delmesh_remesh("EXEC_DEFAULT", True, **{**support.DEFAULTS, **options})
        self.assertEqual(ob.mode, "EDIT")
        bpy.ops.object.mode_set(mode="OBJECT")
        return result

    def test_only_selected_faces_change(self):
        for mode in MODES:
            ob = folded_sheet("sheet " + mode)
            mesh = ob.data
            mesh.attributes.new("number", "INT", "FACE").data.foreach_set("value", np.arange(len(mesh.polygons), dtype=np.int32))
            mesh.attributes.new("rail", "INT", "EDGE").data.foreach_set("value", np.arange(len(mesh.edges), dtype=np.int32) + 1)
            ob.vertex_groups.new(name="group").add(range(0, 50), 0.5, "REPLACE")
            chosen = np.array([p.center.x > 8 for p in mesh.polygons])
            before = {p.index: [tuple(mesh.vertices[v].co) for v in p.vertices] for p in mesh.polygons if not chosen[p.index]}
            rails = {tuple(sorted(e.vertices)): e.index + 1 for e in mesh.edges}
            maps = {name: uv(mesh, name) for name in ("smooth", "split")}
            starts = {p.index: p.loop_start for p in mesh.polygons}
            source = points(mesh)
            self.edit(ob, chosen, mode=mode)
            self.assertFalse(mesh.validate(verbose=True))
            np.testing.assert_array_equal(points(mesh)[:len(source)], source)
            numbers = [d.value for d in mesh.attributes["number"].data]
            kept = [p for p in mesh.polygons if len(p.vertices) == 4]
            self.assertEqual(sorted(numbers[p.index] for p in kept), sorted(before))
            for p in kept:
                self.assertEqual([tuple(mesh.vertices[v].co) for v in p.vertices], before[numbers[p.index]])
                for name, values in maps.items():
                    start = starts[numbers[p.index]]
                    np.testing.assert_array_equal(uv(mesh, name)[p.loop_start:p.loop_start + 4], values[start:start + 4])
            for p in mesh.polygons:
                if len(p.vertices) == 3:
                    self.assertTrue(chosen[numbers[p.index]])
            others = {pair for p in kept for pair in p.edge_keys}
            rail = {tuple(sorted(edge.vertices)): mesh.attributes["rail"].data[edge.index].value for edge in mesh.edges}
            self.assertEqual([rail[pair] for pair in others], [rails[pair] for pair in others])
            self.assertTrue(all(mesh.vertices[v].groups[0].weight == 0.5 for v in range(50)))
            # What was chosen is Delaunay inside.
            part_of = [p for p in mesh.polygons if len(p.vertices) == 3]
            arrays = points(mesh).astype(np.float32), np.array([p.vertices for p in part_of])
            self.assertTrue(part("native").load().certify(arrays, boundary="ignore").delaunay)

    def test_nothing_selected(self):
        ob = folded_sheet()
        with self.assertRaisesRegex(RuntimeError, "No faces are selected"):
            self.edit(ob, np.zeros(len(ob.data.polygons), bool))
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_undo(self):
        ob = folded_sheet()
        before, faces = fingerprint(ob.data), len(ob.data.polygons)
        select(ob)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.ed.undo_push()
        bpy.ops.object.delmesh_remesh("EXEC_DEFAULT", True, **{**support.DEFAULTS, "mode": "FLIP"})
        bpy.context.object.update_from_editmode()
        self.assertGreater(len(bpy.context.object.data.polygons), faces)
        bpy.ops.ed.undo()
        bpy.context.object.update_from_editmode()
        self.assertEqual(len(bpy.context.object.data.polygons), faces)
        self.assertEqual(bpy.context.object.mode, "EDIT")
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assertEqual(fingerprint(bpy.context.object.data)[:3], before[:3])


class Operator(Case):
    def test_undo_and_redo(self):
        ob = monkey()
        select(ob)
        bpy.ops.ed.undo_push()
        before = fingerprint(ob.data)
        remesh(ob, mode="FLIP")
        after = fingerprint(bpy.context.object.data)
        self.assertNotEqual(after, before)
        bpy.ops.ed.undo()
        self.assertEqual(fingerprint(bpy.context.object.data), before)
        bpy.ops.ed.redo()
        self.assertEqual(fingerprint(bpy.context.object.data), after)
        # What the redo panel does: undo, then run again with other settings.
        bpy.ops.ed.undo()
        bpy.ops.object.delmesh_remesh("EXEC_DEFAULT", True, mode="PRESERVE")
        bpy.ops.ed.undo()
        bpy.ops.object.delmesh_remesh("EXEC_DEFAULT", True, mode="FLIP")
        self.assertEqual(fingerprint(bpy.context.object.data), after)

    def test_several_objects_and_shared_meshes(self):
        one, other, bystander = folded_sheet("one"), monkey(), folded_sheet("bystander")
        twin = bpy.data.objects.new("twin", one.data)
        bpy.context.scene.collection.objects.link(twin)
        twin.parent, twin.location = other, (3, 0, 0)
        untouched, mesh, users = fingerprint(bystander.data), one.data, one.data.users
        alone = folded_sheet("alone")
        remesh(alone)
        remesh(one, twin, other)
        self.assertTrue(one.data is twin.data or one.data == twin.data == mesh)
        self.assertEqual(mesh.users, users)
        self.assertEqual(fingerprint(mesh)[:3], fingerprint(alone.data)[:3])  # once, not twice
        self.check_valid(one.data)
        self.check_valid(other.data)
        self.assertEqual(fingerprint(bystander.data), untouched)
        self.assertEqual((twin.parent, tuple(twin.location), twin.name), (other, (3, 0, 0), "twin"))

    def test_an_error_leaves_the_mesh_alone(self):
        band = moebius()
        before = fingerprint(band.data)
        with self.assertRaisesRegex(RuntimeError, "band: "):
            remesh(band)
        self.assertEqual(fingerprint(band.data), before)
        nothing = add_object("nothing", [], [])
        with self.assertRaisesRegex(RuntimeError, "nothing: "):
            remesh(nothing)
        # One that fails does not keep the others from being done.
        good = folded_sheet("good")
        self.assertEqual(remesh(band, good), {"FINISHED"})
        self.check_valid(good.data)
        self.assertEqual(fingerprint(band.data), before)

    def test_poll_says_why_not(self):
        select()
        with self.assertRaisesRegex(RuntimeError, "Select at least one"):
            bpy.ops.object.delmesh_remesh()
        ob = folded_sheet()
        select(ob)
        bpy.ops.object.mode_set(mode="EDIT")
        with self.assertRaisesRegex(RuntimeError, "Works in Object Mode"):
            bpy.ops.object.delmesh_check()
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_a_missing_library_is_said_in_a_sentence(self):
        native = part("native")
        ob = folded_sheet()
        before = fingerprint(ob.data)
        kept = os.environ.get("DELMESH_LIBRARY")
        try:
            os.environ["DELMESH_LIBRARY"] = "/nonexistent/libdelmesh.so"
            native.forget()
            self.assertIn("/nonexistent/libdelmesh.so", native.problem())
            with self.assertRaisesRegex(RuntimeError, "native library of Delmesh is not usable.*/nonexistent/libdelmesh.so"):
                remesh(ob)
            self.assertEqual(fingerprint(ob.data), before)
            bpy.ops.preferences.addon_disable(module=support.ADDON)
            bpy.ops.preferences.addon_enable(module=support.ADDON)  # registers all the same
            self.assertTrue(hasattr(bpy.types, "OBJECT_OT_delmesh_remesh"))
        finally:
            os.environ.pop("DELMESH_LIBRARY")
            if kept:
                os.environ["DELMESH_LIBRARY"] = kept
            part("native").forget()
        self.assertEqual(part("native").problem(), "")
        self.assertEqual(remesh(ob), {"FINISHED"})

    def test_a_path_in_the_preferences_is_used(self):
        preferences = bpy.context.preferences.addons[support.ADDON].preferences
        preferences.path_to_library = "/nonexistent/other.so"
        self.assertIn("/nonexistent/other.so", part("native").problem())
        preferences.path_to_library = ""
        self.assertEqual(part("native").problem(), "")

    def test_buttons_pass_the_panel_s_settings(self):
        class Layout:
            @staticmethod
            def operator(name, **_how):
                class Button:
                    pass
                Layout.button = Button()
                return Layout.button

        panel, settings = part("panel"), bpy.context.scene.delmesh
        settings.remesh.keep_seams, settings.remesh.feature_angle, settings.lod.ratios = False, 0.25, "0.7"
        panel._operator(Layout, part("operators").OBJECT_OT_delmesh_remesh, settings.remesh, settings.remesh)
        chosen = vars(Layout.button)
        self.assertEqual([chosen[name] for name in ("mode", "boundary", "growth_limit", "keep_seams", "feature_angle")],
                         ["FEATURE", "IGNORE", 4, False, 0.25])
        select(folded_sheet())
        self.assertEqual(bpy.ops.object.delmesh_remesh(**chosen), {"FINISHED"})
        panel._operator(Layout, part("lods").OBJECT_OT_delmesh_lod, settings.lod, settings.remesh)
        chosen = vars(Layout.button)
        self.assertEqual((chosen["boundary"], chosen["ratios"], chosen["keep_seams"]), ("IGNORE", "0.7", False))
        self.assertEqual(bpy.ops.object.delmesh_lod(**chosen), {"FINISHED"})

    def test_registration(self):
        self.assertIn(part("panel").draw_menu, bpy.types.VIEW3D_MT_object._dyn_ui_initialize())
        bpy.ops.preferences.addon_disable(module=support.ADDON)
        self.assertFalse(hasattr(bpy.types, "OBJECT_OT_delmesh_remesh"))
        self.assertFalse(hasattr(bpy.types, "VIEW3D_PT_delmesh"))
        if sys.platform.startswith("linux"):
            with open("/proc/self/maps") as maps:
                self.assertFalse("libdelmesh" in maps.read(), "the library stays loaded after the add-on is disabled")
        bpy.ops.preferences.addon_enable(module=support.ADDON)
        self.assertTrue(hasattr(bpy.types, "OBJECT_OT_delmesh_remesh"))
