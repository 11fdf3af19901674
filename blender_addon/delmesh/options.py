# SPDX-License-Identifier: GPL-3.0-or-later
"""The options of the operators. The operators and the panel's settings have the same ones, by inheritance; where the panel begins
with other values than a script gets, it says so in settings.py."""
import math

from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from . import survive

BOUNDARIES = [("NONOBTUSE", "Non-Obtuse", "No angle opposite to a border edge is larger than 90°; splits border edges"),
              ("IGNORE", "Keep", "Border edges stay as they are, so that neighbouring parts of a kit still fit")]


def boundary(default):
    return EnumProperty(name="Borders", description="What is asked of the open borders of a mesh", items=BOUNDARIES,
                        default=default)


def aligned(layout):
    """The layout, with names beside values, as Blender's own panels have them."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    return layout


class KeepOptions:
    """What edges are kept for, and what goes along."""

    keep_seams: BoolProperty(name="Seams", description="Keep edges that are marked as seams", default=True)
    keep_sharp: BoolProperty(name="Sharp Edges", description="Keep edges that are marked as sharp", default=True)
    keep_creases: BoolProperty(name="Creases and Bevels", default=True,
                               description="Keep edges with a crease or a bevel weight")
    keep_freestyle: BoolProperty(name="Freestyle Marks", description="Keep edges that are marked for Freestyle", default=True)
    keep_materials: BoolProperty(name="Material Borders", description="Keep edges between two materials", default=True)
    keep_uv_borders: BoolProperty(
        name="UV Borders", description="Keep edges where a UV map is discontinuous, and in flat places those where it bends. "
        "Without it textures smear where such edges were flipped", default=True)
    keep_colors: BoolProperty(name="Color Borders", default=False,
                              description="Keep edges where a color attribute of face corners is discontinuous")
    keep_face_sets: BoolProperty(name="Face Sets", description="Keep edges between two face sets of sculpt mode", default=False)
    keep_normals: BoolProperty(name="Custom Normal Borders", default=True,
                               description="Keep edges where custom normals are discontinuous")
    custom_normals: BoolProperty(name="Custom Normals", default=True,
                                 description="Carry custom normals over. Takes time on large meshes; without it they are dropped")

    def kept(self):
        return tuple(word for word in survive.KEEP if getattr(self, "keep_" + word))

    def draw_keep(self, layout):
        column = layout.column(heading="Keep")
        for word in survive.KEEP:
            column.prop(self, "keep_" + word)
        layout.prop(self, "custom_normals")


class RemeshOptions(KeepOptions):
    mode: EnumProperty(
        name="Mode", default="PRESERVE", description="What may change to make every edge Delaunay",
        items=[("PRESERVE", "Preserve Shape", "Keep the surface: split edges, flip only in flat places. Adds the most vertices"),
               ("FLIP", "Flip", "Flip edges; add vertices only where no flip is possible. Changes the shape slightly"),
               ("FEATURE", "Keep Features", "Flip edges, but keep those sharper than an angle")])
    feature_angle: FloatProperty(
        name="Angle", description="Edges whose faces meet at a sharper angle than this keep their shape",
        subtype="ANGLE", default=math.radians(30), min=0, max=math.pi)
    max_normal_turn: FloatProperty(
        name="Max Turn", description="By how much a flip may turn the surface; edges that would turn it more are split. "
        "At 180° any flip is allowed", subtype="ANGLE", default=math.pi, min=0, max=math.pi)
    tolerance: FloatProperty(
        name="Tolerance", description="How far Preserve Shape may move the surface, in the scene's units. At 0 as far as the "
        "rounding of coordinates does", subtype="DISTANCE", unit="LENGTH", default=0, min=0, precision=5)
    boundary: boundary("NONOBTUSE")
    growth_limit: FloatProperty(
        name="Growth Limit", description="Leave a mesh alone if preserving its shape would take more vertices than so many times "
        "its own. At 0 there is no limit", default=0, min=0, soft_max=20)
    as_copy: BoolProperty(name="As a Copy", description="Leave the objects as they are and make new ones", default=False)

    def draw_remesh(self, layout, editing):
        """editing: only selected faces, the border of which stays."""
        layout.prop(self, "mode")
        if self.mode == "PRESERVE":
            layout.prop(self, "tolerance")
            layout.prop(self, "growth_limit")
        else:
            if self.mode == "FEATURE":
                layout.prop(self, "feature_angle")
            layout.prop(self, "max_normal_turn")
        if not editing:
            layout.prop(self, "boundary")
            layout.prop(self, "as_copy")

    def remesh_options(self, scale):
        """For survive.remesh. scale: scene units of an object's unit."""
        return {"mode": self.mode.lower(), "boundary": self.boundary.lower(), "feature_angle": math.degrees(self.feature_angle),
                "max_normal_turn": survive.to_degrees(self.max_normal_turn),
                "tolerance": self.tolerance / scale if self.tolerance else -1.0, "growth_limit": self.growth_limit}


