/* SPDX-License-Identifier: Apache-2.0
 *
 * cmd_lod.c: `delmesh lod IN OUT_PREFIX`: a family of ever coarser Delaunay meshes. Level 0 is the whole Delaunay mesh. The files
 * appear together, after all levels are made and certified.
 */
#include "commands.h"
#include "numbers.h"
#include "session.h"
#include "text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { kMostLevels = 64 };

static const Choice kPlacements[] = {
    {"all", DELMESH_COLLAPSE_ALL}, {"paper", DELMESH_COLLAPSE_PAPER}, {"endpoints", DELMESH_COLLAPSE_ENDPOINTS}, {NULL, 0}};
static const Choice kTargets[] = {{"full", DELMESH_TARGET_FULL},           {"vertices", DELMESH_TARGET_VERTICES},
                                  {"triangles", DELMESH_TARGET_FACES},     {"ratio", DELMESH_TARGET_RATIO},
                                  {"deviation", DELMESH_TARGET_DEVIATION}, {NULL, 0}};
static const Choice kStops[] = {{"target", DELMESH_STOPPED_BY_TARGET},     {"topology", DELMESH_STOPPED_BY_TOPOLOGY},
                                {"delaunay", DELMESH_STOPPED_BY_DELAUNAY}, {"features", DELMESH_STOPPED_BY_FEATURES},
                                {"bound", DELMESH_STOPPED_BY_BOUND},       {NULL, 0}};
/* The first five are what the files are called. */
static const Choice kSuffixes[] = {{"ply", 0},  {"obj", 1},  {"off", 2},  {"stl", 3},   {"stla", 4}, {".ply", 0},
                                   {".obj", 1}, {".off", 2}, {".stl", 3}, {".stla", 4}, {NULL, 0}};

/* The options of which there must be one. */
typedef struct TargetList {
    const char* option;
    int32_t kind;
    const char* text; /* NULL: not given */
} TargetList;
enum { kTargetLists = 4 };

typedef struct Level {
    char* path;
    Length length; /* deviation as it was given */
    delmesh_quality_report quality;
    delmesh_distance_report distance;
    int64_t edge_count; /* NLD edges that the region leaves */
    int32_t* edges;     /* edge_count x 2 */
    Output file;
} Level;

typedef struct Lod {
    Session session;
    /* options */
    const char *in_path, *prefix, *report_path, *density_path, *lock_path, *region_path, *subdivide;
    TargetList lists[kTargetLists];
    bool no_measure;
    int32_t encoding, suffix;
    int64_t quality;
    Length prune, tolerance;
    delmesh_decimate_options options;
    /* results */
    Loaded in;
    Numbers density, lock, region;
    int32_t *locked, *mask;
    double diagonal;
    int32_t count;
    Level levels[kMostLevels];
    delmesh_target targets[kMostLevels];
    delmesh_mesh* made[kMostLevels];
    delmesh_level_report reports[kMostLevels];
    delmesh_decimate_report report;
    double seconds_decimate, seconds_write, seconds_measure;
} Lod;

/* ---- Arguments */

static bool fail_list(Lod* l, const TargetList* list, const char* wanted) {
    return fail_with(&l->session.failure, kStatusUsage, "%s takes %s, not '%s'", list->option, wanted, list->text);
}

/* "25000,5000,500": the finest first. */
static bool parse_list(Lod* l, const TargetList* list) {
    const bool deviation = list->kind == DELMESH_TARGET_DEVIATION, ratio = list->kind == DELMESH_TARGET_RATIO;
    const char* wanted = deviation ? "lengths or percents of the diagonal, with commas between them"
                         : ratio   ? "numbers from 0 to 1, with commas between them"
                                   : "whole numbers, with commas between them";
    const char* at = list->text;
    for (;;) {
        if (l->count == kMostLevels)
            return fail_with(&l->session.failure, kStatusUsage, "%s takes at most %d levels", list->option, kMostLevels - 1);
        const Level* before = l->count > 1 ? &l->levels[l->count - 1] : NULL;
        Level* level = &l->levels[l->count];
        int64_t integer = 0;
        double* value = &level->length.value;
        if (deviation || ratio) {
            if (!text_scan_double(&at, value)) return fail_list(l, list, wanted);
        } else {
            if (!text_scan_integer(&at, &integer)) return fail_list(l, list, wanted);
            *value = (double)integer;
        }
        if (!(*value >= 0 && *value <= (ratio ? 1.0 : 1e300))) return fail_list(l, list, wanted);
        level->length.given = true;
        level->length.percent = deviation && *at == '%';
        at += level->length.percent;
        const double previous = before ? before->length.value : *value;
        if ((!before || before->length.percent == level->length.percent) && (deviation ? *value < previous : *value > previous))
            return fail_list(l, list, "the finest level first");
        l->targets[l->count++] = (delmesh_target){list->kind, 0, *value};
        if (*at == '\0') return true;
        if (*at++ != ',') return fail_list(l, list, wanted);
    }
}

