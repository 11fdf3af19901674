/* SPDX-License-Identifier: Apache-2.0
 *
 * cmd_remesh.c: `delmesh remesh IN OUT`. The result is written only after it is certified, and the file appears
 * whole or not at all.
 */
#include "commands.h"
#include "session.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const Choice kPlacements[] = {{"interval", DELMESH_PLACEMENT_INTERVAL}, {"shells", DELMESH_PLACEMENT_SHELLS}, {NULL, 0}};

typedef struct Remesh {
    Session session;
    /* options */
    const char *in_path, *out_path, *report_path;
    bool measure, compact;
    int32_t encoding;
    Length shell_unit, tolerance;
    int64_t effort;
    delmesh_remesh_options options;
    /* results */
    Loaded in;
    delmesh_mesh* out;
    delmesh_remesh_report report;
    delmesh_quality_report before, after;
    delmesh_distance_report distance;
    double seconds_remesh, seconds_write, seconds_measure;
} Remesh;

static bool run_remesh(Remesh* r) {
    Session* s = &r->session;
    double diagonal = 0;
    if (!session_resolve(s, &r->in, &r->shell_unit, &diagonal, &r->options.shell_unit) ||
        !session_resolve(s, &r->in, &r->tolerance, &diagonal, &r->options.tolerance))
        return false;
    r->options.strict = s->strict;
    r->options.compact = r->compact;
    r->options.effort = (int32_t)r->effort;
    r->options.map = carry_needs_map(&s->carry, &r->in.file, r->out_path);
    double begin = seconds_now();
    int32_t status = delmesh_remesh(s->context, r->in.mesh, &r->options, &r->out, &r->report);
    r->seconds_remesh = seconds_now() - begin;
    return session_check(s, status, r->in_path);
}

static bool run_write(Remesh* r) {
    Session* s = &r->session;
    double begin = seconds_now();
    MeshFile file;
    bool ok = session_export(s, r->out, &r->in, r->out_path, &file) &&
              mesh_file_write(r->out_path, (Encoding)r->encoding, &file, &s->failure);
    mesh_file_free(&file);
    r->seconds_write = seconds_now() - begin;
    return ok;
}

static bool run_measure(Remesh* r) {
    Session* s = &r->session;
    double begin = seconds_now();
    bool ok = session_check(s, delmesh_measure_quality(s->context, r->in.mesh, &r->before), r->in_path) &&
              session_check(s, delmesh_measure_quality(s->context, r->out, &r->after), r->out_path) &&
              session_check(s, delmesh_measure_distance(s->context, r->in.mesh, r->out, NULL, &r->distance), r->out_path);
    r->seconds_measure = seconds_now() - begin;
    return ok;
}

/* What the split vertices were needed for, and where most of them are. */
static void json_where(Json* json, const delmesh_remesh_report* p) {
    json_begin_object(json, "splits_where");
    json_integer(json, "boundary", p->split_on_boundary);
    json_integer(json, "kept", p->split_on_kept);
    json_integer(json, "crowded", p->split_crowded);
    json_integer(json, "caps", p->split_on_caps);
    json_integer(json, "small_angles", p->split_at_small_angles);
    json_integer(json, "flipped", p->split_on_flipped);
    json_integer(json, "elsewhere", p->split_elsewhere);
    json_integer(json, "merged", p->split_merged);
    json_end_object(json);
    if (p->worst_edge_splits == 0) return;
    json_begin_array(json, "worst_edge");
    json_integer(json, NULL, p->worst_edge_from);
    json_integer(json, NULL, p->worst_edge_to);
    json_end_array(json);
    json_integer(json, "worst_edge_splits", p->worst_edge_splits);
    json_integer(json, "worst_face", p->worst_face);
    json_integer(json, "worst_face_splits", p->worst_face_splits);
}

/* Where a mesh grew more than its user may have expected. */
static void print_where(const delmesh_remesh_report* p) {
    if (p->vertices_out <= 4 * p->vertices_in) return;
    const struct {
        const char* what;
        int64_t count;
    } causes[] = {{"on boundary edges", p->split_on_boundary},
                  {"on kept edges", p->split_on_kept},
                  {"crowded at the precision", p->split_crowded},
                  {"on long sides of caps", p->split_on_caps},
                  {"beside small angles", p->split_at_small_angles},
                  {"on flipped edges", p->split_on_flipped},
                  {"elsewhere", p->split_elsewhere}};
    int most = 0;
    for (int i = 1; i < (int)(sizeof causes / sizeof causes[0]); ++i)
        if (causes[i].count > causes[most].count) most = i;
    printf("  most new vertices: %s (%lld of %lld); on the edge %ld-%ld alone: %lld\n", causes[most].what,
           (long long)causes[most].count, (long long)p->splits, (long)p->worst_edge_from, (long)p->worst_edge_to,
           (long long)p->worst_edge_splits);
}

