/* SPDX-License-Identifier: Apache-2.0 */
/* validate_mesh must name every broken relation and survive anything: each field of a good mesh is broken in turn, then all of
 * them at random. Sanitizer builds show that nothing outside the arrays is read. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "shim_build.h"

/* Three pages on the edge 0 1 (a quad is one of them), one marked outer edge, and a vertex that no face uses. */
static shim_mesh* make(void) {
    static const float points[] = {0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 2, 0, 3, 2, -3, 3, 9, 9, 9};
    static const int32_t corners[] = {0, 1, 2, 3, 1, 0, 4, 0, 1, 5};
    static const int32_t sizes[] = {4, 3, 3};
    static const int32_t marked[] = {0, 2};
    delmesh_mesh_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.positions = (delmesh_view){points, 7, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){corners, 10, 0, DELMESH_INT32, 1};
    desc.face_sizes = (delmesh_view){sizes, 3, 0, DELMESH_INT32, 1};
    desc.marked_edges = (delmesh_view){marked, 1, 0, DELMESH_INT32, 2};
    shim_mesh* const m = shim_mesh_make(NULL, &desc, 0);
    assert_int_equal(shim_mesh_status(m), DELMESH_OK);
    assert_int_equal(shim_mesh_validate(m), DELMESH_OK);
    return m;
}

static void expect_broken(shim_mesh* m, const char* sentence) {
    assert_int_equal(shim_mesh_validate(m), DELMESH_ERROR_INTERNAL);
    assert_string_equal(shim_mesh_error(m), sentence);
    shim_mesh_free(m);
}

/* Breaks one number of a fresh mesh. */
#define BREAK(array, index, value, sentence)                                                                                     \
    do {                                                                                                                         \
        shim_mesh* const m = make();                                                                                             \
        shim_mesh_arrays(m).array[index] = value;                                                                                \
        expect_broken(m, sentence);                                                                                              \
    } while (0)

static void test_what_the_mesh_is(void** state) {
    (void)state;
    shim_mesh* const m = make();
    const shim_arrays a = shim_mesh_arrays(m);
    static const int32_t verts[] = {0, 1, 2, 0, 2, 3, 7, 8, 4, 9, 10, 5};
    static const int32_t twins[] = {-2, -1, 3, 2, -1, -1, -3, -1, -1, -4, -1, -1};
    assert_int_equal(a.corners, 12);
    assert_memory_equal(a.corner_vert + 0, verts, 6 * sizeof(int32_t));
    assert_memory_equal(a.corner_twin, twins, sizeof twins);
    assert_int_equal(a.vertices, 11);
    assert_int_equal(a.slot_count, 3);
    shim_mesh_free(m);
}

static void test_sizes(void** state) {
    (void)state;
    static const char* const sentences[] = {"pos32 had 32 numbers.",
                                            "corner_vert had 11 corners.",
                                            "corner_twin had 11 corners of 12.",
                                            "corner_bits had 11 corners of 12.",
                                            "Corner 9 had slot 2, which was not its own.",
                                            "face_source had 3 faces of 4.",
                                            "vert_source had 10 vertices of 11.",
                                            "vert_join had 10 vertices of 11."};
    for (int32_t array = 0; array < 8; ++array) {
        shim_mesh* const m = make();
        shim_mesh_shorten(m, array);
        expect_broken(m, sentences[array]);
    }
    static const struct {
        int32_t field, value;
        const char* sentence;
    } cases[] = {{SHIM_VERTEX_COUNT, -1, "The vertex count was -1."},
                 {SHIM_VERTEX_COUNT, 12, "pos32 had 33 numbers."},
                 {SHIM_FIRST_SPLIT, -1, "first_split was -1 with 0 split vertices of 11."},
                 {SHIM_FIRST_SPLIT, 10, "first_split was 10 with 0 split vertices of 11."},
                 {SHIM_PRECISION, DELMESH_FLOAT64, "pos32 had 33 numbers."},
                 {SHIM_PRECISION, 77, "The precision was 77."}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        shim_mesh* const m = make();
        shim_mesh_set(m, cases[i].field, cases[i].value);
        expect_broken(m, cases[i].sentence);
    }
}

