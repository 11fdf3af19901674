/* SPDX-License-Identifier: Apache-2.0 */
/* The guard of deviation targets: exact answers on meshes where the distance is known, and the law over random edits that another
 * measurement never finds more than the limit. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "mesh_makers.h"
#include "shim_deviation.h"

static shim_mesh* mesh_of(const soup* s) {
    const delmesh_mesh_desc desc = desc_of_soup(s);
    shim_mesh* const mesh = shim_mesh_make(NULL, &desc, 0);
    assert_int_equal(shim_mesh_status(mesh), DELMESH_OK);
    return mesh;
}

/* The corner of the edge from a to b, -1 if there is none. */
static int32_t corner_of(const shim_guarded* g, int32_t a, int32_t b) {
    for (int32_t c = 0; c < shim_guarded_corners(g); ++c)
        if (shim_guarded_vert(g, c) == a && shim_guarded_vert(g, c - c % 3 + (c + 1) % 3) == b) return c;
    return -1;
}

/* Collapses the edge a b to the point at t of its way. */
static int32_t collapse(shim_guarded* g, int32_t corner, double t) {
    double a[3], b[3];
    shim_guarded_at(g, shim_guarded_vert(g, corner), a);
    shim_guarded_at(g, shim_guarded_vert(g, corner - corner % 3 + (corner + 1) % 3), b);
    return shim_guarded_collapse(g, corner, a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2]));
}

/* ---- exact answers --------------------------------------------------------------------------------------------------------- */

/* All interior vertices of a flat sheet can go, and those on its straight borders, at next to no distance; its corners cannot. */
static void flat_sheet(void** state) {
    (void)state;
    const int32_t n = 8;
    soup s = sheet(n, n, 1, 0, 1);
    shim_mesh* const mesh = mesh_of(&s);
    shim_guarded* const g = shim_guarded_make(mesh, DELMESH_FLOAT64);
    assert_int_equal(shim_guarded_begin(g, 1e-9), 1);
    for (int32_t i = 1; i < n; ++i)
        for (int32_t j = 1; j < n; ++j) { /* into the row's neighbour, down to the border */
            const int32_t v = i * (n + 1) + j, c = corner_of(g, i * (n + 1), v);
            assert_true(c >= 0);
            assert_int_equal(collapse(g, c, 0), 1);
        }
    assert_int_equal(shim_guarded_faces(g), 4 * n - 2);
    for (int32_t i = 2; i < n - 1; ++i) { /* the left border, one after the other into its first that is not a corner */
        const int32_t a = n + 1, b = i * (n + 1), c = corner_of(g, a, b) >= 0 ? corner_of(g, a, b) : corner_of(g, b, a);
        assert_true(c >= 0);
        assert_int_equal(collapse(g, c, shim_guarded_vert(g, c) == a ? 0 : 1), 1);
    }
    const int32_t corner = corner_of(g, n, n - 1) >= 0 ? corner_of(g, n, n - 1) : corner_of(g, n - 1, n);
    assert_true(corner >= 0);
    assert_int_equal(collapse(g, corner, shim_guarded_vert(g, corner) == n ? 1 : 0), 0);
    shim_guarded_free(g);
    shim_mesh_free(mesh);
    free_soup(&s);
}

/* A pyramid of height h without its base, wherever it lies and however large: its apex can go iff h is within the limit. */
static void pyramid(void** state) {
    (void)state;
    static const double heights[] = {0.01, 0.25, 1}, scales[] = {1, 0x1p-60, 0x1p200}, offsets[] = {0, 1024, -4097};
    for (int h = 0; h < 3; ++h)
        for (int k = 0; k < 9; ++k) {
            const double height = heights[h], scale = scales[k % 3], offset = offsets[k / 3];
            soup s = soup_of(5, 4);
            for (int32_t v = 0; v < 5; ++v) {
                double* const p = s.points + 3 * v;
                p[0] = scale * (offset + (v == 0 ? 0 : v == 1 || v == 4 ? 1 : -1));
                p[1] = scale * (offset + (v == 0 ? 0 : v <= 2 ? 1 : -1));
                p[2] = v == 0 ? scale * height : 0;
            }
            for (int32_t f = 0; f < 4; ++f) set_face(&s, f, 0, f + 1, (f + 1) % 4 + 1);
            shim_mesh* const mesh = mesh_of(&s);
            for (int allowed = 0; allowed < 2; ++allowed) {
                shim_guarded* const g = shim_guarded_make(mesh, DELMESH_FLOAT64);
                assert_int_equal(shim_guarded_begin(g, scale * height * (allowed ? 1 + 1e-10 : 1 - 1e-10)), 1);
                const int32_t c = corner_of(g, 1, 0);
                assert_int_equal(collapse(g, c, 0), allowed);
                assert_int_equal(shim_guarded_faces(g), allowed ? 2 : 4);
                shim_guarded_free(g);
            }
            shim_mesh_free(mesh);
            free_soup(&s);
        }
}

