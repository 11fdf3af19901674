# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator Delaunay LOD Family."""
import itertools
import re
import time

import bpy
import numpy as np

from . import cage, cautions, exchange, survive
from .operators import Cautions, can_run, repairs, selected_meshes
from .options import LodOptions, aligned
from .runner import Request, Running, read_all
from .text import number

LEVEL, SOURCE = "delmesh_lod", "delmesh_lod_of"  # custom properties of the objects made
_STOPPED_BY = {"topology": "its holes and parts", "delaunay": "what can be Delaunay",
               "features": "edges and vertices that are kept"}


class OBJECT_OT_delmesh_lod(Running, LodOptions, bpy.types.Operator):
    """Make coarser and coarser Delaunay levels of the selected meshes, with all attributes"""
    bl_idname = "object.delmesh_lod"
    bl_label = "Delaunay LOD Family"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    _temporary = ()  # names of meshes that go when the run is over

    @classmethod
    def poll(cls, context):
        return can_run(cls, context)

    def draw(self, context):
        layout = aligned(self.layout)
        self.draw_lod(layout, context.active_object)
        self.draw_keep(layout)

    def _requests(self, context):
        self._began = time.perf_counter()
        self._cautions = Cautions()
        return (yield from read_all(selected_meshes(self, context),
                                    lambda mesh, objects: self._request(context, mesh, objects[0])))

    def _request(self, context, mesh, ob):
        options, template, triangles = self.lod_options(), mesh, None
        if self.source == "CAGE":
            modifier = self._modifier(ob)
            options["cage"] = cage.settings(modifier, self.cage_level)
            before, after = cage.around(ob, modifier)
            if any(each.show_viewport for each in before):
                template = self._evaluated(context, ob, {modifier, *after})
            triangles = cage.triangles(template, options["cage"]["rate"])
        elif self.source == "EVALUATED":
            template = self._evaluated(context, ob)
        density = self._density(ob)
        data = yield from exchange.reading(template, ob, self._custom_normals())
        size = float(np.linalg.norm(np.ptp(data.positions, axis=0))) if len(data.positions) else 0.0
        options["targets"] = self.targets(size, cautions.scale_of(ob))
        if self.lod0 == "REMESHED":
            options["targets"].insert(0, "full")
        self._caution(ob, template)
        return Request("lod", data, self.kept(), options, ob, triangles, template=template.name, density=density,
                       matrix=np.array(ob.matrix_world))

    @staticmethod
    def _prepare(requests):
        for request in requests:
            if request.more["density"] and request.data.weights:
                _add_density(request, *request.more["density"])
        for i, verts in shared_borders([(request.data, request.more["matrix"]) for request in requests]).items():
            requests[i].options["locked_verts"] = verts

    def _evaluated(self, context, ob, without=()):
        mesh = evaluated(context, ob, without)
        self._temporary = [*self._temporary, mesh.name]
        return mesh

    def _custom_normals(self):
        """The limit surface is smooth by itself."""
        return self.custom_normals and self.source != "CAGE"

    def _modifier(self, ob):
        modifier = cage.modifier_of(ob)
        if not modifier:
            raise survive.Refused(cage.missing(ob))
        before, after = cage.around(ob, modifier)
        for modifiers, what in ((before, "applied to the cage"), (after, "left to the levels")):
            names = [each.name for each in modifiers if each.show_viewport]
            if names:
                self._cautions.add(f"modifiers {what}: {', '.join(names)}", ob)
        return modifier

    def _density(self, ob):
        """The vertex group's number and what triangles it makes smaller by, None without."""
        group = ob.vertex_groups.get(self.density_group) if self.density_group else None
        if self.density_group and not group:
            self._cautions.add(f"has no vertex group {self.density_group}", ob)
        return group and (group.index, float(self.density_factor))

    def _caution(self, ob, template):
        for lost in cautions.losses(ob, False, self._custom_normals()):
            self._cautions.add(f"not kept: {lost}", ob)
        if cautions.uneven_scale(ob):
            self._cautions.add("scaled unevenly: Delaunay in the object's own space only; apply the scale first", ob)
        for material in cautions.normal_mapped(template):
            self._cautions.add(f"bake the normal map of {material} anew for the levels", ob)

    def _finish(self, context, requests):
        counts = []
        for request in requests:
            ob = request.object()
            levels = self._make(request, ob)
            repairs(self._cautions, ob, request.outcome.report)
            if "locked_verts" in request.options and self.boundary == "NONOBTUSE":
                self._cautions.add("shares borders with another object; with Borders set to Keep they fit afterwards", ob)
            for name, level in zip(levels, request.outcome.levels):
                stopped_by = _STOPPED_BY.get(level["stopped_by"])
                if level["stopped_by"] == "bound":
                    off = level["bound"] * cautions.scale_of(ob)
                    self._cautions.add(f"{name} is proven to be off by no more than {off:.4g} only; less if Prepare is Preserve "
                                       "Shape", ob)
                elif stopped_by:
                    self._cautions.add(f"{name} has {number(level['faces'])} triangles: {stopped_by} stopped it", ob)
            counts.append([level["faces"] for level in request.outcome.levels])
        self._cautions.report(self)
        faces = sum(request.outcome.report["faces_in"] for request in requests)
        steps = " -> ".join(number(sum(column)) for column in zip(*counts))
        self.report({"INFO"}, f"{len(requests)} mesh{'es' if len(requests) > 1 else ''}: {number(faces)} -> {steps} triangles, "
                              f"Delaunay, in {time.perf_counter() - self._began:.1f} s")
        return {"FINISHED"}

    def _make(self, request, ob):
        """-> names of the objects of the levels, without LOD0 if that is the original."""
        if self.replace:
            remove_levels(ob.name)
        base = re.sub(r"_LOD0$", "", ob.name)
        place = (ob.users_collection or (bpy.context.scene.collection,))[0]
        collection = bpy.data.collections.new(f"{base}_LODs")
        place.children.link(collection)
        root = self._root(base, ob, collection)
        template = bpy.data.meshes[request.more["template"]]
        if self.lod0 == "ORIGINAL" and base == ob.name:
            self._level(ob, ob.data, f"{base}_LOD0", 0, root, collection)
        first = 0 if self.lod0 == "REMESHED" else 1
        names = []
        for n, data in enumerate(request.outcome.meshes, first):
            mesh = template.copy()
            mesh.name = f"{base}_LOD{n}"
            level = self._level(ob, mesh, mesh.name, n, root, collection)
            for modifier in self._applied(level):
                level.modifiers.remove(modifier)
            exchange.write(data, mesh, level, exchange.Settings(template, level))
            names.append(level.name)
        return names

    def _applied(self, ob):
        """The modifiers that levels do not need any more."""
        if self.source == "BASE":
            return []
        if self.source == "CAGE":
            modifier = cage.modifier_of(ob)
            return [*cage.around(ob, modifier)[0], modifier]
        return [modifier for modifier in ob.modifiers if modifier.type != "ARMATURE"]

    def _root(self, base, ob, collection):
        """The empty above the levels, where there is to be one: where the object is, and below the same parent."""
        if self.structure not in ("UNITY", "UNREAL"):
            return None
        root = bpy.data.objects.new(f"{base}_LODs", None)
        collection.objects.link(root)
        root.parent, root.parent_type, root.parent_bone = ob.parent, ob.parent_type, ob.parent_bone
        root.matrix_parent_inverse = ob.matrix_parent_inverse
        root.matrix_basis = ob.matrix_basis
        root[SOURCE] = ob.name
        if self.structure == "UNREAL":
            root["fbx_type"] = "LodGroup"
        return root

    @staticmethod
    def _level(ob, mesh, name, number_, root, collection):
        level = ob.copy()
        level.data, level.name = mesh, name
        level[LEVEL], level[SOURCE] = number_, ob.name
        collection.objects.link(level)
        level.select_set(False)
        if root:
            level.parent, level.parent_type = root, "OBJECT"
            level.matrix_parent_inverse = ob.matrix_basis.inverted_safe()  # the root has that transform already
        return level

    def _over(self):
        for name in self._temporary:
            mesh = bpy.data.meshes.get(name)
            if mesh:  # others may have removed it meanwhile
                bpy.data.meshes.remove(mesh)
        self._temporary = ()


