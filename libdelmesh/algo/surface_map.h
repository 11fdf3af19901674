// SPDX-License-Identifier: Apache-2.0
// Where the corners and edges of a result lie on the mesh it was made from (docs/attributes.md). Sides of seams are told apart by the
// connectivity around a vertex, which kept edges divide into the same sectors before and after; distances only decide between
// places on one side.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

// Per vertex, a corner; where the vertex is on the boundary, that with which its fan begins counter-clockwise. -1: unused.
Status find_first_corners(Context& context, const Mesh& mesh, Array<int32_t>& first);
// Where a corner looks: the middle between its edges.
Vec3 gaze(const Mesh& mesh, int32_t c);

// Is the edge from the corner c on a boundary or one with these bits?
inline bool is_border(const Mesh& mesh, int32_t c, EdgeBits kept) {
    return mesh.corner_twin[c] < 0 || (!mesh.corner_bits.empty() && (mesh.corner_bits[c] & kept) != 0);
}
// Per face, the number of its chart: equal where there is a way without borders.
Status find_charts(Context& context, const Mesh& mesh, EdgeBits kept, Array<int32_t>& chart);

// The numbers of a mesh's edges, by their first corners: two bytes per face are read where the faces come in any order.
class EdgeNumbers {
public:
    explicit EdgeNumbers(Memory& memory) : before_(memory), of_face_(memory) {}

    Status begin(Context& context, const Mesh& mesh);

    static bool is_first(const int32_t* twin, int32_t c) { return static_cast<uint32_t>(c) < static_cast<uint32_t>(twin[c]); }

    // Of a face's edges: bit k tells whether the k-th corner is its edge's first, and then number[k] is the edge's number.
    int32_t of(int32_t face, int32_t (&number)[3]) const {
        const int32_t x = of_face_.data()[face];
        number[0] = before_.data()[face / kGroup] + (x >> 3);
        number[1] = number[0] + (x & 1);
        number[2] = number[1] + (x >> 1 & 1);
        return x & 7;
    }
    int32_t of(int32_t first_corner) const {
        int32_t number[3];
        of(face_of(first_corner), number);
        return number[first_corner % 3];
    }

private:
    static constexpr int32_t kGroup = 1 << 11; // 3 kGroup << 3 fits

    Array<int32_t> before_;   // per group: edges
    Array<uint16_t> of_face_; // edges in its group before the face, and a bit for each of its corners
};

// The source's surface, cut along its kept edges.
class Sheets {
public:
    // first_: what find_first_corners finds.
    Sheets(const Mesh& source, EdgeBits kept, Array<int32_t> first_) : in(source), first(std::move(first_)), kept_(kept) {}
    Sheets(Memory& memory, const Mesh& source, EdgeBits kept) : Sheets(source, kept, Array<int32_t>(memory)) {}
    Status begin(Context& context) { return find_first_corners(context, in, first); }

    bool is_border(int32_t c) const { return dm::is_border(in, c, kept_); }
    // The corner of the edge a -> b, or if that is on the boundary the other way, of b -> a; -1: no edge.
    int32_t find_edge(int32_t a, int32_t b) const;

    struct Place {
        double distance_squared = HUGE_VAL;
        int32_t face = -1;
        double weight[3] = {0, 0, 0};
        CornerPlace corners() const { return {{3 * face, 3 * face + 1, 3 * face + 2}, {weight[0], weight[1], weight[2]}}; }
    };
    // The closest point to x on the faces that can be reached from `face` across edges that are no borders, as long as it gets
    // closer. Replaces `place` where it is closer than that.
    void descend(const Vec3& x, int32_t face, Place& place) const;
    // The same on the faces around the corner's vertex in its sector alone.
    void look_around(const Vec3& x, int32_t c, Place& place) const;

    const Mesh& in;
    Array<int32_t> first; // see find_first_corners

private:
    EdgeBits kept_;
};

// What an operation that keeps its input's vertices knows of those of its result.
struct VertexTraces {
    explicit VertexTraces(Memory& memory) : vert(memory), line(memory), face(memory), first(memory) {}
    struct Line { // from vertex a to b of the source, at a + t (b - a); a < 0: something else
        int32_t a, b;
        double t;
    };
    // Per vertex of the result: the vertex of the source that it is; ~i: line[i].
    int32_t of(int32_t v) const { return v < same ? v : vert.data()[v - same]; }
    int32_t same = 0;    // the first so many vertices are the source's, with the same numbers,
    Array<int32_t> vert; // and these are the others
    Array<Line> line;
    Array<int32_t> face;  // per face of the result: one of the source, not far away, on the same side of all kept edges
    Array<int32_t> first; // per vertex of the source: as find_first_corners would find it
    bool merged = false;  // vertices at one place became one: the fans around a vertex need not be those of its source
};

// corner_map, corner_places and edge_source of `out`, in numbers of the source mesh's own corners and edges.
Status map_corners(Context& context, const Mesh& in, EdgeBits kept, VertexTraces&& traces, Mesh& out);

// The same in the numbers of the caller's arrays, where the source was made of these; and how many of them there are.
Status name_places(Context& context, const Mesh& in, Mesh& out);

} // namespace dm