/* Both ways: a vertex that sticks out of a flat sheet is seen from the surface, one that is missing from the input. */
static void begin_tells_distance(void** state) {
    (void)state;
    for (int side = 0; side < 2; ++side) {
        soup s = sheet(6, 6, 1, 0, 1);
        if (side == 0) s.points[3 * 24 + 2] = 0.125;
        shim_mesh* const mesh = mesh_of(&s);
        shim_guarded* const g = shim_guarded_make(mesh, DELMESH_FLOAT64);
        assert_int_equal(shim_guarded_begin(g, 1e-10), 1);
        shim_guarded_move(g, 24, s.points[3 * 24], s.points[3 * 24 + 1], side == 0 ? 0 : 0.125);
        assert_int_equal(shim_guarded_begin(g, 0.125 * (1 - 1e-10)), 0);
        assert_int_equal(shim_guarded_begin(g, 0.125 * (1 + 1e-10)), 1);
        assert_int_equal(shim_guarded_begin(g, 0), 0);
        assert_int_equal(shim_guarded_begin(g, 1e300), 1);
        assert_int_equal(shim_guarded_is_beyond(g, 0, 3, 3, 1e9), 1);
        assert_int_equal(shim_guarded_begin(g, 0.125 * (1 + 1e-10)), 1);
        assert_int_equal(shim_guarded_is_beyond(g, 0, 1.5, 1.25, 0.12), 0);
        assert_int_equal(shim_guarded_is_beyond(g, 0, 1.5, 1.25, 0.13), 1);
        shim_guarded_free(g);
        shim_mesh_free(mesh);
        free_soup(&s);
    }
}

/* Faces without area, vertices at one place and vertices without faces. */
static void degenerate_input(void** state) {
    (void)state;
    soup s = sheet(6, 6, 1, 0, 1);
    memcpy(s.points + 3 * 17, s.points + 3 * 18, 3 * sizeof(double)); /* two vertices at one place */
    memcpy(s.points + 3 * 31, s.points + 3 * 30, 3 * sizeof(double));
    for (int k = 0; k < 3; ++k) s.corners[3 * 50 + k] = s.corners[3 * 49]; /* no face at all: import leaves it out */
    soup more = soup_of(s.vertices + 2, s.faces);
    memcpy(more.points, s.points, (size_t)s.vertices * 3 * sizeof(double));
    memcpy(more.corners, s.corners, (size_t)s.faces * 3 * sizeof(int32_t));
    set_point(&more, s.vertices, 1e6, 0, 0); /* not used */
    shim_mesh* const mesh = mesh_of(&more);
    shim_guarded* const g = shim_guarded_make(mesh, DELMESH_FLOAT32);
    assert_int_equal(shim_guarded_begin(g, 1e-9), 1);
    const int32_t before = (int32_t)shim_guarded_faces(g);
    const int32_t c = corner_of(g, 17, 18);
    assert_true(c >= 0);
    assert_int_equal(collapse(g, c, 0), 1);
    assert_int_equal(shim_guarded_faces(g), before - 2);
    shim_guarded_free(g);
    shim_mesh_free(mesh);
    free_soup(&s);
    free_soup(&more);
}

/* ---- laws ------------------------------------------------------------------------------------------------------------------ */

/* Random collapses and flips, as many as the guard lets through. With `other`, each one that it lets through is made there too:
 * were a refusal to leave a trace in the books, the two would come to differ. */
