# SPDX-License-Identifier: GPL-3.0-or-later
"""A MeshData as a cage: its limit surface by the library, and what lies on the cage at the places that made meshes have on it.
Without bpy."""
import functools

import numpy as np

from .meshdata import Rows

_FOR_EVER = 10.0  # sharpness
_COLUMNS = 16  # components that the library evaluates at once
_ON_LINE = 2.5e-7  # rounding of a place, of which the unit is the circle that the polygon is in
# Layers of creases, by version of Blender
_EDGE_CREASES, _VERT_CREASES = ("crease_edge", "crease"), ("crease_vert", "vertex_creases.value")


def _sharpness(data, domain, names):
    """-> numbers of the elements with a crease, and how many subdivisions each stays sharp. An attribute of such a name that is of
    another domain or kind is the user's own."""
    found = [layer.values for name in names for layer in data.layers
             if layer.name == name and layer.domain == domain and layer.values.dtype.kind == "f" and layer.values.ndim == 1]
    values = np.clip(found[0] if found else np.zeros(0), 0, 1)
    creased = np.flatnonzero(values > 0)
    return creased, _FOR_EVER * values[creased].astype(np.float64) ** 2


class Surface:
    """Of `data`, with the marks of its edges and {number: delmesh.Layer}. told: scheme, boundary, face_varying, as delmesh.Cage is
    told; use_creases; rate, into how many pieces edges are cut; measure: also how far the mesh is from the surface."""

    def __init__(self, delmesh, data, marks, layers, told, progress, cancel):
        self._data, self._cancel = data, cancel
        choices = {name: told[name] for name in ("scheme", "boundary", "face_varying")}
        verts, vert_sharpness = _sharpness(data, "POINT", _VERT_CREASES if told["use_creases"] else ())
        edges, edge_sharpness = _sharpness(data, "EDGE", _EDGE_CREASES if told["use_creases"] else ())
        ends = np.unique(data.edges[data.loose_edges()])  # which Blender leaves where they are
        verts, vert_sharpness = np.append(verts, ends), np.append(vert_sharpness, np.full(len(ends), _FOR_EVER))
        self._cage = delmesh.Cage(data.positions, corner_verts=data.corner_verts, face_offsets=data.face_offsets, edges=data.edges,
                                  edge_marks=marks, layers=layers, creases=(data.edges[edges], edge_sharpness),
                                  corners=(verts, vert_sharpness), cancel=cancel, **choices)
        self.mesh, report = self._cage.subdivide(told["rate"], measure=told["measure"], progress=progress, cancel=cancel)
        self.distance = report.limit_distance

    def values(self, values):
        """Of vertices of the cage (v,), at those of the mesh."""
        return self._cage.values(self.mesh, values, cancel=self._cancel)

    def borders(self, verts):
        """(v,) bool: vertices on the cage's border -> those of the mesh on pieces of the border that these alone shape."""
        alone = self.values(verts.astype(np.float64)) > 1 - 1e-6  # the sum of their weights
        ends = np.zeros(len(alone), bool)
        ends[self.mesh.faces.reshape(-1)[self.mesh.corner_twins.reshape(-1) < 0]] = True
        following = np.roll(self.mesh.faces, -1, axis=1).reshape(-1)
        ends[following[self.mesh.corner_twins.reshape(-1) < 0]] = True
        return alone & ends

    def at(self, made):
        """What lies on the cage, at the elements of a mesh made of this one's."""
        return _OnCage(self._data, self._cage, self._edges, made, self._cancel)

    @functools.cached_property
    def _edges(self):
        """(e,) the edge of the cage that each edge of the mesh is a piece of, -1 for none."""
        faces, places = self.mesh.corner_cage
        sizes, places = _in_polygon(self._data, faces, places)
        middle = (places + np.roll(places, -1, axis=1)) / 2
        side = np.floor(_turn(middle, sizes)).astype(np.int64) % sizes
        half = np.pi / sizes
        normal = np.stack([np.cos((2 * side + 1) * half), np.sin((2 * side + 1) * half)], axis=-1)
        off = [np.abs((end * normal).sum(axis=-1) - np.cos(half)) for end in (places, np.roll(places, -1, axis=1))]
        on = np.maximum(*off) < _ON_LINE
        edges = np.full(len(self.mesh.edges), -1)
        edges[self.mesh.corner_edges[on]] = self._data.corner_edges[(self._data.face_offsets[faces] + side)[on]]
        return edges


def _in_polygon(data, faces, places):
    """-> sizes of the faces, and the places as points of regular polygons, on quads too."""
    sizes = np.diff(data.face_offsets)[faces]
    s, t = np.moveaxis(places.astype(np.float64), -1, 0)
    quad = np.stack([1 - s - t, s - t], axis=-1)
    return sizes, np.where((sizes == 4)[..., None], quad, places)


def _turn(places, sizes):
    """How far round the polygon, in corners."""
    return np.arctan2(places[..., 1], places[..., 0]) * sizes / (2 * np.pi)


class _OnCage:
    """As survive._OnSurface, of a cage."""

    def __init__(self, data, cage, edges, made, cancel):
        self._data, self._cage, self._made, self._cancel = data, cage, made, cancel
        self._layers = made.layers
        self.verts = np.full(len(made.positions), -1)  # the cage's own are not on its surface
        self.edges = np.where(made.edge_source >= 0, edges[made.edge_source], -1)

    def layer(self, number):
        layer = self._data.layers[number]
        if layer.domain == "FACE":
            return layer.values[self._made.cage_faces]
        if layer.values.dtype.kind == "f":
            values = self._layers[str(number)].reshape(-1, *layer.values.shape[1:])
            if layer.kind == "QUATERNION":
                values = values / np.maximum(np.linalg.norm(values, axis=1, keepdims=True), np.finfo(np.float32).tiny)
            return values
        faces, places = self._made.corner_cage if layer.domain == "CORNER" else self._made.vert_cage
        nearest = self._nearest(faces.reshape(-1), places.reshape(-1, 2))
        return layer.values[nearest if layer.domain == "CORNER" else self._data.corner_verts[nearest]]

    def _nearest(self, faces, places):
        """The cage's corner."""
        sizes, places = _in_polygon(self._data, faces, places)
        return self._data.face_offsets[faces] + np.rint(_turn(places, sizes)).astype(np.int64) % sizes

    def moves(self, values):
        return self._cage.values(self._made, values, cancel=self._cancel)

    def rows(self, values):
        source, made = self._data.weights, []
        verts = np.repeat(np.arange(len(source.offsets) - 1), np.diff(source.offsets))
        groups = np.unique(source.indices)
        for first in range(0, len(groups), _COLUMNS):
            some = groups[first:first + _COLUMNS]
            there = np.isin(source.indices, some)
            table = np.zeros((len(source.offsets) - 1, len(some)), np.float32)
            table[verts[there], np.searchsorted(some, source.indices[there])] = values[there]
            limit = self._cage.values(self._made, table, cancel=self._cancel)
            vert, column = np.nonzero(limit > 0)
            made.append((vert, some[column], limit[vert, column]))
        vert, index, weight = (np.concatenate(parts) for parts in zip(*made)) if made else (np.zeros(0, int),) * 3
        order = np.lexsort([index, vert])
        offsets = np.concatenate([[0], np.cumsum(np.bincount(vert, minlength=len(self._made.positions)))]).astype(np.int64)
        return Rows(offsets, index[order].astype(np.int32), weight[order].astype(np.float32))
