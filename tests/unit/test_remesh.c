/* SPDX-License-Identifier: Apache-2.0 */
/* Remeshing below the ABI: what happens to meshes so small that the answer can be written down, then the laws that hold for
 * every mesh, on generated ones. */
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
#include "shim_remesh.h"

enum { P = DELMESH_MODE_PRESERVE, F = DELMESH_MODE_FLIP, K = DELMESH_MODE_FEATURE };

static delmesh_remesh_options options_of(int32_t mode) { /* the defaults, but for the mode */
    delmesh_remesh_options o;
    memset(&o, 0, sizeof o);
    o.struct_size = sizeof o;
    o.mode = mode;
    o.precision = DELMESH_FLOAT32;
    o.feature_angle = 30;
    o.max_normal_turn = -1;
    o.tolerance = -1;
    o.effort = 1;
    return o;
}
/* The same without the boundary rule: tiny meshes are nearly all boundary. */
static delmesh_remesh_options inner_options_of(int32_t mode) {
    delmesh_remesh_options o = options_of(mode);
    o.boundary = DELMESH_BOUNDARY_IGNORE;
    return o;
}

static shim_mesh* made(const delmesh_mesh_desc* desc) {
    shim_mesh* const m = shim_mesh_make(NULL, desc, 0);
    assert_string_equal(shim_mesh_error(m), "");
    assert_int_equal(shim_mesh_status(m), DELMESH_OK);
    return m;
}
static shim_mesh* made_of_soup(const soup* s) {
    const delmesh_mesh_desc desc = desc_of_soup(s);
    return made(&desc);
}

static double coordinate(const shim_arrays* a, int32_t v, int k) {
    return a->pos32_size != 0 ? (double)a->pos32[3 * v + k] : a->pos64[3 * v + k];
}

/* What holds for every result: a valid mesh, certified twice, counts that add up, source vertices in their places. */
static void check_result(const shim_mesh* in_mesh, shim_mesh* out, const delmesh_remesh_options* o,
                         const delmesh_remesh_report* r) {
    shim_mesh* const in = (shim_mesh*)in_mesh;
    const int32_t rule = o->boundary == DELMESH_BOUNDARY_NONOBTUSE;
    if (shim_mesh_status(out) != DELMESH_OK) fail_msg("status %d: %s", shim_mesh_status(out), shim_mesh_error(out));
    const shim_arrays a = shim_mesh_arrays(in), b = shim_mesh_arrays(out);
    const delmesh_mesh_info before = shim_mesh_info(in), after = shim_mesh_info(out);
    assert_int_equal(shim_mesh_validate(out), DELMESH_OK);
    assert_int_equal(r->certified, 1);
    assert_int_equal(r->nld_out, 0);
    assert_true(shim_certify(out, rule, 0).delaunay && shim_scan_all(out, rule).delaunay);
    assert_int_equal(r->vertices_in, before.vertices);
    assert_int_equal(r->faces_in, before.faces);
    assert_int_equal(r->vertices_out, after.vertices);
    assert_int_equal(r->faces_out, after.faces);
    assert_true(r->splits >= r->boundary_splits + r->kept_splits + r->unflippable);
    assert_int_equal(r->unflippable, r->unflippable_2 + r->unflippable_3 + r->unflippable_4);
    assert_int_equal(b.pos32_size != 0, o->precision == DELMESH_FLOAT32);
    if (r->collapsed_edges + r->removed_zero_area_faces == 0) {
        if (!o->compact) assert_int_equal(r->vertices_out, r->vertices_in + r->splits);
        assert_int_equal(after.components, before.components);
        assert_int_equal(after.boundary_loops, before.boundary_loops);
        assert_int_equal(after.euler_characteristic, before.euler_characteristic);
        assert_int_equal(after.boundary_edges - before.boundary_edges, 2 * after.vertices - 2 * after.isolated_vertices -
                                                                           2 * before.vertices + 2 * before.isolated_vertices -
                                                                           (after.faces - before.faces));
        assert_true(after.faces - before.faces >= r->splits && after.faces - before.faces <= 2 * r->splits);
        if (after.boundary_edges == 0) assert_int_equal(after.faces, before.faces + 2 * r->splits);
    }
    if (o->compact == 0) {
        for (int32_t v = 0; v < a.vertices; ++v)
            for (int k = 0; k < 3; ++k) {
                const double x = coordinate(&a, v, k);
                const volatile float rounded = (float)x;
                const double expected = o->precision == DELMESH_FLOAT32 ? (double)rounded : x;
                const double actual = coordinate(&b, v, k);
                if (memcmp(&actual, &expected, sizeof actual) != 0) fail_msg("vertex %d has moved", v);
            }
    }
}

static shim_mesh* remeshed(const shim_mesh* in, const delmesh_remesh_options* o, delmesh_remesh_report* r) {
    shim_mesh* const out = shim_remesh(in, o, 1, r);
    check_result(in, out, o, r);
    return out;
}

static void expect_status(const shim_mesh* in, const delmesh_remesh_options* o, int32_t status, const char* words) {
    delmesh_remesh_report r;
    shim_mesh* const out = shim_remesh(in, o, 1, &r);
    if (shim_mesh_status(out) != status || strstr(shim_mesh_error(out), words) == NULL)
        fail_msg("status %d instead of %d, '%s' has no '%s'", shim_mesh_status(out), status, shim_mesh_error(out), words);
    assert_int_equal(r.certified, 0);
    shim_mesh_free(out);
}

static void expect_corners(shim_mesh* m, const int32_t* expected, int64_t count) {
    const shim_arrays a = shim_mesh_arrays(m);
    assert_int_equal(a.corners, count);
    for (int64_t c = 0; c < count; ++c)
        if (a.corner_vert[c] != expected[c])
            fail_msg("corner %d has vertex %d instead of %d", (int)c, a.corner_vert[c], expected[c]);
}
#define EXPECT_CORNERS(mesh, expected) expect_corners(mesh, expected, COUNT(expected))

static void expect_equal(shim_mesh* one, shim_mesh* two, double scale_x, double scale) { /* two = scaled one */
    const shim_arrays a = shim_mesh_arrays(one), b = shim_mesh_arrays(two);
    assert_int_equal(a.vertices, b.vertices);
    assert_int_equal(a.corners, b.corners);
    assert_int_equal(a.slot_count, b.slot_count);
    for (int32_t v = 0; v < a.vertices; ++v)
        for (int k = 0; k < 3; ++k)
            if (!(coordinate(&a, v, k) * (k == 0 ? scale_x : scale) == coordinate(&b, v, k))) fail_msg("vertex %d differs", v);
    if (a.corners == 0) return;
    assert_memory_equal(a.corner_vert, b.corner_vert, (size_t)a.corners * sizeof(int32_t));
    assert_memory_equal(a.corner_twin, b.corner_twin, (size_t)a.corners * sizeof(int32_t));
}

static uint8_t bits_of(const shim_arrays* a, int32_t p, int32_t q) { /* of the edge p q; 255: there is none */
    for (int32_t c = 0; c < a->corners; ++c) {
        const int32_t x = a->corner_vert[c], y = a->corner_vert[c % 3 == 2 ? c - 2 : c + 1];
        if ((x == p && y == q) || (x == q && y == p)) return a->corner_bits_size != 0 ? a->corner_bits[c] : 0;
    }
    return 255;
}

static int32_t other_ends(const shim_arrays* a, int32_t v) { /* valence of an inner vertex */
    int32_t n = 0;
    for (int32_t c = 0; c < a->corners; ++c) n += a->corner_vert[c] == v;
    return n;
}

/* ---- one edge -------------------------------------------------------------------------------------------------------------- */

static const int32_t kPair[] = {0, 1, 2, 1, 0, 3}, kFlipped[] = {0, 3, 2, 1, 2, 3};
static const int32_t kSplit[] = {0, 4, 2, 1, 4, 3, 4, 1, 2, 4, 0, 3};
static const double kFlat[] = {0, 0, 0, 4, 0, 0, 2, 1, 0, 2, -1, 0};
static const double kBent[] = {0, 0, 0, 4, 0, 0, 2, 1, 1, 2, -1, 1}; /* by 90 degrees; a flip turns normals by 50.8 */

static void test_flat_pair(void** state) {
    (void)state;
    const delmesh_mesh_desc desc = desc_of(kFlat, 4, kPair, 6);
    shim_mesh* const in = made(&desc);
    for (int32_t mode = P; mode <= K; ++mode)
        for (int precision = DELMESH_FLOAT32; precision <= DELMESH_FLOAT64; ++precision)
            for (int boundary = 0; boundary < 2; ++boundary) {
                delmesh_remesh_options o = options_of(mode);
                o.precision = precision;
                o.boundary = boundary;
                o.tolerance = boundary ? 0 : -1;
                delmesh_remesh_report r;
                shim_mesh* const out = remeshed(in, &o, &r);
                EXPECT_CORNERS(out, kFlipped);
                assert_int_equal(r.nld_in, 1);
                assert_int_equal(r.flips, 1);
                assert_int_equal(r.flips_after + r.splits + r.guarded + r.unflippable + r.moved_within_tolerance, 0);
                assert_true(mode == P ? r.surface_bound == 0 : r.surface_bound < 0);
                const shim_arrays a = shim_mesh_arrays(out);
                assert_int_equal(bits_of(&a, 2, 3), 0);
                assert_int_equal(bits_of(&a, 0, 3), DELMESH_EDGE_SOURCE);
                assert_int_equal(a.face_source_size + a.vert_source_size + a.vert_join_size, 0); /* identities */
                shim_mesh_free(out);
            }
    shim_mesh_free(in);
}

static void expect_middle_split(shim_mesh* out, const delmesh_remesh_report* r, uint8_t bits) {
    EXPECT_CORNERS(out, kSplit);
    assert_int_equal(r->flips + r->flips_after, 0);
    assert_int_equal(r->splits, 1);
    const shim_arrays a = shim_mesh_arrays(out);
    assert_true(coordinate(&a, 4, 0) == 2 && coordinate(&a, 4, 1) == 0 && coordinate(&a, 4, 2) == 0);
    int32_t verts[3];
    double weights[3];
    assert_int_equal(a.first_split, 4);
    assert_int_equal(shim_vertex_map(out, 4, verts, weights), 1);
    assert_true(verts[0] == 0 && verts[1] == 1 && weights[0] == 0.5 && weights[1] == 0.5 && weights[2] == 0);
    static const int32_t face_source[] = {0, 1, 0, 1}, vert_source[] = {0, 1, 2, 3, -1};
    assert_int_equal(a.face_source_size, 4);
    assert_memory_equal(a.face_source, face_source, sizeof face_source);
    assert_int_equal(a.vert_source_size, 5);
    assert_memory_equal(a.vert_source, vert_source, sizeof vert_source);
    assert_int_equal(bits_of(&a, 0, 4), bits);
    assert_int_equal(bits_of(&a, 4, 1), bits);
    assert_int_equal(bits_of(&a, 4, 2), 0);
    assert_int_equal(bits_of(&a, 4, 3), 0);
    assert_int_equal(bits_of(&a, 1, 2), DELMESH_EDGE_SOURCE);
}

