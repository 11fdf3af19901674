// SPDX-License-Identifier: Apache-2.0
// The cage that a handle holds: a checked polygon mesh with creases and layers, and the limit surface that it stands for
// (docs/subdivide.md). It never changes once it is made.
#pragma once

#include "mesh/build.h"
#include "subdiv/limit.h"

namespace dm {

// The caller's arrays, checked for shape and type by api/ but not for content.
struct CageInput {
    MeshInput mesh; // positions, faces, marks, layers
    CageRules rules;
    delmesh_view crease_edges{}, crease_sharpness{}, sharp_verts{}, vert_sharpness{}, holes{};
};

// A layer of the cage. Those at corners are face-varying: equal values at a vertex are one value.
struct CageLayer {
    delmesh_layer given; // its view is not to be read any more
    int32_t channel;     // of the limit surface; -1: a layer of faces
    int32_t components;
    int64_t borders;      // edges of the cage
    int64_t first_index;  // in value_index: of the first corner's
    int64_t first_value;  // in values, and
    int64_t value_count;  // so many, of `components` numbers each
    int64_t first_corner; // in value_corner: of the first value's
};

class Cage {
public:
    explicit Cage(Memory& memory)
        : positions(memory), face_first(memory), corner_vert(memory), corner_edge(memory), edge_verts(memory), edge_bits(memory),
          hole(memory), has_limit(memory), crease_verts(memory), crease_sharpness(memory), sharp_verts(memory),
          vert_sharpness(memory), layers(memory), value_index(memory), value_corner(memory), values(memory) {}

    // On failure the cage is to be thrown away and the error sentence is set.
    Status build(Context& context, const CageInput& input);

    int32_t vertices() const { return static_cast<int32_t>(positions.size() / 3); }
    int32_t faces() const { return static_cast<int32_t>(face_first.size() - 1); }
    int32_t corners() const { return static_cast<int32_t>(corner_vert.size()); }
    int32_t edges() const { return static_cast<int32_t>(edge_verts.size() / 2); }
    int32_t face_size(int32_t f) const { return face_first[f + 1] - face_first[f]; }
    // The topology of a channel, for whoever evaluates it.
    const int32_t* index_of(const CageLayer& layer) const { return value_index.data() + layer.first_index; }

    CageRules rules{};
    Array<double> positions;     // 3 V
    Array<int32_t> face_first;   // F + 1: the first corner of each face
    Array<int32_t> corner_vert;  // C
    Array<int32_t> corner_edge;  // C: the edge from the corner to the next
    Array<int32_t> edge_verts;   // 2 E: the lower vertex, then the upper
    Array<EdgeBits> edge_bits;   // E
    Array<uint8_t> hole;         // F
    Array<uint8_t> has_limit;    // F
    Array<int32_t> crease_verts; // 2 per crease, each an edge of a face
    Array<float> crease_sharpness;
    Array<int32_t> sharp_verts;
    Array<float> vert_sharpness;
    int64_t unmatched_creases = 0;
    Array<CageLayer> layers;
    Array<int32_t> value_index;  // C per layer at corners: the number of the corner's value
    Array<int32_t> value_corner; // per value of a layer at corners: the first corner that has it
    Array<double> values;
    uint64_t fingerprint = 0; // of the faces; never 0
    Limit limit;
};

} // namespace dm
