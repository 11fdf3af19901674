/* SPDX-License-Identifier: Apache-2.0
 * Layers carried over to meshes: exact values for every type, policy and domain, sparse rows, every refusal with its sentence. */
#include "support.h"

#include <math.h>
#include <stdio.h>

HOST_FIXTURE(2)

/* ---- Meshes ---------------------------------------------------------------------------------------------------------------- */

/* A quad 0 1 2 3, a degenerate polygon 0 1 1 (left out), and a triangle 2 1 4: 10 corners, 3 polygons, 5 vertices. */
static const float polygon_points[5][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 1, 0}};
static const int32_t polygon_corners[10] = {0, 1, 2, 3, 0, 1, 1, 2, 1, 4}, polygon_sizes[3] = {4, 3, 3};

static delmesh_mesh* polygon_mesh(void) {
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){polygon_points, 5, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){polygon_corners, 10, 0, DELMESH_INT32, 1};
    desc.face_sizes = (delmesh_view){polygon_sizes, 3, 0, DELMESH_INT32, 1};
    delmesh_mesh* mesh = NULL;
    assert_status(delmesh_mesh_create(context, &desc, &mesh), context, DELMESH_OK);
    assert_status(delmesh_mesh_validate(context, mesh), context, DELMESH_OK);
    return mesh;
}

/* A ridge 0 1 between two obtuse triangles, which is split at t from 0: vertex 4 is then (1 - t, t) of 0 and 1. */
static delmesh_mesh* split_triangle(delmesh_mesh** source, double* t) {
    static const double points[4][3] = {{0, 0, 0}, {8, 0, 0}, {3, 2, -1}, {4, -2, -1}};
    static const int32_t corners[6] = {0, 1, 2, 1, 0, 3};
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){points, 4, 0, DELMESH_FLOAT64, 3};
    desc.corner_verts = (delmesh_view){corners, 6, 0, DELMESH_INT32, 1};
    assert_status(delmesh_mesh_create(context, &desc, source), context, DELMESH_OK);
    delmesh_remesh_options options;
    delmesh_remesh_options_init(&options, sizeof options);
    options.precision = DELMESH_FLOAT64;
    options.boundary = DELMESH_BOUNDARY_IGNORE;
    delmesh_mesh* out = NULL;
    assert_status(delmesh_remesh(context, *source, &options, &out, NULL), context, DELMESH_OK);
    assert_int_equal(info_of(out).vertices, 5);
    int32_t verts[5][3];
    double weights[5][3];
    const delmesh_view_mut to_verts = {verts, 5, 0, DELMESH_INT32, 3}, to_weights = {weights, 5, 0, DELMESH_FLOAT64, 3};
    assert_status(delmesh_mesh_read(out, DELMESH_VERT_MAP_VERT, &to_verts), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_read(out, DELMESH_VERT_MAP_WEIGHT, &to_weights), NULL, DELMESH_OK);
    *t = 0;
    for (int k = 0; k < 3; ++k) {
        assert_true(weights[4][k] == 0 || verts[4][k] < 2);
        if (verts[4][k] == 1) *t += weights[4][k];
    }
    assert_true(*t > 0.2 && *t < 0.8);
    return out;
}

static int32_t transfer(const delmesh_mesh* mesh, int32_t domain, int32_t policy, delmesh_view source, delmesh_view_mut target) {
    return delmesh_transfer(context, mesh, domain, policy, &source, &target);
}

static size_t size_of(int32_t type) {
    return type == DELMESH_UINT8 ? 1 : type == DELMESH_FLOAT64 || type == DELMESH_INT64 ? 8 : 4;
}

/* ---- Copies ---------------------------------------------------------------------------------------------------------------- */

/* Every type, many component counts and strides, every domain: element i of the result is that of its source, bit for bit, and
 * nothing is written between the elements. */