static void test_bent_pair(void** state) {
    (void)state;
    const delmesh_mesh_desc desc = desc_of(kBent, 4, kPair, 6);
    shim_mesh* const in = made(&desc);
    delmesh_remesh_report r;
    delmesh_remesh_options o = options_of(F);
    shim_mesh* out = remeshed(in, &o, &r);
    EXPECT_CORNERS(out, kFlipped);
    assert_int_equal(r.flips, 1);
    assert_int_equal(r.splits, 0);
    shim_mesh_free(out);

    o = inner_options_of(P);
    out = remeshed(in, &o, &r);
    expect_middle_split(out, &r, DELMESH_EDGE_SOURCE);
    assert_int_equal(r.kept_splits + r.boundary_splits + r.guarded, 0);
    assert_true(r.surface_bound >= 0 && r.surface_bound <= 0.87 * 0x1p-21);
    shim_mesh_free(out);

    /* Feature edges: kept when sharper than the angle. */
    o = inner_options_of(K);
    for (int i = 0; i < 3; ++i) {
        o.feature_angle = i == 0 ? 30 : i == 1 ? 89.99 : 90.01;
        out = remeshed(in, &o, &r);
        if (i < 2)
            expect_middle_split(out, &r, DELMESH_EDGE_SOURCE | DELMESH_EDGE_FEATURE);
        else
            EXPECT_CORNERS(out, kFlipped);
        assert_int_equal(r.kept_splits, i < 2);
        shim_mesh_free(out);
    }

    /* The guard: a flip that would turn too far is a split. */
    o = inner_options_of(F);
    for (int i = 0; i < 2; ++i) {
        o.max_normal_turn = i == 0 ? 50.7 : 50.8;
        out = remeshed(in, &o, &r);
        if (i == 0)
            expect_middle_split(out, &r, DELMESH_EDGE_SOURCE);
        else
            EXPECT_CORNERS(out, kFlipped);
        assert_int_equal(r.guarded, i == 0);
        shim_mesh_free(out);
    }

    /* With the boundary rule too, and a limit on what may be made. */
    for (int32_t mode = P; mode <= K; mode += 2) {
        o = options_of(mode);
        shim_mesh_free(remeshed(in, &o, &r));
        o = inner_options_of(mode);
        o.max_vertices = 4;
        expect_status(in, &o, DELMESH_ERROR_VERTEX_LIMIT, "limit of 4 vertices");
        o.max_vertices = 5;
        shim_mesh_free(remeshed(in, &o, &r));
    }
    shim_mesh_free(in);
}

/* A split vertex lies on the edge, wherever that is: the edge on an axis, where this is exact, and the apexes aside. */
static void test_split_off_middle(void** state) {
    (void)state;
    static const double points[] = {0, 0, 0, 4, 0, 0, 0.5, 0.25, 0.25, 0.75, -0.25, 0.25};
    const delmesh_mesh_desc desc = desc_of(points, 4, kPair, 6);
    shim_mesh* const in = made(&desc);
    for (int precision = DELMESH_FLOAT32; precision <= DELMESH_FLOAT64; ++precision)
        for (int placement = 0; placement < 2; ++placement) {
            delmesh_remesh_options o = inner_options_of(P);
            o.precision = precision;
            o.placement = placement;
            o.shell_unit = 0.25;
            delmesh_remesh_report r;
            shim_mesh* const out = remeshed(in, &o, &r);
            const shim_arrays a = shim_mesh_arrays(out);
            assert_true(r.splits >= 1);
            for (int32_t v = 4; v < a.vertices; ++v) {
                const double x = coordinate(&a, v, 0);
                assert_true(coordinate(&a, v, 1) == 0 && coordinate(&a, v, 2) == 0 && x > 0 && x < 4);
                int32_t verts[3];
                double weights[3];
                assert_int_equal(shim_vertex_map(out, v, verts, weights), 1);
                assert_true(verts[0] + verts[1] == 1 && weights[2] == 0 && weights[0] + weights[1] == 1);
                const volatile float rounded = (float)(4 * weights[verts[0] == 1 ? 0 : 1]);
                if (precision == DELMESH_FLOAT32)
                    assert_true(x == (double)rounded);
                else
                    assert_true(fabs(x - 4 * weights[verts[0] == 1 ? 0 : 1]) <= 0x1p-51);
                if (placement == DELMESH_PLACEMENT_SHELLS && v == 4) assert_true(x == 2 || x == 1); /* 0.25 x 2^k */
            }
            shim_mesh_free(out);
        }
    shim_mesh_free(in);
}

/* What the caller marked is never flipped, and its pieces stay marked and in place. */
static void test_marked(void** state) {
    (void)state;
    static const int32_t edge[] = {1, 0};
    delmesh_mesh_desc desc = desc_of(kFlat, 4, kPair, 6);
    desc.marked_edges = view_of(edge, 1, DELMESH_INT32, 2);
    shim_mesh* const in = made(&desc);
    for (int32_t mode = P; mode <= K; ++mode) {
        delmesh_remesh_options o = inner_options_of(mode);
        delmesh_remesh_report r;
        shim_mesh* out = remeshed(in, &o, &r);
        expect_middle_split(out, &r, DELMESH_EDGE_SOURCE | DELMESH_EDGE_MARKED);
        assert_int_equal(r.kept_splits, 1);
        shim_mesh_free(out);
        o = options_of(mode);
        out = remeshed(in, &o, &r);
        const shim_arrays a = shim_mesh_arrays(out);
        double marked = 0;
        for (int32_t c = 0; c < a.corners; ++c) {
            if ((a.corner_bits[c] & DELMESH_EDGE_MARKED) == 0) continue;
            const int32_t x = a.corner_vert[c], y = a.corner_vert[c % 3 == 2 ? c - 2 : c + 1];
            assert_true(coordinate(&a, x, 1) == 0 && coordinate(&a, y, 1) == 0);
            assert_int_equal(a.corner_bits[c], DELMESH_EDGE_SOURCE | DELMESH_EDGE_MARKED);
            marked += fabs(coordinate(&a, y, 0) - coordinate(&a, x, 0));
        }
        assert_true(marked == 8); /* from both sides */
        shim_mesh_free(out);
    }
    shim_mesh_free(in);
}

static void test_boundary_rule(void** state) {
    (void)state;
    static const double points[] = {0, 0, 0, 4, 0, 0, 1.5, 1, 0};
    static const int32_t corners[] = {0, 1, 2};
    const delmesh_mesh_desc desc = desc_of(points, 3, corners, 3);
    shim_mesh* const in = made(&desc);
    assert_int_equal(shim_certify(in, 1, 0).nld_boundary, 1);
    assert_true(shim_certify(in, 0, 0).delaunay);
    for (int32_t mode = P; mode <= K; ++mode) {
        delmesh_remesh_report r;
        delmesh_remesh_options o = options_of(mode);
        shim_mesh* out = remeshed(in, &o, &r);
        assert_int_equal(r.nld_in, 1);
        assert_true(r.splits >= 1 && r.boundary_splits >= 1);
        assert_int_equal(r.unflippable + r.guarded + r.kept_splits, 0);
        const shim_arrays a = shim_mesh_arrays(out);
        double area = 0;
        for (int32_t c = 0; c < a.corners; c += 3) {
            const int32_t* v = a.corner_vert + c;
            const double ux = coordinate(&a, v[1], 0) - coordinate(&a, v[0], 0),
                         uy = coordinate(&a, v[1], 1) - coordinate(&a, v[0], 1);
            const double wx = coordinate(&a, v[2], 0) - coordinate(&a, v[0], 0),
                         wy = coordinate(&a, v[2], 1) - coordinate(&a, v[0], 1);
            assert_true(ux * wy - uy * wx > 0);
            area += (ux * wy - uy * wx) / 2;
        }
        assert_true(fabs(area - 2) < 1e-5);
        shim_mesh_free(out);
        o = inner_options_of(mode);
        out = remeshed(in, &o, &r);
        EXPECT_CORNERS(out, corners);
        assert_int_equal(r.nld_in + r.splits + r.flips, 0);
        shim_mesh_free(out);
    }
    shim_mesh_free(in);
}

/* Ties are Delaunay: right angles on the boundary, a square's diagonal. Nothing is touched, in no mode. */
static void test_already_delaunay(void** state) {
    (void)state;
    soup s = sheet(5, 4, 1, 0, 0);
    shim_mesh* const in = made_of_soup(&s);
    for (int32_t mode = P; mode <= K; ++mode)
        for (int precision = DELMESH_FLOAT32; precision <= DELMESH_FLOAT64; ++precision) {
            delmesh_remesh_options o = options_of(mode);
            o.precision = precision;
            delmesh_remesh_report r;
            shim_mesh* const out = remeshed(in, &o, &r);
            expect_equal(in, out, 1, 1);
            assert_int_equal(r.nld_in + r.flips + r.flips_after + r.splits, 0);
            const shim_arrays a = shim_mesh_arrays(out);
            assert_int_equal(a.face_source_size + a.vert_source_size + a.vert_join_size, 0);
            shim_mesh_free(out);
        }
    free_soup(&s);
    shim_mesh_free(in);
}

/* ---- edges that cannot be flipped ------------------------------------------------------------------------------------------ */

/* p 0, q 1 far apart; u 2, v 3 close to the middle of p q and joined by an edge elsewhere. */
static const double kExposed[] = {-3, 0, 0.5, 3, 0, 0, 0, 0.3125, 0, 0, -0.3125, 0, 1, 0, -3};

