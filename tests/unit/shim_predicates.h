/* SPDX-License-Identifier: Apache-2.0 */
/* The predicates of geom/ for a C test: single calls, and campaigns against a second implementation in GMP. */
#ifndef SHIM_PREDICATES_H
#define SHIM_PREDICATES_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Points are x, y, z in a row. */
int shim_edge_is_nld(const double a[3], const double b[3], const double p[3], const double q[3]);
int shim_edge_needs_exact(const double a[3], const double b[3], const double p[3], const double q[3]);
int shim_boundary_edge_is_nld(const double a[3], const double b[3], const double p[3]);
int shim_zero_area(const double a[3], const double b[3], const double c[3]);
int shim_orientation(const double a[3], const double b[3], const double c[3], const double d[3]);
int shim_flat_edge(const double a[3], const double b[3], const double p[3], const double q[3]);
int shim_normals_dot_sign(const double a[3], const double b[3], const double c[3], const double d[3], const double e[3],
                          const double f[3]);

typedef struct shim_campaign {
    int64_t cases;       /* sets of four points */
    int64_t checks;      /* answers compared with the exact ones */
    int64_t wrong;       /* of these */
    int64_t nld;         /* cases whose interior edge is NLD */
    int64_t ties;        /* cases where s1 d2 + s2 d1 is exactly 0 */
    int64_t near_ties;   /* others with |s1 d2 + s2 d1| < 1e-12 times the larger term */
    int64_t right;       /* cases with an angle of exactly 90 degrees at p */
    int64_t flat;        /* cases that flat_edge holds for */
    int64_t zero_areas;  /* cases where (a, b, p) has no area */
    int64_t exact_calls; /* what edge_is_nld counted */
    char first_wrong[640];
} shim_campaign;

/* The families of cases are numbered from 0; the first shim_random_families() of them are random, the others degenerate. */
int32_t shim_families(void);
int32_t shim_random_families(void);
const char* shim_family_name(int32_t family);
shim_campaign shim_run_campaign(int32_t family, uint64_t seed, int64_t cases);

#ifdef __cplusplus
}
#endif

#endif
