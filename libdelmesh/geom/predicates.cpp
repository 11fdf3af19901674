// SPDX-License-Identifier: Apache-2.0
// Floating-point stand-ins until the exact ones land.
#include "geom/predicates.h"
namespace dm {
bool edge_is_nld(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q) {
    const Vec3 u1 = a - p, v1 = b - p, u2 = a - q, v2 = b - q;
    const double d1 = dot(u1, v1), d2 = dot(u2, v2), s1 = length(cross(u1, v1)), s2 = length(cross(u2, v2));
    return s1 * d2 + s2 * d1 < 0 || (s1 == 0 && s2 == 0 && d1 < 0 && d2 < 0);
}
bool boundary_edge_is_nld(const Vec3& a, const Vec3& b, const Vec3& p) { return dot(a - p, b - p) < 0; }
bool zero_area(const Vec3& a, const Vec3& b, const Vec3& c) { return length_squared(cross(b - a, c - a)) == 0; }
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const double v = dot(cross(b - a, c - a), d - a);
    return v > 0 ? 1 : v < 0 ? -1 : 0;
}
bool flat_edge(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q) {
    return orientation(a, b, p, q) == 0 && normals_dot_sign(a, b, p, b, a, q) > 0;
}
int normals_dot_sign(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, const Vec3& e, const Vec3& f) {
    const double v = dot(cross(b - a, c - a), cross(e - d, f - d));
    return v > 0 ? 1 : v < 0 ? -1 : 0;
}
bool edge_is_nld(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q, int64_t&) { return edge_is_nld(a, b, p, q); }
bool boundary_edge_is_nld(const Vec3& a, const Vec3& b, const Vec3& p, int64_t&) { return boundary_edge_is_nld(a, b, p); }
}