static void copies_bit_for_bit(void** state) {
    (void)state;
    delmesh_mesh* mesh = polygon_mesh();
    const delmesh_mesh_info info = info_of(mesh);
    assert_int_equal(info.faces, 3);
    int32_t corner_source[9], face_source[3];
    const delmesh_view_mut faces = {face_source, 3, 0, DELMESH_INT32, 1};
    int32_t map[9][3];
    const delmesh_view_mut corners = {map, 9, 0, DELMESH_INT32, 3};
    assert_status(delmesh_mesh_read(mesh, DELMESH_CORNER_MAP_CORNER, &corners), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_read(mesh, DELMESH_FACE_SOURCE, &faces), NULL, DELMESH_OK);
    int32_t verts[9];
    const delmesh_view_mut to_verts = {verts, 9, 0, DELMESH_INT32, 1};
    assert_status(delmesh_mesh_read(mesh, DELMESH_CORNER_VERT, &to_verts), NULL, DELMESH_OK);
    for (int c = 0; c < 9; ++c) {
        corner_source[c] = map[c][0];
        assert_int_equal(polygon_corners[corner_source[c]], verts[c]); /* the caller's own corner of that vertex ... */
        assert_int_equal(corner_source[c] < 4 ? 0 : 2, face_source[c / 3]); /* ... in the polygon the face was cut from */
        assert_false(corner_source[c] >= 4 && corner_source[c] < 7);
    }
    static const int32_t identity[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    const struct {
        int32_t domain;
        int64_t sources, targets;
        const int32_t* source_of;
    } domains[] = {{DELMESH_DOMAIN_VERTEX, 5, 5, identity},
                   {DELMESH_DOMAIN_CORNER, 10, 9, corner_source},
                   {DELMESH_DOMAIN_FACE, 3, 3, face_source},
                   {DELMESH_DOMAIN_EDGE, info.edges, info.edges, identity}};
    static const int32_t types[] = {DELMESH_FLOAT32, DELMESH_FLOAT64, DELMESH_INT32, DELMESH_UINT32, DELMESH_INT64, DELMESH_UINT8};
    static const int32_t components[] = {1, 2, 3, 4, 5, 16, 256};
    static unsigned char source[16 * 2100], target[16 * 2100];
    for (size_t d = 0; d < 4; ++d)
        for (size_t t = 0; t < 6; ++t)
            for (size_t n = 0; n < 7; ++n)
                for (int padded = 0; padded < 2; ++padded)
                    for (int32_t policy = DELMESH_TRANSFER_LINEAR; policy <= DELMESH_TRANSFER_NEAREST; ++policy) {
                        const size_t bytes = size_of(types[t]) * (size_t)components[n],
                                     from_stride = bytes + (padded ? 2 * size_of(types[t]) : 0),
                                     to_stride = bytes + (padded ? 3 * size_of(types[t]) : 0);
                        for (size_t i = 0; i < sizeof source; ++i) source[i] = (unsigned char)(i * 37 + 11); /* NaNs among them */
                        memset(target, 0x5a, sizeof target);
                        const delmesh_view from = {source, domains[d].sources, padded ? (int64_t)from_stride : 0, types[t],
                                                   components[n]};
                        const delmesh_view_mut to = {target, domains[d].targets, padded ? (int64_t)to_stride : 0, types[t],
                                                     components[n]};
                        assert_status(transfer(mesh, domains[d].domain, policy, from, to), context, DELMESH_OK);
                        for (int64_t i = 0; i < domains[d].targets; ++i) {
                            unsigned char* const element = target + to_stride * (size_t)i;
                            assert_memory_equal(element, source + from_stride * (size_t)domains[d].source_of[i], bytes);
                            memset(element, 0x5a, bytes);
                        }
                        for (size_t i = 0; i < sizeof target; ++i) assert_int_equal(target[i], 0x5a);
                    }
    delmesh_mesh_destroy(mesh);
}

/* Edges that are no piece of a source edge get 0. */
static void edges_without_a_source(void** state) {
    (void)state;
    static const float p[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
    static const int32_t corners[6] = {0, 1, 2, 1, 3, 2}, edges[3][2] = {{3, 1}, {0, 1}, {2, 1}};
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){p, 4, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){corners, 6, 0, DELMESH_INT32, 1};
    desc.edge_verts = (delmesh_view){edges, 3, 0, DELMESH_INT32, 2};
    delmesh_mesh* mesh = NULL;
    assert_status(delmesh_mesh_create(context, &desc, &mesh), context, DELMESH_OK);
    static const float values[3] = {1, 2, 3}, expected[5] = {2, 3, 0, 1, 0}, ones[5] = {1, 1, 0, 1, 0};
    float result[5];
    for (int32_t policy = 0; policy < 4; ++policy) {
        memset(result, 0x5a, sizeof result);
        assert_status(transfer(mesh, DELMESH_DOMAIN_EDGE, policy, (delmesh_view){values, 3, 0, DELMESH_FLOAT32, 1},
                               (delmesh_view_mut){result, 5, 0, DELMESH_FLOAT32, 1}),
                      context, DELMESH_OK);
        assert_memory_equal(result, policy < 2 ? expected : ones, sizeof result);
    }
    delmesh_mesh_destroy(mesh);
}

/* ---- Sums ------------------------------------------------------------------------------------------------------------------ */

static void linear_of_every_type(void** state) {
    (void)state;
    delmesh_mesh *source, *mesh;
    double t;
    mesh = split_triangle(&source, &t);
    const double between = (1 - t) * 10 + t * 20;
#define LINEAR(Type, type, a, b, expected)                                                                                       \
    do {                                                                                                                         \
        const Type from[4][2] = {{a, 7}, {b, 7}, {77, 77}, {78, 78}};                                                            \
        Type to[5][2];                                                                                                           \
        assert_status(transfer(mesh, DELMESH_DOMAIN_VERTEX, DELMESH_TRANSFER_LINEAR, (delmesh_view){from, 4, 0, type, 2},        \
                               (delmesh_view_mut){to, 5, 0, type, 2}),                                                           \
                      context, DELMESH_OK);                                                                                      \
        assert_memory_equal(to, from, sizeof from);                                                                              \
        assert_true(to[4][1] == 7); /* what is the same at both ends stays so */                                                 \
        assert_true(to[4][0] == (Type)(expected));                                                                               \
    } while (0)
    LINEAR(float, DELMESH_FLOAT32, 10, 20, between);
    LINEAR(int32_t, DELMESH_INT32, 10, 20, nearbyint(between));
    LINEAR(int32_t, DELMESH_INT32, -10, -20, nearbyint(-between));
    LINEAR(uint32_t, DELMESH_UINT32, 10, 20, nearbyint(between));
    LINEAR(int64_t, DELMESH_INT64, 10, 20, nearbyint(between));
    LINEAR(uint8_t, DELMESH_UINT8, 10, 20, nearbyint(between));
    LINEAR(int64_t, DELMESH_INT64, INT64_MAX, INT64_MAX, INT64_MAX); /* 2^63 as a double: kept in range */
    LINEAR(int64_t, DELMESH_INT64, INT64_MIN, INT64_MIN, INT64_MIN);
    LINEAR(int64_t, DELMESH_INT64, 9007199254740993, 9007199254740993, 9007199254740993);
    LINEAR(uint32_t, DELMESH_UINT32, UINT32_MAX, UINT32_MAX, UINT32_MAX);
    LINEAR(double, DELMESH_FLOAT64, 0.1, 0.1, 0.1);
    LINEAR(double, DELMESH_FLOAT64, INFINITY, 3, INFINITY);
#undef LINEAR
    /* What has no weight does not count, not even as NaN; what has is one. */
    const double nans[4] = {1, 2, NAN, 4}, more[4] = {NAN, 2, 3, 4};
    double to[5];
    const delmesh_view_mut target = {to, 5, 0, DELMESH_FLOAT64, 1};
    assert_status(transfer(mesh, DELMESH_DOMAIN_VERTEX, 0, (delmesh_view){nans, 4, 0, DELMESH_FLOAT64, 1}, target), context,
                  DELMESH_OK);
    assert_true(fabs(to[4] - (1 + t)) < 1e-15 && isnan(to[2]));
    assert_status(transfer(mesh, DELMESH_DOMAIN_VERTEX, 0, (delmesh_view){more, 4, 0, DELMESH_FLOAT64, 1}, target), context,
                  DELMESH_OK);
    assert_true(isnan(to[4]) && to[1] == 2);
    delmesh_mesh_destroy(mesh);
    delmesh_mesh_destroy(source);
}

static void nearest_direction_and_weights(void** state) {
    (void)state;
    delmesh_mesh *source, *mesh;
    double t;
    mesh = split_triangle(&source, &t);
    const int32_t ids[4] = {100, 200, 300, 400};
    int32_t id[5];
    assert_status(transfer(mesh, DELMESH_DOMAIN_VERTEX, DELMESH_TRANSFER_NEAREST, (delmesh_view){ids, 4, 0, DELMESH_INT32, 1},
                           (delmesh_view_mut){id, 5, 0, DELMESH_INT32, 1}),
                  context, DELMESH_OK);
    assert_int_equal(id[2], 300);
    assert_int_equal(id[4], t > 0.5 ? 200 : 100);

    /* Of length 1: the sum's, also where squares leave the range; 0 stays 0; what has it already stays bit for bit. */
    const double s = 1 / sqrt(3), scales[] = {1, 1e-200, 1e200, 4e-320};
    for (size_t i = 0; i < sizeof scales / sizeof *scales; ++i) {
        const double n[4][3] = {{scales[i], 0, 0}, {0, scales[i], 0}, {s, s, s}, {0, 0, 2}};
        double to[5][3];
        assert_status(transfer(mesh, DELMESH_DOMAIN_VERTEX, DELMESH_TRANSFER_DIRECTION, (delmesh_view){n, 4, 0, DELMESH_FLOAT64, 3},
                               (delmesh_view_mut){to, 5, 0, DELMESH_FLOAT64, 3}),
                      context, DELMESH_OK);
        const double length = sqrt(t * t + (1 - t) * (1 - t)), tolerance = scales[i] < 1e-300 ? 1e-3 : 1e-14 /* few bits are left */;
        assert_true(fabs(to[0][0] - 1) < 1e-15 && to[0][1] == 0 && to[0][2] == 0);
        assert_memory_equal(to[2], n[2], sizeof n[2]);
        assert_true(fabs(to[4][0] - (1 - t) / length) < tolerance && fabs(to[4][1] - t / length) < tolerance && to[4][2] == 0);
    }
    const float opposite[4][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, -3}, {1, 0, 0}};
    float to[5][3];
    assert_status(transfer(mesh, DELMESH_DOMAIN_VERTEX, DELMESH_TRANSFER_DIRECTION, (delmesh_view){opposite, 4, 0, DELMESH_FLOAT32, 3},
                           (delmesh_view_mut){to, 5, 0, DELMESH_FLOAT32, 3}),
                  context, DELMESH_OK);
    assert_true(to[0][0] == 0 && to[4][0] == 0 && to[4][2] == 0 && to[2][2] == -1);

    /* Weights: negative ones and NaN are none. */
    const float weights[4][2] = {{1, 3}, {-5, 2}, {-1, 0}, {NAN, 4}},
                already[4][3] = {{0.1f, 0.2f, 0.7f}, {0.3f, 0.3f, 0.4f}, {0, 0, 1}, {0.6f, 0.3f, 0.1f}};
    float w[5][2], same[5][3];
    assert_status(transfer(mesh, DELMESH_DOMAIN_VERTEX, DELMESH_TRANSFER_WEIGHTS, (delmesh_view){weights, 4, 0, DELMESH_FLOAT32, 2},
                           (delmesh_view_mut){w, 5, 0, DELMESH_FLOAT32, 2}),
                  context, DELMESH_OK);
    const double a = 1 - t, b = 3 * (1 - t) + 2 * t;
    assert_true(w[0][0] == 0.25f && w[0][1] == 0.75f && w[1][0] == 0 && w[1][1] == 1 && w[2][0] == 0 && w[2][1] == 0 && w[3][0] == 0 && w[3][1] == 1);
    assert_true(fabs(w[4][0] - a / (a + b)) < 1e-7 && fabs(w[4][1] - b / (a + b)) < 1e-7);
    assert_status(transfer(mesh, DELMESH_DOMAIN_VERTEX, DELMESH_TRANSFER_WEIGHTS, (delmesh_view){already, 4, 0, DELMESH_FLOAT32, 3},
                           (delmesh_view_mut){same, 5, 0, DELMESH_FLOAT32, 3}),
                  context, DELMESH_OK);
    assert_memory_equal(same, already, sizeof already);
    /* Also where the sum, or 1 divided by it, leaves the range. */
    static const double extremes[] = {0x1p-1070, 0x1p1023};
    for (size_t i = 0; i < sizeof extremes / sizeof *extremes; ++i) {
        const double x = extremes[i], far[4][3] = {{x, x, 0}, {x, x, 0}, {0, x, 0}, {0, 0, 0}};
        double halves[5][3];
        assert_status(transfer(mesh, DELMESH_DOMAIN_VERTEX, DELMESH_TRANSFER_WEIGHTS, (delmesh_view){far, 4, 0, DELMESH_FLOAT64, 3},
                               (delmesh_view_mut){halves, 5, 0, DELMESH_FLOAT64, 3}),
                      context, DELMESH_OK);
        for (int v = 0; v < 5; ++v)
            for (int k = 0; k < 3; ++k)
                assert_true(halves[v][k] == (k == 2 || v == 3 ? 0 : v != 2 ? 0.5 : k == 1));
    }
    delmesh_mesh_destroy(mesh);
    delmesh_mesh_destroy(source);
}

