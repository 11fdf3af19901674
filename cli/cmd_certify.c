/* SPDX-License-Identifier: Apache-2.0
 *
 * cmd_certify.c: `delmesh info` and `delmesh certify`: counts, the exact certificate, and for info angles and repairs.
 */
#include "commands.h"
#include "growth.h"
#include "session.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct Certificate {
    delmesh_certify_report report;
    int64_t edge_count; /* listed */
    int32_t* edges;     /* edge_count x 2 vertices of the file */
    int32_t* faces;     /* report.zero_area_faces faces of the file */
} Certificate;

static void certificate_free(Certificate* certificate) {
    free(certificate->edges);
    free(certificate->faces);
}

/* Replaces mesh vertices or faces by the file's, of which they may be copies or parts. */
static bool to_source(Session* session, const Loaded* loaded, int32_t what, int64_t elements, int32_t* indices, int64_t count) {
    int32_t* source = malloc((size_t)elements * sizeof *source + 1);
    if (!source) return fail_memory(&session->failure);
    const delmesh_view_mut view = {source, elements, 0, DELMESH_INT32, 1};
    bool ok = session_check(session, delmesh_mesh_read(loaded->mesh, what, &view), loaded->path);
    for (int64_t i = 0; ok && i < count; ++i) indices[i] = source[indices[i]];
    free(source);
    return ok;
}

static bool certify(Session* session, const Loaded* loaded, int32_t boundary, bool list, Certificate* out) {
    memset(out, 0, sizeof *out);
    delmesh_certify_options options;
    delmesh_certify_options_init(&options, sizeof options);
    options.boundary = boundary;
    delmesh_certify_report_init(&out->report, sizeof out->report);
    if (!session_check(session, delmesh_certify(session->context, loaded->mesh, &options, &out->report), loaded->path))
        return false;
    if (!list) return true;

    /* Once more, now that it is known how many there are. */
    out->edge_count = out->report.nld_interior + out->report.nld_boundary;
    out->edges = malloc((size_t)out->edge_count * 2 * sizeof(int32_t) + 1);
    out->faces = malloc((size_t)out->report.zero_area_faces * sizeof(int32_t) + 1);
    if (!out->edges || !out->faces) return fail_memory(&session->failure);
    options.nld_edges = (delmesh_view_mut){out->edges, out->edge_count, 0, DELMESH_INT32, 2};
    options.zero_area_faces = (delmesh_view_mut){out->faces, out->report.zero_area_faces, 0, DELMESH_INT32, 1};
    return session_check(session, delmesh_certify(session->context, loaded->mesh, &options, &out->report), loaded->path) &&
           to_source(session, loaded, DELMESH_VERT_SOURCE, loaded->info.vertices, out->edges, 2 * out->edge_count) &&
           to_source(session, loaded, DELMESH_FACE_SOURCE, loaded->info.faces, out->faces, out->report.zero_area_faces);
}

static void json_certificate(Json* json, const Certificate* certificate, bool list) {
    const delmesh_certify_report* r = &certificate->report;
    json_integer(json, "zero_area_faces", r->zero_area_faces);
    json_integer(json, "nld_interior", r->nld_interior);
    json_integer(json, "nld_boundary", r->nld_boundary);
    json_bool(json, "delaunay", r->delaunay);
    if (!list) return;
    json_begin_array(json, "edges");
    for (int64_t i = 0; i < certificate->edge_count; ++i) {
        json_begin_array(json, NULL);
        json_integer(json, NULL, certificate->edges[2 * i]);
        json_integer(json, NULL, certificate->edges[2 * i + 1]);
        json_end_array(json);
    }
    json_end_array(json);
    json_begin_array(json, "zero_area_face_list");
    for (int64_t i = 0; i < r->zero_area_faces; ++i) json_integer(json, NULL, certificate->faces[i]);
    json_end_array(json);
}

static void print_certificate(const Certificate* certificate, bool list) {
    const delmesh_certify_report* r = &certificate->report;
    print_count("interior edges not Delaunay", r->nld_interior);
    print_count("boundary edges not Delaunay", r->nld_boundary);
    print_count("faces of zero area", r->zero_area_faces);
    printf("  %-26s%16s\n", "Delaunay", r->delaunay ? "yes" : "no");
    if (!list) return;
    for (int64_t i = 0; i < certificate->edge_count; ++i)
        printf("edge %ld %ld\n", (long)certificate->edges[2 * i], (long)certificate->edges[2 * i + 1]);
    for (int64_t i = 0; i < r->zero_area_faces; ++i) printf("zero-area face %ld\n", (long)certificate->faces[i]);
}

