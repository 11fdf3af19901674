// SPDX-License-Identifier: Apache-2.0
#include "mesh/triangulate.h"

#include <algorithm>
#include <cmath>

namespace dm {
namespace {

void append(const Triangulator::Polygon& polygon, int32_t i, int32_t j, int32_t k, Mesh& mesh) {
    const int32_t a = polygon.verts[i], b = polygon.verts[j], c = polygon.verts[k];
    if (a == b || b == c || c == a) return;
    for (const int32_t v : {a, b, c}) mesh.corner_vert.push_back(v);
    for (const int32_t n : {i, j, k}) mesh.corner_map.push_back(polygon.corners[n]);
}

} // namespace

Status Triangulator::triangulate(Context& context, double fraction, const Polygon& polygon, Mesh& mesh) {
    const int32_t count = polygon.count;
    if (count > 3) {
        load(mesh, polygon);
        const Vec3 normal = normal_of(count);
        const double fan = fan_quality(count, normal);
        // Without a normal (all on a line) every choice is as good.
        if (!(fan > 0) && length_squared(normal) > 0) {
            if (count > 4) return clip_ears(context, fraction, normal, polygon, mesh);
            const double other = std::min(turn_along(1, 2, 3, normal), turn_along(1, 3, 0, normal));
            if (other > fan) {
                append(polygon, 1, 2, 3, mesh);
                append(polygon, 1, 3, 0, mesh);
                return DELMESH_OK;
            }
        }
    }
    for (int32_t i = 1; i + 1 < count; ++i) append(polygon, 0, i, i + 1, mesh);
    return DELMESH_OK;
}

void Triangulator::load(const Mesh& mesh, const Polygon& polygon) {
    const int32_t count = polygon.count;
    // Products of four lengths follow: out of this range they would overflow or vanish.
    constexpr double kSmall = 0x1p-180, kLarge = 0x1p180;
    points_.resize_uninitialized(count);
    double largest = 0;
    for (int32_t i = 0; i < count; ++i) {
        const Vec3 p = points_[i] = mesh.position(polygon.verts[i]);
        largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    }
    if (largest > 0 && (largest < kSmall || largest > kLarge)) {
        const int exponent = -std::ilogb(largest);
        for (Vec3& p : points_) p = {std::scalbn(p.x, exponent), std::scalbn(p.y, exponent), std::scalbn(p.z, exponent)};
    }
    const Vec3 origin = points_[0];
    for (Vec3& p : points_) p = p - origin;
}

Vec3 Triangulator::normal_of(int32_t count) const {
    if (count == 4) return cross(points_[2], points_[3] - points_[1]); // symmetric in the diagonals
    Vec3 normal{0, 0, 0};
    for (int32_t i = 1; i + 1 < count; ++i) normal = normal + cross(points_[i], points_[i + 1]);
    return normal;
}

double Triangulator::turn_along(int32_t a, int32_t b, int32_t c, const Vec3& normal) const {
    return dot(cross(points_[b] - points_[a], points_[c] - points_[a]), normal);
}

double Triangulator::fan_quality(int32_t count, const Vec3& normal) const {
    double least = turn_along(0, 1, 2, normal);
    for (int32_t i = 2; i + 1 < count; ++i) least = std::min(least, turn_along(0, i, i + 1, normal));
    return least;
}

// Coordinates along two directions in the plane; their lengths differ, which changes no sign of a turn.
void Triangulator::project(int32_t count, const Vec3& normal) {
    const double x = std::abs(normal.x), y = std::abs(normal.y), z = std::abs(normal.z);
    const double scale = 1 / std::max({x, y, z});
    const Vec3 n = scale * normal;
    const Vec3 axis = x <= y && x <= z ? Vec3{1, 0, 0} : y <= z ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
    const Vec3 u = cross(axis, n);
    const Vec3 v = cross(n, u);
    plane_.resize_uninitialized(count);
    for (int32_t i = 0; i < count; ++i) plane_[i] = {dot(points_[i], u), dot(points_[i], v)};
}

double Triangulator::turn(int32_t a, int32_t b, int32_t c) const {
    const Point2 p = plane_[a], q = plane_[b], r = plane_[c];
    return (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
}

// Is the corner b convex, and does no other corner lie in its triangle? Corners at the place of one of the three do not count:
// polygons with holes are given with a bridge that is walked both ways.
bool Triangulator::is_ear(int32_t b, int64_t& tests) const {
    const int32_t a = prev_[b], c = next_[b];
    ++tests;
    if (blocks_[b] != 0) return false;
    const auto at_same_place = [&](int32_t i, int32_t k) { return plane_[i].x == plane_[k].x && plane_[i].y == plane_[k].y; };
    for (int32_t i = next_[c]; i != a; i = next_[i]) {
        ++tests;
        if (blocks_[i] == 0 || turn(a, b, i) < 0 || turn(b, c, i) < 0 || turn(c, a, i) < 0) continue;
        if (!at_same_place(i, a) && !at_same_place(i, b) && !at_same_place(i, c)) return false;
    }
    return true;
}

Status Triangulator::clip_ears(Context& context, double fraction, const Vec3& normal, const Polygon& polygon, Mesh& mesh) {
    const int32_t count = polygon.count;
    project(count, normal);
    next_.resize_uninitialized(count);
    prev_.resize_uninitialized(count);
    blocks_.resize_uninitialized(count);
    for (int32_t i = 0; i < count; ++i) {
        next_[i] = i + 1 < count ? i + 1 : 0;
        prev_[i] = i > 0 ? i - 1 : count - 1;
    }
    const auto look = [&](int32_t i) { blocks_[i] = !(turn(prev_[i], i, next_[i]) > 0); };
    for (int32_t i = 0; i < count; ++i) look(i);

    // A simple polygon always has an ear. One that crosses itself may not: then, after a round without, any convex corner
    // will do, and after another any corner at all.
    int64_t tests = 0;
    const int64_t most_tests = kTestsPerCorner * count;
    int32_t b = 0, left = count, looked_at = 0;
    while (left > 3) {
        const bool clip = looked_at >= 2 * left || tests > most_tests || (looked_at >= left ? blocks_[b] == 0 : is_ear(b, tests));
        if (!clip) {
            ++tests;
            ++looked_at;
            b = next_[b];
            continue;
        }
        if (left % 4096 == 0) DM_TRY(context.progress(fraction));
        const int32_t a = prev_[b], c = next_[b];
        append(polygon, a, b, c, mesh);
        next_[a] = c;
        prev_[c] = a;
        look(a);
        look(c);
        --left;
        looked_at = 0;
        b = c;
    }
    append(polygon, prev_[b], b, next_[b], mesh);
    return DELMESH_OK;
}

} // namespace dm
