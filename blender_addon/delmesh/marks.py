# SPDX-License-Identifier: GPL-3.0-or-later
"""Which edges a remesh must keep so that attributes can follow: on numpy arrays alone, without bpy.

Corners are numbered polygon by polygon; corner i has the vertex corner_verts[i], and corner_edges[i] is the edge to the next one.
"""
import numpy as np


class Polygons:
    def __init__(self, corner_verts, corner_edges, face_offsets, edge_count):
        self.verts, self.edges, self.edge_count = corner_verts, corner_edges, edge_count
        sizes = np.diff(face_offsets)
        self.faces = np.repeat(np.arange(len(sizes)), sizes)
        self.next = np.arange(1, len(corner_verts) + 1)
        filled = sizes > 0
        self.next[face_offsets[1:][filled] - 1] = face_offsets[:-1][filled]
        # The first corner of each edge; the others are compared with it.
        self.first = np.full(edge_count, -1)
        self.first[corner_edges[::-1]] = np.arange(len(corner_edges))[::-1]
        self.others = np.flatnonzero(self.first[corner_edges] != np.arange(len(corner_edges)))
        self.mates = self.first[corner_edges[self.others]]

    def _edges(self, differs):
        marked = np.zeros(self.edge_count, bool)
        marked[self.edges[self.others[differs]]] = True
        return marked

    def face_borders(self, values):
        """Edges between faces with different values."""
        values = values[self.faces]
        return self._edges(values[self.others] != values[self.mates])

    def _by_vertex(self, values, corners):
        """Values at the two ends of the edges of `corners`, the lower vertex first."""
        here, there = values[corners], values[self.next[corners]]
        swap = (self.verts[corners] > self.verts[self.next[corners]]).reshape(-1, *[1] * (values.ndim - 1))
        return np.where(swap, there, here), np.where(swap, here, there)

    def corner_borders(self, values):
        """Edges whose two sides have different values at an end: UV seams. Rounding noise is no difference."""
        differs = np.zeros(len(self.others), bool)
        for a, b in zip(self._by_vertex(values, self.others), self._by_vertex(values, self.mates)):
            differs |= (np.abs(a - b) > 1e-6 * np.maximum(1, np.abs(a))).any(axis=1)
        return self._edges(differs)

    def bends(self, values, positions):
        """Edges across which the values (UVs) are continuous but not the same linear function, where the surface is nearly flat:
        a flip there would not move the surface, but the values inside the faces."""
        positions = positions.astype(np.float64)
        p = self.mates
        q = self.others
        a, b = positions[self.verts[p]], positions[self.verts[self.next[p]]]
        # The third corners: after the edge on one side, and on the other.
        c, d = self.next[self.next[p]], self.next[self.next[q]]
        along = b - a
        square = np.maximum((along * along).sum(axis=1), np.finfo(np.float64).tiny)[:, None]

        def frame(corner):
            """Position along the edge (0..1), and the offset from it, of a corner."""
            offset = positions[self.verts[corner]] - a
            t = (offset * along).sum(axis=1, keepdims=True) / square
            return t, offset - t * along

        (tc, hc), (td, hd) = frame(c), frame(d)
        lc, ld = (np.sqrt((h * h).sum(axis=1, keepdims=True)) for h in (hc, hd))
        flat = ((hc * hd).sum(axis=1, keepdims=True) < -0.99 * lc * ld)[:, 0]
        values = values.astype(np.float64)
        va, vb = values[p], values[self.next[p]]
        with np.errstate(divide="ignore", invalid="ignore"):
            expected = va + td * (vb - va) - ld / lc * (values[c] - va - tc * (vb - va))
        size = np.abs(vb - va).max(axis=1) + np.abs(values[d] - va).max(axis=1)
        return self._edges(flat & ~(np.abs(expected - values[d]).max(axis=1) <= 1e-4 * size))
