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
    uint16_t* corner_bits;
    int32_t* vert_corner;
    int32_t* face_src;
    int32_t* slots; /* corner and next of each slot */
    int32_t* vert_root;
    int32_t* copy_of;
    int32_t* carriers; /* a and b of each */
    int32_t* carrier_splits;
    int32_t* pins; /* per split vertex */
    int64_t corners, twins, bits, vert_corners, face_srcs, slot_count, roots, copies, carrier_count, dead_faces, vertices_in_use,
        pin_count;
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

void shim_surface_unsplit(shim_surface* surface, int32_t corner);
void shim_surface_begin_trial(shim_surface* surface);
void shim_surface_keep_trial(shim_surface* surface);
void shim_surface_undo_trial(shim_surface* surface);

/* Numbers for what a part adds: vertices [from[0], to[0]), faces [from[1], to[1]), carriers [from[2], to[2]). */
typedef struct shim_share {
    int32_t from[3], to[3];
} shim_share;
shim_share shim_surface_grow_blank(shim_surface* whole, int32_t verts, int32_t faces, int32_t carriers);
/* A part without numbers: freed before the whole. */
shim_surface* shim_surface_part(shim_surface* whole, uint8_t number);
/* Shows the part the whole's arrays as they are now, and gives it numbers (share: NULL for none). owner: per vertex, stays. */
void shim_surface_supply(shim_surface* part, shim_surface* whole, const shim_share* share, const uint8_t* owner);
void shim_surface_take_back(shim_surface* whole, shim_surface* part);
int32_t shim_surface_may_edit(const shim_surface* surface, int32_t corner);
int32_t shim_surface_has_room(const shim_surface* surface);

#ifdef __cplusplus
}
#endif

#endif
