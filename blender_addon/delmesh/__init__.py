# SPDX-License-Identifier: GPL-3.0-or-later
"""Delmesh: Delaunay remeshing for Blender. A user of the delmesh Python package, which is the way to the C library.

native.py finds the package; exchange.py reads and writes meshes; marks.py says which edges must stay; operators.py and panel.py
are what the user sees.
"""
import bpy

from . import native, operators, panel

bl_info = {
    "name": "Delmesh",
    "author": "The libdelmesh developers",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Object menu, and View3D > Sidebar > Delmesh",
    "description": "Delaunay remeshing with an exact certificate",
    "category": "Mesh",
}

_CLASSES = (operators.OBJECT_OT_delmesh_remesh, panel.VIEW3D_PT_delmesh, panel.DelmeshPreferences)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.VIEW3D_MT_object.append(panel.draw_menu)


def unregister():
    bpy.types.VIEW3D_MT_object.remove(panel.draw_menu)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
    native.forget()
