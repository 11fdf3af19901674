// SPDX-License-Identifier: Apache-2.0
// A bounding volume hierarchy over the triangles of a mesh, for closest-point queries. Built once by the calling thread with a
// binned surface area heuristic (O(n log n)), then read by any number of threads: queries allocate nothing and keep their stack
// on the thread's.
#pragma once

#include "base/box.h"
#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// The box of the vertices that faces use.
Box used_box(const Mesh& mesh);

// Coordinates for measuring: times a power of two that makes the box about as large as 1, so that no square overflows or
// underflows, then shifted where the box lies farther from 0 than it is wide, so that points made inside it are rounded to its
// size and not to its distance from 0. Both steps are exact: the shift is the end of the box's side that is closer to 0, and
// lo <= x <= 2 lo makes x - lo exact (Sterbenz). Only what is below 2^-1000 of the box may be lost.
struct Frame {
    explicit Frame(const Box& box);
    Vec3 operator()(const Vec3& p) const { return scale * p - shift; }

    double scale; // a power of two
    double unit;  // 1 / scale: length of 1 in model units
    Vec3 shift;   // in scaled units
};

class Bvh {
public:
    struct Triangle {
        Vec3 corner[3]; // in the order of the face's corners, in the frame
    };
    struct Hit {
        double distance_squared;
        int32_t triangle; // in the order of the hierarchy
    };

    explicit Bvh(Memory& memory) : nodes_(memory), triangles_(memory), narrow_triangles_(memory), faces_(memory) {}
    // Replaces what was there. Faces of zero area are kept: they are part of the surface. mesh: at least one face.
    Status build(Context& context, const Mesh& mesh, const Frame& frame);

    // Triangles are numbered so that neighbours in number are neighbours in space.
    int32_t size() const { return static_cast<int32_t>(faces_.size()); }
    Triangle triangle(int32_t t) const {
        if (narrow_triangles_.empty()) return triangles_[t];
        const float* const x = narrow_triangles_[t].corner;
        return {{{x[0], x[1], x[2]}, {x[3], x[4], x[5]}, {x[6], x[7], x[8]}}};
    }
    int32_t face(int32_t t) const { return faces_[t]; } // of the mesh

    double distance_squared(const Vec3& p, int32_t t) const;
    // The triangle closest to p. near: a triangle that may be close; the better the guess, the less is visited, and of equally
    // close ones it wins.
    Hit closest(const Vec3& p, int32_t near) const;

private:
    struct Node {
        float lo[3], hi[3];
        int32_t first; // leaf: first triangle; inner node: left child, the right one follows it
        int32_t count; // triangles; 0: inner node
    };
    struct Primitive;
    struct NarrowTriangle {
        float corner[9];
    };

    static double distance_squared(const Vec3& p, const Node& node);
    int64_t partition(Primitive* primitives, int64_t begin, int64_t end, int32_t depth) const;
    Status make_triangles(Context& context, const Mesh& mesh, const Frame& frame);

    Array<Node> nodes_;
    Array<Triangle> triangles_; // empty if float32 holds all coordinates:
    Array<NarrowTriangle> narrow_triangles_;
    Array<int32_t> faces_;
};

// Closest points again, of a mesh that is asked about a few of its vertices only: a tree that is made in a pass over the faces, takes
// ten bytes for each, and reads the mesh. Its queries visit about twice as much.
class FaceTree {
public:
    struct Hit {
        int32_t face = -1; // -1: there is none
        double weight[3] = {1, 0, 0};
    };

    explicit FaceTree(Memory& memory) : frame_(Box{}), order_(memory), boxes_(memory) {}
    // order: all faces, so that what is near in space is mostly near in number. The mesh has to stay.
    Status build(Context& context, const Mesh& mesh, Array<int32_t> order);
    bool empty() const { return boxes_.empty(); }
    // near: a place in the order that may be close; the better the guess, the less is visited.
    Hit closest(const Vec3& p, int32_t near) const;

private:
    static constexpr int32_t kLeafSize = 4;
    static constexpr int kMostLevels = 32;
    struct FloatBox {
        float lo[3], hi[3];
    };

    const Mesh* mesh_ = nullptr;
    Frame frame_;
    Array<int32_t> order_;
    Array<FloatBox> boxes_;           // around kLeafSize faces each, then around every two of the level before
    int32_t begin_[kMostLevels] = {}; // of the levels in boxes_
    int levels_ = 0;
};

} // namespace dm
