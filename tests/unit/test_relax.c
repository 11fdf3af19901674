/* SPDX-License-Identifier: Apache-2.0 */
/* Relaxation below the ABI: levels whose best places are known, then what holds for every level, on generated ones: Delaunay
 * throughout, never farther from the input, nothing moves that may not, the same bytes for any number of threads. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "mesh_makers.h"
#include "shim_relax.h"

/* A host whose n-th allocation fails, or whose n-th report is answered with a cancel, once it is armed. */
typedef struct host {
    int64_t allocations, fail_at, reports, cancel_at;
    int32_t pool, cancel_in_pool, loops;
    shim_mesh* mesh;
} host;
static void* host_alloc(void* user, uint64_t size, uint64_t align) {
    host* const h = user;
    if (++h->allocations == h->fail_at) return NULL;
    return aligned_alloc(align, (size + align - 1) / align * align);
}
static void host_free(void* user, void* p, uint64_t size) {
    (void)user, (void)size;
    free(p);
}
static int32_t host_progress(void* user, double fraction, const char* stage) {
    host* const h = user;
    assert_true(fraction >= 0 && fraction <= 1 && stage != NULL);
    return ++h->reports == h->cancel_at ? !DELMESH_CONTINUE : DELMESH_CONTINUE;
}
static void host_parallel_for(void* user, int32_t count, delmesh_task_fn task, void* data) { /* backwards */
    host* const h = user;
    const int cancel = ++h->loops == h->cancel_in_pool;
    for (int32_t i = count - 1; i >= 0; --i) {
        if (cancel && i == count / 2) shim_mesh_cancel(h->mesh);
        task(data, i);
    }
}

static shim_mesh* made(const soup* s) {
    const delmesh_mesh_desc desc = desc_of_soup(s);
    shim_mesh* const m = shim_mesh_make(NULL, &desc, 0);
    assert_int_equal(shim_mesh_status(m), DELMESH_OK);
    return m;
}

/* The soup made Delaunay by flips, without a vertex more where the boundary rule asks for none. */
static shim_mesh* level_with(const soup* s, const delmesh_context_options* context, int32_t precision, int32_t boundary) {
    delmesh_remesh_options o;
    memset(&o, 0, sizeof o);
    o.struct_size = sizeof o;
    o.mode = DELMESH_MODE_FLIP;
    o.precision = precision;
    o.boundary = boundary;
    o.feature_angle = 30;
    o.max_normal_turn = o.tolerance = -1;
    shim_mesh* const coarse = made(s);
    shim_mesh* const level = shim_mesh_blank(context);
    delmesh_remesh_report report;
    shim_remesh_into(level, coarse, &o, &report);
    assert_int_equal(shim_mesh_status(level), DELMESH_OK);
    shim_mesh_free(coarse);
    return level;
}
static shim_mesh* level_of(const soup* s, int32_t threads) {
    delmesh_context_options context;
    memset(&context, 0, sizeof context);
    context.struct_size = sizeof context;
    context.max_threads = threads;
    return level_with(s, &context, DELMESH_FLOAT32, DELMESH_BOUNDARY_IGNORE);
}
static shim_relax_rules inner_rules(void) { /* without the boundary rule, as the levels above */
    shim_relax_rules rules = shim_relax_defaults();
    rules.boundary_rule = 0;
    return rules;
}

typedef struct points {
    double* xyz;
    int32_t count;
} points;
static points points_of(shim_mesh* m) {
    const shim_arrays a = shim_mesh_arrays(m);
    const points p = {malloc((size_t)a.vertices * 3 * sizeof(double)), a.vertices};
    for (int64_t i = 0; i < 3 * (int64_t)a.vertices; ++i) p.xyz[i] = a.pos32_size != 0 ? (double)a.pos32[i] : a.pos64[i];
    return p;
}
static int is_same_point(const points* a, const points* b, int32_t v) {
    return memcmp(a->xyz + 3 * v, b->xyz + 3 * v, 3 * sizeof(double)) == 0;
}
static int32_t moved_between(const points* a, const points* b) {
    int32_t moved = 0;
    assert_int_equal(a->count, b->count);
    for (int32_t v = 0; v < a->count; ++v) moved += !is_same_point(a, b, v);
    return moved;
}

