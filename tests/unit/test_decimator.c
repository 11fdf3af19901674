/* SPDX-License-Identifier: Apache-2.0 */
/* The decimation engine below its driver: quadrics, the queue and the order in space against what can be written down, then the
 * Decimator on meshes so small that it is known what must be left, and the laws that hold after every stage. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "mesh_makers.h"
#include "shim_decimator.h"

enum { MARKED = DELMESH_EDGE_MARKED, ANY = 1000000000 };

/* ---- geom/quadric.h -------------------------------------------------------------------------------------------------------- */

static shim_quadric plane(int axis, double at, double weight) { /* across an axis */
    double n[3] = {0, 0, 0}, p[3] = {5, -7, 11};
    n[axis] = 1;
    p[axis] = at;
    return shim_quadric_of_plane(n, p, weight);
}
static shim_quadric three_planes(void) {
    const shim_quadric x = plane(0, 1, 2), y = plane(1, -2, 4), z = plane(2, 3, 8), xy = shim_quadric_sum(&x, &y);
    return shim_quadric_sum(&xy, &z);
}

static void test_quadric_at(void** state) {
    (void)state;
    const double p[3] = {4, 2, 1}, tilted[3] = {0.6, 0.8, 0}, origin[3] = {1, 1, 1};
    const shim_quadric x = plane(0, 1, 2), q = three_planes(), twice = shim_quadric_scaled(&q, 2);
    assert_true(shim_quadric_at(&x, p) == 2 * 9);
    assert_true(shim_quadric_at(&q, p) == 2 * 9 + 4 * 16 + 8 * 4);
    assert_true(shim_quadric_at(&twice, p) == 2 * (2 * 9 + 4 * 16 + 8 * 4));
    const shim_quadric t = shim_quadric_of_plane(tilted, origin, 0.5); /* 0.6 * 3 + 0.8 * 1 = 2.6 */
    assert_true(fabs(shim_quadric_at(&t, p) - 0.5 * 2.6 * 2.6) < 1e-14);
    assert_true(shim_quadric_at(&t, origin) < 1e-15);
}

static void test_quadric_never_negative(void** state) {
    (void)state;
    uint64_t seed = 1;
    int zeros = 0;
    for (int i = 0; i < 10000; ++i) { /* points on all of the planes, far out: rounding is as large as what is left */
        double n[3], p[3], d[3], l = 0;
        for (int k = 0; k < 3; ++k) n[k] = random_unit(&seed), p[k] = 1e6 * random_unit(&seed), l += n[k] * n[k];
        for (int k = 0; k < 3; ++k) n[k] /= sqrt(l);
        d[0] = p[0] + n[1], d[1] = p[1] - n[0], d[2] = p[2];
        const shim_quadric q = shim_quadric_of_plane(n, p, 1);
        const double e = shim_quadric_at(&q, d);
        if (!(e >= 0)) fail_msg("%g", e);
        zeros += e == 0;
    }
    assert_true(zeros > 1000); /* about half of them would be below */
}

static void test_quadric_least(void** state) {
    (void)state;
    const double near[3] = {100, 200, -300};
    double w[3];
    shim_quadric q = three_planes();
    assert_int_equal(shim_quadric_least(&q, near, 0, w), 1);
    assert_true(fabs(w[0] - 1) < 1e-12 && fabs(w[1] + 2) < 1e-12 && fabs(w[2] - 3) < 1e-12);
    assert_true(shim_quadric_at(&q, w) < 1e-20);
    /* One plane: straight down to it, the rest as it was. */
    q = plane(2, 3, 8);
    assert_int_equal(shim_quadric_least(&q, near, 1e-6, w), 1);
    assert_true(w[0] == 100 && w[1] == 200 && fabs(w[2] - 3) < 1e-3);
    /* Two: onto their line. */
    const shim_quadric x = plane(0, 1, 8);
    q = shim_quadric_sum(&q, &x);
    assert_int_equal(shim_quadric_least(&q, near, 1e-6, w), 1);
    assert_true(fabs(w[0] - 1) < 1e-3 && w[1] == 200 && fabs(w[2] - 3) < 1e-3);
    memset(&q, 0, sizeof q);
    assert_int_equal(shim_quadric_least(&q, near, 1e-6, w), 0);
}

/* ---- algo/bucket_queue.h --------------------------------------------------------------------------------------------------- */

static void test_buckets(void** state) {
    (void)state;
    const double priorities[] = {0, 1e-45, 1.17549435e-38, 1e-20, 0.5, 1, 1.015, 3, 1e10, 9e37};
    for (int i = 0; i < COUNT(priorities); ++i) {
        const int32_t b = shim_queue_bucket(priorities[i]);
        if (i > 0) assert_true(b >= shim_queue_bucket(priorities[i - 1]));
        assert_true(shim_queue_end_of(b) > priorities[i]);
        if (b > 0) assert_true(shim_queue_end_of(b - 1) <= (double)(float)priorities[i]);
    }
    assert_int_equal(shim_queue_bucket(0), 0);
    assert_int_equal(shim_queue_bucket(1e-45), 0); /* the least subnormal */
    for (int32_t b = 0; b < shim_queue_bucket(1e38); ++b) {
        const double end = shim_queue_end_of(b);
        const float below = nextafterf((float)end, 0);
        assert_int_equal(shim_queue_bucket(end), b + 1);
        assert_int_equal(shim_queue_bucket(below), b);
        if (b >= shim_queue_bucket(FLT_MIN)) assert_true(end <= (double)(float)(shim_queue_end_of(b - 1) * 1.0313));
    }
}

