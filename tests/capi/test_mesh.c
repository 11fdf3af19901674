/* SPDX-License-Identifier: Apache-2.0
 * Meshes in and out: every view type and stride, every array with its exact values, every documented error. */
#include "support.h"

#include <math.h>

HOST_FIXTURE(1)

static const double tetrahedron[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
static const int32_t tetrahedron_corners[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};

static delmesh_mesh_desc tetrahedron_desc(void) {
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){tetrahedron, 4, 0, DELMESH_FLOAT64, 3};
    desc.corner_verts = (delmesh_view){tetrahedron_corners, 12, 0, DELMESH_INT32, 1};
    return desc;
}

static delmesh_mesh* make(const delmesh_mesh_desc* desc) {
    delmesh_mesh* mesh = NULL;
    assert_status(delmesh_mesh_create(context, desc, &mesh), context, DELMESH_OK);
    assert_non_null(mesh);
    return mesh;
}

static void refuse(const delmesh_mesh_desc* desc, int32_t expected, const char* named) {
    delmesh_mesh* mesh = (delmesh_mesh*)(uintptr_t)1;
    assert_status(delmesh_mesh_create(context, desc, &mesh), context, expected);
    assert_null(mesh);
    if (strstr(delmesh_last_error(context), named) == NULL) fail_msg("'%s' is not in: %s", named, delmesh_last_error(context));
}

/* ---- In ------------------------------------------------------------------------------------------------------------------ */

static void counts_of_a_tetrahedron(void** state) {
    (void)state;
    const delmesh_mesh_desc desc = tetrahedron_desc();
    delmesh_mesh* mesh = make(&desc);
    const delmesh_mesh_info info = info_of(mesh);
    assert_int_equal(info.precision, DELMESH_FLOAT64);
    assert_int_equal(info.vertices, 4);
    assert_int_equal(info.faces, 4);
    assert_int_equal(info.edges, 6);
    assert_int_equal(info.corners, 12);
    assert_int_equal(info.boundary_edges, 0);
    assert_int_equal(info.isolated_vertices, 0);
    assert_int_equal(info.components, 1);
    assert_int_equal(info.boundary_loops, 0);
    assert_int_equal(info.euler_characteristic, 2);
    assert_int_equal(info.polygons, 4);
    assert_int_equal(info.welded_vertices + info.degenerate_faces + info.duplicate_faces + info.non_finite_faces +
                         info.reoriented_faces + info.nonmanifold_edges + info.nonmanifold_vertices + info.copied_vertices +
                         info.unmatched_marked_edges, 0);
    assert_status(delmesh_mesh_validate(context, mesh), context, DELMESH_OK);
    delmesh_mesh_destroy(mesh);
}

/* The same mesh through every type, packed and strided, as triangles and as polygons. */
static void every_type_and_stride_says_the_same(void** state) {
    (void)state;
    delmesh_mesh_desc desc = tetrahedron_desc();
    delmesh_mesh* mesh = make(&desc);
    const Snapshot expected = take_snapshot(mesh);
    delmesh_mesh_destroy(mesh);

    struct { char tag[8]; double p[3]; char pad[16]; } wide[4];
    struct { int32_t c; int32_t other[2]; } strided32[12];
    struct { uint32_t c[3]; uint32_t other; } triples[4];
    struct { int64_t c; int64_t other; } strided64[12];
    uint32_t packed_u32[12];
    int64_t packed_i64[12];
    const int32_t offsets32[5] = {0, 3, 6, 9, 12}, sizes32[4] = {3, 3, 3, 3};
    const uint32_t offsets_u32[5] = {0, 3, 6, 9, 12}, sizes_u32[4] = {3, 3, 3, 3};
    const int64_t offsets64[5] = {0, 3, 6, 9, 12}, sizes64[4] = {3, 3, 3, 3};
    const uint8_t sizes8[4] = {3, 3, 3, 3};
    struct { uint8_t size, other[2]; } strided8[4];
    memset(wide, 0xff, sizeof wide);
    memset(strided32, 0xff, sizeof strided32);
    memset(triples, 0xff, sizeof triples);
    memset(strided64, 0xff, sizeof strided64);
    memset(strided8, 0xff, sizeof strided8);
    for (int i = 0; i < 12; ++i) {
        strided32[i].c = tetrahedron_corners[i];
        triples[i / 3].c[i % 3] = (uint32_t)tetrahedron_corners[i];
        strided64[i].c = packed_i64[i] = tetrahedron_corners[i];
        packed_u32[i] = (uint32_t)tetrahedron_corners[i];
    }
    for (int i = 0; i < 4; ++i) {
        memcpy(wide[i].p, tetrahedron[i], sizeof wide[i].p);
        strided8[i].size = 3;
    }

    const delmesh_view positions[] = {desc.positions, {wide[0].p, 4, sizeof wide[0], DELMESH_FLOAT64, 3}};
    const delmesh_view corners[] = {
        desc.corner_verts,
        {tetrahedron_corners, 12, 4, DELMESH_INT32, 1},
        {packed_u32, 12, 0, DELMESH_UINT32, 1},
        {packed_i64, 12, 0, DELMESH_INT64, 1},
        {strided32, 12, sizeof strided32[0], DELMESH_INT32, 1},
        {strided64, 12, sizeof strided64[0], DELMESH_INT64, 1},
        {tetrahedron_corners, 4, 0, DELMESH_INT32, 3},
        {packed_i64, 4, 0, DELMESH_INT64, 3},
        {triples, 4, sizeof triples[0], DELMESH_UINT32, 3},
    };
    const delmesh_view none = {0};
    const delmesh_view faces[][2] = {
        {none, none},
        {{offsets32, 5, 0, DELMESH_INT32, 1}, none},
        {{offsets_u32, 5, 0, DELMESH_UINT32, 1}, none},
        {{offsets64, 5, 0, DELMESH_INT64, 1}, none},
        {none, {sizes32, 4, 0, DELMESH_INT32, 1}},
        {none, {sizes_u32, 4, 0, DELMESH_UINT32, 1}},
        {none, {sizes64, 4, 0, DELMESH_INT64, 1}},
        {none, {sizes8, 4, 0, DELMESH_UINT8, 1}},
        {none, {&strided8[0].size, 4, sizeof strided8[0], DELMESH_UINT8, 1}},
    };
    int made = 0;
    for (size_t p = 0; p < sizeof positions / sizeof *positions; ++p)
        for (size_t c = 0; c < sizeof corners / sizeof *corners; ++c)
            for (size_t f = 0; f < sizeof faces / sizeof *faces; ++f) {
                if (f != 0 && corners[c].components == 3) continue; /* polygons name their corners one by one */
                desc.positions = positions[p];
                desc.corner_verts = corners[c];
                desc.face_offsets = faces[f][0];
                desc.face_sizes = faces[f][1];
                mesh = make(&desc);
                const Snapshot same = take_snapshot(mesh);
                assert_same_snapshot(expected, same);
                free(same.bytes);
                delmesh_mesh_destroy(mesh);
                ++made;
            }
    assert_int_equal(made, 2 * (6 * 9 + 3));
    free(expected.bytes);
}

