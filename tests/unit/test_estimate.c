/* SPDX-License-Identifier: Apache-2.0 */
/* The sample survey against the remesh that it foretells, and the report of where the vertices went, on generated meshes. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "mesh_makers.h"
#include "shim_estimate.h"

static const shim_sample kSampled = {0, 40, 32, 3}, kWhole = {1 << 30, 40, 32, 3};

static delmesh_remesh_options options_of(double tolerance, int32_t precision) {
    delmesh_remesh_options o;
    memset(&o, 0, sizeof o);
    o.struct_size = sizeof o;
    o.precision = precision;
    o.effort = 1;
    o.feature_angle = 30;
    o.max_normal_turn = -1;
    o.tolerance = tolerance;
    return o;
}

static shim_mesh* made(soup* s) {
    const delmesh_mesh_desc desc = desc_of_soup(s);
    shim_mesh* const m = shim_mesh_make(NULL, &desc, 0);
    assert_int_equal(shim_mesh_status(m), DELMESH_OK);
    free_soup(s);
    return m;
}

static delmesh_preserve_estimate estimate(const shim_mesh* m, const delmesh_remesh_options* o, shim_sample sample) {
    delmesh_preserve_estimate e;
    char error[512];
    const int32_t status = shim_estimate(m, NULL, o, &sample, &e, error);
    if (status != DELMESH_OK) fail_msg("status %d: %s", status, error);
    assert_string_equal(error, "");
    return e;
}

/* The sample's answer lies within `error` of the truth; returns how much the mesh grew. */
static double check_sample_of(shim_mesh* m, double tolerance, double error) {
    double growth = 0;
    for (int32_t precision = DELMESH_FLOAT32; precision <= DELMESH_FLOAT64; ++precision) {
        const delmesh_remesh_options o = options_of(tolerance, precision);
        delmesh_remesh_report truth;
        assert_int_equal(shim_preserve(m, &o, &truth), DELMESH_OK);
        const delmesh_preserve_estimate e = estimate(m, &o, kSampled);
        assert_int_equal(e.exact, 0);
        assert_int_equal(e.outcome, DELMESH_OK);
        assert_int_equal(e.nld_edges, truth.nld_in);
        assert_int_equal(e.vertices_in, truth.vertices_in);
        assert_true(e.sampled_edges > 0 && e.sampled_edges <= 40 * 32);
        assert_true(e.faces_run > 0 && e.faces_run <= truth.faces_in / 2);
        assert_true(fabs(e.growth - (double)e.vertices_out / (double)e.vertices_in) < 1e-12);
        const double off = (double)e.vertices_out / (double)truth.vertices_out - 1;
        const double share = e.deviation / (double)e.vertices_out;
        print_message("    %lld faces, growth %.3f: off by %+.1f %%, deviation %.1f %%, %lld faces run\n",
                      (long long)truth.faces_in, (double)truth.vertices_out / (double)truth.vertices_in, 100 * off, 100 * share,
                      (long long)e.faces_run);
        assert_true(fabs(off) <= error);
        assert_true(fabs(off) <= 4 * share + 0.05); /* what it says about its own error is not far from it */
        growth = (double)truth.vertices_out / (double)truth.vertices_in;
    }
    shim_mesh_free(m);
    return growth;
}
static void check_sample(soup s, double tolerance, double error) {
    check_sample_of(made(&s), tolerance, error);
}

static void samples_of_even_meshes(void** state) {
    (void)state;
    check_sample(torus(220, 120, 0.02, 1), -1, 0.05);
    check_sample(sheet(180, 120, 1, 0.3, 2), -1, 0.05); /* with a boundary */
}

static void samples_of_needles(void** state) {
    (void)state;
    check_sample(torus(300, 200, 0.01, 3), -1, 0.15);
    check_sample(sheet(500, 90, 0.1, 0.03, 4), -1, 0.1);
}

/* Nearly all vertices go to a few needles in an even mesh, which a sample that did not look for them would miss. */
static void needles_are_found(void** state) {
    (void)state;
    soup s = torus(220, 120, 0.001, 5);
    for (int32_t i = 0; i < 12; ++i) { /* an end of an edge is moved next to the other */
        const int32_t v = (7 + 17 * i) * 120 + 11 + 8 * i, w = v + 1;
        double p[3];
        for (int k = 0; k < 3; ++k)
            p[k] = s.points[3 * w + k] + (i % 2 == 0 ? 2e-5 : 5e-5) * (s.points[3 * v + k] - s.points[3 * w + k]);
        set_point(&s, v, p[0], p[1], p[2]);
    }
    check_sample(s, 0, 0.2);
}

