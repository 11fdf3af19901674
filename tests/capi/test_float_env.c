/* SPDX-License-Identifier: Apache-2.0
 * Whatever floating-point environment and locale the host has: the same bytes come out, and the environment afterwards is the
 * host's to the last bit, sticky flags included. */
#include "support.h"

#include <fenv.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>

/* ---- The environment as raw bits ----------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t x87[7], mxcsr;
} RawEnvironment;

#if defined(__x86_64__)
enum { FLUSH = 0x8040 }; /* flush-to-zero and denormals-are-zero */
static RawEnvironment raw_environment(void) {
    RawEnvironment raw;
    __asm__ volatile("fnstenv %0\n\tfldenv %0\n\tstmxcsr %1" : "=m"(raw.x87), "=m"(raw.mxcsr) : : "memory");
    return raw;
}
static void add_to_mxcsr(uint32_t bits) {
    uint32_t mxcsr = raw_environment().mxcsr | bits;
    __asm__ volatile("ldmxcsr %0" : : "m"(mxcsr) : "memory");
}
static void set_x87_precision_to_double(void) {
    uint16_t control;
    __asm__ volatile("fnstcw %0" : "=m"(control));
    control = (uint16_t)((control & ~0x300) | 0x200);
    __asm__ volatile("fldcw %0" : : "m"(control));
}
#else
enum { FLUSH = 0 };
static RawEnvironment raw_environment(void) {
    RawEnvironment raw = {{(uint32_t)fegetround(), (uint32_t)fegetexcept(), (uint32_t)fetestexcept(FE_ALL_EXCEPT)}, 0};
    return raw;
}
static void add_to_mxcsr(uint32_t bits) { (void)bits; }
static void set_x87_precision_to_double(void) {}
#endif

static void plain(void) {}
static void flush(void) { add_to_mxcsr(FLUSH); }
static void upward(void) { fesetround(FE_UPWARD); }
static void toward_zero(void) { fesetround(FE_TOWARDZERO); }
static void traps(void) { feenableexcept(FE_ALL_EXCEPT); }
static void flags(void) { feraiseexcept(FE_DIVBYZERO | FE_UNDERFLOW); }
static void everything(void) {
    flags();
    set_x87_precision_to_double();
    fesetround(FE_DOWNWARD);
    add_to_mxcsr(FLUSH);
}
static const struct {
    const char* name;
    void (*set)(void);
} environments[] = {{"plain", plain}, {"flush to zero", flush}, {"upward", upward}, {"toward zero", toward_zero},
                    {"traps", traps}, {"sticky flags", flags}, {"x87 double precision", set_x87_precision_to_double},
                    {"everything", everything}};

/* ---- One run of everything, inside an environment ------------------------------------------------------------------------ */

/* No arithmetic on doubles between the calls: under traps it could kill the test itself. */
typedef struct {
    unsigned char bytes[1 << 18];
    size_t size;
    int broken; /* calls after which the environment was not as before */
} Record;

static void keep(Record* record, const void* bytes, size_t size) {
    assert_true(record->size + size <= sizeof record->bytes);
    memcpy(record->bytes + record->size, bytes, size);
    record->size += size;
}

#define CALL(record, expression)                                              \
    do {                                                                      \
        const RawEnvironment before_ = raw_environment();                     \
        const int32_t status_ = (expression);                                 \
        const RawEnvironment after_ = raw_environment();                      \
        (record)->broken += memcmp(&before_, &after_, sizeof before_) != 0;   \
        keep(record, &status_, sizeof status_);                               \
    } while (0)