static void check_delaunay(shim_mesh* level, int32_t boundary_rule) {
    const shim_certificate c = shim_scan_all(level, boundary_rule);
    assert_int_equal(c.nld_interior, 0);
    assert_int_equal(c.nld_boundary, 0);
    assert_int_equal(c.zero_area_faces, 0);
    assert_int_equal(shim_certify(level, boundary_rule, 0).delaunay, 1);
}

/* Relaxes, and checks what holds always. */
static int64_t relaxed(shim_mesh* level, const shim_mesh* in, const shim_relax_rules* rules, const uint8_t* stays) {
    const shim_arrays before = shim_mesh_arrays(level);
    int32_t* const verts = malloc((size_t)before.corners * 2 * sizeof(int32_t));
    memcpy(verts, before.corner_vert, (size_t)before.corners * sizeof(int32_t));
    memcpy(verts + before.corners, before.corner_twin, (size_t)before.corners * sizeof(int32_t));
    points old = points_of(level);
    const uint64_t bytes = shim_bytes_alive(level);
    const int64_t moved = shim_relax(level, in, rules, stays);
    if (shim_mesh_status(level) != DELMESH_OK) fail_msg("status %d: %s", shim_mesh_status(level), shim_mesh_error(level));
    assert_int_equal(shim_bytes_alive(level), bytes);
    const shim_arrays after = shim_mesh_arrays(level);
    assert_memory_equal(verts, after.corner_vert, (size_t)before.corners * sizeof(int32_t));
    assert_memory_equal(verts + before.corners, after.corner_twin, (size_t)before.corners * sizeof(int32_t));
    assert_int_equal(shim_mesh_validate(level), DELMESH_OK);
    points now = points_of(level);
    assert_int_equal(moved_between(&old, &now), moved);
    for (int32_t v = 0; stays != NULL && v < now.count; ++v) assert_true(stays[v] == 0 || is_same_point(&old, &now, v));
    check_delaunay(level, rules->boundary_rule);
    free(old.xyz), free(now.xyz), free(verts);
    return moved;
}

static void scale_soup(soup* s, double x, double y, double z) {
    for (int32_t v = 0; v < s->vertices; ++v) {
        const double* p = s->points + 3 * v;
        set_point(s, v, x * p[0], y * p[1], z * p[2]);
    }
}

/* A flat level of a flat input fits already: nothing moves, at either precision. */
static void test_flat_stays(void** state) {
    (void)state;
    soup fine = sheet(17, 13, 1, 0, 1), coarse = sheet(5, 4, 1, 0, 1);
    scale_soup(&coarse, 17.0 / 5, 13.0 / 4, 0);
    shim_mesh* const in = made(&fine);
    for (int32_t precision = DELMESH_FLOAT32; precision <= DELMESH_FLOAT64; ++precision) {
        delmesh_context_options context;
        memset(&context, 0, sizeof context);
        shim_mesh* const level = level_with(&coarse, &context, precision, DELMESH_BOUNDARY_IGNORE);
        shim_relax_rules rules = inner_rules();
        rules.precision = precision;
        relaxed(level, in, &rules, NULL);
        points now = points_of(level);
        for (int32_t v = 0; v < now.count; ++v) assert_true(now.xyz[3 * v + 2] == 0);
        assert_true(shim_distance(level, in).hausdorff_sampled < 1e-6);
        free(now.xyz);
        shim_mesh_free(level);
    }
    shim_mesh_free(in);
    free_soup(&fine), free_soup(&coarse);
}

