/* SPDX-License-Identifier: Apache-2.0
 * The library as a plug-in: opened at run time by a plain C program, gone without a trace when it is closed, and twice in one
 * process without the copies knowing of each other. This program does not link the library; its path is the first argument. */
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <dlfcn.h>
#include <malloc.h>
#include <unistd.h>

#include <delmesh/delmesh.h>

static const char* library_path;
static char copy_path[4096];

static int mapped(const char* name) {
    FILE* maps = fopen("/proc/self/maps", "r");
    assert_non_null(maps);
    char line[4096];
    int found = 0;
    while (fgets(line, sizeof line, maps) != NULL) found += strstr(line, name) != NULL;
    fclose(maps);
    return found;
}

static int threads_alive(void) {
    FILE* status = fopen("/proc/self/status", "r");
    assert_non_null(status);
    char line[256];
    int threads = -1;
    while (fgets(line, sizeof line, status) != NULL)
        if (sscanf(line, "Threads: %d", &threads) == 1) break;
    fclose(status);
    return threads;
}

static const delmesh_api* open_library(const char* path, void** library) {
    *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (*library == NULL) fail_msg("%s", dlerror());
    const delmesh_api* (*get_api)(uint32_t) = NULL;
    *(void**)&get_api = dlsym(*library, "delmesh_get_api");
    assert_non_null(get_api);
    const delmesh_api* api = get_api(DELMESH_ABI_VERSION);
    assert_non_null(api);
    return api;
}

typedef struct {
    const delmesh_api* api;
    delmesh_context* context;
    delmesh_mesh *in, *out;
} Session;

enum { SIDE = 200 };

/* Large enough for own threads to be started: a leaning sheet, remeshed and certified. */
static Session start(const delmesh_api* api) {
    Session s = {api, NULL, NULL, NULL};
    float* positions = malloc(sizeof(float[3]) * SIDE * SIDE);
    int32_t* corners = malloc(sizeof(int32_t[6]) * (SIDE - 1) * (SIDE - 1));
    int32_t* c = corners;
    for (int32_t y = 0; y < SIDE; ++y)
        for (int32_t x = 0; x < SIDE; ++x) {
            float* p = positions + 3 * (y * SIDE + x);
            p[0] = (float)x + 0.75f * (float)y, p[1] = (float)y, p[2] = (float)((x * x + y) % 5) / 4;
            if (x + 1 == SIDE || y + 1 == SIDE) continue;
            const int32_t a = y * SIDE + x, quad[6] = {a, a + 1, a + SIDE + 1, a, a + SIDE + 1, a + SIDE};
            memcpy(c, quad, sizeof quad);
            c += 6;
        }
    delmesh_context_options options;
    api->context_options_init(&options, sizeof options);
    options.max_threads = 4;
    assert_int_equal(api->context_create(&options, &s.context), DELMESH_OK);
    delmesh_mesh_desc desc;
    api->mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){positions, SIDE * SIDE, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){corners, 2 * (SIDE - 1) * (SIDE - 1), 0, DELMESH_INT32, 3};
    assert_int_equal(api->mesh_create(s.context, &desc, &s.in), DELMESH_OK);
    free(positions);
    free(corners);
    delmesh_remesh_options remesh;
    api->remesh_options_init(&remesh, sizeof remesh);
    remesh.mode = DELMESH_MODE_FLIP;
    assert_int_equal(api->remesh(s.context, s.in, &remesh, &s.out, NULL), DELMESH_OK);
    return s;
}

static void assert_delaunay(const Session* s) {
    delmesh_certify_report report;
    s->api->certify_report_init(&report, sizeof report);
    assert_int_equal(s->api->certify(s->context, s->out, NULL, &report), DELMESH_OK);
    assert_int_equal(report.delaunay, 1);
}

static void finish(Session* s) {
    s->api->mesh_destroy(s->out);
    s->api->mesh_destroy(s->in);
    s->api->context_destroy(s->context);
}

static void no_cpp_runtime_is_brought_in(void** state) {
    (void)state;
#if !defined(DELMESH_STATIC_RUNTIME)
    skip();
#endif
    void* library;
    assert_int_equal(mapped("libstdc++"), 0); /* nor has this program one */
    open_library(library_path, &library);
    assert_true(mapped(library_path) > 0);
    assert_int_equal(mapped("libstdc++"), 0);
    dlclose(library);
}

static void nothing_stays_after_closing(void** state) {
    (void)state;
#if defined(DELMESH_SANITIZED)
    skip(); /* the sanitizers' own runtime keeps libraries mapped */
#endif
    size_t in_use = 0;
    for (int round = 0; round < 6; ++round) {
        void* library;
        Session s = start(open_library(library_path, &library));
        assert_true(threads_alive() > 1); /* the run did start threads */
        assert_delaunay(&s);
        finish(&s);
        assert_int_equal(threads_alive(), 1);
        dlclose(library);
        assert_int_equal(mapped(library_path), 0);
        if (round == 2) in_use = mallinfo2().uordblks;
    }
    /* Nor does memory. malloc's own caches make the figure wander by a few kilobytes; the C++ runtime's pool alone has 72. */
    assert_true(mallinfo2().uordblks < in_use + 3 * 16384);
}

static void two_copies_in_one_process(void** state) {
    (void)state;
    void *first_library, *second_library;
    const delmesh_api* first = open_library(library_path, &first_library);
    const delmesh_api* second = open_library(copy_path, &second_library);
    assert_ptr_not_equal(first, second);
    assert_true(first->remesh != second->remesh);
    Session a = start(first), b = start(second);
    assert_delaunay(&a);
    finish(&a);
    dlclose(first_library);
#if !defined(DELMESH_SANITIZED)
    assert_int_equal(mapped(library_path), 0);
#endif
    assert_delaunay(&b); /* the second is not touched */
    finish(&b);
    b = start(second);
    finish(&b);
    dlclose(second_library);
#if !defined(DELMESH_SANITIZED)
    assert_int_equal(mapped(copy_path), 0);
#endif
}

static int copy_library(void** state) {
    (void)state;
    FILE *from = fopen(library_path, "rb"), *to = fopen(copy_path, "wb");
    if (from == NULL || to == NULL) return -1;
    char block[1 << 16];
    for (size_t n; (n = fread(block, 1, sizeof block, from)) != 0;)
        if (fwrite(block, 1, n, to) != n) return -1;
    fclose(from);
    return fclose(to);
}
static int remove_copy(void** state) {
    (void)state;
    return unlink(copy_path);
}

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    library_path = argv[1];
    snprintf(copy_path, sizeof copy_path, "%s", argv[2]);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_cpp_runtime_is_brought_in),
        cmocka_unit_test(nothing_stays_after_closing),
        cmocka_unit_test(two_copies_in_one_process),
    };
    return cmocka_run_group_tests_name("loading", tests, copy_library, remove_copy);
}