def evaluated(context, ob, without=()):
    """-> a new mesh: what the modifiers make of the object, but those of armatures and those in `without`."""
    hidden = [modifier for modifier in ob.modifiers if modifier.type == "ARMATURE" or modifier in without]
    shown = [modifier.show_viewport for modifier in hidden]
    try:
        for modifier in hidden:
            modifier.show_viewport = False
        graph = context.evaluated_depsgraph_get()
        graph.update()
        return bpy.data.meshes.new_from_object(ob.evaluated_get(graph), preserve_all_data_layers=True, depsgraph=graph)
    finally:
        for modifier, value in zip(hidden, shown):
            modifier.show_viewport = value


def remove_levels(name):
    """Removes the levels that were made of the object of that name, and their meshes and collections if nothing else uses them."""
    for level in [ob for ob in bpy.data.objects if ob.get(SOURCE) == name]:
        collections, mesh = level.users_collection, level.data
        bpy.data.objects.remove(level)
        if mesh and not mesh.users:
            bpy.data.meshes.remove(mesh)
        for collection in collections:
            if not collection.all_objects and collection.name.startswith(re.sub(r"_LOD0$", "", name)):
                bpy.data.collections.remove(collection)


def show_level(context, number_):
    """Hides all levels but the one of that number, and the objects that they were made of; -1 shows everything."""
    objects = context.view_layer.objects
    sources = {ob.get(SOURCE) for ob in objects}
    for ob in objects:
        if LEVEL in ob or ob.name in sources:
            ob.hide_set(number_ >= 0 and ob.get(LEVEL) != number_)