/* Positions come back bit for bit: denormals, -0, and the NaN of a vertex that no face uses. */
static void positions_keep_their_bits(void** state) {
    (void)state;
    static const uint32_t bits32[5][3] = {{0x80000000, 0x00000001, 0x3f800001},
                                          {0x3f800000, 0x807fffff, 0x7f7fffff},
                                          {0x00800000, 0x3eaaaaab, 0xbf000000},
                                          {0x7fc12345, 0xff800000, 0x7fa00001},
                                          {0x40490fdb, 0x00000000, 0x80000000}};
    static const uint64_t bits64[4][3] = {{0x8000000000000000, 1, 0x3ff0000000000001},
                                          {0x7fefffffffffffff, 0x000fffffffffffff, 0x3fd5555555555555},
                                          {0x4009000000000000, 0xbff0000000000000, 0},
                                          {0x7ff8000000000123, 0x7ff0000000000001, 0xfff0000000000000}};
    static const int32_t corners[6] = {0, 1, 2, 0, 2, 4}, corners3[3] = {0, 1, 2};
    float positions32[5][3];
    double positions64[4][3];
    memcpy(positions32, bits32, sizeof bits32);
    memcpy(positions64, bits64, sizeof bits64);
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    delmesh_view view;

    desc.positions = (delmesh_view){positions32, 5, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){corners, 6, 0, DELMESH_INT32, 1};
    delmesh_mesh* mesh = make(&desc);
    assert_int_equal(info_of(mesh).isolated_vertices, 1);
    struct { float p[3]; uint32_t guard; } strided[5];
    memset(strided, 0x11, sizeof strided);
    const delmesh_view_mut dst = {strided, 5, sizeof strided[0], DELMESH_FLOAT32, 3};
    assert_status(delmesh_mesh_read(mesh, DELMESH_POSITION, &dst), NULL, DELMESH_OK);
    for (int v = 0; v < 5; ++v) {
        assert_memory_equal(strided[v].p, bits32[v], 12);
        assert_int_equal(strided[v].guard, 0x11111111);
    }
    assert_status(delmesh_mesh_borrow(mesh, DELMESH_POSITION, &view), NULL, DELMESH_OK);
    assert_int_equal(view.type, DELMESH_FLOAT32);
    assert_memory_equal(view.data, bits32, sizeof bits32);
    delmesh_mesh_destroy(mesh);

    desc.positions = (delmesh_view){positions64, 4, 0, DELMESH_FLOAT64, 3};
    desc.corner_verts = (delmesh_view){corners3, 3, 0, DELMESH_INT32, 1};
    mesh = make(&desc);
    double back[4][3];
    const delmesh_view_mut dst64 = {back, 4, 0, DELMESH_FLOAT64, 3};
    assert_status(delmesh_mesh_read(mesh, DELMESH_POSITION, &dst64), NULL, DELMESH_OK);
    assert_memory_equal(back, bits64, sizeof bits64);
    float rounded[4][3]; /* float64 read as float32 is rounded to nearest */
    const delmesh_view_mut dst32 = {rounded, 4, 0, DELMESH_FLOAT32, 3};
    assert_status(delmesh_mesh_read(mesh, DELMESH_POSITION, &dst32), NULL, DELMESH_OK);
    assert_true(rounded[0][2] == 1.0f && rounded[1][2] == 1.0f / 3.0f && isinf(rounded[1][0]) && rounded[1][1] == 0.0f);
    delmesh_mesh_destroy(mesh);
}

