// SPDX-License-Identifier: Apache-2.0
// The mesh that a handle holds: an oriented, manifold corner table that never changes once it is made, in the precision in which
// it is delivered. Operations copy it into a Surface (mesh/surface.h), work there, and make a new Mesh.
//
// Corner c = 3 f + k is the k-th corner of face f and stands for the directed edge from corner_vert[c] to
// corner_vert[next(c)]; the vertex opposite to that edge is corner_vert[prev(c)].
//
//      u = vert[prev(c)]
//        o
//       /  *
//      / f  *           twin[c]: the directed edge q -> p of the neighbouring face,
//     /      *          or a negative number on the boundary (see below)
//    o------>-o
//    p        q
//  vert[c]  vert[next(c)]
#pragma once

#include "base/array.h"
#include "base/round.h"
#include "base/vec.h"

namespace dm {

// In this form, an unsigned remainder compared with 0, they are one multiplication and a comparison: walks around vertices are made
// of them.
inline int32_t next_corner(int32_t c) {
    return static_cast<uint32_t>(c + 1) % 3 == 0 ? c - 2 : c + 1;
}
inline int32_t prev_corner(int32_t c) {
    return static_cast<uint32_t>(c) % 3 == 0 ? c + 2 : c - 1;
}
inline int32_t face_of(int32_t c) {
    return c / 3;
}

// corner_twin of a boundary corner: kBoundary, or cut_twin(slot) where a non-manifold edge was cut open. The slot leads to the
// ring of all copies of that edge, so that a split of one can be made on all.
constexpr int32_t kBoundary = -1;
inline int32_t cut_twin(int32_t slot) {
    return -2 - slot;
}
inline bool is_cut(int32_t twin) {
    return twin <= -2;
}
inline int32_t cut_slot(int32_t twin) {
    return -2 - twin;
}
struct CutSlot {
    int32_t corner; // the boundary corner that has this slot
    int32_t next;   // slot of the next copy of the same edge (a ring)
};

// Bits of an edge, equal on its two corners.
using EdgeBits = uint16_t;
enum EdgeBit : EdgeBits {
    kEdgeMarked = DELMESH_EDGE_MARKED,
    kEdgeFeature = DELMESH_EDGE_FEATURE,
    kEdgeSource = DELMESH_EDGE_SOURCE,
    // What was given with the mesh and is kept unless an operation is told to release it.
    kEdgeGiven = DELMESH_EDGE_MARKED | DELMESH_EDGE_SHARP | DELMESH_EDGE_SEAM | DELMESH_EDGE_CREASE | DELMESH_EDGE_UV |
                 DELMESH_EDGE_NORMAL | DELMESH_EDGE_COLOR | DELMESH_EDGE_LAYER | DELMESH_EDGE_MATERIAL | DELMESH_EDGE_FACE_SET,
    kEdgeFrozen = 0x8000, // of a face outside of the region: neither the edge nor its faces may change. Not handed out
};

// Where a vertex lies on the source: three source vertices and weights. Kept only for vertices made by splits.
struct VertexMap {
    int32_t vert[3];
    double weight[3];
};

// A place on the source: a point of the triangle of three corners, as the caller numbers them.
struct CornerPlace {
    int32_t corner[3];
    double weight[3];
};

// A place on a face of a cage, as delmesh.h says under Subdivide.
struct CagePlace {
    int32_t face;
    float s, t;
};

// A layer as it was given to mesh_create (docs/attributes.md).
struct MeshLayer {
    int32_t kind, components;
    bool keep; // its borders
    double affine_tolerance, weight;
    int64_t borders;     // edges
    int64_t first_value; // in layer_values; -1: not kept
};

struct MeshCounts { // see delmesh_mesh_info
    int64_t edges = 0, boundary_edges = 0, isolated_vertices = 0, components = 0, boundary_loops = 0, euler_characteristic = 0;
    int64_t polygons = 0, welded_vertices = 0, degenerate_faces = 0, duplicate_faces = 0, non_finite_faces = 0,
            reoriented_faces = 0, nonmanifold_edges = 0, nonmanifold_vertices = 0, copied_vertices = 0,
            unmatched_marked_edges = 0;
};

struct Mesh {
    explicit Mesh(Memory& memory)
        : pos32(memory), pos64(memory), corner_vert(memory), corner_twin(memory), corner_bits(memory), cut_slots(memory),
          face_source(memory), vert_source(memory), vert_join(memory), vert_parent(memory), split_map(memory), corner_map(memory),
          corner_places(memory), edge_source(memory), layers(memory), layer_values(memory), corner_cage(memory),
          cage_places(memory), face_cage(memory) {}

