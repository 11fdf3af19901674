# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the operator is found: the Object menu (and so the search), a tab of the 3D view's sidebar; and the preferences."""
import bpy

from . import native
from .operators import OBJECT_OT_delmesh_remesh


class VIEW3D_PT_delmesh(bpy.types.Panel):
    bl_label = "Delaunay Remesh"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Delmesh"
    bl_context = "objectmode"

    def draw(self, context):
        layout = self.layout
        problem = native.problem()
        if problem:
            column = layout.column()
            column.label(text="The native library is missing", icon="ERROR")
            for line in wrapped(problem, max(20, context.region.width // 8)):
                column.label(text=line)
            return
        column = layout.column()
        for item in OBJECT_OT_delmesh_remesh.__annotations__["mode"].keywords["items"]:
            column.operator(OBJECT_OT_delmesh_remesh.bl_idname, text=item[1]).mode = item[0]


def wrapped(text, width):
    """Labels do not wrap."""
    line = ""
    for word in text.split():
        if line and len(line) + 1 + len(word) > width:
            yield line
            line = word
        else:
            line = f"{line} {word}".strip()
    yield line


class DelmeshPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    path_to_library: bpy.props.StringProperty(
        name="Library", subtype="FILE_PATH", update=native.forget,
        description="The native library to use instead of the one that comes with the add-on")

    def draw(self, context):
        layout = self.layout
        layout.prop(self, "path_to_library")
        problem = native.problem()
        for line in wrapped(problem or f"Native library {native.load().version()}", 100):
            layout.label(text=line, icon="ERROR" if problem else "CHECKMARK")


def draw_menu(self, _context):
    self.layout.separator()
    self.layout.operator(OBJECT_OT_delmesh_remesh.bl_idname)
