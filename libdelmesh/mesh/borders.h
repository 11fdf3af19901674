// SPDX-License-Identifier: Apache-2.0
// What the caller says of edges, and the edges at which his layers' values jump: bits of the mesh's edges (docs/attributes.md).
#pragma once

#include "mesh/build.h"

namespace dm {

// The marks of marked_edges and edge_marks on every copy of these edges, and the numbers of edge_verts. weld_to: empty, or per
// vertex as given the one that stands in for it. The mesh is connected and counted.
Status mark_edges(Context& context, const MeshInput& input, const Array<int32_t>& weld_to, double from, double to, Mesh& mesh);

// The borders of all layers, and the values that are needed again.
Status find_borders(Context& context, const MeshInput& input, double from, double to, Mesh& mesh);

// What edge_marks may say of edge e.
Status check_edge_mark(Context& context, int64_t e, int64_t bits);

// Of layers that were given none: 1e-5 of the range of the component that has the largest.
double default_affine_tolerance(const float* values, int64_t count, int32_t components);

// The bit of borders of a kind of layer.
EdgeBits border_bit(int32_t kind);

} // namespace dm