static void polygons_are_cut_and_remembered(void** state) {
    (void)state;
    static const float p[7][3] = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}, {3, 1, 0}, {4, 2, 0}, {2, 3, 0}};
    static const int32_t corners[12] = {0, 1, 2, 3, 2, 4, 5, 6, 3, 3, 2, 6};
    static const int32_t offsets[4] = {0, 4, 9, 12};
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){p, 7, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){corners, 9, 0, DELMESH_INT32, 1}; /* without the third polygon */
    desc.face_offsets = (delmesh_view){offsets, 3, 0, DELMESH_INT32, 1};
    delmesh_mesh* mesh = make(&desc);
    const delmesh_mesh_info info = info_of(mesh);
    assert_int_equal(info.polygons, 2);
    assert_int_equal(info.faces, 2 + 3);
    int32_t source[5];
    const delmesh_view_mut dst = {source, 5, 0, DELMESH_INT32, 1};
    assert_status(delmesh_mesh_read(mesh, DELMESH_FACE_SOURCE, &dst), NULL, DELMESH_OK);
    static const int32_t expected[5] = {0, 0, 1, 1, 1};
    assert_memory_equal(source, expected, sizeof source);
    delmesh_mesh_destroy(mesh);
}

static void repairs_are_counted(void** state) {
    (void)state;
    Shape book = book_shape();
    delmesh_mesh* mesh = shape_mesh(context, &book);
    const delmesh_mesh_info info = info_of(mesh);
    assert_int_equal(info.duplicate_faces, 1);
    assert_int_equal(info.nonmanifold_edges, 1);
    assert_int_equal(info.isolated_vertices, 1);
    assert_int_equal(info.faces, 8);
    assert_int_equal(info.vertices, 11 + info.copied_vertices);
    assert_true(info.copied_vertices >= 2);
    assert_int_equal(2 * info.edges - info.boundary_edges, 3 * info.faces);
    assert_true(host.log_lines > 0);
    assert_status(delmesh_mesh_validate(context, mesh), context, DELMESH_OK);
    /* Copies know whom they copy, and where to be joined again. */
    int32_t source[32], join[32];
    assert_true(info.vertices <= 32);
    const delmesh_view_mut sources = {source, info.vertices, 0, DELMESH_INT32, 1};
    const delmesh_view_mut joins = {join, info.vertices, 0, DELMESH_INT32, 1};
    assert_status(delmesh_mesh_read(mesh, DELMESH_VERT_SOURCE, &sources), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_read(mesh, DELMESH_VERT_JOIN, &joins), NULL, DELMESH_OK);
    for (int32_t v = 0; v < info.vertices; ++v) {
        if (v < 11) assert_int_equal(source[v], v);
        else assert_in_range(source[v], 0, 1);
        assert_int_equal(join[v], source[v]);
    }
    uint8_t flags[32];
    assert_true(info.edges <= 32);
    const delmesh_view_mut dst = {flags, info.edges, 0, DELMESH_UINT8, 1};
    assert_status(delmesh_mesh_read(mesh, DELMESH_EDGE_FLAGS, &dst), NULL, DELMESH_OK);
    int64_t boundary = 0, cut = 0;
    for (int64_t e = 0; e < info.edges; ++e) {
        boundary += (flags[e] & DELMESH_EDGE_BOUNDARY) != 0;
        cut += (flags[e] & DELMESH_EDGE_CUT) != 0;
        assert_true((flags[e] & DELMESH_EDGE_CUT) == 0 || (flags[e] & DELMESH_EDGE_BOUNDARY) != 0);
    }
    assert_int_equal(boundary, info.boundary_edges);
    assert_true(cut >= 2);
    delmesh_mesh_destroy(mesh);

    delmesh_mesh_desc strict = shape_desc(&book);
    strict.strict = 1;
    refuse(&strict, DELMESH_ERROR_STRICT, "");
    assert_true(delmesh_last_error(context)[0] != 0);
    free_shape(&book);
}

static void weld_joins_equal_positions(void** state) {
    (void)state;
    static const float soup[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, -0.0f, 0}, {1, 1, 0}, {-0.0f, 1, 0}};
    static const int32_t corners[6] = {0, 1, 2, 3, 4, 5};
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){soup, 6, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){corners, 6, 0, DELMESH_INT32, 1};
    delmesh_mesh* mesh = make(&desc);
    assert_int_equal(info_of(mesh).edges, 6);
    assert_int_equal(info_of(mesh).components, 2);
    delmesh_mesh_destroy(mesh);
    desc.weld = DELMESH_WELD_EXACT;
    mesh = make(&desc);
    const delmesh_mesh_info info = info_of(mesh);
    assert_int_equal(info.edges, 5);
    assert_int_equal(info.components, 1);
    assert_int_equal(info.welded_vertices, 2);
    assert_int_equal(info.vertices, 6);
    assert_int_equal(info.isolated_vertices, 2);
    delmesh_mesh_destroy(mesh);
}

static void an_empty_mesh_is_a_mesh(void** state) {
    (void)state;
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){NULL, 0, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){NULL, 0, 0, DELMESH_INT32, 1};
    delmesh_mesh* mesh = make(&desc);
    assert_int_equal(info_of(mesh).vertices + info_of(mesh).faces + info_of(mesh).edges, 0);
    for (int32_t what = DELMESH_POSITION; what <= DELMESH_EDGE_SOURCE_EDGE; ++what) {
        delmesh_view view;
        assert_status(delmesh_mesh_borrow(mesh, what, &view), NULL, DELMESH_OK);
        assert_int_equal(view.count, 0);
    }
    delmesh_mesh_destroy(mesh);
}

