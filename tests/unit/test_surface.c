/* SPDX-License-Identifier: Apache-2.0 */
/* The editable surface: every edit on a mesh small enough to write the resulting table down, and long random walks of edits
 * after each of which a checker that shares nothing with the library looks at every relation and at the topology. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "mesh_makers.h"
#include "shim_surface.h"

static int32_t next_of(int32_t c) {
    return c - c % 3 + (c % 3 + 1) % 3;
}
static int32_t prev_of(int32_t c) {
    return c - c % 3 + (c % 3 + 2) % 3;
}

static void expect_ints(const char* what, const int32_t* actual, int64_t actual_count, const int32_t* expected, int64_t count) {
    if (actual_count != count) fail_msg("%s has %d elements instead of %d", what, (int)actual_count, (int)count);
    for (int64_t i = 0; i < count; ++i)
        if (actual[i] != expected[i]) fail_msg("%s[%d] is %d instead of %d", what, (int)i, actual[i], expected[i]);
}
#define EXPECT(array, size, expected) expect_ints(#array, array, size, expected, COUNT(expected))

static void expect_bits(const shim_table* s, const uint8_t* expected, int64_t count) {
    assert_int_equal(s->bits, count);
    for (int64_t i = 0; i < count; ++i)
        if (s->corner_bits[i] != expected[i])
            fail_msg("corner %d has bits %d instead of %d", (int)i, s->corner_bits[i], expected[i]);
}

/* ---- the independent checker ----------------------------------------------------------------------------------------------- */

typedef struct {
    int32_t vertices, edges, faces, boundary_edges, components, loops, euler;
} topology;

static int32_t find_root(int32_t* parent, int32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
}

#define REQUIRE(condition, c)                                                                                                    \
    do {                                                                                                                         \
        if (!(condition)) fail_msg("corner or vertex %d: %s", (int)(c), #condition);                                             \
    } while (0)

static topology checked(shim_surface* surface) {
    const shim_table s = shim_surface_table(surface);
    topology n = {0, 0, 0, 0, 0, 0, 0};
    assert_true(s.corners % 3 == 0 && s.twins == s.corners && s.bits == s.corners && 3 * s.face_srcs == s.corners);
    assert_true(s.vert_corners == s.vertices && (s.roots == 0 || s.roots == s.vertices));
    assert_true(s.first_copy <= s.first_split && s.first_split <= s.vertices && s.copies == s.first_split - s.first_copy);
    int32_t* const used = (int32_t*)calloc((size_t)s.vertices, sizeof(int32_t)); /* corners of each vertex */
    int32_t* const parent = (int32_t*)calloc((size_t)s.vertices, sizeof(int32_t));
    for (int32_t v = 0; v < s.vertices; ++v) parent[v] = v;
    int64_t dead = 0;
    for (int32_t c = 0; c < s.corners; ++c) {
        const int32_t v = s.corner_vert[c], t = s.corner_twin[c];
        if (v < 0) {
            REQUIRE(s.corner_vert[next_of(c)] < 0 && s.corner_vert[prev_of(c)] < 0, c);
            if (c % 3 == 0) ++dead;
            continue;
        }
        const int32_t head = s.corner_vert[next_of(c)];
        REQUIRE(v < s.vertices && head >= 0 && head < s.vertices && v != head, c);
        ++used[v];
        parent[find_root(parent, v)] = find_root(parent, head);
        if (c % 3 == 0) ++n.faces;
        if (t >= 0) {
            REQUIRE(t < s.corners && s.corner_vert[t] == head && s.corner_vert[next_of(t)] == v && s.corner_twin[t] == c, c);
            REQUIRE(s.corner_bits[t] == s.corner_bits[c], c);
            if (t > c) ++n.edges;
        } else {
            ++n.edges;
            ++n.boundary_edges;
        }
        if (t <= -2) { /* the ring of its copies: boundary corners at the same place, of the same two roots */
            const int32_t start = -2 - t;
            int32_t slot = start, length = 0;
            do {
                REQUIRE(slot >= 0 && slot < s.slot_count && ++length <= s.slot_count, c);
                const int32_t k = s.slots[2 * slot];
                REQUIRE(k >= 0 && k < s.corners && s.corner_vert[k] >= 0 && s.corner_twin[k] == -2 - slot, c);
                const int32_t x = s.corner_vert[k], y = s.corner_vert[next_of(k)];
                const int same = s.vert_root[x] == s.vert_root[v] && s.vert_root[y] == s.vert_root[head];
                const int turned = s.vert_root[y] == s.vert_root[v] && s.vert_root[x] == s.vert_root[head];
                REQUIRE(same || turned, c);
                REQUIRE(memcmp(s.pos + 3 * v, s.pos + 3 * (same ? x : y), 3 * sizeof(double)) == 0, c);
                slot = s.slots[2 * slot + 1];
            } while (slot != start);
        }
    }
    assert_int_equal(dead, s.dead_faces);
    for (int32_t v = 0; v < s.vertices; ++v) {
        const int32_t start = s.vert_corner[v];
        REQUIRE((start < 0) == (used[v] == 0), v);
        if (start < 0) continue;
        ++n.vertices;
        if (find_root(parent, v) == v) ++n.components;
        int32_t c = start, steps = 0;
        do {
            REQUIRE(s.corner_vert[c] == v && ++steps <= used[v], v);
            c = s.corner_twin[prev_of(c)];
        } while (c >= 0 && c != start);
        REQUIRE(steps == used[v], v);                      /* one fan */
        REQUIRE((c < 0) == (s.corner_twin[start] < 0), v); /* and the boundary corner where it is open */
    }
    uint8_t* const seen = (uint8_t*)calloc((size_t)(s.corners > 0 ? s.corners : 1), 1);
    for (int32_t c = 0; c < s.corners; ++c) {
        if (s.corner_vert[c] < 0 || s.corner_twin[c] >= 0 || seen[c]) continue;
        ++n.loops;
        for (int32_t k = c; !seen[k]; k = s.vert_corner[s.corner_vert[next_of(k)]]) seen[k] = 1;
    }
    free(seen);
    free(used);
    free(parent);
    n.euler = n.vertices - n.edges + n.faces;
    assert_true(shim_surface_valid(surface));
    return n;
}

static void expect_topology(shim_surface* s, int32_t vertices, int32_t edges, int32_t faces, int32_t boundary, int32_t components,
                            int32_t loops) {
    const topology n = checked(s);
    assert_int_equal(n.vertices, vertices);
    assert_int_equal(n.edges, edges);
    assert_int_equal(n.faces, faces);
    assert_int_equal(n.boundary_edges, boundary);
    assert_int_equal(n.components, components);
    assert_int_equal(n.loops, loops);
}

/* ---- hand-made meshes ------------------------------------------------------------------------------------------------------ */

typedef struct {
    shim_mesh* mesh;
    shim_surface* surface;
} model;

static model model_of(const delmesh_mesh_desc* desc) {
    model m;
    m.mesh = shim_mesh_make(NULL, desc, 0);
    assert_int_equal(shim_mesh_status(m.mesh), DELMESH_OK);
    m.surface = shim_surface_make(m.mesh, DELMESH_FLOAT64);
    return m;
}
static void free_model(model* m) {
    shim_surface_free(m->surface);
    shim_mesh_free(m->mesh);
}

static const double kPoints[24] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 4, 5, 6, 1, -3, 2, 7, 1, -8, 2, -2, -2, -9};

static model model_of_faces(int32_t vertices, const int32_t* corners, int64_t corner_count) {
    const delmesh_mesh_desc desc = desc_of(kPoints, vertices, corners, corner_count);
    return model_of(&desc);
}
#define MODEL(vertices, corners) model_of_faces(vertices, corners, COUNT(corners))

static model model_of_soup(soup* s) {
    const delmesh_mesh_desc desc = desc_of_soup(s);
    const model m = model_of(&desc);
    free_soup(s);
    return m;
}

static const int32_t kPair[] = {0, 1, 2, 1, 0, 3};
static const int32_t kTetrahedron[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
static const int32_t kOctahedron[] = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 1, 0, 5, 2, 1, 5, 3, 2, 5, 0, 3, 5};
/*   3 -- 4 -- 5
 *   | \  | \  |      four faces in a row, cut along the diagonals 1 3 and 2 4
 *   0 -- 1 -- 2 */
static const int32_t kStrip[] = {0, 1, 3, 1, 4, 3, 1, 2, 4, 2, 5, 4};

/* Gives the edge of each of these corners its bits, on both sides. */
static void set_bits(shim_surface* surface, const int32_t* corner_and_bits, int32_t count) {
    const shim_table s = shim_surface_table(surface);
    for (int32_t i = 0; i < count; ++i) {
        const int32_t c = corner_and_bits[2 * i];
        s.corner_bits[c] = (uint16_t)corner_and_bits[2 * i + 1];
        if (s.corner_twin[c] >= 0) s.corner_bits[s.corner_twin[c]] = s.corner_bits[c];
    }
}

