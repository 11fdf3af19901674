/* SPDX-License-Identifier: Apache-2.0
 *
 * bench_decimate.c: what decimation costs, through the C interface, beside meshoptimizer's meshopt_simplify where that is there.
 *     bench_decimate [--ratio R | --family] [--quality N] [--prepare flip|preserve|feature] [--placement all|paper|endpoints]
 *                    [--precision f32|f64] [--threads N] [--repeat N] [--subdivide N] [--growth] [--shuffle] [--map] FILE...
 * Both begin with the same arrays, float32 positions and triangles, and go to the same share of the triangles: 10 % if not told,
 * with --family 50, 10 and 2 % one after the other (meshopt_simplify goes on from its own last level, which is its fastest way).
 * They take turns; of each the fastest repetition is printed. Times are processor time, so that other work of the machine counts
 * as little as can be: `decimate` from the Delaunay mesh to the last level (its stages "decimate" and what is told in them, that
 * is with the copy that is edited and the making of the levels, but without maps and certificates), `call` the whole of
 * delmesh_lod_family: with making Delaunay, maps to the source and certificates. `wall` is the report's seconds_decimate.
 * --growth: each file as it is and after 1, 2, ... --subdivide steps; the last column is ns/vertex against the first row.
 * --map: with what lets attributes be carried over. Not in `decimate`, but in `call` and in the memory.
 * --shuffle: vertices and triangles in an order without any locality, for both.
 */
#include "mesh_file.h"
#include "subdivide.h"

#include <delmesh/delmesh.h>
#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#ifdef BENCH_MESHOPT
#include <meshoptimizer.h>
#endif

enum { kMostLevels = 3 };

typedef struct Settings {
    delmesh_decimate_options options;
    double ratios[kMostLevels];
    int32_t levels;
    int threads, repeat, subdivide;
    bool growth, shuffle;
} Settings;

/* What both begin with. */
typedef struct Input {
    float* positions;
    uint32_t* corners;
    int64_t vertices, faces;
} Input;

typedef struct Sample {
    double decimate, call, wall; /* seconds; processor time but for wall */
    int64_t removed, vertices, faces;
    uint64_t peak;
    delmesh_decimate_report report;
} Sample;

static double cpu_now(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- Input */

static bool is_option(const char* word) {
    return strncmp(word, "--", 2) == 0;
}

static uint64_t scramble(uint64_t x) {
    x = (x ^ x >> 31) * 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 29) * 0xbf58476d1ce4e5b9u;
    return x ^ x >> 32;
}

/* A permutation of 0..count-1, the same in every run; NULL: no memory. */
static uint32_t* permutation(int64_t count) {
    uint32_t* order = malloc((size_t)count * sizeof *order + 1);
    if (order == NULL) return NULL;
    for (int64_t i = 0; i < count; ++i) order[i] = (uint32_t)i;
    for (int64_t i = count - 1; i > 0; --i) {
        const int64_t j = (int64_t)(scramble((uint64_t)i) % (uint64_t)(i + 1));
        const uint32_t other = order[i];
        order[i] = order[j];
        order[j] = other;
    }
    return order;
}

static void input_free(Input* in) {
    free(in->positions);
    free(in->corners);
}

static bool shuffle(Input* in) {
    uint32_t *place = permutation(in->vertices), *order = permutation(in->faces);
    float* positions = malloc((size_t)in->vertices * 3 * sizeof *positions + 1);
    uint32_t* corners = malloc((size_t)in->faces * 3 * sizeof *corners + 1);
    const bool ok = place != NULL && order != NULL && positions != NULL && corners != NULL;
    if (ok) {
        for (int64_t v = 0; v < in->vertices; ++v)
            memcpy(positions + 3 * (int64_t)place[v], in->positions + 3 * v, 3 * sizeof(float));
        for (int64_t f = 0; f < in->faces; ++f)
            for (int k = 0; k < 3; ++k) corners[3 * f + k] = place[in->corners[3 * (int64_t)order[f] + k]];
        input_free(in);
        in->positions = positions;
        in->corners = corners;
    } else {
        free(positions);
        free(corners);
    }
    free(place);
    free(order);
    return ok;
}