/* Through many blocks, on one thread and on several: the positions themselves are a layer, and so are those of the sorted source. */
static void positions_through_the_maps(void** state) {
    (void)state;
    Shape shape = sheet_shape(120);
    delmesh_mesh* in = shape_mesh(context, &shape);
    delmesh_remesh_options options;
    delmesh_remesh_options_init(&options, sizeof options);
    options.precision = DELMESH_FLOAT64;
    options.map = 1;
    delmesh_mesh* out = NULL;
    assert_status(delmesh_remesh(context, in, &options, &out, NULL), context, DELMESH_OK);
    assert_status(delmesh_mesh_validate(context, out), context, DELMESH_OK);
    const delmesh_mesh_info info = info_of(out);
    assert_true(info.vertices > shape.verts);
    delmesh_view position, corner_vert;
    assert_status(delmesh_mesh_borrow(out, DELMESH_POSITION, &position), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_borrow(out, DELMESH_CORNER_VERT, &corner_vert), NULL, DELMESH_OK);
    double* result = malloc((size_t)info.corners * 24);
    const delmesh_view from = {shape.positions, shape.verts, 0, DELMESH_FLOAT64, 3};
    assert_status(transfer(out, DELMESH_DOMAIN_VERTEX, 0, from, (delmesh_view_mut){result, info.vertices, 0, DELMESH_FLOAT64, 3}),
                  context, DELMESH_OK);
    for (int64_t i = 0; i < 3 * info.vertices; ++i) assert_true(fabs(result[i] - ((const double*)position.data)[i]) < 1e-9);
    if (has_map(out)) {
        double* corners = malloc((size_t)shape.faces * 72);
        for (int64_t c = 0; c < 3 * (int64_t)shape.faces; ++c)
            memcpy(corners + 3 * c, shape.positions + 3 * shape.corners[c], 24);
        assert_status(transfer(out, DELMESH_DOMAIN_CORNER, 0, (delmesh_view){corners, 3 * (int64_t)shape.faces, 0, DELMESH_FLOAT64, 3},
                               (delmesh_view_mut){result, info.corners, 0, DELMESH_FLOAT64, 3}),
                      context, DELMESH_OK);
        for (int64_t c = 0; c < info.corners; ++c)
            for (int k = 0; k < 3; ++k)
                assert_true(fabs(result[3 * c + k] -
                                 ((const double*)position.data)[3 * ((const int32_t*)corner_vert.data)[c] + k]) < 1e-9);
        free(corners);
    }
    /* Other threads, the same bytes. */
    double* again = malloc((size_t)info.vertices * 24);
    Host other_host;
    delmesh_context* other = host_context(&other_host, 1);
    const delmesh_view_mut first = {result, info.vertices, 0, DELMESH_FLOAT64, 3}, second = {again, info.vertices, 0, DELMESH_FLOAT64, 3};
    for (int32_t policy = 0; policy < 4; ++policy) {
        assert_status(delmesh_transfer(context, out, DELMESH_DOMAIN_VERTEX, policy, &from, &first), context, DELMESH_OK);
        assert_status(delmesh_transfer(other, out, DELMESH_DOMAIN_VERTEX, policy, &from, &second), other, DELMESH_OK);
        assert_memory_equal(result, again, (size_t)info.vertices * 24);
    }
    delmesh_context_destroy(other);
    assert_nothing_left(&other_host);
    free(again);
    free(result);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
    free_shape(&shape);
}

/* ---- Sparse rows ----------------------------------------------------------------------------------------------------------- */

static int32_t sparse(const delmesh_mesh* mesh, const delmesh_rows* source, int32_t limit, int32_t normalise, int64_t room,
                      int64_t* offsets, int32_t* indices, double* values) {
    const delmesh_rows_mut target = {{offsets, info_of(mesh).vertices + 1, 0, DELMESH_INT64, 1},
                                     {indices, room, 0, DELMESH_INT32, 1},
                                     {values, room, 0, DELMESH_FLOAT64, 1}};
    return delmesh_transfer_sparse(context, mesh, source, limit, normalise, &target);
}

