// SPDX-License-Identifier: Apache-2.0
// Where the elements of a mesh lie on its source: the one reading of the maps that a Mesh holds (docs/attributes.md).
#pragma once

#include "mesh/mesh.h"

namespace dm {

// Through one of the arrays that are empty for the identity.
inline int32_t source_of(const Array<int32_t>& sources, int64_t i) {
    return sources.empty() ? static_cast<int32_t>(i) : sources[i];
}

inline VertexMap vertex_map(const Mesh& mesh, int32_t v) {
    if (!mesh.split_map.empty() && v >= mesh.first_split) return mesh.split_map[v - mesh.first_split];
    const int32_t s = source_of(mesh.vert_source, v);
    return {{s, s, s}, {1, 0, 0}};
}

// Only where mesh.has_map.
inline CornerPlace corner_place(const Mesh& mesh, int32_t c) {
    const int32_t s = source_of(mesh.corner_map, c);
    if (s < 0) return mesh.corner_places[~s];
    return {{s, s, s}, {1, 0, 0}};
}

// Only where mesh.cage is not 0.
inline const CagePlace& cage_place(const Mesh& mesh, int64_t c) {
    return mesh.cage_places.data()[mesh.corner_cage.data()[c]];
}
inline int32_t cage_face(const Mesh& mesh, int64_t f) {
    return mesh.face_cage.empty() ? cage_place(mesh, 3 * f).face : mesh.face_cage[f];
}

// Where a corner has its values of a layer in mesh.layer_values; and of how many corners or places there are some.
inline int64_t layer_value(const Mesh& mesh, const MeshLayer& layer, int32_t c) {
    return layer.first_value + int64_t{mesh.cage != 0 ? mesh.corner_cage.data()[c] : c} * layer.components;
}
inline int64_t layer_value_count(const Mesh& mesh) {
    return mesh.cage != 0 ? mesh.cage_places.size() : mesh.corners();
}

// What `out`, which was made from `in`, has for its source.
inline void set_source_counts(const Mesh& in, Mesh& out) {
    out.source_verts = in.imported ? in.source_verts : in.vertices();
    out.source_corners = in.imported ? in.source_corners : in.corners();
    out.source_faces = in.imported ? in.source_faces : in.faces();
    out.source_edges = in.imported ? in.source_edges : in.counts.edges;
}

// Edges are numbered by their first corner. Without a branch, since which it is no one can predict: a twin < 0 is large.
inline bool is_first_of_edge(const Mesh& mesh, int32_t c) {
    return static_cast<uint32_t>(c) < static_cast<uint32_t>(mesh.corner_twin[c]);
}

// The next corner counter-clockwise around the vertex of c; < 0 past the boundary.
inline int32_t next_around(const Mesh& mesh, int32_t c) {
    return mesh.corner_twin[prev_corner(c)];
}
// body(c) for the corners around a vertex, counter-clockwise from `start`; the boundary ends it.
template <class Body>
void for_corners_around(const Mesh& mesh, int32_t start, Body&& body) {
    int32_t c = start;
    do {
        body(c);
        c = next_around(mesh, c);
    } while (c >= 0 && c != start);
}

} // namespace dm
