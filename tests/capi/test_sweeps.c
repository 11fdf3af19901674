/* SPDX-License-Identifier: Apache-2.0
 * Fail everywhere once: every operation is run with its k-th allocation refused and its k-th progress call cancelling, for every
 * k until it succeeds. After each failure there is no handle, the inputs are as they were, nothing leaks, the next call works. */
#include "support.h"

#include <stdio.h>

typedef struct {
    Host host;
    delmesh_context* context;
    Fixture fixture;
    Snapshot sheet, book; /* of the inputs */
} World;

static void world_init(World* world) {
    world->context = host_context(&world->host, 1);
    fixture_init(&world->fixture, world->context);
    world->sheet = take_snapshot(world->fixture.sheet_mesh);
    world->book = take_snapshot(world->fixture.book_mesh);
}

static void world_free(World* world) {
    fixture_free(&world->fixture);
    delmesh_context_destroy(world->context);
    free(world->sheet.bytes);
    free(world->book.bytes);
    assert_nothing_left(&world->host);
}

static void assert_inputs_unchanged(const World* world) {
    const Snapshot sheet = take_snapshot(world->fixture.sheet_mesh), book = take_snapshot(world->fixture.book_mesh);
    assert_same_snapshot(sheet, world->sheet);
    assert_same_snapshot(book, world->book);
    free(sheet.bytes);
    free(book.bytes);
}

/* Runs operation op, which is to fail with `expected` or to succeed; returns whether it succeeded. */
static int run(World* world, int op, int32_t expected) {
    const int64_t blocks = world->host.live_blocks, bytes = world->host.live_bytes;
    delmesh_mesh* out = (delmesh_mesh*)(uintptr_t)1;
    const int32_t status = run_operation(op, world->context, &world->fixture, &out);
    if (status != DELMESH_OK) {
        assert_status(status, world->context, expected);
        assert_null(out);
        assert_true(delmesh_last_error(world->context)[0] != 0);
    }
    delmesh_mesh_destroy(out);
    assert_int_equal(world->host.live_blocks, blocks);
    assert_int_equal(world->host.live_bytes, bytes);
    assert_inputs_unchanged(world);
    return status == DELMESH_OK;
}

static void out_of_memory_at_every_allocation(void** state) {
    (void)state;
    World world;
    world_init(&world);
    for (int op = 0; op < OPERATIONS; ++op) {
        int64_t k = 0;
        do {
            world.host.fail_at = world.host.allocations + ++k;
        } while (!run(&world, op, DELMESH_ERROR_OUT_OF_MEMORY));
        world.host.fail_at = 0;
        assert_true(run(&world, op, DELMESH_OK));
        print_message("    %-15s %lld allocations\n", operation_names[op], (long long)(k - 1));
        /* Only validation and the gathering of a layer might do without memory. */
        assert_true(k > 1 || op == OPERATIONS - 1 || strcmp(operation_names[op], "transfer") == 0);
    }
    world_free(&world);
}

/* The whole life of a context under a limit: everything up to the first refusal. Returns whether all went well. */
static int life_under(uint64_t memory_limit, uint64_t allocation_limit, int32_t expected) {
    Host host;
    delmesh_context_options options;
    host_init(&host, &options);
    options.memory_limit = memory_limit;
    options.allocation_limit = allocation_limit;
    delmesh_context* context = NULL;
    int32_t status = delmesh_context_create(&options, &context);
    Fixture fixture;
    fixture_init(&fixture, NULL);
    if (status == DELMESH_OK) {
        status = fixture_make(&fixture, context);
        for (int op = 0; op < OPERATIONS && status == DELMESH_OK; ++op) {
            delmesh_mesh* out = NULL;
            status = run_operation(op, context, &fixture, &out);
            assert_true(status == DELMESH_OK || out == NULL);
            delmesh_mesh_destroy(out);
        }
        uint64_t peak, allocations;
        delmesh_context_memory(context, NULL, &peak, &allocations);
        assert_true(memory_limit == 0 || peak <= memory_limit);
        assert_true(allocation_limit == 0 || host.allocations <= (int64_t)allocation_limit + 1); /* the allocator's own block */
    }
    assert_true(status == DELMESH_OK || status == expected);
    fixture_free(&fixture);
    delmesh_context_destroy(context);
    assert_nothing_left(&host);
    return status == DELMESH_OK;
}

static void every_allocation_limit(void** state) {
    (void)state;
    uint64_t limit = 1;
    while (!life_under(0, limit, DELMESH_ERROR_ALLOCATION_LIMIT)) ++limit;
    assert_true(limit > 20);
}

static void many_memory_limits(void** state) {
    (void)state;
    uint64_t limit = 1;
    while (!life_under(limit, 0, DELMESH_ERROR_MEMORY_LIMIT)) limit += 1 + limit / 16;
    assert_true(limit > 10000);
}

/* ---- Cancel -------------------------------------------------------------------------------------------------------------- */