static void expect_unflippable(int32_t vertices, const int32_t* corners, int64_t count, int kind) {
    const delmesh_mesh_desc desc = desc_of(kExposed, vertices, corners, count);
    shim_mesh* const in = made(&desc);
    delmesh_remesh_report r;
    delmesh_remesh_options o = inner_options_of(F);
    shim_mesh* const out = remeshed(in, &o, &r);
    assert_true(r.nld_in >= 1);
    assert_int_equal(r.flips, 0);
    assert_int_equal(r.unflippable, 1);
    assert_int_equal(r.unflippable_2, kind == 2);
    assert_int_equal(r.unflippable_3, kind == 3);
    assert_int_equal(r.unflippable_4, kind == 4);
    const shim_arrays a = shim_mesh_arrays(out);
    assert_int_equal(bits_of(&a, 0, 1), 255);
    shim_mesh_free(out);
    shim_mesh_free(in);
}

static void test_exposed(void** state) {
    (void)state;
    /* q's neighbour w 4 keeps u v apart from both faces. */
    static const int32_t two[] = {0, 1, 2, 1, 0, 3, 1, 3, 4, 2, 1, 4, 2, 4, 3};
    static const int32_t three[] = {0, 1, 2, 1, 0, 3, 0, 2, 3}; /* u v p is a face */
    static const int32_t four[] = {0, 1, 2, 1, 0, 3, 0, 2, 3, 1, 3, 2};
    expect_unflippable(5, two, COUNT(two), 2);
    expect_unflippable(4, three, COUNT(three), 3);
    expect_unflippable(4, four, COUNT(four), 4);
}

/* Past the budget unflippable edges are split as any bent edge is: Algorithm 1. */
static void test_split_budget(void** state) {
    (void)state;
    enum { kCopies = 6 };
    double points[12 * kCopies];
    int32_t corners[9 * kCopies];
    static const int32_t three[] = {0, 1, 2, 1, 0, 3, 0, 2, 3};
    for (int32_t i = 0; i < kCopies; ++i) {
        for (int k = 0; k < 12; ++k) points[12 * i + k] = kExposed[k] + (k % 3 == 1 ? 8. * i : 0);
        for (int k = 0; k < 9; ++k) corners[9 * i + k] = 4 * i + three[k];
    }
    const delmesh_mesh_desc desc = desc_of(points, 4 * kCopies, corners, 9 * kCopies);
    shim_mesh* const in = made(&desc);
    for (int32_t mode = F; mode <= K; ++mode)
        for (int64_t budget = 0; budget < 4; ++budget) {
            delmesh_remesh_options o = inner_options_of(mode);
            o.feature_angle = 180;
            o.split_budget = budget;
            delmesh_remesh_report r;
            shim_mesh* const out = remeshed(in, &o, &r);
            assert_int_equal(r.unflippable, budget == 0 ? kCopies : budget);
            assert_true(r.splits >= kCopies);
            shim_mesh_free(out);
        }
    shim_mesh_free(in);
}

/* ---- preserve: the tolerance ----------------------------------------------------------------------------------------------- */

static void test_tolerance(void** state) {
    (void)state;
    double points[12];
    memcpy(points, kFlat, sizeof points);
    points[8] = 0x1p-21; /* one unit in the last place of the largest coordinate, 4 */
    const delmesh_mesh_desc desc = desc_of(points, 4, kPair, 6);
    shim_mesh* const in = made(&desc);
    delmesh_remesh_report r;
    delmesh_remesh_options o = inner_options_of(P);
    shim_mesh* out = remeshed(in, &o, &r);
    EXPECT_CORNERS(out, kFlipped);
    assert_int_equal(r.splits, 0);
    assert_true(r.surface_bound > 0 && r.surface_bound <= 4 * 0x1p-21);
    shim_mesh_free(out);
    o.tolerance = 0;
    out = remeshed(in, &o, &r);
    expect_middle_split(out, &r, DELMESH_EDGE_SOURCE);
    shim_mesh_free(out);
    /* In double precision the unit is smaller, and the same bend is a bend. */
    o.tolerance = -1;
    o.precision = DELMESH_FLOAT64;
    out = remeshed(in, &o, &r);
    expect_middle_split(out, &r, DELMESH_EDGE_SOURCE);
    shim_mesh_free(out);
    o.tolerance = 0x1p-19;
    out = remeshed(in, &o, &r);
    EXPECT_CORNERS(out, kFlipped);
    assert_true(r.surface_bound > 0 && r.surface_bound <= 0x1p-19);
    shim_mesh_free(out);
    shim_mesh_free(in);
}

/* ---- repairs --------------------------------------------------------------------------------------------------------------- */

/* Spokes round 0, two of which end at one place: a needle on the rim. The smaller of the two vertices stays, whichever way round
 * the needle is. */
static void test_needle(void** state) {
    (void)state;
    static const double up[] = {0, 0, 0, 4, 0, 0, 4, 0, 0, 2, 3, 0, -2, 3, 0, -4, 0, 0, -1, -3, 0};   /* 1 and 2 */
    static const double down[] = {0, 0, 0, 4, 0, 0, 2, 3, 0, -2, 3, 0, -4, 0, 0, -1, -3, 0, 4, 0, 0}; /* 6 and 1 */
    static const int32_t corners[] = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5, 0, 5, 6, 0, 6, 1};
    static const int32_t without_2[] = {0, 1, 3, 0, 3, 4, 0, 4, 5, 0, 5, 6, 0, 6, 1};
    static const int32_t without_6[] = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5, 0, 5, 1};
    for (int turned = 0; turned < 2; ++turned) {
        const delmesh_mesh_desc desc = desc_of(turned ? down : up, 7, corners, COUNT(corners));
        shim_mesh* const in = made(&desc);
        for (int32_t mode = P; mode <= K; ++mode) {
            delmesh_remesh_options o = inner_options_of(mode);
            delmesh_remesh_report r;
            shim_mesh* const out = remeshed(in, &o, &r);
            assert_int_equal(r.collapsed_edges, 1);
            assert_int_equal(r.removed_zero_area_faces + r.splits + r.flips, 0);
            assert_int_equal(r.vertices_out, 7); /* the vertex that went is where it was, unused */
            assert_int_equal(shim_mesh_info(out).isolated_vertices, 1);
            const shim_arrays a = shim_mesh_arrays(out);
            for (int32_t f = 0; f < 5; ++f) assert_int_equal(a.face_source[f], turned ? f : f + 1);
            expect_corners(out, turned ? without_6 : without_2, 15);
            shim_mesh_free(out);
            o.strict = 1;
            expect_status(in, &o, DELMESH_ERROR_STRICT, turned ? "Face 5 had no area" : "Face 0 had no area");
        }
        shim_mesh_free(in);
    }
}

/* The same inside a pyramid without a base: 5 is where its tip, 4, is, and both faces of 4 5 are needles. */
static void test_needle_inside(void** state) {
    (void)state;
    static const double points[] = {3, 0, 0, 0, 3, 0, -3, 0, 0, 0, -3, 0, 0, 0, 1, 0, 0, 1};
    static const int32_t corners[] = {0, 1, 5, 1, 4, 5, 1, 2, 4, 2, 3, 4, 3, 5, 4, 3, 0, 5};
    static const int32_t collapsed[] = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4};
    const delmesh_mesh_desc desc = desc_of(points, 6, corners, COUNT(corners));
    shim_mesh* const in = made(&desc);
    for (int32_t mode = P; mode <= K; ++mode) {
        delmesh_remesh_options o = inner_options_of(mode);
        delmesh_remesh_report r;
        shim_mesh* const out = remeshed(in, &o, &r);
        EXPECT_CORNERS(out, collapsed);
        assert_int_equal(r.collapsed_edges, 1);
        assert_int_equal(shim_mesh_info(out).components, 1);
        assert_int_equal(shim_mesh_info(out).isolated_vertices, 1);
        shim_mesh_free(out);
    }
    shim_mesh_free(in);
}

/* Distinct in double precision, coincident in single. */
static void test_needle_by_rounding(void** state) {
    (void)state;
    static const double points[] = {0, 0, 0, 4, 0, 0, 2, 3, 0, -2, 3, 0, -4, 0, 0, -1, -3, 0, 4, -0x1p-200, 0};
    static const int32_t corners[] = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5, 0, 5, 6, 0, 6, 1};
    const delmesh_mesh_desc desc = desc_of(points, 7, corners, COUNT(corners));
    shim_mesh* const in = made(&desc);
    delmesh_remesh_options o = inner_options_of(P);
    delmesh_remesh_report r;
    shim_mesh* out = remeshed(in, &o, &r);
    assert_int_equal(r.collapsed_edges, 1);
    assert_int_equal(r.faces_out, 5);
    shim_mesh_free(out);
    o.precision = DELMESH_FLOAT64;
    o.strict = 1;
    out = remeshed(in, &o, &r);
    assert_int_equal(r.collapsed_edges, 0);
    assert_int_equal(r.faces_out, 6);
    shim_mesh_free(out);
    shim_mesh_free(in);
}

/* 2 lies on 0 1: the face 0 1 2 has no area. */
static void test_caps(void** state) {
    (void)state;
    static const double points[] = {0, 0, 0, 4, 0, 0, 2, 0, 0, 2, 2, 0, 2, -2, 0};
    static const int32_t inside[] = {0, 1, 2, 1, 0, 4, 0, 2, 3, 2, 1, 3};
    static const int32_t flipped[] = {0, 4, 2, 1, 2, 4, 0, 2, 3, 2, 1, 3};
    static const int32_t boundary[] = {0, 1, 2, 0, 2, 3, 2, 1, 3}, removed[] = {0, 2, 3, 2, 1, 3};
    for (int32_t mode = P; mode <= K; ++mode) {
        delmesh_remesh_options o = options_of(mode);
        delmesh_remesh_report r;
        delmesh_mesh_desc desc = desc_of(points, 5, inside, COUNT(inside));
        shim_mesh* in = made(&desc);
        shim_mesh* out = remeshed(in, &o, &r);
        EXPECT_CORNERS(out, flipped);
        assert_int_equal(r.removed_zero_area_faces, 1);
        assert_int_equal(r.collapsed_edges + r.flips + r.splits, 0);
        shim_mesh_free(out);
        o.strict = 1;
        expect_status(in, &o, DELMESH_ERROR_STRICT, "Face 0 had no area");
        shim_mesh_free(in);
        o.strict = 0;
        desc = desc_of(points, 4, boundary, COUNT(boundary));
        in = made(&desc);
        out = remeshed(in, &o, &r);
        EXPECT_CORNERS(out, removed);
        assert_int_equal(r.removed_zero_area_faces, 1);
        assert_int_equal(r.collapsed_edges + r.flips + r.splits, 0);
        shim_mesh_free(out);
        shim_mesh_free(in);
    }
}

