// SPDX-License-Identifier: Apache-2.0
// Two stages. The first looks at four faces at a time in float32, without a branch, and lets pass what is clear: acute angles and
// faces with area. The second looks at the rest in double, and asks the exact predicates about what is not clear there either.
#include "algo/nld_scan.h"

#include <algorithm>
#include <bit>

#include "geom/predicates.h"

namespace dm {
namespace {

constexpr int64_t kGrain = 8192; // faces per block: some tens of microseconds
constexpr int kBatch = 256;      // faces between the two stages

// ---- First stage ------------------------------------------------------------------------------------------------------------

// What passes here is true without a doubt. With edges of at most kLargest, float32 differences of the coordinates are off by at
// most 2^-24 (1 + 2^-28) of themselves and, where doubles are rounded to subnormals, by 2^-150. Products then are off by
// 3 * 2^-24 of themselves and 2^-88, sums of three or differences of two by less than 6 * 2^-24 of their terms' magnitudes and
// 2^-85. kError and kUnderflow are more than twice that. Infinities and NaN fail the comparisons.
constexpr float kError = 0x1p-20f, kUnderflow = 0x1p-80f, kLargest = 0x1p60f;

constexpr int32_t kUnclearArea = 8, kUnclearAll = 15; // and bit k: the angle at the k-th corner

using Float4 = float __attribute__((vector_size(16)));
using Int4 = int32_t __attribute__((vector_size(16)));

struct FourVectors {
    Float4 x, y, z;
};

inline Float4 magnitude(Float4 x) {
    return std::bit_cast<Float4>(std::bit_cast<Int4>(x) & 0x7fffffff);
}
inline Float4 sum_of_magnitudes(Float4 x, Float4 y, Float4 z) {
    return magnitude(x) + magnitude(y) + magnitude(z);
}

// Component k of q - p, of four faces.
inline Float4 differences(const float* const (&p)[4], const float* const (&q)[4], int k) {
    return Float4{q[0][k], q[1][k], q[2][k], q[3][k]} - Float4{p[0][k], p[1][k], p[2][k], p[3][k]};
}
inline Float4 differences(const double* const (&p)[4], const double* const (&q)[4], int k) {
    return Float4{static_cast<float>(q[0][k] - p[0][k]), static_cast<float>(q[1][k] - p[1][k]),
                  static_cast<float>(q[2][k] - p[2][k]), static_cast<float>(q[3][k] - p[3][k])};
}
template <class Real>
inline FourVectors edges(const Real* const (&p)[4], const Real* const (&q)[4]) {
    return {differences(p, q, 0), differences(p, q, 1), differences(p, q, 2)};
}

// Is the angle between -u and v clearly acute?
inline Int4 clearly_acute(const FourVectors& u, const FourVectors& v) {
    const Float4 x = u.x * v.x, y = u.y * v.y, z = u.z * v.z;
    return x + y + z + kError * sum_of_magnitudes(x, y, z) < -kUnderflow;
}

template <class Real>
inline Int4 find_unclear(const Real* positions, const int32_t* verts) {
    const Real* p[3][4];
    for (int f = 0; f < 4; ++f)
        for (int k = 0; k < 3; ++k) p[k][f] = positions + 3 * static_cast<int64_t>(verts[3 * f + k]);
    const FourVectors e0 = edges(p[0], p[1]), e1 = edges(p[1], p[2]), e2 = edges(p[2], p[0]);
    const Float4 nx = e0.y * e1.z - e0.z * e1.y, ny = e0.z * e1.x - e0.x * e1.z, nz = e0.x * e1.y - e0.y * e1.x;
    const Float4 size0 = sum_of_magnitudes(e0.x, e0.y, e0.z), size1 = sum_of_magnitudes(e1.x, e1.y, e1.z);
    const Float4 reach = kError * (size0 * size1) + kUnderflow;
    const Int4 area = (magnitude(nx) > reach) | (magnitude(ny) > reach) | (magnitude(nz) > reach);
    const Int4 in_range = size0 + size1 < kLargest;
    return (~clearly_acute(e2, e0) & 1) | (~clearly_acute(e0, e1) & 2) | (~clearly_acute(e1, e2) & 4) |
           (~(area & in_range) & kUnclearAll);
}

// ---- Second stage -----------------------------------------------------------------------------------------------------------

// The computed dot product of two differences is off by less than 4 epsilon times the sum of its terms' magnitudes; the factor here
// is generous, and what is below kTiny may have lost bits to underflow.
constexpr double kSafe = 1e-14, kTiny = 1e-280, kHuge = 1e280;

// Is the angle at p, between a and b, clearly acute? To the bit what is found from the other side of the edge (a, b).
bool is_clearly_acute(const Vec3& a, const Vec3& b, const Vec3& p) {
    const Vec3 u = a - p, v = p - b;
    const double x = -u.x * v.x, y = -u.y * v.y, z = -u.z * v.z;
    const double d = x + y + z, size = std::fabs(x) + std::fabs(y) + std::fabs(z);
    return d > kSafe * size && d > kTiny && size < kHuge;
}

template <class Real>
class Scan {
public:
    Scan(const ScanView<Real>& view, bool boundary_rule, uint8_t* marks)
        : view_(view), boundary_rule_(boundary_rule), marks_(marks) {}

