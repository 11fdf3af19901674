/* SPDX-License-Identifier: Apache-2.0 */
/* estimate_preserve() with a sample of the test's choice. */
#ifndef SHIM_ESTIMATE_H
#define SHIM_ESTIMATE_H

#include "shim_build.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct shim_sample {
    int32_t whole_up_to, cells, edges_per_cell, rings; /* see algo/estimate.h */
} shim_sample;

/* context_options: NULL for the defaults. error: of 512 characters. */
int32_t shim_estimate(const shim_mesh* in, const delmesh_context_options* context_options, const delmesh_remesh_options* options,
                      const shim_sample* sample, delmesh_preserve_estimate* out, char* error);
int32_t shim_preserve(const shim_mesh* in, const delmesh_remesh_options* options, delmesh_remesh_report* report);

#ifdef __cplusplus
}
#endif

#endif