static void test_queue_inside(void** state) { /* of a bucket: the last first, over several blocks */
    (void)state;
    enum { N = 100 };
    shim_queue* const q = shim_queue_make();
    int32_t b, values[64];
    assert_int_equal(shim_queue_pop(q, &b, values, 64), 0);
    for (int32_t i = 0; i < N; ++i) shim_queue_push(q, 1, i);
    shim_queue_push(q, 2, 1000);
    assert_int_equal(shim_queue_size(q), N + 1);
    for (int32_t next = N - 1; next >= 0;) {
        const int32_t n = shim_queue_pop(q, &b, values, 7);
        assert_true(n >= 1 && n <= 7);
        assert_int_equal(b, shim_queue_bucket(1));
        for (int32_t i = 0; i < n; ++i) assert_int_equal(values[i], next--);
    }
    shim_queue_push(q, 0, 7); /* below the last one popped */
    shim_queue_push(q, 1e-42, 8);
    assert_int_equal(shim_queue_pop(q, &b, values, 1), 1);
    assert_true(b == 0 && values[0] == 8);
    assert_int_equal(shim_queue_pop(q, &b, values, 64), 1);
    assert_true(b == 0 && values[0] == 7);
    assert_int_equal(shim_queue_pop(q, &b, values, 64), 1);
    assert_true(b == shim_queue_bucket(2) && values[0] == 1000);
    assert_int_equal(shim_queue_pop(q, &b, values, 64), 0);
    assert_int_equal(shim_queue_size(q), 0);
    shim_queue_free(q);
}

/* The reference: a stack per bucket, which bucket is least by looking at all. */
static void test_queue_random(void** state) {
    (void)state;
    enum { STEPS = 100000, KINDS = 300, ROOM = 4000 };
    static int32_t bucket_of[KINDS], stack[KINDS][ROOM], height[KINDS];
    static double priority_of[KINDS];
    memset(height, 0, sizeof height);
    uint64_t seed = 3;
    int32_t kinds = 0;
    double p = 0;
    while (kinds < KINDS) { /* ascending, one of each bucket */
        if (kinds == 0 || shim_queue_bucket(p) > bucket_of[kinds - 1]) {
            priority_of[kinds] = p;
            bucket_of[kinds++] = shim_queue_bucket(p);
        }
        p = p * 1.8 + 1e-41;
    }
    shim_queue* const q = shim_queue_make();
    int64_t size = 0, popped = 0;
    for (int32_t i = 0; i < STEPS; ++i) {
        if (random_below(&seed, 100) < (i / 10000 % 2 == 0 ? 80 : 40)) {
            const int32_t k = random_below(&seed, KINDS);
            if (height[k] == ROOM) continue;
            shim_queue_push(q, priority_of[k], i);
            stack[k][height[k]++] = i;
            ++size;
        } else {
            int32_t b = -1, values[20], k = 0;
            const int32_t most = 1 + random_below(&seed, 20), n = shim_queue_pop(q, &b, values, most);
            assert_int_equal(n == 0, size == 0);
            if (n == 0) continue;
            while (height[k] == 0) ++k;
            assert_true(n <= most && n <= height[k]);
            assert_int_equal(b, bucket_of[k]);
            for (int32_t j = 0; j < n; ++j) assert_int_equal(values[j], stack[k][--height[k]]);
            size -= n;
            popped += n;
        }
        assert_int_equal(shim_queue_size(q), size);
    }
    assert_true(popped > 10000 && size >= 0);
    shim_queue_free(q);
}

static void test_queue_reuses(void** state) {
    (void)state;
    shim_queue* const q = shim_queue_make();
    uint64_t seed = 5;
    int32_t b, value;
    for (int32_t i = 0; i < 2000; ++i) shim_queue_push(q, 1 + random_below(&seed, 1000), i);
    uint64_t bytes = 0;
    for (int32_t i = 0; i < 300000; ++i) {
        assert_int_equal(shim_queue_pop(q, &b, &value, 1), 1);
        shim_queue_push(q, 1 + random_below(&seed, 1000), value);
        if (i == 20000) bytes = shim_queue_bytes(q);
    }
    assert_true(shim_queue_bytes(q) == bytes);
    shim_queue_free(q);
}

/* ---- meshes ---------------------------------------------------------------------------------------------------------------- */

