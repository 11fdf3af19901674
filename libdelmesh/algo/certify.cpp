// SPDX-License-Identifier: Apache-2.0
#include "algo/certify.h"

#include "algo/nld_scan.h"

namespace dm {
namespace {

constexpr int64_t kGrain = 8192; // faces per block: some tens of microseconds

// Which edges and faces of a block offend, as bits beside the counts, so that lists can be made in index order afterwards.
struct Tally {
    int64_t interior = 0, boundary = 0, zero = 0, exact = 0;
    int32_t first_edge = -1, first_zero = -1;
};

template <class Real>
Status certify_positions(Context& context, const Mesh& mesh, const Real* positions, bool boundary_rule, Certificate& out,
                         Array<int32_t>* nld_corners, Array<int32_t>* zero_faces) {
    const int32_t faces = mesh.faces();
    const int64_t blocks = (faces + kGrain - 1) / kGrain;
    Array<Tally> tallies(context.memory(), blocks, Tally{});
    Array<uint8_t> marks(
        context.memory()); // per face: bits 0..2 the corner's edge, bit 3 zero area; only when lists are asked for
    const bool listing = nld_corners != nullptr || zero_faces != nullptr;
    if (listing) marks.assign(faces, 0);
    const int32_t* const verts = mesh.corner_vert.data();
    const int32_t* const twins = mesh.corner_twin.data();
    DM_TRY(context.parallel(faces, kGrain, [&](int64_t block, int64_t begin, int64_t end) {
        Tally tally;
        scan_nld(
            static_cast<int32_t>(begin), static_cast<int32_t>(end), [&](int32_t c) { return verts[c]; },
            [&](int32_t c) { return twins[c]; },
            [&](int32_t v) {
                const Real* x = positions + 3 * static_cast<int64_t>(v);
                return Vec3{x[0], x[1], x[2]};
            },
            boundary_rule, tally.exact,
            [&](int32_t c) {
                ++(twins[c] < 0 ? tally.boundary : tally.interior);
                if (tally.first_edge < 0) tally.first_edge = c;
                if (listing) marks[face_of(c)] |= static_cast<uint8_t>(1 << (c % 3));
            },
            [&](int32_t f) {
                ++tally.zero;
                if (tally.first_zero < 0) tally.first_zero = f;
                if (listing) marks[f] |= 8;
            });
        tallies[block] = tally;
    }));
    for (const Tally& tally : tallies) {
        out.nld_interior += tally.interior;
        out.nld_boundary += tally.boundary;
        out.zero_area_faces += tally.zero;
        out.exact_tests += tally.exact;
        if (out.first_bad_corner < 0) out.first_bad_corner = tally.first_edge;
        if (out.first_zero_face < 0) out.first_zero_face = tally.first_zero;
    }
    if (listing)
        for (int32_t f = 0; f < faces; ++f) {
            if (marks[f] == 0) continue;
            for (int32_t k = 0; k < 3; ++k)
                if ((marks[f] >> k & 1) != 0 && nld_corners != nullptr) nld_corners->push_back(3 * f + k);
            if ((marks[f] & 8) != 0 && zero_faces != nullptr) zero_faces->push_back(f);
        }
    return DELMESH_OK;
}

} // namespace

Status certify_mesh(Context& context, const Mesh& mesh, bool boundary_rule, Certificate& out, Array<int32_t>* nld_corners,
                    Array<int32_t>* zero_faces) {
    out = Certificate{};
    if (mesh.precision == Precision::f32)
        return certify_positions(context, mesh, mesh.pos32.data(), boundary_rule, out, nld_corners, zero_faces);
    return certify_positions(context, mesh, mesh.pos64.data(), boundary_rule, out, nld_corners, zero_faces);
}

} // namespace dm
