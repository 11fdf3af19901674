// SPDX-License-Identifier: Apache-2.0
// Import: from any polygon soup to an oriented manifold Mesh. docs/import.md says what is repaired and how.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// The caller's arrays, checked for shape and type by api/ but not for content.
struct MeshInput {
    delmesh_view positions{}, corner_verts{}, face_offsets{}, face_sizes{}, marked_edges{}, edge_verts{}, edge_marks{};
    static constexpr int32_t kMostLayers = 64;
    delmesh_layer layers[kMostLayers]; // `border` is KEEP or FREE, values have a stride
    int32_t layer_count = 0;
    bool weld = false, strict = false;
};

// Fills `out` (empty), counts included. On failure `out` is to be thrown away and the error sentence is set.
Status build_mesh(Context& context, const MeshInput& input, Mesh& out);

// Edges, boundary, components, loops and Euler characteristic of a finished connectivity; leaves the repair counts alone.
// glance: what connect_faces knows of it, which is used up.
struct Glance;
Status count_mesh(Context& context, Mesh& mesh, Glance* glance = nullptr);
Status count_boundary_edges(Context& context, const Mesh& mesh, int64_t& count);

} // namespace dm
