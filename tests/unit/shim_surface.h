/* SPDX-License-Identifier: Apache-2.0 */
/* The editable surface for tests in C: its edits one by one, and its arrays laid open. */
#ifndef SHIM_SURFACE_H
#define SHIM_SURFACE_H

#include "shim_build.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct shim_surface shim_surface;

/* The surface's own arrays, as they are until the next edit. Writable, so that a test can break them or set bits. */
typedef struct shim_table {
    double* pos; /* 3 per vertex */
    int32_t* corner_vert;
    int32_t* corner_twin;
    uint8_t* corner_bits;
    int32_t* vert_corner;
    int32_t* face_src;
    int32_t* slots; /* corner and next of each slot */
    int32_t* vert_root;
    int32_t* copy_of;
    int32_t* carriers; /* a and b of each */
    int64_t corners, twins, bits, vert_corners, face_srcs, slot_count, roots, copies, carrier_count, dead_faces;
    int32_t vertices, first_copy, first_split;
} shim_table;

/* Of a mesh that was made without errors and outlives it. precision: DELMESH_FLOAT32 or _FLOAT64. */
shim_surface* shim_surface_make(shim_mesh* mesh, int32_t precision);
void shim_surface_free(shim_surface* surface);
shim_table shim_surface_table(shim_surface* surface);
int32_t shim_surface_valid(const shim_surface* surface);
int32_t shim_surface_valid_traps(void); /* 1: on a broken table shim_surface_valid does not return (debug checks) */
int32_t shim_surface_adjacent(const shim_surface* surface, int32_t a, int32_t b);
int32_t shim_surface_has_face(const shim_surface* surface, int32_t a, int32_t b, int32_t c);
int32_t shim_surface_on_one_carrier(const shim_surface* surface, int32_t a, int32_t b, int32_t c);

void shim_surface_flip(shim_surface* surface, int32_t corner);
/* Adds a vertex at the middle and splits this corner's edge there. Returns the corner that split() returns. */
int32_t shim_surface_split(shim_surface* surface, int32_t corner);
/* At t along the edge, 0 to 1, on its carrier and all its copies. Returns how many pieces; the first `most` are written. */
int32_t shim_surface_split_everywhere(shim_surface* surface, int32_t corner, double t, int32_t* pieces, int32_t most);
double shim_surface_split_parameter(const shim_surface* surface, int32_t vert, int32_t* carrier); /* of a split vertex */
int32_t shim_surface_collapse_is_legal(const shim_surface* surface, int32_t corner);
void shim_surface_collapse(shim_surface* surface, int32_t corner);
int32_t shim_surface_collapse_and_cut(shim_surface* surface, int32_t corner);
void shim_surface_remove_boundary_face(shim_surface* surface, int32_t corner);

#ifdef __cplusplus
}
#endif

#endif
