/* SPDX-License-Identifier: Apache-2.0
 * Remesh, certify and measure: exact answers on small shapes, every option and report of every age, every documented error. */
#include "support.h"

#include <math.h>

HOST_FIXTURE(1)

static delmesh_mesh* make(const double* positions, int64_t verts, const int32_t* corners, int64_t faces) {
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){positions, verts, 0, DELMESH_FLOAT64, 3};
    desc.corner_verts = (delmesh_view){corners, faces, 0, DELMESH_INT32, 3};
    delmesh_mesh* mesh = NULL;
    assert_status(delmesh_mesh_create(context, &desc, &mesh), context, DELMESH_OK);
    return mesh;
}

static delmesh_remesh_options defaults(void) {
    delmesh_remesh_options options;
    memset(&options, 0xff, sizeof options);
    delmesh_remesh_options_init(&options, sizeof options);
    return options;
}

/* A flat kite cut along its long diagonal 0 1, which is its one NLD edge. */
static const double kite_positions[12] = {-2, 0, 0, 2, 0, 0, 0, 1, 0, 0, -1, 0};
static const int32_t kite_corners[6] = {0, 1, 2, 1, 0, 3};
static delmesh_mesh* kite(void) { return make(kite_positions, 4, kite_corners, 2); }

/* ---- Remesh -------------------------------------------------------------------------------------------------------------- */

static void defaults_are_documented(void** state) {
    (void)state;
    const delmesh_remesh_options options = defaults();
    assert_int_equal(options.struct_size, sizeof options);
    assert_int_equal(options.mode, DELMESH_MODE_PRESERVE);
    assert_int_equal(options.placement, DELMESH_PLACEMENT_INTERVAL);
    assert_int_equal(options.boundary, DELMESH_BOUNDARY_NONOBTUSE);
    assert_int_equal(options.precision, DELMESH_FLOAT32);
    assert_int_equal(options.strict | options.compact, 0);
    assert_true(options.feature_angle == 30 && options.max_normal_turn < 0 && options.shell_unit <= 0 && options.tolerance < 0);
    assert_int_equal(options.max_vertices | options.split_budget, 0);
    delmesh_distance_options distance;
    delmesh_distance_options_init(&distance, sizeof distance);
    assert_true(distance.compute_bound == 1 && distance.samples == 0);
    assert_true(distance.relative_error == 0.1 && distance.absolute_error == 1e-4);
    delmesh_certify_options certify;
    delmesh_certify_options_init(&certify, sizeof certify);
    assert_int_equal(certify.boundary, DELMESH_BOUNDARY_NONOBTUSE);
    assert_null(certify.nld_edges.data);
}

static void a_kite_is_flipped_once(void** state) {
    (void)state;
    delmesh_mesh *in = kite(), *out = NULL;
    delmesh_remesh_options options = defaults();
    delmesh_remesh_report report;
    delmesh_remesh_report_init(&report, sizeof report);
    options.mode = DELMESH_MODE_FLIP;
    options.boundary = DELMESH_BOUNDARY_IGNORE;
    assert_status(delmesh_remesh(context, in, &options, &out, &report), context, DELMESH_OK);
    assert_int_equal(report.certified, 1);
    assert_int_equal(report.vertices_in, 4);
    assert_int_equal(report.vertices_out, 4);
    assert_int_equal(report.faces_in, 2);
    assert_int_equal(report.faces_out, 2);
    assert_int_equal(report.nld_in, 1);
    assert_int_equal(report.nld_out, 0);
    assert_int_equal(report.flips, 1);
    assert_int_equal(report.flips_after | report.splits | report.unflippable | report.guarded, 0);
    assert_true(report.peak_bytes > 0);
    assert_true(report.seconds_total > 0 && report.seconds_total < 60);
    int32_t edges[5][2], inner = 0;
    const delmesh_view_mut dst = {edges, 5, 0, DELMESH_INT32, 2};
    assert_status(delmesh_mesh_read(out, DELMESH_EDGE_VERT, &dst), NULL, DELMESH_OK);
    for (int e = 0; e < 5; ++e) inner += edges[e][0] + edges[e][1] == 5 && edges[e][0] * edges[e][1] == 6;
    assert_int_equal(inner, 1); /* 2 3 is the new diagonal */
    assert_status(delmesh_mesh_validate(context, out), context, DELMESH_OK);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
}