/* ---- Errors of create ---------------------------------------------------------------------------------------------------- */

static void bad_views(void** state) {
    (void)state;
    const delmesh_mesh_desc good = tetrahedron_desc();
    delmesh_mesh_desc desc;
#define BAD(change, status, named) \
    do {                           \
        desc = good;               \
        change;                    \
        refuse(&desc, status, named); \
    } while (0)
    const int32_t wrong = DELMESH_ERROR_INVALID_ARGUMENT;
    refuse(NULL, wrong, "'desc'");
    assert_status(delmesh_mesh_create(context, &good, NULL), context, wrong);
    assert_string_equal(delmesh_last_error(context), "The argument 'out' was NULL.");
    BAD(memset(&desc.positions, 0, sizeof desc.positions), wrong, "'positions'");
    BAD(memset(&desc.corner_verts, 0, sizeof desc.corner_verts), wrong, "'corner_verts'");
    BAD(desc.positions.data = NULL, wrong, "'positions' had no data");
    BAD(desc.positions.count = -1, wrong, "count -1");
    BAD(desc.positions.type = DELMESH_INT32, wrong, "type 3");
    BAD(desc.positions.type = 99, wrong, "type 99");
    BAD(desc.positions.type = -1, wrong, "type -1");
    BAD(desc.positions.components = 2, wrong, "components 2");
    BAD(desc.positions.stride = 16, wrong, "stride 16");
    BAD(desc.positions.stride = -24, wrong, "stride -24");
    BAD(desc.positions.stride = 28, wrong, "aligned");
    BAD(desc.positions.data = (const char*)tetrahedron + 4, wrong, "aligned");
    BAD((desc.positions.stride = INT64_C(1) << 40, desc.positions.count = INT64_C(1) << 30), wrong, "address space");
    BAD(desc.corner_verts.type = DELMESH_FLOAT32, wrong, "'corner_verts'");
    BAD(desc.corner_verts.type = DELMESH_UINT8, wrong, "'corner_verts'");
    BAD(desc.corner_verts.components = 2, wrong, "'corner_verts'");
    BAD(desc.corner_verts.count = 11, wrong, "11 corners");
    BAD(desc.weld = 2, wrong, "'weld' was 2");
    BAD(desc.strict = -1, wrong, "'strict' was -1");
    BAD(desc.reserved0 = 1, wrong, "'reserved0' was 1");
    static const int32_t offsets[5] = {0, 3, 6, 9, 12};
    static const uint8_t sizes[4] = {3, 3, 3, 3};
    const delmesh_view offset_view = {offsets, 5, 0, DELMESH_INT32, 1}, size_view = {sizes, 4, 0, DELMESH_UINT8, 1};
    BAD((desc.face_offsets = offset_view, desc.face_sizes = size_view), wrong, "Both");
    BAD((desc.face_offsets = offset_view, desc.face_offsets.count = 0), wrong, "'face_offsets'");
    BAD((desc.face_offsets = offset_view, desc.face_offsets.type = DELMESH_UINT8), wrong, "'face_offsets'");
    BAD((desc.face_sizes = size_view, desc.face_sizes.components = 2), wrong, "'face_sizes'");
    BAD((desc.face_offsets = offset_view, desc.corner_verts.components = 3, desc.corner_verts.count = 4), wrong, "'corner_ver");
    BAD(desc.marked_edges = offset_view, wrong, "'marked_edges'");
    /* Numbers that do not fit are refused before anything is read. */
    BAD(desc.positions.count = INT64_C(1) << 31, DELMESH_ERROR_TOO_LARGE, "'positions'");
    BAD(desc.corner_verts.count = INT64_C(3) << 31, DELMESH_ERROR_TOO_LARGE, "'corner_verts'");
    BAD((desc.corner_verts.components = 3, desc.corner_verts.count = 715827883), DELMESH_ERROR_TOO_LARGE, "'corner_verts'");
    BAD((desc.face_sizes = size_view, desc.face_sizes.count = INT64_C(1) << 31), DELMESH_ERROR_TOO_LARGE, "'face_sizes'");
#undef BAD
}

