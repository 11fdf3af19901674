/* SPDX-License-Identifier: Apache-2.0 */
/* The exact predicates: answers known by hand, then campaigns against GMP.
 * `unit_test_predicates CASES [SEED]` runs that many random cases, and as many degenerate ones: the long form of the campaign. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "shim_predicates.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static int64_t campaign_cases = 600000; /* random, and as many degenerate, in all families together */
static uint64_t campaign_seed = 1;

/* ---- interior edges: a = (0, 0, 0), b = (4, 0, 0), everything times a scale and moved ---- */

typedef struct {
    double p[3], q[3];
    int nld;
} edge_case;

static const edge_case edge_cases[] = {
    {{2, 3, 0}, {2, -3, 0}, 0},                  /* acute, acute */
    {{2, 2, 0}, {2, -2, 0}, 0},                  /* 90 + 90: a tie */
    {{2, 2, 0}, {2, 0, -2}, 0},                  /* the same, folded */
    {{2, 1, 0}, {2, -4, 0}, 0},                  /* cocircular: 126.87 + 53.13, a tie */
    {{2, -4, 0}, {2, 1, 0}, 0},                  /* and from the other side */
    {{2, 1, 0}, {2, 0, 4}, 0},                   /* and folded */
    {{2, 1, 0}, {2, -3.9999990463256836, 0}, 1}, /* 2^-20 inside the circle */
    {{2, 1, 0}, {2, -4.0000009536743164, 0}, 0}, /* and outside */
    {{2, 1, 0}, {2, -1, 0}, 1},                  /* obtuse, obtuse */
    {{2, 1, 0}, {2, 1, 0}, 1},                   /* the same apex twice */
    {{2, 0, 0}, {2, -3, 0}, 1},                  /* an apex on the edge: 180 and more */
    {{2, 0, 0}, {2, -0.5, 0}, 1},
    {{2, 0, 0}, {1, 0, 0}, 1},  /* 180 + 180 */
    {{2, 0, 0}, {5, 0, 0}, 0},  /* 180 + 0: a tie */
    {{-1, 0, 0}, {5, 0, 0}, 0}, /* 0 + 0 */
    {{2, 0, 0}, {0, 0, 0}, 0},  /* 180, and an apex on an end */
    {{4, 0, 0}, {0, 0, 0}, 0},
    {{4, 0, 0}, {2, -1, 0}, 0},       /* an apex on an end counts as 0 */
    {{-1, 0, 0}, {2, -1e-3, 0}, 0},   /* 0 + nearly 180 */
    {{1000, 1e-12, 0}, {2, 0, 0}, 1}, /* nearly 0 + 180: past the tie by 4e-18 */
};

/* Powers of two, so that the cases stay what they are as long as nothing is rounded away. */
static const int scale_exponents[] = {0, 20, 100, -90, 400, -400, 511, -537, 1000, -1000};

static void put(double r[3], const double v[3], int exponent, double offset) {
    for (int i = 0; i < 3; ++i) {
        r[i] = v[i];
        for (int k = 0; k < exponent; ++k) r[i] *= 2;
        for (int k = 0; k > exponent; --k) r[i] /= 2;
        r[i] += offset;
    }
}

static void interior_edges_have_the_known_answers(void** state) {
    (void)state;
    static const double origin[3] = {0, 0, 0}, end[3] = {4, 0, 0};
    for (size_t s = 0; s < COUNT(scale_exponents); ++s) {
        for (size_t i = 0; i < COUNT(edge_cases); ++i) {
            const edge_case* c = &edge_cases[i];
            double a[3], b[3], p[3], q[3];
            put(a, origin, scale_exponents[s], 0);
            put(b, end, scale_exponents[s], 0);
            put(p, c->p, scale_exponents[s], 0);
            put(q, c->q, scale_exponents[s], 0);
            if (shim_edge_is_nld(a, b, p, q) != c->nld || shim_edge_is_nld(b, a, q, p) != c->nld) {
                fail_msg("edge case %d at 2^%d should be %d", (int)i, scale_exponents[s], c->nld);
            }
        }
    }
}

static void a_tie_stays_a_tie_far_from_the_origin(void** state) {
    (void)state;
    static const double a0[3] = {0, 0, 0}, b0[3] = {4, 0, 0}, p0[3] = {2, 1, 0}, q0[3] = {2, -4, 0},
                        in[3] = {2, -3.9990234375, 0};
    double a[3], b[3], p[3], q[3], r[3];
    const double offset = 8192; /* the coordinates fit float32: 2^13 + 2^-10 */
    put(a, a0, 0, offset);
    put(b, b0, 0, offset);
    put(p, p0, 0, offset);
    put(q, q0, 0, offset);
    put(r, in, 0, offset);
    assert_int_equal(shim_edge_is_nld(a, b, p, q), 0);
    assert_int_equal(shim_edge_is_nld(a, b, p, r), 1);
}