/* The surface of a cube of n x n x n: 6 n^2 quads, each cut along one diagonal. */
static soup cube(int32_t n) {
    const int32_t m = n + 1;
    int32_t* const number = (int32_t*)calloc((size_t)(m * m * m), sizeof(int32_t));
    soup s = soup_of(6 * n * n + 2, 12 * n * n);
    int32_t v = 0, f = 0;
    for (int32_t x = 0; x <= n; ++x)
        for (int32_t y = 0; y <= n; ++y)
            for (int32_t z = 0; z <= n; ++z)
                if (x == 0 || x == n || y == 0 || y == n || z == 0 || z == n) {
                    number[(x * m + y) * m + z] = v;
                    set_point(&s, v++, x, y, z);
                }
    for (int axis = 0; axis < 3; ++axis)
        for (int far = 0; far < 2; ++far)
            for (int32_t i = 0; i < n; ++i)
                for (int32_t j = 0; j < n; ++j) {
                    int32_t q[4];
                    for (int k = 0; k < 4; ++k) {
                        int32_t p[3];
                        p[axis] = far ? n : 0;
                        p[(axis + 1) % 3] = i + (k == 1 || k == 2);
                        p[(axis + 2) % 3] = j + (k >= 2);
                        q[far ? k : 3 - k] = number[(p[0] * m + p[1]) * m + p[2]];
                    }
                    set_face(&s, f++, q[0], q[1], q[2]);
                    set_face(&s, f++, q[0], q[2], q[3]);
                }
    free(number);
    return s;
}
static soup ball(int32_t n) {
    soup s = cube(n);
    for (int32_t v = 0; v < s.vertices; ++v) {
        double x[3], l = 0;
        for (int k = 0; k < 3; ++k) x[k] = s.points[3 * v + k] - 0.5 * n, l += x[k] * x[k];
        l = sqrt(l);
        set_point(&s, v, x[0] / l, x[1] / l, x[2] / l);
    }
    return s;
}
static soup tetrahedron(void) {
    soup s = soup_of(4, 4);
    for (int v = 0; v < 4; ++v) set_point(&s, v, v == 1 || v == 2, v == 1 || v == 3, v == 2 || v == 3);
    set_face(&s, 0, 0, 2, 1);
    set_face(&s, 1, 0, 1, 3);
    set_face(&s, 2, 0, 3, 2);
    set_face(&s, 3, 1, 2, 3);
    return s;
}
static soup octahedron(void) {
    soup s = soup_of(6, 8);
    for (int v = 0; v < 6; ++v)
        set_point(&s, v, v / 2 == 0 ? 1 - 2 * (v % 2) : 0, v / 2 == 1 ? 1 - 2 * (v % 2) : 0, v / 2 == 2 ? 1 - 2 * (v % 2) : 0);
    for (int f = 0; f < 8; ++f) {
        const int32_t a = f & 1, b = 2 + (f >> 1 & 1), c = 4 + (f >> 2 & 1);
        const int turned = (f & 1) ^ (f >> 1 & 1) ^ (f >> 2 & 1);
        set_face(&s, f, a, turned ? c : b, turned ? b : c);
    }
    return s;
}

static shim_mesh* made_of_soup(const soup* s) {
    const delmesh_mesh_desc desc = desc_of_soup(s);
    shim_mesh* const m = shim_mesh_make(NULL, &desc, 0);
    if (shim_mesh_status(m) != DELMESH_OK) fail_msg("%s", shim_mesh_error(m));
    return m;
}
/* What the Decimator asks for. */
static shim_mesh* delaunay(shim_mesh* in) {
    delmesh_remesh_options o;
    delmesh_remesh_report r;
    memset(&o, 0, sizeof o);
    o.struct_size = sizeof o;
    o.mode = DELMESH_MODE_FLIP;
    o.precision = DELMESH_FLOAT32;
    o.feature_angle = 30;
    o.max_normal_turn = o.tolerance = -1;
    o.effort = 1;
    o.compact = 1;
    shim_mesh* const out = shim_remesh(in, &o, 1, &r);
    if (shim_mesh_status(out) != DELMESH_OK) fail_msg("%s", shim_mesh_error(out));
    shim_mesh_free(in);
    return out;
}
static shim_mesh* delaunay_of(soup s) {
    shim_mesh* const m = made_of_soup(&s);
    free_soup(&s);
    return delaunay(m);
}

/* ---- mesh/spatial_order.h -------------------------------------------------------------------------------------------------- */