static void json_report(Remesh* r, Json* json, bool ok) {
    const delmesh_remesh_report* p = &r->report;
    json_begin_object(json, NULL);
    if (!ok) json_string(json, "error", r->session.failure.text);
    json_string(json, "status", ok ? delmesh_status_name(DELMESH_OK) : r->session.failure.status);
    json_string(json, "input", r->in_path);
    json_string(json, "output", r->out_path);
    json_string(json, "mode", choice_name(kModeChoices, r->options.mode));
    json_string(json, "placement", choice_name(kPlacements, r->options.placement));
    json_string(json, "boundary", choice_name(kBoundaryChoices, r->options.boundary));
    json_string(json, "precision", choice_name(kPrecisionChoices, r->options.precision));
    json_integer(json, "vertices_in", p->vertices_in);
    json_integer(json, "vertices_out", p->vertices_out);
    json_integer(json, "faces_in", p->faces_in);
    json_integer(json, "faces_out", p->faces_out);
    json_integer(json, "flips", p->flips);
    json_integer(json, "flips_after", p->flips_after);
    json_integer(json, "splits", p->splits);
    json_integer(json, "boundary_splits", p->boundary_splits);
    json_integer(json, "kept_splits", p->kept_splits);
    json_integer(json, "unflippable", p->unflippable);
    json_begin_object(json, "unflippable_kinds");
    json_integer(json, "2", p->unflippable_2);
    json_integer(json, "3", p->unflippable_3);
    json_integer(json, "4", p->unflippable_4);
    json_end_object(json);
    json_integer(json, "guarded", p->guarded);
    json_integer(json, "nld_in", p->nld_in);
    json_integer(json, "nld_out", p->nld_out);
    json_bool(json, "certified", ok && p->certified);
    if (p->surface_bound >= 0) json_double(json, "surface_bound", p->surface_bound);
    json_bool(json, "topology_kept", p->topology_kept);
    json_begin_repairs(json, &r->in);
    json_integer(json, "collapsed_edges", p->collapsed_edges);
    json_integer(json, "removed_zero_area_faces", p->removed_zero_area_faces);
    json_integer(json, "moved_within_tolerance", p->moved_within_tolerance);
    json_end_object(json);
    json_where(json, p);
    json_layers(json, &r->in, &r->session.carry.lost);
    if (ok && r->measure) {
        json_deviation(json, &r->distance);
        json_begin_object(json, "quality");
        json_begin_object(json, "before");
        json_quality(json, &r->before);
        json_end_object(json);
        json_begin_object(json, "after");
        json_quality(json, &r->after);
        json_end_object(json);
        json_end_object(json);
    }
    json_begin_object(json, "seconds");
    json_double(json, "total", seconds_now() - r->session.begin);
    json_double(json, "read", r->session.seconds_read);
    json_double(json, "create", r->session.seconds_create);
    json_double(json, "remesh", r->seconds_remesh);
    json_double(json, "repair", p->seconds_repair);
    json_double(json, "flip", p->seconds_flip);
    json_double(json, "split", p->seconds_split);
    json_double(json, "certify", p->seconds_certify);
    json_double(json, "write", r->seconds_write);
    if (r->measure) json_double(json, "measure", r->seconds_measure);
    json_end_object(json);
    json_integer(json, "peak_bytes", (int64_t)p->peak_bytes);
    json_end_object(json);
}

static void print_change(const char* label, int64_t before, int64_t after) {
    printf("  %-26s%16lld -> %lld", label, (long long)before, (long long)after);
    if (before > 0 && before != after) printf("  (%+.1f %%)", 100.0 * (double)(after - before) / (double)before);
    printf("\n");
}

static void print_report(const Remesh* r) {
    const delmesh_remesh_report* p = &r->report;
    printf("%s -> %s: %s, %s\n", r->in_path, r->out_path, choice_name(kModeChoices, r->options.mode),
           choice_name(kPrecisionChoices, r->options.precision));
    print_change("vertices", p->vertices_in, p->vertices_out);
    print_change("faces", p->faces_in, p->faces_out);
    print_change("edges not Delaunay", p->nld_in, p->nld_out);
    printf("  %-26s%16lld before the first split, %lld after\n", "flips", (long long)p->flips, (long long)p->flips_after);
    print_count("splits", p->splits);
    print_where(p);
    if (p->unflippable > 0) print_count("unflippable edges", p->unflippable);
    print_repairs(&r->in);
    print_layers(&r->in);
    if (p->collapsed_edges > 0) print_count("zero edges collapsed", p->collapsed_edges);
    if (p->removed_zero_area_faces > 0) print_count("zero-area faces removed", p->removed_zero_area_faces);
    printf("  %-26s%16s\n", "certified", p->certified ? "yes" : "no");
    if (r->measure) {
        print_quality_head();
        print_quality("before", &r->before);
        print_quality("after", &r->after);
        print_deviation(&r->distance);
    }
    printf("  %-26s%14.3f s (read %.3f, create %.3f, remesh %.3f, write %.3f)\n", "time", seconds_now() - r->session.begin,
           r->session.seconds_read, r->session.seconds_create, r->seconds_remesh, r->seconds_write);
    printf("  %-26s%13.1f MiB\n", "peak memory", (double)p->peak_bytes / 1048576);
}

