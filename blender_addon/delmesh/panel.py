# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the operators are found: a tab of the 3D view's sidebar, the Object menu (and so the search), and Object Data > Remesh."""
import bpy

from . import cage, cautions, native
from .lods import OBJECT_OT_delmesh_lod
from .operators import OBJECT_OT_delmesh_check, OBJECT_OT_delmesh_remesh
from .options import KeepOptions, LodOptions, RemeshOptions, aligned
from .text import number, wrapped


def _operator(layout, operator, settings, keep, **how):
    """A button that runs the operator with these settings. keep: those that say what to keep, which all operators share."""
    button = layout.operator(operator.bl_idname, **how)
    for options in (RemeshOptions, LodOptions):
        if isinstance(settings, options):
            for name in options.__annotations__:
                setattr(button, name, getattr(settings, name))
    for name in KeepOptions.__annotations__:
        setattr(button, name, getattr(keep, name))


def _lines(layout, context, text, icon="NONE"):
    column = layout.column(align=True)
    for i, line in enumerate(wrapped(text, max(20, int(context.region.width / (7.5 * context.preferences.system.ui_scale))))):
        column.label(text=line, icon=icon if i == 0 else "BLANK1" if icon != "NONE" else "NONE")


class _Panel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Delmesh"

    @classmethod
    def poll(cls, context):
        return context.mode in cls.modes and not native.problem()


class VIEW3D_PT_delmesh(_Panel, bpy.types.Panel):
    bl_label = "Delaunay Remesh"

    @classmethod
    def poll(cls, context):
        return context.mode in {"OBJECT", "EDIT_MESH"}

    def draw(self, context):
        layout = aligned(self.layout)
        problem = native.problem()
        if problem:
            layout.label(text="The native library is missing", icon="ERROR")
            _lines(layout, context, problem)
            return
        settings = context.scene.delmesh.remesh
        settings.draw_remesh(layout, context.mode == "EDIT_MESH")
        ob = context.active_object
        if ob and ob.type == "MESH":
            for lost in cautions.losses(ob, True, settings.custom_normals):
                _lines(layout, context, f"Not kept: {lost}", "ERROR")
            if cautions.uneven_scale(ob):
                _lines(layout, context, "Scaled unevenly: apply the scale first", "ERROR")
        _operator(layout, OBJECT_OT_delmesh_remesh, settings, settings, icon="MESH_DATA")


class VIEW3D_PT_delmesh_lod(_Panel, bpy.types.Panel):
    bl_label = "LOD Family"
    modes = {"OBJECT"}

    def draw(self, context):
        layout = aligned(self.layout)
        settings = context.scene.delmesh
        ob = context.active_object
        settings.lod.draw_lod(layout, ob)
        if settings.lod.source == "CAGE" and ob and ob.type == "MESH":
            _lines(layout, context, cage.told(ob, settings.lod.cage_level))
        _operator(layout, OBJECT_OT_delmesh_lod, settings.lod, settings.remesh, icon="MOD_DECIM")
        layout.prop(settings, "shown_level")
        layout.prop(settings, "gltf_lods")


class VIEW3D_PT_delmesh_keep(_Panel, bpy.types.Panel):
    """For both operators."""
    bl_label = "Keep"
    bl_options = {"DEFAULT_CLOSED"}
    modes = {"OBJECT", "EDIT_MESH"}

    def draw(self, context):
        context.scene.delmesh.remesh.draw_keep(aligned(self.layout))


class VIEW3D_PT_delmesh_check(_Panel, bpy.types.Panel):
    bl_label = "Check"
    modes = {"OBJECT"}

    def draw(self, context):
        layout = self.layout
        row = layout.row(align=True)
        button = row.operator(OBJECT_OT_delmesh_check.bl_idname, icon="VIEWZOOM")
        button.boundary = context.scene.delmesh.remesh.boundary
        button.select = False
        button = row.operator(OBJECT_OT_delmesh_check.bl_idname, text="", icon="EDGESEL")
        button.boundary = context.scene.delmesh.remesh.boundary
        button.select = True
        layout.prop(context.scene.delmesh, "show_overlay")
        ob = context.active_object
        if not ob or ob.type != "MESH":
            return
        found = ob.data.delmesh_check
        if not found.is_of(ob.data):
            layout.label(text="Not checked yet" if found.vertices < 0 else "Changed since it was checked")
            return
        layout.label(text="Delaunay" if found.delaunay else "Not Delaunay", icon="CHECKMARK" if found.delaunay else "ERROR")
        column = layout.column(align=True)
        for name, value in (("Edges inside", number(found.nld_interior)), ("Border edges", number(found.nld_boundary)),
                            ("Without area", number(found.zero_area_faces)),
                            ("Negative cotangents", number(found.negative_cotangents)),
                            ("Smallest angle", f"{found.min_angle:.2f}°"), ("Largest angle", f"{found.max_angle:.2f}°")):
            row = column.split(factor=0.68)
            row.label(text=name)
            row.label(text=value)


CLASSES = (VIEW3D_PT_delmesh, VIEW3D_PT_delmesh_lod, VIEW3D_PT_delmesh_keep, VIEW3D_PT_delmesh_check)


def draw_menu(self, context):
    self.layout.separator()
    if native.problem():
        self.layout.operator(OBJECT_OT_delmesh_remesh.bl_idname)
        return
    settings = context.scene.delmesh
    _operator(self.layout, OBJECT_OT_delmesh_remesh, settings.remesh, settings.remesh)
    _operator(self.layout, OBJECT_OT_delmesh_lod, settings.lod, settings.remesh)
    self.layout.operator(OBJECT_OT_delmesh_check.bl_idname).boundary = settings.remesh.boundary


def draw_edit_menu(self, context):
    self.layout.separator()
    if native.problem():
        self.layout.operator(OBJECT_OT_delmesh_remesh.bl_idname)
    else:
        _operator(self.layout, OBJECT_OT_delmesh_remesh, context.scene.delmesh.remesh, context.scene.delmesh.remesh)


def draw_in_data(self, context):
    settings = context.scene.delmesh.remesh
    if not native.problem():
        _operator(self.layout, OBJECT_OT_delmesh_remesh, settings, settings)


def register():
    bpy.types.VIEW3D_MT_object.append(draw_menu)
    bpy.types.VIEW3D_MT_edit_mesh.append(draw_edit_menu)
    bpy.types.DATA_PT_remesh.append(draw_in_data)


def unregister():
    bpy.types.DATA_PT_remesh.remove(draw_in_data)
    bpy.types.VIEW3D_MT_edit_mesh.remove(draw_edit_menu)
    bpy.types.VIEW3D_MT_object.remove(draw_menu)
