// SPDX-License-Identifier: Apache-2.0
// From the Surface that the loop leaves to the Mesh that is delivered.
#pragma once

#include "algo/surface_map.h"
#include "mesh/surface.h"

namespace dm {

// Closes up what was removed, writes the positions in the output's precision, and tells where faces and vertices come from.
// reach: how far a split vertex may lie from the source. The surface's arrays are moved into `out`; all of it but the counts and the
// maps of corners and edges. traces: null, or what these need.
Status hand_out(Context& context, const Mesh& in, Surface& surface, const delmesh_remesh_options& options, double reach,
                VertexTraces* traces, Mesh& out);

} // namespace dm
