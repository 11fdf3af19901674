// SPDX-License-Identifier: Apache-2.0
// Delaunay remeshing: repair at the output precision, flips, splits, certificate.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// options are checked and complete; `report` arrives zeroed but for struct_size and is filled as far as the call got.
Status remesh(Context& context, const Mesh& in, const delmesh_remesh_options& options, Mesh& out, delmesh_remesh_report& report);

} // namespace dm