static bool parse_targets(Lod* l) {
    const TargetList* given = NULL;
    for (int i = 0; i < kTargetLists; ++i) {
        if (!l->lists[i].text) continue;
        if (given)
            return fail_with(&l->session.failure, kStatusUsage, "%s and %s do not go together", given->option,
                             l->lists[i].option);
        given = &l->lists[i];
    }
    if (!given)
        return fail_with(&l->session.failure, kStatusUsage,
                         "one of --vertices, --triangles, --ratios and --deviation is missing");
    l->targets[0] = (delmesh_target){DELMESH_TARGET_FULL, 0, 0};
    l->count = 1;
    return parse_list(l, given);
}

/* "32", "length=0.1", "triangles=1000000" */
static bool parse_subdivide(Lod* l) {
    static const struct {
        const char* name;
        int32_t fineness;
    } kinds[] = {{"length=", DELMESH_FINENESS_EDGE_LENGTH}, {"triangles=", DELMESH_FINENESS_FACES}, {"", DELMESH_FINENESS_RATE}};
    CageOptions* cage = &l->session.cage;
    if (!l->subdivide) {
        if (!cage->creases_path && !cage->normals) return true;
        return fail_with(&l->session.failure, kStatusUsage, "%s goes with --subdivide",
                         cage->normals ? "--normals" : "--creases");
    }
    int kind = 0;
    while (strncmp(l->subdivide, kinds[kind].name, strlen(kinds[kind].name)) != 0) ++kind;
    cage->fineness = kinds[kind].fineness;
    cage->precision = l->options.precision;
    cage->measure = !l->no_measure || l->lists[3].text;
    if (!text_parse_double(l->subdivide + strlen(kinds[kind].name), &cage->value))
        return fail_with(&l->session.failure, kStatusUsage, "--subdivide takes N, length=L or triangles=N, not '%s'",
                         l->subdivide);
    const char* const per_element[] = {l->density_path ? "--density" : NULL, l->lock_path ? "--lock" : NULL,
                                       l->region_path ? "--region" : NULL, l->session.carry.fit ? "--fit" : NULL};
    for (int i = 0; i < 4; ++i)
        if (per_element[i])
            return fail_with(&l->session.failure, kStatusUsage, "--subdivide and %s do not go together", per_element[i]);
    return true;
}

/* What can be refused is refused before the work. */
static bool name_files(Lod* l, const char* suffix) {
    const size_t room = strlen(l->prefix) + strlen(suffix) + 32;
    for (int32_t i = 0; i < l->count; ++i) {
        free(l->levels[i].path);
        char* path = l->levels[i].path = malloc(room);
        if (!path) return fail_memory(&l->session.failure);
        snprintf(path, room, "%s_LOD%ld.%s", l->prefix, (long)i, suffix);
        if (!mesh_file_can_write(path, (Encoding)l->encoding, l->options.precision, &l->session.failure)) return false;
    }
    return !l->report_path || output_check(l->report_path, &l->session.failure);
}

/* PLY, unless told; but only OBJ files can name the material library that the input names. */
static bool choose_files(Lod* l) {
    const bool told = l->suffix >= 0 || l->encoding == kEncodingLittle || l->encoding == kEncodingBig;
    if (told || l->session.carry.bare || l->in.file.format != kFormatObj || l->in.file.libraries.count == 0) return true;
    return name_files(l, "obj");
}

/* ---- Values per vertex and face */

