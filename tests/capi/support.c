/* SPDX-License-Identifier: Apache-2.0 */
#include "support.h"

#include <math.h>
#include <stdio.h>

/* ---- Shapes -------------------------------------------------------------------------------------------------------------- */

static Shape new_shape(int32_t verts, int32_t faces) {
    Shape shape = {calloc((size_t)verts * 3, sizeof(double)), calloc((size_t)faces * 3, sizeof(int32_t)), verts, faces};
    assert_non_null(shape.positions);
    assert_non_null(shape.corners);
    return shape;
}

static void set_vert(Shape* shape, int32_t v, double x, double y, double z) {
    shape->positions[3 * v] = x, shape->positions[3 * v + 1] = y, shape->positions[3 * v + 2] = z;
}

static void set_face(Shape* shape, int32_t f, int32_t a, int32_t b, int32_t c) {
    shape->corners[3 * f] = a, shape->corners[3 * f + 1] = b, shape->corners[3 * f + 2] = c;
}

void free_shape(Shape* shape) {
    free(shape->positions);
    free(shape->corners);
}

/* Exact in float32 up to the division, and made without libm, so that all machines see the same shape. */
Shape sheet_shape(int32_t side) {
    Shape shape = new_shape(side * side, 2 * (side - 1) * (side - 1));
    int32_t f = 0;
    for (int32_t y = 0; y < side; ++y)
        for (int32_t x = 0; x < side; ++x) {
            set_vert(&shape, y * side + x, x + 0.9 * y, y + ((x * 5 + y * 3) % 7) / 16.0,
                     ((x * x + 3 * y * y + x * y) % 11) / 8.0);
            if (x + 1 == side || y + 1 == side) continue;
            const int32_t a = y * side + x;
            set_face(&shape, f++, a, a + 1, a + side + 1);
            set_face(&shape, f++, a, a + side + 1, a + side);
        }
    return shape;
}

Shape torus_shape(int32_t around, int32_t across) {
    Shape shape = new_shape(around * across, 2 * around * across);
    const double turn = 8 * atan(1);
    for (int32_t i = 0; i < around; ++i)
        for (int32_t j = 0; j < across; ++j) {
            const double u = turn * i / around, v = turn * (j + 0.8 * sin(2 * u)) / across;
            set_vert(&shape, i * across + j, (2 + 0.7 * cos(v)) * cos(u), (2 + 0.7 * cos(v)) * sin(u), 0.7 * sin(v));
            const int32_t i1 = (i + 1) % around * across, j1 = (j + 1) % across, i0 = i * across;
            set_face(&shape, 2 * (i0 + j), i0 + j, i1 + j, i1 + j1);
            set_face(&shape, 2 * (i0 + j) + 1, i0 + j, i1 + j1, i0 + j1);
        }
    return shape;
}

/* Vertices 0 and 1 are the spine, 2 + 2 k and 3 + 2 k the outer corners of page k, 10 is loose. */
Shape book_shape(void) {
    static const double out[4][2] = {{1, 0}, {0, 1}, {-1, 0.25}, {0.5, -1}};
    Shape shape = new_shape(11, 9);
    set_vert(&shape, 1, 0, 0, 4);
    for (int32_t k = 0; k < 4; ++k) {
        const int32_t a = 2 + 2 * k, b = a + 1;
        set_vert(&shape, a, out[k][0], out[k][1], 3);
        set_vert(&shape, b, out[k][0], out[k][1], 7);
        if (k == 2) {
            set_face(&shape, 2 * k, 0, 1, a);
            set_face(&shape, 2 * k + 1, 1, b, a);
        } else {
            set_face(&shape, 2 * k, 1, 0, a);
            set_face(&shape, 2 * k + 1, 1, a, b);
        }
    }
    set_face(&shape, 8, 0, 2, 1); /* the first face of page 0 once more */
    set_vert(&shape, 10, 9, 9, 9);
    return shape;
}

Shape moebius_shape(void) {
    Shape shape = new_shape(5, 5);
    for (int32_t v = 0; v < 5; ++v) {
        set_vert(&shape, v, v, v * v, v * v * v);
        set_face(&shape, v, v, (v + 1) % 5, (v + 2) % 5);
    }
    return shape;
}

