/* SPDX-License-Identifier: Apache-2.0
 * Decimation through the C interface: every option, target, view and report, and what every level promises. Running out of memory
 * and cancelling at every step is in test_sweeps.c. */
#include "support.h"

#include <math.h>
#include <stdio.h>

HOST_FIXTURE(1)

static delmesh_decimate_options defaults(void) {
    delmesh_decimate_options options;
    memset(&options, 0xff, sizeof options);
    delmesh_decimate_options_init(&options, sizeof options);
    return options;
}

static delmesh_target target(int32_t kind, double value) {
    return (delmesh_target){kind, 0, value};
}

/* The faces of a unit cube as six quads: 8 vertices, 6 polygons, 12 triangles. */
static delmesh_mesh* torus(int32_t around, int32_t across) {
    Shape shape = torus_shape(around, across);
    delmesh_mesh* mesh = shape_mesh(context, &shape);
    free_shape(&shape);
    return mesh;
}

static int32_t* integers(const delmesh_mesh* mesh, int32_t what, int64_t count, int32_t components) {
    int32_t* numbers = malloc((size_t)(count * components) * sizeof *numbers + 1);
    const delmesh_view_mut dst = {numbers, count, 0, DELMESH_INT32, components};
    assert_status(delmesh_mesh_read(mesh, what, &dst), NULL, DELMESH_OK);
    return numbers;
}

static double* doubles(const delmesh_mesh* mesh, int32_t what) {
    const int64_t count = info_of(mesh).vertices;
    double* numbers = malloc((size_t)count * 3 * sizeof *numbers + 1);
    const delmesh_view_mut dst = {numbers, count, 0, DELMESH_FLOAT64, 3};
    assert_status(delmesh_mesh_read(mesh, what, &dst), NULL, DELMESH_OK);
    return numbers;
}

/* ---- Arguments ----------------------------------------------------------------------------------------------------------- */

static void defaults_are_documented(void** state) {
    (void)state;
    const delmesh_decimate_options options = defaults();
    assert_int_equal(options.struct_size, sizeof options);
    assert_int_equal(options.prepare, DELMESH_MODE_FLIP);
    assert_int_equal(options.boundary, DELMESH_BOUNDARY_NONOBTUSE);
    assert_int_equal(options.precision, DELMESH_FLOAT32);
    assert_int_equal(options.collapse_placement, DELMESH_COLLAPSE_ALL);
    assert_int_equal(options.strict | options.quality | options.reserved0, 0);
    assert_true(options.feature_angle == 30 && options.tolerance < 0 && options.max_normal_turn == 78);
    assert_true(options.boundary_weight == 1 && options.prune == 0);
    assert_null(options.vert_weights.data);
    assert_null(options.locked_verts.data);
    assert_null(options.face_mask.data);
    delmesh_level_report level;
    memset(&level, 0xff, sizeof level);
    delmesh_level_report_init(&level, sizeof level);
    assert_true(level.bound < 0 && level.vertices == 0 && level.certified == 0);
    delmesh_decimate_report report;
    memset(&report, 0xff, sizeof report);
    delmesh_decimate_report_init(&report, sizeof report);
    assert_int_equal(report.struct_size, sizeof report);
    assert_true(report.prepare_bound < 0 && report.collapses == 0 && report.topology_kept == 0 && report.reserved1 == 0);
    assert_int_equal(delmesh_struct_size("delmesh_target"), 16);
    assert_int_equal(delmesh_struct_size("delmesh_decimate_options"), sizeof options);
    assert_int_equal(delmesh_struct_size("delmesh_level_report"), sizeof level);
    assert_int_equal(delmesh_struct_size("delmesh_decimate_report"), sizeof report);
    const delmesh_api* api = delmesh_get_api(DELMESH_ABI_VERSION);
    assert_true(api->lod_family == delmesh_lod_family && api->decimate == delmesh_decimate);
    assert_true(api->decimate_options_init == delmesh_decimate_options_init);
    assert_true(api->level_report_init == delmesh_level_report_init);
    assert_true(api->decimate_report_init == delmesh_decimate_report_init);
}

/* A call that must fail: no handle, reports written all the same, `named` in the sentence. */
static void refuse(const delmesh_mesh* in, const delmesh_target* targets, int32_t count, const delmesh_decimate_options* options,
                   int32_t expected, const char* named) {
    enum { MOST = 4 };
    assert_in_range(count, 1, MOST);
    delmesh_mesh* out[MOST];
    delmesh_level_report levels[MOST];
    delmesh_decimate_report report;
    for (int i = 0; i < MOST; ++i) {
        out[i] = (delmesh_mesh*)(uintptr_t)1;
        delmesh_level_report_init(&levels[i], sizeof levels[i]);
        levels[i].certified = 1;
    }
    delmesh_decimate_report_init(&report, sizeof report);
    report.collapses = 77;
    assert_status(delmesh_lod_family(context, in, targets, count, options, out, levels, &report), context, expected);
    for (int i = 0; i < MOST; ++i) {
        if (i < count) assert_null(out[i]);
        assert_int_equal(levels[i].certified, i < count ? 0 : 1);
    }
    assert_int_equal(report.collapses, 0);
    assert_true(report.seconds_total >= 0);
    if (strstr(delmesh_last_error(context), named) == NULL) fail_msg("'%s' is not in: %s", named, delmesh_last_error(context));
}

