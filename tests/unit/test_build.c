/* SPDX-License-Identifier: Apache-2.0 */
/* Import: every repair on a mesh small enough to know the exact answer, the errors with their sentences, and the resources. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "shim_build.h"

#define COUNT(array) ((int64_t)(sizeof(array) / sizeof(*(array))))

/* Eight points in general position, for connectivity alone. */
static const float kPoints[24] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 4, 5, 6, 1, -3, 2, 7, 1, -8, 2, -2, -2, -9};

static delmesh_view view(const void* data, int64_t count, int32_t type, int32_t components) {
    const delmesh_view v = {data, count, 0, type, components};
    return v;
}

static delmesh_mesh_desc desc_of(const float* positions, int64_t vertices, const int32_t* corners, int64_t corner_count) {
    delmesh_mesh_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.positions = view(positions, vertices, DELMESH_FLOAT32, 3);
    desc.corner_verts = view(corners, corner_count, DELMESH_INT32, 1);
    return desc;
}

static shim_mesh* make(const delmesh_mesh_desc* desc) {
    return shim_mesh_make(NULL, desc, 0);
}

/* Makes it, expects DELMESH_OK and a valid mesh. */
static shim_mesh* made(const delmesh_mesh_desc* desc) {
    shim_mesh* const m = make(desc);
    assert_string_equal(shim_mesh_error(m), "");
    assert_int_equal(shim_mesh_status(m), DELMESH_OK);
    assert_int_equal(shim_mesh_validate(m), DELMESH_OK);
    return m;
}

static void expect_error(const delmesh_mesh_desc* desc, int32_t status, const char* sentence) {
    shim_mesh* const m = make(desc);
    if (sentence != NULL) assert_string_equal(shim_mesh_error(m), sentence);
    assert_int_equal(shim_mesh_status(m), status);
    shim_mesh_free(m);
}

/* The same mesh is refused when `strict` is set. sentence: NULL for any. */
static void expect_strict(const delmesh_mesh_desc* desc, const char* sentence) {
    delmesh_mesh_desc strict = *desc;
    strict.strict = 1;
    expect_error(&strict, DELMESH_ERROR_STRICT, sentence);
}

static void expect_ints(const int32_t* actual, int64_t actual_count, const int32_t* expected, int64_t count) {
    assert_int_equal(actual_count, count);
    for (int64_t i = 0; i < count; ++i)
        if (actual[i] != expected[i]) fail_msg("element %d is %d instead of %d", (int)i, actual[i], expected[i]);
}
#define EXPECT(array, size, expected) expect_ints(array, size, expected, COUNT(expected))

static void expect_topology(const shim_mesh* m, int64_t faces, int64_t edges, int64_t boundary_edges, int64_t components,
                            int64_t loops, int64_t euler) {
    const delmesh_mesh_info n = shim_mesh_info(m);
    assert_int_equal(n.faces, faces);
    assert_int_equal(n.edges, edges);
    assert_int_equal(n.boundary_edges, boundary_edges);
    assert_int_equal(n.components, components);
    assert_int_equal(n.boundary_loops, loops);
    assert_int_equal(n.euler_characteristic, euler);
}

static int64_t repairs(const shim_mesh* m) {
    const delmesh_mesh_info n = shim_mesh_info(m);
    return n.degenerate_faces + n.duplicate_faces + n.non_finite_faces + n.reoriented_faces + n.nonmanifold_edges +
           n.nonmanifold_vertices + n.copied_vertices;
}

/* ---- clean input is taken as it is ----------------------------------------------------------------------------------------- */

