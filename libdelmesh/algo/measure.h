// SPDX-License-Identifier: Apache-2.0
// Quality figures of one mesh, and the two-sided distance between two.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// `report` arrives zeroed but for struct_size.
Status measure_quality(Context& context, const Mesh& mesh, delmesh_quality_report& report);
Status measure_distance(Context& context, const Mesh& a, const Mesh& b, const delmesh_distance_options& options,
                        delmesh_distance_report& report);

// A proven bound of the two-sided distance, a percent more than need be.
Status bound_distance(Context& context, const Mesh& a, const Mesh& b, double& bound);

} // namespace dm
