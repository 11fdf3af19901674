/* SPDX-License-Identifier: Apache-2.0
 * Threads: the same bytes with any number of them, callbacks on the caller's alone, the host's own pool, contexts side by side,
 * meshes read from everywhere, cancelling from outside, and no second call into a busy context. Meant for ThreadSanitizer too. */
#include "support.h"

#include <unistd.h>

/* Large enough for the library to cut its loops into several blocks. */
enum { SIDE = 100 };

static delmesh_mesh* remeshed(delmesh_context* context, const delmesh_mesh* in, int32_t mode) {
    delmesh_remesh_options options;
    delmesh_remesh_options_init(&options, sizeof options);
    options.mode = mode;
    delmesh_mesh* out = NULL;
    assert_status(delmesh_remesh(context, in, &options, &out, NULL), context, DELMESH_OK);
    return out;
}

/* Everything a context can be asked about a shape, as one snapshot of the remeshed mesh and the figures of the measurements. */
typedef struct {
    Snapshot mesh;
    delmesh_certify_report certificate;
    delmesh_quality_report quality;
    delmesh_distance_report distance;
} Results;

static Results all_results(delmesh_context* context, const Shape* shape, int32_t mode) {
    Results results;
    memset(&results, 0, sizeof results);
    delmesh_certify_report_init(&results.certificate, sizeof results.certificate);
    delmesh_quality_report_init(&results.quality, sizeof results.quality);
    delmesh_distance_report_init(&results.distance, sizeof results.distance);
    delmesh_mesh* in = shape_mesh(context, shape);
    delmesh_mesh* out = remeshed(context, in, mode);
    delmesh_distance_options options;
    delmesh_distance_options_init(&options, sizeof options);
    options.samples = 5000;
    options.compute_bound = 0;
    assert_status(delmesh_certify(context, in, NULL, &results.certificate), context, DELMESH_OK);
    assert_status(delmesh_measure_quality(context, in, &results.quality), context, DELMESH_OK);
    assert_status(delmesh_measure_distance(context, in, out, &options, &results.distance), context, DELMESH_OK);
    results.certificate.seconds = results.distance.seconds = 0;
    results.mesh = take_snapshot(out);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
    return results;
}

static void assert_same_results(const Results* a, const Results* b) {
    assert_same_snapshot(a->mesh, b->mesh);
    assert_memory_equal(&a->certificate, &b->certificate, sizeof a->certificate);
    assert_memory_equal(&a->quality, &b->quality, sizeof a->quality);
    assert_memory_equal(&a->distance, &b->distance, sizeof a->distance);
}

static void same_bytes_with_any_number_of_threads(void** state) {
    (void)state;
    Shape shape = sheet_shape(SIDE);
    for (int32_t mode = DELMESH_MODE_PRESERVE; mode <= DELMESH_MODE_FEATURE; ++mode) {
        Results first = {0};
        static const int32_t threads[] = {1, 1, 2, 4};
        for (size_t i = 0; i < sizeof threads / sizeof *threads; ++i) {
            Host host; /* it also checks that its callbacks come on this thread */
            delmesh_context* context = host_context(&host, threads[i]);
            Results results = all_results(context, &shape, mode);
            delmesh_context_destroy(context);
            assert_nothing_left(&host);
            assert_true(host.progress_calls > 0);
            if (i == 0) {
                first = results;
                continue;
            }
            assert_same_results(&first, &results);
            free(results.mesh.bytes);
        }
        free(first.mesh.bytes);
    }
    free_shape(&shape);
}

/* ---- The host's pool ----------------------------------------------------------------------------------------------------- */

typedef struct {
    int64_t runs, tasks; /* of the pool */
} Pool;

typedef struct {
    delmesh_task_fn task;
    void* data;
    int32_t from, to;
} Share;

static void* run_share(void* argument) {
    const Share* share = argument;
    for (int32_t i = share->to - 1; i >= share->from; --i) share->task(share->data, i); /* any order will do */
    return NULL;
}

static void parallel_for(void* user, int32_t count, delmesh_task_fn task, void* task_data) {
    Pool* pool = user;
    pool->runs += 1;
    pool->tasks += count;
    Share shares[3];
    pthread_t threads[3];
    for (int k = 0; k < 3; ++k) {
        shares[k] = (Share){task, task_data, (int32_t)((int64_t)count * k / 3), (int32_t)((int64_t)count * (k + 1) / 3)};
        pthread_create(&threads[k], NULL, run_share, &shares[k]);
    }
    for (int k = 0; k < 3; ++k) pthread_join(threads[k], NULL);
}

