/* SPDX-License-Identifier: Apache-2.0
 *
 * level_check.c: what only the C interface shows of a family of levels: parents, sources, maps to the source. Prints one JSON line
 * with what is wrong with them, counted per level; run_families.py judges.
 *     level_check [--mode flip|preserve|feature] [--precision f32|f64] [--quality N] [--threads N] [--ratios R,R,...] FILE
 * Levels: the whole Delaunay mesh, then the ratios of the input's triangles (0.5,0.1,0.02,0).
 *     invalid        delmesh_mesh_validate found a broken invariant
 *     bad_parents    vertices whose parent is no vertex of the next coarser level (of the last level: is not itself)
 *     no_children    vertices of the next coarser level that no vertex went into
 *     torn_parents   edges whose vertices' parents are in different components of the next coarser level
 *     bad_sources    vertices that are not, bit for bit at the level's precision, the source vertex they are said to be
 *     bad_faces      faces whose source is no polygon
 *     bad_weights    maps with a source vertex out of range, a weight below -1e-9, or a sum that is not 1 within 1e-9
 *     map_percent    the farthest that a vertex is from its place on the source, in percent of the source's diagonal
 *     parent_percent the farthest that a vertex is from its parent, likewise
 *     folded_edges   edges between faces whose normals differ by more than 160 degrees
 * Exit status: 0 if the family was made, else 2.
 */
#include "mesh_file.h"

#include <delmesh/delmesh.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { kMostLevels = 16 };

typedef struct Level {
    int64_t vertices, faces, edges;
    double* positions;  /* vertices x 3 */
    int32_t* corners;   /* faces x 3 */
    int32_t* twins;     /* faces x 3 */
    int32_t* ends;      /* edges x 2 */
    int32_t* parents;   /* vertices */
    int32_t* sources;   /* vertices */
    int32_t* polygons;  /* faces */
    int32_t* map_verts; /* vertices x 3 */
    double* map_weights;
    int32_t* component; /* vertices */
} Level;

static void* room(int64_t count, size_t size) {
    void* memory = calloc((size_t)count + 1, size);
    if (memory == NULL) {
        fprintf(stderr, "no memory\n");
        exit(2);
    }
    return memory;
}

static void read_array(const delmesh_mesh* mesh, int32_t what, void* data, int64_t count, int32_t type, int32_t components) {
    const delmesh_view_mut view = {data, count, 0, type, components};
    const int32_t status = delmesh_mesh_read(mesh, what, &view);
    if (status == DELMESH_OK) return;
    fprintf(stderr, "array %d: %s\n", what, delmesh_status_name(status));
    exit(2);
}

static int32_t root_of(int32_t* parent, int32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
}

static void read_level(const delmesh_mesh* mesh, Level* l) {
    delmesh_mesh_info info;
    delmesh_mesh_info_init(&info, sizeof info);
    delmesh_mesh_get_info(mesh, &info);
    l->vertices = info.vertices;
    l->faces = info.faces;
    l->edges = info.edges;
    l->positions = room(3 * l->vertices, sizeof(double));
    l->corners = room(3 * l->faces, sizeof(int32_t));
    l->twins = room(3 * l->faces, sizeof(int32_t));
    l->ends = room(2 * l->edges, sizeof(int32_t));
    l->parents = room(l->vertices, sizeof(int32_t));
    l->sources = room(l->vertices, sizeof(int32_t));
    l->polygons = room(l->faces, sizeof(int32_t));
    l->map_verts = room(3 * l->vertices, sizeof(int32_t));
    l->map_weights = room(3 * l->vertices, sizeof(double));
    l->component = room(l->vertices, sizeof(int32_t));
    read_array(mesh, DELMESH_POSITION, l->positions, l->vertices, DELMESH_FLOAT64, 3);
    read_array(mesh, DELMESH_CORNER_VERT, l->corners, 3 * l->faces, DELMESH_INT32, 1);
    read_array(mesh, DELMESH_CORNER_TWIN, l->twins, 3 * l->faces, DELMESH_INT32, 1);
    read_array(mesh, DELMESH_EDGE_VERT, l->ends, l->edges, DELMESH_INT32, 2);
    read_array(mesh, DELMESH_VERT_PARENT, l->parents, l->vertices, DELMESH_INT32, 1);
    read_array(mesh, DELMESH_VERT_SOURCE, l->sources, l->vertices, DELMESH_INT32, 1);
    read_array(mesh, DELMESH_FACE_SOURCE, l->polygons, l->faces, DELMESH_INT32, 1);
    read_array(mesh, DELMESH_VERT_MAP_VERT, l->map_verts, l->vertices, DELMESH_INT32, 3);
    read_array(mesh, DELMESH_VERT_MAP_WEIGHT, l->map_weights, l->vertices, DELMESH_FLOAT64, 3);
    for (int64_t v = 0; v < l->vertices; ++v) l->component[v] = (int32_t)v;
    for (int64_t e = 0; e < l->edges; ++e) {
        const int32_t a = root_of(l->component, l->ends[2 * e]), b = root_of(l->component, l->ends[2 * e + 1]);
        l->component[a > b ? a : b] = a < b ? a : b;
    }
    for (int64_t v = 0; v < l->vertices; ++v) l->component[v] = root_of(l->component, (int32_t)v);
}

