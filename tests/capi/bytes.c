/* SPDX-License-Identifier: Apache-2.0
 * Prints a checksum of the result of each operation on generated meshes. Equal lines, equal bytes: the output must be the same
 * wherever the library runs. The meshes are made with integers, + - * / alone, which are the same everywhere, too. Fails where a
 * result is not certified, or depends on the number of threads. */
#include <delmesh/delmesh.h>

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

enum { SIDE = 90, AROUND = 48, ACROSS = 32, MOST = SIDE * SIDE };

typedef struct {
    const char* name;
    double positions[MOST][3];
    int32_t corners[2 * MOST][3];
    int32_t verts, faces;
} Shape;

static uint64_t noise_state = 1;

/* In [-1, 1), a multiple of 2^-30. */
static double noise(void) {
    noise_state = noise_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(int32_t)((noise_state >> 33) & 0x7fffffff) / 1073741824.0 - 1;
}

/* The quad a b c d, whose rows go from a to b and from d to c, as two triangles. */
static void add_quad(Shape* shape, int32_t a, int32_t b, int32_t c, int32_t d) {
    const int32_t triangles[2][3] = {{a, b, c}, {a, c, d}};
    for (int k = 0; k < 2; ++k, ++shape->faces)
        for (int j = 0; j < 3; ++j) shape->corners[shape->faces][j] = triangles[k][j];
}

/* A sheet of hills, every fourth square of it flat. */
static void make_sheet(Shape* shape) {
    shape->name = "sheet";
    shape->verts = SIDE * SIDE;
    shape->faces = 0;
    for (int32_t i = 0; i < shape->verts; ++i) {
        const int32_t x = i % SIDE, y = i / SIDE;
        const int flat = (x / 15 + y / 15) % 4 == 0;
        shape->positions[i][0] = x + 0.35 * noise();
        shape->positions[i][1] = y + 0.35 * noise();
        shape->positions[i][2] = flat ? 0 : 0.4 * noise() + (double)(x * y % 97) / 97;
    }
    for (int32_t y = 0; y + 1 < SIDE; ++y)
        for (int32_t x = 0; x + 1 < SIDE; ++x) {
            const int32_t a = y * SIDE + x;
            add_quad(shape, a, a + 1, a + SIDE + 1, a + SIDE);
        }
}

/* (cosine, sine) of an angle that rises from 0 to a whole turn with i / n. */
static void circle(int32_t i, int32_t n, double* cosine, double* sine) {
    const double t = 4.0 * (i % n) / n;
    const int32_t quarter = (int32_t)t;
    const double u = t - quarter, c = (1 - u * u) / (1 + u * u), s = 2 * u / (1 + u * u);
    *cosine = quarter == 0 ? c : quarter == 1 ? -s : quarter == 2 ? -c : s;
    *sine = quarter == 0 ? s : quarter == 1 ? c : quarter == 2 ? -s : -c;
}

static void make_torus(Shape* shape) {
    shape->name = "torus";
    shape->verts = AROUND * ACROSS;
    shape->faces = 0;
    for (int32_t i = 0; i < shape->verts; ++i) {
        double cu, su, cv, sv;
        circle(i / ACROSS, AROUND, &cu, &su);
        circle(i % ACROSS, ACROSS, &cv, &sv);
        shape->positions[i][0] = (2 + 0.7 * cv) * cu + 0.01 * noise();
        shape->positions[i][1] = (2 + 0.7 * cv) * su + 0.01 * noise();
        shape->positions[i][2] = 0.7 * sv + 0.01 * noise();
    }
    for (int32_t i = 0; i < AROUND; ++i)
        for (int32_t j = 0; j < ACROSS; ++j) {
            const int32_t k = (i + 1) % AROUND, m = (j + 1) % ACROSS;
            add_quad(shape, i * ACROSS + j, k * ACROSS + j, k * ACROSS + m, i * ACROSS + m);
        }
}

static void fail(const delmesh_context* context, const char* what, int32_t status) {
    fprintf(stderr, "%s: %s: %s\n", what, delmesh_status_name(status), context != NULL ? delmesh_last_error(context) : "");
    exit(1);
}