int command_remesh(int count, char** arguments) {
    Remesh r;
    memset(&r, 0, sizeof r);
    Session* s = &r.session;
    session_init(s);
    delmesh_remesh_options_init(&r.options, sizeof r.options);
    delmesh_remesh_report_init(&r.report, sizeof r.report);
    delmesh_quality_report_init(&r.before, sizeof r.before);
    delmesh_quality_report_init(&r.after, sizeof r.after);
    delmesh_distance_report_init(&r.distance, sizeof r.distance);
    r.encoding = kEncodingDefault;
    r.effort = r.options.effort;
    const Option options[] = {
        option_choice("--mode", &r.options.mode, kModeChoices, "preserve|flip|feature",
                      "keep the surface (default), the vertices, or the sharp edges"),
        option_number("--feature-angle", &r.options.feature_angle, 0, 180, "DEG",
                      "feature: edges sharper than this are kept; 0 is flat (30)"),
        option_choice("--placement", &r.options.placement, kPlacements, "interval|shells",
                      "where edges are split: fewest vertices (default), or shells"),
        option_length("--shell-unit", &r.shell_unit, "radius of a shell; 0: diagonal / 1024 (default)"),
        option_number("--max-normal-turn", &r.options.max_normal_turn, 0, 180, "DEG",
                      "split where a flip would turn a normal further (any)"),
        option_length("--tolerance", &r.tolerance, "preserve: how far the surface may move (4 last places)"),
        option_integer("--effort", &r.effort, 0, INT32_MAX, "N",
                       "preserve: 0: plain rule, 1: look ahead (default), more: rounds of search"),
        option_choice("--precision", &r.options.precision, kPrecisionChoices, "f32|f64",
                      "of the result, and of its certificate (f32)"),
        option_choice("--boundary", &r.options.boundary, kBoundaryChoices, "nonobtuse|ignore",
                      "whether angles opposite to boundary edges count"),
        option_integer("--max-vertices", &r.options.max_vertices, 0, INT32_MAX, "N",
                       "of the result; 0: 16 times the input's + 10,000 (default)"),
        option_flag("--compact", &r.compact, "leave out vertices that no face uses"),
        option_flag("--measure", &r.measure, "also measure angles, and the distance to the input"),
        CARRY_OPTIONS(&s->carry),
        option_string("--report", &r.report_path, "R.json", "write the JSON report there"),
        option_choice("--encoding", &r.encoding, kEncodingChoices, "ascii|little|big", "of PLY and STL (little; .stla: ascii)"),
        option_value("--ascii", &r.encoding, kEncodingAscii, "the same as --encoding ascii"),
        SESSION_OPTIONS(s)};
    const Positional positionals[] = {{"IN", &r.in_path}, {"OUT", &r.out_path}, {NULL, NULL}};
    Json json = {0};
    bool help;
    bool ok = options_parse(count, arguments, options, positionals, &help, &s->failure);
    if (ok && help) {
        options_print_help(
            "remesh",
            "Makes a mesh Delaunay, certified exactly, and writes it as .obj, .off, .ply, .stl or .stla (text STL).\n"
            "Vertex i stays vertex i; new vertices come after. STL files hold points, not vertices: their distinct points,\n"
            "in order of appearance, are the vertices unless --weld none.",
            options, positionals);
        return session_end(s, &json, true, 0);
    }
    /* What can be refused is refused before the work. */
    ok = ok && carry_parse(&s->carry, &s->failure) &&
         mesh_file_can_write(r.out_path, (Encoding)r.encoding, r.options.precision, &s->failure) &&
         (!r.report_path || output_check(r.report_path, &s->failure));
    const bool started = ok;
    ok = ok && session_open(s) && session_load(s, r.in_path, &r.in) && run_remesh(&r) && (!r.measure || run_measure(&r)) &&
         run_write(&r);
    if (started && (s->json || r.report_path)) {
        json_report(&r, &json, ok);
        ok = session_report(s, &json, r.report_path, ok);
    }
    if (ok && !s->json && !s->quiet) {
        print_report(&r);
        say_lost(s, r.out_path);
    }
    delmesh_mesh_destroy(r.out);
    loaded_free(&r.in);
    return session_end(s, &json, ok, 0);
}
