# SPDX-License-Identifier: Apache-2.0
"""How attributes follow a remesh: where every corner, vertex, face and edge of the result comes from in the source arrays.

The hard part is the corners, because UVs differ on the two sides of a seam. Mark the seams (marked_edges) when the source Mesh is
made: remesh then never flips them, so that around every vertex the *sectors*, the runs of faces between two marked or boundary
edges, are the same in the source and in the result, however many faces were flipped in between. A corner of the result takes the
values of its sector in the source: exact at source vertices, and on its own side of every seam.

One corner of a sector has a marked or boundary edge as its outgoing edge, where the sector ends clockwise. That directed edge,
or the source edge of which it is a piece, names the sector in source and result alike. A sector without such an edge goes all the
way round and is the only one of its vertex.
"""
import numpy as np

from ._capi import DELMESH_EDGE_MARKED, DELMESH_EDGE_SOURCE


class _Table:
    """Finds integer keys; of equal keys the first."""

    def __init__(self, keys, values):
        order = np.argsort(keys, kind="stable")
        self.keys, self.values = keys[order], values[order]

    def find(self, keys):
        """-> value per key, -1 where there is none."""
        if len(self.keys) == 0:
            return np.full(np.shape(keys), -1, np.int64)
        at = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
        return np.where(self.keys[at] == keys, self.values[at], -1)


class _Corners:
    """The corners of a Mesh, flat, and their sectors."""

    def __init__(self, mesh):
        self.vert = mesh.faces.reshape(-1).astype(np.int64)
        self.twin = mesh.corner_twins.reshape(-1).astype(np.int64)
        self.next = np.arange(len(self.vert)).reshape(-1, 3)[:, [1, 2, 0]].reshape(-1)
        self.marked = (mesh.edge_flags[mesh.corner_edges.reshape(-1)] & DELMESH_EDGE_MARKED) != 0
        self.vert_source = mesh.vert_source.astype(np.int64)
        self.face_source = mesh.face_source.astype(np.int64)
        # The next corner around the vertex: in the face across the outgoing edge, unless the sector ends there.
        corners = np.arange(len(self.vert))
        open_edge = (self.twin >= 0) & ~self.marked
        step = np.where(open_edge, self.next[self.twin], corners)
        end, low = step, corners
        for _ in range(int(np.bincount(self.vert).max(initial=1)).bit_length()):  # doubling: 2^k steps at a time
            low = np.minimum(low, low[end])
            end = end[end]
        # A sector is named by its end, or if it goes all the way round by its lowest corner.
        self.ends = ~open_edge[end]
        self.sector = np.where(self.ends, end, low)