/* Row 0: bone 5 twice, 2, and a 0; row 1: bones 2 and 9; row 2: one bone, whose parts cancel; row 3: none. */
static const int64_t row_offsets[5] = {0, 4, 6, 8, 8};
static const uint32_t row_indices[8] = {5, 2, 5, 3, 2, 9, 1, 1};
static const double row_values[8] = {0.25, 0.5, 0.125, 0, 0.25, 1, 4, -4};
static const delmesh_rows rows = {
    {row_offsets, 5, 0, DELMESH_INT64, 1}, {row_indices, 8, 0, DELMESH_UINT32, 1}, {row_values, 8, 0, DELMESH_FLOAT64, 1}};

static void rows_are_merged_limited_and_normalised(void** state) {
    (void)state;
    delmesh_mesh *source, *mesh;
    double t;
    mesh = split_triangle(&source, &t);
    int64_t offsets[6];
    int32_t indices[12];
    double values[12];
    static const int64_t whole[6] = {0, 2, 4, 4, 4, 7};
    static const int32_t whole_indices[7] = {2, 5, 2, 9, 2, 5, 9};
    const double s = 1 - t, expected[7] = {0.5, 0.375, 0.25, 1, 0.5 * s + 0.25 * t, 0.375 * s, t};
    assert_status(sparse(mesh, &rows, 65535, 0, 7, offsets, indices, values), context, DELMESH_OK);
    assert_memory_equal(offsets, whole, sizeof whole);
    assert_memory_equal(indices, whole_indices, sizeof whole_indices);
    for (int i = 0; i < 7; ++i) assert_true(fabs(values[i] - expected[i]) < 1e-15);
    for (int i = 0; i < 4; ++i) assert_true(values[i] == expected[i]);

    assert_status(sparse(mesh, &rows, 3, 1, 12, offsets, indices, values), context, DELMESH_OK);
    assert_memory_equal(offsets, whole, sizeof whole);
    for (int v = 0; v < 5; ++v) {
        double sum = 0;
        for (int64_t k = offsets[v]; k < offsets[v + 1]; ++k) sum += values[k];
        assert_true(fabs(sum - (v == 2 || v == 3 ? 0 : 1)) < 1e-15);
    }
    assert_true(fabs(values[0] - 0.5 / 0.875) < 1e-15 && fabs(values[2] - 0.2) < 1e-15);

    /* One of each row: the largest; the sum of the row is 1, or what it was. */
    static const int64_t limited[6] = {0, 1, 2, 2, 2, 3};
    const int largest = expected[4] > expected[6] ? 4 : 6;
    for (int32_t normalise = 0; normalise < 3; ++normalise) {
        assert_status(sparse(mesh, &rows, 1, normalise, 3, offsets, indices, values), context, DELMESH_OK);
        assert_memory_equal(offsets, limited, sizeof limited);
        assert_int_equal(indices[0], 2);
        assert_int_equal(indices[1], 9);
        assert_int_equal(indices[2], whole_indices[largest]);
        const double sums[3] = {0.875, 1.25, expected[4] + expected[5] + expected[6]}, plain[3] = {0.5, 1, expected[largest]};
        for (int i = 0; i < 3; ++i)
            assert_true(fabs(values[i] - (normalise == 0 ? plain[i] : normalise == 1 ? 1 : sums[i])) < 1e-15);
    }

    /* A sum so small that 1 divided by it leaves the range. */
    static const int64_t ends[5] = {0, 2, 2, 2, 2};
    static const double tiny[2] = {0x1p-1070, 0x3p-1070};
    const delmesh_rows small = {{ends, 5, 0, DELMESH_INT64, 1}, {row_indices, 2, 0, DELMESH_UINT32, 1}, {tiny, 2, 0, DELMESH_FLOAT64, 1}};
    assert_status(sparse(mesh, &small, 4, 1, 12, offsets, indices, values), context, DELMESH_OK);
    assert_true(values[0] == 0.75 && values[1] == 0.25); /* bones 2 and 5 */

    /* How many there will be, then as many; other types and strides. */
    struct { int32_t offset, other; } counted[6];
    struct { int64_t index; double value; } entries[7];
    float floats[8];
    for (int i = 0; i < 8; ++i) floats[i] = (float)row_values[i];
    const delmesh_rows single = {rows.offsets, rows.indices, {floats, 8, 0, DELMESH_FLOAT32, 1}};
    memset(counted, 0x11, sizeof counted);
    delmesh_rows_mut target = {{counted, 6, sizeof counted[0], DELMESH_INT32, 1}, {0}, {0}};
    assert_status(delmesh_transfer_sparse(context, mesh, &single, 4, 0, &target), context, DELMESH_OK);
    for (int v = 0; v < 6; ++v) assert_true(counted[v].offset == whole[v] && counted[v].other == 0x11111111);
    target.indices = (delmesh_view_mut){&entries[0].index, 7, sizeof entries[0], DELMESH_INT64, 1};
    target.values = (delmesh_view_mut){&entries[0].value, 7, sizeof entries[0], DELMESH_FLOAT64, 1};
    assert_status(delmesh_transfer_sparse(context, mesh, &single, 4, 0, &target), context, DELMESH_OK);
    for (int i = 0; i < 7; ++i) assert_true(entries[i].index == whole_indices[i] && fabs(entries[i].value - expected[i]) < 1e-15);
    delmesh_mesh_destroy(mesh);
    delmesh_mesh_destroy(source);
}