static void the_hosts_pool_gives_the_same_bytes(void** state) {
    (void)state;
    Shape shape = sheet_shape(SIDE);
    Host host;
    delmesh_context* context = host_context(&host, 1);
    Results expected = all_results(context, &shape, DELMESH_MODE_FLIP);
    delmesh_context_destroy(context);
    for (int32_t max_threads = 0; max_threads <= 2; ++max_threads) {
        Pool pool = {0, 0};
        delmesh_context_options options;
        delmesh_context_options_init(&options, sizeof options);
        options.max_threads = max_threads;
        options.parallel_for = parallel_for;
        options.user = &pool;
        assert_int_equal(delmesh_context_create(&options, &context), DELMESH_OK);
        Results results = all_results(context, &shape, DELMESH_MODE_FLIP);
        assert_same_results(&expected, &results);
        free(results.mesh.bytes);
        delmesh_context_destroy(context);
        assert_int_equal(pool.runs > 0, max_threads != 1); /* 1: only the calling thread */
        assert_true(pool.tasks >= 2 * pool.runs);
    }
    free(expected.mesh.bytes);
    free_shape(&shape);
}

/* ---- Contexts side by side, meshes for all ------------------------------------------------------------------------------- */

static void* one_of_two_contexts(void* argument) {
    const Shape* shape = argument;
    delmesh_context* context = NULL;
    delmesh_context_options options;
    delmesh_context_options_init(&options, sizeof options);
    options.max_threads = 2;
    Snapshot* snapshot = calloc(1, sizeof *snapshot);
    if (delmesh_context_create(&options, &context) != DELMESH_OK) return snapshot;
    for (int round = 0; round < 2; ++round) {
        delmesh_mesh* in = shape_mesh(context, shape);
        delmesh_mesh* out = remeshed(context, in, DELMESH_MODE_FLIP);
        free(snapshot->bytes);
        *snapshot = take_snapshot(out);
        delmesh_mesh_destroy(out);
        delmesh_mesh_destroy(in);
    }
    delmesh_context_destroy(context);
    return snapshot;
}

static void two_contexts_in_two_threads(void** state) {
    (void)state;
    Shape shape = sheet_shape(80);
    pthread_t threads[2];
    Snapshot* snapshots[2];
    for (int t = 0; t < 2; ++t) assert_int_equal(pthread_create(&threads[t], NULL, one_of_two_contexts, &shape), 0);
    for (int t = 0; t < 2; ++t) pthread_join(threads[t], (void**)&snapshots[t]);
    assert_true(snapshots[0]->size > 0);
    assert_same_snapshot(*snapshots[0], *snapshots[1]);
    for (int t = 0; t < 2; ++t) {
        free(snapshots[t]->bytes);
        free(snapshots[t]);
    }
    free_shape(&shape);
}

typedef struct {
    const delmesh_mesh* mesh;
    delmesh_view views[DELMESH_CORNER_TWIN + 1];
    Snapshot snapshot;
} Reader;

static void* read_everything(void* argument) {
    Reader* reader = argument;
    for (int32_t what = DELMESH_POSITION; what <= DELMESH_CORNER_TWIN; ++what)
        if (delmesh_mesh_borrow(reader->mesh, what, &reader->views[what]) != DELMESH_OK) return NULL;
    reader->snapshot = take_snapshot(reader->mesh);
    return NULL;
}

static void any_thread_may_read(void** state) {
    (void)state;
    Shape shape = sheet_shape(60);
    delmesh_context* context = NULL;
    assert_int_equal(delmesh_context_create(NULL, &context), DELMESH_OK);
    delmesh_mesh* in = shape_mesh(context, &shape);
    Reader readers[4];
    memset(readers, 0, sizeof readers);
    pthread_t threads[4];
    for (int t = 0; t < 4; ++t) {
        readers[t].mesh = in;
        assert_int_equal(pthread_create(&threads[t], NULL, read_everything, &readers[t]), 0);
    }
    delmesh_mesh* out = remeshed(context, in, DELMESH_MODE_FLIP); /* while they read */
    for (int t = 0; t < 4; ++t) pthread_join(threads[t], NULL);
    for (int t = 0; t < 4; ++t) {
        assert_same_snapshot(readers[0].snapshot, readers[t].snapshot);
        for (int32_t what = DELMESH_POSITION; what <= DELMESH_CORNER_TWIN; ++what) {
            assert_non_null(readers[t].views[what].data);
            assert_ptr_equal(readers[t].views[what].data, readers[0].views[what].data); /* made once */
        }
    }
    for (int t = 0; t < 4; ++t) free(readers[t].snapshot.bytes);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
    delmesh_context_destroy(context);
    free_shape(&shape);
}

