// SPDX-License-Identifier: Apache-2.0
// What collapses do to the layers that have a weight: quadrics for values, not only for distances (Hoppe, New Quadric Metric for
// Simplifying Meshes with Appearance Attributes, 1999). On every face a component is an affine function of the position. A
// vertex's best value is the mean of those of the faces that went into it, and its error their variance, which again is a
// quadric in the place alone: it is added to that of the distances, and everything else is as without layers.
// A vertex has such means for each of its sectors between boundary and kept edges, its wedges.
#pragma once

#include "base/context.h"
#include "geom/quadric.h"
#include "mesh/spatial_order.h"
#include "mesh/surface.h"

namespace dm {

class Wedges {
public:
    explicit Wedges(Memory& memory)
        : wedge_(memory), squares_(memory), areas_(memory), means_(memory), values_(memory), changed_(memory), merged_(memory),
          merged_means_(memory) {}
    static bool are_needed(const Mesh& in);
    // s: as decimation begins with it, a copy of `full` in another order; full: made from `in`, with its map in numbers of in's own.
    Status begin(Context& context, const Mesh& in, const Mesh& full, const SpatialOrder& order, const Surface& s);
    // The squares are about `origin` and times `unit`; the range of a layer counts as much as `size`, times its weight.
    // vert_weights: null, or per vertex, a factor.
    Status add_faces(Context& context, const Surface& s, const Vec3& origin, double unit, double size,
                     const double* vert_weights);
    bool has_values() const { return !values_.empty(); }
    bool empty() const { return wedge_.empty(); }
    void free_storage();

    // Of the vertex that the edge c is collapsed to, as far as the collapse changes its wedges.
    Quadric merged(const Surface& s, int32_t c) const;

    // A vertex at a place, in one of its sectors.
    struct Group { // of wedges that count as one
        int32_t wedge[3];
        int count;
    };
    struct Stand {
        Vec3 at;
        Group group;
    };
    Stand stand(const Surface& s, int32_t c) const { return {s.at(s.vert(c)), {{wedge_[c], -1, -1}, 1}}; }
    // Of the vertex that the edge `collapsed` is collapsed to, in the sector of the corner c at one of its ends.
    Stand stand_after(const Surface& s, int32_t collapsed, int32_t c, const Vec3& at) const;
    // What a flip of [a, b] to [u, v] moves, beside what it moves the surface: the squares of the differences where they cross, times
    // half of the area.
    double moved_by_flip(const Stand& a, const Stand& b, const Stand& u, const Stand& v) const;

    // A collapse, with the flips after it, until it is kept or undone.
    struct Sides { // wedges of the ends, on either side; -1: boundary
        int32_t p[2], q[2];
    };
    Sides sides(const Surface& s, int32_t c) const;
    void merge(const Surface& s, int32_t p, const Sides& sides); // after the collapse
    void flip(const Surface& s, int32_t c);                      // before it is made
    void keep() {
        changed_.clear();
        merged_.clear();
        merged_means_.clear();
    }
    void undo();

private:
    struct Mean { // the sum of the functions' values at x is dot(gradient, x) + value
        Vec3 gradient;
        double value;
    };
    struct Change {
        int32_t corner, old;
    };
    struct Merged { // what a wedge was
        int32_t wedge;
        Quadric square;
        double area;
    };
    int groups(const Surface& s, int32_t c, Group* out) const;
    Quadric of(const Group& group) const;
    double value(const Stand& stand, int32_t component) const;
    void put(int32_t c, int32_t wedge) {
        changed_.push_back({c, wedge_[c]});
        wedge_[c] = wedge;
    }
    void find_wedges(const Surface& s);

    int32_t components_ = 0; // of all layers with a weight
    Vec3 origin_{0, 0, 0};
    Array<int32_t> wedge_;   // per corner
    Array<Quadric> squares_; // of all components; this and the rest per wedge
    Array<double> areas_;
    Array<Mean> means_;    // per component
    Array<double> values_; // per corner and component, times its weight, of a range of 1: until they are added
    Array<Change> changed_;
    Array<Merged> merged_;
    Array<Mean> merged_means_;
};

} // namespace dm
