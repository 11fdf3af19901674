// SPDX-License-Identifier: Apache-2.0
// Points spread evenly over a triangle.
#pragma once

#include <cstdint>

#include "base/vec.h"

namespace dm {

// The triangular van der Corput sequence (Basu and Owen 2015): the digits of `index` to the base of 4 say which of the four
// similar parts of the triangle to go into, the lowest first, so that any run of consecutive numbers is well spread. 0 is the
// centroid.
inline Vec3 low_discrepancy_point(const Vec3 (&corner)[3], uint64_t index) {
    double weight[4] = {0, 0, 0, 0}; // of nobody, and of the corners
    double size = 1;
    for (; index != 0; index >>= 2) {
        const unsigned digit = index & 3;
        size *= digit == 0 ? -0.5 : 0.5; // the middle part is upside down
        if (digit != 0) weight[digit] += size;
    }
    const double third = (1 - (weight[1] + weight[2] + weight[3])) / 3;
    const double b = third + weight[2], c = third + weight[3];
    return corner[0] + (b * (corner[1] - corner[0]) + c * (corner[2] - corner[0]));
}

} // namespace dm