static void an_edge_of_length_zero_is_delaunay(void** state) {
    (void)state;
    static const double a[3] = {1, 2, 3}, p[3] = {4, 4, 4}, q[3] = {0, -1, 5};
    assert_int_equal(shim_edge_is_nld(a, a, p, q), 0);
    assert_int_equal(shim_edge_is_nld(a, a, a, q), 0);
    assert_int_equal(shim_edge_is_nld(a, a, a, a), 0);
    assert_int_equal(shim_boundary_edge_is_nld(a, a, p), 0);
    assert_int_equal(shim_boundary_edge_is_nld(a, a, a), 0);
    assert_int_equal(shim_zero_area(a, a, p), 1);
    assert_int_equal(shim_flat_edge(a, a, p, q), 0);
}

static void subnormal_and_overflowing_coordinates(void** state) {
    (void)state;
    const double tiny = 4.9406564584124654e-324, huge = 1.7976931348623157e308;
    const double o[3] = {0, 0, 0}, x[3] = {4 * tiny, 0, 0}, p[3] = {2 * tiny, tiny, 0}, q[3] = {2 * tiny, -4 * tiny, 0};
    const double r[3] = {2 * tiny, -3 * tiny, 0};
    assert_int_equal(shim_edge_is_nld(o, x, p, q), 0);
    assert_int_equal(shim_edge_is_nld(o, x, p, r), 1);
    assert_int_equal(shim_orientation(o, x, p, q), 0);
    /* b - a overflows. 90 + 90, and a little more. */
    const double a[3] = {-huge, 0, 0}, b[3] = {huge, 0, 0}, up[3] = {0, huge, 0}, down[3] = {0, -huge, 0};
    const double inside[3] = {0, -1.7976931348623155e308, 0};
    assert_int_equal(shim_edge_is_nld(a, b, up, down), 0);
    assert_int_equal(shim_edge_is_nld(a, b, up, inside), 1);
    assert_int_equal(shim_boundary_edge_is_nld(a, b, down), 0);
    assert_int_equal(shim_boundary_edge_is_nld(a, b, inside), 1);
    assert_int_equal(shim_boundary_edge_is_nld(a, b, x), 1);
    assert_int_equal(shim_flat_edge(a, b, up, down), 1);
    /* the two ends of the range in one triangle: off the line by the smallest double, seen from 10^308 */
    const double off[3] = {0, tiny, 0};
    assert_int_equal(shim_zero_area(a, b, o), 1);
    assert_int_equal(shim_zero_area(a, b, off), 0);
    assert_int_equal(shim_edge_is_nld(a, b, off, down), 1);
}

static void boundary_edges_have_the_known_answers(void** state) {
    (void)state;
    static const double a[3] = {0, 0, 0}, b[3] = {4, 0, 0};
    static const double right[3] = {2, 2, 0}, obtuse[3] = {2, 1.9999998807907104, 0}, acute[3] = {2, 2.0000002384185791, 0};
    static const double on[3] = {1, 0, 0}, past[3] = {5, 0, 0};
    assert_int_equal(shim_boundary_edge_is_nld(a, b, right), 0);
    assert_int_equal(shim_boundary_edge_is_nld(a, b, obtuse), 1);
    assert_int_equal(shim_boundary_edge_is_nld(a, b, acute), 0);
    assert_int_equal(shim_boundary_edge_is_nld(a, b, on), 1);
    assert_int_equal(shim_boundary_edge_is_nld(a, b, past), 0);
    assert_int_equal(shim_boundary_edge_is_nld(a, b, b), 0);
}

static void orientation_and_flatness_have_the_known_answers(void** state) {
    (void)state;
    static const double o[3] = {0, 0, 0}, x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, z[3] = {0, 0, 1}, xy[3] = {1, 1, 0};
    static const double bent[3] = {1, 1, 1e-300}, dart[3] = {0.25, 0.25, 0};
    assert_int_equal(shim_orientation(o, x, y, z), 1);
    assert_int_equal(shim_orientation(o, y, x, z), -1);
    assert_int_equal(shim_orientation(o, x, y, xy), 0);
    assert_int_equal(shim_orientation(o, x, y, bent), 1);
    /* the edge (x, y) between (x, y, o) and (y, x, apex) */
    assert_int_equal(shim_flat_edge(x, y, o, xy), 1);
    assert_int_equal(shim_flat_edge(y, x, xy, o), 1);
    assert_int_equal(shim_flat_edge(x, y, o, bent), 0);
    assert_int_equal(shim_flat_edge(x, y, o, dart), 0); /* folded over: the same side */
    assert_int_equal(shim_flat_edge(x, y, o, z), 0);
    assert_int_equal(shim_flat_edge(x, y, o, x), 0); /* no area */
    assert_int_equal(shim_normals_dot_sign(o, x, y, y, x, xy), 1);
    assert_int_equal(shim_normals_dot_sign(o, x, y, x, y, xy), -1);
    assert_int_equal(shim_normals_dot_sign(o, x, y, o, y, z), 0);
    assert_int_equal(shim_normals_dot_sign(o, x, x, o, x, y), 0);
}