/* ---- copying in ------------------------------------------------------------------------------------------------------------ */

static void test_copy(void** state) {
    (void)state;
    model m = MODEL(5, kPair); /* vertex 4 is used by no face */
    static const int32_t twins[] = {3, -1, -1, 0, -1, -1}, vert_corner[] = {4, 1, 2, 5, -1}, face_src[] = {0, 1};
    const shim_table s = shim_surface_table(m.surface);
    EXPECT(s.corner_vert, s.corners, kPair);
    EXPECT(s.corner_twin, s.twins, twins);
    EXPECT(s.vert_corner, s.vert_corners, vert_corner);
    EXPECT(s.face_src, s.face_srcs, face_src);
    assert_memory_equal(s.pos, kPoints, 15 * sizeof(double));
    assert_int_equal(s.roots + s.copies + s.slot_count + s.dead_faces, 0);
    assert_int_equal(s.first_copy, 5);
    assert_int_equal(s.first_split, 5);
    expect_topology(m.surface, 4, 5, 2, 4, 1, 1);
    assert_true(shim_surface_adjacent(m.surface, 0, 1) && shim_surface_adjacent(m.surface, 1, 0));
    assert_true(shim_surface_adjacent(m.surface, 2, 0) && shim_surface_adjacent(m.surface, 0, 2)); /* by one corner only */
    assert_false(shim_surface_adjacent(m.surface, 2, 3));
    assert_true(shim_surface_has_face(m.surface, 1, 2, 0) && shim_surface_has_face(m.surface, 2, 1, 0));
    assert_false(shim_surface_has_face(m.surface, 0, 2, 3) || shim_surface_has_face(m.surface, 2, 3, 1));
    free_model(&m);
}

/* Coordinates are rounded to the precision asked for, once. */
static void test_copy_rounds(void** state) {
    (void)state;
    static const double points[] = {0.1, 1e-50, 3, 1 + 0x1p-24, 1 + 0x1.8p-23, -1e10, 0, 7, 1. / 3};
    static const int32_t corners[] = {0, 1, 2};
    const delmesh_mesh_desc desc = desc_of(points, 3, corners, 3);
    for (int f32 = 0; f32 < 2; ++f32) {
        shim_mesh* const mesh = shim_mesh_make(NULL, &desc, 0);
        shim_surface* const surface = shim_surface_make(mesh, f32 ? DELMESH_FLOAT32 : DELMESH_FLOAT64);
        const shim_table s = shim_surface_table(surface);
        for (int i = 0; i < 9; ++i) {
            const volatile float rounded = (float)points[i];
            assert_true(s.pos[i] == (f32 ? (double)rounded : points[i]));
        }
        shim_surface_free(surface);
        shim_mesh_free(mesh);
    }
}

/* ---- flip ------------------------------------------------------------------------------------------------------------------ */

static void test_flip_pair(void** state) {
    (void)state;
    for (int other = 0; other < 2; ++other) {
        model m = MODEL(4, kPair);
        static const int32_t bits[] = {0, 7, 1, 1, 2, 2, 4, 16, 5, 3};
        set_bits(m.surface, bits, 5);
        shim_surface_flip(m.surface, other ? 3 : 0);
        const shim_table s = shim_surface_table(m.surface);
        static const int32_t corners[] = {0, 3, 2, 1, 2, 3}, twins[] = {-1, 4, -1, -1, 1, -1}, vert_corner[] = {0, 3, 2, 5};
        static const uint8_t moved[] = {16, 0, 2, 1, 0, 3};
        EXPECT(s.corner_vert, s.corners, corners); /* by symmetry the same from either side */
        EXPECT(s.corner_twin, s.twins, twins);
        EXPECT(s.vert_corner, s.vert_corners, vert_corner);
        expect_bits(&s, moved, 6);
        expect_topology(m.surface, 4, 5, 2, 4, 1, 1);
        free_model(&m);
    }
}

static void test_flip_inside(void** state) {
    (void)state;
    model m = MODEL(6, kOctahedron);
    static const int32_t bits[] = {0, 1, 1, 2, 2, 4, 13, 16, 14, 3}; /* 01, 14, 40, 05, 51 */
    set_bits(m.surface, bits, 5);
    shim_surface_flip(m.surface, 0);
    const shim_table s = shim_surface_table(m.surface);
    static const int32_t corners[] = {0, 5, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 1, 4, 5, 2, 1, 5, 3, 2, 5, 0, 3, 5};
    EXPECT(s.corner_vert, s.corners, corners);
    assert_int_equal(s.corner_twin[1], 13); /* the new edge */
    assert_int_equal(s.corner_bits[0], 16); /* 0 5 */
    assert_int_equal(s.corner_bits[1], 0);
    assert_int_equal(s.corner_bits[2], 4);  /* 4 0 */
    assert_int_equal(s.corner_bits[12], 2); /* 1 4 */
    assert_int_equal(s.corner_bits[14], 3); /* 5 1 */
    expect_topology(m.surface, 6, 12, 8, 0, 1, 0);
    assert_true(shim_surface_adjacent(m.surface, 4, 5));
    assert_false(shim_surface_adjacent(m.surface, 0, 1));
    shim_surface_flip(m.surface, 1); /* and back: the same faces in the other two places */
    expect_topology(m.surface, 6, 12, 8, 0, 1, 0);
    assert_true(shim_surface_has_face(m.surface, 0, 1, 4) && shim_surface_has_face(m.surface, 1, 0, 5));
    free_model(&m);
}

/* A cut edge that changes places with a flip keeps its ring. */
static void test_flip_beside_cut(void** state) {
    (void)state;
    soup pages = book(3, 1, 0, 0); /* each page: two faces, the first or second of which has the spine */
    model m = model_of_soup(&pages);
    expect_topology(m.surface, 12, 15, 6, 12, 3, 3);
    const shim_table s = shim_surface_table(m.surface);
    assert_int_equal(s.slot_count, 3);
    for (int32_t f = 0; f < 6; f += 2) {
        int32_t c = 3 * f;
        while (shim_surface_table(m.surface).corner_twin[c] < 0) ++c;
        shim_surface_flip(m.surface, c);
        expect_topology(m.surface, 12, 15, 6, 12, 3, 3);
    }
    int32_t cuts = 0;
    const shim_table after = shim_surface_table(m.surface);
    for (int32_t c = 0; c < after.corners; ++c) cuts += after.corner_twin[c] <= -2;
    assert_int_equal(cuts, 3);
    free_model(&m);
}

/* ---- split ----------------------------------------------------------------------------------------------------------------- */

static void test_split_inside(void** state) {
    (void)state;
    model m = MODEL(4, kPair);
    static const int32_t bits[] = {0, 7, 1, 1, 2, 2, 4, 16, 5, 3};
    set_bits(m.surface, bits, 5);
    assert_int_equal(shim_surface_split(m.surface, 0), 6);
    const shim_table s = shim_surface_table(m.surface);
    static const int32_t corners[] = {0, 4, 2, 1, 4, 3, 4, 1, 2, 4, 0, 3};
    static const int32_t twins[] = {9, 8, -1, 6, 11, -1, 3, -1, 1, 0, -1, 4};
    static const int32_t vert_corner[] = {10, 7, 2, 5, 6}, face_src[] = {0, 1, 0, 1}, carriers[] = {0, 1};
    static const uint8_t pieces[] = {7, 0, 2, 7, 0, 3, 7, 1, 0, 7, 16, 0};
    static const double middle[] = {2, 0, 0};
    EXPECT(s.corner_vert, s.corners, corners);
    EXPECT(s.corner_twin, s.twins, twins);
    EXPECT(s.vert_corner, s.vert_corners, vert_corner);
    EXPECT(s.face_src, s.face_srcs, face_src);
    EXPECT(s.carriers, 2 * s.carrier_count, carriers);
    expect_bits(&s, pieces, 12);
    assert_memory_equal(s.pos + 12, middle, sizeof middle);
    assert_int_equal(s.first_split, 4);
    expect_topology(m.surface, 5, 8, 4, 4, 1, 1);
    free_model(&m);
}