/* Many rows of many entries, against a plain table, through several pieces of the mesh, on one thread and on two. */
static void rows_against_a_table(void** state) {
    (void)state;
    enum { BONES = 24, EACH = 9, LIMIT = 4 };
    Shape shape = sheet_shape(150);
    delmesh_mesh *in = shape_mesh(context, &shape), *out = NULL;
    delmesh_remesh_options options;
    delmesh_remesh_options_init(&options, sizeof options);
    options.mode = DELMESH_MODE_FLIP;
    assert_status(delmesh_remesh(context, in, &options, &out, NULL), context, DELMESH_OK);
    const int64_t verts = info_of(out).vertices;
    int64_t* offsets = malloc((size_t)(shape.verts + 1) * sizeof *offsets);
    int32_t* indices = malloc((size_t)shape.verts * EACH * sizeof *indices);
    float* values = malloc((size_t)shape.verts * EACH * sizeof *values);
    double* table = calloc((size_t)shape.verts * BONES, sizeof *table);
    int64_t entries = 0;
    for (int32_t v = 0; v < shape.verts; ++v) {
        offsets[v] = entries;
        for (int k = 0; k < v % (EACH + 1); ++k, ++entries) {
            indices[entries] = (v * 7 + k * k * 5) % BONES; /* in no order, some twice */
            values[entries] = (float)(1 + (v * 31 + k * 17) % 64) / 64;
            table[v * BONES + indices[entries]] += values[entries];
        }
    }
    offsets[shape.verts] = entries;
    const delmesh_rows from = {{offsets, shape.verts + 1, 0, DELMESH_INT64, 1},
                               {indices, entries, 0, DELMESH_INT32, 1},
                               {values, entries, 0, DELMESH_FLOAT32, 1}};
    int64_t *to = malloc((size_t)(verts + 1) * sizeof *to), *to1 = malloc((size_t)(verts + 1) * sizeof *to);
    int32_t *bones = calloc((size_t)verts * LIMIT, sizeof *bones), *bones1 = calloc((size_t)verts * LIMIT, sizeof *bones);
    double *weights = calloc((size_t)verts * LIMIT, sizeof *weights), *weights1 = calloc((size_t)verts * LIMIT, sizeof *weights);
    assert_status(sparse(out, &from, LIMIT, 0, verts * LIMIT, to, bones, weights), context, DELMESH_OK);
    /* A dense layer of the same numbers has the sums. */
    double* dense = malloc((size_t)verts * BONES * sizeof *dense);
    assert_status(transfer(out, DELMESH_DOMAIN_VERTEX, 0, (delmesh_view){table, shape.verts, 0, DELMESH_FLOAT64, BONES},
                           (delmesh_view_mut){dense, verts, 0, DELMESH_FLOAT64, BONES}),
                  context, DELMESH_OK);
    for (int64_t v = 0; v < verts; ++v) {
        int given = 0;
        for (int b = 0; b < BONES; ++b) given += dense[v * BONES + b] != 0;
        assert_int_equal(to[v + 1] - to[v], given < LIMIT ? given : LIMIT);
        for (int64_t k = to[v]; k < to[v + 1]; ++k) {
            assert_true(k == to[v] || bones[k] > bones[k - 1]);
            assert_true(fabs(weights[k] - dense[v * BONES + bones[k]]) < 1e-14);
            int larger = 0; /* none that was left out is larger */
            for (int b = 0; b < BONES; ++b) larger += dense[v * BONES + b] > weights[k] + 1e-14;
            assert_true(larger < LIMIT);
        }
    }
    Host other_host;
    delmesh_context *other = host_context(&other_host, 1), *mine = context;
    context = other;
    assert_status(sparse(out, &from, LIMIT, 0, verts * LIMIT, to1, bones1, weights1), other, DELMESH_OK);
    context = mine;
    assert_memory_equal(to, to1, (size_t)(verts + 1) * sizeof *to);
    assert_memory_equal(bones, bones1, (size_t)verts * LIMIT * sizeof *bones);
    assert_memory_equal(weights, weights1, (size_t)verts * LIMIT * sizeof *weights);
    delmesh_context_destroy(other);
    assert_nothing_left(&other_host);
    free(offsets), free(indices), free(values), free(table), free(to), free(to1), free(bones), free(bones1), free(weights),
        free(weights1), free(dense);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
    free_shape(&shape);
}

/* ---- Fits ------------------------------------------------------------------------------------------------------------------ */

static double bump(const double* x) {
    return sin(0.1 * x[0]) * cos(0.08 * x[1]);
}

/* A flat grid, and a level of it with a map, which has its vertices where the bump needs them. */
enum { SIDE = 41 };
static delmesh_mesh* flat_level(delmesh_context* of, Shape* shape, delmesh_mesh** in) {
    *shape = sheet_shape(SIDE);
    for (int32_t v = 0; v < shape->verts; ++v) {
        shape->positions[3 * v] = v % SIDE;
        shape->positions[3 * v + 1] = (double)(v / SIDE) + (v % SIDE) * 0.25;
        shape->positions[3 * v + 2] = 0;
    }
    const int64_t corners = 3 * (int64_t)shape->faces;
    double* values = malloc((size_t)corners * sizeof *values);
    for (int64_t c = 0; c < corners; ++c) values[c] = bump(&shape->positions[3 * shape->corners[c]]);
    delmesh_layer layer;
    delmesh_layer_init(&layer, sizeof layer);
    layer.kind = DELMESH_LAYER_OTHER;
    layer.weight = 1;
    layer.values = (delmesh_view){values, corners, 0, DELMESH_FLOAT64, 1};
    delmesh_mesh_desc desc = shape_desc(shape);
    desc.layers = &layer;
    desc.layer_count = 1;
    assert_status(delmesh_mesh_create(of, &desc, in), of, DELMESH_OK);
    free(values);
    const delmesh_target target = {DELMESH_TARGET_RATIO, 0, 0.1};
    delmesh_decimate_options options;
    delmesh_decimate_options_init(&options, sizeof options);
    options.map = 1;
    options.precision = DELMESH_FLOAT64;
    delmesh_mesh* level = NULL;
    assert_status(delmesh_decimate(of, *in, &target, &options, &level, NULL, NULL), of, DELMESH_OK);
    return level;
}

/* The integral of the squared difference between what a layer of corners says on a flat mesh and the function. */
static double squares_of(const delmesh_mesh* mesh, const double* values) {
    const delmesh_mesh_info info = info_of(mesh);
    double(*places)[3] = malloc((size_t)info.vertices * sizeof *places);
    int32_t* verts = malloc((size_t)info.corners * sizeof *verts);
    const delmesh_view_mut to_places = {places, info.vertices, 0, DELMESH_FLOAT64, 3},
                           to_verts = {verts, info.corners, 0, DELMESH_INT32, 1};
    assert_status(delmesh_mesh_read(mesh, DELMESH_POSITION, &to_places), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_read(mesh, DELMESH_CORNER_VERT, &to_verts), NULL, DELMESH_OK);
    double sum = 0;
    enum { CUTS = 10 };
    for (int64_t f = 0; f < info.faces; ++f) {
        const double *a = places[verts[3 * f]], *b = places[verts[3 * f + 1]], *c = places[verts[3 * f + 2]];
        const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        for (int i = 0; i < CUTS; ++i)
            for (int j = 0; j < 2 * (CUTS - i) - 1; ++j) {
                const double part = (1 + j % 2) / 3.0, u = (i + part) / CUTS, v = (j / 2 + part) / CUTS, w = 1 - u - v;
                const double x[2] = {w * a[0] + u * b[0] + v * c[0], w * a[1] + u * b[1] + v * c[1]};
                const double off = w * values[3 * f] + u * values[3 * f + 1] + v * values[3 * f + 2] - bump(x);
                sum += area * off * off;
            }
    }
    free(places), free(verts);
    return sum;
}

