// SPDX-License-Identifier: Apache-2.0
// Exact decisions on the coordinates as they are: a floating-point filter with a proven bound, then exact integers. No epsilon.
// All functions are pure and right for any finite doubles (subnormals and differences that overflow included), in the
// floating-point environment of base/fp_env.h. docs/numerics.md has the proofs.
#pragma once

#include <cmath>
#include <cstdint>

#include "base/vec.h"

namespace dm {

namespace detail {

// With u and v differences of two doubles each, |computed u.v - true u.v| < kDotError * (sum of |products|) + kDotUnderflow.
constexpr double kDotError = 0x1p-50;
constexpr double kDotUnderflow = 0x1p-1022;

// A component of u x v is off by less than kCrossError * (sum of its terms' magnitudes) + kCrossUnderflow.
constexpr double kCrossError = 0x1p-50, kCrossUnderflow = 0x1p-1022;

// The components of u x v with + in the place of -, all terms positive: what its rounding errors are relative to.
inline Vec3 cross_size(const Vec3& u, const Vec3& v) {
    return {std::fabs(u.y * v.z) + std::fabs(u.z * v.y), std::fabs(u.z * v.x) + std::fabs(u.x * v.z),
            std::fabs(u.x * v.y) + std::fabs(u.y * v.x)};
}

// exact_calls: null, or incremented when the filter could not tell.
bool edge_is_nld_unsure(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q, int64_t* exact_calls);
bool boundary_edge_is_nld_unsure(const Vec3& a, const Vec3& b, const Vec3& p, int64_t* exact_calls);
bool zero_area_unsure(const Vec3& a, const Vec3& b, const Vec3& c);

} // namespace detail

// Is the angle between u and v, differences of two points each, certainly below 90 degrees? False when in doubt, also for infinities
// and NaN from an overflow. The same for -u and -v.
inline bool surely_acute(const Vec3& u, const Vec3& v) {
    const double x = u.x * v.x, y = u.y * v.y, z = u.z * v.z;
    return x + y + z - detail::kDotError * (std::fabs(x) + std::fabs(y) + std::fabs(z)) > detail::kDotUnderflow;
}

// Is the interior edge (a, b) with the opposite vertices p and q not locally Delaunay: angle(a p b) + angle(a q b) > 180?
// Angles of zero-area triangles are 0 or 180; an apex on an end of the edge counts as angle 0. Ties are Delaunay.
// With u, v from the apex to the ends, d = u.v, s = |u x v|: NLD iff s1 d2 + s2 d1 < 0, or s1 = s2 = 0 with both d < 0.
// The answer is the same when a and b, or p and q, change places.
inline bool edge_is_nld(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q) {
    if (surely_acute(a - p, b - p) && surely_acute(a - q, b - q)) return false; // nearly every edge
    return detail::edge_is_nld_unsure(a, b, p, q, nullptr);
}
// The same where surely_acute has been asked of both angles, and they are not.
inline bool edge_is_nld_past_acute(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q) {
    return detail::edge_is_nld_unsure(a, b, p, q, nullptr);
}

// Is the boundary edge (a, b) with the opposite vertex p obtuse: angle(a p b) > 90?
inline bool boundary_edge_is_nld(const Vec3& a, const Vec3& b, const Vec3& p) {
    return !surely_acute(a - p, b - p) && detail::boundary_edge_is_nld_unsure(a, b, p, nullptr);
}

// The same, and exact_calls counts the calls that the floating-point filter could not decide.
inline bool edge_is_nld(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q, int64_t& exact_calls) {
    if (surely_acute(a - p, b - p) && surely_acute(a - q, b - q)) return false;
    return detail::edge_is_nld_unsure(a, b, p, q, &exact_calls);
}
inline bool boundary_edge_is_nld(const Vec3& a, const Vec3& b, const Vec3& p, int64_t& exact_calls) {
    return !surely_acute(a - p, b - p) && detail::boundary_edge_is_nld_unsure(a, b, p, &exact_calls);
}

// Do a, b, c lie on a line (or coincide)?
inline bool zero_area(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 u = b - a, v = c - a, n = cross(u, v), size = detail::cross_size(u, v);
    const auto surely_not_0 = [](double x, double s) { return std::fabs(x) - detail::kCrossError * s > detail::kCrossUnderflow; };
    if (surely_not_0(n.x, size.x) || surely_not_0(n.y, size.y) || surely_not_0(n.z, size.z)) return false;
    return detail::zero_area_unsure(a, b, c);
}

// Sign of the volume of (a, b, c, d): +1 when d lies on the side of the plane to which the counter-clockwise normal of (a, b, c)
// points, -1 on the other side, 0 exactly when the four are coplanar.
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// Are the faces (a, b, p) and (b, a, q) coplanar, both with area, with p and q on opposite sides of the edge (a, b)? Flipping
// such an edge moves nothing where the quad is convex, as it is where the edge is NLD.
bool flat_edge(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q);

// Sign of the dot product of the normals of (a, b, c) and (d, e, f); 0 also when one of them has no area.
int normals_dot_sign(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, const Vec3& e, const Vec3& f);

} // namespace dm