/* One vertex is off the surface: it comes back, and nobody else goes far. */
static void test_pushed_vertex_returns(void** state) {
    (void)state;
    soup fine = sheet(24, 24, 1, 0, 1), coarse = sheet(6, 6, 1, 0.1, 1); /* irregular: no ties */
    scale_soup(&coarse, 4, 4, 0);
    const int32_t pushed = 3 * 7 + 3;
    coarse.points[3 * pushed + 2] = 1;
    shim_mesh* const in = made(&fine);
    shim_mesh* const level = level_of(&coarse, 1);
    const shim_relax_rules rules = inner_rules();
    const double before = shim_distance(level, in).rms;
    assert_true(relaxed(level, in, &rules, NULL) > 0);
    points now = points_of(level);
    assert_true(fabs(now.xyz[3 * pushed + 2]) < 1e-3);
    assert_true(shim_distance(level, in).rms < 0.01 * before);
    free(now.xyz);
    shim_mesh_free(level), shim_mesh_free(in);
    free_soup(&fine), free_soup(&coarse);
}

/* Two slopes that meet in a ridge; the level's ridge is bent up and down. */
static soup roof(int32_t nx, int32_t ny, double width, double height, double bend) {
    soup s = sheet(nx, ny, 1, 0, 1);
    scale_soup(&s, width / nx, height / ny, 0);
    for (int32_t i = 0; i <= nx; ++i)
        for (int32_t j = 0; j <= ny; ++j) {
            double* const p = s.points + 3 * (i * (ny + 1) + j);
            p[2] = width / 2 - fabs(p[0] - width / 2);
            if (2 * i == nx && j > 0 && j < ny) p[2] += j % 2 == 0 ? bend : -bend;
        }
    return s;
}
static int32_t ridge(int32_t nx, int32_t ny, int32_t j) {
    return nx / 2 * (ny + 1) + j;
}

static void test_creases(void** state) {
    (void)state;
    enum { NX = 6, NY = 6 };
    soup fine = roof(24, 24, 24, 24, 0), coarse = roof(NX, NY, 24, 24, 0.25);
    shim_mesh* const in = made(&fine);
    const shim_relax_rules rules = inner_rules();
    for (int kind = 0; kind < 3; ++kind) {
        shim_mesh* const level = level_of(&coarse, 1);
        points old = points_of(level);
        for (int32_t j = 0; j < NY; ++j) {
            const uint8_t bits = kind == 1 ? DELMESH_EDGE_MARKED : DELMESH_EDGE_FEATURE;
            shim_set_edge_bits(level, ridge(NX, NY, j), ridge(NX, NY, j + 1), bits);
        }
        /* A third crease ends at a vertex of the ridge: a corner. */
        if (kind == 2) shim_set_edge_bits(level, ridge(NX, NY, 3), ridge(NX, NY, 3) + NY + 1, DELMESH_EDGE_FEATURE);
        relaxed(level, in, &rules, NULL);
        points now = points_of(level);
        for (int32_t j = 0; j <= NY; ++j) {
            const int32_t v = ridge(NX, NY, j);
            const int is_end = j == 0 || j == NY; /* where the ridge meets the boundary three such edges do */
            if (kind == 1 || is_end || (kind == 2 && j == 3))
                assert_true(is_same_point(&old, &now, v));
            else
                assert_true(fabs(now.xyz[3 * v + 2] - 12) < 0.1 && fabs(now.xyz[3 * v] - 12) < 0.1);
        }
        free(old.xyz), free(now.xyz);
        shim_mesh_free(level);
    }
    shim_mesh_free(in);
    free_soup(&fine), free_soup(&coarse);
}

/* The boundary of the level is a ragged version of the input's: it gets closer. */
static void test_boundary(void** state) {
    (void)state;
    soup fine = sheet(24, 24, 1, 0, 1), coarse = sheet(6, 6, 4, 0, 1);
    scale_soup(&coarse, 1, 4, 1);
    for (int32_t j = 1; j < 6; ++j) coarse.points[3 * j] = j % 2 == 0 ? 0.4f : -0.4f;
    shim_mesh* const in = made(&fine);
    shim_mesh* const level = level_of(&coarse, 1);
    const shim_relax_rules rules = inner_rules();
    const double before = shim_distance(level, in).hausdorff_sampled;
    relaxed(level, in, &rules, NULL);
    assert_true(before > 0.39);
    assert_true(shim_distance(level, in).hausdorff_sampled < 0.5 * before);
    shim_mesh_free(level), shim_mesh_free(in);
    free_soup(&fine), free_soup(&coarse);
}