/* The defaults: input vertices first, bit for bit at float32; split vertices on the surface by their map. */
static void preserve_keeps_vertices_and_maps_the_new(void** state) {
    (void)state;
    Shape shape = sheet_shape(9);
    delmesh_mesh *in = shape_mesh(context, &shape), *out = NULL;
    assert_status(delmesh_remesh(context, in, NULL, &out, NULL), context, DELMESH_OK);
    const int64_t before = shape.verts, after = info_of(out).vertices;
    assert_true(after > before);
    float* p = malloc((size_t)after * 12);
    int32_t(*map)[3] = malloc((size_t)after * 12);
    double(*weight)[3] = malloc((size_t)after * 24);
    int32_t* source = malloc((size_t)after * 4);
    const delmesh_view_mut views[] = {{p, after, 0, DELMESH_FLOAT32, 3}, {map, after, 0, DELMESH_INT32, 3},
                                      {weight, after, 0, DELMESH_FLOAT64, 3}, {source, after, 0, DELMESH_INT32, 1}};
    assert_status(delmesh_mesh_read(out, DELMESH_POSITION, &views[0]), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_read(out, DELMESH_VERT_MAP_VERT, &views[1]), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_read(out, DELMESH_VERT_MAP_WEIGHT, &views[2]), NULL, DELMESH_OK);
    assert_status(delmesh_mesh_read(out, DELMESH_VERT_SOURCE, &views[3]), NULL, DELMESH_OK);
    for (int64_t v = 0; v < after; ++v) {
        assert_int_equal(source[v], v < before ? v : -1);
        assert_float_equal((float)(weight[v][0] + weight[v][1] + weight[v][2]), 1.0f, 1e-6f);
        for (int k = 0; k < 3; ++k) {
            double on_source = 0;
            for (int i = 0; i < 3; ++i) {
                assert_in_range(map[v][i], 0, before - 1);
                on_source += weight[v][i] * shape.positions[3 * map[v][i] + k];
            }
            if (v < before) assert_true(p[3 * v + k] == (float)shape.positions[3 * v + k]);
            else assert_true(fabs(p[3 * v + k] - on_source) < 4e-6);
        }
    }
    free(p), free(map), free(weight), free(source);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
    free_shape(&shape);
}

static void refuse(const delmesh_mesh* in, const delmesh_remesh_options* options, int32_t expected, const char* named) {
    delmesh_mesh* out = (delmesh_mesh*)(uintptr_t)1;
    delmesh_remesh_report report;
    memset(&report, 0xff, sizeof report);
    delmesh_remesh_report_init(&report, sizeof report);
    report.certified = 1;
    assert_status(delmesh_remesh(context, in, options, &out, &report), context, expected);
    assert_null(out);
    assert_int_equal(report.certified, 0); /* written also after errors */
    assert_int_equal(report.struct_size, sizeof report);
    assert_true(report.seconds_total >= 0 && report.peak_bytes > 0);
    if (strstr(delmesh_last_error(context), named) == NULL) fail_msg("'%s' is not in: %s", named, delmesh_last_error(context));
}