static void run_all(Record* record, delmesh_context* context, const Shape* shape) {
    const delmesh_mesh_desc desc = shape_desc(shape);
    delmesh_mesh *in = NULL, *out = NULL;
    CALL(record, delmesh_mesh_create(context, &desc, &in));
    assert_non_null(in);
    float rounded[200][3];
    const delmesh_view_mut dst = {rounded, shape->verts, 0, DELMESH_FLOAT32, 3};
    assert_true(shape->verts <= 200);
    CALL(record, delmesh_mesh_read(in, DELMESH_POSITION, &dst));
    keep(record, rounded, (size_t)shape->verts * sizeof rounded[0]);
    for (int32_t mode = DELMESH_MODE_PRESERVE; mode <= DELMESH_MODE_FEATURE; ++mode)
        for (int32_t precision = DELMESH_FLOAT32; precision <= DELMESH_FLOAT64; ++precision) {
            delmesh_remesh_options options;
            delmesh_remesh_options_init(&options, sizeof options);
            options.mode = mode;
            options.precision = precision;
            options.max_vertices = 1000; /* ends early where denormals have no room */
            CALL(record, delmesh_remesh(context, in, &options, &out, NULL));
            keep(record, delmesh_last_error(context), strlen(delmesh_last_error(context)));
            if (out == NULL) continue;
            const Snapshot snapshot = take_snapshot(out);
            keep(record, snapshot.bytes, snapshot.size);
            free(snapshot.bytes);
            delmesh_mesh_destroy(out);
        }
    delmesh_certify_report certificate;
    delmesh_certify_report_init(&certificate, sizeof certificate);
    CALL(record, delmesh_certify(context, in, NULL, &certificate));
    memset(&certificate.seconds, 0, sizeof certificate.seconds);
    keep(record, &certificate, sizeof certificate);
    delmesh_quality_report quality;
    delmesh_quality_report_init(&quality, sizeof quality);
    CALL(record, delmesh_measure_quality(context, in, &quality));
    keep(record, &quality, sizeof quality);
    CALL(record, delmesh_mesh_validate(context, in));
    delmesh_mesh_destroy(in);
}

static void scale(Shape* shape, double factor) {
    for (int32_t i = 0; i < 3 * shape->verts; ++i) shape->positions[i] *= factor;
}

static Record expected, actual;

static void run_in_every_environment(double factor, int32_t max_threads) {
    Shape shape = sheet_shape(9);
    scale(&shape, factor);
    Host host;
    delmesh_context* context = host_context(&host, max_threads);
    fenv_t original;
    fegetenv(&original);
    for (size_t e = 0; e < sizeof environments / sizeof *environments; ++e) {
        Record* record = e == 0 ? &expected : &actual;
        record->size = 0;
        record->broken = 0;
        environments[e].set();
        run_all(record, context, &shape);
        fesetenv(&original);
        const int equal = record->size == expected.size && memcmp(record->bytes, expected.bytes, expected.size) == 0;
        if (record->broken != 0 || !equal)
            fail_msg("under '%s' at scale %g: %d changed environments, %s results", environments[e].name, factor, record->broken,
                     equal ? "equal" : "other");
    }
    delmesh_context_destroy(context);
    assert_nothing_left(&host);
    free_shape(&shape);
}

static void ordinary_coordinates(void** state) {
    (void)state;
    run_in_every_environment(1, 1);
    run_in_every_environment(1, 3);
}
static void coordinates_that_are_denormal_in_float32(void** state) {
    (void)state;
    run_in_every_environment(ldexp(1, -136), 1);
}
static void coordinates_that_are_denormal_in_float64(void** state) {
    (void)state;
    run_in_every_environment(ldexp(1, -1060), 1);
}
static void huge_coordinates(void** state) {
    (void)state;
    run_in_every_environment(ldexp(1, 118), 1);
}

/* The test can fail: denormals do vanish under flush-to-zero, sums do change when they are rounded upward. */
static void environments_matter(void** state) {
    (void)state;
    fenv_t original;
    fegetenv(&original);
    volatile double tiny = ldexp(1, -1060), one = 1, three = 3, nearest, up, flushed;
    nearest = one / three;
    upward();
    up = one / three;
    fesetenv(&original);
    assert_true(up > nearest);
    if (FLUSH != 0) {
        flush();
        flushed = tiny * one;
        fesetenv(&original);
        assert_true(flushed == 0 && tiny * one > 0);
    }
}

/* ---- The threads of the host's pool have an environment of their own ----------------------------------------------------- */

static int pool_broken;

typedef struct {
    delmesh_task_fn task;
    void* data;
    int32_t count;
} Work;

static void* flushing_thread(void* argument) {
    const Work* work = argument;
    everything();
    for (int32_t i = 0; i < work->count; ++i) {
        const RawEnvironment before = raw_environment();
        work->task(work->data, i);
        const RawEnvironment after = raw_environment();
        pool_broken += memcmp(&before, &after, sizeof before) != 0;
    }
    return NULL;
}