/* ---- Cancel from outside, no second call --------------------------------------------------------------------------------- */

static void* cancel_soon(void* context) {
    usleep(20000);
    delmesh_cancel(context);
    return NULL;
}

static void cancel_from_another_thread(void** state) {
    (void)state;
    Shape shape = sheet_shape(SIDE);
    for (int32_t threads = 1; threads <= 2; ++threads) {
        Host host;
        delmesh_context* context = host_context(&host, threads);
        delmesh_mesh* in = shape_mesh(context, &shape);
        const Snapshot before = take_snapshot(in);
        pthread_t thread;
        assert_int_equal(pthread_create(&thread, NULL, cancel_soon, context), 0);
        delmesh_mesh* out;
        int32_t status, runs = 0;
        do { /* one run may be over before the cancel comes: then it is the next one's, and so on */
            status = delmesh_remesh(context, in, NULL, &out, NULL);
            assert_int_equal(out != NULL, status == DELMESH_OK);
            delmesh_mesh_destroy(out);
        } while (status == DELMESH_OK && ++runs < 100000);
        assert_status(status, context, DELMESH_ERROR_CANCELLED);
        pthread_join(thread, NULL);
        const Snapshot after = take_snapshot(in);
        assert_same_snapshot(before, after);
        delmesh_mesh_destroy(remeshed(context, in, DELMESH_MODE_PRESERVE)); /* once only */
        free(before.bytes);
        free(after.bytes);
        delmesh_mesh_destroy(in);
        delmesh_context_destroy(context);
        assert_nothing_left(&host);
    }
    free_shape(&shape);
}

typedef struct {
    delmesh_context* context;
    const delmesh_mesh* mesh;
    int64_t calls, busy;
} Reentrant;

static int32_t call_back_in(void* user, double fraction, const char* stage) {
    Reentrant* r = user;
    (void)fraction, (void)stage;
    if (r->mesh == NULL) return DELMESH_CONTINUE;
    delmesh_mesh* out = (delmesh_mesh*)(uintptr_t)1;
    r->calls += 1;
    r->busy += delmesh_mesh_validate(r->context, r->mesh) == DELMESH_ERROR_BUSY &&
               delmesh_remesh(r->context, r->mesh, NULL, &out, NULL) == DELMESH_ERROR_BUSY && out == NULL &&
               delmesh_last_error(r->context)[0] == 0;
    return DELMESH_CONTINUE;
}

static void a_busy_context_refuses(void** state) {
    (void)state;
    Reentrant reentrant = {NULL, NULL, 0, 0};
    delmesh_context_options options;
    delmesh_context_options_init(&options, sizeof options);
    options.progress = call_back_in;
    options.user = &reentrant;
    assert_int_equal(delmesh_context_create(&options, &reentrant.context), DELMESH_OK);
    Shape shape = torus_shape(12, 8);
    delmesh_mesh* in = shape_mesh(reentrant.context, &shape);
    reentrant.mesh = in;
    delmesh_mesh* out = remeshed(reentrant.context, in, DELMESH_MODE_FLIP); /* the call itself is not disturbed */
    assert_true(reentrant.calls > 2);
    assert_int_equal(reentrant.busy, reentrant.calls);
    delmesh_mesh_destroy(out);
    delmesh_mesh_destroy(in);
    delmesh_context_destroy(reentrant.context);
    free_shape(&shape);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_bytes_with_any_number_of_threads), cmocka_unit_test(the_hosts_pool_gives_the_same_bytes),
        cmocka_unit_test(two_contexts_in_two_threads),           cmocka_unit_test(any_thread_may_read),
        cmocka_unit_test(cancel_from_another_thread),            cmocka_unit_test(a_busy_context_refuses),
    };
    return cmocka_run_group_tests_name("threads", tests, NULL, NULL);
}