/* Triangles of polygons: fans. */
static bool input_of(const MeshFile* file, bool shuffled, Input* in) {
    memset(in, 0, sizeof *in);
    in->vertices = file->vertex_count;
    int64_t begin = 0, at = 0;
    for (int64_t f = 0; f < file->face_count; ++f) {
        const int32_t size = file->face_sizes != NULL ? file->face_sizes[f] : 3;
        in->faces += size > 2 ? size - 2 : 0;
    }
    in->positions = malloc((size_t)in->vertices * 3 * sizeof(float) + 1);
    in->corners = malloc((size_t)in->faces * 3 * sizeof(uint32_t) + 1);
    if (in->positions == NULL || in->corners == NULL) return false;
    for (int64_t i = 0; i < 3 * in->vertices; ++i)
        in->positions[i] =
            file->precision == DELMESH_FLOAT32 ? ((const float*)file->positions)[i] : (float)((const double*)file->positions)[i];
    for (int64_t f = 0; f < file->face_count; ++f) {
        const int32_t size = file->face_sizes != NULL ? file->face_sizes[f] : 3;
        for (int32_t k = 2; k < size; ++k) {
            in->corners[at++] = (uint32_t)file->corner_verts[begin];
            in->corners[at++] = (uint32_t)file->corner_verts[begin + k - 1];
            in->corners[at++] = (uint32_t)file->corner_verts[begin + k];
        }
        begin += size;
    }
    return !shuffled || shuffle(in);
}

/* ---- The library */

/* Processor time of the stages "decimate", as the library tells when a stage begins. */
typedef struct StageClock {
    double begin, total;
    bool runs;
} StageClock;

static int32_t on_progress(void* user, double fraction, const char* stage) {
    (void)fraction;
    StageClock* clock = user;
    const bool decimates = strcmp(stage, "decimate") == 0;
    if (decimates != clock->runs) {
        const double now = cpu_now();
        if (clock->runs) clock->total += now - clock->begin;
        clock->begin = now;
        clock->runs = decimates;
    }
    return DELMESH_CONTINUE;
}

static int32_t decimate_in(delmesh_context* context, const Input* input, const Settings* settings, StageClock* clock, Sample* s) {
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){input->positions, input->vertices, 0, DELMESH_FLOAT32, 3};
    desc.corner_verts = (delmesh_view){input->corners, 3 * input->faces, 0, DELMESH_UINT32, 1};
    delmesh_mesh *in = NULL, *out[kMostLevels] = {NULL};
    delmesh_target targets[kMostLevels];
    delmesh_level_report levels[kMostLevels];
    for (int32_t i = 0; i < settings->levels; ++i) {
        targets[i] = (delmesh_target){DELMESH_TARGET_RATIO, 0, settings->ratios[i]};
        delmesh_level_report_init(&levels[i], sizeof levels[i]);
    }
    delmesh_decimate_report_init(&s->report, sizeof s->report);
    int32_t status = delmesh_mesh_create(context, &desc, &in);
    *clock = (StageClock){0, 0, false};
    const double begin = cpu_now();
    if (status == DELMESH_OK)
        status = delmesh_lod_family(context, in, targets, settings->levels, &settings->options, out, levels, &s->report);
    s->call = cpu_now() - begin;
    on_progress(clock, 1, "");
    s->decimate = clock->total;
    s->wall = s->report.seconds_decimate;
    delmesh_context_memory(context, NULL, &s->peak, NULL);
    if (status == DELMESH_OK) {
        s->vertices = levels[settings->levels - 1].vertices;
        s->faces = levels[settings->levels - 1].faces;
        s->removed = s->report.collapses;
    }
    for (int32_t i = 0; i < settings->levels; ++i) delmesh_mesh_destroy(out[i]);
    delmesh_mesh_destroy(in);
    return status;
}

