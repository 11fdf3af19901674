// SPDX-License-Identifier: Apache-2.0
#include "algo/certify.h"

#include "algo/nld_scan.h"

namespace dm {

Status certify_mesh(Context& context, const Mesh& mesh, bool boundary_rule, Certificate& out, Array<int32_t>* nld_corners,
                    Array<int32_t>* zero_faces) {
    out = Certificate{};
    const int32_t faces = mesh.faces();
    Array<uint8_t> marks(context.memory()); // only when lists are asked for
    if (nld_corners != nullptr || zero_faces != nullptr) marks.resize_uninitialized(faces);
    const auto scan = [&](const auto& positions) {
        const ScanView view{mesh.corner_vert.data(), mesh.corner_twin.data(), positions.data(), faces};
        return scan_faces(context, view, boundary_rule, marks.data(), out);
    };
    DM_TRY(mesh.precision == Precision::f32 ? scan(mesh.pos32) : scan(mesh.pos64));
    for_each_marked(marks.data(), marks.empty() ? 0 : faces, [&](int32_t f) {
        for (int32_t k = 0; k < 3; ++k)
            if ((marks[f] >> k & 1) != 0 && nld_corners != nullptr) nld_corners->push_back(3 * f + k);
        if ((marks[f] & kMarkNoArea) != 0 && zero_faces != nullptr) zero_faces->push_back(f);
    });
    return DELMESH_OK;
}

} // namespace dm