static void test_refusals(void** state) {
    (void)state;
    static const double line[] = {0, 0, 0, 1, 2, 3, 2, 4, 6, 3, 6, 9};
    delmesh_mesh_desc desc = desc_of(line, 4, kPair, 6);
    shim_mesh* in = made(&desc);
    delmesh_remesh_options o = options_of(P);
    expect_status(in, &o, DELMESH_ERROR_NO_SURFACE, "No face had any area");
    o.strict = 1;
    expect_status(in, &o, DELMESH_ERROR_NO_SURFACE, "No face had any area");
    shim_mesh_free(in);
    desc = desc_of(line, 4, NULL, 0);
    in = made(&desc);
    o.strict = 0;
    expect_status(in, &o, DELMESH_ERROR_NO_SURFACE, "no face");
    shim_mesh_free(in);
    /* Past float32's range; vertex 4 too, but nobody uses it. */
    static const double far[] = {0, 0, 0, 4e38, 0, 0, 2e38, 1e38, 0, 2e38, -1e38, 0, 1e300, 0, 0};
    desc = desc_of(far, 5, kPair, 6);
    in = made(&desc);
    expect_status(in, &o, DELMESH_ERROR_PRECISION, "Vertex 1 was out");
    o.precision = DELMESH_FLOAT64;
    delmesh_remesh_report r;
    shim_mesh* out = remeshed(in, &o, &r);
    EXPECT_CORNERS(out, kFlipped);
    shim_mesh_free(out);
    shim_mesh_free(in);
}

/* ---- sheets cut at import -------------------------------------------------------------------------------------------------- */

/* Every split vertex on the spine, y = z = 0, has a copy on each sheet, and joining leads to one vertex. */
static int32_t check_spine(shim_mesh* out, int32_t sheets) {
    const shim_arrays a = shim_mesh_arrays(out);
    assert_int_equal(a.vert_join_size, a.vertices);
    int32_t places = 0;
    for (int32_t v = a.first_split; v < a.vertices; ++v) {
        if (coordinate(&a, v, 1) != 0 || coordinate(&a, v, 2) != 0) continue;
        int32_t copies = 0;
        for (int32_t w = a.first_split; w < a.vertices; ++w) {
            const int joined = a.vert_join[v] == a.vert_join[w];
            const int here =
                coordinate(&a, v, 0) == coordinate(&a, w, 0) && coordinate(&a, w, 1) == 0 && coordinate(&a, w, 2) == 0;
            assert_int_equal(joined, here);
            copies += here;
        }
        assert_int_equal(copies, sheets);
        assert_int_equal(a.vert_join[a.vert_join[v]], a.vert_join[v]);
        places += a.vert_join[v] == v;
    }
    return places;
}

static const double kPages[] = {0, 0, 0, 4, 0, 0, 1, 1, 0, 2, -0.5, 1, 2.5, -0.5, -1};

static void test_three_pages(void** state) {
    (void)state;
    static const int32_t corners[] = {0, 1, 2, 1, 0, 3, 0, 1, 4};
    const delmesh_mesh_desc desc = desc_of(kPages, 5, corners, COUNT(corners));
    shim_mesh* const in = made(&desc);
    assert_int_equal(shim_mesh_info(in).nonmanifold_edges, 1);
    for (int32_t mode = P; mode <= K; ++mode)
        for (int placement = 0; placement < 2; ++placement) {
            delmesh_remesh_options o = options_of(mode);
            o.placement = placement;
            delmesh_remesh_report r;
            shim_mesh* const out = remeshed(in, &o, &r);
            assert_true(check_spine(out, 3) >= 1);
            const shim_arrays a = shim_mesh_arrays(out);
            for (int32_t v = a.first_split; v < a.vertices; ++v) { /* each copy on the very line of its sources */
                int32_t verts[3];
                double weights[3], x = 0;
                shim_vertex_map(out, v, verts, weights);
                for (int k = 0; k < 3; ++k) x += weights[k] * kPages[3 * verts[k]];
                assert_true(fabs(x - coordinate(&a, v, 0)) < 1e-6);
            }
            shim_mesh_free(out);
        }
    shim_mesh_free(in);
}

/* The spine 0 1 2 has a piece of no length, 0 1. On the second page the sheet's copies come in the other order, so that there
 * the copy of 1 may be the one that stays: the copies of the long piece must go on being split at the same places. */
static void test_pages_with_needles(void** state) {
    (void)state;
    static const double points[] = {0, 0, 0, 0, 0, 0, 4, 0, 0, 1, 1, 0, 2, -0.5, 1, 2.5, -0.5, -1};
    static const int32_t corners[] = {0, 1, 3, 1, 2, 3, 1, 0, 4, 2, 1, 4, 5, 0, 1, 5, 1, 2};
    static const int32_t turned[] = {2, 1, 3, 1, 0, 3, 1, 2, 4, 0, 1, 4, 2, 1, 5, 1, 0, 5};
    for (int which = 0; which < 2; ++which) {
        const delmesh_mesh_desc desc = desc_of(points, 6, which ? turned : corners, 18);
        shim_mesh* const in = made(&desc);
        assert_int_equal(shim_mesh_info(in).nonmanifold_edges, 2);
        for (int32_t mode = P; mode <= K; ++mode) {
            delmesh_remesh_options o = options_of(mode);
            delmesh_remesh_report r;
            shim_mesh* const out = remeshed(in, &o, &r);
            assert_int_equal(r.collapsed_edges, 3);
            assert_true(check_spine(out, 3) >= 1);
            const shim_arrays a = shim_mesh_arrays(out);
            for (int32_t v = a.first_split; v < a.vertices; ++v) {
                int32_t verts[3];
                double weights[3], x = 0;
                shim_vertex_map(out, v, verts, weights);
                for (int k = 0; k < 3; ++k) x += weights[k] * points[3 * verts[k]];
                if (!(fabs(x - coordinate(&a, v, 0)) < 1e-6)) fail_msg("vertex %d's sources say x = %g", v, x);
            }
            /* The used ends of the three sheets are joined. */
            for (int end = 0; end < 2; ++end) {
                int32_t root = -1;
                for (int32_t v = 0; v < a.first_split; ++v) {
                    if (coordinate(&a, v, 0) != 4. * end || coordinate(&a, v, 1) != 0 || other_ends(&a, v) == 0) continue;
                    if (root < 0) root = a.vert_join[v];
                    if (a.vert_join[v] != root) fail_msg("end %d: vertex %d joins %d, not %d", end, v, a.vert_join[v], root);
                }
            }
            shim_mesh_free(out);
        }
        shim_mesh_free(in);
    }
}

/* compact drops the page on which the others' roots lie (it has no area): they stay joined to each other. */
static void test_compact_keeps_joins(void** state) {
    (void)state;
    static const double points[] = {0, 0, 0, 4, 0, 0, 2, 0, 0, 2, -3, 3, 2, -3, -3};
    static const int32_t corners[] = {0, 1, 2, 1, 0, 3, 0, 1, 4};
    const delmesh_mesh_desc desc = desc_of(points, 5, corners, COUNT(corners));
    shim_mesh* const in = made(&desc);
    for (int compact = 0; compact < 2; ++compact) {
        delmesh_remesh_options o = options_of(P);
        o.compact = compact;
        delmesh_remesh_report r;
        shim_mesh* const out = remeshed(in, &o, &r);
        assert_int_equal(r.removed_zero_area_faces, 1);
        assert_int_equal(r.faces_out, 2);
        const shim_arrays a = shim_mesh_arrays(out);
        for (int end = 0; end < 2; ++end) {
            int32_t roots[2], n = 0;
            for (int32_t v = 0; v < a.vertices; ++v)
                if (other_ends(&a, v) > 0 && coordinate(&a, v, 0) == 4. * end && n < 2) roots[n++] = a.vert_join[v];
            assert_int_equal(n, 2);
            if (roots[0] != roots[1]) fail_msg("compact %d, end %d: the sheets join %d and %d", compact, end, roots[0], roots[1]);
        }
        shim_mesh_free(out);
    }
    shim_mesh_free(in);
}

static void test_compact(void** state) {
    (void)state;
    static const double points[] = {9, 9, 9, 0, 0, 0, 4, 0, 0, 8, 8, 8, 2, 1, 1, 2, -1, 1, 7, 7, 7};
    static const int32_t corners[] = {1, 2, 4, 2, 1, 5};
    const delmesh_mesh_desc desc = desc_of(points, 7, corners, 6);
    shim_mesh* const in = made(&desc);
    for (int32_t mode = P; mode <= F; ++mode) {
        delmesh_remesh_options o = inner_options_of(mode);
        delmesh_remesh_report r;
        o.compact = 1;
        shim_mesh* out = remeshed(in, &o, &r);
        const shim_arrays a = shim_mesh_arrays(out);
        static const int32_t source[] = {1, 2, 4, 5, -1};
        assert_int_equal(a.vertices, mode == P ? 5 : 4);
        assert_int_equal(a.vert_source_size, a.vertices);
        assert_memory_equal(a.vert_source, source, (size_t)a.vertices * sizeof(int32_t));
        for (int32_t v = 0; v < 4; ++v)
            for (int k = 0; k < 3; ++k) assert_true(coordinate(&a, v, k) == points[3 * source[v] + k]);
        if (mode == P) {
            EXPECT_CORNERS(out, kSplit);
            int32_t verts[3];
            double weights[3];
            assert_int_equal(shim_vertex_map(out, 4, verts, weights), 1);
            assert_true(verts[0] == 1 && verts[1] == 2); /* the source's numbers */
        } else
            EXPECT_CORNERS(out, kFlipped);
        assert_int_equal(shim_mesh_info(out).isolated_vertices, 0);
        shim_mesh_free(out);
        o.compact = 0;
        out = remeshed(in, &o, &r);
        assert_int_equal(shim_mesh_info(out).isolated_vertices, 3);
        shim_mesh_free(out);
    }
    shim_mesh_free(in);
}

/* ---- laws ------------------------------------------------------------------------------------------------------------------ */