static void fits_are_closer(void** state) {
    (void)state;
    Shape shape;
    delmesh_mesh *in, *level = flat_level(context, &shape, &in);
    const delmesh_mesh_info info = info_of(level);
    const int64_t from = 3 * (int64_t)shape.faces;
    double *layer = malloc((size_t)from * sizeof *layer), *mapped = malloc((size_t)info.corners * sizeof *mapped),
           *fitted = malloc((size_t)info.corners * sizeof *fitted), *once_more = malloc((size_t)info.corners * sizeof *fitted);
    for (int64_t c = 0; c < from; ++c) layer[c] = bump(&shape.positions[3 * shape.corners[c]]);
    const delmesh_view source = {layer, from, 0, DELMESH_FLOAT64, 1};
    const delmesh_view_mut to_mapped = {mapped, info.corners, 0, DELMESH_FLOAT64, 1},
                           to_fitted = {fitted, info.corners, 0, DELMESH_FLOAT64, 1},
                           to_once_more = {once_more, info.corners, 0, DELMESH_FLOAT64, 1};
    assert_status(transfer(level, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, source, to_mapped), context, DELMESH_OK);
    assert_status(
        delmesh_transfer_fitted(context, in, level, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, &source, &to_fitted), context,
        DELMESH_OK);
    const double before = squares_of(level, mapped), after = squares_of(level, fitted);
    print_message("    squares %.4g, fitted %.4g\n", before, after);
    assert_true(after < 0.5 * before);
    /* It is the least: moving any vertex' value either way makes it worse, but for what lies between the points. On the boundary
     * they are as they were. */
    int32_t* verts = malloc((size_t)info.corners * sizeof *verts);
    uint8_t* ends = calloc((size_t)info.vertices, 1);
    int32_t* edges = malloc((size_t)info.edges * 2 * sizeof *edges);
    int32_t* flags = malloc((size_t)info.edges * sizeof *flags);
    const delmesh_view_mut to_verts = {verts, info.corners, 0, DELMESH_INT32, 1},
                           to_edges = {edges, info.edges, 0, DELMESH_INT32, 2},
                           to_flags = {flags, info.edges, 0, DELMESH_INT32, 1};
    assert_status(delmesh_mesh_read(level, DELMESH_CORNER_VERT, &to_verts), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_read(level, DELMESH_EDGE_VERT, &to_edges), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_read(level, DELMESH_EDGE_FLAGS, &to_flags), NULL, DELMESH_OK);
    for (int64_t e = 0; e < info.edges; ++e)
        if (flags[e] & DELMESH_EDGE_BOUNDARY) ends[edges[2 * e]] = ends[edges[2 * e + 1]] = 1;
    int inside = 0;
    for (int32_t v = 0; v < info.vertices; ++v) {
        if (!ends[v] && ++inside > 20) continue;
        for (int way = -1; way < 2; way += 2) {
            memcpy(once_more, fitted, (size_t)info.corners * sizeof *fitted);
            for (int64_t c = 0; c < info.corners; ++c) {
                if (verts[c] != v) continue;
                if (ends[v]) assert_true(fitted[c] == mapped[c]);
                once_more[c] += way * 0.01;
            }
            if (!ends[v]) assert_true(squares_of(level, once_more) > after);
        }
    }
    assert_true(inside > 20);
    /* Whatever the number of threads, and in a second run. */
    Host other_host;
    delmesh_context* other = host_context(&other_host, 1);
    assert_status(
        delmesh_transfer_fitted(other, in, level, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, &source, &to_once_more), other,
        DELMESH_OK);
    assert_memory_equal(once_more, fitted, (size_t)info.corners * sizeof *fitted);
    delmesh_context_destroy(other);
    assert_nothing_left(&other_host);
    /* What is the same all over stays so bit for bit, and what is linear fits already. */
    for (int64_t c = 0; c < from; ++c) layer[c] = 0.1;
    assert_status(
        delmesh_transfer_fitted(context, in, level, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, &source, &to_fitted), context,
        DELMESH_OK);
    for (int64_t c = 0; c < info.corners; ++c) assert_true(fitted[c] == 0.1);
    for (int64_t c = 0; c < from; ++c) layer[c] = shape.positions[3 * shape.corners[c]];
    assert_status(transfer(level, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, source, to_mapped), context, DELMESH_OK);
    assert_status(
        delmesh_transfer_fitted(context, in, level, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, &source, &to_fitted), context,
        DELMESH_OK);
    for (int64_t c = 0; c < info.corners; ++c) /* the level's boundary is a little off the grid's */
        assert_true(fabs(fitted[c] - mapped[c]) < 1e-3);
    free(layer), free(mapped), free(fitted), free(once_more), free(verts), free(ends), free(edges), free(flags);
    delmesh_mesh_destroy(level);
    delmesh_mesh_destroy(in);
    free_shape(&shape);
}

/* Values stay in their range, directions of length 1, borders and what is not finite as they were. */
static void fits_of_every_kind(void** state) {
    (void)state;
    Shape shape;
    delmesh_mesh *in, *level = flat_level(context, &shape, &in);
    const delmesh_mesh_info info = info_of(level);
    const int64_t from = 3 * (int64_t)shape.faces, to = info.corners;
    const size_t room = (size_t)(from > to ? from : to);
    uint8_t *greys = malloc(room), *grey = malloc(room), *grey_fitted = malloc(room);
    for (int64_t c = 0; c < from; ++c) greys[c] = shape.positions[3 * shape.corners[c]] < 17 ? 3 : 250;
    delmesh_view source = {greys, from, 0, DELMESH_UINT8, 1};
    delmesh_view_mut target = {grey, to, 0, DELMESH_UINT8, 1}, fitted = {grey_fitted, to, 0, DELMESH_UINT8, 1};
    assert_status(transfer(level, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, source, target), context, DELMESH_OK);
    assert_status(delmesh_transfer_fitted(context, in, level, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, &source, &fitted),
                  context, DELMESH_OK);
    int changed = 0;
    for (int64_t c = 0; c < to; ++c) {
        assert_true(grey_fitted[c] >= 3 && grey_fitted[c] <= 250);
        changed += grey[c] != grey_fitted[c];
    }
    assert_true(changed > 0);
    free(greys), free(grey), free(grey_fitted);

    float *normals = malloc(room * 3 * sizeof *normals), *normal = malloc(room * 3 * sizeof *normals);
    for (int64_t c = 0; c < from; ++c) {
        const double turn = 0.1 * shape.positions[3 * shape.corners[c] + 1] * shape.positions[3 * shape.corners[c] + 1] / 10;
        normals[3 * c] = (float)sin(turn), normals[3 * c + 1] = 0, normals[3 * c + 2] = (float)cos(turn);
    }
    source = (delmesh_view){normals, from, 0, DELMESH_FLOAT32, 3};
    fitted = (delmesh_view_mut){normal, to, 0, DELMESH_FLOAT32, 3};
    assert_status(
        delmesh_transfer_fitted(context, in, level, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_DIRECTION, &source, &fitted), context,
        DELMESH_OK);
    for (int64_t c = 0; c < to; ++c) {
        const float* n = &normal[3 * c];
        assert_true(fabs(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1.0) < 1e-6);
    }

    /* A value of its own on each face of the source: every vertex has several. And one that is none. */
    for (int64_t c = 0; c < from; ++c) normals[c] = (float)(c / 3 % 97);
    normals[0] = NAN;
    source = (delmesh_view){normals, from, 0, DELMESH_FLOAT32, 1};
    assert_status(transfer(in, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, source,
                           (delmesh_view_mut){normal, from, 0, DELMESH_FLOAT32, 1}),
                  context, DELMESH_OK);
    assert_status(delmesh_transfer_fitted(context, in, in, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, &source,
                                          &(delmesh_view_mut){normal + from, from, 0, DELMESH_FLOAT32, 1}),
                  context, DELMESH_OK);
    assert_memory_equal(normal, normal + from, (size_t)from * sizeof *normal);
    free(normals), free(normal);
    delmesh_mesh_destroy(level);
    delmesh_mesh_destroy(in);
    free_shape(&shape);
}

/* ---- Refusals -------------------------------------------------------------------------------------------------------------- */

static void expect(int32_t status, int32_t expected, const char* sentence) {
    assert_status(status, context, expected);
    assert_string_equal(delmesh_last_error(context), sentence);
}

