// SPDX-License-Identifier: Apache-2.0
// Polygons to triangles.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// Cuts polygons into triangles without new vertices: the fan from the first corner where it does not fold, else the other
// diagonal of a quad, else ear clipping in the plane of the polygon's Newell normal. Plain arithmetic: the choice is a matter of
// quality, any choice is a valid triangulation. Keeps its scratch between polygons.
class Triangulator {
public:
    explicit Triangulator(Memory& memory) : points_(memory), plane_(memory), next_(memory), prev_(memory), blocks_(memory) {}

    struct Polygon {
        const int32_t *verts, *corners;
        int32_t count;
    };
    // Appends the triangles of the polygon's verts to mesh.corner_vert, and of its corners, which are any numbers, to
    // mesh.corner_map; count >= 3, neighbouring verts differ (cyclically), all positions are finite. Triangles with a vertex twice,
    // which polygons that touch themselves can give, are not appended.
    // Time: O(count) for fans; ear clipping is quadratic at worst, and past kTestsPerCorner x count tests takes the rest as it
    // comes. fraction: of the stage, for cancelling inside huge polygons.
    Status triangulate(Context& context, double fraction, const Polygon& polygon, Mesh& mesh);

private:
    struct Point2 {
        double x, y;
    };
    static constexpr int64_t kTestsPerCorner = 4096;

    void load(const Mesh& mesh, const Polygon& polygon);
    Vec3 normal_of(int32_t count) const;
    double turn_along(int32_t a, int32_t b, int32_t c, const Vec3& normal) const; // > 0: the triangle faces as the polygon does
    double fan_quality(int32_t count, const Vec3& normal) const;                  // the smallest of these over the fan

    void project(int32_t count, const Vec3& normal);
    double turn(int32_t a, int32_t b, int32_t c) const;
    bool is_ear(int32_t b, int64_t& tests) const;
    Status clip_ears(Context& context, double fraction, const Vec3& normal, const Polygon& polygon, Mesh& mesh);

    Array<Vec3> points_; // relative to the first corner
    Array<Point2> plane_;
    Array<int32_t> next_, prev_;
    Array<uint8_t> blocks_; // 1: not convex, so it may lie inside an ear
};

} // namespace dm
