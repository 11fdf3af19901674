/* SPDX-License-Identifier: Apache-2.0 */
/* Quality figures and distances: small cases with exact answers, laws on random surfaces (the bound against a dense sampling that
 * shares no code with the library), and calls that are cancelled or run out of memory at every step. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <float.h>
#include <math.h>
#include <string.h>

#include "shim_measure.h"

#define COUNT(array) ((int32_t)(sizeof(array) / sizeof(array)[0]))
#define MESH(positions, corners) {positions, COUNT(positions) / 3, corners, COUNT(corners) / 3, 0}

static void check_near(double value, double expected, double error, int line) {
    if (!(fabs(value - expected) <= error)) {
        print_error("line %d: %.17g, expected %.17g +- %g\n", line, value, expected, error);
        fail();
    }
}
#define assert_near(value, expected, error) check_near(value, expected, error, __LINE__)
#define assert_same(value, expected) check_near(value, expected, 0, __LINE__)

static uint64_t random_state;
static double random_unit(void) { /* -1 .. 1 */
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) * 0x1p-52 - 1;
}

static delmesh_distance_options defaults(void) {
    return (delmesh_distance_options){
        .struct_size = sizeof(delmesh_distance_options), .compute_bound = 1, .relative_error = 0.1, .absolute_error = 1e-4};
}

static delmesh_quality_report quality(const shim_mesh* mesh) {
    shim_run run = {.threads = 1};
    delmesh_quality_report report;
    assert_int_equal(shim_measure_quality(mesh, &run, &report), DELMESH_OK);
    assert_int_equal(run.leaked_bytes, 0);
    return report;
}

static void check_laws(const delmesh_distance_report* r, const delmesh_distance_options* o) {
    const double absolute = o->absolute_error / 100 * r->diagonal;
    assert_same(r->hausdorff_sampled, fmax(r->a_to_b_max, r->b_to_a_max));
    assert_same(r->rms, fmax(r->a_to_b_rms, r->b_to_a_rms));
    assert_true(r->a_to_b_rms <= r->a_to_b_max * (1 + 1e-12) && r->b_to_a_rms <= r->b_to_a_max * (1 + 1e-12));
    if (o->compute_bound) {
        assert_same(r->hausdorff_bound, fmax(r->a_to_b_bound, r->b_to_a_bound));
        assert_true(r->a_to_b_bound >= r->a_to_b_max && r->b_to_a_bound >= r->b_to_a_max);
        assert_true(r->a_to_b_bound <= (1 + o->relative_error) * r->a_to_b_max + absolute + 1e-12 * r->diagonal);
        assert_true(r->b_to_a_bound <= (1 + o->relative_error) * r->b_to_a_max + absolute + 1e-12 * r->diagonal);
    } else {
        assert_same(r->hausdorff_bound, -1);
        assert_same(r->a_to_b_bound, -1);
        assert_same(r->b_to_a_bound, -1);
    }
    if (r->diagonal > 0) {
        assert_near(r->hausdorff_percent, 100 * r->hausdorff_sampled / r->diagonal, 1e-12 * r->hausdorff_percent);
        assert_near(r->rms_percent, 100 * r->rms / r->diagonal, 1e-12 * r->rms_percent);
    }
    assert_true(r->normal_deviation_mean <= r->normal_deviation_max && r->normal_deviation_max <= 180);
}

static delmesh_distance_report distance_with(const shim_mesh* a, const shim_mesh* b, const delmesh_distance_options* options) {
    shim_run run = {.threads = 1};
    delmesh_distance_report report;
    assert_int_equal(shim_measure_distance(a, b, options, &run, &report), DELMESH_OK);
    assert_int_equal(run.leaked_bytes, 0);
    assert_false(run.progress_went_back);
    check_laws(&report, options);
    return report;
}
static delmesh_distance_report distance(const shim_mesh* a, const shim_mesh* b) {
    const delmesh_distance_options options = defaults();
    return distance_with(a, b, &options);
}

/* ---- Surfaces ---- */

