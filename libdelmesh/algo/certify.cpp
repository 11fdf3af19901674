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
    if (nld_corners != nullptr) for_each_marked_edge(marks.data(), faces, [&](int32_t c) { nld_corners->push_back(c); });
    if (zero_faces != nullptr)
        for_each_marked(marks.data(), faces, [&](int32_t f) {
            if ((marks[f] & kMarkNoArea) != 0) zero_faces->push_back(f);
        });
    return DELMESH_OK;
}

} // namespace dm
