/* SPDX-License-Identifier: Apache-2.0
 *
 * cage.h: a file as a cage, subdivided before anything else is done with it (docs/subdivide.md).
 */
#ifndef DELMESH_CLI_CAGE_H
#define DELMESH_CLI_CAGE_H

#include "carry.h"

typedef struct CageOptions {
    int32_t scheme, boundary, face_varying, evaluation, precision;
    const char* creases_path; /* NULL: none */
    bool normals;             /* the limit surface's go into the result */
    int32_t fineness;         /* DELMESH_FINENESS_*; -1: the file is no cage */
    double value;
    bool measure; /* also how far the mesh is from the limit surface */
} CageOptions;

/* But for how fine, which commands spell differently. `boundary_name`: "--boundary" may mean something else there. */
#define CAGE_OPTIONS(cage, boundary_name)                                                                                        \
    option_choice("--scheme", &(cage)->scheme, kSchemeChoices, "catmull-clark|loop|bilinear", "of subdivision (catmull-clark)"), \
        option_choice(boundary_name, &(cage)->boundary, kCageBoundaryChoices, "edge-and-corner|edge|none",                       \
                      "what is sharp where the cage ends (edge-and-corner)"),                                                    \
        option_choice("--fvar", &(cage)->face_varying, kFaceVaryingChoices, "boundaries|none|corners|plus1|plus2|all",           \
                      "where UVs are linear, not smooth (boundaries)"),                                                          \
        option_string("--creases", &(cage)->creases_path, "FILE", "more: crease V V SHARPNESS, corner V SHARPNESS, hole FACE"),  \
        option_flag("--normals", &(cage)->normals, "write the limit surface's normals")
extern const Choice kSchemeChoices[];
extern const Choice kCageBoundaryChoices[];
extern const Choice kFaceVaryingChoices[];

/* A cage made of a file, and its numbers of the file's layers. */
typedef struct Cage {
    delmesh_cage* handle; /* NULL: there is none */
    int32_t* layer_of;    /* per layer of the file: its number in the cage; -1: the cage has not got it */
    delmesh_subdivide_report report;
    bool normals;
} Cage;

void cage_options_init(CageOptions* options);
/* Makes the cage of the file and its mesh. Returns a status of the library, of which the sentence is in its context; or DELMESH_OK
 * with *failure. */
int32_t cage_subdivide(const CageOptions* options, const Carry* carry, delmesh_context* context, MeshFile* file, Cage* out,
                       delmesh_mesh** mesh, Failure* failure);
void cage_free(Cage* cage);

/* Fills `to` with the layer at the places of a mesh that comes from the cage; *carried: that can be done. */
int32_t cage_carry_layer(const Cage* cage, delmesh_context* context, const delmesh_mesh* mesh, int32_t index, const Layer* from,
                         Layer* to, bool* carried, Failure* failure);

/* The normals that the result is to have, also where the file has none: adds them to `out`. As cage_carry_layer. */
int32_t cage_add_normals(const Cage* cage, delmesh_context* context, const delmesh_mesh* mesh, MeshFile* out, Failure* failure);

#endif
