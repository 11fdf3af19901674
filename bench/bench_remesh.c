/* SPDX-License-Identifier: Apache-2.0
 *
 * bench_remesh.c: what a host waits for: arrays in, certified Delaunay arrays out, through the C interface.
 *     bench_remesh [--mode preserve|flip|feature] [--precision f32|f64] [--tolerance L] [--effort N] [--threads N]
 *                  [--repeat N] [--subdivide N] [--map 0|1] [--fresh 0|1] [--phases] FILE...
 * The timed part is delmesh_mesh_create, delmesh_remesh (with its certificate) and the reads of positions and corner vertices;
 * reading the file is not. Printed per file: the best of the repetitions, in milliseconds and nanoseconds per input edge, where
 * that run spent it, and the allocator's peak in bytes per input triangle (input and output mesh included).
 * --phases: a table per file instead, in nanoseconds per input edge, for one thread and for N (2 if not told), taking turns, with
 * the speed-up; for the modes flip and preserve, or for the one told.
 * --subdivide N: cuts every triangle into four, N times (subdivide.h).
 * --fresh 1: the arrays for the result are new in each run, and their first touch is part of the read. Without, the host keeps them.
 */
#include "mesh_file.h"
#include "subdivide.h"

#include <delmesh/delmesh.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct Sample {
    double total, create, remesh, read; /* seconds */
    double certificate;                 /* seconds of one more, after the clock has stopped */
    int64_t edges, faces;
    uint64_t peak;
    delmesh_remesh_report report;
} Sample;

/* What the host takes the result in. */
typedef struct HostArrays {
    void* data[2];
    size_t size[2];
} HostArrays;

typedef struct Settings {
    delmesh_remesh_options options;
    bool mode_told, phases, fresh;
    int threads, repeat, subdivide;
} Settings;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static delmesh_view view(const void* data, int64_t count, int32_t type, int32_t components) {
    const delmesh_view v = {data, count, 0, type, components};
    return v;
}

static void free_arrays(HostArrays* arrays) {
    for (int i = 0; i < 2; ++i) free(arrays->data[i]);
    memset(arrays, 0, sizeof *arrays);
}

/* Room for `size` bytes, touched; the seconds that took. */
static double make_room(HostArrays* arrays, int which, size_t size) {
    if (arrays->size[which] >= size) return 0;
    const double begin = now();
    free(arrays->data[which]);
    arrays->data[which] = malloc(size);
    memset(arrays->data[which], 1, size);
    arrays->size[which] = size;
    return now() - begin;
}

static int32_t run_in(delmesh_context* context, const MeshFile* file, const delmesh_remesh_options* options, bool fresh,
                      HostArrays* arrays, Sample* sample) {
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = view(file->positions, file->vertex_count, file->precision, 3);
    desc.corner_verts = view(file->corner_verts, file->corner_count, DELMESH_INT32, 1);
    if (file->face_sizes != NULL) desc.face_sizes = view(file->face_sizes, file->face_count, DELMESH_INT32, 1);
    delmesh_mesh *in = NULL, *out = NULL;
    delmesh_remesh_report_init(&sample->report, sizeof sample->report);
    const double begin = now();
    int32_t status = delmesh_mesh_create(context, &desc, &in);
    const double created = now();
    if (status == DELMESH_OK) status = delmesh_remesh(context, in, options, &out, &sample->report);
    const double remeshed = now();
    delmesh_mesh_info info;
    delmesh_mesh_info_init(&info, sizeof info);
    if (status == DELMESH_OK) status = delmesh_mesh_get_info(out, &info);
    const size_t size = options->precision == DELMESH_FLOAT32 ? sizeof(float) : sizeof(double);
    const size_t positions_size = (size_t)(3 * info.vertices) * size + 1;
    const size_t corners_size = (size_t)info.corners * sizeof(int32_t) + 1;
    void *new_positions = NULL, *new_corners = NULL;
    double not_counted = 0;
    if (fresh) {
        new_positions = malloc(positions_size);
        new_corners = malloc(corners_size);
    } else {
        not_counted = make_room(arrays, 0, positions_size) + make_room(arrays, 1, corners_size);
    }
    const delmesh_view_mut positions_out = {fresh ? new_positions : arrays->data[0], info.vertices, 0, options->precision, 3};
    const delmesh_view_mut corners_out = {fresh ? new_corners : arrays->data[1], info.corners, 0, DELMESH_INT32, 1};
    if (status == DELMESH_OK) status = delmesh_mesh_read(out, DELMESH_POSITION, &positions_out);
    if (status == DELMESH_OK) status = delmesh_mesh_read(out, DELMESH_CORNER_VERT, &corners_out);
    const double end = now() - not_counted;
    free(new_corners);
    free(new_positions);
    if (status == DELMESH_OK) status = delmesh_mesh_get_info(in, &info);
    sample->total = end - begin;
    sample->create = created - begin;
    sample->remesh = remeshed - created;
    sample->read = end - remeshed;
    sample->edges = info.edges;
    sample->faces = info.faces;
    delmesh_context_memory(context, NULL, &sample->peak, NULL);
    delmesh_certify_options certify_options;
    delmesh_certify_options_init(&certify_options, sizeof certify_options);
    certify_options.boundary = options->boundary;
    delmesh_certify_report certify_report;
    delmesh_certify_report_init(&certify_report, sizeof certify_report);
    if (status == DELMESH_OK) status = delmesh_certify(context, out, &certify_options, &certify_report);
    sample->certificate = certify_report.seconds;
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
    return status;
}

