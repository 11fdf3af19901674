# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh with everything on it as numpy arrays: what exchange.py reads and writes and survive.py carries. Without bpy, so that it
can go to another process.

Corners are numbered polygon by polygon: corner i has the vertex corner_verts[i], and corner_edges[i] is the edge to the next one of
its polygon. Domains are named as Blender names them: POINT, EDGE, FACE, CORNER."""
import dataclasses
import functools

import numpy as np


@dataclasses.dataclass
class Layer:
    """`values` has a row per element of `domain`. kind: the type of a Blender attribute, of which BYTE_COLOR is as it is stored, in
    sRGB; "UV"; or where it is kept otherwise, see exchange.py. texts: of strings, which values number."""

    name: str
    kind: str
    domain: str
    values: np.ndarray
    texts: list = dataclasses.field(default_factory=list)


@dataclasses.dataclass
class Rows:
    """Sparse numbers: element i has values[k] of the group indices[k] for k from offsets[i] to offsets[i + 1]."""

    offsets: np.ndarray
    indices: np.ndarray
    values: np.ndarray

    def take(self, elements):
        """The rows of these elements."""
        begin, count = self.offsets[elements], np.diff(self.offsets)[elements]
        offsets = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
        entries = np.repeat(begin - offsets[:-1], count) + np.arange(offsets[-1])
        return Rows(offsets, self.indices[entries], self.values[entries])

    @functools.cached_property
    def by_value(self):
        """{group: (values, bounds, elements)}, as lists: elements[bounds[i]:bounds[i + 1]] have values[i] of that group."""
        order = np.lexsort([self.values, self.indices])
        elements = np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))[order]
        groups, first = np.unique(self.indices[order], return_index=True)
        made = {}
        for group, low, high in zip(groups.tolist(), first, [*first[1:], len(order)]):
            values = self.values[order[low:high]]
            starts = np.flatnonzero(np.diff(values, prepend=np.nan))
            made[group] = values[starts].tolist(), [*starts.tolist(), int(high - low)], elements[low:high].tolist()
        return made

    @staticmethod
    def concatenate(parts):
        offsets = [parts[0].offsets]
        for part in parts[1:]:
            offsets.append(part.offsets[1:] + offsets[-1][-1])
        return Rows(np.concatenate(offsets), np.concatenate([part.indices for part in parts]),
                    np.concatenate([part.values for part in parts]))


@dataclasses.dataclass
class MeshData:
    positions: np.ndarray  # (v, 3) float32
    edges: np.ndarray  # (e, 2) int32, those without faces too
    corner_verts: np.ndarray  # (c,) int32
    corner_edges: np.ndarray  # (c,) int32
    face_offsets: np.ndarray  # (f + 1,) int32
    layers: list  # of Layer
    weights: Rows | None = None  # vertex groups by their number
    keys: list = dataclasses.field(default_factory=list)  # (v, 3) float32 per shape key
    normals: np.ndarray | None = None  # (c, 3) float32: custom normals

    def prepare(self):
        """Computes what writing needs besides, here and not on Blender's main thread."""
        if self.weights:
            self.weights.by_value  # noqa: B018 which stays

    def layer(self, name):
        """The values of the layer of that name, None without it."""
        return next((layer.values for layer in self.layers if layer.name == name), None)

    def corners_of(self, faces):
        """(c,) bool: the corners of the faces (f,) bool."""
        return np.repeat(faces, np.diff(self.face_offsets))

    def part(self, faces):
        """Those faces, with all vertices and edges."""
        corners = self.corners_of(faces)
        chosen = {"FACE": faces, "CORNER": corners}
        offsets = np.concatenate([[0], np.cumsum(np.diff(self.face_offsets)[faces])]).astype(np.int32)
        layers = [dataclasses.replace(layer, values=layer.values[chosen[layer.domain]]) if layer.domain in chosen else layer
                  for layer in self.layers]
        return dataclasses.replace(self, corner_verts=self.corner_verts[corners], corner_edges=self.corner_edges[corners],
                                   face_offsets=offsets, layers=layers,
                                   normals=None if self.normals is None else self.normals[corners])

    def loose_edges(self):
        """Numbers of the edges that no face uses."""
        used = np.zeros(len(self.edges), bool)
        used[self.corner_edges] = True
        return np.flatnonzero(~used)

    def border_verts(self):
        """(v,) bool: the ends of edges with one face."""
        once = np.bincount(self.corner_edges, minlength=len(self.edges)) == 1
        marked = np.zeros(len(self.positions), bool)
        marked[self.edges[once]] = True
        return marked