static void test_tetrahedron(void** state) {
    (void)state;
    static const int32_t corners[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
    static const int32_t twins[] = {11, 6, 3, 2, 8, 9, 1, 10, 4, 5, 7, 0};
    delmesh_mesh_desc desc = desc_of(kPoints, 5, corners, COUNT(corners));
    desc.strict = 1;
    shim_mesh* const m = made(&desc);
    const shim_arrays a = shim_mesh_arrays(m);
    EXPECT(a.corner_vert, a.corners, corners);
    EXPECT(a.corner_twin, a.corner_twin_size, twins);
    assert_memory_equal(a.pos32, kPoints, 15 * sizeof(float));
    assert_int_equal(
        a.pos64_size + a.corner_bits_size + a.slot_count + a.face_source_size + a.vert_source_size + a.vert_join_size, 0);
    assert_int_equal(a.first_split, 5);
    expect_topology(m, 4, 6, 0, 1, 0, 2);
    assert_int_equal(shim_mesh_info(m).isolated_vertices, 1);
    assert_int_equal(shim_mesh_info(m).polygons, 4);
    shim_mesh_free(m);
}

static void test_empty(void** state) {
    (void)state;
    const delmesh_mesh_desc desc = desc_of(NULL, 0, NULL, 0);
    shim_mesh* const m = made(&desc);
    expect_topology(m, 0, 0, 0, 0, 0, 0);
    shim_mesh_free(m);
    const delmesh_mesh_desc points = desc_of(kPoints, 8, NULL, 0);
    shim_mesh* const p = made(&points);
    expect_topology(p, 0, 0, 0, 0, 0, 0);
    assert_int_equal(shim_mesh_info(p).isolated_vertices, 8);
    shim_mesh_free(p);
}

/* Csaszar's torus: seven vertices, every two of them joined. Not two faces share more than an edge, yet it looks crowded. */
static void test_csaszar_torus(void** state) {
    (void)state;
    int32_t corners[42];
    for (int32_t i = 0; i < 7; ++i) {
        const int32_t faces[6] = {i, (i + 1) % 7, (i + 3) % 7, i, (i + 3) % 7, (i + 2) % 7};
        memcpy(corners + 6 * i, faces, sizeof faces);
    }
    delmesh_mesh_desc desc = desc_of(kPoints, 7, corners, 42);
    desc.strict = 1;
    shim_mesh* const m = made(&desc);
    expect_topology(m, 14, 21, 0, 1, 0, 0);
    shim_mesh_free(m);
}

/* Two faces back to back with nothing else at their edges are a closed surface. */
static void test_pillow(void** state) {
    (void)state;
    static const int32_t corners[] = {0, 1, 2, 2, 1, 0};
    static const int32_t twins[] = {4, 3, 5, 1, 0, 2};
    delmesh_mesh_desc desc = desc_of(kPoints, 3, corners, COUNT(corners));
    desc.strict = 1;
    shim_mesh* const m = made(&desc);
    const shim_arrays a = shim_mesh_arrays(m);
    EXPECT(a.corner_twin, a.corner_twin_size, twins);
    expect_topology(m, 2, 3, 0, 1, 0, 2);
    shim_mesh_free(m);
}

/* ---- all types and strides give the same mesh ------------------------------------------------------------------------------ */

static void test_types_and_strides(void** state) {
    (void)state;
    static const int32_t corners[] = {0, 2, 1, 0, 1, 3};
    struct {
        double xyz[3];
        int32_t other;
    } wide[4];
    struct {
        int64_t abc[3];
        char other[5];
    } rows[2];
    uint32_t unsigned_corners[6];
    for (int i = 0; i < 12; ++i) wide[i / 3].xyz[i % 3] = (double)kPoints[i];
    for (int i = 0; i < 6; ++i) {
        rows[i / 3].abc[i % 3] = corners[i];
        unsigned_corners[i] = (uint32_t)corners[i];
    }
    delmesh_mesh_desc desc = desc_of(kPoints, 4, corners, 6);
    desc.positions = view(wide, 4, DELMESH_FLOAT64, 3);
    desc.positions.stride = sizeof wide[0];
    desc.corner_verts = view(rows, 2, DELMESH_INT64, 3);
    desc.corner_verts.stride = sizeof rows[0];
    shim_mesh* const m = made(&desc);
    const shim_arrays a = shim_mesh_arrays(m);
    assert_int_equal(a.pos32_size, 0);
    assert_int_equal(a.pos64_size, 12);
    for (int i = 0; i < 12; ++i) assert_true(a.pos64[i] == (double)kPoints[i]);
    EXPECT(a.corner_vert, a.corners, corners);
    shim_mesh_free(m);

    static const uint8_t sizes[] = {3, 3};
    static const int64_t offsets[] = {0, 3, 6};
    desc = desc_of(kPoints, 4, corners, 6);
    desc.corner_verts = view(unsigned_corners, 6, DELMESH_UINT32, 1);
    for (int polygons = 0; polygons < 2; ++polygons) {
        if (polygons == 0)
            desc.face_sizes = view(sizes, 2, DELMESH_UINT8, 1);
        else
            desc.face_offsets = view(offsets, 3, DELMESH_INT64, 1);
        shim_mesh* const p = made(&desc);
        const shim_arrays b = shim_mesh_arrays(p);
        EXPECT(b.corner_vert, b.corners, corners);
        assert_int_equal(b.face_source_size, 0); /* all triangles: the identity */
        assert_int_equal(shim_mesh_info(p).polygons, 2);
        shim_mesh_free(p);
        memset(&desc.face_sizes, 0, sizeof desc.face_sizes);
    }
}

/* ---- what is no mesh ------------------------------------------------------------------------------------------------------- */

static void test_bad_indices(void** state) {
    (void)state;
    static const uint32_t large[] = {0, 1, 2, 2, 1, 4294967295u};
    static const int64_t negative[] = {0, -7, 2};
    static const int32_t one_past[] = {0, 1, 2, 0, 4, 1};
    delmesh_mesh_desc desc = desc_of(kPoints, 4, one_past, 6);
    expect_error(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "corner_verts: corner 4 had vertex 4; there were 4 vertices.");
    desc.corner_verts = view(large, 6, DELMESH_UINT32, 1);
    expect_error(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "corner_verts: corner 5 had vertex 4294967295; there were 4 vertices.");
    desc.corner_verts = view(negative, 3, DELMESH_INT64, 1);
    expect_error(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "corner_verts: corner 1 had vertex -7; there were 4 vertices.");
    static const int32_t size = 3;
    desc.face_sizes = view(&size, 1, DELMESH_INT32, 1);
    expect_error(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "corner_verts: corner 1 had vertex -7; there were 4 vertices.");
    static const int32_t quad[] = {0, 1, 2, 9};
    static const int32_t four = 4;
    desc = desc_of(kPoints, 4, quad, 4);
    desc.face_sizes = view(&four, 1, DELMESH_INT32, 1);
    expect_error(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "corner_verts: corner 3 had vertex 9; there were 4 vertices.");
}

static void test_bad_faces(void** state) {
    (void)state;
    static const int32_t corners[] = {0, 1, 2, 0, 2, 3};
    delmesh_mesh_desc desc = desc_of(kPoints, 4, corners, 6);
    static const int32_t not_zero[] = {1, 3, 6}, falling[] = {0, 6, 3}, past[] = {0, 3, 7}, negative[] = {0, -1, 6},
                         few[] = {0, 3, 5};
    desc.face_offsets = view(not_zero, 3, DELMESH_INT32, 1);
    expect_error(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "face_offsets: the first was 1 instead of 0.");
    desc.face_offsets = view(falling, 3, DELMESH_INT32, 1);
    expect_error(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "face_offsets: offset 2 was 3, less than the one before it.");
    desc.face_offsets = view(past, 3, DELMESH_INT32, 1);
    expect_error(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "face_offsets: offset 2 was 7; there were 6 corners.");
    desc.face_offsets = view(negative, 3, DELMESH_INT32, 1);
    expect_error(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "face_offsets: offset 1 was -1, less than the one before it.");
    desc.face_offsets = view(few, 3, DELMESH_INT32, 1);
    expect_error(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "face_offsets: the faces took 5 of 6 corners.");
    memset(&desc.face_offsets, 0, sizeof desc.face_offsets);
    static const int64_t negative_size[] = {3, -3, 6}, many[] = {3, INT64_MAX}, too_few[] = {3};
    desc.face_sizes = view(negative_size, 3, DELMESH_INT64, 1);
    expect_error(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "face_sizes: size 1 was -3.");
    desc.face_sizes = view(many, 2, DELMESH_INT64, 1);
    expect_error(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "face_sizes: face 1 went past the last of 6 corners.");
    desc.face_sizes = view(too_few, 1, DELMESH_INT64, 1);
    expect_error(&desc, DELMESH_ERROR_INVALID_ARGUMENT, "face_sizes: the faces took 3 of 6 corners.");
}

/* One polygon of 2^30 corners makes more corners than there are indices: refused before its corners are read. */
static void test_too_large(void** state) {
    (void)state;
    static const int32_t size = 1 << 30;
    delmesh_mesh_desc desc = desc_of(kPoints, 4, (const int32_t*)kPoints, size);
    desc.face_sizes = view(&size, 1, DELMESH_INT32, 1);
    expect_error(&desc, DELMESH_ERROR_TOO_LARGE, "face_sizes: the faces made 1073741822 triangles, more than 2^31 - 1 corners.");
}

static void test_moebius(void** state) {
    (void)state;
    static const int32_t corners[] = {0, 1, 2, 1, 3, 2, 2, 3, 4, 3, 0, 4, 4, 0, 1};
    const delmesh_mesh_desc desc = desc_of(kPoints, 5, corners, COUNT(corners));
    shim_mesh* const m = make(&desc);
    assert_int_equal(shim_mesh_status(m), DELMESH_ERROR_NON_ORIENTABLE);
    assert_string_equal(shim_mesh_error(m), "Face 2 belongs to a one-sided surface, like a Moebius strip.");
    shim_mesh_free(m);
}

/* ---- faces left out -------------------------------------------------------------------------------------------------------- */

static void test_degenerate_and_non_finite(void** state) {
    (void)state;
    float points[24];
    memcpy(points, kPoints, sizeof points);
    points[3 * 4 + 1] = NAN;
    points[3 * 5] = -INFINITY;
    static const int32_t corners[] = {0, 1, 2, 3, 3, 1, 4, 1, 0, 2, 1, 3, 5, 6, 7, 0, 6, 0};
    static const int32_t kept[] = {0, 1, 2, 2, 1, 3};
    static const int32_t source[] = {0, 3};
    delmesh_mesh_desc desc = desc_of(points, 8, corners, COUNT(corners));
    shim_mesh* const m = made(&desc);
    const shim_arrays a = shim_mesh_arrays(m);
    EXPECT(a.corner_vert, a.corners, kept);
    EXPECT(a.face_source, a.face_source_size, source);
    const delmesh_mesh_info n = shim_mesh_info(m);
    assert_int_equal(n.degenerate_faces, 2);
    assert_int_equal(n.non_finite_faces, 2);
    assert_int_equal(n.isolated_vertices, 4);
    assert_int_equal(n.vertices, 8);
    assert_true(isnan(a.pos32[13]));
    shim_mesh_free(m);
    expect_strict(&desc, "Face 1 had a vertex twice or fewer than three corners, and 'strict' forbids to leave it out.");
    desc.corner_verts.count = 3;
    desc.corner_verts.data = corners + 6;
    expect_strict(&desc, "Face 0 had a NaN or infinite coordinate, and 'strict' forbids to leave it out.");
}

static void test_duplicates(void** state) {
    (void)state;
    /* A tetrahedron whose second face is there three times, once turned round in its corners. */
    static const int32_t corners[] = {0, 2, 1, 0, 1, 3, 1, 3, 0, 1, 2, 3, 0, 3, 2, 3, 0, 1};
    static const int32_t kept[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
    static const int32_t source[] = {0, 1, 3, 4};
    const delmesh_mesh_desc desc = desc_of(kPoints, 4, corners, COUNT(corners));
    shim_mesh* const m = made(&desc);
    const shim_arrays a = shim_mesh_arrays(m);
    EXPECT(a.corner_vert, a.corners, kept);
    EXPECT(a.face_source, a.face_source_size, source);
    assert_int_equal(shim_mesh_info(m).duplicate_faces, 2);
    assert_int_equal(repairs(m), 2);
    expect_topology(m, 4, 6, 0, 1, 0, 2);
    shim_mesh_free(m);
    expect_strict(&desc, "Face 2 was a second copy of a face, and 'strict' forbids to leave it out.");
    /* Two lone copies, and a pillow given twice. */
    static const int32_t lone[] = {0, 1, 2, 1, 2, 0, 3, 4, 5, 5, 4, 3, 4, 5, 3, 3, 5, 4};
    const delmesh_mesh_desc others = desc_of(kPoints, 6, lone, COUNT(lone));
    shim_mesh* const p = made(&others);
    assert_int_equal(repairs(p), 3);
    assert_int_equal(shim_mesh_info(p).duplicate_faces, 3);
    expect_topology(p, 3, 6, 3, 2, 1, 3);
    shim_mesh_free(p);
}

/* ---- orientation ----------------------------------------------------------------------------------------------------------- */

static void test_orientation(void** state) {
    (void)state;
    /* The tetrahedron with its third face turned; then a strip of two, where the lower face decides. */
    static const int32_t corners[] = {0, 2, 1, 0, 1, 3, 1, 3, 2, 0, 3, 2};
    static const int32_t fixed[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
    static const int32_t twins[] = {11, 6, 3, 2, 8, 9, 1, 10, 4, 5, 7, 0};
    const delmesh_mesh_desc desc = desc_of(kPoints, 4, corners, COUNT(corners));
    shim_mesh* const m = made(&desc);
    const shim_arrays a = shim_mesh_arrays(m);
    EXPECT(a.corner_vert, a.corners, fixed);
    EXPECT(a.corner_twin, a.corner_twin_size, twins);
    assert_int_equal(shim_mesh_info(m).reoriented_faces, 1);
    assert_int_equal(repairs(m), 1);
    expect_topology(m, 4, 6, 0, 1, 0, 2);
    shim_mesh_free(m);
    expect_strict(&desc, "Face 2 was oriented against its component, and 'strict' forbids to turn it.");

    static const int32_t strip[] = {0, 1, 2, 1, 2, 3};
    static const int32_t tied[] = {0, 1, 2, 1, 3, 2};
    const delmesh_mesh_desc two = desc_of(kPoints, 4, strip, COUNT(strip));
    shim_mesh* const s = made(&two);
    const shim_arrays b = shim_mesh_arrays(s);
    EXPECT(b.corner_vert, b.corners, tied);
    shim_mesh_free(s);

    /* Face 0 is the odd one out of three. */
    static const int32_t odd[] = {0, 2, 1, 1, 3, 2, 2, 3, 4};
    static const int32_t right[] = {0, 1, 2, 1, 3, 2, 2, 3, 4};
    const delmesh_mesh_desc three = desc_of(kPoints, 5, odd, COUNT(odd));
    shim_mesh* const o = made(&three);
    const shim_arrays c = shim_mesh_arrays(o);
    EXPECT(c.corner_vert, c.corners, right);
    assert_int_equal(shim_mesh_info(o).reoriented_faces, 1);
    shim_mesh_free(o);
}

/* ---- non-manifold edges and vertices --------------------------------------------------------------------------------------- */

/* Fifty pages on one edge: each a sheet of its own, all in one ring. */
static void test_book(void** state) {
    (void)state;
    enum { kPages = 50 };
    float points[3 * (kPages + 2)];
    int32_t corners[3 * kPages];
    for (int i = 0; i < 3 * (kPages + 2); ++i) points[i] = (float)(i * i % 97);
    for (int32_t i = 0; i < kPages; ++i) {
        corners[3 * i] = i % 2; /* pages run both ways */
        corners[3 * i + 1] = 1 - i % 2;
        corners[3 * i + 2] = i + 2;
    }
    const delmesh_mesh_desc desc = desc_of(points, kPages + 2, corners, 3 * kPages);
    shim_mesh* const m = made(&desc);
    const delmesh_mesh_info n = shim_mesh_info(m);
    const shim_arrays a = shim_mesh_arrays(m);
    expect_topology(m, kPages, 3 * kPages, 3 * kPages, kPages, kPages, kPages);
    assert_int_equal(n.nonmanifold_edges, 1);
    assert_int_equal(n.nonmanifold_vertices, 2);
    assert_int_equal(n.copied_vertices, 2 * (kPages - 1));
    assert_int_equal(n.reoriented_faces, 0);
    assert_int_equal(a.slot_count, kPages);
    assert_int_equal(a.vert_source_size, a.vertices);
    assert_int_equal(a.vert_join_size, a.vertices);
    int slot = -2 - a.corner_twin[0], length = 0;
    do {
        const int32_t corner = a.slots[2 * slot], next = a.slots[2 * slot + 1];
        assert_int_equal(corner % 3, 0);
        assert_int_equal(a.corner_twin[corner], -2 - slot);
        assert_int_equal(a.vert_source[a.corner_vert[corner]], corners[corner]);
        assert_int_equal(a.vert_join[a.corner_vert[corner + 1]], corners[corner + 1]);
        slot = next;
        ++length;
    } while (slot != -2 - a.corner_twin[0] && length <= kPages);
    assert_int_equal(length, kPages);
    for (int32_t v = kPages + 2; v < a.vertices; ++v)
        assert_memory_equal(a.pos32 + 3 * v, points + 3 * a.vert_source[v], 3 * sizeof(float));
    shim_mesh_free(m);
    expect_strict(&desc, "The 50 faces at the edge from vertex 0 to 1 were no manifold, and 'strict' forbids to cut it.");
}

/* Four quads around vertex 3, the third of which has vertex 0 where a sheet would have 4: three of their triangles are at the edge
 * from 0 to 3, so that two corners of 3 lead to one, and a walk around 3 sees all of them without coming back. */
static void test_walk_that_does_not_come_home(void** state) {
    (void)state;
    static const float points[] = {0, 3, 0, 0, 4, 0, 0, 5, 0, 1, 4, 0, 1, 3, 0, 1, 5, 0, 2, 3, 0, 2, 4, 0, 2, 5, 0};
    static const int32_t triangles[] = {0, 4, 3, 0, 3, 1, 1, 3, 5, 1, 5, 2, 0, 6, 7, 0, 7, 3, 3, 7, 8, 3, 8, 5};
    const delmesh_mesh_desc desc = desc_of(points, 9, triangles, COUNT(triangles));
    shim_mesh* const m = made(&desc);
    const delmesh_mesh_info n = shim_mesh_info(m);
    assert_int_equal(n.nonmanifold_edges, 1);
    assert_int_equal(n.reoriented_faces, 0);
    assert_int_equal(shim_mesh_validate(m), DELMESH_OK);
    shim_mesh_free(m);
    expect_strict(&desc, "The 3 faces at the edge from vertex 0 to 3 were no manifold, and 'strict' forbids to cut it.");
}

static void test_two_tetrahedra(void** state) {
    (void)state;
    /* Sharing the edge 0 1: four faces there, of which all are cut. The two are held together by the edge 2 3 and 4 5 alone. */
    static const int32_t by_edge[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2, 0, 4, 1, 0, 1, 5, 1, 4, 5, 0, 5, 4};
    const delmesh_mesh_desc edge = desc_of(kPoints, 6, by_edge, COUNT(by_edge));
    shim_mesh* const m = made(&edge);
    const delmesh_mesh_info n = shim_mesh_info(m);
    expect_topology(m, 8, 14, 4, 2, 2, 2);
    assert_int_equal(n.nonmanifold_edges, 1);
    assert_int_equal(n.nonmanifold_vertices, 2);
    assert_int_equal(n.copied_vertices, 2);
    const shim_arrays a = shim_mesh_arrays(m);
    static const int32_t source[] = {0, 1, 2, 3, 4, 5, 0, 1};
    static const int32_t second[] = {6, 4, 7, 6, 7, 5, 7, 4, 5, 6, 5, 4};
    static const int32_t slots[] = {2, 1, 3, 2, 14, 3, 15, 0};
    EXPECT(a.vert_source, a.vert_source_size, source);
    EXPECT(a.vert_join, a.vert_join_size, source);
    EXPECT(a.corner_vert + 12, a.corners - 12, second);
    EXPECT(a.slots, 2 * a.slot_count, slots);
    shim_mesh_free(m);

    static const int32_t by_vertex[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2, 4, 5, 0, 4, 0, 6, 0, 5, 6, 4, 6, 5};
    const delmesh_mesh_desc vertex = desc_of(kPoints, 7, by_vertex, COUNT(by_vertex));
    shim_mesh* const p = made(&vertex);
    expect_topology(p, 8, 12, 0, 2, 0, 4);
    assert_int_equal(shim_mesh_info(p).nonmanifold_edges, 0);
    assert_int_equal(shim_mesh_info(p).nonmanifold_vertices, 1);
    assert_int_equal(shim_mesh_info(p).copied_vertices, 1);
    const shim_arrays b = shim_mesh_arrays(p);
    assert_int_equal(b.corner_vert[0], 0);
    assert_int_equal(b.corner_vert[14], 7);
    assert_int_equal(b.vert_source[7], 0);
    assert_int_equal(b.slot_count, 0);
    assert_memory_equal(b.pos32 + 21, b.pos32, 3 * sizeof(float));
    shim_mesh_free(p);
    expect_strict(&vertex, "Vertex 0 joined several fans of faces, and 'strict' forbids to split it.");
}

/* Both sides of a quad: two sheets, cut apart along the rim, where each edge is a ring of two. */
static void test_double_sided(void** state) {
    (void)state;
    static const int32_t corners[] = {0, 1, 2, 0, 2, 3, 2, 1, 0, 0, 3, 2};
    static const int32_t out[] = {0, 1, 2, 0, 2, 3, 4, 5, 6, 6, 7, 4};
    static const int32_t source[] = {0, 1, 2, 3, 2, 1, 0, 3};
    const delmesh_mesh_desc desc = desc_of(kPoints, 4, corners, COUNT(corners));
    shim_mesh* const m = made(&desc);
    const shim_arrays a = shim_mesh_arrays(m);
    expect_topology(m, 4, 10, 8, 2, 2, 2);
    EXPECT(a.corner_vert, a.corners, out);
    EXPECT(a.vert_source, a.vert_source_size, source);
    assert_int_equal(a.corner_twin[2], 3);
    assert_int_equal(a.corner_twin[8], 11);
    assert_int_equal(a.slot_count, 8);
    assert_int_equal(shim_mesh_info(m).nonmanifold_edges, 5);
    assert_int_equal(shim_mesh_info(m).reoriented_faces, 0);
    shim_mesh_free(m);
}

/* A closed tetrahedron with the back of one face: the solid stays whole, the back is a sheet of its own. */
static void test_back_of_a_solid(void** state) {
    (void)state;
    static const int32_t corners[] = {0, 1, 2, 0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
    const delmesh_mesh_desc desc = desc_of(kPoints, 4, corners, COUNT(corners));
    shim_mesh* const m = made(&desc);
    const shim_arrays a = shim_mesh_arrays(m);
    expect_topology(m, 5, 9, 3, 2, 1, 3);
    assert_int_equal(shim_mesh_info(m).reoriented_faces, 0);
    assert_int_equal(shim_mesh_info(m).nonmanifold_edges, 3);
    for (int c = 0; c < 15; ++c) assert_int_equal(a.corner_twin[c] < 0, c < 3); /* face 0 looks inwards: it is the back */
    shim_mesh_free(m);
}

/* ---- polygons -------------------------------------------------------------------------------------------------------------- */

static double area_z(const float* p, const int32_t* corner) {
    const float *a = p + 3 * corner[0], *b = p + 3 * corner[1], *c = p + 3 * corner[2];
    return 0.5 * ((double)(b[0] - a[0]) * (double)(c[1] - a[1]) - (double)(b[1] - a[1]) * (double)(c[0] - a[0]));
}

/* All triangles of a flat polygon turn as it does, and their areas add up: then nothing folds and nothing overlaps. */
static void expect_tiling(const shim_arrays* a, double area) {
    double sum = 0;
    for (int64_t c = 0; c < a->corners; c += 3) {
        const double part = area_z(a->pos32, a->corner_vert + c);
        assert_true(part > 0);
        sum += part;
    }
    assert_true(fabs(sum - area) <= 1e-6 * area);
}

static void test_polygons(void** state) {
    (void)state;
    static const float points[] = {0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 3, 3, 0, 2, 0, 0};
    /* A convex quad; an arrowhead whose fan from its first corner folds; a hexagon with a corner on a straight side. */
    static const int32_t corners[] = {0, 1, 2, 3, 1, 2, 3, 4, 0, 5, 1, 2, 3, 4};
    static const int32_t sizes[] = {4, 4, 6};
    static const int32_t quads[] = {0, 1, 2, 0, 2, 3, 2, 3, 4, 2, 4, 1};
    static const int32_t source[] = {0, 0, 1, 1};
    delmesh_mesh_desc desc = desc_of(points, 6, corners, 8);
    desc.face_sizes = view(sizes, 2, DELMESH_INT32, 1);
    shim_mesh* const m = make(&desc);
    assert_int_equal(shim_mesh_status(m), DELMESH_OK);
    const shim_arrays a = shim_mesh_arrays(m);
    EXPECT(a.face_source, a.face_source_size, source);
    assert_int_equal(shim_mesh_info(m).polygons, 2);
    shim_mesh_free(m);

    desc = desc_of(points, 6, corners, 4);
    desc.face_sizes = view(sizes, 1, DELMESH_INT32, 1);
    desc.strict = 1; /* cutting polygons is no repair */
    shim_mesh* const quad = made(&desc);
    shim_arrays q = shim_mesh_arrays(quad);
    expect_ints(q.corner_vert, q.corners, quads, 6);
    shim_mesh_free(quad);

    desc.corner_verts.data = corners + 4;
    shim_mesh* const arrow = made(&desc);
    q = shim_mesh_arrays(arrow);
    expect_ints(q.corner_vert, q.corners, quads + 6, 6);
    expect_tiling(&q, 4);
    shim_mesh_free(arrow);

    desc.corner_verts = view(corners + 8, 6, DELMESH_INT32, 1);
    desc.face_sizes = view(sizes + 2, 1, DELMESH_INT32, 1);
    shim_mesh* const hexagon = made(&desc);
    q = shim_mesh_arrays(hexagon);
    assert_int_equal(q.corners, 12);
    expect_tiling(&q, 10);
    shim_mesh_free(hexagon);
}

/* A comb of many teeth, seen along each axis and at extreme scales: ear clipping must tile it. */
static void test_concave_polygon(void** state) {
    (void)state;
    enum { kTeeth = 100, kCorners = 2 * kTeeth + 3 };
    static const float scales[] = {1e-37f, 1, 1e36f};
    for (int s = 0; s < 3; ++s) {
        float points[3 * kCorners];
        int32_t corners[kCorners];
        double area = 0;
        for (int i = 0; i < kCorners; ++i) corners[i] = i;
        for (int i = 0; i <= 2 * kTeeth; ++i) {
            points[3 * i] = (float)(2 * kTeeth - i) * 0.01f * scales[s];
            points[3 * i + 1] = (i % 2 == 0 ? 3.0f : 0.25f) * scales[s];
            points[3 * i + 2] = 0;
        }
        const float bottom[] = {0, -scales[s], 0, 2 * scales[s], -scales[s], 0};
        memcpy(points + 3 * (kCorners - 2), bottom, sizeof bottom);
        for (int i = 0; i < kCorners; ++i) {
            const float *p = points + 3 * i, *q = points + 3 * ((i + 1) % kCorners);
            area += 0.5 * ((double)p[0] * (double)q[1] - (double)p[1] * (double)q[0]);
        }
        const int32_t size = kCorners;
        delmesh_mesh_desc desc = desc_of(points, kCorners, corners, kCorners);
        desc.face_sizes = view(&size, 1, DELMESH_INT32, 1);
        shim_mesh* const m = made(&desc);
        const shim_arrays a = shim_mesh_arrays(m);
        assert_int_equal(shim_mesh_info(m).faces, kCorners - 2);
        double sum = 0;
        for (int64_t c = 0; c < a.corners; c += 3) {
            const float *p = a.pos32 + 3 * a.corner_vert[c], *q = a.pos32 + 3 * a.corner_vert[c + 1],
                        *r = a.pos32 + 3 * a.corner_vert[c + 2];
            const double part = 0.5 * (((double)q[0] - (double)p[0]) * ((double)r[1] - (double)p[1]) -
                                       ((double)q[1] - (double)p[1]) * ((double)r[0] - (double)p[0]));
            assert_true(part > 0);
            sum += part;
        }
        assert_true(fabs(sum - area) <= 1e-6 * area);
        expect_topology(m, kCorners - 2, 2 * kCorners - 3, kCorners, 1, 1, 1);
        shim_mesh_free(m);
    }
}

/* A square with a square hole, given as one polygon with a bridge that is walked twice. */
static void test_polygon_with_hole(void** state) {
    (void)state;
    static const float points[] = {0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 1, 1, 0, 3, 1, 0, 3, 3, 0, 1, 3, 0};
    static const int32_t corners[] = {0, 1, 2, 3, 0, 4, 7, 6, 5, 4};
    static const int32_t size = 10;
    delmesh_mesh_desc desc = desc_of(points, 8, corners, 10);
    desc.face_sizes = view(&size, 1, DELMESH_INT32, 1);
    shim_mesh* const m = made(&desc);
    const shim_arrays a = shim_mesh_arrays(m);
    expect_tiling(&a, 12);
    expect_topology(m, 8, 16, 8, 1, 2, 0);
    shim_mesh_free(m);
}

/* Triangles given and triangles made and left out always add up, whatever the polygon does. */
static void test_bad_polygons(void** state) {
    (void)state;
    static const int32_t corners[] = {0, 1, 1, 2, 3, 3, 4, 0, 1, 0, 1, 2, 2, 2, 5, 5, 0, 1, 2, 0, 3};
    static const int32_t sizes[] = {4, 2, 1, 4, 3, 2, 0, 5};
    delmesh_mesh_desc desc = desc_of(kPoints, 8, corners, COUNT(corners));
    desc.face_sizes = view(sizes, COUNT(sizes), DELMESH_INT32, 1);
    shim_mesh* const m = made(&desc);
    const delmesh_mesh_info n = shim_mesh_info(m);
    int64_t expected = 0;
    for (int i = 0; i < COUNT(sizes); ++i) expected += sizes[i] > 3 ? sizes[i] - 2 : 1;
    assert_int_equal(n.polygons, COUNT(sizes));
    assert_int_equal(n.faces + n.degenerate_faces + n.duplicate_faces + n.non_finite_faces, expected);
    assert_true(n.degenerate_faces >= 7);
    shim_mesh_free(m);
    expect_strict(&desc, "Face 0 had a vertex twice or fewer than three corners, and 'strict' forbids to leave it out.");
    float points[24];
    memcpy(points, kPoints, sizeof points);
    points[3] = INFINITY;
    static const int32_t pentagon[] = {0, 1, 2, 3, 4};
    static const int32_t five = 5;
    desc = desc_of(points, 8, pentagon, 5);
    desc.face_sizes = view(&five, 1, DELMESH_INT32, 1);
    shim_mesh* const p = made(&desc);
    assert_int_equal(shim_mesh_info(p).non_finite_faces, 3);
    assert_int_equal(shim_mesh_info(p).faces, 0);
    shim_mesh_free(p);
}

/* ---- welding --------------------------------------------------------------------------------------------------------------- */

static void test_weld(void** state) {
    (void)state;
    const float points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, -0.0f, 0, -0.0f, 1, -0.0f, 1, 1, 0, NAN, 0, 0, NAN, 0, 0, 1, 1e-30f, 0};
    static const int32_t corners[] = {0, 1, 2, 3, 5, 4};
    static const int32_t welded[] = {0, 1, 2, 1, 5, 2};
    delmesh_mesh_desc desc = desc_of(points, 9, corners, 6);
    shim_mesh* const apart = made(&desc);
    expect_topology(apart, 2, 6, 6, 2, 2, 2);
    shim_mesh_free(apart);
    desc.weld = DELMESH_WELD_EXACT;
    desc.strict = 1; /* asked for, so no repair */
    shim_mesh* const m = made(&desc);
    const shim_arrays a = shim_mesh_arrays(m);
    EXPECT(a.corner_vert, a.corners, welded);
    assert_int_equal(shim_mesh_info(m).welded_vertices, 2);
    assert_int_equal(shim_mesh_info(m).vertices, 9);
    assert_int_equal(a.vert_source_size, 0);
    assert_memory_equal(a.pos32, points, sizeof points);
    expect_topology(m, 2, 5, 4, 1, 1, 1);
    shim_mesh_free(m);
    double wide[27];
    for (int i = 0; i < 27; ++i) wide[i] = (double)points[i];
    desc.positions = view(wide, 9, DELMESH_FLOAT64, 3);
    shim_mesh* const w = made(&desc);
    const shim_arrays b = shim_mesh_arrays(w);
    EXPECT(b.corner_vert, b.corners, welded);
    shim_mesh_free(w);
}

/* ---- marked edges ---------------------------------------------------------------------------------------------------------- */

static void test_marked_edges(void** state) {
    (void)state;
    /* Three pages on 0 1, marked there from both ends, on one outer edge, on a pair that is no edge, and on a point. */
    static const int32_t corners[] = {0, 1, 2, 1, 0, 3, 0, 1, 4};
    static const int32_t marked[] = {1, 0, 0, 1, 4, 0, 2, 3, 2, 2};
    static const uint16_t bits[] = {DELMESH_EDGE_MARKED, 0, 0, DELMESH_EDGE_MARKED, 0, 0, DELMESH_EDGE_MARKED, 0,
                                    DELMESH_EDGE_MARKED};
    delmesh_mesh_desc desc = desc_of(kPoints, 5, corners, COUNT(corners));
    desc.marked_edges = view(marked, 5, DELMESH_INT32, 2);
    shim_mesh* const m = made(&desc);
    const shim_arrays a = shim_mesh_arrays(m);
    assert_int_equal(a.corner_bits_size, COUNT(bits));
    assert_memory_equal(a.corner_bits, bits, sizeof bits);
    assert_int_equal(shim_mesh_info(m).unmatched_marked_edges, 2);
    shim_mesh_free(m);
    static const int32_t none[] = {2, 3};
    desc.marked_edges = view(none, 1, DELMESH_INT32, 2);
    shim_mesh* const p = made(&desc);
    assert_int_equal(shim_mesh_arrays(p).corner_bits_size, 0);
    shim_mesh_free(p);
    static const int64_t wrong[] = {0, 1, 1, 5}; /* 5 would be a copy: the caller has no such vertex */
    desc.marked_edges = view(wrong, 2, DELMESH_INT64, 2);
    expect_error(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "marked_edges: edge 1 had vertex 5; there were 5 vertices.");
    /* Through the weld: vertex 2 is vertex 0. */
    static const float twice[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0};
    static const int32_t face[] = {2, 1, 3};
    static const int32_t welded[] = {0, 1};
    desc = desc_of(twice, 4, face, 3);
    desc.weld = DELMESH_WELD_EXACT;
    desc.marked_edges = view(welded, 1, DELMESH_INT32, 2);
    shim_mesh* const w = made(&desc);
    assert_int_equal(shim_mesh_arrays(w).corner_bits[0], DELMESH_EDGE_MARKED);
    assert_int_equal(shim_mesh_info(w).unmatched_marked_edges, 0);
    shim_mesh_free(w);
}

/* ---- time, memory, cancel -------------------------------------------------------------------------------------------------- */

/* A hundred thousand faces around one vertex, in an order without locality. Quadratic matching would take minutes. */
static void test_large_fan(void** state) {
    (void)state;
    enum { kRim = 100003 };
    float* const points = calloc(3 * (kRim + 1), sizeof(float));
    int32_t* const corners = malloc(3 * kRim * sizeof(int32_t));
    for (int32_t i = 0; i < kRim; ++i) {
        const int32_t p = (int32_t)((int64_t)i * 40009 % kRim);
        corners[3 * i] = 0;
        corners[3 * i + 1] = 1 + p;
        corners[3 * i + 2] = 1 + (p + 1) % kRim;
    }
    delmesh_mesh_desc desc = desc_of(points, kRim + 1, corners, 3 * kRim);
    for (int turn = 0; turn < 2; ++turn) { /* as it is, and with a face turned: the slow path */
        const clock_t start = clock();
        shim_mesh* const m = made(&desc);
        assert_true((double)(clock() - start) / CLOCKS_PER_SEC < 5);
        expect_topology(m, kRim, 2 * kRim, kRim, 1, 1, 1);
        assert_int_equal(repairs(m), turn);
        shim_mesh_free(m);
        const int32_t swap = corners[1];
        corners[1] = corners[2];
        corners[2] = swap;
    }
    free(points);
    free(corners);
}

/* A closed grid of 2 n^2 triangles. */
static void make_torus(int32_t n, float* points, int32_t* corners) {
    for (int32_t i = 0; i < n * n; ++i) {
        const int32_t x = i % n, y = i / n, right = y * n + (x + 1) % n, up = (y + 1) % n * n + x,
                      across = (y + 1) % n * n + (x + 1) % n;
        const int32_t faces[6] = {i, right, across, i, across, up};
        memcpy(corners + 6 * i, faces, sizeof faces);
        points[3 * i] = (float)x;
        points[3 * i + 1] = (float)y;
        points[3 * i + 2] = (float)((x * 7 + y * 13) % 5);
    }
}

/* Two pyramids over one rim of n, mixed up: apexes with n corners, and rim vertices with four. */
static void make_bipyramid(int32_t n, int32_t first, int32_t top, int32_t bottom, int32_t* corners) {
    for (int32_t i = 0; i < n; ++i) {
        const int32_t p = first + i, q = first + (i + 1) % n;
        const int32_t faces[6] = {p, q, top, q, p, bottom};
        memcpy(corners + 6 * i, faces, sizeof faces);
    }
}
static void shuffle_faces(int32_t* corners, int32_t faces, uint32_t seed) {
    for (int32_t f = faces - 1; f >= 0; --f) {
        seed = seed * 1664525u + 1013904223u;
        const int32_t g = (int32_t)((seed >> 8) % (uint32_t)(f + 1)), turn = (int32_t)(seed >> 4) % 3;
        int32_t face[3];
        for (int k = 0; k < 3; ++k) face[k] = corners[3 * g + (k + turn) % 3];
        memcpy(corners + 3 * g, corners + 3 * f, sizeof face);
        memcpy(corners + 3 * f, face, sizeof face);
    }
}
/* Each corner's twin is the one corner that runs the other way between the same vertices. */
static void expect_twins(shim_mesh* m) {
    const shim_arrays a = shim_mesh_arrays(m);
    const int64_t n = a.corners;
    for (int64_t c = 0; c < n; ++c) {
        const int32_t p = a.corner_vert[c], q = a.corner_vert[c % 3 == 2 ? c - 2 : c + 1];
        int64_t twin = -1;
        for (int64_t t = 0; t < n && twin < 0; ++t)
            if (a.corner_vert[t] == q && a.corner_vert[t % 3 == 2 ? t - 2 : t + 1] == p) twin = t;
        assert_int_equal(a.corner_twin[c], twin);
    }
}

/* Vertices of every size that import treats differently, and around the borders between these. */
static void test_valences(void** state) {
    (void)state;
    static const int32_t sizes[] = {3, 4, 5, 6, 7, 8, 9, 15, 16, 63, 64, 65, 127, 255, 256, 257, 300};
    enum { kMost = 300 };
    float points[3 * (2 * kMost + 4)];
    int32_t corners[3 * (4 * kMost + 1)];
    for (int64_t i = 0; i < COUNT(points); ++i) points[i] = (float)((i * 7919) % 1009);
    for (int64_t i = 0; i < COUNT(sizes); ++i) {
        const int32_t n = sizes[i], top = 2 * n, bottom = 2 * n + 1, vertices = 2 * n + 4;
        make_bipyramid(n, 0, top, bottom, corners);
        shuffle_faces(corners, 2 * n, (uint32_t)n);
        delmesh_mesh_desc desc = desc_of(points, vertices, corners, 6 * n);
        desc.strict = 1;
        shim_mesh* m = made(&desc);
        expect_topology(m, 2 * n, 3 * n, 0, 1, 0, 2);
        expect_twins(m);
        shim_mesh_free(m);

        desc = desc_of(points, vertices, corners, 6 * n - 3); /* with a hole */
        desc.strict = 1;
        m = made(&desc);
        expect_topology(m, 2 * n - 1, 3 * n, 3, 1, 1, 1);
        expect_twins(m);
        shim_mesh_free(m);

        make_bipyramid(n, n, top, 2 * n + 2, corners + 6 * n); /* another one that hangs at the same vertex */
        shuffle_faces(corners, 4 * n, (uint32_t)n);
        desc = desc_of(points, vertices, corners, 12 * n);
        expect_strict(&desc, NULL);
        m = made(&desc);
        expect_topology(m, 4 * n, 6 * n, 0, 2, 0, 4);
        assert_int_equal(shim_mesh_info(m).nonmanifold_vertices, 1);
        assert_int_equal(shim_mesh_info(m).copied_vertices, 1);
        assert_int_equal(shim_mesh_info(m).isolated_vertices, 1);
        expect_twins(m);
        shim_mesh_free(m);

        make_bipyramid(n, 0, top, bottom, corners); /* a page more at an edge of the large vertex */
        const int32_t page[3] = {0, top, 2 * n + 3};
        memcpy(corners + 6 * n, page, sizeof page);
        desc = desc_of(points, vertices, corners, 6 * n + 3);
        m = made(&desc);
        assert_int_equal(shim_mesh_info(m).nonmanifold_edges, 1);
        shim_mesh_free(m);

        const int32_t swap = corners[0]; /* a face turned over, at that vertex and two others */
        corners[0] = corners[1];
        corners[1] = swap;
        desc = desc_of(points, vertices, corners, 6 * n);
        m = made(&desc);
        assert_int_equal(shim_mesh_info(m).reoriented_faces, 1);
        expect_topology(m, 2 * n, 3 * n, 0, 1, 0, 2);
        shim_mesh_free(m);
    }
}

/* More faces than one thread is given, with any number of threads: the same mesh. Vertices without a face, too. */
static void test_many_threads(void** state) {
    (void)state;
    enum { kSide = 130, kVertices = kSide * kSide + 5, kFaces = 2 * kSide * kSide };
    float* const points = calloc(3 * kVertices, sizeof(float));
    int32_t* const corners = malloc(3 * kFaces * sizeof(int32_t));
    make_torus(kSide, points, corners);
    shuffle_faces(corners, kFaces, 1);
    const delmesh_mesh_desc desc = desc_of(points, kVertices, corners, 3 * (kFaces - 100));
    shim_mesh* first = NULL;
    for (int32_t threads = 1; threads <= 5; ++threads) {
        delmesh_context_options options;
        memset(&options, 0, sizeof options);
        options.max_threads = threads;
        shim_mesh* const m = shim_mesh_make(&options, &desc, 0);
        assert_int_equal(shim_mesh_status(m), DELMESH_OK);
        assert_int_equal(shim_mesh_validate(m), DELMESH_OK);
        if (first == NULL) {
            first = m;
            assert_int_equal(shim_mesh_info(m).isolated_vertices, 5);
            assert_true(shim_mesh_info(m).boundary_loops > 10);
            continue;
        }
        const shim_arrays a = shim_mesh_arrays(first), b = shim_mesh_arrays(m);
        const delmesh_mesh_info p = shim_mesh_info(first), q = shim_mesh_info(m);
        assert_memory_equal(&p, &q, sizeof p);
        expect_ints(b.corner_vert, b.corners, a.corner_vert, a.corners);
        expect_ints(b.corner_twin, b.corner_twin_size, a.corner_twin, a.corner_twin_size);
        expect_ints(b.vert_source, b.vert_source_size, a.vert_source, a.vert_source_size);
        shim_mesh_free(m);
    }
    shim_mesh_free(first);
    free(points);
    free(corners);
}

/* The first of several wrong corners is named, however many threads looked. */
static void test_first_bad_corner(void** state) {
    (void)state;
    enum { kFaces = 100000 };
    int32_t* const corners = malloc(3 * kFaces * sizeof(int32_t));
    for (int32_t c = 0; c < 3 * kFaces; ++c) corners[c] = c % 3;
    const delmesh_mesh_desc desc = desc_of(kPoints, 8, corners, 3 * kFaces);
    corners[3 * kFaces - 1] = -1;
    corners[200002] = 8;
    corners[200001] = -2147483647;
    expect_error(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE,
                 "corner_verts: corner 200001 had vertex -2147483647; there were 8 vertices.");
    free(corners);
}

static void test_memory(void** state) {
    (void)state;
    enum { kSide = 100, kFaces = 2 * kSide * kSide };
    float* const points = malloc(3 * kSide * kSide * sizeof(float));
    int32_t* const corners = malloc(3 * kFaces * sizeof(int32_t));
    make_torus(kSide, points, corners);
    const delmesh_mesh_desc desc = desc_of(points, kSide * kSide, corners, 3 * kFaces);
    shim_mesh* const m = make(&desc);
    assert_int_equal(shim_mesh_status(m), DELMESH_OK);
    expect_topology(m, kFaces, 3 * kFaces / 2, 0, 1, 0, 0);
    assert_true(shim_mesh_peak(m) <= 60 * (uint64_t)kFaces);
    shim_mesh_free(m);
    free(points);
    free(corners);
}

static void test_cancel(void** state) {
    (void)state;
    static const int32_t corners[] = {0, 1, 2};
    const delmesh_mesh_desc desc = desc_of(kPoints, 3, corners, 3);
    shim_mesh* const m = shim_mesh_make(NULL, &desc, 1);
    assert_int_equal(shim_mesh_status(m), DELMESH_ERROR_CANCELLED);
    shim_mesh_free(m);
}

/* A mesh that takes every path: polygons, welding, duplicates, turned faces, cut edges, copies, marks. */
static delmesh_mesh_desc nasty(void) {
    static float points[30];
    static const int32_t corners[] = {0, 1, 2, 3, 1, 0, 4, 1, 0, 5, 5, 1, 0, 5, 6, 7, 5, 6, 4, 7, 2, 2, 2, 3, 9, 8, 6, 7};
    static const int32_t sizes[] = {4, 3, 3, 3, 3, 3, 3, 3, 3};
    static const int32_t marked[] = {0, 1, 6, 7};
    memcpy(points, kPoints, sizeof kPoints);
    memcpy(points + 24, kPoints + 9, 3 * sizeof(float));
    points[29] = INFINITY;
    delmesh_mesh_desc desc = desc_of(points, 10, corners, COUNT(corners));
    desc.face_sizes = view(sizes, COUNT(sizes), DELMESH_INT32, 1);
    desc.marked_edges = view(marked, 2, DELMESH_INT32, 2);
    desc.weld = DELMESH_WELD_EXACT;
    return desc;
}

static int64_t alive; /* bytes handed out by the counting allocator */
static void* counting_alloc(void* user, uint64_t size, uint64_t align) {
    (void)user;
    void* p = NULL;
    if (posix_memalign(&p, (size_t)align, (size_t)size) != 0) return NULL;
    alive += (int64_t)size;
    return p;
}
static void counting_free(void* user, void* pointer, uint64_t size) {
    (void)user;
    alive -= (int64_t)size;
    free(pointer);
}

static void test_out_of_memory(void** state) {
    (void)state;
    const delmesh_mesh_desc desc = nasty();
    shim_mesh* const whole = made(&desc);
    const delmesh_mesh_info n = shim_mesh_info(whole);
    assert_true(n.degenerate_faces > 0 && n.duplicate_faces > 0 && n.non_finite_faces > 0 && n.reoriented_faces > 0);
    assert_true(n.nonmanifold_edges > 0 && n.copied_vertices > 0 && n.welded_vertices > 0);
    shim_mesh_free(whole);
    delmesh_context_options options;
    memset(&options, 0, sizeof options);
    options.alloc = counting_alloc;
    options.free = counting_free;
    int32_t status = DELMESH_ERROR_ALLOCATION_LIMIT;
    uint64_t limit = 0;
    while (status != DELMESH_OK) {
        options.allocation_limit = ++limit;
        shim_mesh* const m = shim_mesh_make(&options, &desc, 0);
        status = shim_mesh_status(m);
        assert_true(status == DELMESH_OK || status == DELMESH_ERROR_ALLOCATION_LIMIT);
        shim_mesh_free(m);
        assert_int_equal(alive, 0);
        assert_true(limit < 1000);
    }
    assert_true(limit > 20);
}

static void record(void* user, int32_t level, const char* text) {
    assert_int_equal(level, DELMESH_LOG_WARNING);
    strcat(strcat((char*)user, text), "\n");
}

static void test_log(void** state) {
    (void)state;
    static const int32_t corners[] = {0, 2, 1, 0, 1, 3, 1, 3, 0, 1, 2, 3, 0, 3, 2, 3, 0, 1, 5, 5, 6};
    const delmesh_mesh_desc desc = desc_of(kPoints, 8, corners, COUNT(corners));
    char text[1024] = "";
    delmesh_context_options options;
    memset(&options, 0, sizeof options);
    options.log = record;
    options.user = text;
    shim_mesh_free(shim_mesh_make(&options, &desc, 0));
    assert_string_equal(text, "1 degenerate triangle was left out.\n2 duplicate faces were left out.\n");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tetrahedron),
        cmocka_unit_test(test_empty),
        cmocka_unit_test(test_csaszar_torus),
        cmocka_unit_test(test_pillow),
        cmocka_unit_test(test_types_and_strides),
        cmocka_unit_test(test_bad_indices),
        cmocka_unit_test(test_bad_faces),
        cmocka_unit_test(test_too_large),
        cmocka_unit_test(test_moebius),
        cmocka_unit_test(test_degenerate_and_non_finite),
        cmocka_unit_test(test_duplicates),
        cmocka_unit_test(test_orientation),
        cmocka_unit_test(test_book),
        cmocka_unit_test(test_walk_that_does_not_come_home),
        cmocka_unit_test(test_two_tetrahedra),
        cmocka_unit_test(test_double_sided),
        cmocka_unit_test(test_back_of_a_solid),
        cmocka_unit_test(test_polygons),
        cmocka_unit_test(test_concave_polygon),
        cmocka_unit_test(test_polygon_with_hole),
        cmocka_unit_test(test_bad_polygons),
        cmocka_unit_test(test_weld),
        cmocka_unit_test(test_marked_edges),
        cmocka_unit_test(test_large_fan),
        cmocka_unit_test(test_valences),
        cmocka_unit_test(test_many_threads),
        cmocka_unit_test(test_first_bad_corner),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_cancel),
        cmocka_unit_test(test_out_of_memory),
        cmocka_unit_test(test_log),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
