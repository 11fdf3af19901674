/* SPDX-License-Identifier: Apache-2.0 */
/* build_mesh and validate_mesh for tests in C: a Mesh with its own context, and its arrays laid open. */
#ifndef SHIM_BUILD_H
#define SHIM_BUILD_H

#include "delmesh/delmesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct shim_mesh shim_mesh;

/* The mesh's own arrays, writable so that a test can break them. Sizes in elements; those of empty arrays are 0. */
typedef struct shim_arrays {
    float* pos32;
    double* pos64;
    int32_t* corner_vert;
    int32_t* corner_twin;
    uint16_t* corner_bits;
    int32_t* slots; /* corner and next of each slot */
    int32_t* face_source;
    int32_t* vert_source;
    int32_t* vert_join;
    int64_t pos32_size, pos64_size, corners, corner_twin_size, corner_bits_size, slot_count, face_source_size, vert_source_size,
        vert_join_size;
    int32_t vertices, first_split;
} shim_arrays;

/* Never NULL but for want of memory. options: NULL for the defaults. cancel: 1 asks for it before the work starts. */
shim_mesh* shim_mesh_make(const delmesh_context_options* options, const delmesh_mesh_desc* desc, int32_t cancel);
int32_t shim_mesh_status(const shim_mesh* mesh);
const char* shim_mesh_error(const shim_mesh* mesh);
uint64_t shim_mesh_peak(const shim_mesh* mesh); /* bytes, while it was made */
delmesh_mesh_info shim_mesh_info(const shim_mesh* mesh);
shim_arrays shim_mesh_arrays(shim_mesh* mesh);
int32_t shim_mesh_validate(shim_mesh* mesh); /* sets the error text too */
void shim_mesh_free(shim_mesh* mesh);

/* What validate must notice: fields that no array holds. */
enum { SHIM_VERTEX_COUNT, SHIM_FIRST_SPLIT, SHIM_PRECISION };
void shim_mesh_set(shim_mesh* mesh, int32_t field, int32_t value);
/* Drops the last element of an array: 0 pos32, 1 corner_vert, 2 corner_twin, 3 corner_bits, 4 slots, 5 face_source,
 * 6 vert_source, 7 vert_join. */
void shim_mesh_shorten(shim_mesh* mesh, int32_t array);
/* vert_parent becomes `count` numbers: 0, 0, ... and last `parent`. */
void shim_mesh_set_parents(shim_mesh* mesh, int32_t count, int32_t parent);
/* One number of the maps: element i of the field becomes `value`. Fields that are empty get all their elements first: */
enum {
    SHIM_SOURCE_CORNERS,  /* (i is not looked at) */
    SHIM_SOURCE_EDGES,    /* (nor here) */
    SHIM_CORNER_MAP,
    SHIM_PLACE_CORNER,    /* two places on corners 0 1 2 with weights 0.5 0.5 0 */
    SHIM_PLACE_WEIGHT,    /* the same; i counts through both */
    SHIM_EDGE_SOURCE,     /* the identity */
    SHIM_LAYER_KIND,      /* one UV layer with two components, all values 0 */
    SHIM_LAYER_COMPONENTS,
    SHIM_LAYER_FIRST,
    SHIM_HAS_MAP
};
void shim_mesh_set_map(shim_mesh* mesh, int32_t field, int64_t i, double value);
/* Declares the last vertex a split vertex on (vert, vert, vert) with these weights. */
void shim_mesh_set_split(shim_mesh* mesh, int32_t vert, double weight0, double weight1, double weight2);

/* Sets bits of the edge p q, on both corners. */
void shim_set_edge_bits(shim_mesh* mesh, int32_t p, int32_t q, uint16_t bits);

#ifdef __cplusplus
}
#endif

#endif
