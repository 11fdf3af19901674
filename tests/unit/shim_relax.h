/* SPDX-License-Identifier: Apache-2.0 */
/* relax() for tests in C, on the meshes of shim_build.h. */
#ifndef SHIM_RELAX_H
#define SHIM_RELAX_H

#include "shim_remesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct shim_relax_rules {
    int32_t precision, boundary_rule;
    double fold_cosine;
    int32_t sweeps;
} shim_relax_rules;

shim_relax_rules shim_relax_defaults(void);
/* On the level's own context, with its callbacks; its status is what relax() returned. stays: NULL, or per vertex. Returns how
 * many vertices moved. */
int64_t shim_relax(shim_mesh* level, const shim_mesh* in, const shim_relax_rules* rules, const uint8_t* stays);
delmesh_distance_report shim_distance(shim_mesh* level, const shim_mesh* in);
uint64_t shim_bytes_alive(const shim_mesh* mesh); /* of its context */

#ifdef __cplusplus
}
#endif

#endif