/* One run in a context of its own; *best is replaced if this one was faster, or the first (its call is 0 then). */
static bool run_decimate(const char* name, const Input* input, const Settings* settings, Sample* best) {
    StageClock clock;
    delmesh_context_options options;
    delmesh_context_options_init(&options, sizeof options);
    options.max_threads = settings->threads;
    options.user = &clock;
    options.progress = on_progress;
    delmesh_context* context = NULL;
    clock = (StageClock){0, 0, false};
    int32_t status = delmesh_context_create(&options, &context);
    Sample sample = {0};
    if (status == DELMESH_OK) status = decimate_in(context, input, settings, &clock, &sample);
    if (status != DELMESH_OK) fprintf(stderr, "%s: %s: %s\n", name, delmesh_status_name(status), delmesh_last_error(context));
    if (best->call == 0 || sample.decimate < best->decimate) *best = sample;
    delmesh_context_destroy(context);
    return status == DELMESH_OK;
}

/* ---- The peer */

typedef struct PeerSample {
    double seconds; /* processor time; 0: not there */
    int64_t faces;
} PeerSample;

static bool run_peer(const Input* input, const Settings* settings, PeerSample* best) {
#ifdef BENCH_MESHOPT
    unsigned int* corners = malloc((size_t)input->faces * 3 * sizeof *corners + 1);
    unsigned int* result = malloc((size_t)input->faces * 3 * sizeof *result + 1);
    const bool ok = corners != NULL && result != NULL;
    if (ok) {
        memcpy(corners, input->corners, (size_t)input->faces * 3 * sizeof *corners);
        size_t count = (size_t)input->faces * 3;
        const double begin = cpu_now();
        for (int32_t i = 0; i < settings->levels; ++i) {
            const size_t target = 3 * (size_t)(settings->ratios[i] * (double)input->faces);
            count = meshopt_simplify(result, corners, count, input->positions, (size_t)input->vertices, 3 * sizeof(float), target,
                                     FLT_MAX, 0, NULL);
            unsigned int* const other = corners;
            corners = result;
            result = other;
        }
        const double seconds = cpu_now() - begin;
        if (best->seconds == 0 || seconds < best->seconds) *best = (PeerSample){seconds, (int64_t)(count / 3)};
    }
    free(corners);
    free(result);
    return ok;
#else
    (void)input, (void)settings, (void)best;
    return true;
#endif
}

/* ---- The table */