static bool read_values(Lod* l, const char* path, bool positive, int64_t count, const char* elements, Numbers* out) {
    if (!path) return true;
    if (!numbers_read(path, positive, out, &l->session.failure)) return false;
    if (out->count == count) return true;
    return fail_with(&l->session.failure, kStatusRead, "%s: there are %lld numbers in it, and %s has %lld %s", path,
                     (long long)out->count, l->in_path, (long long)count, elements);
}

static bool read_flags(Lod* l, const char* path, int64_t count, const char* elements, Numbers* numbers, int32_t** flags,
                       delmesh_view* view) {
    if (!read_values(l, path, false, count, elements, numbers)) return false;
    if (!path) return true;
    *flags = malloc((size_t)count * sizeof **flags + 1);
    if (!*flags) return fail_memory(&l->session.failure);
    for (int64_t i = 0; i < count; ++i) (*flags)[i] = numbers->values[i] != 0;
    *view = (delmesh_view){*flags, count, 0, DELMESH_INT32, 1};
    return true;
}

static bool read_all_values(Lod* l) {
    const delmesh_mesh_info* info = &l->in.info;
    const int64_t verts = info->vertices - info->copied_vertices;
    if (!read_values(l, l->density_path, true, verts, "vertices", &l->density)) return false;
    if (l->density.values) l->options.vert_weights = (delmesh_view){l->density.values, verts, 0, DELMESH_FLOAT64, 1};
    return read_flags(l, l->lock_path, verts, "vertices", &l->lock, &l->locked, &l->options.locked_verts) &&
           read_flags(l, l->region_path, info->polygons, "faces", &l->region, &l->mask, &l->options.face_mask);
}

/* ---- Work */

static bool run_decimate(Lod* l) {
    Session* s = &l->session;
    delmesh_decimate_options* options = &l->options;
    if (!session_resolve(s, &l->in, &l->prune, &l->diagonal, &options->prune) ||
        !session_resolve(s, &l->in, &l->tolerance, &l->diagonal, &options->tolerance))
        return false;
    for (int32_t i = 1; i < l->count; ++i)
        if (!session_resolve(s, &l->in, &l->levels[i].length, &l->diagonal, &l->targets[i].value)) return false;
    /* Against the limit surface: what the mesh of it is off already is spent. */
    const double off = l->in.cage.handle ? l->in.cage.report.limit_distance : 0;
    for (int32_t i = 1; i < l->count && off > 0; ++i) {
        if (l->targets[i].kind != DELMESH_TARGET_DEVIATION) continue;
        if (l->targets[i].value <= off)
            return fail_with(
                &s->failure, kStatusUsage,
                "--deviation: level %ld was to be within %.6g of the limit surface, and the mesh that it is made of is "
                "%.6g away: --subdivide finer",
                (long)i, l->targets[i].value, off);
        l->targets[i].value -= off;
    }
    options->strict = s->strict;
    options->quality = (int32_t)l->quality;
    options->map = l->in.cage.handle ? !s->carry.bare : carry_needs_map(&s->carry, &l->in.file, l->levels[0].path);
    const double begin = seconds_now();
    const int32_t status =
        delmesh_lod_family(s->context, l->in.mesh, l->targets, l->count, options, l->made, l->reports, &l->report);
    l->seconds_decimate = seconds_now() - begin;
    return session_check(s, status, l->in_path);
}

/* The edges outside of the region that are NLD still. */
static bool list_edges(Lod* l, int32_t i) {
    Session* s = &l->session;
    Level* level = &l->levels[i];
    if (!l->region_path || l->reports[i].nld_outside == 0) return true;
    delmesh_certify_options options;
    delmesh_certify_options_init(&options, sizeof options);
    options.boundary = l->options.boundary;
    level->edge_count = l->reports[i].nld_outside;
    level->edges = calloc((size_t)level->edge_count * 2 + 1, sizeof *level->edges);
    if (!level->edges) return fail_memory(&s->failure);
    options.nld_edges = (delmesh_view_mut){level->edges, level->edge_count, 0, DELMESH_INT32, 2};
    return session_check(s, delmesh_certify(s->context, l->made[i], &options, NULL), level->path);
}