static void print_head(const Loaded* loaded) {
    printf("%s: %s, %s\n", loaded->path, mesh_format_name(loaded->file.format),
           loaded->info.precision == DELMESH_FLOAT32 ? "float32" : "float64");
}

static void print_info(const Loaded* loaded, const delmesh_quality_report* quality) {
    const delmesh_mesh_info* i = &loaded->info;
    print_count("vertices", i->vertices);
    if (i->isolated_vertices > 0) print_count("of them used by no face", i->isolated_vertices);
    print_count("faces", i->faces);
    if (i->polygons != i->faces) print_count("polygons in the file", i->polygons);
    print_count("edges", i->edges);
    print_count("boundary edges", i->boundary_edges);
    print_count("components", i->components);
    print_count("boundary loops", i->boundary_loops);
    print_count("Euler characteristic", i->euler_characteristic);
    print_repairs(loaded);
    print_layers(loaded);
    print_quality_head();
    print_quality("", quality);
}

/* Both commands; full: info. */
static int run(int count, char** arguments, bool full) {
    Session session;
    session_init(&session);
    session.carry.bare = !full;
    const char* path = NULL;
    int32_t boundary = DELMESH_BOUNDARY_NONOBTUSE;
    bool list = false, no_estimate = false, help;
    Growth growth;
    growth_init(&growth);
    const Option boundary_option = option_choice("--boundary", &boundary, kBoundaryChoices, "nonobtuse|ignore",
                                                 "whether angles opposite to boundary edges count");
    const Option list_option = option_flag("--list", &list, "list the edges and faces, by the file's indices from 0");
    const Option certify_options[] = {boundary_option, list_option, SESSION_OPTIONS(&session)};
    const Option info_options[] = {boundary_option, list_option, GROWTH_OPTIONS(&growth),
                                   option_flag("--no-estimate", &no_estimate, "do not foretell how preserve would grow the mesh"),
                                   SESSION_OPTIONS(&session)};
    const Option* options = full ? info_options : certify_options;
    const Positional positionals[] = {{"FILE", &path}, {NULL, NULL}};
    Json json = {0};
    bool ok = options_parse(count, arguments, options, positionals, &help, &session.failure);
    if (ok && help) {
        options_print_help(
            full ? "info" : "certify",
            full ? "Tells what is in a mesh file: counts, angles, what the import had to repair, whether it is Delaunay, and\n"
                   "how many vertices 'remesh' in its mode preserve would return."
                 : "Decides exactly whether a mesh is Delaunay. Exit status: 0 it is, 1 it is not, 2 error.",
            options, positionals);
        return session_end(&session, &json, true, 0);
    }
    Loaded loaded = {0};
    Certificate certificate = {.edges = NULL};
    delmesh_quality_report quality;
    delmesh_quality_report_init(&quality, sizeof quality);
    ok = ok && session_open(&session) && session_load(&session, path, &loaded) &&
         certify(&session, &loaded, boundary, list, &certificate);
    if (ok && full) ok = session_check(&session, delmesh_measure_quality(session.context, loaded.mesh, &quality), path);
    if (ok && full && !no_estimate) ok = growth_estimate(&session, &loaded, boundary, quality.diagonal, &growth);

    if (ok && session.json) {
        json_begin_object(&json, NULL);
        json_string(&json, "file", path);
        json_string(&json, "format", mesh_format_name(loaded.file.format));
        json_string(&json, "precision", loaded.info.precision == DELMESH_FLOAT32 ? "f32" : "f64");
        json_counts(&json, &loaded.info);
        json_certificate(&json, &certificate, list);
        if (full) {
            json_integer(&json, "polygons", loaded.info.polygons);
            json_integer(&json, "isolated_vertices", loaded.info.isolated_vertices);
            json_double(&json, "largest_coordinate", loaded.largest_coordinate);
            json_quality(&json, &quality);
            json_layers(&json, &loaded, NULL);
            json_begin_repairs(&json, &loaded);
            json_end_object(&json);
            if (!no_estimate) json_growth(&json, &growth);
        }
        json_double(&json, "seconds", seconds_now() - session.begin);
        json_end_object(&json);
    } else if (ok && !session.quiet) {
        print_head(&loaded);
        if (full) print_info(&loaded, &quality);
        print_certificate(&certificate, list);
        if (full && !no_estimate) print_growth(&growth);
    }
    const bool delaunay = certificate.report.delaunay;
    certificate_free(&certificate);
    loaded_free(&loaded);
    return session_end(&session, &json, ok, full || delaunay ? 0 : 1);
}

int command_info(int count, char** arguments) {
    return run(count, arguments, true);
}
int command_certify(int count, char** arguments) {
    return run(count, arguments, false);
}
