/* SPDX-License-Identifier: Apache-2.0 */
/* Generated meshes for the unit tests: plain arrays, the same on every machine (no libm beyond sqrt, own random numbers). */
#ifndef MESH_MAKERS_H
#define MESH_MAKERS_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "delmesh/delmesh.h"

#define COUNT(array) ((int64_t)(sizeof(array) / sizeof(*(array))))

typedef struct soup {
    double* points;   /* 3 per vertex, all of them float32 numbers */
    int32_t* corners; /* 3 per face */
    int32_t vertices, faces;
} soup;

/* Knuth's 64-bit linear congruential generator; its upper half is good enough to choose with. */
static inline uint32_t random_bits(uint64_t* state) {
    *state = *state * 6364136223846793005ull + 1442695040888963407ull;
    return (uint32_t)(*state >> 32);
}
static inline int32_t random_below(uint64_t* state, int32_t n) {
    return (int32_t)((uint64_t)random_bits(state) * (uint64_t)n >> 32);
}
static inline double random_unit(uint64_t* state) { /* -1 to 1 */
    return (double)random_bits(state) / 2147483648.0 - 1;
}

static inline soup soup_of(int32_t vertices, int32_t faces) {
    const soup s = {(double*)calloc((size_t)vertices * 3, sizeof(double)), (int32_t*)calloc((size_t)faces * 3, sizeof(int32_t)),
                    vertices, faces};
    return s;
}
static inline void free_soup(soup* s) {
    free(s->points);
    free(s->corners);
}
static inline void set_point(soup* s, int32_t v, double x, double y, double z) {
    const double xyz[3] = {x, y, z};
    for (int k = 0; k < 3; ++k) {
        const volatile float rounded = (float)xyz[k]; /* GCC 12.2 at -O2 forgets to round neighbours without the volatile */
        s->points[3 * v + k] = (double)rounded;
    }
}
static inline void set_face(soup* s, int32_t f, int32_t a, int32_t b, int32_t c) {
    s->corners[3 * f] = a;
    s->corners[3 * f + 1] = b;
    s->corners[3 * f + 2] = c;
}
static inline soup copy_of_soup(const soup* s) {
    soup copy = soup_of(s->vertices, s->faces);
    memcpy(copy.points, s->points, (size_t)s->vertices * 3 * sizeof(double));
    memcpy(copy.corners, s->corners, (size_t)s->faces * 3 * sizeof(int32_t));
    return copy;
}

/* A point of the unit circle, by rational parametrisation: k of n, not evenly spaced but all the way round. */
static inline void circle(int32_t k, int32_t n, double* x, double* y) {
    const double quarter = 4.0 * k / n;
    const int32_t turn = (int32_t)quarter;
    const double t = quarter - turn, c = (1 - t * t) / (1 + t * t), s = 2 * t / (1 + t * t);
    *x = turn == 0 ? c : turn == 1 ? -s : turn == 2 ? -c : s;
    *y = turn == 0 ? s : turn == 1 ? c : turn == 2 ? -s : -c;
}

/* nu x nv quads, each cut along one diagonal. noise: of the radii. */
static inline soup torus(int32_t nu, int32_t nv, double noise, uint64_t seed) {
    soup s = soup_of(nu * nv, 2 * nu * nv);
    for (int32_t i = 0; i < nu; ++i)
        for (int32_t j = 0; j < nv; ++j) {
            double cu, su, cv, sv;
            circle(i, nu, &cu, &su);
            circle(j, nv, &cv, &sv);
            const double r = 1 + noise * random_unit(&seed), ring = 3 + r * cv + noise * random_unit(&seed);
            set_point(&s, i * nv + j, ring * cu, ring * su, r * sv);
            const int32_t a = i * nv + j, b = (i + 1) % nu * nv + j, c = (i + 1) % nu * nv + (j + 1) % nv,
                          d = i * nv + (j + 1) % nv;
            set_face(&s, 2 * a, a, b, c);
            set_face(&s, 2 * a + 1, a, c, d);
        }
    return s;
}

