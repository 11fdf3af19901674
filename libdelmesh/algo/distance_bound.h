// SPDX-License-Identifier: Apache-2.0
// A proven upper bound on the one-sided Hausdorff distance between two surfaces, by branch and bound.
#pragma once

#include "base/context.h"
#include "geom/bvh.h"

namespace dm {

struct DistanceBound {
    double lower; // a distance that occurs: the largest sampled one, and what the search met beyond it
    double upper; // no point of the surface is farther away
};

// The largest distance of a point of `from` to `to`, both in the same frame. Stops at upper <= (1 + relative) lower + absolute,
// or at the level of rounding (2^-40 of the frame) where that is larger. Where this takes too much work the bound is still
// valid, and looser.
// near: per triangle of `from`, one of `to` that may be close. start, end: the part of the stage, for the progress.
// bound: holds the largest sampled distance in `lower`.
Status bound_distance(Context& context, const Bvh& from, const Bvh& to, const Array<int32_t>& near, double relative,
                      double absolute, double start, double end, DistanceBound& bound);

} // namespace dm