/* Pyramids side by side, whose slopes are flat places of 2 x 2 squares, each with its middle vertex moved about in it. */
static soup pyramids(int32_t n, uint64_t seed) {
    soup s = sheet(2 * n, 2 * n, 1, 0, seed);
    for (int32_t i = 0, v = 0; i <= 2 * n; ++i)
        for (int32_t j = 0; j <= 2 * n; ++j, ++v) {
            const double inside = i % 2 && j % 2 ? 1 : 0;
            const double along = 1.3 * (random_unit(&seed) - 0.5), across = 0.5 * (random_unit(&seed) - 0.5);
            const double x = i + inside * (along + across), y = j + inside * (along - across);
            set_point(&s, v, x, y, 0.5 * fabs(fmod(x, 4) - 2) + 0.5 * fabs(fmod(y, 4) - 2));
        }
    return s;
}

/* A texture that would move holds up the flips in flat places, in the sample as in the mesh. */
static void textures_count(void** state) {
    (void)state;
    soup s = pyramids(100, 18);
    const double bare = check_sample_of(made(&s), 1e-4, 0.1);

    s = pyramids(100, 18);
    delmesh_mesh_desc desc = desc_of_soup(&s);
    const int64_t corners = 3 * (int64_t)s.faces;
    double* const uv = malloc((size_t)(2 * corners) * sizeof *uv);
    assert_non_null(uv);
    for (int64_t c = 0; c < corners; ++c)
        for (int k = 0; k < 2; ++k) { /* one value per vertex, and no affine map anywhere */
            uint64_t seed = 2 * (uint64_t)s.corners[c] + (uint64_t)k + 1;
            random_unit(&seed);
            uv[2 * c + k] = random_unit(&seed);
        }
    delmesh_layer layer;
    memset(&layer, 0, sizeof layer);
    layer.struct_size = sizeof layer;
    layer.kind = DELMESH_LAYER_UV;
    layer.border = DELMESH_BORDER_KEEP;
    layer.affine_tolerance = 1e-5;
    layer.values.data = uv;
    layer.values.count = corners;
    layer.values.stride = 2 * sizeof(double);
    layer.values.components = 2;
    layer.values.type = DELMESH_FLOAT64;
    desc.layers = &layer;
    desc.layer_count = 1;
    shim_mesh* const m = shim_mesh_make(NULL, &desc, 0);
    assert_int_equal(shim_mesh_status(m), DELMESH_OK);
    free_soup(&s);
    free(uv);
    assert_true(check_sample_of(m, 1e-4, 0.1) > bare + 0.2);
}

static void small_meshes_are_run(void** state) {
    (void)state;
    soup s = torus(30, 20, 0.1, 6);
    shim_mesh* const m = made(&s);
    delmesh_remesh_options o = options_of(-1, DELMESH_FLOAT32);
    delmesh_remesh_report truth;
    assert_int_equal(shim_preserve(m, &o, &truth), DELMESH_OK);
    o.mode = DELMESH_MODE_FLIP; /* does not matter */
    const delmesh_preserve_estimate e = estimate(m, &o, kWhole);
    assert_int_equal(e.exact, 1);
    assert_true(truth.vertices_out > truth.vertices_in);
    assert_int_equal(e.vertices_out, truth.vertices_out);
    assert_int_equal(e.nld_edges, truth.nld_in);
    assert_int_equal(e.sampled_edges, truth.nld_in);
    assert_int_equal(e.faces_run, truth.faces_in);
    assert_true(e.deviation == 0);
    o.effort = 3; /* is estimated by effort 1 */
    assert_int_equal(estimate(m, &o, kWhole).exact, 0);
    o.effort = 1;
    o.max_vertices = truth.vertices_in + 3;
    const delmesh_preserve_estimate stopped = estimate(m, &o, kWhole);
    assert_int_equal(stopped.outcome, DELMESH_ERROR_VERTEX_LIMIT);
    assert_true(stopped.vertices_out <= truth.vertices_in + 3);
    shim_mesh_free(m);
}

