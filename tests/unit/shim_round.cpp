// SPDX-License-Identifier: Apache-2.0
// The table of round_kernel.cpp's builds; round_variants.inc is written by CMake.
#include "shim_round.h"

#include "base/round.h"

extern "C" {

#define ROUND_VARIANT(name)                                                                                                      \
    void round_pair_##name(double*);                                                                                             \
    void round_points_##name(double*, int);                                                                                      \
    void round_points_naively_##name(double*, int);
#include "round_variants.inc"
#undef ROUND_VARIANT

static const shim_round_variant kVariants[] = {
#define ROUND_VARIANT(name) {#name, round_pair_##name, round_points_##name, round_points_naively_##name},
#include "round_variants.inc"
#undef ROUND_VARIANT
};

int shim_round_variants(void) {
    return static_cast<int>(sizeof kVariants / sizeof *kVariants);
}
shim_round_variant shim_round_variant_at(int index) {
    return kVariants[index];
}
double shim_round_to_f32(double x) {
    return dm::round_to_f32(x);
}

} // extern "C"
