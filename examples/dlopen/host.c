/* SPDX-License-Identifier: Apache-2.0
 * A host that knows delmesh only as a file: it opens the library named on its command line, finds everything through the one
 * symbol delmesh_get_api, cancels a run at half way, sees that its input is as it was, closes the library, opens it again and
 * finishes. */
#include <delmesh/delmesh.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
static void* load(const char* path) {
    return LoadLibraryA(path);
}
static const char* load_error(void) {
    return "LoadLibrary failed";
}
static void* symbol(void* library, const char* name) {
    return (void*)GetProcAddress(library, name);
}
static void unload(void* library) {
    FreeLibrary(library);
}
#else
#include <dlfcn.h>
static void* load(const char* path) {
    return dlopen(path, RTLD_NOW | RTLD_LOCAL);
}
static const char* load_error(void) {
    return dlerror();
}
static void* symbol(void* library, const char* name) {
    return dlsym(library, name);
}
static void unload(void* library) {
    dlclose(library);
}
#endif

enum { SIDE = 600, VERTS = SIDE * SIDE, FACES = 2 * (SIDE - 1) * (SIDE - 1) };

typedef struct {
    double positions[VERTS][3];
    int32_t corners[FACES][3];
} Terrain;

static Terrain terrain, before;

static void fail(const char* what, const char* detail) {
    fprintf(stderr, "%s: %s\n", what, detail);
    exit(1);
}

static void make_terrain(void) {
    for (int i = 0; i < VERTS; ++i) {
        const double x = i % SIDE, y = i / SIDE;
        terrain.positions[i][0] = x + 0.9 * sin(0.3 * y); /* leaning, so that half of the diagonals are the wrong ones */
        terrain.positions[i][1] = y;
        terrain.positions[i][2] = 6 * sin(0.11 * x) * cos(0.07 * y);
    }
    int32_t* corner = terrain.corners[0];
    for (int32_t y = 0; y + 1 < SIDE; ++y)
        for (int32_t x = 0; x + 1 < SIDE; ++x) {
            const int32_t a = y * SIDE + x, quad[6] = {a, a + 1, a + SIDE, a + 1, a + SIDE + 1, a + SIDE};
            memcpy(corner, quad, sizeof quad);
            corner += 6;
        }
}

static const delmesh_api* open_library(const char* path, void** library) {
    *library = load(path);
    if (*library == NULL) fail(path, load_error());
    const delmesh_api* (*get_api)(uint32_t) = NULL;
    *(void**)&get_api = symbol(*library, "delmesh_get_api");
    const delmesh_api* api = get_api != NULL ? get_api(DELMESH_ABI_VERSION) : NULL;
    if (api == NULL) fail(path, "is no delmesh library of this ABI version");
    return api;
}

typedef struct {
    int stop_half_way, remeshing, stopped;
} Watcher;

static int32_t on_progress(void* user, double fraction, const char* stage) {
    Watcher* watcher = user;
    if (!watcher->stop_half_way || !watcher->remeshing || fraction < 0.5) return DELMESH_CONTINUE;
    printf("stopped at %.0f %% (%s)\n", 100 * fraction, stage);
    watcher->stopped = 1;
    return 0; /* anything but DELMESH_CONTINUE */
}

/* One session with the library: the terrain goes in, is remeshed, and the status of that is returned. */
static int32_t session(const delmesh_api* api, Watcher* watcher) {
    delmesh_context_options context_options;
    api->context_options_init(&context_options, sizeof context_options);
    context_options.progress = on_progress;
    context_options.user = watcher;
    delmesh_context* context = NULL;
    if (api->context_create(&context_options, &context) != DELMESH_OK) fail("context_create", "failed");

    delmesh_mesh_desc desc;
    api->mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){terrain.positions, VERTS, 0, DELMESH_FLOAT64, 3};
    desc.corner_verts = (delmesh_view){terrain.corners, FACES, 0, DELMESH_INT32, 3};
    delmesh_mesh *in = NULL, *out = NULL;
    int32_t status = api->mesh_create(context, &desc, &in);
    if (status == DELMESH_OK) {
        delmesh_remesh_options options;
        delmesh_remesh_report report;
        api->remesh_options_init(&options, sizeof options);
        api->remesh_report_init(&report, sizeof report);
        options.mode = DELMESH_MODE_FLIP;
        options.precision = DELMESH_FLOAT64;
        watcher->remeshing = 1;
        status = api->remesh(context, in, &options, &out, &report);
        if (status == DELMESH_OK)
            printf("done: %lld of %lld edges were not Delaunay, now %lld; %lld vertices\n", (long long)report.nld_in,
                   (long long)(3 * SIDE * SIDE - 4 * SIDE + 1), (long long)report.nld_out, (long long)report.vertices_out);
        else
            printf("%s: %s\n", api->status_name(status), api->last_error(context));
        if ((out != NULL) != (status == DELMESH_OK)) fail("remesh", "left a half-made mesh behind");
        delmesh_view kept;
        if (api->mesh_borrow(in, DELMESH_POSITION, &kept) != DELMESH_OK ||
            memcmp(kept.data, terrain.positions, sizeof terrain.positions) != 0)
            fail("remesh", "changed its input mesh");
    }
    api->mesh_destroy(out);
    api->mesh_destroy(in);
    api->context_destroy(context);
    return status;
}

int main(int argc, char** argv) {
    if (argc != 2) fail("usage", "delmesh_dlopen LIBRARY");
    make_terrain();
    before = terrain;

    void* library;
    const delmesh_api* api = open_library(argv[1], &library);
    Watcher hasty = {1, 0, 0}, patient = {0, 0, 0};
    if (session(api, &hasty) != DELMESH_ERROR_CANCELLED || !hasty.stopped) fail("stop", "was not obeyed");
    if (memcmp(&before, &terrain, sizeof terrain) != 0) fail("stop", "changed the host's arrays");
    printf("the input is as it was\n");
    unload(library);

    api = open_library(argv[1], &library);
    if (session(api, &patient) != DELMESH_OK) fail("second session", "failed");
    if (memcmp(&before, &terrain, sizeof terrain) != 0) fail("remesh", "changed the host's arrays");
    unload(library);
    return 0;
}