static bool run_measure(Lod* l) {
    Session* s = &l->session;
    const double begin = seconds_now();
    bool ok = true;
    for (int32_t i = 0; i < l->count && ok; ++i) {
        Level* level = &l->levels[i];
        ok = list_edges(l, i);
        if (l->no_measure) continue;
        ok = ok && session_check(s, delmesh_measure_quality(s->context, l->made[i], &level->quality), level->path) &&
             session_check(s, delmesh_measure_distance(s->context, l->in.mesh, l->made[i], NULL, &level->distance), level->path);
    }
    l->seconds_measure = seconds_now() - begin;
    return ok;
}

/* All files, or none. */
static bool run_write(Lod* l) {
    Session* s = &l->session;
    const double begin = seconds_now();
    Output files[kMostLevels];
    int32_t written = 0;
    bool ok = true;
    while (written < l->count && ok) {
        MeshFile file;
        ok = session_export(s, l->made[written], &l->in, l->levels[written].path, &file) &&
             mesh_file_prepare(l->levels[written].path, (Encoding)l->encoding, &file, &files[written], &s->failure);
        mesh_file_free(&file);
        written += ok;
    }
    ok = output_commit(files, written, ok, &s->failure);
    l->seconds_write = seconds_now() - begin;
    return ok;
}

/* ---- Report */

static bool is_reached(const Lod* l, int32_t i) {
    /* A deviation is reached when nothing more fits in it; not if it was spent before the first collapse. */
    return l->reports[i].stopped_by == DELMESH_STOPPED_BY_TARGET ||
           (l->targets[i].kind == DELMESH_TARGET_DEVIATION && l->reports[i].bound >= 0 &&
            l->reports[i].bound <= l->targets[i].value);
}

static void json_level(const Lod* l, Json* json, int32_t i) {
    const Level* level = &l->levels[i];
    const delmesh_level_report* p = &l->reports[i];
    json_begin_object(json, NULL);
    json_string(json, "file", level->path);
    json_begin_object(json, "target");
    json_string(json, "kind", choice_name(kTargets, l->targets[i].kind));
    if (i > 0) json_double(json, "value", l->targets[i].value);
    json_end_object(json);
    json_integer(json, "vertices", p->vertices);
    json_integer(json, "faces", p->faces);
    json_string(json, "stopped_by", choice_name(kStops, p->stopped_by));
    json_bool(json, "reached", is_reached(l, i));
    if (p->certified && p->nld_outside > 0)
        json_string(json, "certified", "interior");
    else
        json_bool(json, "certified", p->certified);
    if (l->region_path) {
        json_integer(json, "nld_outside", p->nld_outside);
        json_begin_array(json, "nld_edges");
        for (int64_t e = 0; e < level->edge_count; ++e) {
            json_begin_array(json, NULL);
            json_integer(json, NULL, level->edges[2 * e]);
            json_integer(json, NULL, level->edges[2 * e + 1]);
            json_end_array(json);
        }
        json_end_array(json);
    }
    if (p->bound >= 0) json_double(json, "bound", p->bound);
    json_integer(json, "pruned_components", p->pruned_components);
    json_integer(json, "relaxed_vertices", p->relaxed_vertices);
    if (!l->no_measure) {
        json_deviation(json, &level->distance);
        if (l->in.cage.handle)
            json_double(json, "limit_hausdorff_bound", level->distance.hausdorff_bound + l->in.cage.report.limit_distance);
        json_begin_object(json, "angles");
        json_quality(json, &level->quality);
        json_end_object(json);
    }
    json_double(json, "seconds", p->seconds);
    json_end_object(json);
}