/* Pairs of an input and a coarse level of it. */
enum { PAIRS = 5 };
static void make_pair(int32_t i, soup* fine, soup* coarse) {
    switch (i) {
    case 0:
        *fine = torus(60, 40, 0, 1), *coarse = torus(18, 12, 0.05, 2);
        break;
    case 1: /* rough */
        *fine = torus(60, 40, 0.1, 3), *coarse = torus(20, 14, 0.1, 4);
        break;
    case 2: /* a rough sheet with a boundary */
        *fine = sheet(40, 40, 1, 0.3, 5), *coarse = sheet(10, 10, 4, 0.1, 6);
        scale_soup(coarse, 1, 4, 4);
        break;
    case 3: /* needles */
        *fine = fan(40, 7), *coarse = fan(40, 8);
        break;
    default: /* thin: two sheets of one tube nearly touch */
        *fine = torus(60, 40, 0, 1), *coarse = torus(18, 14, 0.03, 9);
        scale_soup(fine, 1, 1, 0.03), scale_soup(coarse, 1, 1, 0.03);
        break;
    }
}

static double two_sided(const delmesh_distance_report* r) {
    return sqrt(0.5 * (r->a_to_b_rms * r->a_to_b_rms + r->b_to_a_rms * r->b_to_a_rms));
}

static void test_never_farther(void** state) {
    (void)state;
    for (int32_t i = 0; i < PAIRS; ++i) {
        soup fine, coarse;
        make_pair(i, &fine, &coarse);
        shim_mesh* const in = made(&fine);
        shim_mesh* const level = level_of(&coarse, 2);
        shim_relax_rules rules = inner_rules();
        rules.sweeps = 1;
        delmesh_distance_report d = shim_distance(level, in);
        const double first = two_sided(&d);
        double last = first;
        for (int sweep = 0; sweep < 6; ++sweep) {
            relaxed(level, in, &rules, NULL);
            d = shim_distance(level, in);
            const double rms = two_sided(&d);
            if (rms > last * 1.01) /* the cost that may not grow has more in it than the square */
                fail_msg("pair %d, sweep %d: %g after %g", i, sweep, rms, last);
            last = rms;
        }
        if (!(last < 0.95 * first)) fail_msg("pair %d: from %g to %g", i, first, last);
        shim_mesh_free(level), shim_mesh_free(in);
        free_soup(&fine), free_soup(&coarse);
    }
}

static void test_boundary_rule(void** state) {
    (void)state;
    soup fine, coarse;
    make_pair(2, &fine, &coarse);
    shim_mesh* const in = made(&fine);
    delmesh_context_options context;
    memset(&context, 0, sizeof context);
    shim_mesh* const level = level_with(&coarse, &context, DELMESH_FLOAT32, DELMESH_BOUNDARY_NONOBTUSE);
    const shim_relax_rules rules = shim_relax_defaults();
    assert_int_equal(rules.boundary_rule, 1);
    assert_true(relaxed(level, in, &rules, NULL) > 0);
    shim_mesh_free(level), shim_mesh_free(in);
    free_soup(&fine), free_soup(&coarse);
}

static void test_stays(void** state) {
    (void)state;
    uint64_t seed = 11;
    for (int32_t i = 0; i < PAIRS; ++i) {
        soup fine, coarse;
        make_pair(i, &fine, &coarse);
        shim_mesh* const in = made(&fine);
        shim_mesh* const level = level_of(&coarse, 1);
        const int32_t verts = shim_mesh_arrays(level).vertices;
        uint8_t* const stays = malloc((size_t)verts);
        for (int32_t v = 0; v < verts; ++v) stays[v] = random_below(&seed, 3) == 0;
        const shim_relax_rules rules = inner_rules();
        assert_true(relaxed(level, in, &rules, stays) > 0);
        memset(stays, 1, (size_t)verts);
        assert_int_equal(relaxed(level, in, &rules, stays), 0);
        free(stays);
        shim_mesh_free(level), shim_mesh_free(in);
        free_soup(&fine), free_soup(&coarse);
    }
}

