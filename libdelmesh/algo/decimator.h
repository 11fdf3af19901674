// SPDX-License-Identifier: Apache-2.0
// The one class behind decimation, shared by the files that implement it and by nobody else:
//     decimator.cpp   quadrics, the queue, which edge is next
//     star.cpp        what a collapse leaves around an edge, and whether it would be Delaunay
//     placement.cpp   where the merged vertex goes; the paper's allowable region
//     decimate.cpp    the driver: levels, their meshes and reports
// The surface is Delaunay before and after every collapse.
#pragma once

#include <algorithm>

#include "algo/bucket_queue.h"
#include "algo/deviation_guard.h"
#include "algo/wedges.h"
#include "geom/angle.h"
#include "geom/quadric.h"
#include "mesh/surface.h"

namespace dm {

struct DecimationRules {
    Precision precision = Precision::f32;
    bool boundary_rule = true;
    bool optimum = true;             // try the quadrics' optimum,
    bool region = true;              // the best place of the paper's allowable region,
    bool ends = true, middle = true; // of the edge,
    bool flips = true;               // and flips where none of them is Delaunay as it is
    double fold_cosine = 0.2;        // no normal may turn further, by a collapse or by a flip
    double boundary_weight = 1;      // of planes through boundary and kept edges, against that of faces
    double flip_weight = 1;          // of what flips move, against quadrics
    double slack = 1.1;              // a collapse is done when it costs no more than this times what was the least
};

class Decimator {
public:
    struct Counts {
        int64_t collapses = 0, flips = 0, undone = 0, postponed = 0;
    };

    Decimator(Context& context, Surface& surface, const DecimationRules& rules);
    // Quadrics of all faces, kinds of all vertices, and the queue. vert_weights, locked_verts: null, or per vertex.
    Status begin(const double* vert_weights, const uint8_t* locked_verts);
    // Collapses edges until there are no more than so many vertices and faces, or nothing more can be.
    Status run(int64_t most_vertices, int64_t most_faces);

    // Between runs: gives back the memory of the queue and of what is known of vertices that are gone. Until it is woken, only kind()
    // may be asked. The next run begins with all edges again.
    void rest();
    Status wake(); // does nothing where it is awake
    // After the last run: what only collapses need is given back. kind() and prune() may not be asked any more.
    void finish() {
        verts.free_storage();
        quadrics.free_storage();
        queue.free_storage();
        wedges.free_storage();
    }

    // How many of the edges at a vertex are on the boundary or kept says how it may move.
    enum class Kind : uint8_t { smooth, crease, corner };
    Kind kind(int32_t v) const { return verts[v].kind; }
    // Takes components away whose bounding box has a smaller diagonal: not the largest one, nor one in which something has to stay.
    Status prune(double diagonal, int64_t& pruned);

    Wedges wedges;                   // may have begun before begin()
    DeviationGuard* guard = nullptr; // has to agree with every collapse, if there is one
    int64_t vertices_left = 0, faces_left = 0;
    int32_t stopped_by = DELMESH_STOPPED_BY_TARGET; // the last run
    Counts counts;
    double cost = 0;            // of the dearest collapse so far
    Array<int32_t> merged_into; // per vertex: the one it was collapsed into; itself while it lives
    Array<int32_t> next_merged; // lists of the vertices that went into one: see last_merged
    Array<int32_t> last_merged; // of the list that begins with this vertex
    Array<int32_t> place_of;    // per vertex: the vertex of the beginning whose place it has; -1: it was moved

private:
    // Apart from its quadric: most entries of the queue are void by the time they are popped, and that is seen here.
    struct Vertex {
        uint32_t version = 0; // counts changes of its place and quadric
        Kind kind = Kind::smooth;
        bool locked = false; // by the caller, a cut or the region: a corner whatever becomes of its edges
    };
    // What is known of an edge since its ends changed: nothing; its optimum cost too much for where the entry was.
    enum Tried : uint32_t { kNothing, kOptimum };
    struct Entry {
        int32_t corner, p, q;
        uint32_t stamp : 31; // see stamp_of: an entry made before one of the ends changed is not looked at
        uint32_t tried : 1;
    };
    // The edge from the merged vertex to a neighbour, and the face that follows counter-clockwise.
    struct Spoke {
        int32_t corner;                            // of a face that stays, at p or q; -1 for the last of an open star
        int32_t ring;                              // the neighbour
        int32_t beyond;                            // opposite to the face's outer edge; -1: none
        bool kept, link_kept, frozen, link_frozen; // this edge, and the face's outer one
        Vec3 at_ring, at_beyond;
        Vec3 normal; // of the face as it is
    };
    static constexpr int kPartBits = 13; // of the queue: 8192 vertices in a row, with all that is known of them 2 MB
    static constexpr int kMostSpokes = 96;
    static constexpr double kSharpest = -0.866; // cosine between neighbouring normals that collapses and flips may bring about
    static constexpr double kStiffness = 1e-4;  // of optima where the quadric leaves a choice
    struct Star {
        int32_t c; // p -> q
        int count; // faces; a closed star has as many spokes, an open one has one more
        bool open;
        Spoke spokes[kMostSpokes + 1];
        const Spoke& after(int i) const { return spokes[i + 1 < count || open ? i + 1 : 0]; }
        int before(int i) const { return i > 0 ? i - 1 : open ? -1 : count - 1; } // -1: none
    };
    struct Trial {             // of a place
        bool possible = false; // no fold, and what is not Delaunay may be flipped
        int nld = 0;           // edges
        double flips = 0;      // what flipping these would move, if that were all
    };
    struct Place {
        Vec3 at{0, 0, 0};
        double cost = 0;
        Trial trial;
    };