    void run(int64_t begin, int64_t end) {
        int32_t unclear[kBatch];
        for (int64_t first = begin; first < end; first += kBatch) {
            const int64_t count = std::min<int64_t>(kBatch, end - first);
            const int32_t* const verts = view_.corner_vert + 3 * first;
            int64_t i = 0;
            for (; i + 4 <= count; i += 4) {
                const int32_t* const four = verts + 3 * i;
                if ((four[0] | four[3] | four[6] | four[9]) < 0) { // one of them is dead
                    for (int64_t k = i; k < i + 4; ++k) unclear[k] = kUnclearAll;
                    continue;
                }
                const Int4 found = find_unclear(view_.positions, four);
                std::memcpy(unclear + i, &found, sizeof found);
            }
            for (; i < count; ++i) unclear[i] = kUnclearAll;
            if (marks_ != nullptr) std::memset(marks_ + first, 0, static_cast<size_t>(count));
            int16_t left[kBatch];
            int lefts = 0;
            for (i = 0; i < count; ++i) { // without a branch: no one can predict it
                left[lefts] = static_cast<int16_t>(i);
                lefts += unclear[i] != 0;
            }
            for (int k = 0; k < lefts; ++k)
                look_at(static_cast<int32_t>(first + left[k]), static_cast<uint32_t>(unclear[left[k]]));
        }
    }

    Certificate tally;

private:
    Vec3 at(int32_t v) const {
        const Real* const x = view_.positions + 3 * static_cast<int64_t>(v);
        return {x[0], x[1], x[2]};
    }

    void look_at(int32_t f, uint32_t unclear) {
        const int32_t* const verts = view_.corner_vert + 3 * static_cast<int64_t>(f);
        if (verts[0] < 0) return;
        const Vec3 p[3] = {at(verts[0]), at(verts[1]), at(verts[2])};
        if ((unclear & kUnclearArea) != 0 && zero_area(p[0], p[1], p[2])) {
            ++tally.zero_area_faces;
            if (tally.first_zero_face < 0) tally.first_zero_face = f;
            mark(f, kMarkNoArea);
        }
        for (uint32_t corners = unclear & 7; corners != 0; corners &= corners - 1) {
            const int k = std::countr_zero(corners), start = k == 2 ? 0 : k + 1;
            if (!is_nld(3 * f + start, p[start], p[k == 0 ? 2 : k - 1], p[k])) continue;
            ++(view_.corner_twin[3 * f + start] < 0 ? tally.nld_boundary : tally.nld_interior);
            if (tally.first_bad_corner < 0 || 3 * f + start < tally.first_bad_corner) tally.first_bad_corner = 3 * f + start;
            mark(f, static_cast<uint8_t>(1 << start));
        }
    }

    // Is the edge (a, b) of the corner c NLD, with p opposite to it, and c the corner that tells?
    bool is_nld(int32_t c, const Vec3& a, const Vec3& b, const Vec3& p) {
        if (is_clearly_acute(a, b, p)) return false;
        const int32_t t = view_.corner_twin[c];
        if (t < 0) return boundary_rule_ && boundary_edge_is_nld(a, b, p, tally.exact_tests);
        const Vec3 q = at(view_.corner_vert[prev_corner(t)]);
        if (t < c && !is_clearly_acute(a, b, q)) return false;
        return edge_is_nld(a, b, p, q, tally.exact_tests);
    }

    void mark(int32_t f, uint8_t bits) {
        if (marks_ != nullptr) marks_[f] |= bits;
    }

    const ScanView<Real>& view_;
    const bool boundary_rule_;
    uint8_t* const marks_;
};

} // namespace

template <class Real>
Status scan_faces(Context& context, const ScanView<Real>& view, bool boundary_rule, uint8_t* marks, Certificate& out) {
    out = Certificate{};
    Array<Certificate> tallies(context.memory(), (view.faces + kGrain - 1) / kGrain, Certificate{});
    DM_TRY(context.parallel(view.faces, kGrain, [&](int64_t block, int64_t begin, int64_t end) {
        Scan<Real> scan(view, boundary_rule, marks);
        scan.run(begin, end);
        tallies[block] = scan.tally;
    }));
    for (const Certificate& tally : tallies) {
        out.nld_interior += tally.nld_interior;
        out.nld_boundary += tally.nld_boundary;
        out.zero_area_faces += tally.zero_area_faces;
        out.exact_tests += tally.exact_tests;
        if (out.first_bad_corner < 0) out.first_bad_corner = tally.first_bad_corner;
        if (out.first_zero_face < 0) out.first_zero_face = tally.first_zero_face;
    }
    return DELMESH_OK;
}

template Status scan_faces(Context&, const ScanView<float>&, bool, uint8_t*, Certificate&);
template Status scan_faces(Context&, const ScanView<double>&, bool, uint8_t*, Certificate&);

} // namespace dm