/* Where a sample would be no less work than the mesh, the mesh is run: here everything hangs together through flat places. */
static void flat_meshes_are_run(void** state) {
    (void)state;
    soup s = sheet(100, 100, 1, 0, 7);
    uint64_t seed = 8;
    for (int32_t v = 0; v < s.vertices; ++v)
        set_point(&s, v, s.points[3 * v] + 0.25 * random_unit(&seed), s.points[3 * v + 1] + 0.25 * random_unit(&seed), 0);
    shim_mesh* const m = made(&s);
    const delmesh_remesh_options o = options_of(-1, DELMESH_FLOAT32);
    assert_int_equal(estimate(m, &o, kSampled).exact, 1);
    shim_mesh_free(m);
}

static void a_large_sample_is_no_sample(void** state) {
    (void)state;
    soup s = torus(120, 90, 0.01, 9);
    shim_mesh* const m = made(&s);
    const delmesh_remesh_options o = options_of(-1, DELMESH_FLOAT32);
    const delmesh_preserve_estimate drawn = estimate(m, &o, (shim_sample){0, 10, 16, 4});
    assert_true(drawn.deviation > 0);
    assert_int_equal(drawn.exact, 0);
    const delmesh_preserve_estimate all = estimate(m, &o, (shim_sample){0, 100000, 16, 4});
    assert_int_equal(all.exact, 1); /* would be more work than the mesh */
    shim_mesh_free(m);
}

static void same_answer_on_any_threads(void** state) {
    (void)state;
    soup s = torus(200, 100, 0.02, 10);
    shim_mesh* const m = made(&s);
    const delmesh_remesh_options o = options_of(-1, DELMESH_FLOAT32);
    delmesh_preserve_estimate e[2];
    char error[512];
    for (int i = 0; i < 2; ++i) {
        delmesh_context_options context;
        memset(&context, 0, sizeof context);
        context.max_threads = i == 0 ? 1 : 3;
        assert_int_equal(shim_estimate(m, &context, &o, &kSampled, &e[i], error), DELMESH_OK);
    }
    assert_memory_equal(&e[0], &e[1], sizeof e[0]);
    shim_mesh_free(m);
}

/* A mesh that has no Delaunay edge to speak of costs one look. */
static void nothing_to_do(void** state) {
    (void)state;
    soup s = torus(200, 66, 0, 11);
    shim_mesh* const m = made(&s);
    delmesh_remesh_options o = options_of(-1, DELMESH_FLOAT32);
    const delmesh_preserve_estimate e = estimate(m, &o, kSampled);
    if (e.nld_edges == 0) {
        assert_int_equal(e.faces_run, 0);
        assert_int_equal(e.vertices_out, e.vertices_in);
    }
    shim_mesh_free(m);
}

typedef struct Calls {
    int64_t count, cancel_at;
    double last;
    int falls;
} Calls;
static int32_t on_progress(void* user, double fraction, const char* stage) {
    Calls* const calls = user;
    (void)stage;
    calls->falls += fraction < calls->last;
    calls->last = fraction;
    return ++calls->count == calls->cancel_at ? 0 : DELMESH_CONTINUE;
}

static void fails_at_every_step(void** state) {
    (void)state;
    soup s = torus(120, 60, 0.02, 12);
    shim_mesh* const m = made(&s);
    const delmesh_remesh_options o = options_of(-1, DELMESH_FLOAT32);
    const shim_sample sample = {0, 6, 8, 3};
    delmesh_preserve_estimate e;
    char error[512];
    delmesh_context_options context;
    memset(&context, 0, sizeof context);
    int64_t limit = 0;
    for (int32_t status = 1; status != DELMESH_OK; limit += 1 + limit / 8) {
        context.allocation_limit = (uint64_t)limit + 1;
        status = shim_estimate(m, &context, &o, &sample, &e, error);
        assert_true(status == DELMESH_OK || status == DELMESH_ERROR_ALLOCATION_LIMIT);
    }
    assert_true(limit > 30);
    context.allocation_limit = 0;
    Calls calls = {0, 0, 0, 0};
    context.user = &calls;
    context.progress = on_progress;
    assert_int_equal(shim_estimate(m, &context, &o, &sample, &e, error), DELMESH_OK);
    assert_true(calls.count > 6 && calls.falls == 0 && calls.last > 0.9);
    const int64_t all = calls.count;
    for (int64_t k = 1; k <= all; ++k) {
        calls = (Calls){0, k, 0, 0};
        const int32_t status = shim_estimate(m, &context, &o, &sample, &e, error);
        assert_true(status == DELMESH_ERROR_CANCELLED || calls.count < k); /* how often it is told depends on the clock */
        assert_true(status == DELMESH_OK || error[0] != 0);
    }
    shim_mesh_free(m);
}

