/* SPDX-License-Identifier: Apache-2.0 */
#include "session.h"

#include "interrupt.h"
#include "text.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

const Choice kWeldChoices[] = {{"none", DELMESH_WELD_NONE}, {"exact", DELMESH_WELD_EXACT}, {NULL, 0}};
const Choice kBoundaryChoices[] = {{"nonobtuse", DELMESH_BOUNDARY_NONOBTUSE}, {"ignore", DELMESH_BOUNDARY_IGNORE}, {NULL, 0}};

const Choice kModeChoices[] = {
    {"preserve", DELMESH_MODE_PRESERVE}, {"flip", DELMESH_MODE_FLIP}, {"feature", DELMESH_MODE_FEATURE}, {NULL, 0}};
const Choice kPrecisionChoices[] = {{"f32", DELMESH_FLOAT32}, {"f64", DELMESH_FLOAT64}, {NULL, 0}};
const Choice kEncodingChoices[] = {{"ascii", kEncodingAscii}, {"little", kEncodingLittle}, {"big", kEncodingBig}, {NULL, 0}};

double seconds_now(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void session_init(Session* session) {
    memset(session, 0, sizeof *session);
    session->weld = kWeldByFormat;
    carry_init(&session->carry);
    cage_options_init(&session->cage);
    session->begin = seconds_now();
}

bool session_open(Session* session) {
    session->progress.enabled = !session->quiet && isatty(STDERR_FILENO);
    delmesh_context_options options;
    delmesh_context_options_init(&options, sizeof options);
    options.max_threads = (int32_t)session->threads;
    options.user = &session->progress;
    options.progress = progress_report;
    int32_t status = delmesh_context_create(&options, &session->context);
    if (status != DELMESH_OK)
        return fail_with(&session->failure, delmesh_status_name(status), "the library could not be started");
    interrupt_set_context(session->context);
    return true;
}

bool session_check(Session* session, int32_t status, const char* path) {
    progress_clear(&session->progress);
    if (status == DELMESH_OK) return true;
    return fail_with(&session->failure, delmesh_status_name(status), "%s: %s", path, delmesh_last_error(session->context));
}

static delmesh_view view(const void* data, int64_t count, int32_t type, int32_t components) {
    delmesh_view v = {data, count, 0, type, components};
    return v;
}

static double largest_coordinate(const MeshFile* file) {
    double largest = 0;
    for (int64_t c = 0; c < file->corner_count; ++c) {
        for (int k = 0; k < 3; ++k) {
            const int64_t at = 3 * (int64_t)file->corner_verts[c] + k;
            const double x = fabs(file->precision == DELMESH_FLOAT32 ? (double)((const float*)file->positions)[at]
                                                                     : ((const double*)file->positions)[at]);
            if (x > largest && isfinite(x)) largest = x;
        }
    }
    return largest;
}

/* The mesh of the file, with the borders of its layers. */
static bool create_mesh(Session* session, const char* path, Loaded* out) {
    MeshFile* file = &out->file;
    CarryLayers layers;
    bool ok = carry_describe(&session->carry, file, &layers, &session->failure);
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.weld = session->weld == DELMESH_WELD_EXACT ? DELMESH_WELD_EXACT : DELMESH_WELD_NONE;
    desc.strict = session->strict;
    desc.positions = view(file->positions, file->vertex_count, file->precision, 3);
    desc.corner_verts = view(file->corner_verts, file->corner_count, DELMESH_INT32, 1);
    if (file->face_sizes) desc.face_sizes = view(file->face_sizes, file->face_count, DELMESH_INT32, 1);
    desc.layers = layers.views;
    desc.layer_count = layers.count;
    ok = ok && session_check(session, delmesh_mesh_create(session->context, &desc, &out->mesh), path);
    out->borders = malloc((size_t)file->layers.count * sizeof *out->borders + 1);
    if (ok && !out->borders) ok = fail_memory(&session->failure);
    for (int32_t i = 0; ok && i < file->layers.count; ++i) out->borders[i] = -1;
    for (int32_t i = 0; ok && i < layers.count; ++i)
        ok = session_check(session, delmesh_mesh_layer_borders(out->mesh, i, &out->borders[layers.from[i]]), path);
    carry_layers_free(&layers);
    return ok;
}

/* The mesh of the cage that the file is. */
static bool create_from_cage(Session* session, const char* path, Loaded* out) {
    MeshFile* file = &out->file;
    const int32_t status =
        cage_subdivide(&session->cage, &session->carry, session->context, file, &out->cage, &out->mesh, &session->failure);
    if (session->failure.status || !session_check(session, status, path)) return false;
    out->borders = malloc((size_t)file->layers.count * sizeof *out->borders + 1);
    if (!out->borders) return fail_memory(&session->failure);
    for (int32_t i = 0; i < file->layers.count; ++i) {
        out->borders[i] = -1;
        const int32_t layer = out->cage.layer_of[i];
        if (layer >= 0 && !session_check(session, delmesh_mesh_layer_borders(out->mesh, layer, &out->borders[i]), path))
            return false;
    }
    return true;
}

bool session_load(Session* session, const char* path, Loaded* out) {
    memset(out, 0, sizeof *out);
    out->path = path;
    double begin = seconds_now();
    MeshFile* file = &out->file;
    if (!mesh_file_read(path, session->weld != DELMESH_WELD_NONE, file, &session->failure)) return false;
    if (session->carry.bare) layers_free(&file->layers);
    double read = seconds_now();
    out->largest_coordinate = largest_coordinate(file);
    bool ok = session->weld != DELMESH_WELD_EXACT || carry_spread(file, &session->failure);
    ok = ok && (session->cage.fineness >= 0 ? create_from_cage : create_mesh)(session, path, out);
    free(file->positions);
    free(file->corner_verts);
    free(file->face_sizes);
    file->positions = NULL;
    file->corner_verts = file->face_sizes = NULL;
    delmesh_mesh_info_init(&out->info, sizeof out->info);
    ok = ok && session_check(session, delmesh_mesh_get_info(out->mesh, &out->info), path);
    session->seconds_read += read - begin;
    session->seconds_create += seconds_now() - read;
    return ok;
}

void loaded_free(Loaded* loaded) {
    delmesh_mesh_destroy(loaded->mesh);
    cage_free(&loaded->cage);
    mesh_file_free(&loaded->file);
    free(loaded->borders);
    memset(loaded, 0, sizeof *loaded);
}

bool session_export(Session* session, const delmesh_mesh* mesh, const Loaded* loaded, const char* path, MeshFile* out) {
    memset(out, 0, sizeof *out);
    delmesh_mesh_info info;
    delmesh_mesh_info_init(&info, sizeof info);
    if (!session_check(session, delmesh_mesh_get_info(mesh, &info), loaded->path)) return false;
    const size_t real = info.precision == DELMESH_FLOAT32 ? sizeof(float) : sizeof(double);
    *out = (MeshFile){
        .precision = info.precision, .vertex_count = info.vertices, .face_count = info.faces, .corner_count = info.corners};
    out->positions = malloc((size_t)info.vertices * 3 * real + 1);
    out->corner_verts = malloc((size_t)info.corners * sizeof(int32_t) + 1);
    const delmesh_view_mut positions = {out->positions, info.vertices, 0, info.precision, 3};
    const delmesh_view_mut corners = {out->corner_verts, info.corners, 0, DELMESH_INT32, 1};
    return ((out->positions && out->corner_verts) || fail_memory(&session->failure)) &&
           session_check(session, delmesh_mesh_read(mesh, DELMESH_POSITION, &positions), loaded->path) &&
           session_check(session, delmesh_mesh_read(mesh, DELMESH_CORNER_VERT, &corners), loaded->path) &&
           session_check(session,
                         carry_over(&session->carry, session->context, loaded->mesh, mesh, &info, &loaded->file,
                                    loaded->cage.handle ? &loaded->cage : NULL, loaded->path, path, out, &session->failure),
                         loaded->path) &&
           !session->failure.status;
}

bool session_resolve(Session* session, const Loaded* loaded, const Length* length, double* diagonal, double* out) {
    if (!length->given) return true;
    *out = length->value;
    if (!length->percent) return true;
    if (*diagonal == 0) {
        delmesh_quality_report quality;
        delmesh_quality_report_init(&quality, sizeof quality);
        if (!session_check(session, delmesh_measure_quality(session->context, loaded->mesh, &quality), loaded->path))
            return false;
        *diagonal = quality.diagonal;
    }
    *out = length->value / 100 * *diagonal;
    return true;
}

/* The failure as the one JSON object, unless the command has made a fuller one. */
static void json_failure(Json* json, const Failure* failure) {
    if (json->size > 0) return;
    json_begin_object(json, NULL);
    json_string(json, "error", failure->text);
    json_string(json, "status", failure->status);
    json_end_object(json);
}

static bool json_save(const Json* json, const char* path, Failure* failure) {
    Output out;
    if (json->out_of_memory) return fail_memory(failure);
    if (!output_open(&out, path, failure)) return false;
    return output_close(&out, output_write(&out, json->text, json->size));
}

bool session_report(Session* session, Json* json, const char* path, bool ok) {
    if (!path) return ok;
    Failure unreported = {NULL, ""}; /* an error's report is worth having, too; but no second error about it */
    const bool saved = json_save(json, path, ok ? &session->failure : &unreported);
    if (saved || !ok) return ok;
    json_free(json);
    return false;
}

int session_end(Session* session, Json* json, bool ok, int success) {
    Failure* failure = &session->failure;
    progress_clear(&session->progress);
    if (session->context) {
        interrupt_set_context(NULL);
        delmesh_context_destroy(session->context);
        session->context = NULL;
    }
    if (ok && json->out_of_memory) ok = fail_memory(failure);
    if (!ok && session->json) json_failure(json, failure);
    if (session->json && json->size > 0 && !json->out_of_memory) fputs(json->text, stdout);
    json_free(json);
    carry_free(&session->carry);
    if (ok && (fflush(stdout) != 0 || ferror(stdout)))
        ok = fail_with(failure, kStatusWrite, "standard output could not be written: %s", strerror(errno));
    if (ok) return success;
    fprintf(stderr, "delmesh: %s\n", failure->text);
    return interrupt_signal && strcmp(failure->status, kStatusCancelled) == 0 ? 128 + (int)interrupt_signal : 2;
}

/* ---- What reports are made of */

typedef struct Count {
    const char* key;
    const char* label;
    int64_t value;
} Count;

enum { kRepairCount = 8 };

static void repairs_of(const Loaded* loaded, Count out[kRepairCount]) {
    const delmesh_mesh_info* i = &loaded->info;
    const Count counts[kRepairCount] = {
        {"welded_vertices", "vertices welded", i->welded_vertices + loaded->file.merged_points},
        {"degenerate_faces", "degenerate faces left out", i->degenerate_faces},
        {"duplicate_faces", "duplicate faces left out", i->duplicate_faces},
        {"non_finite_faces", "non-finite faces left out", i->non_finite_faces},
        {"reoriented_faces", "faces turned over", i->reoriented_faces},
        {"nonmanifold_edges", "non-manifold edges cut", i->nonmanifold_edges},
        {"nonmanifold_vertices", "pinched vertices split", i->nonmanifold_vertices},
        {"copied_vertices", "vertices copied for that", i->copied_vertices},
    };
    memcpy(out, counts, sizeof counts);
}

void json_begin_repairs(Json* json, const Loaded* loaded) {
    Count counts[kRepairCount];
    repairs_of(loaded, counts);
    json_begin_object(json, "repairs");
    for (int i = 0; i < kRepairCount; ++i) json_integer(json, counts[i].key, counts[i].value);
}

void json_layers(Json* json, const Loaded* loaded, const Names* lost) {
    static const char* const domains[] = {"vertex", "corner", "face"};
    json_begin_list(json, "layers");
    for (int32_t i = 0; i < loaded->file.layers.count; ++i) {
        const Layer* layer = &loaded->file.layers.items[i];
        json_begin_object(json, NULL);
        json_string(json, "name", layer_name(layer));
        json_string(json, "kind", layer_kind_name(layer->kind));
        json_string(json, "domain", domains[layer->domain]);
        json_integer(json, "components", layer->components);
        if (loaded->borders && loaded->borders[i] >= 0) json_integer(json, "border_edges", loaded->borders[i]);
        json_end_object(json);
    }
    json_end_list(json);
    if (!lost) return;
    json_begin_list(json, "lost");
    for (int32_t i = 0; i < lost->count; ++i) json_string(json, NULL, names_at(lost, i));
    json_end_list(json);
}

void say_lost(const Session* session, const char* path) {
    const Names* lost = &session->carry.lost;
    for (int32_t i = 0; i < lost->count; ++i) fprintf(stderr, "delmesh: %s: lost: %s\n", path, names_at(lost, i));
}

void print_layers(const Loaded* loaded) {
    const Layers* layers = &loaded->file.layers;
    if (layers->count == 0) return;
    printf("  %-26s ", "layers");
    for (int32_t i = 0; i < layers->count; ++i) {
        printf("%s", i > 0 ? ", " : "");
        for (const char* at = layer_name(&layers->items[i]); *at; ++at)
            putchar((unsigned char)*at < 32 || *at == 127 ? '?' : *at);
        if (loaded->borders[i] >= 0) printf(" (%lld border edges)", (long long)loaded->borders[i]);
    }
    printf("\n");
}

void json_counts(Json* json, const delmesh_mesh_info* info) {
    json_integer(json, "vertices", info->vertices);
    json_integer(json, "faces", info->faces);
    json_integer(json, "edges", info->edges);
    json_integer(json, "boundary_edges", info->boundary_edges);
    json_integer(json, "components", info->components);
    json_integer(json, "boundary_loops", info->boundary_loops);
    json_integer(json, "euler_characteristic", info->euler_characteristic);
}

void json_quality(Json* json, const delmesh_quality_report* q) {
    json_double(json, "min_angle", q->min_angle);
    json_double(json, "max_angle", q->max_angle);
    json_double(json, "mean_min_angle", q->mean_min_angle);
    json_double(json, "percent_below_30", q->percent_below_30);
    json_double(json, "percent_above_120", q->percent_above_120);
    json_double(json, "min_edge", q->min_edge);
    json_double(json, "max_edge", q->max_edge);
    json_double(json, "mean_edge", q->mean_edge);
    json_double(json, "area", q->area);
    json_double(json, "diagonal", q->diagonal);
    json_integer(json, "negative_cotangents", q->negative_cotangents);
    json_integer(json, "max_valence", q->max_valence);
    json_begin_array(json, "angle_histogram");
    for (size_t i = 0; i < sizeof q->angle_histogram / sizeof *q->angle_histogram; ++i)
        json_integer(json, NULL, q->angle_histogram[i]);
    json_end_array(json);
}

void json_deviation(Json* json, const delmesh_distance_report* d) {
    json_begin_object(json, "deviation");
    json_double(json, "hausdorff_sampled", d->hausdorff_sampled);
    if (d->hausdorff_bound >= 0) json_double(json, "hausdorff_bound", d->hausdorff_bound);
    json_double(json, "rms", d->rms);
    json_double(json, "diagonal", d->diagonal);
    json_double(json, "hausdorff_percent", d->hausdorff_percent);
    json_double(json, "rms_percent", d->rms_percent);
    json_double(json, "a_to_b_max", d->a_to_b_max);
    json_double(json, "a_to_b_rms", d->a_to_b_rms);
    json_double(json, "b_to_a_max", d->b_to_a_max);
    json_double(json, "b_to_a_rms", d->b_to_a_rms);
    json_double(json, "normal_deviation_mean", d->normal_deviation_mean);
    json_double(json, "normal_deviation_max", d->normal_deviation_max);
    json_double(json, "seconds", d->seconds);
    json_end_object(json);
}

void print_count(const char* label, int64_t count) {
    char digits[kTextDoubleSize], grouped[2 * kTextDoubleSize];
    size_t length = text_print_integer(digits, count), n = 0;
    for (size_t i = 0; i < length; ++i) {
        grouped[n++] = digits[i];
        if ((length - i) % 3 == 1 && i + 1 < length && digits[i] != '-') grouped[n++] = ',';
    }
    grouped[n] = '\0';
    printf("  %-26s%16s\n", label, grouped);
}

void print_quality_head(void) {
    printf("  %-12s%10s%10s%10s%10s%14s\n", "angles", "smallest", "largest", "< 30", "> 120", "mean smallest");
}

void print_quality(const char* label, const delmesh_quality_report* q) {
    printf("  %-12s%10.3f%10.3f%8.1f %%%8.1f %%%14.1f\n", label, q->min_angle, q->max_angle, q->percent_below_30,
           q->percent_above_120, q->mean_min_angle);
}

void print_deviation(const delmesh_distance_report* d) {
    const double percent = d->diagonal > 0 ? 100 / d->diagonal : 0;
    printf("  %-12s%16s%18s\n", "distance", "model units", "% of the diagonal");
    printf("  %-12s%16.6g%18.6f\n", "largest", d->hausdorff_sampled, d->hausdorff_sampled * percent);
    if (d->hausdorff_bound >= 0) printf("  %-12s%16.6g%18.6f\n", "at most", d->hausdorff_bound, d->hausdorff_bound * percent);
    printf("  %-12s%16.6g%18.6f\n", "rms", d->rms, d->rms * percent);
}

void print_repairs(const Loaded* loaded) {
    Count counts[kRepairCount];
    repairs_of(loaded, counts);
    for (int i = 0; i < kRepairCount; ++i)
        if (counts[i].value > 0) print_count(counts[i].label, counts[i].value);
}
