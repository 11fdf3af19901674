# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender meshes to MeshData and back. What Blender stores as attributes goes through them (fast since 3.5); what an older Blender
keeps elsewhere (UV maps, edge marks, smooth flags in 3.4) goes through its properties. Exact types matter: with another dtype
foreach_get is many times slower.

Reading is a generator, which yields after all that takes a while, for Blender's window to have a look. Writing is not: nobody may
see half a mesh."""
import bmesh
import bpy
import numpy as np

from .meshdata import Layer, MeshData, Rows
from .survive import Refused

# type of an attribute -> (property of its elements, dtype, numbers per element)
_TYPES = {"FLOAT": ("value", np.float32, 1), "INT": ("value", np.int32, 1), "INT8": ("value", np.int32, 1),
          "BOOLEAN": ("value", bool, 1), "FLOAT_VECTOR": ("vector", np.float32, 3), "FLOAT2": ("vector", np.float32, 2),
          "INT32_2D": ("value", np.int32, 2), "INT16_2D": ("value", np.int32, 2), "QUATERNION": ("value", np.float32, 4),
          "FLOAT4X4": ("value", np.float32, 16), "FLOAT_COLOR": ("color", np.float32, 4),
          "BYTE_COLOR": ("color_srgb", np.float32, 4)}  # as it is stored: to linear numbers Blender takes several times longer
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
# What takes some milliseconds: elements for Python to look at one by one, bytes for the system to find
_ELEMENTS, _BYTES = 8192, 1 << 22
_ACTIVE = [("attributes", "active_index"), ("attributes", "active_color_index"), ("attributes", "render_color_index"),
           ("uv_layers", "active_index")]


def _get(find, name, dtype, components=1):
    """find() -> the collection, which may move between the steps. Memory is found in pieces beforehand: for a large new array the
    system takes longer than Blender to fill it."""
    values = np.empty(len(find()) * components, dtype)
    step = _BYTES // values.itemsize
    for first in range(0, len(values), step):
        values[first:first + step] = 0
        yield
    find().foreach_get(name, values)
    yield
    return values if components == 1 else values.reshape(-1, components)


def _set(collection, name, values):
    collection.foreach_set(name, np.ascontiguousarray(values).reshape(-1))


def _get_structure(mesh, name, owner, fallback, dtype, components=1):
    if name in mesh.attributes:
        return _get(lambda: mesh.attributes[name].data, "vector" if components == 3 else "value", dtype, components)
    return _get(lambda: getattr(mesh, owner), fallback, dtype, components)


def _set_structure(mesh, name, collection, fallback, values):
    attribute = mesh.attributes.get(name)
    if attribute:
        _set(attribute.data, "vector" if values.ndim == 2 and values.shape[1] == 3 else "value", values)
    else:
        _set(collection, fallback, values)


# ---- Reading ----------------------------------------------------------------------------------------------------------------


def drained(steps):
    """Takes all the steps of a generator. -> what it returns."""
    while True:
        try:
            next(steps)
        except StopIteration as over:
            return over.value


def read(mesh, ob, normals=True):
    """All of reading() at once."""
    return drained(reading(mesh, ob, normals))


def reading(mesh, ob, normals=True):
    """-> MeshData. ob: an object of the mesh; vertex groups are only reached through it. normals: whether custom normals are read
    (they take long). Refuses a mesh whose elements or layers become others between the steps; other values go unnoticed, and
    one that is removed is a ReferenceError, as everywhere."""
    return _while_unchanged(mesh, _read(mesh, ob, normals))


def reading_surface(mesh):
    """-> MeshData of the faces alone."""
    return _while_unchanged(mesh, _read_surface(mesh))


def _while_unchanged(mesh, steps):
    before = _shape(mesh)
    while _shape(mesh) == before:
        try:
            next(steps)
        except StopIteration as over:
            return over.value
        yield
    raise Refused("A mesh was changed while it was read")


def _shape(mesh):
    return (mesh.is_editmode, len(mesh.vertices), len(mesh.edges), len(mesh.loops), len(mesh.polygons), mesh.attributes.keys(),
            mesh.uv_layers.keys(), mesh.shape_keys and mesh.shape_keys.key_blocks.keys())


def _read_surface(mesh):
    starts = yield from _get(lambda: mesh.polygons, "loop_start", np.int32)
    return MeshData(
        positions=(yield from _get_structure(mesh, "position", "vertices", "co", np.float32, 3)),
        edges=(yield from _get_structure(mesh, ".edge_verts", "edges", "vertices", np.int32, 2)),
        corner_verts=(yield from _get_structure(mesh, ".corner_vert", "loops", "vertex_index", np.int32)),
        corner_edges=(yield from _get_structure(mesh, ".corner_edge", "loops", "edge_index", np.int32)),
        face_offsets=np.append(starts, np.int32(len(mesh.loops))),
        layers=[])


def _read(mesh, ob, normals):
    data = yield from _read_surface(mesh)
    for more in (_read_uvs, _read_attributes, _read_properties):
        yield from more(mesh, data.layers)
    if ob.vertex_groups:
        data.weights = yield from _read_weights(mesh)
    for name in mesh.shape_keys.key_blocks.keys() if mesh.shape_keys else ():
        data.keys.append((yield from _get(lambda: mesh.shape_keys.key_blocks[name].data, "co", np.float32, 3)))
    if normals and _has_packed_normals(mesh):
        data.normals = yield from _read_normals(mesh)
    return data


def _has_packed_normals(mesh):
    """Custom normals relative to the mesh they were made for; others are attributes as any."""
    attribute = mesh.attributes.get("custom_normal")
    return attribute.data_type == "INT16_2D" if attribute else mesh.has_custom_normals


def _read_normals(mesh):
    if hasattr(mesh, "corner_normals"):  # 4.1
        return (yield from _get(lambda: mesh.corner_normals, "vector", np.float32, 3))
    mesh.calc_normals_split()
    values = drained(_get(lambda: mesh.loops, "normal", np.float32, 3))
    mesh.free_normals_split()
    return values


# Layers are looked up by their names at every step: meanwhile others may have moved them.


def _read_uvs(mesh, layers):
    for name in mesh.uv_layers.keys():
        if hasattr(mesh.uv_layers[name], "uv"):  # 3.5
            values = yield from _get(lambda: mesh.uv_layers[name].uv, "vector", np.float32, 2)
            layers.append(Layer(name, "UV", "CORNER", values))
        else:
            values = yield from _get(lambda: mesh.uv_layers[name].data, "uv", np.float32, 2)
            layers.append(Layer(name, "UV", "CORNER", values))
            pinned = yield from _get(lambda: mesh.uv_layers[name].data, "pin_uv", bool)
            if pinned.any():
                layers.append(Layer(name, "UV_PIN", "CORNER", pinned))


def _read_attributes(mesh, layers):
    uvs = mesh.uv_layers.keys()
    for name in mesh.attributes.keys():
        attribute = mesh.attributes[name]
        kind, domain = attribute.data_type, attribute.domain
        if name in _STRUCTURE or name in uvs or len(attribute.data) == 0:
            continue
        if name == ".select_edge" and kind != "BOOLEAN":  # see _repair_selection
            continue
        if name == "custom_normal" and kind == "INT16_2D":
            continue
        if kind == "STRING":
            texts, numbers = yield from _read_texts(mesh, name)
            layers.append(Layer(name, kind, domain, numbers, texts))
        elif kind in _TYPES:
            layers.append(Layer(name, kind, domain, (yield from _get(lambda: mesh.attributes[name].data, *_TYPES[kind]))))


def _read_texts(mesh, name):
    """-> the texts there are, the empty one first, as elements without a source get 0; and the number of each element's."""
    values = []
    for some in _slices(len(mesh.attributes[name].data)):
        values += [element.value for element in mesh.attributes[name].data[some]]
        yield
    texts = sorted({type(values[0])(), *values})
    numbers = {text: number for number, text in enumerate(texts)}
    return texts, np.array([numbers[text] for text in values], np.int32)


