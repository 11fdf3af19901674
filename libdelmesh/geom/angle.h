// SPDX-License-Identifier: Apache-2.0
// Angles of options.
#pragma once

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

} // namespace dm