static void test_split_boundary(void** state) {
    (void)state;
    static const int32_t triangle[] = {0, 1, 2};
    model m = MODEL(3, triangle);
    static const int32_t bits[] = {0, 1, 1, 2, 2, 4};
    set_bits(m.surface, bits, 3);
    assert_int_equal(shim_surface_split(m.surface, 1), 3);
    const shim_table s = shim_surface_table(m.surface);
    /* (1, 2, 0) with 1 -> 2 cut: corner 1 is 1 -> 3, corner 2 is 3 -> 0; the new face is (3, 2, 0). */
    static const int32_t corners[] = {0, 1, 3, 3, 2, 0}, twins[] = {-1, -1, 5, -1, -1, 2}, vert_corner[] = {0, 1, 4, 3};
    static const uint8_t pieces[] = {1, 2, 0, 2, 4, 0};
    EXPECT(s.corner_vert, s.corners, corners);
    EXPECT(s.corner_twin, s.twins, twins);
    EXPECT(s.vert_corner, s.vert_corners, vert_corner);
    expect_bits(&s, pieces, 6);
    expect_topology(m.surface, 4, 5, 2, 4, 1, 1);
    free_model(&m);
}

/* Pieces of an edge stay on its carrier, whichever end is the new vertex; parameters are those of the carrier. */
static void test_carriers(void** state) {
    (void)state;
    model m = MODEL(4, kPair);
    int32_t piece, carrier;
    assert_int_equal(shim_surface_split_everywhere(m.surface, 0, 0.25, &piece, 1), 1); /* 4 on 0 1 */
    assert_int_equal(piece, 0);
    assert_true(shim_surface_split_parameter(m.surface, 4, &carrier) == 0.25 && carrier == 0);
    shim_surface_split_everywhere(m.surface, 0, 0.5, &piece, 1); /* 5 between 0 and 4 */
    assert_true(shim_surface_split_parameter(m.surface, 5, &carrier) == 0.125 && carrier == 0);
    shim_surface_split_everywhere(m.surface, 3, 0.5, &piece, 1); /* 6 between 1 and 4, from the end of the carrier */
    assert_true(shim_surface_split_parameter(m.surface, 6, &carrier) == 0.625 && carrier == 0);
    shim_surface_split_everywhere(m.surface, 3, 0.25, &piece, 1); /* 7 between 1 and 6 */
    assert_true(shim_surface_split_parameter(m.surface, 7, &carrier) == 0.90625 && carrier == 0);
    const shim_table s = shim_surface_table(m.surface);
    assert_int_equal(s.carrier_count, 1);
    static const double xs[] = {1, 0.5, 2.5, 3.625};
    for (int i = 0; i < 4; ++i) assert_true(s.pos[3 * (4 + i)] == xs[i]);
    assert_true(shim_surface_on_one_carrier(m.surface, 0, 7, 4) && shim_surface_on_one_carrier(m.surface, 0, 1, 5));
    assert_false(shim_surface_on_one_carrier(m.surface, 0, 7, 2) || shim_surface_on_one_carrier(m.surface, 0, 1, 2));
    shim_surface_split_everywhere(m.surface, 2, 0.5, &piece, 1); /* another edge, 2 0: a carrier of its own */
    assert_true(shim_surface_split_parameter(m.surface, 8, &carrier) == 0.5 && carrier == 1);
    assert_false(shim_surface_on_one_carrier(m.surface, 8, 0, 4));
    expect_topology(m.surface, 9, 19, 11, 5, 1, 1);
    free_model(&m);
}

/* Three pages, two one way round and one the other, share 0 1: a split of one copy is made on all, at one place. */
static void test_split_everywhere(void** state) {
    (void)state;
    static const int32_t pages[] = {0, 1, 2, 1, 0, 3, 0, 1, 4};
    for (int32_t from = 0; from < 3; ++from) {
        model m = MODEL(5, pages);
        expect_topology(m.surface, 9, 9, 3, 9, 3, 3);
        int32_t pieces[3];
        assert_int_equal(shim_surface_split_everywhere(m.surface, 3 * from, 0.25, pieces, 3), 3);
        assert_int_equal(pieces[0], 3 * from);
        expect_topology(m.surface, 12, 15, 6, 12, 3, 3);
        const shim_table s = shim_surface_table(m.surface);
        assert_int_equal(s.first_split, 9);
        assert_int_equal(s.vertices, 12);
        assert_int_equal(s.slot_count, 6);
        assert_int_equal(s.carrier_count, 3);
        const double x = from == 1 ? 3 : 1;
        for (int32_t v = 9; v < 12; ++v) {
            const double there[3] = {x, 0, 0};
            assert_memory_equal(s.pos + 3 * v, there, sizeof there);
            assert_int_equal(s.vert_root[v], 9);
            int32_t carrier;
            const double t = shim_surface_split_parameter(m.surface, v, &carrier);
            const double start = s.pos[3 * s.carriers[2 * carrier]], end = s.pos[3 * s.carriers[2 * carrier + 1]];
            assert_true(start + t * (end - start) == x); /* each sheet's carrier has its own direction */
        }
        /* Each half has a ring of three, and splits again on all sheets. */
        for (int32_t half = 0; half < 2; ++half) {
            const int32_t c = half == 0 ? 3 * from : s.vert_corner[9];
            assert_int_equal(shim_surface_split_everywhere(m.surface, c, 0.5, pieces, 3), 3);
        }
        expect_topology(m.surface, 18, 27, 12, 18, 3, 3);
        const shim_table end = shim_surface_table(m.surface);
        for (int32_t v = 12; v < 18; ++v) {
            assert_true(end.pos[3 * v] == (v < 15 ? (from == 1 ? 3.5 : 0.5) : from == 1 ? 1.5 : 2.5));
            assert_int_equal(end.vert_root[v], v < 15 ? 12 : 15);
            int32_t carrier;
            const double t = shim_surface_split_parameter(m.surface, v, &carrier);
            const double first = end.pos[3 * end.carriers[2 * carrier]], last = end.pos[3 * end.carriers[2 * carrier + 1]];
            assert_true(first + t * (last - first) == end.pos[3 * v]);
        }
        assert_int_equal(end.carrier_count, 3);
        free_model(&m);
    }
}

/* ---- collapse -------------------------------------------------------------------------------------------------------------- */

static int32_t legal_collapses(shim_surface* s, int64_t corners) {
    int32_t legal = 0;
    for (int32_t c = 0; c < corners; ++c) legal += shim_surface_collapse_is_legal(s, c);
    return legal;
}

static void test_collapse_legality(void** state) {
    (void)state;
    static const int32_t triangle[] = {0, 1, 2};
    model m = MODEL(4, kTetrahedron);
    assert_int_equal(legal_collapses(m.surface, 12), 0);
    free_model(&m);
    m = MODEL(3, triangle);
    assert_int_equal(legal_collapses(m.surface, 3), 0);
    free_model(&m);
    m = MODEL(6, kOctahedron);
    assert_int_equal(legal_collapses(m.surface, 24), 24);
    free_model(&m);
    /* Outer edges may go, the diagonal would leave nothing. */
    m = MODEL(4, kPair);
    for (int32_t c = 0; c < 6; ++c) assert_int_equal(shim_surface_collapse_is_legal(m.surface, c), c != 0 && c != 3);
    free_model(&m);
    /* Edges across the strip would pinch it: 1 3, 1 4 (either way) and 2 4. */
    m = MODEL(6, kStrip);
    static const int32_t legal[] = {1, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1, 0};
    for (int32_t c = 0; c < 12; ++c)
        if (shim_surface_collapse_is_legal(m.surface, c) != legal[c]) fail_msg("corner %d", c);
    free_model(&m);
    /* On a torus three round every edge is on a loop of three edges that bounds no face: the link condition. */
    soup s = torus(3, 3, 0, 0);
    m = model_of_soup(&s);
    expect_topology(m.surface, 9, 27, 18, 0, 1, 0);
    assert_int_equal(legal_collapses(m.surface, 54), 0);
    free_model(&m);
    s = torus(4, 4, 0, 0);
    m = model_of_soup(&s);
    assert_int_equal(legal_collapses(m.surface, 96), 96);
    free_model(&m);
    /* Vertex 4 with three neighbours, inside the triangle 0 1 3 of a tetrahedron: 0 1 is on the loop 0 1 3 now. */
    static const int32_t raised[] = {0, 2, 1, 0, 1, 4, 1, 3, 4, 3, 0, 4, 1, 2, 3, 0, 3, 2};
    m = MODEL(5, raised);
    assert_false(shim_surface_collapse_is_legal(m.surface, 3)); /* 0 1 */
    assert_true(shim_surface_collapse_is_legal(m.surface, 4));  /* 1 4 */
    free_model(&m);
}