static void bad_contents(void** state) {
    (void)state;
    delmesh_mesh_desc desc = tetrahedron_desc();
    int64_t corners[12];
    for (int i = 0; i < 12; ++i) corners[i] = tetrahedron_corners[i];
    desc.corner_verts = (delmesh_view){corners, 12, 0, DELMESH_INT64, 1};
    static const int64_t bad_indices[] = {4, -1, INT64_C(1) << 32, INT64_MIN};
    for (size_t i = 0; i < sizeof bad_indices / sizeof *bad_indices; ++i) {
        corners[7] = bad_indices[i];
        refuse(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "7");
    }
    corners[7] = tetrahedron_corners[7];
    static const struct {
        int32_t offsets[5], expected;
    } bad_offsets[] = {{{1, 3, 6, 9, 12}, DELMESH_ERROR_INVALID_ARGUMENT},
                       {{0, 3, 6, 9, 11}, DELMESH_ERROR_INVALID_ARGUMENT},
                       {{0, 3, 9, 6, 12}, DELMESH_ERROR_INVALID_ARGUMENT},
                       {{0, 3, 6, 9, 13}, DELMESH_ERROR_INDEX_OUT_OF_RANGE},
                       {{0, -3, 6, 9, 12}, DELMESH_ERROR_INVALID_ARGUMENT}};
    for (size_t i = 0; i < sizeof bad_offsets / sizeof *bad_offsets; ++i) {
        desc.face_offsets = (delmesh_view){bad_offsets[i].offsets, 5, 0, DELMESH_INT32, 1};
        refuse(&desc, bad_offsets[i].expected, "face_offsets");
    }
    memset(&desc.face_offsets, 0, sizeof desc.face_offsets);
    static const struct {
        int32_t sizes[4], expected;
    } bad_sizes[] = {{{3, 3, 3, 4}, DELMESH_ERROR_INDEX_OUT_OF_RANGE},
                     {{3, 3, 3, 2}, DELMESH_ERROR_INVALID_ARGUMENT},
                     {{3, -3, 9, 3}, DELMESH_ERROR_INVALID_ARGUMENT}};
    for (size_t i = 0; i < sizeof bad_sizes / sizeof *bad_sizes; ++i) {
        desc.face_sizes = (delmesh_view){bad_sizes[i].sizes, 4, 0, DELMESH_INT32, 1};
        refuse(&desc, bad_sizes[i].expected, "face_sizes");
    }
    memset(&desc.face_sizes, 0, sizeof desc.face_sizes);
    static const int32_t bad_edge[2] = {0, 4};
    desc.marked_edges = (delmesh_view){bad_edge, 1, 0, DELMESH_INT32, 2};
    refuse(&desc, DELMESH_ERROR_INDEX_OUT_OF_RANGE, "");

    Shape strip = moebius_shape();
    desc = shape_desc(&strip);
    refuse(&desc, DELMESH_ERROR_NON_ORIENTABLE, "");
    free_shape(&strip);
}