static void refused_layers(void** state) {
    (void)state;
    delmesh_mesh *source, *mesh, *polygons = polygon_mesh();
    double t;
    mesh = split_triangle(&source, &t);
    float from[10 * 257] = {0}, to[5 * 257];
    memset(to, 0x5a, sizeof to);
    const delmesh_view good = {from, 4, 0, DELMESH_FLOAT32, 2}, ints = {from, 4, 0, DELMESH_INT32, 2};
    const delmesh_view_mut into = {to, 5, 0, DELMESH_FLOAT32, 2}, into_ints = {to, 5, 0, DELMESH_INT32, 2};
    enum { BAD = DELMESH_ERROR_INVALID_ARGUMENT };
    expect(delmesh_transfer(context, NULL, 0, 0, &good, &into), BAD, "The argument 'mesh' was NULL.");
    expect(delmesh_transfer(context, mesh, 0, 0, NULL, &into), BAD, "The argument 'source' was NULL.");
    expect(delmesh_transfer(context, mesh, 0, 0, &good, NULL), BAD, "The argument 'target' was NULL.");
    assert_int_equal(delmesh_transfer(NULL, mesh, 0, 0, &good, &into), BAD);
    expect(transfer(mesh, 4, 0, good, into), BAD, "The argument 'domain' was 4, which is no DELMESH_DOMAIN_*.");
    expect(transfer(mesh, -1, 0, good, into), BAD, "The argument 'domain' was -1, which is no DELMESH_DOMAIN_*.");
    expect(transfer(mesh, 0, 4, good, into), BAD, "The argument 'policy' was 4, which is no DELMESH_TRANSFER_*.");
    expect(transfer(mesh, 0, -1, good, into), BAD, "The argument 'policy' was -1, which is no DELMESH_TRANSFER_*.");
    expect(transfer(mesh, DELMESH_DOMAIN_CORNER, 0, good, into), BAD,
           "The argument 'mesh' had no map of its corners: it was made without 'map'.");
    expect(transfer(mesh, DELMESH_DOMAIN_EDGE, 0, good, into), BAD,
           "The argument 'mesh' had no map of its edges: it was made without 'map'.");
    delmesh_view view = good;
    view.components = 0;
    expect(transfer(mesh, 0, 0, view, into), BAD, "The view 'source' had 0 components, outside 1 to 256.");
    view.components = 257;
    expect(transfer(mesh, 0, 0, view, into), BAD, "The view 'source' had 257 components, outside 1 to 256.");
    view = good, view.type = 7;
    expect(transfer(mesh, 0, 0, view, into), BAD,
           "The view 'source' had a type that is not taken here: type 7, components 2, count 4, stride 0.");
    expect(transfer(mesh, 0, DELMESH_TRANSFER_DIRECTION, ints, into_ints), BAD,
           "The view 'source' had a type that is not taken here: type 3, components 2, count 4, stride 0.");
    expect(transfer(mesh, 0, DELMESH_TRANSFER_WEIGHTS, ints, into_ints), BAD,
           "The view 'source' had a type that is not taken here: type 3, components 2, count 4, stride 0.");
    view = good, view.data = NULL;
    expect(transfer(mesh, 0, 0, view, into), BAD, "The view 'source' had no data: type 1, components 2, count 4, stride 0.");
    view = good, view.stride = 4;
    expect(transfer(mesh, 0, 0, view, into), BAD,
           "The view 'source' had a stride smaller than its elements: type 1, components 2, count 4, stride 4.");
    view = good, view.stride = 10;
    expect(transfer(mesh, 0, 0, view, into), BAD,
           "The view 'source' was not aligned to its type: type 1, components 2, count 4, stride 10.");
    expect(transfer(mesh, 0, 0, good, into_ints), BAD,
           "The view 'target' had a type that is not taken here: type 3, components 2, count 5, stride 0.");
    delmesh_view_mut target = into;
    target.components = 3;
    expect(transfer(mesh, 0, 0, good, target), BAD,
           "The view 'target' had the wrong number of components: type 1, components 3, count 5, stride 0.");
    view = good, view.count = 5;
    expect(transfer(mesh, 0, 0, view, into), BAD, "The view 'source' had 5 elements, and there were 4 source vertices.");
    target = into, target.count = 4;
    expect(transfer(mesh, 0, 0, good, target), BAD, "The view 'target' had 4 elements, and there were 5 vertices.");
    expect(transfer(mesh, DELMESH_DOMAIN_FACE, 0, good, into), BAD, "The view 'source' had 4 elements, and there were 2 source faces.");
    view = good, view.count = 3;
    expect(transfer(polygons, DELMESH_DOMAIN_FACE, 0, view, into), BAD, "The view 'target' had 5 elements, and there were 3 faces.");
    expect(transfer(polygons, DELMESH_DOMAIN_CORNER, 0, good, into), BAD,
           "The view 'source' had 4 elements, and there were 10 source corners.");
    view = good, view.count = 10;
    expect(transfer(polygons, DELMESH_DOMAIN_CORNER, 0, view, into), BAD,
           "The view 'target' had 5 elements, and there were 9 corners.");
    expect(transfer(polygons, DELMESH_DOMAIN_EDGE, 0, good, into), BAD,
           "The view 'source' had 4 elements, and there were 7 source edges.");
    view.count = 7;
    expect(transfer(polygons, DELMESH_DOMAIN_EDGE, 0, view, into), BAD, "The view 'target' had 5 elements, and there were 7 edges.");
    for (size_t i = 0; i < sizeof to; ++i) assert_int_equal(((unsigned char*)to)[i], 0x5a);
    delmesh_mesh_destroy(polygons);
    delmesh_mesh_destroy(mesh);
    delmesh_mesh_destroy(source);
}

static void refused_fits(void** state) {
    (void)state;
    Shape shape;
    delmesh_mesh *in, *level = flat_level(context, &shape, &in), *polygons = polygon_mesh(), *source, *unmapped;
    double t;
    unmapped = split_triangle(&source, &t);
    const int64_t from = info_of(in).vertices, to = info_of(level).vertices;
    float *values = calloc((size_t)from, sizeof *values), *out = malloc((size_t)to * sizeof *out);
    memset(out, 0x5a, (size_t)to * sizeof *out);
    const delmesh_view good = {values, from, 0, DELMESH_FLOAT32, 1};
    const delmesh_view_mut into = {out, to, 0, DELMESH_FLOAT32, 1};
    enum { BAD = DELMESH_ERROR_INVALID_ARGUMENT };
    expect(delmesh_transfer_fitted(context, NULL, level, 0, 0, &good, &into), BAD, "The argument 'in' was NULL.");
    expect(delmesh_transfer_fitted(context, in, NULL, 0, 0, &good, &into), BAD, "The argument 'mesh' was NULL.");
    expect(delmesh_transfer_fitted(context, in, level, 0, 0, NULL, &into), BAD, "The argument 'source' was NULL.");
    expect(delmesh_transfer_fitted(context, in, level, 0, 0, &good, NULL), BAD, "The argument 'target' was NULL.");
    expect(delmesh_transfer_fitted(context, in, level, 2, 0, &good, &into), BAD, "The argument 'domain' was 2, outside 0 to 1.");
    expect(delmesh_transfer_fitted(context, in, level, 0, 1, &good, &into), BAD,
           "The argument 'policy' was 1, and only DELMESH_TRANSFER_LINEAR and _DIRECTION can fit.");
    expect(delmesh_transfer_fitted(context, source, unmapped, 0, 0, &good, &into), BAD,
           "The argument 'mesh' had no map of its corners: it was made without 'map'.");
    expect(delmesh_transfer_fitted(context, polygons, level, 0, 0, &good, &into), BAD,
           "The argument 'in' had 5 vertices, 10 corners and 3 faces, and the source of 'mesh' had 1681, 9600 and 3200.");
    delmesh_view view = good;
    view.count = 3;
    expect(delmesh_transfer_fitted(context, in, level, 0, 0, &view, &into), BAD,
           "The view 'source' had 3 elements, and there were 1681 source vertices.");
    for (size_t i = 0; i < (size_t)to * sizeof *out; ++i) assert_int_equal(((unsigned char*)out)[i], 0x5a);
    free(values), free(out);
    delmesh_mesh_destroy(unmapped);
    delmesh_mesh_destroy(source);
    delmesh_mesh_destroy(polygons);
    delmesh_mesh_destroy(level);
    delmesh_mesh_destroy(in);
    free_shape(&shape);
}

