// SPDX-License-Identifier: Apache-2.0
// Neighbouring coordinates rounded in place, as an optimiser sees them in real code. Compiled once for every compiler and
// optimisation level (ROUND_VARIANT names them); test_round compares what comes out.
#include "base/round.h"

#define ROUND_JOIN_2(a, b) a##b
#define ROUND_JOIN(a, b) ROUND_JOIN_2(a, b)

extern "C" {

void ROUND_JOIN(round_pair_, ROUND_VARIANT)(double* p) {
    p[0] = dm::round_to_f32(p[0]);
    p[1] = dm::round_to_f32(p[1]);
}

void ROUND_JOIN(round_points_, ROUND_VARIANT)(double* p, int count) {
    dm::Vec3* v = reinterpret_cast<dm::Vec3*>(p);
    for (int i = 0; i < count; ++i) v[i] = dm::round_to(dm::Precision::f32, v[i]);
}

// What GCC 12 gets wrong: observed, never used.
void ROUND_JOIN(round_points_naively_, ROUND_VARIANT)(double* p, int count) {
    dm::Vec3* v = reinterpret_cast<dm::Vec3*>(p);
    for (int i = 0; i < count; ++i) {
        v[i].x = static_cast<float>(v[i].x);
        v[i].y = static_cast<float>(v[i].y);
        v[i].z = static_cast<float>(v[i].z);
    }
}

} // extern "C"