static void check_order(shim_mesh* in) {
    const shim_arrays a = shim_mesh_arrays(in);
    const int32_t verts = a.vertices, faces = (int32_t)(a.corners / 3);
    int32_t* const maps = (int32_t*)calloc((size_t)(2 * verts + 2 * faces), sizeof(int32_t));
    int32_t *const old_vert = maps, *const new_vert = maps + verts, *const old_face = new_vert + verts,
                   *const new_face = old_face + faces;
    shim_mesh* const out = shim_sort_in_space(in, old_vert, new_vert, old_face, new_face);
    assert_int_equal(shim_mesh_status(out), DELMESH_OK);
    const shim_arrays b = shim_mesh_arrays(out);
    assert_true(b.vertices == verts && b.corners == a.corners && b.slot_count == a.slot_count);
    assert_true(b.pos32_size == a.pos32_size && b.pos64_size == a.pos64_size && b.corner_bits_size == a.corner_bits_size);
    for (int32_t v = 0; v < verts; ++v) {
        assert_true(old_vert[v] >= 0 && old_vert[v] < verts && new_vert[old_vert[v]] == v);
        if (a.pos32_size != 0) assert_memory_equal(b.pos32 + 3 * v, a.pos32 + 3 * old_vert[v], 3 * sizeof(float));
        if (a.pos64_size != 0) assert_memory_equal(b.pos64 + 3 * v, a.pos64 + 3 * old_vert[v], 3 * sizeof(double));
    }
    int32_t first_before = 0;
    for (int32_t f = 0; f < faces; ++f) {
        assert_true(old_face[f] >= 0 && old_face[f] < faces && new_face[old_face[f]] == f);
        int32_t first = verts;
        for (int32_t k = 0; k < 3; ++k) {
            const int32_t c = 3 * f + k, from = 3 * old_face[f] + k, t = a.corner_twin[from];
            assert_int_equal(b.corner_vert[c], new_vert[a.corner_vert[from]]);
            assert_int_equal(b.corner_twin[c], t < 0 ? t : 3 * new_face[t / 3] + t % 3);
            if (a.corner_bits_size != 0) assert_int_equal(b.corner_bits[c], a.corner_bits[from]);
            if (b.corner_vert[c] < first) first = b.corner_vert[c];
        }
        assert_true(first >= first_before);
        first_before = first;
    }
    if (shim_mesh_validate(out) != DELMESH_OK) fail_msg("%s", shim_mesh_error(out));
    free(maps);
    shim_mesh_free(out);
    shim_mesh_free(in);
}
static void test_spatial_order(void** state) {
    (void)state;
    soup s = torus(24, 12, 0.2, 1);
    check_order(made_of_soup(&s));
    free_soup(&s);
    s = book(3, 6, 0.2, 2);
    shim_mesh* const m = made_of_soup(&s);
    assert_true(shim_mesh_arrays(m).slot_count > 0); /* edges were cut */
    shim_set_edge_bits(m, 0, s.corners[1], MARKED);
    check_order(m);
    free_soup(&s);
    s = tetrahedron();
    check_order(made_of_soup(&s));
    for (int i = 0; i < 12; ++i) s.points[i] = i % 3 == 2 ? 0 : s.points[i]; /* flat: no height to divide by */
    check_order(made_of_soup(&s));
    free_soup(&s);
}

/* ---- the Decimator --------------------------------------------------------------------------------------------------------- */

/* What holds after every stage: a valid surface without NLD edges, counts that agree, every vertex in one list. euler: of the
 * surface. */
static shim_decimation checked(const shim_decimator* d, const shim_decimation_rules* rules, int64_t euler) {
    const shim_decimation s = shim_decimator_state(d);
    assert_int_equal(shim_decimator_valid(d), 1);
    shim_mesh* const level = shim_decimator_level(d);
    if (shim_mesh_validate(level) != DELMESH_OK) fail_msg("%s", shim_mesh_error(level));
    const shim_certificate one = shim_certify(level, rules->boundary_rule, 0), two = shim_scan_all(level, rules->boundary_rule);
    assert_true(one.delaunay && two.delaunay);
    assert_int_equal(one.nld_interior + one.zero_area_faces + (rules->boundary_rule ? one.nld_boundary : 0), 0);
    const shim_arrays a = shim_mesh_arrays(level);
    assert_int_equal(a.vertices, s.vertices_left);
    assert_int_equal(a.corners, 3 * s.faces_left);
    int64_t halves = 0;
    for (int64_t c = 0; c < a.corners; ++c) halves += a.corner_twin[c] < 0 ? 2 : 1;
    assert_int_equal(s.vertices_left - halves / 2 + s.faces_left, euler);
    shim_mesh_free(level);
    uint8_t* const listed = (uint8_t*)calloc((size_t)s.vertices, 1);
    for (int32_t v = 0; v < s.vertices; ++v) {
        const int lives = s.merged_into[v] == v;
        assert_int_equal(lives, s.vert_corner[v] >= 0);
        if (!lives) continue;
        int32_t last = v, among = s.place_of[v] < 0;
        for (int32_t w = v; w >= 0; w = s.next_merged[w]) {
            assert_false(listed[w]); /* also keeps a list from turning in circles */
            listed[w] = 1;
            last = w;
            if (w == s.place_of[v]) among = 1;
            int32_t root = w;
            for (int32_t i = 0; s.merged_into[root] != root; ++i) {
                root = s.merged_into[root];
                assert_true(i < s.vertices);
            }
            assert_int_equal(root, v);
        }
        assert_int_equal(s.last_merged[v], last);
        assert_true(among);
    }
    for (int32_t v = 0; v < s.vertices; ++v) assert_true(listed[v]);
    free(listed);
    return s;
}