static void parallel_for(void* user, int32_t count, delmesh_task_fn task, void* task_data) {
    Work work = {task, task_data, count};
    pthread_t thread;
    *(int*)user += 1;
    pthread_create(&thread, NULL, flushing_thread, &work);
    pthread_join(thread, NULL);
}

static void certify_tiny(const delmesh_context_options* options, delmesh_certify_report* certificate,
                         delmesh_quality_report* quality) {
    Shape shape = sheet_shape(160);
    scale(&shape, ldexp(1, -1060));
    delmesh_context* context = NULL;
    assert_int_equal(delmesh_context_create(options, &context), DELMESH_OK);
    delmesh_mesh* in = shape_mesh(context, &shape);
    delmesh_certify_report_init(certificate, sizeof *certificate);
    delmesh_quality_report_init(quality, sizeof *quality);
    assert_status(delmesh_certify(context, in, NULL, certificate), context, DELMESH_OK);
    assert_status(delmesh_measure_quality(context, in, quality), context, DELMESH_OK);
    certificate->seconds = 0;
    delmesh_mesh_destroy(in);
    delmesh_context_destroy(context);
    free_shape(&shape);
}

static void pool_threads_with_flush_to_zero(void** state) {
    (void)state;
    int runs = 0;
    delmesh_context_options options;
    delmesh_context_options_init(&options, sizeof options);
    options.max_threads = 1;
    delmesh_certify_report certificates[2];
    delmesh_quality_report qualities[2];
    certify_tiny(&options, &certificates[0], &qualities[0]);
    options.max_threads = 0;
    options.parallel_for = parallel_for;
    options.user = &runs;
    certify_tiny(&options, &certificates[1], &qualities[1]);
    assert_true(runs > 0);
    assert_int_equal(pool_broken, 0);
    assert_true(certificates[0].nld_interior > 0);
    assert_memory_equal(&certificates[0], &certificates[1], sizeof certificates[0]);
    assert_memory_equal(&qualities[0], &qualities[1], sizeof qualities[0]);
}

/* ---- Locale -------------------------------------------------------------------------------------------------------------- */

static void a_comma_locale_changes_nothing(void** state) {
    (void)state;
    const char* set = setlocale(LC_ALL, "de_DE.UTF-8");
    if (set == NULL) {
        print_message("    no de_DE.UTF-8 locale here: skipped\n");
        skip();
    }
    char name[64], number[16];
    snprintf(name, sizeof name, "%s", set); /* Windows has a name of its own for it */
    snprintf(number, sizeof number, "%.1f", 0.5);
    assert_string_equal(number, "0,5");
    delmesh_context* context = NULL;
    assert_int_equal(delmesh_context_create(NULL, &context), DELMESH_OK);
    Shape shape = sheet_shape(9);
    actual.size = expected.size = 0;
    run_all(&actual, context, &shape);
    delmesh_mesh *in = shape_mesh(context, &shape), *out = NULL;
    delmesh_remesh_options options;
    delmesh_remesh_options_init(&options, sizeof options);
    options.feature_angle = -0.5;
    assert_status(delmesh_remesh(context, in, &options, &out, NULL), context, DELMESH_ERROR_INVALID_ARGUMENT);
    assert_string_equal(delmesh_last_error(context), "The option 'feature_angle' was -0.5, outside 0 to 180.");
    delmesh_mesh_destroy(in);
    assert_string_equal(setlocale(LC_ALL, NULL), name); /* left alone */
    setlocale(LC_ALL, "C");
    run_all(&expected, context, &shape);
    assert_int_equal(actual.size, expected.size);
    assert_memory_equal(actual.bytes, expected.bytes, expected.size);
    delmesh_context_destroy(context);
    free_shape(&shape);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(environments_matter),
        cmocka_unit_test(ordinary_coordinates),
        cmocka_unit_test(coordinates_that_are_denormal_in_float32),
        cmocka_unit_test(coordinates_that_are_denormal_in_float64),
        cmocka_unit_test(huge_coordinates),
        cmocka_unit_test(pool_threads_with_flush_to_zero),
        cmocka_unit_test(a_comma_locale_changes_nothing),
    };
    return cmocka_run_group_tests_name("float_env", tests, NULL, NULL);
}
