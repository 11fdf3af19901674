// SPDX-License-Identifier: Apache-2.0
// Where to put the vertex that splits an NLD edge.
//
// Interval placement, after Liu, Xu, Fan, He 2015 with a look-ahead: unfold the faces around the edge into the plane. Along the
// edge, the positions at which both pieces become locally Delaunay form an interval, and so do those at which one of the
// surrounding edges that cannot be flipped would stop being Delaunay; their ends are roots of quadratics. They cut the edge into
// cells; the cell that leaves the fewest violated pieces wins, and in it the point nearest the middle, kept clear of the cell's
// ends, because there the new vertex lies on a circumcircle and rounding would decide.
// All of this is ordinary floating point: it decides how many vertices are needed, never whether the result is Delaunay.
#pragma once

#include "algo/flat_patches.h"
#include "mesh/surface.h"

namespace dm {

struct SplitPlan {
    static constexpr int kMost = 12;
    double t[kMost]; // along the edge, best first, 0 and 1 excluded
    int count = 0;
    double from[kMost], to[kMost]; // the same edges are violated everywhere in here
    int equals = 0;                // so many of the first differ only in their distance from the middle
};

// patches: where flips are free (preserve), or null where every edge that is not kept can be flipped.
// look_ahead: choose by all pieces that the new vertex would leave violated; otherwise the plain rule: both pieces of the edge must
// be Delaunay, and of the edges of its two faces as many as possible.
// resolution: distance between neighbouring coordinates of the output precision near the model's size.
void plan_split(const Surface& surface, const FlatPatches* patches, bool boundary_rule, bool look_ahead, double resolution,
                int32_t c, SplitPlan& plan);

// The paper's concentric shells: the distance from `origin`, an end of an edge of this length, that is a power of two times unit
// and nearest to half the length (the smaller at a tie). As a fraction of the length, always within [1/3, 2/3].
double shell_fraction(double length, double unit);

} // namespace dm