static void descriptions_of_every_age(void** state) {
    (void)state;
    const delmesh_mesh_desc good = tetrahedron_desc();
    /* An older caller, from before face_offsets and what follows. */
    const uint32_t old_size = offsetof(delmesh_mesh_desc, face_offsets);
    delmesh_mesh_desc* old = exactly(old_size);
    memcpy(old, &good, old_size);
    old->struct_size = old_size;
    delmesh_mesh_destroy(make(old));
    free(old);
    struct {
        delmesh_mesh_desc known;
        delmesh_view unknown;
    } newer;
    delmesh_mesh_desc_init(&newer.known, sizeof newer);
    newer.known = good;
    newer.known.struct_size = sizeof newer;
    delmesh_mesh_destroy(make(&newer.known));
    newer.unknown.components = 1;
    refuse(&newer.known, DELMESH_ERROR_UNSUPPORTED, "'desc'");
    delmesh_mesh_desc bad = good;
    bad.struct_size = 0;
    refuse(&bad, DELMESH_ERROR_INVALID_ARGUMENT, "struct_size");

    /* mesh_info, the same for a struct that is written. */
    delmesh_mesh* mesh = make(&good);
    const delmesh_mesh_info full = info_of(mesh);
    for (uint32_t size = 8; size <= sizeof full; size += 8) {
        delmesh_mesh_info* part = exactly(size);
        delmesh_mesh_info_init(part, size);
        assert_status(delmesh_mesh_get_info(mesh, part), NULL, DELMESH_OK);
        assert_int_equal(part->struct_size, size);
        assert_memory_equal((char*)part + 4, (const char*)&full + 4, size - 4);
        free(part);
    }
    struct {
        delmesh_mesh_info known;
        uint64_t unknown;
    } newer_info;
    delmesh_mesh_info_init(&newer_info.known, sizeof newer_info);
    newer_info.unknown = 77;
    assert_status(delmesh_mesh_get_info(mesh, &newer_info.known), NULL, DELMESH_OK);
    assert_int_equal(newer_info.known.struct_size, sizeof newer_info);
    assert_int_equal(newer_info.known.faces, 4);
    assert_int_equal(newer_info.unknown, 77);
    newer_info.known.struct_size = 0;
    assert_status(delmesh_mesh_get_info(mesh, &newer_info.known), NULL, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_status(delmesh_mesh_get_info(mesh, NULL), NULL, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_status(delmesh_mesh_get_info(NULL, &newer_info.known), NULL, DELMESH_ERROR_INVALID_ARGUMENT);
    delmesh_mesh_destroy(mesh);
}

/* ---- Out ----------------------------------------------------------------------------------------------------------------- */

/* Two triangles 0 1 2 and 1 3 2: every array, exactly. */
static void every_array_of_a_quad(void** state) {
    (void)state;
    static const double p[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
    static const int32_t corners[6] = {0, 1, 2, 1, 3, 2}, marked[2] = {3, 2};
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){p, 4, 0, DELMESH_FLOAT64, 3};
    desc.corner_verts = (delmesh_view){corners, 6, 0, DELMESH_INT32, 1};
    desc.marked_edges = (delmesh_view){marked, 1, 0, DELMESH_INT32, 2};
    delmesh_mesh* mesh = make(&desc);

    static const int64_t edge_vert[10] = {0, 1, 1, 2, 2, 0, 1, 3, 3, 2}, corner_edge[6] = {0, 1, 2, 3, 4, 1},
                         corner_twin[6] = {-1, 5, -1, -1, -1, 1}, face_source[2] = {0, 1}, identity[5] = {0, 1, 2, 3, 4},
                         map_vert[12] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3}, corner_vert[6] = {0, 1, 2, 1, 3, 2},
                         map_corner[18] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4, 5, 5, 5};
    static const struct {
        int32_t what;
        const int64_t* values;
        int64_t count;
        int32_t components;
        int corners;
    } arrays[] = {
        {DELMESH_CORNER_VERT, corner_vert, 6, 1, 1}, {DELMESH_EDGE_VERT, edge_vert, 5, 2, 0},
        {DELMESH_CORNER_EDGE, corner_edge, 6, 1, 1}, {DELMESH_FACE_SOURCE, face_source, 2, 1, 0},
        {DELMESH_VERT_SOURCE, identity, 4, 1, 0},    {DELMESH_VERT_JOIN, identity, 4, 1, 0},
        {DELMESH_VERT_MAP_VERT, map_vert, 4, 3, 0},  {DELMESH_CORNER_TWIN, corner_twin, 6, 1, 1},
        {DELMESH_EDGE_SOURCE_EDGE, identity, 5, 1, 0}, {DELMESH_CORNER_MAP_CORNER, map_corner, 6, 3, 0},
    };
    for (size_t a = 0; a < sizeof arrays / sizeof *arrays; ++a) {
        const int64_t numbers = arrays[a].count * arrays[a].components;
        int32_t i32[18];
        uint32_t u32[18];
        int64_t i64[18], strided[12][2];
        memset(strided, 0x11, sizeof strided);
        const delmesh_view_mut views[] = {{i32, arrays[a].count, 0, DELMESH_INT32, arrays[a].components},
                                          {i64, arrays[a].count, 0, DELMESH_INT64, arrays[a].components},
                                          {u32, arrays[a].count, 0, DELMESH_UINT32, arrays[a].components}};
        const int negative = arrays[a].what == DELMESH_CORNER_TWIN;
        u32[0] = 12345;
        for (int v = 0; v < 3; ++v)
            assert_status(delmesh_mesh_read(mesh, arrays[a].what, &views[v]), NULL,
                          v == 2 && negative ? DELMESH_ERROR_TOO_LARGE : DELMESH_OK);
        if (negative) assert_int_equal(u32[0], 12345); /* untouched */
        if (arrays[a].components == 1) {
            const delmesh_view_mut view = {strided, arrays[a].count, sizeof strided[0], DELMESH_INT64, 1};
            assert_status(delmesh_mesh_read(mesh, arrays[a].what, &view), NULL, DELMESH_OK);
        }
        delmesh_view lent;
        assert_status(delmesh_mesh_borrow(mesh, arrays[a].what, &lent), NULL, DELMESH_OK);
        assert_int_equal(lent.count, arrays[a].count);
        assert_int_equal(lent.components, arrays[a].components);
        assert_int_equal(lent.type, DELMESH_INT32);
        assert_int_equal(lent.stride, 4 * arrays[a].components);
        for (int64_t i = 0; i < numbers; ++i) {
            assert_int_equal(i32[i], arrays[a].values[i]);
            assert_int_equal(i64[i], arrays[a].values[i]);
            if (!negative) assert_int_equal(u32[i], arrays[a].values[i]);
            assert_int_equal(((const int32_t*)lent.data)[i], arrays[a].values[i]);
            if (arrays[a].components == 1) {
                assert_int_equal(strided[i][0], arrays[a].values[i]);
                assert_int_equal(strided[i][1], 0x1111111111111111);
            }
        }
        if (arrays[a].corners) { /* also by faces */
            const delmesh_view_mut triples = {i64, 2, 0, DELMESH_INT64, 3};
            memset(i64, 0, sizeof i64);
            assert_status(delmesh_mesh_read(mesh, arrays[a].what, &triples), NULL, DELMESH_OK);
            for (int64_t i = 0; i < 6; ++i) assert_int_equal(i64[i], arrays[a].values[i]);
        }
        delmesh_view again;
        assert_status(delmesh_mesh_borrow(mesh, arrays[a].what, &again), NULL, DELMESH_OK);
        assert_ptr_equal(again.data, lent.data);
    }

    static const uint8_t edge_flags[5] = {1, 0, 1, 1, 1 | DELMESH_EDGE_MARKED};
    uint8_t flags8[5];
    int32_t flags32[5];
    delmesh_view lent;
    const delmesh_view_mut view8 = {flags8, 5, 0, DELMESH_UINT8, 1}, view32 = {flags32, 5, 0, DELMESH_INT32, 1};
    assert_status(delmesh_mesh_read(mesh, DELMESH_EDGE_FLAGS, &view8), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_read(mesh, DELMESH_EDGE_FLAGS, &view32), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_borrow(mesh, DELMESH_EDGE_FLAGS, &lent), NULL, DELMESH_OK);
    assert_int_equal(lent.type, DELMESH_INT32);
    for (int e = 0; e < 5; ++e) {
        const uint8_t expected = edge_flags[e];
        assert_int_equal(flags8[e] & ~DELMESH_EDGE_SOURCE, expected);
        assert_int_equal(flags32[e], flags8[e]);
        assert_int_equal(((const int32_t*)lent.data)[e], flags8[e]);
    }

    double weights[6][3];
    float weights32[4][3];
    const delmesh_view_mut view64 = {weights, 4, 0, DELMESH_FLOAT64, 3}, viewf = {weights32, 4, 0, DELMESH_FLOAT32, 3};
    assert_status(delmesh_mesh_read(mesh, DELMESH_VERT_MAP_WEIGHT, &view64), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_read(mesh, DELMESH_VERT_MAP_WEIGHT, &viewf), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_borrow(mesh, DELMESH_VERT_MAP_WEIGHT, &lent), NULL, DELMESH_OK);
    assert_memory_equal(lent.data, weights, 4 * sizeof *weights);
    for (int v = 0; v < 4; ++v)
        assert_true(weights[v][0] == 1 && weights[v][1] == 0 && weights[v][2] == 0 && weights32[v][0] == 1);
    const delmesh_view_mut of_corners = {weights, 6, 0, DELMESH_FLOAT64, 3};
    memset(weights, 0x33, sizeof weights);
    assert_status(delmesh_mesh_read(mesh, DELMESH_CORNER_MAP_WEIGHT, &of_corners), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_borrow(mesh, DELMESH_CORNER_MAP_WEIGHT, &lent), NULL, DELMESH_OK);
    assert_memory_equal(lent.data, weights, sizeof weights);
    for (int c = 0; c < 6; ++c) assert_true(weights[c][0] == 1 && weights[c][1] == 0 && weights[c][2] == 0);
    delmesh_mesh_destroy(mesh);
}