enum { kMeshes = 8 };
static soup generated(int i) {
    switch (i) {
    case 0:
        return torus(14, 9, 0.25, 1);
    case 1:
        return torus(24, 6, 0.1, 2);
    case 2:
        return sheet(7, 9, 2.5, 0.35, 3);
    case 3:
        return sheet(12, 5, 1, 0.3, 4);
    case 4:
        return fan(19, 5);
    case 5:
        return fan(60, 6);
    case 6:
        return book(3, 4, 0.3, 7);
    default:
        return sheet(9, 6, 6, 0, 8); /* flat and stretched: NLD nowhere, or ties, until it is sheared */
    }
}
static soup generated_sheared(int i) {
    soup s = generated(i);
    if (i == kMeshes - 1)
        for (int32_t v = 0; v < s.vertices; ++v)
            set_point(&s, v, s.points[3 * v] - 9 * s.points[3 * v + 1], s.points[3 * v + 1], s.points[3 * v + 2]);
    return s;
}

static double area_of(const shim_arrays* a) {
    double sum = 0;
    for (int32_t c = 0; c < a->corners; c += 3) {
        double u[3], w[3];
        for (int k = 0; k < 3; ++k) {
            u[k] = coordinate(a, a->corner_vert[c + 1], k) - coordinate(a, a->corner_vert[c], k);
            w[k] = coordinate(a, a->corner_vert[c + 2], k) - coordinate(a, a->corner_vert[c], k);
        }
        const double x = u[1] * w[2] - u[2] * w[1], y = u[2] * w[0] - u[0] * w[2], z = u[0] * w[1] - u[1] * w[0];
        sum += sqrt(x * x + y * y + z * z) / 2;
    }
    return sum;
}

static double unit_of(const shim_arrays* a, int32_t precision) { /* in the last place of the largest coordinate in use */
    double largest = 0;
    for (int32_t c = 0; c < a->corners; ++c)
        for (int k = 0; k < 3; ++k) largest = fmax(largest, fabs(coordinate(a, a->corner_vert[c], k)));
    int exponent;
    frexp(largest, &exponent);
    return ldexp(1, exponent - (precision == DELMESH_FLOAT32 ? 24 : 53));
}

/* Split vertices of preserve lie within 0.87 units of the line between two source vertices, and where the map says. */
static void check_maps(shim_mesh* in, shim_mesh* out, const delmesh_remesh_options* o, int64_t tally[2]) {
    const shim_arrays a = shim_mesh_arrays(in), b = shim_mesh_arrays(out);
    const long double limit = 0.87L * (long double)unit_of(&b, o->precision);
    for (int32_t v = 0; v < b.vertices; ++v) {
        int32_t verts[3];
        double weights[3];
        const int32_t split = shim_vertex_map(out, v, verts, weights);
        assert_int_equal(split, v >= a.vertices);
        double sum = 0;
        for (int k = 0; k < 3; ++k) {
            assert_true(verts[k] >= 0 && verts[k] < a.vertices && weights[k] >= 0);
            sum += weights[k];
        }
        assert_true(fabs(sum - 1) <= 2 * DBL_EPSILON);
        if (!split) continue;
        if (o->mode != P) continue;
        const int on_edge = weights[2] == 0; /* else inside a flat patch, on an edge that a flip made */
        ++tally[on_edge];
        assert_true(verts[0] != verts[1]);
        long double d[3], w[3], dd = 0, dw = 0, ww = 0, off = 0;
        for (int k = 0; k < 3; ++k) {
            const long double p = (long double)coordinate(&a, verts[0], k), q = (long double)coordinate(&a, verts[1], k);
            const long double x = (long double)coordinate(&b, v, k);
            d[k] = q - p;
            w[k] = x - p;
            dd += d[k] * d[k];
            dw += d[k] * w[k];
            ww += w[k] * w[k];
            const long double r = (long double)coordinate(&a, verts[2], k);
            const long double there = (long double)weights[0] * p + (long double)weights[1] * q + (long double)weights[2] * r - x;
            off += there * there;
        }
        long double line = 0;
        for (int k = 0; k < 3; ++k) line += (w[k] - dw / dd * d[k]) * (w[k] - dw / dd * d[k]);
        if (on_edge && !(sqrtl(line) <= limit))
            fail_msg("split vertex %d lies %g units off its line", v, (double)(sqrtl(line) / limit * 0.87L));
        /* In double precision the weights' own rounding adds about as much again; a patch has a thickness. */
        const int allowance = !on_edge ? 16 : o->precision == DELMESH_FLOAT32 ? 1 : 4;
        if (!(sqrtl(off) <= allowance * limit))
            fail_msg("split vertex %d lies %g units from where its map says", v, (double)(sqrtl(off) / limit * 0.87L));
    }
}

static void test_laws(void** state) {
    (void)state;
    int64_t splits[3] = {0, 0, 0}, flips[3] = {0, 0, 0}, splitless = 0, tally[2] = {0, 0};
    for (int i = 0; i < kMeshes; ++i) {
        soup s = generated_sheared(i);
        shim_mesh* const in = made_of_soup(&s);
        const shim_arrays a = shim_mesh_arrays(in);
        for (int32_t mode = P; mode <= K; ++mode)
            for (int precision = DELMESH_FLOAT32; precision <= DELMESH_FLOAT64; ++precision)
                for (int boundary = 0; boundary < 2; ++boundary) {
                    delmesh_remesh_options o = options_of(mode);
                    o.precision = precision;
                    o.boundary = boundary;
                    delmesh_remesh_report r;
                    shim_mesh* const out = remeshed(in, &o, &r);
                    const shim_arrays b = shim_mesh_arrays(out);
                    check_maps(in, out, &o, tally);
                    splits[mode] += r.splits;
                    flips[mode] += r.flips + r.flips_after;
                    if (mode == P) assert_true(r.surface_bound >= 0 && r.surface_bound <= 4 * unit_of(&b, precision));
                    if (mode == F && r.splits == 0) {
                        assert_true(area_of(&b) <= area_of(&a) * (1 + 1e-12));
                        ++splitless;
                    }
                    shim_mesh_free(out);
                }
        shim_mesh_free(in);
        free_soup(&s);
    }
    for (int32_t mode = P; mode <= K; ++mode) assert_true(splits[mode] > 50 && flips[mode] > 50); /* there was something to do */
    assert_true(splitless > 0);
    assert_true(tally[1] > 500 && tally[0] * 20 < tally[1]); /* nearly all lie on edges of the source */
}

/* Remeshing a result changes nothing, and tells where its vertices are in the mesh it was given. */
static void test_chain(void** state) {
    (void)state;
    for (int i = 0; i < kMeshes; ++i) {
        soup s = generated_sheared(i);
        shim_mesh* const in = made_of_soup(&s);
        for (int32_t mode = P; mode <= K; ++mode)
            for (int precision = DELMESH_FLOAT32; precision <= DELMESH_FLOAT64; ++precision) {
                delmesh_remesh_options o = options_of(mode);
                o.precision = precision;
                delmesh_remesh_report r;
                shim_mesh* const once = remeshed(in, &o, &r);
                shim_mesh* const twice = remeshed(once, &o, &r);
                assert_int_equal(r.nld_in + r.flips + r.splits, 0);
                expect_equal(once, twice, 1, 1);
                const shim_arrays a = shim_mesh_arrays(once), b = shim_mesh_arrays(twice);
                assert_int_equal(b.first_split, b.vertices);
                for (int32_t v = a.first_split; v < b.vertices; ++v)
                    assert_int_equal(b.vert_source_size != 0 ? b.vert_source[v] : v, v);
                shim_mesh_free(twice);
                shim_mesh_free(once);
            }
        shim_mesh_free(in);
        free_soup(&s);
    }
}

/* Also where the second call adds vertices and the first one's are renumbered: its source is the first one's result. */
static void test_chain_maps(void** state) {
    (void)state;
    enum { kUnused = 500 };
    int64_t tally[2] = {0, 0};
    for (int i = 0; i < kMeshes; ++i) {
        soup s = generated_sheared(i), shifted = soup_of(s.vertices + kUnused, s.faces);
        memcpy(shifted.points + 3 * kUnused, s.points, (size_t)s.vertices * 3 * sizeof(double));
        for (int32_t c = 0; c < 3 * s.faces; ++c) shifted.corners[c] = s.corners[c] + kUnused;
        shim_mesh* const in = made_of_soup(&shifted);
        for (int compact = 0; compact < 2; ++compact)
            for (int32_t mode = P; mode <= F; ++mode) {
                delmesh_remesh_options o = inner_options_of(mode);
                o.compact = compact;
                delmesh_remesh_report r;
                shim_mesh* const once = remeshed(in, &o, &r);
                o = options_of(P);
                shim_mesh* const twice = remeshed(once, &o, &r);
                check_maps(once, twice, &o, tally);
                shim_mesh_free(twice);
                shim_mesh_free(once);
            }
        shim_mesh_free(in);
        free_soup(&shifted);
        free_soup(&s);
    }
    assert_true(tally[1] > 100);
}

static void test_similarity(void** state) {
    (void)state;
    for (int i = 0; i < kMeshes; ++i) {
        soup s = generated_sheared(i);
        shim_mesh* const in = made_of_soup(&s);
        for (int k = 0; k < 3; ++k) {
            soup t = copy_of_soup(&s);
            const double scale = k == 0 ? 32 : k == 1 ? 0x1p-40 : 1, scale_x = k == 2 ? -1 : scale;
            for (int32_t j = 0; j < 3 * t.vertices; ++j) t.points[j] *= j % 3 == 0 ? scale_x : scale;
            shim_mesh* const other = made_of_soup(&t);
            for (int32_t mode = P; mode <= K; ++mode)
                for (int placement = 0; placement < 2; ++placement) {
                    delmesh_remesh_options o = options_of(mode);
                    o.precision = (i + k + mode) % 2 == 0 ? DELMESH_FLOAT32 : DELMESH_FLOAT64;
                    o.placement = placement;
                    delmesh_remesh_report r, q;
                    shim_mesh* const one = remeshed(in, &o, &r);
                    shim_mesh* const two = remeshed(other, &o, &q);
                    expect_equal(one, two, scale_x, scale);
                    assert_int_equal(r.flips, q.flips);
                    assert_true(r.surface_bound < 0 || r.surface_bound * scale == q.surface_bound);
                    shim_mesh_free(one);
                    shim_mesh_free(two);
                }
            shim_mesh_free(other);
            free_soup(&t);
        }
        shim_mesh_free(in);
        free_soup(&s);
    }
}