    // -- decimator.cpp
    // A line may get shorter from where it ends inside: noise has many of these.
    static Kind kind_among(int lines) { return lines > 2 ? Kind::corner : lines > 0 ? Kind::crease : Kind::smooth; }
    void find_kind_again(int32_t v);
    // Of the vertex that the edge c is collapsed to.
    Quadric merged(int32_t c) const {
        Quadric sum = quadrics[s.vert(c)];
        sum += quadrics[s.head(c)];
        if (!wedges.empty()) sum += wedges.merged(s, c);
        return sum;
    }
    void push(int32_t c);
    void push_around(int32_t v);
    Status fill_queue();
    void enqueue(int32_t bucket, const Entry& e) { queue.push(e.p >> kPartBits, bucket, e); }
    uint32_t stamp_of(int32_t p, int32_t q) const { return (verts[p].version + verts[q].version) & 0x7fffffff; }
    int32_t find(const Entry& e) const;
    void ask_for(const Entry* entries, int count, int32_t* corners) const;
    bool ends_may_merge(int32_t c, bool& stays_at_p, bool& stays_at_q) const;
    Vec3 optimum(const Quadric& q, int32_t p_vert, int32_t q_vert) const;
    void attempt(int32_t c, Tried tried, int32_t bucket);
    Status sweep();
    int64_t lines_that_hold_back() const;
    bool commit(const Star& star, const Place& place, double most, double& total);
    bool flip_until_delaunay(double budget, double& moved);

    // What a flip of [a, b] to [u, v] moves: h^2 times half the area, for the height h of the tetrahedron that it cuts.
    static double moved_by_flip(const Vec3& a, const Vec3& b, const Vec3& u, const Vec3& v) {
        const Vec3 n = cross(b - a, v - u);
        const double area = length(n), height = area > 0 ? dot(n, u - a) / area : 0;
        return 0.25 * height * height * area;
    }

    // -- star.cpp
    bool gather(int32_t c, Star& star) const; // false: the edge may not be collapsed
    Trial try_place(const Star& star, const Vec3& w) const;
    bool folds(const Star& star, const Vec3& w) const;
    double bend(int32_t c) const;
    // Between faces with these normals; most are not sharp.
    static void look_at_bend(const Vec3& m, const Vec3& n, double& sharpest) {
        if (dot(m, n) < 0) sharpest = std::min(sharpest, cosine_between(m, n));
    }
    bool flip_folds(int32_t c) const;

    // -- placement.cpp
    Vec3 keep_volume(const Star& star, const Quadric& quadric, const Vec3& least) const;
    bool best_allowed(const Star& star, const Quadric& quadric, const Vec3& near, Vec3& out) const;

    Context& context;
    Surface& s;
    const DecimationRules& rules;
    Vec3 origin{0, 0, 0};       // of the quadrics: the numbers in them are then of the model's size
    double flip_weight = 1;     // in units of the quadrics
    bool has_lines = false;     // kept edges
    bool has_marks = false;     // kept or frozen edges
    bool guard_refused = false; // in the attempt at hand
    Array<Vertex> verts;
    Array<Quadric> quadrics; // per vertex
    BucketQueue<Entry> queue;
    Array<int32_t> to_flip, flipped, changed;
    int64_t refusals[5] = {0, 0, 0, 0, 0}; // since the last sweep, per DELMESH_STOPPED_BY_*
};

} // namespace dm
