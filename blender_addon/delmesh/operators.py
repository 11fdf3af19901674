# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator Delaunay Remesh. execute() reads everything from its properties and the context, so that the redo panel and
scripts get the same result."""
import math
import time

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty

from . import exchange, marks, native


class Refused(Exception):
    """Says in a sentence why an object is left alone."""


class OBJECT_OT_delmesh_remesh(bpy.types.Operator):
    """Turn the selected meshes into Delaunay triangle meshes, keeping materials, UV maps and attributes"""
    bl_idname = "object.delmesh_remesh"
    bl_label = "Delaunay Remesh"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    mode: EnumProperty(
        name="Mode", default="PRESERVE", description="What may change to make every edge Delaunay",
        items=[("PRESERVE", "Preserve Shape", "Keep the surface: split edges, flip only in flat places. Adds the most vertices"),
               ("FLIP", "Flip", "Flip edges; add vertices only where no flip is possible. Changes the shape slightly"),
               ("FEATURE", "Keep Features", "Flip edges, but keep those sharper than an angle")])
    feature_angle: FloatProperty(
        name="Feature Angle", description="Edges whose faces meet at a sharper angle than this keep their shape",
        subtype="ANGLE", default=math.radians(30), min=0, max=math.pi)
    max_normal_turn: FloatProperty(
        name="Max Normal Turn", description="By how much a flip may turn the surface; edges that would turn it more are split. "
        "At 180° any flip is allowed", subtype="ANGLE", default=math.pi, min=0, max=math.pi)
    boundary: EnumProperty(
        name="Boundary", default="NONOBTUSE", description="What is asked of the open borders of a mesh",
        items=[("NONOBTUSE", "Non-Obtuse", "No angle opposite to a border edge is larger than 90°; splits border edges"),
               ("IGNORE", "Ignore", "Border edges are left as they are")])
    keep_seams: BoolProperty(name="Seams", description="Keep edges that are marked as seams", default=True)
    keep_sharp: BoolProperty(name="Sharp Edges", description="Keep edges that are marked as sharp", default=True)
    keep_materials: BoolProperty(name="Material Borders", description="Keep edges between two materials", default=True)
    keep_uv_borders: BoolProperty(
        name="UV Borders", description="Keep edges where a UV map is discontinuous, and in flat places those where it bends. "
        "Without it textures smear where such edges were flipped", default=True)

    @classmethod
    def poll(cls, context):
        if context.mode != "OBJECT":
            cls.poll_message_set("Works in Object Mode")
            return False
        if not any(ob.type == "MESH" for ob in context.selected_editable_objects):
            cls.poll_message_set("Select at least one editable mesh object")
            return False
        return True

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "mode")
        column = layout.column()
        column.active = self.mode == "FEATURE"
        column.prop(self, "feature_angle")
        column = layout.column()
        column.active = self.mode != "PRESERVE"
        column.prop(self, "max_normal_turn")
        layout.prop(self, "boundary")
        column = layout.column(heading="Keep")
        for name in ("keep_seams", "keep_sharp", "keep_materials", "keep_uv_borders"):
            column.prop(self, name)

    def execute(self, context):
        try:
            delmesh = native.load()
        except native.Unavailable as reason:
            self.report({"ERROR"}, str(reason))
            return {"CANCELLED"}
        # Objects that share a mesh are changed together, once.
        objects = {ob.data: ob for ob in reversed(context.selected_editable_objects) if ob.type == "MESH"}
        began = time.perf_counter()
        totals, failed, dropped = np.zeros(4, np.int64), [], set()
        manager = context.window_manager
        manager.progress_begin(0, len(objects))
        try:
            for number, (mesh, ob) in enumerate(reversed(objects.items())):
                try:
                    totals += self._remesh(delmesh, mesh, ob, dropped,
                                           lambda fraction, _stage: manager.progress_update(number + fraction))
                except (Refused, delmesh.DelmeshError) as reason:
                    failed.append(f"{ob.name}: {reason}")
        finally:
            manager.progress_end()
        if len(failed) == len(objects):
            self.report({"ERROR"}, failed[0] if len(failed) == 1 else f"{failed[0]} ({len(failed)} objects failed)")
            return {"CANCELLED"}
        done = len(objects) - len(failed)
        before, after, flips, splits = (f"{number:,}".replace(",", " ") for number in totals)
        self.report({"INFO"}, f"{done} mesh{'es' if done > 1 else ''}: {before} -> {after} triangles, {flips} flips, {splits} "
                              f"new vertices, Delaunay, in {time.perf_counter() - began:.1f} s")
        if dropped:
            self.report({"WARNING"}, f"Not kept: {', '.join(sorted(dropped))}")
        if failed:
            self.report({"WARNING"}, f"Left as it was: {'; '.join(failed)}")
        return {"FINISHED"}

    def _marked_edges(self, source):
        polygons = marks.Polygons(source.corner_verts, source.corner_edges, source.face_offsets, len(source.edges))
        marked = np.zeros(len(source.edges), bool)
        if self.keep_seams:
            marked |= source.seams
        if self.keep_sharp:
            marked |= source.sharp
        if self.keep_materials:
            marked |= polygons.face_borders(source.materials)
        if self.keep_uv_borders:
            for layer in source.uvs:
                marked |= polygons.corner_borders(layer.values)
                if self.mode == "PRESERVE":
                    marked |= polygons.bends(layer.values, source.positions)
        marked &= polygons.first >= 0  # an edge without a face cannot be kept
        return source.edges[marked]

    def _remesh(self, delmesh, mesh, ob, dropped, progress):
        """-> triangles before and after, flips, splits. The mesh changes in the last line, or not at all."""
        if mesh.shape_keys:
            raise Refused("meshes with shape keys are not supported yet")
        source = exchange.Source(mesh, ob)
        made = delmesh.Mesh(source.positions, corner_verts=source.corner_verts, face_offsets=source.face_offsets,
                            marked_edges=self._marked_edges(source))
        turn = -1.0 if self.max_normal_turn >= math.pi else math.degrees(self.max_normal_turn)
        remeshed, report = delmesh.remesh(
            made, mode=self.mode.lower(), boundary=self.boundary.lower(), feature_angle=math.degrees(self.feature_angle),
            max_normal_turn=turn, progress=progress)
        surface_map = delmesh.SurfaceMap(made, remeshed, source.corner_verts, source.face_offsets)
        result = exchange.Result(source, remeshed, surface_map)
        dropped.update(source.dropped)
        result.write(mesh, ob)
        return report.faces_in, report.faces_out, report.flips + report.flips_after, report.splits
