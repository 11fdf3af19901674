// SPDX-License-Identifier: Apache-2.0
// Where the vertices went: sorts those that splits made by what called for them, and finds the edge and the face with the most.
#pragma once

#include "base/context.h"
#include "mesh/surface.h"

namespace dm {

// Fills the split_* and worst_* fields of the report, whose `splits` is known. s: made out of `in`. resolution: unit in the last
// place of the largest coordinate.
Status where_vertices_went(Context& context, const Mesh& in, const Surface& s, double resolution, delmesh_remesh_report& report);

} // namespace dm