/* ---- Host ---------------------------------------------------------------------------------------------------------------- */

static void expect(Host* host, int in_contract) {
    if (!in_contract || !pthread_equal(pthread_self(), host->thread)) host->misused = 1;
}

static void* aligned_new(size_t size, size_t align) {
#ifdef _WIN32
    return _aligned_malloc(size, align);
#else
    void* pointer = NULL;
    return posix_memalign(&pointer, align < sizeof(void*) ? sizeof(void*) : align, size) == 0 ? pointer : NULL;
#endif
}

static void aligned_delete(void* pointer) {
#ifdef _WIN32
    _aligned_free(pointer);
#else
    free(pointer);
#endif
}

static void* host_alloc(void* user, uint64_t size, uint64_t align) {
    Host* host = user;
    expect(host, size > 0 && align > 0 && align <= 64 && (align & (align - 1)) == 0);
    if (++host->allocations == host->fail_at) return NULL;
    void* pointer = aligned_new(size, align);
    if (pointer == NULL) return NULL;
    memset(pointer, 0xa5, size); /* what nobody has written looks like nothing */
    host->live_blocks += 1;
    host->live_bytes += (int64_t)size;
    return pointer;
}

static void host_free(void* user, void* pointer, uint64_t size) {
    Host* host = user;
    expect(host, pointer != NULL);
    host->live_blocks -= 1;
    host->live_bytes -= (int64_t)size;
    memset(pointer, 0x5a, size); /* also checks the size */
    aligned_delete(pointer);
}

static int32_t host_progress(void* user, double fraction, const char* stage) {
    Host* host = user;
    expect(host, fraction >= 0 && fraction <= 1);
    if (fraction < host->last_fraction && host->progress_calls != 0) host->fraction_fell = 1;
    host->last_fraction = fraction;
    snprintf(host->last_stage, sizeof host->last_stage, "%s", stage);
    return ++host->progress_calls == host->cancel_at ? 0 : DELMESH_CONTINUE;
}

static void host_log(void* user, int32_t level, const char* text) {
    Host* host = user;
    expect(host, (level == DELMESH_LOG_INFO || level == DELMESH_LOG_WARNING) && text[0] != 0 && strchr(text, '\n') == NULL);
    host->log_lines += 1;
}

void host_init(Host* host, delmesh_context_options* options) {
    memset(host, 0, sizeof *host);
    host->thread = pthread_self();
    delmesh_context_options_init(options, sizeof *options);
    options->user = host;
    options->alloc = host_alloc;
    options->free = host_free;
    options->progress = host_progress;
    options->log = host_log;
    options->max_threads = 1;
}

delmesh_context* host_context(Host* host, int32_t max_threads) {
    delmesh_context_options options;
    host_init(host, &options);
    options.max_threads = max_threads;
    delmesh_context* context = NULL;
    assert_status(delmesh_context_create(&options, &context), NULL, DELMESH_OK);
    return context;
}

void assert_nothing_left(const Host* host) {
    assert_int_equal(host->live_blocks, 0);
    assert_int_equal(host->live_bytes, 0);
    assert_false(host->misused);
}

/* ---- Meshes -------------------------------------------------------------------------------------------------------------- */

delmesh_view view(const void* data, int64_t count, int32_t type, int32_t components) {
    const delmesh_view v = {data, count, 0, type, components};
    return v;
}

delmesh_mesh_desc shape_desc(const Shape* shape) {
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){shape->positions, shape->verts, 0, DELMESH_FLOAT64, 3};
    desc.corner_verts = (delmesh_view){shape->corners, shape->faces, 0, DELMESH_INT32, 3};
    return desc;
}

delmesh_mesh* shape_mesh(delmesh_context* context, const Shape* shape) {
    const delmesh_mesh_desc desc = shape_desc(shape);
    delmesh_mesh* mesh = NULL;
    assert_status(delmesh_mesh_create(context, &desc, &mesh), context, DELMESH_OK);
    return mesh;
}