static void test_faces(void** state) {
    (void)state;
    BREAK(corner_vert, 4, 11, "Corner 1 of face 1 had vertex 11 of 11.");
    BREAK(corner_vert, 4, -1, "Corner 1 of face 1 had vertex -1 of 11.");
    BREAK(corner_vert, 5, 0, "Face 1 had a vertex twice.");
    BREAK(pos32, 3, NAN, "Vertex 1 of face 0 had a NaN or infinite coordinate.");
    BREAK(pos32, 9, INFINITY, "Vertex 3 of face 1 had a NaN or infinite coordinate.");
    BREAK(face_source, 2, -1, "Face 2 had source -1.");
    shim_mesh* const m = make();
    shim_mesh_arrays(m).pos32[3 * 6] = NAN; /* the vertex that no face uses may be anything */
    assert_int_equal(shim_mesh_validate(m), DELMESH_OK);
    shim_mesh_free(m);
}

static void test_twins(void** state) {
    (void)state;
    BREAK(corner_twin, 2, 12, "Corner 2 had twin 12, which was not its own.");
    BREAK(corner_twin, 2, 4, "Corner 2 had twin 4, which was not its own.");
    BREAK(corner_twin, 2, -1, "Corner 3 had twin 2, which was not its own.");
    BREAK(corner_twin, 1, 1, "Corner 1 had its twin 1 in the same face.");
    BREAK(corner_twin, 0, -9, "Corner 0 had slot 7, which was not its own.");
    BREAK(corner_twin, 0, -3, "Corner 0 had slot 1, which was not its own.");
    BREAK(corner_twin, 0, INT32_MIN, "Corner 0 had slot 2147483646, which was not its own.");
    BREAK(corner_vert, 2, 3, "Corner 2 and its twin 3 had different vertices.");
    BREAK(corner_bits, 3, 0, "Corner 2 and its twin 3 had different bits.");
    BREAK(corner_bits, 7, 0x4000, "Corner 7 had edge bits 16384.");
    /* Twins that are each other's, between other vertices. */
    shim_mesh* const m = make();
    const shim_arrays a = shim_mesh_arrays(m);
    a.corner_twin[1] = 7;
    a.corner_twin[7] = 1;
    expect_broken(m, "Corner 1 and its twin 7 had different vertices.");
}

static void test_rings(void** state) {
    (void)state;
    BREAK(slots, 1, 3, "Slot 0 had no right successor: 3.");
    BREAK(slots, 1, -1, "Slot 0 had no right successor: -1.");
    BREAK(slots, 3, 1, "Slot 1 had no right successor: 1."); /* 0 goes there already */
    BREAK(slots, 2, 12, "Corner 6 had slot 1, which was not its own.");
    BREAK(corner_twin, 0, -1, "Slot 0 had corner 0, which was not its own.");
    BREAK(vert_join, 7, 7, "Slots 0 and 1 were no copies of one edge.");
}

static void test_fans(void** state) {
    (void)state;
    /* The quad's halves parted: two fans at its vertices 0 and 2. */
    shim_mesh* const m = make();
    const shim_arrays a = shim_mesh_arrays(m);
    a.corner_twin[2] = a.corner_twin[3] = -1;
    expect_broken(m, "Vertex 0 had several fans of faces.");
}

static void test_maps(void** state) {
    (void)state;
    BREAK(vert_source, 3, -1, "Vertex 3 had source -1.");
    BREAK(vert_join, 3, 4, "Vertex 3 was joined to 4.");
    BREAK(vert_join, 3, -5, "Vertex 3 was joined to -5.");
    BREAK(vert_join, 6, 2, "Vertex 6 was joined to 2, which lay elsewhere.");
    BREAK(pos32, 3 * 7, 0.5f, "Vertex 7 was joined to 1, which lay elsewhere.");
    shim_mesh* m = make();
    shim_mesh_arrays(m).pos32[3 * 7 + 1] = -0.0f; /* is where 0 is */
    assert_int_equal(shim_mesh_validate(m), DELMESH_OK);
    shim_mesh_set_parents(m, 11, 1000);
    assert_int_equal(shim_mesh_validate(m), DELMESH_OK);
    shim_mesh_set_parents(m, 11, -2);
    expect_broken(m, "Vertex 10 had parent -2.");
    m = make();
    shim_mesh_set_parents(m, 10, 0);
    expect_broken(m, "vert_parent had 10 vertices of 11.");
    m = make();
    shim_mesh_set_split(m, 0, 0.5, 0.5, 0);
    assert_int_equal(shim_mesh_validate(m), DELMESH_OK);
    shim_mesh_set_split(m, -1, 0.5, 0.5, 0);
    expect_broken(m, "Vertex 10 lay on a vertex out of range.");
    m = make();
    shim_mesh_set_split(m, 0, 0.5, 0.6, 0);
    expect_broken(m, "Vertex 10 had weights that did not sum to 1.");
    m = make();
    shim_mesh_set_split(m, 0, NAN, 1, 0);
    expect_broken(m, "Vertex 10 had weights that did not sum to 1.");
}