static void test_collapse(void** state) {
    (void)state;
    model m = MODEL(6, kOctahedron);
    static const int32_t bits[] = {1, 1, 2, 2, 13, 4, 14, 16}; /* 14, 40, 05, 51: pairs that become one edge each */
    set_bits(m.surface, bits, 4);
    shim_surface_collapse(m.surface, 0); /* 1 into 0 */
    const shim_table s = shim_surface_table(m.surface);
    static const int32_t corners[] = {-1, -1, -1, 0, 2, 4, 2, 3, 4, 3, 0, 4, -1, -1, -1, 2, 0, 5, 3, 2, 5, 0, 3, 5};
    EXPECT(s.corner_vert, s.corners, corners);
    expect_topology(m.surface, 5, 9, 6, 0, 1, 0);
    assert_int_equal(s.vert_corner[1], -1);
    assert_int_equal(s.corner_twin[5], 10); /* 4 0 and 0 4 */
    assert_int_equal(s.corner_twin[16], 23);
    assert_int_equal(s.corner_bits[5], 3);
    assert_int_equal(s.corner_bits[16], 20);
    free_model(&m);

    /* On the boundary, of the strip: 0 1 goes with its face; 1 3, inner before, is the boundary 0 3 then. */
    m = MODEL(6, kStrip);
    shim_surface_collapse(m.surface, 0);
    const shim_table strip = shim_surface_table(m.surface);
    static const int32_t left[] = {-1, -1, -1, 0, 4, 3, 0, 2, 4, 2, 5, 4};
    EXPECT(strip.corner_vert, strip.corners, left);
    expect_topology(m.surface, 5, 7, 3, 5, 1, 1);
    assert_true(strip.corner_twin[5] < 0);
    free_model(&m);

    /* A cut edge that goes leaves the ring of its copies; the others stay in it. The pages' outer edges close up. */
    static const int32_t pages[] = {0, 1, 2, 1, 0, 3, 0, 1, 4, 1, 2, 5};
    m = MODEL(6, pages);
    expect_topology(m.surface, 10, 11, 4, 10, 3, 3);
    assert_true(shim_surface_collapse_is_legal(m.surface, 0));
    shim_surface_collapse(m.surface, 0);
    const shim_table cut = shim_surface_table(m.surface);
    static const int32_t rest[] = {-1, -1, -1, 7, 6, 3, 8, 9, 4, 0, 2, 5};
    assert_int_equal(cut.corners, COUNT(rest));
    assert_int_equal(cut.corner_vert[9], 0);
    int32_t members = 0;
    for (int32_t c = 0; c < cut.corners; ++c) members += cut.corner_vert[c] >= 0 && cut.corner_twin[c] <= -2;
    assert_int_equal(members, 2);
    expect_topology(m.surface, 9, 9, 3, 9, 3, 3);
    free_model(&m);
}

/* ---- collapse where it is not legal ---------------------------------------------------------------------------------------- */

static void test_collapse_and_cut(void** state) {
    (void)state;
    static const int32_t pillow[] = {0, 1, 2, 2, 1, 0};
    model m = MODEL(3, pillow);
    assert_true(shim_surface_collapse_and_cut(m.surface, 0));
    expect_topology(m.surface, 0, 0, 0, 0, 0, 0);
    free_model(&m);

    /* A tetrahedron is flattened to a pillow. */
    m = MODEL(4, kTetrahedron);
    assert_true(shim_surface_collapse_and_cut(m.surface, 0)); /* 2 into 0 */
    expect_topology(m.surface, 3, 3, 2, 0, 1, 0);
    free_model(&m);

    /* The torus three round is cut along the loop and closed on either side: a sphere. Vertex 6 is on the loop of 0 and 3. */
    soup s = torus(3, 3, 0, 0);
    m = model_of_soup(&s);
    assert_true(shim_surface_collapse_and_cut(m.surface, 0)); /* 0 -> 3 */
    expect_topology(m.surface, 10, 24, 16, 0, 1, 0);          /* 9 - 1 + a copy of 0 and one of 6 */
    const shim_table t = shim_surface_table(m.surface);
    assert_int_equal(t.first_split, 11);
    static const int32_t copies[] = {0, 6};
    int32_t sorted[2] = {t.copy_of[0], t.copy_of[1]};
    if (sorted[0] > sorted[1]) sorted[0] = t.copy_of[1], sorted[1] = t.copy_of[0];
    EXPECT(sorted, t.copies, copies);
    for (int32_t v = 9; v < 11; ++v) assert_memory_equal(t.pos + 3 * v, t.pos + 3 * t.copy_of[v - 9], 3 * sizeof(double));
    free_model(&m);

    /* A bow tie comes apart: 1 4 of the strip. */
    m = MODEL(6, kStrip);
    assert_true(shim_surface_collapse_and_cut(m.surface, 3)); /* 4 into 1 */
    expect_topology(m.surface, 6, 6, 2, 6, 2, 2);
    const shim_table strip = shim_surface_table(m.surface);
    assert_int_equal(strip.copies, 1);
    assert_int_equal(strip.copy_of[0], 1);
    free_model(&m);

    /* A loop with a side on the boundary is refused, and nothing has changed: an annulus three round. */
    static const int32_t annulus[] = {0, 1, 3, 1, 4, 3, 1, 2, 4, 2, 5, 4, 2, 0, 5, 0, 3, 5};
    m = MODEL(6, annulus);
    expect_topology(m.surface, 6, 12, 6, 6, 1, 2);
    const shim_table before = shim_surface_table(m.surface);
    int32_t twins[18];
    memcpy(twins, before.corner_twin, sizeof twins);
    assert_false(shim_surface_collapse_and_cut(m.surface, 0)); /* 0 1, on the loop 0 1 2 of the boundary */
    const shim_table after = shim_surface_table(m.surface);
    EXPECT(after.corner_vert, after.corners, annulus);
    EXPECT(after.corner_twin, after.twins, twins);
    expect_topology(m.surface, 6, 12, 6, 6, 1, 2);
    free_model(&m);
}

/* ---- removal of a face ----------------------------------------------------------------------------------------------------- */

static void test_remove_boundary_face(void** state) {
    (void)state;
    /* An ear: vertex 3 is left unused. */
    model m = MODEL(4, kPair);
    shim_surface_remove_boundary_face(m.surface, 5);
    shim_table s = shim_surface_table(m.surface);
    static const int32_t ear[] = {0, 1, 2, -1, -1, -1};
    EXPECT(s.corner_vert, s.corners, ear);
    assert_int_equal(s.vert_corner[3], -1);
    expect_topology(m.surface, 3, 3, 1, 3, 1, 1);
    shim_surface_remove_boundary_face(m.surface, 1); /* and the lone triangle */
    expect_topology(m.surface, 0, 0, 0, 0, 0, 0);
    free_model(&m);

    /* A pinch: 1 4 3 goes by its edge 4 3, and 1 is on the boundary: it gets a copy on one side. */
    m = MODEL(6, kStrip);
    shim_surface_remove_boundary_face(m.surface, 4);
    s = shim_surface_table(m.surface);
    expect_topology(m.surface, 7, 8, 3, 7, 2, 2);
    assert_int_equal(s.copies, 1);
    assert_int_equal(s.copy_of[0], 1);
    assert_int_equal(s.first_split, 7);
    assert_true((s.corner_vert[1] == 1 && s.corner_vert[6] == 6) || (s.corner_vert[1] == 6 && s.corner_vert[6] == 1));
    assert_memory_equal(s.pos + 18, kPoints + 3, 3 * sizeof(double));
    free_model(&m);

    /* No pinch: a face at the rim of a fan whose hub is inside; the hub gets on the boundary. */
    static const int32_t hub[] = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1};
    m = MODEL(5, hub);
    shim_surface_remove_boundary_face(m.surface, 4); /* 2 3 */
    expect_topology(m.surface, 5, 7, 3, 5, 1, 1);
    assert_int_equal(shim_surface_table(m.surface).copies, 0);
    free_model(&m);

    /* A closed surface opened, then a page of a book: the ring loses a member. */
    static const int32_t pages[] = {0, 1, 2, 1, 0, 3, 0, 1, 4};
    m = MODEL(5, pages);
    shim_surface_remove_boundary_face(m.surface, 4);
    s = shim_surface_table(m.surface);
    int32_t members = 0;
    for (int32_t c = 0; c < s.corners; ++c) members += s.corner_vert[c] >= 0 && s.corner_twin[c] <= -2;
    assert_int_equal(members, 2);
    expect_topology(m.surface, 6, 6, 2, 6, 2, 2);
    int32_t pieces[3];
    assert_int_equal(shim_surface_split_everywhere(m.surface, 0, 0.5, pieces, 3), 2);
    free_model(&m);
}

/* ---- the validator itself -------------------------------------------------------------------------------------------------- */

