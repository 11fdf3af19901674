// SPDX-License-Identifier: Apache-2.0
// Angles of options, and between normals.
#pragma once

#include "base/vec.h"

namespace dm {

// cos of an angle in degrees, 0..180, by arithmetic alone: libm's differs between systems in the last place, and a decision
// must not.
inline double cosine_of_degrees(double degrees) {
    const bool obtuse = degrees > 90;
    const double x = (obtuse ? 180 - degrees : degrees) * 0.017453292519943295;
    double term = 1, sum = 1;
    for (int k = 2; k <= 24; k += 2) {
        term *= -x * x / static_cast<double>(k * (k - 1));
        sum += term;
    }
    return obtuse ? -sum : sum;
}

// Of the angle between the two vectors; -1 where one has the length 0, or nearly so.
inline double cosine_between(const Vec3& m, const Vec3& n) {
    const double size = length_squared(m) * length_squared(n);
    return size > 0 ? dot(m, n) / std::sqrt(size) : -1;
}

// Is the angle between the two vectors, of any length, less than that with this cosine (>= 0)? A vector of length 0
// has no angle: false.
inline bool turns_less(const Vec3& m, const Vec3& n, double cosine) {
    const double turn = dot(m, n), sizes = length_squared(m) * length_squared(n);
    if (sizes > 1e-250 && sizes < 1e250) return turn > 0 && turn * turn > cosine * cosine * sizes;
    return turn > 0 && turn > cosine * length(m) * length(n); // where their product leaves the range
}

} // namespace dm
