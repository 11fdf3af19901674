/* SPDX-License-Identifier: Apache-2.0 */
/* What test_measure.c sees of the measuring code: meshes as plain arrays, calls with everything that may go wrong in them. */
#ifndef DELMESH_TESTS_SHIM_MEASURE_H
#define DELMESH_TESTS_SHIM_MEASURE_H

#include <stdint.h>

#include "delmesh/delmesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    const double* positions; /* 3 per vertex; float32 holds them when f32 is set */
    int32_t vertices;
    const int32_t* corners; /* 3 per face */
    int32_t faces;
    int32_t f32;
} shim_mesh;

typedef struct {
    int32_t threads;            /* 0: the run below counts parallel loops on a host's parallel_for */
    uint64_t allocation_limit;  /* 0: none */
    int64_t cancel_at_progress; /* the callback's k-th call cancels; 0: never */
    int64_t cancel_at_loop;     /* a cancel from outside in the k-th parallel loop; needs threads = 0 */
    /* out */
    int64_t progress_calls, loops;
    double last_fraction;
    int32_t progress_went_back;
    int64_t leaked_bytes;
    char error[512];
} shim_run;

int32_t shim_measure_quality(const shim_mesh* mesh, shim_run* run, delmesh_quality_report* report);
int32_t shim_measure_distance(const shim_mesh* a, const shim_mesh* b, const delmesh_distance_options* options, shim_run* run,
                              delmesh_distance_report* report);

/* Of `count` points: how often the hierarchy's closest distance differs from that of all triangles tried one by one.
 * -1: there was no hierarchy. */
int32_t shim_closest_mismatches(const shim_mesh* mesh, const double* points, int32_t count);
double shim_triangle_distance(const double* point, const double* triangle);

#ifdef __cplusplus
}
#endif

#endif