int32_t create_quad_cube(delmesh_context* context, delmesh_mesh** out) {
    static const float corners[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    static const uint32_t verts[24] = {0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};
    static const uint8_t sizes[6] = {4, 4, 4, 4, 4, 4};
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){corners, 8, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){verts, 24, 0, DELMESH_UINT32, 1};
    desc.face_sizes = (delmesh_view){sizes, 6, 0, DELMESH_UINT8, 1};
    return delmesh_mesh_create(context, &desc, out);
}

void* exactly(size_t bytes) {
    return malloc(bytes);
}

delmesh_mesh_info info_of(const delmesh_mesh* mesh) {
    delmesh_mesh_info info;
    delmesh_mesh_info_init(&info, sizeof info);
    assert_status(delmesh_mesh_get_info(mesh, &info), NULL, DELMESH_OK);
    return info;
}

static int has_integers(const delmesh_mesh* mesh, int32_t what, int64_t count) {
    int32_t* numbers = malloc((size_t)count * sizeof *numbers + 1);
    const delmesh_view_mut dst = {numbers, count, 0, DELMESH_INT32, 1};
    const int32_t status = delmesh_mesh_read(mesh, what, &dst);
    free(numbers);
    if (status != DELMESH_OK) assert_status(status, NULL, DELMESH_ERROR_INVALID_ARGUMENT);
    return status == DELMESH_OK;
}
int has_map(const delmesh_mesh* mesh) {
    return has_integers(mesh, DELMESH_EDGE_SOURCE_EDGE, info_of(mesh).edges);
}
static int has_places(const delmesh_mesh* mesh) {
    return has_integers(mesh, DELMESH_FACE_CAGE_FACE, info_of(mesh).faces);
}

/* A house: two of its walls have the roof's edges, which is creased, and its UVs jump at the ridge. */
static int32_t create_cage(delmesh_context* context, delmesh_cage** out) {
    static const float points[10][3] = {{0, 0, 0}, {2, 0, 0}, {2, 3, 0}, {0, 3, 0}, {0, 0, 2},
                                        {2, 0, 2}, {2, 3, 2}, {0, 3, 2}, {1, 0, 3}, {1, 3, 3}};
    static const int32_t corners[30] = {0, 3, 2, 1, 0, 1, 5, 8, 4, 1, 2, 6, 5, 2, 3, 7, 9, 6, 3, 0, 4, 7, 5, 6, 9, 8, 4, 8, 9, 7};
    static const int32_t sizes[7] = {4, 5, 4, 5, 4, 4, 4}, ridge[2] = {8, 9};
    static const double sharp[1] = {1.5};
    float uvs[30][2];
    for (int i = 0; i < 30; ++i) {
        uvs[i][0] = points[corners[i]][0] + (i < 26 ? 0 : 5);
        uvs[i][1] = points[corners[i]][1];
    }
    delmesh_layer layer;
    delmesh_layer_init(&layer, sizeof layer);
    layer.kind = DELMESH_LAYER_UV;
    layer.values = (delmesh_view){uvs, 30, 0, DELMESH_FLOAT32, 2};
    delmesh_cage_desc desc;
    delmesh_cage_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){points, 10, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){corners, 30, 0, DELMESH_INT32, 1};
    desc.face_sizes = (delmesh_view){sizes, 7, 0, DELMESH_INT32, 1};
    desc.crease_edges = (delmesh_view){ridge, 1, 0, DELMESH_INT32, 2};
    desc.crease_sharpness = (delmesh_view){sharp, 1, 0, DELMESH_FLOAT64, 1};
    desc.layers = &layer;
    desc.layer_count = 1;
    return delmesh_cage_create(context, &desc, out);
}

int has_cages(void) {
    delmesh_context* context = NULL;
    delmesh_cage* cage = NULL;
    assert_int_equal(delmesh_context_create(NULL, &context), DELMESH_OK);
    const int32_t status = create_cage(context, &cage);
    if (status != DELMESH_OK) assert_status(status, context, DELMESH_ERROR_UNSUPPORTED);
    delmesh_cage_destroy(cage);
    delmesh_context_destroy(context);
    return status == DELMESH_OK;
}