static void the_filter_decides_what_is_not_close(void** state) {
    (void)state;
    static const double a[3] = {100, 0, 0}, b[3] = {104, 0, 0}, p[3] = {102, 1, 0}, q[3] = {102, -4, 0};
    static const double near_q[3] = {102, -3.9999999999, 0}, acute[3] = {102, 3, 0}, denormal_edge[3] = {4e-42, 0, 0};
    static const double o[3] = {0, 0, 0}, dp[3] = {2e-42, 1e-42, 0}, dq[3] = {2e-42, -3e-42, 0};
    assert_int_equal(shim_edge_needs_exact(a, b, p, q), 1);
    assert_int_equal(shim_edge_needs_exact(a, b, p, near_q), 0);
    assert_int_equal(shim_edge_needs_exact(a, b, acute, q), 0);
    assert_int_equal(shim_edge_needs_exact(o, denormal_edge, dp, dq), 0); /* float32 subnormals are nothing special in double */
}

/* ---- campaigns ---- */

static shim_campaign run(int32_t family, int64_t cases) {
    const shim_campaign r = shim_run_campaign(family, campaign_seed, cases);
    print_message("  %-40s %10lld cases, %11lld answers: %lld wrong; %lld NLD, %lld ties, %lld near, %lld exact\n",
                  shim_family_name(family), (long long)r.cases, (long long)r.checks, (long long)r.wrong, (long long)r.nld,
                  (long long)r.ties, (long long)r.near_ties, (long long)r.exact_calls);
    if (r.wrong != 0)
        fail_msg("%s: %lld wrong answers, the first: %s", shim_family_name(family), (long long)r.wrong, r.first_wrong);
    assert_true(r.cases == cases);
    return r;
}

static void random_cases_agree_with_gmp(void** state) {
    (void)state;
    const int32_t families = shim_random_families();
    for (int32_t f = 0; f < families; ++f) {
        /* most of them in the two plain families: those with wild exponents take long integers */
        const int64_t share = f < 2 ? campaign_cases * 2 / 5 : campaign_cases / 10;
        const shim_campaign r = run(f, share);
        assert_true(r.nld > r.cases / 20 && r.nld < r.cases / 2);
    }
}

static void degenerate_cases_agree_with_gmp(void** state) {
    (void)state;
    int64_t cases = 0, ties = 0, near_ties = 0, right = 0, flat = 0, zero_areas = 0;
    const int32_t first = shim_random_families(), families = shim_families();
    for (int32_t f = first; f < families; ++f) {
        const shim_campaign r = run(f, campaign_cases / (families - first));
        cases += r.cases;
        ties += r.ties;
        near_ties += r.near_ties;
        right += r.right;
        flat += r.flat;
        zero_areas += r.zero_areas;
    }
    print_message(
        "  of %lld degenerate cases: %lld exact ties, %lld near ties, %lld right angles, %lld flat, %lld without area\n",
        (long long)cases, (long long)ties, (long long)near_ties, (long long)right, (long long)flat, (long long)zero_areas);
    /* the generators do what they are for */
    assert_true(ties > cases / 6 && near_ties > cases / 12 && right > cases / 30 && flat > cases / 10 && zero_areas > cases / 20);
}

int main(int argc, char** argv) {
    if (argc > 1) campaign_cases = strtoll(argv[1], NULL, 10);
    if (argc > 2) campaign_seed = strtoull(argv[2], NULL, 10);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(interior_edges_have_the_known_answers),
        cmocka_unit_test(a_tie_stays_a_tie_far_from_the_origin),
        cmocka_unit_test(an_edge_of_length_zero_is_delaunay),
        cmocka_unit_test(subnormal_and_overflowing_coordinates),
        cmocka_unit_test(boundary_edges_have_the_known_answers),
        cmocka_unit_test(orientation_and_flatness_have_the_known_answers),
        cmocka_unit_test(the_filter_decides_what_is_not_close),
        cmocka_unit_test(random_cases_agree_with_gmp),
        cmocka_unit_test(degenerate_cases_agree_with_gmp),
    };
    return cmocka_run_group_tests_name("predicates", tests, NULL, NULL);
}
