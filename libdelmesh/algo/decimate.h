// SPDX-License-Identifier: Apache-2.0
// Decimation by edge collapses, one level after the other.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// Per element of the source, checked; null where the caller gave none.
struct DecimationInput {
    const double* vert_weights = nullptr; // of the Mesh's vertices: copies that import made have those of what they copy
    const uint8_t* locked_verts = nullptr;
    const uint8_t* face_mask = nullptr; // of the Mesh's faces
};

// options are checked and complete; the reports arrive zeroed but for struct_size and are filled as far as the call got.
// out, levels: `count` of them.
Status decimate(Context& context, const Mesh& in, const delmesh_target* targets, int32_t count,
                const delmesh_decimate_options& options, const DecimationInput& input, Mesh* const* out,
                delmesh_level_report* levels, delmesh_decimate_report& report);

} // namespace dm