static void free_level(Level* l) {
    void* const arrays[] = {l->positions, l->corners,  l->twins,     l->ends,        l->parents,
                            l->sources,   l->polygons, l->map_verts, l->map_weights, l->component};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; ++i) free(arrays[i]);
}

static double distance(const double* a, const double* b) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

static bool normal_of(const Level* l, int64_t face, double n[3]) {
    const double *p[3], *origin = l->positions + 3 * (int64_t)l->corners[3 * face];
    for (int k = 0; k < 3; ++k) p[k] = l->positions + 3 * (int64_t)l->corners[3 * face + k];
    double u[3], w[3];
    for (int k = 0; k < 3; ++k) u[k] = p[1][k] - origin[k], w[k] = p[2][k] - origin[k];
    for (int k = 0; k < 3; ++k) n[k] = u[(k + 1) % 3] * w[(k + 2) % 3] - u[(k + 2) % 3] * w[(k + 1) % 3];
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3; ++k) n[k] /= length;
    return length > 0;
}

static int64_t folded_edges(const Level* l) {
    int64_t folded = 0;
    for (int64_t c = 0; c < 3 * l->faces; ++c) {
        double n[3], m[3];
        if (l->twins[c] <= c || !normal_of(l, c / 3, n) || !normal_of(l, l->twins[c] / 3, m)) continue;
        folded += n[0] * m[0] + n[1] * m[1] + n[2] * m[2] < -0.93969; /* cos 160 degrees */
    }
    return folded;
}

/* next: the next coarser level, or NULL. */
static void print_level(const Level* l, const Level* next, const MeshFile* file, const double* source, double diagonal,
                        int32_t precision, bool valid) {
    int64_t bad_parents = 0, no_children = 0, torn = 0, bad_sources = 0, bad_faces = 0, bad_weights = 0;
    double map_far = 0, parent_far = 0;
    char* has_child = room(next != NULL ? next->vertices : 0, 1);
    for (int64_t v = 0; v < l->vertices; ++v) {
        const int32_t parent = l->parents[v];
        if (next == NULL) {
            bad_parents += parent != v;
        } else if (parent < 0 || parent >= next->vertices) {
            ++bad_parents;
        } else {
            has_child[parent] = 1;
            const double d = distance(l->positions + 3 * v, next->positions + 3 * (int64_t)parent);
            if (d > parent_far) parent_far = d;
        }
        const double* p = l->positions + 3 * v;
        const int32_t s = l->sources[v];
        if (s >= file->vertex_count) ++bad_sources;
        if (s >= 0 && s < file->vertex_count)
            for (int k = 0; k < 3; ++k) {
                const double x = source[3 * (int64_t)s + k], rounded = precision == DELMESH_FLOAT32 ? (double)(float)x : x;
                if (p[k] != rounded) {
                    ++bad_sources;
                    break;
                }
            }
        double sum = 0, place[3] = {0, 0, 0};
        bool fine = true;
        for (int k = 0; k < 3; ++k) {
            const int32_t u = l->map_verts[3 * v + k];
            const double w = l->map_weights[3 * v + k];
            fine = fine && u >= 0 && u < file->vertex_count && w >= -1e-9;
            sum += w;
            for (int i = 0; i < 3 && fine; ++i) place[i] += w != 0 ? w * source[3 * (int64_t)u + i] : 0;
        }
        fine = fine && fabs(sum - 1) <= 1e-9;
        bad_weights += !fine;
        const double d = fine ? distance(p, place) : 0;
        if (!(d <= map_far)) map_far = d;
    }
    for (int64_t v = 0; next != NULL && v < next->vertices; ++v) no_children += !has_child[v];
    for (int64_t e = 0; next != NULL && bad_parents == 0 && e < l->edges; ++e)
        torn += next->component[l->parents[l->ends[2 * e]]] != next->component[l->parents[l->ends[2 * e + 1]]];
    for (int64_t f = 0; f < l->faces; ++f) bad_faces += l->polygons[f] < 0 || l->polygons[f] >= file->face_count;
    printf(
        "{\"vertices\": %lld, \"faces\": %lld, \"invalid\": %d, \"bad_parents\": %lld, \"no_children\": %lld, \"torn_parents\": "
        "%lld, \"bad_sources\": %lld, \"bad_faces\": %lld, \"bad_weights\": %lld, \"map_percent\": %.9g, \"parent_percent\": "
        "%.9g, \"folded_edges\": %lld}",
        (long long)l->vertices, (long long)l->faces, !valid, (long long)bad_parents, (long long)no_children, (long long)torn,
        (long long)bad_sources, (long long)bad_faces, (long long)bad_weights, 100 * map_far / diagonal,
        100 * parent_far / diagonal, (long long)folded_edges(l));
    free(has_child);
}

