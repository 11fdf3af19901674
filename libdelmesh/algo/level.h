// SPDX-License-Identifier: Apache-2.0
// From the surface that decimation has come to, to the Mesh of a level, with what ties it to its source and to the level before.
#pragma once

#include "algo/decimator.h"
#include "algo/level_map.h"
#include "geom/bvh.h"
#include "mesh/spatial_order.h"

namespace dm {

class LevelMaker {
public:
    // in: the source; full: the Delaunay mesh made of it, of which `surface` is a copy in another order that `decimator` works on.
    LevelMaker(Context& context, const Mesh& in, const Mesh& full, const SpatialOrder& order, const Surface& surface,
               const Decimator& decimator);
    // Everything but where its vertices lie on the source. before: the level before, whose parents are filled in, the one made last
    // or `full` itself; null if there is none.
    Status make(Mesh& out, Mesh* before);
    // Which vertices of the level just made may not be moved any more.
    void find_staying(Array<uint8_t>& stays) const;
    // The rest, once the level's vertices are where they stay.
    Status map_to_source(Mesh& out);
    // What a map of its corners needs to know of the level just made, where its vertices are now.
    void trace(const Mesh& out, LevelTraces& traces) const;

private:
    int32_t source_of(int32_t v) const; // of a vertex as the surface numbers it; -1: none
    Status make_tree();

    Context& context;
    const Mesh &in, &full;
    const SpatialOrder& order;
    const Surface& s;
    const Decimator& d;
    FaceTree in_tree;            // of `in`; made when it is first needed
    Array<int32_t> near;         // per vertex of the surface, a place in the tree's order
    Array<int32_t> verts, faces; // of the level made last, as the surface numbers them; empty: all
};

} // namespace dm