/* One run in a context of its own; *best is replaced if this one was faster (or the first: its total is 0 then). */
static bool run_once(const char* path, const MeshFile* file, const delmesh_remesh_options* options, bool fresh, int threads,
                     HostArrays* arrays, Sample* best) {
    delmesh_context_options context_options;
    delmesh_context_options_init(&context_options, sizeof context_options);
    context_options.max_threads = threads;
    delmesh_context* context = NULL;
    int32_t status = delmesh_context_create(&context_options, &context);
    Sample sample = {0};
    if (status == DELMESH_OK) status = run_in(context, file, options, fresh, arrays, &sample);
    if (status != DELMESH_OK) fprintf(stderr, "%s: %s: %s\n", path, delmesh_status_name(status), delmesh_last_error(context));
    if (best->total == 0 || sample.total < best->total) *best = sample;
    delmesh_context_destroy(context);
    return status == DELMESH_OK;
}

static const char* base_name(const char* path) {
    const char* slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

static bool print_row(const char* path, const MeshFile* file, const Settings* settings) {
    Sample best = {0};
    HostArrays arrays = {0};
    bool ok = true;
    for (int i = 0; ok && i < settings->repeat; ++i)
        ok = run_once(path, file, &settings->options, settings->fresh, settings->threads, &arrays, &best);
    free_arrays(&arrays);
    if (!ok) return false;
    printf("%-30s %9lld %8lld %8lld %9.2f %8.1f %8.2f %8.2f %8.2f %8.2f %8.2f %8.1f\n", base_name(path), (long long)best.edges,
           (long long)(best.report.flips + best.report.flips_after), (long long)best.report.splits, 1e3 * best.total,
           1e9 * best.total / (double)best.edges, 1e3 * best.create, 1e3 * best.report.seconds_flip,
           1e3 * best.report.seconds_split, 1e3 * best.report.seconds_certify, 1e3 * best.read,
           (double)best.peak / (double)best.faces);
    return true;
}

enum { kImport, kCopy, kLoop, kFinish, kExport, kTotal, kCertificate, kPhaseCount };

static void phases_of(const Sample* sample, double phases[kPhaseCount]) {
    phases[kImport] = sample->create;
    phases[kLoop] = sample->report.seconds_flip + sample->report.seconds_split;
    phases[kFinish] = sample->report.seconds_certify;
    phases[kCopy] = sample->remesh - phases[kLoop] - phases[kFinish];
    phases[kExport] = sample->read;
    phases[kTotal] = sample->total;
    phases[kCertificate] = sample->certificate;
}

static bool print_phases(const char* path, const MeshFile* file, const Settings* settings, int32_t mode) {
    const int threads[2] = {1, settings->threads > 1 ? settings->threads : 2};
    delmesh_remesh_options options = settings->options;
    options.mode = mode;
    Sample best[2];
    memset(best, 0, sizeof best);
    HostArrays arrays = {0};
    bool ok = true;
    for (int i = 0; ok && i < settings->repeat; ++i) /* taking turns: whatever else the machine does, it does to both */
        for (int t = 0; ok && t < 2; ++t) ok = run_once(path, file, &options, settings->fresh, threads[t], &arrays, &best[t]);
    free_arrays(&arrays);
    if (!ok) return false;
    const char* name = mode == DELMESH_MODE_FLIP ? "flip" : mode == DELMESH_MODE_PRESERVE ? "preserve" : "feature";
    printf("%s: %lld edges, %lld faces, %s, %s; %lld flips, %lld splits; best of %d\n", base_name(path), (long long)best[0].edges,
           (long long)best[0].faces, name, options.precision == DELMESH_FLOAT64 ? "float64" : "float32",
           (long long)(best[0].report.flips + best[0].report.flips_after), (long long)best[0].report.splits, settings->repeat);
    printf("  %-12s %8s %8s %8s %8s %8s %8s %8s %8s\n", "ns/edge", "import", "copy", "loop", "finish", "export", "total",
           "(certif)", "B/tri");
    double phases[2][kPhaseCount];
    for (int t = 0; t < 2; ++t) {
        phases_of(&best[t], phases[t]);
        printf("  %2d thread%-3s", threads[t], threads[t] > 1 ? "s" : "");
        for (int p = 0; p < kPhaseCount; ++p) printf(" %8.1f", 1e9 * phases[t][p] / (double)best[t].edges);
        printf(" %8.1f\n", (double)best[t].peak / (double)best[t].faces);
    }
    printf("  %-12s", "speed-up");
    for (int p = 0; p < kPhaseCount; ++p) printf(" %8.2f", phases[0][p] / phases[1][p]);
    printf("\n");
    return true;
}

static bool bench_file(const char* path, const Settings* settings) {
    MeshFile file;
    if (!read_subdivided(path, settings->subdivide, &file)) return false;
    bool ok;
    if (!settings->phases)
        ok = print_row(path, &file, settings);
    else if (settings->mode_told)
        ok = print_phases(path, &file, settings, settings->options.mode);
    else
        ok = print_phases(path, &file, settings, DELMESH_MODE_FLIP) && print_phases(path, &file, settings, DELMESH_MODE_PRESERVE);
    mesh_file_free(&file);
    return ok;
}

/* One option with its value; false if there is no such option. */
static bool set_option(Settings* settings, const char* name, const char* value) {
    if (strcmp(name, "--mode") == 0) {
        settings->mode_told = true;
        settings->options.mode = strcmp(value, "preserve") == 0  ? DELMESH_MODE_PRESERVE
                                 : strcmp(value, "feature") == 0 ? DELMESH_MODE_FEATURE
                                                                 : DELMESH_MODE_FLIP;
    } else if (strcmp(name, "--precision") == 0)
        settings->options.precision = strcmp(value, "f64") == 0 ? DELMESH_FLOAT64 : DELMESH_FLOAT32;
    else if (strcmp(name, "--tolerance") == 0)
        settings->options.tolerance = atof(value);
    else if (strcmp(name, "--effort") == 0)
        settings->options.effort = atoi(value);
    else if (strcmp(name, "--threads") == 0)
        settings->threads = atoi(value);
    else if (strcmp(name, "--repeat") == 0)
        settings->repeat = atoi(value);
    else if (strcmp(name, "--subdivide") == 0)
        settings->subdivide = atoi(value);
    else if (strcmp(name, "--map") == 0)
        settings->options.map = atoi(value);
    else if (strcmp(name, "--fresh") == 0)
        settings->fresh = atoi(value) != 0;
    else
        return false;
    return true;
}

int main(int argc, char** argv) {
    Settings settings = {.threads = 1, .repeat = 7};
    delmesh_remesh_options_init(&settings.options, sizeof settings.options);
    settings.options.mode = DELMESH_MODE_FLIP;
    int at = 1;
    bool ok = true;
    while (ok && at < argc && argv[at][0] == '-') {
        settings.phases |= strcmp(argv[at], "--phases") == 0;
        if (strcmp(argv[at], "--phases") == 0)
            at += 1;
        else if (at + 1 < argc && set_option(&settings, argv[at], argv[at + 1]))
            at += 2;
        else
            ok = false;
    }
    if (!ok || at >= argc || settings.repeat < 1) {
        fprintf(stderr, "usage: bench_remesh [--mode preserve|flip|feature] [--precision f32|f64] [--tolerance L] [--effort N]\n"
                        "                    [--threads N] [--repeat N] [--subdivide N] [--map 0|1] [--fresh 0|1] [--phases]\n"
                        "                    FILE...\n");
        return 2;
    }
    if (!settings.phases)
        printf("%-30s %9s %8s %8s %9s %8s %8s %8s %8s %8s %8s %8s\n", "mesh", "edges", "flips", "splits", "ms", "ns/edge",
               "create", "flip", "split", "certify", "read", "B/tri");
    int failed = 0;
    for (; at < argc; ++at) failed |= !bench_file(argv[at], &settings);
    return failed;
}