def _read_properties(mesh, layers):
    for owner, name, dtype, attribute, until in _PROPERTIES:
        if bpy.app.version < until and attribute not in mesh.attributes:
            values = yield from _get(lambda: getattr(mesh, owner), name, dtype)
            if values.any():
                layers.append(Layer(name, "PROPERTY", _DOMAINS[owner], values))
    for owner, _, name, components, dtype, until in _VERTEX_LAYERS:
        if bpy.app.version < until and len(getattr(mesh, owner)):
            values = yield from _get(lambda: getattr(mesh, owner)[0].data, name, dtype, components)
            layers.append(Layer(f"{owner}.{name}", "VERTEX", "POINT", values))
    for name in mesh.face_maps.keys() if hasattr(mesh, "face_maps") else ():  # before 4.0
        values = yield from _get(lambda: mesh.face_maps[name].data, "value", np.int32)
        layers.append(Layer(name, "FACE_MAP", "FACE", values))


def _slices(count):
    """Of so many elements that Python looks at one by one; at least one."""
    return [slice(first, first + _ELEMENTS) for first in range(0, max(count, 1), _ELEMENTS)]


def _read_weights(mesh):
    parts = []
    for some in _slices(len(mesh.vertices)):
        offsets, indices, values = [0], [], []
        for vertex in mesh.vertices[some]:
            for element in vertex.groups:
                indices.append(element.group)
                values.append(element.weight)
            offsets.append(len(indices))
        parts.append(Rows(np.array(offsets, np.int64), np.array(indices, np.int32), np.array(values, np.float32)))
        yield
    return Rows.concatenate(parts)


def selected_faces(mesh):
    """(f,) bool."""
    return drained(_get(lambda: mesh.polygons, "select", bool))


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
    sharp = _sharp_edges(mesh)
    mesh.normals_split_custom_set(data.normals)
    if (_sharp_edges(mesh) != sharp).any():  # where normals differ it makes edges sharp
        _set(mesh.edges, "use_edge_sharp", sharp)
        mesh.update()


def _sharp_edges(mesh):
    return drained(_get(lambda: mesh.edges, "use_edge_sharp", bool))


def _write_weights(data, ob, settings):
    groups = ob.vertex_groups
    if [group.name for group in groups] != [name for name, _ in settings.groups]:  # not all versions clear the names
        groups.clear()
        for name, _ in settings.groups:
            groups.new(name=name)
    if data.weights is None:
        return
    for number, (group, (_, lock)) in enumerate(zip(groups, settings.groups)):
        values, bounds, vertices = data.weights.by_value.get(number, ((), (), ()))
        for value, low, high in zip(values, bounds, bounds[1:]):
            group.add(vertices[low:high], value, "REPLACE")
        group.lock_weight = lock
    groups.active_index = settings.active_group


def select(mesh, verts, edges, faces):
    """Selects these elements, bool per element, and no others."""
    _repair_selection(mesh)
    for collection, values in ((mesh.vertices, verts), (mesh.edges, edges), (mesh.polygons, faces)):
        _set(collection, "select", values)
