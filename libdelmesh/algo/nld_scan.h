// SPDX-License-Identifier: Apache-2.0
// One pass over the faces that finds every NLD edge and every face without area.
// An edge can only be NLD if one of the angles opposite to it is obtuse, and a face has at most one obtuse angle; so three dot
// products per face settle nearly all of the mesh, and only the edge opposite to a possibly obtuse corner is tested exactly.
#pragma once

#include <algorithm>
#include <cstring>

#include "base/context.h"
#include "geom/predicates.h"
#include "mesh/mesh.h"

namespace dm {

// The mesh to look at: corner tables, and three coordinates per vertex. Faces whose first corner has no vertex are skipped.
template <class Real>
struct ScanView {
    const int32_t* corner_vert;
    const int32_t* corner_twin;
    const Real* positions;
    int32_t faces;
};

// What is wrong with a face: bit k: the edge of its k-th corner is NLD (an edge with an obtuse angle on both sides is marked at
// its smaller corner only, another one where it is obtuse); and:
constexpr uint8_t kMarkNoArea = 8;

struct Certificate {
    int64_t nld_interior = 0, nld_boundary = 0, zero_area_faces = 0, exact_tests = 0;
    int32_t first_bad_corner = -1, first_zero_face = -1;
    bool delaunay(bool boundary_rule) const {
        return nld_interior == 0 && zero_area_faces == 0 && (!boundary_rule || nld_boundary == 0);
    }
};

// Scans all faces, in parallel. marks: null, or one byte per face, all of which are written.
template <class Real>
Status scan_faces(Context& context, const ScanView<Real>& view, bool boundary_rule, uint8_t* marks, Certificate& out);

// Calls use(f) for every face with a mark, in ascending order.
template <class Use>
void for_each_marked(const uint8_t* marks, int32_t faces, Use&& use) {
    constexpr int64_t kWord = sizeof(uint64_t); // faces that are looked at together: most have no mark
    for (int64_t begin = 0; begin < faces; begin += kWord) {
        const int64_t end = std::min<int64_t>(begin + kWord, faces);
        uint64_t any = 0;
        std::memcpy(&any, marks + begin, static_cast<size_t>(end - begin));
        if (any == 0) continue;
        for (int64_t f = begin; f < end; ++f)
            if (marks[f] != 0) use(static_cast<int32_t>(f));
    }
}

// For the faces [begin, end): on_edge(c) for each NLD edge, by a corner of this range (an edge whose two opposite angles are both
// obtuse is met from both sides: only the smaller corner reports it), on_zero(face) for each face without area.
// vert(c), twin(c), at(v): the mesh; dead faces have vert < 0.
template <class Vert, class Twin, class At, class OnEdge, class OnZero>
inline void scan_nld(int32_t begin, int32_t end, Vert vert, Twin twin, At at, bool boundary_rule, int64_t& exact_calls,
                     OnEdge on_edge, OnZero on_zero) {
    // The computed dot product of two differences is off by less than 4 epsilon times the sum of its terms' magnitudes, and the
    // cross product's components by less than that of theirs; the factor here is generous, and what is below kTiny may have
    // lost bits to underflow. What is not clear goes to the exact predicates.
    constexpr double kSafe = 1e-14, kTiny = 1e-280;
    const auto clearly_positive = [](double d, double magnitude) {
        return d > kSafe * magnitude && d > kTiny && magnitude < 1e280;
    };
    for (int32_t f = begin; f < end; ++f) {
        const int32_t c0 = 3 * f;
        const int32_t i0 = vert(c0), i1 = vert(c0 + 1), i2 = vert(c0 + 2);
        if (i0 < 0) continue;
        const Vec3 p[3] = {at(i0), at(i1), at(i2)};
        const Vec3 e0 = p[1] - p[0], e1 = p[2] - p[1], e2 = p[0] - p[2];
        const auto terms = [](const Vec3& a, const Vec3& b, double& magnitude) {
            const double x = -a.x * b.x, y = -a.y * b.y, z = -a.z * b.z;
            magnitude = std::fabs(x) + std::fabs(y) + std::fabs(z);
            return x + y + z;
        };
        double m[3];
        const double d[3] = {terms(e2, e0, m[0]), terms(e0, e1, m[1]), terms(e1, e2, m[2])}; // at corner 0, 1, 2
        const Vec3 n = cross(e0, e1);
        const double reach = kSafe * (std::fabs(e0.x) + std::fabs(e0.y) + std::fabs(e0.z)) *
                             (std::fabs(e1.x) + std::fabs(e1.y) + std::fabs(e1.z)); // more than n can be off
        const bool has_area =
            (std::fabs(n.x) > reach || std::fabs(n.y) > reach || std::fabs(n.z) > reach) && reach > kTiny && reach < 1e280;
        if (!has_area && zero_area(p[0], p[1], p[2])) on_zero(f);
        for (int k = 0; k < 3; ++k) {
            if (clearly_positive(d[k], m[k])) continue;
            const int32_t c = c0 + (k == 2 ? 0 : k + 1); // the edge opposite to corner k
            const int32_t t = twin(c);
            const Vec3 &a = p[k == 2 ? 0 : k + 1], &b = p[k == 0 ? 2 : k - 1];
            if (t < 0) {
                if (boundary_rule && boundary_edge_is_nld(a, b, p[k], exact_calls)) on_edge(c);
            } else {
                const Vec3 q = at(vert(prev_corner(t)));
                double mq;
                const double dq = terms(a - q, q - b, mq); // to the bit what the other face computes
                if (t < c && !clearly_positive(dq, mq)) continue;
                if (edge_is_nld(a, b, p[k], q, exact_calls)) on_edge(c);
            }
        }
    }
}

} // namespace dm