static void test_valid_notices(void** state) {
    (void)state;
    if (shim_surface_valid_traps()) skip(); /* with debug checks a broken table ends the program */
    for (int what = 0; what < 6; ++what) {
        model m = MODEL(6, kOctahedron);
        assert_true(shim_surface_valid(m.surface));
        const shim_table s = shim_surface_table(m.surface);
        switch (what) {
        case 0:
            s.corner_vert[7] = 99;
            break;
        case 1:
            s.corner_vert[7] = s.corner_vert[6];
            break;
        case 2:
            s.corner_twin[7] = s.corner_twin[8];
            break;
        case 3:
            s.corner_twin[7] = -1;
            break;
        case 4:
            s.corner_bits[7] ^= 1;
            break;
        default:
            s.vert_corner[3] = 0;
            break;
        }
        if (shim_surface_valid(m.surface)) fail_msg("defect %d went unnoticed", what);
        free_model(&m);
    }
}

/* ---- random walks ---------------------------------------------------------------------------------------------------------- */

/* Would the collapse of this corner's edge touch a cut edge? Then its copies would have to follow: nobody does that. */
static int near_cut(const shim_table* s, int32_t corner) {
    const int32_t goes = s->corner_vert[next_of(corner)];
    for (int32_t c = 0; c < s->corners; ++c)
        if (s->corner_vert[c] == goes && (s->corner_twin[c] <= -2 || s->corner_twin[prev_of(c)] <= -2)) return 1;
    return 0;
}

static void random_walk(soup start, uint64_t seed, int steps) {
    model m = model_of_soup(&start);
    const topology before = checked(m.surface);
    int64_t flips = 0, splits = 0, cut_splits = 0, collapses = 0;
    int32_t live = before.faces;
    for (int step = 0; step < steps; ++step) {
        const shim_table s = shim_surface_table(m.surface);
        const int32_t what = random_below(&seed, 4);
        int32_t c = random_below(&seed, (int32_t)s.corners);
        while (s.corner_vert[c] < 0) c = random_below(&seed, (int32_t)s.corners); /* not of a face that is gone */
        const int32_t t = s.corner_twin[c];
        if (what < 2) {
            if (t < 0) continue;
            const int32_t u = s.corner_vert[prev_of(c)], v = s.corner_vert[prev_of(t)];
            if (u == v || shim_surface_adjacent(m.surface, u, v)) continue;
            shim_surface_flip(m.surface, c);
            assert_true(shim_surface_adjacent(m.surface, u, v));
            ++flips;
        } else if (what == 2) {
            if (live > 2 * before.faces + 20) continue;
            int32_t pieces[8];
            const int32_t n = shim_surface_split_everywhere(m.surface, c, 0.25 + 0.5 * (random_unit(&seed) + 1) / 2, pieces, 8);
            assert_int_equal(n > 1, t <= -2);
            const shim_table after = shim_surface_table(m.surface);
            assert_int_equal(after.vertices, s.vertices + n);
            for (int32_t i = 0; i < n; ++i) {
                const int32_t x = after.corner_vert[next_of(pieces[i])];
                assert_memory_equal(after.pos + 3 * x, after.pos + 3 * s.vertices, 3 * sizeof(double));
                if (after.roots != 0) assert_int_equal(after.vert_root[x], s.vertices);
            }
            splits += n;
            if (t <= -2) ++cut_splits;
        } else {
            if (live < before.faces / 2 || near_cut(&s, c) || !shim_surface_collapse_is_legal(m.surface, c)) continue;
            shim_surface_collapse(m.surface, c);
            ++collapses;
        }
        const topology n = checked(m.surface);
        live = n.faces;
        if (n.euler != before.euler || n.components != before.components || n.loops != before.loops)
            fail_msg("step %d (kind %d) changed the topology", step, what);
    }
    if (flips < steps / 10 || splits < steps / 100 || collapses < steps / 100)
        fail_msg("only %d flips, %d splits, %d collapses: a walk on the spot", (int)flips, (int)splits, (int)collapses);
    if (shim_surface_table(m.surface).roots != 0) assert_true(cut_splits > 5);
    free_model(&m);
}

static void test_walk_torus(void** state) {
    (void)state;
    random_walk(torus(4, 4, 0, 0), 1, 6000);
    random_walk(torus(7, 5, 0.1, 2), 3, 6000);
}
static void test_walk_disc(void** state) {
    (void)state;
    random_walk(sheet(4, 4, 1, 0.1, 4), 5, 6000);
    random_walk(fan(9, 6), 7, 6000);
}
static void test_walk_book(void** state) {
    (void)state;
    random_walk(book(3, 3, 0, 0), 9, 6000);
    random_walk(book(5, 2, 0.1, 10), 11, 6000);
}

/* ---- the whole table as it is ---------------------------------------------------------------------------------------------- */

/* A copy of what means anything: of faces that are gone and numbers that are not in use, only that they are. */
typedef struct {
    int64_t size;
    uint8_t* bytes;
    int64_t capacity;
} snapshot;

static void append(snapshot* s, const void* data, size_t size) {
    if (s->size + (int64_t)size > s->capacity) {
        s->capacity = 2 * (s->size + (int64_t)size);
        s->bytes = (uint8_t*)realloc(s->bytes, (size_t)s->capacity);
    }
    memcpy(s->bytes + s->size, data, size);
    s->size += (int64_t)size;
}
static snapshot snapshot_of(shim_surface* surface) {
    const shim_table t = shim_surface_table(surface);
    const int64_t sizes[] = {t.corners,         t.twins,      t.bits,       t.vert_corners,  t.face_srcs, t.slot_count,
                             t.roots,           t.copies,     t.dead_faces, t.carrier_count, t.pin_count, t.vertices,
                             t.vertices_in_use, t.first_copy, t.first_split};
    snapshot s = {0, NULL, 0};
    append(&s, sizes, sizeof sizes);
    append(&s, t.corner_vert, (size_t)t.corners * sizeof(int32_t));
    append(&s, t.vert_corner, (size_t)t.vertices * sizeof(int32_t));
    if (t.slot_count != 0) append(&s, t.slots, (size_t)t.slot_count * 2 * sizeof(int32_t));
    for (int32_t c = 0; c < t.corners; ++c) {
        if (t.corner_vert[c] < 0) continue;
        const int32_t of_corner[] = {t.corner_twin[c], t.corner_bits[c], t.face_src[c / 3]};
        append(&s, of_corner, sizeof of_corner);
    }
    for (int32_t v = 0; v < t.vertices; ++v) {
        if (v >= t.first_split) append(&s, t.pins + (v - t.first_split), sizeof(int32_t));
        if (t.vert_corner[v] < 0) continue;
        append(&s, t.pos + 3 * v, 3 * sizeof(double));
        if (t.roots != 0) append(&s, t.vert_root + v, sizeof(int32_t));
        if (v < t.first_split) continue;
        int32_t carrier;
        const double parameter = shim_surface_split_parameter(surface, v, &carrier);
        append(&s, &parameter, sizeof parameter);
        append(&s, &carrier, sizeof carrier);
        append(&s, t.carriers + 2 * carrier, 2 * sizeof(int32_t));
        append(&s, t.carrier_splits + carrier, sizeof(int32_t));
    }
    return s;
}
static void free_snapshot(snapshot* s) {
    free(s->bytes);
    s->bytes = NULL;
}
static void expect_snapshot(shim_surface* surface, const snapshot* expected, const char* what) {
    snapshot s = snapshot_of(surface);
    if (s.size != expected->size) fail_msg("%s: the table has another size", what);
    for (int64_t i = 0; i < s.size; ++i)
        if (s.bytes[i] != expected->bytes[i]) fail_msg("%s: byte %d of the table differs", what, (int)i);
    free_snapshot(&s);
}

/* The numbers that only trials and taking out keep: how many split vertices each carrier has, how many carriers end at a vertex. */
static void check_books(shim_surface* surface) {
    const shim_table t = shim_surface_table(surface);
    int32_t* const splits = (int32_t*)calloc((size_t)t.carrier_count + 1, sizeof(int32_t));
    int32_t* const ends = (int32_t*)calloc((size_t)t.vertices + 1, sizeof(int32_t));
    for (int32_t v = t.first_split; v < t.vertices; ++v) {
        if (t.vert_corner[v] < 0) continue;
        int32_t carrier;
        shim_surface_split_parameter(surface, v, &carrier);
        REQUIRE(carrier >= 0 && carrier < t.carrier_count, v);
        ++splits[carrier];
    }
    for (int32_t k = 0; k < t.carrier_count; ++k) {
        if (splits[k] != t.carrier_splits[k]) fail_msg("carrier %d has %d splits, not %d", k, splits[k], t.carrier_splits[k]);
        if (splits[k] == 0) continue;
        for (int end = 0; end < 2; ++end) {
            const int32_t v = t.carriers[2 * k + end];
            REQUIRE(v >= 0 && v < t.vertices && t.vert_corner[v] >= 0, v);
            ++ends[v];
        }
    }
    for (int32_t v = t.first_split; v < t.vertices; ++v)
        if (ends[v] != t.pins[v - t.first_split])
            fail_msg("at vertex %d end %d carriers, not %d", v, ends[v], t.pins[v - t.first_split]);
    free(splits);
    free(ends);
}

