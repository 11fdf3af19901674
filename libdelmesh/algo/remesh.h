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
// whole: if `in` is a piece of a model, the size of that. face_mask: null, or per face 0 where it and its edges stay as they are,
// Delaunay or not; these edges are frozen in `out`.
Status remesh(Context& context, const Mesh& in, const delmesh_remesh_options& options, Mesh& out, delmesh_remesh_report& report,
              const ModelSize* whole = nullptr, const uint8_t* face_mask = nullptr);

} // namespace dm
