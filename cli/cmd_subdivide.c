/* SPDX-License-Identifier: Apache-2.0
 *
 * cmd_subdivide.c: `delmesh subdivide CAGE OUT`: the limit surface of a control cage, as triangles. `lod --subdivide` goes on from
 * there.
 */
#include "commands.h"
#include "session.h"

#include <stdio.h>
#include <string.h>

static const Choice kEvaluations[] = {{"bfr", DELMESH_EVALUATION_BFR}, {"far", DELMESH_EVALUATION_FAR}, {NULL, 0}};

typedef struct Subdivide {
    Session session;
    const char *in_path, *out_path, *report_path;
    int64_t rate, triangles;
    double edge_length;
    int32_t encoding;
    Loaded in;
    double seconds_write;
} Subdivide;

static bool choose_fineness(Subdivide* d) {
    CageOptions* cage = &d->session.cage;
    const struct {
        const char* option;
        int32_t fineness;
        double value;
    } given[] = {{"--rate", DELMESH_FINENESS_RATE, (double)d->rate},
                 {"--edge-length", DELMESH_FINENESS_EDGE_LENGTH, d->edge_length},
                 {"--triangles", DELMESH_FINENESS_FACES, (double)d->triangles}};
    const char* first = NULL;
    for (int i = 0; i < 3; ++i) {
        if (given[i].value < 0) continue;
        if (first) return fail_with(&d->session.failure, kStatusUsage, "%s and %s do not go together", first, given[i].option);
        first = given[i].option;
        cage->fineness = given[i].fineness;
        cage->value = given[i].value;
    }
    return first || fail_with(&d->session.failure, kStatusUsage, "one of --rate, --edge-length and --triangles is missing");
}

static bool run_write(Subdivide* d) {
    Session* s = &d->session;
    const double begin = seconds_now();
    MeshFile file;
    const bool ok = session_export(s, d->in.mesh, &d->in, d->out_path, &file) &&
                    mesh_file_write(d->out_path, (Encoding)d->encoding, &file, &s->failure);
    mesh_file_free(&file);
    d->seconds_write = seconds_now() - begin;
    return ok;
}

static void json_report(const Subdivide* d, Json* json, bool ok) {
    const Session* s = &d->session;
    const delmesh_subdivide_report* p = &d->in.cage.report;
    json_begin_object(json, NULL);
    if (!ok) json_string(json, "error", s->failure.text);
    json_string(json, "status", ok ? delmesh_status_name(DELMESH_OK) : s->failure.status);
    json_string(json, "input", d->in_path);
    json_string(json, "output", d->out_path);
    json_string(json, "scheme", choice_name(kSchemeChoices, s->cage.scheme));
    json_string(json, "precision", choice_name(kPrecisionChoices, s->cage.precision));
    json_integer(json, "rate", p->rate);
    json_integer(json, "left_out_faces", p->left_out_faces);
    json_integer(json, "unmatched_creases", p->unmatched_creases);
    if (p->limit_distance >= 0) {
        json_double(json, "limit_distance", p->limit_distance);
        json_double(json, "limit_rms", p->limit_rms);
    }
    json_counts(json, &d->in.info);
    json_begin_repairs(json, &d->in);
    json_end_object(json);
    json_layers(json, &d->in, &s->carry.lost);
    json_begin_object(json, "seconds");
    json_double(json, "total", seconds_now() - s->begin);
    json_double(json, "read", s->seconds_read);
    json_double(json, "create", s->seconds_create);
    json_double(json, "subdivide", p->seconds_total);
    json_double(json, "write", d->seconds_write);
    json_end_object(json);
    json_integer(json, "peak_bytes", (int64_t)p->peak_bytes);
    json_end_object(json);
}

