/* SPDX-License-Identifier: Apache-2.0 */
/* remesh() and certify_mesh() for tests in C, on the meshes of shim_build.h. */
#ifndef SHIM_REMESH_H
#define SHIM_REMESH_H

#include "shim_build.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A new mesh with a context of its own, never NULL but for want of memory; its status is what remesh() returned. */
shim_mesh* shim_remesh(const shim_mesh* in, const delmesh_remesh_options* options, int32_t threads,
                       delmesh_remesh_report* report);

/* The same in two steps: an empty mesh, with a context of its own, and the call. The callbacks are the options'. */
shim_mesh* shim_mesh_blank(const delmesh_context_options* options);
void shim_remesh_into(shim_mesh* out, const shim_mesh* in, const delmesh_remesh_options* options, delmesh_remesh_report* report);
void shim_mesh_cancel(shim_mesh* mesh); /* what delmesh_cancel does */

/* Where a vertex lies on the source. 1 for a vertex made by a split. */
int32_t shim_vertex_map(const shim_mesh* mesh, int32_t vert, int32_t verts[3], double weights[3]);

typedef struct shim_certificate {
    int64_t nld_interior, nld_boundary, zero_area_faces;
    int32_t first_zero_face, delaunay;
    int64_t listed_edges, listed_faces; /* how long the lists were; 0 when they were not asked for */
    int32_t in_order;                   /* 1: ascending, and the first edge is the one named without a list */
    uint64_t listed_sum;                /* over which edges and faces they name */
} shim_certificate;

/* boundary_rule: are boundary edges opposite to an obtuse angle offences? lists: ask for them. */
shim_certificate shim_certify(shim_mesh* mesh, int32_t boundary_rule, int32_t lists);
/* The same by asking the exact predicates about every edge and face, one after the other, from its first corner. */
shim_certificate shim_scan_all(const shim_mesh* mesh, int32_t boundary_rule);

#ifdef __cplusplus
}
#endif

#endif
