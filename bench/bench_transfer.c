/* SPDX-License-Identifier: Apache-2.0
 *
 * bench_transfer.c: what carrying layers over to a result costs, through the C interface.
 *     bench_transfer [--threads N] [--layers N] [--repeat N] [--subdivide N] [--flip] FILE...
 * The layers, 8 if not told, are float32 with 4 components each at the corners, all of them memory of their own that was touched
 * before. To the mesh as it was imported, or with --flip to the result of that mode with its map. Printed per file: the best of the
 * repetitions for all layers, in milliseconds, and gigabytes per second read and written.
 */
#include "mesh_file.h"
#include "subdivide.h"

#include <delmesh/delmesh.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { COMPONENTS = 4 };

typedef struct Settings {
    int threads, layers, repeat, subdivide;
    bool flip;
} Settings;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int32_t make_meshes(delmesh_context* context, const MeshFile* file, bool flip, delmesh_mesh** in, delmesh_mesh** out) {
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){file->positions, file->vertex_count, 0, file->precision, 3};
    desc.corner_verts = (delmesh_view){file->corner_verts, file->corner_count, 0, DELMESH_INT32, 1};
    if (file->face_sizes != NULL) desc.face_sizes = (delmesh_view){file->face_sizes, file->face_count, 0, DELMESH_INT32, 1};
    delmesh_remesh_options options;
    delmesh_remesh_options_init(&options, sizeof options);
    options.mode = DELMESH_MODE_FLIP;
    options.map = 1;
    int32_t status = delmesh_mesh_create(context, &desc, in);
    if (status == DELMESH_OK && flip) status = delmesh_remesh(context, *in, &options, out, NULL);
    return status;
}

static int32_t bench_mesh(delmesh_context* context, const delmesh_mesh* mesh, int64_t source_corners, const Settings* settings,
                          const char* path) {
    delmesh_mesh_info info;
    delmesh_mesh_info_init(&info, sizeof info);
    int32_t status = delmesh_mesh_get_info(mesh, &info);
    const size_t from_size = (size_t)source_corners * COMPONENTS, to_size = (size_t)info.corners * COMPONENTS;
    float* from = malloc((size_t)settings->layers * from_size * sizeof *from);
    float* to = malloc((size_t)settings->layers * to_size * sizeof *to);
    if (from == NULL || to == NULL) status = DELMESH_ERROR_OUT_OF_MEMORY;
    for (size_t i = 0; status == DELMESH_OK && i < (size_t)settings->layers * from_size; ++i) from[i] = (float)(i % 1021);
    if (status == DELMESH_OK) memset(to, 0, (size_t)settings->layers * to_size * sizeof *to);
    double best = 0;
    for (int r = 0; r < settings->repeat && status == DELMESH_OK; ++r) {
        const double begin = now();
        for (int l = 0; l < settings->layers && status == DELMESH_OK; ++l) {
            const delmesh_view source = {from + (size_t)l * from_size, source_corners, 0, DELMESH_FLOAT32, COMPONENTS};
            const delmesh_view_mut target = {to + (size_t)l * to_size, info.corners, 0, DELMESH_FLOAT32, COMPONENTS};
            status = delmesh_transfer(context, mesh, DELMESH_DOMAIN_CORNER, DELMESH_TRANSFER_LINEAR, &source, &target);
        }
        const double seconds = now() - begin;
        if (best == 0 || seconds < best) best = seconds;
    }
    if (status == DELMESH_OK)
        printf("%-40s %10lld corners %3d layers %9.2f ms %7.2f GB/s\n", path, (long long)info.corners, settings->layers,
               1e3 * best, (double)settings->layers * (double)(from_size + to_size) * sizeof(float) / best * 1e-9);
    free(to);
    free(from);
    return status;
}

static bool bench_file(const char* path, const Settings* settings) {
    MeshFile file;
    if (!read_subdivided(path, settings->subdivide, &file)) return false;
    delmesh_context_options options;
    delmesh_context_options_init(&options, sizeof options);
    options.max_threads = settings->threads;
    delmesh_context* context = NULL;
    delmesh_mesh *in = NULL, *out = NULL;
    int32_t status = delmesh_context_create(&options, &context);
    if (status == DELMESH_OK) status = make_meshes(context, &file, settings->flip, &in, &out);
    if (status == DELMESH_OK) status = bench_mesh(context, out != NULL ? out : in, file.corner_count, settings, path);
    if (context != NULL && status != DELMESH_OK)
        fprintf(stderr, "%s: %s: %s\n", path, delmesh_status_name(status), delmesh_last_error(context));
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
    delmesh_context_destroy(context);
    mesh_file_free(&file);
    return status == DELMESH_OK;
}

int main(int argc, char** argv) {
    Settings settings = {.threads = 2, .layers = 8, .repeat = 7};
    int at = 1;
    bool ok = true;
    while (ok && at < argc && argv[at][0] == '-') {
        const bool value = at + 1 < argc;
        if (strcmp(argv[at], "--flip") == 0)
            settings.flip = true;
        else if (value && strcmp(argv[at], "--threads") == 0)
            settings.threads = atoi(argv[++at]);
        else if (value && strcmp(argv[at], "--layers") == 0)
            settings.layers = atoi(argv[++at]);
        else if (value && strcmp(argv[at], "--repeat") == 0)
            settings.repeat = atoi(argv[++at]);
        else if (value && strcmp(argv[at], "--subdivide") == 0)
            settings.subdivide = atoi(argv[++at]);
        else
            ok = false;
        ++at;
    }
    if (!ok || at >= argc || settings.repeat < 1 || settings.layers < 1) {
        fprintf(stderr, "usage: bench_transfer [--threads N] [--layers N] [--repeat N] [--subdivide N] [--flip] FILE...\n");
        return 2;
    }
    bool all = true;
    for (; at < argc; ++at) all &= bench_file(argv[at], &settings);
    return all ? 0 : 1;
}
