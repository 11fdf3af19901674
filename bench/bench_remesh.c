/* SPDX-License-Identifier: Apache-2.0
 *
 * bench_remesh.c: what a host waits for: arrays in, certified Delaunay arrays out, through the C interface.
 *     bench_remesh [--mode preserve|flip|feature] [--precision f32|f64] [--threads N] [--repeat N] FILE...
 * The timed part is delmesh_mesh_create, delmesh_remesh (with its certificate) and the reads of positions and corner vertices;
 * reading the file is not. Printed per file: the best of the repetitions, in milliseconds and nanoseconds per input edge, where
 * that run spent it, and the allocator's peak in bytes per input triangle (input and output mesh included).
 */
#include "mesh_file.h"

#include <delmesh/delmesh.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct Sample {
    double total, create, remesh, read; /* seconds */
    int64_t edges, faces;
    uint64_t peak;
    delmesh_remesh_report report;
} Sample;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static delmesh_view view(const void* data, int64_t count, int32_t type, int32_t components) {
    const delmesh_view v = {data, count, 0, type, components};
    return v;
}

static int32_t run_once(delmesh_context* context, const MeshFile* file, const delmesh_remesh_options* options, Sample* sample) {
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
    void* positions = malloc((size_t)(3 * info.vertices) * size + 1);
    int32_t* corners = malloc((size_t)info.corners * sizeof(int32_t) + 1);
    const delmesh_view_mut positions_out = {positions, info.vertices, 0, options->precision, 3};
    const delmesh_view_mut corners_out = {corners, info.corners, 0, DELMESH_INT32, 1};
    if (status == DELMESH_OK) status = delmesh_mesh_read(out, DELMESH_POSITION, &positions_out);
    if (status == DELMESH_OK) status = delmesh_mesh_read(out, DELMESH_CORNER_VERT, &corners_out);
    const double end = now();
    free(corners);
    free(positions);
    if (status == DELMESH_OK) status = delmesh_mesh_get_info(in, &info);
    sample->total = end - begin;
    sample->create = created - begin;
    sample->remesh = remeshed - created;
    sample->read = end - remeshed;
    sample->edges = info.edges;
    sample->faces = info.faces;
    delmesh_context_memory(context, NULL, &sample->peak, NULL);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
    return status;
}

static int bench_file(const char* path, const delmesh_remesh_options* options, int threads, int repeat) {
    Failure failure = {NULL, ""};
    MeshFile file;
    if (!mesh_file_read(path, true, &file, &failure)) {
        fprintf(stderr, "%s\n", failure.text);
        return 1;
    }
    Sample best = {0};
    int32_t status = DELMESH_OK;
    for (int i = 0; i < repeat && status == DELMESH_OK; ++i) {
        delmesh_context_options context_options;
        delmesh_context_options_init(&context_options, sizeof context_options);
        context_options.max_threads = threads;
        delmesh_context* context = NULL;
        status = delmesh_context_create(&context_options, &context);
        Sample sample = {0};
        if (status == DELMESH_OK) status = run_once(context, &file, options, &sample);
        if (status != DELMESH_OK) fprintf(stderr, "%s: %s: %s\n", path, delmesh_status_name(status), delmesh_last_error(context));
        if (i == 0 || sample.total < best.total) best = sample;
        delmesh_context_destroy(context);
    }
    mesh_file_free(&file);
    if (status != DELMESH_OK) return 1;
    const char* name = strrchr(path, '/');
    printf("%-30s %9lld %8lld %8lld %9.2f %8.1f %8.2f %8.2f %8.2f %8.2f %8.2f %8.1f\n", name != NULL ? name + 1 : path,
           (long long)best.edges, (long long)(best.report.flips + best.report.flips_after), (long long)best.report.splits,
           1e3 * best.total, 1e9 * best.total / (double)best.edges, 1e3 * best.create, 1e3 * best.report.seconds_flip,
           1e3 * best.report.seconds_split, 1e3 * best.report.seconds_certify, 1e3 * best.read,
           (double)best.peak / (double)best.faces);
    return 0;
}

int main(int argc, char** argv) {
    delmesh_remesh_options options;
    delmesh_remesh_options_init(&options, sizeof options);
    options.mode = DELMESH_MODE_FLIP;
    int threads = 1, repeat = 7, failed = 0, at = 1;
    for (; at + 1 < argc && argv[at][0] == '-'; at += 2) {
        const char *name = argv[at], *value = argv[at + 1];
        if (strcmp(name, "--mode") == 0)
            options.mode = strcmp(value, "preserve") == 0 ? DELMESH_MODE_PRESERVE
                           : strcmp(value, "feature") == 0 ? DELMESH_MODE_FEATURE : DELMESH_MODE_FLIP;
        else if (strcmp(name, "--precision") == 0)
            options.precision = strcmp(value, "f64") == 0 ? DELMESH_FLOAT64 : DELMESH_FLOAT32;
        else if (strcmp(name, "--threads") == 0)
            threads = atoi(value);
        else if (strcmp(name, "--repeat") == 0)
            repeat = atoi(value);
        else
            break;
    }
    if (at >= argc || argv[at][0] == '-' || repeat < 1) {
        fprintf(stderr, "usage: bench_remesh [--mode preserve|flip|feature] [--precision f32|f64] [--threads N] [--repeat N] FILE...\n");
        return 2;
    }
    printf("%-30s %9s %8s %8s %9s %8s %8s %8s %8s %8s %8s %8s\n", "mesh", "edges", "flips", "splits", "ms", "ns/edge", "create",
           "flip", "split", "certify", "read", "B/tri");
    for (; at < argc; ++at) failed |= bench_file(argv[at], &options, threads, repeat);
    return failed;
}
