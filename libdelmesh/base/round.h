// SPDX-License-Identifier: Apache-2.0
// The one place where a coordinate is rounded to float32.
#pragma once

#include "base/vec.h"

namespace dm {

enum class Precision : int { f32 = 1, f64 = 2 }; // the values of DELMESH_FLOAT32 and DELMESH_FLOAT64

// The nearest float32, as a double. A value past the float32 range becomes infinite.
// GCC 12.2 at -O2 drops the rounding of neighbouring double -> float -> double conversions when its SLP vectoriser pairs them;
// the empty asm makes the float opaque, so that the pair cannot be folded. tests/unit/test_round.c pins this at every -O level.
inline double round_to_f32(double x) {
    float f = static_cast<float>(x);
#if defined(__GNUC__) && (defined(__x86_64__) || defined(__i386__))
    __asm__("" : "+x"(f));
#elif defined(__GNUC__) && defined(__aarch64__)
    __asm__("" : "+w"(f));
#else
    volatile float opaque = f;
    f = opaque;
#endif
    return static_cast<double>(f);
}

inline double round_to(Precision p, double x) {
    return p == Precision::f32 ? round_to_f32(x) : x;
}
inline Vec3 round_to(Precision p, const Vec3& a) {
    if (p == Precision::f64) return a;
    return {round_to_f32(a.x), round_to_f32(a.y), round_to_f32(a.z)};
}

} // namespace dm