class SurfaceMap:
    """Where everything in `result` comes from in the arrays that `source` was made of.

    source        the Mesh given to remesh, made without weld, with the seams of the attributes as marked_edges
    result        what remesh made of it, a Mesh or a Result, without compact
    corner_verts  (c,) and face_offsets (m + 1,): the polygons of the source as they were given; by default triangles

    corners, corner_weights  (3 f, 3) source corners and weights of each corner of the result
    verts, vert_weights      (v, 3) the same for vertices
    faces                    (f,) source polygon of each face
    """

    def __init__(self, source, result, corner_verts=None, face_offsets=None):
        result = getattr(result, "mesh", result)  # of a Result
        s, r = _Corners(source), _Corners(result)
        if corner_verts is None:
            corner_verts = s.vert_source[s.vert]
        polygon_verts = np.asarray(corner_verts).reshape(-1).astype(np.int64)
        if face_offsets is None:
            face_offsets = np.arange(0, len(polygon_verts) + 1, 3)
        self.faces = result.face_source
        self.verts, self.vert_weights = result.vert_map
        self._result = result
        self._sources = max(int(polygon_verts.max(initial=-1)), int(s.vert_source.max(initial=-1))) + 1
        sectors = np.flatnonzero(r.sector == np.arange(len(r.sector)))
        number = np.empty(len(r.sector), np.int64)
        number[sectors] = np.arange(len(sectors))
        # Per corner of the result and source vertex: the corner that names a sector of the source.
        ends = self._match(s, r, sectors)[number[r.sector]]
        self._choose(s, r, ends, polygon_verts, np.diff(face_offsets))

    def _match(self, s, r, sectors):
        """For each sector of the result (named by a corner) and each of the three source vertices of its vertex: the sector of
        the source to take values from, named by a corner of the source Mesh."""
        big = self._sources
        source_at, source_head = s.vert_source[s.vert], s.vert_source[s.vert[s.next]]
        named = np.flatnonzero(s.sector == np.arange(len(s.vert)))
        found = np.full((len(sectors), 3), -1, np.int64)
        vert, head = r.vert[sectors], r.vert[r.next[sectors]]
        verts, weights = self.verts[vert].astype(np.int64), self.vert_weights[vert]
        ends = r.ends[sectors]

        # Vertices of the source Mesh: vertex i of both is the same.
        count = np.bincount(s.vert[named], minlength=len(s.vert_source))
        only = np.zeros(len(s.vert_source), np.int64)
        only[s.vert[named]] = named
        kept = np.flatnonzero(vert < len(count))
        single = kept[count[vert[kept]] == 1]
        found[single] = only[vert[single], None]
        several = kept[(count[vert[kept]] > 1) & ends[kept]]
        along = self._other_end(vert[several], head[several])
        named_ends = named[s.ends[named]]
        table = _Table(s.vert[named_ends] * big + source_head[named_ends], named_ends)
        found[several] = np.where(along >= 0, table.find(vert[several] * big + along), -1)[:, None]

        # Vertices that split an edge a b of the source: the side is the one with the directed edge that leaves the sector.
        split = np.flatnonzero((r.vert_source[vert] < 0) & (np.count_nonzero(weights, axis=1) == 2))
        pair, where = self._ends_of(vert[split])
        pair_head, where_head = self._ends_of(head[split])
        same = (pair == pair_head).all(axis=1)
        at_end = r.vert_source[head[split], None] == pair  # the edge ends at a source vertex
        forward = np.where(same, where_head > where, at_end[:, 1])
        known = same | at_end.any(axis=1)
        first = np.where(forward, pair[:, 0], pair[:, 1])
        last = np.where(forward, pair[:, 1], pair[:, 0])
        wanted = np.zeros(big, bool)
        wanted[pair] = True
        candidates = np.flatnonzero(wanted[source_at] & wanted[source_head])
        key = source_at[candidates] * big + source_head[candidates]
        polygons = int(max(s.face_source.max(initial=0), r.face_source.max(initial=0))) + 1
        edges = _Table(key, candidates)
        numbers = _Table(edges.keys, np.arange(len(key)))  # of keys: small, so that a polygon number fits beside them
        exact = _Table(numbers.find(key) * polygons + s.face_source[candidates // 3], candidates)

        def side(a, b, polygon):
            """The corner of the source at a of its directed edge a b: the polygon's own, if it has one (sheets that meet in one
            edge have the same a and b)."""
            number = numbers.find(a * big + b)
            own = np.where(number >= 0, exact.find(number * polygons + polygon), -1)
            return np.where(own >= 0, own, edges.find(a * big + b))

        polygon = r.face_source[sectors[split] // 3]
        corner = np.where(~ends[split] | known, side(first, last, polygon), -1)
        inner = np.flatnonzero((corner < 0) & ~ends[split])  # not on a seam: both sides are the same
        corner[inner] = side(last[inner], first[inner], polygon[inner])
        hit = np.flatnonzero(corner >= 0)
        tail_sector, head_sector = s.sector[corner[hit]], s.sector[s.next[corner[hit]]]
        at_tail = verts[split[hit]] == source_at[corner[hit], None]
        found[split[hit]] = np.where(at_tail, tail_sector[:, None], head_sector[:, None])

        # The rest lies off the edges of the source: in flat places, or after flips.
        count = np.bincount(source_at[named], minlength=big)
        only = np.full(big, -1, np.int64)
        only[source_at[named]] = named
        rows, slots = np.nonzero((found < 0) & (weights != 0))
        where_from = verts[rows, slots]
        found[rows, slots] = np.where(count[where_from] == 1, only[where_from], -1)
        left = found[rows, slots] < 0
        sector_row = {int(name): row for row, name in enumerate(sectors)} if left.any() else {}
        for row, slot in zip(rows[left], slots[left]):
            found[row, slot] = _nearest(r, sectors[row], verts[row, slot], sector_row, found)
        return found

    def _ends_of(self, vert):
        """The source edge on which split vertices lie: (n, 2) ends in ascending order, (n,) weight of the second."""
        verts, weights = self.verts[vert].astype(np.int64), self.vert_weights[vert]
        used = np.where(weights != 0, verts, verts[np.arange(len(vert)), np.argmax(weights, axis=1), None])
        low, high = used.min(axis=1), used.max(axis=1)
        return np.stack([low, high], axis=1), (weights * (verts == high[:, None])).sum(axis=1)

    def _other_end(self, vert, head):
        """The source vertex at the far end of the source edge of which vert -> head is the first piece, -1 if there is none."""
        own = self.verts[vert, 0].astype(np.int64)
        pair, _ = self._ends_of(head)
        on_edge = np.count_nonzero(self.vert_weights[head], axis=1) == 2
        other = np.where(pair[:, 0] == own, pair[:, 1], np.where(pair[:, 1] == own, pair[:, 0], -1))
        return np.where(on_edge, other, np.where(pair[:, 0] == pair[:, 1], pair[:, 0], -1))

    def _choose(self, s, r, ends, polygon_verts, sizes):
        """From sectors to corners: inside its sector a corner prefers the polygon that its face comes from."""
        big = self._sources
        key = np.repeat(np.arange(len(sizes)), sizes) * big + polygon_verts
        table = _Table(key, np.arange(len(key)))
        to_polygon = table.find(np.repeat(s.face_source, 3) * big + s.vert_source[s.vert])
        if (to_polygon < 0).any():
            raise ValueError("the polygons are not those that the source mesh was made of")
        sector = np.full(len(key), -1, np.int64)
        sector[to_polygon] = s.sector
        anywhere = np.zeros(big, np.int64)
        anywhere[polygon_verts] = np.arange(len(key))
        self.corners = np.empty((len(r.vert), 3), np.int64)
        self.corner_weights = self.vert_weights[r.vert]
        face_source = np.repeat(r.face_source, 3)
        for slot in range(3):
            used = np.flatnonzero(self.corner_weights[:, slot] != 0)
            vert = self.verts[r.vert[used], slot].astype(np.int64)
            own = table.find(face_source[used] * big + vert)
            end = ends[used, slot]
            is_there = (own >= 0) & ((sector[own] == end) | (end < 0))
            self.corners[:, slot] = self.corners[:, 0]
            self.corners[used, slot] = np.where(is_there, own, np.where(end >= 0, to_polygon[end], anywhere[vert]))

    # ---- Values ------------------------------------------------------------------------------------------------------------

    def corner_values(self, values):
        """Source values, one row per corner of the polygons, carried to the corners of the result."""
        return _gather(values, self.corners, self.corner_weights)

    def vert_values(self, values):
        """The same for vertices."""
        return _gather(values, self.verts, self.vert_weights)

    def face_values(self, values):
        """The same for faces."""
        return np.asarray(values)[self.faces]

    def edge_source(self, edges):
        """For each edge of the result the row of `edges` (n, 2), edges of the source, of which it is a piece; or -1."""
        edges = np.sort(np.asarray(edges, np.int64).reshape(-1, 2), axis=1)
        table = _Table(edges[:, 0] * self._sources + edges[:, 1], np.arange(len(edges)))
        result = np.full(len(self._result.edges), -1, np.int64)
        pieces = np.flatnonzero(self._result.edge_flags & DELMESH_EDGE_SOURCE)
        ends = self._result.edges[pieces]
        pairs = np.concatenate([self._ends_of(ends[:, 0])[0], self._ends_of(ends[:, 1])[0]], axis=1)
        result[pieces] = table.find(pairs.min(axis=1) * self._sources + pairs.max(axis=1))
        return result


def _nearest(r, start, source_vert, sector_row, found):
    """The source sector of the corner at source_vert that is the fewest faces away without crossing a marked edge. Rare."""
    front, seen = [int(start) // 3], {int(start) // 3}
    while front:
        further = []
        for face in front:
            for corner in range(3 * face, 3 * face + 3):
                if r.vert_source[r.vert[corner]] == source_vert:
                    there = found[sector_row[int(r.sector[corner])], 0]
                    if there >= 0:
                        return there
                twin = int(r.twin[corner])
                if twin >= 0 and not r.marked[corner] and twin // 3 not in seen:
                    seen.add(twin // 3)
                    further.append(twin // 3)
        front = further
    return -1


def _gather(values, index, weights):
    """Rows of `values` blended; rows with one source, and what cannot be blended (integers, booleans), are copied bit for bit."""
    values = np.asarray(values)
    heaviest = np.argmax(weights, axis=1)
    out = values[index[np.arange(len(index)), heaviest]]
    blended = np.flatnonzero(weights[np.arange(len(index)), heaviest] != 1)
    if values.dtype.kind == "f" and len(blended):
        shape = (len(blended), 3) + (1,) * (values.ndim - 1)
        mixed = (values[index[blended]].astype(np.float64) * weights[blended].reshape(shape)).sum(axis=1)
        out[blended] = mixed.astype(values.dtype)
    return out
