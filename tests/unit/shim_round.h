/* SPDX-License-Identifier: Apache-2.0 */
/* Every build of round_kernel.cpp, by number. */
#ifndef SHIM_ROUND_H
#define SHIM_ROUND_H

#ifdef __cplusplus
extern "C" {
#endif

typedef struct shim_round_variant {
    const char* name;                       /* compiler and optimisation level */
    void (*pair)(double* values);           /* two doubles, in place */
    void (*points)(double* xyz, int count); /* 3 * count doubles, in place */
    void (*points_naively)(double* xyz, int count);
} shim_round_variant;

int shim_round_variants(void);
shim_round_variant shim_round_variant_at(int index);
double shim_round_to_f32(double x); /* as the unit tests themselves are built */

#ifdef __cplusplus
}
#endif

#endif