static double diagonal_of(const MeshFile* file, const double* points) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int64_t c = 0; c < file->corner_count; ++c)
        for (int k = 0; k < 3; ++k) {
            const double x = points[3 * (int64_t)file->corner_verts[c] + k];
            if (!isfinite(x)) continue;
            low[k] = fmin(low[k], x);
            high[k] = fmax(high[k], x);
        }
    return distance(low, high);
}

static int fail(const delmesh_context* context, int32_t status) {
    fprintf(stderr, "%s: %s\n", delmesh_status_name(status), delmesh_last_error(context));
    return 2;
}

static int run(const MeshFile* file, const delmesh_decimate_options* options, int threads, delmesh_target* targets,
               int32_t count) {
    double* source = room(3 * file->vertex_count, sizeof(double));
    for (int64_t i = 0; i < 3 * file->vertex_count; ++i)
        source[i] =
            file->precision == DELMESH_FLOAT32 ? (double)((const float*)file->positions)[i] : ((const double*)file->positions)[i];
    delmesh_context_options context_options;
    delmesh_context_options_init(&context_options, sizeof context_options);
    context_options.max_threads = threads;
    delmesh_context* context = NULL;
    int32_t status = delmesh_context_create(&context_options, &context);
    if (status != DELMESH_OK) return fail(NULL, status);
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = (delmesh_view){file->positions, file->vertex_count, 0, file->precision, 3};
    desc.corner_verts = (delmesh_view){file->corner_verts, file->corner_count, 0, DELMESH_INT32, 1};
    if (file->face_sizes != NULL) desc.face_sizes = (delmesh_view){file->face_sizes, file->face_count, 0, DELMESH_INT32, 1};
    delmesh_mesh *in = NULL, *made[kMostLevels] = {NULL};
    status = delmesh_mesh_create(context, &desc, &in);
    if (status == DELMESH_OK) status = delmesh_lod_family(context, in, targets, count, options, made, NULL, NULL);
    if (status != DELMESH_OK) return fail(context, status);
    Level levels[kMostLevels];
    for (int32_t i = 0; i < count; ++i) read_level(made[i], &levels[i]);
    const double diagonal = diagonal_of(file, source);
    Level given;
    read_level(in, &given);
    printf("{\"folded_edges\": %lld, \"levels\": [", (long long)folded_edges(&given));
    free_level(&given);
    for (int32_t i = 0; i < count; ++i) {
        if (i > 0) printf(", ");
        print_level(&levels[i], i + 1 < count ? &levels[i + 1] : NULL, file, source, diagonal, options->precision,
                    delmesh_mesh_validate(context, made[i]) == DELMESH_OK);
    }
    printf("]}\n");
    for (int32_t i = 0; i < count; ++i) {
        free_level(&levels[i]);
        delmesh_mesh_destroy(made[i]);
    }
    delmesh_mesh_destroy(in);
    delmesh_context_destroy(context);
    free(source);
    return 0;
}

static int32_t parse_ratios(const char* text, delmesh_target* targets) {
    int32_t count = 0;
    targets[count++] = (delmesh_target){DELMESH_TARGET_FULL, 0, 0};
    for (char* end = NULL; count < kMostLevels; text = end + 1) {
        const double value = strtod(text, &end);
        if (end == text) break;
        targets[count++] = (delmesh_target){DELMESH_TARGET_RATIO, 0, value};
        if (*end != ',') break;
    }
    return count;
}

int main(int argc, char** argv) {
    delmesh_decimate_options options;
    delmesh_decimate_options_init(&options, sizeof options);
    delmesh_target targets[kMostLevels];
    int32_t count = parse_ratios("0.5,0.1,0.02,0", targets);
    int threads = 1, at = 1;
    for (; at + 2 < argc; at += 2) {
        const char *name = argv[at], *value = argv[at + 1];
        if (strcmp(name, "--mode") == 0)
            options.prepare = strcmp(value, "preserve") == 0  ? DELMESH_MODE_PRESERVE
                              : strcmp(value, "feature") == 0 ? DELMESH_MODE_FEATURE
                                                              : DELMESH_MODE_FLIP;
        else if (strcmp(name, "--precision") == 0)
            options.precision = strcmp(value, "f64") == 0 ? DELMESH_FLOAT64 : DELMESH_FLOAT32;
        else if (strcmp(name, "--quality") == 0)
            options.quality = atoi(value);
        else if (strcmp(name, "--threads") == 0)
            threads = atoi(value);
        else if (strcmp(name, "--ratios") == 0)
            count = parse_ratios(value, targets);
        else
            break;
    }
    if (at + 1 != argc) {
        fprintf(stderr, "usage: level_check [--mode M] [--precision P] [--quality N] [--threads N] [--ratios R,R,...] FILE\n");
        return 2;
    }
    Failure failure = {NULL, ""};
    MeshFile file;
    if (!mesh_file_read(argv[at], true, &file, &failure)) {
        fprintf(stderr, "%s\n", failure.text);
        return 2;
    }
    const int status = run(&file, &options, threads, targets, count);
    mesh_file_free(&file);
    return status;
}