static void test_threads(void** state) {
    (void)state;
    soup s = torus(120, 90, 0.2, 11); /* some blocks for each thread */
    shim_mesh* const in = made_of_soup(&s);
    for (int32_t mode = P; mode <= F; ++mode) {
        delmesh_remesh_options o = options_of(mode);
        delmesh_remesh_report r, q;
        shim_mesh* const one = remeshed(in, &o, &r);
        for (int32_t threads = 2; threads <= 4; threads += 2) {
            shim_mesh* const many = shim_remesh(in, &o, threads, &q);
            assert_int_equal(shim_mesh_status(many), DELMESH_OK);
            expect_equal(one, many, 1, 1);
            const shim_arrays a = shim_mesh_arrays(one), b = shim_mesh_arrays(many);
            assert_memory_equal(a.pos32, b.pos32, (size_t)a.pos32_size * sizeof(float));
            assert_memory_equal(a.corner_bits, b.corner_bits, (size_t)a.corner_bits_size * sizeof *a.corner_bits);
            assert_memory_equal(&r.nld_in, &q.nld_in,
                                offsetof(delmesh_remesh_report, seconds_total) - offsetof(delmesh_remesh_report, nld_in));
            shim_mesh_free(many);
        }
        shim_mesh_free(one);
    }
    shim_mesh_free(in);
    free_soup(&s);
}

/* The height of a mesh without overhangs above (x, y); NAN beside it. */
static double height_at(const shim_arrays* a, double x, double y) {
    for (int32_t c = 0; c < a->corners; c += 3) {
        const int32_t* v = a->corner_vert + c;
        double w[3], sum = 0, z = 0;
        for (int k = 0; k < 3; ++k) {
            const int32_t p = v[(k + 1) % 3], q = v[(k + 2) % 3];
            const double px = coordinate(a, p, 0) - x, py = coordinate(a, p, 1) - y;
            w[k] = px * (coordinate(a, q, 1) - y) - py * (coordinate(a, q, 0) - x);
            sum += w[k];
        }
        if (!(w[0] > 0 && w[1] > 0 && w[2] > 0)) continue;
        for (int k = 0; k < 3; ++k) z += w[k] / sum * coordinate(a, v[k], 2);
        return z;
    }
    return NAN;
}

/* A sheet that is flat up to a few units in the last place: what flips move stays within the tolerance, and within the bound the
 * report gives, both measured here by interpolation. What is rougher than that is split. */
static void test_slab(void** state) {
    (void)state;
    double worst = 0;
    for (int rough = 1; rough <= 64; rough *= 2) {
        uint64_t seed = 21;
        soup s = sheet(9, 8, 3, 0.2, 20);
        const double unit = 0x1p-18; /* of float32 coordinates from 32 to 64 */
        for (int32_t v = 0; v < s.vertices; ++v)
            set_point(&s, v, s.points[3 * v] - 5 * s.points[3 * v + 1], s.points[3 * v + 1],
                      unit * rough * random_unit(&seed) / 2);
        shim_mesh* const in = made_of_soup(&s);
        const shim_arrays a = shim_mesh_arrays(in);
        assert_true(unit_of(&a, DELMESH_FLOAT32) == unit);
        for (int limit = 0; limit < 3; ++limit) {
            delmesh_remesh_options o = inner_options_of(P);
            o.tolerance = limit == 0 ? -1 : limit == 1 ? 0 : 10 * unit;
            const double tolerance = limit == 0 ? 4 * unit : limit == 1 ? 0.87 * unit : 10 * unit;
            delmesh_remesh_report r;
            shim_mesh* const out = remeshed(in, &o, &r);
            const shim_arrays b = shim_mesh_arrays(out);
            assert_true(r.surface_bound >= 0 && r.surface_bound <= tolerance);
            if (limit == 1) assert_true(r.flips == 0 && r.splits > 0);
            if (limit == 0 && rough == 1) assert_true(r.flips > 50 && r.splits < 100); /* at tolerance 0: hundreds */
            if (limit == 0 && rough == 64) assert_true(r.splits > 200);
            double moved = 0;
            int found = 0;
            for (int i = 0; i < 400; ++i) {
                const double y = 4 + 4 * random_unit(&seed), x = 13.5 + 13.5 * random_unit(&seed) - 5 * y;
                const double d = height_at(&a, x, y) - height_at(&b, x, y);
                if (isnan(d)) continue;
                ++found;
                moved = fmax(moved, fabs(d));
            }
            assert_true(found > 200);
            if (!(moved <= r.surface_bound * 1.0001)) /* heights are a little longer than distances */
                fail_msg("roughness %d: moved by %g units, bound %g", rough, moved / unit, r.surface_bound / unit);
            if (limit == 0) worst = fmax(worst, moved);
            shim_mesh_free(out);
        }
        shim_mesh_free(in);
        free_soup(&s);
    }
    assert_true(worst > 0x1p-20); /* the tolerance was made use of */
}

/* certify finds just what asking about every edge finds, in number and in place. */
static void test_certify(void** state) {
    (void)state;
    int64_t interior = 0, boundary_edges = 0, zero = 0;
    /* Also past what float32 can square, below its range, and where the squares of doubles end. */
    static const double scales[] = {1, 0x1p59, 0x1p70, 0x1p-45, 0x1p-70, 0x1p-140, 0x1p300, 0x1p-520, 0x1p520};
    for (int i = 0; i < 3 * kMeshes * COUNT(scales); ++i) {
        soup s = generated_sheared(i % kMeshes);
        const int snap = i / kMeshes % 3; /* to a coarse grid: many ties, zero areas and coincident points */
        const double scale = scales[i / (3 * kMeshes)];
        for (int32_t k = 0; k < 3 * s.vertices; ++k) {
            if (snap != 0) s.points[k] = floor(s.points[k] * snap);
            s.points[k] *= scale;
        }
        shim_mesh* const f64 = made_of_soup(&s);
        float* const single = malloc((size_t)s.vertices * 3 * sizeof(float));
        const int fits = scale > 0x1p-100 && scale < 0x1p100;
        for (int32_t k = 0; k < 3 * s.vertices; ++k) single[k] = fits ? (float)s.points[k] : 0;
        delmesh_mesh_desc desc = desc_of_soup(&s);
        desc.positions.data = single;
        desc.positions.type = DELMESH_FLOAT32;
        shim_mesh* const f32 = made(&desc);
        for (int precision = 0; precision < 1 + fits; ++precision) {
            shim_mesh* const m = precision == 0 ? f64 : f32;
            for (int32_t rule = 0; rule < 2; ++rule) {
                const shim_certificate all = shim_scan_all(m, rule);
                for (int32_t lists = 0; lists < 2; ++lists) {
                    const shim_certificate c = shim_certify(m, rule, lists);
                    assert_int_equal(c.nld_interior, all.nld_interior);
                    assert_int_equal(c.nld_boundary, all.nld_boundary);
                    assert_int_equal(c.zero_area_faces, all.zero_area_faces);
                    assert_int_equal(c.delaunay, all.delaunay);
                    assert_int_equal(c.first_zero_face, all.first_zero_face);
                    assert_int_equal(c.listed_edges, lists ? c.nld_interior + c.nld_boundary : 0);
                    assert_int_equal(c.listed_faces, lists ? c.zero_area_faces : 0);
                    if (lists) assert_true(c.in_order && c.listed_sum == all.listed_sum);
                }
                interior += all.nld_interior;
                boundary_edges += all.nld_boundary;
                zero += all.zero_area_faces;
            }
        }
        shim_mesh_free(f32);
        shim_mesh_free(f64);
        free(single);
        free_soup(&s);
    }
    if (interior < 500 || boundary_edges < 50 || zero < 50)
        fail_msg("%d, %d, %d: nothing to find", (int)interior, (int)boundary_edges, (int)zero);
}

/* ---- crowds ---------------------------------------------------------------------------------------------------------------- */

/* A small mesh on a grid of float32's units in the last place: split vertices soon have no room and melt. */
static soup crowded(int which, uint64_t seed) {
    const double size = which == 2 ? 12 : 4, noise = which == 2 ? 6 : 4;
    soup s = which == 0 ? fan(3 + (int32_t)(seed % 5), seed) : which < 3 ? torus(3, 3, 0, 0) : torus(4, 3, 0, 0);
    for (int32_t v = 0; v < s.vertices; ++v) {
        double x[3];
        for (int k = 0; k < 3; ++k) x[k] = 0x1p23 + 64 + floor(s.points[3 * v + k] * size + noise * random_unit(&seed));
        set_point(&s, v, x[0], x[1], x[2]);
    }
    return s;
}

/* What the report says of where the vertices went, against the source and, where there is one, the result. */
static int64_t check_where(shim_mesh* in, shim_mesh* out, const delmesh_remesh_options* o, const delmesh_remesh_report* r) {
    const int64_t left = r->split_on_boundary + r->split_on_kept + r->split_crowded + r->split_on_caps +
                         r->split_at_small_angles + r->split_on_flipped + r->split_elsewhere;
    assert_int_equal(left + r->split_merged, r->splits);
    assert_true(r->worst_edge_splits <= left && r->worst_edge_splits <= r->worst_face_splits && r->worst_face_splits <= left);
    const shim_arrays a = shim_mesh_arrays(in);
    const int32_t p = r->worst_edge_from, q = r->worst_edge_to;
    if (r->worst_edge_splits == 0) {
        assert_true(p == -1 && q == -1 && r->worst_face == -1 && r->worst_face_splits == 0);
        return left;
    }
    assert_true(p < q && bits_of(&a, p, q) != 255);
    assert_in_range(r->worst_face, 0, a.corners / 3 - 1);
    if (shim_mesh_status(out) != DELMESH_OK || o->mode != P) return left;
    int64_t there = 0;
    const shim_arrays b = shim_mesh_arrays(out);
    for (int32_t v = b.first_split; v < b.vertices; ++v) {
        int32_t verts[3];
        double weights[3];
        shim_vertex_map(out, v, verts, weights);
        there += weights[2] == 0 && ((verts[0] == p && verts[1] == q) || (verts[0] == q && verts[1] == p));
    }
    if (there < r->worst_edge_splits)
        fail_msg("%d split vertices on the edge %d %d, the report has %d", (int)there, p, q, (int)r->worst_edge_splits);
    return left;
}