static void random_edits(shim_guarded* g, shim_guarded* other, int32_t steps, uint64_t seed, int64_t* done, int64_t* refused) {
    *done = *refused = 0;
    for (int32_t i = 0; i < steps; ++i) {
        const int32_t c = random_below(&seed, shim_guarded_corners(g)), kind = random_below(&seed, 8);
        const double t = 0.5 * random_below(&seed, 3);
        if (shim_guarded_vert(g, c) < 0) continue;
        const int32_t answer = kind == 0 ? shim_guarded_flip(g, c) : collapse(g, c, t);
        *done += answer == 1;
        *refused += answer == 0;
        if (answer == 1 && other != NULL) assert_int_equal(kind == 0 ? shim_guarded_flip(other, c) : collapse(other, c, t), 1);
    }
}

static void never_farther(void** state) {
    (void)state;
    static const double limits[] = {0.01, 0.05, 0.2, 0.6};
    for (int shape = 0; shape < 4; ++shape)
        for (int k = 0; k < 4; ++k) {
            soup s = shape == 0   ? torus(40, 24, 0.02, 5)
                     : shape == 1 ? sheet(24, 24, 1, 0.2, 6)
                     : shape == 2 ? sheet(20, 20, 7, 0.05, 7)
                                  : book(3, 10, 0.1, 8);
            shim_mesh* const mesh = mesh_of(&s);
            shim_guarded* const g = shim_guarded_make(mesh, DELMESH_FLOAT32);
            assert_int_equal(shim_guarded_begin(g, limits[k]), 1);
            int64_t done, refused;
            random_edits(g, NULL, 6000, (uint64_t)(17 * shape + k), &done, &refused);
            assert_true(done > 20 && refused > 20);
            delmesh_distance_report report;
            assert_int_equal(shim_guarded_measure(g, 1e-4, &report), DELMESH_OK);
            if (!(report.hausdorff_sampled <= limits[k]) || !(report.hausdorff_bound <= limits[k] + 1.1e-6 * report.diagonal))
                fail_msg("shape %d, limit %g: sampled %.17g, bound %.17g", shape, limits[k], report.hausdorff_sampled,
                         report.hausdorff_bound);
            assert_true(report.hausdorff_bound > 0.5 * limits[k]); /* the limit is used */
            /* The next level may go farther. */
            assert_int_equal(shim_guarded_begin(g, 2 * limits[k]), 1);
            random_edits(g, NULL, 3000, (uint64_t)(31 * shape + k), &done, &refused);
            assert_true(done > 0);
            assert_int_equal(shim_guarded_measure(g, 1e-4, &report), DELMESH_OK);
            assert_true(report.hausdorff_sampled <= 2 * limits[k]);
            assert_true(report.hausdorff_bound <= 2 * limits[k] + 1.1e-6 * report.diagonal);
            shim_guarded_free(g);
            shim_mesh_free(mesh);
            free_soup(&s);
        }
}

static void refusals_leave_no_trace(void** state) {
    (void)state;
    soup s = torus(30, 20, 0.02, 9);
    shim_mesh* const mesh = mesh_of(&s);
    shim_guarded* const g = shim_guarded_make(mesh, DELMESH_FLOAT32);
    shim_guarded* const other = shim_guarded_make(mesh, DELMESH_FLOAT32);
    assert_int_equal(shim_guarded_begin(g, 0.1), 1);
    assert_int_equal(shim_guarded_begin(other, 0.1), 1);
    int64_t done, refused;
    random_edits(g, other, 6000, 3, &done, &refused);
    assert_true(done > 100 && refused > 100);
    assert_int_equal(shim_guarded_faces(g), shim_guarded_faces(other));
    for (int32_t c = 0; c < shim_guarded_corners(g); ++c) assert_int_equal(shim_guarded_vert(g, c), shim_guarded_vert(other, c));
    shim_guarded_free(g);
    shim_guarded_free(other);
    shim_mesh_free(mesh);
    free_soup(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flat_sheet),       cmocka_unit_test(pyramid),       cmocka_unit_test(begin_tells_distance),
        cmocka_unit_test(degenerate_input), cmocka_unit_test(never_farther), cmocka_unit_test(refusals_leave_no_trace),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