static void json_report(const Lod* l, Json* json, bool ok) {
    const delmesh_decimate_report* p = &l->report;
    json_begin_object(json, NULL);
    if (!ok) json_string(json, "error", l->session.failure.text);
    json_string(json, "status", ok ? delmesh_status_name(DELMESH_OK) : l->session.failure.status);
    json_string(json, "input", l->in_path);
    json_string(json, "output", l->prefix);
    json_string(json, "mode", choice_name(kModeChoices, l->options.prepare));
    json_string(json, "collapse_placement", choice_name(kPlacements, l->options.collapse_placement));
    json_string(json, "boundary", choice_name(kBoundaryChoices, l->options.boundary));
    json_string(json, "precision", choice_name(kPrecisionChoices, l->options.precision));
    json_integer(json, "quality", l->quality);
    json_integer(json, "vertices_in", p->vertices_in);
    json_integer(json, "faces_in", p->faces_in);
    json_integer(json, "collapses", p->collapses);
    json_integer(json, "flips", p->flips);
    json_integer(json, "undone", p->undone);
    if (l->in.cage.handle) {
        json_begin_object(json, "subdivide");
        json_integer(json, "rate", l->in.cage.report.rate);
        json_integer(json, "left_out_faces", l->in.cage.report.left_out_faces);
        if (l->in.cage.report.limit_distance >= 0) json_double(json, "limit_distance", l->in.cage.report.limit_distance);
        json_end_object(json);
    }
    json_begin_object(json, "prepare");
    json_integer(json, "nld_in", p->prepare_nld);
    json_integer(json, "flips", p->prepare_flips);
    json_integer(json, "splits", p->prepare_splits);
    if (p->prepare_bound >= 0) json_double(json, "surface_bound", p->prepare_bound);
    json_bool(json, "topology_kept", p->topology_kept);
    json_end_object(json);
    json_begin_repairs(json, &l->in);
    json_end_object(json);
    json_layers(json, &l->in, &l->session.carry.lost);
    json_begin_list(json, "levels");
    for (int32_t i = 0; ok && i < l->count; ++i) json_level(l, json, i);
    json_end_list(json);
    json_begin_object(json, "seconds");
    json_double(json, "total", seconds_now() - l->session.begin);
    json_double(json, "read", l->session.seconds_read);
    json_double(json, "create", l->session.seconds_create);
    json_double(json, "lod", l->seconds_decimate);
    json_double(json, "prepare", p->seconds_prepare);
    json_double(json, "decimate", p->seconds_decimate);
    json_double(json, "relax", p->seconds_relax);
    json_double(json, "export", p->seconds_export);
    json_double(json, "measure", l->seconds_measure);
    json_double(json, "write", l->seconds_write);
    json_end_object(json);
    json_integer(json, "peak_bytes", (int64_t)p->peak_bytes);
    json_end_object(json);
}

static void print_report(const Lod* l) {
    const delmesh_decimate_report* p = &l->report;
    printf("%s -> %s ... %ld: %s, %s\n", l->in_path, l->levels[0].path, (long)l->count - 1,
           choice_name(kModeChoices, l->options.prepare), choice_name(kPrecisionChoices, l->options.precision));
    print_count("vertices in", p->vertices_in);
    print_count("faces in", p->faces_in);
    print_repairs(&l->in);
    print_layers(&l->in);
    if (!l->no_measure) printf("  %51s%20s\n", "distance, % of the diagonal", "angles");
    printf("  %5s%11s%11s", "level", "vertices", "faces");
    if (!l->no_measure) printf("%9s%9s%9s%10s%8s", "sampled", "at most", "rms", "smallest", "largest");
    printf("%10s%12s%10s\n", "certified", "stopped by", "seconds");
    for (int32_t i = 0; i < l->count; ++i) {
        const Level* level = &l->levels[i];
        const delmesh_level_report* r = &l->reports[i];
        printf("  %5ld%11lld%11lld", (long)i, (long long)r->vertices, (long long)r->faces);
        const double percent = level->distance.diagonal > 0 ? 100 / level->distance.diagonal : 0;
        if (!l->no_measure)
            printf("%9.4f%9.4f%9.4f%10.2f%8.1f", level->distance.hausdorff_sampled * percent,
                   level->distance.hausdorff_bound * percent, level->distance.rms * percent, level->quality.min_angle,
                   level->quality.max_angle);
        printf("%10s%12s%10.3f\n",
               !r->certified        ? "no"
               : r->nld_outside > 0 ? "interior"
                                    : "yes",
               choice_name(kStops, r->stopped_by), r->seconds);
    }
    printf("  %-26s%14.3f s (read %.3f, create %.3f, prepare %.3f, decimate %.3f, relax %.3f, export %.3f, measure %.3f, write "
           "%.3f)\n",
           "time", seconds_now() - l->session.begin, l->session.seconds_read, l->session.seconds_create, p->seconds_prepare,
           p->seconds_decimate, p->seconds_relax, p->seconds_export, l->seconds_measure, l->seconds_write);
    printf("  %-26s%13.1f MiB\n", "peak memory", (double)p->peak_bytes / 1048576);
}