/* Through _read, not _borrow: a borrow makes derived arrays, which would count as allocations of the mesh. */
Snapshot take_snapshot(const delmesh_mesh* mesh) {
    const delmesh_mesh_info info = info_of(mesh);
    struct {
        int32_t what;
        int64_t count;
        int32_t type, components, bytes;
    } arrays[] = {
        {DELMESH_POSITION, info.vertices, info.precision, 3, info.precision == DELMESH_FLOAT32 ? 12 : 24},
        {DELMESH_CORNER_VERT, info.corners, DELMESH_INT32, 1, 4},
        {DELMESH_EDGE_VERT, info.edges, DELMESH_INT32, 2, 8},
        {DELMESH_CORNER_EDGE, info.corners, DELMESH_INT32, 1, 4},
        {DELMESH_FACE_SOURCE, info.faces, DELMESH_INT32, 1, 4},
        {DELMESH_VERT_SOURCE, info.vertices, DELMESH_INT32, 1, 4},
        {DELMESH_VERT_JOIN, info.vertices, DELMESH_INT32, 1, 4},
        {DELMESH_EDGE_FLAGS, info.edges, DELMESH_INT32, 1, 4},
        {DELMESH_VERT_MAP_VERT, info.vertices, DELMESH_INT32, 3, 12},
        {DELMESH_VERT_MAP_WEIGHT, info.vertices, DELMESH_FLOAT64, 3, 24},
        {DELMESH_CORNER_TWIN, info.corners, DELMESH_INT32, 1, 4},
        {DELMESH_VERT_PARENT, info.vertices, DELMESH_INT32, 1, 4},
        {DELMESH_EDGE_SOURCE_EDGE, info.edges, DELMESH_INT32, 1, 4},
        {DELMESH_CORNER_MAP_CORNER, info.corners, DELMESH_INT32, 3, 12},
        {DELMESH_CORNER_MAP_WEIGHT, info.corners, DELMESH_FLOAT64, 3, 24},
        {DELMESH_CORNER_CAGE_FACE, info.corners, DELMESH_INT32, 1, 4},
        {DELMESH_CORNER_CAGE_PLACE, info.corners, DELMESH_FLOAT64, 2, 16},
        {DELMESH_VERT_CAGE_FACE, info.vertices, DELMESH_INT32, 1, 4},
        {DELMESH_VERT_CAGE_PLACE, info.vertices, DELMESH_FLOAT64, 2, 16},
        {DELMESH_FACE_CAGE_FACE, info.faces, DELMESH_INT32, 1, 4},
    };
    const size_t kinds = sizeof arrays / sizeof *arrays;
    const int32_t first_of_map = DELMESH_CORNER_MAP_CORNER, first_of_cage = DELMESH_CORNER_CAGE_FACE;
    const int map = has_map(mesh), places = has_places(mesh);
    Snapshot snapshot = {NULL, sizeof info};
    for (size_t i = 0; i < kinds; ++i) {
        if (arrays[i].what >= first_of_cage ? !places : arrays[i].what >= first_of_map && !map)
            arrays[i].count = -1; /* not there */
        if (arrays[i].count >= 0) snapshot.size += (size_t)(arrays[i].count * arrays[i].bytes);
    }
    snapshot.bytes = malloc(snapshot.size);
    memcpy(snapshot.bytes, &info, sizeof info);
    size_t at = sizeof info;
    for (size_t i = 0; i < kinds; ++i) {
        if (arrays[i].count < 0) continue;
        unsigned char* packed = malloc((size_t)(arrays[i].count * arrays[i].bytes) + 1); /* aligned, which `at` is not */
        const delmesh_view_mut dst = {packed, arrays[i].count, 0, arrays[i].type, arrays[i].components};
        assert_status(delmesh_mesh_read(mesh, arrays[i].what, &dst), NULL, DELMESH_OK);
        memcpy(snapshot.bytes + at, packed, (size_t)(arrays[i].count * arrays[i].bytes));
        at += (size_t)(arrays[i].count * arrays[i].bytes);
        free(packed);
    }
    return snapshot;
}