/* ---- unsplit --------------------------------------------------------------------------------------------------------------- */

/* The table after a split and its opposite is the one before, but for what is now unused. */
static void expect_same_part(shim_surface* surface, const shim_table* before, const int32_t* corner_vert,
                             const int32_t* corner_twin, const uint16_t* bits, const int32_t* vert_corner) {
    const shim_table t = shim_surface_table(surface);
    expect_ints("corner_vert", t.corner_vert, before->corners, corner_vert, before->corners);
    expect_ints("corner_twin", t.corner_twin, before->corners, corner_twin, before->corners);
    expect_ints("vert_corner", t.vert_corner, before->vertices, vert_corner, before->vertices);
    assert_memory_equal(t.corner_bits, bits, (size_t)before->corners * sizeof *bits);
    for (int64_t c = before->corners; c < t.corners; ++c) assert_true(t.corner_vert[c] < 0);
    for (int64_t v = before->vertices; v < t.vertices; ++v) assert_true(t.vert_corner[v] < 0);
    assert_int_equal(t.vertices_in_use, before->vertices_in_use);
    assert_int_equal(t.dead_faces, (t.corners - before->corners) / 3);
}

static void test_unsplit(void** state) {
    (void)state;
    for (int which = 0; which < 3; ++which)
        for (int32_t c = 0; c < (which == 0 ? 6 : which == 1 ? 12 : 24); ++c)
            for (int again = 0; again < 2; ++again) {
                model m = which == 0 ? MODEL(4, kPair) : which == 1 ? MODEL(6, kStrip) : MODEL(6, kOctahedron);
                for (int32_t k = 0; k < (which == 2 ? 24 : which == 1 ? 12 : 6); ++k) {
                    const int32_t bits[] = {k, k % 7};
                    set_bits(m.surface, bits, 1);
                }
                const shim_table t = shim_surface_table(m.surface);
                int32_t verts[24], twins[24], firsts[6];
                uint16_t bits[24];
                memcpy(verts, t.corner_vert, (size_t)t.corners * sizeof(int32_t));
                memcpy(twins, t.corner_twin, (size_t)t.corners * sizeof(int32_t));
                memcpy(bits, t.corner_bits, (size_t)t.corners * sizeof *bits);
                memcpy(firsts, t.vert_corner, (size_t)t.vertices * sizeof(int32_t));
                const topology before = checked(m.surface);
                /* From either side: the edge that arrives at the new vertex in the first face, or in the other one. */
                for (int from = 0; from < (twins[c] >= 0 ? 2 : 1); ++from) {
                    const int32_t tail = shim_surface_split(m.surface, c);
                    const shim_table split = shim_surface_table(m.surface);
                    assert_int_equal(split.vertices, t.vertices + 1); /* the number is used again */
                    assert_int_equal(split.carrier_count, 1);
                    assert_int_equal(split.corners, t.corners + (twins[c] >= 0 ? 6 : 3));
                    assert_int_equal(split.carrier_splits[0], 1);
                    check_books(m.surface);
                    if (again) shim_surface_begin_trial(m.surface);
                    shim_surface_unsplit(m.surface, from == 0 ? c : split.corner_twin[tail]);
                    if (again) shim_surface_keep_trial(m.surface);
                    const topology after = checked(m.surface);
                    assert_memory_equal(&before, &after, sizeof before);
                    check_books(m.surface);
                    assert_int_equal(shim_surface_table(m.surface).carrier_splits[0], 0);
                    if (from == 0) expect_same_part(m.surface, &t, verts, twins, bits, firsts);
                }
                free_model(&m);
            }
}

/* Numbers that a trial frees are not used again before it is kept: if it is undone they are still somebody's. */
static void test_numbers_in_trials(void** state) {
    (void)state;
    model m = MODEL(6, kOctahedron);
    shim_surface_split(m.surface, 0); /* 6, faces 8 and 9 */
    snapshot before = snapshot_of(m.surface);
    for (int keep = 0; keep < 2; ++keep) {
        shim_surface_begin_trial(m.surface);
        shim_surface_unsplit(m.surface, 0);
        const int32_t tail = shim_surface_split(m.surface, 0);
        shim_table t = shim_surface_table(m.surface);
        assert_int_equal(t.vertices, 8);
        assert_int_equal(t.corner_vert[tail], 7);
        assert_int_equal(t.corners, 36);
        assert_int_equal(t.carrier_count, 2);
        assert_int_equal(tail, 30);
        if (!keep) {
            shim_surface_undo_trial(m.surface);
            expect_snapshot(m.surface, &before, "undone");
        } else {
            shim_surface_keep_trial(m.surface);
            expect_topology(m.surface, 7, 15, 10, 0, 1, 0);
            assert_int_equal(shim_surface_table(m.surface).vertices_in_use, 7);
            shim_surface_split(m.surface, 3); /* 1 2 of the next face: takes what is free */
            t = shim_surface_table(m.surface);
            assert_int_equal(t.vertices, 8);
            assert_int_equal(t.corners, 36);
            assert_int_equal(t.carrier_count, 2);
            assert_int_equal(t.dead_faces, 0);
            assert_true(t.vert_corner[6] >= 0);
        }
        check_books(m.surface);
    }
    free_snapshot(&before);
    free_model(&m);
}

/* But a copy that an edit makes of a split vertex gets a new number, whatever was given back: the loop looks for what an edit added
 * at the end. */
static void test_copies_are_new(void** state) {
    (void)state;
    static const int32_t quad[] = {0, 1, 2, 0, 2, 3};
    model m = MODEL(4, quad);
    shim_surface_split(m.surface, 4); /* 4 on the edge 2 3: faces 0 2 4 and 4 3 0 */
    const int32_t tail = shim_surface_split(m.surface, 1);
    shim_surface_unsplit(m.surface, 1); /* 5, given back */
    assert_true(tail > 0);
    shim_surface_flip(m.surface, 3); /* 0 2 becomes 1 4 */
    shim_table s = shim_surface_table(m.surface);
    assert_int_equal(s.vertices, 6);
    assert_int_equal(s.vertices_in_use, 5);
    int32_t rim = -1;
    for (int32_t c = 0; c < s.corners; ++c)
        if (s.corner_vert[c] == 0 && s.corner_vert[next_of(c)] == 1 && s.corner_vert[prev_of(c)] == 4) rim = c;
    assert_true(rim >= 0 && s.corner_twin[rim] < 0);
    const topology before = checked(m.surface);
    shim_surface_remove_boundary_face(m.surface, rim); /* what is left meets in 4 alone */
    s = shim_surface_table(m.surface);
    assert_int_equal(s.vertices, 7);
    assert_int_equal(s.vert_corner[5], -1);
    assert_true(s.vert_corner[6] >= 0 && s.copies == 0);
    assert_int_equal(s.pins[6 - s.first_split], 0);
    assert_memory_equal(s.pos + 18, s.pos + 12, 3 * sizeof(double));
    int32_t carrier[2];
    assert_true(shim_surface_split_parameter(m.surface, 4, &carrier[0]) ==
                shim_surface_split_parameter(m.surface, 6, &carrier[1]));
    assert_int_equal(carrier[0], carrier[1]);
    check_books(m.surface);
    assert_int_equal(checked(m.surface).components, before.components + 1);
    shim_surface_split(m.surface, s.vert_corner[6]); /* a split takes what was given back */
    assert_int_equal(shim_surface_table(m.surface).vertices, 7);
    free_model(&m);
}

/* ---- random trials --------------------------------------------------------------------------------------------------------- */

typedef struct {
    int64_t flips, splits, unsplits, flips_beside_cuts, kept, undone;
} tally;

/* Where a vertex lies on a carrier; NAN if it does not. */
static double parameter_on(shim_surface* surface, const shim_table* t, int32_t carrier, int32_t v) {
    if (t->carriers[2 * carrier] == v) return 0;
    if (t->carriers[2 * carrier + 1] == v) return 1;
    if (v < t->first_split) return NAN;
    int32_t its;
    const double parameter = shim_surface_split_parameter(surface, v, &its);
    return its == carrier ? parameter : NAN;
}

