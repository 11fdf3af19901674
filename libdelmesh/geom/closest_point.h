// SPDX-License-Identifier: Apache-2.0
// Distance from a point to a segment and to a triangle.
//
// What is returned is the distance to a point that was really computed on the triangle, as a convex combination of its corners.
// It is therefore an upper bound of the true distance up to rounding, however thin the triangle is (geom/bvh and algo/measure
// rely on that). With p and the corners no longer than R, the true distance is at most the computed one + 25 u R, u = 2^-53:
// s + t <= 1 + 3u costs 6, the products and sums of the point 9, taking the corners and p relative to a common origin 2, and the
// difference and the root 8.
// Slivers: barycentric coordinates come from the normal and have an error of about u L / h (L long, h high), so that the result
// may exceed the true distance by min(h, u L^2 / h), at worst 1e-8 L.
#pragma once

#include "base/vec.h"

namespace dm {

// a: an end of the segment, ab: the way to the other end.
inline double segment_distance_squared(const Vec3& ap, const Vec3& ab) {
    const double along = dot(ap, ab), whole = dot(ab, ab);
    if (!(along > 0)) return dot(ap, ap);
    return length_squared(along < whole ? ap - (along / whole) * ab : ap - ab);
}

inline double triangle_distance_squared(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 ab = b - a, ac = c - a, ap = p - a;
    const Vec3 n = cross(ab, ac);
    const double nn = dot(n, n);
    const double wb = dot(n, cross(ap, ac)), wc = dot(n, cross(ab, ap)), wa = nn - wb - wc;
    if (wa >= 0 && wb >= 0 && wc >= 0 && nn > 0) return length_squared(ap - ((wb / nn) * ab + (wc / nn) * ac));
    // The closest point lies on an edge whose outer side p is on; without area on any edge.
    const bool flat = !(nn > 0);
    double best = HUGE_VAL;
    if (wc < 0 || flat) best = segment_distance_squared(ap, ab);
    if (wb < 0 || flat) {
        const double d = segment_distance_squared(ap, ac);
        if (d < best) best = d;
    }
    if (wa < 0 || flat) {
        const double d = segment_distance_squared(p - b, c - b);
        if (d < best) best = d;
    }
    return best;
}

struct ClosestPoint {
    double weight[3]; // of the corners; they sum to 1
    Vec3 residual;    // from there to the point that was asked about
    bool inside;      // not on an edge
};

// The same point as triangle_distance_squared's, and where in the triangle it is.
inline ClosestPoint closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 ab = b - a, ac = c - a, ap = p - a, n = cross(ab, ac);
    const double nn = dot(n, n), wb = dot(n, cross(ap, ac)), wc = dot(n, cross(ab, ap)), wa = nn - wb - wc;
    if (wa >= 0 && wb >= 0 && wc >= 0 && nn > 0) {
        const double sb = wb / nn, sc = wc / nn;
        return {{1 - sb - sc, sb, sc}, ap - (sb * ab + sc * ac), wa > 0 && wb > 0 && wc > 0};
    }
    const bool flat = !(nn > 0);
    double least = HUGE_VAL;
    ClosestPoint best{{1, 0, 0}, ap, false};
    const auto look = [&](const Vec3& from, const Vec3& to, int i, int j) {
        const Vec3 way = to - from, off = p - from;
        const double along = dot(off, way), whole = dot(way, way);
        const double t = !(along > 0) ? 0 : along < whole ? along / whole : 1;
        const Vec3 residual = off - t * way;
        if (!(length_squared(residual) < least)) return;
        least = length_squared(residual);
        best = {{0, 0, 0}, residual, false};
        best.weight[i] = 1 - t;
        best.weight[j] = t;
    };
    if (wc < 0 || flat) look(a, b, 0, 1);
    if (wb < 0 || flat) look(a, c, 0, 2);
    if (wa < 0 || flat) look(b, c, 1, 2);
    return best;
}

} // namespace dm
