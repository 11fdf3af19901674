// SPDX-License-Identifier: Apache-2.0
// Who is whose neighbour in a list of triangles that is an oriented manifold already.
#pragma once

#include <limits>

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

struct FanLinks {
    bool oriented_manifold = false; // every edge has at most two faces, which run along it in opposite directions
    bool several_fans = false;      // and the faces around some vertex form several fans
    int64_t boundary_edges = 0;     // with an oriented manifold
};

// Fills corner_twin, if the faces are an oriented manifold along their edges; else its contents are undefined. Faces must have
// three different vertices in range. O(corners), in parallel. Uses the part from..to of the context's stage.
// least_neighbour: gets per vertex the least of itself and its neighbours, kNoNeighbour where no face has it.
constexpr int32_t kNoNeighbour = std::numeric_limits<int32_t>::max();
Status link_fans(Context& context, double from, double to, Mesh& mesh, FanLinks& found, Array<int32_t>& least_neighbour);

} // namespace dm
