/* SPDX-License-Identifier: Apache-2.0 */
#include "subdivide.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double kNoise = 0.05; /* of the edge's length, in each coordinate */

typedef struct EdgeTable {
    uint64_t mask;
    uint64_t* keys; /* smaller vertex in the upper half; an edge of a vertex with itself, 0 included, has a slot as well */
    int32_t* verts; /* the vertex in the middle; -1: free slot */
} EdgeTable;

static uint64_t scramble(uint64_t x) {
    x ^= x >> 31;
    x *= 0x9e3779b97f4a7c15u;
    x ^= x >> 29;
    x *= 0xbf58476d1ce4e5b9u;
    return x ^ x >> 32;
}

static double get(const MeshFile* mesh, const void* positions, int64_t at) {
    return mesh->precision == DELMESH_FLOAT32 ? (double)((const float*)positions)[at] : ((const double*)positions)[at];
}

static void set(const MeshFile* mesh, void* positions, int64_t at, double value) {
    if (mesh->precision == DELMESH_FLOAT32)
        ((float*)positions)[at] = (float)value;
    else
        ((double*)positions)[at] = value;
}

static bool cut_fans(MeshFile* mesh) {
    if (mesh->face_sizes == NULL) return true;
    int64_t triangles = 0, begin = 0, at = 0;
    for (int64_t f = 0; f < mesh->face_count; ++f) triangles += mesh->face_sizes[f] > 2 ? mesh->face_sizes[f] - 2 : 0;
    int32_t* corners = malloc((size_t)(3 * triangles) * sizeof *corners + 1);
    if (corners == NULL) return false;
    for (int64_t f = 0; f < mesh->face_count; begin += mesh->face_sizes[f++])
        for (int32_t k = 2; k < mesh->face_sizes[f]; ++k) {
            corners[at++] = mesh->corner_verts[begin];
            corners[at++] = mesh->corner_verts[begin + k - 1];
            corners[at++] = mesh->corner_verts[begin + k];
        }
    free(mesh->corner_verts);
    free(mesh->face_sizes);
    mesh->corner_verts = corners;
    mesh->face_sizes = NULL;
    mesh->face_count = triangles;
    mesh->corner_count = 3 * triangles;
    return true;
}

/* The vertex in the middle of (a, b): the known one, or *count, which then grows. */
static int32_t middle(EdgeTable* table, int32_t a, int32_t b, int64_t* count) {
    const uint64_t key = a < b ? (uint64_t)a << 32 | (uint64_t)b : (uint64_t)b << 32 | (uint64_t)a;
    uint64_t slot = scramble(key) & table->mask;
    while (table->verts[slot] >= 0 && table->keys[slot] != key) slot = (slot + 1) & table->mask;
    if (table->verts[slot] < 0) {
        table->keys[slot] = key;
        table->verts[slot] = (int32_t)(*count)++;
    }
    return table->verts[slot];
}

static void place(const MeshFile* mesh, void* positions, int32_t a, int32_t b, int32_t m) {
    double pa[3], pb[3], length = 0;
    for (int k = 0; k < 3; ++k) {
        pa[k] = get(mesh, positions, 3 * (int64_t)a + k);
        pb[k] = get(mesh, positions, 3 * (int64_t)b + k);
        length += (pb[k] - pa[k]) * (pb[k] - pa[k]);
    }
    length = sqrt(length);
    for (int k = 0; k < 3; ++k) {
        const double random = (double)(scramble(3 * (uint64_t)m + (uint64_t)k + 1) >> 11) * 0x1p-52 - 1; /* -1 to 1 */
        set(mesh, positions, 3 * (int64_t)m + k, pa[k] + 0.5 * (pb[k] - pa[k]) + kNoise * length * random);
    }
}

bool subdivide(MeshFile* mesh) {
    if (!cut_fans(mesh) || mesh->vertex_count + mesh->corner_count > INT32_MAX || 4 * mesh->corner_count > INT32_MAX)
        return false;
    EdgeTable table = {1, NULL, NULL};
    while (table.mask < 2 * (uint64_t)mesh->corner_count) table.mask *= 2;
    table.keys = malloc(table.mask * sizeof *table.keys);
    table.verts = malloc(table.mask * sizeof *table.verts);
    int32_t* corners = malloc((size_t)(4 * mesh->corner_count) * sizeof *corners + 1);
    void* positions = NULL;
    bool ok = table.keys != NULL && table.verts != NULL && corners != NULL;
    if (ok) {
        for (uint64_t i = 0; i < table.mask; ++i) table.verts[i] = -1;
        --table.mask;
        int64_t count = mesh->vertex_count;
        for (int64_t f = 0; f < mesh->face_count; ++f) {
            const int32_t* v = mesh->corner_verts + 3 * f;
            int32_t m[3];
            for (int k = 0; k < 3; ++k) m[k] = middle(&table, v[k], v[(k + 1) % 3], &count);
            const int32_t four[12] = {v[0], m[0], m[2], m[0], v[1], m[1], m[2], m[1], v[2], m[0], m[1], m[2]};
            for (int k = 0; k < 12; ++k) corners[12 * f + k] = four[k];
        }
        const size_t size = mesh->precision == DELMESH_FLOAT32 ? sizeof(float) : sizeof(double);
        positions = realloc(mesh->positions, (size_t)(3 * count) * size + 1);
        ok = positions != NULL;
        if (ok) {
            mesh->positions = positions;
            for (uint64_t i = 0; i <= table.mask; ++i)
                if (table.verts[i] >= 0)
                    place(mesh, positions, (int32_t)(table.keys[i] >> 32), (int32_t)(table.keys[i] & 0xffffffffu),
                          table.verts[i]);
            free(mesh->corner_verts);
            mesh->corner_verts = corners;
            corners = NULL;
            mesh->vertex_count = count;
            mesh->face_count *= 4;
            mesh->corner_count *= 4;
        }
    }
    free(corners);
    free(table.verts);
    free(table.keys);
    return ok;
}

bool read_subdivided(const char* path, int steps, MeshFile* mesh) {
    Failure failure = {NULL, ""};
    if (!mesh_file_read(path, true, mesh, &failure)) {
        fprintf(stderr, "%s\n", failure.text);
        return false;
    }
    for (int i = 0; i < steps; ++i) {
        if (subdivide(mesh)) continue;
        fprintf(stderr, "%s: no memory to subdivide, or too big\n", path);
        mesh_file_free(mesh);
        return false;
    }
    return true;
}