static const double square_points[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
static const int32_t square_corners[] = {0, 1, 2, 0, 2, 3};
static const shim_mesh square = MESH(square_points, square_corners);

static const int32_t cube_corners[] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                       1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
static const double cube_points[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
static const shim_mesh cube = MESH(cube_points, cube_corners);

#define GRID 9
typedef struct {
    double points[3 * GRID * GRID];
    int32_t corners[6 * (GRID - 1) * (GRID - 1)];
    shim_mesh mesh;
} grid;

/* A bumpy square over [0, 1]^2; `diagonal`: which way the squares are cut (2: at random). */
static void make_grid(grid* g, uint64_t seed, double height, double jitter, int diagonal) {
    int32_t* c = g->corners;
    random_state = seed;
    for (int i = 0; i < GRID * GRID; ++i) {
        g->points[3 * i] = (i % GRID + jitter * random_unit()) / (GRID - 1);
        g->points[3 * i + 1] = ((double)(i / GRID) + jitter * random_unit()) / (GRID - 1);
        g->points[3 * i + 2] = height * random_unit();
    }
    for (int y = 0; y + 1 < GRID; ++y)
        for (int x = 0; x + 1 < GRID; ++x) {
            const int32_t p = y * GRID + x, q = p + 1, r = q + GRID, s = p + GRID;
            const int way = diagonal == 2 ? random_unit() > 0 : diagonal;
            const int32_t one[6] = {p, q, r, p, r, s}, other[6] = {p, q, s, q, r, s};
            memcpy(c, way ? other : one, sizeof one);
            c += 6;
        }
    g->mesh = (shim_mesh){g->points, GRID * GRID, g->corners, COUNT(g->corners) / 3, 0};
}

/* ---- Quality ---- */

static void test_quality_of_a_square(void** state) {
    (void)state;
    const delmesh_quality_report q = quality(&square);
    assert_near(q.area, 1, 1e-15);
    assert_near(q.diagonal, sqrt(2), 1e-15);
    assert_near(q.min_angle, 45, 1e-13);
    assert_near(q.max_angle, 90, 1e-13);
    assert_near(q.mean_min_angle, 45, 1e-13);
    assert_same(q.percent_below_30, 0);
    assert_same(q.percent_above_120, 0);
    assert_same(q.min_edge, 1);
    assert_near(q.max_edge, sqrt(2), 1e-15);
    assert_near(q.mean_edge, (4 + sqrt(2)) / 5, 1e-15);
    assert_int_equal(q.negative_cotangents, 0); /* 90 + 90: a tie */
    assert_int_equal(q.max_valence, 3);
    for (int k = 0; k < 18; ++k) assert_int_equal(q.angle_histogram[k], k == 4 ? 4 : k == 9 ? 2 : 0);
}

static void test_quality_counts(void** state) {
    (void)state;
    /* Two flat triangles on the edge (-4,0) (4,0), apexes at (0, 1) and (0, -1): 152 degrees each; and one of zero area. */
    static const double points[] = {-4, 0, 0, 4, 0, 0, 0, 1, 0, 0, -1, 0, 50, 50, 50};
    static const int32_t corners[] = {0, 1, 2, 1, 0, 3, 2, 2, 3};
    const shim_mesh mesh = MESH(points, corners);
    const delmesh_quality_report q = quality(&mesh);
    const double small = atan(0.25) * 180 / acos(-1), large = 180 - 2 * small;
    assert_near(q.min_angle, small, 1e-12);
    assert_near(q.max_angle, large, 1e-12);
    assert_near(q.mean_min_angle, small, 1e-12);
    assert_near(q.percent_below_30, 400.0 / 6, 1e-12);
    assert_near(q.percent_above_120, 200.0 / 6, 1e-12);
    assert_int_equal(q.negative_cotangents, 1);
    assert_int_equal(q.angle_histogram[1], 4);
    assert_int_equal(q.angle_histogram[15], 2);
    assert_near(q.area, 8, 1e-14);
    assert_near(q.diagonal, sqrt(64 + 4), 1e-14); /* the isolated vertex does not count */
    assert_same(q.min_edge, 0);                    /* of the face of zero area */
    assert_int_equal(quality(&cube).max_valence, 5); /* three edges of the cube and two diagonals */
}

static void test_quality_without_faces(void** state) {
    (void)state;
    const shim_mesh empty = {square_points, 4, square_corners, 0, 0};
    const delmesh_quality_report q = quality(&empty);
    assert_same(q.area, 0);
    assert_same(q.diagonal, 0);
    assert_same(q.min_angle, 0);
    assert_same(q.mean_edge, 0);
    assert_int_equal(q.max_valence, 0);
}

static void test_quality_scales_exactly(void** state) {
    (void)state;
    static grid g, scaled;
    make_grid(&g, 1, 0.1, 0.4, 2);
    const delmesh_quality_report q = quality(&g.mesh);
    static const int powers[] = {-480, -149, 40, 500};
    for (int i = 0; i < COUNT(powers); ++i) {
        const int k = powers[i];
        make_grid(&scaled, 1, 0.1, 0.4, 2);
        for (int32_t j = 0; j < COUNT(scaled.points); ++j) scaled.points[j] = ldexp(scaled.points[j], k);
        const delmesh_quality_report s = quality(&scaled.mesh);
        assert_same(s.area, ldexp(q.area, 2 * k));
        assert_same(s.diagonal, ldexp(q.diagonal, k));
        assert_same(s.mean_edge, ldexp(q.mean_edge, k));
        assert_same(s.min_angle, q.min_angle);
        assert_same(s.mean_min_angle, q.mean_min_angle);
        assert_memory_equal(s.angle_histogram, q.angle_histogram, sizeof s.angle_histogram);
    }
}

/* ---- Point and triangle, hierarchy ---- */

static void test_point_to_triangle(void** state) {
    (void)state;
    static const double t[] = {0, 0, 0, 4, 0, 0, 0, 4, 0};
    static const struct {
        double point[3], distance;
    } cases[] = {
        {{1, 1, 3}, 3},   {{1, 1, 0}, 0}, {{0, 0, 0}, 0},    {{-3, -4, 0}, 5}, {{7, -4, 0}, 5}, {{-3, 8, 0}, 5},
        {{2, -5, 12}, 13}, {{-5, 2, 12}, 13}, {{5, 5, 0}, 4.2426406871192851}, {{4, 0, 2}, 2},
    };
    for (int i = 0; i < COUNT(cases); ++i) assert_near(shim_triangle_distance(cases[i].point, t), cases[i].distance, 1e-15);
    /* Thin, and without area. */
    static const double thin[] = {0, 0, 0, 1, 0, 0, 0.5, 1e-12, 0}, line[] = {0, 0, 0, 1, 0, 0, 3, 0, 0};
    static const double dot[] = {1, 1, 1, 1, 1, 1, 1, 1, 1};
    static const double above[] = {0.3, 0, 2}, beyond[] = {6, 4, 0}, aside[] = {2, -2, 0};
    assert_near(shim_triangle_distance(above, thin), 2, 1e-15);
    assert_near(shim_triangle_distance(above, line), 2, 1e-15);
    assert_near(shim_triangle_distance(beyond, line), 5, 1e-15);
    assert_near(shim_triangle_distance(aside, line), 2, 1e-15);
    assert_near(shim_triangle_distance(beyond, dot), sqrt(25 + 9 + 1), 1e-14);
}

static void test_hierarchy_finds_the_closest(void** state) {
    (void)state;
    enum { FACES = 600, POINTS = 500 };
    static double positions[9 * FACES], points[3 * POINTS];
    static int32_t corners[3 * FACES];
    const shim_mesh mesh = {positions, 3 * FACES, corners, FACES, 0};
    for (int32_t c = 0; c < 3 * FACES; ++c) corners[c] = c;
    for (int kind = 0; kind < 4; ++kind) {
        random_state = 5 + (uint64_t)kind;
        for (int f = 0; f < FACES; ++f) {
            /* a soup; all in one place; a cascade that halves down to the depth limit; a line of points */
            const double size = kind == 2 ? ldexp(1, -f % 300) : 0.1;
            for (int k = 0; k < 9; ++k) {
                double x = (kind == 0 ? k < 3 ? 1 : size : size) * random_unit();
                if (kind == 0 && k >= 3) x += positions[9 * f + k % 3];
                if (kind == 1) x = k == 0 || k == 4;
                if (kind == 3) x = k % 3 == 0 ? f : 0;
                positions[9 * f + k] = x;
            }
        }
        for (int i = 0; i < 3 * POINTS; ++i) points[i] = 1.5 * random_unit() * (kind == 2 ? ldexp(1, -i % 50) : 1);
        assert_int_equal(shim_closest_mismatches(&mesh, points, POINTS), 0);
    }
}

/* ---- Distance: exact cases ---- */

static void test_parallel_squares(void** state) {
    (void)state;
    static const double points[] = {0, 0, 0.5, 1, 0, 0.5, 1, 1, 0.5, 0, 1, 0.5};
    static const int32_t reversed[] = {2, 1, 0, 3, 2, 0};
    shim_mesh upper = MESH(points, square_corners);
    delmesh_distance_report r = distance(&square, &upper);
    assert_near(r.diagonal, sqrt(2), 1e-15);
    assert_same(r.a_to_b_max, 0.5);
    assert_same(r.b_to_a_max, 0.5);
    assert_near(r.rms, 0.5, 1e-12);
    assert_near(r.hausdorff_bound, 0.5, 1e-12); /* all of it is at that distance from one triangle */
    assert_same(r.normal_deviation_max, 0);
    upper.corners = reversed;
    r = distance(&square, &upper);
    assert_same(r.hausdorff_sampled, 0.5);
    assert_near(r.normal_deviation_mean, 180, 1e-12);
}

static void test_a_surface_and_its_subdivision(void** state) {
    (void)state;
    static const double points[] = {0, 0, 0, 4, 0, 1, 1, 4, 2, 2, 0, 0.5, 2.5, 2, 1.5, 0.5, 2, 1};
    static const int32_t whole[] = {0, 1, 2}, parts[] = {0, 3, 5, 3, 1, 4, 5, 4, 2, 3, 4, 5};
    const shim_mesh a = MESH(points, whole), b = MESH(points, parts);
    const delmesh_distance_report r = distance(&a, &b);
    assert_near(r.hausdorff_sampled, 0, 1e-14);
    assert_near(r.hausdorff_bound, 0, 1e-8 * r.diagonal); /* far better than asked for */
    assert_near(r.normal_deviation_max, 0, 1e-6);
    static grid g;
    make_grid(&g, 3, 0.2, 0.3, 2);
    const delmesh_distance_report same = distance(&g.mesh, &g.mesh);
    assert_near(same.hausdorff_bound, 0, 1e-14);
}

static void test_shifted_cubes(void** state) {
    (void)state;
    static double points[COUNT(cube_points)];
    const shim_mesh shifted = MESH(points, cube_corners);
    for (int axes = 1; axes < 8; ++axes) {
        for (int32_t i = 0; i < COUNT(points); ++i) points[i] = cube_points[i] + (axes >> i % 3 & 1) * 0.25;
        const delmesh_distance_report r = distance(&cube, &shifted);
        const double expected = 0.25 * sqrt((axes & 1) + (axes >> 1 & 1) + (axes >> 2 & 1));
        assert_near(r.a_to_b_max, expected, 1e-15);
        assert_near(r.b_to_a_max, expected, 1e-15);
        assert_near(r.hausdorff_bound, expected, 0.1 * expected + 1e-6 * r.diagonal);
    }
}

static void test_one_direction_is_zero(void** state) {
    (void)state;
    static const double points[] = {0, 0, 0, 3, 0, 0, 3, 1, 0, 0, 1, 0};
    const shim_mesh wide = MESH(points, square_corners);
    const delmesh_distance_report r = distance(&square, &wide);
    assert_near(r.a_to_b_max, 0, 1e-15);
    assert_near(r.a_to_b_bound, 0, 1e-6 * r.diagonal);
    assert_same(r.b_to_a_max, 2);
    assert_near(r.b_to_a_bound, 2, 0.2 + 1e-6 * r.diagonal);
    assert_same(r.hausdorff_sampled, 2);
    assert_near(r.hausdorff_percent, 100 * sqrt(2), 1e-12);
    const delmesh_distance_report swapped = distance(&wide, &square);
    assert_same(swapped.a_to_b_max, r.b_to_a_max);
    assert_near(swapped.diagonal, sqrt(10), 1e-15);
}

/* What no sample sees: the middle of a small hole in the other surface. */
static void test_the_bound_sees_what_samples_miss(void** state) {
    (void)state;
    const double e = 0x1p-8, x = 0.3, y = 0.4;
    const double points[] = {0,     0,     0, 1,     0,     0, 1,     1,     0, 0,     1,     0,
                             x - e, y - e, 0, x + e, y - e, 0, x + e, y + e, 0, x - e, y + e, 0};
    static const int32_t corners[] = {0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
    const shim_mesh holed = MESH(points, corners);
    delmesh_distance_options options = defaults();
    options.samples = 1;
    options.compute_bound = 0;
    const delmesh_distance_report blind = distance_with(&square, &holed, &options);
    assert_near(blind.a_to_b_max, 0, 1e-15);
    options.compute_bound = 1;
    const delmesh_distance_report seen = distance_with(&square, &holed, &options);
    assert_true(seen.a_to_b_bound >= e);
    assert_true(seen.a_to_b_max <= e * (1 + 1e-12)); /* a distance that occurs */
    assert_true(seen.a_to_b_max >= (e - 2e-6) / 1.1);
    assert_near(seen.b_to_a_bound, 0, 1e-6 * seen.diagonal);
    /* Asked for the exact value. */
    options.relative_error = 0;
    const delmesh_distance_report exact = distance_with(&square, &holed, &options);
    assert_near(exact.a_to_b_max, e, 1e-6 * exact.diagonal);
    assert_near(exact.a_to_b_bound, e, 1e-6 * exact.diagonal);
}

/* A notch cut from the middle of an edge: the midpoint is farthest from what is left, and is looked at with one sample too. */
static void test_midpoints_are_samples(void** state) {
    (void)state;
    static const double points[] = {0, 0, 0, 2, 0, 0, 1, -1, 0, 1, -0.5, 0};
    static const int32_t whole[] = {0, 2, 1}, notched[] = {0, 2, 3, 3, 2, 1};
    const shim_mesh a = MESH(points, whole), b = {points, 4, notched, 2, 0};
    delmesh_distance_options options = defaults();
    options.samples = 1;
    options.compute_bound = 0;
    assert_near(distance_with(&a, &b, &options).a_to_b_max, 1 / sqrt(5), 1e-15);
}

/* Above a tilted plane the distance is linear, and its root mean square over a unit square 1/sqrt(3) of the largest: however the
 * square is cut into triangles. */
static void test_rms_is_weighted_by_area(void** state) {
    (void)state;
    static const double plane_points[] = {-9, -9, -9 * 0.75, 9, -9, 9 * 0.75, 9, 9, 9 * 0.75, -9, 9, -9 * 0.75};
    const shim_mesh plane = MESH(plane_points, square_corners);
    enum { FAN = 60 };
    static double points[3 * (FAN + 3)];
    static int32_t corners[3 * (FAN + 1)];
    const double apex[] = {0, 0, 0, 1, 0, 0, 1, 1, 0};
    memcpy(points, apex, sizeof apex);
    int32_t* c = corners;
    *c++ = 0, *c++ = 1, *c++ = 2;
    for (int i = 0; i < FAN; ++i) { /* the other half of the square is a fan of ever thinner triangles */
        points[9 + 3 * i] = i + 1 == FAN ? 0 : ldexp(1, -i - 1);
        points[9 + 3 * i + 1] = 1;
        *c++ = 0, *c++ = i + 2, *c++ = i + 3;
    }
    const shim_mesh fan = MESH(points, corners);
    const double slope = 0.6; /* the sine */
    const delmesh_distance_report a = distance(&square, &plane), b = distance(&fan, &plane);
    assert_near(a.a_to_b_max, slope, 1e-15);
    assert_near(a.a_to_b_rms, slope / sqrt(3), 1e-4);
    assert_near(b.a_to_b_max, slope, 1e-15);
    assert_near(b.a_to_b_rms, slope / sqrt(3), 1e-4);
    assert_near(b.normal_deviation_mean, asin(slope) * 180 / acos(-1), 1e-9);
}

static void test_degenerate_faces(void** state) {
    (void)state;
    static const double points[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5, 0.5, 0, 100, 0, 0};
    static const int32_t corners[] = {0, 1, 2, 0, 2, 3, 0, 0, 1, 3, 3, 3, 0, 4, 2};
    const shim_mesh untidy = MESH(points, corners);
    const delmesh_distance_report r = distance(&untidy, &cube), tidy = distance(&square, &cube);
    assert_same(r.diagonal, tidy.diagonal);
    assert_same(r.a_to_b_max, tidy.a_to_b_max);
    assert_same(r.b_to_a_max, tidy.b_to_a_max);
    assert_near(r.b_to_a_rms, tidy.b_to_a_rms, 1e-12);
    assert_same(r.b_to_a_max, 1);

    static const int32_t flat[] = {0, 1, 1, 0, 0, 1};
    const shim_mesh line = MESH(points, flat); /* from (0,0,0) to (1,0,0) */
    const delmesh_distance_report l = distance(&line, &square);
    assert_same(l.a_to_b_max, 0);
    assert_same(l.a_to_b_rms, 0);
    assert_same(l.b_to_a_max, 1);
    assert_near(l.b_to_a_rms, 1 / sqrt(3), 1e-4);

    static const int32_t spot[] = {5, 5, 5};
    const shim_mesh point = MESH(points, spot);
    const delmesh_distance_report p = distance(&point, &point);
    assert_same(p.diagonal, 0);
    assert_same(p.hausdorff_sampled, 0);
    assert_same(p.hausdorff_percent, 0);
    assert_true(p.hausdorff_bound >= 0 && p.hausdorff_bound <= 1e-10);
    const delmesh_distance_report far = distance(&point, &square);
    assert_same(far.a_to_b_max, 99);
    assert_same(far.b_to_a_max, sqrt(100 * 100 + 1));
}

static void test_no_surface(void** state) {
    (void)state;
    const shim_mesh empty = {square_points, 4, square_corners, 0, 0};
    const delmesh_distance_options options = defaults();
    shim_run run = {.threads = 1};
    delmesh_distance_report report;
    assert_int_equal(shim_measure_distance(&empty, &square, &options, &run, &report), DELMESH_ERROR_NO_SURFACE);
    assert_string_equal(run.error, "Mesh a has no faces.");
    assert_int_equal(shim_measure_distance(&square, &empty, &options, &run, &report), DELMESH_ERROR_NO_SURFACE);
    assert_string_equal(run.error, "Mesh b has no faces.");
    delmesh_distance_options many = options;
    many.samples = INT64_MAX;
    assert_int_equal(shim_measure_distance(&square, &square, &many, &run, &report), DELMESH_ERROR_INVALID_ARGUMENT);
}

/* ---- Distance: laws ---- */

/* An own distance from a point to a triangle: the plane's foot if it is inside, else the edges. */
static double reference_distance(const long double* p, const double* const* t) {
    long double e[2][3], w[3], g[3] = {0, 0, 0}, r[2] = {0, 0}, best = LDBL_MAX;
    for (int k = 0; k < 3; ++k) {
        e[0][k] = (long double)t[1][k] - t[0][k];
        e[1][k] = (long double)t[2][k] - t[0][k];
        w[k] = p[k] - t[0][k];
        g[0] += e[0][k] * e[0][k], g[1] += e[0][k] * e[1][k], g[2] += e[1][k] * e[1][k];
        r[0] += e[0][k] * w[k], r[1] += e[1][k] * w[k];
    }
    const long double det = g[0] * g[2] - g[1] * g[1];
    const long double u = det > 0 ? (r[0] * g[2] - r[1] * g[1]) / det : -1, v = det > 0 ? (r[1] * g[0] - r[0] * g[1]) / det : -1;
    if (u >= 0 && v >= 0 && u + v <= 1) {
        long double d = 0;
        for (int k = 0; k < 3; ++k) d += (w[k] - u * e[0][k] - v * e[1][k]) * (w[k] - u * e[0][k] - v * e[1][k]);
        return (double)sqrtl(d);
    }
    for (int i = 0; i < 3; ++i) {
        const double *a = t[i], *b = t[(i + 1) % 3];
        long double along = 0, whole = 0, d = 0;
        for (int k = 0; k < 3; ++k) {
            const long double edge = (long double)b[k] - a[k];
            along += (p[k] - a[k]) * edge;
            whole += edge * edge;
        }
        const long double s = !(along > 0) ? 0 : along < whole ? along / whole : 1;
        for (int k = 0; k < 3; ++k) {
            const long double x = p[k] - a[k] - s * ((long double)b[k] - a[k]);
            d += x * x;
        }
        if (d < best) best = d;
    }
    return (double)sqrtl(best);
}

/* The largest distance from a fine lattice on every triangle of a to all triangles of b. */
static double dense_distance(const shim_mesh* a, const shim_mesh* b) {
    enum { N = 11 };
    double most = 0;
    for (int32_t f = 0; f < a->faces; ++f)
        for (int i = 0; i <= N; ++i)
            for (int j = 0; i + j <= N; ++j) {
                long double p[3];
                for (int k = 0; k < 3; ++k)
                    p[k] = ((long double)i * a->positions[3 * a->corners[3 * f] + k] +
                            (long double)j * a->positions[3 * a->corners[3 * f + 1] + k] +
                            (long double)(N - i - j) * a->positions[3 * a->corners[3 * f + 2] + k]) /
                           N;
                double best = DBL_MAX;
                for (int32_t g = 0; g < b->faces; ++g) {
                    const double* const t[3] = {b->positions + 3 * b->corners[3 * g], b->positions + 3 * b->corners[3 * g + 1],
                                                b->positions + 3 * b->corners[3 * g + 2]};
                    const double d = reference_distance(p, t);
                    if (d < best) best = d;
                }
                if (best > most) most = best;
            }
    return most;
}

static void test_bound_holds_on_random_surfaces(void** state) {
    (void)state;
    static grid a, b;
    static const struct {
        double height, jitter, move;
        int cut, other_cut;
    } cases[] = {
        {0.1, 0.3, 0, 0, 1},     /* flipped edges */
        {0.001, 0.3, 0, 2, 1},   /* nearly flat */
        {0.1, 0.3, 1e-7, 0, 0},  /* nearly the same */
        {0.05, 0.2, 0.02, 2, 2}, /* moved */
        {0.5, 0.9, 0.3, 2, 2},   /* wild, folded over */
        {0, 0.4, 0.01, 0, 1},    /* flat against bumpy */
    };
    for (int i = 0; i < COUNT(cases); ++i) {
        make_grid(&a, 10 + (uint64_t)i, cases[i].height, cases[i].jitter, cases[i].cut);
        make_grid(&b, 10 + (uint64_t)i, cases[i].height, cases[i].jitter, cases[i].other_cut);
        for (int32_t j = 0; j < COUNT(b.points); ++j) b.points[j] += cases[i].move * random_unit();
        delmesh_distance_options options = defaults();
        options.samples = 500;
        const delmesh_distance_report r = distance_with(&a.mesh, &b.mesh, &options);
        const double ab = dense_distance(&a.mesh, &b.mesh), ba = dense_distance(&b.mesh, &a.mesh);
        assert_true(ab <= r.a_to_b_bound && ba <= r.b_to_a_bound);
        /* Tighter on request, and the two agree. */
        options.relative_error = 1e-3;
        const delmesh_distance_report tight = distance_with(&a.mesh, &b.mesh, &options);
        assert_true(ab <= tight.a_to_b_bound && ba <= tight.b_to_a_bound);
        assert_true(r.a_to_b_max <= tight.a_to_b_bound && tight.a_to_b_max <= r.a_to_b_bound);
        /* float32 has the same laws */
        a.mesh.f32 = b.mesh.f32 = 1;
        distance(&a.mesh, &b.mesh);
    }
}

static void test_distance_scales_exactly(void** state) {
    (void)state;
    static grid a, b;
    make_grid(&a, 20, 0.1, 0.3, 0);
    make_grid(&b, 20, 0.1, 0.3, 1);
    const delmesh_distance_report r = distance(&a.mesh, &b.mesh);
    static const int powers[] = {-900, -140, 77, 900};
    for (int i = 0; i < COUNT(powers); ++i) {
        const int k = powers[i];
        make_grid(&a, 20, 0.1, 0.3, 0);
        make_grid(&b, 20, 0.1, 0.3, 1);
        for (int32_t j = 0; j < COUNT(a.points); ++j) {
            a.points[j] = ldexp(a.points[j], k);
            b.points[j] = ldexp(b.points[j], k);
        }
        const delmesh_distance_report s = distance(&a.mesh, &b.mesh);
        assert_same(s.diagonal, ldexp(r.diagonal, k));
        assert_same(s.hausdorff_sampled, ldexp(r.hausdorff_sampled, k));
        assert_same(s.hausdorff_bound, ldexp(r.hausdorff_bound, k));
        assert_same(s.a_to_b_rms, ldexp(r.a_to_b_rms, k));
        assert_same(s.b_to_a_rms, ldexp(r.b_to_a_rms, k));
        assert_same(s.hausdorff_percent, r.hausdorff_percent);
        assert_same(s.normal_deviation_mean, r.normal_deviation_mean);
    }
}

/* 2^40 away from the origin a double has steps of 2^-12: points on the surfaces must not be rounded to them. */
static void test_distance_far_from_the_origin(void** state) {
    (void)state;
    static grid a, b;
    make_grid(&a, 30, 0.1, 0.3, 0);
    make_grid(&b, 30, 0.1, 0.3, 1);
    for (int32_t j = 0; j < COUNT(a.points); ++j) {
        a.points[j] = floor(ldexp(a.points[j], 12)) * 0x1p-12;
        b.points[j] = floor(ldexp(b.points[j] + 0.01 * random_unit(), 12)) * 0x1p-12;
    }
    const delmesh_distance_report r = distance(&a.mesh, &b.mesh);
    for (int sign = -1; sign <= 1; sign += 2) {
        for (int32_t j = 0; j < COUNT(a.points); ++j) {
            a.points[j] += sign * 0x1p40;
            b.points[j] += sign * 0x1p40;
        }
        const delmesh_distance_report s = distance(&a.mesh, &b.mesh);
        for (int32_t j = 0; j < COUNT(a.points); ++j) {
            a.points[j] -= sign * 0x1p40;
            b.points[j] -= sign * 0x1p40;
        }
        assert_near(s.diagonal, r.diagonal, 1e-14);
        /* the hierarchies differ, and so do the samples */
        assert_near(s.hausdorff_sampled, r.hausdorff_sampled, 1e-3 * r.hausdorff_sampled);
        assert_true(s.hausdorff_sampled <= r.hausdorff_bound && r.hausdorff_sampled <= s.hausdorff_bound);
        assert_near(s.rms, r.rms, 1e-3 * r.rms);
    }
}

static void test_threads_do_not_matter(void** state) {
    (void)state;
    static grid a, b;
    make_grid(&a, 40, 0.1, 0.3, 2);
    make_grid(&b, 41, 0.1, 0.3, 2);
    delmesh_distance_options options = defaults();
    delmesh_quality_report qualities[4];
    for (int few = 0; few < 2; ++few) {
        options.samples = few; /* with a single sample the search raises the lower bounds itself, in several blocks */
        delmesh_distance_report reports[4];
        for (int i = 0; i < 4; ++i) {
            shim_run run = {.threads = (int32_t[]){1, 2, 4, 0}[i]}; /* the host of 0 takes the blocks backwards */
            assert_int_equal(shim_measure_distance(&a.mesh, &b.mesh, &options, &run, &reports[i]), DELMESH_OK);
            reports[i].seconds = 0;
            assert_memory_equal(&reports[i], &reports[0], sizeof reports[0]);
            assert_int_equal(shim_measure_quality(&a.mesh, &run, &qualities[i]), DELMESH_OK);
            assert_memory_equal(&qualities[i], &qualities[0], sizeof qualities[0]);
        }
    }
}

/* ---- Interruptions ---- */

static void test_out_of_memory_at_every_allocation(void** state) {
    (void)state;
    static grid a, b;
    make_grid(&a, 50, 0.1, 0.3, 0);
    make_grid(&b, 50, 0.1, 0.3, 1);
    delmesh_distance_options options = defaults();
    options.samples = 100;
    delmesh_distance_report report;
    delmesh_quality_report q;
    int32_t status = DELMESH_ERROR_ALLOCATION_LIMIT;
    uint64_t limit = 1;
    for (; status != DELMESH_OK; ++limit) {
        shim_run run = {.threads = 2, .allocation_limit = limit};
        status = shim_measure_distance(&a.mesh, &b.mesh, &options, &run, &report);
        assert_true(status == DELMESH_OK || status == DELMESH_ERROR_ALLOCATION_LIMIT);
        assert_int_equal(run.leaked_bytes, 0);
    }
    assert_in_range(limit, 15, 200);
    status = DELMESH_ERROR_ALLOCATION_LIMIT;
    for (limit = 1; status != DELMESH_OK; ++limit) {
        shim_run run = {.threads = 1, .allocation_limit = limit};
        status = shim_measure_quality(&a.mesh, &run, &q);
        assert_true(status == DELMESH_OK || status == DELMESH_ERROR_ALLOCATION_LIMIT);
        assert_int_equal(run.leaked_bytes, 0);
    }
    assert_in_range(limit, 3, 20);
}

static void test_cancel_at_every_step(void** state) {
    (void)state;
    static grid a, b;
    make_grid(&a, 60, 0.1, 0.3, 0);
    make_grid(&b, 60, 0.1, 0.3, 1);
    const delmesh_distance_options options = defaults(); /* 100,000 samples: several slices */
    delmesh_distance_report report;
    shim_run run = {.threads = 0};
    assert_int_equal(shim_measure_distance(&a.mesh, &b.mesh, &options, &run, &report), DELMESH_OK);
    const int64_t loops = run.loops, calls = run.progress_calls;
    assert_true(loops >= 8 && calls >= 4);
    for (int64_t k = 1; k <= loops; ++k) {
        shim_run cancelled = {.threads = 0, .cancel_at_loop = k};
        assert_int_equal(shim_measure_distance(&a.mesh, &b.mesh, &options, &cancelled, &report), DELMESH_ERROR_CANCELLED);
        assert_int_equal(cancelled.loops, k); /* at once */
        assert_int_equal(cancelled.leaked_bytes, 0);
    }
    for (int64_t k = 1; k <= 4; ++k) { /* the stages; what comes between depends on the clock */
        shim_run cancelled = {.threads = 1, .cancel_at_progress = k};
        assert_int_equal(shim_measure_distance(&a.mesh, &b.mesh, &options, &cancelled, &report), DELMESH_ERROR_CANCELLED);
        assert_int_equal(cancelled.progress_calls, k);
        delmesh_quality_report q;
        cancelled = (shim_run){.threads = 1, .cancel_at_progress = 1 + k % 2};
        assert_int_equal(shim_measure_quality(&a.mesh, &cancelled, &q), DELMESH_ERROR_CANCELLED);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_quality_of_a_square),
        cmocka_unit_test(test_quality_counts),
        cmocka_unit_test(test_quality_without_faces),
        cmocka_unit_test(test_quality_scales_exactly),
        cmocka_unit_test(test_point_to_triangle),
        cmocka_unit_test(test_hierarchy_finds_the_closest),
        cmocka_unit_test(test_parallel_squares),
        cmocka_unit_test(test_a_surface_and_its_subdivision),
        cmocka_unit_test(test_shifted_cubes),
        cmocka_unit_test(test_one_direction_is_zero),
        cmocka_unit_test(test_the_bound_sees_what_samples_miss),
        cmocka_unit_test(test_midpoints_are_samples),
        cmocka_unit_test(test_rms_is_weighted_by_area),
        cmocka_unit_test(test_degenerate_faces),
        cmocka_unit_test(test_no_surface),
        cmocka_unit_test(test_bound_holds_on_random_surfaces),
        cmocka_unit_test(test_distance_scales_exactly),
        cmocka_unit_test(test_distance_far_from_the_origin),
        cmocka_unit_test(test_threads_do_not_matter),
        cmocka_unit_test(test_out_of_memory_at_every_allocation),
        cmocka_unit_test(test_cancel_at_every_step),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