static void test_same_bytes(void** state) {
    (void)state;
    for (int32_t i = 0; i < PAIRS; ++i) {
        soup fine, coarse;
        make_pair(i, &fine, &coarse);
        shim_mesh* const in = made(&fine);
        const shim_relax_rules rules = inner_rules();
        points first = {NULL, 0};
        const int32_t threads[] = {1, 1, 2, 4, 0}; /* 0: a host's pool that runs backwards */
        for (int k = 0; k < 5; ++k) {
            host h;
            memset(&h, 0, sizeof h);
            delmesh_context_options context;
            memset(&context, 0, sizeof context);
            context.max_threads = threads[k];
            context.user = &h;
            if (threads[k] == 0) context.max_threads = 2, context.parallel_for = host_parallel_for;
            shim_mesh* const level = level_with(&coarse, &context, DELMESH_FLOAT32, DELMESH_BOUNDARY_IGNORE);
            relaxed(level, in, &rules, NULL);
            points now = points_of(level);
            if (k == 0)
                first = now;
            else {
                assert_int_equal(moved_between(&first, &now), 0);
                free(now.xyz);
            }
            shim_mesh_free(level);
        }
        free(first.xyz);
        shim_mesh_free(in);
        free_soup(&fine), free_soup(&coarse);
    }
}

/* Whatever ends a call early leaves a Delaunay level, an error and no memory behind. */
static void test_interrupted(void** state) {
    (void)state;
    soup fine = torus(30, 20, 0, 1), coarse = torus(14, 10, 0.05, 2);
    shim_mesh* const in = made(&fine);
    shim_relax_rules rules = inner_rules();
    rules.sweeps = 2;
    enum { ALLOCATION, REPORT, LOOP };
    for (int what = ALLOCATION; what <= LOOP; ++what) {
        int ended = 0;
        for (int64_t step = 1; !ended; ++step) {
            host h;
            memset(&h, 0, sizeof h);
            delmesh_context_options context;
            memset(&context, 0, sizeof context);
            context.max_threads = 2;
            context.user = &h;
            context.alloc = host_alloc;
            context.free = host_free;
            context.progress = host_progress;
            context.parallel_for = host_parallel_for;
            shim_mesh* const level = level_with(&coarse, &context, DELMESH_FLOAT32, DELMESH_BOUNDARY_IGNORE);
            const uint64_t bytes = shim_bytes_alive(level);
            memset(&h, 0, sizeof h);
            h.mesh = level;
            if (what == ALLOCATION)
                h.fail_at = step;
            else if (what == REPORT)
                h.cancel_at = step;
            else
                h.cancel_in_pool = (int32_t)step;
            shim_relax(level, in, &rules, NULL);
            ended = shim_mesh_status(level) == DELMESH_OK;
            if (!ended)
                assert_int_equal(shim_mesh_status(level),
                                 what == ALLOCATION ? DELMESH_ERROR_OUT_OF_MEMORY : DELMESH_ERROR_CANCELLED);
            else
                assert_true(step > 5); /* it was tried at several places */
            if (!ended && what != ALLOCATION) assert_string_not_equal(shim_mesh_error(level), "");
            assert_int_equal(shim_bytes_alive(level), bytes);
            h.fail_at = h.cancel_at = h.cancel_in_pool = 0;
            check_delaunay(level, 0);
            shim_mesh_free(level);
        }
    }
    shim_mesh_free(in);
    free_soup(&fine), free_soup(&coarse);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_flat_stays),    cmocka_unit_test(test_pushed_vertex_returns),
        cmocka_unit_test(test_creases),       cmocka_unit_test(test_boundary),
        cmocka_unit_test(test_never_farther), cmocka_unit_test(test_boundary_rule),
        cmocka_unit_test(test_stays),         cmocka_unit_test(test_same_bytes),
        cmocka_unit_test(test_interrupted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