/* May the edge c -> s be made one with the edge beyond s? */
static int unsplit_is_legal(shim_surface* surface, const shim_table* t, int32_t c) {
    const int32_t p = t->corner_vert[c], s = t->corner_vert[next_of(c)];
    if (s < t->first_split || t->pins[s - t->first_split] != 0) return 0;
    int32_t faces = 0, k = t->vert_corner[s];
    do {
        if (t->corner_twin[k] <= -2 || t->corner_twin[prev_of(k)] <= -2) return 0;
        ++faces;
        k = t->corner_twin[prev_of(k)];
    } while (k >= 0 && k != t->vert_corner[s]);
    if (faces != (k < 0 ? 2 : 4) || (k < 0) != (t->corner_twin[c] < 0)) return 0;
    const int32_t beyond = next_of(t->corner_twin[next_of(c)]);
    const int32_t q = t->corner_vert[next_of(beyond)];
    int32_t carrier;
    const double at = shim_surface_split_parameter(surface, s, &carrier);
    const double one = parameter_on(surface, t, carrier, p), other = parameter_on(surface, t, carrier, q);
    return (one - at) * (other - at) < 0 && !shim_surface_adjacent(surface, p, q);
}

/* One edit, if the one that was drawn is legal here. `surface`: whole or part. more_splits: 0 none, 2 instead of unsplits. */
static void random_edit(shim_surface* surface, uint64_t* seed, int more_splits, tally* n) {
    const shim_table t = shim_surface_table(surface);
    int32_t c = random_below(seed, (int32_t)t.corners);
    int32_t what = random_below(seed, 6);
    if (more_splits == 2 && what > 2) what = 2;
    if (t.corner_vert[c] < 0 || !shim_surface_may_edit(surface, c) || !shim_surface_has_room(surface)) return;
    const int32_t twin = t.corner_twin[c];
    if (what < 2) {
        if (twin < 0) return;
        const int32_t u = t.corner_vert[prev_of(c)], v = t.corner_vert[prev_of(twin)];
        if (u == v || shim_surface_adjacent(surface, u, v)) return;
        const int32_t around[4] = {next_of(c), prev_of(c), next_of(twin), prev_of(twin)};
        for (int i = 0; i < 4; ++i) n->flips_beside_cuts += t.corner_twin[around[i]] <= -2;
        shim_surface_flip(surface, c);
        ++n->flips;
    } else if (what == 2) {
        if (!more_splits || twin <= -2) return;
        int32_t piece;
        assert_int_equal(shim_surface_split_everywhere(surface, c, 0.25 + 0.25 * (random_unit(seed) + 1), &piece, 1), 1);
        ++n->splits;
    } else { /* of the first corner from here on where it is possible */
        for (int32_t step = 0; step < 60; ++step, c = (c + 1) % (int32_t)t.corners) {
            if (t.corner_vert[c] < 0 || !shim_surface_may_edit(surface, c) || !unsplit_is_legal(surface, &t, c)) continue;
            const int32_t beyond = next_of(t.corner_twin[next_of(c)]);
            if (!shim_surface_may_edit(surface, beyond)) continue;
            shim_surface_unsplit(surface, c);
            ++n->unsplits;
            return;
        }
    }
}

static void trials(soup start, uint64_t seed, int rounds) {
    model m = model_of_soup(&start);
    const int32_t given = shim_surface_table(m.surface).vertices;
    const topology before = checked(m.surface);
    tally n = {0, 0, 0, 0, 0, 0};
    for (int round = 0; round < rounds; ++round) {
        const shim_table t = shim_surface_table(m.surface);
        const int keep = random_below(&seed, 3) != 0;
        const int32_t edits = 1 + random_below(&seed, round % 16 == 0 ? 300 : 24);
        const int more = t.vertices_in_use < 3 * (int64_t)before.vertices;
        snapshot was = snapshot_of(m.surface);
        shim_surface_begin_trial(m.surface);
        const uint64_t seed_of_trial = seed;
        tally ignored = n;
        for (int32_t i = 0; i < edits; ++i) random_edit(m.surface, &seed, more, keep ? &n : &ignored);
        const topology during = checked(m.surface);
        assert_true(during.euler == before.euler && during.components == before.components && during.loops == before.loops);
        if (keep) {
            snapshot is = snapshot_of(m.surface);
            /* What is kept is what the trial made; and the same after an undone one, numbers and all. */
            if (round % 4 == 0) {
                shim_surface_undo_trial(m.surface);
                expect_snapshot(m.surface, &was, "undone first");
                shim_surface_begin_trial(m.surface);
                uint64_t same = seed_of_trial;
                tally unused = n;
                for (int32_t i = 0; i < edits; ++i) random_edit(m.surface, &same, more, &unused);
                assert_true(same == seed);
                expect_snapshot(m.surface, &is, "done twice");
            }
            free_snapshot(&is);
            shim_surface_keep_trial(m.surface);
            ++n.kept;
        } else {
            shim_surface_undo_trial(m.surface);
            expect_snapshot(m.surface, &was, "undone");
            ++n.undone;
        }
        free_snapshot(&was);
        const topology after = checked(m.surface);
        assert_true(after.euler == before.euler && after.components == before.components && after.loops == before.loops);
        const shim_table now = shim_surface_table(m.surface);
        int64_t used = 0; /* every vertex has faces: all that is not in use is free */
        for (int32_t v = 0; v < now.vertices; ++v) used += now.vert_corner[v] >= 0;
        assert_int_equal(now.vertices_in_use, used);
        check_books(m.surface);
    }
    if (n.flips < rounds || n.splits < rounds / 8 || n.unsplits < rounds / 8 || n.kept < rounds / 4 || n.undone < rounds / 8)
        fail_msg("%d flips, %d splits, %d unsplits: too few", (int)n.flips, (int)n.splits, (int)n.unsplits);
    if (shim_surface_table(m.surface).roots != 0 && n.flips_beside_cuts < rounds / 8)
        fail_msg("%d flips beside cuts: too few", (int)n.flips_beside_cuts);
    /* Numbers are used again, but for vertices between split vertices. */
    assert_true(shim_surface_table(m.surface).vertices - given < n.splits);
    free_model(&m);
}

static void test_trials_torus(void** state) {
    (void)state;
    trials(torus(4, 4, 0, 0), 1, 800);
    trials(torus(7, 5, 0.1, 2), 3, 800);
}
static void test_trials_disc(void** state) {
    (void)state;
    trials(sheet(4, 4, 1, 0.1, 4), 5, 800);
    trials(fan(9, 6), 7, 800);
}
static void test_trials_book(void** state) {
    (void)state;
    trials(book(3, 3, 0, 0), 9, 800);
    trials(book(5, 2, 0.1, 10), 11, 800);
}

/* ---- parts ----------------------------------------------------------------------------------------------------------------- */

enum { kNobody = 255 };

/* Owners of a sheet's vertices by their column: 0 on the left, 1 on the right, nobody where they have neighbours on both sides. */
static void find_owners(shim_surface* surface, double border, uint8_t* owner) {
    const shim_table t = shim_surface_table(surface);
    for (int32_t v = 0; v < t.vertices; ++v) owner[v] = t.pos[3 * v] < border ? 0 : 1;
    uint8_t* const at_border = (uint8_t*)calloc((size_t)t.vertices + 1, 1);
    for (int32_t c = 0; c < t.corners; ++c) {
        if (t.corner_vert[c] < 0) continue;
        const int32_t a = t.corner_vert[c], b = t.corner_vert[next_of(c)];
        if (owner[a] != owner[b] || t.corner_twin[c] <= -2)
            at_border[a] = at_border[b] = at_border[t.corner_vert[prev_of(c)]] = 1;
    }
    for (int32_t v = 0; v < t.vertices; ++v)
        if (at_border[v]) owner[v] = kNobody;
    free(at_border);
}

