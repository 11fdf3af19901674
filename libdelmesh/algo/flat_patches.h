// SPDX-License-Identifier: Apache-2.0
// Where flips are free: connected sets of faces that lie in one plane, exactly or within a tolerance.
//
// A patch is grown from a seed face while every vertex stays within the tolerance of the seed's plane and no face turns its back
// on it. Whatever the triangulation inside, as long as it covers the same outline without folding, both surfaces lie in the same
// slab over the same outline: they are at most the slab's thickness apart, and flips do not accumulate. Patches are decided once,
// before anything is split, so the rounding of split points changes nothing about them; the pieces of a face inherit its patch.
#pragma once

#include "mesh/surface.h"

namespace dm {

struct FlatPatches {
    explicit FlatPatches(Memory& memory) : face_patch(memory), plane(memory), drift(memory) {}
    struct Plane {
        Vec3 normal;      // unit length (zero for a lone face without area)
        double thickness; // of the slab that holds the patch's faces as given
    };
    Array<int32_t> face_patch; // per face of the surface
    Array<Plane> plane;        // per patch
    Array<double> drift;       // per face: how far from the input flips outside of patches may have taken it
    // Proven two-sided distance of what a face belongs to now from the input, the rounding of split points aside.
    double moved(int32_t face) const { return drift[face] + plane[face_patch[face]].thickness; }
};

// thickness: of the slab, parallel to the seed, that may hold a patch; 0: exactly coplanar neighbours only.
// Kept edges are not crossed.
Status grow_flat_patches(Context& context, const Surface& surface, double thickness, FlatPatches& out);

} // namespace dm
