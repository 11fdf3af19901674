// SPDX-License-Identifier: Apache-2.0
// Another order of a mesh's elements, in which what is near in space is near in memory: for operations that jump about.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

struct SpatialOrder {
    explicit SpatialOrder(Memory& memory) : old_vert(memory), new_vert(memory), old_face(memory), new_face(memory) {}
    Array<int32_t> old_vert, new_vert; // per vertex of the new order the one of the old, and the other way round
    Array<int32_t> old_face, new_face;
};

// Vertices along a Z-order curve (Morton 1966), faces by their first vertex there. Only the connectivity, its bits and the
// positions go into `out`: no sources, maps, counts. O(n).
Status sort_in_space(Context& context, const Mesh& in, SpatialOrder& order, Mesh& out);

} // namespace dm