static void parts(soup start, double border, uint64_t seed, int turns) {
    enum { kVerts = 30, kMost = 20000 };
    model m = model_of_soup(&start);
    const topology before = checked(m.surface);
    uint8_t* const owner = (uint8_t*)malloc(kMost);
    tally n = {0, 0, 0, 0, 0, 0};
    int filled = 0;
    for (int turn = 0; turn < turns; ++turn) {
        find_owners(m.surface, border, owner);
        const shim_table was = shim_surface_table(m.surface);
        const shim_share all = shim_surface_grow_blank(m.surface, 2 * kVerts, 4 * kVerts, 2 * kVerts);
        assert_int_equal(all.to[0] - all.from[0], 2 * kVerts);
        assert_int_equal(all.to[1] - all.from[1], 4 * kVerts);
        assert_int_equal(all.from[0], was.vertices);
        assert_true(all.to[0] < kMost);
        shim_surface* part[2];
        for (int i = 0; i < 2; ++i) {
            shim_share share = all;
            for (int k = 0; k < 3; ++k) {
                const int32_t half = (all.to[k] - all.from[k]) / 2;
                share.from[k] = all.from[k] + i * half;
                share.to[k] = share.from[k] + half;
            }
            memset(owner + share.from[0], i, kVerts);
            part[i] = shim_surface_part(m.surface, (uint8_t)i);
            shim_surface_supply(part[i], m.surface, &share, owner);
            assert_true(shim_surface_has_room(part[i]));
        }
        const int32_t steps = turn % 3 == 2 ? 200 : 40;
        for (int32_t step = 0; step < steps; ++step) {
            if (step == 150) { /* further numbers for one of them, while what it has is kept */
                const shim_share more = shim_surface_grow_blank(m.surface, kVerts / 3, kVerts / 3 * 2, kVerts / 3);
                assert_true(more.to[0] < kMost);
                const uint8_t which = turn % 2;
                memset(owner + more.from[0], which, kVerts / 3);
                for (int i = 0; i < 2; ++i) shim_surface_supply(part[i], m.surface, i == which ? &more : NULL, owner);
                assert_true(shim_surface_has_room(part[which]));
            }
            const int i = random_below(&seed, 2);
            const int open = random_below(&seed, 4); /* 0: no trial, 1: undone, else kept */
            const int64_t dead = shim_surface_table(part[i]).dead_faces;
            snapshot copy = snapshot_of(part[i]);
            if (open != 0) shim_surface_begin_trial(part[i]);
            tally ignored = n;
            const int32_t edits = open == 0 ? 1 : 1 + random_below(&seed, 30);
            for (int32_t k = 0; k < edits; ++k) random_edit(part[i], &seed, turn % 3 == 1 ? 2 : 1, open == 1 ? &ignored : &n);
            if (open == 1) {
                shim_surface_undo_trial(part[i]);
                expect_snapshot(part[i], &copy, "undone in a part");
                assert_int_equal(shim_surface_table(part[i]).dead_faces, dead);
            } else if (open > 1)
                shim_surface_keep_trial(part[i]);
            free_snapshot(&copy);
        }
        for (int i = 0; i < 2; ++i) filled += !shim_surface_has_room(part[i]);
        for (int i = 0; i < 2; ++i) shim_surface_take_back(m.surface, part[i]);
        for (int i = 0; i < 2; ++i) assert_false(shim_surface_has_room(part[i])); /* nothing is left to it */
        for (int i = 0; i < 2; ++i) shim_surface_free(part[i]);
        const topology after = checked(m.surface);
        assert_true(after.euler == before.euler && after.components == before.components && after.loops == before.loops);
        check_books(m.surface);
        shim_table now = shim_surface_table(m.surface);
        int64_t used = 0;
        for (int32_t v = 0; v < now.vertices; ++v) used += now.vert_corner[v] >= 0;
        assert_int_equal(now.vertices_in_use, used);
        /* Nobody's faces are as they were: their vertices, at least. What was free is used before the table grows: on vertices of
         * the input, for those between split vertices get new numbers. */
        for (int32_t free_numbers = (int32_t)(now.vertices - now.vertices_in_use), i = 0; i < free_numbers && i < 8;) {
            const int32_t c = random_below(&seed, (int32_t)now.corners);
            now = shim_surface_table(m.surface);
            if (now.corner_vert[c] < 0 || now.corner_vert[c] >= now.first_split ||
                now.corner_vert[next_of(c)] >= now.first_split || now.corner_twin[c] <= -2)
                continue;
            int32_t piece;
            assert_int_equal(shim_surface_split_everywhere(m.surface, c, 0.5, &piece, 1), 1);
            const shim_table grown = shim_surface_table(m.surface);
            assert_int_equal(grown.vertices, now.vertices);
            assert_int_equal(grown.corners, now.corners);
            assert_int_equal(grown.vertices_in_use, now.vertices_in_use + 1);
            ++i;
        }
        checked(m.surface);
        check_books(m.surface);
    }
    if (filled == 0 || n.flips < turns || n.splits < turns || n.unsplits < turns / 2)
        fail_msg("%d flips, %d splits, %d unsplits, %d parts full: too few", (int)n.flips, (int)n.splits, (int)n.unsplits,
                 filled);
    free(owner);
    free_model(&m);
}

static void test_parts(void** state) {
    (void)state;
    parts(sheet(12, 8, 1, 0.1, 21), 6, 22, 30);
    parts(torus(16, 6, 0.1, 23), 0, 24, 30);
    parts(book(3, 9, 0.1, 25), 0, 26, 30);
}

/* A part that is full says so, and a trial that is undone makes it free again. */
static void test_part_is_full(void** state) {
    (void)state;
    for (int what = 0; what < 3; ++what) { /* vertices, faces, carriers are too few */
        soup s = torus(6, 6, 0, 0);
        model m = model_of_soup(&s);
        static uint8_t owner[200];
        const int32_t few = 3;
        const shim_share share =
            shim_surface_grow_blank(m.surface, what == 0 ? few : 40, what == 1 ? 2 * few + 1 : 80, what == 2 ? few : 40);
        shim_surface* const part = shim_surface_part(m.surface, 0);
        shim_surface_supply(part, m.surface, &share, owner);
        for (int turn = 0; turn < 3; ++turn) {
            shim_surface_begin_trial(part);
            int32_t splits = 0, piece;
            for (; shim_surface_has_room(part); ++splits)
                shim_surface_split_everywhere(part, 6 * splits, 0.5, &piece, 1); /* edges of the grid, far enough apart */
            assert_int_equal(splits, few);
            if (turn < 2) {
                shim_surface_undo_trial(part);
                assert_true(shim_surface_has_room(part));
            } else
                shim_surface_keep_trial(part);
        }
        assert_false(shim_surface_has_room(part));
        if (what != 0) { /* faces and carriers that go come back at once, vertices only where their lines end at the input */
            shim_surface_unsplit(part, 0);
            assert_true(shim_surface_has_room(part));
        }
        shim_surface_take_back(m.surface, part);
        shim_surface_free(part);
        checked(m.surface);
        check_books(m.surface);
        free_model(&m);
    }
}

/* What two threads may do at the same time is decided by may_edit: never the same edge, and never one at the border. */
static void test_may_edit(void** state) {
    (void)state;
    soup s = sheet(6, 4, 1, 0, 0);
    model m = model_of_soup(&s);
    uint8_t owner[40];
    find_owners(m.surface, 3.5, owner);
    shim_surface* const left = shim_surface_part(m.surface, 0);
    shim_surface* const right = shim_surface_part(m.surface, 1);
    shim_surface_supply(left, m.surface, NULL, owner);
    shim_surface_supply(right, m.surface, NULL, owner);
    const shim_table t = shim_surface_table(m.surface);
    int counts[3] = {0, 0, 0};
    for (int32_t c = 0; c < t.corners; ++c) {
        assert_true(shim_surface_may_edit(m.surface, c)); /* the whole is nobody else's */
        const int l = shim_surface_may_edit(left, c), r = shim_surface_may_edit(right, c);
        assert_false(l && r);
        ++counts[l ? 0 : r ? 1 : 2];
        double low = 1e9, high = -1e9; /* x of the up to four vertices around the edge */
        const int32_t around[4] = {c, next_of(c), prev_of(c), t.corner_twin[c] >= 0 ? prev_of(t.corner_twin[c]) : c};
        for (int i = 0; i < 4; ++i) {
            low = fmin(low, t.pos[3 * t.corner_vert[around[i]]]);
            high = fmax(high, t.pos[3 * t.corner_vert[around[i]]]);
        }
        assert_int_equal(l, high <= 2); /* columns 3 and 4 are each other's neighbours */
        assert_int_equal(r, low >= 5);
    }
    assert_true(counts[0] > 0 && counts[1] > 0 && counts[2] > 0);
    assert_false(shim_surface_has_room(left));
    shim_surface_free(left);
    shim_surface_free(right);
    free_model(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_copy),
        cmocka_unit_test(test_copy_rounds),
        cmocka_unit_test(test_flip_pair),
        cmocka_unit_test(test_flip_inside),
        cmocka_unit_test(test_flip_beside_cut),
        cmocka_unit_test(test_split_inside),
        cmocka_unit_test(test_split_boundary),
        cmocka_unit_test(test_carriers),
        cmocka_unit_test(test_split_everywhere),
        cmocka_unit_test(test_collapse_legality),
        cmocka_unit_test(test_collapse),
        cmocka_unit_test(test_collapse_and_cut),
        cmocka_unit_test(test_remove_boundary_face),
        cmocka_unit_test(test_valid_notices),
        cmocka_unit_test(test_walk_torus),
        cmocka_unit_test(test_walk_disc),
        cmocka_unit_test(test_walk_book),
        cmocka_unit_test(test_unsplit),
        cmocka_unit_test(test_numbers_in_trials),
        cmocka_unit_test(test_copies_are_new),
        cmocka_unit_test(test_trials_torus),
        cmocka_unit_test(test_trials_disc),
        cmocka_unit_test(test_trials_book),
        cmocka_unit_test(test_parts),
        cmocka_unit_test(test_part_is_full),
        cmocka_unit_test(test_may_edit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