static shim_decimator* begun(const shim_mesh* m, const shim_decimation_rules* rules) {
    shim_decimator* const d = shim_decimator_make(m, rules, NULL, NULL);
    assert_non_null(d);
    return d;
}
static shim_decimation run_to(shim_decimator* d, const shim_decimation_rules* rules, int64_t vertices, int64_t euler) {
    assert_int_equal(shim_decimator_run(d, vertices, ANY, 1000000), DELMESH_OK);
    return checked(d, rules, euler);
}

static void check_places(const shim_decimation* s, const float* before) { /* place_of tells the truth */
    for (int32_t v = 0; v < s->vertices; ++v) {
        if (s->merged_into[v] != v || s->place_of[v] < 0) continue;
        for (int k = 0; k < 3; ++k) assert_true(s->pos[3 * v + k] == (double)before[3 * s->place_of[v] + k]);
    }
}

static void test_flat_grid(void** state) {
    (void)state;
    enum { N = 12 };
    const shim_decimation_rules rules = shim_decimation_defaults();
    shim_mesh* const m = delaunay_of(sheet(N, N, 1, 0, 1));
    shim_decimator* const d = begun(m, &rules);
    const int64_t targets[] = {100, 40, 12, 4};
    for (int i = 0; i < COUNT(targets); ++i) {
        const shim_decimation s = run_to(d, &rules, targets[i], 1);
        assert_int_equal(s.vertices_left, targets[i]);
        assert_int_equal(s.stopped_by, DELMESH_STOPPED_BY_TARGET);
        if (!(s.cost <= 1e-15)) fail_msg("cost %g at %d", s.cost, (int)targets[i]); /* of a size of 1 */
        int corners = 0;
        for (int32_t v = 0; v < s.vertices; ++v) {
            if (s.vert_corner[v] < 0) continue;
            const double x = s.pos[3 * v], y = s.pos[3 * v + 1];
            assert_true(s.pos[3 * v + 2] == 0);
            const int on_x = x == 0 || x == N, on_y = y == 0 || y == N;
            if (s.corner_twin[s.vert_corner[v]] < 0) assert_true(on_x || on_y);
            corners += on_x && on_y;
        }
        assert_int_equal(corners, 4);
        check_places(&s, shim_mesh_arrays(m).pos32);
    }
    shim_decimator_free(d);
    shim_mesh_free(m);
}

static void test_tetrahedron_refuses(void** state) {
    (void)state;
    const shim_decimation_rules rules = shim_decimation_defaults();
    shim_mesh* const m = delaunay_of(tetrahedron());
    shim_decimator* const d = begun(m, &rules);
    const shim_decimation s = run_to(d, &rules, 3, 2);
    assert_int_equal(s.vertices_left, 4);
    assert_int_equal(s.stopped_by, DELMESH_STOPPED_BY_TOPOLOGY);
    assert_true(s.collapses == 0 && s.cost == 0);
    shim_decimator_free(d);
    shim_mesh_free(m);
}

static void test_octahedron(void** state) {
    (void)state;
    const shim_decimation_rules rules = shim_decimation_defaults(); /* the first place's flips fail: then the ends */
    shim_mesh* const m = delaunay_of(octahedron());
    shim_decimator* const d = begun(m, &rules);
    shim_decimation s = run_to(d, &rules, 5, 2);
    assert_int_equal(s.vertices_left, 5);
    s = run_to(d, &rules, 0, 2);
    assert_int_equal(s.vertices_left, 4);
    assert_int_equal(s.stopped_by, DELMESH_STOPPED_BY_TOPOLOGY);
    assert_int_equal(s.faces_left, 4);
    shim_decimator_free(d);
    shim_mesh_free(m);
}

static void test_torus(void** state) {
    (void)state;
    const shim_decimation_rules rules = shim_decimation_defaults();
    shim_mesh* const m = delaunay_of(torus(40, 20, 0.02, 4));
    shim_decimator* const d = begun(m, &rules);
    int64_t reached = 800;
    for (int64_t target = 400; target > 50; target /= 2) {
        const shim_decimation s = run_to(d, &rules, target, 0);
        assert_int_equal(s.stopped_by, DELMESH_STOPPED_BY_TARGET);
        assert_int_equal(s.vertices_left, target);
    }
    const shim_decimation s = run_to(d, &rules, 0, 0);
    reached = s.vertices_left;
    assert_true(reached >= 7 && reached <= 30); /* no torus has fewer than 7 */
    assert_true(s.stopped_by == DELMESH_STOPPED_BY_TOPOLOGY || s.stopped_by == DELMESH_STOPPED_BY_DELAUNAY);
    shim_decimator_free(d);
    shim_mesh_free(m);
}

