/* SPDX-License-Identifier: Apache-2.0 */
/* A Surface under a DeviationGuard, for tests in C, on the meshes of shim_build.h. */
#ifndef SHIM_DEVIATION_H
#define SHIM_DEVIATION_H

#include "shim_build.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct shim_guarded shim_guarded;

/* A copy of a mesh that was made without errors and outlives it. precision: DELMESH_FLOAT32 or _FLOAT64, of the copy. */
shim_guarded* shim_guarded_make(shim_mesh* mesh, int32_t precision);
void shim_guarded_free(shim_guarded* guarded);
/* 1: within the limit; 0: not proven; negative: the status. */
int32_t shim_guarded_begin(shim_guarded* guarded, double limit);

/* Moves without asking: only before begin. */
void shim_guarded_move(shim_guarded* guarded, int32_t vert, double x, double y, double z);
/* 1: done; 0: the guard refused, and all is as before; -1: not legal. */
int32_t shim_guarded_collapse(shim_guarded* guarded, int32_t corner, double x, double y, double z);
int32_t shim_guarded_flip(shim_guarded* guarded, int32_t corner);
int32_t shim_guarded_is_beyond(const shim_guarded* guarded, int32_t near_face, double x, double y, double z);

int32_t shim_guarded_corners(const shim_guarded* guarded);
int32_t shim_guarded_vert(const shim_guarded* guarded, int32_t corner); /* -1: of a dead face */
void shim_guarded_at(const shim_guarded* guarded, int32_t vert, double* xyz);
int64_t shim_guarded_faces(const shim_guarded* guarded); /* that are alive */
/* What measure_distance says of the input and the surface as it is. absolute: in percent of the diagonal. */
int32_t shim_guarded_measure(shim_guarded* guarded, double absolute, delmesh_distance_report* report);

#ifdef __cplusplus
}
#endif

#endif