static const char* base_name(const char* path) {
    const char* slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

static void print_heading(void) {
    printf("%-26s %9s %8s %8s %8s %8s %8s %9s %6s %9s %7s %7s %7s\n", "mesh", "triangles", "left", "decimate", "call", "wall",
           "ns/vert", "verts/s", "B/tri", "meshopt", "left", "times", "growth");
}

/* base: ns per vertex of the first row of the file; 0 where this is it. */
static bool print_row(const char* path, const MeshFile* file, const Settings* settings, double* base) {
    const char* name = base_name(path);
    Input input;
    Sample best = {0};
    PeerSample peer = {0};
    bool ok = input_of(file, settings->shuffle, &input);
    if (!ok) fprintf(stderr, "%s: no memory\n", name);
    for (int i = 0; i < settings->repeat && ok; ++i) /* taking turns: whatever else the machine does, it does to both */
        ok = run_decimate(name, &input, settings, &best) && run_peer(&input, settings, &peer);
    if (ok) {
        const double per_vertex = best.removed > 0 ? 1e9 * best.decimate / (double)best.removed : 0;
        if (*base == 0) *base = per_vertex;
        printf("%-26s %9lld %8lld %8.1f %8.1f %8.1f %8.0f %9.0f %6.0f", name, (long long)input.faces, (long long)best.faces,
               1e3 * best.decimate, 1e3 * best.call, 1e3 * best.wall, per_vertex, best.decimate > 0 ? 1e9 / per_vertex : 0,
               (double)best.peak / (double)input.faces);
        if (peer.seconds > 0)
            printf(" %9.1f %7lld %7.2f", 1e3 * peer.seconds, (long long)peer.faces, best.decimate / peer.seconds);
        else
            printf(" %9s %7s %7s", "-", "-", "-");
        printf(" %7.2f\n", *base > 0 ? per_vertex / *base : 0);
        fflush(stdout);
    }
    input_free(&input);
    return ok;
}

static bool bench_file(const char* path, const Settings* settings) {
    MeshFile file;
    if (!read_subdivided(path, 0, &file)) return false;
    bool ok = true;
    double base = 0;
    for (int i = 0; i <= settings->subdivide && ok; ++i) {
        if (i > 0) ok = subdivide(&file);
        if (!ok) fprintf(stderr, "%s: no memory to subdivide, or too big\n", path);
        if (ok && (settings->growth || i == settings->subdivide)) ok = print_row(path, &file, settings, &base);
    }
    mesh_file_free(&file);
    return ok;
}

/* ---- Arguments */

static bool set_flag(Settings* settings, const char* name) {
    if (strcmp(name, "--family") == 0) {
        const double family[kMostLevels] = {0.5, 0.1, 0.02};
        memcpy(settings->ratios, family, sizeof family);
        settings->levels = kMostLevels;
    } else if (strcmp(name, "--growth") == 0)
        settings->growth = true;
    else if (strcmp(name, "--shuffle") == 0)
        settings->shuffle = true;
    else if (strcmp(name, "--map") == 0)
        settings->options.map = 1;
    else
        return false;
    return true;
}

/* One option with its value; false if there is no such option. */
static bool set_option(Settings* settings, const char* name, const char* value) {
    delmesh_decimate_options* options = &settings->options;
    if (strcmp(name, "--ratio") == 0) {
        settings->ratios[0] = atof(value);
        settings->levels = 1;
    } else if (strcmp(name, "--quality") == 0)
        options->quality = atoi(value);
    else if (strcmp(name, "--prepare") == 0)
        options->prepare = strcmp(value, "preserve") == 0  ? DELMESH_MODE_PRESERVE
                           : strcmp(value, "feature") == 0 ? DELMESH_MODE_FEATURE
                                                           : DELMESH_MODE_FLIP;
    else if (strcmp(name, "--placement") == 0)
        options->collapse_placement = strcmp(value, "paper") == 0       ? DELMESH_COLLAPSE_PAPER
                                      : strcmp(value, "endpoints") == 0 ? DELMESH_COLLAPSE_ENDPOINTS
                                                                        : DELMESH_COLLAPSE_ALL;
    else if (strcmp(name, "--precision") == 0)
        options->precision = strcmp(value, "f64") == 0 ? DELMESH_FLOAT64 : DELMESH_FLOAT32;
    else if (strcmp(name, "--threads") == 0)
        settings->threads = atoi(value);
    else if (strcmp(name, "--repeat") == 0)
        settings->repeat = atoi(value);
    else if (strcmp(name, "--subdivide") == 0)
        settings->subdivide = atoi(value);
    else
        return false;
    return true;
}

int main(int argc, char** argv) {
    Settings settings = {.ratios = {0.1}, .levels = 1, .threads = 1, .repeat = 5};
    delmesh_decimate_options_init(&settings.options, sizeof settings.options);
    int at = 1;
    bool ok = true;
    while (ok && at < argc && is_option(argv[at])) {
        if (set_flag(&settings, argv[at]))
            at += 1;
        else if (at + 1 < argc && set_option(&settings, argv[at], argv[at + 1]))
            at += 2;
        else
            ok = false;
    }
    if (!ok || at >= argc || settings.repeat < 1) {
        fprintf(stderr,
                "usage: bench_decimate [--ratio R | --family] [--quality N] [--prepare flip|preserve|feature]\n"
                "                      [--placement all|paper|endpoints] [--precision f32|f64] [--threads N] [--repeat N]\n"
                "                      [--subdivide N] [--growth] [--shuffle] [--map] FILE...\n");
        return 2;
    }
    print_heading();
    int failed = 0;
    for (; at < argc; ++at) failed |= !bench_file(argv[at], &settings);
    return failed;
}