static void print_report(const Subdivide* d) {
    const delmesh_subdivide_report* p = &d->in.cage.report;
    printf("%s -> %s: %s, rate %ld, %s\n", d->in_path, d->out_path, choice_name(kSchemeChoices, d->session.cage.scheme),
           (long)p->rate, choice_name(kPrecisionChoices, d->session.cage.precision));
    print_count("faces of the cage", d->in.info.polygons);
    print_count("vertices", p->vertices);
    print_count("faces", p->faces);
    print_count("boundary edges", d->in.info.boundary_edges);
    if (p->left_out_faces > 0) print_count("faces left out", p->left_out_faces);
    if (p->unmatched_creases > 0) print_count("creases on no edge", p->unmatched_creases);
    if (p->limit_distance >= 0)
        printf("  %-26s%16.3g at most, %.3g rms, sampled\n", "from the limit surface", p->limit_distance, p->limit_rms);
    print_repairs(&d->in);
    print_layers(&d->in);
    printf("  %-26s%14.3f s (read %.3f, subdivide %.3f, write %.3f)\n", "time", seconds_now() - d->session.begin,
           d->session.seconds_read, p->seconds_total, d->seconds_write);
    printf("  %-26s%13.1f MiB\n", "peak memory", (double)p->peak_bytes / 1048576);
}

int command_subdivide(int count, char** arguments) {
    Subdivide d;
    memset(&d, 0, sizeof d);
    Session* s = &d.session;
    session_init(s);
    d.rate = d.triangles = -1;
    d.edge_length = -1;
    d.encoding = kEncodingDefault;
    const Option options[] = {
        option_integer("--rate", &d.rate, 0, INT32_MAX, "N", "every edge of the cage is cut into N pieces"),
        option_number("--edge-length", &d.edge_length, 0, 1e300, "L", "... or into pieces of at most this length, on average"),
        option_integer("--triangles", &d.triangles, 0, INT32_MAX, "N", "... or so that there are at most N triangles"),
        CAGE_OPTIONS(&s->cage, "--boundary"),
        option_choice("--evaluation", &s->cage.evaluation, kEvaluations, "bfr|far",
                      "each point on its own (bfr), or by refinement"),
        option_choice("--precision", &s->cage.precision, kPrecisionChoices, "f32|f64", "of the result (f32)"),
        option_flag("--measure", &s->cage.measure, "also measure how far it is from the limit surface"),
        CARRY_OPTIONS(&s->carry),
        option_string("--report", &d.report_path, "R.json", "write the JSON report there"),
        option_choice("--encoding", &d.encoding, kEncodingChoices, "ascii|little|big", "of PLY and STL (little; .stla: ascii)"),
        option_value("--ascii", &d.encoding, kEncodingAscii, "the same as --encoding ascii"),
        SESSION_OPTIONS(s)};
    const Positional positionals[] = {{"CAGE", &d.in_path}, {"OUT", &d.out_path}, {NULL, NULL}};
    Json json = {0};
    bool help;
    bool ok = options_parse(count, arguments, options, positionals, &help, &s->failure);
    if (ok && help) {
        options_print_help(
            "subdivide",
            "Makes triangles whose vertices lie on the limit surface of a control cage. Creases, corners and holes are\n"
            "those of an OBJ file's t lines, and of --creases. The result is not Delaunay yet: see remesh, and\n"
            "lod --subdivide, which keeps what the cage knows.",
            options, positionals);
        return session_end(s, &json, true, 0);
    }
    ok = ok && choose_fineness(&d) && carry_parse(&s->carry, &s->failure) &&
         mesh_file_can_write(d.out_path, (Encoding)d.encoding, s->cage.precision, &s->failure) &&
         (!d.report_path || output_check(d.report_path, &s->failure));
    const bool started = ok;
    ok = ok && session_open(s) && session_load(s, d.in_path, &d.in) && run_write(&d);
    if (started && (s->json || d.report_path)) {
        json_report(&d, &json, ok);
        ok = session_report(s, &json, d.report_path, ok);
    }
    if (ok && !s->json && !s->quiet) {
        print_report(&d);
        say_lost(s, d.out_path);
    }
    loaded_free(&d.in);
    return session_end(s, &json, ok, 0);
}
