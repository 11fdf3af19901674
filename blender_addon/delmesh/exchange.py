# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender meshes as numpy arrays and back. What Blender stores as attributes goes through them (fast since 3.5); what an older
Blender keeps elsewhere (UV maps, edge marks, smooth flags in 3.4) goes through its properties. Exact types matter: with another
dtype foreach_get is many times slower."""
import bpy
import numpy as np

# type of an attribute -> (property of its elements, numbers per element, dtype)
_TYPES = {"FLOAT": ("value", 1, np.float32), "INT": ("value", 1, np.int32), "INT8": ("value", 1, np.int32),
          "BOOLEAN": ("value", 1, bool), "FLOAT_VECTOR": ("vector", 3, np.float32), "FLOAT2": ("vector", 2, np.float32),
          "INT32_2D": ("value", 2, np.int32), "QUATERNION": ("value", 4, np.float32),
          "FLOAT_COLOR": ("color", 4, np.float32), "BYTE_COLOR": ("color", 4, np.float32)}
# The mesh itself, and what is only valid for the very corners it was made for.
_STRUCTURE = {"position", ".edge_verts", ".corner_vert", ".corner_edge", "custom_normal"}
# Before 4.0 not attributes: (collection, property, dtype)
_LEGACY = [("edges", "use_seam", bool), ("edges", "use_edge_sharp", bool), ("edges", "crease", np.float32),
           ("edges", "bevel_weight", np.float32), ("vertices", "bevel_weight", np.float32), ("polygons", "use_smooth", bool)]
_ACTIVE = [("attributes", "active_index"), ("attributes", "active_color_index"), ("attributes", "render_color_index"),
           ("uv_layers", "active_index")]


def _get(collection, name, dtype, components=1):
    values = np.empty(len(collection) * components, dtype)
    collection.foreach_get(name, values)
    return values if components == 1 else values.reshape(-1, components)


def _get_attribute(mesh, name, collection, fallback, dtype, components):
    attribute = mesh.attributes.get(name)
    if attribute:
        return _get(attribute.data, "vector" if components == 3 else "value", dtype, components)
    return _get(collection, fallback, dtype, components)


def _set(collection, name, values):
    collection.foreach_set(name, np.ascontiguousarray(values).reshape(-1))


def _set_attribute(mesh, name, collection, fallback, values):
    attribute = mesh.attributes.get(name)
    if attribute:
        _set(attribute.data, "vector" if values.ndim == 2 and values.shape[1] == 3 else "value", values)
    else:
        _set(collection, fallback, values)


class Layer:
    """One attribute: `values` has a row per element of `domain` (POINT, EDGE, FACE, CORNER)."""

    def __init__(self, name, kind, domain, values):
        self.name, self.kind, self.domain, self.values = name, kind, domain, values


class Source:
    """All that is read of a mesh."""

    def __init__(self, mesh, ob):
        """ob: an object of the mesh; vertex groups are only reached through it."""
        self.positions = _get_attribute(mesh, "position", mesh.vertices, "co", np.float32, 3)
        self.edges = _get_attribute(mesh, ".edge_verts", mesh.edges, "vertices", np.int32, 2)
        self.corner_verts = _get_attribute(mesh, ".corner_vert", mesh.loops, "vertex_index", np.int32, 1)
        self.corner_edges = _get_attribute(mesh, ".corner_edge", mesh.loops, "edge_index", np.int32, 1)
        self.face_offsets = np.append(_get(mesh.polygons, "loop_start", np.int32), np.int32(len(mesh.loops)))
        self.uvs = [self._uv(mesh, layer) for layer in mesh.uv_layers]
        self.seams = _get(mesh.edges, "use_seam", bool)
        self.sharp = _get(mesh.edges, "use_edge_sharp", bool)
        self.materials = _get(mesh.polygons, "material_index", np.int32)
        names = {layer.name for layer in mesh.uv_layers}
        self.layers, self.dropped = [], []
        for attribute in mesh.attributes:
            if attribute.name in _STRUCTURE:
                if attribute.name == "custom_normal":
                    self.dropped.append("custom normals")
            elif attribute.data_type not in _TYPES or len(attribute.data) == 0:
                self.dropped.append(attribute.name)
            elif attribute.name not in names:
                name, components, dtype = _TYPES[attribute.data_type]
                self.layers.append(Layer(attribute.name, attribute.data_type, attribute.domain,
                                         _get(attribute.data, name, dtype, components)))
        self.legacy = []
        if bpy.app.version < (4, 0, 0):
            self.legacy = [(owner, name, _get(getattr(mesh, owner), name, dtype)) for owner, name, dtype in _LEGACY]
            if mesh.has_custom_normals:
                self.dropped.append("custom normals")
        self.active = [(owner, name, getattr(getattr(mesh, owner), name)) for owner, name in _ACTIVE
                       if hasattr(getattr(mesh, owner), name)]
        self.render_uv = next((i for i, layer in enumerate(mesh.uv_layers) if layer.active_render), -1)
        self.groups = _read_groups(mesh, ob)
        self.active_group = ob.vertex_groups.active_index

    @staticmethod
    def _uv(mesh, layer):
        if hasattr(layer, "uv"):  # 3.5
            return Layer(layer.name, "FLOAT2", "CORNER", _get(layer.uv, "vector", np.float32, 2))
        return Layer(layer.name, "FLOAT2", "CORNER", _get(layer.data, "uv", np.float32, 2))


def _read_groups(mesh, ob):
    """-> (name, lock, dense weights) per vertex group; NaN where the vertex is not in the group."""
    groups = [(group.name, group.lock_weight, np.full(len(mesh.vertices), np.nan, np.float32)) for group in ob.vertex_groups]
    if groups:
        for vertex in mesh.vertices:
            for element in vertex.groups:
                if element.group < len(groups):
                    groups[element.group][2][vertex.index] = element.weight
    return groups


class Result:
    """All that is written: made completely before the mesh is touched."""

    def __init__(self, source, mesh, surface_map):
        """mesh: the remeshed delmesh.Mesh; surface_map: its delmesh.SurfaceMap."""
        self.positions, self.edges = mesh.positions, mesh.edges
        self.faces, self.corner_edges = mesh.faces, mesh.corner_edges
        edge_source = surface_map.edge_source(source.edges)
        # Where the library cut a non-manifold place open, the sheets are joined again.
        stays = np.arange(len(self.positions))
        join = mesh.vert_join
        if (join != stays).any():
            self._join(join, edge_source)
            edge_source = self._edge_source
            stays = np.flatnonzero(join == stays)
        loose = np.setdiff1d(np.arange(len(source.edges)), source.corner_edges)
        self.edges = np.concatenate([self.edges, source.edges[loose]]).astype(np.int32)
        edge_source = np.concatenate([edge_source, loose])
        self.carry = {"POINT": lambda values: surface_map.vert_values(values)[stays], "FACE": surface_map.face_values,
                      "CORNER": surface_map.corner_values, "EDGE": lambda values: _edge_values(values, edge_source)}
        domains = {"vertices": "POINT", "edges": "EDGE", "polygons": "FACE"}
        self.uvs = [self._carried(layer) for layer in source.uvs]
        self.layers = [self._carried(layer) for layer in source.layers]
        self.legacy = [(owner, name, self.carry[domains[owner]](values)) for owner, name, values in source.legacy]
        self.active, self.render_uv = source.active, source.render_uv
        self.groups = [(name, lock, _blend_group(weights, surface_map, stays)) for name, lock, weights in source.groups]
        self.active_group = source.active_group

    def _carried(self, layer):
        return Layer(layer.name, layer.kind, layer.domain, self.carry[layer.domain](layer.values))

    def _join(self, join, edge_source):
        while (join[join] != join).any():
            join = join[join]
        stays = join == np.arange(len(join))
        number = (np.cumsum(stays) - 1)[join].astype(np.int32)
        self.positions, self.faces = self.positions[stays], number[self.faces]
        pairs, first, index = np.unique(np.sort(number[self.edges], axis=1), axis=0, return_index=True, return_inverse=True)
        self.edges, self.corner_edges = pairs, index.reshape(-1)[self.corner_edges].astype(np.int32)
        self._edge_source = edge_source[first]

    def write(self, mesh, ob):
        """Replaces the geometry of `mesh`, which keeps its name, users, materials and custom properties."""
        mesh.clear_geometry()
        faces = len(self.faces)
        mesh.vertices.add(len(self.positions))
        mesh.edges.add(len(self.edges))
        mesh.loops.add(3 * faces)
        mesh.polygons.add(faces)
        _set_attribute(mesh, "position", mesh.vertices, "co", self.positions)
        _set_attribute(mesh, ".edge_verts", mesh.edges, "vertices", self.edges)
        _set_attribute(mesh, ".corner_vert", mesh.loops, "vertex_index", self.faces.reshape(-1))
        _set_attribute(mesh, ".corner_edge", mesh.loops, "edge_index", self.corner_edges.reshape(-1))
        _set(mesh.polygons, "loop_start", np.arange(0, 3 * faces, 3, dtype=np.int32))
        if bpy.app.version < (4, 0, 0):
            _set(mesh.polygons, "loop_total", np.full(faces, 3, np.int32))
        for layer in self.uvs:
            added = mesh.uv_layers.new(name=layer.name, do_init=False)
            if hasattr(added, "uv"):
                _set(added.uv, "vector", layer.values)
            else:
                _set(added.data, "uv", layer.values)
        for layer in self.layers:
            # Some exist as soon as the geometry does.
            attribute = mesh.attributes.get(layer.name) or mesh.attributes.new(layer.name, layer.kind, layer.domain)
            _set(attribute.data, _TYPES[layer.kind][0], layer.values)
        for owner, name, values in self.legacy:
            _set(getattr(mesh, owner), name, values)
        for owner, name, value in self.active:
            if value >= 0:
                setattr(getattr(mesh, owner), name, value)
        if self.render_uv >= 0:
            mesh.uv_layers[self.render_uv].active_render = True
        mesh.update()
        ob.vertex_groups.clear()  # whether clear_geometry did so depends on the version
        for name, lock, weights in self.groups:
            group = ob.vertex_groups.new(name=name)
            _write_group(group, weights)
            group.lock_weight = lock
        if self.groups:
            ob.vertex_groups.active_index = self.active_group


def _edge_values(values, edge_source):
    out = values[edge_source]
    out[edge_source < 0] = 0
    return out


def _blend_group(weights, surface_map, stays):
    """A vertex that is in the group through none of its sources stays out of it."""
    member = ~np.isnan(weights)
    blended = surface_map.vert_values(np.where(member, weights, np.float32(0)))
    in_group = (member[surface_map.verts] & (surface_map.vert_weights != 0)).any(axis=1)
    return np.where(in_group, blended, np.float32(np.nan))[stays]


def _write_group(group, weights):
    members = np.flatnonzero(~np.isnan(weights))
    order = members[np.argsort(weights[members], kind="stable")]
    values, starts = np.unique(weights[order], return_index=True)
    for value, indices in zip(values, np.split(order, starts[1:])):
        group.add(indices.tolist(), float(value), "REPLACE")