/* What kept a level from its target, on standard error; no error. */
static void say_unreached(const Lod* l) {
    for (int32_t i = 0; i < l->count; ++i) {
        if (is_reached(l, i)) continue;
        const char* reason = "";
        switch (l->reports[i].stopped_by) {
        case DELMESH_STOPPED_BY_TOPOLOGY:
            reason = "further collapses would change the topology";
            break;
        case DELMESH_STOPPED_BY_DELAUNAY:
            reason = "further collapses would leave an edge that is not Delaunay, or a fold";
            break;
        case DELMESH_STOPPED_BY_FEATURES:
            reason = "further collapses would move corners, features, boundaries or what is locked, or cost the rest too much";
            break;
        case DELMESH_STOPPED_BY_BOUND:
            reason = "making the mesh Delaunay had spent the deviation";
            break;
        }
        fprintf(stderr, "delmesh: %s: the target was not reached: %s\n", l->levels[i].path, reason);
    }
}

static void lod_free(Lod* l) {
    for (int32_t i = 0; i < l->count; ++i) {
        free(l->levels[i].path);
        free(l->levels[i].edges);
        delmesh_mesh_destroy(l->made[i]);
    }
    free(l->locked);
    free(l->mask);
    numbers_free(&l->density);
    numbers_free(&l->lock);
    numbers_free(&l->region);
    loaded_free(&l->in);
}

static void lod_init(Lod* l) {
    memset(l, 0, sizeof *l);
    session_init(&l->session);
    delmesh_decimate_options_init(&l->options, sizeof l->options);
    delmesh_decimate_report_init(&l->report, sizeof l->report);
    for (int i = 0; i < kMostLevels; ++i) {
        delmesh_level_report_init(&l->reports[i], sizeof l->reports[i]);
        delmesh_quality_report_init(&l->levels[i].quality, sizeof l->levels[i].quality);
        delmesh_distance_report_init(&l->levels[i].distance, sizeof l->levels[i].distance);
    }
    const TargetList lists[kTargetLists] = {{"--vertices", DELMESH_TARGET_VERTICES, NULL},
                                            {"--triangles", DELMESH_TARGET_FACES, NULL},
                                            {"--ratios", DELMESH_TARGET_RATIO, NULL},
                                            {"--deviation", DELMESH_TARGET_DEVIATION, NULL}};
    memcpy(l->lists, lists, sizeof lists);
    l->encoding = kEncodingDefault;
    l->suffix = -1;
}