static void bad_options(void** state) {
    (void)state;
    delmesh_mesh* in = torus(6, 5);
    const delmesh_target half = target(DELMESH_TARGET_RATIO, 0.5);
    delmesh_decimate_options options;
#define BAD(field, value, named)                                                                                                 \
    do {                                                                                                                         \
        options = defaults();                                                                                                    \
        options.field = value;                                                                                                   \
        refuse(in, &half, 1, &options, DELMESH_ERROR_INVALID_ARGUMENT, "'" #field "' was " named);                               \
    } while (0)
    BAD(prepare, -1, "-1");
    BAD(prepare, 3, "3");
    BAD(boundary, 2, "2");
    BAD(precision, 0, "0");
    BAD(precision, DELMESH_INT32, "3");
    BAD(strict, 2, "2");
    BAD(collapse_placement, 3, "3");
    BAD(quality, -1, "-1");
    BAD(reserved0, 1, "1");
    BAD(feature_angle, -0.5, "-0.5");
    BAD(feature_angle, NAN, "nan");
    BAD(tolerance, INFINITY, "inf");
    BAD(max_normal_turn, -1, "-1");
    BAD(max_normal_turn, 90.5, "90.5");
    BAD(boundary_weight, -1, "-1");
    BAD(boundary_weight, INFINITY, "inf");
    BAD(prune, -0.25, "-0.25");
    BAD(prune, NAN, "nan");
#undef BAD
    options = defaults();
    options.struct_size = 12;
    refuse(in, &half, 1, &options, DELMESH_ERROR_INVALID_ARGUMENT, "struct_size of 'options' was 12");
    refuse(NULL, &half, 1, NULL, DELMESH_ERROR_INVALID_ARGUMENT, "'in' was NULL");
    refuse(in, NULL, 1, NULL, DELMESH_ERROR_INVALID_ARGUMENT, "'targets' was NULL");
    delmesh_mesh* out = (delmesh_mesh*)(uintptr_t)1;
    assert_status(delmesh_decimate(context, in, NULL, NULL, &out, NULL, NULL), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_non_null(strstr(delmesh_last_error(context), "'target' was NULL"));
    assert_null(out);
    assert_status(delmesh_decimate(context, in, &half, NULL, NULL, NULL, NULL), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_non_null(strstr(delmesh_last_error(context), "'out' was NULL"));
    assert_int_equal(delmesh_decimate(NULL, in, &half, NULL, &out, NULL, NULL), DELMESH_ERROR_INVALID_ARGUMENT);
    /* How long `out` is nobody knows here, so it is left alone. */
    for (int32_t count = -1; count <= 65; count += count == 0 ? 65 : 1) {
        out = (delmesh_mesh*)(uintptr_t)1;
        assert_status(delmesh_lod_family(context, in, &half, count, NULL, &out, NULL, NULL), context,
                      DELMESH_ERROR_INVALID_ARGUMENT);
        assert_non_null(strstr(delmesh_last_error(context), "'count' was "));
        assert_true(out == (delmesh_mesh*)(uintptr_t)1);
    }
    delmesh_mesh_destroy(in);
}

static void bad_targets(void** state) {
    (void)state;
    delmesh_mesh* in = torus(6, 5); /* 60 faces */
    const struct {
        delmesh_target targets[3];
        int32_t count;
        const char* named;
    } cases[] = {
        {{{-1, 0, 0}}, 1, "The kind of 'targets' 0 was -1"},
        {{{DELMESH_TARGET_VERTICES, 0, 20}, {5, 0, 0}}, 2, "The kind of 'targets' 1 was 5"},
        {{{DELMESH_TARGET_VERTICES, 1, 20}}, 1, "'reserved0' of 'targets' 0 was 1"},
        {{{DELMESH_TARGET_VERTICES, 0, -1}}, 1, "The number of vertices of 'targets' 0 was -1"},
        {{{DELMESH_TARGET_FACES, 0, NAN}}, 1, "The number of faces of 'targets' 0 was nan"},
        {{{DELMESH_TARGET_FACES, 0, 1e300}}, 1, "1e+300"},
        {{{DELMESH_TARGET_RATIO, 0, 0.5}, {DELMESH_TARGET_RATIO, 0, 1.5}}, 2, "The ratio of 'targets' 1 was 1.5"},
        {{{DELMESH_TARGET_DEVIATION, 0, -0.5}}, 1, "The deviation of 'targets' 0 was -0.5"},
        {{{DELMESH_TARGET_DEVIATION, 0, INFINITY}}, 1, "inf"},
        /* Finer than one before it that counts the same. */
        {{{DELMESH_TARGET_VERTICES, 0, 10}, {DELMESH_TARGET_VERTICES, 0, 11}}, 2, "'targets' 1, 11, was finer than 0, 10"},
        {{{DELMESH_TARGET_VERTICES, 0, 10}, {DELMESH_TARGET_DEVIATION, 0, 9}, {DELMESH_TARGET_VERTICES, 0, 11}},
         3,
         "was finer than 0"},
        {{{DELMESH_TARGET_FACES, 0, 20}, {DELMESH_TARGET_RATIO, 0, 0.5}}, 2, "'targets' 1, 0.5, was finer than 0, 20"},
        {{{DELMESH_TARGET_DEVIATION, 0, 0.5}, {DELMESH_TARGET_DEVIATION, 0, 0.25}},
         2,
         "'targets' 1, 0.25, was finer than 0, 0.5"},
        {{{DELMESH_TARGET_VERTICES, 0, 10}, {DELMESH_TARGET_FULL, 0, 0}}, 2, "'targets' 1 was DELMESH_TARGET_FULL"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i)
        refuse(in, cases[i].targets, cases[i].count, NULL, DELMESH_ERROR_INVALID_ARGUMENT, cases[i].named);
    /* Equal ones are fine, and so is what cannot be compared. */
    const delmesh_target fine[4] = {{DELMESH_TARGET_FULL, 0, NAN},
                                    {DELMESH_TARGET_RATIO, 0, 0.5},
                                    {DELMESH_TARGET_FACES, 0, 30},
                                    {DELMESH_TARGET_VERTICES, 0, 1000}};
    delmesh_mesh* out[4];
    assert_status(delmesh_lod_family(context, in, fine, 4, NULL, out, NULL, NULL), context, DELMESH_OK);
    for (int i = 0; i < 4; ++i) delmesh_mesh_destroy(out[i]);
    delmesh_mesh_destroy(in);
}

static void bad_views(void** state) {
    (void)state;
    delmesh_mesh* in = NULL;
    assert_status(create_quad_cube(context, &in), context, DELMESH_OK);
    const delmesh_target full = target(DELMESH_TARGET_FULL, 0);
    double weights[12];
    int32_t flags[12] = {0};
    uint8_t bytes[12] = {0};
    for (int i = 0; i < 12; ++i) weights[i] = 1;
    delmesh_decimate_options options;
#define BAD(field, view, named)                                                                                                  \
    do {                                                                                                                         \
        options = defaults();                                                                                                    \
        options.field = (delmesh_view)view;                                                                                      \
        refuse(in, &full, 1, &options, DELMESH_ERROR_INVALID_ARGUMENT, named);                                                   \
    } while (0)
#define VIEW(...) {__VA_ARGS__}
    BAD(vert_weights, VIEW(flags, 8, 0, DELMESH_INT32, 1), "'vert_weights' had a type");
    BAD(vert_weights, VIEW(weights, 4, 0, DELMESH_FLOAT64, 2), "'vert_weights' had the wrong number of components");
    BAD(vert_weights, VIEW(NULL, 8, 0, DELMESH_FLOAT64, 1), "'vert_weights' had no data");
    BAD(vert_weights, VIEW(weights, 8, 4, DELMESH_FLOAT64, 1), "'vert_weights' had a stride");
    BAD(vert_weights, VIEW(weights, 7, 0, DELMESH_FLOAT64, 1), "'vert_weights' had 7 elements, and there were 8 source vertices");
    BAD(vert_weights, VIEW(weights, 12, 0, DELMESH_FLOAT64, 1), "had 12 elements");
    BAD(locked_verts, VIEW(weights, 8, 0, DELMESH_FLOAT64, 1), "'locked_verts' had a type");
    BAD(locked_verts, VIEW(flags, 9, 0, DELMESH_INT32, 1), "'locked_verts' had 9 elements, and there were 8 source vertices");
    BAD(face_mask, VIEW(flags, 6, 0, DELMESH_INT64, 1), "'face_mask' had a type");
    BAD(face_mask, VIEW(bytes, 12, 0, DELMESH_UINT8, 1), "'face_mask' had 12 elements, and there were 6 source polygons");
    static const double wrong[] = {0, -1, NAN, INFINITY};
    static const char* const names[] = {"was 0,", "was -1,", "was nan,", "was inf,"};
    for (int i = 0; i < 4; ++i) {
        weights[5] = wrong[i];
        char named[64];
        snprintf(named, sizeof named, "The weight 5 of 'vert_weights' %s", names[i]);
        BAD(vert_weights, VIEW(weights, 8, 0, DELMESH_FLOAT64, 1), named);
    }
    weights[5] = 1;
#undef BAD
#undef VIEW
    /* All at once, with strides. */
    options = defaults();
    float wide[8][3];
    for (int i = 0; i < 8; ++i) wide[i][1] = 0.5f + (float)i;
    options.vert_weights = (delmesh_view){&wide[0][1], 8, sizeof wide[0], DELMESH_FLOAT32, 1};
    options.locked_verts = (delmesh_view){bytes, 8, 0, DELMESH_UINT8, 1};
    memset(flags, 1, sizeof flags);
    options.face_mask = (delmesh_view){flags, 6, 8, DELMESH_INT32, 1};
    delmesh_mesh* out = NULL;
    assert_status(delmesh_decimate(context, in, &full, &options, &out, NULL, NULL), context, DELMESH_OK);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);

    /* What import copied has no values of its own; what an operation made is its own source. */
    Shape book = book_shape();
    in = shape_mesh(context, &book);
    assert_true(info_of(in).copied_vertices > 0);
    for (int64_t count = book.verts - 1; count <= info_of(in).vertices; ++count) {
        double* each = malloc((size_t)count * sizeof *each);
        for (int64_t v = 0; v < count; ++v) each[v] = 2;
        options = defaults();
        options.vert_weights = (delmesh_view){each, count, 0, DELMESH_FLOAT64, 1};
        assert_status(delmesh_decimate(context, in, &full, &options, &out, NULL, NULL), context,
                      count == book.verts ? DELMESH_OK : DELMESH_ERROR_INVALID_ARGUMENT);
        delmesh_mesh_destroy(out);
        free(each);
    }
    options = defaults();
    options.face_mask = (delmesh_view){flags, book.faces, 0, DELMESH_INT32, 1}; /* 9, of which one was left out */
    assert_status(delmesh_decimate(context, in, &full, &options, &out, NULL, NULL), context, DELMESH_OK);
    const delmesh_mesh_info made = info_of(out);
    delmesh_mesh* again = NULL;
    options.face_mask.count = made.faces;
    options.face_mask.data = calloc((size_t)made.faces, sizeof(int32_t));
    assert_status(delmesh_decimate(context, out, &full, &options, &again, NULL, NULL), context, DELMESH_OK);
    free((void*)(uintptr_t)options.face_mask.data);
    delmesh_mesh_destroy(again);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
    free_shape(&book);
}

static void options_and_reports_of_every_age(void** state) {
    (void)state;
    enum { COUNT = 3 };
    delmesh_mesh *in = torus(8, 6), *out[COUNT];
    const delmesh_target targets[COUNT] = {target(DELMESH_TARGET_FULL, 0), target(DELMESH_TARGET_FACES, 60),
                                           target(DELMESH_TARGET_FACES, 40)};
    delmesh_decimate_options* old = exactly(16); /* up to and including precision */
    delmesh_decimate_options_init(old, 16);
    old->precision = DELMESH_FLOAT64;
    for (uint32_t size = 8; size <= sizeof(delmesh_decimate_report); size += 8) {
        delmesh_decimate_report* report = exactly(size);
        delmesh_decimate_report_init(report, size);
        assert_status(delmesh_lod_family(context, in, targets, COUNT, old, out, NULL, report), context, DELMESH_OK);
        assert_int_equal(report->struct_size, size);
        if (size >= 24) assert_int_equal(report->faces_in, 96);
        free(report);
        assert_int_equal(info_of(out[2]).precision, DELMESH_FLOAT64);
        for (int i = 0; i < COUNT; ++i) delmesh_mesh_destroy(out[i]);
    }
    /* Reports of the levels lie as far apart as the caller's are long. */
    for (uint32_t size = 8; size <= sizeof(delmesh_level_report) + 8; size += 8) {
        unsigned char* levels = exactly(COUNT * (size_t)size);
        for (int i = 0; i < COUNT; ++i)
            delmesh_level_report_init((delmesh_level_report*)(void*)(levels + i * (size_t)size), size);
        assert_status(delmesh_lod_family(context, in, targets, COUNT, old, out, (delmesh_level_report*)(void*)levels, NULL),
                      context, DELMESH_OK);
        for (int i = 0; i < COUNT; ++i) {
            const delmesh_level_report* level = (const delmesh_level_report*)(const void*)(levels + i * (size_t)size);
            assert_int_equal(level->struct_size, size);
            assert_int_equal(level->certified, 1);
            if (size >= 32) assert_int_equal(level->faces, info_of(out[i]).faces);
            delmesh_mesh_destroy(out[i]);
        }
        /* One of another length: nobody knows where the next begins. */
        ((delmesh_level_report*)(void*)(levels + size))->struct_size = size + 8;
        assert_status(delmesh_lod_family(context, in, targets, COUNT, old, out, (delmesh_level_report*)(void*)levels, NULL),
                      context, DELMESH_ERROR_INVALID_ARGUMENT);
        assert_non_null(strstr(delmesh_last_error(context), "The struct_size of 'levels' 1 was "));
        free(levels);
    }
    delmesh_level_report level;
    delmesh_level_report_init(&level, sizeof level);
    level.struct_size = 3;
    assert_status(delmesh_decimate(context, in, targets, NULL, out, &level, NULL), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_non_null(strstr(delmesh_last_error(context), "The struct_size of 'level' 0 was 3"));
    free(old);
    struct {
        delmesh_decimate_options known;
        double unknown;
    } newer;
    delmesh_decimate_options_init(&newer.known, sizeof newer);
    assert_status(delmesh_decimate(context, in, targets, &newer.known, out, NULL, NULL), context, DELMESH_OK);
    delmesh_mesh_destroy(out[0]);
    newer.unknown = 1e-300;
    refuse(in, targets, COUNT, &newer.known, DELMESH_ERROR_UNSUPPORTED, "'options'");
    delmesh_mesh_destroy(in);
}

static void documented_errors(void** state) {
    (void)state;
    static const double line[9] = {0, 0, 0, 1, 1, 1, 2, 2, 2};
    static const int32_t triangle[3] = {0, 1, 2};
    const delmesh_target full = target(DELMESH_TARGET_FULL, 0);
    Shape shape = {(double*)(uintptr_t)line, (int32_t*)(uintptr_t)triangle, 3, 1};
    for (shape.faces = 0; shape.faces < 2; ++shape.faces) {
        delmesh_mesh* in = shape_mesh(context, &shape);
        refuse(in, &full, 1, NULL, DELMESH_ERROR_NO_SURFACE, "");
        delmesh_mesh_destroy(in);
    }
}

/* ---- Levels -------------------------------------------------------------------------------------------------------------- */

/* What holds for every level, whatever it was made of. */
static double squared_to_segment(const double* p, const double* a, const double* b) {
    double along = 0, whole = 0, squared = 0;
    for (int k = 0; k < 3; ++k) along += (p[k] - a[k]) * (b[k] - a[k]), whole += (b[k] - a[k]) * (b[k] - a[k]);
    const double t = whole > 0 ? fmin(1, fmax(0, along / whole)) : 0;
    for (int k = 0; k < 3; ++k) squared += (p[k] - a[k] - t * (b[k] - a[k])) * (p[k] - a[k] - t * (b[k] - a[k]));
    return squared;
}
static double squared_to_triangle(const double* p, const double* const x[3]) {
    double n[3], size = 0, height = 0, least = HUGE_VAL;
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        n[k] = (x[1][i] - x[0][i]) * (x[2][j] - x[0][j]) - (x[1][j] - x[0][j]) * (x[2][i] - x[0][i]);
        size += n[k] * n[k];
        least = fmin(least, squared_to_segment(p, x[k], x[i]));
    }
    for (int e = 0; e < 3; ++e) { /* on the inner side of every edge */
        double side = 0;
        for (int k = 0; k < 3; ++k) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            const double *const a = x[e], *const b = x[(e + 1) % 3];
            side += n[k] * ((b[i] - a[i]) * (p[j] - a[j]) - (b[j] - a[j]) * (p[i] - a[i]));
        }
        if (!(side > 0)) return least;
    }
    for (int k = 0; k < 3; ++k) height += n[k] * (p[k] - x[0][k]);
    return fmin(least, height * height / size);
}
/* The place that the map tells is the closest there is. */
static void assert_closest(const delmesh_mesh* in, const double* given, const double* p, const int32_t* map,
                           const double* weight) {
    const int64_t faces = info_of(in).faces;
    int32_t* corner = integers(in, DELMESH_CORNER_VERT, 3 * faces, 1);
    double here = 0, least = HUGE_VAL;
    for (int k = 0; k < 3; ++k) {
        double x = p[k];
        for (int i = 0; i < 3; ++i) x -= weight[i] * given[3 * map[i] + k];
        here += x * x;
    }
    for (int64_t f = 0; f < faces; ++f) {
        const double* const x[3] = {given + 3 * corner[3 * f], given + 3 * corner[3 * f + 1], given + 3 * corner[3 * f + 2]};
        least = fmin(least, squared_to_triangle(p, x));
    }
    if (!(sqrt(here) <= sqrt(least) + 1e-6)) fail_msg("%g away, the closest place is at %g", sqrt(here), sqrt(least));
    free(corner);
}

static void assert_level(const delmesh_mesh* in, const delmesh_mesh* level, const delmesh_level_report* report,
                         const delmesh_target* wanted) {
    const delmesh_mesh_info before = info_of(in), info = info_of(level);
    assert_status(delmesh_mesh_validate(context, level), context, DELMESH_OK);
    delmesh_certify_report certificate;
    delmesh_certify_report_init(&certificate, sizeof certificate);
    assert_status(delmesh_certify(context, level, NULL, &certificate), context, DELMESH_OK);
    assert_int_equal(certificate.delaunay, 1);
    assert_int_equal(report->certified, 1);
    assert_int_equal(report->vertices, info.vertices);
    assert_int_equal(report->faces, info.faces);
    assert_int_equal(info.isolated_vertices, 0);
    assert_int_equal(info.components, before.components);
    assert_int_equal(info.boundary_loops, before.boundary_loops);
    assert_int_equal(info.euler_characteristic, before.euler_characteristic);
    if (report->stopped_by == DELMESH_STOPPED_BY_TARGET) {
        if (wanted->kind == DELMESH_TARGET_VERTICES) assert_true((double)info.vertices <= wanted->value);
        if (wanted->kind == DELMESH_TARGET_FACES) assert_true((double)info.faces <= wanted->value);
        if (wanted->kind == DELMESH_TARGET_RATIO) assert_true((double)info.faces <= wanted->value * (double)before.faces);
    }
    /* Where vertices lie on the source: one of its vertices bit for bit, or weights that make a point. */
    int32_t* source = integers(level, DELMESH_VERT_SOURCE, info.vertices, 1);
    int32_t* map = integers(level, DELMESH_VERT_MAP_VERT, info.vertices, 3);
    int32_t* face = integers(level, DELMESH_FACE_SOURCE, info.faces, 1);
    double *at = doubles(level, DELMESH_POSITION), *given = doubles(in, DELMESH_POSITION);
    double* weight = doubles(level, DELMESH_VERT_MAP_WEIGHT);
    const int64_t source_verts = before.vertices - before.copied_vertices;
    for (int64_t v = 0; v < info.vertices; ++v) {
        assert_true(source[v] >= -1 && source[v] < source_verts);
        double sum = 0;
        for (int k = 0; k < 3; ++k) {
            assert_in_range(map[3 * v + k], 0, source_verts - 1);
            assert_true(weight[3 * v + k] >= 0 && weight[3 * v + k] <= 1);
            sum += weight[3 * v + k];
            const double x = source[v] < 0 ? 0 : given[3 * source[v] + k];
            if (source[v] >= 0) assert_true(at[3 * v + k] == (info.precision == DELMESH_FLOAT32 ? (double)(float)x : x));
        }
        assert_true(fabs(sum - 1) < 1e-12);
        if (source[v] >= 0)
            assert_true(map[3 * v] == source[v] && weight[3 * v] == 1);
        else if (v % 8 == 0)
            assert_closest(in, given, at + 3 * v, map + 3 * v, weight + 3 * v);
    }
    for (int64_t f = 0; f < info.faces; ++f) assert_in_range(face[f], 0, before.polygons - 1);
    free(source), free(map), free(face), free(at), free(given), free(weight);
}

/* Every vertex went into one of the next level, and something went into each of those. */
static void assert_parents(delmesh_mesh* const* levels, int count) {
    for (int i = 0; i < count; ++i) {
        const int64_t verts = info_of(levels[i]).vertices, above = info_of(levels[i + 1 < count ? i + 1 : i]).vertices;
        int32_t* parent = integers(levels[i], DELMESH_VERT_PARENT, verts, 1);
        delmesh_view lent;
        assert_status(delmesh_mesh_borrow(levels[i], DELMESH_VERT_PARENT, &lent), NULL, DELMESH_OK);
        assert_int_equal(lent.count, verts);
        assert_memory_equal(lent.data, parent, (size_t)verts * sizeof *parent);
        char* has_child = calloc((size_t)above, 1);
        for (int64_t v = 0; v < verts; ++v) {
            assert_in_range(parent[v], 0, above - 1);
            if (i + 1 == count) assert_int_equal(parent[v], v);
            has_child[parent[v]] = 1;
        }
        for (int64_t v = 0; v < above; ++v) assert_int_equal(has_child[v], 1);
        free(has_child), free(parent);
    }
}

enum { LEVELS = 5 };
typedef struct {
    delmesh_mesh* meshes[LEVELS];
    delmesh_level_report levels[LEVELS];
    delmesh_decimate_report report;
} Family;

static Family make_family(delmesh_context* with, const delmesh_mesh* in, const delmesh_target* targets,
                          const delmesh_decimate_options* options) {
    Family family;
    for (int i = 0; i < LEVELS; ++i) delmesh_level_report_init(&family.levels[i], sizeof family.levels[i]);
    delmesh_decimate_report_init(&family.report, sizeof family.report);
    assert_status(delmesh_lod_family(with, in, targets, LEVELS, options, family.meshes, family.levels, &family.report), with,
                  DELMESH_OK);
    return family;
}
static void free_family(Family* family) {
    for (int i = 0; i < LEVELS; ++i) delmesh_mesh_destroy(family->meshes[i]);
}

static void every_level_of_a_family(void** state) {
    (void)state;
    const delmesh_target closed[LEVELS] = {{DELMESH_TARGET_FULL, 0, 0},
                                           {DELMESH_TARGET_RATIO, 0, 0.75},
                                           {DELMESH_TARGET_VERTICES, 0, 200},
                                           {DELMESH_TARGET_FACES, 0, 200},
                                           {DELMESH_TARGET_VERTICES, 0, 0}};
    Shape shapes[2] = {torus_shape(24, 20), sheet_shape(22)};
    for (int which = 0; which < 6; ++which) {
        delmesh_mesh* in = shape_mesh(context, &shapes[which % 2]);
        const Snapshot before = take_snapshot(in);
        delmesh_decimate_options options = defaults();
        options.precision = which < 2 ? DELMESH_FLOAT32 : DELMESH_FLOAT64;
        options.collapse_placement = which / 2;
        options.prepare = which == 3 ? DELMESH_MODE_FEATURE : which == 4 ? DELMESH_MODE_PRESERVE : DELMESH_MODE_FLIP;
        options.quality = which == 1 ? 2 : 0;
        Family family = make_family(context, in, closed, &options);
        for (int i = 0; i < LEVELS; ++i) {
            assert_level(in, family.meshes[i], &family.levels[i], &closed[i]);
            if (i > 0) assert_true(family.levels[i].vertices <= family.levels[i - 1].vertices);
        }
        assert_parents(family.meshes, LEVELS);
        /* What cannot be is no error; what stopped it is said. */
        assert_int_equal(family.levels[0].stopped_by, DELMESH_STOPPED_BY_TARGET);
        /* On the rough sheet hardly an edge is no feature. */
        assert_int_equal(family.levels[1].stopped_by, which == 3 ? DELMESH_STOPPED_BY_FEATURES : DELMESH_STOPPED_BY_TARGET);
        assert_int_not_equal(family.levels[4].stopped_by, DELMESH_STOPPED_BY_TARGET);
        assert_in_range(family.levels[4].stopped_by, DELMESH_STOPPED_BY_TOPOLOGY, DELMESH_STOPPED_BY_FEATURES);
        const delmesh_decimate_report* report = &family.report;
        assert_int_equal(report->vertices_in, shapes[which % 2].verts);
        assert_int_equal(report->faces_in, shapes[which % 2].faces);
        assert_int_equal(report->collapses, family.levels[0].vertices - family.levels[4].vertices);
        assert_true(report->prepare_nld > 0 && report->prepare_flips + report->prepare_splits > 0 && report->peak_bytes > 0);
        assert_int_equal(report->topology_kept, 1);
        assert_int_equal(report->prepare_bound >= 0, options.prepare == DELMESH_MODE_PRESERVE);
        assert_true(report->seconds_prepare + report->seconds_decimate + report->seconds_relax + report->seconds_export <=
                    report->seconds_total);
        const Snapshot after = take_snapshot(in);
        assert_same_snapshot(before, after);
        free(before.bytes), free(after.bytes);
        free_family(&family);
        delmesh_mesh_destroy(in);
    }
    free_shape(&shapes[0]);
    free_shape(&shapes[1]);
}

/* The level of DELMESH_TARGET_FULL is what delmesh_remesh makes. */
static void the_full_level_is_the_remesh(void** state) {
    (void)state;
    Shape shape = sheet_shape(14);
    delmesh_mesh* in = shape_mesh(context, &shape);
    free_shape(&shape);
    const delmesh_target targets[] = {target(DELMESH_TARGET_FULL, 0), target(DELMESH_TARGET_RATIO, 0.3)};
    for (int32_t round = 0; round < 6; ++round) {
        const int32_t mode = DELMESH_MODE_PRESERVE + round % 3;
        delmesh_decimate_options options = defaults();
        options.prepare = mode;
        options.feature_angle = 40;
        options.map = round / 3;
        delmesh_remesh_options same;
        delmesh_remesh_options_init(&same, sizeof same);
        same.mode = mode;
        same.feature_angle = 40;
        same.compact = 1;
        same.map = options.map;
        delmesh_mesh *level = NULL, *remeshed = NULL, *family[2] = {NULL, NULL};
        delmesh_decimate_report report;
        delmesh_decimate_report_init(&report, sizeof report);
        assert_status(delmesh_decimate(context, in, targets, &options, &level, NULL, &report), context, DELMESH_OK);
        assert_status(delmesh_remesh(context, in, &same, &remeshed, NULL), context, DELMESH_OK);
        assert_int_equal(report.collapses, 0);
        Snapshot a = take_snapshot(level), b = take_snapshot(remeshed);
        assert_same_snapshot(a, b);
        free(a.bytes), free(b.bytes);
        /* And so it is where there are levels after it, but for what its vertices went into. */
        assert_status(delmesh_lod_family(context, in, targets, 2, &options, family, NULL, NULL), context, DELMESH_OK);
        assert_parents(family, 2);
        const int64_t verts = info_of(level).vertices, edges = info_of(level).edges;
        double *p = doubles(level, DELMESH_VERT_MAP_WEIGHT), *q = doubles(family[0], DELMESH_VERT_MAP_WEIGHT);
        assert_memory_equal(p, q, (size_t)verts * 3 * sizeof *p);
        free(p), free(q);
        static const int32_t arrays[] = {DELMESH_CORNER_VERT, DELMESH_VERT_SOURCE, DELMESH_FACE_SOURCE, DELMESH_EDGE_FLAGS,
                                         DELMESH_EDGE_SOURCE_EDGE};
        for (int i = 0; i < 4 + options.map; ++i) {
            const int64_t faces = info_of(level).faces, counts[] = {3 * faces, verts, faces, edges, edges};
            int32_t *x = integers(level, arrays[i], counts[i], 1), *y = integers(family[0], arrays[i], counts[i], 1);
            assert_memory_equal(x, y, (size_t)counts[i] * sizeof *x);
            free(x), free(y);
        }
        delmesh_mesh_destroy(level);
        delmesh_mesh_destroy(remeshed);
        delmesh_mesh_destroy(family[0]);
        delmesh_mesh_destroy(family[1]);
    }
    delmesh_mesh_destroy(in);
}

static void one_target_is_a_family_of_one(void** state) {
    (void)state;
    delmesh_mesh *in = torus(20, 16), *one = NULL, *family = NULL;
    const delmesh_target few = target(DELMESH_TARGET_VERTICES, 90);
    assert_status(delmesh_decimate(context, in, &few, NULL, &one, NULL, NULL), context, DELMESH_OK);
    assert_status(delmesh_lod_family(context, in, &few, 1, NULL, &family, NULL, NULL), context, DELMESH_OK);
    assert_int_equal(info_of(one).vertices, 90);
    const Snapshot a = take_snapshot(one), b = take_snapshot(family);
    assert_same_snapshot(a, b);
    free(a.bytes), free(b.bytes);
    delmesh_mesh_destroy(one);
    delmesh_mesh_destroy(family);
    delmesh_mesh_destroy(in);
}

/* A level that its predecessor satisfies already is that once more. */
static void a_level_may_repeat(void** state) {
    (void)state;
    const delmesh_target targets[LEVELS] = {{DELMESH_TARGET_VERTICES, 0, 100},
                                            {DELMESH_TARGET_VERTICES, 0, 100},
                                            {DELMESH_TARGET_FACES, 0, 1e9},
                                            {DELMESH_TARGET_VERTICES, 0, 60},
                                            {DELMESH_TARGET_RATIO, 0, 1}};
    delmesh_mesh* in = torus(20, 16);
    Family family = make_family(context, in, targets, NULL);
    for (int i = 0; i < LEVELS; ++i) {
        assert_int_equal(family.levels[i].vertices, i < 3 ? 100 : 60);
        assert_int_equal(family.levels[i].stopped_by, DELMESH_STOPPED_BY_TARGET);
    }
    assert_parents(family.meshes, LEVELS);
    free_family(&family);
    delmesh_mesh_destroy(in);
}

static void locked_vertices_stay(void** state) {
    (void)state;
    Shape shapes[2] = {torus_shape(18, 14), sheet_shape(15)};
    const delmesh_target targets[LEVELS] = {{DELMESH_TARGET_FULL, 0, 0},
                                            {DELMESH_TARGET_RATIO, 0, 0.5},
                                            {DELMESH_TARGET_RATIO, 0, 0.25},
                                            {DELMESH_TARGET_VERTICES, 0, 30},
                                            {DELMESH_TARGET_VERTICES, 0, 0}};
    for (int which = 0; which < 2; ++which) {
        const Shape* shape = &shapes[which];
        delmesh_mesh* in = shape_mesh(context, shape);
        int32_t* locked = calloc((size_t)shape->verts, sizeof *locked);
        for (int32_t v = 3; v < shape->verts; v += 11) locked[v] = -1;
        delmesh_decimate_options options = defaults();
        options.locked_verts = (delmesh_view){locked, shape->verts, 0, DELMESH_INT32, 1};
        options.quality = 3;
        Family family = make_family(context, in, targets, &options);
        for (int i = 0; i < LEVELS; ++i) {
            assert_level(in, family.meshes[i], &family.levels[i], &targets[i]); /* also compares what source vertices there are */
            const int64_t verts = family.levels[i].vertices;
            int32_t* source = integers(family.meshes[i], DELMESH_VERT_SOURCE, verts, 1);
            int32_t* here = calloc((size_t)shape->verts, sizeof *here);
            for (int64_t v = 0; v < verts; ++v)
                if (source[v] >= 0) here[source[v]] += 1;
            for (int32_t v = 0; v < shape->verts; ++v)
                if (locked[v]) assert_int_equal(here[v], 1);
            free(source), free(here);
        }
        assert_int_not_equal(family.levels[4].stopped_by, DELMESH_STOPPED_BY_TARGET);
        free_family(&family);
        free(locked);
        delmesh_mesh_destroy(in);
    }
    free_shape(&shapes[0]);
    free_shape(&shapes[1]);
}

/* Outside of the mask every face is there, at the same coordinates, in the same order of corners. */
static void outside_of_the_mask_nothing_changes(void** state) {
    (void)state;
    Shape shape = sheet_shape(16);
    delmesh_mesh *in = shape_mesh(context, &shape), *level = NULL;
    uint8_t* mask = malloc((size_t)shape.faces);
    int64_t outside = 0;
    for (int32_t f = 0; f < shape.faces; ++f) outside += !(mask[f] = f >= shape.faces / 2);
    delmesh_decimate_options options = defaults();
    options.face_mask = (delmesh_view){mask, shape.faces, 0, DELMESH_UINT8, 1};
    options.quality = 2;
    const delmesh_target few = target(DELMESH_TARGET_RATIO, 0.7);
    delmesh_level_report report;
    delmesh_level_report_init(&report, sizeof report);
    assert_status(delmesh_decimate(context, in, &few, &options, &level, &report, NULL), context, DELMESH_OK);
    assert_status(delmesh_mesh_validate(context, level), context, DELMESH_OK);
    assert_int_equal(report.certified, 1);
    assert_int_equal(report.stopped_by, DELMESH_STOPPED_BY_TARGET);
    int32_t* corners = integers(level, DELMESH_CORNER_VERT, report.faces, 3);
    int32_t* source = integers(level, DELMESH_VERT_SOURCE, report.vertices, 1);
    char* found = calloc((size_t)shape.faces, 1);
    for (int64_t f = 0; f < report.faces; ++f) {
        int32_t s[3];
        for (int k = 0; k < 3; ++k) s[k] = source[corners[3 * f + k]];
        for (int32_t g = 0; g < shape.faces; ++g)
            for (int turn = 0; turn < 3; ++turn)
                if (s[turn] == shape.corners[3 * g] && s[(turn + 1) % 3] == shape.corners[3 * g + 1] &&
                    s[(turn + 2) % 3] == shape.corners[3 * g + 2])
                    found[g] = 1;
    }
    for (int32_t f = 0; f < shape.faces; ++f)
        if (!mask[f]) assert_int_equal(found[f], 1);
    /* What is NLD is outside, and is counted. */
    delmesh_certify_report certificate;
    delmesh_certify_report_init(&certificate, sizeof certificate);
    assert_status(delmesh_certify(context, level, NULL, &certificate), context, DELMESH_OK);
    assert_int_equal(certificate.nld_interior + certificate.nld_boundary, report.nld_outside);
    assert_true(report.nld_outside > 0 && report.nld_outside < 3 * outside);
    free(corners), free(source), free(found), free(mask);
    delmesh_mesh_destroy(level);
    delmesh_mesh_destroy(in);
    free_shape(&shape);
}

/* A sphere-like speck far from a torus: it goes when it may, and stays when it may not. */
static void pruning(void** state) {
    (void)state;
    Shape shape = torus_shape(16, 12);
    const int32_t v = shape.verts, f = shape.faces;
    shape.positions = realloc(shape.positions, (size_t)(v + 4) * 3 * sizeof(double));
    shape.corners = realloc(shape.corners, (size_t)(f + 4) * 3 * sizeof(int32_t));
    static const double speck[12] = {0, 0, 5, 0.01, 0, 5, 0, 0.01, 5, 0, 0, 5.01};
    static const int32_t sides[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    memcpy(shape.positions + 3 * v, speck, sizeof speck);
    for (int i = 0; i < 12; ++i) shape.corners[3 * f + i] = v + sides[i];
    shape.verts += 4, shape.faces += 4;
    delmesh_mesh* in = shape_mesh(context, &shape);
    assert_int_equal(info_of(in).components, 2);
    for (int pruned = 0; pruned < 2; ++pruned) {
        delmesh_decimate_options options = defaults();
        options.prune = pruned ? 0.05 : 0.01;
        const delmesh_target few = target(DELMESH_TARGET_FACES, 100);
        delmesh_level_report report;
        delmesh_level_report_init(&report, sizeof report);
        delmesh_mesh* level = NULL;
        assert_status(delmesh_decimate(context, in, &few, &options, &level, &report, NULL), context, DELMESH_OK);
        assert_int_equal(info_of(level).components, 2 - pruned);
        assert_int_equal(report.pruned_components, pruned);
        assert_true(report.faces <= 100 && report.certified == 1);
        delmesh_mesh_destroy(level);
    }
    /* What went away has no parent, and a level with such vertices is a valid mesh. */
    delmesh_decimate_options options = defaults();
    options.prune = 0.05;
    const delmesh_target targets[2] = {target(DELMESH_TARGET_FULL, 0), target(DELMESH_TARGET_FACES, 100)};
    delmesh_mesh* levels[2] = {NULL, NULL};
    assert_status(delmesh_lod_family(context, in, targets, 2, &options, levels, NULL, NULL), context, DELMESH_OK);
    const int64_t count = info_of(levels[0]).vertices;
    int32_t* parents = malloc((size_t)count * sizeof *parents);
    const delmesh_view_mut view = {parents, count, 0, DELMESH_INT32, 1};
    assert_int_equal(delmesh_mesh_read(levels[0], DELMESH_VERT_PARENT, &view), DELMESH_OK);
    int orphans = 0;
    for (int64_t i = 0; i < count; ++i) orphans += parents[i] == -1;
    assert_int_equal(orphans, 4);
    free(parents);
    for (int i = 0; i < 2; ++i) {
        assert_status(delmesh_mesh_validate(context, levels[i]), context, DELMESH_OK);
        delmesh_mesh_destroy(levels[i]);
    }
    /* Not what is locked. */
    uint8_t* locks = calloc((size_t)shape.verts, 1);
    locks[v + 2] = 1;
    options.locked_verts = (delmesh_view){locks, shape.verts, 0, DELMESH_UINT8, 1};
    assert_status(delmesh_decimate(context, in, &targets[1], &options, levels, NULL, NULL), context, DELMESH_OK);
    assert_int_equal(info_of(levels[0]).components, 2);
    delmesh_mesh_destroy(levels[0]);
    free(locks);
    delmesh_mesh_destroy(in);
    free_shape(&shape);
}

/* DELMESH_COLLAPSE_ENDPOINTS: every vertex has the place of one of the source's, under a distance too. */
static void ends_only(void** state) {
    (void)state;
    delmesh_mesh* in = torus(30, 24);
    delmesh_decimate_options options = defaults();
    options.collapse_placement = DELMESH_COLLAPSE_ENDPOINTS;
    const delmesh_target targets[2] = {target(DELMESH_TARGET_RATIO, 0.3), target(DELMESH_TARGET_DEVIATION, 0.05)};
    for (int t = 0; t < 2; ++t) {
        delmesh_mesh* level = NULL;
        assert_status(delmesh_decimate(context, in, &targets[t], &options, &level, NULL, NULL), context, DELMESH_OK);
        const int64_t count = info_of(level).vertices;
        int32_t* sources = malloc((size_t)count * sizeof *sources);
        const delmesh_view_mut view = {sources, count, 0, DELMESH_INT32, 1};
        assert_int_equal(delmesh_mesh_read(level, DELMESH_VERT_SOURCE, &view), DELMESH_OK);
        for (int64_t i = 0; i < count; ++i) assert_true(sources[i] >= 0);
        free(sources);
        delmesh_mesh_destroy(level);
    }
    delmesh_mesh_destroy(in);
}

/* The two-sided distance to the input, as measured, is within the target, and the level is smaller for a larger one. */
static void deviations_are_kept(void** state) {
    (void)state;
    delmesh_mesh* in = torus(30, 24);
    const delmesh_target targets[LEVELS] = {{DELMESH_TARGET_DEVIATION, 0, 1e-9},
                                            {DELMESH_TARGET_DEVIATION, 0, 0.02},
                                            {DELMESH_TARGET_DEVIATION, 0, 0.05},
                                            {DELMESH_TARGET_DEVIATION, 0, 0.1},
                                            {DELMESH_TARGET_DEVIATION, 0, 0.3}};
    Family family = make_family(context, in, targets, NULL);
    delmesh_distance_options options;
    delmesh_distance_options_init(&options, sizeof options);
    options.compute_bound = 0;
    for (int i = 0; i < LEVELS; ++i) {
        assert_level(in, family.meshes[i], &family.levels[i], &targets[i]);
        delmesh_distance_report distance;
        delmesh_distance_report_init(&distance, sizeof distance);
        assert_status(delmesh_measure_distance(context, in, family.meshes[i], &options, &distance), context, DELMESH_OK);
        assert_true(family.levels[i].bound >= 0 && distance.hausdorff_sampled <= family.levels[i].bound * 1.000001);
        if (family.levels[i].vertices < family.levels[0].vertices) assert_true(family.levels[i].bound <= targets[i].value);
        if (i > 1) assert_true(family.levels[i].vertices < family.levels[i - 1].vertices);
    }
    /* Nothing fits in a billionth: making the mesh Delaunay took more. */
    assert_int_equal(family.levels[0].stopped_by, DELMESH_STOPPED_BY_BOUND);
    /* Relaxation keeps the distance as well, and does something: only those vertices stay that would exceed it. */
    delmesh_decimate_options relaxing = defaults();
    relaxing.quality = 4;
    Family relaxed = make_family(context, in, targets, &relaxing);
    for (int i = 1; i < LEVELS; ++i) {
        assert_level(in, relaxed.meshes[i], &relaxed.levels[i], &targets[i]);
        assert_int_equal(relaxed.levels[i].vertices, family.levels[i].vertices);
        assert_true(relaxed.levels[i].bound <= targets[i].value);
        assert_true(2 * relaxed.levels[i].relaxed_vertices > relaxed.levels[i].vertices);
        double rms[2];
        for (int which = 0; which < 2; ++which) {
            delmesh_distance_report distance;
            delmesh_distance_report_init(&distance, sizeof distance);
            const delmesh_mesh* const level = which == 0 ? family.meshes[i] : relaxed.meshes[i];
            assert_status(delmesh_measure_distance(context, in, level, &options, &distance), context, DELMESH_OK);
            assert_true(distance.hausdorff_sampled <= targets[i].value * 1.000001);
            rms[which] = distance.rms;
        }
        assert_true(rms[1] < rms[0]);
    }
    free_family(&relaxed);
    free_family(&family);
    delmesh_mesh_destroy(in);
}

static void weights_move_detail(void** state) {
    (void)state;
    Shape shape = torus_shape(40, 24);
    delmesh_mesh *in = shape_mesh(context, &shape), *level = NULL;
    double* weights = malloc((size_t)shape.verts * sizeof *weights);
    for (int32_t v = 0; v < shape.verts; ++v) weights[v] = shape.positions[3 * v] > 0 ? 100 : 1;
    delmesh_decimate_options options = defaults();
    options.vert_weights = (delmesh_view){weights, shape.verts, 0, DELMESH_FLOAT64, 1};
    const delmesh_target few = target(DELMESH_TARGET_VERTICES, 200);
    int64_t right[2];
    for (int weighted = 0; weighted < 2; ++weighted) {
        assert_status(delmesh_decimate(context, in, &few, weighted ? &options : NULL, &level, NULL, NULL), context, DELMESH_OK);
        double* at = doubles(level, DELMESH_POSITION);
        right[weighted] = 0;
        for (int64_t v = 0; v < 200; ++v) right[weighted] += at[3 * v] > 0;
        free(at);
        delmesh_mesh_destroy(level);
    }
    assert_true(right[0] > 60 && right[0] < 140);
    assert_true(right[1] > right[0] + 20);
    free(weights);
    delmesh_mesh_destroy(in);
    free_shape(&shape);
}

static void threads_change_nothing(void** state) {
    (void)state;
    Shape shape = torus_shape(70, 50);
    const delmesh_target targets[LEVELS] = {{DELMESH_TARGET_FULL, 0, 0},
                                            {DELMESH_TARGET_RATIO, 0, 0.5},
                                            {DELMESH_TARGET_RATIO, 0, 0.1},
                                            {DELMESH_TARGET_VERTICES, 0, 100},
                                            {DELMESH_TARGET_DEVIATION, 0, 0.5}};
    delmesh_decimate_options options = defaults();
    options.quality = 2;
    Snapshot first[LEVELS];
    for (int32_t threads = 1; threads <= 4; ++threads) {
        delmesh_context_options how;
        delmesh_context_options_init(&how, sizeof how);
        how.max_threads = threads == 4 ? 1 : threads; /* the last is a second run */
        delmesh_context* with = NULL;
        assert_status(delmesh_context_create(&how, &with), NULL, DELMESH_OK);
        delmesh_mesh* in = shape_mesh(with, &shape);
        Family family = make_family(with, in, targets, &options);
        for (int i = 0; i < LEVELS; ++i) {
            const Snapshot now = take_snapshot(family.meshes[i]);
            if (threads > 1) {
                assert_same_snapshot(first[i], now);
                free(now.bytes);
            } else {
                first[i] = now;
            }
        }
        free_family(&family);
        delmesh_mesh_destroy(in);
        delmesh_context_destroy(with);
    }
    for (int i = 0; i < LEVELS; ++i) free(first[i].bytes);
    free_shape(&shape);
}

/* Non-manifold input, cut at import: its sheets stay together, and what the import copied counts as what it copies. */
static void cut_sheets(void** state) {
    (void)state;
    Shape book = book_shape();
    delmesh_mesh* in = shape_mesh(context, &book);
    const delmesh_target targets[LEVELS] = {{DELMESH_TARGET_FULL, 0, 0},
                                            {DELMESH_TARGET_VERTICES, 0, 20},
                                            {DELMESH_TARGET_VERTICES, 0, 14},
                                            {DELMESH_TARGET_VERTICES, 0, 8},
                                            {DELMESH_TARGET_VERTICES, 0, 0}};
    Family family = make_family(context, in, targets, NULL);
    for (int i = 0; i < LEVELS; ++i) assert_level(in, family.meshes[i], &family.levels[i], &targets[i]);
    assert_parents(family.meshes, LEVELS);
    free_family(&family);
    delmesh_mesh_destroy(in);
    free_shape(&book);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(defaults_are_documented),
        cmocka_unit_test(bad_options),
        cmocka_unit_test(bad_targets),
        cmocka_unit_test(bad_views),
        cmocka_unit_test(options_and_reports_of_every_age),
        cmocka_unit_test(documented_errors),
        cmocka_unit_test(every_level_of_a_family),
        cmocka_unit_test(the_full_level_is_the_remesh),
        cmocka_unit_test(one_target_is_a_family_of_one),
        cmocka_unit_test(a_level_may_repeat),
        cmocka_unit_test(locked_vertices_stay),
        cmocka_unit_test(outside_of_the_mask_nothing_changes),
        cmocka_unit_test(pruning),
        cmocka_unit_test(ends_only),
        cmocka_unit_test(deviations_are_kept),
        cmocka_unit_test(weights_move_detail),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(cut_sheets),
    };
    return cmocka_run_group_tests_name("decimate", tests, set_up, tear_down);
}