/* Flags past the first eight bits do not fit a uint8, and are not cut off. A result without a map has none to read. */
static void wide_flags_and_missing_maps(void** state) {
    (void)state;
    static const float p[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
    static const int32_t corners[6] = {0, 1, 2, 1, 3, 2}, materials[2] = {5, 6};
    static const int32_t edges[5][2] = {{3, 1}, {0, 1}, {3, 0}, {2, 0}, {1, 2}};
    delmesh_layer layer;
    delmesh_layer_init(&layer, sizeof layer);
    layer.kind = DELMESH_LAYER_MATERIAL;
    layer.values = (delmesh_view){materials, 2, 0, DELMESH_INT32, 1};
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){p, 4, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){corners, 6, 0, DELMESH_INT32, 1};
    desc.layers = &layer;
    desc.layer_count = 1;
    uint8_t flags8[5] = {77};
    int32_t flags32[5], source[5];
    uint32_t unsigned_source[5];
    const delmesh_view_mut view8 = {flags8, 5, 0, DELMESH_UINT8, 1}, view32 = {flags32, 5, 0, DELMESH_INT32, 1},
                           sources = {source, 5, 0, DELMESH_INT32, 1}, without_sign = {unsigned_source, 5, 0, DELMESH_UINT32, 1};
    delmesh_mesh* mesh = make(&desc);
    assert_status(delmesh_mesh_read(mesh, DELMESH_EDGE_FLAGS, &view8), NULL, DELMESH_ERROR_TOO_LARGE);
    assert_int_equal(flags8[0], 77);
    assert_status(delmesh_mesh_read(mesh, DELMESH_EDGE_FLAGS, &view32), NULL, DELMESH_OK);
    for (int e = 0; e < 5; ++e) assert_int_equal(flags32[e] & DELMESH_EDGE_MATERIAL, e == 1 ? DELMESH_EDGE_MATERIAL : 0);
    delmesh_mesh *flipped = NULL, *numbered = NULL;
    delmesh_remesh_options options;
    delmesh_remesh_options_init(&options, sizeof options);
    options.mode = DELMESH_MODE_FLIP;
    assert_status(delmesh_remesh(context, mesh, &options, &flipped, NULL), context, DELMESH_OK);
    delmesh_view lent;
    for (int32_t what = DELMESH_CORNER_MAP_CORNER; what <= DELMESH_EDGE_SOURCE_EDGE; ++what)
        assert_status(delmesh_mesh_borrow(flipped, what, &lent), NULL, DELMESH_ERROR_INVALID_ARGUMENT);
    delmesh_mesh_destroy(flipped);
    delmesh_mesh_destroy(mesh);

    /* The caller's own numbers, in his order; 3 2 is none of his. */
    desc.edge_verts = (delmesh_view){edges, 5, 0, DELMESH_INT32, 2};
    desc.layer_count = 0;
    numbered = make(&desc);
    assert_status(delmesh_mesh_read(numbered, DELMESH_EDGE_SOURCE_EDGE, &sources), NULL, DELMESH_OK);
    static const int32_t expected[5] = {1, 4, 3, 0, -1};
    assert_memory_equal(source, expected, sizeof expected);
    assert_status(delmesh_mesh_read(numbered, DELMESH_EDGE_SOURCE_EDGE, &without_sign), NULL, DELMESH_ERROR_TOO_LARGE);
    assert_status(delmesh_mesh_validate(context, numbered), context, DELMESH_OK);
    delmesh_mesh_destroy(numbered);
}

