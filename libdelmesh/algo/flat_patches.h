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
    explicit FlatPatches(Memory& memory) : face_patch(memory), normal(memory), drift(memory) {}
    Array<int32_t> face_patch; // per face of the surface
    Array<Vec3> normal;        // per patch, unit length (zero for a lone face without area)
    Array<double> drift;       // per face: how far it may be from the input besides the slab, by flips within the tolerance
    double thickness = 0;      // of the thickest patch
};

// half_slab: distance a vertex may have from the seed's plane; 0: exactly coplanar neighbours only. Kept edges are not crossed.
Status grow_flat_patches(Context& context, const Surface& surface, double half_slab, FlatPatches& out);

} // namespace dm
