// SPDX-License-Identifier: Apache-2.0
// Who is whose neighbour in a list of triangles that is an oriented manifold already.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

struct FanLinks {
    bool oriented_manifold = false; // every edge has at most two faces, which run along it in opposite directions
    bool several_fans = false;      // and the faces around some vertex form several fans
};

// Fills corner_twin, if the faces are an oriented manifold along their edges; else its contents are undefined. Faces must have
// three different vertices in range. O(corners), in parallel. Uses the part from..to of the context's stage.
Status link_fans(Context& context, double from, double to, Mesh& mesh, FanLinks& found);

} // namespace dm