/* A sheet of nx x ny quads, `stretch` times as wide as high; noise: in all directions, of a quad's height. */
static inline soup sheet(int32_t nx, int32_t ny, double stretch, double noise, uint64_t seed) {
    soup s = soup_of((nx + 1) * (ny + 1), 2 * nx * ny);
    for (int32_t i = 0; i <= nx; ++i)
        for (int32_t j = 0; j <= ny; ++j) {
            const double dx = random_unit(&seed), dy = random_unit(&seed), dz = random_unit(&seed);
            set_point(&s, i * (ny + 1) + j, stretch * (i + noise * dx), j + noise * dy, noise * dz);
        }
    for (int32_t i = 0; i < nx; ++i)
        for (int32_t j = 0; j < ny; ++j) {
            const int32_t a = i * (ny + 1) + j, b = a + ny + 1, f = 2 * (i * ny + j);
            set_face(&s, f, a, b, b + 1);
            set_face(&s, f + 1, a, b + 1, a + 1);
        }
    return s;
}

/* Spokes of random length around a hub: needles and wide angles. */
static inline soup fan(int32_t spokes, uint64_t seed) {
    soup s = soup_of(spokes + 1, spokes);
    set_point(&s, 0, 0, 0, 0.25);
    for (int32_t i = 0; i < spokes; ++i) {
        double x, y;
        circle(i, spokes, &x, &y);
        const double r = 1 + 0.8 * random_unit(&seed);
        set_point(&s, i + 1, r * x, r * y, 0.1 * random_unit(&seed));
        set_face(&s, i, 0, i + 1, (i + 1) % spokes + 1);
    }
    return s;
}

/* `pages` sheets of n x n quads that share the column of vertices 0 .. n. Every other page is turned over. */
static inline soup book(int32_t pages, int32_t n, double noise, uint64_t seed) {
    soup s = soup_of((n + 1) * (1 + pages * n), 2 * pages * n * n);
    for (int32_t j = 0; j <= n; ++j) set_point(&s, j, 0, j, 0);
    int32_t f = 0;
    for (int32_t page = 0; page < pages; ++page) {
        const int32_t first = (n + 1) * (1 + page * n);
        double cx, cz;
        circle(page, pages, &cx, &cz);
        for (int32_t i = 0; i < n; ++i)
            for (int32_t j = 0; j <= n; ++j) {
                const double out = i + 1 + noise * random_unit(&seed), up = j + noise * random_unit(&seed);
                set_point(&s, first + i * (n + 1) + j, out * cx, up, out * cz);
            }
        for (int32_t i = 0; i < n; ++i)
            for (int32_t j = 0; j < n; ++j) {
                const int32_t a = i == 0 ? j : first + (i - 1) * (n + 1) + j, b = first + i * (n + 1) + j;
                const int32_t c = page % 2 == 0 ? a : b, d = page % 2 == 0 ? b : a;
                set_face(&s, f++, c, d, b + 1);
                set_face(&s, f++, a + 1, page % 2 == 0 ? a : b + 1, page % 2 == 0 ? b + 1 : a);
            }
    }
    return s;
}

static inline delmesh_view view_of(const void* data, int64_t count, int32_t type, int32_t components) {
    const delmesh_view v = {data, count, 0, type, components};
    return v;
}
static inline delmesh_mesh_desc desc_of(const double* points, int64_t vertices, const int32_t* corners, int64_t corner_count) {
    delmesh_mesh_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.positions = view_of(points, vertices, DELMESH_FLOAT64, 3);
    desc.corner_verts = view_of(corners, corner_count, DELMESH_INT32, 1);
    return desc;
}
static inline delmesh_mesh_desc desc_of_soup(const soup* s) {
    return desc_of(s->points, s->vertices, s->corners, 3 * (int64_t)s->faces);
}

#endif
