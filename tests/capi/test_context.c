/* SPDX-License-Identifier: Apache-2.0
 * Contexts: options of every age, limits, names, the table, the sentence of the last error. */
#include "support.h"

#include <stdio.h>

static void names_and_versions(void** state) {
    (void)state;
    assert_int_equal(delmesh_version(), DELMESH_VERSION_MAJOR << 16 | DELMESH_VERSION_MINOR << 8 | DELMESH_VERSION_PATCH);
    static const struct {
        int32_t status;
        const char* name;
    } names[] = {
#define NAME(status) {status, #status}
        NAME(DELMESH_OK), NAME(DELMESH_ERROR_INVALID_ARGUMENT), NAME(DELMESH_ERROR_OUT_OF_MEMORY),
        NAME(DELMESH_ERROR_MEMORY_LIMIT), NAME(DELMESH_ERROR_ALLOCATION_LIMIT), NAME(DELMESH_ERROR_CANCELLED),
        NAME(DELMESH_ERROR_INDEX_OUT_OF_RANGE),
        NAME(DELMESH_ERROR_TOO_LARGE), NAME(DELMESH_ERROR_NO_SURFACE), NAME(DELMESH_ERROR_NON_ORIENTABLE),
        NAME(DELMESH_ERROR_STRICT), NAME(DELMESH_ERROR_VERTEX_LIMIT), NAME(DELMESH_ERROR_PRECISION),
        NAME(DELMESH_ERROR_UNSUPPORTED), NAME(DELMESH_ERROR_BUSY), NAME(DELMESH_ERROR_INTERNAL),
#undef NAME
    };
    for (int32_t i = 0; i < (int32_t)(sizeof names / sizeof *names); ++i) {
        assert_int_equal(names[i].status, -i); /* the numbers are fixed for ever */
        assert_string_equal(delmesh_status_name(names[i].status), names[i].name);
    }
    assert_string_equal(delmesh_status_name(1), "DELMESH_ERROR_UNKNOWN");
    assert_string_equal(delmesh_status_name(-16), "DELMESH_ERROR_UNKNOWN");
}

static void struct_sizes(void** state) {
    (void)state;
#define SIZE(type) assert_int_equal(delmesh_struct_size(#type), sizeof(type))
    SIZE(delmesh_view);
    SIZE(delmesh_view_mut);
    SIZE(delmesh_context_options);
    SIZE(delmesh_mesh_desc);
    SIZE(delmesh_mesh_info);
    SIZE(delmesh_remesh_options);
    SIZE(delmesh_remesh_report);
    SIZE(delmesh_certify_options);
    SIZE(delmesh_certify_report);
    SIZE(delmesh_quality_report);
    SIZE(delmesh_distance_options);
    SIZE(delmesh_distance_report);
    SIZE(delmesh_api);
#undef SIZE
    assert_int_equal(sizeof(delmesh_view), 32); /* frozen */
    assert_int_equal(delmesh_struct_size("delmesh_context"), 0);
    assert_int_equal(delmesh_struct_size(""), 0);
    assert_int_equal(delmesh_struct_size(NULL), 0);
    assert_int_equal(delmesh_field_offset("delmesh_view.data"), 0);
    assert_int_equal(delmesh_field_offset("delmesh_view.stride"), 16);
    assert_int_equal(delmesh_field_offset("delmesh_remesh_options.tolerance"), offsetof(delmesh_remesh_options, tolerance));
    assert_int_equal(delmesh_field_offset("delmesh_api.remesh"), offsetof(delmesh_api, remesh));
    assert_int_equal(delmesh_field_offset("delmesh_view"), UINT32_MAX);
    assert_int_equal(delmesh_field_offset("delmesh_view.strides"), UINT32_MAX);
    assert_int_equal(delmesh_field_offset(NULL), UINT32_MAX);
}

