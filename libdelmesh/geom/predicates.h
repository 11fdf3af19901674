// SPDX-License-Identifier: Apache-2.0
// Exact decisions on the coordinates as they are: a floating-point filter with a proven bound, then exact integers. No epsilon.
// All functions are pure and safe on any finite doubles (subnormals and differences that overflow included).
#pragma once

#include <cstdint>

#include "base/vec.h"

namespace dm {

// Is the interior edge (a, b) with the opposite vertices p and q not locally Delaunay: angle(a p b) + angle(a q b) > 180?
// Angles of zero-area triangles are 0 or 180; an apex on an end of the edge counts as angle 0. Ties are Delaunay.
// With u, v from the apex to the ends, d = u.v, s = |u x v|: NLD iff s1 d2 + s2 d1 < 0, or s1 = s2 = 0 with both d < 0.
bool edge_is_nld(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q);

// Is the boundary edge (a, b) with the opposite vertex p obtuse: angle(a p b) > 90?
bool boundary_edge_is_nld(const Vec3& a, const Vec3& b, const Vec3& p);

// Do a, b, c lie on a line (or coincide)?
bool zero_area(const Vec3& a, const Vec3& b, const Vec3& c);

// Sign of the volume of (a, b, c, d): +1 when d lies on the side of the plane to which the counter-clockwise normal of (a, b, c)
// points... 0 exactly when the four are coplanar.
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// Are the faces (a, b, p) and (b, a, q) coplanar, both with area, with p and q on opposite sides of the edge (a, b): is flipping it
// free of any movement?
bool flat_edge(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q);

// Sign of the dot product of the normals of (a, b, c) and (d, e, f).
int normals_dot_sign(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, const Vec3& e, const Vec3& f);

// How many calls needed the exact path since the counter was set to 0. Per thread of work: the caller owns the counter and hands
// it in where it wants to know.
bool edge_is_nld(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q, int64_t& exact_calls);
bool boundary_edge_is_nld(const Vec3& a, const Vec3& b, const Vec3& p, int64_t& exact_calls);

} // namespace dm
