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

// The same for every NLD edge, by the corner that is marked.
template <class Use>
void for_each_marked_edge(const uint8_t* marks, int32_t faces, Use&& use) {
    for_each_marked(marks, faces, [&](int32_t f) {
        for (int32_t k = 0; k < 3; ++k)
            if ((marks[f] >> k & 1) != 0) use(3 * f + k);
    });
}

} // namespace dm