static void test_corner_maps(void** state) {
    (void)state;
    static const struct {
        int32_t field;
        int64_t i;
        double value;
        const char* sentence; /* NULL: all is well */
    } cases[] = {
        {SHIM_CORNER_MAP, 4, 9, NULL},
        {SHIM_CORNER_MAP, 4, -2, NULL}, /* place 1 */
        {SHIM_CORNER_MAP, 4, -3, "Corner 4 had source -3."},
        {SHIM_CORNER_MAP, 4, 10, "Corner 4 had source 10."},
        {SHIM_PLACE_CORNER, 4, 9, NULL},
        {SHIM_PLACE_CORNER, 4, 10, "Place 1 was on corner 10."},
        {SHIM_PLACE_CORNER, 0, -1, "Place 0 was on corner -1."},
        {SHIM_PLACE_WEIGHT, 3, 0.5 + 5e-13, NULL},
        {SHIM_PLACE_WEIGHT, 3, 0.5 + 5e-12, "Place 1 had weights that did not sum to 1."},
        {SHIM_PLACE_WEIGHT, 0, NAN, "Place 0 had weights that did not sum to 1."},
        {SHIM_PLACE_WEIGHT, 1, INFINITY, "Place 0 had weights that did not sum to 1."},
        {SHIM_EDGE_SOURCE, 2, -1, NULL},
        {SHIM_EDGE_SOURCE, 2, -2, "Edge 2 had source -2."},
        {SHIM_EDGE_SOURCE, 2, 11, "Edge 2 had source 11."},
        {SHIM_SOURCE_CORNERS, 0, -1, "The source had less than no vertices, corners, faces or edges."},
        {SHIM_SOURCE_EDGES, 0, 10, "Edge 10 had source 10."},
        {SHIM_LAYER_KIND, 0, 0, "Layer 0 had kind 0."},
        {SHIM_LAYER_COMPONENTS, 0, 17, "Layer 0 had 17 components."},
        {SHIM_LAYER_FIRST, 0, 1, "Layer 0 had its values at 1 of 24."},
        {SHIM_LAYER_FIRST, 0, -1, NULL},
        {SHIM_HAS_MAP, 0, 0, "The mesh had no map, and corners or edges that had a source."},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        shim_mesh* const m = make();
        shim_mesh_set_map(m, cases[i].field, cases[i].i, cases[i].value);
        if (cases[i].sentence != NULL) {
            expect_broken(m, cases[i].sentence);
        } else {
            if (shim_mesh_validate(m) != DELMESH_OK) fail_msg("case %d: %s", (int)i, shim_mesh_error(m));
            shim_mesh_free(m);
        }
    }
}

/* Random numbers in random places: any answer will do, as long as there is one. */
static void test_garbage(void** state) {
    (void)state;
    uint64_t random = 7;
    int64_t broken = 0;
    for (int round = 0; round < 5000; ++round) {
        shim_mesh* const m = make();
        const shim_arrays a = shim_mesh_arrays(m);
        struct {
            int32_t* data;
            int64_t size;
        } const arrays[] = {{a.corner_vert, a.corners},          {a.corner_twin, a.corner_twin_size},
                            {a.slots, 2 * a.slot_count},         {a.face_source, a.face_source_size},
                            {a.vert_source, a.vert_source_size}, {a.vert_join, a.vert_join_size}};
        for (int changes = 1 + round % 6; changes > 0; --changes) {
            random = random * 6364136223846793005u + 1442695040888963407u;
            const unsigned which = (unsigned)(random >> 33) % 6;
            const int64_t where = (int64_t)(random >> 36) % arrays[which].size;
            const int32_t wild = (int32_t)(uint32_t)(random >> 32), near = (int32_t)((random >> 45) % 16) - 4;
            arrays[which].data[where] = random >> 63 != 0 ? wild : near;
        }
        const int32_t status = shim_mesh_validate(m);
        assert_true(status == DELMESH_OK || status == DELMESH_ERROR_INTERNAL);
        assert_true((status == DELMESH_OK) == (shim_mesh_error(m)[0] == 0));
        broken += status != DELMESH_OK;
        shim_mesh_free(m);
    }
    assert_true(broken > 2500);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_the_mesh_is),
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_faces),
        cmocka_unit_test(test_twins),
        cmocka_unit_test(test_rings),
        cmocka_unit_test(test_fans),
        cmocka_unit_test(test_maps),
        cmocka_unit_test(test_corner_maps),
        cmocka_unit_test(test_garbage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
