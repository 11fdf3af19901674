// SPDX-License-Identifier: Apache-2.0
// Where the corners and edges of decimation's levels lie on their source (docs/attributes.md). A level's kept edges are those of
// the Delaunay mesh, some merged: what lies to their left there tells the sides of seams apart.
#pragma once

#include "algo/surface_map.h"

namespace dm {

// How a level's elements come from the Delaunay mesh, in its numbers.
struct LevelTraces {
    explicit LevelTraces(Memory& memory) : face(memory), same(memory), into(memory) {}
    Array<int32_t> face; // per face of the level: one of the same chart
    Array<int32_t> same; // per vertex of the level: the vertex whose place it has; -1: it was moved
    Array<int32_t> into; // per vertex of the Delaunay mesh: the level's that it went into; -1: none
};

class LevelMap {
public:
    // in: the source; full: the Delaunay mesh made of it, which has its map, in numbers of in's own.
    LevelMap(Context& context, const Mesh& in, const Mesh& full, EdgeBits kept);
    Status begin();
    // corner_map, corner_places and edge_source, in numbers of in's own corners and edges.
    Status map(const LevelTraces& traces, Mesh& level) const;

private:
    friend class LevelMapping;
    bool is_border(int32_t c) const { return dm::is_border(full_, c, kept_ & kEdgeGiven); } // of full
    bool is_line(int32_t c) const { return dm::is_border(full_, c, kept_); }
    int32_t source_corner(int32_t c) const; // of `in`, at the place of full's corner c, or of the face that it lies on

    Context& context_;
    const Mesh &in_, &full_;
    const EdgeBits kept_;
    Sheets sheets_;
    Array<int32_t> first_; // per vertex of full, a corner; that of a boundary edge, else of a line where there is one
    EdgeNumbers edges_;    // of full
    Array<int32_t> chart_; // per face of full: equal where no border is between
};

} // namespace dm