/* Vertices that were counted on a line and are gone again, all of a line or all there were. */
static void test_melted(void** state) {
    (void)state;
    int64_t melted = 0, nothing_left = 0, certified = 0, runs = 0;
    for (int which = 0; which < 4; ++which)
        for (uint64_t seed = 1; seed <= (which == 0 ? 600 : 24); ++seed) {
            soup s = crowded(which, seed);
            const delmesh_mesh_desc desc = desc_of_soup(&s);
            shim_mesh* const in = shim_mesh_make(NULL, &desc, 0);
            for (int32_t mode = P; mode <= K && shim_mesh_status(in) == DELMESH_OK; ++mode)
                for (int boundary = 0; boundary < (which == 0 ? 2 : 1); ++boundary) {
                    delmesh_remesh_options o = options_of(mode);
                    o.boundary = boundary;
                    o.tolerance = seed % 2 == 0 ? -1 : 0;
                    if (mode == F) o.max_normal_turn = 20;
                    o.max_vertices = 2000;
                    delmesh_remesh_report r;
                    shim_mesh* const out = shim_remesh(in, &o, 1, &r);
                    const int32_t status = shim_mesh_status(out);
                    if (status == DELMESH_OK)
                        check_result(in, out, &o, &r);
                    else if (status != DELMESH_ERROR_PRECISION && status != DELMESH_ERROR_VERTEX_LIMIT)
                        fail_msg("status %d: %s", status, shim_mesh_error(out));
                    const int64_t left = check_where(in, out, &o, &r);
                    ++runs;
                    certified += status == DELMESH_OK;
                    melted += r.split_merged > 0;
                    nothing_left += r.splits > 0 && left == 0;
                    shim_mesh_free(out);
                }
            shim_mesh_free(in);
            free_soup(&s);
        }
    print_message("    %d runs, %d certified, %d melted, %d to nothing\n", (int)runs, (int)certified, (int)melted,
                  (int)nothing_left);
    assert_true(melted > 50 && nothing_left > 0 && certified > runs / 2);
}

/* ---- few vertices, and parts ----------------------------------------------------------------------------------------------- */

/* Sanitizers make it slow, and find what they look for without the long searches. */
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
enum { kEfforts = 2 };
#else
enum { kEfforts = 4 };
#endif

/* Large enough to be cut into parts: each has more than 2,048 NLD edges. */
enum { kLarge = 4 };
static soup large_mesh(int which) {
    uint64_t seed = 31;
    soup s = which == 0   ? torus(200, 100, 0.2, 41) /* bumpy */
             : which == 1 ? sheet(150, 130, 3, 0.45, 42)
             : which == 2 ? book(3, 60, 0.3, 43)    /* cut at its spine */
                          : torus(90, 40, 0.1, 44); /* needles: see below */
    for (int32_t v = 0; v < s.vertices; ++v) {
        double* const x = s.points + 3 * v;
        if (which == 2) set_point(&s, v, x[0] + 0.3 * random_unit(&seed), x[1] + 0.4 * x[0], x[2] + 0.3 * random_unit(&seed));
        if (which == 3) set_point(&s, v, 6 * x[0] + 2 * x[1], x[1] + x[2], x[2]);
    }
    return s;
}

static void expect_same_bytes(shim_mesh* one, shim_mesh* two, const delmesh_remesh_report* r, const delmesh_remesh_report* q) {
    expect_equal(one, two, 1, 1);
    const shim_arrays a = shim_mesh_arrays(one), b = shim_mesh_arrays(two);
    assert_int_equal(a.pos32_size, b.pos32_size);
    if (a.pos32_size != 0) assert_memory_equal(a.pos32, b.pos32, (size_t)a.pos32_size * sizeof(float));
    assert_int_equal(a.corner_bits_size, b.corner_bits_size);
    assert_memory_equal(a.corner_bits, b.corner_bits, (size_t)a.corner_bits_size * sizeof *a.corner_bits);
    assert_int_equal(a.face_source_size, b.face_source_size);
    if (a.face_source_size != 0) assert_memory_equal(a.face_source, b.face_source, (size_t)a.face_source_size * sizeof(int32_t));
    for (int32_t v = a.first_split; v < a.vertices; ++v) {
        int32_t x[3], y[3];
        double wx[3], wy[3];
        shim_vertex_map(one, v, x, wx);
        shim_vertex_map(two, v, y, wy);
        assert_memory_equal(x, y, sizeof x);
        assert_memory_equal(wx, wy, sizeof wx);
    }
    assert_memory_equal(&r->nld_in, &q->nld_in,
                        offsetof(delmesh_remesh_report, seconds_total) - offsetof(delmesh_remesh_report, nld_in));
    assert_true(r->surface_bound == q->surface_bound && r->worst_face == q->worst_face && r->split_merged == q->split_merged);
}

enum { kHub = 5 }; /* of the generated meshes */

static void test_effort_laws(void** state) {
    (void)state;
    int64_t sums[4] = {0, 0, 0, 0}, tally[2] = {0, 0}, fewer = 0;
    for (int i = 0; i < kMeshes; ++i) {
        soup s = generated_sheared(i);
        shim_mesh* const in = made_of_soup(&s);
        for (int precision = DELMESH_FLOAT32; precision <= DELMESH_FLOAT64; ++precision)
            for (int exact = 0; exact < 2; ++exact) {
                int64_t last = INT64_MAX;
                for (int32_t effort = 0; effort < kEfforts; ++effort) {
                    delmesh_remesh_options o = options_of(P);
                    o.precision = precision;
                    o.effort = effort;
                    o.tolerance = exact ? 0 : -1;
                    delmesh_remesh_report r, q;
                    shim_mesh* const out = remeshed(in, &o, &r);
                    check_maps(in, out, &o, tally);
                    const shim_arrays b = shim_mesh_arrays(out);
                    assert_true(r.surface_bound >= 0 && r.surface_bound <= 4 * unit_of(&b, precision));
                    shim_mesh* const again = shim_remesh(in, &o, 2, &q);
                    assert_int_equal(shim_mesh_status(again), DELMESH_OK);
                    expect_same_bytes(out, again, &r, &q);
                    shim_mesh_free(again);
                    shim_mesh_free(out);
                    /* The look-ahead does not pay at the hub of many needles, so there the law begins with effort 1. */
                    if (i != kHub) sums[effort] += r.splits;
                    if (effort >= (i == kHub ? 2 : 1) && r.splits > last)
                        fail_msg("mesh %d: effort %d needs %d vertices, %d before", i, effort, (int)r.splits, (int)last);
                    fewer += r.splits < last;
                    last = r.splits;
                }
            }
        shim_mesh_free(in);
        free_soup(&s);
    }
    if (!(sums[0] > sums[1] && (kEfforts < 4 || (sums[1] > sums[2] && sums[2] >= sums[3]))))
        fail_msg("%d, %d, %d, %d vertices with efforts 0 to 3", (int)sums[0], (int)sums[1], (int)sums[2], (int)sums[3]);
    assert_true(fewer > 0 && tally[1] > 500);
}

static void test_parts(void** state) {
    (void)state;
    int64_t sums[4] = {0, 0, 0, 0}, tally[2] = {0, 0};
    for (int which = 0; which < kLarge; ++which) {
        soup s = large_mesh(which);
        shim_mesh* const in = made_of_soup(&s);
        if (which == 2) assert_true(shim_mesh_arrays(in).slot_count > 100);
        for (int32_t effort = 0; effort < (which < 3 ? kEfforts : 2); ++effort) {
            delmesh_remesh_options o = options_of(P);
            o.effort = effort;
            o.precision = (which + effort) % 2 == 0 ? DELMESH_FLOAT32 : DELMESH_FLOAT64;
            if (which == 3) o.max_vertices = 100 * s.vertices;
            delmesh_remesh_report r, q;
            shim_mesh* const one = remeshed(in, &o, &r);
            assert_true(r.nld_in > 2048);
            if (which == 3) assert_true(r.splits > 4 * r.nld_in); /* more than any part was given at first */
            check_maps(in, one, &o, tally);
            const shim_arrays b = shim_mesh_arrays(one);
            assert_true(r.surface_bound >= 0 && r.surface_bound <= 4 * unit_of(&b, o.precision));
            if (which < 3) sums[effort] += r.splits;
            static const int32_t threads[] = {2, 3, 7};
            for (int i = 0; i < (kEfforts == 4 && effort < 2 ? 3 : 1); ++i) {
                shim_mesh* const many = shim_remesh(in, &o, threads[i], &q);
                if (shim_mesh_status(many) != DELMESH_OK) fail_msg("%s", shim_mesh_error(many));
                expect_same_bytes(one, many, &r, &q);
                shim_mesh_free(many);
            }
            print_message("    mesh %d effort %d: %d vertices, %d NLD, %d splits\n", which, effort, s.vertices, (int)r.nld_in,
                          (int)r.splits);
            shim_mesh_free(one);
        }
        shim_mesh_free(in);
        free_soup(&s);
    }
    for (int effort = 1; effort < kEfforts; ++effort)
        if (sums[effort] >= sums[effort - 1])
            fail_msg("%d vertices with effort %d, %d before", (int)sums[effort], effort, (int)sums[effort - 1]);
}

/* Flips in parts: from 4,096 NLD edges on. The bytes are the same with any number of threads, and mirrored if the mesh is. */
static void test_parts_flip(void** state) {
    (void)state;
    for (int which = 0; which < 3; ++which) {
        soup s = which == 0 ? torus(200, 100, 0.35, 61) : which == 1 ? sheet(150, 130, 3, 0.45, 62) : book(3, 90, 0.4, 63);
        uint64_t seed = 64;
        for (int32_t v = 0; which == 2 && v < s.vertices; ++v) {
            double* const x = s.points + 3 * v;
            set_point(&s, v, x[0] + 0.3 * random_unit(&seed), x[1] + 0.4 * x[0], x[2] + 0.3 * random_unit(&seed));
        }
        soup t = copy_of_soup(&s);
        for (int32_t v = 0; v < t.vertices; ++v) t.points[3 * v + which] *= -1;
        shim_mesh* const in = made_of_soup(&s);
        shim_mesh* const mirrored = made_of_soup(&t);
        for (int32_t mode = F; mode <= K; ++mode) {
            delmesh_remesh_options o = options_of(mode);
            o.precision = (which + mode) % 2 == 0 ? DELMESH_FLOAT32 : DELMESH_FLOAT64;
            delmesh_remesh_report r, q;
            shim_mesh* const one = remeshed(in, &o, &r);
            assert_true(r.nld_in >= 4096 && r.flips > 0);
            static const int32_t threads[] = {2, 4, 7};
            for (int i = 0; i < (kEfforts == 4 ? 3 : 1); ++i) {
                shim_mesh* const many = shim_remesh(in, &o, threads[i], &q);
                assert_int_equal(shim_mesh_status(many), DELMESH_OK);
                expect_same_bytes(one, many, &r, &q);
                shim_mesh_free(many);
            }
            shim_mesh* const other = remeshed(mirrored, &o, &q);
            const shim_arrays a = shim_mesh_arrays(one), b = shim_mesh_arrays(other);
            assert_int_equal(a.corners, b.corners);
            assert_memory_equal(a.corner_vert, b.corner_vert, (size_t)a.corners * sizeof(int32_t));
            assert_memory_equal(a.corner_twin, b.corner_twin, (size_t)a.corners * sizeof(int32_t));
            for (int32_t v = 0; v < a.vertices; ++v)
                for (int k = 0; k < 3; ++k) assert_true(coordinate(&a, v, k) == (k == which ? -1 : 1) * coordinate(&b, v, k));
            print_message("    mesh %d mode %d: %d NLD, %d flips, %d later, %d splits\n", which, mode, (int)r.nld_in,
                          (int)r.flips, (int)r.flips_after, (int)r.splits);
            shim_mesh_free(other);
            shim_mesh_free(one);
        }
        shim_mesh_free(mirrored);
        shim_mesh_free(in);
        free_soup(&t);
        free_soup(&s);
    }
}