static void bad_remesh_options(void** state) {
    (void)state;
    delmesh_mesh* in = kite();
    delmesh_mesh* out = NULL;
    delmesh_remesh_options options;
#define BAD(field, value, named) \
    do {                         \
        options = defaults();    \
        options.field = value;   \
        refuse(in, &options, DELMESH_ERROR_INVALID_ARGUMENT, "'" #field "' was " named); \
    } while (0)
    BAD(mode, -1, "-1");
    BAD(mode, 3, "3");
    BAD(placement, 2, "2");
    BAD(boundary, 2, "2");
    BAD(precision, 0, "0");
    BAD(precision, DELMESH_INT32, "3");
    BAD(strict, 2, "2");
    BAD(compact, -1, "-1");
    BAD(effort, -1, "-1");
    BAD(feature_angle, -0.5, "-0.5");
    BAD(feature_angle, 180.25, "180.25");
    BAD(feature_angle, NAN, "nan");
    BAD(max_normal_turn, 181, "181");
    BAD(max_normal_turn, INFINITY, "inf");
    BAD(max_normal_turn, -INFINITY, "-inf");
    BAD(shell_unit, NAN, "nan");
    BAD(tolerance, INFINITY, "inf");
    BAD(max_vertices, -1, "-1");
    BAD(split_budget, INT64_MIN, "-9223372036854775808");
#undef BAD
    refuse(NULL, NULL, DELMESH_ERROR_INVALID_ARGUMENT, "'in' was NULL");
    assert_status(delmesh_remesh(context, in, NULL, NULL, NULL), context, DELMESH_ERROR_INVALID_ARGUMENT);
    delmesh_remesh_report report;
    delmesh_remesh_report_init(&report, sizeof report);
    report.struct_size = 3;
    assert_status(delmesh_remesh(context, in, NULL, &out, &report), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_null(out);
    delmesh_mesh_destroy(in);
}

static void options_and_reports_of_every_age(void** state) {
    (void)state;
    delmesh_mesh *in = kite(), *out = NULL;
    /* Older: up to and including `boundary`. What is missing has its default. */
    delmesh_remesh_options* old = exactly(16);
    delmesh_remesh_options_init(old, 16);
    old->mode = DELMESH_MODE_FLIP;
    old->boundary = DELMESH_BOUNDARY_IGNORE;
    for (uint32_t size = 8; size <= sizeof(delmesh_remesh_report); size += 8) {
        delmesh_remesh_report* report = exactly(size);
        delmesh_remesh_report_init(report, size);
        assert_status(delmesh_remesh(context, in, old, &out, report), context, DELMESH_OK);
        assert_int_equal(report->struct_size, size);
        assert_int_equal(report->certified, 1);
        if (size >= 16) assert_int_equal(report->vertices_in, 4);
        if (size >= 64) assert_int_equal(report->flips, 1);
        free(report);
        assert_int_equal(info_of(out).precision, DELMESH_FLOAT32);
        delmesh_mesh_destroy(out);
    }
    free(old);
    struct {
        delmesh_remesh_options known;
        double unknown;
    } newer;
    struct {
        delmesh_remesh_report known;
        double unknown;
    } newer_report;
    delmesh_remesh_options_init(&newer.known, sizeof newer);
    delmesh_remesh_report_init(&newer_report.known, sizeof newer_report);
    assert_true(newer.unknown == 0 && newer_report.unknown == 0);
    assert_status(delmesh_remesh(context, in, &newer.known, &out, &newer_report.known), context, DELMESH_OK);
    assert_int_equal(newer_report.known.certified, 1);
    assert_int_equal(newer_report.known.struct_size, sizeof newer_report);
    assert_true(newer_report.unknown == 0);
    delmesh_mesh_destroy(out);
    newer.unknown = 1e-300;
    refuse(in, &newer.known, DELMESH_ERROR_UNSUPPORTED, "'options'");
    delmesh_mesh_destroy(in);
}

static void documented_errors_of_remesh(void** state) {
    (void)state;
    delmesh_remesh_options options = defaults();
    static const int32_t triangle[3] = {0, 1, 2};
    static const double line[9] = {0, 0, 0, 1, 1, 1, 2, 2, 2};
    delmesh_mesh* in = make(line, 3, triangle, 1);
    refuse(in, &options, DELMESH_ERROR_NO_SURFACE, "");
    delmesh_mesh_destroy(in);
    in = make(line, 3, triangle, 0);
    refuse(in, &options, DELMESH_ERROR_NO_SURFACE, "");
    delmesh_mesh_destroy(in);

    static const double needle[12] = {0, 0, 0, 2, 0, 0, 1, 0, 0, 1, 1, 0}; /* 0 1 2 has no area, 1 0 3 has */
    static const int32_t folded[6] = {1, 0, 2, 0, 1, 3};
    in = make(needle, 4, folded, 2);
    options.strict = 1;
    refuse(in, &options, DELMESH_ERROR_STRICT, "");
    delmesh_mesh_destroy(in);
    options.strict = 0;

    static const double far[9] = {0, 0, 0, 1e300, 0, 0, 0, 1e300, 0};
    in = make(far, 3, triangle, 1);
    refuse(in, &options, DELMESH_ERROR_PRECISION, "");
    delmesh_mesh_destroy(in);

    Shape shape = sheet_shape(12);
    in = shape_mesh(context, &shape);
    options.max_vertices = shape.verts + 3;
    refuse(in, &options, DELMESH_ERROR_VERTEX_LIMIT, "");
    delmesh_mesh_destroy(in);
    free_shape(&shape);
}

/* ---- Memory --------------------------------------------------------------------------------------------------------------- */

/* A sheet of nearly equilateral triangles, each vertex moved by up to `noise` of an edge, in space. */
static Shape rough_sheet(int32_t side, double noise) {
    Shape shape = sheet_shape(side);
    uint64_t state = 1;
    for (int32_t i = 0; i < shape.verts; ++i) {
        double* p = shape.positions + 3 * (ptrdiff_t)i;
        p[0] = i % side - 0.5 * (i / side), p[1] = 0.875 * (i / side), p[2] = 0;
        for (int k = 0; k < 3; ++k) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            p[k] += noise * ((double)(state >> 40) / (1 << 23) - 1);
        }
    }
    return shape;
}

/* What the context holds at most during create and remesh, per triangle of the input; both meshes are a part of it. The limits are
 * what was measured and a twelfth. Memory is as deterministic as everything else, but for one log of trials per thread. */
static void memory_per_triangle_stays_low(void** state) {
    (void)state;
    static const struct {
        int32_t mode;
        double tolerance;
        int32_t precision, most;
    } runs[] = {
        {DELMESH_MODE_FLIP, -1, DELMESH_FLOAT32, 125},
        {DELMESH_MODE_PRESERVE, -1, DELMESH_FLOAT32, 165},
        {DELMESH_MODE_PRESERVE, 0, DELMESH_FLOAT32, 165},
        {DELMESH_MODE_PRESERVE, -1, DELMESH_FLOAT64, 165},
    };
    Shape shape = rough_sheet(300, 0.42);
    for (size_t i = 0; i < sizeof runs / sizeof *runs; ++i) {
        Host own_host;
        delmesh_context* own = host_context(&own_host, 2);
        delmesh_mesh *in = shape_mesh(own, &shape), *out = NULL;
        delmesh_remesh_options options = defaults();
        options.mode = runs[i].mode;
        options.tolerance = runs[i].tolerance;
        options.precision = runs[i].precision;
        delmesh_remesh_report report;
        delmesh_remesh_report_init(&report, sizeof report);
        assert_status(delmesh_remesh(own, in, &options, &out, &report), own, DELMESH_OK);
        assert_true(report.nld_in > shape.faces / 12 && report.nld_in < shape.faces / 8);
        if (runs[i].mode == DELMESH_MODE_PRESERVE) assert_true(report.splits > shape.faces / 10);
        uint64_t peak;
        delmesh_context_memory(own, NULL, &peak, NULL);
        assert_in_range(peak, 1, (uint64_t)runs[i].most * (uint64_t)shape.faces);
        delmesh_mesh_destroy(out);
        delmesh_mesh_destroy(in);
        delmesh_context_destroy(own);
        assert_nothing_left(&own_host);
    }
    free_shape(&shape);
}

/* ---- Estimate ------------------------------------------------------------------------------------------------------------ */

static void the_estimate_of_a_sheet_is_the_truth(void** state) {
    (void)state;
    Shape shape = sheet_shape(12);
    delmesh_mesh *in = shape_mesh(context, &shape), *out = NULL;
    free_shape(&shape);
    delmesh_remesh_options options = defaults();
    delmesh_remesh_report report;
    delmesh_remesh_report_init(&report, sizeof report);
    assert_status(delmesh_remesh(context, in, &options, &out, &report), context, DELMESH_OK);
    delmesh_mesh_destroy(out);
    assert_int_equal(report.split_on_boundary + report.split_on_kept + report.split_crowded + report.split_on_caps +
                         report.split_at_small_angles + report.split_on_flipped + report.split_elsewhere + report.split_merged,
                     report.splits);
    assert_true(report.worst_edge_splits > 0 && report.worst_edge_from >= 0 && report.worst_edge_from < report.worst_edge_to);
    assert_true(report.worst_face_splits >= report.worst_edge_splits && report.worst_face >= 0);

    delmesh_preserve_estimate estimate, old;
    memset(&estimate, 0xff, sizeof estimate);
    delmesh_preserve_estimate_init(&estimate, sizeof estimate);
    assert_int_equal(estimate.exact | estimate.outcome, 0);
    options.mode = DELMESH_MODE_FLIP; /* does not matter */
    assert_status(delmesh_estimate_preserve(context, in, &options, &estimate), context, DELMESH_OK);
    assert_int_equal(estimate.exact, 1);
    assert_int_equal(estimate.outcome, DELMESH_OK);
    assert_int_equal(estimate.vertices_in, report.vertices_in);
    assert_int_equal(estimate.vertices_out, report.vertices_out);
    assert_int_equal(estimate.nld_edges, report.nld_in);
    assert_true(estimate.growth == (double)report.vertices_out / (double)report.vertices_in);
    assert_true(estimate.deviation == 0 && estimate.seconds >= 0 && estimate.peak_bytes > 0);
    assert_status(delmesh_estimate_preserve(context, in, NULL, &estimate), context, DELMESH_OK);
    assert_int_equal(estimate.vertices_out, report.vertices_out);
    /* A caller that knows only the first fields. */
    memset(&old, 0x11, sizeof old);
    old.struct_size = 32;
    assert_status(delmesh_estimate_preserve(context, in, NULL, &old), context, DELMESH_OK);
    assert_int_equal(old.vertices_out, report.vertices_out);
    assert_int_equal(old.nld_edges, 0x1111111111111111);

    options.max_vertices = report.vertices_in + 3;
    assert_status(delmesh_estimate_preserve(context, in, &options, &estimate), context, DELMESH_OK);
    assert_int_equal(estimate.outcome, DELMESH_ERROR_VERTEX_LIMIT);
    assert_string_equal(delmesh_last_error(context), "");
    options.max_vertices = -1;
    assert_status(delmesh_estimate_preserve(context, in, &options, &estimate), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_int_equal(estimate.vertices_out, 0);
    assert_status(delmesh_estimate_preserve(context, NULL, NULL, &estimate), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_status(delmesh_estimate_preserve(context, in, NULL, NULL), context, DELMESH_ERROR_INVALID_ARGUMENT);
    estimate.struct_size = 5;
    assert_status(delmesh_estimate_preserve(context, in, NULL, &estimate), context, DELMESH_ERROR_INVALID_ARGUMENT);
    delmesh_mesh_destroy(in);
    in = make(kite_positions, 4, kite_corners, 0);
    estimate.struct_size = sizeof estimate;
    assert_status(delmesh_estimate_preserve(context, in, NULL, &estimate), context, DELMESH_ERROR_NO_SURFACE);
    delmesh_mesh_destroy(in);
}

/* ---- Certify ------------------------------------------------------------------------------------------------------------- */

static void certify_names_what_is_wrong(void** state) {
    (void)state;
    /* The kite, and beside it a face without area and an obtuse one. */
    static const double p[30] = {-2, 0, 0, 2,  0, 0, 0,  1, 0, 0,  -1, 0, 10, 0, 0,
                                 11, 0, 0, 12, 0, 0, 20, 0, 0, 24, 0,  0, 22, 1, 0};
    static const int32_t corners[12] = {0, 1, 2, 1, 0, 3, 4, 5, 6, 7, 8, 9};
    delmesh_mesh* mesh = make(p, 10, corners, 4);
    struct { int64_t edge[2], guard; } edges[4];
    int32_t faces[3];
    memset(edges, 0x11, sizeof edges);
    memset(faces, 0x11, sizeof faces);
    delmesh_certify_options options;
    delmesh_certify_report report;
    delmesh_certify_options_init(&options, sizeof options);
    delmesh_certify_report_init(&report, sizeof report);
    options.boundary = DELMESH_BOUNDARY_IGNORE;
    options.nld_edges = (delmesh_view_mut){edges, 4, sizeof edges[0], DELMESH_INT64, 2};
    options.zero_area_faces = (delmesh_view_mut){faces, 3, 0, DELMESH_INT32, 1};
    assert_status(delmesh_certify(context, mesh, &options, &report), context, DELMESH_OK);
    assert_int_equal(report.delaunay, 0);
    assert_int_equal(report.nld_interior, 1);
    assert_int_equal(report.zero_area_faces, 1);
    assert_int_equal(faces[0], 2);
    assert_int_equal(faces[1], 0x11111111);
    assert_int_equal(edges[0].edge[0] + edges[0].edge[1], 1);
    assert_int_equal(edges[0].guard, 0x1111111111111111);
    assert_int_equal(edges[1].edge[0], 0x1111111111111111);

    options.boundary = DELMESH_BOUNDARY_NONOBTUSE;
    assert_status(delmesh_certify(context, mesh, &options, &report), context, DELMESH_OK);
    assert_int_equal(report.nld_interior, 1);
    assert_true(report.nld_boundary >= 1); /* 7 8, and what the face without area adds */
    int found = 0;
    for (int i = 0; i < 4; ++i) found += edges[i].edge[0] == 7 && edges[i].edge[1] == 8;
    assert_int_equal(found, 1);
    /* Room for fewer than there are, and no room at all. */
    memset(edges, 0x11, sizeof edges);
    options.nld_edges.count = 1;
    options.zero_area_faces = (delmesh_view_mut){0};
    assert_status(delmesh_certify(context, mesh, &options, NULL), context, DELMESH_OK);
    assert_int_equal(edges[0].edge[0] + edges[0].edge[1], 1);
    assert_int_equal(edges[1].edge[0], 0x1111111111111111);
    assert_status(delmesh_certify(context, mesh, NULL, &report), context, DELMESH_OK);
    assert_int_equal(report.delaunay, 0);

    options.boundary = 2;
    assert_status(delmesh_certify(context, mesh, &options, &report), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_int_equal(report.nld_interior, 0);
    options.boundary = 0;
    options.nld_edges.type = DELMESH_FLOAT64;
    assert_status(delmesh_certify(context, mesh, &options, &report), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_non_null(strstr(delmesh_last_error(context), "'nld_edges'"));
    options.nld_edges = (delmesh_view_mut){0};
    options.zero_area_faces = (delmesh_view_mut){faces, 3, 0, DELMESH_INT32, 2};
    assert_status(delmesh_certify(context, mesh, &options, &report), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_non_null(strstr(delmesh_last_error(context), "'zero_area_faces'"));
    assert_status(delmesh_certify(context, NULL, NULL, &report), context, DELMESH_ERROR_INVALID_ARGUMENT);
    report.struct_size = 5;
    assert_status(delmesh_certify(context, mesh, NULL, &report), context, DELMESH_ERROR_INVALID_ARGUMENT);
    delmesh_mesh_destroy(mesh);
}

/* ---- Measure ------------------------------------------------------------------------------------------------------------- */

static void quality_of_a_kite(void** state) {
    (void)state;
    delmesh_mesh* mesh = kite();
    delmesh_quality_report report;
    delmesh_quality_report_init(&report, sizeof report);
    assert_status(delmesh_measure_quality(context, mesh, &report), context, DELMESH_OK);
    assert_true(fabs(report.area - 4) < 1e-12);
    assert_true(fabs(report.diagonal - sqrt(20)) < 1e-12);
    assert_true(fabs(report.min_angle - 26.565051177077990) < 1e-9);
    assert_true(fabs(report.max_angle - 126.86989764584402) < 1e-9);
    assert_true(fabs(report.max_edge - 4) < 1e-12 && fabs(report.min_edge - sqrt(5)) < 1e-12);
    assert_true(fabs(report.percent_below_30 - 400 / 6.0) < 1e-9 && fabs(report.percent_above_120 - 200 / 6.0) < 1e-9);
    assert_int_equal(report.negative_cotangents, 1);
    assert_int_equal(report.max_valence, 3);
    assert_int_equal(report.angle_histogram[2], 4);
    assert_int_equal(report.angle_histogram[12], 2);
    assert_status(delmesh_measure_quality(context, mesh, NULL), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_status(delmesh_measure_quality(context, NULL, &report), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_true(report.area == 0); /* written after the error */
    report.struct_size = 1;
    assert_status(delmesh_measure_quality(context, mesh, &report), context, DELMESH_ERROR_INVALID_ARGUMENT);
    delmesh_mesh_destroy(mesh);
}

static void distance_of_two_kites(void** state) {
    (void)state;
    double lifted[12];
    memcpy(lifted, kite_positions, sizeof lifted);
    for (int v = 0; v < 4; ++v) lifted[3 * v + 2] += 0.5;
    delmesh_mesh *a = kite(), *b = make(lifted, 4, kite_corners, 2);
    delmesh_distance_options options;
    delmesh_distance_report report;
    delmesh_distance_options_init(&options, sizeof options);
    delmesh_distance_report_init(&report, sizeof report);
    options.samples = 1000;
    assert_status(delmesh_measure_distance(context, a, b, &options, &report), context, DELMESH_OK);
    assert_true(fabs(report.hausdorff_sampled - 0.5) < 1e-12 && fabs(report.rms - 0.5) < 1e-12);
    assert_true(report.hausdorff_bound >= 0.5 && report.hausdorff_bound <= 1.1 * 0.5 + 1e-6 * report.diagonal);
    assert_true(fabs(report.diagonal - sqrt(20)) < 1e-12);
    assert_true(fabs(report.hausdorff_percent - 50 / sqrt(20)) < 1e-9);
    options.compute_bound = 0;
    assert_status(delmesh_measure_distance(context, a, b, &options, &report), context, DELMESH_OK);
    assert_true(report.hausdorff_bound < 0 && report.hausdorff_sampled == 0.5);
#define BAD(field, value)                                                                                               \
    do {                                                                                                                \
        delmesh_distance_options_init(&options, sizeof options);                                                        \
        options.field = value;                                                                                          \
        assert_status(delmesh_measure_distance(context, a, b, &options, &report), context, DELMESH_ERROR_INVALID_ARGUMENT); \
        assert_non_null(strstr(delmesh_last_error(context), #field));                                                   \
        assert_true(report.hausdorff_bound < 0 && report.hausdorff_sampled == 0);                                       \
    } while (0)
    BAD(compute_bound, 2);
    BAD(samples, -1);
    BAD(relative_error, -0.1);
    BAD(relative_error, NAN);
    BAD(absolute_error, 0);
    BAD(absolute_error, INFINITY);
#undef BAD
    assert_status(delmesh_measure_distance(context, NULL, b, NULL, &report), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_status(delmesh_measure_distance(context, a, NULL, NULL, &report), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_status(delmesh_measure_distance(context, a, b, NULL, NULL), context, DELMESH_ERROR_INVALID_ARGUMENT);
    delmesh_mesh* empty = make(kite_positions, 4, kite_corners, 0);
    assert_status(delmesh_measure_distance(context, a, empty, NULL, &report), context, DELMESH_ERROR_NO_SURFACE);
    assert_status(delmesh_measure_distance(context, empty, a, NULL, &report), context, DELMESH_ERROR_NO_SURFACE);
    delmesh_mesh_destroy(empty);
    delmesh_mesh_destroy(b);
    delmesh_mesh_destroy(a);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(defaults_are_documented),
        cmocka_unit_test(a_kite_is_flipped_once),
        cmocka_unit_test(preserve_keeps_vertices_and_maps_the_new),
        cmocka_unit_test(bad_remesh_options),
        cmocka_unit_test(options_and_reports_of_every_age),
        cmocka_unit_test(documented_errors_of_remesh),
        cmocka_unit_test(memory_per_triangle_stays_low),
        cmocka_unit_test(the_estimate_of_a_sheet_is_the_truth),
        cmocka_unit_test(certify_names_what_is_wrong),
        cmocka_unit_test(quality_of_a_kite),
        cmocka_unit_test(distance_of_two_kites),
    };
    return cmocka_run_group_tests_name("operations", tests, set_up, tear_down);
}