void assert_same_snapshot(Snapshot a, Snapshot b) {
    assert_int_equal(a.size, b.size);
    assert_memory_equal(a.bytes, b.bytes, a.size);
}

void assert_status_at(int32_t status, const delmesh_context* context, int32_t expected, const char* file, int line) {
    if (status != expected)
        print_error("status %s, expected %s: %s\n", delmesh_status_name(status), delmesh_status_name(expected),
                    delmesh_last_error(context));
    _assert_int_equal((LargestIntegralType)status, (LargestIntegralType)expected, file, line);
}

/* ---- Operations ---------------------------------------------------------------------------------------------------------- */

static int32_t subdivide(delmesh_context* context, const delmesh_cage* cage, delmesh_mesh** out) {
    delmesh_subdivide_options options;
    delmesh_subdivide_report report;
    delmesh_subdivide_options_init(&options, sizeof options);
    delmesh_subdivide_report_init(&report, sizeof report);
    report.seconds_total = -1;
    options.value = 3;
    options.measure = 1;
    const int32_t status = delmesh_subdivide(context, cage, &options, out, &report);
    assert_true(report.seconds_total >= 0);
    return status;
}

int32_t fixture_make(Fixture* fixture, delmesh_context* context) {
    const delmesh_mesh_desc sheet = shape_desc(&fixture->sheet), book = shape_desc(&fixture->book);
    int32_t status = delmesh_mesh_create(context, &sheet, &fixture->sheet_mesh);
    if (status == DELMESH_OK) status = delmesh_mesh_create(context, &book, &fixture->book_mesh);
    if (status == DELMESH_OK) status = create_cage(context, &fixture->cage);
    if (status == DELMESH_ERROR_UNSUPPORTED) return DELMESH_OK;
    if (status == DELMESH_OK) status = subdivide(context, fixture->cage, &fixture->cage_mesh);
    return status;
}

void fixture_init(Fixture* fixture, delmesh_context* context) {
    memset(fixture, 0, sizeof *fixture);
    fixture->sheet = sheet_shape(7);
    fixture->book = book_shape();
    if (context != NULL) assert_status(fixture_make(fixture, context), context, DELMESH_OK);
}

void fixture_free(Fixture* fixture) {
    delmesh_mesh_destroy(fixture->sheet_mesh);
    delmesh_mesh_destroy(fixture->book_mesh);
    delmesh_mesh_destroy(fixture->cage_mesh);
    delmesh_cage_destroy(fixture->cage);
    free_shape(&fixture->sheet);
    free_shape(&fixture->book);
}

const char* const operation_names[OPERATIONS] = {"create",   "create welded", "create polygons", "preserve",      "flip",
                                                 "feature",  "certify",       "quality",         "distance",      "estimate",
                                                 "decimate", "family",        "transfer",        "transfer rows", "fit",
                                                 "cage",     "subdivide",     "limit values",    "reevaluate",    "validate"};

static int32_t create(delmesh_context* context, const Shape* shape, int32_t weld, delmesh_mesh** out) {
    delmesh_mesh_desc desc = shape_desc(shape);
    static const int32_t spine[2] = {0, 1};
    desc.marked_edges = (delmesh_view){spine, 1, 0, DELMESH_INT32, 2};
    desc.weld = weld;
    return delmesh_mesh_create(context, &desc, out);
}

static int32_t remesh(delmesh_context* context, const delmesh_mesh* in, int32_t mode, delmesh_mesh** out) {
    delmesh_remesh_options options;
    delmesh_remesh_report report;
    delmesh_remesh_options_init(&options, sizeof options);
    delmesh_remesh_report_init(&report, sizeof report);
    report.seconds_total = -1;
    options.mode = mode;
    options.precision = mode == DELMESH_MODE_PRESERVE ? DELMESH_FLOAT32 : DELMESH_FLOAT64;
    options.placement = mode == DELMESH_MODE_FEATURE ? DELMESH_PLACEMENT_SHELLS : DELMESH_PLACEMENT_INTERVAL;
    const int32_t status = delmesh_remesh(context, in, &options, out, &report);
    assert_true(report.seconds_total >= 0); /* the report is filled after every end */
    if (status == DELMESH_OK) {
        assert_int_equal(report.certified, 1);
        assert_int_equal(report.vertices_in, info_of(in).vertices);
    }
    return status;
}