/* ---- Where the vertices went */

static int64_t sum_of(const delmesh_remesh_report* r) {
    return r->split_on_boundary + r->split_on_kept + r->split_crowded + r->split_on_caps + r->split_at_small_angles +
           r->split_on_flipped + r->split_elsewhere + r->split_merged;
}

static delmesh_remesh_report where_of(soup s, int32_t mode, int32_t boundary) {
    shim_mesh* const m = made(&s);
    delmesh_remesh_options o = options_of(-1, DELMESH_FLOAT32);
    o.mode = mode;
    o.boundary = boundary;
    delmesh_remesh_report r;
    assert_int_equal(shim_preserve(m, &o, &r), DELMESH_OK);
    assert_int_equal(sum_of(&r), r.splits);
    shim_mesh_free(m);
    return r;
}

static delmesh_remesh_report where(soup s, int32_t mode) {
    return where_of(s, mode, DELMESH_BOUNDARY_NONOBTUSE);
}

static void two_faces(soup* s, double height, double depth) {
    *s = soup_of(4, 2);
    set_point(s, 0, -1, 0, 0);
    set_point(s, 1, 1, 0, 0);
    set_point(s, 2, 0, height, 0);
    set_point(s, 3, 0, 0, -depth);
    set_face(s, 0, 0, 1, 2);
    set_face(s, 1, 1, 0, 3);
}

static void every_cause_has_its_count(void** state) {
    (void)state;
    soup s;
    two_faces(&s, 0.1, 1.5); /* a cap over a bent edge */
    delmesh_remesh_report r = where_of(s, DELMESH_MODE_PRESERVE, DELMESH_BOUNDARY_IGNORE);
    assert_true(r.splits > 0);
    assert_int_equal(r.split_on_caps, r.splits);
    assert_int_equal(r.worst_edge_from, 0);
    assert_int_equal(r.worst_edge_to, 1);
    assert_int_equal(r.worst_edge_splits, r.splits);
    assert_int_equal(r.worst_face, 0);
    assert_int_equal(r.worst_face_splits, r.splits);

    s = soup_of(3, 1); /* one obtuse corner */
    set_point(&s, 0, 0, 0, 0);
    set_point(&s, 1, 4, 0, 0);
    set_point(&s, 2, 1, 1, 0);
    set_face(&s, 0, 0, 1, 2);
    r = where(s, DELMESH_MODE_PRESERVE);
    assert_true(r.splits > 0);
    assert_int_equal(r.split_on_boundary, r.splits);
    assert_int_equal(r.worst_face_splits, r.splits);
    assert_true(r.worst_edge_splits > 0);

    r = where(torus(60, 40, 0.15, 13), DELMESH_MODE_PRESERVE);
    assert_true(r.split_elsewhere > 0 && r.split_at_small_angles > 0);
    assert_int_equal(r.split_on_boundary, 0);
    r = where(torus(30, 120, 0.01, 14), DELMESH_MODE_PRESERVE);
    assert_true(r.split_at_small_angles > r.splits / 2);
    r = where(torus(40, 30, 0.1, 15), DELMESH_MODE_FEATURE);
    assert_int_equal(r.split_on_kept, r.kept_splits);
    r = where(book(3, 12, 0.2, 16), DELMESH_MODE_PRESERVE);
    assert_int_equal(r.split_on_boundary, r.boundary_splits);
    r = where(torus(40, 30, 0, 17), DELMESH_MODE_FLIP);
    assert_int_equal(r.splits, 0);
    assert_int_equal(r.worst_edge_splits, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_of_even_meshes),
        cmocka_unit_test(samples_of_needles),
        cmocka_unit_test(needles_are_found),
        cmocka_unit_test(textures_count),
        cmocka_unit_test(small_meshes_are_run),
        cmocka_unit_test(flat_meshes_are_run),
        cmocka_unit_test(a_large_sample_is_no_sample),
        cmocka_unit_test(same_answer_on_any_threads),
        cmocka_unit_test(nothing_to_do),
        cmocka_unit_test(fails_at_every_step),
        cmocka_unit_test(every_cause_has_its_count),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
