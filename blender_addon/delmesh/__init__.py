# SPDX-License-Identifier: GPL-3.0-or-later
"""Delmesh: Delaunay remeshing and LOD families for Blender. A user of the delmesh Python package, which is the way to the library.

    native.py      finds the package
    meshdata.py    a mesh with everything on it, as arrays
    exchange.py    Blender meshes to that and back
    survive.py     what is done to it; limit.py: of its limit surface. Without bpy
    runner.py      runs that in a thread, with meshes read piece by piece, so that a window stays alive
    isolation.py   ... and in another process: helper.py, shared.py
    options.py     of the operators; settings.py: what files remember
    operators.py   Delaunay Remesh, Check Delaunay; lods.py: Delaunay LOD Family; gltf.py: families in glTF files
    cage.py        what a Subdivision Surface modifier says
    cautions.py    what users should know before
    panel.py, overlay.py   what they see
"""
import bpy

from . import gltf, isolation, lods, native, operators, overlay, panel, runner, settings

bl_info = {
    "name": "Delmesh",
    "author": "The libdelmesh developers",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Object menu, and View3D > Sidebar > Delmesh",
    "description": "Delaunay remeshing and LOD families, with an exact certificate",
    "category": "Mesh",
}

glTF2ExportUserExtension = gltf.glTF2ExportUserExtension  # where the exporter looks for it

_CLASSES = (*settings.CLASSES, operators.OBJECT_OT_delmesh_remesh, lods.OBJECT_OT_delmesh_lod, operators.OBJECT_OT_delmesh_check,
            *panel.CLASSES)
_PARTS = (settings, panel, overlay)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    for part in _PARTS:
        part.register()


def unregister():
    runner.end()
    for part in reversed(_PARTS):
        part.unregister()
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
    isolation.close()
    native.forget()