static void refused_rows(void** state) {
    (void)state;
    delmesh_mesh *source, *mesh;
    double t;
    mesh = split_triangle(&source, &t);
    unsigned char room[256];
    memset(room, 0x5a, sizeof room);
    const delmesh_rows_mut into = {{room, 6, 0, DELMESH_INT32, 1},
                                   {room + 64, 7, 0, DELMESH_INT32, 1},
                                   {room + 128, 7, 0, DELMESH_FLOAT64, 1}};
    enum { BAD = DELMESH_ERROR_INVALID_ARGUMENT, RANGE = DELMESH_ERROR_INDEX_OUT_OF_RANGE, LARGE = DELMESH_ERROR_TOO_LARGE };
    expect(delmesh_transfer_sparse(context, NULL, &rows, 4, 0, &into), BAD, "The argument 'mesh' was NULL.");
    expect(delmesh_transfer_sparse(context, mesh, NULL, 4, 0, &into), BAD, "The argument 'source' was NULL.");
    expect(delmesh_transfer_sparse(context, mesh, &rows, 4, 0, NULL), BAD, "The argument 'target' was NULL.");
    expect(delmesh_transfer_sparse(context, mesh, &rows, 0, 0, &into), BAD, "The argument 'limit' was 0, outside 1 to 65535.");
    expect(delmesh_transfer_sparse(context, mesh, &rows, 65536, 0, &into), BAD,
           "The argument 'limit' was 65536, outside 1 to 65535.");
    expect(delmesh_transfer_sparse(context, mesh, &rows, 4, 3, &into), BAD, "The argument 'normalise' was 3, outside 0 to 2.");
    expect(delmesh_transfer_sparse(context, mesh, &rows, 4, -1, &into), BAD, "The argument 'normalise' was -1, outside 0 to 2.");
#define REFUSE(change, status, sentence)                                                                                         \
    do {                                                                                                                         \
        delmesh_rows from = rows;                                                                                                \
        delmesh_rows_mut to = into;                                                                                              \
        change;                                                                                                                  \
        expect(delmesh_transfer_sparse(context, mesh, &from, 4, 0, &to), status, sentence);                                      \
        for (size_t i = 0; i < sizeof room; ++i) assert_int_equal(room[i], 0x5a);                                                \
    } while (0)
    REFUSE(from.offsets.type = DELMESH_FLOAT32, BAD,
           "The view 'source.offsets' had a type that is not taken here: type 1, components 1, count 5, stride 0.");
    REFUSE(from.indices.components = 2, BAD,
           "The view 'source.indices' had the wrong number of components: type 4, components 2, count 8, stride 0.");
    REFUSE(from.values.type = DELMESH_INT32, BAD,
           "The view 'source.values' had a type that is not taken here: type 3, components 1, count 8, stride 0.");
    REFUSE(from.offsets.count = 4, BAD, "The view 'source.offsets' had 4 elements, and there were 5 source vertices and an end.");
    REFUSE(from.indices.count = 7, BAD, "The view 'source.indices' had 7 elements, and there were 8 values.");
    REFUSE((from.indices.count = 7, from.values.count = 7), RANGE, "Offset 4 of 'source' was 8, and the number of values 7.");
    static const int64_t falling[5] = {0, 5, 4, 8, 8}, late[5] = {1, 5, 6, 8, 8};
    REFUSE(from.offsets.data = falling, RANGE, "Offset 2 of 'source' was 4, less than the one before it, 5.");
    REFUSE(from.offsets.data = late, RANGE, "Offset 0 of 'source' was 1, not 0.");
    static const int32_t negative[8] = {1, 2, 3, 4, 5, -6, 7, 8};
    static const int64_t huge[8] = {1, 2, 3, 4, 5, 6, 5000000000, 8};
    REFUSE((from.indices = (delmesh_view){negative, 8, 0, DELMESH_INT32, 1}), RANGE, "Index 5 of 'source' was -6, less than 0.");
    REFUSE((from.indices = (delmesh_view){huge, 8, 0, DELMESH_INT64, 1}), LARGE,
           "The view 'target.indices' had a type that cannot hold the index 5000000000.");
    static const double infinite[8] = {1, 1, 1, -INFINITY, 1, NAN, 1, 1};
    REFUSE(from.values.data = infinite, BAD, "Value 3 of 'source' was NaN or infinite.");
    REFUSE(to.offsets.count = 5, BAD, "The view 'target.offsets' had 5 elements, and there were 6 vertices and an end.");
    REFUSE(to.offsets.type = DELMESH_UINT8, BAD,
           "The view 'target.offsets' had a type that is not taken here: type 6, components 1, count 6, stride 0.");
    REFUSE((to.indices = (delmesh_view_mut){0}), BAD,
           "The view 'target.indices' had a type that is not taken here: type 0, components 0, count 0, stride 0.");
    REFUSE((to.values = (delmesh_view_mut){0}), BAD,
           "The view 'target.values' had a type that is not taken here: type 0, components 0, count 0, stride 0.");
    REFUSE(to.indices.count = 6, LARGE, "The view 'target.indices' had room for 6 entries, and there were 7.");
    REFUSE(to.values.count = 6, LARGE, "The view 'target.values' had room for 6 entries, and there were 7.");
#undef REFUSE
    delmesh_mesh_destroy(mesh);
    delmesh_mesh_destroy(source);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(copies_bit_for_bit),
        cmocka_unit_test(edges_without_a_source),
        cmocka_unit_test(linear_of_every_type),
        cmocka_unit_test(nearest_direction_and_weights),
        cmocka_unit_test(positions_through_the_maps),
        cmocka_unit_test(rows_are_merged_limited_and_normalised),
        cmocka_unit_test(rows_against_a_table),
        cmocka_unit_test(fits_are_closer),
        cmocka_unit_test(fits_of_every_kind),
        cmocka_unit_test(refused_layers),
        cmocka_unit_test(refused_fits),
        cmocka_unit_test(refused_rows),
    };
    return cmocka_run_group_tests_name("transfer", tests, set_up, tear_down);
}
