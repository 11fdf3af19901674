// SPDX-License-Identifier: Apache-2.0
// Relaxation: vertices of a decimated mesh move to where the mesh fits the input better.
#pragma once

#include "base/context.h"
#include "mesh/mesh.h"

namespace dm {

struct RelaxRules {
    Precision precision = Precision::f32; // new positions are rounded to it
    bool boundary_rule = true;
    double fold_cosine = 0.2;                       // no normal may turn further in one move
    double sharpest = -0.5;                         // cosine between neighbouring normals that a move may bring about
    int32_t sweeps = 6;                             // at most; the passes end when nothing moves any more
    EdgeBits kept_bits = kEdgeGiven | kEdgeFeature; // an edge with one of these is kept
};

// level: Delaunay, and so it stays, exactly tested on rounded positions; its connectivity and everything else stay as they are.
// Least squares of the distance from samples of `in` to `level` and back, with more weight on what is far off. Where all edges at
// a vertex are inside and not kept it moves freely; on the boundary or between feature edges it does where there are exactly two
// of these; at kept edges that came with the mesh it stays. stays: null, or per vertex of `level` 1 where it may not move at all.
// What `level` knows of where its vertices lie on the input is not brought up to date. moved: vertices that ended elsewhere. After
// an error `level` is valid and Delaunay, somewhere on the way.
Status relax(Context& context, const Mesh& in, const RelaxRules& rules, const uint8_t* stays, Mesh& level, int64_t& moved);

} // namespace dm