static int32_t certify(delmesh_context* context, const delmesh_mesh* mesh) {
    enum { ROOM = 64 };
    int64_t edges[ROOM][2];
    uint32_t faces[ROOM];
    memset(edges, 0x77, sizeof edges);
    memset(faces, 0x77, sizeof faces);
    delmesh_certify_options options;
    delmesh_certify_report report;
    delmesh_certify_options_init(&options, sizeof options);
    delmesh_certify_report_init(&report, sizeof report);
    options.nld_edges = (delmesh_view_mut){edges, ROOM, 0, DELMESH_INT64, 2};
    options.zero_area_faces = (delmesh_view_mut){faces, ROOM, 0, DELMESH_UINT32, 1};
    const int32_t status = delmesh_certify(context, mesh, &options, &report);
    const int64_t found = status == DELMESH_OK ? report.nld_interior + report.nld_boundary : 0;
    assert_true(status != DELMESH_OK || (found > 0 && found <= ROOM));
    for (int64_t i = 0; i < ROOM; ++i) { /* the lists hold what was found, and where nothing was, what they held */
        assert_int_equal(edges[i][0] == 0x7777777777777777, i >= found);
        assert_int_equal(faces[i], 0x77777777);
    }
    return status;
}

static int32_t decimate(delmesh_context* context, const delmesh_mesh* in, delmesh_mesh** out) {
    const delmesh_target target = {DELMESH_TARGET_RATIO, 0, 0.5};
    delmesh_level_report level;
    delmesh_decimate_report report;
    delmesh_level_report_init(&level, sizeof level);
    delmesh_decimate_report_init(&report, sizeof report);
    report.seconds_total = -1;
    const int32_t status = delmesh_decimate(context, in, &target, NULL, out, &level, &report);
    assert_true(report.seconds_total >= 0);
    if (status == DELMESH_OK) assert_int_equal(level.certified, 1);
    return status;
}

/* With every array of the options and relaxation. The coarsest level is *out. */
static int32_t family(delmesh_context* context, const Shape* shape, const delmesh_mesh* in, delmesh_mesh** out) {
    enum { LEVELS = 3 };
    const delmesh_target targets[LEVELS] = {
        {DELMESH_TARGET_FULL, 0, 0}, {DELMESH_TARGET_DEVIATION, 0, 0.5}, {DELMESH_TARGET_FACES, 0, 8}};
    double* weights = malloc((size_t)shape->verts * sizeof *weights);
    uint8_t* locked = malloc((size_t)shape->verts);
    int32_t* mask = malloc((size_t)shape->faces * sizeof *mask);
    for (int32_t v = 0; v < shape->verts; ++v) weights[v] = 1 + v % 3, locked[v] = v % 7 == 0;
    for (int32_t f = 0; f < shape->faces; ++f) mask[f] = f % 9 != 0;
    delmesh_decimate_options options;
    delmesh_decimate_options_init(&options, sizeof options);
    options.quality = 1;
    options.prune = 0.25;
    options.precision = DELMESH_FLOAT64;
    options.vert_weights = (delmesh_view){weights, shape->verts, 0, DELMESH_FLOAT64, 1};
    options.locked_verts = (delmesh_view){locked, shape->verts, 0, DELMESH_UINT8, 1};
    options.face_mask = (delmesh_view){mask, shape->faces, 0, DELMESH_INT32, 1};
    delmesh_level_report levels[LEVELS];
    delmesh_mesh* made[LEVELS];
    for (int i = 0; i < LEVELS; ++i) {
        delmesh_level_report_init(&levels[i], sizeof levels[i]);
        made[i] = (delmesh_mesh*)(uintptr_t)1;
    }
    const int32_t status = delmesh_lod_family(context, in, targets, LEVELS, &options, made, levels, NULL);
    free(weights), free(locked), free(mask);
    for (int i = 0; i < LEVELS; ++i) assert_int_equal(made[i] != NULL, status == DELMESH_OK); /* all or none */
    for (int i = 0; i + 1 < LEVELS; ++i) delmesh_mesh_destroy(made[i]);
    *out = made[LEVELS - 1];
    return status;
}

