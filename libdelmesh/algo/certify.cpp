// SPDX-License-Identifier: Apache-2.0
#include "algo/certify.h"

#include "algo/nld_scan.h"
#include "algo/parallel_slices.h"

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

Status certify_unfrozen(Context& context, const Mesh& mesh, bool boundary_rule, Certificate& out, int64_t& outside) {
    outside = 0;
    constexpr int64_t kGrain = 1 << 17;
    const int64_t with_bits = mesh.corner_bits.size(); // 0: no corner has any
    Array<EdgeBits> of_blocks(context.memory(), block_count(with_bits, kGrain));
    DM_TRY(context.parallel(with_bits, kGrain, [&](int64_t block, int64_t begin, int64_t end) {
        EdgeBits all = 0;
        for (int64_t c = begin; c < end; ++c) all |= mesh.corner_bits[c]; // many at a time
        of_blocks[block] = all;
    }));
    EdgeBits of_all = 0;
    for (const EdgeBits bits : of_blocks) of_all |= bits;
    if ((of_all & kEdgeFrozen) == 0) return certify_mesh(context, mesh, boundary_rule, out, nullptr, nullptr);
    Array<int32_t> corners(context.memory()), faces(context.memory());
    Certificate all;
    DM_TRY(certify_mesh(context, mesh, boundary_rule, all, &corners, &faces));
    const auto frozen = [&](int32_t c) { return (mesh.corner_bits[c] & kEdgeFrozen) != 0; };
    out = Certificate{};
    out.exact_tests = all.exact_tests;
    for (const int32_t c : corners) {
        if (frozen(c)) {
            ++outside;
            continue;
        }
        ++(mesh.corner_twin[c] < 0 ? out.nld_boundary : out.nld_interior);
        if (out.first_bad_corner < 0) out.first_bad_corner = c;
    }
    for (const int32_t f : faces) {
        if (frozen(3 * f) && frozen(3 * f + 1) && frozen(3 * f + 2)) continue;
        ++out.zero_area_faces;
        if (out.first_zero_face < 0) out.first_zero_face = f;
    }
    return DELMESH_OK;
}

} // namespace dm