/* Every array of the mesh, byte by byte (FNV-1a). */
static uint64_t checksum(const delmesh_mesh* mesh) {
    uint64_t sum = UINT64_C(14695981039346656037);
    for (int32_t array = DELMESH_POSITION; array <= DELMESH_VERT_PARENT; ++array) {
        delmesh_view view;
        const int32_t status = delmesh_mesh_borrow(mesh, array, &view);
        if (status != DELMESH_OK) fail(NULL, "delmesh_mesh_borrow", status);
        const int64_t size = view.count * view.components *
                             (view.type == DELMESH_UINT8                                   ? 1
                              : view.type == DELMESH_FLOAT64 || view.type == DELMESH_INT64 ? 8
                                                                                           : 4);
        for (int64_t i = 0; i < size; ++i) sum = (sum ^ ((const unsigned char*)view.data)[i]) * UINT64_C(1099511628211);
    }
    return sum;
}

enum { LEVELS = 3, RESULTS = 20 };

/* All operations on one shape; prints nothing. -> the number of results. */
static int run(const Shape* shape, int32_t threads, uint64_t results[RESULTS], int64_t vertices[RESULTS]) {
    int count = 0;
    delmesh_context_options context_options;
    delmesh_context_options_init(&context_options, sizeof context_options);
    context_options.max_threads = threads;
    delmesh_context* context = NULL;
    int32_t status = delmesh_context_create(&context_options, &context);
    if (status != DELMESH_OK) fail(NULL, "delmesh_context_create", status);
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){shape->positions, shape->verts, 0, DELMESH_FLOAT64, 3};
    desc.corner_verts = (delmesh_view){shape->corners, shape->faces, 0, DELMESH_INT32, 3};
    delmesh_mesh* in = NULL;
    status = delmesh_mesh_create(context, &desc, &in);
    if (status != DELMESH_OK) fail(context, "delmesh_mesh_create", status);

    for (int32_t precision = DELMESH_FLOAT32; precision <= DELMESH_FLOAT64; ++precision) {
        for (int32_t mode = DELMESH_MODE_PRESERVE; mode <= DELMESH_MODE_FEATURE; ++mode) {
            delmesh_remesh_options options;
            delmesh_remesh_options_init(&options, sizeof options);
            options.mode = mode;
            options.precision = precision;
            delmesh_remesh_report report;
            delmesh_remesh_report_init(&report, sizeof report);
            delmesh_mesh* out = NULL;
            status = delmesh_remesh(context, in, &options, &out, &report);
            if (status != DELMESH_OK) fail(context, "delmesh_remesh", status);
            if (!report.certified) fail(context, "the result was not certified", status);
            vertices[count] = report.vertices_out;
            results[count++] = checksum(out);
            delmesh_mesh_destroy(out);
        }
        delmesh_decimate_options options;
        delmesh_decimate_options_init(&options, sizeof options);
        options.precision = precision;
        options.quality = 2;
        const delmesh_target targets[LEVELS] = {
            {DELMESH_TARGET_FULL, 0, 0}, {DELMESH_TARGET_RATIO, 0, 0.3}, {DELMESH_TARGET_VERTICES, 0, 200}};
        delmesh_mesh* levels[LEVELS] = {NULL};
        delmesh_level_report reports[LEVELS];
        for (int k = 0; k < LEVELS; ++k) delmesh_level_report_init(&reports[k], sizeof reports[k]);
        status = delmesh_lod_family(context, in, targets, LEVELS, &options, levels, reports, NULL);
        if (status != DELMESH_OK) fail(context, "delmesh_lod_family", status);
        for (int k = 0; k < LEVELS; ++k) {
            if (!reports[k].certified) fail(context, "a level was not certified", status);
            vertices[count] = reports[k].vertices;
            results[count++] = checksum(levels[k]);
            delmesh_mesh_destroy(levels[k]);
        }
    }
    delmesh_mesh_destroy(in);
    delmesh_context_destroy(context);
    return count;
}

int main(void) {
    static Shape shape;
    void (*const makers[])(Shape*) = {make_sheet, make_torus};
    for (size_t s = 0; s < sizeof makers / sizeof *makers; ++s) {
        makers[s](&shape);
        uint64_t once[RESULTS], again[RESULTS];
        int64_t vertices[RESULTS];
        const int count = run(&shape, 1, once, vertices);
        run(&shape, 3, again, vertices);
        for (int k = 0; k < count; ++k) {
            printf("%s %2d: %6" PRId64 " vertices, %016" PRIx64 "\n", shape.name, k, vertices[k], once[k]);
            if (once[k] != again[k]) fail(NULL, "the bytes depend on the number of threads", DELMESH_OK);
        }
    }
    return 0;
}