    // Made by mesh_create: its sources are the caller's arrays, and operations look through it to those. The sources of other
    // meshes are the mesh that they were made from.
    bool imported = false;
    Precision precision = Precision::f32;
    Array<float> pos32;          // 3 V, when precision is f32: the very numbers that are delivered
    Array<double> pos64;         // 3 V, when precision is f64
    Array<int32_t> corner_vert;  // 3 F
    Array<int32_t> corner_twin;  // 3 F
    Array<EdgeBits> corner_bits; // 3 F, or empty when no edge has a bit
    Array<CutSlot> cut_slots;
    Array<int32_t> face_source; // F, or empty for the identity
    Array<int32_t> vert_source; // V, or empty for the identity; -1 for split vertices
    Array<int32_t> vert_join;   // V, or empty for the identity
    Array<int32_t> vert_parent; // V, or empty for the identity: the vertex of the next coarser level
    int32_t first_split = 0;    // vertices [first_split, V) were made by splits, or moved by decimation;
    Array<VertexMap> split_map; // split_map[v - first_split] says where
    // Where corners and edges lie on the source, if has_map. Source corners, faces... are numbered as the caller did.
    bool has_map = false;
    Array<int32_t> corner_map; // 3 F, or empty for the identity: a source corner, or ~i for corner_places[i]
    Array<CornerPlace> corner_places;
    Array<int32_t> edge_source; // E, in the order of first corners, or empty for the identity; -1: no piece of a source edge
    int64_t source_verts = 0, source_corners = 0, source_faces = 0, source_edges = 0;
    // Only where imported or subdivided, and only of layers whose values are needed again: components after each other, corner by
    // corner of this mesh's own; where subdivided, place by place of cage_places. See layer_value (mesh/source_map.h).
    Array<MeshLayer> layers;
    Array<float> layer_values;
    // Where corners and faces lie on a cage; only of meshes that come from one.
    uint64_t cage = 0;          // what tells cages of different faces apart; 0: none
    Array<int32_t> corner_cage; // 3 F: which of cage_places
    Array<CagePlace> cage_places;
    Array<int32_t> face_cage; // F, or empty: the cage's face of a face's corners, which is then the same for all three
    int32_t vertex_count = 0;
    MeshCounts counts;

    // All that o has; arrays but for positions are o's own where its Memory lends them, and then o has to stay. mesh/share.cpp
    void share(const Mesh& o);
    void drop_map() {
        has_map = false;
        corner_map.free_storage();
        corner_places.free_storage();
        edge_source.free_storage();
    }

    int32_t vertices() const { return vertex_count; }
    int32_t corners() const { return static_cast<int32_t>(corner_vert.size()); }
    int32_t faces() const { return corners() / 3; }
    Vec3 position(int32_t v) const {
        const int64_t i = 3 * static_cast<int64_t>(v);
        if (precision == Precision::f32) return {pos32.data()[i], pos32.data()[i + 1], pos32.data()[i + 2]};
        return {pos64.data()[i], pos64.data()[i + 1], pos64.data()[i + 2]};
    }
    void set_position(int32_t v, const Vec3& x) { // rounded already
        const int64_t i = 3 * static_cast<int64_t>(v);
        const double xyz[3] = {x.x, x.y, x.z};
        for (int k = 0; k < 3; ++k) {
            if (precision == Precision::f32)
                pos32[i + k] = static_cast<float>(xyz[k]);
            else
                pos64[i + k] = xyz[k];
        }
    }
};

} // namespace dm
