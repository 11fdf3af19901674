// SPDX-License-Identifier: Apache-2.0
// Flips that leave the surface where it is, or within what is left of the tolerance: what `preserve` may flip, and the book it
// keeps of how far each face has come from the input.
#pragma once

#include "algo/flat_patches.h"
#include "mesh/surface.h"

namespace dm {

double distance_to_segment(const Vec3& x, const Vec3& a, const Vec3& b);

// An upper bound on the two-sided distance between the two pairs of faces of the tetrahedron p q u v: those with the edge p q,
// and those with u v.
double flip_displacement(const Vec3& p, const Vec3& q, const Vec3& u, const Vec3& v);

// How far a face may be from the input.
struct MovementLimit {
    double anywhere = 0;  // wherever its split vertices are rounded to
    double rounded = 0;   // and its split vertices from where they belong, in all
    bool hurried = false; // where the precision has no room or splits crowd: add up to the limit, and measure nothing
    // So much of the difference may be taken by flips: split vertices need some room.
    double tight() const { return anywhere + 0.65 * (rounded - anywhere); }
};

// What a flip in `preserve` does to the surface.
struct FreeFlip {
    enum Kind { none, in_plane, first_has_no_area, second_has_no_area, moves };
    Kind kind = none;
    // Where it moves the surface: the bounds of the region that holds its faces then, and whether the region remembers both of
    // those that it is made of, or begins anew.
    double base = 0, height = 0;
    bool remembers = false, measured = false;
    bool allowed() const { return kind != none; }
};

// May the edge c be flipped within the limit? in_need: there is no room to split it, and what could leave a face without area is
// allowed.
FreeFlip judge_free_flip(const Surface& surface, const FlatPatches& patches, int32_t c, const MovementLimit& limit, bool in_need);

// Enters the flip of c, which has been done, into the book.
void book_free_flip(const Surface& surface, FlatPatches& patches, int32_t c, const FreeFlip& flip);

} // namespace dm