/* A layer and sparse rows through the maps of an imported mesh. What is refused writes nothing, but for a cancel. */
static int32_t transfer(delmesh_context* context, const Shape* shape, const delmesh_mesh* mesh) {
    const int64_t verts = info_of(mesh).vertices;
    double* places = malloc((size_t)verts * 3 * sizeof *places);
    const delmesh_view layer = {shape->positions, shape->verts, 0, DELMESH_FLOAT64, 3};
    const delmesh_view_mut into = {places, verts, 0, DELMESH_FLOAT64, 3};
    const int32_t status = delmesh_transfer(context, mesh, DELMESH_DOMAIN_VERTEX, DELMESH_TRANSFER_LINEAR, &layer, &into);
    if (status == DELMESH_OK) assert_memory_equal(places, shape->positions, (size_t)shape->verts * 24);
    free(places);
    return status;
}

/* On the mesh that it came from a layer fits already: it may be a rounding off, no more. */
static int32_t fit(delmesh_context* context, const Shape* shape, const delmesh_mesh* mesh) {
    const int64_t count = 3 * info_of(mesh).vertices;
    double* places = malloc((size_t)count * sizeof *places);
    const delmesh_view layer = {shape->positions, shape->verts, 0, DELMESH_FLOAT64, 3};
    const delmesh_view_mut into = {places, count / 3, 0, DELMESH_FLOAT64, 3};
    const int32_t status =
        delmesh_transfer_fitted(context, mesh, mesh, DELMESH_DOMAIN_VERTEX, DELMESH_TRANSFER_LINEAR, &layer, &into);
    for (int64_t i = 0; i < count && status == DELMESH_OK; ++i)
        assert_true(places[i] - shape->positions[i] < 1e-13 && shape->positions[i] - places[i] < 1e-13);
    free(places);
    return status;
}

static int32_t transfer_rows(delmesh_context* context, const Shape* shape, const delmesh_mesh* mesh) {
    const int64_t verts = info_of(mesh).vertices;
    int64_t* offsets = malloc((size_t)(shape->verts + 1) * sizeof *offsets);
    int32_t* indices = malloc((size_t)shape->verts * 2 * sizeof *indices);
    float* values = malloc((size_t)shape->verts * 2 * sizeof *values);
    for (int32_t v = 0; v <= shape->verts; ++v) offsets[v] = 2 * v;
    for (int32_t k = 0; k < 2 * shape->verts; ++k) indices[k] = (k * 5) % 7, values[k] = 0.5f;
    int32_t* bones = malloc((size_t)verts * 2 * sizeof *bones);
    float* weights = malloc((size_t)verts * 2 * sizeof *weights);
    int64_t* ends = malloc((size_t)(verts + 1) * sizeof *ends);
    memset(ends, 0x77, (size_t)(verts + 1) * sizeof *ends);
    const delmesh_rows rows = {{offsets, shape->verts + 1, 0, DELMESH_INT64, 1},
                               {indices, 2 * (int64_t)shape->verts, 0, DELMESH_INT32, 1},
                               {values, 2 * (int64_t)shape->verts, 0, DELMESH_FLOAT32, 1}};
    const delmesh_rows_mut target = {{ends, verts + 1, 0, DELMESH_INT64, 1},
                                     {bones, 2 * verts, 0, DELMESH_INT32, 1},
                                     {weights, 2 * verts, 0, DELMESH_FLOAT32, 1}};
    const int32_t status = delmesh_transfer_sparse(context, mesh, &rows, 2, 1, &target);
    if (status == DELMESH_OK)
        assert_int_equal(ends[verts], 2 * verts);
    else if (status != DELMESH_ERROR_CANCELLED)
        for (int64_t v = 0; v <= verts; ++v) assert_int_equal(ends[v], 0x7777777777777777);
    free(offsets), free(indices), free(values), free(bones), free(weights), free(ends);
    return status;
}

