// SPDX-License-Identifier: Apache-2.0
// Delaunay remeshing: repair at the output precision, flips, splits, certificate.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// What decides about units in the last place and shells. A piece of a model has its model's.
struct ModelSize {
    double largest, diagonal; // coordinate in size; of the bounding box
};

// options are checked and complete; `report` arrives zeroed but for struct_size and is filled as far as the call got.
// whole: if `in` is a piece of a model, the size of that.
Status remesh(Context& context, const Mesh& in, const delmesh_remesh_options& options, Mesh& out, delmesh_remesh_report& report,
              const ModelSize* whole = nullptr);

} // namespace dm