static int32_t lines_of(const double* p, int32_t n) { /* on how many pairs of the cube's sides */
    int32_t on = 0;
    for (int k = 0; k < 3; ++k) on += fabs(p[k]) < 1e-5 || fabs(p[k] - n) < 1e-5;
    return on;
}
static void check_kinds(const shim_decimator* d, const shim_decimation* s) { /* where nothing is locked */
    int32_t* const lines = (int32_t*)calloc((size_t)s->vertices, sizeof(int32_t));
    for (int32_t c = 0; c < s->corners; ++c) {
        if (s->corner_vert[c] < 0 || s->corner_twin[c] >= c) continue;
        if (s->corner_twin[c] >= 0 && (s->corner_bits[c] & (MARKED | DELMESH_EDGE_FEATURE)) == 0) continue;
        ++lines[s->corner_vert[c]];
        ++lines[s->corner_vert[c % 3 == 2 ? c - 2 : c + 1]];
    }
    for (int32_t v = 0; v < s->vertices; ++v)
        if (s->vert_corner[v] >= 0) assert_int_equal(shim_decimator_kind(d, v), lines[v] > 2 ? 2 : lines[v] > 0 ? 1 : 0);
    free(lines);
}

/* Noise: single feature edges, pairs, and triangles of them. Once they have shrunk to nothing, they hold nothing. */
static void test_specks(void** state) {
    (void)state;
    const shim_decimation_rules rules = shim_decimation_defaults();
    shim_mesh* const m = delaunay_of(torus(40, 20, 0.02, 4));
    const shim_arrays a = shim_mesh_arrays(m);
    for (int32_t c = 0; c < a.corners; ++c)
        if (c % 31 == 0 || c % 93 < 3)
            shim_set_edge_bits(m, a.corner_vert[c], a.corner_vert[c % 3 == 2 ? c - 2 : c + 1], DELMESH_EDGE_FEATURE);
    shim_decimator* const d = begun(m, &rules);
    int fewer = 0;
    for (int64_t target = 400; target >= 50; target /= 2) {
        const shim_decimation s = run_to(d, &rules, target, 0);
        assert_int_equal(s.vertices_left, target);
        check_kinds(d, &s);
        for (int32_t v = 0; v < s.vertices; ++v) fewer += s.vert_corner[v] >= 0 && shim_decimator_kind(d, v) == 0;
    }
    assert_true(fewer > 0);
    shim_decimator_free(d);
    shim_mesh_free(m);
}

/* Two lines around a ball, as close as its vertices are: edges of either can only get so long before the other's vertices see them
 * under an obtuse angle. The rest must not pay for that. */
static void test_close_lines(void** state) {
    (void)state;
    enum { N = 24 };
    const shim_decimation_rules rules = shim_decimation_defaults();
    soup lattice = cube(N), b = ball(N);
    shim_mesh* const raw = made_of_soup(&b);
    for (int32_t k = 0; k < 3 * b.faces; ++k) {
        const int32_t p = b.corners[k], q = b.corners[k % 3 == 2 ? k - 2 : k + 1];
        const double *const x = lattice.points + 3 * p, *const y = lattice.points + 3 * q;
        const int one = (x[1] != y[1]) + (x[2] != y[2]) == 1;
        if (one && x[0] == y[0] && (x[0] == N / 2 || x[0] == N / 2 + 1)) shim_set_edge_bits(raw, p, q, MARKED);
    }
    free_soup(&lattice);
    free_soup(&b);
    shim_mesh* const m = delaunay(raw);
    shim_decimator* const d = begun(m, &rules);
    int64_t left = 0;
    for (int i = 0; i < 2; ++i) { /* and it does not go on when it is asked again */
        const shim_decimation s = run_to(d, &rules, 20, 2);
        check_kinds(d, &s);
        assert_int_equal(s.stopped_by, DELMESH_STOPPED_BY_FEATURES);
        assert_true(i == 0 || s.vertices_left == left);
        left = s.vertices_left;
        int64_t smooth = 0;
        for (int32_t v = 0; v < s.vertices; ++v) smooth += s.vert_corner[v] >= 0 && shim_decimator_kind(d, v) == 0;
        if (!(4 * smooth > left)) fail_msg("%d of %d vertices are not on lines", (int)smooth, (int)left);
    }
    shim_decimator_free(d);
    shim_mesh_free(m);
}

static double least_bend(const shim_decimation* s) { /* the least cosine between the normals of neighbours */
    double least = 1;
    for (int32_t c = 0; c < s->corners; ++c) {
        const int32_t t = s->corner_twin[c];
        if (s->corner_vert[c] < 0 || t < c) continue;
        double n[2][3];
        for (int side = 0; side < 2; ++side) {
            const int32_t f = (side == 0 ? c : t) / 3;
            const double *const o = s->pos + 3 * s->corner_vert[3 * f], *const p = s->pos + 3 * s->corner_vert[3 * f + 1],
                                *const q = s->pos + 3 * s->corner_vert[3 * f + 2];
            for (int k = 0; k < 3; ++k) {
                const int i = (k + 1) % 3, j = (k + 2) % 3;
                n[side][k] = (p[i] - o[i]) * (q[j] - o[j]) - (p[j] - o[j]) * (q[i] - o[i]);
            }
        }
        double products[3] = {0, 0, 0}; /* n n, n m, m m */
        for (int k = 0; k < 3; ++k)
            products[0] += n[0][k] * n[0][k], products[1] += n[0][k] * n[1][k], products[2] += n[1][k] * n[1][k];
        least = fmin(least, products[1] / sqrt(products[0] * products[2]));
    }
    return least;
}