static void table(void** state) {
    (void)state;
    assert_null(delmesh_get_api(DELMESH_ABI_VERSION + 1));
    assert_null(delmesh_get_api(0));
    const delmesh_api* api = delmesh_get_api(DELMESH_ABI_VERSION);
    assert_non_null(api);
    assert_ptr_equal(api, delmesh_get_api(DELMESH_ABI_VERSION));
    assert_int_equal(api->struct_size, sizeof *api);
    assert_int_equal(api->abi_version, DELMESH_ABI_VERSION);
#define ENTRY(name) assert_true(api->name == delmesh_##name)
    ENTRY(version);
    ENTRY(status_name);
    ENTRY(context_options_init);
    ENTRY(context_create);
    ENTRY(context_destroy);
    ENTRY(cancel);
    ENTRY(last_error);
    ENTRY(context_memory);
    ENTRY(mesh_desc_init);
    ENTRY(mesh_create);
    ENTRY(mesh_destroy);
    ENTRY(mesh_info_init);
    ENTRY(mesh_get_info);
    ENTRY(mesh_read);
    ENTRY(mesh_borrow);
    ENTRY(mesh_validate);
    ENTRY(remesh_options_init);
    ENTRY(remesh_report_init);
    ENTRY(remesh);
    ENTRY(certify_options_init);
    ENTRY(certify_report_init);
    ENTRY(certify);
    ENTRY(quality_report_init);
    ENTRY(measure_quality);
    ENTRY(distance_options_init);
    ENTRY(distance_report_init);
    ENTRY(measure_distance);
#undef ENTRY
}

/* ---- Options of every age ------------------------------------------------------------------------------------------------ */

static int32_t create_with(const delmesh_context_options* options) {
    delmesh_context* context = (delmesh_context*)(uintptr_t)1;
    const int32_t status = delmesh_context_create(options, &context);
    assert_int_equal(context != NULL, status == DELMESH_OK);
    delmesh_context_destroy(context);
    return status;
}

static void options_of_every_age(void** state) {
    (void)state;
    assert_int_equal(create_with(NULL), DELMESH_OK);
    /* An older caller: only struct_size and max_threads, with nothing behind them (a sanitizer sees any look beyond). */
    delmesh_context_options* old = exactly(8);
    delmesh_context_options_init(old, 8);
    assert_int_equal(old->struct_size, 8);
    assert_int_equal(old->max_threads, 0);
    old->max_threads = 1;
    assert_int_equal(create_with(old), DELMESH_OK);
    free(old);
    /* A newer caller: what the library does not know must be zero. */
    struct {
        delmesh_context_options known;
        uint64_t unknown[2];
    } newer;
    memset(&newer, 0xff, sizeof newer);
    delmesh_context_options_init(&newer.known, sizeof newer);
    assert_int_equal(newer.known.struct_size, sizeof newer);
    assert_int_equal(newer.unknown[0] | newer.unknown[1], 0);
    assert_int_equal(create_with(&newer.known), DELMESH_OK);
    newer.unknown[1] = 1ull << 63;
    assert_int_equal(create_with(&newer.known), DELMESH_ERROR_UNSUPPORTED);
    /* Callers that never called _init. */
    static const uint32_t bad_sizes[] = {0, 4, 12, sizeof(delmesh_context_options) - 4, 4104, 0xffffffff};
    for (size_t i = 0; i < sizeof bad_sizes / sizeof *bad_sizes; ++i) {
        delmesh_context_options options;
        delmesh_context_options_init(&options, sizeof options);
        options.struct_size = bad_sizes[i];
        assert_int_equal(create_with(&options), DELMESH_ERROR_INVALID_ARGUMENT);
    }
    delmesh_context_options_init(NULL, sizeof newer); /* harmless */
}

static void* no_memory(void* user, uint64_t size, uint64_t align) {
    (void)user, (void)size, (void)align;
    return NULL;
}
static void no_free(void* user, void* pointer, uint64_t size) { (void)user, (void)pointer, (void)size; }

static void bad_options(void** state) {
    (void)state;
    delmesh_context_options options;
    delmesh_context_options_init(&options, sizeof options);
    options.max_threads = -1;
    assert_int_equal(create_with(&options), DELMESH_ERROR_INVALID_ARGUMENT);
    options.max_threads = INT32_MAX;
    assert_int_equal(create_with(&options), DELMESH_OK);
    options.alloc = no_memory;
    assert_int_equal(create_with(&options), DELMESH_ERROR_INVALID_ARGUMENT);
    options.free = no_free;
    assert_int_equal(create_with(&options), DELMESH_ERROR_OUT_OF_MEMORY);
    options.alloc = NULL;
    assert_int_equal(create_with(&options), DELMESH_ERROR_INVALID_ARGUMENT);
    assert_int_equal(delmesh_context_create(NULL, NULL), DELMESH_ERROR_INVALID_ARGUMENT);
}

