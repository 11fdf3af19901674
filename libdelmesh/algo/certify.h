// SPDX-License-Identifier: Apache-2.0
// The library's certificate: an exact look at every edge and face of a finished Mesh, on the very numbers it delivers.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

struct Certificate {
    int64_t nld_interior = 0, nld_boundary = 0, zero_area_faces = 0, exact_tests = 0;
    int32_t first_bad_corner = -1, first_zero_face = -1;
    bool delaunay(bool boundary_rule) const {
        return nld_interior == 0 && zero_area_faces == 0 && (!boundary_rule || nld_boundary == 0);
    }
};

// Either list may be null; they get the offending edges (by one of their corners) and faces, in index order.
Status certify_mesh(Context& context, const Mesh& mesh, bool boundary_rule, Certificate& out, Array<int32_t>* nld_corners,
                    Array<int32_t>* zero_faces);

} // namespace dm