/* A limit of vertices holds for all parts together. */
static void test_parts_limit(void** state) {
    (void)state;
    for (int which = 2; which < kLarge; ++which) {
        soup s = large_mesh(which);
        shim_mesh* const in = made_of_soup(&s);
        const int32_t given = shim_mesh_info(in).vertices;
        delmesh_remesh_options o = options_of(P);
        o.max_vertices = 100 * s.vertices;
        delmesh_remesh_report r;
        shim_mesh* const out = remeshed(in, &o, &r);
        const int64_t needed = r.splits;
        shim_mesh_free(out);
        for (int i = 0; i <= 10; i += kEfforts == 4 ? 1 : 5) {
            o.max_vertices = given + (i == 0 ? 0 : i == 1 ? 1 : i == 10 ? needed : needed * (i - 1) / 9);
            for (int32_t threads = 1; threads <= 2; ++threads) {
                shim_mesh* const limited = shim_remesh(in, &o, threads, &r);
                const int32_t status = shim_mesh_status(limited);
                if (status == DELMESH_OK)
                    check_result(in, limited, &o, &r);
                else {
                    assert_int_equal(status, DELMESH_ERROR_VERTEX_LIMIT);
                    assert_non_null(strstr(shim_mesh_error(limited), "The limit of"));
                }
                if (i < 6) assert_int_equal(status, DELMESH_ERROR_VERTEX_LIMIT);
                if (r.vertices_out > o.max_vertices + 3)
                    fail_msg("mesh %d: %d vertices, limit %d", which, (int)r.vertices_out, (int)o.max_vertices);
                shim_mesh_free(limited);
            }
        }
        shim_mesh_free(in);
        free_soup(&s);
    }
}

/* ---- refusals while parts run ---------------------------------------------------------------------------------------------- */

typedef struct {
    shim_mesh* out;
    int64_t live, allocations, used, pools, reports, fail_at, pool_calls, cancel_at, progress_calls, cancel_progress_at;
    int in_pool, misused; /* misused: a block was asked for while the pool ran */
} host;

static void* host_alloc(void* user, size_t size, size_t align) {
    host* const h = user;
    if (h->in_pool) h->misused = 1;
    if (++h->allocations == h->fail_at) return NULL;
    void* const p = aligned_alloc(align, (size + align - 1) / align * align);
    h->live += p != NULL;
    return p;
}
static void host_free(void* user, void* pointer, size_t size) {
    (void)size;
    host* const h = user;
    if (h->in_pool) h->misused = 1;
    h->live -= pointer != NULL;
    free(pointer);
}
static int32_t host_progress(void* user, double fraction, const char* stage) {
    (void)fraction, (void)stage;
    host* const h = user;
    return ++h->progress_calls == h->cancel_progress_at ? 0 : DELMESH_CONTINUE;
}
static void host_pool(void* user, int32_t count, delmesh_task_fn task, void* data) { /* one after the other, the last one first */
    host* const h = user;
    const int32_t before = ++h->pool_calls == h->cancel_at ? count / 2 : -1;
    h->in_pool = 1;
    for (int32_t i = count - 1; i >= 0; --i) {
        if (i == before) shim_mesh_cancel(h->out);
        task(data, i);
    }
    h->in_pool = 0;
}

static int32_t run_in_host(host* h, const shim_mesh* in, const delmesh_remesh_options* o) {
    delmesh_context_options used;
    memset(&used, 0, sizeof used);
    used.max_threads = 4;
    used.alloc = host_alloc;
    used.free = host_free;
    used.progress = host_progress;
    used.parallel_for = host_pool;
    used.user = h;
    h->allocations = h->pool_calls = h->progress_calls = 0;
    const int64_t fail_at = h->fail_at;
    h->fail_at = 0;
    h->out = shim_mesh_blank(&used);
    const int64_t before = h->allocations;
    h->fail_at = fail_at == 0 ? 0 : before + fail_at;
    delmesh_remesh_report r;
    shim_remesh_into(h->out, in, o, &r);
    const int32_t status = shim_mesh_status(h->out);
    h->used = h->allocations - before;
    h->pools = h->pool_calls;
    h->reports = h->progress_calls;
    h->fail_at = 0;
    h->in_pool = 0;
    const int misused = h->misused;
    if (status == DELMESH_OK) {
        assert_true(r.nld_in >= (o->mode == F ? 4096 : 2048));
        /* How often it is asked depends on time: what did not come to be cancelled is not cancelled while it is checked. */
        const int64_t cancel_at = h->cancel_at, cancel_progress_at = h->cancel_progress_at;
        h->cancel_at = h->cancel_progress_at = 0;
        check_result(in, h->out, o, &r);
        h->cancel_at = cancel_at;
        h->cancel_progress_at = cancel_progress_at;
    }
    shim_mesh_free(h->out);
    assert_int_equal(h->live, 0);
    assert_false(misused);
    return status;
}

static void test_parts_refusals(void** state) {
    (void)state;
    for (int which = 0; which < 3; ++which) { /* 2: flips alone */
        soup s = which == 0 ? torus(90, 60, 0.3, 51) : which == 1 ? torus(110, 60, 0.1, 52) : torus(120, 90, 0.4, 53);
        if (which == 1)
            for (int32_t v = 0; v < s.vertices; ++v)
                set_point(&s, v, 3 * s.points[3 * v] + s.points[3 * v + 1], s.points[3 * v + 1] + s.points[3 * v + 2],
                          s.points[3 * v + 2]);
        shim_mesh* const in = made_of_soup(&s);
        delmesh_remesh_options o = options_of(which == 2 ? F : P);
        o.max_vertices = 60 * s.vertices;
        host h;
        memset(&h, 0, sizeof h);
        assert_int_equal(run_in_host(&h, in, &o), DELMESH_OK);
        const int64_t allocations = h.used, pool_calls = h.pools, progress_calls = h.reports;
        print_message("    %d allocations, %d parallel loops\n", (int)allocations, (int)pool_calls);
        for (int64_t k = 1 + which; k <= allocations; k += kEfforts == 4 ? 7 : 29) {
            h.fail_at = k;
            assert_int_equal(run_in_host(&h, in, &o), DELMESH_ERROR_OUT_OF_MEMORY);
        }
        h.fail_at = 0;
        for (h.cancel_at = 1; h.cancel_at <= pool_calls; ++h.cancel_at)
            assert_int_equal(run_in_host(&h, in, &o), DELMESH_ERROR_CANCELLED);
        h.cancel_at = 0;
        for (h.cancel_progress_at = 1; h.cancel_progress_at <= (progress_calls < 20 ? progress_calls : 20);
             ++h.cancel_progress_at) {
            const int32_t status = run_in_host(&h, in, &o);
            if (h.reports >= h.cancel_progress_at) assert_int_equal(status, DELMESH_ERROR_CANCELLED);
        }
        shim_mesh_free(in);
        free_soup(&s);
    }
}

/* So many edges in each part that cannot be flipped that a part's turn ends before all of them were looked at again. */
static void test_blocked_everywhere(void** state) {
    (void)state;
    soup s = sheet(300, 300, 1, 0.05, 61);
    for (int32_t v = 0; v < s.vertices; ++v)
        set_point(&s, v, s.points[3 * v] + 0.5 * s.points[3 * v + 1], s.points[3 * v + 1], s.points[3 * v + 2]);
    shim_mesh* const in = made_of_soup(&s);
    delmesh_remesh_options o = inner_options_of(P);
    o.tolerance = 0;
    o.effort = 0;
    host h;
    memset(&h, 0, sizeof h);
    h.cancel_at = 300; /* it takes 31 */
    assert_int_equal(run_in_host(&h, in, &o), DELMESH_OK);
    print_message("    %d parallel loops\n", (int)h.pools);
    shim_mesh_free(in);
    free_soup(&s);
}

/* An argument is the pattern of what to run; "rest": all but test_parts*, which is a test of its own to ctest. */
int main(int count, char** arguments) {
    if (count > 1 && strcmp(arguments[1], "rest") == 0)
        cmocka_set_skip_filter("test_parts*");
    else if (count > 1)
        cmocka_set_test_filter(arguments[1]);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_flat_pair),
        cmocka_unit_test(test_bent_pair),
        cmocka_unit_test(test_split_off_middle),
        cmocka_unit_test(test_marked),
        cmocka_unit_test(test_boundary_rule),
        cmocka_unit_test(test_already_delaunay),
        cmocka_unit_test(test_exposed),
        cmocka_unit_test(test_split_budget),
        cmocka_unit_test(test_tolerance),
        cmocka_unit_test(test_needle),
        cmocka_unit_test(test_needle_inside),
        cmocka_unit_test(test_needle_by_rounding),
        cmocka_unit_test(test_caps),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_three_pages),
        cmocka_unit_test(test_pages_with_needles),
        cmocka_unit_test(test_compact_keeps_joins),
        cmocka_unit_test(test_compact),
        cmocka_unit_test(test_laws),
        cmocka_unit_test(test_chain),
        cmocka_unit_test(test_chain_maps),
        cmocka_unit_test(test_similarity),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_slab),
        cmocka_unit_test(test_certify),
        cmocka_unit_test(test_melted),
        cmocka_unit_test(test_effort_laws),
        cmocka_unit_test(test_parts),
        cmocka_unit_test(test_parts_flip),
        cmocka_unit_test(test_parts_limit),
        cmocka_unit_test(test_parts_refusals),
        cmocka_unit_test(test_blocked_everywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
