# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators Delaunay Remesh and Check Delaunay. execute() reads everything from its properties and the context, so that the
redo panel and scripts get the same result."""
import contextlib
import time

import bpy
import numpy as np

from . import cautions, exchange, overlay
from .options import CheckOptions, RemeshOptions, aligned
from .runner import Request, Running, read_all
from .text import number


def selected_meshes(operator, context):
    """{mesh: its selected objects} of those that can be worked on; reports the others."""
    objects, linked = {}, []
    for ob in sorted(context.selected_editable_objects, key=lambda ob: ob != context.active_object):
        if ob.type == "MESH":
            if any(getattr(ob.data, name) for name in ("library", "override_library")):
                linked.append(ob.name)
            else:
                objects.setdefault(ob.data, []).append(ob)
    if linked:
        operator.report({"WARNING"}, f"Left as they were: {', '.join(linked)}, whose meshes are linked from another file")
    return objects


@contextlib.contextmanager
def out_of_edit_mode(editing):
    """Meshes in edit mode can be neither read nor written."""
    if editing:
        bpy.ops.object.mode_set(mode="OBJECT")
    try:
        yield
    finally:
        if editing:
            bpy.ops.object.mode_set(mode="EDIT")


def can_run(cls, context):
    """What poll() asks, with the reason in the tooltip."""
    if context.mode != "OBJECT":
        cls.poll_message_set("Works in Object Mode")
        return False
    if not any(ob.type == "MESH" for ob in context.selected_editable_objects):
        cls.poll_message_set("Select at least one editable mesh object")
        return False
    return True


class Cautions:
    """Collects what users are to be told, and tells each thing once, with the objects that it is about."""

    def __init__(self):
        self._about = {}

    def add(self, text, ob):
        self._about.setdefault(text, []).append(ob.name)

    def report(self, operator):
        for text, names in self._about.items():
            about = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
            operator.report({"WARNING"}, f"{about}: {text}")


def repairs(cautions_, ob, report):
    for name, text in (("degenerate_faces", "faces without area were left out"), ("duplicate_faces", "double faces were left out"),
                       ("non_finite_faces", "faces at infinite or undefined places were left out"),
                       ("reoriented_faces", "faces were turned over to face as their neighbours do")):
        if report[name]:
            cautions_.add(f"{number(report[name])} {text}", ob)
    if not report["topology_kept"]:
        cautions_.add("what is smaller than the precision of coordinates had to be cut or removed", ob)


class OBJECT_OT_delmesh_remesh(Running, RemeshOptions, bpy.types.Operator):
    """Turn the selected meshes, in Edit Mode their selected faces, into Delaunay triangles, with all that lies on them"""
    bl_idname = "object.delmesh_remesh"
    bl_label = "Delaunay Remesh"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    @classmethod
    def poll(cls, context):
        return context.mode == "EDIT_MESH" or can_run(cls, context)

    def draw(self, context):
        layout = aligned(self.layout)
        self.draw_remesh(layout, context.mode == "EDIT_MESH")
        self.draw_keep(layout)

    def _requests(self, context):
        self._began = time.perf_counter()
        self._cautions = Cautions()
        editing = context.mode == "EDIT_MESH"
        meshes = {ob.data: [ob] for ob in context.objects_in_mode_unique_data} if editing else selected_meshes(self, context)
        steps = read_all(meshes, lambda mesh, objects: self._request(mesh, objects, editing))
        if not editing:
            return (yield from steps)
        with out_of_edit_mode(editing):
            requests = exchange.drained(steps)  # others are to find Blender in the mode that they know
        if not requests:
            self.report({"ERROR"}, "No faces are selected")
        return requests

    def _request(self, mesh, objects, editing):
        """None if no faces are selected."""
        ob, options = objects[0], self.remesh_options(max(cautions.scale_of(each) for each in objects))
        if editing:
            options["region"] = exchange.selected_faces(mesh)
            if not options["region"].any():
                return None
        for lost in cautions.losses(ob, True, self.custom_normals):
            self._cautions.add(f"not kept: {lost}", ob)
        for each in objects:
            if cautions.uneven_scale(each):
                self._cautions.add("scaled unevenly: Delaunay in the object's own space only; apply the scale first", each)
        data = yield from exchange.reading(mesh, ob, self.custom_normals)
        return Request("remesh", data, self.kept(), options, ob, objects=[each.name for each in objects])

    def _finish(self, context, requests):
        totals = np.zeros(4, np.int64)
        editing = context.mode == "EDIT_MESH"
        with out_of_edit_mode(editing):
            for request in requests:
                totals += self._write(request, editing)
        self._cautions.report(self)
        before, after, flips, splits = map(number, totals)
        self.report({"INFO"}, f"{len(requests)} mesh{'es' if len(requests) > 1 else ''}: {before} -> {after} triangles, {flips} "
                              f"flips, {splits} new vertices, Delaunay, in {time.perf_counter() - self._began:.1f} s")
        return {"FINISHED"}

    def _write(self, request, editing):
        """-> triangles before and after, flips, splits."""
        ob, report = request.object(), request.outcome.report
        target = self._copies(request, ob) if self.as_copy and not editing else ob
        exchange.write(request.outcome.meshes[0], target.data, target, exchange.Settings(ob.data, ob))
        flips = report["flips"] + report["flips_after"]
        repairs(self._cautions, ob, report)
        if report["boundary_splits"]:
            self._cautions.add(f"{number(report['boundary_splits'])} border edges were split; with Borders set to Keep "
                               "neighbouring parts still fit", ob)
        if flips or report["splits"]:
            for material in cautions.normal_mapped(ob.data):
                self._cautions.add(f"bake the normal map of {material} anew, the triangles are others", ob)
        return np.array((report["faces_in"], report["faces_out"], flips, report["splits"]), np.int64)

    @staticmethod
    def _copies(request, ob):
        """Copies of the objects that share a mesh share a copy of it. -> one of them."""
        mesh = ob.data.copy()
        for name in request.more["objects"]:
            original = bpy.data.objects[name]
            copy = original.copy()
            copy.data = mesh
            for collection in original.users_collection:
                collection.objects.link(copy)
            copy.select_set(False)
        return copy


class OBJECT_OT_delmesh_check(Running, CheckOptions, bpy.types.Operator):
    """Find the edges of the selected meshes that are not Delaunay, exactly"""
    bl_idname = "object.delmesh_check"
    bl_label = "Check Delaunay"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return can_run(cls, context)

    def draw(self, _context):
        layout = aligned(self.layout)
        layout.prop(self, "boundary")
        layout.prop(self, "select")

    def _requests(self, context):
        return (yield from read_all(selected_meshes(self, context), self._request))

    def _request(self, mesh, objects):
        data = yield from exchange.reading_surface(mesh)
        return Request("check", data, (), {"boundary": self.boundary.lower()}, objects[0])

    def _finish(self, context, requests):
        total = 0
        for request in requests:
            ob, report = request.object(), request.outcome.report
            ob.data.delmesh_check.set(ob.data, report, self.boundary)
            overlay.show(ob.data, report["places"])
            total += report["nld_interior"] + report["nld_boundary"]
            if self.select:
                exchange.select(ob.data, *report["selected"])
        flat = sum(request.outcome.report["zero_area_faces"] for request in requests)
        what = f"{number(total)} edge{'s are' if total != 1 else ' is'} not Delaunay" if total else "" if flat else "Delaunay"
        if flat:
            what += f"{', ' if what else ''}{number(flat)} faces have no area"
        worst = min(request.outcome.report["min_angle"] for request in requests)
        self.report({"INFO"}, f"{len(requests)} mesh{'es' if len(requests) > 1 else ''}: {what}; smallest angle {worst:.2f}°")
        if self.select and total:
            if context.active_object not in {request.object() for request in requests}:
                context.view_layer.objects.active = requests[0].object()
            context.tool_settings.mesh_select_mode = (False, True, False)
            bpy.ops.object.mode_set(mode="EDIT")
        return {"FINISHED"}