def _add_density(request, group, factor):
    rows, weights = request.data.weights, np.zeros(len(request.data.positions))
    there = rows.indices == group
    weights[np.repeat(np.arange(len(weights)), np.diff(rows.offsets))[there]] = rows.values[there]
    request.options["vert_weights"] = factor ** weights


def shared_borders(parts):
    """parts: (MeshData, matrix to the scene). -> {number of the part: (v,) bool} of border vertices that lie where another part has
    one: decimation must leave them alone, for the parts to fit afterwards."""
    if len(parts) < 2:
        return {}
    places, owners, verts = [], [], []
    for i, (data, matrix) in enumerate(parts):
        border = np.flatnonzero(data.border_verts())
        places.append(data.positions[border] @ matrix[:3, :3].T + matrix[:3, 3])
        owners.append(np.full(len(border), i))
        verts.append(border)
    places, owners, verts = np.concatenate(places), np.concatenate(owners), np.concatenate(verts)
    if not len(places):
        return {}
    # Transforms round. What is as near as that falls into one cell of at least one of these grids.
    step = 1e-5 * max(float(np.ptp(places, axis=0).max()), 1e-30)
    shared = np.zeros(len(places), bool)
    for shift in itertools.product((0, 0.5), repeat=3):
        _, cell = np.unique(np.floor(places / step + shift), axis=0, return_inverse=True)
        cell = cell.reshape(-1)
        low, high = np.full(cell.max() + 1, len(parts)), np.full(cell.max() + 1, -1)
        np.minimum.at(low, cell, owners)
        np.maximum.at(high, cell, owners)
        shared |= (low != high)[cell]
    locked = {}
    for i in np.unique(owners[shared]).tolist():
        locked[i] = np.zeros(len(parts[i][0].positions), bool)
        locked[i][verts[shared & (owners == i)]] = True
    return locked