class LodOptions(KeepOptions):
    by: EnumProperty(
        name="Levels By", default="RATIO", description="What tells how coarse a level is",
        items=[("RATIO", "Ratio", "Shares of the original's triangles"), ("COUNT", "Triangles", "Numbers of triangles"),
               ("DEVIATION", "Deviation", "Distances from the original that are proven to be kept, in the scene's units"),
               ("SCREEN", "Screen Size", "Shares of the screen's height at which a level comes into use: it then deviates by no "
                "more than Pixel Error")])
    ratios: StringProperty(name="Ratios", description="Shares of the original's triangles, e.g. 0.5,0.1", default="0.5,0.1")
    counts: StringProperty(name="Triangles", description="Numbers of triangles, e.g. 10000,2000", default="10000,2000")
    deviations: StringProperty(name="Deviations", description="Distances in the scene's units, e.g. 0.01,0.05",
                               default="0.01,0.05")
    screen_sizes: StringProperty(name="Screen Sizes", description="Shares of the screen's height, e.g. 0.5,0.25,0.1",
                                 default="0.5,0.25,0.1")
    pixel_error: FloatProperty(name="Pixel Error", description="How far a level may be off on the screen", default=1, min=0.01,
                               soft_max=10, subtype="PIXEL")
    screen_height: IntProperty(name="Screen Height", description="Pixels", default=1080, min=1, subtype="PIXEL")
    source: EnumProperty(
        name="Source", default="BASE", description="What the levels are made of",
        items=[("BASE", "Base Mesh", "The mesh without modifiers; the levels have the same modifiers and shape keys"),
               ("EVALUATED", "With Modifiers", "What the modifiers make of the mesh, but those of an armature, which the levels "
                "keep; shape keys are applied"),
               ("CAGE", "Subdivision Cage", "The smooth surface that a Subdivision Surface modifier stands for. Textures, shape "
                "keys, weights are those of the cage, and exact on every level")])
    cage_level: IntProperty(name="Level", description="Subdivisions that the levels are made of; at 0 as the modifier has for "
                            "renders", default=0, min=0, soft_max=7, max=10)
    lod0: EnumProperty(
        name="LOD0", default="ORIGINAL", description="What the finest level is",
        items=[("ORIGINAL", "Original", "An object with the original's own mesh"),
               ("REMESHED", "Delaunay", "The whole mesh made Delaunay"), ("NONE", "None", "Levels begin with LOD1")])
    prepare: EnumProperty(
        name="Prepare", default="FLIP", description="How the mesh becomes Delaunay before it is decimated",
        items=[("FLIP", "Flip", "Edges are flipped"), ("FEATURE", "Keep Features", "Edges sharper than Angle are kept"),
               ("PRESERVE", "Preserve Shape", "The surface stays; adds vertices first")])
    feature_angle: FloatProperty(name="Angle", description="Edges whose faces meet at a sharper angle are kept",
                                 subtype="ANGLE", default=math.radians(30), min=0, max=math.pi)
    boundary: boundary("NONOBTUSE")
    quality: IntProperty(name="Relaxation", description="Sweeps in which the vertices of a level move to where it fits the "
                         "original better. 6 is most of what there is to gain", default=0, min=0, soft_max=10)
    uv_weight: FloatProperty(name="UV Weight", description="How much the texture's place counts beside the shape", default=1, min=0,
                             soft_max=10)
    normal_weight: FloatProperty(name="Normal Weight", description="How much custom normals count beside the shape; 0.1 is a good "
                                 "start", default=0, min=0, soft_max=1)
    fit: BoolProperty(name="Fit Textures", description="UV maps, colors and custom normals of a level are those that are right all "
                      "over its triangles, in the mean, instead of at their corners; seams stay exact", default=False)
    density_group: StringProperty(name="Density", description="A vertex group: where its weight is larger, more triangles stay")
    density_factor: FloatProperty(name="Factor", description="By how much an error counts more where the weight is 1", default=10,
                                  min=0.01, soft_max=100)
    structure: EnumProperty(
        name="Structure", default="COLLECTION", description="Where the levels go and how they are called",
        items=[("COLLECTION", "Collection", "Name_LOD0, Name_LOD1, ... in a collection Name_LODs"),
               ("UNITY", "Unity", "Children Name_LOD0, Name_LOD1, ... of an empty Name_LODs: an FBX of them gives an LODGroup"),
               ("UNREAL", "Unreal", "The same under an empty with the custom property fbx_type, which the FBX exporter turns into "
                "an LodGroup"),
               ("GODOT", "Godot", "The same in a collection, for one glTF file; Godot has visibility ranges to set by hand")])
    replace: BoolProperty(name="Replace", description="Remove the levels that were made of the same objects before", default=True)

    def draw_lod(self, layout, ob):
        """ob: whose vertex groups are offered, or None."""
        layout.prop(self, "by")
        layout.prop(self, {"RATIO": "ratios", "COUNT": "counts", "DEVIATION": "deviations", "SCREEN": "screen_sizes"}[self.by])
        if self.by == "SCREEN":
            layout.prop(self, "pixel_error")
            layout.prop(self, "screen_height")
        layout.prop(self, "source")
        if self.source == "CAGE":
            layout.prop(self, "cage_level")
        layout.prop(self, "lod0")
        layout.prop(self, "structure")
        layout.prop(self, "replace")
        layout.separator()
        layout.prop(self, "prepare")
        if self.prepare == "FEATURE":
            layout.prop(self, "feature_angle")
        layout.prop(self, "boundary")
        layout.prop(self, "quality")
        if self.source != "CAGE":
            layout.prop(self, "uv_weight")
            if ob and ob.type == "MESH" and ob.data.has_custom_normals:
                layout.prop(self, "normal_weight")
            layout.prop(self, "fit")
        if ob and ob.type == "MESH":
            layout.prop_search(self, "density_group", ob, "vertex_groups")
        else:
            layout.prop(self, "density_group")
        if self.density_group:
            layout.prop(self, "density_factor")

    def targets(self, size, scale):
        """For delmesh.lod_family. size: the diagonal of the object's bounding box, in its own units. Raises Refused."""
        kind, text = {"RATIO": ("ratio", self.ratios), "COUNT": ("faces", self.counts), "DEVIATION": ("deviation", self.deviations),
                      "SCREEN": ("deviation", self.screen_sizes)}[self.by]
        try:
            values = [float(word) for word in text.replace(";", ",").split(",") if word.strip()]
        except ValueError:
            values = []
        if not values or not all(0 < value < math.inf for value in values):
            raise survive.Refused(f"'{text}' is no list of numbers like 0.5,0.1")
        if self.by == "COUNT":
            values = [int(value) for value in values]
        if self.by == "DEVIATION":
            values = [value / scale for value in values]
        if self.by == "SCREEN":  # a model of this share of the screen's height has so many pixels
            values = [self.pixel_error * size / (value * self.screen_height) for value in values]
        values.sort(reverse=kind != "deviation")
        return [(kind, value) for value in values]

    def lod_options(self):
        """For survive.lod."""
        return {"prepare": self.prepare.lower(), "boundary": self.boundary.lower(), "quality": self.quality,
                "feature_angle": math.degrees(self.feature_angle), "uv_weight": self.uv_weight,
                "normal_weight": self.normal_weight, "fit": self.fit}


class CheckOptions:
    boundary: boundary("NONOBTUSE")
    select: BoolProperty(name="Select Edges", description="Go to edit mode with the edges selected that are not Delaunay",
                         default=True)