static void bad_reads(void** state) {
    (void)state;
    const delmesh_mesh_desc desc = tetrahedron_desc();
    delmesh_mesh* mesh = make(&desc);
    double numbers[64];
    const delmesh_view_mut good = {numbers, 4, 0, DELMESH_FLOAT64, 3};
    const struct {
        int32_t what;
        delmesh_view_mut view;
    } bad[] = {
        {0, good},
        {DELMESH_EDGE_SOURCE_EDGE + 1, good},
        {-1, good},
        {INT32_MAX, good},
        {DELMESH_POSITION, {NULL, 4, 0, DELMESH_FLOAT64, 3}},
        {DELMESH_POSITION, {numbers, 3, 0, DELMESH_FLOAT64, 3}},
        {DELMESH_POSITION, {numbers, 5, 0, DELMESH_FLOAT64, 3}},
        {DELMESH_POSITION, {numbers, -4, 0, DELMESH_FLOAT64, 3}},
        {DELMESH_POSITION, {numbers, 12, 0, DELMESH_FLOAT64, 1}},
        {DELMESH_POSITION, {numbers, 4, 16, DELMESH_FLOAT64, 3}},
        {DELMESH_POSITION, {numbers, 4, 36, DELMESH_FLOAT64, 3}},
        {DELMESH_POSITION, {(char*)numbers + 4, 4, 0, DELMESH_FLOAT64, 3}},
        {DELMESH_POSITION, {numbers, 4, 0, DELMESH_INT32, 3}},
        {DELMESH_POSITION, {numbers, 4, 0, 0, 3}},
        {DELMESH_CORNER_VERT, {numbers, 12, 0, DELMESH_FLOAT32, 1}},
        {DELMESH_CORNER_VERT, {numbers, 12, 0, DELMESH_UINT8, 1}},
        {DELMESH_CORNER_VERT, {numbers, 12, 0, DELMESH_INT32, 3}},
        {DELMESH_CORNER_VERT, {numbers, 6, 0, DELMESH_INT32, 2}},
        {DELMESH_EDGE_VERT, {numbers, 12, 0, DELMESH_INT32, 1}},
        {DELMESH_EDGE_FLAGS, {numbers, 6, 0, DELMESH_FLOAT32, 1}},
        {DELMESH_VERT_MAP_WEIGHT, {numbers, 4, 0, DELMESH_INT32, 3}},
    };
    memset(numbers, 0x33, sizeof numbers);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i)
        assert_status(delmesh_mesh_read(mesh, bad[i].what, &bad[i].view), NULL, DELMESH_ERROR_INVALID_ARGUMENT);
    for (size_t i = 0; i < sizeof numbers; ++i) assert_int_equal(((unsigned char*)numbers)[i], 0x33);
    assert_status(delmesh_mesh_read(mesh, DELMESH_POSITION, NULL), NULL, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_status(delmesh_mesh_read(NULL, DELMESH_POSITION, &good), NULL, DELMESH_ERROR_INVALID_ARGUMENT);
    delmesh_view view = {numbers, 1, 1, 1, 1};
    assert_status(delmesh_mesh_borrow(mesh, 0, &view), NULL, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_null(view.data);
    assert_status(delmesh_mesh_borrow(mesh, DELMESH_POSITION, NULL), NULL, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_status(delmesh_mesh_borrow(NULL, DELMESH_POSITION, &view), NULL, DELMESH_ERROR_INVALID_ARGUMENT);
    /* A borrow that gets no memory fails, and succeeds later. */
    host.fail_at = host.allocations + 1;
    assert_status(delmesh_mesh_borrow(mesh, DELMESH_CORNER_EDGE, &view), NULL, DELMESH_ERROR_OUT_OF_MEMORY);
    assert_null(view.data);
    assert_status(delmesh_mesh_borrow(mesh, DELMESH_CORNER_EDGE, &view), NULL, DELMESH_OK);
    assert_int_equal(view.count, 12);
    delmesh_mesh_destroy(mesh);
}

static void a_mesh_outlives_its_context(void** state) {
    (void)state;
    Host own;
    delmesh_context* short_lived = host_context(&own, 1);
    const delmesh_mesh_desc desc = tetrahedron_desc();
    delmesh_mesh* mesh = NULL;
    assert_status(delmesh_mesh_create(short_lived, &desc, &mesh), short_lived, DELMESH_OK);
    delmesh_context_destroy(short_lived);
    delmesh_view view; /* makes an array with the allocator of the context that is gone */
    assert_status(delmesh_mesh_borrow(mesh, DELMESH_EDGE_VERT, &view), NULL, DELMESH_OK);
    assert_int_equal(view.count, 6);
    assert_status(delmesh_mesh_validate(context, mesh), context, DELMESH_OK); /* and serves other contexts */
    assert_true(own.live_blocks > 0);
    delmesh_mesh_destroy(mesh);
    assert_nothing_left(&own);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(counts_of_a_tetrahedron),      cmocka_unit_test(every_type_and_stride_says_the_same),
        cmocka_unit_test(positions_keep_their_bits),    cmocka_unit_test(polygons_are_cut_and_remembered),
        cmocka_unit_test(repairs_are_counted),          cmocka_unit_test(weld_joins_equal_positions),
        cmocka_unit_test(an_empty_mesh_is_a_mesh),      cmocka_unit_test(bad_views),
        cmocka_unit_test(bad_contents),                 cmocka_unit_test(descriptions_of_every_age),
        cmocka_unit_test(every_array_of_a_quad),        cmocka_unit_test(wide_flags_and_missing_maps), cmocka_unit_test(bad_reads),
        cmocka_unit_test(a_mesh_outlives_its_context),
    };
    return cmocka_run_group_tests_name("mesh", tests, set_up, tear_down);
}
