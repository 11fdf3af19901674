// SPDX-License-Identifier: Apache-2.0
// The library's certificate: an exact look at every edge and face of a finished Mesh, on the very numbers it delivers.
#pragma once

#include "algo/nld_scan.h"

namespace dm {

// Either list may be null; they get the offending edges (by one of their corners) and faces, in index order.
Status certify_mesh(Context& context, const Mesh& mesh, bool boundary_rule, Certificate& out, Array<int32_t>* nld_corners,
                    Array<int32_t>* zero_faces);
// The same, but edges that are frozen, and faces without area all of whose edges are, count as `outside` only.
Status certify_unfrozen(Context& context, const Mesh& mesh, bool boundary_rule, Certificate& out, int64_t& outside);

} // namespace dm