static void null_context(void** state) {
    (void)state;
    delmesh_mesh* mesh = (delmesh_mesh*)(uintptr_t)1;
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    delmesh_context_destroy(NULL);
    delmesh_mesh_destroy(NULL);
    delmesh_cancel(NULL);
    assert_string_equal(delmesh_last_error(NULL), "");
    uint64_t current = 1, peak = 1, allocations = 1;
    delmesh_context_memory(NULL, &current, &peak, &allocations);
    assert_int_equal(current | peak | allocations, 0);
    assert_int_equal(delmesh_mesh_create(NULL, &desc, &mesh), DELMESH_ERROR_INVALID_ARGUMENT);
    assert_null(mesh);
    mesh = (delmesh_mesh*)(uintptr_t)1;
    assert_int_equal(delmesh_remesh(NULL, NULL, NULL, &mesh, NULL), DELMESH_ERROR_INVALID_ARGUMENT);
    assert_null(mesh);
    assert_int_equal(delmesh_mesh_validate(NULL, NULL), DELMESH_ERROR_INVALID_ARGUMENT);
    assert_int_equal(delmesh_certify(NULL, NULL, NULL, NULL), DELMESH_ERROR_INVALID_ARGUMENT);
    assert_int_equal(delmesh_measure_quality(NULL, NULL, NULL), DELMESH_ERROR_INVALID_ARGUMENT);
    assert_int_equal(delmesh_measure_distance(NULL, NULL, NULL, NULL, NULL), DELMESH_ERROR_INVALID_ARGUMENT);
}

/* ---- The sentence, the counters ------------------------------------------------------------------------------------------ */

static void last_error_is_the_last_calls(void** state) {
    (void)state;
    Host host;
    delmesh_context* context = host_context(&host, 1);
    assert_string_equal(delmesh_last_error(context), "");
    assert_status(delmesh_mesh_validate(context, NULL), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_string_equal(delmesh_last_error(context), "The argument 'mesh' was NULL.");
    Shape shape = torus_shape(4, 4);
    delmesh_mesh* mesh = shape_mesh(context, &shape);
    assert_string_equal(delmesh_last_error(context), "");
    delmesh_mesh_destroy(mesh);
    free_shape(&shape);
    delmesh_context_destroy(context);
    assert_nothing_left(&host);
}

static void memory_is_counted(void** state) {
    (void)state;
    Host host;
    delmesh_context* context = host_context(&host, 1);
    uint64_t before, current, peak, allocations;
    delmesh_context_memory(context, &before, NULL, NULL);
    assert_true(before > 0 && (int64_t)before <= host.live_bytes);
    Shape shape = torus_shape(8, 8);
    delmesh_mesh* mesh = shape_mesh(context, &shape);
    delmesh_context_memory(context, &current, &peak, &allocations);
    assert_true(current > before && peak >= current);
    assert_true(allocations > 1 && (int64_t)allocations <= host.allocations);
    delmesh_mesh_destroy(mesh);
    delmesh_context_memory(context, &current, NULL, NULL);
    assert_int_equal(current, before);
    free_shape(&shape);
    delmesh_context_destroy(context);
    assert_nothing_left(&host);
}

static void progress_runs_from_0_to_1(void** state) {
    (void)state;
    Host host;
    delmesh_context* context = host_context(&host, 1);
    Fixture fixture;
    fixture_init(&fixture, context);
    for (int op = 0; op < OPERATIONS; ++op) {
        host.progress_calls = host.fraction_fell = 0;
        delmesh_mesh* out;
        assert_status(run_operation(op, context, &fixture, &out), context, DELMESH_OK);
        assert_true(host.progress_calls > 1);
        assert_true(host.last_fraction == 1);
        assert_false(host.fraction_fell);
        delmesh_mesh_destroy(out);
    }
    assert_true(host.log_lines > 0); /* the book was repaired */
    fixture_free(&fixture);
    delmesh_context_destroy(context);
    assert_nothing_left(&host);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(names_and_versions),    cmocka_unit_test(struct_sizes),
        cmocka_unit_test(table),                 cmocka_unit_test(options_of_every_age),
        cmocka_unit_test(bad_options),           cmocka_unit_test(null_context),
        cmocka_unit_test(last_error_is_the_last_calls), cmocka_unit_test(memory_is_counted),
        cmocka_unit_test(progress_runs_from_0_to_1),
    };
    return cmocka_run_group_tests_name("context", tests, NULL, NULL);
}
