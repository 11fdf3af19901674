# SPDX-License-Identifier: GPL-3.0-or-later
"""What the file and the preferences remember: the panel's settings, in the scene; what a check found, in the mesh."""
import math

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import native
from .lods import show_level
from .options import LodOptions, RemeshOptions, boundary
from .text import wrapped


class DelmeshRemeshSettings(RemeshOptions, bpy.types.PropertyGroup):
    """Begins with what does least harm to a model that was made by hand; scripts get the operator's own defaults."""

    mode: EnumProperty(name="Mode", items=RemeshOptions.__annotations__["mode"].keywords["items"], default="FEATURE",
                       description="What may change to make every edge Delaunay")
    max_normal_turn: FloatProperty(
        name="Max Turn", description="By how much a flip may turn the surface; edges that would turn it more are split. "
        "At 180° any flip is allowed", subtype="ANGLE", default=math.radians(60), min=0, max=math.pi)
    boundary: boundary("IGNORE")
    growth_limit: FloatProperty(
        name="Growth Limit", description="Leave a mesh alone if preserving its shape would take more vertices than so many times "
        "its own. At 0 there is no limit", default=4, min=0, soft_max=20)


class DelmeshLodSettings(LodOptions, bpy.types.PropertyGroup):
    boundary: boundary("IGNORE")
    fit: BoolProperty(name="Fit Textures", description=LodOptions.__annotations__["fit"].keywords["description"], default=True)


class DelmeshSettings(bpy.types.PropertyGroup):
    remesh: PointerProperty(type=DelmeshRemeshSettings)
    lod: PointerProperty(type=DelmeshLodSettings)
    shown_level: IntProperty(name="Show Level", description="Hide all levels but this one; at -1 all are shown", default=-1, min=-1,
                             soft_max=8, update=lambda settings, context: show_level(context, settings.shown_level))
    gltf_lods: BoolProperty(name="MSFT_lod in glTF", default=False,
                            description="Write families to glTF files as one node with levels, which Babylon and others read")
    show_overlay: BoolProperty(name="Show in Viewport", description="Draw the edges that the last check found", default=True)


class DelmeshCheck(bpy.types.PropertyGroup):
    """Of a mesh: what Check Delaunay found, and of how many vertices and faces, to see when it is out of date."""

    vertices: IntProperty(default=-1)
    polygons: IntProperty()
    boundary: StringProperty()
    delaunay: BoolProperty()
    nld_interior: IntProperty()
    nld_boundary: IntProperty()
    zero_area_faces: IntProperty()
    negative_cotangents: IntProperty()
    min_angle: FloatProperty()
    max_angle: FloatProperty()

    def set(self, mesh, report, rule):
        self.vertices, self.polygons, self.boundary = len(mesh.vertices), len(mesh.polygons), rule
        for name in ("nld_interior", "nld_boundary", "zero_area_faces", "negative_cotangents", "min_angle", "max_angle"):
            setattr(self, name, report[name])
        self.delaunay = bool(report["delaunay"])

    def is_of(self, mesh):
        return (self.vertices, self.polygons) == (len(mesh.vertices), len(mesh.polygons))


class DelmeshPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    isolate: BoolProperty(
        name="Isolation", default=True, description="Run the library in a process of its own: should it crash, Blender does not")
    path_to_library: StringProperty(
        name="Library", subtype="FILE_PATH", update=native.forget,
        description="The native library to use instead of the one that comes with the add-on")

    def draw(self, _context):
        layout = self.layout
        layout.prop(self, "isolate")
        layout.prop(self, "path_to_library")
        problem = native.problem()
        for line in wrapped(problem or f"Native library {native.load().version()}", 100):
            layout.label(text=line, icon="ERROR" if problem else "CHECKMARK")


CLASSES = (DelmeshRemeshSettings, DelmeshLodSettings, DelmeshSettings, DelmeshCheck, DelmeshPreferences)


def register():
    bpy.types.Scene.delmesh = PointerProperty(type=DelmeshSettings)
    bpy.types.Mesh.delmesh_check = PointerProperty(type=DelmeshCheck)


def unregister():
    del bpy.types.Mesh.delmesh_check
    del bpy.types.Scene.delmesh
