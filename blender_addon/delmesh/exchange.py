# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender meshes to MeshData and back. What Blender stores as attributes goes through them (fast since 3.5); what an older Blender
keeps elsewhere (UV maps, edge marks, smooth flags in 3.4) goes through its properties. Exact types matter: with another dtype
foreach_get is many times slower."""
import bmesh
import bpy
import numpy as np

from .meshdata import Layer, MeshData, Rows

# type of an attribute -> (property of its elements, numbers per element, dtype)
_TYPES = {"FLOAT": ("value", 1, np.float32), "INT": ("value", 1, np.int32), "INT8": ("value", 1, np.int32),
          "BOOLEAN": ("value", 1, bool), "FLOAT_VECTOR": ("vector", 3, np.float32), "FLOAT2": ("vector", 2, np.float32),
          "INT32_2D": ("value", 2, np.int32), "INT16_2D": ("value", 2, np.int32), "QUATERNION": ("value", 4, np.float32),
          "FLOAT4X4": ("value", 16, np.float32), "FLOAT_COLOR": ("color", 4, np.float32),
          "BYTE_COLOR": ("color_srgb", 4, np.float32)}  # as it is stored: to linear numbers Blender takes several times longer
# The mesh itself
_STRUCTURE = {"position", ".edge_verts", ".corner_vert", ".corner_edge"}
# Properties that became attributes: (collection, property, dtype, attribute, first version that has it as attribute)
_PROPERTIES = [("edges", "use_seam", bool, "uv_seam", (4, 0)), ("edges", "use_edge_sharp", bool, "sharp_edge", (4, 0)),
               ("edges", "use_freestyle_mark", bool, "freestyle_edge", (5, 0)),
               ("edges", "crease", np.float32, "crease_edge", (4, 0)),
               ("edges", "bevel_weight", np.float32, "bevel_weight_edge", (4, 0)),
               ("vertices", "bevel_weight", np.float32, "bevel_weight_vert", (4, 0)),
               ("polygons", "use_smooth", bool, "sharp_face", (4, 0)),
               ("polygons", "use_freestyle_mark", bool, "freestyle_face", (5, 0))]
_DOMAINS = {"vertices": "POINT", "edges": "EDGE", "polygons": "FACE"}
_COLLECTIONS = {domain: name for name, domain in _DOMAINS.items()}
# Layers of vertices that only bmesh can make: (collection of the mesh, layer of bmesh, property, numbers per element, dtype, first
# version that has it as attribute)
_VERTEX_LAYERS = [("vertex_creases", "crease", "value", 1, np.float32, (4, 0)),
                  ("vertex_paint_masks", "paint_mask", "value", 1, np.float32, (4, 1)),
                  ("skin_vertices", "skin", "radius", 2, np.float32, (99, 0)),
                  ("skin_vertices", "skin", "use_root", 1, bool, (99, 0)),
                  ("skin_vertices", "skin", "use_loose", 1, bool, (99, 0))]
_ACTIVE = [("attributes", "active_index"), ("attributes", "active_color_index"), ("attributes", "render_color_index"),
           ("uv_layers", "active_index")]


def _get(collection, name, dtype, components=1):
    values = np.empty(len(collection) * components, dtype)
    collection.foreach_get(name, values)
    return values if components == 1 else values.reshape(-1, components)


def _set(collection, name, values):
    collection.foreach_set(name, np.ascontiguousarray(values).reshape(-1))


def _get_structure(mesh, name, collection, fallback, dtype, components):
    attribute = mesh.attributes.get(name)
    if attribute:
        return _get(attribute.data, "vector" if components == 3 else "value", dtype, components)
    return _get(collection, fallback, dtype, components)


def _set_structure(mesh, name, collection, fallback, values):
    attribute = mesh.attributes.get(name)
    if attribute:
        _set(attribute.data, "vector" if values.ndim == 2 and values.shape[1] == 3 else "value", values)
    else:
        _set(collection, fallback, values)


# ---- Reading ----------------------------------------------------------------------------------------------------------------


def read_surface(mesh):
    """-> MeshData of the faces alone."""
    return MeshData(
        positions=_get_structure(mesh, "position", mesh.vertices, "co", np.float32, 3),
        edges=_get_structure(mesh, ".edge_verts", mesh.edges, "vertices", np.int32, 2),
        corner_verts=_get_structure(mesh, ".corner_vert", mesh.loops, "vertex_index", np.int32, 1),
        corner_edges=_get_structure(mesh, ".corner_edge", mesh.loops, "edge_index", np.int32, 1),
        face_offsets=np.append(_get(mesh.polygons, "loop_start", np.int32), np.int32(len(mesh.loops))),
        layers=[])


def read(mesh, ob, normals=True):
    """-> MeshData. ob: an object of the mesh; vertex groups are only reached through it. normals: whether custom normals are read
    (they take long)."""
    data = read_surface(mesh)
    data.layers = [*_read_uvs(mesh), *_read_attributes(mesh), *_read_properties(mesh)]
    if ob.vertex_groups:
        data.weights = _read_weights(mesh)
    if mesh.shape_keys:
        data.keys = [_get(key.data, "co", np.float32, 3) for key in mesh.shape_keys.key_blocks]
    if normals and _has_packed_normals(mesh):
        data.normals = _read_normals(mesh)
    return data


def _has_packed_normals(mesh):
    """Custom normals relative to the mesh they were made for; others are attributes as any."""
    attribute = mesh.attributes.get("custom_normal")
    return attribute.data_type == "INT16_2D" if attribute else mesh.has_custom_normals


def _read_normals(mesh):
    if hasattr(mesh, "corner_normals"):  # 4.1
        return _get(mesh.corner_normals, "vector", np.float32, 3)
    mesh.calc_normals_split()
    values = _get(mesh.loops, "normal", np.float32, 3)
    mesh.free_normals_split()
    return values


def _read_uvs(mesh):
    for layer in mesh.uv_layers:
        if hasattr(layer, "uv"):  # 3.5
            yield Layer(layer.name, "UV", "CORNER", _get(layer.uv, "vector", np.float32, 2))
        else:
            yield Layer(layer.name, "UV", "CORNER", _get(layer.data, "uv", np.float32, 2))
            pinned = _get(layer.data, "pin_uv", bool)
            if pinned.any():
                yield Layer(layer.name, "UV_PIN", "CORNER", pinned)


def _read_attributes(mesh):
    uvs = {layer.name for layer in mesh.uv_layers}
    for attribute in mesh.attributes:
        name, kind = attribute.name, attribute.data_type
        if name in _STRUCTURE or name in uvs or len(attribute.data) == 0:
            continue
        if name == ".select_edge" and kind != "BOOLEAN":  # see _repair_selection
            continue
        if name == "custom_normal" and kind == "INT16_2D":
            continue
        if kind == "STRING":
            values = [element.value for element in attribute.data]
            texts = sorted({type(values[0])(), *values})  # the empty one first: elements without a source get 0
            numbers = {text: number for number, text in enumerate(texts)}
            yield Layer(name, kind, attribute.domain, np.array([numbers[text] for text in values], np.int32), texts)
        elif kind in _TYPES:
            value, components, dtype = _TYPES[kind]
            yield Layer(name, kind, attribute.domain, _get(attribute.data, value, dtype, components))


def _read_properties(mesh):
    for owner, name, dtype, attribute, until in _PROPERTIES:
        if bpy.app.version < until and attribute not in mesh.attributes:
            values = _get(getattr(mesh, owner), name, dtype)
            if values.any():
                yield Layer(name, "PROPERTY", _DOMAINS[owner], values)
    for owner, _, name, components, dtype, until in _VERTEX_LAYERS:
        if bpy.app.version < until and len(getattr(mesh, owner)):
            yield Layer(f"{owner}.{name}", "VERTEX", "POINT", _get(getattr(mesh, owner)[0].data, name, dtype, components))
    for layer in getattr(mesh, "face_maps", ()):  # before 4.0
        yield Layer(layer.name, "FACE_MAP", "FACE", _get(layer.data, "value", np.int32))


def _read_weights(mesh):
    offsets, indices, values = [0], [], []
    for vertex in mesh.vertices:
        for element in vertex.groups:
            indices.append(element.group)
            values.append(element.weight)
        offsets.append(len(indices))
    return Rows(np.array(offsets, np.int64), np.array(indices, np.int32), np.array(values, np.float32))


def selected_faces(mesh):
    """(f,) bool."""
    return _get(mesh.polygons, "select", bool)


# ---- Writing ----------------------------------------------------------------------------------------------------------------


class Settings:
    """What belongs to the mesh as a whole and does not outlive clear_geometry()."""

    def __init__(self, mesh, ob):
        self.active = [(owner, name, getattr(getattr(mesh, owner), name)) for owner, name in _ACTIVE
                       if hasattr(getattr(mesh, owner), name)]
        self.render_uv = next((i for i, layer in enumerate(mesh.uv_layers) if layer.active_render), -1)
        self.groups = [(group.name, group.lock_weight) for group in ob.vertex_groups]
        self.active_group = ob.vertex_groups.active_index

    def restore_layers(self, mesh):
        for owner, name, value in self.active:
            if value >= 0:
                setattr(getattr(mesh, owner), name, value)
        if self.render_uv >= 0:
            mesh.uv_layers[self.render_uv].active_render = True


def write(data, mesh, ob, settings):
    """Replaces the geometry of `mesh`, which keeps its name, users, materials, custom properties, and its shape keys with their
    animation. settings: the Settings of the mesh that `data` comes from."""
    mesh.clear_geometry()
    mesh.vertices.add(len(data.positions))
    _prepare_vertices(data, mesh)
    mesh.edges.add(len(data.edges))
    _repair_selection(mesh)
    mesh.loops.add(len(data.corner_verts))
    mesh.polygons.add(len(data.face_offsets) - 1)
    _set_structure(mesh, "position", mesh.vertices, "co", data.positions)
    _set_structure(mesh, ".edge_verts", mesh.edges, "vertices", data.edges)
    _set_structure(mesh, ".corner_vert", mesh.loops, "vertex_index", data.corner_verts)
    _set_structure(mesh, ".corner_edge", mesh.loops, "edge_index", data.corner_edges)
    _set(mesh.polygons, "loop_start", data.face_offsets[:-1])
    if bpy.app.version < (4, 0):
        _set(mesh.polygons, "loop_total", np.diff(data.face_offsets))
    if bpy.app.version >= (4, 1) and "sharp_face" in mesh.attributes and data.layer("sharp_face") is None:
        mesh.attributes.remove(mesh.attributes["sharp_face"])  # without it all faces are smooth
    for layer in data.layers:
        _write_layer(layer, mesh)
    for key, values in zip(mesh.shape_keys.key_blocks if data.keys else (), data.keys):
        _set(key.data, "co", values)
    settings.restore_layers(mesh)
    if bpy.app.version < (4, 0):
        mesh.update(calc_edges_loose=True)
    else:
        mesh.update()
    if data.normals is not None:
        _write_normals(data, mesh)
    _write_weights(data, ob, settings)


def _repair_selection(mesh):
    """5.0 adds edges with a selection of the wrong type, and crashes when that is written."""
    attribute = mesh.attributes.get(".select_edge")
    if attribute and attribute.data_type != "BOOLEAN":
        mesh.attributes.remove(attribute)


def _prepare_vertices(data, mesh):
    """While the mesh is nothing but vertices, bmesh is a cheap way to what else only it can do: it gives shape keys as many points
    as there are vertices, and makes layers that Python cannot add."""
    wanted = {layer.name.partition(".")[0] for layer in data.layers if layer.kind == "VERTEX"}
    if not mesh.shape_keys and not wanted:
        return
    work = bmesh.new()
    try:
        work.from_mesh(mesh)
        for owner, name, *_ in _VERTEX_LAYERS:
            if owner in wanted:
                getattr(work.verts.layers, name).verify()
        work.to_mesh(mesh)
    finally:
        work.free()


def _write_layer(layer, mesh):
    if layer.kind == "UV":
        added = mesh.uv_layers.new(name=layer.name, do_init=False)
        if hasattr(added, "uv"):
            _set(added.uv, "vector", layer.values)
        else:
            _set(added.data, "uv", layer.values)
    elif layer.kind == "UV_PIN":
        _set(mesh.uv_layers[layer.name].data, "pin_uv", layer.values)
    elif layer.kind == "PROPERTY":
        _set(getattr(mesh, _COLLECTIONS[layer.domain]), layer.name, layer.values)
    elif layer.kind == "VERTEX":
        owner, _, name = layer.name.partition(".")
        _set(getattr(mesh, owner)[0].data, name, layer.values)
    elif layer.kind == "FACE_MAP":
        _set(mesh.face_maps.new(name=layer.name).data, "value", layer.values)
    else:
        # Some exist as soon as the geometry does.
        attribute = mesh.attributes.get(layer.name) or mesh.attributes.new(layer.name, layer.kind, layer.domain)
        if layer.kind == "STRING":
            for element, number in zip(attribute.data, layer.values.tolist()):
                element.value = layer.texts[number]
        else:
            _set(attribute.data, _TYPES[layer.kind][0], layer.values)


def _write_normals(data, mesh):
    sharp = _get(mesh.edges, "use_edge_sharp", bool)
    mesh.normals_split_custom_set(data.normals)
    if (_get(mesh.edges, "use_edge_sharp", bool) != sharp).any():  # where normals differ it makes edges sharp
        _set(mesh.edges, "use_edge_sharp", sharp)
        mesh.update()


def _write_weights(data, ob, settings):
    groups = ob.vertex_groups
    if [group.name for group in groups] != [name for name, _ in settings.groups]:  # not all versions clear the names
        groups.clear()
        for name, _ in settings.groups:
            groups.new(name=name)
    if data.weights is None:
        return
    vertices = np.repeat(np.arange(len(data.positions)), np.diff(data.weights.offsets))
    order = np.lexsort([data.weights.values, data.weights.indices])
    numbers = data.weights.indices[order]
    for number, (group, (_, lock)) in enumerate(zip(groups, settings.groups)):
        low, high = np.searchsorted(numbers, [number, number + 1])
        members = order[low:high]
        values, starts = np.unique(data.weights.values[members], return_index=True)
        for value, run in zip(values.tolist(), np.split(vertices[members], starts[1:])):
            group.add(run.tolist(), value, "REPLACE")
        group.lock_weight = lock
    groups.active_index = settings.active_group


def select_edges(mesh, pairs, faces):
    """Selects these edges (n, 2), the diagonals of polygons as well as they can be: by their two vertices, and these faces."""
    verts, edges, polygons = np.zeros(len(mesh.vertices), bool), np.zeros(len(mesh.edges), bool), np.zeros(len(mesh.polygons), bool)
    verts[pairs] = True
    ends = _get_structure(mesh, ".edge_verts", mesh.edges, "vertices", np.int32, 2)
    count = len(verts)
    keys = np.sort(ends, axis=1).astype(np.int64) @ (count, 1)
    edges[np.isin(keys, np.sort(pairs, axis=1).astype(np.int64) @ (count, 1))] = True
    polygons[faces] = True
    corner_edges = _get_structure(mesh, ".corner_edge", mesh.loops, "edge_index", np.int32, 1)
    edges[corner_edges[np.repeat(polygons, _get(mesh.polygons, "loop_total", np.int32))]] = True
    verts[ends[edges]] = True
    _repair_selection(mesh)
    for collection, values in ((mesh.vertices, verts), (mesh.edges, edges), (mesh.polygons, polygons)):
        _set(collection, "select", values)