static int run(Lod* l, int count, char** arguments) {
    Session* s = &l->session;
    lod_init(l);
    const Option options[] = {
        option_string("--vertices", &l->lists[0].text, "N,N,...", "at most so many vertices in level 1, 2, ..."),
        option_string("--triangles", &l->lists[1].text, "N,N,...", "... or so many triangles"),
        option_string("--ratios", &l->lists[2].text, "R,R,...", "... or these shares of the input's triangles, 0 to 1"),
        option_string("--deviation", &l->lists[3].text, "L|P%,...", "... or as few as stay this close to the input, proven"),
        option_choice("--mode", &l->options.prepare, kModeChoices, "flip|preserve|feature",
                      "how the input becomes Delaunay: see remesh (flip)"),
        option_number("--feature-angle", &l->options.feature_angle, 0, 180, "DEG",
                      "feature: edges sharper than this are kept (30)"),
        option_length("--tolerance", &l->tolerance, "preserve: how far the surface may move (4 last places)"),
        option_count("--quality", &l->quality, 6, 0, INT32_MAX, "N", "relax every level, N sweeps (none; without N: 6)"),
        option_choice("--collapse-placement", &l->options.collapse_placement, kPlacements, "all|paper|endpoints",
                      "where the vertex of a collapse may go (all)"),
        option_number("--max-normal-turn", &l->options.max_normal_turn, 0, 90, "DEG",
                      "how far a collapse may turn a normal (78)"),
        option_number("--boundary-weight", &l->options.boundary_weight, 0, 1e6, "W",
                      "of boundaries and features, against surface (1)"),
        option_number("--uv-weight", &l->session.carry.uv_weight, 0, 1e6, "W",
                      "of UVs, against surface: 1 holds textures still (0)"),
        option_number("--normal-weight", &l->session.carry.normal_weight, 0, 1e6, "W",
                      "of the file's normals: 0.1 keeps shading (0)"),
        option_flag("--fit", &l->session.carry.fit, "UVs, normals, ... fit all over the surface, not at vertices"),
        option_string("--subdivide", &l->subdivide, "N|length=L|triangles=N",
                      "IN is a cage: the levels are of its limit surface"),
        CAGE_OPTIONS(&s->cage, "--cage-boundary"),
        option_string("--density", &l->density_path, "FILE", "detail wanted: a number over 0 per vertex, a line each"),
        option_string("--lock", &l->lock_path, "FILE", "a number per vertex, a line each: where not 0, it stays"),
        option_string("--region", &l->region_path, "FILE", "a number per face, a line each: where 0, nothing changes"),
        option_length("--prune", &l->prune, "components with a smaller diagonal may vanish (none)"),
        option_choice("--precision", &l->options.precision, kPrecisionChoices, "f32|f64",
                      "of the levels, and their certificates (f32)"),
        option_choice("--boundary", &l->options.boundary, kBoundaryChoices, "nonobtuse|ignore",
                      "whether angles opposite to boundary edges count"),
        option_flag("--no-measure", &l->no_measure, "leave out angles, and distances to the input"),
        CARRY_OPTIONS(&s->carry),
        option_string("--report", &l->report_path, "R.json", "write the JSON report there"),
        option_choice("--suffix", &l->suffix, kSuffixes, "ply|obj|off|stl|stla",
                      "the files' format (ply; obj if IN has a mtllib)"),
        option_choice("--format", &l->suffix, kSuffixes, "ply|obj|off|stl|stla", "the same as --suffix"),
        option_choice("--encoding", &l->encoding, kEncodingChoices, "ascii|little|big", "of PLY and STL (little; .stla: ascii)"),
        option_value("--ascii", &l->encoding, kEncodingAscii, "the same as --encoding ascii"),
        SESSION_OPTIONS(s)};
    const Positional positionals[] = {{"IN", &l->in_path}, {"OUT_PREFIX", &l->prefix}, {NULL, NULL}};
    Json json = {0};
    bool help;
    bool ok = options_parse(count, arguments, options, positionals, &help, &s->failure);
    if (ok && help) {
        options_print_help(
            "lod",
            "Makes a family of ever coarser meshes, each Delaunay and certified exactly, and writes OUT_PREFIX_LOD0.ply (all of\n"
            "the input, made Delaunay), OUT_PREFIX_LOD1.ply, ... One of --vertices, --triangles, --ratios and --deviation says\n"
            "where the levels end, the finest first. A target that cannot be reached is no error: the report says what stopped "
            "it.",
            options, positionals);
        return session_end(s, &json, true, 0);
    }
    ok = ok && parse_targets(l) && parse_subdivide(l) && carry_parse(&s->carry, &s->failure) &&
         name_files(l, kSuffixes[l->suffix < 0 ? 0 : l->suffix].name);
    const bool started = ok;
    ok = ok && session_open(s) && session_load(s, l->in_path, &l->in) && choose_files(l) && read_all_values(l) &&
         run_decimate(l) && run_measure(l) && run_write(l);
    if (started && (s->json || l->report_path)) {
        json_report(l, &json, ok);
        ok = session_report(s, &json, l->report_path, ok);
    }
    if (ok && !s->json && !s->quiet) {
        print_report(l);
        say_unreached(l);
        say_lost(s, l->prefix);
    }
    lod_free(l);
    return session_end(s, &json, ok, 0);
}

int command_lod(int count, char** arguments) {
    Lod* l = malloc(sizeof *l); /* with room for all levels, too large for some stacks */
    if (!l) {
        fprintf(stderr, "delmesh: there was not enough memory\n");
        return 2;
    }
    const int status = run(l, count, arguments);
    free(l);
    return status;
}