static int32_t only_create_cage(delmesh_context* context) {
    delmesh_cage* cage = (delmesh_cage*)(uintptr_t)1;
    const int32_t status = create_cage(context, &cage);
    assert_int_equal(cage != NULL, status == DELMESH_OK);
    delmesh_cage_destroy(cage);
    return status;
}

static int32_t limit_values(delmesh_context* context, const Fixture* fixture) {
    const int64_t corners = info_of(fixture->cage_mesh).corners;
    float* values = malloc((size_t)corners * 8);
    const delmesh_view_mut uvs = {values, corners, 0, DELMESH_FLOAT32, 2};
    const int32_t status = delmesh_limit_values(context, fixture->cage, fixture->cage_mesh, DELMESH_DOMAIN_CORNER, 0, NULL, &uvs);
    free(values);
    return status;
}

static int32_t reevaluate(delmesh_context* context, const Fixture* fixture, delmesh_mesh** out) {
    float pose[10][3];
    for (int i = 0; i < 30; ++i) pose[i / 3][i % 3] = (float)(i % 7);
    const delmesh_view positions = {pose, 10, 0, DELMESH_FLOAT32, 3};
    delmesh_reevaluate_report report;
    delmesh_reevaluate_report_init(&report, sizeof report);
    return delmesh_reevaluate(context, fixture->cage, fixture->cage_mesh, &positions, out, &report);
}

int32_t run_operation(int operation, delmesh_context* context, const Fixture* fixture, delmesh_mesh** out) {
    *out = NULL;
    switch (operation) {
    case 0:
        return create(context, &fixture->sheet, DELMESH_WELD_NONE, out);
    case 1:
        return create(context, &fixture->book, DELMESH_WELD_EXACT, out);
    case 2:
        return create_quad_cube(context, out);
    case 3:
        return remesh(context, fixture->sheet_mesh, DELMESH_MODE_PRESERVE, out);
    case 4:
        return remesh(context, fixture->sheet_mesh, DELMESH_MODE_FLIP, out);
    case 5:
        return remesh(context, fixture->book_mesh, DELMESH_MODE_FEATURE, out);
    case 6:
        return certify(context, fixture->sheet_mesh);
    case 7: {
        delmesh_quality_report report;
        delmesh_quality_report_init(&report, sizeof report);
        return delmesh_measure_quality(context, fixture->sheet_mesh, &report);
    }
    case 8: {
        delmesh_distance_options options;
        delmesh_distance_report report;
        delmesh_distance_options_init(&options, sizeof options);
        delmesh_distance_report_init(&report, sizeof report);
        options.samples = 100;
        return delmesh_measure_distance(context, fixture->sheet_mesh, fixture->book_mesh, &options, &report);
    }
    case 9: {
        delmesh_preserve_estimate estimate;
        delmesh_preserve_estimate_init(&estimate, sizeof estimate);
        return delmesh_estimate_preserve(context, fixture->sheet_mesh, NULL, &estimate);
    }
    case 10:
        return decimate(context, fixture->sheet_mesh, out);
    case 11:
        return family(context, &fixture->sheet, fixture->sheet_mesh, out);
    case 12:
        return transfer(context, &fixture->sheet, fixture->sheet_mesh);
    case 13:
        return transfer_rows(context, &fixture->sheet, fixture->sheet_mesh);
    case 14:
        return fit(context, &fixture->sheet, fixture->sheet_mesh);
    case 15: /* where there are no cages, something else */
        return fixture->cage != NULL ? only_create_cage(context) : create_quad_cube(context, out);
    case 16:
        return fixture->cage != NULL ? subdivide(context, fixture->cage, out) : create_quad_cube(context, out);
    case 17:
        return fixture->cage != NULL ? limit_values(context, fixture) : create_quad_cube(context, out);
    case 18:
        return fixture->cage != NULL ? reevaluate(context, fixture, out) : create_quad_cube(context, out);
    default:
        return delmesh_mesh_validate(context, fixture->sheet_mesh);
    }
}
