/* SPDX-License-Identifier: Apache-2.0 */
/* The decimation engine for tests in C: its quadrics, its queue, its order in space, and the Decimator on a Surface of its own. */
#ifndef SHIM_DECIMATOR_H
#define SHIM_DECIMATOR_H

#include "shim_remesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* -- geom/quadric.h */
typedef struct shim_quadric {
    double xx, xy, xz, yy, yz, zz, bx, by, bz, c;
} shim_quadric;
shim_quadric shim_quadric_of_plane(const double normal[3], const double point[3], double weight);
shim_quadric shim_quadric_sum(const shim_quadric* a, const shim_quadric* b);
shim_quadric shim_quadric_scaled(const shim_quadric* a, double by);
double shim_quadric_at(const shim_quadric* q, const double point[3]);
int32_t shim_quadric_least(const shim_quadric* q, const double near[3], double stiffness, double out[3]);

/* -- algo/bucket_queue.h, of numbers */
typedef struct shim_queue shim_queue;
shim_queue* shim_queue_make(void);
void shim_queue_free(shim_queue* queue);
int32_t shim_queue_bucket(double priority);
double shim_queue_end_of(int32_t bucket);
void shim_queue_push(shim_queue* queue, double priority, int32_t value);
void shim_queue_push_to(shim_queue* queue, int32_t bucket, int32_t value);
int32_t shim_queue_pop(shim_queue* queue, int32_t* bucket, int32_t* values, int32_t most);
int64_t shim_queue_size(const shim_queue* queue);
uint64_t shim_queue_bytes(const shim_queue* queue);

/* -- mesh/spatial_order.h: the four permutations are the caller's arrays, of the mesh's vertices and faces */
shim_mesh* shim_sort_in_space(shim_mesh* in, int32_t* old_vert, int32_t* new_vert, int32_t* old_face, int32_t* new_face);

/* -- algo/decimator.h */
typedef struct shim_decimation_rules {
    int32_t precision, boundary_rule, optimum, region, ends, middle, flips;
    double fold_cosine, boundary_weight, flip_weight, slack;
} shim_decimation_rules;
typedef struct shim_decimator shim_decimator;
typedef struct shim_decimation {
    int64_t vertices_left, faces_left, collapses, flips, undone, postponed;
    int32_t stopped_by, vertices, corners;
    double cost;
    const int32_t *merged_into, *next_merged, *last_merged, *place_of; /* per vertex */
    const double* pos;                                                 /* 3 per vertex */
    const int32_t *corner_vert, *corner_twin, *vert_corner;
    const uint16_t* corner_bits;
} shim_decimation;

shim_decimation_rules shim_decimation_defaults(void);
/* On a copy of a Delaunay mesh. weights, locked: NULL, or per vertex. */
shim_decimator* shim_decimator_make(const shim_mesh* mesh, const shim_decimation_rules* rules, const double* weights,
                                    const uint8_t* locked);
void shim_decimator_free(shim_decimator* decimator);
/* What Decimator::run returned. It is cancelled once more than so many attempts were postponed, so that no test hangs. */
int32_t shim_decimator_run(shim_decimator* decimator, int64_t most_vertices, int64_t most_faces, int64_t most_postponed);
int32_t shim_decimator_prune(shim_decimator* decimator, double diagonal, int64_t* pruned);
shim_decimation shim_decimator_state(const shim_decimator* decimator);
int32_t shim_decimator_valid(const shim_decimator* decimator);              /* Surface::valid */
int32_t shim_decimator_kind(const shim_decimator* decimator, int32_t vert); /* 0 smooth, 1 crease, 2 corner */
/* What is left, as a mesh with a context of its own: vertices and faces in the order of their numbers. */
shim_mesh* shim_decimator_level(const shim_decimator* decimator);

#ifdef __cplusplus
}
#endif

#endif
