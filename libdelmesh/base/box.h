// SPDX-License-Identifier: Apache-2.0
// Axis-parallel boxes.
#pragma once

#include <algorithm>

#include "base/vec.h"

namespace dm {

struct Box {
    Vec3 lo{HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}; // empty

    void extend(const Vec3& p) { // NaN leaves it as it is
        lo = {p.x < lo.x ? p.x : lo.x, p.y < lo.y ? p.y : lo.y, p.z < lo.z ? p.z : lo.z};
        hi = {p.x > hi.x ? p.x : hi.x, p.y > hi.y ? p.y : hi.y, p.z > hi.z ? p.z : hi.z};
    }
    void extend(const Box& o) {
        extend(o.lo);
        extend(o.hi);
    }
    bool empty() const { return !(lo.x <= hi.x); }
    // Of the box that is not empty; below 0 of the empty one.
    double longest_side() const { return std::max({hi.x - lo.x, hi.y - lo.y, hi.z - lo.z}); }
    double largest_coordinate() const {
        return std::max({std::fabs(lo.x), std::fabs(lo.y), std::fabs(lo.z), std::fabs(hi.x), std::fabs(hi.y), std::fabs(hi.z)});
    }
    double diagonal() const {
        const double size = longest_side();
        return size > 0 ? size * length((1 / size) * (hi - lo)) : 0; // squares of a small model's sides may be 0
    }
};

} // namespace dm