/* Lenses: where few faces go round their rims, they lie almost on each other. Where a collapse would fold the surface it goes to
   another place, which may need flips; what is refused is paid for elsewhere, in cost. */
static void test_no_folds(void** state) {
    (void)state;
    const shim_decimation_rules rules = shim_decimation_defaults();
    const double heights[] = {0.125, 0.04};
    for (int i = 0; i < COUNT(heights); ++i) {
        soup lens = ball(16);
        for (int32_t v = 0; v < lens.vertices; ++v) lens.points[3 * v + 2] *= heights[i];
        shim_mesh* const m = delaunay_of(lens);
        shim_decimator* const d = begun(m, &rules);
        for (int64_t target = 800; target >= 25; target /= 2) {
            const shim_decimation s = run_to(d, &rules, target, 2);
            const double least = least_bend(&s);
            if (!(least > -0.867)) fail_msg("%d vertices: a cosine of %g", (int)target, least);
            if (target < 50) continue;
            assert_true(s.vertices_left == target);
            if (!(s.cost < 1e-5)) fail_msg("height %g, %d vertices: a cost of %g", heights[i], (int)target, s.cost);
        }
        shim_decimator_free(d);
        shim_mesh_free(m);
    }
}

static void test_marked_cube(void** state) {
    (void)state;
    enum { N = 6 };
    const shim_decimation_rules rules = shim_decimation_defaults();
    soup c = cube(N);
    shim_mesh* const raw = made_of_soup(&c);
    for (int32_t k = 0; k < 3 * c.faces; ++k) {
        const int32_t p = c.corners[k], q = c.corners[k % 3 == 2 ? k - 2 : k + 1];
        double middle[3];
        for (int i = 0; i < 3; ++i) middle[i] = 0.5 * (c.points[3 * p + i] + c.points[3 * q + i]);
        if (lines_of(middle, N) >= 2) shim_set_edge_bits(raw, p, q, MARKED);
    }
    free_soup(&c);
    shim_mesh* const m = delaunay(raw);
    shim_decimator* const d = begun(m, &rules);
    const int64_t targets[] = {100, 30, 8, 4};
    for (int i = 0; i < COUNT(targets); ++i) {
        const shim_decimation s = run_to(d, &rules, targets[i], 2);
        assert_int_equal(s.vertices_left, targets[i] < 8 ? 8 : targets[i]);
        assert_int_equal(s.stopped_by, targets[i] < 8 ? DELMESH_STOPPED_BY_FEATURES : DELMESH_STOPPED_BY_TARGET);
        assert_true(s.cost < 1e-12);
        int corners = 0;
        double length_of_kept = 0;
        for (int32_t v = 0; v < s.vertices; ++v)
            if (s.vert_corner[v] >= 0 && shim_decimator_kind(d, v) == 2) {
                for (int k = 0; k < 3; ++k) assert_true(s.pos[3 * v + k] == 0 || s.pos[3 * v + k] == N);
                ++corners;
            }
        assert_int_equal(corners, 8);
        for (int32_t k = 0; k < s.corners; ++k) {
            if (s.corner_vert[k] < 0 || (s.corner_bits[k] & MARKED) == 0) continue;
            const double *const p = s.pos + 3 * s.corner_vert[k], *const q =
                                                                      s.pos + 3 * s.corner_vert[k % 3 == 2 ? k - 2 : k + 1];
            double squared = 0;
            for (int j = 0; j < 3; ++j) squared += (p[j] - q[j]) * (p[j] - q[j]);
            length_of_kept += 0.5 * sqrt(squared);
            assert_true(lines_of(p, N) >= 2 && lines_of(q, N) >= 2);
        }
        assert_true(fabs(length_of_kept - 12 * N) < 1e-4);
        check_kinds(d, &s);
    }
    shim_decimator_free(d);
    shim_mesh_free(m);
}

static void test_locked(void** state) {
    (void)state;
    enum { N = 16 };
    const shim_decimation_rules rules = shim_decimation_defaults();
    shim_mesh* const m = delaunay_of(sheet(N, N, 1, 0.1, 7));
    const shim_arrays a = shim_mesh_arrays(m);
    uint8_t* const locked = (uint8_t*)calloc((size_t)a.vertices, 1);
    for (int32_t v = 0; v < a.vertices; ++v) locked[v] = v % 7 == 3;
    shim_decimator* const d = shim_decimator_make(m, &rules, NULL, locked);
    const shim_decimation s = run_to(d, &rules, 60, 1);
    for (int32_t v = 0; v < s.vertices; ++v) {
        if (!locked[v]) continue;
        int32_t w = v; /* the number that the vertex goes by */
        while (s.merged_into[w] != w) w = s.merged_into[w];
        assert_true(s.place_of[w] == v && shim_decimator_kind(d, w) == 2);
        for (int k = 0; k < 3; ++k) assert_true(s.pos[3 * w + k] == (double)a.pos32[3 * v + k]);
    }
    assert_true(s.vertices_left < 120);
    check_places(&s, a.pos32);
    shim_decimator_free(d);
    memset(locked, 1, (size_t)a.vertices); /* all of them: nothing may be */
    shim_decimator* const none = shim_decimator_make(m, &rules, NULL, locked);
    const shim_decimation t = run_to(none, &rules, 60, 1);
    assert_int_equal(t.collapses, 0);
    assert_int_equal(t.stopped_by, DELMESH_STOPPED_BY_FEATURES);
    shim_decimator_free(none);
    free(locked);
    shim_mesh_free(m);
}

