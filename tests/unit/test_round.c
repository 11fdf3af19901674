/* SPDX-License-Identifier: Apache-2.0 */
/* Rounding to float32 must survive the optimiser: GCC 12 at -O2 drops it in loops over neighbouring doubles. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "shim_round.h"

enum { kCount = 6000 };

/* A volatile float is a real store and load: no optimiser may look through it. */
static double expected_rounding(double x) {
    volatile float f = (float)x;
    return (double)f;
}

/* Doubles of all float32 magnitudes, with digits to lose. */
static void fill(double* values) {
    uint64_t state = 1;
    for (int i = 0; i < kCount; ++i) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        const double mantissa = 1 + (double)(state >> 12) * 0x1p-52;
        const int exponent = (int)(state % 280u) - 150;
        values[i] = ldexp((state >> 11) % 2u ? mantissa : -mantissa, exponent);
    }
}

static int differences(const double* values, const double* expected) {
    int count = 0;
    for (int i = 0; i < kCount; ++i) count += memcmp(&values[i], &expected[i], sizeof(double)) != 0;
    return count;
}

static void rounding_survives_every_compiler_and_level(void** state) {
    (void)state;
    static double input[kCount], expected[kCount], pairs[kCount], points[kCount], naive[kCount];
    fill(input);
    for (int i = 0; i < kCount; ++i) expected[i] = expected_rounding(input[i]);
    assert_true(differences(input, expected) > kCount * 9 / 10);
    const int variants = shim_round_variants();
    assert_true(variants >= 4);
    for (int k = 0; k < variants; ++k) {
        const shim_round_variant v = shim_round_variant_at(k);
        memcpy(pairs, input, sizeof input);
        memcpy(points, input, sizeof input);
        memcpy(naive, input, sizeof input);
        for (int i = 0; i < kCount; i += 2) v.pair(pairs + i);
        v.points(points, kCount / 3);
        v.points_naively(naive, kCount / 3);
        /* an observation about the compiler, not a requirement */
        print_message("  %-10s plain casts leave %d of %d values unrounded\n", v.name, differences(naive, expected), (int)kCount);
        if (differences(pairs, expected) != 0 || differences(points, expected) != 0) {
            fail_msg("%s: %d values wrong in pairs, %d in points", v.name, differences(pairs, expected),
                     differences(points, expected));
        }
    }
}

static void rounding_has_the_known_answers(void** state) {
    (void)state;
    static const double known[][2] = {
        {0.1, 0.100000001490116119384765625},
        {16777217, 16777216}, /* ties go to the even neighbour */
        {16777219, 16777220},
        {-16777217, -16777216},
        {3.4028234663852886e38, FLT_MAX},
        {3.4028235677973362e38, FLT_MAX}, /* just below half an ulp past FLT_MAX */
        {3.4028235677973366e38, HUGE_VAL},
        {-1e300, -HUGE_VAL},
        {1.4e-45, 1.401298464324817e-45}, /* the smallest subnormal float32 */
        {7.006492321624085e-46, 0},       /* half of it: a tie to even */
        {7.006492321624087e-46, 1.401298464324817e-45},
        {5e-324, 0},
    };
    for (size_t i = 0; i < sizeof known / sizeof *known; ++i) {
        if (shim_round_to_f32(known[i][0]) != known[i][1]) {
            fail_msg("%.17g became %.17g instead of %.17g", known[i][0], shim_round_to_f32(known[i][0]), known[i][1]);
        }
    }
    assert_true(signbit(shim_round_to_f32(-0.0)) && signbit(shim_round_to_f32(-1e-300)));
    assert_true(isnan(shim_round_to_f32(NAN)));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rounding_survives_every_compiler_and_level),
        cmocka_unit_test(rounding_has_the_known_answers),
    };
    return cmocka_run_group_tests_name("round", tests, NULL, NULL);
}