static void cancel_at_every_progress_call(void** state) {
    (void)state;
    World world;
    world_init(&world);
    for (int op = 0; op < OPERATIONS; ++op) {
        int64_t k = 0;
        do {
            world.host.progress_calls = 0;
            world.host.cancel_at = ++k;
        } while (!run(&world, op, DELMESH_ERROR_CANCELLED));
        assert_true(world.host.progress_calls < k); /* how many there are depends on the time they take */
        assert_true(k > 2);                         /* it can be cancelled, and not only at its end */
        world.host.cancel_at = 0;
        assert_true(run(&world, op, DELMESH_OK));
    }
    world_free(&world);
}

static void cancel_before_the_call(void** state) {
    (void)state;
    World world;
    world_init(&world);
    for (int op = 0; op < OPERATIONS; ++op) {
        delmesh_cancel(world.context);
        delmesh_cancel(world.context);
        assert_false(run(&world, op, DELMESH_ERROR_CANCELLED));
        assert_true(run(&world, op, DELMESH_OK)); /* that call alone */
    }
    /* Also a call that would have failed otherwise takes the cancel with it. */
    delmesh_cancel(world.context);
    assert_status(delmesh_mesh_validate(world.context, NULL), world.context, DELMESH_ERROR_CANCELLED);
    assert_status(delmesh_mesh_validate(world.context, NULL), world.context, DELMESH_ERROR_INVALID_ARGUMENT);
    world_free(&world);
}

typedef struct {
    delmesh_context* context;
    int64_t calls, cancel_at;
    double last_fraction;
} Canceller;

static int32_t cancel_but_go_on(void* user, double fraction, const char* stage) {
    Canceller* canceller = user;
    (void)stage;
    canceller->last_fraction = fraction;
    if (++canceller->calls == canceller->cancel_at) delmesh_cancel(canceller->context);
    return DELMESH_CONTINUE;
}

/* delmesh_cancel from inside the callback, also at the very last one, when the work is done. */
static void cancel_inside_the_callback(void** state) {
    (void)state;
    Canceller canceller = {NULL, 0, 0, 0};
    delmesh_context_options options;
    delmesh_context_options_init(&options, sizeof options);
    options.max_threads = 1;
    options.progress = cancel_but_go_on;
    options.user = &canceller;
    assert_int_equal(delmesh_context_create(&options, &canceller.context), DELMESH_OK);
    Fixture fixture;
    fixture_init(&fixture, canceller.context);
    for (int op = 0; op < OPERATIONS; ++op) {
        /* How often it is asked depends on the time it takes, so it is cancelled later and later until it ends before that. */
        int64_t cancelled = 0;
        for (canceller.cancel_at = 1;; ++canceller.cancel_at) {
            canceller.calls = 0;
            delmesh_mesh* out;
            const int32_t status = run_operation(op, canceller.context, &fixture, &out);
            if (canceller.calls < canceller.cancel_at) {
                assert_status(status, canceller.context, DELMESH_OK);
                delmesh_mesh_destroy(out);
                break;
            }
            assert_status(status, canceller.context, DELMESH_ERROR_CANCELLED);
            assert_null(out);
            assert_int_equal(canceller.calls, canceller.cancel_at); /* nobody is asked again after a cancel */
            ++cancelled;
        }
        assert_true(cancelled > 0);
    }
    fixture_free(&fixture);
    delmesh_context_destroy(canceller.context);
}

/* Any other value than DELMESH_CONTINUE cancels: what a binding returns by accident must not mean "go on". */
static int32_t answer_of(void* user, double fraction, const char* stage) {
    (void)fraction, (void)stage;
    return *(const int32_t*)user;
}

static void any_other_answer_cancels(void** state) {
    (void)state;
    static const int32_t answers[] = {0, 1, -1, 0x600C, 0x600E, (int32_t)0x8000600D, 0x0D60, INT32_MIN};
    for (size_t i = 0; i < sizeof answers / sizeof *answers; ++i) {
        delmesh_context_options options;
        delmesh_context_options_init(&options, sizeof options);
        options.progress = answer_of;
        int32_t answer = answers[i];
        options.user = &answer;
        delmesh_context* context = NULL;
        assert_int_equal(delmesh_context_create(&options, &context), DELMESH_OK);
        Shape shape = torus_shape(6, 6);
        const delmesh_mesh_desc desc = shape_desc(&shape);
        delmesh_mesh* mesh = (delmesh_mesh*)(uintptr_t)1;
        assert_status(delmesh_mesh_create(context, &desc, &mesh), context, DELMESH_ERROR_CANCELLED);
        assert_null(mesh);
        answer = DELMESH_CONTINUE;
        assert_status(delmesh_mesh_create(context, &desc, &mesh), context, DELMESH_OK);
        delmesh_mesh_destroy(mesh);
        free_shape(&shape);
        delmesh_context_destroy(context);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(out_of_memory_at_every_allocation), cmocka_unit_test(every_allocation_limit),
        cmocka_unit_test(many_memory_limits),                cmocka_unit_test(cancel_at_every_progress_call),
        cmocka_unit_test(cancel_before_the_call),            cmocka_unit_test(cancel_inside_the_callback),
        cmocka_unit_test(any_other_answer_cancels),
    };
    return cmocka_run_group_tests_name("sweeps", tests, NULL, NULL);
}