static void test_same_twice(void** state) {
    (void)state;
    const shim_decimation_rules rules = shim_decimation_defaults();
    shim_mesh* const m = delaunay_of(torus(40, 20, 0.2, 9));
    shim_decimator *const one = begun(m, &rules), *const two = begun(m, &rules);
    const shim_decimation a = run_to(one, &rules, 150, 0), b = run_to(two, &rules, 150, 0);
    assert_true(a.corners == b.corners && a.vertices == b.vertices && a.cost == b.cost && a.postponed == b.postponed);
    assert_true(a.collapses == b.collapses && a.flips == b.flips && a.undone == b.undone);
    const size_t verts = (size_t)a.vertices * sizeof(int32_t), corners = (size_t)a.corners * sizeof(int32_t);
    assert_memory_equal(a.corner_vert, b.corner_vert, corners);
    assert_memory_equal(a.corner_twin, b.corner_twin, corners);
    assert_memory_equal(a.pos, b.pos, (size_t)a.vertices * 3 * sizeof(double));
    assert_memory_equal(a.merged_into, b.merged_into, verts);
    assert_memory_equal(a.next_merged, b.next_merged, verts);
    assert_memory_equal(a.place_of, b.place_of, verts);
    shim_decimator_free(one);
    shim_decimator_free(two);
    shim_mesh_free(m);
}

/* The paper's own algorithm: the allowable region alone. */
static void test_region_alone(void** state) {
    (void)state;
    shim_decimation_rules rules = shim_decimation_defaults();
    rules.optimum = rules.ends = rules.middle = rules.flips = 0;
    shim_mesh* const m = delaunay_of(ball(12));
    shim_decimator* const d = begun(m, &rules);
    const int64_t all = shim_decimator_state(d).vertices_left;
    for (int64_t percent = 90; percent >= 50; percent -= 20) {
        const shim_decimation s = run_to(d, &rules, all * percent / 100, 2);
        assert_int_equal(s.flips, 0);
        assert_int_equal(s.stopped_by, DELMESH_STOPPED_BY_TARGET);
        for (int32_t v = 0; v < s.vertices; ++v) {
            if (s.vert_corner[v] < 0) continue;
            double squared = 0;
            for (int k = 0; k < 3; ++k) squared += s.pos[3 * v + k] * s.pos[3 * v + k];
            assert_true(fabs(sqrt(squared) - 1) < 0.3);
        }
    }
    shim_decimator_free(d);
    shim_mesh_free(m);
}

/* Where the estimate is 0 and flips cost a little, entries were once put off by a bucket at a time: thousands of buckets. */
static void test_postponed_once(void** state) {
    (void)state;
    const shim_decimation_rules rules = shim_decimation_defaults();
    const double noises[] = {0, 1e-6, 1e-4, 1e-2};
    for (int i = 0; i < COUNT(noises); ++i) {
        soup s = sheet(24, 24, 3, 0.3, 11);
        uint64_t seed = 13;
        for (int32_t v = 0; v < s.vertices; ++v) s.points[3 * v + 2] = (double)(float)(noises[i] * random_unit(&seed));
        shim_mesh* const m = delaunay_of(s);
        shim_decimator* const d = begun(m, &rules);
        const int64_t most = 50 * shim_decimator_state(d).vertices_left;
        assert_int_equal(shim_decimator_run(d, 0, ANY, most), DELMESH_OK);
        const shim_decimation end = checked(d, &rules, 1);
        assert_true(end.postponed <= most && end.vertices_left < 300);
        shim_decimator_free(d);
        shim_mesh_free(m);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_quadric_at),     cmocka_unit_test(test_quadric_never_negative),
        cmocka_unit_test(test_quadric_least),  cmocka_unit_test(test_buckets),
        cmocka_unit_test(test_queue_inside),   cmocka_unit_test(test_queue_random),
        cmocka_unit_test(test_queue_reuses),   cmocka_unit_test(test_spatial_order),
        cmocka_unit_test(test_flat_grid),      cmocka_unit_test(test_tetrahedron_refuses),
        cmocka_unit_test(test_octahedron),     cmocka_unit_test(test_torus),
        cmocka_unit_test(test_marked_cube),    cmocka_unit_test(test_locked),
        cmocka_unit_test(test_same_twice),     cmocka_unit_test(test_region_alone),
        cmocka_unit_test(test_postponed_once), cmocka_unit_test(test_specks),
        cmocka_unit_test(test_close_lines),    cmocka_unit_test(test_no_folds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
